//! Progress display: a bar on a terminal, one line for each stage otherwise, nothing if quiet.

use crate::cancel;
use indicatif::{ProgressBar, ProgressStyle};
use std::borrow::Cow;
use std::io::IsTerminal;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tetmill::progress::{Observer, Stage};

/// Shows the stages of a run on the standard error.
#[derive(Debug)]
pub struct Terminal {
    bar: Option<ProgressBar>,
    lines: bool,
    /// Tets of the current stage, 0 if it does not count them.
    tets: AtomicU64,
}

/// Length of the bar: a stage in thousandths.
const LENGTH: u64 = 1000;

impl Terminal {
    /// Creates the display; it shows nothing if `quiet`.
    pub fn new(quiet: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let bar = (!quiet && terminal).then(|| {
            let template = "{spinner} {prefix:12} [{bar:30}] {percent:>3} %  {elapsed}  {eta} left  {msg}";
            let style = ProgressStyle::with_template(template).expect("the template is well formed");
            let bar = ProgressBar::new(LENGTH).with_style(style.progress_chars("=> "));
            bar.enable_steady_tick(Duration::from_millis(120));
            bar
        });
        Self { bar, lines: !quiet && !terminal, tets: AtomicU64::new(0) }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

impl Observer for Terminal {
    fn begin(&self, stage: Stage) {
        if let Some(bar) = &self.bar {
            bar.reset();
            bar.set_prefix(stage.name());
            bar.set_message("");
        }
        self.tets.store(0, Ordering::Relaxed);
    }

    fn expect(&self, _: Stage, tets: u64) {
        self.tets.store(tets, Ordering::Relaxed);
    }

    fn advance(&self, _: Stage, fraction: f64) {
        if let Some(bar) = &self.bar {
            bar.set_position((fraction * LENGTH as f64) as u64);
            let tets = fraction * self.tets.load(Ordering::Relaxed) as f64;
            let seconds = bar.elapsed().as_secs_f64();
            if tets > 0.0 && seconds > 0.0 {
                bar.set_message(format!("{:.2} million tets/s", tets / seconds * 1e-6));
            }
        }
    }

    fn end(&self, stage: Stage, seconds: f64) {
        if self.lines {
            eprintln!("{:<12} {seconds:8.2} s", stage.name());
        }
    }

    fn is_cancelled(&self) -> bool {
        cancel::is_cancelled()
    }

    fn note(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| eprintln!("{}", prefixed(text))),
            None if self.lines => eprintln!("{}", prefixed(text)),
            None => {}
        }
    }
}

/// A note with its prefix, except warnings of a geometry, which are those of a compiler:
/// `FILE:LINE:` first, as editors expect.
fn prefixed(text: &str) -> Cow<'_, str> {
    if text.contains(": warning: ") { text.into() } else { format!("note: {text}").into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_have_a_prefix_and_warnings_begin_with_their_place() {
        assert_eq!(prefixed("plate.stl: 3 points in no face"), "note: plate.stl: 3 points in no face");
        let warning = "a.geo:2:5: warning: the unknown flag -mat is ignored";
        assert_eq!(prefixed(warning), warning);
    }
}

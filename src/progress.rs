//! What a user sees while the stages run, and how long each took.

use indicatif::{ProgressBar, ProgressStyle};
use std::cell::RefCell;
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// One finished stage.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Stage {
    /// Its name.
    pub name: String,
    /// Wall-clock seconds.
    pub seconds: f64,
}

/// Shows stages as they run: a bar on a terminal, a line each elsewhere, nothing when quiet.
#[derive(Debug)]
pub struct Progress {
    bar: Option<ProgressBar>,
    lines: bool,
    stages: RefCell<Vec<Stage>>,
}

impl Progress {
    /// Shows on standard error, unless `quiet`. `stages` is how many there will be.
    pub fn new(quiet: bool, stages: u64) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let bar = (!quiet && terminal).then(|| {
            let style = ProgressStyle::with_template("{spinner} [{bar:24}] {pos}/{len} {wide_msg} {elapsed}")
                .expect("the template is well formed")
                .progress_chars("=> ");
            let bar = ProgressBar::new(stages).with_style(style);
            bar.enable_steady_tick(Duration::from_millis(120));
            bar
        });
        Self { bar, lines: !quiet && !terminal, stages: RefCell::default() }
    }

    /// Runs one stage.
    pub fn stage<T>(&self, name: &str, work: impl FnOnce() -> T) -> T {
        if let Some(bar) = &self.bar {
            bar.set_message(name.to_string());
        }
        let start = Instant::now();
        let result = work();
        let seconds = start.elapsed().as_secs_f64();
        if let Some(bar) = &self.bar {
            bar.inc(1);
        }
        if self.lines {
            eprintln!("{name:<12} {seconds:8.2} s");
        }
        let mut stages = self.stages.borrow_mut();
        match stages.iter_mut().find(|stage| stage.name == name) {
            Some(stage) => stage.seconds += seconds,
            None => stages.push(Stage { name: name.into(), seconds }),
        }
        result
    }

    /// Says something that the user should see now.
    pub fn note(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| eprintln!("{text}")),
            None if self.lines => eprintln!("{text}"),
            None => {}
        }
    }

    /// Removes the bar; the times of the stages, each name once.
    pub fn finish(&self) -> Vec<Stage> {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        self.stages.borrow().clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stage_that_runs_twice_is_listed_once() {
        let progress = Progress::new(true, 2);
        assert_eq!(progress.stage("mesh", || 1) + progress.stage("mesh", || 2), 3);
        progress.stage("write", || ());
        let names: Vec<String> = progress.finish().into_iter().map(|s| s.name).collect();
        assert_eq!(names, ["mesh", "write"]);
    }
}

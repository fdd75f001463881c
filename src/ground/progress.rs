//! Progress reports and cancellation of runs.
//!
//! An [`Observer`] receives the current [`Stage`] and its progress, from any thread, and can cancel
//! the run. [`Silent`] does nothing. Stages report through a [`Work`], which limits the number of
//! reports.

use crate::ground::memory;
use std::cell::RefCell;
use std::fmt;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::time::Instant;

/// The stages of all runs. A run has some of them, some several times.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Reading a geometry, a surface or a mesh, and finding the features of a geometry.
    Read,
    /// Merging small faces and edges of a CAD file.
    Merge,
    /// Making the coarse mesh.
    Mesh,
    /// Choosing planes through the geometry, and cutting it.
    Cut,
    /// Meshing the surface of the pieces of a cut geometry.
    Surface,
    /// Assigning tets to parts.
    Partition,
    /// Sending the parts to their ranks.
    Distribute,
    /// Refining to each level before the last, to measure it.
    Levels,
    /// Refining.
    Refine,
    /// Meshing the inside of parts.
    Fill,
    /// Numbering shared entities.
    Number,
    /// Improving tets beside interfaces between parts.
    Interfaces,
    /// Moving tets between parts to balance them.
    EvenOut,
    /// Moving tets to other parts.
    Move,
    /// Checking the mesh.
    Check,
    /// Writing files.
    Write,
    /// Reading the written files again.
    ReadBack,
}

impl Stage {
    /// Its name in lower case, as in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Read => "read",
            Self::Merge => "merge",
            Self::Mesh => "mesh",
            Self::Cut => "cut",
            Self::Surface => "surface",
            Self::Partition => "partition",
            Self::Distribute => "distribute",
            Self::Levels => "levels",
            Self::Refine => "refine",
            Self::Fill => "fill",
            Self::Number => "number",
            Self::Interfaces => "interfaces",
            Self::EvenOut => "even out",
            Self::Move => "move",
            Self::Check => "check",
            Self::Write => "write",
            Self::ReadBack => "read back",
        }
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Observes a run. All methods have defaults that do nothing; they are called from several threads
/// and must be quick.
pub trait Observer: Sync {
    /// A stage begins.
    fn begin(&self, _stage: Stage) {}
    /// A stage that has begun goes through this many tets of this rank: with the progress this
    /// gives a rate. Not called by stages that count nothing or something else.
    fn expect(&self, _stage: Stage, _tets: u64) {}
    /// The progress of a stage, 0 to 1. Called by any thread; never decreases within a stage.
    fn advance(&self, _stage: Stage, _fraction: f64) {}
    /// A stage has ended after this many seconds.
    fn end(&self, _stage: Stage, _seconds: f64) {}
    /// A message for the user, without a prefix such as "note"; one line except the warnings about
    /// a geometry ([`Geometry::notes`](crate::Geometry::notes)).
    fn note(&self, _text: &str) {}
    /// Whether the run should be cancelled. Called often, by any thread; once true it must stay
    /// true. If one rank cancels, the run ends on all.
    fn is_cancelled(&self) -> bool {
        false
    }
}

/// The observer that does nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Observer for Silent {}

/// The error of a run that its observer cancelled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// The total time of a stage.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct StageTime {
    /// The stage.
    pub name: &'static str,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// The peak resident memory of the process during the stage, bytes. `None` unless that is
    /// [measured](Progress::measuring_memory), or if the system does not report it.
    pub peak_memory: Option<u64>,
}

/// The stages of one run on one rank: notifies the observer, and records times.
pub struct Progress<'a> {
    observer: &'a dyn Observer,
    measures_memory: bool,
    stages: RefCell<Vec<StageTime>>,
}

impl fmt::Debug for Progress<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Progress").field("stages", &self.stages).finish_non_exhaustive()
    }
}

impl<'a> Progress<'a> {
    /// Progress of a run that has not started.
    pub fn new(observer: &'a dyn Observer) -> Self {
        Self { observer, measures_memory: false, stages: RefCell::default() }
    }

    /// Measures the peak memory of the process in each stage: for one rank of a process, because
    /// each stage starts a new peak.
    pub fn measuring_memory(self) -> Self {
        Self { measures_memory: true, ..self }
    }

    /// Runs one stage, which reports how far it is.
    pub fn stage<T>(&self, stage: Stage, run: impl FnOnce(&Work) -> T) -> T {
        self.observer.begin(stage);
        if self.measures_memory {
            memory::restart_peak();
        }
        let start = Instant::now();
        let result = run(&Work::new(self.observer, stage));
        let seconds = start.elapsed().as_secs_f64();
        let peak_memory = self.measures_memory.then(memory::peak_since_restart).flatten();
        self.observer.end(stage, seconds);
        let mut stages = self.stages.borrow_mut();
        match stages.iter_mut().find(|time| time.name == stage.name()) {
            Some(time) => {
                time.seconds += seconds;
                time.peak_memory = time.peak_memory.max(peak_memory);
            }
            None => stages.push(StageTime { name: stage.name(), seconds, peak_memory }),
        }
        result
    }

    /// Sends a message for the user to the observer.
    pub fn note(&self, text: &str) {
        self.observer.note(text);
    }

    /// The times of the stages so far, in the order of their first start, each name once.
    pub fn times(&self) -> Vec<StageTime> {
        self.stages.borrow().clone()
    }
}

/// The progress of one stage, shared between threads.
pub struct Work<'a> {
    observer: &'a dyn Observer,
    stage: Stage,
    /// The start and end of the current step as fractions of the stage, as bits of `f64`.
    step: [AtomicU64; 2],
    /// The range that units are counted in: the step or a part of it.
    range: [AtomicU64; 2],
    done: AtomicU64,
    total: AtomicU64,
    /// The progress last reported to the observer, in [`TICKS`].
    reported: AtomicU32,
}

fn store(to: &[AtomicU64; 2], bounds: [f64; 2]) {
    to.iter().zip(bounds).for_each(|(to, bound)| to.store(bound.to_bits(), Ordering::Relaxed));
}

fn load(from: &[AtomicU64; 2]) -> [f64; 2] {
    [0, 1].map(|k: usize| f64::from_bits(from[k].load(Ordering::Relaxed)))
}

/// The maximum number of reports per stage.
const TICKS: u32 = 1000;

impl<'a> Work<'a> {
    const fn new(observer: &'a dyn Observer, stage: Stage) -> Self {
        const fn whole() -> [AtomicU64; 2] {
            [AtomicU64::new(0.0_f64.to_bits()), AtomicU64::new(1.0_f64.to_bits())]
        }
        Self {
            observer,
            stage,
            step: whole(),
            range: whole(),
            done: AtomicU64::new(0),
            total: AtomicU64::new(1),
            reported: AtomicU32::new(0),
        }
    }

    /// Work without an observer.
    pub fn unwatched() -> &'static Work<'static> {
        static UNWATCHED: Work<'static> = Work::new(&Silent, Stage::Read);
        &UNWATCHED
    }

    /// Starts a step of `units` units between two fractions of the stage.
    pub fn step(&self, from: f64, to: f64, units: u64) {
        store(&self.step, [from, to]);
        self.substep(0.0, 1.0, units);
    }

    /// Sends a message for the user to the observer.
    pub(crate) fn note(&self, text: &str) {
        self.observer.note(text);
    }

    /// Reports the number of tets that the stage goes through.
    pub(crate) fn expect(&self, tets: u64) {
        self.observer.expect(self.stage, tets);
    }

    /// Starts a part of `units` units between two fractions of the current step.
    pub fn substep(&self, from: f64, to: f64, units: u64) {
        let [start, end] = load(&self.step);
        let range = [from, to].map(|fraction| start + fraction * (end - start));
        store(&self.range, range);
        self.total.store(units.max(1), Ordering::Relaxed);
        self.done.store(0, Ordering::Relaxed);
        self.tell(range[0]);
    }

    /// Reports that `units` units of the step are done. Callable from any thread.
    pub fn add(&self, units: u64) {
        let done = self.done.fetch_add(units, Ordering::Relaxed) + units;
        let total = self.total.load(Ordering::Relaxed);
        let [from, to] = load(&self.range);
        self.tell(from + (to - from) * (done as f64 / total as f64).min(1.0));
    }

    /// Reports that the unit at `index` of `count` is done. Call this once for each index, from any
    /// thread. Neighbouring units are added together, because threads that all add to one number
    /// wait for each other.
    #[inline]
    pub fn add_one(&self, index: usize, count: usize) {
        /// The maximum number of units added together.
        const TOGETHER: usize = 256;
        let together = (count / (4 * TICKS as usize)).clamp(1, TOGETHER);
        if index.is_multiple_of(together) {
            self.add(together.min(count - index) as u64);
        }
    }

    fn tell(&self, fraction: f64) {
        let tick = (fraction.clamp(0.0, 1.0) * f64::from(TICKS)) as u32;
        if self.reported.fetch_max(tick, Ordering::Relaxed) < tick {
            self.observer.advance(self.stage, f64::from(tick) / f64::from(TICKS));
        }
    }

    /// Whether the run was cancelled.
    pub fn is_cancelled(&self) -> bool {
        self.observer.is_cancelled()
    }

    /// Continues unless the run was cancelled.
    ///
    /// # Errors
    /// [`Cancelled`] if it was.
    pub fn proceed(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[derive(Default)]
    struct Listener(Mutex<Vec<f64>>);

    impl Observer for Listener {
        fn advance(&self, _: Stage, fraction: f64) {
            self.0.lock().unwrap().push(fraction);
        }
    }

    #[test]
    fn a_stage_that_runs_twice_is_listed_once() {
        let progress = Progress::new(&Silent);
        assert_eq!(progress.stage(Stage::Mesh, |_| 1) + progress.stage(Stage::Mesh, |_| 2), 3);
        progress.stage(Stage::Write, |_| ());
        let names: Vec<&str> = progress.times().into_iter().map(|s| s.name).collect();
        assert_eq!(names, ["mesh", "write"]);
    }

    #[test]
    fn each_stage_has_its_own_peak_if_memory_is_measured() {
        const BYTES: usize = 200 << 20;
        let progress = Progress::new(&Silent).measuring_memory();
        // Touched, so that it is resident.
        progress.stage(Stage::Mesh, |_| std::hint::black_box(vec![1_u8; BYTES]).len());
        progress.stage(Stage::Write, |_| ());
        let [mesh, write] = &progress.times()[..] else { panic!("two stages") };
        if let (Some(mesh), Some(write)) = (mesh.peak_memory, write.peak_memory) {
            // Other tests may allocate meanwhile.
            assert!(mesh as usize > BYTES && write + BYTES as u64 / 2 < mesh, "{mesh} {write}");
            assert!(memory::peak_bytes() >= Some(mesh));
        }
        let unmeasured = Progress::new(&Silent);
        unmeasured.stage(Stage::Mesh, |_| ());
        assert_eq!(unmeasured.times()[0].peak_memory, None);
    }

    #[test]
    fn fractions_rise_through_the_steps_and_are_not_told_one_by_one() {
        let listener = Listener::default();
        Progress::new(&listener).stage(Stage::Refine, |work| {
            for step in 0..2 {
                work.step(f64::from(step) / 2.0, f64::from(step + 1) / 2.0, 100_000);
                (0..100_000).for_each(|_| work.add(1));
            }
        });
        let reported = listener.0.into_inner().unwrap();
        assert_eq!(reported.len(), TICKS as usize);
        assert!(reported.is_sorted() && reported.last() == Some(&1.0));
    }

    #[test]
    fn units_added_together_are_all_counted() {
        for count in [1, 7, 5000, 100_001] {
            let listener = Listener::default();
            Progress::new(&listener).stage(Stage::Refine, |work| {
                work.step(0.0, 1.0, count as u64);
                (0..count).rev().for_each(|index| work.add_one(index, count));
                assert_eq!(work.done.load(Ordering::Relaxed), count as u64);
            });
            assert_eq!(listener.0.into_inner().unwrap().last(), Some(&1.0));
        }
    }
}

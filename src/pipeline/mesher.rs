//! The builder for all settings, with defaults.

use super::error::Error;
use super::geometry::Geometry;
use super::merged::generate;
use super::result::Generated;
use super::settings::{GenerateSettings, Method, Wanted};
use crate::Point;
use crate::ground::comm::{Communicator, thread};
use crate::ground::mesh::Order;
use crate::ground::progress::{Observer, Progress, Silent, Stage};
use crate::ground::size::{Closeness, Preset, SizeFunction, SizeSettings, Source};
use crate::mesher::improve::Effort;

/// Makes meshes; unset options have the defaults of the command line.
///
/// If an option is set twice, the last value counts. Numbers are checked when meshing begins: one
/// that no mesh can have is [`RequestError::Option`](crate::error::RequestError::Option).
///
/// ```
/// use tetmill::{Geometry, Mesher};
///
/// let geometry = Geometry::from_text("algebraic3d solid ball = sphere(0, 0, 0; 1); tlo ball;")?;
/// let mesh = Mesher::new().max_size(0.5).levels(1).generate(&geometry)?.arrays();
/// assert!(mesh.points.iter().all(|[x, y, z]| x * x + y * y + z * z < 1.0 + 1e-9));
/// # Ok::<(), tetmill::Error>(())
/// ```
#[derive(Clone)]
pub struct Mesher<'a> {
    settings: GenerateSettings,
    observer: &'a dyn Observer,
}

impl Default for Mesher<'_> {
    fn default() -> Self {
        Self { settings: GenerateSettings::default(), observer: &Silent }
    }
}

impl<'a> Mesher<'a> {
    /// Meshes at the preset `moderate`, without refinement.
    pub fn new() -> Self {
        Self::default()
    }

    /// Starts from given settings.
    pub fn with_settings(settings: GenerateSettings) -> Self {
        Self { settings, observer: &Silent }
    }

    fn with(mut self, change: impl FnOnce(&mut GenerateSettings)) -> Self {
        change(&mut self.settings);
        self
    }

    fn with_size(self, change: impl FnOnce(&mut SizeSettings)) -> Self {
        self.with(|settings| change(&mut settings.coarse.size))
    }

    /// The fineness. Replaces earlier size settings except upper bounds and sources.
    pub fn preset(self, preset: Preset) -> Self {
        self.with_size(|size| {
            let SizeSettings { maxh, sources, function, .. } = std::mem::take(size);
            *size = SizeSettings { maxh, sources, function, ..preset.into() };
        })
    }

    /// The largest element size (length).
    pub fn max_size(self, size: f64) -> Self {
        self.with_size(|settings| settings.maxh = Some(size))
    }

    /// The smallest element size (length) that curvature and short curves may cause.
    pub fn min_size(self, size: f64) -> Self {
        self.with_size(|settings| settings.minh = size)
    }

    /// Growth of the size per unit of distance.
    pub fn grading(self, grading: f64) -> Self {
        self.with_size(|settings| settings.grading = grading)
    }

    /// The largest element size in thin regions, in units of their thickness; 0 ignores thin
    /// regions.
    pub fn closeness(self, ratio: f64) -> Self {
        self.with_size(|settings| settings.closeness = Closeness::of_ratio(ratio))
    }

    /// Adds sizes at places, from which sizes grow by the grading. On several ranks those of rank 0
    /// count.
    pub fn sources(self, sources: impl IntoIterator<Item = Source>) -> Self {
        self.with_size(|settings| settings.sources.extend(sources))
    }

    /// An upper bound of the coarse mesh's size (length) by place. Values that are not positive are
    /// ignored.
    ///
    /// A [`Point`] has the coordinates `x`, `y` and `z`, and converts `into()` a `[f64; 3]`. The
    /// function is called very often, by several threads, on rank 0 only. If it changes faster than
    /// the grading, elements may be badly shaped; a small region finer than the elements around it
    /// may be missed.
    ///
    /// The settings own the function, so it cannot borrow local data: `move` data into it, or share
    /// data by an [`Arc`](std::sync::Arc).
    pub fn size(self, size: impl Fn(Point) -> f64 + Send + Sync + 'static) -> Self {
        self.size_function(SizeFunction::new(size))
    }

    /// The same by a [`SizeFunction`], e.g. the sizes on a background mesh that an error estimate
    /// asks for ([`SizeFunction::on_mesh`]).
    pub fn size_function(self, size: SizeFunction) -> Self {
        self.with_size(|settings| settings.function = Some(size))
    }

    /// Refines the coarse mesh this many times, each time every tet into eight: the same as
    /// [`pieces`](Self::pieces) of 2 to the power `levels`.
    ///
    /// At most 10 levels are possible ([`MAX_PIECES`](crate::run::MAX_PIECES)); more are refused
    /// when meshing. Replaces earlier `levels` and `pieces`, and [`tets`](Self::tets).
    pub fn levels(self, levels: u32) -> Self {
        self.pieces(1_u32.checked_shl(levels).unwrap_or(u32::MAX))
    }

    /// Splits each coarse edge into `pieces`, so each coarse tet into `pieces`³.
    ///
    /// 1 to [`MAX_PIECES`](crate::run::MAX_PIECES) are possible; other numbers are refused when
    /// meshing. Replaces earlier `pieces` and [`levels`](Self::levels), and [`tets`](Self::tets).
    pub fn pieces(self, pieces: u32) -> Self {
        self.with(|settings| match &mut settings.wanted {
            Wanted::Coarse { pieces: of_coarse, .. } => *of_coarse = pieces,
            wanted => *wanted = Wanted::Sizes { pieces },
        })
    }

    /// Chooses sizes for a coarse mesh of `tets` to 1.5 times as many.
    ///
    /// [`levels`](Self::levels) or [`pieces`](Self::pieces), set before or after, refine it.
    /// Replaces an earlier `coarse_tets`, and [`tets`](Self::tets).
    pub fn coarse_tets(self, tets: u64) -> Self {
        self.with(|settings| {
            let pieces = match settings.wanted {
                Wanted::Sizes { pieces } | Wanted::Coarse { pieces, .. } => pieces,
                Wanted::Elements(_) => 1,
            };
            settings.wanted = Wanted::Coarse { tets, pieces };
        })
    }

    /// Chooses sizes and refinement for a total of `tets` to 1.3 times as many.
    ///
    /// Replaces earlier [`coarse_tets`](Self::coarse_tets), [`levels`](Self::levels) and
    /// [`pieces`](Self::pieces); each of them replaces it if set later.
    pub fn tets(self, tets: u64) -> Self {
        self.with(|settings| settings.wanted = Wanted::Elements(tets))
    }

    /// How the parts are meshed.
    pub fn method(self, method: Method) -> Self {
        self.with(|settings| settings.method = method)
    }

    /// Refines the tets of separately meshed parts this many times, each time every tet into eight,
    /// with the boundary on the geometry.
    ///
    /// For the methods [`Surface`](Method::Surface) and [`Decompose`](Method::Decompose);
    /// the method [`Refine`](Method::Refine) has [`levels`](Self::levels). All sizes are those
    /// before this refinement, but [`tets`](Self::tets) counts the tets after it.
    pub fn refine(self, levels: u32) -> Self {
        self.with(|settings| settings.refine = levels)
    }

    /// The effort for better shapes.
    pub fn effort(self, effort: Effort) -> Self {
        self.with(|settings| settings.coarse.effort = Some(effort))
    }

    /// Splits all octahedra of a coarse tet along one diagonal, so that each tet of a refinement
    /// level lies in one tet of the level before
    /// ([`Hierarchy::tet_parents`](crate::Hierarchy::tet_parents)). Near curved boundaries that
    /// costs at most 0.4° of the smallest angle (`benches/results/nested-2026-11-23.md`).
    pub fn nested(self) -> Self {
        self.with(|settings| settings.nested = true)
    }

    /// The order of the elements. With [`Order::Second`] tets have ten nodes, those on the boundary
    /// on the geometry, and each tet is proved valid.
    ///
    /// ```
    /// use tetmill::{Geometry, Mesher, mesh::Order};
    ///
    /// let ball = Geometry::from_text("algebraic3d solid ball = sphere(0, 0, 0; 1); tlo ball;")?;
    /// let mesh = Mesher::new().max_size(0.5).order(Order::Second).generate(&ball)?;
    /// let arrays = mesh.arrays(); // corners in `tets`, the other nodes in `tet_edge_nodes`
    /// assert_eq!(arrays.tets.len(), arrays.tet_edge_nodes.len());
    /// assert!(mesh.check.scaled_jacobian.is_some_and(|least| least.value > 0.1));
    /// # Ok::<(), tetmill::Error>(())
    /// ```
    pub fn order(self, order: Order) -> Self {
        self.with(|settings| settings.coarse.order = order)
    }

    /// With second order, leaves edges straight where the tets beside them would not be valid
    /// otherwise: [`Generated::straight`] lists them. Without, this is an error.
    pub fn allow_off_surface(self) -> Self {
        self.with(|settings| settings.allow_off_surface = true)
    }

    /// The memory for the fine mesh on each machine (bytes), instead of its free memory.
    pub fn memory(self, bytes: u64) -> Self {
        self.with(|settings| settings.memory = Some(bytes))
    }

    /// Sets an observer, which receives the progress and can cancel the run. On several ranks that
    /// of rank 0 receives the progress, and any can cancel.
    pub fn observer(self, observer: &'a dyn Observer) -> Self {
        Self { observer, ..self }
    }

    /// Makes the mesh in one part.
    ///
    /// # Errors
    /// No valid mesh, with the location; not enough memory; cancelled.
    pub fn generate(&self, geometry: &Geometry) -> Result<Generated, Error> {
        self.generate_on(&thread::alone(), Some(geometry))
    }

    /// **Collective.** Makes the mesh in one part for each rank; each rank gets its own.
    ///
    /// Only rank 0 uses the geometry, [`sources`](Self::sources) and the function
    /// [`size`](Self::size); those of other ranks are ignored. All other options except
    /// [`memory`](Self::memory) must be the same on all ranks, which is checked.
    ///
    /// # Errors
    /// On all ranks: options that are impossible or differ between ranks; no geometry on rank 0; no
    /// valid mesh, with the location; more parts than coarse tets; not enough memory; cancelled.
    /// The failing rank has the original error, others [`Error::Comm`] with its text.
    pub fn generate_on(
        &self,
        comm: &dyn Communicator,
        geometry: Option<&Geometry>,
    ) -> Result<Generated, Error> {
        let cancel = CancelOnly(self.observer);
        let progress = Progress::new(if comm.rank() == 0 { self.observer } else { &cancel });
        generate(comm, geometry, &self.settings, &progress)
    }
}

/// The observer of a rank other than 0.
struct CancelOnly<'a>(&'a dyn Observer);

impl Observer for CancelOnly<'_> {
    fn begin(&self, _: Stage) {}

    fn is_cancelled(&self) -> bool {
        self.0.is_cancelled()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::error::{ErrorKind, HasKind};
    use std::sync::atomic::{AtomicBool, Ordering};

    /// Cancels when a stage begins, or reaches a fraction.
    struct CancelIn {
        stage: Stage,
        fraction: f64,
        cancelled: AtomicBool,
    }

    impl Observer for CancelIn {
        fn begin(&self, stage: Stage) {
            if stage == self.stage && self.fraction == 0.0 {
                self.cancelled.store(true, Ordering::Relaxed);
            }
        }

        fn advance(&self, stage: Stage, fraction: f64) {
            if stage == self.stage && fraction >= self.fraction {
                self.cancelled.store(true, Ordering::Relaxed);
            }
        }

        fn is_cancelled(&self) -> bool {
            self.cancelled.load(Ordering::Relaxed)
        }
    }

    #[test]
    fn a_run_ends_on_all_ranks_in_whichever_stage_it_is_cancelled() {
        let ball = Geometry::from_text("algebraic3d solid b = sphere (0, 0, 0; 1); tlo b;").unwrap();
        let stages = [
            (Stage::Mesh, 0.0),
            (Stage::Mesh, 0.5),
            (Stage::Levels, 0.1),
            (Stage::Refine, 0.3),
            (Stage::Check, 0.3),
        ];
        for ranks in [1, 3] {
            for (stage, fraction) in stages {
                let observer = CancelIn { stage, fraction, cancelled: AtomicBool::new(false) };
                let mesher = Mesher::new().levels(2).observer(&observer);
                let ended = thread::run(ranks, |comm| mesher.generate_on(comm, Some(&ball)).map(|_| ()));
                for ended in ended.unwrap() {
                    let error = ended.expect_err("it was cancelled");
                    assert_eq!(error.kind(), ErrorKind::Cancelled, "{stage} at {fraction}: {error}");
                }
            }
        }
    }
}

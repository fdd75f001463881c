//! Geometries, and the start of a run.

use crate::error::Failure;
use crate::mesh::Mesh;
use crate::options::Options;
use crate::ranks::{Processes, Ranks, agree, on_ranks};
use crate::watch::{Stop, watched};
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;
use tetmill::comm::Communicator;
use tetmill::error::Error;
use tetmill::progress::{Progress, StageTime};
use tetmill::run::{Balance, GenerateSettings, balance, generate as generate_part};
use tetmill::{Generated, InputSettings, MeshArrays, SurfaceArrays};
use tetmill_cli::report::{Report, processes};

/// The input of the mesher.
#[pyclass(frozen, module = "tetmill._native")]
pub struct Geometry {
    geometry: tetmill::Geometry,
    /// What reports call it.
    name: String,
}

/// The keyword arguments for the input; all keys are present.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Input {
    keep_surface: bool,
    keep_small: bool,
    merge: Option<f64>,
    /// Degrees.
    feature_angle: Option<f64>,
    /// The name of a unit of length, checked by the caller.
    unit: String,
    solids: Vec<String>,
    /// A name of the solid that keeps what two have in common, checked by the caller.
    overlap_to: Option<String>,
}

impl Input {
    fn settings(&self) -> InputSettings {
        let mut settings = InputSettings {
            keep_surface: self.keep_surface,
            keep_small: self.keep_small,
            merge: self.merge,
            unit: self.unit.parse().unwrap_or_default(),
            solids: self.solids.clone(),
            overlap_to: self.overlap_to.as_deref().and_then(|to| to.parse().ok()),
            ..InputSettings::default()
        };
        if let Some(degrees) = self.feature_angle {
            settings.facets.feature_angle = degrees.to_radians();
        }
        settings
    }
}

/// A number and its names, for bodies and patches.
pub type Labels = Vec<(u32, Vec<String>)>;

/// Numbers and names by index.
pub fn labels(of: &[tetmill::mesh::Label]) -> Labels {
    of.iter().map(|label| (label.number, label.names.clone())).collect()
}

fn read(
    py: Python<'_>,
    name: String,
    make: impl FnOnce() -> Result<tetmill::Geometry, Error> + Send,
) -> PyResult<Geometry> {
    let (geometry, _) = watched(py, None, &Arc::default(), |_| Ok(make()?))?;
    Ok(Geometry { geometry, name })
}

#[pymethods]
impl Geometry {
    /// Reads one file, several surfaces or several CAD files.
    #[staticmethod]
    fn from_files(py: Python<'_>, paths: Vec<PathBuf>, input: Input) -> PyResult<Self> {
        let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
        read(py, names.join(", "), || tetmill::Geometry::from_files(&paths, &input.settings()))
    }

    /// Reads the text of a `.geo` file.
    #[staticmethod]
    fn from_text(py: Python<'_>, text: &str) -> PyResult<Self> {
        read(py, "text".into(), || tetmill::Geometry::from_text(text))
    }

    /// Takes closed surfaces. `numbers` is empty or has one number for each triangle.
    #[staticmethod]
    fn from_surface(
        py: Python<'_>,
        points: PyReadonlyArray2<'_, f64>,
        triangles: PyReadonlyArray2<'_, u32>,
        numbers: PyReadonlyArray1<'_, u32>,
        names: BTreeMap<u32, String>,
        input: Input,
    ) -> PyResult<Self> {
        let surface = SurfaceArrays {
            points: bytemuck::cast_slice(points.as_slice()?),
            triangles: bytemuck::cast_slice(triangles.as_slice()?),
            numbers: numbers.as_slice()?,
            names,
        };
        read(py, "arrays".into(), || tetmill::Geometry::from_surface(&surface, &input.settings()))
    }

    /// Takes a tetrahedral mesh. `bodies` and `face_tags` are empty or have one number for each
    /// tet and face.
    #[staticmethod]
    #[expect(clippy::too_many_arguments, reason = "the arrays of a mesh")]
    fn from_mesh(
        py: Python<'_>,
        points: PyReadonlyArray2<'_, f64>,
        tets: PyReadonlyArray2<'_, u32>,
        bodies: PyReadonlyArray1<'_, u32>,
        faces: PyReadonlyArray2<'_, u32>,
        face_tags: PyReadonlyArray1<'_, u32>,
        body_names: BTreeMap<u32, String>,
        face_names: BTreeMap<u32, String>,
    ) -> PyResult<Self> {
        let mesh = MeshArrays {
            points: bytemuck::cast_slice(points.as_slice()?),
            tets: bytemuck::cast_slice(tets.as_slice()?),
            bodies: bodies.as_slice()?,
            triangles: bytemuck::cast_slice(faces.as_slice()?),
            boundaries: face_tags.as_slice()?,
            body_names,
            boundary_names: face_names,
        };
        read(py, "arrays".into(), || tetmill::Geometry::from_mesh(&mesh))
    }

    /// Warnings of the language, and repairs while reading.
    fn notes(&self) -> Vec<String> {
        self.geometry.notes().to_vec()
    }

    /// The numbers of bodies, patches, curves and corners as JSON.
    fn entities(&self) -> String {
        serde_json::to_string(&self.geometry.entities()).expect("plain data")
    }

    /// All bodies, patches, curves and corners as JSON; `None` for a tetrahedral mesh.
    fn inspect(&self, py: Python<'_>) -> Option<String> {
        let inspection = py.detach(|| self.geometry.inspect())?;
        Some(serde_json::to_string(&inspection).expect("plain data"))
    }

    fn is_mesh(&self) -> bool {
        self.geometry.is_mesh()
    }

    /// Numbers and names of the bodies.
    fn bodies(&self) -> Labels {
        labels(&self.geometry.names().bodies)
    }

    /// Numbers and names of the patches.
    fn patches(&self) -> Labels {
        labels(&self.geometry.names().patches)
    }
}

/// **Collective** over the processes, if there are several. Makes a mesh; process 0 gives the
/// geometry.
#[pyfunction]
pub fn generate(
    py: Python<'_>,
    geometry: Option<Bound<'_, Geometry>>,
    options: Options<'_>,
) -> PyResult<Mesh> {
    let start = Instant::now();
    let ranks = match &options.processes {
        Some(processes) => Ranks::of_processes(Processes::new(processes)?, options.parts),
        None => Ranks::of_threads(options.parts.max(1)),
    };
    let geometry = geometry.as_ref().map(Bound::get).filter(|_| ranks.is_first());
    let stop = Arc::default();
    let settings = agree(py, &ranks, settings(&options, geometry, &stop))?;
    let (made, notes) = on_ranks(py, &ranks, options.progress.as_ref(), &stop, |comm, progress| {
        let geometry = geometry.filter(|_| comm.rank() == 0);
        Ok(run(comm, geometry.map(|of| &of.geometry), &settings, progress)?)
    })?;
    let report = made.first().zip(geometry).map(|(first, geometry)| geometry.report(first, &ranks, start));
    Mesh::new(py, made.into_iter().map(|run| run.made).collect(), ranks, report, notes)
}

fn settings(
    options: &Options<'_>,
    geometry: Option<&Geometry>,
    stop: &Arc<Stop>,
) -> Result<GenerateSettings, Failure> {
    if options.has_sizes() && geometry.is_some_and(Geometry::is_mesh) {
        let text = "the geometry is a mesh already and is taken as it is: leave out preset, maxh, minh, grading, \
                    closeness, mesh_size_file, sources, size, effort and coarse";
        return Err(PyValueError::new_err(text).into());
    }
    options.settings(geometry.map(|of| &of.geometry), stop)
}

/// The result of one rank.
struct Run {
    made: Generated,
    balance: Balance,
    processes: processes::Processes,
    stages: Vec<StageTime>,
}

/// **Collective.** Makes the mesh of one rank, and measures what its report needs.
fn run(
    comm: &dyn Communicator,
    geometry: Option<&tetmill::Geometry>,
    settings: &GenerateSettings,
    progress: &Progress,
) -> Result<Run, Error> {
    let made = generate_part(comm, geometry, settings, progress)?;
    let balance = balance(comm, &made.part)?;
    Ok(Run { made, balance, processes: processes::processes(comm)?, stages: progress.times() })
}

impl Geometry {
    /// The report of the command line, as JSON, from the result of rank 0.
    fn report(&self, run: &Run, ranks: &Ranks, start: Instant) -> String {
        let Run { made, balance, processes, stages } = run;
        let mut report = Report::new(&self.geometry, &self.name, made, *processes, ranks.ranks(), *balance);
        report.stages = stages.clone();
        report.seconds = start.elapsed().as_secs_f64();
        serde_json::to_string(&report).expect("plain data")
    }
}

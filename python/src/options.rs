//! The options of a run.

use crate::error::Failure;
use crate::size;
use crate::watch::Stop;
use numpy::PyReadonlyArray2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;
use tetmill::files::mesh_size;
use tetmill::mesh::Order;
use tetmill::run::{
    Candidates, CoarseSettings, CutPlane, CutSettings, GenerateSettings, PlanSettings, Wanted,
};
use tetmill::size::{Closeness, Effort, Preset, SizeSettings, Source};
use tetmill::{Geometry, Method, Point, Vector};

/// The keyword arguments of `Geometry.generate`; all keys are present.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Options<'py> {
    method: String,
    /// 0 stands for one in each process.
    pub parts: u32,
    /// The processes, if there are several.
    pub processes: Option<Bound<'py, PyAny>>,
    elements: Option<u64>,
    pieces: u32,
    nested: bool,
    refine: u32,
    order: u32,
    allow_off_surface: bool,
    planes: String,
    /// A point and a normal in each row.
    planes_from: Option<PyReadonlyArray2<'py, f64>>,
    memory: Option<u64>,
    preset: Option<String>,
    maxh: Option<f64>,
    minh: Option<f64>,
    grading: Option<f64>,
    closeness: Option<f64>,
    mesh_size_file: Option<PathBuf>,
    /// A point and its size in each row.
    sources: Option<PyReadonlyArray2<'py, f64>>,
    effort: Option<String>,
    coarse: Option<u64>,
    size: Option<Bound<'py, PyAny>>,
    pub progress: Option<Py<PyAny>>,
}

fn unknown(what: &str, value: &str, known: &str) -> PyErr {
    PyValueError::new_err(format!("{what} cannot be {value:?}: possible are {known}"))
}

impl Options<'_> {
    /// The settings of the library.
    pub fn settings(
        &self,
        geometry: Option<&Geometry>,
        stop: &Arc<Stop>,
    ) -> Result<GenerateSettings, Failure> {
        Ok(GenerateSettings {
            method: self.method()?,
            coarse: CoarseSettings {
                order: Order::of_degree(self.order)
                    .ok_or_else(|| unknown("order", &self.order.to_string(), "1, 2"))?,
                ..self.coarse(geometry, stop)?
            },
            wanted: self.wanted(),
            memory: self.memory,
            nested: self.nested,
            refine: self.refine,
            allow_off_surface: self.allow_off_surface,
            ..GenerateSettings::default()
        })
    }

    /// Whether sizes are set, which a tetrahedral mesh cannot follow.
    pub fn has_sizes(&self) -> bool {
        let lengths = [self.maxh, self.minh, self.grading, self.closeness];
        let files = self.mesh_size_file.is_some() || self.sources.is_some() || self.size.is_some();
        let names = self.preset.is_some() || self.effort.is_some() || self.coarse.is_some();
        files || names || lengths.iter().any(Option::is_some)
    }

    fn method(&self) -> PyResult<Method> {
        match self.method.as_str() {
            "refine" => Ok(Method::Refine),
            "surface" => Ok(Method::Surface),
            "decompose" => self.cuts().map(Method::Decompose),
            other => Err(unknown("method", other, "refine, surface, decompose")),
        }
    }

    fn cuts(&self) -> PyResult<CutSettings> {
        let candidates = match self.planes.as_str() {
            "best" => Candidates::All,
            "axes" => Candidates::Axes,
            "principal" => Candidates::Principal,
            "random" => Candidates::Random,
            "median" => Candidates::Median,
            other => return Err(unknown("planes", other, "best, axes, principal, random, median")),
        };
        let rows: &[[f64; 6]] = match &self.planes_from {
            Some(planes) => bytemuck::cast_slice(planes.as_slice()?),
            None => &[],
        };
        let plane = |&[x, y, z, nx, ny, nz]: &[f64; 6]| {
            let normal = Vector::new(nx, ny, nz).try_normalize(0.0);
            let normal =
                normal.ok_or_else(|| PyValueError::new_err("planes_from has a normal of length 0"))?;
            Ok(CutPlane { point: Point::new(x, y, z), normal })
        };
        let planes = rows.iter().map(plane).collect::<PyResult<_>>()?;
        Ok(CutSettings { plan: PlanSettings { candidates, ..PlanSettings::default() }, planes })
    }

    fn wanted(&self) -> Wanted {
        match (self.elements, self.coarse) {
            (Some(tets), _) => Wanted::Elements(tets),
            (None, Some(tets)) => Wanted::Coarse { tets, pieces: self.pieces },
            (None, None) => Wanted::Sizes { pieces: self.pieces },
        }
    }

    fn coarse(&self, geometry: Option<&Geometry>, stop: &Arc<Stop>) -> Result<CoarseSettings, Failure> {
        let preset: Preset = match &self.preset {
            Some(name) => name.parse().map_err(PyValueError::new_err)?,
            None => Preset::default(),
        };
        let mut size = SizeSettings::from(preset);
        size.maxh = self.maxh;
        size.minh = self.minh.unwrap_or(size.minh);
        size.grading = self.grading.unwrap_or(size.grading);
        if let Some(ratio) = self.closeness {
            size.closeness = Closeness::of_ratio(ratio);
        }
        // Only rank 0 has a geometry, and reads sizes by place.
        let Some(geometry) = geometry else {
            return Ok(CoarseSettings { effort: self.effort()?, ..size.into() });
        };
        if let Some(file) = &self.mesh_size_file {
            let least = geometry.least_size().unwrap_or(0.0);
            size.sources = mesh_size::read_from(file, least).map_err(|error| Failure::Error(error.into()))?;
        }
        if let Some(sources) = &self.sources {
            let rows: &[[f64; 4]] = bytemuck::cast_slice(sources.as_slice().map_err(PyErr::from)?);
            size.sources
                .extend(rows.iter().map(|&[x, y, z, size]| Source { point: Point::new(x, y, z), size }));
        }
        if let Some(function) = &self.size {
            size.function = Some(size::function(function, stop)?);
        }
        Ok(CoarseSettings { effort: self.effort()?, ..size.into() })
    }

    fn effort(&self) -> PyResult<Option<Effort>> {
        let effort = self.effort.as_ref().map(|name| name.parse());
        effort.transpose().map_err(PyValueError::new_err)
    }
}

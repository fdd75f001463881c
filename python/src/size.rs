//! Sizes by place: functions of the user, values on a grid, and values on a mesh.

use crate::watch::Stop;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use std::sync::Arc;
use tetmill::Point;
use tetmill::size::SizeFunction;

/// A size for each point of a regular grid, interpolated linearly in each direction.
#[pyclass(frozen, module = "tetmill._native")]
pub struct Grid {
    field: Arc<Field>,
}

struct Field {
    origin: [f64; 3],
    spacing: [f64; 3],
    /// Numbers of points.
    shape: [usize; 3],
    /// The last index varies fastest.
    values: Vec<f64>,
}

#[pymethods]
impl Grid {
    #[new]
    fn new(origin: [f64; 3], spacing: [f64; 3], values: PyReadonlyArray3<'_, f64>) -> PyResult<Self> {
        let shape = values.as_array().dim();
        let values = values.as_slice()?.to_vec();
        Ok(Self { field: Arc::new(Field { origin, spacing, shape: shape.into(), values }) })
    }

    /// The size at a point.
    fn at(&self, point: [f64; 3]) -> f64 {
        self.field.at(point)
    }
}

/// Sizes at the points of a tetrahedral mesh.
#[pyclass(frozen, module = "tetmill._native")]
pub struct Background(SizeFunction);

#[pymethods]
impl Background {
    #[new]
    fn new(
        points: PyReadonlyArray2<'_, f64>,
        tets: PyReadonlyArray2<'_, u32>,
        sizes: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<Self> {
        let (points, tets) =
            (bytemuck::cast_slice(points.as_slice()?), bytemuck::cast_slice(tets.as_slice()?));
        let function = SizeFunction::on_mesh(points, tets, sizes.as_slice()?);
        function.map(Self).map_err(|error| PyValueError::new_err(error.to_string()))
    }

    /// The size at a point.
    fn at(&self, point: [f64; 3]) -> f64 {
        self.0.at(Point::from(point))
    }
}

impl Field {
    fn at(&self, point: [f64; 3]) -> f64 {
        let mut cell = [0; 3];
        let mut fraction = [0.0; 3];
        for axis in 0..3 {
            // Points outside the grid have the size of the nearest point of its surface.
            let last = (self.shape[axis] - 1) as f64;
            let steps = ((point[axis] - self.origin[axis]) / self.spacing[axis]).clamp(0.0, last);
            cell[axis] = (steps as usize).min(self.shape[axis].saturating_sub(2));
            fraction[axis] = steps - cell[axis] as f64;
        }
        let corner = |bits: usize| {
            let offset = |axis: usize| (bits >> axis) & 1;
            let weight = |axis: usize| [1.0 - fraction[axis], fraction[axis]][offset(axis)];
            // Axes with one point have no second corner, whose weight would be 0.
            let index = |axis: usize| (cell[axis] + offset(axis)).min(self.shape[axis] - 1);
            let place = (index(0) * self.shape[1] + index(1)) * self.shape[2] + index(2);
            weight(0) * weight(1) * weight(2) * self.values[place]
        };
        (0..8).map(corner).sum()
    }
}

/// The size function of a grid, a background mesh or a callable.
pub fn function(size: &Bound<'_, PyAny>, stop: &Arc<Stop>) -> PyResult<SizeFunction> {
    if let Ok(grid) = size.cast::<Grid>() {
        let field = Arc::clone(&grid.get().field);
        return Ok(SizeFunction::new(move |point| field.at([point.x, point.y, point.z])));
    }
    if let Ok(background) = size.cast::<Background>() {
        return Ok(background.get().0.clone());
    }
    let (callable, stop) = (size.clone().unbind(), Arc::clone(stop));
    Ok(SizeFunction::new(move |point| {
        if stop.is_set() {
            return f64::NAN;
        }
        Python::attach(|py| call(callable.bind(py), point)).unwrap_or_else(|exception| {
            stop.raise(exception);
            f64::NAN
        })
    }))
}

/// Calls the user's function with an array of one point.
fn call(callable: &Bound<'_, PyAny>, point: Point) -> PyResult<f64> {
    let points = PyArray1::from_slice(callable.py(), &[point.x, point.y, point.z]).reshape([1, 3])?;
    let result = callable.call1((points,))?;
    let size = match result.extract::<PyReadonlyArray1<'_, f64>>() {
        Ok(sizes) if sizes.len()? == 1 => sizes.get(0).copied(),
        Ok(_) => None,
        Err(_) => result.extract::<f64>().ok(),
    };
    let Some(size) = size else {
        let shown = result.repr()?.to_string();
        return Err(PyTypeError::new_err(format!(
            "the size function must return float64 values of shape (n,) for points of shape (n, 3); for (1, 3) it \
             returned {shown:.200}"
        )));
    };
    if size > 0.0 {
        return Ok(size);
    }
    Err(PyValueError::new_err(format!(
        "the size function returned {size} at ({}, {}, {}): sizes are positive, numpy.inf sets no bound",
        point.x, point.y, point.z
    )))
}

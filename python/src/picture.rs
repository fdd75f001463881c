//! Pictures of meshes.

use pyo3::prelude::*;
use tetmill::Error;
use tetmill::comm::Communicator;
use tetmill::files::picture::{self, ColorBy, Cut, Look, Settings};
use tetmill::mesh::MeshStream;

/// The keyword arguments of `Mesh.picture`; all keys are present.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct View {
    width: u32,
    height: u32,
    azimuth: Option<f64>,
    elevation: Option<f64>,
    /// A point and a normal.
    cut: Option<[f64; 6]>,
    /// `patch`, `part` or `body`.
    color_by: String,
}

/// **Collective.** Draws a mesh as PNG, on rank 0.
pub fn draw(comm: &dyn Communicator, part: &dyn MeshStream, view: &View) -> Result<Option<Vec<u8>>, Error> {
    let color_by = match view.color_by.as_str() {
        "part" => ColorBy::Part,
        "body" => ColorBy::Body,
        _ => ColorBy::Patch,
    };
    let cut = view.cut.map(|[x, y, z, nx, ny, nz]| Cut { point: [x, y, z], normal: [nx, ny, nz] });
    let scene = picture::scene_of_part(part, &Look { color_by, cut });
    let facing = cut.as_ref().map_or_else(Settings::default, Settings::facing);
    let settings = Settings {
        width: view.width,
        height: view.height,
        azimuth: view.azimuth.unwrap_or(facing.azimuth),
        elevation: view.elevation.unwrap_or(facing.elevation),
        ..facing
    };
    let scene = picture::gather(comm, &scene)?;
    Ok(scene.map(|scene| picture::png_bytes(&picture::render(&scene, &settings))))
}

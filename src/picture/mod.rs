//! Pictures of meshes without a window or a graphics card: triangles to a PNG.
//!
//! A **scene** is a list of coloured triangles, made from a part of a mesh by [`scene_of_part`]: its skin, or with a
//! **cut** the skin of the tets on one side of a plane, so that whole tets show inside (a crinkle cut).
//! [`render`] looks at it from a direction, parallel, with the scene filling the image.
//!
//! ```no_run
//! use tetmill::{io::plain::PlainPart, mesh::Mesh, picture};
//! # let mesh = Mesh::default();
//! let look = picture::Look { color_by: picture::ColorBy::Patch, cut: None };
//! let scene = picture::scene_of_part(&PlainPart::whole(&mesh), &look);
//! let image = picture::render(&scene, &picture::Settings::default());
//! picture::write_png(&image, "mesh.png".as_ref())?;
//! # Ok::<(), tetmill::io::WriteError>(())
//! ```

pub mod color;
mod png_file;
mod raster;
mod scene;

pub use png_file::write_png;
pub use raster::{Image, Settings, render};
pub use scene::{ColorBy, Cut, Look, Scene, Triangle, gather, scene_of_part};

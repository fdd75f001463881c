//! Renders meshes to PNG without a window or a graphics card.
//!
//! A **scene** is a list of coloured triangles, made from a part of a mesh by [`scene_of_part`]:
//! its skin, or with a **cut** the skin of the tets on one side of a plane, so that whole inner
//! tets are visible (a crinkle cut). [`render`] draws it in parallel projection from a direction,
//! scaled to fill the image. Curved faces of second order are drawn as flat pieces.
//!
//! ```no_run
//! use tetmill::files::picture;
//! use tetmill::internals::PlainPart;
//! # let mesh = tetmill::mesh::Mesh::default();
//! let look = picture::Look { color_by: picture::ColorBy::Patch, cut: None };
//! let scene = picture::scene_of_part(&PlainPart::whole(&mesh), &look);
//! let image = picture::render(&scene, &picture::Settings::default());
//! picture::write_png(&image, "mesh.png".as_ref())?;
//! # Ok::<(), tetmill::files::WriteError>(())
//! ```

mod curved;
mod png_file;
mod raster;
mod scene;

pub use png_file::{png_bytes, write_png};
pub use raster::{Image, Settings, render};
pub use scene::{ColorBy, Cut, Look, Scene, Triangle, gather, scene_of_part};

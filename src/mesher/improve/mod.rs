//! Improvement of the tets of a mesh; the boundary is not changed.
//!
//! Boundary triangles, segments and their vertices stay; everything else may change. The **score**
//! of a tet measures its shape: by default the mean ratio of the worst tet in its refinement
//! ([`Measure::Refined`]). A change is made only if it raises the worst score of the tets involved,
//! so the worst score of the mesh never decreases, and every tet stays positive by exact sign.
//! There are six operations; all but the first refill a **cavity**:
//!
//! * `smooth` moves a vertex;
//! * `swap` removes an edge, or the faces between two vertices;
//! * `collapse` merges a vertex into a neighbour;
//! * `insert` fills a cavity around a new vertex;
//! * `reconnect` fills a cavity with the best tets of its vertices;
//! * `repair` applies the others to *illegal* tets.
//!
//! Swaps come first: slivers are mostly caused by the connectivity, and smoothing instead costs
//! more and leaves worse neighbours. Large meshes are divided into `blocks`, which are improved in
//! parallel.
//!
//! [`make_refinable`] is [`improve()`] for a coarse mesh that will be refined and projected to the
//! geometry. It also handles **illegal** tets, which would flatten at a vertex whatever their shape
//! (`legality`): their score is below that of every legal tet. In addition, the score is reduced
//! for corners that would shrink much or be inverted (`limits`).
//!
//! ```
//! use tetmill::internals::improve::{Settings, improve};
//! use tetmill::mesh::{Class, Mesh, VertexId};
//! use tetmill::internals::UniformSize;
//! # use csg::BodyId;
//! // A long edge with four flat tets around it: other tets of the same six vertices are better.
//! let points = [[0., 0., 3.], [0., 0., -3.], [1., 0., 0.], [0., 1., 0.], [-1., 0., 0.], [0., -1., 0.]];
//! let tets = [[1, 0, 2, 3], [1, 0, 3, 4], [1, 0, 4, 5], [1, 0, 5, 2]];
//! let mut mesh = Mesh {
//!     points: points.map(Into::into).to_vec(),
//!     classes: vec![Class::Body(BodyId(0)); 6],
//!     tets: tets.map(|t| t.map(VertexId)).to_vec(),
//!     bodies: vec![BodyId(0); 4],
//!     ..Mesh::default()
//! };
//! let settings = Settings { change_below: 0.0, ..Settings::default() };
//! let report = improve(&mut mesh, &UniformSize(1.0), &settings);
//! assert!(report.swaps > 0 && report.after.worst_mean_ratio > report.before.worst_mean_ratio);
//! ```
//!
//! Not guaranteed: any angle. If the boundary has bad triangles, or bodies are thinner than its
//! triangles, tets are bad too. Edge lengths are not adapted to the size field: it only limits
//! collapses and insertions.

mod blocks;
mod collapse;
mod complex;
mod insert;
mod legality;
mod limits;
mod objective;
mod reconnect;
mod repair;
mod schedule;
mod settings;
mod smooth;
mod swap;

#[cfg(test)]
mod samples;

pub use legality::{GeometrySmoothness, Smoothness, surface_normal, tangent_of_normals};
pub use objective::Measure;
pub use schedule::{Report, improve, improve_for, make_refinable};
pub use settings::{Effort, InsertionSteps, Settings};

#[cfg(test)]
mod tests;

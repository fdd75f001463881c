//! Improvement of a tetrahedral mesh inside its boundary.
//!
//! Boundary triangles, segments and their vertices stay; everything else may change. The **score** of a tet is
//! its shape: by default the mean ratio of the worst tet that ever comes of it by refinement
//! ([`Measure::Refined`]). A change is made only if it raises the worst score of the tets that it touches, so
//! the worst of the mesh never falls, and every tet stays positive by exact sign. There are six tools, all of which
//! but the first fill a **hole** anew:
//!
//! * `smooth` moves a vertex;
//! * `swap` removes an edge, or the faces between two vertices;
//! * `collapse` merges a vertex into a neighbour;
//! * `insert` fills a hole round a new vertex;
//! * `reconnect` fills a hole with the best tets between its vertices;
//! * `repair` uses the others where a tet is *illegal*.
//!
//! Swaps come first: a sliver is mostly a matter of how its neighbourhood is cut into tets, and to bend its neighbours
//! instead costs more and leaves them worse. Large meshes are cut into `blocks`, which are improved in parallel.
//!
//! [`make_refinable`] is [`improve()`] for a coarse mesh that will be refined and snapped to the geometry. It also knows
//! of **illegal** tets, which would flatten at a vertex whatever their shape is now (`legality`): their score is below
//! that of every legal tet. And a tet loses score for corners that would shrink much, or turn over (`limits`).
//!
//! ```
//! use tetmill::improve::{Settings, improve};
//! use tetmill::mesh::{Class, Mesh, VertexId};
//! use tetmill::size::UniformSize;
//! # use csg::BodyId;
//! // A long edge with four flat tets round it: other tets on the same six vertices are better.
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
//! Not promised: any angle. Where the boundary has bad triangles, or bodies are thinner than them, tets are bad too. Nor
//! does it make edges as long as the size field says: it only keeps collapses and insertions from making them worse.

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
mod smooth;
mod swap;

#[cfg(test)]
mod samples;

pub use legality::{GeometrySmoothness, Smoothness};
pub use objective::Measure;
pub use schedule::{Effort, Report, Settings, improve, make_refinable};

#[cfg(test)]
mod tests;

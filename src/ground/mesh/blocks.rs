//! A part in blocks of bounded size, for programs that cannot store all of it at once.

use super::GlobalId;
use super::stream::{MeshStream, TetBlock};
use csg::BodyId;

/// A block of tets of a part.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tets {
    /// Index of the first tet in the part; the others are consecutive.
    pub first: u64,
    /// Vertices by local index, positively oriented.
    pub tets: Vec<[u32; 4]>,
    /// Global ids.
    pub ids: Vec<GlobalId>,
    /// Bodies.
    pub bodies: Vec<BodyId>,
}

/// A block of vertices of a part.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Vertices {
    /// Local index of the first vertex; the others are consecutive.
    pub first: u32,
    /// Coordinates.
    pub points: Vec<[f64; 3]>,
    /// Global ids.
    pub ids: Vec<GlobalId>,
}

/// *Local.* The tets of a part in blocks of at most `size`.
///
/// # Panics
/// If `size` is 0.
pub fn tets(part: &dyn MeshStream, size: usize) -> impl Iterator<Item = Tets> + '_ {
    assert!(size > 0, "blocks of no tets");
    let mut block = TetBlock::default();
    let (mut next, mut taken, mut first) = (0, 0, 0);
    std::iter::from_fn(move || {
        let mut out = Tets { first, ..Tets::default() };
        while out.tets.len() < size {
            if taken == block.tets.len() {
                if next == part.tet_blocks() {
                    break;
                }
                part.tet_block(next, &mut block);
                (next, taken) = (next + 1, 0);
            }
            let end = block.tets.len().min(taken + size - out.tets.len());
            out.tets.extend_from_slice(&block.tets[taken..end]);
            out.ids.extend(block.first_id + taken as u64..block.first_id + end as u64);
            out.bodies.resize(out.tets.len(), block.body.expect("a tet block has a body"));
            taken = end;
        }
        first += out.tets.len() as u64;
        (!out.tets.is_empty()).then_some(out)
    })
}

/// *Local.* The vertices of a part in blocks of at most `size`.
///
/// # Panics
/// If `size` is 0.
pub fn vertices(part: &dyn MeshStream, size: usize) -> impl Iterator<Item = Vertices> + '_ {
    assert!(size > 0, "blocks of no vertices");
    let mut points = Vec::new();
    let mut ids = 0..0;
    let (mut next, mut taken, mut first) = (0, 0, 0);
    std::iter::from_fn(move || {
        let mut out = Vertices { first, ..Vertices::default() };
        while out.points.len() < size {
            if taken == points.len() {
                if next == part.vertex_blocks() {
                    break;
                }
                points.clear();
                points.extend_from_slice(&part.vertex_points(next));
                ids = part.vertex_block(next).ids();
                (next, taken) = (next + 1, 0);
            }
            let end = points.len().min(taken + size - out.points.len());
            out.points.extend_from_slice(&points[taken..end]);
            out.ids.extend(ids.start + taken as u64..ids.start + end as u64);
            taken = end;
        }
        first += out.points.len() as u32;
        (!out.points.is_empty()).then_some(out)
    })
}

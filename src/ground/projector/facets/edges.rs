//! The edges of a triangulated surface, each with any number of triangles.

use rayon::prelude::*;

/// The use of an edge by a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Use {
    /// The ends, the lower number first.
    pub ends: [u32; 2],
    /// The triangle.
    pub triangle: u32,
    /// The side of the triangle: the corner opposite the edge.
    pub side: u8,
    /// Whether the triangle's orientation goes from the lower to the higher end.
    pub along: bool,
}

/// All edges; the uses of each are consecutive, ordered by triangle.
#[derive(Clone, Debug, Default)]
pub(crate) struct Edges {
    pub uses: Vec<Use>,
    /// The index of the first use of each edge, and the number of all uses.
    pub starts: Vec<u32>,
    /// The edge by triangle and side.
    pub of_side: Vec<[u32; 3]>,
}

impl Edges {
    pub fn new(triangles: &[[u32; 3]]) -> Self {
        let mut uses = Vec::with_capacity(3 * triangles.len());
        for (t, v) in triangles.iter().enumerate() {
            for side in 0..3 {
                let (a, b) = (v[(side + 1) % 3], v[(side + 2) % 3]);
                let ends = [a.min(b), a.max(b)];
                uses.push(Use { ends, triangle: t as u32, side: side as u8, along: a < b });
            }
        }
        uses.par_sort_unstable();
        let mut edges = Self { uses, starts: vec![0], of_side: vec![[0; 3]; triangles.len()] };
        for uses in edges.uses.chunk_by(|a, b| a.ends == b.ends) {
            let edge = edges.starts.len() as u32 - 1;
            for u in uses {
                edges.of_side[u.triangle as usize][u.side as usize] = edge;
            }
            edges.starts.push(edges.starts[edge as usize] + uses.len() as u32);
        }
        edges
    }

    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// The uses of an edge.
    pub fn uses(&self, edge: usize) -> &[Use] {
        &self.uses[self.starts[edge] as usize..self.starts[edge + 1] as usize]
    }

    /// The two triangles at an edge, if there are two.
    pub fn pair(&self, edge: usize) -> Option<[u32; 2]> {
        match self.uses(edge) {
            [a, b] => Some([a.triangle, b.triangle]),
            _ => None,
        }
    }
}

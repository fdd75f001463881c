//! The edges and faces that must stay in the mesh: those of the surface, and the parts of split
//! ones.

use super::tetrahedra::Tetrahedra;
use crate::ground::kernel::hash::WordHash;
use crate::ground::kernel::simplex::ascending;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// A triangle of the surface, or a part of it if Steiner points split it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    /// Its vertices, oriented as its triangle.
    pub vertices: [u32; 3],
    /// The triangle of the surface that contains it.
    pub triangle: u32,
    /// Whether it was replaced by other facets.
    pub gone: bool,
}

/// The surface entity that a Steiner point lies on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// The surface edge between these vertices, the lower one first.
    Edge([u32; 2]),
    /// The interior of this triangle.
    Triangle(u32),
}

/// The facets and their edges. Hash maps are only looked up, never iterated, so results are
/// reproducible.
#[derive(Clone, Debug, Default)]
pub(super) struct Constraints {
    pub facets: Vec<Facet>,
    by_vertices: HashMap<[u32; 3], u32, WordHash>,
    /// The number of facets that use each edge, plus one if it is kept.
    edge_uses: HashMap<[u32; 2], u32, WordHash>,
    /// The surface entity of each vertex after those of the surface, if it lies on one.
    places: Vec<Option<Place>>,
    /// The facets at each Steiner point, including gone ones.
    at_steiner: BTreeMap<u32, Vec<u32>>,
    /// Vertices below this number are vertices of the surface.
    surface_vertices: u32,
    /// Edges that must stay without a facet, the lower vertex first.
    kept: BTreeSet<[u32; 2]>,
}

impl Constraints {
    /// Makes one facet of each triangle.
    pub fn new(triangles: &[[u32; 3]]) -> Self {
        let surface_vertices = 1 + triangles.iter().flatten().copied().max().unwrap_or(0);
        let mut constraints = Self { surface_vertices, ..Self::default() };
        constraints.by_vertices.reserve(triangles.len());
        constraints.edge_uses.reserve(triangles.len() * 3 / 2);
        for (t, &vertices) in triangles.iter().enumerate() {
            constraints.add(vertices, t as u32);
        }
        constraints
    }

    /// Adds a facet of a triangle; returns its number.
    pub fn add(&mut self, vertices: [u32; 3], triangle: u32) -> u32 {
        let facet = self.facets.len() as u32;
        self.facets.push(Facet { vertices, triangle, gone: false });
        self.by_vertices.insert(ascending(vertices), facet);
        for edge in edges(vertices) {
            *self.edge_uses.entry(edge).or_insert(0) += 1;
        }
        for v in vertices.into_iter().filter(|&v| v >= self.surface_vertices) {
            self.at_steiner.entry(v).or_default().push(facet);
        }
        facet
    }

    /// Removes a facet; an edge is released with the last facet that uses it.
    pub fn remove(&mut self, facet: u32) {
        let f = &mut self.facets[facet as usize];
        f.gone = true;
        let vertices = f.vertices;
        self.by_vertices.remove(&ascending(vertices));
        for edge in edges(vertices) {
            self.release(edge);
        }
    }

    /// The facet with these vertices.
    #[inline]
    pub fn facet(&self, face: [u32; 3]) -> Option<u32> {
        self.by_vertices.get(&ascending(face)).copied()
    }

    /// The faces of a mesh that are facets: from one side each, with the facet, ascending.
    pub fn faces_in(&self, mesh: &Tetrahedra) -> Vec<(u32, u32)> {
        let once = mesh.half_faces().filter(|&h| h < mesh.across(h));
        once.filter_map(|h| Some((h, self.facet(mesh.face(h))?))).collect()
    }

    /// Whether these are the ends of an edge of a facet.
    #[inline]
    pub fn has_edge(&self, a: u32, b: u32) -> bool {
        self.edge_uses.contains_key(&[a.min(b), a.max(b)])
    }

    /// Keeps an edge, whether a facet uses it or not.
    pub fn keep_edge(&mut self, a: u32, b: u32) {
        let edge = [a.min(b), a.max(b)];
        if self.kept.insert(edge) {
            *self.edge_uses.entry(edge).or_insert(0) += 1;
        }
    }

    /// Undoes [`Constraints::keep_edge`].
    pub fn forget_edge(&mut self, a: u32, b: u32) {
        let edge = [a.min(b), a.max(b)];
        if self.kept.remove(&edge) {
            self.release(edge);
        }
    }

    /// The edges that must stay without a facet, sorted.
    pub fn kept_edges(&self) -> Vec<[u32; 2]> {
        self.kept.iter().copied().collect()
    }

    /// The other ends of the kept edges at a vertex, ascending.
    pub fn kept_neighbours(&self, vertex: u32) -> Vec<u32> {
        let at = self.kept.iter().filter(|edge| edge.contains(&vertex));
        at.map(|&[a, b]| if a == vertex { b } else { a }).collect()
    }

    /// The whole edge that contains a segment of a kept edge.
    pub fn line_of(&self, a: u32, b: u32) -> [u32; 2] {
        let split = [a, b].iter().find_map(|&v| self.edge_at(v));
        split.unwrap_or([a.min(b), a.max(b)])
    }

    fn release(&mut self, edge: [u32; 2]) {
        let uses = self.edge_uses.get_mut(&edge).expect("an edge in use");
        *uses -= 1;
        if *uses == 0 {
            self.edge_uses.remove(&edge);
        }
    }

    /// Whether a vertex belongs to the input surface.
    pub fn is_of_surface(&self, v: u32) -> bool {
        v < self.surface_vertices
    }

    /// Stores the surface entity of a Steiner point.
    pub fn set_place(&mut self, p: u32, place: Place) {
        let i = (p - self.surface_vertices) as usize;
        self.places.resize(self.places.len().max(i + 1), None);
        self.places[i] = Some(place);
    }

    fn place(&self, v: u32) -> Option<Place> {
        let i = v.checked_sub(self.surface_vertices)?;
        self.places.get(i as usize).copied().flatten()
    }

    /// The surface edge that a Steiner point lies on, if any.
    fn edge_at(&self, v: u32) -> Option<[u32; 2]> {
        match self.place(v)? {
            Place::Edge(edge) => Some(edge),
            Place::Triangle(_) => None,
        }
    }

    /// Clears the surface entity of a Steiner point that was removed from the surface.
    pub fn forget_place(&mut self, p: u32) {
        self.places[(p - self.surface_vertices) as usize] = None;
    }

    /// The facets in use, ascending.
    pub fn alive(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.facets.len() as u32).filter(|&f| !self.facets[f as usize].gone)
    }

    /// The facets in use at a Steiner point, ascending.
    pub fn facets_at(&self, vertex: u32) -> Vec<u32> {
        let at = self.at_steiner.get(&vertex).into_iter().flatten().copied();
        at.filter(|&f| !self.facets[f as usize].gone).collect()
    }
}

/// The edges of a face, each with its lower vertex first.
pub(super) fn edges([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(|[p, q]| [p.min(q), p.max(q)])
}

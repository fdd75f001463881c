//! Which edges and faces of the mesh must stay: the surface's, and pieces of those that had to be split.

use super::tetrahedra::sorted;
use crate::kernel::hash::WordHash;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// A piece of a triangle of the surface: the whole, unless Steiner points split it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    /// Its vertices, in the order of its triangle.
    pub vertices: [u32; 3],
    /// The triangle of the surface that it is part of.
    pub triangle: u32,
    /// Whether it was split or joined: then other facets are in its place.
    pub gone: bool,
}

/// Where on the surface a Steiner point lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// On the edge between these vertices of the surface, the lower first.
    Edge([u32; 2]),
    /// Inside this triangle.
    Triangle(u32),
}

/// The facets and their edges. A vertex, edge or face here is looked up, never iterated in hash order.
#[derive(Clone, Debug, Default)]
pub(super) struct Constraints {
    pub facets: Vec<Facet>,
    by_vertices: HashMap<[u32; 3], u32, WordHash>,
    /// How many facets use each edge.
    edge_uses: HashMap<[u32; 2], u32, WordHash>,
    /// Where each vertex after those of the surface lies on it, if it does.
    places: Vec<Option<Place>>,
    /// The facets at each Steiner point, some of them gone.
    at_steiner: BTreeMap<u32, Vec<u32>>,
    /// The vertices of the surface are those below.
    surface_vertices: u32,
    /// Edges that must stay although no facet needs them, the lower vertex first.
    kept: BTreeSet<[u32; 2]>,
}

impl Constraints {
    /// One facet for each triangle.
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

    /// Adds a facet of a triangle.
    pub fn add(&mut self, vertices: [u32; 3], triangle: u32) -> u32 {
        let facet = self.facets.len() as u32;
        self.facets.push(Facet { vertices, triangle, gone: false });
        self.by_vertices.insert(sorted(vertices), facet);
        for edge in edges(vertices) {
            *self.edge_uses.entry(edge).or_insert(0) += 1;
        }
        for v in vertices.into_iter().filter(|&v| v >= self.surface_vertices) {
            self.at_steiner.entry(v).or_default().push(facet);
        }
        facet
    }

    /// Takes a facet away; its edges go with the last facet that uses them.
    pub fn remove(&mut self, facet: u32) {
        let f = &mut self.facets[facet as usize];
        f.gone = true;
        let vertices = f.vertices;
        self.by_vertices.remove(&sorted(vertices));
        for edge in edges(vertices) {
            self.release(edge);
        }
    }

    /// The facet with these vertices.
    #[inline]
    pub fn facet(&self, face: [u32; 3]) -> Option<u32> {
        self.by_vertices.get(&sorted(face)).copied()
    }

    /// Whether these are the ends of an edge of a facet.
    #[inline]
    pub fn has_edge(&self, a: u32, b: u32) -> bool {
        self.edge_uses.contains_key(&[a.min(b), a.max(b)])
    }

    /// From now on the edge is one that must stay, whether a facet uses it or not.
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

    /// The edges that must stay although no facet needs them, sorted.
    pub fn kept_edges(&self) -> Vec<[u32; 2]> {
        self.kept.iter().copied().collect()
    }

    /// The other ends of the kept edges at a vertex, ascending.
    pub fn kept_neighbours(&self, vertex: u32) -> Vec<u32> {
        let at = self.kept.iter().filter(|edge| edge.contains(&vertex));
        at.map(|&[a, b]| if a == vertex { b } else { a }).collect()
    }

    /// The whole edge that a piece of a kept one is part of.
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

    /// Whether a vertex was given with the surface.
    pub fn is_of_surface(&self, v: u32) -> bool {
        v < self.surface_vertices
    }

    /// Notes where on the surface a Steiner point lies.
    pub fn set_place(&mut self, p: u32, place: Place) {
        let i = (p - self.surface_vertices) as usize;
        self.places.resize(self.places.len().max(i + 1), None);
        self.places[i] = Some(place);
    }

    fn place(&self, v: u32) -> Option<Place> {
        let i = v.checked_sub(self.surface_vertices)?;
        self.places.get(i as usize).copied().flatten()
    }

    /// The edge of the surface that a Steiner point lies on, if it lies on one.
    fn edge_at(&self, v: u32) -> Option<[u32; 2]> {
        match self.place(v)? {
            Place::Edge(edge) => Some(edge),
            Place::Triangle(_) => None,
        }
    }

    /// A Steiner point lies on no triangle any more.
    pub fn forget_place(&mut self, p: u32) {
        self.places[(p - self.surface_vertices) as usize] = None;
    }

    /// The facets in use, in ascending order.
    pub fn alive(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.facets.len() as u32).filter(|&f| !self.facets[f as usize].gone)
    }

    /// The facets at a Steiner point, in ascending order.
    pub fn facets_at(&self, vertex: u32) -> Vec<u32> {
        let at = self.at_steiner.get(&vertex).into_iter().flatten().copied();
        at.filter(|&f| !self.facets[f as usize].gone).collect()
    }
}

/// The edges of a face, each with its lower vertex first.
pub(super) fn edges([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(|[p, q]| [p.min(q), p.max(q)])
}

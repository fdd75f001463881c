//! An oriented triangulation with adjacency, without coordinates.
//!
//! A **side** `(t, i)` is the edge of triangle `t` opposite its corner `i`, directed from corner
//! `i+1` to corner `i+2` with the triangle on the left. A side on a curve stores the number of its
//! segment; such sides are never changed.

/// No triangle, no segment.
pub(super) const NONE: u32 = u32::MAX;

/// A triangle with its neighbours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Triangle {
    /// Its corners, counter-clockwise; all [`NONE`] for a removed triangle.
    pub v: [u32; 3],
    /// The triangle across each side.
    pub near: [u32; 3],
    /// The segment on each side, or [`NONE`].
    pub segment: [u32; 3],
}

impl Triangle {
    /// Whether the triangle is part of the triangulation.
    pub fn lives(&self) -> bool {
        self.v[0] != NONE
    }

    /// The index of a corner.
    ///
    /// # Panics
    /// If the vertex is not one of its corners.
    pub fn corner(&self, v: u32) -> usize {
        self.v.iter().position(|&x| x == v).expect("the vertex is a corner of the triangle")
    }

    /// The index of the side directed from `a` to `b`.
    fn side(&self, a: u32, b: u32) -> Option<usize> {
        (0..3).find(|&i| self.v[next(i)] == a && self.v[last(i)] == b)
    }
}

/// The index after `i` modulo three.
pub(super) fn next(i: usize) -> usize {
    if i == 2 { 0 } else { i + 1 }
}

/// The index before `i` modulo three.
pub(super) fn last(i: usize) -> usize {
    if i == 0 { 2 } else { i - 1 }
}

/// The triangles of an oriented surface with or without boundary.
#[derive(Clone, Debug, Default)]
pub(super) struct Topology {
    /// All triangles, including removed ones.
    pub triangles: Vec<Triangle>,
    /// A triangle at each vertex, or [`NONE`].
    star: Vec<u32>,
    removed: Vec<u32>,
}

impl Topology {
    /// Links triangles along common edges; `None` if two triangles have the same directed edge.
    pub fn from_triangles(vertices: usize, list: &[[u32; 3]]) -> Option<Self> {
        let mut star = vec![NONE; vertices];
        let mut sides = Vec::with_capacity(3 * list.len());
        for (t, v) in list.iter().enumerate() {
            for i in 0..3 {
                star[v[i] as usize] = t as u32;
                let (a, b) = (v[next(i)], v[last(i)]);
                sides.push((a.min(b), a.max(b), a > b, t as u32, i));
            }
        }
        sides.sort_unstable();
        if sides.windows(2).any(|w| (w[0].0, w[0].1, w[0].2) == (w[1].0, w[1].1, w[1].2)) {
            return None;
        }
        let unlinked = |&v: &[u32; 3]| Triangle { v, near: [NONE; 3], segment: [NONE; 3] };
        let mut triangles: Vec<_> = list.iter().map(unlinked).collect();
        for w in sides.windows(2) {
            if (w[0].0, w[0].1) == (w[1].0, w[1].1) {
                triangles[w[0].3 as usize].near[w[0].4] = w[1].3;
                triangles[w[1].3 as usize].near[w[1].4] = w[0].3;
            }
        }
        Some(Self { triangles, star, removed: Vec::new() })
    }

    /// The triangle with this index.
    #[inline]
    pub fn at(&self, t: u32) -> &Triangle {
        &self.triangles[t as usize]
    }

    /// The triangles that were not removed, ascending.
    pub fn living(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.triangles.len() as u32).filter(|&t| self.at(t).lives())
    }

    /// Adds a vertex without triangles; returns its number.
    pub fn add_vertex(&mut self) -> u32 {
        self.star.push(NONE);
        self.star.len() as u32 - 1
    }

    /// The same side in the adjacent triangle.
    pub fn twin(&self, t: u32, i: usize) -> Option<(u32, usize)> {
        let u = self.at(t).near[i];
        if u == NONE {
            return None;
        }
        let v = &self.at(t).v;
        let j = self.at(u).side(v[last(i)], v[next(i)]).expect("neighbours share an edge");
        Some((u, j))
    }

    /// Collects the triangles around a vertex: all of an interior vertex, counter-clockwise; one
    /// fan of a boundary vertex.
    pub fn around(&self, v: u32, ring: &mut Vec<u32>) {
        ring.clear();
        let first = self.star[v as usize];
        if first == NONE {
            return;
        }
        let mut t = first;
        loop {
            ring.push(t);
            let triangle = self.at(t);
            t = triangle.near[next(triangle.corner(v))];
            if t == first {
                return;
            }
            if t == NONE {
                break;
            }
        }
        // An open fan: triangles clockwise of the first one come before it.
        ring.reverse();
        t = first;
        loop {
            let triangle = self.at(t);
            t = triangle.near[last(triangle.corner(v))];
            if t == NONE {
                break;
            }
            ring.push(t);
        }
        ring.reverse();
    }

    /// Whether a vertex is in a triangle.
    pub fn is_used(&self, v: u32) -> bool {
        self.star[v as usize] != NONE
    }

    /// The side from `a` to `b`, searched around `a`.
    pub fn find(&self, a: u32, b: u32, ring: &mut Vec<u32>) -> Option<(u32, usize)> {
        self.around(a, ring);
        ring.iter().find_map(|&t| self.at(t).side(a, b).map(|i| (t, i)))
    }

    /// Sets the segment of a side and its twin.
    pub fn set_segment(&mut self, t: u32, i: usize, segment: u32) {
        if let Some((u, j)) = self.twin(t, i) {
            self.triangles[u as usize].segment[j] = segment;
        }
        self.triangles[t as usize].segment[i] = segment;
    }

    /// Swaps the diagonal of the two triangles at a side. With p opposite to the side a→b and d
    /// opposite to its twin, `t` becomes (p, a, d) and its neighbour (p, d, b).
    pub fn flip(&mut self, t: u32, i: usize) {
        let (u, j) = self.twin(t, i).expect("a side with two triangles");
        let (x, y) = (*self.at(t), *self.at(u));
        debug_assert!(x.segment[i] == NONE);
        let [p, a, b, d] = [x.v[i], x.v[next(i)], x.v[last(i)], y.v[j]];
        self.triangles[t as usize] = Triangle {
            v: [p, a, d],
            near: [y.near[next(j)], u, x.near[last(i)]],
            segment: [y.segment[next(j)], NONE, x.segment[last(i)]],
        };
        self.triangles[u as usize] = Triangle {
            v: [p, d, b],
            near: [y.near[last(j)], x.near[next(i)], t],
            segment: [y.segment[last(j)], x.segment[next(i)], NONE],
        };
        self.relink(y.near[next(j)], d, a, t);
        self.relink(x.near[next(i)], p, b, u);
        for (v, s) in [(p, t), (a, t), (d, t), (b, u)] {
            self.star[v as usize] = s;
        }
    }

    /// Sets `t` as the neighbour of triangle `n` across its side from `a` to `b`.
    fn relink(&mut self, n: u32, a: u32, b: u32, t: u32) {
        if n != NONE {
            let i = self.at(n).side(a, b).expect("neighbours share an edge");
            self.triangles[n as usize].near[i] = t;
        }
    }

    /// The index of a removed triangle, or of a new one.
    fn new_slot(&mut self) -> u32 {
        let blank = Triangle { v: [NONE; 3], near: [NONE; 3], segment: [NONE; 3] };
        self.removed.pop().unwrap_or_else(|| {
            self.triangles.push(blank);
            self.triangles.len() as u32 - 1
        })
    }

    /// Inserts a vertex into a triangle; returns the three new triangles, each with the vertex as
    /// its last corner.
    pub fn split_triangle(&mut self, t: u32, v: u32) -> [u32; 3] {
        let x = *self.at(t);
        let parts = [t, self.new_slot(), self.new_slot()];
        for k in 0..3 {
            // Triangle k keeps the side from corner k to corner k+1, opposite to corner k+2.
            let (a, b) = (x.v[k], x.v[next(k)]);
            self.triangles[parts[k] as usize] = Triangle {
                v: [a, b, v],
                near: [parts[next(k)], parts[last(k)], x.near[last(k)]],
                segment: [NONE, NONE, x.segment[last(k)]],
            };
            self.relink(x.near[last(k)], b, a, parts[k]);
            self.star[a as usize] = parts[k];
        }
        self.star[v as usize] = t;
        parts
    }

    /// Inserts a vertex on an edge that is not a segment; returns the triangles around it, each
    /// with the vertex as its last corner.
    pub fn split_side(&mut self, t: u32, i: usize, v: u32) -> [u32; 4] {
        let (u, j) = self.twin(t, i).expect("a side with two triangles");
        let (x, y) = (*self.at(t), *self.at(u));
        debug_assert!(x.segment[i] == NONE);
        let [p, a, b, d] = [x.v[i], x.v[next(i)], x.v[last(i)], y.v[j]];
        let parts = [t, self.new_slot(), u, self.new_slot()];
        let outer = [
            (p, a, x.near[last(i)], x.segment[last(i)]),
            (a, d, y.near[next(j)], y.segment[next(j)]),
            (d, b, y.near[last(j)], y.segment[last(j)]),
            (b, p, x.near[next(i)], x.segment[next(i)]),
        ];
        for (k, &(from, to, near, segment)) in outer.iter().enumerate() {
            self.triangles[parts[k] as usize] = Triangle {
                v: [from, to, v],
                near: [parts[(k + 1) % 4], parts[(k + 3) % 4], near],
                segment: [NONE, NONE, segment],
            };
            self.relink(near, to, from, parts[k]);
            self.star[from as usize] = parts[k];
        }
        self.star[v as usize] = t;
        parts
    }

    /// Collapses the side from a to b into b. Vertex a must be interior and on no segment, and has
    /// no triangles afterwards.
    ///
    /// The caller guarantees that the result is a triangulation.
    pub fn collapse(&mut self, t: u32, i: usize, ring: &mut Vec<u32>) {
        let (u, j) = self.twin(t, i).expect("a side with two triangles");
        let (a, b) = (self.at(t).v[next(i)], self.at(t).v[last(i)]);
        self.around(a, ring);
        // The sides of t and u at a (opposite b), and those at b (opposite a).
        for (gone, apex, at_a, at_b) in [(t, i, last(i), next(i)), (u, j, next(j), last(j))] {
            let x = *self.at(gone);
            debug_assert!(x.segment[at_a] == NONE);
            let (m, n) = (x.near[at_a], x.near[at_b]);
            let p = x.v[apex];
            let towards =
                |y: &Triangle, q: u32| (0..3).find(|&k| y.v[k] != p && y.v[k] != q).expect("a third corner");
            let k = towards(self.at(m), a);
            self.triangles[m as usize].near[k] = n;
            self.triangles[m as usize].segment[k] = x.segment[at_b];
            if n != NONE {
                let k = towards(self.at(n), b);
                self.triangles[n as usize].near[k] = m;
            }
            self.star[p as usize] = m;
            self.star[b as usize] = m;
        }
        for &s in ring.iter() {
            let k = self.at(s).corner(a);
            self.triangles[s as usize].v[k] = b;
        }
        for gone in [t, u] {
            self.triangles[gone as usize] = Triangle { v: [NONE; 3], near: [NONE; 3], segment: [NONE; 3] };
            self.removed.push(gone);
        }
        self.star[a as usize] = NONE;
    }

    /// Keeps the triangles marked in `keep` and renumbers the vertices.
    pub fn retain(&mut self, keep: &[bool], old_to_new_vertex: &[u32], vertices: usize) {
        let mut old_to_new = vec![NONE; self.triangles.len()];
        let mut kept = Vec::new();
        for t in 0..self.triangles.len() {
            if keep[t] && self.triangles[t].lives() {
                old_to_new[t] = kept.len() as u32;
                kept.push(self.triangles[t]);
            }
        }
        self.star = vec![NONE; vertices];
        for (t, x) in kept.iter_mut().enumerate() {
            x.v = x.v.map(|v| old_to_new_vertex[v as usize]);
            x.near = x.near.map(|n| if n == NONE { NONE } else { old_to_new[n as usize] });
            for v in x.v {
                self.star[v as usize] = t as u32;
            }
        }
        self.triangles = kept;
        self.removed.clear();
    }

    /// Asserts that adjacency is consistent.
    #[cfg(test)]
    pub fn check(&self) {
        for t in self.living() {
            for i in 0..3 {
                let x = self.at(t);
                if let Some((u, j)) = self.twin(t, i) {
                    assert_eq!(self.at(u).near[j], t, "triangle {t} side {i}");
                    assert_eq!(self.at(u).segment[j], x.segment[i], "triangle {t} side {i}");
                }
                let s = self.star[x.v[i] as usize];
                assert!(s != NONE && self.at(s).v.contains(&x.v[i]), "the star of {}", x.v[i]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::mesh::TET_FACES;

    /// The boundary of a tet: closed, all vertices of degree three.
    fn tet() -> Topology {
        let faces = TET_FACES.map(|f| f.map(|v| v as u32));
        Topology::from_triangles(4, &faces).expect("a closed surface")
    }

    fn euler(mesh: &Topology) -> i64 {
        let faces = mesh.living().count() as i64;
        let vertices = mesh.star.iter().filter(|&&t| t != NONE).count() as i64;
        vertices - faces / 2
    }

    #[test]
    fn splits_flips_and_collapses_keep_a_sphere_a_sphere() {
        let mut mesh = tet();
        let mut ring = Vec::new();
        let v = mesh.add_vertex();
        mesh.split_triangle(0, v);
        mesh.check();
        let w = mesh.add_vertex();
        let (t, i) = mesh.find(v, 1, &mut ring).expect("an edge");
        mesh.split_side(t, i, w);
        mesh.check();
        assert_eq!(euler(&mesh), 2);
        let (t, i) = mesh.find(w, v, &mut ring).expect("an edge");
        mesh.flip(t, i);
        mesh.check();
        assert_eq!(mesh.find(w, v, &mut ring), None);
        let other = mesh.at(ring[0]).v.into_iter().find(|&x| x != w).expect("a neighbour");
        let (t, i) = mesh.find(w, other, &mut ring).expect("an edge");
        mesh.collapse(t, i, &mut ring);
        mesh.check();
        assert_eq!(euler(&mesh), 2);
    }

    #[test]
    fn two_triangles_with_one_directed_edge_are_refused() {
        assert!(Topology::from_triangles(4, &[[0, 1, 2], [0, 1, 3]]).is_none());
    }
}

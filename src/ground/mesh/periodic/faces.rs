//! The triangles on periodic patches, whichever mesh or rank they come from.

use super::{Link, MapError, Pair, Pairs};
use crate::Point;
use crate::ground::kernel::places::Places;
use crate::ground::mesh::{GlobalId, Mesh, VertexId, sorted_face, topology};
use csg::PatchId;
use std::collections::BTreeMap;

/// A triangle on a periodic patch, by global ids.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct PeriodicFace {
    /// Its patch.
    pub patch: PatchId,
    /// Its vertices, ascending.
    pub vertices: [GlobalId; 3],
    /// The face.
    pub face: GlobalId,
    /// The edges between the vertices 0 and 1, 0 and 2, 1 and 2.
    pub edges: [GlobalId; 3],
}

/// The triangles on periodic patches, and the places of their vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct PeriodicFaces {
    /// The triangles.
    pub faces: Vec<PeriodicFace>,
    /// The vertices.
    pub points: BTreeMap<GlobalId, Point>,
}

/// The edges of a triangle, by corners.
const EDGES: [[usize; 2]; 3] = [[0, 1], [0, 2], [1, 2]];

impl PeriodicFaces {
    /// Those of a mesh, with edges and faces numbered as in `distribute`.
    pub fn of(mesh: &Mesh, links: &[Link]) -> Self {
        let edges = topology::edges(mesh.points.len(), &mesh.tets).edges;
        let faces = topology::faces(mesh.points.len(), &mesh.tets).faces;
        let mut found = Self::default();
        for triangle in mesh.triangles.iter().filter(|t| is_linked(links, t.patch)) {
            let vertices = sorted_face(triangle.vertices);
            let edge = |[i, j]: [usize; 2]| edges.binary_search(&[vertices[i], vertices[j]]);
            found.faces.push(PeriodicFace {
                patch: triangle.patch,
                vertices: vertices.map(|v| v.0.into()),
                face: faces.binary_search(&vertices).expect("a triangle is a face of a tet") as GlobalId,
                edges: EDGES.map(|ends| edge(ends).expect("an edge of a face") as GlobalId),
            });
            let point = |v: VertexId| (GlobalId::from(v.0), mesh.points[v.index()]);
            found.points.extend(vertices.map(point));
        }
        found
    }

    /// The pairs of a patch and its copy, within `distance`.
    pub(super) fn pairs(&self, link: &Link, distance: f64) -> Result<Pairs, MapError> {
        let on = |patch: PatchId| self.faces.iter().filter(move |face| face.patch == patch);
        let vertices = |patch: PatchId| {
            let mut vertices: Vec<GlobalId> = on(patch).flat_map(|face| face.vertices).collect();
            vertices.sort_unstable();
            vertices.dedup();
            vertices
        };
        let images = vertices(link.image);
        let places = Places::new((0..).zip(images.iter().map(|v| self.points[v])), distance);
        let mut image_of: BTreeMap<GlobalId, GlobalId> = BTreeMap::new();
        for vertex in vertices(link.of) {
            let place = self.points[&vertex];
            let image = places.find(&(link.motion * place));
            let image = image.ok_or(MapError::Vertex { vertex, place, patch: link.image })?;
            image_of.insert(vertex, images[image as usize]);
        }
        let mut pairs: [Vec<Pair>; 3] = Default::default();
        pairs[0].extend(image_of.iter().map(|(of, image)| pair(*image, *of, [*image])));
        let copies: BTreeMap<[GlobalId; 3], &PeriodicFace> =
            on(link.image).map(|face| (face.vertices, face)).collect();
        for of in on(link.of) {
            let images = of.vertices.map(|v| image_of[&v]);
            let mut sorted = images;
            sorted.sort_unstable();
            let Some(copy) = copies.get(&sorted) else {
                let place = link.motion * self.points[&of.vertices[0]];
                return Err(MapError::Triangle { patch: link.image, place });
            };
            pairs[2].push(pair(copy.face, of.face, images));
            for (edge, [i, j]) in of.edges.into_iter().zip(EDGES) {
                let ends = [images[i], images[j]];
                let [p, q] = ends.map(|end| sorted.iter().position(|v| *v == end).expect("a corner"));
                pairs[1].push(pair(copy.edges[p + q - 1], edge, ends));
            }
        }
        for kind in &mut pairs {
            kind.sort_unstable();
            kind.dedup();
        }
        // As many distinct copies as triangles: then each triangle has one.
        let different = pairs[2].chunk_by(|a, b| a.image == b.image).count();
        if different != copies.len() || different != on(link.of).count() {
            let place = images.first().map_or(Point::origin(), |v| self.points[v]);
            return Err(MapError::Triangle { patch: link.image, place });
        }
        Ok(Pairs(pairs))
    }
}

/// Whether a patch is a periodic copy or has one.
pub(crate) fn is_linked(links: &[Link], patch: PatchId) -> bool {
    links.iter().any(|link| link.of == patch || link.image == patch)
}

/// The pair of two entities, from their ids and the copies of the ascending vertices of the master.
fn pair<const N: usize>(image: GlobalId, of: GlobalId, images: [GlobalId; N]) -> Pair {
    let mut sorted = images;
    sorted.sort_unstable();
    let mut corners = [0, 1, 2];
    for (corner, vertex) in corners.iter_mut().zip(sorted) {
        *corner = images.iter().position(|v| *v == vertex).expect("one of them") as u8;
    }
    Pair { image, of, corners }
}

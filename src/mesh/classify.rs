//! A classified mesh from tets, their bodies and the triangles that a file names.
//!
//! Files of other programs say at best which triangles lie on which boundary. The rest follows: faces that bound a body
//! and are not named become patches of their own; edges where the patches change, or where not
//! two triangles meet, lie on curves, one for each set of patches that meet; vertices where curves end or branch are corners.

use super::topology::{face_tets, faces};
use super::{BoundaryTriangle, Class, Mesh, Names, Segment, TET_FACES, VertexId};
use crate::Point;
use csg::{BodyId, CornerId, CurveId, PatchId};
use std::collections::BTreeMap;

/// What makes tets and named triangles no mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ClassifyError {
    /// Three or more tets share a face.
    #[error("more than two tets have the face of the vertices {vertices:?} (counted from 0) at {place:?}")]
    FaceOfThreeTets {
        /// Its vertices.
        vertices: [u32; 3],
        /// Its first vertex.
        place: [f64; 3],
    },
    /// A named triangle is not a face of any tet.
    #[error(
        "boundary triangle {triangle} with the vertices {vertices:?} (counted from 0) at {place:?} is no face of a tet"
    )]
    NotAFace {
        /// Its index among the named ones.
        triangle: usize,
        /// Its vertices.
        vertices: [u32; 3],
        /// Its first vertex.
        place: [f64; 3],
    },
    /// A face is named for two boundaries.
    #[error(
        "boundary triangle {triangle} with the vertices {vertices:?} (counted from 0) at {place:?} is named for \
         two boundaries"
    )]
    NamedTwice {
        /// The index of the second one.
        triangle: usize,
        /// Its vertices.
        vertices: [u32; 3],
        /// Its first vertex.
        place: [f64; 3],
    },
}

/// Tets that have no geometry, with what is known of their boundary.
#[derive(Clone, Debug, Default)]
pub struct Unclassified {
    /// The vertices' coordinates.
    pub points: Vec<Point>,
    /// The tets, positively oriented.
    pub tets: Vec<[VertexId; 4]>,
    /// The body of each tet.
    pub bodies: Vec<BodyId>,
    /// Faces that are named as part of a boundary, in any orientation.
    pub triangles: Vec<BoundaryTriangle>,
    /// Numbers and names of the bodies and of the boundaries that are named.
    pub names: Names,
}

/// Finds the boundary triangles that are not named, the segments, and the classes of the vertices.
///
/// Triangles are turned to point out of the first of the two bodies beside them, or into the exterior. What is not named gets new patches
/// behind the others: one for the exterior, and one for each pair of bodies.
///
/// # Errors
/// Faces of three tets; named triangles that are no faces, or that two boundaries name.
pub fn classify(input: Unclassified) -> Result<(Mesh, Names), ClassifyError> {
    let Unclassified { points, tets, bodies, triangles: named, mut names } = input;
    let place = |v: VertexId| points[v.index()].into();
    let listed = faces(points.len(), &tets);
    let sides = face_tets(listed.faces.len(), &listed.tet_faces).map_err(|face| {
        let face = listed.faces[face.index()];
        ClassifyError::FaceOfThreeTets { vertices: face.map(|v| v.0), place: place(face[0]) }
    })?;

    let mut patches: Vec<Option<PatchId>> = vec![None; listed.faces.len()];
    for (index, triangle) in named.iter().enumerate() {
        let vertices = triangle.vertices.map(|v| v.0);
        let mut ascending = triangle.vertices;
        ascending.sort_unstable();
        let face = listed.faces.binary_search(&ascending).map_err(|_| ClassifyError::NotAFace {
            triangle: index,
            vertices,
            place: place(triangle.vertices[0]),
        })?;
        if patches[face].replace(triangle.patch).is_some_and(|before| before != triangle.patch) {
            let place = place(triangle.vertices[0]);
            return Err(ClassifyError::NamedTwice { triangle: index, vertices, place });
        }
    }

    let body = |tet: u32| (tet != u32::MAX).then(|| bodies[tet as usize]);
    let mut unnamed: BTreeMap<Option<[BodyId; 2]>, PatchId> = BTreeMap::new();
    let mut triangles = Vec::new();
    for (face, (patch, [first, second])) in patches.iter().zip(sides).enumerate() {
        let mut beside = [body(first), body(second)];
        let mut behind = first;
        if beside[1].is_some() && beside[1] < beside[0] {
            beside.swap(0, 1);
            behind = second;
        }
        let patch = match patch {
            Some(patch) => *patch,
            None if beside[0] == beside[1] => continue,
            None => {
                let between = beside[0].zip(beside[1]).map(<[BodyId; 2]>::from);
                *unnamed.entry(between).or_insert_with(|| name_patch(&mut names, beside))
            }
        };
        let tet = behind as usize;
        let k = listed.tet_faces[tet].iter().position(|f| f.index() == face).expect("a face of its tet");
        triangles.push(BoundaryTriangle { vertices: TET_FACES[k].map(|i| tets[tet][i]), patch });
    }
    let segments = segments_between(&triangles);
    let classes = classes_of(points.len(), &tets, &bodies, &triangles, &segments);
    Ok((Mesh { points, classes, tets, bodies, triangles, segments }, names))
}

/// A new patch for faces that no file names.
fn name_patch(names: &mut Names, [behind, front]: [Option<BodyId>; 2]) -> PatchId {
    let patch = PatchId::new(names.patches.len());
    let number = names.patches.iter().map(|(number, _)| number + 1).max().unwrap_or(1);
    let body = |id: BodyId| names.bodies.get(id.index()).map_or("body", |(_, name)| name.as_str());
    let name = match [behind, front] {
        [Some(a), Some(b)] => format!("{}_{}", body(a), body(b)),
        _ => "boundary".to_owned(),
    };
    names.patches.push((number, name));
    patch
}

/// The edges of triangles where patches change or where not two triangles meet, on one curve for each set of patches.
fn segments_between(triangles: &[BoundaryTriangle]) -> Vec<Segment> {
    let mut beside: Vec<([VertexId; 2], PatchId)> = Vec::with_capacity(3 * triangles.len());
    for triangle in triangles {
        let [a, b, c] = triangle.vertices;
        for [v, w] in [[a, b], [b, c], [c, a]] {
            beside.push(([v.min(w), v.max(w)], triangle.patch));
        }
    }
    beside.sort_unstable();
    let mut curves: BTreeMap<Vec<PatchId>, CurveId> = BTreeMap::new();
    let mut segments = Vec::new();
    for group in beside.chunk_by(|a, b| a.0 == b.0) {
        if group.len() == 2 && group[0].1 == group[1].1 {
            continue;
        }
        let next = CurveId::new(curves.len());
        let patches = group.iter().map(|(_, patch)| *patch).collect();
        let curve = *curves.entry(patches).or_insert(next);
        segments.push(Segment { vertices: group[0].0, curve });
    }
    segments
}

/// What each vertex lies on: inside a body, on a patch, on a curve, or at a corner.
fn classes_of(
    vertices: usize,
    tets: &[[VertexId; 4]],
    bodies: &[BodyId],
    triangles: &[BoundaryTriangle],
    segments: &[Segment],
) -> Vec<Class> {
    let mut classes = vec![Class::Body(BodyId(0)); vertices];
    for (tet, body) in tets.iter().zip(bodies) {
        tet.iter().for_each(|v| classes[v.index()] = Class::Body(*body));
    }
    for triangle in triangles {
        triangle.vertices.iter().for_each(|v| classes[v.index()] = Class::Patch(triangle.patch));
    }
    let mut ends: Vec<(VertexId, CurveId)> =
        segments.iter().flat_map(|s| s.vertices.map(|v| (v, s.curve))).collect();
    ends.sort_unstable();
    let mut corners = 0..;
    for group in ends.chunk_by(|a, b| a.0 == b.0) {
        let (vertex, curve) = group[0];
        classes[vertex.index()] = if group.len() == 2 && group[1].1 == curve {
            Class::Curve(curve)
        } else {
            Class::Corner(CornerId::new(corners.next().expect("no end")))
        };
    }
    classes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dist::from_serial;

    /// Two tets on one face, with these bodies.
    fn two_tets(bodies: [u32; 2]) -> Unclassified {
        let points = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [1., 1., 1.]];
        Unclassified {
            points: points.map(Point::from).to_vec(),
            tets: [[0, 1, 2, 3], [1, 2, 3, 4]].map(|tet| tet.map(VertexId)).to_vec(),
            bodies: bodies.map(BodyId).to_vec(),
            triangles: Vec::new(),
            names: Names {
                bodies: (1..=2).map(|n| (n, format!("body{n}"))).collect(),
                patches: vec![(7, "bottom".into())],
            },
        }
    }

    fn named(vertices: [u32; 3]) -> BoundaryTriangle {
        BoundaryTriangle { vertices: vertices.map(VertexId), patch: PatchId(0) }
    }

    #[test]
    fn one_body_without_named_faces_has_one_patch_and_no_curves() {
        let (mesh, names) = classify(two_tets([0, 0])).unwrap();
        assert_eq!(mesh.triangles.len(), 6);
        assert!(mesh.segments.is_empty());
        assert!(mesh.classes.iter().all(|class| *class == Class::Patch(PatchId(1))));
        assert_eq!(names.patches[1], (8, "boundary".into()));
        from_serial(mesh).expect("a sound mesh");
    }

    #[test]
    fn between_two_bodies_there_is_a_patch_whose_rim_is_a_curve() {
        let (mesh, names) = classify(two_tets([1, 0])).unwrap();
        assert_eq!(mesh.triangles.len(), 7);
        assert_eq!(mesh.segments.len(), 3);
        assert_eq!(names.patches.len(), 3);
        let between = names.patches.iter().position(|(_, name)| name == "body1_body2").expect("an interface");
        // Out of the first body, which is that of the second tet.
        let inner = mesh.triangles.iter().find(|t| t.patch == PatchId::new(between)).expect("an interface");
        let corners = inner.vertices.map(|v| mesh.points[v.index()]);
        let normal = crate::kernel::simplex::area_vector(&corners[0], &corners[1], &corners[2]);
        assert!(normal.sum() < 0.0);
        from_serial(mesh).expect("a sound mesh");
    }

    #[test]
    fn a_named_face_in_any_orientation_keeps_its_patch_and_gets_corners_at_no_branch() {
        for vertices in [[0, 1, 2], [2, 1, 0]] {
            let mut input = two_tets([0, 0]);
            input.triangles.push(named(vertices));
            let (mesh, _) = classify(input).unwrap();
            assert_eq!(mesh.segments.len(), 3);
            let bottom = mesh.triangles.iter().find(|t| t.patch == PatchId(0)).expect("the named face");
            let corners = bottom.vertices.map(|v| mesh.points[v.index()]);
            assert!(crate::kernel::simplex::area_vector(&corners[0], &corners[1], &corners[2]).z < 0.0);
            assert!(mesh.classes[..3].iter().all(|class| matches!(class, Class::Curve(_))));
            from_serial(mesh).expect("a sound mesh");
        }
    }

    #[test]
    fn what_is_no_mesh_is_refused_with_its_place() {
        let mut input = two_tets([0, 0]);
        input.triangles.push(named([0, 1, 4]));
        assert!(matches!(classify(input), Err(ClassifyError::NotAFace { triangle: 0, .. })));

        let mut input = two_tets([0, 0]);
        input.triangles = vec![named([0, 1, 2]), BoundaryTriangle { patch: PatchId(1), ..named([1, 0, 2]) }];
        assert!(matches!(classify(input), Err(ClassifyError::NamedTwice { triangle: 1, .. })));

        let mut input = two_tets([0, 0]);
        input.tets.push([1, 3, 2, 0].map(VertexId));
        input.bodies.push(BodyId(0));
        assert!(matches!(classify(input), Err(ClassifyError::FaceOfThreeTets { .. })));
    }
}

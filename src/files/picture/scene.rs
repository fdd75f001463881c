//! Scenes: the visible triangles of a mesh.

use super::curved;
use crate::files::color::{Color, of_number};
use crate::files::skin::{SkinFace, patches, skin};
use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::stream::MeshStream;
use csg::PatchId;

/// A triangle to be drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// Its corners, in the mesh's unit of length.
    pub corners: [[f64; 3]; 3],
    /// Its colour.
    pub color: Color,
    /// Which edges are drawn as lines, by the opposite corner.
    pub edges: [bool; 3],
    /// The number of pieces of an edge of the face that this is a piece of; 1 for a whole face.
    pub pieces: u32,
}

/// The triangles to be drawn, in any order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// The triangles.
    pub triangles: Vec<Triangle>,
}

/// The meaning of the colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColorBy {
    /// By patch; inner faces have a light colour of their body.
    Patch,
    /// By part.
    Part,
    /// By body.
    Body,
}

/// A plane; tets with their centre on its positive side are hidden.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// A point on it.
    pub point: [f64; 3],
    /// Its normal, of any length.
    pub normal: [f64; 3],
}

/// Which tets of a part are shown, and in which colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// The meaning of the colours.
    pub color_by: ColorBy,
    /// Hides the tets on one side.
    pub cut: Option<Cut>,
}

/// *Local.* The scene of a part's skin.
pub fn scene_of_part(part: &dyn MeshStream, look: &Look) -> Scene {
    let faces = skin(part, |tet| look.cut.is_none_or(|cut| is_behind(&cut, tet)));
    let on_patches = match look.color_by {
        ColorBy::Patch => patches(part, &faces),
        ColorBy::Part | ColorBy::Body => vec![None; faces.len()],
    };
    let color = |face: &SkinFace, patch: Option<PatchId>| match (look.color_by, patch) {
        (ColorBy::Part, _) => of_number(part.rank()),
        (ColorBy::Body, _) => of_number(face.body.0),
        (ColorBy::Patch, Some(patch)) => of_number(patch.0),
        (ColorBy::Patch, None) => of_number(face.body.0).map(|c| 0.65 + 0.35 * c),
    };
    let points = |vertices: [u32; 3]| vertices.map(|v| part.points()[v as usize]);
    let mut triangles = Vec::with_capacity(faces.len());
    for (face, patch) in faces.iter().zip(on_patches) {
        let (corners, color) = (points(face.vertices), color(face, patch));
        match face.edge_nodes {
            Some(nodes) => curved::pieces(corners, points(nodes), color, &mut triangles),
            None => triangles.push(Triangle { corners, color, edges: [true; 3], pieces: 1 }),
        }
    }
    Scene { triangles }
}

fn is_behind(cut: &Cut, tet: &[[f64; 3]; 4]) -> bool {
    let distance = |k: usize| tet.iter().map(|corner| corner[k] - cut.point[k]).sum::<f64>() * cut.normal[k];
    (0..3).map(distance).sum::<f64>() < 0.0
}

/// **Collective.** Joins the scenes of all ranks on rank 0; the others get `None`.
pub fn gather(comm: &dyn Communicator, scene: &Scene) -> Result<Option<Scene>, CommError> {
    const NUMBERS: usize = 16;
    let mut numbers: Vec<f64> = Vec::with_capacity(NUMBERS * scene.triangles.len());
    for triangle in &scene.triangles {
        numbers.extend(triangle.corners.as_flattened());
        numbers.extend(triangle.color.map(f64::from));
        numbers.extend(triangle.edges.map(|drawn| f64::from(u8::from(drawn))));
        numbers.push(triangle.pieces.into());
    }
    let all = comm.gather(0, &numbers)?;
    let unpack = |n: &[f64; NUMBERS]| Triangle {
        corners: [[n[0], n[1], n[2]], [n[3], n[4], n[5]], [n[6], n[7], n[8]]],
        color: [n[9] as f32, n[10] as f32, n[11] as f32],
        edges: [n[12], n[13], n[14]].map(|drawn| drawn != 0.0),
        pieces: n[15] as u32,
    };
    let triangles = all.iter().flat_map(|numbers| numbers.as_chunks().0.iter().map(unpack)).collect();
    Ok((comm.rank() == 0).then_some(Scene { triangles }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::plain::PlainPart;
    use crate::files::testing::{cube, slabs, together};

    #[test]
    fn rank_0_gets_the_scenes_of_all_parts_in_their_colours() {
        let mesh = cube(2);
        let look = Look { color_by: ColorBy::Part, cut: None };
        let scenes = together(2, |comm| {
            let part = PlainPart::part(&mesh, &slabs(&mesh, 2), 2, comm.rank());
            let own = scene_of_part(&part, &look);
            let all = gather(comm, &own).unwrap();
            (own, all)
        });
        assert!(scenes[1].1.is_none());
        let all = scenes[0].1.as_ref().unwrap();
        let expected: Vec<Triangle> = scenes.iter().flat_map(|(own, _)| own.triangles.clone()).collect();
        assert_eq!(all.triangles, expected);
        assert_ne!(scenes[0].0.triangles[0].color, scenes[1].0.triangles[0].color);
    }

    #[test]
    fn a_cut_shows_the_tets_behind_it() {
        let look = Look {
            color_by: ColorBy::Body,
            cut: Some(Cut { point: [0.0, 0.0, 1.0 / 3.0], normal: [0.0, 0.0, 2.0] }),
        };
        let scene = scene_of_part(&PlainPart::whole(&cube(2)), &look);
        assert_eq!(scene.triangles.len(), 8 + 4 * 4 + 8, "the lower half");
        assert!(scene.triangles.iter().all(|t| t.color == of_number(0)));
    }
}

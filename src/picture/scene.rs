//! What is seen of a mesh.

use super::color::{Color, of_number};
use crate::comm::{CommError, Communicator};
use crate::io::skin::{SkinFace, patches, skin};
use crate::mesh::stream::MeshStream;
use csg::PatchId;

/// A triangle to be drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// Its corners, in the mesh's unit of length.
    pub corners: [[f32; 3]; 3],
    /// Its colour.
    pub color: Color,
}

/// What is to be drawn, in any order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// The triangles.
    pub triangles: Vec<Triangle>,
}

/// What the colours tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColorBy {
    /// The patch; faces inside are in a light colour of their body.
    Patch,
    /// The part.
    Part,
    /// The body.
    Body,
}

/// A plane: tets whose centre is on its positive side are left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// A point on it.
    pub point: [f64; 3],
    /// Its normal, of any length.
    pub normal: [f64; 3],
}

/// What is shown of a part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// What the colours tell.
    pub color_by: ColorBy,
    /// Shows the tets on one side only.
    pub cut: Option<Cut>,
}

/// *Local.* The skin of a part.
pub fn scene_of_part(part: &dyn MeshStream, look: &Look) -> Scene {
    let faces = skin(part, |tet| look.cut.is_none_or(|cut| is_behind(&cut, tet)));
    let on_patches = match look.color_by {
        ColorBy::Patch => patches(part, &faces),
        ColorBy::Part | ColorBy::Body => vec![None; faces.len()],
    };
    let triangle = |(face, patch): (&SkinFace, Option<PatchId>)| Triangle {
        corners: face.vertices.map(|v| part.points()[v as usize].map(|x| x as f32)),
        color: match (look.color_by, patch) {
            (ColorBy::Part, _) => of_number(part.rank()),
            (ColorBy::Body, _) => of_number(face.body.0),
            (ColorBy::Patch, Some(patch)) => of_number(patch.0),
            (ColorBy::Patch, None) => of_number(face.body.0).map(|c| 0.65 + 0.35 * c),
        },
    };
    Scene { triangles: faces.iter().zip(on_patches).map(triangle).collect() }
}

fn is_behind(cut: &Cut, tet: &[[f64; 3]; 4]) -> bool {
    let distance = |k: usize| tet.iter().map(|corner| corner[k] - cut.point[k]).sum::<f64>() * cut.normal[k];
    (0..3).map(distance).sum::<f64>() < 0.0
}

/// **Collective.** Rank 0 gets the scenes of all ranks as one, the others `None`.
pub fn gather(comm: &dyn Communicator, scene: &Scene) -> Result<Option<Scene>, CommError> {
    const NUMBERS: usize = 12;
    let pack = |t: &Triangle| t.corners.into_iter().flatten().chain(t.color).collect::<Vec<f32>>();
    let numbers: Vec<f32> = scene.triangles.iter().flat_map(pack).collect();
    let all = comm.gather::<f32>(0, &numbers)?;
    let unpack = |n: &[f32; NUMBERS]| Triangle {
        corners: [[n[0], n[1], n[2]], [n[3], n[4], n[5]], [n[6], n[7], n[8]]],
        color: [n[9], n[10], n[11]],
    };
    let triangles = all.iter().flat_map(|numbers| numbers.as_chunks().0.iter().map(unpack)).collect();
    Ok((comm.rank() == 0).then_some(Scene { triangles }))
}

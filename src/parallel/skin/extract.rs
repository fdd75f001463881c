//! Extraction of the skin of a part: the faces on a patch or with only one tet in the part, refined
//! by the lattice.

use crate::Point;
use crate::ground::mesh::{Class, FaceId, GlobalId, Order, TetId};
use crate::ground::projector::Projector;
use crate::parallel::distribution::{DistMesh, Shared};
use crate::parallel::refine::numbering::Numbering;
use crate::parallel::refine::snap::boundary_first;
use crate::parallel::refine::{Keep, RefineError, Settings};
use csg::{BodyId, PatchId};

/// A triangle of a skin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SkinTriangle {
    /// Its vertices, by index in the skin.
    pub vertices: [u32; 3],
    /// The bodies of this part behind and in front of it; `None` if there is none, or if another
    /// part has the tet.
    pub beside: [Option<BodyId>; 2],
    /// The patch it is on, and whether the back of the triangle is that of the patch.
    pub patch: Option<(PatchId, bool)>,
}

/// The surface of a part: closed, and bitwise the same on both sides of an interface.
///
/// Vertices are those of triangles, then the prescribed interior ones (points and curves inside
/// bodies).
#[derive(Clone, Debug, Default)]
pub struct Skin {
    /// The name of each vertex, the same on all ranks that share it.
    pub names: Vec<GlobalId>,
    /// Vertices shared by several ranks.
    pub shared: Shared,
    /// The number of vertices of triangles; the vertices from here on are interior.
    pub on_triangles: usize,
    /// Coordinates.
    pub points: Vec<Point>,
    /// The geometric entities the vertices are classified on.
    pub classes: Vec<Class>,
    /// The triangles.
    pub triangles: Vec<SkinTriangle>,
    /// Edges on curves and patches, with their class; those of triangles on patches may be missing.
    pub edges: Vec<([u32; 2], Class)>,
}

/// The skin of a part of a coarse mesh, with the lattice that contains it. Vertices of triangles,
/// and interior vertices, ascend in the lattice.
#[derive(Clone, Debug)]
pub struct LatticeSkin {
    /// The skin.
    pub skin: Skin,
    /// The numbering of the lattice of the whole part.
    pub numbering: Numbering,
    /// The lattice vertex of each vertex of the skin.
    pub lattice: Vec<u32>,
}

/// No tet, no vertex.
const NONE: u32 = u32::MAX;

/// *Local.* The skin of a part, refined with `n` subdivisions per coarse edge and projected to the
/// geometry.
///
/// # Errors
/// [`RefineError::Projection`] and [`RefineError::OutOfMemory`], as
/// [`refine`](crate::parallel::refine::refine()).
pub fn skin(mesh: &DistMesh, projector: &Projector, n: u32) -> Result<LatticeSkin, RefineError> {
    let numbering = Numbering::new(mesh, n, Order::First)?;
    let settings = Settings { keep: Keep::Boundary, ..Settings::default() };
    let coordinates = boundary_first(mesh, projector, &numbering, &settings)?;
    let mut triangles = Vec::new();
    sides(mesh).for_each(|side| push_triangles(mesh, &numbering, side, &mut triangles));
    let mut edges = numbering.classified_edges(mesh).collect::<Vec<_>>();

    let mut place = vec![NONE; coordinates.len()];
    triangles.iter().flat_map(|t| t.vertices).for_each(|v| place[v as usize] = 0);
    let mut lattice: Vec<u32> = (0..place.len() as u32).filter(|&v| place[v as usize] == 0).collect();
    let on_triangles = lattice.len();
    let corners = (0..).zip(&mesh.vertex_classes).filter(|(_, class)| matches!(class, Class::Corner(_)));
    let ends = edges.iter().flat_map(|(ends, _)| *ends);
    let mut inside: Vec<u32> =
        corners.map(|(v, _)| v).chain(ends).filter(|&v| place[v as usize] == NONE).collect();
    inside.sort_unstable();
    inside.dedup();
    lattice.append(&mut inside);
    (0..).zip(&lattice).for_each(|(new, &v)| place[v as usize] = new);

    let renumbered = |v: u32| place[v as usize];
    triangles.iter_mut().for_each(|t| t.vertices = t.vertices.map(renumbered));
    edges.iter_mut().for_each(|(ends, _)| *ends = ends.map(renumbered));
    let mut skin = Skin { on_triangles, triangles, edges, ..Skin::default() };
    for (new, &v) in (0..).zip(&lattice) {
        let (entity, within) = numbering.locate(v);
        skin.names.push(numbering.first_id_in(mesh, entity) + u64::from(within));
        skin.points.push(coordinates[v as usize].into());
        skin.classes.push(entity.class(mesh));
        let holders = entity.holders(mesh);
        if !holders.is_empty() {
            skin.shared.push(new, holders.iter().copied());
        }
    }
    Ok(LatticeSkin { skin, numbering, lattice })
}

impl Skin {
    /// The edges of the triangles, ascending.
    pub fn sides(&self) -> Vec<[u32; 2]> {
        let of = |t: &SkinTriangle| {
            let [a, b, c] = t.vertices;
            [[a, b], [b, c], [c, a]].map(sorted_ends)
        };
        let mut sides: Vec<[u32; 2]> = self.triangles.iter().flat_map(of).collect();
        sides.sort_unstable();
        sides.dedup();
        sides
    }

    /// The edges inside bodies, which belong to no triangle.
    pub fn loose_edges(&self) -> Vec<[u32; 2]> {
        let sides = self.sides();
        let is_loose = |edge: &[u32; 2]| sides.binary_search(edge).is_err();
        self.edges.iter().map(|(ends, _)| sorted_ends(*ends)).filter(is_loose).collect()
    }
}

pub(crate) fn sorted_ends([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// A coarse face of a skin, seen from the tet behind it.
struct CoarseSide {
    tet: TetId,
    /// The local number of the face in the tet.
    face: usize,
    /// The tet of this part in front of it.
    front: Option<TetId>,
    /// Its patch, and whether the tet is behind that.
    patch: Option<(PatchId, bool)>,
}

/// The coarse faces of a part's skin, by ascending face.
fn sides(mesh: &DistMesh) -> impl Iterator<Item = CoarseSide> {
    // The one or two tets of each face.
    let mut tets = vec![[None; 2]; mesh.faces.len()];
    for (tet, faces) in (0..).map(TetId).zip(&mesh.tet_faces) {
        for face in faces {
            let [first, second] = &mut tets[face.index()];
            *(if first.is_none() { first } else { second }) = Some(tet);
        }
    }
    let mut boundary = mesh.boundary.iter().peekable();
    let side = move |(face, [first, second]): (FaceId, [Option<TetId>; 2])| {
        let on_patch = boundary.next_if(|triangle| triangle.face == face);
        let place = |tet: TetId| mesh.tet_faces[tet.index()].iter().position(|f| *f == face);
        let of = |tet: TetId, front, patch| CoarseSide {
            face: place(tet).expect("the face belongs to the tet"),
            tet,
            front,
            patch,
        };
        match (on_patch.map(|t| (t.patch, t.parents)), first, second) {
            (Some((patch, [Some(behind), front])), ..) => Some(of(behind, front, Some((patch, true)))),
            (Some((patch, [None, Some(tet)])), ..) => Some(of(tet, None, Some((patch, false)))),
            (_, Some(tet), None) => Some(of(tet, None, None)),
            _ => None,
        }
    };
    (0..).map(FaceId).zip(tets).filter_map(side)
}

/// Appends the fine triangles of a coarse face, by lattice vertices.
fn push_triangles(
    mesh: &DistMesh,
    numbering: &Numbering,
    side: CoarseSide,
    triangles: &mut Vec<SkinTriangle>,
) {
    let body = |tet: TetId| mesh.tet_bodies[tet.index()];
    let beside = [Some(body(side.tet)), side.front.map(body)];
    numbering.for_each_triangle(mesh, side.tet, side.face, |vertices, _| {
        triangles.push(SkinTriangle { vertices, beside, patch: side.patch });
    });
}

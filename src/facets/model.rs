//! From triangles to bodies, patches, curves and corners.

use super::edges::Edges;
use super::features::{self, Found};
use super::join::{self, Joined};
use super::projector::{FacetProjector, Source};
use super::regions::Regions;
use super::{FacetError, normals, regions};
use crate::Point;
use crate::kernel::tree;
use crate::mesh::{BoundaryTriangle, VertexId};
use crate::surface::crossings;
use csg::{Aabb, BodyId, CornerId, PatchId};

/// A triangulated surface as a file gives it: closed, its triangles in any order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Facets {
    /// The points; equal ones are taken as one.
    pub points: Vec<Point>,
    /// The triangles, by indices of points.
    pub triangles: Vec<[u32; 3]>,
    /// By triangle: its group (the solid of an STL file). Where groups differ, patches end. Missing ones are 0.
    pub groups: Vec<u32>,
    /// Points that say what is solid, in files whose triangles are not oriented; else orientation says it.
    pub marks: Option<Marks>,
}

/// What a file says of the regions that its triangles part, by a point in each (TetGen's `.poly`). Without a mark they are bodies.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Marks {
    /// Points in regions that are no bodies.
    pub holes: Vec<Point>,
    /// Points in bodies, and the numbers of these.
    pub regions: Vec<(Point, i64)>,
}

/// How patches, curves and corners are told apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Patches end where facets turn by more than this (radians). Coarse exports have 12 facets a circle or more, 30° each;
    /// chamfers turn by 45°.
    pub feature_angle: f64,
    /// From this angle on (radians) patches end if no edge like it is beside, as there would be on a round surface. The feature
    /// angle makes this rule void.
    pub least_angle: f64,
    /// Curves have a corner where they turn by more than this (radians).
    pub corner_angle: f64,
    /// A vertex without sharp edges is a corner if the angles of its facets differ from a full turn by more than this (radians).
    /// The vertices of an icosahedron differ by 60°; a cone of 60° half-angle at its tip by 48°, one of 45° by 105°.
    pub tip_angle: f64,
    /// Chains of sharp edges that end inside a patch are left out up to this length (fraction of the bounding-box diagonal).
    pub shortest_end: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            feature_angle: 40_f64.to_radians(),
            least_angle: 14_f64.to_radians(),
            corner_angle: 40_f64.to_radians(),
            tip_angle: 65_f64.to_radians(),
            shortest_end: 0.05,
        }
    }
}

/// A body that facets bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FacetBody {
    /// The surface, as an index of those given, whose solid it is: the smallest one where several hold it.
    pub file: u32,
    /// The number that its file gives to it.
    pub number: Option<i64>,
}

/// A patch: facets that hang together and turn into each other smoothly.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FacetPatch {
    /// The body that its normals point away from.
    pub inside: Option<BodyId>,
    /// The body that its normals point into.
    pub outside: Option<BodyId>,
    /// The surfaces that it is in and its group in each; several where they share facets.
    pub labels: Vec<(u32, u32)>,
}

/// A curve: a chain of edges between corners, or a closed one.
#[derive(Clone, Debug, PartialEq)]
pub struct FacetCurve {
    /// Its first and last corner; `None` if it is closed without a corner.
    pub ends: Option<[CornerId; 2]>,
    /// Its points as indices of the model's; a closed one ends where it begins.
    pub vertices: Vec<u32>,
}

/// Facets and what they bound.
#[derive(Clone, Debug, PartialEq)]
pub struct FacetModel {
    /// The points that facets use, each place once.
    pub points: Vec<Point>,
    /// The facets on their patches, normals from the patch's `inside` to its `outside`.
    pub triangles: Vec<BoundaryTriangle>,
    /// The points that are corners.
    pub corners: Vec<u32>,
    /// The curves.
    pub curves: Vec<FacetCurve>,
    /// The patches.
    pub patches: Vec<FacetPatch>,
    /// The bodies.
    pub bodies: Vec<FacetBody>,
    /// The box around all points.
    pub bounds: Aabb,
    /// Projection to patches and curves.
    pub projector: FacetProjector,
    /// How far points may be from where they were meant to be, judged from their digits (length).
    pub rounding: f64,
}

impl FacetModel {
    /// Finds bodies, patches, curves and corners of one or several surfaces.
    ///
    /// Each bounded region of space that one of the surfaces winds round is a body. In one file a surface inside another
    /// makes a hollow if its triangles look inward (as seen from the solid around), else a body inside a body. Surfaces that are not
    /// consistently oriented are turned.
    ///
    /// # Errors
    /// Facets that are open, lie on each other, or have one side only, with the place. Facets that intersect are left to the
    /// volume mesher.
    pub fn new(files: &[Facets], settings: &Settings) -> Result<Self, FacetError> {
        let mut joined = join::join(files)?;
        let mut regions = regions::find(&mut joined, files)?;
        if regions.files.is_empty() {
            return Err(FacetError::NoBody);
        }
        drop_walls(&mut joined, &mut regions.sides);
        // Normals leave the inside: a body rather than none, and the lower of two.
        for (triangle, sides) in joined.triangles.iter_mut().zip(&mut regions.sides) {
            if sides[0].map_or(u32::MAX, |b| b) > sides[1].map_or(u32::MAX, |b| b) {
                triangle.swap(0, 1);
                sides.swap(0, 1);
            }
        }
        let edges = Edges::new(&joined.triangles);
        let keys = keys(&joined, &regions.sides);
        let bounds = tree::bounds(&joined.points);
        let rounding = normals::rounding(&joined.points);
        let (normals, _) = normals::trusted(&joined.points, &joined.triangles, &edges, rounding);
        let found = features::find(
            &features::Input {
                points: &joined.points,
                triangles: &joined.triangles,
                edges: &edges,
                normals: &normals,
                keys: &keys,
                rounding,
                diagonal: bounds.diagonal(),
            },
            settings,
        );
        Ok(assemble(joined, &regions, found, bounds, rounding))
    }

    /// The middles of the sides of facets that meet others where they must not, by exact signs. Remeshing may heal such places, where they come from rounding; kept facets
    /// with any bound nothing.
    pub fn crossings(&self) -> Vec<Point> {
        crossings(&self.points, &self.triangles)
    }

    /// The patch with this id.
    pub fn patch(&self, patch: PatchId) -> &FacetPatch {
        &self.patches[patch.index()]
    }
}

/// Leaves out triangles with no body on either side.
fn drop_walls(joined: &mut Joined, sides: &mut Vec<[Option<u32>; 2]>) {
    let keep: Vec<bool> = sides.iter().map(|s| *s != [None; 2]).collect();
    let mut of = keep.iter();
    joined.triangles.retain(|_| *of.next().unwrap_or(&true));
    of = keep.iter();
    joined.layers.retain(|_| *of.next().unwrap_or(&true));
    of = keep.iter();
    sides.retain(|_| *of.next().unwrap_or(&true));
}

/// Numbers what patches must not mix: regions and groups.
fn keys(joined: &Joined, sides: &[[Option<u32>; 2]]) -> Vec<u32> {
    let key = |t: usize| {
        let labels: Vec<(u32, u32)> = joined.layers[t].iter().map(|l| (l.file, l.group)).collect();
        (sides[t], labels)
    };
    let all: Vec<_> = (0..sides.len()).map(key).collect();
    let mut different = all.clone();
    different.sort_unstable();
    different.dedup();
    all.iter().map(|k| different.binary_search(k).unwrap_or(0) as u32).collect()
}

fn assemble(joined: Joined, regions: &Regions, found: Found, bounds: Aabb, rounding: f64) -> FacetModel {
    let mut patches: Vec<Option<FacetPatch>> = vec![None; found.patches];
    for (t, &patch) in found.patch_of.iter().enumerate() {
        patches[patch as usize].get_or_insert_with(|| {
            let [inside, outside] = regions.sides[t].map(|b| b.map(BodyId));
            let mut labels: Vec<(u32, u32)> = joined.layers[t].iter().map(|l| (l.file, l.group)).collect();
            labels.dedup();
            FacetPatch { inside, outside, labels }
        });
    }
    let corner = |v: u32| found.corners.binary_search(&v).ok().map(CornerId::new);
    let curves: Vec<FacetCurve> = found
        .chains
        .into_iter()
        .map(|chain| {
            let [first, last] = [chain.vertices[0], chain.vertices[chain.vertices.len() - 1]];
            let ends = corner(first).zip(corner(last)).map(|(a, b)| [a, b]);
            FacetCurve { ends, vertices: chain.vertices }
        })
        .collect();
    let mut on_curve: Vec<CornerId> = curves.iter().filter_map(|c| c.ends).flatten().collect();
    on_curve.sort_unstable();
    let is_tip = |i: &usize| on_curve.binary_search(&CornerId::new(*i)).is_err();
    let tips = (0..found.corners.len()).filter(is_tip).map(|i| found.corners[i]).collect();
    let triangles = joined
        .triangles
        .iter()
        .zip(&found.patch_of)
        .map(|(v, &p)| BoundaryTriangle { vertices: v.map(VertexId), patch: PatchId(p) })
        .collect();
    let projector = FacetProjector::new(Source {
        points: joined.points.clone(),
        triangles: joined.triangles,
        patch_of: found.patch_of,
        patches: found.patches as u32,
        curves: curves.iter().map(|c| c.vertices.clone()).collect(),
        tips,
    });
    FacetModel {
        points: joined.points,
        triangles,
        corners: found.corners,
        curves,
        patches: patches.into_iter().flatten().collect(),
        bodies: bodies_of(regions),
        bounds,
        projector,
        rounding,
    }
}

fn bodies_of(regions: &Regions) -> Vec<FacetBody> {
    let Regions { files, numbers, .. } = regions;
    files.iter().zip(numbers).map(|(&file, &number)| FacetBody { file, number }).collect()
}

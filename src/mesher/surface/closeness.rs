//! Sizes for thin regions.
//!
//! One layer of tets fills the space between two facing patches. If edges along the patches are
//! much longer than the region is thick, these tets are flat, so the size is lowered to a multiple
//! of the thickness. The thickness is measured on a first triangulation, for analytic surfaces and
//! facets alike: at sample points of each triangle a **shrinking ball** (Ma, Bae, Choi 2012),
//! tangent to the triangle from inside the body, shrinks until no other patch is inside the ball.
//! If the triangle and the other patch touch the ball on opposite sides, their distance is the
//! thickness. A ray would suffice for parallel walls; the ball also finds edges and bends that come
//! near.
//!
//! Patches with a common curve or corner are excluded, and triangles of one patch with a common
//! vertex: they form a wedge, whose thickness tapers to zero for any size.

use super::SurfaceMesh;
use crate::ground::kernel::nearest::{at, in_triangle};
use crate::ground::kernel::simplex::area_vector;
use crate::ground::kernel::tree::{Tree, bounds};
use crate::ground::mesh::{Class, Touching};
use crate::ground::size::{Closeness, SizeField, Source, thinned};
use crate::{Point, Vector};
use csg::{Aabb, BodyId, PatchId};
use rayon::prelude::*;

/// A size is lowered only if the wanted size is below this fraction of it.
const WORTH: f64 = 0.85;

/// Largest distance of neighbouring sources, in units of their size.
const SPACING: f64 = 1.5;

/// Largest ratio by which surfaces may be closer than the triangles that approximate them.
const SAG: f64 = 1.25;

/// The most halvings of a triangle in each direction.
const MOST_HALVINGS: u32 = 24;

/// Parts of triangles with a height below this fraction of the spacing are probed along their
/// longest side only: the number of parts goes little faster than the length, else with its power
/// 1.6.
const FLAT: f64 = 0.1;

/// The ball is final if its radius shrinks by less than this fraction.
const SETTLED: f64 = 0.01;

/// The most shrinking steps; each uses the nearest point, so a few suffice.
const MOST_SHRINKS: usize = 12;

/// Triangles of one patch face each other if the cosine of the angle between their normals is below
/// this (120°).
const OPPOSITE: f64 = -0.5;

/// Input of [`thin_regions`]: a first surface mesh, its geometry and the sizes.
pub struct Walls<'a> {
    /// The triangulation.
    pub mesh: &'a SurfaceMesh,
    /// Triangles that are no walls: those of faces far smaller than the elements.
    pub is_ignored: &'a (dyn Fn(u32) -> bool + Sync),
    /// The bodies behind and in front of each patch.
    pub regions: &'a (dyn Fn(PatchId) -> [Option<BodyId>; 2] + Sync),
    /// Bodies that touch: patches of theirs are no walls of each other.
    pub touching: &'a Touching,
    /// Projection onto the patch itself.
    pub project: &'a (dyn Fn(PatchId, &Point) -> Point + Sync),
    /// The sizes to be lowered.
    pub size: &'a dyn SizeField,
    /// The resolution wanted across thin regions.
    pub closeness: Closeness,
}

/// Statistics of regions that are thin compared with the sizes.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct ThinRegions {
    /// Sample points at which the size is too large for the thickness.
    pub places: u64,
    /// Those that need a smaller size than [`Closeness::most`] allows.
    pub limited: u64,
    /// The least thickness among them (length).
    pub thinnest: Option<f64>,
    /// A point on the surface there.
    pub thinnest_at: Option<[f64; 3]>,
    /// The place where the size remains largest relative to the thickness, if it is too large.
    pub flattest: Option<FlatPlace>,
}

/// A place of a thin region whose size remains larger than [`Closeness::ratio`] thicknesses.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct FlatPlace {
    /// A point on the surface.
    pub point: [f64; 3],
    /// The thickness there (length).
    pub thickness: f64,
    /// The size there (length).
    pub size: f64,
}

impl FlatPlace {
    /// The smallest dihedral angle of a layer of prisms of this thickness over regular triangles
    /// of this size, degrees. Tets between independent triangulations have smaller ones.
    pub fn prism_angle(&self) -> f64 {
        (2.0 * self.thickness / (3.0_f64.sqrt() * self.size)).atan().to_degrees()
    }
}

/// Sources that lower the sizes in thin regions, and statistics of these regions; incomplete if the
/// work of the size field is cancelled.
pub fn thin_regions(walls: &Walls) -> (Vec<Source>, ThinRegions) {
    let mut found = ThinRegions::default();
    if !walls.closeness.ratio.is_finite() {
        return (Vec::new(), found);
    }
    let prober = Prober::new(walls);
    let places: Vec<Vec<Place>> = (0..walls.mesh.triangles.len() as u32)
        .into_par_iter()
        .map(|t| {
            let mut places = Vec::new();
            if !(walls.is_ignored)(t) && !walls.size.work().is_cancelled() {
                prober.probe_triangle(t, &mut places);
            }
            places
        })
        .collect();
    let places = places.concat();
    found.places = places.len() as u64;
    let limited = || places.iter().filter(|place| place.limited);
    found.limited = limited().count() as u64;
    found.flattest = limited().map(Place::flat).max_by(|a, b| {
        let flatness = |place: &FlatPlace| place.size / place.thickness;
        flatness(a).total_cmp(&flatness(b)).then_with(|| b.point.partial_cmp(&a.point).expect("finite"))
    });
    let by_thickness = |a: &&Place, b: &&Place| {
        let [p, q] = [a, b].map(|place| <[f64; 3]>::from(place.point));
        a.thickness.total_cmp(&b.thickness).then_with(|| p.partial_cmp(&q).expect("finite"))
    };
    let thinnest = places.iter().min_by(by_thickness);
    found.thinnest = thinnest.map(|place| place.thickness);
    found.thinnest_at = thinnest.map(|place| place.point.into());
    (thinned(places.into_iter().filter_map(|place| place.source).collect()), found)
}

#[derive(Clone, Copy)]
struct Place {
    point: Point,
    /// The size, lowered if that is worth it.
    size: f64,
    source: Option<Source>,
    thickness: f64,
    limited: bool,
}

impl Place {
    fn flat(&self) -> FlatPlace {
        FlatPlace { point: self.point.into(), thickness: self.thickness, size: self.size }
    }
}

struct Prober<'a> {
    walls: &'a Walls<'a>,
    corners: Vec<[Point; 3]>,
    /// Unit normals; zero for triangles without area.
    normals: Vec<Vector>,
    /// The triangles of each patch with their tree; `tree` is a tree of the patches. One tree of
    /// all triangles would be slow near sharp wedges, which have very many triangles of excluded
    /// patches.
    patches: Vec<(Vec<u32>, Tree)>,
    tree: Tree,
    /// For each patch, those with a common curve or corner, ascending.
    adjacent: Vec<Vec<PatchId>>,
}

impl<'a> Prober<'a> {
    fn new(walls: &'a Walls<'a>) -> Self {
        let mesh = walls.mesh;
        let corners: Vec<[Point; 3]> =
            mesh.triangles.iter().map(|t| t.vertices.map(|v| mesh.points[v.index()])).collect();
        let normal = |[a, b, c]: &[Point; 3]| area_vector(a, b, c).try_normalize(0.0);
        let adjacent = adjacent_patches(mesh);
        let mut of_patch = vec![Vec::new(); adjacent.len()];
        for (t, triangle) in (0..).zip(&mesh.triangles).filter(|(t, _)| !(walls.is_ignored)(*t)) {
            of_patch[triangle.patch.index()].push(t);
        }
        let boxes = |triangles: &[u32]| -> Vec<Aabb> {
            triangles.iter().map(|&t| bounds(&corners[t as usize])).collect()
        };
        let around = |triangles: &Vec<u32>| {
            let whole = |a: Aabb, b: Aabb| Aabb { min: a.min.inf(&b.min), max: a.max.sup(&b.max) };
            let nowhere =
                Aabb { min: Point::from([f64::INFINITY; 3]), max: Point::from([f64::NEG_INFINITY; 3]) };
            boxes(triangles).into_iter().fold(nowhere, whole)
        };
        Self {
            walls,
            normals: corners.iter().map(|p| normal(p).unwrap_or_else(Vector::zeros)).collect(),
            tree: Tree::new(&of_patch.iter().map(around).collect::<Vec<_>>()),
            patches: of_patch
                .into_iter()
                .map(|triangles| {
                    let tree = Tree::new(&boxes(&triangles));
                    (triangles, tree)
                })
                .collect(),
            adjacent,
            corners,
        }
    }

    /// Adds the sample points of a triangle at which the opposite wall is too close.
    fn probe_triangle(&self, t: u32, places: &mut Vec<Place>) {
        let normal = self.normals[t as usize];
        let [behind, before] = (self.walls.regions)(self.walls.mesh.triangles[t as usize].patch);
        for (body, into) in [(behind, -normal), (before, normal)] {
            if body.is_some() && normal != Vector::zeros() {
                self.probe(t, into, self.corners[t as usize], 2 * MOST_HALVINGS, places);
            }
        }
    }

    /// Probes a part of a triangle, which is halved while it is long compared with the size it
    /// needs.
    fn probe(&self, t: u32, into: Vector, part: [Point; 3], halvings: u32, places: &mut Vec<Place>) {
        let Closeness { ratio, most } = self.walls.closeness;
        let [a, b, c] = part;
        let middle = Point::from((a.coords + b.coords + c.coords) / 3.0);
        let size = self.walls.size.size_at(&middle);
        let length = |k: usize| (part[(k + 2) % 3] - part[(k + 1) % 3]).norm();
        let longest = (0..3).fold(0, |best, k| if length(k) > length(best) { k } else { best });
        let Some(thickness) = self.thickness(t, &middle, into, self.limit(size, length(longest))) else {
            return;
        };
        let wanted = ratio * thickness;
        let lowered = lowered(size, wanted, most);
        let spacing = SPACING * lowered;
        if length(longest) > spacing && halvings > 0 {
            let [i, j, k] = [longest, (longest + 1) % 3, (longest + 2) % 3].map(|corner| part[corner]);
            let cut = nalgebra::center(&j, &k);
            let height = area_vector(&i, &j, &k).norm() * 2.0 / length(longest);
            let is_flat = height < FLAT * spacing;
            let halves = if is_flat { [[cut, j, cut], [cut, cut, k]] } else { [[i, j, cut], [i, cut, k]] };
            halves.into_iter().for_each(|half| self.probe(t, into, half, halvings - 1, places));
        } else if wanted < WORTH * size {
            let source = (lowered < WORTH * size).then_some(Source { point: middle, size: lowered });
            let size = source.map_or(size, |source| source.size);
            places.push(Place { point: middle, size, source, thickness, limited: wanted < lowered });
        }
    }

    /// The thickness above which a wall needs no smaller size at a part of a triangle and all its
    /// subdivisions.
    fn limit(&self, size: f64, longest: f64) -> f64 {
        let ratio = self.walls.closeness.ratio;
        if longest > SPACING * WORTH * size {
            // Over the triangle the thickness may vary by up to its length.
            return size / ratio + 0.5 * longest;
        }
        SAG * WORTH * size / ratio
    }

    /// The nearest point to a ball's centre, within the ball, on patches that may be opposite to a
    /// triangle; with its triangle.
    fn nearest(&self, t: u32, center: &Point, radius: f64) -> Option<(u32, Point)> {
        let patch = self.walls.mesh.triangles[t as usize].patch;
        let adjacent = &self.adjacent[patch.index()];
        let beside = (self.walls.regions)(patch);
        let normal = self.normals[t as usize];
        let foot = |s: u32| at(&self.corners[s as usize], in_triangle(center, &self.corners[s as usize]));
        let mut best: Option<(f64, u32)> = None;
        self.tree.nearest_within(center, radius * radius, |other| {
            let other = PatchId(other);
            let do_touch = self.walls.touching.may_meet(beside, (self.walls.regions)(other));
            if do_touch || adjacent.binary_search(&other).is_ok() {
                return f64::INFINITY;
            }
            let (triangles, tree) = &self.patches[other.index()];
            let squared = |k: u32| {
                let s = triangles[k as usize];
                let faces =
                    other != patch || normal.dot(&self.normals[s as usize]) < OPPOSITE && !self.meet(t, s);
                if faces { (foot(s) - center).norm_squared() } else { f64::INFINITY }
            };
            let limit = best.map_or(radius * radius, |(distance, _)| distance);
            let Some((k, distance)) = tree.nearest_within(center, limit, squared) else {
                return f64::INFINITY;
            };
            let found = (distance, triangles[k as usize]);
            best = Some(best.map_or(found, |best| if found < best { found } else { best }));
            distance
        });
        best.map(|(_, s)| (s, foot(s)))
    }

    /// Whether two triangles have a common vertex.
    fn meet(&self, s: u32, t: u32) -> bool {
        let [s, t] = [s, t].map(|t| self.walls.mesh.triangles[t as usize].vertices);
        s.iter().any(|v| t.contains(v))
    }

    /// The distance from a point of a triangle to the opposite wall, if it is less than `limit`.
    fn thickness(&self, t: u32, from: &Point, into: Vector, limit: f64) -> Option<f64> {
        let patch = self.walls.mesh.triangles[t as usize].patch;
        let mut radius = 0.5 * limit;
        let mut touched: Option<(u32, Point)> = None;
        for _ in 0..MOST_SHRINKS {
            let Some((s, point)) = self.nearest(t, &(from + into * radius), radius) else { break };
            let way = point - from;
            let smaller = way.norm_squared() / (2.0 * into.dot(&way));
            touched = Some((s, point));
            if !(smaller > 0.0 && smaller < (1.0 - SETTLED) * radius) {
                break;
            }
            radius = smaller;
        }
        let (s, point) = touched?;
        let center = from + into * radius;
        if (from - center).dot(&(point - center)) > 0.0 {
            return None;
        }
        // The triangles are chords, so the distance is measured on the surfaces.
        let project = self.walls.project;
        let ends = [project(patch, from), project(self.walls.mesh.triangles[s as usize].patch, &point)];
        Some((ends[1] - ends[0]).norm()).filter(|&d| d > 0.0 && d < limit)
    }
}

/// The size that replaces `size` if a smaller size is wanted.
///
/// It is the wanted size, if that is at most `most` times smaller. Beyond that the reduction
/// decreases and vanishes at about twice the factor, because a partial reduction costs many tets
/// that are still flat.
pub(crate) fn lowered(size: f64, wanted: f64, most: f64) -> f64 {
    let beyond = size / (wanted * most);
    if beyond <= 1.0 { wanted } else { size * (beyond.powi(3) / most).min(1.0) }
}

/// For each patch, those with a common curve or corner, ascending.
fn adjacent_patches(mesh: &SurfaceMesh) -> Vec<Vec<PatchId>> {
    let patches = mesh.triangles.iter().map(|t| t.patch.index() + 1).max().unwrap_or(0);
    // Keys: curves first, then corners.
    let on = |class: Class| match class {
        Class::Curve(curve) => Some((0, curve.0)),
        Class::Corner(corner) => Some((1, corner.0)),
        _ => None,
    };
    let mut uses: Vec<((u8, u32), PatchId)> = Vec::new();
    for t in &mesh.triangles {
        uses.extend(t.vertices.iter().filter_map(|v| Some((on(mesh.classes[v.index()])?, t.patch))));
    }
    // A curve of a single segment has no interior vertex, but its end corners are shared.
    uses.sort_unstable();
    uses.dedup();
    let mut adjacent = vec![Vec::new(); patches];
    for group in uses.chunk_by(|a, b| a.0 == b.0) {
        for (_, patch) in group {
            adjacent[patch.index()].extend(group.iter().map(|(_, other)| *other).filter(|o| o != patch));
        }
    }
    for list in &mut adjacent {
        list.sort_unstable();
        list.dedup();
    }
    adjacent
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::size::UniformSize;
    use crate::mesher::facets::{FacetModel, Facets, keep};

    /// A box as facets.
    fn slab([x, y, z]: [f64; 3]) -> FacetModel {
        let points = (0..8)
            .map(|i| Point::new(x * f64::from(i & 1), y * f64::from(i >> 1 & 1), z * f64::from(i >> 2 & 1)));
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let facets = Facets { points: points.collect(), triangles, ..Facets::default() };
        FacetModel::new(&[facets], &crate::mesher::facets::Settings::default()).unwrap()
    }

    fn found(model: &FacetModel, size: f64, closeness: Closeness) -> (Vec<Source>, ThinRegions) {
        thin_regions(&Walls {
            mesh: &keep(model),
            is_ignored: &|_| false,
            regions: &|patch| model.bodies_beside(patch),
            touching: &model.touching,
            project: &|_, point| *point,
            size: &UniformSize(size),
            closeness,
        })
    }

    #[test]
    fn a_plate_gets_sources_all_over_and_a_block_none() {
        let closeness = Closeness { ratio: 2.0, most: 8.0 };
        let (sources, walls) = found(&slab([4.0, 4.0, 0.25]), 1.0, closeness);
        assert!(walls.thinnest.is_some_and(|d| (d - 0.25).abs() < 1e-12), "{walls:?}");
        assert_eq!(walls.limited, 0);
        assert!(sources.iter().all(|s| (s.size - 0.5).abs() < 1e-12));
        // Every point of the large faces is within one spacing and one thinning cell of a source.
        for (i, j) in (0..9).flat_map(|i| (0..9).map(move |j| (i, j))) {
            let p = Point::new(0.5 * f64::from(i), 0.5 * f64::from(j), 0.0);
            let nearest = sources.iter().map(|s| (s.point - p).norm()).fold(f64::INFINITY, f64::min);
            assert!(nearest < (SPACING + 1.0) * 0.5, "{p}: {nearest}");
        }
        let (sources, walls) = found(&slab([1.0, 1.0, 1.0]), 1.0, closeness);
        assert!(sources.is_empty() && walls == ThinRegions::default());
    }

    #[test]
    fn a_long_thin_bar_is_probed_in_little_more_than_proportion_to_its_length() {
        let places = |length| {
            let closeness = Closeness { ratio: 2.0, most: 8.0 };
            found(&slab([length, 1.0, 0.25]), 1.0, closeness).1.places as f64
        };
        let [short, long] = [64.0, 1024.0].map(places);
        // 16 times as long; with the power 1.6 there were 80 times as many places.
        assert!(long < 40.0 * short, "{short}, {long}");
    }

    #[test]
    fn regions_too_thin_to_resolve_are_counted_and_left_unchanged() {
        let paper = slab([4.0, 4.0, 0.001]);
        let (sources, walls) = found(&paper, 1.0, Closeness { ratio: 2.0, most: 8.0 });
        assert!(sources.is_empty() && walls.limited > 0 && walls.limited == walls.places, "{walls:?}");
        assert!(found(&paper, 1.0, Closeness::OFF).1 == ThinRegions::default());
    }

    #[test]
    fn the_reduction_vanishes_for_extremely_thin_regions() {
        let factor = |needed: f64| 1.0 / lowered(1.0, 1.0 / needed, 8.0);
        assert_eq!([factor(1.0), factor(4.0), factor(8.0)], [1.0, 4.0, 8.0]);
        assert!((factor(12.0) - 8.0 / 1.5_f64.powi(3)).abs() < 1e-12);
        assert_eq!([factor(16.0), factor(1e6)], [1.0, 1.0]);
    }
}

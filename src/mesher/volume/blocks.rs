//! Blocks of a mesh that are filled at the same time, each by one thread.
//!
//! A block holds some tets of the mesh with their vertices. Faces that it shares with other tets
//! are its **seam**: without a neighbour in the block, but not locked. A cavity that reaches the
//! seam may go on behind it, so its point has to wait. Thus tets with a face on the seam stay as
//! they are, and so do the links of their faces across it. (Marot, Pellerin, Remacle 2019 also cut
//! the mesh and let such points wait, but their threads change one mesh.)
//!
//! Blocks depend on the mesh and the points only, and what happens in a block on the block only, so
//! the result is the same for any number of threads.

use super::tetrahedra::Tetrahedra;
use crate::Point;
use crate::ground::kernel::sphere::Circumsphere;
use crate::mesher::half_face::NONE;
use rayon::prelude::*;

/// Boxes that cut space by planes, one box for each block (recursive coordinate bisection: Berger,
/// Bokhari 1987).
pub(super) struct Boxes {
    /// The axis and the coordinate of each plane: a binary heap, with the same depth everywhere.
    planes: Vec<(usize, f64)>,
}

impl Boxes {
    /// Cuts boxes in two, 2^`levels` in the end, so that this part of the points in a box is below
    /// its plane.
    pub fn new(points: impl Iterator<Item = Point>, levels: u32, part: f64) -> Self {
        let mut points: Vec<Point> = points.collect();
        let mut planes = vec![(0, 0.0); (1 << levels) - 1];
        bisect(&mut points, part, 0, &mut planes);
        Self { planes }
    }

    /// The number of boxes.
    pub fn len(&self) -> usize {
        self.planes.len() + 1
    }

    /// The box of a point.
    pub fn of(&self, point: &Point) -> usize {
        let mut at = 0;
        while let Some(&(axis, cut)) = self.planes.get(at) {
            at = 2 * at + 1 + usize::from(point[axis] >= cut);
        }
        at - self.planes.len()
    }

    /// The axis and the coordinate of the plane that cuts a box of the `level` in two; level 0 has
    /// one box.
    pub fn plane(&self, level: u32, index: usize) -> (usize, f64) {
        self.planes[(1 << level) - 1 + index]
    }

    /// How often space is cut in two.
    pub fn levels(&self) -> u32 {
        self.len().ilog2()
    }

    /// The 2^`level` boxes by the first planes.
    pub fn at_level(&self, level: u32) -> Self {
        Self { planes: self.planes[..(1 << level) - 1].to_vec() }
    }

    /// Whether a plane that bounds the box of a point is nearer than `reach`.
    pub fn is_near_side(&self, point: &Point, reach: f64) -> bool {
        let mut at = 0;
        while let Some(&(axis, cut)) = self.planes.get(at) {
            if (point[axis] - cut).abs() < reach {
                return true;
            }
            at = 2 * at + 1 + usize::from(point[axis] >= cut);
        }
        false
    }
}

/// Finds the plane `at` of the heap and those below it.
fn bisect(points: &mut [Point], part: f64, at: usize, planes: &mut [(usize, f64)]) {
    if at >= planes.len() || points.is_empty() {
        return;
    }
    let low = points.iter().fold(points[0], |low, p| low.inf(p));
    let high = points.iter().fold(points[0], |high, p| high.sup(p));
    let axis = (high - low).imax();
    let middle = (part * points.len() as f64) as usize;
    points.select_nth_unstable_by(middle, |a, b| a[axis].total_cmp(&b[axis]));
    planes[at] = (axis, points[middle][axis]);
    let (below, above) = points.split_at_mut(middle);
    bisect(below, part, 2 * at + 1, planes);
    bisect(above, part, 2 * at + 2, planes);
}

/// Tets of a mesh in blocks.
pub(super) struct Cut {
    /// The tets of each block.
    blocks: Vec<Vec<u32>>,
    /// The block of each slot of the mesh, or [`NONE`], and the index there.
    places: Vec<[u32; 2]>,
}

impl Cut {
    /// Puts each of `tets` into the block in whose box its centroid lies.
    pub fn new(mesh: &Tetrahedra, tets: &[u32], boxes: &Boxes) -> Self {
        let block = |&t: &u32| boxes.of(&mesh.centroid(t));
        let of_tets: Vec<usize> = tets.par_iter().map(block).collect();
        let mut cut =
            Self { blocks: vec![Vec::new(); boxes.len()], places: vec![[NONE; 2]; mesh.tets.len()] };
        for (&t, block) in tets.iter().zip(of_tets) {
            cut.places[t as usize] = [block as u32, cut.blocks[block].len() as u32];
            cut.blocks[block].push(t);
        }
        cut
    }

    /// The number of blocks.
    pub fn len(&self) -> usize {
        self.blocks.len()
    }

    /// The block of a tet, if it is in one, and its number there.
    pub fn place(&self, tet: u32) -> Option<[u32; 2]> {
        Some(self.places[tet as usize]).filter(|place| place[0] != NONE)
    }
}

/// A block, or what became of it.
pub(super) struct Block {
    /// The tets and vertices of the block; added ones follow.
    pub mesh: Tetrahedra,
    /// The slots of its first tets in the whole mesh.
    pub tets: Vec<u32>,
    /// The numbers of its first vertices in the whole mesh.
    pub vertices: Vec<u32>,
}

impl Block {
    /// Copies one block of a mesh without exact positions and ranks.
    ///
    /// `numbers` has one entry per vertex of the whole mesh; all are [`NONE`], before and after.
    pub fn new(whole: &Tetrahedra, cut: &Cut, block: usize, numbers: &mut [u32]) -> Self {
        debug_assert!(whole.exact.is_empty() && whole.ranks.is_empty());
        let tets = cut.blocks[block].clone();
        let mut vertices = Vec::new();
        let mut mesh = Tetrahedra::default();
        for &t in &tets {
            let slot = mesh.free_slot() as usize;
            let t = t as usize;
            mesh.tets[slot] = whole.tets[t].map(|v| {
                let number = &mut numbers[v as usize];
                if *number == NONE {
                    *number = vertices.len() as u32;
                    vertices.push(v);
                }
                *number
            });
            mesh.across[slot] = whole.across[t].map(|other| match cut.places.get((other >> 2) as usize) {
                Some(&[there, slot]) if there as usize == block => 4 * slot + (other & 3),
                _ => NONE,
            });
            mesh.locked[slot] = whole.locked[t];
            mesh.bodies[slot] = whole.bodies[t];
            mesh.spheres[slot] = whole.spheres[t];
        }
        mesh.points = vertices.iter().map(|&v| whole.points[v as usize]).collect();
        mesh.at_vertex = vec![NONE; vertices.len()];
        for (tet, slot) in mesh.tets.iter().zip(0..) {
            tet.iter().for_each(|&v| mesh.at_vertex[v as usize] = slot);
        }
        let kept = whole.kept_edges().iter().map(|edge| edge.map(|v| numbers[v as usize]));
        let mut kept: Vec<[u32; 2]> =
            kept.filter(|edge| !edge.contains(&NONE)).map(|[a, b]| [a.min(b), a.max(b)]).collect();
        kept.sort_unstable();
        mesh.keep_edges(kept);
        vertices.iter().for_each(|&v| numbers[v as usize] = NONE);
        Self { mesh, tets, vertices }
    }
}

/// The numbers in the whole mesh of the tets and vertices of a block.
struct Numbers {
    /// Those of its first tets.
    tets: Vec<u32>,
    /// Those of its first vertices.
    vertices: Vec<u32>,
    first_added_tet: u32,
    first_added_vertex: u32,
    added_tets: usize,
}

impl Numbers {
    fn tet(&self, slot: u32) -> u32 {
        let added = || self.first_added_tet + slot - self.tets.len() as u32;
        self.tets.get(slot as usize).copied().unwrap_or_else(added)
    }

    fn vertex(&self, v: u32) -> u32 {
        let added = || self.first_added_vertex + v - self.vertices.len() as u32;
        self.vertices.get(v as usize).copied().unwrap_or_else(added)
    }

    fn half_face(&self, half_face: u32) -> u32 {
        if half_face == NONE { NONE } else { 4 * self.tet(half_face >> 2) + (half_face & 3) }
    }
}

impl Tetrahedra {
    /// Puts blocks back: their first tets into the slots from which they were copied, the others
    /// behind all tets, block by block; likewise the vertices.
    ///
    /// The values of the blocks are freed one after the other, because the peak of memory is here.
    pub fn absorb(&mut self, blocks: Vec<Block>) {
        let (mut first_added_tet, mut first_added_vertex) =
            (self.tets.len() as u32, self.points.len() as u32);
        let (mut numbers, mut meshes) = (Vec::with_capacity(blocks.len()), Vec::with_capacity(blocks.len()));
        for Block { mesh, tets, vertices } in blocks {
            let added_tets = mesh.tets.len() - tets.len();
            let added_vertices = mesh.points.len() - vertices.len();
            numbers.push(Numbers { tets, vertices, first_added_tet, first_added_vertex, added_tets });
            first_added_tet += added_tets as u32;
            first_added_vertex += added_vertices as u32;
            meshes.push(mesh);
        }
        let spheres = take(&mut meshes, |mesh| &mut mesh.spheres);
        put_back(&mut self.spheres, &numbers, spheres, Circumsphere::UNKNOWN, |_, _, _, sphere| sphere);
        let across = take(&mut meshes, |mesh| &mut mesh.across);
        put_back(&mut self.across, &numbers, across, [NONE; 4], |block, slot, before, across| {
            // Faces on the seam keep their links.
            let is_inner = |face: usize| across[face] != NONE || meshes[block].locked[slot] >> face & 1 == 1;
            let link =
                |face| if is_inner(face) { numbers[block].half_face(across[face]) } else { before[face] };
            [0, 1, 2, 3].map(link)
        });
        let tets = take(&mut meshes, |mesh| &mut mesh.tets);
        put_back(&mut self.tets, &numbers, tets, [NONE; 4], |block, _, _, tet| {
            if tet[0] == NONE { tet } else { tet.map(|v| numbers[block].vertex(v)) }
        });
        let bodies = take(&mut meshes, |mesh| &mut mesh.bodies);
        put_back(&mut self.bodies, &numbers, bodies, NONE, |_, _, _, body| body);
        let locked = take(&mut meshes, |mesh| &mut mesh.locked);
        put_back(&mut self.locked, &numbers, locked, 0, |_, _, _, locked| locked);
        for (mesh, numbers) in meshes.iter().zip(&numbers) {
            self.points.extend_from_slice(&mesh.points[numbers.vertices.len()..]);
        }
        self.at_vertex.resize(self.points.len(), NONE);
        for (mesh, numbers) in meshes.iter().zip(&numbers) {
            for (v, &slot) in (0..).zip(&mesh.at_vertex) {
                self.at_vertex[numbers.vertex(v) as usize] = numbers.tet(slot);
            }
            self.free.extend(mesh.free.iter().map(|&slot| numbers.tet(slot)));
        }
        self.clear_marks();
    }
}

/// Takes the values of all slots out of each mesh.
fn take<T>(meshes: &mut [Tetrahedra], values: impl Fn(&mut Tetrahedra) -> &mut Vec<T>) -> Vec<Vec<T>> {
    meshes.iter_mut().map(|mesh| std::mem::take(values(mesh))).collect()
}

/// Writes the values of the slots of blocks into those of the whole mesh, which gets further slots.
/// `convert` gets the block, the slot in it, and the values there in the whole mesh and the block.
fn put_back<T: Copy + Send + Sync>(
    to: &mut Vec<T>,
    numbers: &[Numbers],
    values: Vec<Vec<T>>,
    filler: T,
    convert: impl Fn(usize, usize, T, T) -> T + Sync,
) {
    for (block, (numbers, values)) in numbers.iter().zip(&values).enumerate() {
        for (slot, (&t, &value)) in numbers.tets.iter().zip(values).enumerate() {
            to[t as usize] = convert(block, slot, to[t as usize], value);
        }
    }
    let before = to.len();
    to.resize(before + numbers.iter().map(|numbers| numbers.added_tets).sum::<usize>(), filler);
    let mut rest = &mut to[before..];
    let mut parts = Vec::with_capacity(numbers.len());
    for (numbers, values) in numbers.iter().zip(&values) {
        let (part, others) = rest.split_at_mut(numbers.added_tets);
        parts.push((part, values, numbers.tets.len()));
        rest = others;
    }
    parts.into_par_iter().enumerate().for_each(|(block, (part, values, old))| {
        for (slot, here) in (old..).zip(part) {
            *here = convert(block, slot, filler, values[slot]);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::super::cavity::Cavity;
    use super::super::delaunay::delaunay;
    use super::*;
    use crate::ground::kernel::predicates::{Sign, orient3d};
    use crate::ground::kernel::random::Random;

    fn is_around(mesh: &Tetrahedra, tet: u32, point: &Point) -> bool {
        (4 * tet..4 * tet + 4).all(|half_face| {
            let [a, b, c] = mesh.face_points(half_face);
            orient3d(a, b, c, point) != Sign::Positive
        })
    }

    #[test]
    fn points_inserted_in_blocks_leave_a_valid_delaunay_mesh() {
        let mut random = Random::new(7);
        let mut scattered = |count: usize| -> Vec<Point> {
            (0..count).map(|_| Point::from([(); 3].map(|()| random.unit()))).collect()
        };
        let (first, added) = (scattered(2000), scattered(2000));
        let mut mesh = delaunay(&first, &[]);
        let boxes = Boxes::new(added.iter().copied(), 2, 0.5);
        let tets: Vec<u32> = mesh.alive().collect();
        let cut = Cut::new(&mesh, &tets, &boxes);
        let mut numbers = vec![NONE; mesh.points.len()];
        let mut blocks: Vec<Block> = (0..4).map(|b| Block::new(&mesh, &cut, b, &mut numbers)).collect();
        assert!(numbers.iter().all(|&number| number == NONE));
        let mut inserted = 0;
        let mut cavity = Cavity::default();
        for point in &added {
            let block = &mut blocks[boxes.of(point)].mesh;
            let slots: Vec<u32> = block.alive().collect();
            let Some(seed) = slots.into_iter().find(|&t| is_around(block, t, point)) else { continue };
            cavity.grow(block, seed, point);
            if !cavity.meets_seam && cavity.make_star_shaped(block, seed, point) {
                let v = block.add_point(*point);
                cavity.fill(block, v, 0);
                inserted += 1;
            }
        }
        assert!(inserted > 500, "{inserted}");
        let before = mesh.points.len();
        mesh.absorb(blocks);
        assert_eq!(mesh.points.len(), before + inserted);
        assert_eq!(mesh.check(), Vec::<String>::new());
        let tets: Vec<u32> = mesh.alive().collect();
        for t in tets {
            for other in mesh.across[t as usize].into_iter().filter(|&other| other != NONE) {
                let apex = *mesh.point(mesh.apex(other));
                assert!(
                    !mesh.is_in_sphere(t, &apex),
                    "the face between {t} and {} is not Delaunay",
                    other >> 2
                );
            }
        }
    }

    #[test]
    fn boxes_hold_equal_parts_and_know_their_sides() {
        let points =
            (0..1000).map(|i| Point::new(f64::from(i % 10), f64::from(i / 10 % 10), f64::from(i / 100)));
        let boxes = Boxes::new(points.clone().map(|p| p + p.coords * 1e-3), 3, 0.5);
        let mut counts = vec![0; boxes.len()];
        points.for_each(|p| counts[boxes.of(&(p + p.coords * 1e-3))] += 1);
        assert_eq!(counts, [125; 8]);
        assert!(boxes.is_near_side(&Point::new(4.9, 2.0, 2.0), 0.5));
        assert!(!boxes.is_near_side(&Point::new(2.0, 2.0, 2.0), 0.5));
    }
}

//! Regions of space on both sides of each triangle, and which regions are bodies.
//!
//! Around an edge the triangles are ordered like the pages of a book; the sides that face each
//! other across a sector belong to the same **region** of space. Disconnected components of the
//! surface are related by rays. So regions depend on the positions of the triangles only, not on
//! their orientation. Orientation decides which regions are solid: those with a winding number
//! other than zero (Jacobson, Kavan, Sorkine-Hornung 2013 generalise it; here it is an exact
//! integer, because the surface is closed).

use super::FacetError;
use super::join::{Joined, Layer};
use super::rays::{Hit, shoot_from_point, shoot_from_triangle, tree_of};
use super::{Facets, Marks};
use crate::ground::kernel::predicates::{Sign, orient3d};
use crate::ground::kernel::sets::Sets;
use crate::ground::kernel::simplex::{area_vector, volume6};
use crate::ground::kernel::tree::Tree;
use crate::ground::projector::facets::edges::{Edges, Use};
use crate::{Point, Vector};
use std::cmp::Ordering;

/// The regions on both sides of the triangles.
#[derive(Clone, Debug)]
pub(super) struct Regions {
    /// The bodies behind and in front of each triangle.
    pub sides: Vec<[Option<u32>; 2]>,
    /// The surface that each body belongs to.
    pub files: Vec<u32>,
    /// The number that a file assigns to each body.
    pub numbers: Vec<Option<i64>>,
}

/// The number of the front or back side of a triangle.
fn side_of(triangle: u32, front: bool) -> u32 {
    2 * triangle + u32::from(front)
}

/// Finds the regions; may reorient triangles of surfaces that are not consistently oriented.
///
/// # Errors
/// [`FacetError::Open`], [`FacetError::Overlap`], [`FacetError::NotOrientable`] or
/// [`FacetError::NoRay`], with positions.
pub(super) fn find(joined: &mut Joined, files: &[Facets]) -> Result<Regions, FacetError> {
    let edges = &Edges::new(&joined.triangles);
    refuse_open(joined, edges)?;
    let mut sets = Sets::new(2 * joined.triangles.len());
    for edge in 0..edges.len() {
        join_sectors(joined, edges.uses(edge), &mut sets)?;
    }
    let tree = &tree_of(joined);
    let outside = join_components(joined, tree, edges, &mut sets)?;
    let region: Vec<u32> = (0..2 * joined.triangles.len() as u32).map(|s| sets.find(s)).collect();
    let outside = sets.find(outside);
    let mut solid_in = vec![Vec::new(); region.len()];
    let mut numbered = Vec::new();
    for (file, facets) in (0..).zip(files) {
        let solid = match &facets.marks {
            None => solids(joined, edges, &region, outside, file)?,
            Some(marks) => {
                for &(place, number) in &marks.regions {
                    numbered.push((region_at(joined, tree, &region, outside, place)?, number));
                }
                marked_solids(joined, tree, &region, outside, file, marks)?
            }
        };
        solid.into_iter().for_each(|r| solid_in[r as usize].push(file));
    }
    Ok(number(joined, &region, &solid_in, &numbered))
}

/// The region that contains a point.
fn region_at(
    joined: &Joined,
    tree: &Tree,
    region: &[u32],
    outside: u32,
    place: Point,
) -> Result<u32, FacetError> {
    let hits = shoot_from_point(joined, tree, place).ok_or(FacetError::NoRay(place))?;
    Ok(hits.first().map_or(outside, |hit| region[side_of(hit.triangle, !hit.along) as usize]))
}

/// The regions that one surface separates from the outside, except marked holes.
fn marked_solids(
    joined: &Joined,
    tree: &Tree,
    region: &[u32],
    outside: u32,
    file: u32,
    marks: &Marks,
) -> Result<Vec<u32>, FacetError> {
    let mut open = vec![outside];
    for &hole in &marks.holes {
        open.push(region_at(joined, tree, region, outside, hole)?);
    }
    // Merge regions that are separated by other surfaces only.
    let mut sets = Sets::new(region.len());
    for (t, layers) in joined.layers.iter().enumerate() {
        if layers.iter().all(|l| l.file != file) {
            sets.join(region[2 * t], region[2 * t + 1]);
        }
    }
    let open: Vec<u32> = open.into_iter().map(|r| sets.find(r)).collect();
    let mut solid: Vec<u32> = region.to_vec();
    solid.sort_unstable();
    solid.dedup();
    solid.retain(|&r| !open.contains(&sets.find(r)));
    Ok(solid)
}

/// The most edges listed in an error about gaps.
const SHOWN: usize = 20;

fn refuse_open(joined: &Joined, edges: &Edges) -> Result<(), FacetError> {
    let open = || (0..edges.len()).map(|e| edges.uses(e)).filter(|uses| uses.len() == 1);
    let places: Vec<Point> = open().take(SHOWN).map(|uses| middle(joined, &uses[0])).collect();
    if places.is_empty() { Ok(()) } else { Err(FacetError::Open { count: open().count(), places }) }
}

/// The midpoint of an edge.
fn middle(joined: &Joined, edge: &Use) -> Point {
    let [a, b] = edge.ends.map(|v| &joined.points[v as usize]);
    nalgebra::center(a, b)
}

/// Joins the sides that face each other across the sectors at an edge.
fn join_sectors(joined: &Joined, uses: &[Use], sets: &mut Sets) -> Result<(), FacetError> {
    let mut pages: Vec<Use> = uses.to_vec();
    if uses.len() > 2
        && let Err(pair) = sort_pages(joined, &mut pages)
    {
        return Err(FacetError::Overlap { place: middle(joined, &uses[0]), files: files_of(joined, pair) });
    }
    for i in 0..pages.len() {
        let (page, next) = (&pages[i], &pages[(i + 1) % pages.len()]);
        // A page directed along the edge has its normal in the direction of the turn.
        sets.join(side_of(page.triangle, page.along), side_of(next.triangle, !next.along));
    }
    Ok(())
}

/// The surfaces of two triangles: two different ones if possible.
fn files_of(joined: &Joined, triangles: [u32; 2]) -> [usize; 2] {
    let [of_first, of_second] =
        triangles.map(|t| joined.layers[t as usize].iter().map(|layer| layer.file as usize));
    let pairs = of_first.flat_map(|a| of_second.clone().map(move |b| [a, b]));
    pairs.max_by_key(|[a, b]| a != b).map_or([0; 2], |[a, b]| [a.min(b), a.max(b)])
}

/// Sorts the pages of an edge in a right-handed turn, starting with the first.
///
/// # Errors
/// If two coincide: their triangles.
fn sort_pages(joined: &Joined, pages: &mut [Use]) -> Result<(), [u32; 2]> {
    let point = |v: u32| &joined.points[v as usize];
    let apex = |u: &Use| point(joined.triangles[u.triangle as usize][u.side as usize]);
    let [a, b] = pages[0].ends.map(point);
    let first = pages[0];
    // A point off the plane of the first page distinguishes its two half-planes.
    let step = (b - a).amax();
    let aside = (0..3).map(|k| a + Vector::ith(k, step));
    let Some(beside) = aside.into_iter().find(|p| orient3d(a, b, apex(&first), p) != Sign::Zero) else {
        return Err([first.triangle; 2]);
    };
    let first_side = orient3d(a, b, &beside, apex(&first));
    // 0: same half-plane as the first; 1: less than half a turn; 2: half a turn; 3: more.
    let quarter = |u: &Use| match orient3d(a, b, apex(&first), apex(u)) {
        Sign::Positive => 1,
        Sign::Negative => 3,
        Sign::Zero if orient3d(a, b, &beside, apex(u)) == first_side => 0,
        Sign::Zero => 2,
    };
    let compare = |u: &Use, w: &Use| {
        quarter(u).cmp(&quarter(w)).then_with(|| match orient3d(a, b, apex(u), apex(w)) {
            Sign::Positive => Ordering::Less,
            Sign::Negative => Ordering::Greater,
            Sign::Zero => Ordering::Equal,
        })
    };
    pages.sort_by(compare);
    match pages.windows(2).find(|w| compare(&w[0], &w[1]) == Ordering::Equal) {
        Some(pair) => Err([pair[0].triangle, pair[1].triangle]),
        None => Ok(()),
    }
}

/// Joins the regions of disconnected components; returns a side that faces the outside of all.
///
/// A ray is shot from each component. Between two of its triangles it stays in one region, and
/// behind the last one it is outside of all.
fn join_components(joined: &Joined, tree: &Tree, edges: &Edges, sets: &mut Sets) -> Result<u32, FacetError> {
    let mut component = Sets::new(joined.triangles.len());
    for edge in 0..edges.len() {
        edges.uses(edge).windows(2).for_each(|w| component.join(w[0].triangle, w[1].triangle));
    }
    let components: Vec<u32> = (0..joined.triangles.len() as u32).map(|t| component.find(t)).collect();
    let mut largest: Vec<Option<(f64, u32)>> = vec![None; components.len()];
    for (t, &p) in components.iter().enumerate() {
        let area = normal(joined, t as u32).norm();
        if largest[p as usize].is_none_or(|(most, _)| area > most) {
            largest[p as usize] = Some((area, t as u32));
        }
    }
    let mut outside = None;
    for (_, start) in largest.into_iter().flatten() {
        let corner = joined.points[joined.triangles[start as usize][0] as usize];
        let hits = shoot_from_triangle(joined, tree, start).ok_or(FacetError::NoRay(corner))?;
        let [behind, before] =
            [false, true].map(|front| move |hit: &Hit| side_of(hit.triangle, hit.along == front));
        for pair in hits.windows(2) {
            sets.join(before(&pair[0]), behind(&pair[1]));
        }
        let end = hits.last().map(before).expect("the ray starts on a triangle");
        sets.join(end, *outside.get_or_insert(end));
    }
    outside.ok_or(FacetError::Empty)
}

pub(super) fn normal(joined: &Joined, t: u32) -> Vector {
    let [a, b, c] = joined.triangles[t as usize].map(|v| &joined.points[v as usize]);
    area_vector(a, b, c)
}

/// The regions with a winding number other than zero for one surface.
///
/// A surface that is not consistently oriented is reoriented first; if that does not help, all
/// bounded regions are solid.
fn solids(
    joined: &mut Joined,
    edges: &Edges,
    region: &[u32],
    outside: u32,
    file: u32,
) -> Result<Vec<u32>, FacetError> {
    if let Some(solid) = winding(joined, region, outside, file) {
        return Ok(solid);
    }
    orient(joined, edges, file)?;
    Ok(winding(joined, region, outside, file).unwrap_or_else(|| {
        let mut all: Vec<u32> = region.iter().copied().filter(|&r| r != outside).collect();
        all.sort_unstable();
        all.dedup();
        all
    }))
}

/// The regions with a winding number other than 0; `None` if the number depends on the path.
fn winding(joined: &Joined, region: &[u32], outside: u32, file: u32) -> Option<Vec<u32>> {
    // From behind a triangle to its front the number decreases by its layers.
    let mut steps: Vec<(u32, u32, i32)> = Vec::with_capacity(2 * joined.triangles.len());
    for (t, layers) in joined.layers.iter().enumerate() {
        let fall = |l: &Layer| if l.even { 1 } else { -1 };
        let jump: i32 = layers.iter().filter(|l| l.file == file).map(fall).sum();
        let [behind, front] = [region[2 * t], region[2 * t + 1]];
        steps.push((behind, front, -jump));
        steps.push((front, behind, jump));
    }
    steps.sort_unstable();
    steps.dedup();
    let mut numbers: Vec<Option<i32>> = vec![None; region.len()];
    numbers[outside as usize] = Some(0);
    let mut queue = vec![outside];
    while let Some(r) = queue.pop() {
        let here = numbers[r as usize].unwrap_or(0);
        let first = steps.partition_point(|s| s.0 < r);
        for &(_, to, change) in steps[first..].iter().take_while(|s| s.0 == r) {
            match numbers[to as usize] {
                None => {
                    numbers[to as usize] = Some(here + change);
                    queue.push(to);
                }
                Some(n) if n != here + change => return None,
                Some(_) => {}
            }
        }
    }
    let solid = |(r, n): (usize, &Option<i32>)| n.is_some_and(|n| n != 0).then_some(r as u32);
    Some(numbers.iter().enumerate().filter_map(solid).collect())
}

/// Orients a surface consistently, by flipping the part with the lesser area of each connected
/// sheet.
fn orient(joined: &mut Joined, edges: &Edges, file: u32) -> Result<(), FacetError> {
    let has = |t: u32| joined.layers[t as usize].iter().any(|l| l.file == file);
    let even = |t: u32| joined.layers[t as usize].iter().find(|l| l.file == file).is_some_and(|l| l.even);
    let mut turned: Vec<Option<bool>> = vec![None; joined.triangles.len()];
    let mut flips = Vec::new();
    for seed in (0..joined.triangles.len() as u32).filter(|&t| has(t)) {
        if turned[seed as usize].is_some() {
            continue;
        }
        turned[seed as usize] = Some(false);
        let mut sheet = vec![seed];
        let mut next = 0;
        while let Some(&t) = sheet.get(next) {
            next += 1;
            for edge in edges.of_side[t as usize] {
                let here: Vec<&Use> = edges.uses(edge as usize).iter().filter(|u| has(u.triangle)).collect();
                let [a, b] = here[..] else { continue };
                let (own, other) = if a.triangle == t { (a, b) } else { (b, a) };
                let agree = (own.along == even(t)) != (other.along == even(other.triangle));
                let wanted = turned[t as usize].map(|x| x == agree);
                match turned[other.triangle as usize] {
                    None => {
                        turned[other.triangle as usize] = wanted;
                        sheet.push(other.triangle);
                    }
                    is if is != wanted => {
                        return Err(FacetError::NotOrientable(middle(joined, own)));
                    }
                    _ => {}
                }
            }
        }
        let area = |yes: bool| -> f64 {
            let some = sheet.iter().filter(|&&t| turned[t as usize] == Some(yes));
            some.map(|&t| normal(joined, t).norm()).sum()
        };
        let minority = area(true) <= area(false);
        flips.extend(sheet.iter().copied().filter(|&t| turned[t as usize] == Some(minority)));
    }
    for t in flips {
        let own = joined.layers[t as usize].iter_mut().filter(|l| l.file == file);
        own.for_each(|l| l.even = !l.even);
    }
    Ok(())
}

/// Numbers the solid regions as bodies, in the order of their triangles.
fn number(joined: &Joined, region: &[u32], solid_in: &[Vec<u32>], numbered: &[(u32, i64)]) -> Regions {
    let volumes = file_volumes(joined);
    let mut body_of: Vec<Option<u32>> = vec![None; region.len()];
    let mut files = Vec::new();
    let sides = (0..joined.triangles.len()).map(|t| {
        [0, 1].map(|s| {
            let r = region[2 * t + s] as usize;
            // If a region is inside several surfaces, the body belongs to the smallest.
            let file = solid_in[r]
                .iter()
                .copied()
                .min_by(|&f, &g| volumes[f as usize].total_cmp(&volumes[g as usize]))?;
            if body_of[r].is_none() {
                body_of[r] = Some(files.len() as u32);
                files.push(file);
            }
            body_of[r]
        })
    });
    let sides = sides.collect();
    let mut numbers = vec![None; files.len()];
    for &(r, number) in numbered {
        if let Some(body) = body_of[r as usize] {
            numbers[body as usize] = Some(number);
        }
    }
    Regions { sides, files, numbers }
}

/// The volume enclosed by each surface, by a surface integral.
fn file_volumes(joined: &Joined) -> Vec<f64> {
    let files = joined.layers.iter().flatten().map(|l| l.file as usize + 1).max().unwrap_or(0);
    let mut volumes = vec![0.0; files];
    let o = joined.points[0];
    for (v, layers) in joined.triangles.iter().zip(&joined.layers) {
        let [a, b, c] = v.map(|v| &joined.points[v as usize]);
        let volume = volume6(&o, a, b, c);
        for l in layers {
            volumes[l.file as usize] += if l.even { volume } else { -volume };
        }
    }
    volumes.iter().map(|v: &f64| v.abs()).collect()
}

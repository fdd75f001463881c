//! Geometric partition: recursive coordinate bisection (Berger and Bokhari 1987).

use crate::ground::mesh::{Mesh, Rank};

/// Fewer tets than this are split on one thread.
const SPLIT_ALONE: usize = 10_000;

/// A tet's centroid (times four), its index, its part.
type Item = ([f64; 3], u32, Rank);

/// Partitions into parts whose sizes differ by at most one.
///
/// The tets are split by centroid at a plane across the longest side of their box, in proportion to
/// the numbers of parts on both sides; ties go by index.
pub fn bisect(mesh: &Mesh, parts: u32) -> Vec<Rank> {
    let center = |tet: &[_; 4]| {
        tet.iter().fold([0.0; 3], |[x, y, z], v: &crate::ground::mesh::VertexId| {
            let p = &mesh.points[v.index()];
            [x + p.x, y + p.y, z + p.z]
        })
    };
    let mut items: Vec<Item> = (0..).zip(&mesh.tets).map(|(index, tet)| (center(tet), index, 0)).collect();
    split(&mut items, 0, parts);
    let mut part = vec![0; items.len()];
    items.iter().for_each(|&(_, index, p)| part[index as usize] = p);
    part
}

/// Assigns parts from `first` on to the items.
fn split(items: &mut [Item], first: Rank, parts: u32) {
    if parts == 1 {
        items.iter_mut().for_each(|item| item.2 = first);
        return;
    }
    let axis = longest_axis(items);
    let low_parts = parts / 2;
    let low_count = (items.len() as u64 * u64::from(low_parts) / u64::from(parts)) as usize;
    items.select_nth_unstable_by(low_count, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
    let (low, high) = items.split_at_mut(low_count);
    let low_task = |low| split(low, first, low_parts);
    let high_task = |high| split(high, first + low_parts, parts - low_parts);
    if low.len() < SPLIT_ALONE {
        low_task(low);
        high_task(high);
    } else {
        rayon::join(|| low_task(low), || high_task(high));
    }
}

/// The axis along which the box of the centroids is longest; the first on ties.
fn longest_axis(items: &[Item]) -> usize {
    let length = |axis: usize| {
        let coordinates = || items.iter().map(|item| item.0[axis]);
        coordinates().fold(f64::NEG_INFINITY, f64::max) - coordinates().fold(f64::INFINITY, f64::min)
    };
    let lengths = [length(0), length(1), length(2)];
    (1..3).fold(0, |best, axis| if lengths[axis] > lengths[best] { axis } else { best })
}

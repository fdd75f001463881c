//! Checks the regions between the triangles around each edge.
//!
//! Around a directed edge the triangles are ordered like the pages of a book; between two
//! neighbours is a **sector**. Both must assign it the same region. The order is exact.

use crate::Point;
use crate::ground::kernel::predicates::{Sign, orient2d, orient3d};
use csg::BodyId;
use std::cmp::Ordering;

/// A fault around an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum EdgeFault {
    /// Two triangles are in the same half-plane.
    Overlap([u32; 2]),
    /// A sector to which its two triangles assign different regions.
    Open([u32; 2], [Option<BodyId>; 2]),
}

/// A triangle at an edge: its apex, and the regions before and after it in a right-handed turn
/// around the edge.
#[derive(Clone, Copy, Debug)]
struct Page {
    edge: [u32; 2],
    triangle: u32,
    apex: u32,
    before: Option<BodyId>,
    after: Option<BodyId>,
}

/// The first fault of each edge, by edge.
pub(super) fn edge_faults(
    points: &[Point],
    triangles: &[[u32; 3]],
    regions: &[[Option<BodyId>; 2]],
) -> Vec<([u32; 2], EdgeFault)> {
    let mut pages = pages(triangles, regions);
    pages.sort_unstable_by_key(|p| (p.edge, p.triangle));
    let mut faults = Vec::new();
    for book in pages.chunk_by_mut(|p, q| p.edge == q.edge) {
        if let Some(fault) = book_fault(points, book) {
            faults.push((book[0].edge, fault));
        }
    }
    faults
}

fn pages(triangles: &[[u32; 3]], regions: &[[Option<BodyId>; 2]]) -> Vec<Page> {
    let mut pages = Vec::with_capacity(3 * triangles.len());
    for (t, (&[a, b, c], &[behind, front])) in triangles.iter().zip(regions).enumerate() {
        for [from, to, apex] in [[a, b, c], [b, c, a], [c, a, b]] {
            // The normal is edge × page, so a right-handed turn passes from behind to front.
            let (edge, before, after) =
                if from < to { ([from, to], behind, front) } else { ([to, from], front, behind) };
            pages.push(Page { edge, triangle: t as u32, apex, before, after });
        }
    }
    pages
}

fn book_fault(points: &[Point], book: &mut [Page]) -> Option<EdgeFault> {
    if let [one, other] = *book {
        // Two triangles need no sorting; they only must not overlap.
        if half_turn(points, &one, &other) == Turn::None {
            return Some(EdgeFault::Overlap([one.triangle, other.triangle]));
        }
    } else {
        let first = book[0];
        book.sort_by(|p, q| compare(points, &first, p, q));
        for pair in book.windows(2) {
            if compare(points, &first, &pair[0], &pair[1]) == Ordering::Equal {
                return Some(EdgeFault::Overlap([pair[0].triangle, pair[1].triangle]));
            }
        }
    }
    (0..book.len()).find_map(|i| {
        let (page, next) = (book[i], book[(i + 1) % book.len()]);
        (page.after != next.before)
            .then_some(EdgeFault::Open([page.triangle, next.triangle], [page.after, next.before]))
    })
}

/// The angle from one page to another, compared with a half turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Turn {
    None,
    BelowHalf,
    Half,
    AboveHalf,
}

fn half_turn(points: &[Point], from: &Page, to: &Page) -> Turn {
    let [a, b] = from.edge.map(|v| &points[v as usize]);
    let [c, d] = [from.apex, to.apex].map(|v| &points[v as usize]);
    match orient3d(a, b, c, d) {
        Sign::Positive => Turn::BelowHalf,
        Sign::Negative => Turn::AboveHalf,
        Sign::Zero if from.apex == to.apex || same_side(a, b, c, d) => Turn::None,
        Sign::Zero => Turn::Half,
    }
}

/// Whether coplanar points c and d, both off line ab, are on the same side of it.
fn same_side(a: &Point, b: &Point, c: &Point, d: &Point) -> bool {
    [[0, 1], [1, 2], [2, 0]].iter().any(|&[i, j]| {
        let side = |p: &Point| orient2d([a[i], a[j]], [b[i], b[j]], [p[i], p[j]]);
        side(c) != Sign::Zero && side(c) == side(d)
    })
}

/// The order of two pages in a right-handed turn that starts at `first`.
fn compare(points: &[Point], first: &Page, p: &Page, q: &Page) -> Ordering {
    let (turn, other) = (half_turn(points, first, p), half_turn(points, first, q));
    turn.cmp(&other).then_with(|| match (turn, half_turn(points, p, q)) {
        (Turn::None | Turn::Half, _) | (_, Turn::None) => Ordering::Equal,
        (_, Turn::BelowHalf) => Ordering::Less,
        _ => Ordering::Greater,
    })
}

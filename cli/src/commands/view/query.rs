//! The queries of the page.

use tetmill::files::view::{Cutter, Region};
use tetmill::run::MAX_PIECES;

/// What the page asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Query {
    /// `level/PIECES`: a level, whole or its surface.
    Level(u32),
    /// `cut/PIECES/CUTTER/LOWX,LOWY,LOWZ,HIGHX,HIGHY,HIGHZ`: the tets that meet a cutter inside a
    /// window, at this level or a coarser one. The cutter is a plane, `NX,NY,NZ,OFFSET`, or a box
    /// with its corners as those of the window.
    Cut {
        /// Subdivisions of each coarse edge.
        pieces: u32,
        /// The cutter and the window.
        region: Region,
    },
    /// `ghosts/PIECES/PART`: the tets of other parts that touch a part, at a level that is shown
    /// whole.
    Ghosts {
        /// Subdivisions of each coarse edge.
        pieces: u32,
        /// The part, from 0.
        part: u32,
    },
}

impl Query {
    /// Reads a query; `None` if it is none.
    pub fn parse(text: &str) -> Option<Self> {
        let words: Vec<&str> = text.split('/').collect();
        match words[..] {
            ["level", pieces] => Some(Self::Level(pieces_of(pieces)?)),
            ["ghosts", pieces, part] => {
                Some(Self::Ghosts { pieces: pieces_of(pieces)?, part: part.parse().ok()? })
            }
            ["cut", pieces, cutter, window] => {
                let [low, high] = corners(window)?;
                let region = Region { cutter: plane_of(cutter).or_else(|| box_of(cutter))?, low, high };
                Some(Self::Cut { pieces: pieces_of(pieces)?, region })
            }
            _ => None,
        }
    }
}

fn pieces_of(text: &str) -> Option<u32> {
    text.parse().ok().filter(|pieces| (1..=MAX_PIECES).contains(pieces))
}

/// Coordinates up to this are products that arithmetic can reach.
const FARTHEST: f64 = 1e100;

/// A plane with a direction.
fn plane_of(text: &str) -> Option<Cutter> {
    let [x, y, z, offset] = numbers(text)?;
    let length = (x * x + y * y + z * z).sqrt();
    let is_plane = (1.0 / FARTHEST..FARTHEST).contains(&length) && offset.abs() <= FARTHEST;
    is_plane.then(|| Cutter::Plane { normal: [x, y, z].map(|n| n / length), offset: offset / length })
}

/// A box whose first corner is the lowest.
fn box_of(text: &str) -> Option<Cutter> {
    let [low, high] = corners(text)?;
    let is_box = (0..3).all(|k| -FARTHEST <= low[k] && low[k] <= high[k] && high[k] <= FARTHEST);
    is_box.then_some(Cutter::Box { low, high })
}

fn corners(text: &str) -> Option<[[f64; 3]; 2]> {
    let [a, b, c, d, e, f] = numbers(text)?;
    Some([[a, b, c], [d, e, f]])
}

/// Exactly `N` finite numbers.
fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|number| number.parse().ok()).collect();
    numbers?.try_into().ok().filter(|all: &[f64; N]| all.iter().all(|x| x.is_finite()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_cuts_and_ghosts_are_read() {
        assert_eq!(Query::parse("level/52"), Some(Query::Level(52)));
        assert_eq!(Query::parse("ghosts/2/0"), Some(Query::Ghosts { pieces: 2, part: 0 }));
        let cutter = Cutter::Plane { normal: [0.0, 1.0, 0.0], offset: -0.5 };
        let region = Region { cutter, low: [-1.0, 0.0, 0.0], high: [1.0, 1e3, 3.0] };
        let cut = "cut/8/0,2,0,-1/-1,0,0,1,1e3,3";
        assert_eq!(Query::parse(cut), Some(Query::Cut { pieces: 8, region }));
        let region = Region { cutter: Cutter::Box { low: [-1.0; 3], high: [0.5, 1.0, -1.0] }, ..region };
        let cut = "cut/8/-1,-1,-1,0.5,1,-1/-1,0,0,1,1e3,3";
        assert_eq!(Query::parse(cut), Some(Query::Cut { pieces: 8, region }));
    }

    #[test]
    fn anything_else_is_no_query() {
        let bad = [
            "",
            "level",
            "level/",
            "level/0",
            "level/-1",
            "level/1025",
            "level/4294967297",
            "level/1/2",
            "levels/1",
            "ghosts/1",
            "ghosts/1/-1",
            "ghosts/0/1",
            "ghosts/1/4294967296",
            "level/x",
            "cut/8",
            "cut/8/0,0,1,0",
            "cut/8/0,0,0,1/0,0,0,1,1,1",
            "cut/8/0,0,1/0,0,0,1,1,1",
            "cut/8/0,0,1,0/0,0,0,1,1",
            "cut/8/0,0,1,nan/0,0,0,1,1,1",
            "cut/8/0,0,1,inf/0,0,0,1,1,1",
            "cut/8/0,0,1e300,0/0,0,0,1,1,1",
            "cut/8/0,0,1,0/0,0,0,1,1,1,1",
            "cut/8/0,0,1,0/0,0,0,1,1,",
            "cut/0/0,0,1,0/0,0,0,1,1,1",
            "cut/8/0,0,0,1,1/0,0,0,1,1,1",
            "cut/8/0,0,0,1,1,1,1/0,0,0,1,1,1",
            "cut/8/0,0,0,1,1,-1/0,0,0,1,1,1",
            "cut/8/0,0,0,1,1,nan/0,0,0,1,1,1",
            "cut/8/0,0,0,1,1,1e101/0,0,0,1,1,1",
            "cut/8/0,0,0,1,1,1/0,0,0,1,1",
            "box/8/0,0,0,1,1,1/0,0,0,1,1,1",
        ];
        for text in bad {
            assert_eq!(Query::parse(text), None, "{text}");
        }
    }
}

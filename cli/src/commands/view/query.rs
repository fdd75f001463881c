//! The queries of the page.

use tetmill::files::view::Region;
use tetmill::run::MAX_PIECES;

/// What the page asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Query {
    /// `level/PIECES`: a level, whole or its surface.
    Level(u32),
    /// `cut/PIECES/NX,NY,NZ,OFFSET/LOWX,LOWY,LOWZ,HIGHX,HIGHY,HIGHZ`: the tets that meet a plane
    /// inside a box, at this level or a coarser one.
    Cut {
        /// Subdivisions of each coarse edge.
        pieces: u32,
        /// The plane and the box.
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
            ["cut", pieces, plane, bounds] => {
                let [x, y, z, offset] = numbers(plane)?;
                let [a, b, c, d, e, f] = numbers(bounds)?;
                let length = (x * x + y * y + z * z).sqrt();
                // A plane of such numbers has a direction, and a place that arithmetic can reach.
                if !(1e-100..1e100).contains(&length) || offset.abs() > 1e100 {
                    return None;
                }
                let region = Region {
                    normal: [x, y, z].map(|n| n / length),
                    offset: offset / length,
                    low: [a, b, c],
                    high: [d, e, f],
                };
                Some(Self::Cut { pieces: pieces_of(pieces)?, region })
            }
            _ => None,
        }
    }
}

fn pieces_of(text: &str) -> Option<u32> {
    text.parse().ok().filter(|pieces| (1..=MAX_PIECES).contains(pieces))
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
        let region =
            Region { normal: [0.0, 1.0, 0.0], offset: -0.5, low: [-1.0, 0.0, 0.0], high: [1.0, 1e3, 3.0] };
        let cut = "cut/8/0,2,0,-1/-1,0,0,1,1e3,3";
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
        ];
        for text in bad {
            assert_eq!(Query::parse(text), None, "{text}");
        }
    }
}

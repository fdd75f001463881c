//! How many tets are wanted, and the coarse mesh and the pieces of its edges that give them.
//!
//! T coarse tets become T·n³. Any n is possible, but the lattice of its odd part has no midpoints to come from and is interpolated
//! point by point: n = m·2ᵏ with m small. So T is steered to where some such n fits, from few enough coarse tets that making them takes no time to
//! speak of, and not so few that they are badly shaped, or a part gets too few to be balanced.

use super::coarse::{CoarseMesh, CoarseSettings};
use super::mend::{self, MendError};
use super::model::Model;
use super::target::{Outcome, mesh_to_target};
use crate::refine::lattice::MAX_PIECES;
use crate::refine::pieces_for;
use crate::size::Source;

/// How many tets are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// What the sizes give, with edges cut into this many pieces.
    Sizes {
        /// Pieces of each coarse edge.
        pieces: u32,
    },
    /// A coarse mesh with this many, and its edges cut into this many pieces.
    Coarse {
        /// Tets of the coarse mesh.
        tets: u64,
        /// Pieces of each coarse edge.
        pieces: u32,
    },
    /// This many in all, to 1.3 times as many: pieces are chosen.
    Elements(u64),
}

/// Below this many coarse tets a mesh that is to have many is not refined, but made finer. The shaft's mesh of 1.4·10⁹ tets has
/// a smallest dihedral angle of 18° from 5,800 coarse tets.
const LEAST_COARSE: u64 = 5_000;

/// And below this many for each part: METIS keeps parts of 100 tets within a few percent of each other.
const LEAST_OF_PART: u64 = 100;

/// The largest odd factor of the pieces that are chosen: with it every n from 8 on is within a ninth of such a one.
const MOST_ODD: u32 = 15;

/// A wanted number is delivered to within this factor above it, ten times the numerator and the denominator.
const ROOM: [u64; 2] = [13, 10];

/// The least pieces, with a small odd factor, that make of `tets` coarse tets `count` to 1.3·`count`.
fn pieces_within(tets: u64, count: u64) -> Option<u32> {
    let made = |n: u32| u128::from(tets) * u128::from(n).pow(3);
    let most = u128::from(count) * u128::from(ROOM[0]) / u128::from(ROOM[1]);
    let first = pieces_for(tets, count);
    (first..=MAX_PIECES).take_while(|&n| made(n) <= most).find(|&n| is_cheap(n))
}

fn is_cheap(n: u32) -> bool {
    n >> n.trailing_zeros() <= MOST_ODD
}

/// The most pieces with a small odd factor for which `count` tets come of `coarse` tets or more.
fn most_pieces(count: u64, coarse: u64) -> u32 {
    let fits = |n: &u32| is_cheap(*n) && u128::from(*n).pow(3) * u128::from(coarse) <= u128::from(count);
    (1..=MAX_PIECES).rev().find(fits).unwrap_or(1)
}

/// What came of a wish: the pieces of each coarse edge, the coarse mesh, and how the wanted number came out, if one was wanted.
pub(super) type Granted = (u32, CoarseMesh, Option<Outcome>);

/// Makes a coarse mesh that can be refined as wanted, for so many parts. `sources` are added to the sizes.
///
/// # Errors
/// No coarse mesh, or none whose children are positive.
pub(super) fn mesh_as_wanted(
    parts: u32,
    model: &Model,
    settings: &CoarseSettings,
    wanted: Wanted,
    sources: &[Source],
) -> Result<Granted, MendError> {
    let with = |more: &[Source]| {
        let mut coarse = settings.clone();
        coarse.size.sources.extend(sources.iter().chain(more));
        coarse
    };
    let to_target = |tets: u64, pieces: u32, fits: &dyn Fn(u64) -> bool| {
        mend::refinable(model, pieces, |more| mesh_to_target(model, &mut with(more), tets, fits))
    };
    match wanted {
        Wanted::Elements(count) if let Model::Given(given) = model => {
            let pieces = pieces_for(given.mesh.tets.len() as u64, count);
            Ok((pieces, model.coarse_mesh(&mut settings.clone())?, None))
        }
        Wanted::Sizes { pieces } => {
            let make = |more: &[Source]| Ok((model.coarse_mesh(&mut with(more))?, None));
            let (made, outcome) = mend::refinable(model, pieces, make)?;
            Ok((pieces, made, outcome))
        }
        Wanted::Coarse { tets, pieces } => {
            let (made, outcome) = to_target(tets, pieces, &|made| made >= tets && made <= tets + tets / 2)?;
            Ok((pieces, made, Some(outcome)))
        }
        Wanted::Elements(count) => {
            let mut pieces = most_pieces(count, LEAST_COARSE.max(LEAST_OF_PART * u64::from(parts)));
            loop {
                let tets = count.div_ceil(u64::from(pieces).pow(3));
                // A coarse mesh near what was aimed at, with whatever pieces fit.
                let near = |made: u64| made >= tets / 2 && made <= 2 * tets;
                let fits = |made: u64| near(made) && pieces_within(made, count).is_some();
                let (made, outcome) = to_target(tets, pieces, &fits)?;
                if let Some(pieces) = pieces_within(made.report.tets, count) {
                    return Ok((pieces, made, Some(Outcome::Reached)));
                }
                if pieces == 1 {
                    return Ok((pieces, made, Some(outcome)));
                }
                // Too fine a coarse mesh for so many pieces: fewer pieces reach the number.
                pieces = (pieces - 1).min(most_pieces(count, made.report.tets));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_chosen_that_give_the_number_and_little_more() {
        assert_eq!(pieces_within(5_800, 1_400_000_000), Some(64));
        assert_eq!(pieces_within(5_000, 5_000), Some(1));
        assert_eq!(pieces_within(6_501, 5_000), None);
        // 17 and 19 pieces are passed over for 18 and 20.
        assert_eq!(pieces_within(1_000, 17_u64.pow(3) * 1_000), Some(18));
        assert_eq!(pieces_within(9, 10_000_000_000), None);
    }

    #[test]
    fn nearly_every_coarse_mesh_fits_a_large_number() {
        for count in [100_000_000, 1_400_000_000, 10_000_000_000_u64] {
            let fitting = (5_000..10_000).filter(|&tets| pieces_within(tets, count).is_some()).count();
            assert!(fitting > 4_000, "{count}: {fitting}");
        }
    }

    #[test]
    fn the_most_pieces_leave_enough_coarse_tets() {
        assert_eq!(most_pieces(1_400_000_000, 5_000), 64);
        assert_eq!(most_pieces(39_999, 5_000), 1);
        assert_eq!(most_pieces(40_000, 5_000), 2);
        assert_eq!(most_pieces(100, 5_000), 1);
    }
}

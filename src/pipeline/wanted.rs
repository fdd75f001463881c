//! Chooses the coarse mesh and the subdivisions of its edges for a requested number of tets.
//!
//! T coarse tets become T·n³. Any n is possible, but the lattice of its odd factor has no midpoints
//! and is interpolated point by point, so n = m·2ᵏ with small m. T is adjusted until such an n
//! fits: small enough that the coarse mesh takes little time, but large enough for good shapes and
//! balanced parts.

use super::coarse::CoarseSettings;
use super::coarse_mesh::CoarseMesh;
use super::error::Error;
use super::mend;
use super::model::Model;
use super::retries::Budget;
use super::settings::{Request, Wanted};
use super::target::{Outcome, first_scale, mesh_to_target};
use crate::ground::mesh::Order;
use crate::ground::progress::Work;
use crate::ground::size::Source;
use crate::parallel::refine::lattice::MAX_PIECES;
use crate::parallel::refine::{pieces_for, possible_pieces};

/// The coarse mesh of a large mesh has at least this many tets. The shaft's mesh of 1.4·10⁹ tets
/// has a smallest dihedral angle of 18° from 5,800 coarse tets.
const LEAST_COARSE: u64 = 5_000;

/// It also has at least this many tets for each part: METIS balances parts of 100 tets within a few
/// percent.
const LEAST_OF_PART: u64 = 100;

/// The largest odd factor of the subdivisions: every n from 8 on is within a ninth of such a
/// number.
const MOST_ODD: u32 = 15;

/// The accepted factor above the requested number, as numerator and denominator.
const ROOM: [u64; 2] = [13, 10];

/// The least number of subdivisions with a small odd factor that turns `tets` coarse tets into
/// `count` to 1.3·`count`.
fn pieces_within(tets: u64, count: u64, order: Order) -> Option<u32> {
    let made = |n: u32| u128::from(tets) * u128::from(n).pow(3);
    let most = u128::from(count) * u128::from(ROOM[0]) / u128::from(ROOM[1]);
    let first = pieces_for(tets, count);
    (first..=MAX_PIECES / order.degree()).take_while(|&n| made(n) <= most).find(|&n| is_cheap(n))
}

fn is_cheap(n: u32) -> bool {
    n >> n.trailing_zeros() <= MOST_ODD
}

/// The largest number of subdivisions with a small odd factor at which `count` tets need `coarse`
/// coarse tets or more.
fn most_pieces(count: u64, coarse: u64, order: Order) -> u32 {
    let fits = |n: &u32| is_cheap(*n) && u128::from(*n).pow(3) * u128::from(coarse) <= u128::from(count);
    (1..=MAX_PIECES / order.degree()).rev().find(fits).unwrap_or(1)
}

/// The subdivisions of each coarse edge, the coarse mesh, and whether the requested number was
/// reached, if one was requested.
pub(super) type Granted = (u32, CoarseMesh, Option<Outcome>);

/// Makes a coarse mesh that can be refined as requested for this number of parts. `sources` are
/// added to the sizes.
///
/// # Errors
/// No coarse mesh, or none without inverted children.
pub(super) fn mesh_as_wanted(
    parts: u32,
    model: &Model,
    settings: &CoarseSettings,
    Request { wanted, refined }: Request,
    sources: &[Source],
    budget: &Budget,
    work: &Work,
) -> Result<Granted, Error> {
    let order = settings.order;
    let with = |more: &[Source], pieces: u32| {
        let is_final = pieces * refined == 1 && order == Order::First;
        let mut coarse = CoarseSettings { is_final, ..settings.clone() };
        coarse.size.sources.extend(sources.iter().chain(more));
        coarse
    };
    let to_target = |tets: u64, pieces: u32, fits: &dyn Fn(u64) -> bool, is_of_use: &dyn Fn(u64) -> bool| {
        // Sizes lowered at some places change the number little: the search goes on from the scale
        // that it found, or ends with it where no number fits.
        let mut found = None;
        mend::refinable(model, (pieces * refined, order), budget, is_of_use, |more| {
            let mut coarse = with(more, pieces);
            coarse.size.scale = match found {
                Some((scale, _)) => scale,
                None => first_scale(model, &coarse.size, tets),
            };
            let (made, outcome) = match found {
                Some((_, outcome @ (Outcome::Least | Outcome::Jumped))) => {
                    (model.coarse_mesh(&mut coarse, budget, work)?, outcome)
                }
                _ => mesh_to_target(model, &mut coarse, tets, fits, budget, work)?,
            };
            found = Some((coarse.size.scale, outcome));
            Ok((made, outcome))
        })
    };
    match wanted {
        Wanted::Elements(count) if let Model::Given(given) = model => {
            let pieces = possible_pieces(pieces_for(given.mesh.tets.len() as u64, count), settings.order)?;
            Ok((pieces, model.coarse_mesh(&mut settings.clone(), budget, work)?, None))
        }
        Wanted::Sizes { pieces } => {
            let make =
                |more: &[Source]| Ok((model.coarse_mesh(&mut with(more, pieces), budget, work)?, None));
            let (made, outcome) = mend::refinable(model, (pieces * refined, order), budget, &|_| true, make)?;
            Ok((pieces, made, outcome))
        }
        Wanted::Coarse { tets, pieces } => {
            let fits = |made: u64| made >= tets && made <= tets + tets / 2;
            let (made, outcome) = to_target(tets, pieces, &fits, &|_| true)?;
            Ok((pieces, made, Some(outcome)))
        }
        Wanted::Elements(count) => {
            let mut pieces = most_pieces(count, LEAST_COARSE.max(LEAST_OF_PART * u64::from(parts)), order);
            loop {
                let tets = count.div_ceil(u64::from(pieces).pow(3));
                // Accept a coarse mesh near the goal for which some number of subdivisions fits.
                let near = |made: u64| made >= tets / 2 && made <= 4 * tets;
                let pieces_of = |made: u64| pieces_within(made, count, order);
                let fits = |made: u64| near(made) && pieces_of(made).is_some();
                let is_of_use = |made: u64| pieces == 1 || pieces_of(made).is_some();
                let (made, outcome) = to_target(tets, pieces, &fits, &is_of_use)?;
                if let Some(pieces) = pieces_of(made.report.tets) {
                    return Ok((pieces, made, Some(Outcome::Reached)));
                }
                if pieces == 1 {
                    return Ok((pieces, made, Some(outcome)));
                }
                // The coarse mesh is too fine for this many subdivisions: fewer reach the number.
                pieces = (pieces - 1).min(most_pieces(count, made.report.tets, order));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_chosen_that_give_the_number_and_little_more() {
        assert_eq!(pieces_within(5_800, 1_400_000_000, Order::First), Some(64));
        assert_eq!(pieces_within(5_000, 5_000, Order::First), Some(1));
        assert_eq!(pieces_within(6_501, 5_000, Order::First), None);
        // 17 and 19 subdivisions are skipped for 18 and 20.
        assert_eq!(pieces_within(1_000, 17_u64.pow(3) * 1_000, Order::First), Some(18));
        assert_eq!(pieces_within(9, 10_000_000_000, Order::First), None);
    }

    #[test]
    fn nearly_every_coarse_mesh_fits_a_large_number() {
        for count in [100_000_000, 1_400_000_000, 10_000_000_000_u64] {
            let fitting =
                (5_000..10_000).filter(|&tets| pieces_within(tets, count, Order::First).is_some()).count();
            assert!(fitting > 4_000, "{count}: {fitting}");
        }
    }

    #[test]
    fn the_most_pieces_leave_enough_coarse_tets() {
        assert_eq!(most_pieces(1_400_000_000, 5_000, Order::First), 64);
        assert_eq!(most_pieces(39_999, 5_000, Order::First), 1);
        assert_eq!(most_pieces(40_000, 5_000, Order::First), 2);
        assert_eq!(most_pieces(100, 5_000, Order::First), 1);
    }
}

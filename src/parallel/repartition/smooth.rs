//! Reduction of the cut between parts of a distributed mesh, by threshold dynamics.
//!
//! The faces between parts should be few, like the area of a soap film. So each part is diffused a
//! little and each tet goes to the part with the largest share there: this moves the surface
//! between two parts by its curvature (Merriman, Bence, Osher 1992; for several phases Esedoglu and
//! Otto 2015), with a bonus for parts that are too small, so that sizes are kept (after Jacobs,
//! Merkurjev, Esedoglu 2018). Finally, single tets move to the part of most of their neighbours, as
//! in the refinement of Kernighan and Lin (1970).
//!
//! ```text
//!     AAAAABBB     A diffuses into B and B into A, one face a step     AAAAABBB
//!     AABABBBB ──► for some steps; then each tet takes the part    ──► AAAABBBB
//!     AAAABABB     with the largest share in it                        AAAABBBB
//! ```
//! Compared with Fiduccia and Mattheyses' single moves, this needs no priority queue across ranks;
//! compared with gathering bands around cuts (Chevalier and Pellegrini 2008), its data does not
//! grow with the mesh on one rank. All tets are decided simultaneously, in integers, so the result
//! does not depend on the distribution. Only tets near cuts are visited, and messages are
//! proportional to the cut at rank boundaries.

use super::metrics::sum_by_part;
use super::neighbours::{NONE, Neighbours};
use crate::ground::comm::pack::{put_varint, take_varint};
use crate::ground::comm::{CommError, Communicator};
use crate::ground::kernel::random::mix;
use crate::ground::mesh::{GlobalId, Rank};
use rayon::prelude::*;

/// Parameters of [`smooth`].
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Diffusion steps per round, one face each: an even number, so that no part can gain by being
    /// scattered, and at most 12.
    pub steps: u32,
    /// The maximum number of diffusion rounds.
    pub rounds: usize,
    /// The maximum number of rounds in which single tets move.
    pub single_moves: usize,
    /// The maximum size (tets or weight) of a part over the mean, unless the initial partition
    /// exceeds it.
    pub imbalance: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { steps: 8, rounds: 8, single_moves: 10, imbalance: 1.01 }
    }
}

/// In [`Band::slot`]: the tet belongs wholly to its own part.
const PURE: u32 = u32::MAX;
/// The number of parts whose shares a tet stores. More meet within a few faces only if parts are
/// tiny.
const KEPT: usize = 6;
/// After each round the part sizes are corrected to this distance from the mean, well below
/// [`Settings::imbalance`].
const BALANCED: f64 = 0.003;
/// The maximum number of bonus corrections per round.
const CORRECTIONS: usize = 12;
/// Rounds stop when fewer than one in this many tets of the band moved.
const STILL_MOVING: u64 = 500;

/// **Collective.** Reassigns tets near cuts so that fewer faces are between parts; never increases
/// the cut. `ids` are those of the tets. Parts are balanced by weight, or by tet count without
/// weights.
///
/// # Errors
/// [`CommError`] if another rank fails.
pub fn smooth(
    comm: &dyn Communicator,
    neighbours: &Neighbours,
    ids: &[GlobalId],
    weights: Option<&[u32]>,
    part: &mut Vec<Rank>,
    parts: u32,
    settings: &Settings,
) -> Result<(), CommError> {
    let mut state = State { label: neighbours.with_ghosts(comm, part)?, parts, weights };
    let mut best = state.judge(comm, neighbours)?;
    let allowed = settings.imbalance.max(best.imbalance);
    let mut bonus = vec![0.0; parts as usize];
    for _ in 0..settings.rounds {
        let moved = state.spread(comm, neighbours, &mut bonus, settings.steps)?;
        best.take(state.judge(comm, neighbours)?, allowed);
        if !moved {
            break;
        }
    }
    state.label = neighbours.with_ghosts(comm, &best.part)?;
    for _ in 0..settings.single_moves {
        let moved = state.move_single(comm, neighbours, ids, allowed)?;
        best.take(state.judge(comm, neighbours)?, allowed);
        if !moved {
            break;
        }
    }
    *part = best.part;
    Ok(())
}

/// A partition with its cut and imbalance.
struct Judged {
    part: Vec<Rank>,
    cut: u64,
    imbalance: f64,
}

impl Judged {
    /// Replaces `self` by a partition with a smaller cut and an allowed imbalance.
    fn take(&mut self, other: Self, allowed: f64) {
        if other.cut < self.cut && other.imbalance <= allowed {
            *self = other;
        }
    }
}

/// The shares of the parts in a tet, as integers whose sum is 5 to the power of the steps (unless
/// shares were dropped). Parts ascend; unused entries have weight 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Field([(Rank, u32); KEPT]);

impl Field {
    /// The whole tet belongs to one part.
    fn pure(part: Rank, all: u32) -> Self {
        let mut field = [(Rank::MAX, 0); KEPT];
        field[0] = (part, all);
        Self(field)
    }

    fn entries(&self) -> impl Iterator<Item = (Rank, u32)> + '_ {
        self.0.iter().copied().take_while(|(_, weight)| *weight > 0)
    }

    /// The sum of the fields of a tet and its four neighbours.
    fn sum(five: [Self; 5]) -> Self {
        let mut sums = [(Rank::MAX, 0u32); 5 * KEPT];
        let mut count = 0;
        for (part, weight) in five.iter().flat_map(Self::entries) {
            match sums[..count].iter_mut().find(|(known, _)| *known == part) {
                Some((_, sum)) => *sum += weight,
                None => {
                    sums[count] = (part, weight);
                    count += 1;
                }
            }
        }
        let sums = &mut sums[..count];
        if count > KEPT {
            // Keep the largest shares, on ties those of the lower parts.
            sums.sort_unstable_by_key(|&(part, weight)| (std::cmp::Reverse(weight), part));
        }
        let mut field = [(Rank::MAX, 0); KEPT];
        let kept = count.min(KEPT);
        field[..kept].copy_from_slice(&sums[..kept]);
        field[..kept].sort_unstable();
        Self(field)
    }
}

/// The local tets near cuts, with the shares of the parts in them.
struct Band {
    tets: Vec<u32>,
    fields: Vec<Field>,
    /// For a tet its index in `tets`, for a ghost its index in `ghosts`, or `PURE`.
    slot: Vec<u32>,
    ghosts: Vec<Field>,
    /// The sum of the weights of each field.
    whole: u32,
}

impl Band {
    /// **Collective.** Diffuses the parts for `steps` steps of one face each.
    fn spread(
        comm: &dyn Communicator,
        neighbours: &Neighbours,
        label: &[Rank],
        steps: u32,
    ) -> Result<Self, CommError> {
        let at_cut = |tet: &u32| {
            neighbours.beside[*tet as usize]
                .iter()
                .any(|&n| n != NONE && label[n as usize] != label[*tet as usize])
        };
        let tets: Vec<u32> = (0..neighbours.tets() as u32).into_par_iter().filter(at_cut).collect();
        let mut listed = vec![false; neighbours.tets()];
        tets.iter().for_each(|&tet| listed[tet as usize] = true);
        let slot = vec![PURE; label.len()];
        let mut band = Self { tets, fields: Vec::new(), slot, ghosts: Vec::new(), whole: 1 };
        let mut newest = 0;
        for step in 0..steps {
            if step > 0 {
                let grown = band.tets.len();
                band.grow(neighbours, newest, &mut listed);
                newest = grown;
            }
            let field = |n: u32| match band.slot[n as usize] {
                PURE => Field::pure(label[n as usize], band.whole),
                slot if (n as usize) < neighbours.tets() => band.fields[slot as usize],
                slot => band.ghosts[slot as usize],
            };
            // Mirror boundary condition at missing neighbours, so that no share is lost there.
            let sum = |&tet: &u32| {
                let [a, b, c, d] = neighbours.beside[tet as usize].map(|n| if n == NONE { tet } else { n });
                Field::sum([tet, a, b, c, d].map(field))
            };
            band.fields = band.tets.par_iter().map(sum).collect();
            (0..).zip(&band.tets).for_each(|(place, &tet)| band.slot[tet as usize] = place);
            band.whole *= 5;
            if step + 1 < steps {
                band.exchange_ghosts(comm, neighbours)?;
            }
        }
        Ok(band)
    }

    /// Adds the neighbours of the newest tets, and those of ghosts.
    fn grow(&mut self, neighbours: &Neighbours, newest: usize, listed: &mut [bool]) {
        let mut add = |tets: &mut Vec<u32>, n: u32| {
            if (n as usize) < listed.len() && !std::mem::replace(&mut listed[n as usize], true) {
                tets.push(n);
            }
        };
        for place in newest..self.tets.len() {
            neighbours.beside[self.tets[place] as usize].iter().for_each(|&n| add(&mut self.tets, n));
        }
        for (ghost, &own) in neighbours.at_ghosts().iter().enumerate() {
            if self.slot[neighbours.tets() + ghost] != PURE {
                add(&mut self.tets, own);
            }
        }
    }

    /// **Collective.** Exchanges the fields of the ghosts.
    fn exchange_ghosts(&mut self, comm: &dyn Communicator, neighbours: &Neighbours) -> Result<(), CommError> {
        let message = |(rank, ghosts): &(Rank, Vec<u32>)| {
            let mut message = Vec::new();
            let mut skipped = 0;
            for &ghost in ghosts {
                let slot = self.slot[neighbours.own(ghost) as usize];
                if slot == PURE {
                    skipped += 1;
                    continue;
                }
                put_varint(&mut message, std::mem::take(&mut skipped));
                let field = &self.fields[slot as usize];
                put_varint(&mut message, field.entries().count() as u64);
                for (part, weight) in field.entries() {
                    put_varint(&mut message, part.into());
                    put_varint(&mut message, weight.into());
                }
            }
            (*rank, message)
        };
        let messages =
            neighbours.with.iter().map(message).filter(|(_, message)| !message.is_empty()).collect();
        self.ghosts.clear();
        for (from, message) in comm.exchange_bytes(messages)? {
            let rest = &mut &message[..];
            let mut ghosts = neighbours.from(from).iter();
            while !rest.is_empty() {
                let ghost = ghosts.nth(take_varint(rest) as usize).expect("a shared face");
                let mut field = [(Rank::MAX, 0); KEPT];
                let count = take_varint(rest) as usize;
                for entry in &mut field[..count] {
                    *entry = (take_varint(rest) as Rank, take_varint(rest) as u32);
                }
                self.slot[neighbours.tets() + *ghost as usize] = self.ghosts.len() as u32;
                self.ghosts.push(Field(field));
            }
        }
        Ok(())
    }

    /// For each tet of the band the part with the largest share plus bonus; on ties its own part.
    fn choose(&self, label: &[Rank], bonus: &[f64]) -> Vec<Rank> {
        let choose = |(&tet, field): (&u32, &Field)| {
            let own = label[tet as usize];
            let value = |(part, weight)| f64::from(weight) / f64::from(self.whole) + bonus[part as usize];
            let better = |best: (f64, Rank), (part, weight)| {
                let value = value((part, weight));
                if value > best.0 || value == best.0 && part == own { (value, part) } else { best }
            };
            field.entries().fold((f64::NEG_INFINITY, own), better).1
        };
        self.tets.par_iter().zip(&self.fields).map(choose).collect()
    }
}

/// The current part of each tet and ghost.
struct State<'a> {
    label: Vec<Rank>,
    parts: u32,
    /// The weights of the local tets; 1 each if `None`.
    weights: Option<&'a [u32]>,
}

impl State<'_> {
    fn weight(&self, tet: usize) -> u64 {
        self.weights.map_or(1, |weights| weights[tet].into())
    }

    /// The weight of each part on this rank.
    fn sizes(&self, tets: usize) -> Vec<u64> {
        self.weigh(self.label[..tets].iter().copied().enumerate())
    }

    /// The weight of each part, given tets with their parts.
    fn weigh(&self, tets: impl Iterator<Item = (usize, Rank)>) -> Vec<u64> {
        let mut sizes = vec![0; self.parts as usize];
        tets.for_each(|(tet, part)| sizes[part as usize] += self.weight(tet));
        sizes
    }

    /// **Collective.** The current partition with its cut and imbalance.
    fn judge(&self, comm: &dyn Communicator, neighbours: &Neighbours) -> Result<Judged, CommError> {
        let tets = neighbours.tets();
        let cut = |tet: usize| {
            let faces = neighbours.beside[tet].iter();
            faces.filter(|&&n| n != NONE && self.label[n as usize] != self.label[tet]).count() as u64
        };
        let twice: u64 = (0..tets).into_par_iter().map(cut).sum();
        let [twice] = comm.all_reduce_sum_u64([twice])?;
        let sizes = sum_by_part(comm, &self.sizes(tets))?;
        let largest = sizes.iter().copied().max().unwrap_or(0) as f64;
        let mean = sizes.iter().sum::<u64>() as f64 / f64::from(self.parts);
        Ok(Judged { part: self.label[..tets].to_vec(), cut: twice / 2, imbalance: largest / mean })
    }

    /// **Collective.** One diffusion round. Returns whether enough tets moved to continue.
    fn spread(
        &mut self,
        comm: &dyn Communicator,
        neighbours: &Neighbours,
        bonus: &mut [f64],
        steps: u32,
    ) -> Result<bool, CommError> {
        let band = Band::spread(comm, neighbours, &self.label, steps)?;
        let tets = neighbours.tets();
        let mut outside = self.sizes(tets);
        for &tet in &band.tets {
            outside[self.label[tet as usize] as usize] -= self.weight(tet as usize);
        }
        let outside = sum_by_part(comm, &outside)?;
        let mut chosen = Vec::new();
        for _ in 0..CORRECTIONS {
            chosen = band.choose(&self.label, bonus);
            let in_band = band.tets.iter().map(|&tet| tet as usize).zip(chosen.iter().copied());
            let inside = sum_by_part(comm, &self.weigh(in_band))?;
            let sizes: Vec<u64> = inside.iter().zip(&outside).map(|(a, b)| a + b).collect();
            let mean = sizes.iter().sum::<u64>() as f64 / f64::from(self.parts);
            if sizes.iter().all(|&size| (size as f64 - mean).abs() <= BALANCED * mean) {
                break;
            }
            // Near a cut the share of a part falls from all to nothing across about half of the
            // band.
            for ((bonus, size), inside) in bonus.iter_mut().zip(&sizes).zip(&inside) {
                *bonus += 0.5 * (mean - *size as f64) / (*inside as f64 + 1.0);
            }
        }
        let mut part = self.label[..tets].to_vec();
        let mut moved = 0;
        for (&tet, &to) in band.tets.iter().zip(&chosen) {
            moved += u64::from(std::mem::replace(&mut part[tet as usize], to) != to);
        }
        self.label = neighbours.with_ghosts(comm, &part)?;
        let [moved, near] = comm.all_reduce_sum_u64([moved, band.tets.len() as u64])?;
        Ok(moved * STILL_MOVING > near)
    }

    /// **Collective.** Moves tets to the part of most of their neighbours, never two neighbours in
    /// the same round. Returns whether any moved.
    fn move_single(
        &mut self,
        comm: &dyn Communicator,
        neighbours: &Neighbours,
        ids: &[GlobalId],
        allowed: f64,
    ) -> Result<bool, CommError> {
        let tets = neighbours.tets();
        let sizes = sum_by_part(comm, &self.sizes(tets))?;
        let most = allowed * sizes.iter().sum::<u64>() as f64 / f64::from(self.parts);
        let has_room = |tet: usize, part: Rank| ((sizes[part as usize] + self.weight(tet)) as f64) < most;
        let wish = |tet: usize| self.wish(neighbours, tet, |part| has_room(tet, part));
        let wishes: Vec<(u64, Rank)> = (0..tets)
            .into_par_iter()
            .map(|tet| match wish(tet) {
                // Larger gains first; a hash breaks ties, so that no direction is preferred.
                Some((gain, to)) => (gain << 60 | mix(ids[tet]) >> 4 | 1, to),
                None => (0, 0),
            })
            .collect();
        let priorities: Vec<u64> = wishes.iter().map(|(priority, _)| *priority).collect();
        let priorities = neighbours.with_ghosts(comm, &priorities)?;
        let wins = |tet: usize| {
            let first = |&n: &u32| n == NONE || priorities[n as usize] < priorities[tet];
            priorities[tet] > 0 && neighbours.beside[tet].iter().all(first)
        };
        let winners: Vec<usize> = (0..tets).into_par_iter().filter(|&tet| wins(tet)).collect();
        let mut part = self.label[..tets].to_vec();
        winners.iter().for_each(|&tet| part[tet] = wishes[tet].1);
        self.label = neighbours.with_ghosts(comm, &part)?;
        Ok(comm.all_reduce_sum_u64([winners.len() as u64])?[0] > 0)
    }

    /// The part to which a tet has more neighbours than to its own, and the difference.
    fn wish(
        &self,
        neighbours: &Neighbours,
        tet: usize,
        has_room: impl Fn(Rank) -> bool,
    ) -> Option<(u64, Rank)> {
        let own = self.label[tet];
        let beside = neighbours.beside[tet];
        let parts = || beside.iter().filter(|&&n| n != NONE).map(|&n| self.label[n as usize]);
        let count = |part: Rank| parts().filter(|&other| other == part).count();
        let here = count(own);
        let gains = parts().filter(|&part| part != own && count(part) > here && has_room(part));
        gains
            .map(|part| ((count(part) - here) as u64, part))
            .max_by_key(|&(gain, part)| (gain, std::cmp::Reverse(part)))
    }
}

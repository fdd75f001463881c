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
    let tets = neighbours.tets();
    let mut state = State::new(comm, neighbours, part, parts, weights)?;
    let (cut, imbalance) = state.judge(comm, neighbours)?;
    let mut best = Best { cuts: state.cuts.clone(), cut, allowed: settings.imbalance.max(imbalance) };
    let mut bonus = vec![0.0; parts as usize];
    for _ in 0..settings.rounds {
        let moved = state.spread(comm, neighbours, &mut bonus, settings.steps)?;
        best.update(&state.cuts, state.judge(comm, neighbours)?);
        if !moved {
            break;
        }
    }
    state.cuts = best.cuts.clone();
    let mut priorities = vec![0; best.cuts.label.len()];
    for _ in 0..settings.single_moves {
        let moved = state.move_single(comm, neighbours, ids, &mut priorities, best.allowed)?;
        best.update(&state.cuts, state.judge(comm, neighbours)?);
        if !moved {
            break;
        }
    }
    *part = best.cuts.label;
    part.truncate(tets);
    Ok(())
}

/// A partition of the tets and ghosts.
#[derive(Clone)]
struct Cuts {
    /// The part of each tet and ghost.
    label: Vec<Rank>,
    /// The tets with a neighbour in another part, ascending.
    at: Vec<u32>,
    /// The weight of the tets of each part on this rank.
    sizes: Vec<u64>,
}

/// The partition with the smallest cut so far.
struct Best {
    cuts: Cuts,
    /// The number of faces between parts.
    cut: u64,
    /// The largest allowed imbalance.
    allowed: f64,
}

impl Best {
    /// Takes another partition if its cut is smaller and its imbalance allowed.
    fn update(&mut self, cuts: &Cuts, (cut, imbalance): (u64, f64)) {
        if cut < self.cut && imbalance <= self.allowed {
            (self.cuts, self.cut) = (cuts.clone(), cut);
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
        Cuts { label, at, .. }: &Cuts,
        steps: u32,
    ) -> Result<Self, CommError> {
        let tets = at.clone();
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

/// The current partition.
struct State<'a> {
    cuts: Cuts,
    parts: u32,
    /// The weights of the local tets; 1 each if `None`.
    weights: Option<&'a [u32]>,
}

impl<'a> State<'a> {
    /// **Collective.** The state of the partition `part`.
    fn new(
        comm: &dyn Communicator,
        neighbours: &Neighbours,
        part: &[Rank],
        parts: u32,
        weights: Option<&'a [u32]>,
    ) -> Result<Self, CommError> {
        let label = neighbours.with_ghosts(comm, part)?;
        let tets = 0..neighbours.tets() as u32;
        let at = tets.into_par_iter().filter(|&tet| cut_faces(neighbours, &label, tet) > 0).collect();
        let mut state = Self { cuts: Cuts { label, at, sizes: Vec::new() }, parts, weights };
        state.cuts.sizes = state.weigh(part.iter().copied().enumerate());
        Ok(state)
    }

    fn weight(&self, tet: usize) -> u64 {
        self.weights.map_or(1, |weights| weights[tet].into())
    }

    /// The weight of each part, given tets with their parts.
    fn weigh(&self, tets: impl Iterator<Item = (usize, Rank)>) -> Vec<u64> {
        let mut sizes = vec![0; self.parts as usize];
        tets.for_each(|(tet, part)| sizes[part as usize] += self.weight(tet));
        sizes
    }

    /// **Collective.** The cut and the imbalance of the current partition.
    fn judge(&self, comm: &dyn Communicator, neighbours: &Neighbours) -> Result<(u64, f64), CommError> {
        let cut = |&tet: &u32| cut_faces(neighbours, &self.cuts.label, tet);
        let twice: u64 = self.cuts.at.par_iter().map(cut).sum();
        let [twice] = comm.all_reduce_sum_u64([twice])?;
        let sizes = sum_by_part(comm, &self.cuts.sizes)?;
        let largest = sizes.iter().copied().max().unwrap_or(0) as f64;
        let mean = sizes.iter().sum::<u64>() as f64 / f64::from(self.parts);
        Ok((twice / 2, largest / mean))
    }

    /// **Collective.** Assigns tets to parts. Returns how many local ones changed.
    fn assign(
        &mut self,
        comm: &dyn Communicator,
        neighbours: &Neighbours,
        parts: impl Iterator<Item = (u32, Rank)>,
    ) -> Result<u64, CommError> {
        let tets = neighbours.tets();
        // Cuts may be at these.
        let mut near = std::mem::take(&mut self.cuts.at);
        let mut changed = 0;
        for (tet, to) in parts {
            let weight = self.weight(tet as usize);
            let from = std::mem::replace(&mut self.cuts.label[tet as usize], to);
            if from == to {
                continue;
            }
            changed += 1;
            self.cuts.sizes[from as usize] -= weight;
            self.cuts.sizes[to as usize] += weight;
            near.push(tet);
            near.extend(neighbours.beside[tet as usize].iter().filter(|&&n| (n as usize) < tets));
        }
        let label = &mut self.cuts.label;
        let ghosts = neighbours.ghosts(comm, |tet| label[tet as usize])?;
        for ((label, part), &own) in label[tets..].iter_mut().zip(ghosts).zip(neighbours.at_ghosts()) {
            if std::mem::replace(label, part) != part {
                near.push(own);
            }
        }
        near.sort_unstable();
        near.dedup();
        near.retain(|&tet| cut_faces(neighbours, label, tet) > 0);
        self.cuts.at = near;
        Ok(changed)
    }

    /// **Collective.** One diffusion round. Returns whether enough tets moved to continue.
    fn spread(
        &mut self,
        comm: &dyn Communicator,
        neighbours: &Neighbours,
        bonus: &mut [f64],
        steps: u32,
    ) -> Result<bool, CommError> {
        let band = Band::spread(comm, neighbours, &self.cuts, steps)?;
        let mut outside = self.cuts.sizes.clone();
        for &tet in &band.tets {
            outside[self.cuts.label[tet as usize] as usize] -= self.weight(tet as usize);
        }
        let outside = sum_by_part(comm, &outside)?;
        let mut chosen = Vec::new();
        for _ in 0..CORRECTIONS {
            chosen = band.choose(&self.cuts.label, bonus);
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
        let changed = self.assign(comm, neighbours, band.tets.iter().copied().zip(chosen))?;
        let [moved, near] = comm.all_reduce_sum_u64([changed, band.tets.len() as u64])?;
        Ok(moved * STILL_MOVING > near)
    }

    /// **Collective.** Moves tets to the part of most of their neighbours, never two neighbours in
    /// the same round. Returns whether any moved. `priorities` of all tets and ghosts are 0 before
    /// and after, except those of ghosts.
    fn move_single(
        &mut self,
        comm: &dyn Communicator,
        neighbours: &Neighbours,
        ids: &[GlobalId],
        priorities: &mut [u64],
        allowed: f64,
    ) -> Result<bool, CommError> {
        let tets = neighbours.tets();
        let sizes = sum_by_part(comm, &self.cuts.sizes)?;
        let most = allowed * sizes.iter().sum::<u64>() as f64 / f64::from(self.parts);
        let has_room =
            |tet: u32, part: Rank| ((sizes[part as usize] + self.weight(tet as usize)) as f64) < most;
        let wish = |&tet: &u32| match self.wish(neighbours, tet, |part| has_room(tet, part)) {
            // Larger gains first; a hash breaks ties, so that no direction is preferred.
            Some((gain, to)) => (gain << 60 | mix(ids[tet as usize]) >> 4 | 1, to),
            None => (0, 0),
        };
        let at = &self.cuts.at;
        let wishes: Vec<(u64, Rank)> = at.par_iter().map(wish).collect();
        at.iter().zip(&wishes).for_each(|(&tet, (priority, _))| priorities[tet as usize] = *priority);
        let of_ghosts = neighbours.ghosts(comm, |tet| priorities[tet as usize])?;
        priorities[tets..].copy_from_slice(&of_ghosts);
        let wins = |tet: u32| {
            let own = priorities[tet as usize];
            let first = |&n: &u32| n == NONE || priorities[n as usize] < own;
            own > 0 && neighbours.beside[tet as usize].iter().all(first)
        };
        let to = at.iter().zip(&wishes).filter(|&(&tet, _)| wins(tet)).map(|(&tet, wish)| (tet, wish.1));
        let winners: Vec<(u32, Rank)> = to.collect();
        at.iter().for_each(|&tet| priorities[tet as usize] = 0);
        let changed = self.assign(comm, neighbours, winners.into_iter())?;
        Ok(comm.all_reduce_sum_u64([changed])?[0] > 0)
    }

    /// The part to which a tet has more neighbours than to its own, and the difference.
    fn wish(
        &self,
        neighbours: &Neighbours,
        tet: u32,
        has_room: impl Fn(Rank) -> bool,
    ) -> Option<(u64, Rank)> {
        let label = &self.cuts.label;
        let own = label[tet as usize];
        let beside = neighbours.beside[tet as usize];
        let parts = || beside.iter().filter(|&&n| n != NONE).map(|&n| label[n as usize]);
        let count = |part: Rank| parts().filter(|&other| other == part).count();
        let here = count(own);
        let gains = parts().filter(|&part| part != own && count(part) > here && has_room(part));
        gains
            .map(|part| ((count(part) - here) as u64, part))
            .max_by_key(|&(gain, part)| (gain, std::cmp::Reverse(part)))
    }
}

/// The number of neighbours of a tet in other parts.
fn cut_faces(neighbours: &Neighbours, label: &[Rank], tet: u32) -> u64 {
    let own = label[tet as usize];
    let beside = neighbours.beside[tet as usize].iter();
    beside.filter(|&&n| n != NONE && label[n as usize] != own).count() as u64
}

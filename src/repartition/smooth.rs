//! A smaller cut between parts of a distributed mesh, by threshold dynamics.
//!
//! The faces between parts are to become few, as the area of a soap film does. So each part is spread out a little and each tet goes to the part
//! of which most arrives: this moves the surface between two parts by its curvature (Merriman, Bence, Osher 1992; for many phases Esedoglu and
//! Otto 2015), with a bonus for parts that are too small, so that volumes are kept (after Jacobs, Merkurjev, Esedoglu 2018).
//! Last, tets move to the part that most of their neighbours are in, as in the refinement of Kernighan and Lin (1970).
//!
//! ```text
//!   AAAAABBB      A spreads into B and B into A, one face a step     AAAAABBB
//!   AABABBBB  ──► for some steps; then each tet takes the part  ──► AAAABBBB
//!   AAAABABB      that it has most of                                AAAABBBB
//! ```
//! Chosen over Fiduccia and Mattheyses' moves one by one, which need a queue across ranks, and over gathering bands around cuts (Chevalier and
//! Pellegrini 2008), which grow with the mesh. All tets are judged at once, in whole numbers: the result does not depend on
//! who holds which tet. Only tets near cuts are touched, and messages are as large as the cut where it crosses ranks.

use super::metrics::sum_by_part;
use super::tets_at_faces;
use crate::comm::pack::{put_varint, take_varint};
use crate::comm::{CommError, Communicator};
use crate::dist::DistMesh;
use crate::kernel::random::mix;
use crate::mesh::{GlobalId, Rank};
use rayon::prelude::*;

/// Choices for [`smooth`].
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Steps in which parts spread, one face each: even, so that no part can gain by being spread out, and at most 12.
    pub steps: u32,
    /// The most rounds of spreading.
    pub rounds: usize,
    /// The most rounds in which single tets move.
    pub single_moves: usize,
    /// The most tets, or weight, that a part may have in the end over the mean, unless it begins with more.
    pub imbalance: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { steps: 8, rounds: 8, single_moves: 10, imbalance: 1.01 }
    }
}

/// No tet behind a face.
pub(super) const NONE: u32 = u32::MAX;
/// In [`Band::slot`]: all of a tet is in its own part.
const PURE: u32 = u32::MAX;
/// A tet keeps what came of so many parts: more meet within a few faces only where parts are tiny.
const KEPT: usize = 6;
/// Sizes are brought this near to the mean after each round: well below what [`Settings::imbalance`] asks.
const BALANCED: f64 = 0.003;
/// The most corrections of the bonuses after each round.
const CORRECTIONS: usize = 12;
/// Rounds end when fewer tets near cuts than one in so many moved.
const STILL_MOVING: u64 = 500;

/// **Collective.** Changes the parts of tets near cuts so that fewer faces lie between parts; never makes the cut larger. Parts are balanced by
/// the weights of their tets, or by their numbers where there are no weights.
///
/// # Errors
/// If another rank fails.
pub fn smooth(
    comm: &dyn Communicator,
    mesh: &DistMesh,
    weights: Option<&[u32]>,
    part: &mut Vec<Rank>,
    parts: u32,
    settings: &Settings,
) -> Result<(), CommError> {
    let links = Links::new(mesh);
    let mut state = State { label: links.with_ghosts(comm, part)?, parts, weights };
    let mut best = state.judge(comm, &links)?;
    let allowed = settings.imbalance.max(best.imbalance);
    let mut bonus = vec![0.0; parts as usize];
    for _ in 0..settings.rounds {
        let moved = state.spread(comm, &links, &mut bonus, settings.steps)?;
        best.take(state.judge(comm, &links)?, allowed);
        if !moved {
            break;
        }
    }
    state.label = links.with_ghosts(comm, &best.part)?;
    for _ in 0..settings.single_moves {
        let moved = state.move_single(comm, &links, &mesh.tet_ids, allowed)?;
        best.take(state.judge(comm, &links)?, allowed);
        if !moved {
            break;
        }
    }
    *part = best.part;
    Ok(())
}

/// A partition, and how good it is.
struct Judged {
    part: Vec<Rank>,
    cut: u64,
    imbalance: f64,
}

impl Judged {
    /// Takes a better one in its place.
    fn take(&mut self, other: Self, allowed: f64) {
        if other.cut < self.cut && other.imbalance <= allowed {
            *self = other;
        }
    }
}

/// Which tets are beside which, over the borders of ranks: there stand **ghosts**, numbered behind the tets of this rank.
pub(super) struct Links {
    /// Across each face of each tet.
    pub beside: Vec<[u32; 4]>,
    /// For each ghost the tet of this rank beside it.
    own: Vec<u32>,
    /// The ghosts by the rank that has them, in the order of faces, which is the same there.
    with: Vec<(Rank, Vec<u32>)>,
}

impl Links {
    pub fn new(mesh: &DistMesh) -> Self {
        let sides = tets_at_faces(mesh);
        let mut ghost = vec![NONE; mesh.faces.len()];
        let mut own = Vec::with_capacity(mesh.shared_faces.len());
        let mut with: Vec<(Rank, Vec<u32>)> = (0..mesh.ranks).map(|rank| (rank, Vec::new())).collect();
        for (place, (face, holders)) in (0..).zip(mesh.shared_faces.iter()) {
            let other = holders.iter().find(|&&holder| holder != mesh.rank).expect("another holder");
            ghost[face as usize] = mesh.tets.len() as u32 + place;
            own.push(sides[face as usize][0]);
            with[*other as usize].1.push(place);
        }
        with.retain(|(_, ghosts)| !ghosts.is_empty());
        let across = |tet: usize| {
            mesh.tet_faces[tet].map(|face| match sides[face.index()] {
                [one, NONE] if one as usize == tet => ghost[face.index()],
                [one, other] => {
                    if one as usize == tet {
                        other
                    } else {
                        one
                    }
                }
            })
        };
        Self { beside: (0..mesh.tets.len()).into_par_iter().map(across).collect(), own, with }
    }

    fn tets(&self) -> usize {
        self.beside.len()
    }

    /// **Collective.** Words on this rank's tets, followed by those on the ghosts.
    pub fn with_ghosts<T: bytemuck::Pod>(
        &self,
        comm: &dyn Communicator,
        words: &[T],
    ) -> Result<Vec<T>, CommError> {
        let mut all = Vec::with_capacity(words.len() + self.own.len());
        all.extend_from_slice(words);
        all.resize(words.len() + self.own.len(), T::zeroed());
        let say = |ghosts: &Vec<u32>| ghosts.iter().map(|&g| words[self.own[g as usize] as usize]).collect();
        let letters = self.with.iter().map(|(rank, ghosts)| (*rank, say(ghosts))).collect();
        for (from, said) in comm.exchange::<T>(letters)? {
            for (&ghost, word) in self.from(from).iter().zip(said) {
                all[words.len() + ghost as usize] = word;
            }
        }
        Ok(all)
    }

    /// The ghosts that a rank has.
    fn from(&self, rank: Rank) -> &[u32] {
        let place = self.with.binary_search_by_key(&rank, |(rank, _)| *rank).expect("a neighbour");
        &self.with[place].1
    }
}

/// What a tet has of each part, in whole numbers that add to 5 to the power of the steps: parts ascend, and where nothing is left
/// weights are 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Field([(Rank, u32); KEPT]);

impl Field {
    /// All of one part.
    fn pure(part: Rank, all: u32) -> Self {
        let mut field = [(Rank::MAX, 0); KEPT];
        field[0] = (part, all);
        Self(field)
    }

    fn entries(&self) -> impl Iterator<Item = (Rank, u32)> + '_ {
        self.0.iter().copied().take_while(|(_, weight)| *weight > 0)
    }

    /// The sum of five: a tet's own and those across its faces.
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
            // The largest stay, of equal ones the lower parts.
            sums.sort_unstable_by_key(|&(part, weight)| (std::cmp::Reverse(weight), part));
        }
        let mut field = [(Rank::MAX, 0); KEPT];
        let kept = count.min(KEPT);
        field[..kept].copy_from_slice(&sums[..kept]);
        field[..kept].sort_unstable();
        Self(field)
    }
}

/// The tets of this rank near cuts, and what they have of each part.
struct Band {
    tets: Vec<u32>,
    fields: Vec<Field>,
    /// By tet: its place in `tets`; by ghost: its place in `ghosts`.
    slot: Vec<u32>,
    ghosts: Vec<Field>,
    /// The sum of the weights of each field.
    whole: u32,
}

impl Band {
    /// **Collective.** Spreads parts, so many faces far.
    fn spread(comm: &dyn Communicator, links: &Links, label: &[Rank], steps: u32) -> Result<Self, CommError> {
        let at_cut = |tet: &u32| {
            links.beside[*tet as usize]
                .iter()
                .any(|&n| n != NONE && label[n as usize] != label[*tet as usize])
        };
        let tets: Vec<u32> = (0..links.tets() as u32).into_par_iter().filter(at_cut).collect();
        let mut listed = vec![false; links.tets()];
        tets.iter().for_each(|&tet| listed[tet as usize] = true);
        let slot = vec![PURE; label.len()];
        let mut band = Self { tets, fields: Vec::new(), slot, ghosts: Vec::new(), whole: 1 };
        let mut newest = 0;
        for step in 0..steps {
            if step > 0 {
                let grown = band.tets.len();
                band.grow(links, newest, &mut listed);
                newest = grown;
            }
            let field = |n: u32| match band.slot[n as usize] {
                PURE => Field::pure(label[n as usize], band.whole),
                slot if (n as usize) < links.tets() => band.fields[slot as usize],
                slot => band.ghosts[slot as usize],
            };
            // Where there is no tet, a mirror: nothing is lost across the skin.
            let sum = |&tet: &u32| {
                let [a, b, c, d] = links.beside[tet as usize].map(|n| if n == NONE { tet } else { n });
                Field::sum([tet, a, b, c, d].map(field))
            };
            band.fields = band.tets.par_iter().map(sum).collect();
            (0..).zip(&band.tets).for_each(|(place, &tet)| band.slot[tet as usize] = place);
            band.whole *= 5;
            if step + 1 < steps {
                band.hear_ghosts(comm, links)?;
            }
        }
        Ok(band)
    }

    /// Adds the tets across the faces of the newest ones, and of ghosts.
    fn grow(&mut self, links: &Links, newest: usize, listed: &mut [bool]) {
        let mut add = |tets: &mut Vec<u32>, n: u32| {
            if (n as usize) < listed.len() && !std::mem::replace(&mut listed[n as usize], true) {
                tets.push(n);
            }
        };
        for place in newest..self.tets.len() {
            links.beside[self.tets[place] as usize].iter().for_each(|&n| add(&mut self.tets, n));
        }
        for (ghost, &own) in links.own.iter().enumerate() {
            if self.slot[links.tets() + ghost] != PURE {
                add(&mut self.tets, own);
            }
        }
    }

    /// **Collective.** Asks what the ghosts have.
    fn hear_ghosts(&mut self, comm: &dyn Communicator, links: &Links) -> Result<(), CommError> {
        let letter = |(rank, ghosts): &(Rank, Vec<u32>)| {
            let mut message = Vec::new();
            let mut skipped = 0;
            for &ghost in ghosts {
                let slot = self.slot[links.own[ghost as usize] as usize];
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
        let letters = links.with.iter().map(letter).filter(|(_, message)| !message.is_empty()).collect();
        self.ghosts.clear();
        for (from, message) in comm.exchange_bytes(letters)? {
            let rest = &mut &message[..];
            let mut ghosts = links.from(from).iter();
            while !rest.is_empty() {
                let ghost = ghosts.nth(take_varint(rest) as usize).expect("a face of both");
                let mut field = [(Rank::MAX, 0); KEPT];
                let count = take_varint(rest) as usize;
                for entry in &mut field[..count] {
                    *entry = (take_varint(rest) as Rank, take_varint(rest) as u32);
                }
                self.slot[links.tets() + *ghost as usize] = self.ghosts.len() as u32;
                self.ghosts.push(Field(field));
            }
        }
        Ok(())
    }

    /// The part of each tet of the band: of which it has most, with the bonuses; of equal ones its own.
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

/// The parts of tets and ghosts.
struct State<'a> {
    label: Vec<Rank>,
    parts: u32,
    /// Of this rank's tets; 1 each where there are none.
    weights: Option<&'a [u32]>,
}

impl State<'_> {
    fn weight(&self, tet: usize) -> u64 {
        self.weights.map_or(1, |weights| weights[tet].into())
    }

    /// The weight of all tets of this rank in each part.
    fn sizes(&self, tets: usize) -> Vec<u64> {
        self.weigh(self.label[..tets].iter().copied().enumerate())
    }

    /// The weight of tets, given with the parts that they are in, in each part.
    fn weigh(&self, tets: impl Iterator<Item = (usize, Rank)>) -> Vec<u64> {
        let mut sizes = vec![0; self.parts as usize];
        tets.for_each(|(tet, part)| sizes[part as usize] += self.weight(tet));
        sizes
    }

    /// **Collective.** The partition as it is.
    fn judge(&self, comm: &dyn Communicator, links: &Links) -> Result<Judged, CommError> {
        let tets = links.tets();
        let cut = |tet: usize| {
            let faces = links.beside[tet].iter();
            faces.filter(|&&n| n != NONE && self.label[n as usize] != self.label[tet]).count() as u64
        };
        let twice: u64 = (0..tets).into_par_iter().map(cut).sum();
        let [twice] = comm.all_reduce_sum_u64([twice])?;
        let sizes = sum_by_part(comm, &self.sizes(tets))?;
        let largest = sizes.iter().copied().max().unwrap_or(0) as f64;
        let mean = sizes.iter().sum::<u64>() as f64 / f64::from(self.parts);
        Ok(Judged { part: self.label[..tets].to_vec(), cut: twice / 2, imbalance: largest / mean })
    }

    /// **Collective.** One round of spreading. Returns whether it pays to go on.
    fn spread(
        &mut self,
        comm: &dyn Communicator,
        links: &Links,
        bonus: &mut [f64],
        steps: u32,
    ) -> Result<bool, CommError> {
        let band = Band::spread(comm, links, &self.label, steps)?;
        let tets = links.tets();
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
            // Near a cut the share of a part falls from all to nothing across about half of the band.
            for ((bonus, size), inside) in bonus.iter_mut().zip(&sizes).zip(&inside) {
                *bonus += 0.5 * (mean - *size as f64) / (*inside as f64 + 1.0);
            }
        }
        let mut part = self.label[..tets].to_vec();
        let mut moved = 0;
        for (&tet, &to) in band.tets.iter().zip(&chosen) {
            moved += u64::from(std::mem::replace(&mut part[tet as usize], to) != to);
        }
        self.label = links.with_ghosts(comm, &part)?;
        let [moved, near] = comm.all_reduce_sum_u64([moved, band.tets.len() as u64])?;
        Ok(moved * STILL_MOVING > near)
    }

    /// **Collective.** Moves tets to parts that more of their neighbours are in, no two neighbours at once. Returns whether any moved.
    fn move_single(
        &mut self,
        comm: &dyn Communicator,
        links: &Links,
        ids: &[GlobalId],
        allowed: f64,
    ) -> Result<bool, CommError> {
        let tets = links.tets();
        let sizes = sum_by_part(comm, &self.sizes(tets))?;
        let most = allowed * sizes.iter().sum::<u64>() as f64 / f64::from(self.parts);
        let has_room = |tet: usize, part: Rank| ((sizes[part as usize] + self.weight(tet)) as f64) < most;
        let wish = |tet: usize| self.wish(links, tet, |part| has_room(tet, part));
        let wishes: Vec<(u64, Rank)> = (0..tets)
            .into_par_iter()
            .map(|tet| match wish(tet) {
                // More faces first; between equals a hash decides, so that no direction is preferred.
                Some((gain, to)) => (gain << 60 | mix(ids[tet]) >> 4 | 1, to),
                None => (0, 0),
            })
            .collect();
        let priorities: Vec<u64> = wishes.iter().map(|(priority, _)| *priority).collect();
        let priorities = links.with_ghosts(comm, &priorities)?;
        let wins = |tet: usize| {
            let first = |&n: &u32| n == NONE || priorities[n as usize] < priorities[tet];
            priorities[tet] > 0 && links.beside[tet].iter().all(first)
        };
        let winners: Vec<usize> = (0..tets).into_par_iter().filter(|&tet| wins(tet)).collect();
        let mut part = self.label[..tets].to_vec();
        winners.iter().for_each(|&tet| part[tet] = wishes[tet].1);
        self.label = links.with_ghosts(comm, &part)?;
        Ok(comm.all_reduce_sum_u64([winners.len() as u64])?[0] > 0)
    }

    /// The part that more of a tet's neighbours are in than in its own, and how many more.
    fn wish(&self, links: &Links, tet: usize, has_room: impl Fn(Rank) -> bool) -> Option<(u64, Rank)> {
        let own = self.label[tet];
        let beside = links.beside[tet];
        let parts = || beside.iter().filter(|&&n| n != NONE).map(|&n| self.label[n as usize]);
        let count = |part: Rank| parts().filter(|&other| other == part).count();
        let here = count(own);
        let gains = parts().filter(|&part| part != own && count(part) > here && has_room(part));
        gains
            .map(|part| ((count(part) - here) as u64, part))
            .max_by_key(|&(gain, part)| (gain, std::cmp::Reverse(part)))
    }
}

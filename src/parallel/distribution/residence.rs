//! Which ranks have each vertex, edge or face of a mesh whose tets are assigned to ranks.

use super::Shared;
use super::piece::Entities;
use crate::ground::kernel::buckets::{Buckets, map_each, ranges, tabulate};
use crate::ground::mesh::{Class, GlobalId, Rank};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::AtomicU32;
use std::sync::atomic::Ordering::Relaxed;

/// Marks an entity that no tet has been found to have.
const NONE: Rank = Rank::MAX;
/// Marks an entity of several ranks.
const SHARED: Rank = Rank::MAX - 1;

/// The holders of each entity of one kind, and the entities of each rank, both ascending.
pub(super) struct Residence {
    /// The only rank that has each entity, or [`SHARED`].
    ranks: Vec<Rank>,
    /// The entities of several ranks.
    shared: Shared,
    by_rank: Buckets,
}

impl Residence {
    /// Finds the holders of the entities that `of_tet` lists for each tet.
    pub fn new<const K: usize>(
        entities: usize,
        part: &[Rank],
        ranks: u32,
        of_tet: impl Fn(usize) -> [u32; K] + Sync + Send,
    ) -> Self {
        let found = tabulate(entities, |_| AtomicU32::new(NONE));
        map_each(ranges(part.len()), |range| {
            for tet in range {
                of_tet(tet).into_iter().for_each(|entity| add(&found[entity as usize], part[tet]));
            }
        });
        let only: Vec<Rank> = found.into_iter().map(AtomicU32::into_inner).collect();
        let shared = shared(&only, part, of_tet);
        let mut residence = Self { ranks: only, shared, by_rank: Buckets::default() };
        residence.by_rank = Buckets::collect(&ranges(entities), ranks as usize, |range| {
            let holders = |entity: u32| residence.holders(entity).iter();
            (range.start as u32..range.end as u32)
                .flat_map(move |entity| holders(entity).map(move |&rank| (rank as usize, entity)))
        });
        residence
    }

    /// The ranks that have an entity, ascending.
    pub fn holders(&self, entity: u32) -> &[Rank] {
        match &self.ranks[entity as usize] {
            &SHARED => self.shared.holders_of(entity).expect("listed as shared"),
            &NONE => &[],
            rank => std::slice::from_ref(rank),
        }
    }

    /// The entities of `rank`, ascending.
    pub fn of_rank(&self, rank: Rank) -> &[u32] {
        self.by_rank.of(rank as usize)
    }

    /// The entities of `rank`, with their classes and holders.
    pub fn entities(&self, rank: Rank, classes: &[Class]) -> Entities {
        let ids = self.of_rank(rank);
        let mut shared = Shared::default();
        for (local, &id) in (0..).zip(ids) {
            if self.ranks[id as usize] == SHARED {
                shared.push(local, self.holders(id).iter().copied());
            }
        }
        Entities {
            ids: ids.iter().map(|&id| GlobalId::from(id)).collect(),
            classes: ids.iter().map(|&id| classes[id as usize]).collect(),
            shared,
        }
    }
}

/// Adds a rank to those of an entity. The result does not depend on the order of several threads.
fn add(entity: &AtomicU32, rank: Rank) {
    let mut found = entity.load(Relaxed);
    if found == NONE {
        found = entity.compare_exchange(NONE, rank, Relaxed, Relaxed).map_or_else(|other| other, |_| rank);
    }
    if found != rank && found != SHARED {
        entity.store(SHARED, Relaxed);
    }
}

/// The holders of the entities of several ranks.
fn shared<const K: usize>(
    ranks: &[Rank],
    part: &[Rank],
    of_tet: impl Fn(usize) -> [u32; K] + Sync + Send,
) -> Shared {
    let pairs = |range: Range<usize>| {
        let mut pairs: Vec<[u32; 2]> = Vec::new();
        for tet in range {
            let here = of_tet(tet).into_iter().filter(|&entity| ranks[entity as usize] == SHARED);
            pairs.extend(here.map(|entity| [entity, part[tet]]));
        }
        pairs.sort_unstable();
        pairs.dedup();
        pairs
    };
    let mut pairs = map_each(ranges(part.len()), pairs).concat();
    pairs.par_sort_unstable();
    pairs.dedup();
    let mut shared = Shared::default();
    for holders in pairs.chunk_by(|a, b| a[0] == b[0]) {
        shared.push(holders[0][0], holders.iter().map(|pair| pair[1]));
    }
    shared
}

//! Meshes as the page gets them: levels and cuts, bounded in size.

use super::query::Query;
use crate::failure::{Failure, agree};
use crate::report::counted;
use serde_json::json;
use tetmill::comm::Communicator;
use tetmill::files::view::{About, Fill, Region, ViewPart, fitting, gather, message, part};
use tetmill::mesh::{By, Counts, MeshStream, Order, WithHalo, halo};
use tetmill::run::Levels;

/// Maximum number of tets in a page: with 90 bytes each, below 20 MB.
pub const IN_FILE: u64 = 200_000;

/// Maximum number of tets of a level that is served whole: the browser takes some 300 bytes each.
const SERVED: u64 = 1_000_000;

/// Maximum number of tets of the level that the page loads by itself, after the coarsest one.
const AT_FIRST: u64 = 200_000;

/// Maximum number of tets at the surface of a mesh that is too large to be shown whole.
const MOST_HOLLOW: u64 = 3 * SERVED;

/// Maximum number of boundary triangles of a level of which only the surface is shown.
const MOST_FACES: u64 = 600_000;

/// Maximum number of tets of a cut, of first order.
const IN_CUT: u64 = 400_000;

/// This rank's part of a mesh that is shown.
pub struct Shown<'a> {
    /// The tets.
    pub tets: Tets<'a>,
    /// What is said about the mesh. Level and fill are those of each message.
    pub about: About,
}

/// The tets of a mesh on one rank.
pub enum Tets<'a> {
    /// The levels of a refined part, made on demand.
    Levels(Box<Levels>),
    /// Stored parts.
    Stored(Vec<&'a dyn MeshStream>),
}

impl Shown<'_> {
    /// What the page knows from the start, as JSON: the levels from the coarsest to the finest with
    /// subdivisions and whether it is the surface only, the one to be loaded after the first, and
    /// whether the server makes cuts and ghosts.
    pub fn index(&self) -> String {
        let levels = match &self.tets {
            Tets::Levels(levels) => levels,
            Tets::Stored(streams) => {
                let hollow = self.about.totals.tets > SERVED;
                let ghosts = streams.iter().all(|stream| stream.ranks() > 1) && streams.len() == 1;
                return json!({ "levels": [[1, hollow]], "start": 0, "cuts": hollow, "ghosts": ghosts })
                    .to_string();
            }
        };
        let listed = listed(levels);
        let is_small = |m| counts_of(levels, m).is_ok_and(|counts| counts.tets <= AT_FIRST);
        let start = listed.iter().rposition(|&(m, hollow)| !hollow && is_small(m));
        let cuts = listed.last() != Some(&(levels.pieces(), false));
        json!({ "levels": listed, "start": start.unwrap_or(0), "cuts": cuts, "ghosts": true }).to_string()
    }

    /// **Collective.** The message that answers a query, on rank 0; empty on other ranks.
    ///
    /// # Errors
    /// The same on all ranks: there is no such level, it is too large, or there is not enough
    /// memory.
    pub fn answer(&self, comm: &dyn Communicator, query: &Query) -> Result<Vec<u8>, Failure> {
        match *query {
            Query::Level(pieces) => self.level(comm, pieces, SERVED),
            Query::Cut { pieces, region } => self.cut(comm, pieces, region),
            Query::Ghosts { pieces, part } => self.ghosts(comm, pieces, part),
        }
    }

    /// **Collective.** The message with the finest level that fits into a page, on rank 0.
    pub fn for_page(&self, comm: &dyn Communicator) -> Result<Vec<u8>, Failure> {
        let pieces = match &self.tets {
            Tets::Levels(levels) => finest(levels, |counts| counts.tets <= IN_FILE).unwrap_or(1),
            Tets::Stored(_) => 1,
        };
        self.level(comm, pieces, IN_FILE)
    }

    /// **Collective.** A level: whole if it has at most `most` tets, otherwise its surface.
    fn level(&self, comm: &dyn Communicator, pieces: u32, most: u64) -> Result<Vec<u8>, Failure> {
        let fill = |tets: u64| if tets <= most { Fill::Full } else { Fill::Hollow };
        let (own, fill, pieces) = match &self.tets {
            Tets::Levels(levels) => {
                let counts = counts_of(levels, pieces)?;
                let fill = fill(counts.tets);
                if fill == Fill::Hollow && counts.boundary > MOST_FACES && pieces > 1 {
                    return Err(Failure::input(format!(
                        "the level has {}, and at most {MOST_FACES} can be shown",
                        counted(counts.boundary, "boundary triangle", "boundary triangles")
                    )));
                }
                let level = agree(comm, levels.level(pieces).map_err(Failure::from))?;
                (vec![part(&level, fill)], fill, Some([levels.pieces(), pieces]))
            }
            Tets::Stored(streams) => {
                let fill = fill(self.about.totals.tets);
                (streams.iter().map(|stream| part(*stream, fill)).collect(), fill, None)
            }
        };
        let parts = gather(comm, own)?;
        agree(comm, refuse_large(&parts))?;
        Ok(self.message(comm, &parts, About { pieces, hollow: fill == Fill::Hollow, ..self.about.clone() }))
    }

    /// **Collective.** The tets at a cut.
    fn cut(&self, comm: &dyn Communicator, pieces: u32, region: Region) -> Result<Vec<u8>, Failure> {
        let order = match &self.tets {
            Tets::Levels(levels) => levels.order(),
            Tets::Stored(streams) => streams.first().map_or(Order::First, |stream| stream.order()),
        };
        // Ten-node tets have more bytes, and their faces are drawn in pieces.
        let most = IN_CUT / u64::from(order.degree()).pow(2);
        match &self.tets {
            Tets::Levels(levels) => match levels.cut(comm, pieces, region, most)? {
                Some(cut) => {
                    let pieces = Some([levels.pieces(), cut.pieces]);
                    Ok(self.message(comm, &cut.parts, About { pieces, ..self.about.clone() }))
                }
                None => {
                    let coarse = agree(comm, levels.level(1).map_err(Failure::from))?;
                    self.stored_cut(comm, &[&coarse], Some([levels.pieces(), 1]), region, most)
                }
            },
            Tets::Stored(streams) => self.stored_cut(comm, streams, None, region, most),
        }
    }

    /// **Collective.** The tets of parts at a cut; if there are too many, those in the middle of
    /// the window.
    fn stored_cut(
        &self,
        comm: &dyn Communicator,
        streams: &[&dyn MeshStream],
        pieces: Option<[u32; 2]>,
        region: Region,
        most: u64,
    ) -> Result<Vec<u8>, Failure> {
        let near = |region: Region| -> Result<(Vec<ViewPart>, u64), Failure> {
            let fill = Fill::Near { region, most };
            let own: Vec<ViewPart> = streams.iter().map(|stream| part(*stream, fill)).collect();
            let [found] = comm.all_reduce_sum_u64([own.iter().map(|part| part.tets.len() as u64).sum()])?;
            Ok((own, found))
        };
        let (mut own, mut found) = near(region)?;
        let mut window = None;
        if found > most {
            let smaller = fitting(comm, streams, &region, most)?;
            (own, found) = near(smaller)?;
            window = Some([smaller.low, smaller.high]);
        }
        if found > most {
            let many = counted(most, "tet", "tets");
            return Err(Failure::input(format!("the middle of the cut has more than {many}")));
        }
        Ok(self.message(comm, &gather(comm, own)?, About { pieces, window, ..self.about.clone() }))
    }

    /// **Collective.** The ghosts of one part.
    fn ghosts(&self, comm: &dyn Communicator, pieces: u32, wanted: u32) -> Result<Vec<u8>, Failure> {
        let of = |stream: &dyn MeshStream| -> Result<Vec<u8>, Failure> {
            if wanted >= stream.ranks() || stream.ranks() != comm.size() {
                return Err(Failure::input("there is no such part with ghosts"));
            }
            let ghosts = halo(comm, stream, By::Vertices)?;
            let own = match comm.rank() == wanted {
                true => vec![part(&WithHalo::new(stream, &ghosts), Fill::Ghosts)],
                false => Vec::new(),
            };
            Ok(self.message(comm, &gather(comm, own)?, self.about.clone()))
        };
        match &self.tets {
            Tets::Levels(levels) => {
                if counts_of(levels, pieces)?.tets > SERVED {
                    return Err(Failure::input("ghosts are shown of levels that are shown whole"));
                }
                of(&agree(comm, levels.level(pieces).map_err(Failure::from))?)
            }
            Tets::Stored(streams) => match streams[..] {
                [stream] => of(stream),
                _ => Err(Failure::input("ghosts are shown of meshes whose parts are on a rank each")),
            },
        }
    }

    fn message(&self, comm: &dyn Communicator, parts: &[ViewPart], about: About) -> Vec<u8> {
        if comm.rank() == 0 { message(parts, &about) } else { Vec::new() }
    }
}

/// The counts of a level.
fn counts_of(levels: &Levels, pieces: u32) -> Result<Counts, Failure> {
    let most = levels.pieces();
    if !(1..=most).contains(&pieces) {
        return Err(Failure::input(format!("coarse edges are cut into 1 to {most}, not into {pieces}")));
    }
    let mut counts = levels.totals(pieces);
    // A ten-node tet is drawn as if it were eight tets.
    let weight = u64::from(levels.order().degree()).pow(3);
    counts.tets *= weight;
    Ok(counts)
}

/// The most subdivisions of a level with such counts.
fn finest(levels: &Levels, fits: impl Fn(Counts) -> bool) -> Option<u32> {
    (1..=levels.pieces()).rev().find(|&m| counts_of(levels, m).is_ok_and(&fits))
}

/// The levels that the page offers, from the coarsest: subdivisions, and whether only the surface
/// is shown. Any number of subdivisions is a level; these are the finest that is shown whole, its
/// halves, and the finest of which the surface is shown.
fn listed(levels: &Levels) -> Vec<(u32, bool)> {
    let whole = finest(levels, |counts| counts.tets <= SERVED);
    let halves = std::iter::successors(whole, |&m| (m > 1).then_some(m / 2));
    let mut listed: Vec<(u32, bool)> = halves.map(|m| (m, false)).collect();
    listed.reverse();
    let surface = finest(levels, |counts| counts.boundary <= MOST_FACES).unwrap_or(1);
    if whole.is_none_or(|whole| surface > whole) {
        listed.push((surface, true));
    }
    listed
}

fn refuse_large(parts: &[ViewPart]) -> Result<(), Failure> {
    let tets: u64 = parts.iter().map(|part| part.tets.len() as u64).sum();
    if tets <= MOST_HOLLOW {
        return Ok(());
    }
    Err(Failure::input(format!(
        "the surface of the mesh has {}, and at most {MOST_HOLLOW} can be shown: show a coarser mesh",
        counted(tets, "tet", "tets")
    )))
}

//! The check of a part: its vertex blocks, boundary and tets, each in one parallel pass.

use super::boundary::{Side, check_block, check_parents, check_range, sides_of};
use super::checksum::{self, Checksum, Hashed};
use super::report::{Extreme, PartReport, ShapeReport};
use super::shape::{Batch, Measures, Shapes};
use super::{Fault, angles, curved};
use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::GlobalId;
use crate::ground::mesh::stream::{BoundaryBlock, LocalBlock, MeshStream};
use crate::ground::projector::Projector;
use rayon::prelude::*;
use std::ops::Range;

/// Parameters of the check.
#[derive(Clone, Copy, Debug)]
pub struct Settings<'a> {
    /// Whether to measure the shapes of the tets.
    pub shapes: bool,
    /// The maximum number of faults that are described one by one.
    pub described: usize,
    /// Vertices that may be off the surface: global ids, ascending.
    pub off_surface: &'a [GlobalId],
}

impl Default for Settings<'_> {
    fn default() -> Self {
        Self { shapes: true, described: 8, off_surface: &[] }
    }
}

/// Blocks are checked in at most this many chunks, whose sums are added in order: enough for any
/// number of threads, few enough that their reports take little memory.
const CHUNKS: usize = 1024;

/// *Local.* Checks this rank's part: exact orientation of every tet, blocks without gaps, boundary
/// triangles on their patches (if `projector` is given) and on their parent tets. The report is the
/// same for any number of threads.
///
/// If the stream's work is cancelled, the report covers only some of the tets; the caller must test
/// for cancellation.
///
/// Matching faces between tets are not checked here but by the [`checksum`](super::checksum()).
pub fn check_part(stream: &dyn MeshStream, projector: Option<&Projector>, settings: &Settings) -> PartReport {
    check_all(stream, projector, settings, false).0
}

/// *Local.* [`check_part`] and the part's [`checksum`](super::checksum()), in one pass over all
/// tets. Blocks that refer to missing vertices, which are faults, are left out of the checksum.
pub fn check_part_and_sum(
    stream: &dyn MeshStream,
    projector: Option<&Projector>,
    settings: &Settings,
) -> (PartReport, Checksum) {
    let (report, tets) = check_all(stream, projector, settings, true);
    (report, checksum::without_tets(stream).plus(tets))
}

/// Checks this rank's part; also returns the checksum of its tets, or 0 without.
fn check_all(
    stream: &dyn MeshStream,
    projector: Option<&Projector>,
    settings: &Settings,
    with_checksum: bool,
) -> (PartReport, Checksum) {
    let mut report = check_vertices(stream, settings);
    let (boundary, sides) = check_boundary(stream, projector, settings);
    report = report.merged(boundary, settings.described);
    check_range(stream, &sides, settings, &mut report);
    let (tets, checksum) = check_tets(stream, &sides, settings, with_checksum);
    (report.merged(tets, settings.described), checksum)
}

/// **Collective.** Checks all parts. Every rank gets the report of the whole mesh, with its counts
/// compared to the stated totals.
///
/// # Errors
/// [`CommError`] if another rank fails.
pub fn check(
    comm: &dyn Communicator,
    stream: &dyn MeshStream,
    projector: Option<&Projector>,
    settings: &Settings,
) -> Result<PartReport, CommError> {
    report_of_all(comm, stream, check_part(stream, projector, settings), settings)
}

/// **Collective.** [`check()`] and [`checksum_of_all`](super::checksum_of_all) in one pass over the
/// tets.
///
/// # Errors
/// [`CommError`] if another rank fails.
pub fn check_and_sum(
    comm: &dyn Communicator,
    stream: &dyn MeshStream,
    projector: Option<&Projector>,
    settings: &Settings,
) -> Result<(PartReport, Checksum), CommError> {
    let (report, sum) = check_part_and_sum(stream, projector, settings);
    Ok((report_of_all(comm, stream, report, settings)?, checksum::sum_of_all(comm, sum)?))
}

/// **Collective.** Merges the reports of the parts, and compares their counts to the stated totals.
fn report_of_all(
    comm: &dyn Communicator,
    stream: &dyn MeshStream,
    mine: PartReport,
    settings: &Settings,
) -> Result<PartReport, CommError> {
    let text = |report: &PartReport| serde_json::to_vec(report).expect("plain data with text keys");
    let read = |bytes: &Vec<u8>| serde_json::from_slice(bytes).expect("what this program wrote");
    // Merge on one rank: with an all-gather, a thousand ranks would receive gigabytes.
    let all = comm.gather_bytes(0, &text(&mine))?;
    let merged = all.iter().map(read).reduce(|a: PartReport, b| a.merged(b, settings.described));
    let mut bytes = merged.as_ref().map(text).unwrap_or_default();
    comm.broadcast_bytes(0, &mut bytes)?;
    let mut report: PartReport = read(&bytes);
    let totals = stream.totals();
    let found = [report.vertices, report.tets, report.boundary];
    let stated = [totals.vertices, totals.tets, totals.boundary];
    if found != stated {
        report.add_fault(Fault::Count { found, stated }, settings.described);
    }
    Ok(report)
}

/// Divides `count` blocks into chunks, independently of the number of threads.
fn chunks(count: usize) -> impl IndexedParallelIterator<Item = Range<usize>> {
    let size = count.div_ceil(CHUNKS).max(1);
    (0..count.div_ceil(size)).into_par_iter().map(move |chunk| chunk * size..count.min((chunk + 1) * size))
}

/// Merges reports in order.
fn merge_all(reports: Vec<PartReport>, settings: &Settings) -> PartReport {
    reports.into_iter().fold(PartReport::default(), |all, one| all.merged(one, settings.described))
}

/// Counts owned vertices; checks that vertex blocks follow each other without gaps.
fn check_vertices(stream: &dyn MeshStream, settings: &Settings) -> PartReport {
    let blocks = stream.vertex_blocks();
    let count = |range: Range<usize>| {
        let mut report = PartReport::default();
        for index in range {
            let block = stream.vertex_block(index);
            let next = match index + 1 {
                next if next < blocks => stream.vertex_block(next).local.start,
                _ => stream.counts().vertices as u32,
            };
            if block.local.end != next || index == 0 && block.local.start != 0 {
                let at = u64::from(block.local.end);
                report.add_fault(Fault::Gap { rank: stream.rank(), at }, settings.described);
            }
            let owned = block.ids().filter(|&id| block.owner(id, stream.rank()) == stream.rank());
            report.vertices +=
                if block.holders.is_empty() { block.local.len() as u64 } else { owned.count() as u64 };
        }
        report
    };
    merge_all(chunks(blocks).map(count).collect(), settings)
}

fn check_boundary(
    stream: &dyn MeshStream,
    projector: Option<&Projector>,
    settings: &Settings,
) -> (PartReport, Vec<Side>) {
    let check = |block: &mut BoundaryBlock, range: Range<usize>| {
        let mut sides = Vec::new();
        let reports =
            range.map(|index| check_block(stream, projector, index, block, &mut sides, settings)).collect();
        (merge_all(reports, settings), sides)
    };
    let checked: Vec<_> = chunks(stream.boundary_blocks()).map_init(BoundaryBlock::default, check).collect();
    let (reports, sides): (Vec<_>, Vec<_>) = checked.into_iter().unzip();
    let mut sides = sides.concat();
    sides.par_sort_unstable();
    (merge_all(reports, settings), sides)
}

/// Scratch space of one thread.
#[derive(Default)]
struct Scratch {
    block: LocalBlock,
    points: Vec<[f64; 3]>,
    boundary: BoundaryBlock,
    batch: Batch,
    shapes: Shapes,
    hashed: Hashed,
}

fn check_tets(
    stream: &dyn MeshStream,
    sides: &[Side],
    settings: &Settings,
    with_checksum: bool,
) -> (PartReport, Checksum) {
    let check = |scratch: &mut Scratch, range: Range<usize>| {
        let mut checksum = with_checksum.then(Checksum::default);
        let (tets, report) = check_chunk(stream, sides, settings, scratch, range, checksum.as_mut());
        (tets, report, checksum.unwrap_or_default())
    };
    let checked: Vec<_> = chunks(stream.tet_blocks()).map_init(Scratch::default, check).collect();
    let (mut report, mut checksum) = (PartReport::default(), Checksum::default());
    let mut next = 0;
    for (tets, chunk, sum) in checked {
        if tets.start != next {
            report.add_fault(Fault::Gap { rank: stream.rank(), at: next }, settings.described);
        }
        next = tets.end;
        report = report.merged(chunk, settings.described);
        checksum = checksum.plus(sum);
    }
    (report, checksum)
}

/// Checks the tets of some blocks, and adds them to `checksum`; also returns the range of their
/// local indices.
fn check_chunk(
    stream: &dyn MeshStream,
    sides: &[Side],
    settings: &Settings,
    scratch: &mut Scratch,
    blocks: Range<usize>,
    mut checksum: Option<&mut Checksum>,
) -> (Range<u64>, PartReport) {
    let mut report = PartReport::default();
    let mut covered: Option<Range<u64>> = None;
    let vertices = stream.counts().vertices as u32;
    let mut body = None;
    for index in blocks {
        if stream.work().is_cancelled() {
            break;
        }
        let Scratch { block, points, boundary, batch, shapes, hashed } = &mut *scratch;
        stream.local_block(index, block);
        let tets = &block.tets;
        let range = tets.first_local..tets.first_local + tets.tets.len() as u64;
        if let Some(before) = covered.as_ref().filter(|before| before.end != range.start) {
            report.add_fault(Fault::Gap { rank: stream.rank(), at: before.end }, settings.described);
        }
        covered = Some(covered.map_or(range.start, |before| before.start)..range.end);
        if tets.body != body {
            flush(batch, shapes, body, settings, &mut report);
            body = tets.body;
        }
        stream.block_points(block, points);
        let missing = |vertex: u32| vertex >= vertices;
        let all_there = !block.vertices.iter().any(|&vertex| missing(vertex));
        if let Some(sum) = checksum.as_deref_mut().filter(|_| all_there) {
            *sum = sum.plus(checksum::of_tets(stream, block, hashed));
        }
        for (id, tet) in (tets.first_id..).zip(&tets.tets) {
            if let Some(vertex) =
                tet.iter().map(|&k| block.vertices[k as usize]).find(|&v| !all_there && missing(v))
            {
                report.add_fault(Fault::NoSuchVertex { rank: stream.rank(), vertex }, settings.described);
                continue;
            }
            let at = |k: usize| points[tet[k] as usize];
            batch.push(id, [at(0), at(1), at(2), at(3)]);
            if batch.is_full() {
                flush(batch, shapes, body, settings, &mut report);
            }
        }
        curved::check_block(block, points, settings, &mut report);
        for side in sides_of(sides, tets) {
            check_parents(stream, *side, block, boundary, settings, &mut report);
        }
    }
    flush(&mut scratch.batch, &mut scratch.shapes, body, settings, &mut report);
    (covered.unwrap_or(0..0), report)
}

/// Adds the tets of a batch to the report and clears the batch.
fn flush(
    batch: &mut Batch,
    shapes: &mut Shapes,
    body: Option<csg::BodyId>,
    settings: &Settings,
    report: &mut PartReport,
) {
    if batch.is_empty() {
        return;
    }
    let volumes = batch.volumes(shapes);
    if !volumes.all_positive {
        for lane in (0..batch.len()).filter(|&lane| !batch.is_positive(shapes, lane)) {
            let fault = Fault::NotPositive { tet: batch.id(lane), place: batch.centroid(lane) };
            report.add_fault(fault, settings.described);
        }
    }
    report.tets += batch.len() as u64;
    report.add_volume(body, volumes.sum6 / 6.0);
    if settings.shapes {
        let measures = batch.shapes(shapes);
        add_shapes(batch, shapes, measures, &mut report.shape);
    }
    batch.clear();
}

fn add_shapes(batch: &Batch, shapes: &Shapes, measures: Measures, report: &mut Option<ShapeReport>) {
    let found = measures.extremes;
    let lane_of = |values: &[f64], value: f64| values.iter().position(|v| *v == value).unwrap_or(0);
    let extreme = |value, lane| Extreme { value, tet: batch.id(lane), place: batch.centroid(lane) };
    let degrees = |cosine: f64| cosine.clamp(-1.0, 1.0).acos().to_degrees();
    // Cosines decrease with the angle, so the smallest angle has the largest. Only new extremes are
    // converted to angles with positions.
    let beaten = report.as_ref().is_none_or(|report| {
        found.mean_ratio <= report.worst_ratio.value
            || degrees(found.smallest) <= report.smallest_angle.value
            || degrees(found.largest) >= report.largest_angle.value
    });
    if beaten {
        let worst = extreme(found.mean_ratio, lane_of(&shapes.mean_ratio, found.mean_ratio));
        let smallest = extreme(degrees(found.smallest), lane_of(&shapes.smallest, found.smallest));
        let largest = extreme(degrees(found.largest), lane_of(&shapes.largest, found.largest));
        report
            .get_or_insert_with(|| ShapeReport::of(worst, smallest, largest))
            .take_extremes(worst, smallest, largest);
    }
    let Some(report) = report else { return };
    let degrees_of = angles::Table::get();
    report.sum_of_ratios += measures.sum_of_ratios;
    let [ratios, smallest, largest] = &shapes.bins;
    for lane in 0..batch.len() {
        report.ratios[ratios[lane] as usize] += 1;
        report.smallest_angles[degrees_of.whole_degrees(smallest[lane], shapes.smallest[lane])] += 1;
        report.largest_angles[degrees_of.whole_degrees(largest[lane], shapes.largest[lane])] += 1;
    }
}

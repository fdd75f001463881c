//! Reads the tets that a viewer needs of one part.

use super::{Fill, OUTSIDE, UNKNOWN, ViewPart, faces};
use crate::Point;
use crate::ground::kernel::quality::mean_ratio;
use crate::ground::kernel::simplex::dihedral_angles;
use crate::ground::mesh::stream::{LocalBlock, MeshStream};
use crate::ground::mesh::{GlobalId, Mesh, TET_FACES};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// The number of ranges of tet blocks that are read in parallel.
const RANGES: usize = 256;

/// *Local.* Reads a part.
///
/// With [`Fill::Near`] reading stops when more tets are found than requested at most: then the part
/// has more tets than that, but not all.
pub fn part(stream: &dyn MeshStream, fill: Fill) -> ViewPart {
    let skin = if fill == Fill::Hollow { skin_of(stream) } else { Vec::new() };
    let reader = Reader { stream, fill, skin: &skin, found: AtomicU64::new(0) };
    // Ghosts are the last tets, in a block each.
    let ghosts = stream.ghosts().filter(|_| fill == Fill::Ghosts).map_or(&[][..], |ghosts| &ghosts.tets);
    let first = if fill == Fill::Ghosts { stream.tet_blocks() - ghosts.len() } else { 0 };
    let blocks = stream.tet_blocks() - first;
    let range = |k: usize| first + blocks * k / RANGES..first + blocks * (k + 1) / RANGES;
    let read: Vec<Kept> = (0..RANGES).into_par_iter().map(|k| reader.read(range(k))).collect();
    let mut all = Kept::default();
    read.into_iter().for_each(|kept| all.append(kept));
    all.vertices.par_sort_unstable();
    all.vertices.dedup();
    all.inside.par_sort_unstable_by_key(|(vertex, _)| *vertex);
    let used = &all.vertices;
    let known = stream.points();
    let point = |vertex: &u32| match known.get(*vertex as usize) {
        Some(point) => *point,
        None => {
            let place = all.inside.binary_search_by_key(vertex, |(vertex, _)| *vertex);
            all.inside[place.expect("read with its tet")].1
        }
    };
    let new = |vertex: u32| used.binary_search(&vertex).expect("a vertex of a tet") as u32;
    let tets: Vec<[u32; 4]> = all.tets.par_iter().map(|tet| tet.map(new)).collect();
    let boundary = faces::on_patches(stream, used);
    let (neighbours, patches) = faces::of_tets(&tets, &boundary, |face| match fill {
        Fill::Full => OUTSIDE,
        Fill::Hollow if face.iter().all(|&v| skin[used[v as usize] as usize]) => OUTSIDE,
        Fill::Hollow | Fill::Near { .. } | Fill::Ghosts => UNKNOWN,
    });
    ViewPart {
        points: used.par_iter().map(point).collect(),
        ids: used.par_iter().map(|&vertex| stream.vertex_id(vertex)).collect(),
        nodes: all.nodes.par_iter().map(|nodes| nodes.map(new)).collect(),
        tets,
        tet_ids: all.tet_ids,
        bodies: all.bodies,
        neighbours,
        patches,
        owners: ghosts.iter().map(|ghost| ghost.owner).collect(),
        quality: all.quality,
    }
}

/// *Local.* Reads a mesh in one part.
pub fn of_mesh(mesh: &Mesh, fill: Fill) -> ViewPart {
    part(&crate::files::plain::PlainPart::whole(mesh), fill)
}

/// For each vertex whether it is on the boundary or shared.
fn skin_of(stream: &dyn MeshStream) -> Vec<bool> {
    let mut on_skin = vec![false; stream.counts().vertices as usize];
    for index in 0..stream.vertex_blocks() {
        let block = stream.vertex_block(index);
        let local = block.local.start as usize..block.local.end as usize;
        on_skin[local].fill(block.on_boundary || !block.holders.is_empty());
    }
    on_skin
}

/// Tets that are kept, by local vertices of the stream.
#[derive(Default)]
struct Kept {
    tets: Vec<[u32; 4]>,
    nodes: Vec<[u32; 6]>,
    tet_ids: Vec<GlobalId>,
    bodies: Vec<u32>,
    quality: Vec<[f32; 2]>,
    vertices: Vec<u32>,
    /// The coordinates of vertices that the stream does not store.
    inside: Vec<(u32, [f64; 3])>,
}

impl Kept {
    fn append(&mut self, mut other: Self) {
        self.tets.append(&mut other.tets);
        self.nodes.append(&mut other.nodes);
        self.tet_ids.append(&mut other.tet_ids);
        self.bodies.append(&mut other.bodies);
        self.quality.append(&mut other.quality);
        self.vertices.append(&mut other.vertices);
        self.inside.append(&mut other.inside);
    }
}

struct Reader<'a> {
    stream: &'a dyn MeshStream,
    fill: Fill,
    skin: &'a [bool],
    /// The number of tets kept by all threads.
    found: AtomicU64,
}

impl Reader<'_> {
    /// Reads some tet blocks.
    fn read(&self, blocks: Range<usize>) -> Kept {
        let mut kept = Kept::default();
        let (mut block, mut points) = (LocalBlock::default(), Vec::new());
        for index in blocks {
            if let Fill::Near { most, .. } = self.fill
                && self.found.load(Ordering::Relaxed) > most
            {
                break;
            }
            self.stream.local_block(index, &mut block);
            // Most blocks of a hollow part have no tet that is kept.
            let any =
                self.fill != Fill::Hollow || (0..block.tets.tets.len()).any(|tet| self.on_skin(&block, tet));
            if any {
                self.stream.block_points(&block, &mut points);
                self.keep(&block, &points, &mut kept);
            }
        }
        kept.vertices.sort_unstable();
        kept.vertices.dedup();
        kept.inside.sort_unstable_by_key(|(vertex, _)| *vertex);
        kept.inside.dedup_by_key(|(vertex, _)| *vertex);
        kept
    }

    /// Whether a tet has a face on the skin.
    fn on_skin(&self, block: &LocalBlock, tet: usize) -> bool {
        let tet = block.tets.tets[tet].map(|k| self.skin[block.vertices[k as usize] as usize]);
        TET_FACES.iter().any(|face| face.iter().all(|&k| tet[k]))
    }

    /// Appends the tets of a block that are wanted.
    fn keep(&self, block: &LocalBlock, points: &[[f64; 3]], kept: &mut Kept) {
        let body = block.tets.body.expect("a tet block has a body").0;
        let known = self.stream.points().len();
        let before = kept.tets.len();
        for (place, tet) in block.tets.tets.iter().enumerate() {
            let corners = tet.map(|k| points[k as usize]);
            let wanted = match &self.fill {
                Fill::Full | Fill::Ghosts => true,
                Fill::Hollow => self.on_skin(block, place),
                Fill::Near { region, .. } => region.meets(&corners),
            };
            if !wanted {
                continue;
            }
            let local = |k: u32| block.vertices[k as usize];
            let nodes = block.tets.edge_nodes.get(place);
            for &k in tet.iter().chain(nodes.into_iter().flatten()) {
                kept.vertices.push(local(k));
                if local(k) as usize >= known {
                    kept.inside.push((local(k), points[k as usize]));
                }
            }
            kept.tets.push(tet.map(local));
            kept.nodes.extend(nodes.map(|nodes| nodes.map(local)));
            kept.tet_ids.push(block.tets.first_id + place as u64);
            kept.bodies.push(body);
            kept.quality.push(quality_of(corners));
        }
        self.found.fetch_add((kept.tets.len() - before) as u64, Ordering::Relaxed);
    }
}

/// The smallest dihedral angle in degrees, and the mean ratio, which is negative for an inverted
/// tet; of straight edges.
fn quality_of(tet: [[f64; 3]; 4]) -> [f32; 2] {
    let p = tet.map(Point::from);
    let angle = dihedral_angles(&p).into_iter().fold(f64::INFINITY, f64::min);
    [angle as f32, mean_ratio(&p[0], &p[1], &p[2], &p[3]) as f32]
}

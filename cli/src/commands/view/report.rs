//! What the page of a report shows beside the numbers of the report.

use super::{Shown, Tets};
use crate::failure::{Failure, agree};
use serde_json::{Value, json};
use tetmill::Generated;
use tetmill::comm::Communicator;
use tetmill::files::picture::{ColorBy, Cut, Look, Settings, gather, png_bytes, render, scene_of_part};
use tetmill::mesh::MeshStream;

/// Maximum number of tets and of boundary triangles of a level that is drawn: larger meshes are
/// black with grid.
const DRAWN: [u64; 2] = [2_000_000, 60_000];

/// **Collective.** Pictures, histograms of the whole mesh and the counts of each part, on rank 0.
pub fn beside_report(comm: &dyn Communicator, made: &Generated, shown: &Shown) -> Result<Value, Failure> {
    let pictures = match &shown.tets {
        Tets::Levels(levels) => {
            let fits = |m: &u32| {
                let counts = levels.totals(*m);
                counts.tets <= DRAWN[0] && counts.boundary <= DRAWN[1]
            };
            let pieces = (1..=levels.pieces()).rev().find(fits).unwrap_or(1);
            pictures(comm, &agree(comm, levels.level(pieces).map_err(Failure::from))?)?
        }
        Tets::Stored(_) => pictures(comm, made.stream())?,
    };
    let (counts, mut shared) = (made.stream().counts(), 0);
    for index in 0..made.stream().vertex_blocks() {
        let block = made.stream().vertex_block(index);
        shared += if block.holders.is_empty() { 0 } else { u64::from(block.local.end - block.local.start) };
    }
    let parts = comm.all_gather_one([counts.tets, counts.vertices, counts.boundary, shared])?;
    let part = |(number, [tets, vertices, boundary, shared]): (usize, [u64; 4])| json!({ "part": number + 1, "tets": tets, "vertices": vertices, "shared_vertices": shared, "boundary": boundary });
    let shape = made.check.shape.as_ref();
    Ok(json!({
        "pictures": pictures,
        "angles": shape.map(|shape| &shape.smallest_angles),
        "ratios": shape.map(|shape| &shape.ratios),
        "parts": parts.into_iter().enumerate().map(part).collect::<Vec<_>>(),
    }))
}

/// **Collective.** The whole mesh, and the mesh cut in its middle, as PNG in base64 with a title
/// each.
fn pictures(comm: &dyn Communicator, part: &dyn MeshStream) -> Result<Vec<Value>, Failure> {
    let ends = |sign: f64| {
        let low = part
            .points()
            .iter()
            .fold([f64::INFINITY; 3], |low, p| [0, 1, 2].map(|k| low[k].min(sign * p[k])));
        comm.all_reduce_min_f64(low)
    };
    let (low, high) = (ends(1.0)?, ends(-1.0)?.map(|x| -x));
    let cut = Cut { point: [0, 1, 2].map(|k| 0.5 * (low[k] + high[k])), normal: [0.0, -1.0, 0.0] };
    let color_by = if comm.size() > 1 { ColorBy::Part } else { ColorBy::Patch };
    let mut made = Vec::new();
    for (title, cut) in [("The mesh", None), ("Cut through the middle", Some(cut))] {
        let scene = gather(comm, &scene_of_part(part, &Look { color_by, cut }))?;
        let view = cut.as_ref().map_or_else(Settings::default, Settings::facing);
        let view = Settings { width: 720, height: 540, ..view };
        made.extend(scene.map(|scene| {
            let png = tetmill_view::base64(&png_bytes(&render(&scene, &view)));
            json!({ "title": title, "png": png })
        }));
    }
    Ok(made)
}

//! The message to the page: a head in JSON, then the arrays of all parts.
//!
//! ```text
//! u32 length of the head (little endian, as all numbers)
//! head: counts, names, notes; "arrays": name, type, offset from the end of the head, count
//! arrays, each from a multiple of 8 bytes
//! ```

use super::ViewPart;
use crate::ground::mesh::Names;
use crate::ground::mesh::stream::Counts;
use serde_json::json;

/// What the page says about the mesh, beside the arrays.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct About {
    /// The name of the mesh.
    pub title: String,
    /// Numbers and names of bodies and boundaries.
    pub names: Names,
    /// Counts of the whole mesh, which can be finer than what is shown.
    pub totals: Counts,
    /// Subdivisions of each coarse edge of the mesh and of what is shown, if it is a lattice.
    pub pieces: Option<[u32; 2]>,
    /// Whether only tets at the skin are stored.
    pub hollow: bool,
    /// The corners of the window that a cut has tets of, if it has more than are sent.
    pub window: Option<[[f64; 3]; 2]>,
    /// Pairs of patches, a periodic copy and its master, by index.
    pub periodic: Vec<[u32; 2]>,
    /// The report of the run, if there is one.
    pub report: Option<serde_json::Value>,
}

/// Packs all parts of a mesh. Coordinates are rounded to single precision relative to the centre of
/// the bounding box.
pub fn message(parts: &[ViewPart], about: &About) -> Vec<u8> {
    let [low, high] = bounds(parts);
    let center = [0, 1, 2].map(|k| 0.5 * (low[k] + high[k]));
    let mut arrays = Arrays::default();
    let all = |find: &dyn Fn(&ViewPart) -> usize| parts.iter().map(find).collect::<Vec<_>>();
    let shift = |p: &[f64; 3]| [0, 1, 2].map(|k| ((p[k] - center[k]) as f32).to_le_bytes());
    arrays.push("points", "f32", parts.iter().flat_map(|p| &p.points).flat_map(shift));
    let ids = |ids: &[u64]| ids.iter().map(|&id| (id as f64).to_le_bytes()).collect::<Vec<_>>();
    arrays.push("ids", "f64", parts.iter().flat_map(|p| ids(&p.ids)));
    arrays.push("tetIds", "f64", parts.iter().flat_map(|p| ids(&p.tet_ids)));
    let tets = parts.iter().flat_map(|p| p.tets.as_flattened());
    arrays.push("tets", "u32", tets.map(|v| v.to_le_bytes()));
    let neighbours = parts.iter().flat_map(|p| p.neighbours.as_flattened());
    arrays.push("neighbours", "i32", neighbours.map(|n| n.to_le_bytes()));
    let patches = parts.iter().flat_map(|p| p.patches.as_flattened()).copied();
    match patches.clone().max() {
        Some(last) if last > i16::MAX.into() => arrays.push("patches", "i32", patches.map(i32::to_le_bytes)),
        _ => arrays.push("patches", "i16", patches.map(|p| (p as i16).to_le_bytes())),
    }
    let bodies = parts.iter().flat_map(|p| &p.bodies).copied();
    match bodies.clone().max() {
        Some(last) if last > u16::MAX.into() => arrays.push("bodies", "u32", bodies.map(u32::to_le_bytes)),
        _ => arrays.push("bodies", "u16", bodies.map(|b| (b as u16).to_le_bytes())),
    }
    let nodes = parts.iter().flat_map(|p| p.nodes.as_flattened());
    arrays.push("nodes", "u32", nodes.map(|v| v.to_le_bytes()));
    arrays.push("owners", "u32", parts.iter().flat_map(|p| &p.owners).map(|o| o.to_le_bytes()));
    let quality = parts.iter().flat_map(|p| p.quality.as_flattened());
    arrays.push("quality", "f32", quality.map(|q| q.to_le_bytes()));
    let label = |label: &crate::ground::mesh::Label| json!({ "number": label.number, "names": label.names });
    let head = json!({
        "title": about.title,
        "center": center, "low": low, "high": high,
        "vertices": all(&|p| p.points.len()), "tets": all(&|p| p.tets.len()),
        "totals": { "vertices": about.totals.vertices, "tets": about.totals.tets, "boundary": about.totals.boundary },
        "pieces": about.pieces, "hollow": about.hollow, "window": about.window, "periodic": about.periodic,
        "patches": about.names.patches.iter().map(label).collect::<Vec<_>>(),
        "bodies": about.names.bodies.iter().map(label).collect::<Vec<_>>(),
        "report": about.report,
        "arrays": arrays.list,
    });
    let mut head = head.to_string().into_bytes();
    // Arrays start at a multiple of 8 bytes, with the length before the head.
    head.resize((head.len() + 4).next_multiple_of(8) - 4, b' ');
    let mut bytes = (head.len() as u32).to_le_bytes().to_vec();
    bytes.append(&mut head);
    bytes.append(&mut arrays.bytes);
    bytes
}

/// The corners of the bounding box; zero without points.
fn bounds(parts: &[ViewPart]) -> [[f64; 3]; 2] {
    let mut points = parts.iter().flat_map(|part| &part.points).peekable();
    let first = points.peek().copied().copied().unwrap_or_default();
    points.fold([first; 2], |[low, high], p| {
        [[0, 1, 2].map(|k| low[k].min(p[k])), [0, 1, 2].map(|k| high[k].max(p[k]))]
    })
}

#[derive(Default)]
struct Arrays {
    bytes: Vec<u8>,
    list: Vec<serde_json::Value>,
}

impl Arrays {
    fn push<const N: usize>(&mut self, name: &str, kind: &str, numbers: impl Iterator<Item = [u8; N]>) {
        let offset = self.bytes.len();
        let mut count = 0;
        for number in numbers {
            self.bytes.extend_from_slice(&number);
            count += 1;
        }
        self.list.push(json!({ "name": name, "type": kind, "offset": offset, "count": count }));
        self.bytes.resize(self.bytes.len().next_multiple_of(8), 0);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Fill, of_mesh};
    use super::*;
    use crate::files::testing::cube;
    use crate::ground::mesh::Label;

    #[test]
    fn the_arrays_are_where_the_head_says() {
        let part = of_mesh(&cube(2), Fill::Full);
        let names = Names { bodies: vec![Label::new(1, "<script>")], patches: Vec::new() };
        let about = About { title: "cube".into(), names, ..About::default() };
        let bytes = message(std::slice::from_ref(&part), &about);
        let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
        assert_eq!((length + 4) % 8, 0);
        let head: serde_json::Value = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
        assert_eq!(head["bodies"][0]["names"][0], "<script>");
        assert_eq!(head["tets"][0], 48);
        let tets = head["arrays"].as_array().unwrap().iter().find(|a| a["name"] == "tets").unwrap();
        let start = 4 + length + tets["offset"].as_u64().unwrap() as usize;
        let number = |k: usize| u32::from_le_bytes(bytes[start + 4 * k..][..4].try_into().unwrap());
        let read: Vec<u32> = (0..192).map(number).collect();
        assert_eq!(read, part.tets.as_flattened());
    }

    #[test]
    fn large_numbers_of_boundaries_and_bodies_are_wider() {
        let mut part = of_mesh(&cube(2), Fill::Full);
        let types = |part: &ViewPart| {
            let bytes = message(std::slice::from_ref(part), &About::default());
            let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
            let head: serde_json::Value = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
            let arrays = head["arrays"].as_array().unwrap().clone();
            ["patches", "bodies"]
                .map(|name| arrays.iter().find(|a| a["name"] == name).unwrap()["type"].clone())
        };
        (part.patches[0][0], part.bodies[0]) = (32_767, 65_535);
        assert_eq!(types(&part), ["i16", "u16"]);
        (part.patches[0][0], part.bodies[0]) = (32_768, 65_536);
        assert_eq!(types(&part), ["i32", "u32"]);
    }
}

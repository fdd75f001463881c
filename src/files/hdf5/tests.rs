//! The datasets, read back from their places. That HDF5's own library finds them there is tested
//! with h5py, VTK, DOLFINx and PETSc, see `tests/clients.rs`.

use super::checksum::checksum;
use super::tree::{Kind, Placed, Tree, Value};
use super::{
    BODIES, BOUNDARIES, CONNECTIVITY, Content, OFFSETS, PARENTS, PARTS, POINTS, Settings, TRIANGLES, cells,
    named_path, write_with,
};
use crate::files::Written;
use crate::files::plain::PlainPart;
use crate::files::testing::{cube, names, scattered, slabs, together};
use crate::ground::comm::Communicator;
use crate::ground::mesh::stream::MeshStream;
use crate::ground::mesh::{Label, Mesh, Names, Order, Rank, VertexId};
use std::fs;
use std::path::Path;

/// A written file, with the places of its datasets.
pub(super) struct Found {
    bytes: Vec<u8>,
    placed: Placed,
}

impl Found {
    /// Writes a mesh in parts and reads the file.
    fn of(mesh: &Mesh, names: &Names, tet_to_rank: &[Rank], ranks: u32, folder: &Path) -> Self {
        let part = |comm: &dyn Communicator| PlainPart::part(mesh, tet_to_rank, ranks, comm.rank());
        Self::written(part, names, ranks, Settings::default(), folder)
    }

    /// Writes the parts of ranks and reads the file.
    pub fn written<P: MeshStream>(
        part: impl Fn(&dyn Communicator) -> P + Sync,
        names: &Names,
        ranks: u32,
        settings: Settings,
        folder: &Path,
    ) -> Self {
        let stem = folder.join("m");
        let results = together(ranks, |comm| {
            let part = part(comm);
            let written = write_with(comm, &part, names, &stem, settings).unwrap();
            (written, Content::of(comm, &part, names, settings).unwrap().tree().place())
        });
        let bytes = fs::read(folder.join("m.h5")).unwrap();
        let index = fs::read(folder.join("m.xdmf")).unwrap();
        let expected = Written { files: 2, bytes: (bytes.len() + index.len()) as u64 };
        assert!(results.iter().all(|(written, _)| *written == expected));
        let (_, placed) = results.into_iter().next().unwrap();
        assert_eq!(placed.bytes(), bytes.len() as u64);
        Self { bytes, placed }
    }

    fn values<const N: usize, T>(&self, dataset: &str, value: fn([u8; N]) -> T) -> Vec<T> {
        let (kind, shape) = self.placed.dataset(dataset);
        assert_eq!(kind.bytes(), N as u64, "{dataset}");
        let first = self.placed.place_of(dataset, 0) as usize;
        let end = self.placed.place_of(dataset, shape.iter().product()) as usize;
        self.bytes[first..end].chunks_exact(N).map(|bytes| value(bytes.try_into().unwrap())).collect()
    }

    pub fn longs(&self, dataset: &str) -> Vec<i64> {
        self.values(dataset, i64::from_ne_bytes)
    }

    fn ints(&self, dataset: &str) -> Vec<i32> {
        self.values(dataset, i32::from_ne_bytes)
    }

    /// Each cell of N corners by the bits of their coordinates, sorted, with its number.
    fn cells<const N: usize>(&self, cells: &str, numbers: &str) -> Vec<([[u64; 3]; N], i32)> {
        let points = self.values(POINTS, f64::from_ne_bytes);
        let place = |v: &i64| [0, 1, 2].map(|axis| points[3 * *v as usize + axis].to_bits());
        let corners = self.longs(cells);
        let corners = corners.chunks_exact(N).map(|cell| {
            let mut places = [0; N].map(|_: u8| [0; 3]);
            places.iter_mut().zip(cell).for_each(|(to, v)| *to = place(v));
            places.sort_unstable();
            places
        });
        let mut cells: Vec<_> = corners.zip(self.ints(numbers)).collect();
        cells.sort_unstable();
        cells
    }
}

/// The cells of a mesh in the form of [`Found::cells`].
fn expected<const N: usize>(
    mesh: &Mesh,
    cells: impl Iterator<Item = ([VertexId; N], u32)>,
) -> Vec<([[u64; 3]; N], i32)> {
    let place = |v: VertexId| <[f64; 3]>::from(mesh.points[v.index()]).map(f64::to_bits);
    let mut cells: Vec<_> = cells
        .map(|(vertices, number)| {
            let mut places = vertices.map(place);
            places.sort_unstable();
            (places, number as i32)
        })
        .collect();
    cells.sort_unstable();
    cells
}

#[test]
fn any_number_of_ranks_write_the_same_mesh() {
    let (mesh, names) = (cube(4), names());
    let tets = mesh.tets.iter().zip(&mesh.bodies);
    let tets = expected(&mesh, tets.map(|(tet, body)| (*tet, names.bodies[body.index()].number)));
    let triangles = mesh.triangles.iter().map(|t| (t.vertices, names.patches[t.patch.index()].number));
    let triangles = expected(&mesh, triangles);
    let dir = tempfile::tempdir().unwrap();
    for (ranks, tet_to_rank) in [
        (1, slabs(&mesh, 1)),
        (2, slabs(&mesh, 2)),
        (3, scattered(&mesh, 3)),
        (7, scattered(&mesh, 7)),
        // Four ranks have no tets.
        (7, slabs(&mesh, 3)),
    ] {
        let found = Found::of(&mesh, &names, &tet_to_rank, ranks, dir.path());
        assert_eq!(found.cells(CONNECTIVITY, BODIES), tets, "{ranks} ranks");
        assert_eq!(found.cells(TRIANGLES, BOUNDARIES), triangles, "{ranks} ranks");
        assert_eq!(found.longs(cells(Order::First)), found.longs(CONNECTIVITY));
        assert!(found.longs(OFFSETS).into_iter().eq((0..=384).map(|tet| 4 * tet)));
        let mut parts: Vec<u32> = tet_to_rank.iter().map(|rank| rank + 1).collect();
        parts.sort_unstable();
        assert!(found.ints(PARTS).into_iter().eq(parts.into_iter().map(|part| part as i32)));
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2, "no other files are left");
    }
}

#[test]
fn an_interface_triangle_has_its_tets_of_both_parts() {
    let mesh = cube(4);
    let dir = tempfile::tempdir().unwrap();
    for (ranks, tet_to_rank) in [(1, slabs(&mesh, 1)), (2, slabs(&mesh, 2)), (5, scattered(&mesh, 5))] {
        let found = Found::of(&mesh, &names(), &tet_to_rank, ranks, dir.path());
        let (tets, bodies) = (found.longs(CONNECTIVITY), found.ints(BODIES));
        let mut on_both_sides = 0;
        for ((triangle, parents), number) in (found.longs(TRIANGLES).chunks_exact(3))
            .zip(found.longs(PARENTS).chunks_exact(2))
            .zip(found.ints(BOUNDARIES))
        {
            let there = parents.iter().filter(|tet| **tet >= 0).map(|&tet| tet as usize);
            assert!(there.clone().all(|tet| triangle.iter().all(|v| tets[4 * tet..][..4].contains(v))));
            let beside: Vec<i32> = there.map(|tet| bodies[tet]).collect();
            on_both_sides += usize::from(beside.len() == 2);
            assert_eq!(beside, if number == 3 { vec![1, 2] } else { vec![number] });
        }
        assert_eq!(on_both_sides, 32, "{ranks} ranks");
    }
}

#[test]
fn names_of_any_characters_are_stored_with_their_numbers() {
    let mut names = names();
    names.bodies[0] = Label { number: 1, names: vec!["Stahl/Guß".into(), "all".into()] };
    names.bodies[1] = Label { number: 2, names: vec!["Stahl_Guß".into(), "all".into()] };
    let dir = tempfile::tempdir().unwrap();
    let found = Found::of(&cube(2), &names, &slabs(&cube(2), 2), 2, dir.path());
    assert_eq!(found.ints(&named_path("Body", "Numbers")), [1, 1, 2, 2]);
    let text = found.values(&named_path("Body", "Names"), |bytes: [u8; 10]| bytes);
    let text = text.iter().map(|bytes| std::str::from_utf8(bytes).unwrap().trim_end_matches('\0'));
    assert!(text.eq(["Stahl/Guß", "all", "Stahl_Guß", "all"]));
    assert_eq!(found.ints("/VTKHDF/FieldData/Body Stahl_Guß"), [1, 2]);
    assert_eq!(found.ints("/VTKHDF/FieldData/Body all"), [1, 2]);
}

#[test]
fn places_do_not_overlap_and_headers_are_where_the_groups_say() {
    let mut tree = Tree::default();
    tree.add("/a/b/first", Kind::F64, &[5, 3]);
    tree.add("/a/second", Kind::U8, &[0]);
    tree.add("/c", Kind::Text(7), &[3]);
    tree.link("/d/e", "/c");
    tree.attribute("/a", "Type", Value::Text("text"));
    tree.attribute("/c", "numbers", Value::Integers(vec![1, 2]));
    let placed = tree.place();
    let head = placed.head();
    // Superblock, and the headers of the root, a, a/b, d and three datasets.
    let headers = head.windows(4).filter(|bytes| bytes == b"OHDR").count();
    assert_eq!((&head[..8], headers), (&b"\x89HDF\r\n\x1a\n"[..], 7));
    let place = |dataset| placed.place_of(dataset, 0);
    assert!(head.len() as u64 <= place("/a/b/first"));
    assert!(place("/a/b/first") + 120 <= place("/a/second") && place("/a/second") <= place("/c"));
    assert_eq!(placed.place_of("/c", 3), placed.bytes());
    let sum = |bytes: &[u8]| checksum(bytes).to_le_bytes();
    assert_eq!(head[44..48], sum(&head[..44]));
    let root = u64::from_le_bytes(head[36..44].try_into().unwrap()) as usize;
    let length = u32::from_le_bytes(head[root + 6..root + 10].try_into().unwrap()) as usize;
    let end = root + 10 + length;
    assert_eq!(head[end..end + 4], sum(&head[root..end]));
}

//! One part in one file: the format by the file's name.

use super::lines::{self, TetLine, TriangleLine, VertexLine};
use super::once::LeftOut;
use super::output::{Output, write_file};
use super::text::{FLOAT_CHARS, Line};
use super::{WriteError, Written, geomview, vtu};
use crate::comm::thread;
use crate::mesh::stream::{MeshStream, NO_TET, SingularTags, TetBlock};
use crate::mesh::{Label, Names};
use std::ffi::OsStr;
use std::path::Path;

/// The ends of names that [`write()`] knows.
pub const KNOWN: &str =
    ".vtu, .msh (Gmsh 2.2), .mesh (Medit), .vol (NETGEN), .off (Geomview: the boundary alone)";

/// Writes a mesh of one part in the format that the end of `path` tells; see [`KNOWN`]. With `.vtu` the triangles
/// on patches are in a second file, `STEM.boundary.vtu`.
///
/// # Errors
/// An unknown format, several parts, a body or patch without a number, a full disk, what the system says; the
/// file before it stays.
pub fn write(part: &dyn MeshStream, names: &Names, path: &Path) -> Result<Written, WriteError> {
    if part.ranks() != 1 {
        return Err(WriteError::SeveralParts { path: path.to_path_buf(), parts: part.ranks() });
    }
    let format: fn(&dyn MeshStream, &Names, &mut Output) -> Result<(), WriteError> = match path
        .extension()
        .and_then(OsStr::to_str)
    {
        Some("vtu") => return vtu::write(&thread::alone(), part, names, path),
        Some("off") => return geomview::write(&thread::alone(), part, &geomview::Settings::default(), path),
        Some("msh") => gmsh,
        Some("mesh") => medit,
        Some("vol") => netgen,
        _ => return Err(WriteError::UnknownFormat(path.to_path_buf())),
    };
    let bytes = write_file(path, estimate(part), |path| {
        let mut file = Output::create(path)?;
        format(part, names, &mut file)?;
        file.finish()
    })?;
    Ok(Written { files: 1, bytes })
}

/// About how many bytes a text format takes.
fn estimate(part: &dyn MeshStream) -> u64 {
    const PER_ENTITY: u64 = 45;
    let counts = part.counts();
    counts.vertices * (3 * FLOAT_CHARS as u64) + (counts.tets + counts.boundary) * PER_ENTITY
}

/// Appends ids from 1.
fn ids(line: &mut Line, vertices: &[u32]) {
    vertices.iter().for_each(|&v| _ = line.blank().int(u64::from(v) + 1));
}

fn coordinates(line: &mut Line, point: &[f64; 3]) {
    line.float(point[0]).blank().float(point[1]).blank().float(point[2]);
}

/// Each number once, with the first name it has.
fn numbered(list: &[Label]) -> Vec<(u32, &str)> {
    let named = list.iter().filter_map(|label| Some((label.number, label.name()?)));
    let mut numbered: Vec<(u32, &str)> = named.collect();
    numbered.sort_by_key(|(number, _)| *number);
    numbered.dedup_by_key(|(number, _)| *number);
    numbered
}

/// Gmsh 2.2, text: boundary and body numbers are physical tags, patches and bodies (from 1) elementary ones.
fn gmsh(part: &dyn MeshStream, names: &Names, file: &mut Output) -> Result<(), WriteError> {
    let counts = part.counts();
    let mut head = String::from("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n");
    let (patches, bodies) = (numbered(&names.patches), numbered(&names.bodies));
    head += &format!("{}\n", patches.len() + bodies.len());
    for (dimension, list) in [(2, patches), (3, bodies)] {
        for (number, name) in list {
            head += &format!("{dimension} {number} \"{}\"\n", name.replace(['"', '\n', '\r'], "_"));
        }
    }
    head += &format!("$EndPhysicalNames\n$Nodes\n{}\n", counts.vertices);
    file.write(head.as_bytes())?;
    lines::vertices(part, file, |line, VertexLine { index, point }| {
        coordinates(line.int(index as u64 + 1).blank(), point);
    })?;
    file.write(format!("$EndNodes\n$Elements\n{}\n", counts.boundary + counts.tets).as_bytes())?;
    lines::triangles(part, names, &LeftOut::default(), file, |line, triangle: TriangleLine| {
        line.int(triangle.index + 1).bytes(b" 2 2 ").int(triangle.number).blank();
        ids(line.int(u64::from(triangle.patch.0) + 1), triangle.vertices);
    })?;
    lines::tets(part, names, file, |line, tet: TetLine| {
        line.int(counts.boundary + tet.index + 1).bytes(b" 4 2 ").int(tet.number).blank();
        ids(line.int(u64::from(tet.body.0) + 1), tet.vertices);
    })?;
    file.write(b"$EndElements\n")?;
    gmsh_periodic(part, file)
}

/// Gmsh's `$Periodic`: for each image its elementary tag and that of the patch it is the image of, the matrix of the motion, and
/// the pairs of nodes, image first.
fn gmsh_periodic(part: &dyn MeshStream, file: &mut Output) -> Result<(), WriteError> {
    let links = part.links();
    if links.is_empty() {
        return Ok(());
    }
    let mut text = format!("$Periodic\n{}\n", links.len());
    for (index, link) in links.iter().enumerate() {
        text += &format!("2 {} {}\nAffine", link.image.0 + 1, link.of.0 + 1);
        // By rows.
        link.motion.to_homogeneous().transpose().iter().for_each(|x| text += &format!(" {x}"));
        let pairs = part.images(index);
        text += &format!("\n{}\n", pairs.len());
        for (image, of) in pairs {
            text += &format!("{} {}\n", image + 1, of + 1);
        }
    }
    file.write((text + "$EndPeriodic\n").as_bytes())
}

/// Medit: the references are boundary and body numbers.
fn medit(part: &dyn MeshStream, names: &Names, file: &mut Output) -> Result<(), WriteError> {
    let counts = part.counts();
    let head = format!("MeshVersionFormatted 2\nDimension 3\nVertices\n{}\n", counts.vertices);
    file.write(head.as_bytes())?;
    lines::vertices(part, file, |line, vertex| {
        coordinates(line, vertex.point);
        line.bytes(b" 0");
    })?;
    // Each line begins with a blank, which Medit skips.
    file.write(format!("Triangles\n{}\n", counts.boundary).as_bytes())?;
    lines::triangles(part, names, &LeftOut::default(), file, |line, triangle| {
        ids(line, triangle.vertices);
        line.blank().int(triangle.number);
    })?;
    file.write(format!("Tetrahedra\n{}\n", counts.tets).as_bytes())?;
    lines::tets(part, names, file, |line, tet| {
        ids(line, tet.vertices);
        line.blank().int(tet.number);
    })?;
    file.write(b"End\n")
}

/// NETGEN's `.vol`. Its tets are negatively oriented: two vertices change places. Without edge segments.
fn netgen(part: &dyn MeshStream, names: &Names, file: &mut Output) -> Result<(), WriteError> {
    let counts = part.counts();
    let bodies = BodyRuns::of(part);
    let domain = |tet: u64| match bodies.find(tet) {
        Some(body) => names.bodies.get(body).map_or(0, |label| u64::from(label.number)),
        None => 0,
    };
    file.write(
        format!("mesh3d\ndimension\n3\ngeomtype\n0\nsurfaceelements\n{}\n", counts.boundary).as_bytes(),
    )?;
    lines::triangles(part, names, &LeftOut::default(), file, |line, triangle| {
        line.int(u64::from(triangle.patch.0) + 1).blank().int(triangle.number);
        triangle.parents.iter().for_each(|&parent| _ = line.blank().int(domain(parent)));
        ids(line.bytes(b" 3"), triangle.vertices);
    })?;
    file.write(format!("volumeelements\n{}\n", counts.tets).as_bytes())?;
    lines::tets(part, names, file, |line, tet| {
        let [a, b, c, d] = *tet.vertices;
        ids(line.int(tet.number).bytes(b" 4"), &[b, a, c, d]);
    })?;
    file.write(format!("edgesegmentsgi2\n0\npoints\n{}\n", counts.vertices).as_bytes())?;
    lines::vertices(part, file, |line, vertex| coordinates(line, vertex.point))?;
    let mut end = netgen_identifications(part) + &netgen_singularities(part);
    for (title, list) in [("materials", &names.bodies), ("bcnames", &names.patches)] {
        let list = numbered(list);
        end += &format!("{title}\n{}\n", list.len());
        for (number, name) in list {
            // The reader takes words.
            end += &format!("{number} {}\n", name.split_whitespace().collect::<Vec<_>>().join("_"));
        }
    }
    file.write((end + "endmesh\n").as_bytes())
}

/// NETGEN's pairs of vertices with the numbers of their identifications, all of them periodic. Empty if there are none.
fn netgen_identifications(part: &dyn MeshStream) -> String {
    /// NETGEN's number for periodic ones.
    const PERIODIC: &str = " 2";
    let links = part.links();
    let of_link = |index: usize| {
        let pair = move |(image, of): (u32, u64)| (links[index].identification, of + 1, u64::from(image) + 1);
        part.images(index).into_iter().map(pair)
    };
    let mut pairs: Vec<(u32, u64, u64)> = (0..links.len()).flat_map(of_link).collect();
    pairs.sort_unstable();
    pairs.dedup();
    let Some(count) = links.iter().map(|link| link.identification).max() else { return String::new() };
    let mut text = format!("identifications\n{}\n", pairs.len());
    for (number, of, image) in pairs {
        text += &format!("{of} {image} {number}\n");
    }
    text + &format!("identificationtypes\n{count}\n{}\n", PERIODIC.repeat(count as usize).trim_start())
}

/// NETGEN's factors of singular points and of faces, on both sides of these. Edges have none, as the file has no segments.
fn netgen_singularities(part: &dyn MeshStream) -> String {
    let SingularTags { patches, vertices } = part.singular();
    let points: Vec<_> = vertices.iter().map(|(v, factor)| (u64::from(*v) + 1, *factor)).collect();
    let faces: Vec<_> = patches.iter().map(|(patch, factor)| (u64::from(patch.0) + 1, *factor)).collect();
    let mut text = String::new();
    for (title, list) in [
        ("singular_points", points),
        ("singular_face_inside", faces.clone()),
        ("singular_face_outside", faces),
    ] {
        if !list.is_empty() {
            text += &format!("{title}\n{}\n", list.len());
        }
        for (number, factor) in list {
            text += &format!("{number} {factor}\n");
        }
    }
    text
}

/// The body of each tet of a part, as runs of equal ones.
struct BodyRuns(Vec<(u64, usize)>);

impl BodyRuns {
    fn of(part: &dyn MeshStream) -> Self {
        let mut runs: Vec<(u64, usize)> = Vec::new();
        let mut block = TetBlock::default();
        for index in 0..part.tet_blocks() {
            part.tet_block(index, &mut block);
            let body = block.body.expect("a tet block has a body").index();
            if runs.last().is_none_or(|(_, last)| *last != body) {
                runs.push((block.first_local, body));
            }
        }
        Self(runs)
    }

    fn find(&self, tet: u64) -> Option<usize> {
        let after = self.0.partition_point(|(first, _)| *first <= tet);
        (tet != NO_TET).then(|| self.0[after - 1].1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::plain::PlainPart;
    use crate::io::testing::{cube, names, two_tets};
    use crate::mesh::Mesh;
    use std::fs;

    fn written(mesh: &Mesh, name: &str) -> String {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(name);
        let written = write(&PlainPart::whole(mesh), &names(), &path).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        assert_eq!(written, Written { files: 1, bytes: text.len() as u64 });
        text
    }

    #[test]
    fn two_tets_are_written_to_the_letter_for_gmsh() {
        let expected = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n5\n\
            2 1 \"skin\"\n2 2 \"lid\"\n2 3 \"between\"\n3 1 \"lower\"\n3 2 \"upper\"\n$EndPhysicalNames\n\
            $Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 1\n$EndNodes\n$Elements\n8\n\
            1 2 2 1 1 1 3 2\n2 2 2 1 1 1 2 4\n3 2 2 1 1 1 4 3\n4 2 2 2 2 2 3 5\n5 2 2 2 2 2 5 4\n\
            6 2 2 2 2 3 4 5\n7 4 2 1 1 1 2 3 4\n8 4 2 1 1 2 3 4 5\n$EndElements\n";
        assert_eq!(written(&two_tets(), "m.msh"), expected);
    }

    #[test]
    fn two_tets_are_written_to_the_letter_for_medit() {
        let expected = "MeshVersionFormatted 2\nDimension 3\nVertices\n5\n\
            0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 1 1 0\nTriangles\n6\n \
            1 3 2 1\n 1 2 4 1\n 1 4 3 1\n 2 3 5 2\n 2 5 4 2\n 3 4 5 2\nTetrahedra\n2\n 1 2 3 4 1\n 2 3 4 5 1\nEnd\n";
        assert_eq!(written(&two_tets(), "m.mesh"), expected);
    }

    #[test]
    fn two_tets_are_written_to_the_letter_for_netgen() {
        let expected = "mesh3d\ndimension\n3\ngeomtype\n0\nsurfaceelements\n6\n\
            1 1 1 0 3 1 3 2\n1 1 1 0 3 1 2 4\n1 1 1 0 3 1 4 3\n2 2 1 0 3 2 3 5\n2 2 1 0 3 2 5 4\n2 2 1 0 3 3 4 5\n\
            volumeelements\n2\n1 4 2 1 3 4\n1 4 3 2 4 5\nedgesegmentsgi2\n0\npoints\n5\n\
            0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\nmaterials\n2\n1 lower\n2 upper\n\
            bcnames\n3\n1 skin\n2 lid\n3 between\nendmesh\n";
        assert_eq!(written(&two_tets(), "m.vol"), expected);
    }

    #[test]
    fn an_interface_lies_between_two_domains_for_netgen() {
        let text = written(&cube(4), "m.vol");
        let surface = text.lines().skip_while(|line| *line != "surfaceelements").skip(2).take(192 + 32);
        let (interface, outer): (Vec<&str>, Vec<&str>) = surface.partition(|line| line.starts_with("3 3 "));
        assert_eq!((interface.len(), outer.len()), (32, 192));
        assert!(interface.iter().all(|line| line.starts_with("3 3 1 2 3 ")));
        assert!(outer.iter().all(|line| line.starts_with("1 1 1 0 3 ") || line.starts_with("2 2 2 0 3 ")));
    }

    #[test]
    fn other_formats_and_several_parts_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let mesh = two_tets();
        let refuse = |part: &PlainPart, name: &str| {
            write(part, &names(), &dir.path().join(name)).unwrap_err().to_string()
        };
        let unknown = refuse(&PlainPart::whole(&mesh), "m.stl");
        assert!(unknown.contains("m.stl") && unknown.contains(".msh"), "{unknown}");
        let parts = refuse(&PlainPart::part(&mesh, &[0, 1], 2, 0), "m.msh");
        assert!(parts.contains("2 parts"), "{parts}");
        assert!(fs::read_dir(dir.path()).unwrap().next().is_none());
    }
}

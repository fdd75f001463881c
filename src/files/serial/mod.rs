//! Single-file formats, chosen by the file's extension. Gmsh, Medit, NETGEN and Abaqus files hold
//! the mesh of all ranks.

mod abaqus;
mod gmsh;
mod netgen;

use super::input::ending;
use super::joined::{self, Section, TextFormat, Whole};
use super::node_order::VTK;
use super::output::Destination;
use super::text::Line;
use super::{WriteError, Written, geomview, vtu};
use crate::ground::comm::{Communicator, thread};
use crate::ground::mesh::stream::MeshStream;
use crate::ground::mesh::{Names, Order};
use std::path::{Path, PathBuf};

/// The extensions that [`Format::of`] knows.
pub const KNOWN: &str = ".vtu, .msh (Gmsh), .mesh (Medit), .vol (NETGEN), .inp (Abaqus, CalculiX), .off (Geomview: the boundary alone)";

/// A single-file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// VTK's XML, binary. The triangles on patches are in a second file, `STEM.boundary.vtu`.
    Vtu,
    /// Gmsh text 2.2, or 4.1 if an entity is in several groups or faces are periodic.
    Gmsh,
    /// Medit, text.
    Medit,
    /// NETGEN's `.vol`.
    Netgen,
    /// Abaqus' and CalculiX' `.inp`.
    Abaqus,
    /// Geomview's OFF: boundary only.
    Off,
}

impl Format {
    /// Returns the format for the extension of a path; see [`KNOWN`].
    ///
    /// # Errors
    /// If the extension is missing or unknown.
    pub fn of(path: &Path) -> Result<Self, WriteError> {
        match ending(path).as_str() {
            "vtu" => Ok(Self::Vtu),
            "msh" => Ok(Self::Gmsh),
            "mesh" => Ok(Self::Medit),
            "vol" => Ok(Self::Netgen),
            "inp" => Ok(Self::Abaqus),
            "off" => Ok(Self::Off),
            _ => Err(WriteError::UnknownFormat(path.to_path_buf())),
        }
    }

    /// Refuses a path that cannot take this format: VTU needs two files, so it cannot go to a
    /// stream.
    ///
    /// # Errors
    /// For VTU: if the path is not a regular file ending in `.vtu`, or the second path is not a
    /// regular file.
    pub fn fits(self, path: &Path) -> Result<(), WriteError> {
        let is_file = |path: &Path| matches!(Destination::of(path), Ok(Destination::File(_)));
        let Some(second) = self.second(path) else { return Ok(()) };
        if ending(path) != "vtu" || !is_file(path) {
            return Err(WriteError::TwoFiles(path.to_path_buf()));
        }
        if is_file(&second) { Ok(()) } else { Err(WriteError::NoRegularFile(second)) }
    }

    /// The second file of the format, written beside `path`.
    pub fn second(self, path: &Path) -> Option<PathBuf> {
        (self == Self::Vtu).then(|| path.with_extension("boundary.vtu"))
    }

    /// The text format, if this one can hold the mesh of all ranks.
    fn text(self) -> Option<TextFormat> {
        match self {
            Self::Gmsh => Some(TextFormat { name: "Gmsh", corners_first: false, sections: gmsh::sections }),
            Self::Medit => Some(TextFormat { name: "Medit", corners_first: false, sections: medit_sections }),
            Self::Netgen => {
                Some(TextFormat { name: "NETGEN", corners_first: true, sections: netgen::sections })
            }
            Self::Abaqus => {
                Some(TextFormat { name: "Abaqus", corners_first: false, sections: abaqus::sections })
            }
            Self::Vtu | Self::Off => None,
        }
    }
}

/// Writes a mesh of one part in the format of the extension of `path`; see [`KNOWN`] and
/// [`write_as`].
///
/// # Errors
/// An unknown extension, and the errors of [`write_as`].
pub fn write(part: &dyn MeshStream, names: &Names, path: &Path) -> Result<Written, WriteError> {
    write_as(part, names, Format::of(path)?, path)
}

/// Writes a mesh of one part in a given format, whatever the extension of `path`. A path that is
/// not a regular file is written through, and `-` is the standard output; see
/// [`super::output::Destination`].
///
/// # Errors
/// Several parts, a body or patch without a number, VTU into a stream, not enough disk space, or an
/// I/O error. An existing file is kept.
pub fn write_as(
    part: &dyn MeshStream,
    names: &Names,
    format: Format,
    path: &Path,
) -> Result<Written, WriteError> {
    if part.ranks() != 1 {
        return Err(WriteError::SeveralParts { path: path.to_path_buf(), parts: part.ranks() });
    }
    format.fits(path)?;
    match format.text() {
        Some(text) => joined::write(&thread::alone(), part, names, path, &text),
        None if format == Format::Off => geomview::write_whole(part, path),
        None => vtu::write(&thread::alone(), part, names, path),
    }
}

/// **Collective.** Writes the mesh of all ranks to one Gmsh, Medit, NETGEN or Abaqus file. Each
/// vertex, tet and interface triangle is written once. All ranks get the totals.
///
/// # Errors
/// A format for one part only, more vertices or elements than 32 bits can number, a part with
/// ghosts, a body or patch without a number, not enough disk space, or an I/O error. All ranks get
/// the error, and an existing file is kept.
pub fn write_joined(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    names: &Names,
    format: Format,
    path: &Path,
) -> Result<Written, WriteError> {
    match format.text() {
        Some(text) => joined::write(comm, part, names, path, &text),
        None => Err(WriteError::SeveralParts { path: path.to_path_buf(), parts: part.ranks() }),
    }
}

/// Names and numbers of a mesh that a file of this format cannot hold, one sentence each: a solver
/// looks for them there.
pub fn losses(names: &Names, format: Format) -> Vec<String> {
    match format {
        Format::Gmsh => gmsh::losses(names),
        Format::Netgen => netgen::losses(names),
        Format::Abaqus => abaqus::losses(names),
        Format::Medit if names.bodies.iter().chain(&names.patches).any(|label| !label.names.is_empty()) => {
            vec!["Medit has no names: bodies and boundaries are known by their numbers alone".into()]
        }
        _ => Vec::new(),
    }
}

/// Joins the first few texts, and counts the rest.
fn listed(texts: impl Iterator<Item = String>) -> String {
    const SHOWN: usize = 10;
    let texts: Vec<String> = texts.collect();
    let list = texts[..texts.len().min(SHOWN)].join(", ");
    if texts.len() > SHOWN { format!("{list} and {} more", texts.len() - SHOWN) } else { list }
}

fn coordinates(line: &mut Line, point: &[f64; 3]) {
    line.float(point[0]).blank().float(point[1]).blank().float(point[2]);
}

/// Medit: the references are boundary and body numbers.
fn medit_sections<'a>(_: &dyn Communicator, whole: &'a Whole<'a>) -> Result<Vec<Section<'a>>, WriteError> {
    let counts = whole.totals;
    let [triangles, tets] = match whole.order() {
        Order::First => ["Triangles", "Tetrahedra"],
        Order::Second => ["TrianglesP2", "TetrahedraP2"],
    };
    Ok(vec![
        Section::Text(format!("MeshVersionFormatted 2\nDimension 3\nVertices\n{}\n", counts.vertices)),
        Section::Vertices(Box::new(|line, _, point| {
            coordinates(line, point);
            line.bytes(b" 0");
        })),
        Section::Text(format!("{triangles}\n{}\n", counts.boundary)),
        Section::Triangles(Box::new(|line, triangle| {
            whole.triangle_ids(line, triangle);
            line.blank().int(triangle.number);
        })),
        Section::Text(format!("{tets}\n{}\n", counts.tets)),
        Section::Tets(Box::new(|line, tet| {
            whole.tet_ids(line, tet, &VTK);
            line.blank().int(tet.number);
        })),
        Section::Text("End\n".into()),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::plain::PlainPart;
    use crate::files::testing::{cube, names, two_tets};
    use crate::ground::mesh::{Label, Mesh};
    use std::fs;

    fn written(mesh: &Mesh, name: &str) -> String {
        written_with(mesh, &names(), name)
    }

    fn written_with(mesh: &Mesh, names: &Names, name: &str) -> String {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(name);
        let written = write(&PlainPart::whole(mesh), names, &path).unwrap();
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
    fn boundaries_in_several_groups_make_a_gmsh_file_of_version_4() {
        let all = |number: u32, more: &[&str]| Label {
            number,
            names: [&["all"], more].concat().into_iter().map(String::from).collect(),
        };
        let names = Names { bodies: vec![Label::unnamed(4)], patches: vec![all(1, &[]), all(2, &["clamp"])] };
        let expected = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 1 \"all\"\n2 2 \"clamp\"\n$EndPhysicalNames\n\
            $Entities\n0 0 2 1\n1 0 0 0 1 1 1 1 1 0\n2 0 0 0 1 1 1 2 1 2 0\n1 0 0 0 1 1 1 1 4 0\n$EndEntities\n\
            $Nodes\n1 5 1 5\n3 1 0 5\n1\n2\n3\n4\n5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n$EndNodes\n\
            $Elements\n3 8 1 8\n2 1 2 3\n1 1 3 2\n2 1 2 4\n3 1 4 3\n2 2 2 3\n4 2 3 5\n5 2 5 4\n6 3 4 5\n\
            3 1 4 2\n7 1 2 3 4\n8 2 3 4 5\n$EndElements\n";
        assert_eq!(written_with(&two_tets(), &names, "m.msh"), expected);
        assert!(losses(&names, Format::Gmsh).is_empty());
        let said = losses(&names, Format::Netgen);
        assert_eq!(said, ["NETGEN has one name for a number: of boundaries, 2 is `all` without `clamp`"]);
        assert_eq!(losses(&names, Format::Medit).len(), 1);
    }

    #[test]
    fn boundaries_of_one_name_are_one_physical_group() {
        let names = Names {
            bodies: vec![Label::new(1, "lower")],
            patches: vec![Label::new(6, "skin"), Label::new(3, "skin")],
        };
        let text = written_with(&two_tets(), &names, "m.msh");
        assert!(text.contains("$PhysicalNames\n2\n2 3 \"skin\"\n3 1 \"lower\"\n"), "{text}");
        assert!(text.contains("\n1 2 2 3 1 1 3 2\n") && text.contains("\n6 2 2 3 2 3 4 5\n"), "{text}");
        let said = losses(&names, Format::Gmsh);
        assert_eq!(said, ["Gmsh has one number a name: of boundaries, 6 in 3 (`skin`)"]);
    }

    #[test]
    fn unused_and_unnamed_numbers_have_names_for_netgen() {
        let names = Names {
            bodies: vec![Label::unnamed(2)],
            patches: vec![Label::new(4, "skin"), Label::unnamed(2)],
        };
        let text = written_with(&two_tets(), &names, "m.vol");
        let end = "materials\n2\n1 default\n2 default\nbcnames\n4\n1 default\n2 default\n3 default\n4 skin\nendmesh\n";
        assert!(text.ends_with(end), "{text}");
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

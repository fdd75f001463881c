//! Geomview's OOGL: the skin of each part in its own colour.
//!
//! ```text
//! STEM.off                      one part
//! STEM.list                     several parts: an index of
//! STEM.parts/part.K.off         K = 1 … N, rank K−1; each with its boundary and its cut faces
//! ```

use super::lines::FLUSH_AT;
use super::output::{Output, folder_and_name, write_file, write_text, write_together};
use super::skin::{SkinFace, skin};
use super::text::{FLOAT_CHARS, Line};
use super::{WriteError, Written, sum_written};
use crate::files::color::{Color, of_number};
use crate::ground::comm::Communicator;
use crate::ground::mesh::stream::MeshStream;
use std::fs;
use std::path::Path;

/// Options for drawing the parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Size of each part about its centre, as a fraction of its true size; below 1 there are gaps
    /// between parts.
    pub shrink: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { shrink: 1.0 }
    }
}

/// **Collective.** Writes the skin of each rank's part and, with several, their index file. `stem`
/// may end in `.off` or `.list`. All ranks get the totals.
///
/// # Errors
/// A part with ghosts, not enough disk space, or an I/O error. All ranks get the error, and old
/// files are kept.
pub fn write(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    settings: &Settings,
    stem: &Path,
) -> Result<Written, WriteError> {
    refuse_ghosts(part)?;
    let (folder, name) = folder_and_name(stem)?;
    let name = name.to_string_lossy();
    let name = [".off", ".list"].iter().find_map(|end| name.strip_suffix(end)).unwrap_or(&name);

    let faces = skin(part, |_| true);
    let needed = estimate(&faces);
    let written = write_together(comm, &folder, needed, is_part_file, |stage| {
        let mut written = Written { files: 1, bytes: 0 };
        let file = if part.ranks() == 1 {
            format!("{name}.off")
        } else {
            let folder = stage.join(format!("{name}.parts"));
            fs::create_dir_all(&folder).map_err(WriteError::io(&folder))?;
            format!("{name}.parts/part.{}.off", part.rank() + 1)
        };
        let mut file = Output::create(&stage.join(file))?;
        write_off(part, &faces, settings, &mut file)?;
        written.bytes += file.finish()?;
        if part.ranks() > 1 && part.rank() == 0 {
            let bytes = write_text(&stage.join(format!("{name}.list")), list(name, part.ranks()).as_bytes())?;
            written += Written { files: 1, bytes };
        }
        Ok(written)
    })?;
    sum_written(comm, written)
}

/// Writes the boundary of the only part to one file or stream.
pub(super) fn write_whole(part: &dyn MeshStream, path: &Path) -> Result<Written, WriteError> {
    refuse_ghosts(part)?;
    let faces = skin(part, |_| true);
    let bytes =
        write_file(path, estimate(&faces), |file| write_off(part, &faces, &Settings::default(), file))?;
    Ok(Written { files: 1, bytes })
}

fn refuse_ghosts(part: &dyn MeshStream) -> Result<(), WriteError> {
    if part.ghosts().is_some() { Err(WriteError::NoHalo("Geomview's OFF")) } else { Ok(()) }
}

/// Estimated size of the faces of a part in bytes: a closed triangulated surface has half as many
/// vertices as triangles.
fn estimate(faces: &[SkinFace]) -> u64 {
    faces.len() as u64 * (3 * FLOAT_CHARS as u64 / 2 + 40)
}

/// Whether a file of a replaced `STEM.parts` may be deleted.
fn is_part_file(name: &str) -> bool {
    let number = name.strip_prefix("part.").and_then(|rest| rest.strip_suffix(".off"));
    number.is_some_and(|number| number.bytes().all(|b| b.is_ascii_digit()))
}

fn list(name: &str, parts: u32) -> String {
    let mut text = String::from("{ LIST\n");
    for part in 1..=parts {
        text += &format!("  {{ appearance {{ +face -edge }} {{ < \"{name}.parts/part.{part}.off\" }} }}\n");
    }
    text + "}\n"
}

/// Writes one OFF object: the vertices of the faces, and the faces in the part's colour.
fn write_off(
    part: &dyn MeshStream,
    faces: &[SkinFace],
    settings: &Settings,
    file: &mut Output,
) -> Result<(), WriteError> {
    let mut used: Vec<u32> = faces.iter().flat_map(|face| face.vertices).collect();
    used.sort_unstable();
    used.dedup();
    let place = |v: u32| used.binary_search(&v).expect("a vertex of a face") as u64;
    let points = || used.iter().map(|&v| part.points()[v as usize]);
    let centre: [f64; 3] =
        std::array::from_fn(|k| points().map(|p| p[k]).sum::<f64>() / used.len().max(1) as f64);

    let mut text = format!("OFF\n{} {} 0\n", used.len(), faces.len()).into_bytes();
    let mut line = Line::default();
    for point in points() {
        for k in 0..3 {
            let shrunk = centre[k] + settings.shrink * (point[k] - centre[k]);
            // At true size the coordinates must stay bitwise equal.
            line.float(if settings.shrink == 1.0 { point[k] } else { shrunk }).blank();
        }
        line.end(&mut text);
        file.flush_past(FLUSH_AT, &mut text)?;
    }
    let color = rgb(of_number(part.rank()));
    for face in faces {
        line.int(3);
        face.vertices.iter().for_each(|&v| _ = line.blank().int(place(v)));
        line.bytes(color.as_bytes()).end(&mut text);
        file.flush_past(FLUSH_AT, &mut text)?;
    }
    file.flush_past(0, &mut text)
}

/// Formats a colour with decimal points, because Geomview reads `1 0 0` as integers up to 255.
fn rgb(color: Color) -> String {
    color.iter().map(|c| format!(" {c:.3}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::plain::PlainPart;
    use crate::files::testing::{together, two_tets};

    #[test]
    fn two_tets_are_written_to_the_letter() {
        let dir = tempfile::tempdir().unwrap();
        let mesh = two_tets();
        let stem = dir.path().join("m.off");
        let whole = PlainPart::whole(&mesh);
        let written = together(1, |comm| write(comm, &whole, &Settings::default(), &stem).unwrap())[0];
        let text = fs::read_to_string(&stem).unwrap();
        assert_eq!(written, Written { files: 1, bytes: text.len() as u64 });
        let colour = rgb(of_number(0));
        let mut expected = String::from("OFF\n5 6 0\n0 0 0 \n1 0 0 \n0 1 0 \n0 0 1 \n1 1 1 \n");
        for face in ["0 3 2", "0 1 3", "0 2 1", "2 3 4", "1 4 3", "1 2 4"] {
            expected += &format!("3 {face}{colour}\n");
        }
        assert_eq!(text, expected);
    }

    #[test]
    fn parts_are_listed_and_shrunk_about_their_centres() {
        let dir = tempfile::tempdir().unwrap();
        let mesh = two_tets();
        together(2, |comm| {
            let part = PlainPart::part(&mesh, &[0, 1], 2, comm.rank());
            write(comm, &part, &Settings { shrink: 0.5 }, &dir.path().join("m")).unwrap()
        });
        let list = fs::read_to_string(dir.path().join("m.list")).unwrap();
        assert!(list.starts_with("{ LIST\n") && list.contains("{ < \"m.parts/part.2.off\" }"), "{list}");
        let first = fs::read_to_string(dir.path().join("m.parts/part.1.off")).unwrap();
        assert!(first.starts_with("OFF\n4 4 0\n0.125 0.125 0.125 \n0.625 0.125 0.125 \n"), "{first}");
        let second = fs::read_to_string(dir.path().join("m.parts/part.2.off")).unwrap();
        assert!(second.ends_with(&format!("{}\n", rgb(of_number(1)))), "{second}");
    }
}

//! Output files, checked before any work: no output may overwrite an input or another output.

use crate::failure::{Failure, Status};
use crate::options::{Format, RunOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use tetmill::files::elmer::Layout;
use tetmill::files::{
    Destination, WriteError, elmer, folder_of, gmsh4, hdf5, is_same_place, mfem, remove_abandoned,
    with_ending,
};

/// The files that a command reads and writes, with the options that name them.
#[derive(Default)]
pub(super) struct Outputs {
    inputs: Vec<PathBuf>,
    files: Vec<(&'static str, PathBuf)>,
    folder: Option<PathBuf>,
    /// Paths written into the folder.
    entries: Vec<PathBuf>,
}

impl Outputs {
    /// Starts with the files of the geometries, surfaces or meshes that are read.
    pub fn reading<'a>(inputs: impl IntoIterator<Item = &'a PathBuf>) -> Self {
        let inputs = inputs.into_iter().flat_map(|input| files_of(input)).collect();
        Self { inputs, ..Self::default() }
    }

    /// Adds an optional input.
    pub fn and_reading(mut self, input: Option<&PathBuf>) -> Self {
        self.inputs.extend(input.cloned());
        self
    }

    /// Adds the file named by an option, if given.
    pub fn file(mut self, option: &'static str, path: Option<&PathBuf>) -> Self {
        self.files.extend(path.map(|path| (option, path.clone())));
        self
    }

    /// Adds the folder of a partitioned mesh, unless the only format is `none`. `stem` names the
    /// files of formats with one file.
    pub fn folder(mut self, folder: &Path, stem: &Path, run: &RunOptions, parts: u32) -> Self {
        self.entries = run.format.iter().flat_map(|format| entries(*format, folder, stem, parts)).collect();
        self.folder = (!self.entries.is_empty()).then(|| folder.to_path_buf());
        self
    }

    /// Refuses outputs that cannot be written or would overwrite an input or each other.
    ///
    /// Then removes files of killed runs from the output folders.
    ///
    /// # Errors
    /// If an output is refused, with the names of both files.
    pub fn prepare(&self) -> Result<(), Failure> {
        self.refuse_other_kinds()?;
        self.refuse_clashes()?;
        self.files
            .iter()
            .filter_map(|(_, path)| folder_of(path))
            .for_each(|folder| remove_abandoned(&folder));
        self.folder.iter().for_each(|folder| remove_abandoned(folder));
        Ok(())
    }

    /// Whether an output goes to the standard output, which must then contain nothing else.
    pub fn take_stdout(&self) -> bool {
        self.files.iter().any(|(_, path)| matches!(Destination::of(path), Ok(Destination::Stdout)))
    }

    /// Prints a text to the standard output, or to the standard error if a file goes to the former.
    ///
    /// A reader that closes the pipe, as in `| head`, is not an error.
    pub fn show(&self, text: std::fmt::Arguments) -> Result<(), Failure> {
        let (shown, stream) = if self.take_stdout() {
            (std::io::stderr().lock().write_fmt(text), "error")
        } else {
            (std::io::stdout().lock().write_fmt(text), "output")
        };
        match shown {
            Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Failure::new(
                Status::Resources,
                format!("cannot write to the standard {stream}: {error}"),
            )),
            _ => Ok(()),
        }
    }

    fn refuse_other_kinds(&self) -> Result<(), Failure> {
        for (option, path) in &self.files {
            let shown = path.display();
            match Destination::of(path) {
                Err(error) => return Err(Failure::input(format!("{option} {shown}: {error}"))),
                Ok(Destination::File(place)) if place.is_dir() => {
                    return Err(Failure::input(format!(
                        "{option} {shown} is a folder; give the name of a file"
                    )));
                }
                Ok(_) => {}
            }
        }
        if let Some(entry) =
            self.entries.iter().find(|entry| matches!(Destination::of(entry), Ok(Destination::Stream(_))))
        {
            return Err(WriteError::NoRegularFile(entry.clone()).into());
        }
        let Some(folder) = &self.folder else { return Ok(()) };
        match Destination::of(folder) {
            Ok(Destination::File(place)) if place.is_dir() || !place.exists() => Ok(()),
            _ => Err(Failure::input(format!(
                "-o {} is no folder; the mesh has several files: give a folder",
                folder.display()
            ))),
        }
    }

    fn refuse_clashes(&self) -> Result<(), Failure> {
        let folder = self.folder.iter().map(|folder| ("-o", folder));
        let named: Vec<_> = self.files.iter().map(|(option, path)| (*option, path)).chain(folder).collect();
        for (index, (option, path)) in named.iter().enumerate() {
            if let Some((first, other)) = named[..index].iter().find(|(_, other)| is_same_place(other, path))
            {
                return Err(Failure::input(format!(
                    "{first} {} and {option} {} are the same file; rename one of them",
                    other.display(),
                    path.display()
                )));
            }
        }
        for (option, path) in &self.files {
            let clash = |other: &&PathBuf| is_same_place(other, path);
            if let Some(input) = self.inputs.iter().find(clash) {
                return Err(overwrites(&format!("{option} {}", path.display()), input));
            }
            if let Some(entry) = self.entries.iter().find(clash) {
                return Err(Failure::input(format!(
                    "{option} {} and {}, written by -o and -f, are the same file; rename one of them",
                    path.display(),
                    entry.display()
                )));
            }
        }
        for entry in &self.entries {
            if let Some(input) = self.inputs.iter().find(|input| is_same_place(input, entry)) {
                return Err(overwrites(&entry.display().to_string(), input));
            }
        }
        Ok(())
    }
}

fn overwrites(output: &str, input: &Path) -> Failure {
    let input = input.display();
    Failure::input(format!("{output} would overwrite the input {input}; choose another name"))
}

/// All files that are read for an input.
fn files_of(input: &Path) -> Vec<PathBuf> {
    if input.is_dir() {
        return elmer::only_layout(input).map(files_of_layout).unwrap_or_default();
    }
    let ending = input.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let beside: &[&str] = match ending.as_str() {
        "ele" | "node" | "face" => &["ele", "node", "face"],
        "poly" | "smesh" => &["node"],
        _ => return vec![input.to_path_buf()],
    };
    let others = beside.iter().flat_map(|ending| [ending.to_string(), ending.to_ascii_uppercase()]);
    let others = others.map(|ending| input.with_extension(ending)).filter(|path| path != input);
    std::iter::once(input.to_path_buf()).chain(others).collect()
}

/// The files of an Elmer mesh without `mesh.names`, which is only overwritten with the same names.
fn files_of_layout(layout: Layout) -> Vec<PathBuf> {
    match layout {
        Layout::Serial(folder) => SERIAL.iter().map(|name| folder.join(name)).collect(),
        Layout::Partitioned { folder, .. } => vec![folder],
    }
}

/// The files of a serial Elmer mesh except the names.
const SERIAL: [&str; 4] = ["mesh.header", "mesh.nodes", "mesh.elements", "mesh.boundary"];

/// The paths that a format writes in the folder, or removes because an earlier run had more parts.
fn entries(format: Format, folder: &Path, stem: &Path, parts: u32) -> Vec<PathBuf> {
    let named = |ends: &[&str]| ends.iter().map(|end| with_ending(stem, end)).collect::<Vec<PathBuf>>();
    match (format, parts) {
        (Format::None, _) => Vec::new(),
        (Format::Elmer, 1) => {
            let serial = SERIAL.iter().map(|name| folder.join(name));
            serial.chain([folder.join("partitioning.1"), folder.join("mesh.names")]).collect()
        }
        (Format::Elmer, parts) => {
            vec![folder.join(format!("partitioning.{parts}")), folder.join("mesh.names")]
        }
        (Format::Vtu, 1) => named(&[".vtu", ".boundary.vtu"]),
        (Format::Vtu, _) => named(&[".pvtu", ".boundary.pvtu", ".parts"]),
        (Format::Msh | Format::Msh4, _) => named(&[".msh"]),
        (Format::Msh4Parts, parts) => {
            let files = (1..=parts).map(|part| with_ending(stem, &format!("_{part}.msh")));
            files.chain(gmsh4::outdated(stem, parts)).collect()
        }
        (Format::Medit, _) => named(&[".mesh"]),
        (Format::Vol, _) => named(&[".vol"]),
        (Format::Inp, _) => named(&[".inp"]),
        (Format::Mfem, parts) => {
            let files = (0..parts).map(|rank| with_ending(stem, &format!(".{rank:06}")));
            files.chain(mfem::outdated(stem, parts)).collect()
        }
        (Format::Hdf5, _) => named(&hdf5::ENDINGS),
        (Format::Geomview, 1) => named(&[".off"]),
        (Format::Geomview, _) => named(&[".list", ".parts"]),
    }
}

//! The frame of a `.vtu` file: tags with the offset of each array, then the arrays.

use crate::files::WriteError;
use crate::files::chunks::{items, split, write_chunks};
use crate::files::node_order::vtk_types;
use crate::files::output::Output;
use crate::ground::mesh::Order;
use crate::ground::progress::Work;
use std::path::{Path, PathBuf};

/// The type of an array's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    U8,
    I32,
    I64,
    F64,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::U8 => "UInt8",
            Self::I32 => "Int32",
            Self::I64 => "Int64",
            Self::F64 => "Float64",
        }
    }

    fn bytes(self) -> u64 {
        match self {
            Self::U8 => 1,
            Self::I32 => 4,
            Self::I64 | Self::F64 => 8,
        }
    }

    /// Appends a number of this type.
    #[inline]
    pub fn push(self, number: u64, bytes: &mut Vec<u8>) {
        match self {
            Self::U8 => bytes.push(number as u8),
            Self::I32 => bytes.extend_from_slice(&(number as u32).to_ne_bytes()),
            Self::I64 => bytes.extend_from_slice(&number.to_ne_bytes()),
            Self::F64 => bytes.extend_from_slice(&(number as f64).to_ne_bytes()),
        }
    }
}

/// The section of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Section {
    Points,
    Cells,
    PointData,
    CellData,
}

/// One array of a piece.
#[derive(Clone, Debug)]
pub(super) struct Array {
    pub section: Section,
    pub name: String,
    pub kind: Kind,
    /// Numbers for each point or cell.
    pub components: usize,
    /// Length in numbers.
    pub len: u64,
}

impl Array {
    /// The attributes that are the same in pieces and in their index file.
    pub fn attributes(&self) -> String {
        let components = match self.components {
            1 => String::new(),
            count => format!(" NumberOfComponents=\"{count}\""),
        };
        format!("type=\"{}\" Name=\"{}\"{components}", self.kind.name(), escaped(&self.name))
    }

    fn bytes(&self) -> u64 {
        self.len * self.kind.bytes()
    }
}

/// The arrays of one `.vtu` file, section by section.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub points: u64,
    pub cells: u64,
    pub arrays: Vec<Array>,
    /// Attributes of sections: which array has the global ids.
    pub attributes: Vec<(Section, &'static str)>,
    /// Numbers by name for the whole file: the names of bodies and boundaries.
    pub fields: Vec<(String, Vec<u32>)>,
    /// The order of the elements.
    pub order: Order,
    /// Whether the fields are in a comment. MFEM's reader accepts nothing before, beside or after
    /// the piece; VTK and meshio accept fields only there.
    pub hides_fields: bool,
}

/// Length in bytes of the size that precedes each array.
const LENGTH: u64 = 8;
const END: &str = "\n </AppendedData>\n</VTKFile>\n";

/// The first lines of a file.
pub(super) fn file_tag(kind: &str) -> String {
    let order = if cfg!(target_endian = "big") { "BigEndian" } else { "LittleEndian" };
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"{order}\" \
         header_type=\"UInt64\">\n"
    )
}

/// Escapes text for an attribute. XML has no control characters, so these become `_`.
pub(super) fn escaped(text: &str) -> String {
    let text = text.replace(char::is_control, "_").replace('&', "&amp;").replace('"', "&quot;");
    text.replace('<', "&lt;").replace('>', "&gt;")
}

impl Piece {
    /// A piece of tets followed by triangles. Vertex numbers have 32 bits if they fit.
    pub fn new(points: u64, tets: u64, triangles: u64, order: Order) -> Self {
        let (of_tet, of_triangle) = (order.tet_nodes() as u64, order.triangle_nodes() as u64);
        let (cells, corners) = (tets + triangles, of_tet * tets + of_triangle * triangles);
        let id = if points.max(corners) <= i32::MAX as u64 { Kind::I32 } else { Kind::I64 };
        let mut piece = Self {
            points,
            cells,
            arrays: Vec::new(),
            attributes: Vec::new(),
            fields: Vec::new(),
            order,
            hides_fields: false,
        };
        piece.add_field(Section::Points, "Points", 3, points);
        piece.add(Section::Cells, "connectivity", id, corners);
        piece.add(Section::Cells, "offsets", id, cells);
        piece.add(Section::Cells, "types", Kind::U8, cells);
        piece
    }

    pub fn add(&mut self, section: Section, name: &str, kind: Kind, len: u64) {
        self.arrays.push(Array { section, name: name.to_owned(), kind, components: 1, len });
    }

    /// Adds an array of real numbers with several components for each of `count` points or cells.
    pub fn add_field(&mut self, section: Section, name: &str, components: usize, count: u64) {
        let len = components as u64 * count;
        self.arrays.push(Array { section, name: name.to_owned(), kind: Kind::F64, components, len });
    }

    /// Calls `f(name, attributes, arrays)` for each section, whose arrays must be adjacent.
    pub fn for_each_section(&self, mut f: impl FnMut(&str, &str, &[Array])) {
        for arrays in self.arrays.chunk_by(|a, b| a.section == b.section) {
            let section = arrays[0].section;
            let found = self.attributes.iter().find(|(of, _)| *of == section);
            f(&format!("{section:?}"), found.map_or("", |(_, attributes)| attributes), arrays);
        }
    }

    /// The fields as text.
    fn field_data(&self) -> String {
        if self.fields.is_empty() {
            return String::new();
        }
        let mut text = String::new();
        for (name, numbers) in &self.fields {
            let (name, count) = (escaped(name), numbers.len());
            let values: Vec<String> = numbers.iter().map(u32::to_string).collect();
            text += &format!(
                "   <DataArray type=\"Int32\" Name=\"{name}\" NumberOfTuples=\"{count}\" format=\"ascii\">{}</DataArray>\n",
                values.join(" ")
            );
        }
        let text = format!("<FieldData>\n{text}  </FieldData>");
        if self.hides_fields {
            // Two hyphens would end the comment.
            return format!("  <!-- {} -->\n", text.replace("--", "-&#45;"));
        }
        format!("  {text}\n")
    }

    /// The text before the arrays.
    fn head(&self) -> String {
        let mut text = file_tag("UnstructuredGrid") + " <UnstructuredGrid>\n" + &self.field_data();
        text += &format!("  <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n", self.points, self.cells);
        let mut offset = 0;
        self.for_each_section(|section, attributes, arrays| {
            text += &format!("   <{section}{attributes}>\n");
            for array in arrays {
                let attributes = array.attributes();
                text += &format!("    <DataArray {attributes} format=\"appended\" offset=\"{offset}\"/>\n");
                offset += LENGTH + array.bytes();
            }
            text += &format!("   </{section}>\n");
        });
        text + "  </Piece>\n </UnstructuredGrid>\n <AppendedData encoding=\"raw\">\n_"
    }

    /// The length of the file in bytes.
    pub fn bytes(&self) -> u64 {
        let arrays: u64 = self.arrays.iter().map(|array| LENGTH + array.bytes()).sum();
        (self.head().len() + END.len()) as u64 + arrays
    }

    /// Creates the file with everything but the numbers.
    pub fn create(&self, path: &Path) -> Result<PieceFile<'_>, WriteError> {
        let head = self.head();
        let mut file = Output::create(path)?;
        file.write(head.as_bytes())?;
        let mut position = head.len() as u64;
        for array in &self.arrays {
            let mut at = Output::at(path, position)?;
            at.write(&array.bytes().to_ne_bytes())?;
            position += LENGTH + array.bytes();
        }
        Output::at(path, position)?.write(END.as_bytes())?;
        Ok(PieceFile { piece: self, file, head: head.len() as u64, path: path.to_path_buf() })
    }
}

/// A `.vtu` file whose arrays are being written.
pub(super) struct PieceFile<'a> {
    piece: &'a Piece,
    file: Output,
    head: u64,
    path: PathBuf,
}

impl PieceFile<'_> {
    /// Opens the array of this name at its beginning; if both points and cells have one, that of
    /// the points.
    pub fn array(&self, name: &str) -> Result<(Output, Kind), WriteError> {
        self.array_from(name, 0)
    }

    /// Like [`array`](Self::array), but positioned after the first `numbers`.
    pub fn array_from(&self, name: &str, numbers: u64) -> Result<(Output, Kind), WriteError> {
        let place = self.piece.arrays.iter().position(|array| array.name == name);
        self.array_at(place.expect("an array of the piece"), numbers)
    }

    /// Opens the cell array of this name at its beginning, if there is one.
    pub fn cell_array(&self, name: &str) -> Result<Option<(Output, Kind)>, WriteError> {
        let place = self.place_in(Section::CellData, name);
        place.map(|place| self.array_at(place, 0)).transpose()
    }

    /// Opens the array of a field at its beginning.
    pub fn field(&self, section: Section, name: &str) -> Result<Output, WriteError> {
        let place = self.place_in(section, name);
        Ok(self.array_at(place.expect("an array of the piece"), 0)?.0)
    }

    fn place_in(&self, section: Section, name: &str) -> Option<usize> {
        self.piece.arrays.iter().position(|array| array.section == section && array.name == name)
    }

    fn array_at(&self, place: usize, numbers: u64) -> Result<(Output, Kind), WriteError> {
        let arrays = &self.piece.arrays;
        let before: u64 = arrays[..place].iter().map(|array| LENGTH + array.bytes()).sum();
        let kind = arrays[place].kind;
        let offset = self.head + before + LENGTH + numbers * kind.bytes();
        Ok((Output::at(&self.path, offset)?, kind))
    }

    /// Fills an array with one number per cell.
    pub fn fill(&self, name: &str, number: impl Fn(u64) -> u64 + Sync) -> Result<(), WriteError> {
        self.fill_array(self.array(name)?, number)
    }

    /// Fills an opened array with one number per cell.
    pub fn fill_array(
        &self,
        (mut file, kind): (Output, Kind),
        number: impl Fn(u64) -> u64 + Sync,
    ) -> Result<(), WriteError> {
        const PER_CHUNK: u64 = 1 << 16;
        let cells = self.piece.cells as usize;
        let (chunks, per_chunk) = split(cells, cells as u64, PER_CHUNK);
        write_chunks([&mut file], chunks, Work::unwatched(), |chunk, [bytes]| {
            items(chunk, per_chunk, cells).for_each(|cell| kind.push(number(cell as u64), bytes));
            Ok(())
        })
    }

    /// Fills the offsets and types of the cells: `tets` tets, then triangles.
    pub fn fill_cells(&self, tets: u64) -> Result<(), WriteError> {
        let order = self.piece.order;
        let (of_tet, of_triangle) = (order.tet_nodes() as u64, order.triangle_nodes() as u64);
        let end = |count: u64| of_tet * count.min(tets) + of_triangle * count.saturating_sub(tets);
        let [triangle, tet] = vtk_types(order).map(u64::from);
        self.fill("offsets", |cell| end(cell + 1))?;
        self.fill("types", |cell| if cell < tets { tet } else { triangle })
    }

    /// Flushes the file to disk and returns its length.
    pub fn finish(self) -> Result<u64, WriteError> {
        self.file.finish()
    }
}

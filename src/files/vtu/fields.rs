//! Values at the vertices and tets of a part: solutions, coefficients, errors.

use super::arrays::{Piece, PieceFile, Section};
use crate::files::WriteError;
use crate::ground::comm::Communicator;
use crate::ground::error::{ErrorKind, HasKind};
use crate::ground::mesh::stream::MeshStream;
use std::collections::BTreeSet;

/// The entities that a field has values on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum On {
    /// The vertices of the part.
    Points,
    /// The tets of the part.
    Cells,
}

impl On {
    fn section(self) -> Section {
        match self {
            Self::Points => Section::PointData,
            Self::Cells => Section::CellData,
        }
    }

    fn noun(self) -> &'static str {
        match self {
            Self::Points => "vertices",
            Self::Cells => "tets",
        }
    }
}

/// Values on all vertices or all tets of a part, written with the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field<'a> {
    /// The name of the array.
    pub name: &'a str,
    /// Whether the values are on vertices or tets.
    pub on: On,
    /// The values in the order of [`Arrays`](crate::mesh::Arrays): all components of the first
    /// vertex or tet, then those of the second, …
    pub values: &'a [f64],
    /// The number of values for each vertex or tet: 1 for a scalar, 3 for a vector, 9 for a tensor.
    pub components: usize,
}

/// Why fields cannot be written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FieldError {
    /// The number of values does not match the part.
    #[error(
        "the field `{name}` has {values} values, but rank {rank} has {count} {}, which take {}: pass one value \
         for each component of each of them, in the order of the arrays of the part",
        .on.noun(), .count * *.components as u64
    )]
    Length {
        /// The field.
        name: String,
        /// The rank.
        rank: u32,
        /// The number of its values.
        values: usize,
        /// The number of its components.
        components: usize,
        /// Whether it is on vertices or tets.
        on: On,
        /// The number of vertices or tets of the part.
        count: u64,
    },
    /// A field without components.
    #[error("the field `{0}` has no components: a scalar has 1")]
    NoComponents(String),
    /// A name that readers could not find.
    #[error("{0:?} cannot name a field: a name has at least one visible character and no control characters")]
    Name(String),
    /// The name of an array that tetmill writes.
    #[error("a field cannot have the name `{0}`, which tetmill gives to an array of the mesh")]
    Reserved(String),
    /// Two fields on vertices, or two on tets, have the same name.
    #[error("two fields on {} have the name `{name}`", .on.noun())]
    Twice {
        /// The name.
        name: String,
        /// Whether they are on vertices or tets.
        on: On,
    },
    /// The ranks pass different fields.
    #[error(
        "rank {rank} passes other fields than rank 0: names, order, components and places must be the same on all ranks"
    )]
    Differ {
        /// The rank.
        rank: u32,
    },
}

impl HasKind for FieldError {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Input
    }
}

/// The names of tetmill's own arrays, on points or cells.
const RESERVED: [&str; 12] = [
    "Points",
    "connectivity",
    "offsets",
    "types",
    "GlobalNodeId",
    "GlobalElementId",
    "PeriodicId",
    "BodyId",
    "BoundaryId",
    "PartitionId",
    "material",
    "vtkGhostType",
];

/// **Collective.** Refuses fields that do not fit their parts, and different fields on two ranks.
pub(super) fn check(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    fields: &[Field<'_>],
) -> Result<(), WriteError> {
    comm.agree(check_here(part, fields).map_err(WriteError::from))?;
    let described: Vec<_> = fields.iter().map(|field| (field.on, field.name, field.components)).collect();
    let described = format!("{described:?}").into_bytes();
    let mut of_rank_0 = described.clone();
    comm.broadcast_bytes(0, &mut of_rank_0)?;
    let same = described == of_rank_0;
    comm.agree(if same { Ok(()) } else { Err(FieldError::Differ { rank: comm.rank() }.into()) })
}

fn check_here(part: &dyn MeshStream, fields: &[Field<'_>]) -> Result<(), FieldError> {
    let mut seen = BTreeSet::new();
    for &Field { name, on, values, components } in fields {
        if name.trim().is_empty() || name.contains(char::is_control) {
            return Err(FieldError::Name(name.to_owned()));
        }
        if RESERVED.contains(&name) {
            return Err(FieldError::Reserved(name.to_owned()));
        }
        if !seen.insert((on, name)) {
            return Err(FieldError::Twice { name: name.to_owned(), on });
        }
        if components == 0 {
            return Err(FieldError::NoComponents(name.to_owned()));
        }
        let counts = part.counts();
        let count = if on == On::Points { counts.vertices } else { counts.tets };
        if values.len() as u64 != count * components as u64 {
            let (name, rank, values) = (name.to_owned(), part.rank(), values.len());
            return Err(FieldError::Length { name, rank, values, components, on, count });
        }
    }
    Ok(())
}

/// Adds the arrays of the fields on these entities, of which the file has `count`.
pub(super) fn add(piece: &mut Piece, fields: &[Field<'_>], on: On, count: u64) {
    for field in fields.iter().filter(|field| field.on == on) {
        piece.add_field(on.section(), field.name, field.components, count);
    }
}

/// Writes all values.
pub(super) fn write(file: &PieceFile, fields: &[Field<'_>]) -> Result<(), WriteError> {
    for field in fields {
        file.field(field.on.section(), field.name)?.write(bytemuck::cast_slice(field.values))?;
    }
    Ok(())
}

/// Writes the values at some of the vertices, by ascending local index.
pub(super) fn write_at(
    file: &PieceFile,
    fields: &[Field<'_>],
    vertices: impl Iterator<Item = u32> + Clone,
) -> Result<(), WriteError> {
    for field in fields.iter().filter(|field| field.on == On::Points) {
        let mut bytes = Vec::new();
        for vertex in vertices.clone() {
            let start = vertex as usize * field.components;
            bytes.extend_from_slice(bytemuck::cast_slice(&field.values[start..start + field.components]));
        }
        file.field(field.on.section(), field.name)?.write(&bytes)?;
    }
    Ok(())
}

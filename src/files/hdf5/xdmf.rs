//! The index for readers of XDMF: a grid of tets and a grid of triangles, whose arrays are in the
//! HDF5 file.
//!
//! The first attribute of a grid is the one that DOLFINx takes for tags of cells or facets.

use super::tree::{Kind, Placed};
use super::{BODIES, BOUNDARIES, ELEMENT_IDS, NODE_IDS, PARTS, TRIANGLE_PARTS, TRIANGLES, VERTICES, cells};
use crate::ground::mesh::Order;

/// The text of the index; `file` is the name of the HDF5 file.
pub(super) fn text(placed: &Placed, order: Order, file: &str) -> String {
    let index = Index { placed, file: &escaped(file) };
    let [triangle, tet] = match order {
        Order::First => ["Triangle", "Tetrahedron"],
        Order::Second => ["Triangle_6", "Tetrahedron_10"],
    };
    let mesh = index.grid(
        "mesh",
        [tet, cells(order)],
        &[
            ("BodyId", "Cell", BODIES),
            ("PartitionId", "Cell", PARTS),
            ("GlobalElementId", "Cell", ELEMENT_IDS),
            ("GlobalNodeId", "Node", NODE_IDS),
        ],
    );
    let boundary = index.grid(
        "boundary",
        [triangle, TRIANGLES],
        &[("BoundaryId", "Cell", BOUNDARIES), ("PartitionId", "Cell", TRIANGLE_PARTS)],
    );
    format!("<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n<Domain>\n{mesh}{boundary}</Domain>\n</Xdmf>\n")
}

struct Index<'a> {
    placed: &'a Placed,
    file: &'a str,
}

impl Index<'_> {
    /// A grid with its type of cells, the path of these, and the attributes: name, centre, path.
    fn grid(&self, name: &str, [kind, cells]: [&str; 2], attributes: &[(&str, &str, &str)]) -> String {
        let (_, shape) = self.placed.dataset(cells);
        let (count, nodes) = (shape[0], shape[1]);
        let mut text = format!(
            " <Grid Name=\"{name}\" GridType=\"Uniform\">\n  <Topology TopologyType=\"{kind}\" \
             NumberOfElements=\"{count}\" NodesPerElement=\"{nodes}\">{}</Topology>\n  \
             <Geometry GeometryType=\"XYZ\">{}</Geometry>\n",
            self.item(cells, cells),
            self.item(super::POINTS, VERTICES)
        );
        for (name, center, path) in attributes {
            text += &format!(
                "  <Attribute Name=\"{name}\" AttributeType=\"Scalar\" Center=\"{center}\">{}</Attribute>\n",
                self.item(path, path)
            );
        }
        text + " </Grid>\n"
    }

    /// The reference to a dataset, with one of its names.
    fn item(&self, path: &str, name: &str) -> String {
        let (kind, shape) = self.placed.dataset(path);
        let number = if kind == Kind::F64 { "Float" } else { "Int" };
        let shape: Vec<String> = shape.iter().map(u64::to_string).collect();
        format!(
            "<DataItem Format=\"HDF\" NumberType=\"{number}\" Precision=\"{}\" Dimensions=\"{}\">{}:{name}</DataItem>",
            kind.bytes(),
            shape.join(" "),
            self.file
        )
    }
}

/// Escapes text between tags.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

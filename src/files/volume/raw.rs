//! A mesh as stored in a file: vertices from 0, labelled elements; only element kinds are checked.

use crate::Point;
use std::collections::BTreeMap;

/// The label of an element in a file.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub(super) struct Label {
    /// The geometric entity, if the format distinguishes it from the number; else 0.
    pub entity: i64,
    /// The number of the body or boundary; 0 for none.
    pub number: i64,
}

impl Label {
    /// A label of a format with one number.
    pub fn number(number: i64) -> Self {
        Self { entity: 0, number }
    }
}

/// Shapes of elements.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Shape {
    /// A single vertex, which is skipped.
    Point,
    /// Two corners.
    Edge,
    /// Three corners.
    Triangle,
    /// Four corners.
    Tet,
    /// An unsupported shape.
    Other(&'static str),
}

impl Shape {
    /// Its dimension, 0 to 3.
    pub fn dimension(self) -> usize {
        match self {
            Self::Point => 0,
            Self::Edge => 1,
            Self::Triangle => 2,
            Self::Tet | Self::Other(_) => 3,
        }
    }
}

/// Pairs of vertices that a file declares periodic.
#[derive(Clone, Debug, Default)]
pub(super) struct PeriodicPairs {
    /// The number of the identification, if the format has one; else 0.
    pub identification: i64,
    /// The periodic copy, and its master.
    pub pairs: Vec<[u32; 2]>,
}

/// Names of bodies or boundaries by number.
pub(super) type NamesByNumber = BTreeMap<i64, Vec<String>>;

/// The content of a file.
#[derive(Clone, Debug, Default)]
pub(super) struct Raw {
    pub points: Vec<Point>,
    pub tets: Vec<[u32; 4]>,
    pub tet_labels: Vec<Label>,
    /// Numbers of the tets in the file, for messages; empty if they are consecutive from 1.
    pub tet_numbers: Vec<u64>,
    pub triangles: Vec<[u32; 3]>,
    pub triangle_labels: Vec<Label>,
    pub edges: Vec<[u32; 2]>,
    pub edge_labels: Vec<i64>,
    /// Names of bodies by number.
    pub body_names: NamesByNumber,
    /// Names of boundaries by number.
    pub patch_names: NamesByNumber,
    /// Number of higher-order elements.
    pub higher_order: usize,
    /// The order of the nodes on the edges of ten-node tets, as in [`node_order`]; `None` if it is
    /// not known.
    ///
    /// [`node_order`]: crate::files::node_order
    pub edge_order: Option<&'static [usize; 6]>,
    /// The nodes on the edges of ten-node tets, in the order of
    /// [`TET_EDGES`](crate::ground::mesh::TET_EDGES); as many as tets, or some are not of second
    /// order.
    pub edge_nodes: Vec<[u32; 6]>,
    /// Periodic pairs of the file.
    pub periodic: Vec<PeriodicPairs>,
    pub notes: Vec<String>,
}

impl Raw {
    /// Adds an element; its corners come first, then nodes of higher order.
    ///
    /// # Errors
    /// If elements of this shape are not supported; returns the message.
    pub fn add(&mut self, shape: Shape, nodes: &[u32], label: Label) -> Result<(), String> {
        let corners = match (shape, nodes) {
            (Shape::Point, _) => nodes.len(),
            (Shape::Edge, &[a, b, ..]) => {
                self.edges.push([a, b]);
                self.edge_labels.push(if label.entity == 0 { label.number } else { label.entity });
                2
            }
            (Shape::Triangle, &[a, b, c, ..]) => {
                self.triangles.push([a, b, c]);
                self.triangle_labels.push(label);
                3
            }
            (Shape::Tet, &[a, b, c, d, ..]) => {
                self.tets.push([a, b, c, d]);
                self.tet_labels.push(label);
                if let (Some(order), Some(edges)) = (self.edge_order, nodes[4..].first_chunk::<6>())
                    && nodes.len() == 10
                {
                    let mut arranged = [0; 6];
                    order.iter().zip(edges).for_each(|(&edge, &node)| arranged[edge] = node);
                    self.edge_nodes.push(arranged);
                }
                4
            }
            (Shape::Other(name), _) => return Err(refusal(name)),
            _ => return Err(format!("an element with {} vertices", nodes.len())),
        };
        self.higher_order += usize::from(nodes.len() > corners);
        Ok(())
    }

    /// The number of a tet in the file.
    pub fn tet_number(&self, tet: usize) -> u64 {
        self.tet_numbers.get(tet).copied().unwrap_or(tet as u64 + 1)
    }

    /// Adds names that are not there yet.
    pub fn add_names(&mut self, [bodies, patches]: [NamesByNumber; 2]) {
        for (names, more) in [(&mut self.body_names, bodies), (&mut self.patch_names, patches)] {
            for (number, more) in more {
                let names: &mut Vec<String> = names.entry(number).or_default();
                for name in more {
                    if !names.contains(&name) {
                        names.push(name);
                    }
                }
            }
        }
    }
}

/// The message that refuses a mesh with elements of this shape.
pub(super) fn refusal(name: &str) -> String {
    format!("a {name}; only meshes of tetrahedra, with triangles and edges, are read")
}

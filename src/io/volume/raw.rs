//! A mesh as a file has it: vertices from 0, elements with labels, nothing checked but the kinds of elements.

use crate::Point;
use std::collections::BTreeMap;

/// What a file says an element belongs to.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub(super) struct Label {
    /// The geometric entity, where the format tells it from the number; else 0.
    pub entity: i64,
    /// The number of the body or boundary; 0 for none.
    pub number: i64,
}

impl Label {
    /// A label of formats with one number.
    pub fn number(number: i64) -> Self {
        Self { entity: 0, number }
    }
}

/// Shapes of elements.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Shape {
    /// A single vertex: left out.
    Point,
    /// Two corners.
    Edge,
    /// Three corners.
    Triangle,
    /// Four corners.
    Tet,
    /// What is not read.
    Other(&'static str),
}

impl Shape {
    /// 0 to 3.
    pub fn dimension(self) -> usize {
        match self {
            Self::Point => 0,
            Self::Edge => 1,
            Self::Triangle => 2,
            Self::Tet | Self::Other(_) => 3,
        }
    }
}

/// Vertices that a file calls periodic images of others.
#[derive(Clone, Debug, Default)]
pub(super) struct PeriodicPairs {
    /// The number of their identification, if the format has such; else 0.
    pub identification: i64,
    /// The image, and what it is the image of.
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
    pub triangles: Vec<[u32; 3]>,
    pub triangle_labels: Vec<Label>,
    pub edges: Vec<[u32; 2]>,
    pub edge_labels: Vec<i64>,
    /// Names of bodies by number.
    pub body_names: NamesByNumber,
    /// Names of boundaries by number.
    pub patch_names: NamesByNumber,
    /// Elements of higher order, whose corners alone are kept.
    pub higher_order: usize,
    /// What is periodic.
    pub periodic: Vec<PeriodicPairs>,
    pub notes: Vec<String>,
}

impl Raw {
    /// Adds an element: its corners, and behind them what higher orders add.
    ///
    /// # Errors
    /// Why a mesh with such elements is not read.
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
                4
            }
            (Shape::Other(name), _) => return Err(refusal(name)),
            _ => return Err(format!("an element with {} vertices", nodes.len())),
        };
        self.higher_order += usize::from(nodes.len() > corners);
        Ok(())
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

/// Why a mesh with such elements is not read.
pub(super) fn refusal(name: &str) -> String {
    format!("a {name}; only meshes of tetrahedra, with triangles and edges, are read")
}

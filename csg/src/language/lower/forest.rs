//! The solids of a file as one directed acyclic graph.
//!
//! A named solid is shared by all that use it: its surfaces are theirs, and where it is defined again its
//! earlier uses change too. A transform copies everything under it. Walks use a stack of their own, since
//! programs write chains of many thousands of definitions.

use std::collections::HashMap;
use std::ops::Range;
use std::rc::Rc;

use super::swept::Joint;
use crate::geometry::{Span, SurfaceInfo};
use crate::{Solid, Surface, SurfaceId};
use nalgebra::Isometry3;

/// Most surfaces that the primitives of a file may have, copies by transforms included: the nested
/// `multitranslate` of a few short lines could otherwise ask for more than any memory holds. The 10⁴
/// holes of a large perforated plate are well below.
pub(super) const MOST_SURFACES: usize = 1_000_000;
/// Most nodes of the graph, for the same reason.
const MOST_NODES: usize = 4 * MOST_SURFACES;

/// Index of a [`Node`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct NodeId(usize);

/// A set of points, made of others.
#[derive(Debug)]
pub(super) enum Node {
    /// Index of a [`Primitive`].
    Primitive(usize),
    /// Index of a [`Definition`].
    Named(usize),
    Not(NodeId),
    And(Vec<NodeId>),
    Or(Vec<NodeId>),
}

/// A primitive with its place among the surfaces.
#[derive(Clone, Debug)]
pub(super) struct Primitive {
    /// Its surfaces among [`Forest::surfaces`].
    pub surfaces: Range<usize>,
    /// Its inside; surface 0 is its first one.
    pub inside: Rc<Solid>,
    /// Why it cannot be meshed, if so.
    pub unsupported: Option<String>,
    /// For a swept solid the number of segments of its profile.
    pub segments: Option<usize>,
    /// Where a swept solid's path goes on.
    pub joints: Rc<Vec<Joint>>,
    pub span: Span,
}

/// One surface of one primitive, equal ones still apart.
#[derive(Clone, Debug)]
pub(super) struct RawSurface {
    /// `None` for a primitive that cannot be meshed yet.
    pub surface: Option<Surface>,
    pub info: SurfaceInfo,
    /// Which face of the text it belongs to: the halves of a polyhedron's quadrilateral have the same.
    /// [`NO_FACE`](super::swept::NO_FACE) for none.
    pub face: usize,
}

/// A named solid.
#[derive(Debug)]
pub(super) struct Definition {
    pub name: String,
    pub span: Span,
    /// `None` if its definition has an error.
    pub root: Option<NodeId>,
    /// `-maxh`
    pub maxh: Option<f64>,
    /// Whether all its surfaces have a boundary number, and a boundary name.
    pub labelled: [bool; 2],
}

#[derive(Debug, Default)]
pub(super) struct Forest {
    nodes: Vec<Node>,
    pub primitives: Vec<Primitive>,
    pub surfaces: Vec<RawSurface>,
    pub definitions: Vec<Definition>,
}

/// Why there is no order, or no copy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ForestError {
    /// A definition needs itself.
    Cycle,
    /// A definition with an error is used.
    Broken,
    /// More than [`MOST_SURFACES`] surfaces.
    TooLarge,
}

impl Forest {
    pub fn node(&self, id: NodeId) -> &Node {
        &self.nodes[id.0]
    }

    /// Adds a node.
    ///
    /// # Errors
    /// [`ForestError::TooLarge`].
    pub fn add(&mut self, node: Node) -> Result<NodeId, ForestError> {
        if self.nodes.len() >= MOST_NODES || self.surfaces.len() > MOST_SURFACES {
            return Err(ForestError::TooLarge);
        }
        self.nodes.push(node);
        Ok(NodeId(self.nodes.len() - 1))
    }

    /// The members of a node; names count as what they stand for.
    pub fn members(&self, id: NodeId) -> Result<Vec<NodeId>, ForestError> {
        let members: &[NodeId] = match self.node(id) {
            Node::Primitive(_) => &[],
            Node::Named(index) => &[self.definitions[*index].root.ok_or(ForestError::Broken)?],
            Node::Not(member) => &[*member],
            Node::And(members) | Node::Or(members) => members,
        };
        Ok(members.to_vec())
    }

    /// All nodes under `root`, each once, members before what they make up, from left to right.
    pub fn post_order(&self, root: NodeId) -> Result<Vec<NodeId>, ForestError> {
        self.post_order_except(root, |_| false)
    }

    /// The same without what is under the definitions that `skip` names.
    fn post_order_except(
        &self,
        root: NodeId,
        skip: impl Fn(&Definition) -> bool,
    ) -> Result<Vec<NodeId>, ForestError> {
        enum Step {
            Enter(NodeId),
            Leave(NodeId),
        }
        let mut is_open: HashMap<NodeId, bool> = HashMap::new();
        let mut order = Vec::new();
        let mut steps = vec![Step::Enter(root)];
        while let Some(step) = steps.pop() {
            match step {
                Step::Leave(id) => {
                    is_open.insert(id, false);
                    order.push(id);
                }
                Step::Enter(id) if matches!(self.node(id), Node::Named(d) if skip(&self.definitions[*d])) => {
                }
                Step::Enter(id) => match is_open.get(&id) {
                    Some(false) => {}
                    Some(true) => return Err(ForestError::Cycle),
                    None => {
                        is_open.insert(id, true);
                        steps.push(Step::Leave(id));
                        steps.extend(self.members(id)?.into_iter().rev().map(Step::Enter));
                    }
                },
            }
        }
        Ok(order)
    }

    /// The primitives under `root`, each once, from left to right.
    pub fn primitives_of(&self, root: NodeId) -> Result<Vec<usize>, ForestError> {
        Ok(self.primitives_among(&self.post_order(root)?))
    }

    fn primitives_among(&self, nodes: &[NodeId]) -> Vec<usize> {
        let primitive = |id: &NodeId| match self.node(*id) {
            Node::Primitive(index) => Some(*index),
            _ => None,
        };
        nodes.iter().filter_map(primitive).collect()
    }

    /// The surfaces under `root`, each once, from left to right.
    pub fn surfaces_of(&self, root: NodeId) -> Result<Vec<usize>, ForestError> {
        self.surfaces_except(root, |_| false)
    }

    /// The same without those of the definitions that `skip` names.
    pub fn surfaces_except(
        &self,
        root: NodeId,
        skip: impl Fn(&Definition) -> bool,
    ) -> Result<Vec<usize>, ForestError> {
        let primitives = self.primitives_among(&self.post_order_except(root, skip)?);
        Ok(primitives.into_iter().flat_map(|p| self.primitives[p].surfaces.clone()).collect())
    }

    /// Copies what is under `root`, moved. The copies of surfaces belong to `solid` and have no flags.
    pub fn copy(
        &mut self,
        root: NodeId,
        motion: &Isometry3<f64>,
        solid: &str,
    ) -> Result<NodeId, ForestError> {
        let mut copies: HashMap<NodeId, NodeId> = HashMap::new();
        let mut last = root;
        for id in self.post_order(root)? {
            let copy_of = |member: &NodeId| copies[member];
            last = match self.node(id) {
                Node::Primitive(index) => self.copy_primitive(*index, motion, solid)?,
                Node::Named(_) => copy_of(&self.members(id)?[0]),
                Node::Not(member) => self.add(Node::Not(copy_of(member)))?,
                Node::And(members) => self.add(Node::And(members.iter().map(copy_of).collect()))?,
                Node::Or(members) => self.add(Node::Or(members.iter().map(copy_of).collect()))?,
            };
            copies.insert(id, last);
        }
        Ok(last)
    }

    fn copy_primitive(
        &mut self,
        index: usize,
        motion: &Isometry3<f64>,
        solid: &str,
    ) -> Result<NodeId, ForestError> {
        let original = self.primitives[index].clone();
        let first = self.surfaces.len();
        for raw in original.surfaces {
            let RawSurface { surface, info, face } = &self.surfaces[raw];
            let surface = surface.as_ref().map(|surface| surface.transformed(motion));
            let info = SurfaceInfo { solid: solid.to_owned(), span: info.span, ..SurfaceInfo::default() };
            self.surfaces.push(RawSurface { surface, info, face: *face });
        }
        self.primitives.push(Primitive { surfaces: first..self.surfaces.len(), ..original });
        self.add(Node::Primitive(self.primitives.len() - 1))
    }
}

/// The half-space behind the surface at `index` of a primitive.
pub(super) fn inside_of(index: usize) -> Solid {
    Solid::Half { surface: SurfaceId::new(index), positive: false }
}

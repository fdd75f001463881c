//! The solids of a file as a directed acyclic graph.
//!
//! A named solid is shared by all its users: they use the same surfaces, and a redefinition also
//! changes earlier uses. A transform copies the whole subgraph. Traversals use an explicit stack,
//! because generated files may have chains of many thousands of definitions.

use std::collections::HashMap;
use std::ops::Range;
use std::rc::Rc;

use super::swept::Joint;
use crate::geometry::{Span, SurfaceInfo};
use crate::{Solid, Surface, SurfaceId};
use nalgebra::Isometry3;

/// Largest number of surfaces of all primitives in a file, including copies by transforms. A few
/// nested `multitranslate` could otherwise exceed any memory. A large perforated plate has 10⁴
/// holes.
pub(super) const MOST_SURFACES: usize = 1_000_000;
/// Largest number of nodes of the graph, for the same reason.
const MOST_NODES: usize = 4 * MOST_SURFACES;

/// Index of a [`Node`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct NodeId(usize);

/// A Boolean operation, a primitive or a name.
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

/// A primitive and its surfaces.
#[derive(Clone, Debug)]
pub(super) struct Primitive {
    /// Its range in [`Forest::surfaces`].
    pub surfaces: Range<usize>,
    /// Its inside, with surfaces numbered from 0 within the primitive.
    pub inside: Rc<Solid>,
    /// Why it cannot be meshed, if it cannot.
    pub unsupported: Option<String>,
    /// The number of segments of the profile of a swept solid.
    pub segments: Option<usize>,
    /// The smooth joints of the path of an extrusion.
    pub joints: Rc<Vec<Joint>>,
    pub span: Span,
}

/// One surface of one primitive, before equal surfaces are unified.
#[derive(Clone, Debug)]
pub(super) struct RawSurface {
    /// `None` for a primitive that cannot be meshed yet.
    pub surface: Option<Surface>,
    pub info: SurfaceInfo,
    /// The face of the primitive in the text; both halves of a polyhedron's quadrilateral have the
    /// same. [`NO_FACE`](super::swept::NO_FACE) if none.
    pub face: usize,
}

/// A named solid.
#[derive(Debug)]
pub(super) struct Definition {
    pub name: String,
    pub span: Span,
    /// `None` if the definition has an error.
    pub root: Option<NodeId>,
    /// `-maxh`
    pub maxh: Option<f64>,
    /// Whether all its surfaces have a boundary number, and whether all have a boundary name.
    pub labelled: [bool; 2],
}

#[derive(Debug, Default)]
pub(super) struct Forest {
    nodes: Vec<Node>,
    pub primitives: Vec<Primitive>,
    pub surfaces: Vec<RawSurface>,
    pub definitions: Vec<Definition>,
}

/// Why a traversal or a copy failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ForestError {
    /// A definition depends on itself.
    Cycle,
    /// A definition with an error is used.
    Broken,
    /// There are more than [`MOST_SURFACES`] surfaces or [`MOST_NODES`] nodes.
    TooLarge,
}

impl Forest {
    pub fn node(&self, id: NodeId) -> &Node {
        &self.nodes[id.0]
    }

    /// Adds a node.
    ///
    /// # Errors
    /// [`ForestError::TooLarge`] if a limit is reached.
    pub fn add(&mut self, node: Node) -> Result<NodeId, ForestError> {
        if self.nodes.len() >= MOST_NODES || self.surfaces.len() > MOST_SURFACES {
            return Err(ForestError::TooLarge);
        }
        self.nodes.push(node);
        Ok(NodeId(self.nodes.len() - 1))
    }

    /// The members of a node; the member of a name is the root of its definition.
    pub fn members(&self, id: NodeId) -> Result<Vec<NodeId>, ForestError> {
        let members: &[NodeId] = match self.node(id) {
            Node::Primitive(_) => &[],
            Node::Named(index) => &[self.definitions[*index].root.ok_or(ForestError::Broken)?],
            Node::Not(member) => &[*member],
            Node::And(members) | Node::Or(members) => members,
        };
        Ok(members.to_vec())
    }

    /// All nodes below `root`, each once, in post-order from left to right.
    pub fn post_order(&self, root: NodeId) -> Result<Vec<NodeId>, ForestError> {
        self.post_order_except(root, |_| false)
    }

    /// The same as [`post_order`](Self::post_order) without the definitions selected by `skip`.
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

    /// The primitives below `root`, each once, from left to right.
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

    /// The surfaces below `root`, each once, from left to right.
    pub fn surfaces_of(&self, root: NodeId) -> Result<Vec<usize>, ForestError> {
        self.surfaces_except(root, |_| false)
    }

    /// The same as [`surfaces_of`](Self::surfaces_of) without the definitions selected by `skip`.
    pub fn surfaces_except(
        &self,
        root: NodeId,
        skip: impl Fn(&Definition) -> bool,
    ) -> Result<Vec<usize>, ForestError> {
        let primitives = self.primitives_among(&self.post_order_except(root, skip)?);
        Ok(primitives.into_iter().flat_map(|p| self.primitives[p].surfaces.clone()).collect())
    }

    /// Copies the nodes below `root` with a motion. Copied surfaces belong to `solid` and have no
    /// flags.
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

/// The negative half-space of the surface at `index` of a primitive.
pub(super) fn inside_of(index: usize) -> Solid {
    Solid::Half { surface: SurfaceId::new(index), positive: false }
}

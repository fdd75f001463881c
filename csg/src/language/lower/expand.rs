//! Expands the graph of solids to one Boolean tree per body.

use std::collections::{HashMap, HashSet};

use super::forest::{Forest, ForestError, Node, NodeId};
use super::unify::Classes;
use crate::{Solid, SurfaceId};

/// Largest number of half-spaces per body: a graph of a few lines may expand to a tree that exceeds
/// any memory.
const MOST_HALF_SPACES: usize = 1_000_000;
/// Largest depth of a tree, because traversals recurse. A chain of `and` or of `or` of any length
/// counts as one level.
const DEEPEST_TREE: usize = 400;

/// Why a body cannot be expanded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ExpandError {
    /// A node below it has an error, which has been reported.
    Graph(ForestError),
    /// There are more than [`MOST_HALF_SPACES`] half-spaces.
    TooManyHalfSpaces,
    /// The tree is deeper than [`DEEPEST_TREE`].
    TooDeep,
}

impl std::fmt::Display for ExpandError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            ExpandError::Graph(_) => write!(f, "depends on a solid with an error"),
            ExpandError::TooManyHalfSpaces => {
                write!(f, "consists of more than {MOST_HALF_SPACES} half-spaces")
            }
            ExpandError::TooDeep => {
                write!(f, "nests alternating `and`, `or` and `not` more than {DEEPEST_TREE} deep")
            }
        }
    }
}

/// A tree with its size.
#[derive(Clone)]
struct Measured {
    solid: Solid,
    halves: usize,
    depth: usize,
}

/// The Boolean tree of the node `root`.
///
/// # Errors
/// [`ExpandError`] if a node below has an error, or the tree exceeds a limit.
pub(super) fn expand(forest: &Forest, classes: &Classes, root: NodeId) -> Result<Solid, ExpandError> {
    let mut order = forest.post_order(root).map_err(ExpandError::Graph)?;
    order.retain(|&id| !matches!(forest.node(id), Node::Named(_)));
    let mut uses: HashMap<NodeId, usize> = HashMap::new();
    for &id in &order {
        for member in distinct_members(forest, id)? {
            *uses.entry(member).or_default() += 1;
        }
    }
    let absorbed = absorbed(forest, &order, &uses)?;
    let mut trees: HashMap<NodeId, Measured> = HashMap::new();
    let mut halves = 0;
    for id in order.into_iter().filter(|id| !absorbed.contains(id)) {
        let mut members = Vec::new();
        for member in members_of_chain(forest, id, &absorbed)? {
            let left = uses.get_mut(&member).expect("each use was counted");
            *left -= 1;
            let tree = if *left == 0 {
                trees.remove(&member).expect("members come first")
            } else {
                halves += trees[&member].halves;
                trees[&member].clone()
            };
            members.push(tree);
        }
        let tree = match forest.node(id) {
            Node::Primitive(index) => {
                let primitive = &forest.primitives[*index];
                let first = primitive.surfaces.start;
                let half_space = |local: SurfaceId| classes.half_space(first + local.index());
                let measured = measure(relabel(&primitive.inside, &half_space));
                halves += measured.halves;
                measured
            }
            Node::Not(_) => complement(members.swap_remove(0)),
            Node::And(_) => combine(members, true),
            Node::Or(_) => combine(members, false),
            Node::Named(_) => unreachable!("names were left out of the order"),
        };
        if halves > MOST_HALF_SPACES {
            return Err(ExpandError::TooManyHalfSpaces);
        }
        if tree.depth > DEEPEST_TREE {
            return Err(ExpandError::TooDeep);
        }
        trees.insert(id, tree);
    }
    let root = resolved(forest, root)?;
    Ok(trees.remove(&root).expect("the root comes last").solid)
}

/// The nodes whose only user is of the same kind, so that their members become members of the user.
///
/// This makes a chain of thousands of unions, each of the previous one and another solid, take
/// linear time.
fn absorbed(
    forest: &Forest,
    order: &[NodeId],
    uses: &HashMap<NodeId, usize>,
) -> Result<HashSet<NodeId>, ExpandError> {
    let mut absorbed = HashSet::new();
    for &id in order {
        for member in distinct_members(forest, id)? {
            let same_kind = matches!(
                (forest.node(id), forest.node(member)),
                (Node::And(_), Node::And(_)) | (Node::Or(_), Node::Or(_))
            );
            if same_kind && uses[&member] == 1 {
                absorbed.insert(member);
            }
        }
    }
    Ok(absorbed)
}

/// The members of a node and of all nodes absorbed into it, from left to right.
fn members_of_chain(
    forest: &Forest,
    id: NodeId,
    absorbed: &HashSet<NodeId>,
) -> Result<Vec<NodeId>, ExpandError> {
    let mut members = Vec::new();
    let mut open = distinct_members(forest, id)?;
    open.reverse();
    while let Some(member) = open.pop() {
        if absorbed.contains(&member) {
            open.extend(distinct_members(forest, member)?.into_iter().rev());
        } else {
            members.push(member);
        }
    }
    Ok(members)
}

/// The node that a name refers to.
fn resolved(forest: &Forest, mut id: NodeId) -> Result<NodeId, ExpandError> {
    while let Node::Named(_) = forest.node(id) {
        id = forest.members(id).map_err(ExpandError::Graph)?[0];
    }
    Ok(id)
}

/// The members of a node, with names resolved and duplicates removed.
fn distinct_members(forest: &Forest, id: NodeId) -> Result<Vec<NodeId>, ExpandError> {
    let mut distinct = Vec::new();
    let mut seen = HashSet::new();
    for member in forest.members(id).map_err(ExpandError::Graph)? {
        let member = resolved(forest, member)?;
        if seen.insert(member) {
            distinct.push(member);
        }
    }
    Ok(distinct)
}

fn measure(solid: Solid) -> Measured {
    fn of(solid: &Solid) -> (usize, usize) {
        match solid {
            Solid::Half { .. } => (1, 1),
            Solid::Not(member) => {
                let (halves, depth) = of(member);
                (halves, depth + 1)
            }
            Solid::And(members) | Solid::Or(members) => {
                let each = members.iter().map(of);
                each.fold((0, 1), |(sum, deep), (halves, depth)| (sum + halves, deep.max(depth + 1)))
            }
        }
    }
    let (halves, depth) = of(&solid);
    Measured { solid, halves, depth }
}

/// The tree over other half-spaces; `half_space` maps a surface to the half-space on its negative
/// side.
fn relabel(solid: &Solid, half_space: &impl Fn(SurfaceId) -> (SurfaceId, bool)) -> Solid {
    let all = |members: &[Solid]| members.iter().map(|member| relabel(member, half_space)).collect();
    match solid {
        Solid::Half { surface, positive } => {
            let (surface, flipped) = half_space(*surface);
            Solid::Half { surface, positive: *positive != flipped }
        }
        Solid::And(members) => Solid::And(all(members)),
        Solid::Or(members) => Solid::Or(all(members)),
        Solid::Not(member) => Solid::Not(Box::new(relabel(member, half_space))),
    }
}

fn complement(Measured { solid, halves, depth }: Measured) -> Measured {
    match solid {
        Solid::Half { surface, positive } => {
            Measured { solid: Solid::Half { surface, positive: !positive }, halves, depth }
        }
        Solid::Not(member) => Measured { solid: *member, halves, depth: depth - 1 },
        other => Measured { solid: Solid::Not(Box::new(other)), halves, depth: depth + 1 },
    }
}

/// The intersection or union of trees. Nested nodes of the same kind are flattened, repeated
/// half-spaces removed.
fn combine(members: Vec<Measured>, is_and: bool) -> Measured {
    let mut flat = Vec::new();
    let mut seen = HashSet::new();
    let mut depth = 1;
    let mut halves = 0;
    let mut take = |solid: Solid, flat: &mut Vec<Solid>| match solid {
        Solid::Half { surface, positive } if !seen.insert((surface, positive)) => {}
        other => flat.push(other),
    };
    for member in members {
        halves += member.halves;
        match (member.solid, is_and) {
            (Solid::And(inner), true) | (Solid::Or(inner), false) => {
                depth = depth.max(member.depth);
                inner.into_iter().for_each(|solid| take(solid, &mut flat));
            }
            (solid, _) => {
                depth = depth.max(member.depth + 1);
                take(solid, &mut flat);
            }
        }
    }
    if flat.len() == 1 {
        return measure(flat.swap_remove(0));
    }
    let solid = if is_and { Solid::And(flat) } else { Solid::Or(flat) };
    Measured { solid, halves, depth }
}

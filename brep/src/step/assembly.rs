//! Which solids a file has, and where: products, their representations, and assemblies of them.
//!
//! Source: ISO 10303-203 and the recommended practices of the CAx Implementor Forum. A product is
//! placed in another one by a NEXT_ASSEMBLY_USAGE_OCCURRENCE, whose CONTEXT_DEPENDENT_SHAPE_
//! REPRESENTATION has the transformation, or by a MAPPED_ITEM of its representation. A product
//! without solids may have a document, the name of the file that holds it.

use super::geometry::placement;
use super::record::{Node, given, nodes};
use super::text::Records;
use super::units::Units;
use crate::{BrepError, Placement};
use nalgebra::Matrix3;
use std::collections::{BTreeMap, BTreeSet};

/// A solid, or a shell of a surface model, at a place.
pub(super) struct PlacedSolid<'a> {
    pub solid: Node<'a>,
    /// From the coordinates of its records to those of the result.
    pub placement: Placement,
    pub units: Units,
    /// Its own name or that of its product, if either has one.
    pub name: Option<String>,
}

impl PlacedSolid<'_> {
    /// The solid with the whole at a place.
    pub fn placed(&self, place: &Placement) -> Self {
        Self { placement: place.after(&self.placement), name: self.name.clone(), ..*self }
    }
}

/// A product in another file at a place.
pub(super) struct PlacedFile {
    pub name: String,
    /// From the coordinates of the file's product, in the unit of the result.
    pub placement: Placement,
}

/// What a file holds, in the order of its products.
pub(super) struct Contents<'a> {
    pub solids: Vec<PlacedSolid<'a>>,
    /// Shells and sets of faces of surface models.
    pub shells: Vec<PlacedSolid<'a>>,
    pub files: Vec<PlacedFile>,
    /// Metres of the unit of the result, if any shape has one.
    pub unit: Option<f64>,
}

/// Types of solids.
pub(super) const SOLIDS: [&str; 4] =
    ["MANIFOLD_SOLID_BREP", "BREP_WITH_VOIDS", "FACETED_BREP", "FACETED_BREP_AND_BREP_WITH_VOIDS"];

/// Types of surface models, which have shells or sets of faces.
const SURFACES: [&str; 2] = ["SHELL_BASED_SURFACE_MODEL", "FACE_BASED_SURFACE_MODEL"];

/// Assemblies may be nested this deep.
pub(super) const DEEPEST: usize = 64;
/// The most uses of products and representations: a small file can use one exponentially often.
pub(super) const MOST_USES: usize = 200_000;

/// An item of a representation or an occurrence of a product.
struct Occurrence {
    /// The product definition that is placed.
    child: u64,
    placement: Option<Placement>,
}

/// The structure of products.
struct Structure<'a> {
    /// Representations of each product definition.
    shapes: BTreeMap<u64, Vec<Node<'a>>>,
    /// Representations that share the coordinates of another one.
    same: BTreeMap<u64, Vec<Node<'a>>>,
    children: BTreeMap<u64, Vec<Occurrence>>,
    names: BTreeMap<u64, String>,
    /// The file that holds a product definition or has the shape for a representation.
    documents: BTreeMap<u64, String>,
    out: Contents<'a>,
    /// The solids that were found.
    found: BTreeSet<u64>,
    uses: usize,
}

/// What a file holds. The unit of the result (metres) is that of the first shape, if none is given.
pub(super) fn contents<'a>(records: &'a Records<'a>, unit: Option<f64>) -> Result<Contents<'a>, BrepError> {
    let mut structure = Structure::read(records)?;
    structure.out.unit = unit;
    let placed: BTreeSet<u64> = structure.children.values().flatten().map(|o| o.child).collect();
    // An assembly need not have a shape of its own.
    let products: BTreeSet<u64> = structure.shapes.keys().chain(structure.children.keys()).copied().collect();
    let roots: Vec<u64> = products.difference(&placed).copied().collect();
    for root in roots {
        structure.add_product(root, &Placement::IDENTITY, DEEPEST)?;
    }
    // Representations of no product.
    for node in nodes(records).filter(is_shape) {
        let is_new = |item: &Node| is_body(*item) && !structure.found.contains(&item.id);
        if items(node)?.iter().any(is_new) {
            structure.add_shape(node, &Placement::IDENTITY, None, DEEPEST)?;
        }
    }
    Ok(structure.out)
}

fn is_solid(node: Node) -> bool {
    node.any(&SOLIDS).is_some()
}

/// Whether a record is a solid or a surface model.
fn is_body(node: Node) -> bool {
    is_solid(node) || node.any(&SURFACES).is_some()
}

/// Whether a record is a representation of shapes.
fn is_shape(node: &Node) -> bool {
    let names = [
        "SHAPE_REPRESENTATION",
        "ADVANCED_BREP_SHAPE_REPRESENTATION",
        "FACETED_BREP_SHAPE_REPRESENTATION",
        "MANIFOLD_SURFACE_SHAPE_REPRESENTATION",
        "REPRESENTATION",
    ];
    node.any(&names).is_some()
}

/// The label, the items and the context of a representation; a complex record has them in the part
/// REPRESENTATION.
fn items(node: Node) -> Result<Vec<Node>, BrepError> {
    representation(node).map_or(Ok(Vec::new()), |fields| fields.refers_all(1))
}

fn representation(node: Node) -> Option<super::record::Fields> {
    node.get("REPRESENTATION").or_else(|| node.get(&node.kind()))
}

impl<'a> Structure<'a> {
    fn read(records: &'a Records<'a>) -> Result<Self, BrepError> {
        let mut structure = Self {
            shapes: BTreeMap::new(),
            same: BTreeMap::new(),
            children: BTreeMap::new(),
            names: BTreeMap::new(),
            documents: documents(records),
            out: Contents { solids: Vec::new(), shells: Vec::new(), files: Vec::new(), unit: None },
            found: BTreeSet::new(),
            uses: 0,
        };
        for node in nodes(records) {
            if let Some(fields) = node.get("SHAPE_DEFINITION_REPRESENTATION") {
                let shape = fields.refers(0)?;
                // Other definitions are those of parts of a shape.
                if let Some(definition) = shape.get("PRODUCT_DEFINITION_SHAPE") {
                    let product = definition.refers(2)?;
                    if product.is("PRODUCT_DEFINITION") {
                        structure.shapes.entry(product.id).or_default().push(fields.refers(1)?);
                        structure.names.extend(name_of(product).map(|name| (product.id, name)));
                    }
                }
            } else if let Some(fields) = node.get("SHAPE_REPRESENTATION_RELATIONSHIP")
                && !node.is("REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION")
                && node.kind() == "SHAPE_REPRESENTATION_RELATIONSHIP"
            {
                let [one, other] = [fields.refers(2)?, fields.refers(3)?];
                structure.same.entry(one.id).or_default().push(other);
                structure.same.entry(other.id).or_default().push(one);
            }
        }
        structure.read_occurrences(records)?;
        Ok(structure)
    }

    /// Reads where products are placed in others.
    fn read_occurrences(&mut self, records: &'a Records<'a>) -> Result<(), BrepError> {
        // Transformations by the occurrence that they place.
        let mut placements = BTreeMap::new();
        for node in nodes(records) {
            let Some(fields) = node.get("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION") else { continue };
            let occurrence = fields.refers(1)?.fields("PRODUCT_DEFINITION_SHAPE")?.refers(2)?;
            placements.insert(occurrence.id, fields.refers(0)?);
        }
        for node in nodes(records) {
            let Some(fields) = node.get("NEXT_ASSEMBLY_USAGE_OCCURRENCE") else { continue };
            let (parent, child) = (fields.refers(3)?, fields.refers(4)?);
            let placement = match placements.get(&node.id) {
                Some(relation) => Some(self.placement(*relation, child.id)?),
                None => None,
            };
            self.children.entry(parent.id).or_default().push(Occurrence { child: child.id, placement });
        }
        Ok(())
    }

    /// The placement of a child in its parent. The transformation is from the first representation
    /// to the second; the child should be the first, but some programs exchange them.
    fn placement(&self, relation: Node<'a>, child: u64) -> Result<Placement, BrepError> {
        let ends = relation.fields("REPRESENTATION_RELATIONSHIP")?;
        let transformation = relation.fields("REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION")?.refers(0)?;
        if !transformation.is("ITEM_DEFINED_TRANSFORMATION") {
            return placement(transformation);
        }
        let fields = transformation.fields("ITEM_DEFINED_TRANSFORMATION")?;
        let [from, to] = [placement(fields.refers(2)?)?, placement(fields.refers(3)?)?];
        let own = self.shapes.get(&child);
        let is_of_child = |end: usize| {
            ends.refers(end).is_ok_and(|e| own.is_some_and(|own| own.iter().any(|s| s.id == e.id)))
        };
        let is_exchanged = !is_of_child(2) && is_of_child(3);
        let [from, to] = if is_exchanged { [to, from] } else { [from, to] };
        let inverse = from.inverse().ok_or_else(|| transformation.error("it is singular"))?;
        Ok(to.after(&inverse))
    }

    fn add_product(&mut self, product: u64, at: &Placement, depth: usize) -> Result<(), BrepError> {
        let name = self.names.get(&product).cloned();
        let shapes = self.shapes.get(&product).cloned().unwrap_or_default();
        let mut ids = std::iter::once(product).chain(shapes.iter().map(|shape| shape.id));
        let file = ids.find_map(|id| self.documents.get(&id)).cloned();
        let before = self.out.solids.len();
        for shape in shapes {
            self.add_shape(shape, at, name.as_deref(), depth)?;
        }
        let is_leaf = !self.children.contains_key(&product);
        if let Some(name) = file.filter(|name| is_step(name) || is_leaf)
            && self.out.solids.len() == before
        {
            self.out.files.push(PlacedFile { name, placement: *at });
        }
        for k in 0..self.children.get(&product).map_or(0, Vec::len) {
            let Occurrence { child, placement } = &self.children[&product][k];
            let (child, inner) = (*child, placement.unwrap_or(Placement::IDENTITY));
            // The transformation is in the unit of the parent, the placement in that of the result.
            self.count(depth)?;
            let scaled = self.scaled_shift([product, child], &inner)?;
            self.add_product(child, &at.after(&scaled), depth - 1)?;
        }
        Ok(())
    }

    /// Counts a use.
    ///
    /// # Errors
    /// If uses are nested too deep, or there are too many.
    fn count(&mut self, depth: usize) -> Result<(), BrepError> {
        self.uses += 1;
        if depth > 0 && self.uses <= MOST_USES { Ok(()) } else { Err(too_many()) }
    }

    /// A placement of a child in its parent as one in the unit of the result. Their unit is that of
    /// the first of both that has a shape.
    fn scaled_shift(&mut self, products: [u64; 2], inner: &Placement) -> Result<Placement, BrepError> {
        let shape = products.iter().find_map(|product| self.shapes.get(product)?.first()).copied();
        let Some(shape) = shape else {
            return Ok(*inner);
        };
        let scale = self.scale(&units(shape)?);
        Ok(Placement { linear: inner.linear, shift: inner.shift * scale })
    }

    /// The unit of a file as a multiple of that of the result, which is the first one if none was
    /// chosen.
    fn scale(&mut self, units: &Units) -> f64 {
        units.length / *self.out.unit.get_or_insert(units.length)
    }

    /// Adds the solids of a representation and of those with the same coordinates.
    fn add_shape(
        &mut self,
        shape: Node<'a>,
        at: &Placement,
        name: Option<&str>,
        depth: usize,
    ) -> Result<(), BrepError> {
        let mut seen = BTreeSet::new();
        let mut stack = vec![shape];
        while let Some(shape) = stack.pop() {
            if !seen.insert(shape.id) {
                continue;
            }
            stack.extend(self.same.get(&shape.id).into_iter().flatten().copied());
            let units = units(shape)?;
            let scale = self.scale(&units);
            let bodies: Vec<Node> = items(shape)?.into_iter().filter(|item| is_body(*item)).collect();
            let is_alone = bodies.iter().filter(|body| is_solid(**body)).count() == 1;
            for body in bodies {
                self.count(depth)?;
                self.found.insert(body.id);
                let product = name.filter(|_| is_alone || body.label().is_none());
                let name = body.label().or_else(|| product.map(str::to_owned));
                let linear = Matrix3::identity() * scale;
                let placement = at.after(&Placement { linear, shift: [0.0; 3].into() });
                let placed = PlacedSolid { solid: body, placement, units, name };
                if let Some(fields) = body.any(&SURFACES) {
                    let shells = fields.refers_all(1)?.into_iter();
                    let placed =
                        shells.map(|solid| PlacedSolid { solid, name: placed.name.clone(), ..placed });
                    self.out.shells.extend(placed);
                } else {
                    self.out.solids.push(placed);
                }
            }
            for mapped in items(shape)?.into_iter().filter_map(|item| item.get("MAPPED_ITEM")) {
                self.count(depth)?;
                let map = mapped.refers(1)?.fields("REPRESENTATION_MAP")?;
                let [from, to] = [placement(map.refers(0)?)?, placement(mapped.refers(2)?)?];
                let inverse = from.inverse().ok_or_else(|| map.node().error("it is singular"))?;
                let inner = to.after(&inverse);
                let scaled = Placement { linear: inner.linear, shift: inner.shift * scale };
                self.add_shape(map.refers(1)?, &at.after(&scaled), name, depth - 1)?;
            }
        }
        Ok(())
    }
}

/// The error for assemblies that are nested too deep or repeat too much.
pub(super) fn too_many() -> BrepError {
    let what = format!(
        "parts of assemblies are nested more than {DEEPEST} deep, or used more than {MOST_USES} times"
    );
    BrepError::Syntax { line: 1, what }
}

/// The files that hold product definitions or representations (CAx Implementor Forum, recommended
/// practices for external references): a document with the name of a file is assigned to the
/// definition, or is a property of the representation, or both.
fn documents(records: &Records) -> BTreeMap<u64, String> {
    let mut files = BTreeMap::new();
    for node in nodes(records) {
        if let Some(fields) = node.get("APPLIED_DOCUMENT_REFERENCE")
            && let Some(name) = fields.refers(0).ok().and_then(file_of)
        {
            let definitions = fields.refers_all(2).unwrap_or_default();
            files.extend(definitions.into_iter().map(|definition| (definition.id, name.clone())));
        } else if let Some(fields) = node.get("PROPERTY_DEFINITION_REPRESENTATION")
            && let Ok([property, shape]) = fields.refers(0).and_then(|p| Ok([p, fields.refers(1)?]))
            && let Some(definition) = property.get("PROPERTY_DEFINITION")
            && definition.text(0).is_some_and(|kind| kind == "external definition")
            && let Some(name) = definition.refers(2).ok().and_then(file_of)
        {
            files.insert(shape.id, name);
        }
    }
    files
}

/// Whether a file is a STEP file by its name. Others may be drawings, or parts in the format of the
/// program.
pub(super) fn is_step(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    [".stp", ".step", ".p21"].iter().any(|ending| name.ends_with(ending))
}

/// The name of the file that a document is.
fn file_of(document: Node) -> Option<String> {
    let name = document.get("DOCUMENT_FILE")?.text(0)?;
    name.contains('.').then_some(name)
}

/// The units of a representation.
fn units(shape: Node) -> Result<Units, BrepError> {
    match representation(shape) {
        Some(fields) => Units::of(fields.refers(2)?),
        None => Err(shape.error("it has no context")),
    }
}

/// The name of the product of a definition.
fn name_of(definition: Node) -> Option<String> {
    let formation = definition.get("PRODUCT_DEFINITION")?.refers(2).ok()?;
    let fields = formation
        .any(&["PRODUCT_DEFINITION_FORMATION", "PRODUCT_DEFINITION_FORMATION_WITH_SPECIFIED_SOURCE"])?;
    let product = fields.refers(2).ok()?.get("PRODUCT")?;
    product.text(1).and_then(given).or_else(|| product.text(0).and_then(given))
}

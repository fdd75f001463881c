//! Describes a geometry's entities, as text and as JSON.

use crate::files::input::counted;
use crate::ground::mesh::Label;
use crate::mesher::model::CsgModel;
use crate::pipeline::FacetSolid;
use csg::{BodyId, Curve, CurveId, Features, PatchId, Singular};
use serde::Serialize;
use std::fmt;

/// A geometry's bodies, patches, curves and corners.
#[derive(Clone, Debug, Serialize)]
pub struct Inspection {
    /// The lower and upper corner of the bounding box.
    pub bounds: [[f64; 3]; 2],
    /// The bodies.
    pub bodies: Vec<BodyLine>,
    /// The patches.
    pub patches: Vec<PatchLine>,
    /// The curves.
    pub curves: Vec<CurveLine>,
    /// The corners.
    pub corners: Vec<[f64; 3]>,
    /// Patches that are periodic copies of others.
    pub periodic: Vec<PeriodicLine>,
    /// Patches, curves and corners tagged as singular in the file.
    pub singular: Vec<SingularLine>,
}

/// A patch that is the periodic copy of another.
#[derive(Clone, Debug, Serialize)]
pub struct PeriodicLine {
    /// The number of the identification, from 1.
    pub identification: usize,
    /// The boundary numbers of the patch (master) and its copy.
    pub boundaries: [u32; 2],
    /// The motion to the copy as a matrix by rows: rotation and, in the last column, translation.
    pub motion: [[f64; 4]; 3],
}

/// A singular entity.
#[derive(Clone, Debug, Serialize)]
pub struct SingularLine {
    /// `patch` (with its boundary number), `curve` or `corner` (with its index).
    pub kind: &'static str,
    /// The number or index.
    pub number: usize,
    /// Its singularity factor.
    pub factor: i32,
}

/// A body.
#[derive(Clone, Debug, Serialize)]
pub struct BodyLine {
    /// Its number in the mesh files.
    pub number: u32,
    /// Its name: the material, else the solid.
    pub name: String,
    /// Its largest element size, if the file sets one.
    pub maxh: Option<f64>,
    /// The line of the file that makes it a body; null for surfaces.
    pub line: Option<u32>,
}

/// A patch.
#[derive(Clone, Debug, Serialize)]
pub struct PatchLine {
    /// Its boundary number.
    pub boundary: u32,
    /// Its boundary name; null if it has none.
    pub name: Option<String>,
    /// The kind of its surface.
    pub surface: &'static str,
    /// The solid of the file that defines its surface; null for surfaces.
    pub solid: Option<String>,
    /// The line of that definition in the file.
    pub line: Option<u32>,
    /// The numbers of the bodies behind and in front of it; 0 is the exterior.
    pub bodies: [u32; 2],
    /// The curves of its boundary, by index.
    pub curves: Vec<usize>,
    /// Its largest element size, if the file sets one.
    pub maxh: Option<f64>,
    /// The solid that cuts it out, if it is a top-level object of its own.
    pub cutout: Option<String>,
}

/// A curve.
#[derive(Clone, Debug, Serialize)]
pub struct CurveLine {
    /// Its length.
    pub length: f64,
    /// The indices of the corners at its ends; null if it is closed.
    pub corners: Option<[usize; 2]>,
    /// The boundary numbers of the patches beside it.
    pub boundaries: Vec<u32>,
}

impl Inspection {
    /// Describes a CSG geometry.
    pub fn of_csg(model: &CsgModel) -> Self {
        let CsgModel { geometry, features, projector, .. } = model;
        let number = |body: Option<BodyId>| body.map_or(0, |b| geometry.bodies[b.index()].number);
        let patch = |patch: &csg::Patch| {
            let info = &geometry.surface_info[patch.surface.index()];
            let cutout = patch.cutout.map(|i| &geometry.cutouts[i as usize]);
            PatchLine {
                boundary: patch.bc,
                name: patch.name.clone(),
                surface: geometry.surfaces[patch.surface.index()].kind(),
                solid: Some(info.solid.clone()),
                line: Some(info.span.line),
                bodies: [number(patch.inside), number(patch.outside)],
                curves: patch.boundary.iter().map(|(curve, _)| curve.index()).collect(),
                maxh: cutout.and_then(|cutout| cutout.maxh).or(info.maxh),
                cutout: cutout.map(|cutout| cutout.name.clone()),
            }
        };
        let boundary = |id: PatchId| features.patch(id).bc;
        let curve = |(index, curve): (usize, &Curve)| CurveLine {
            length: projector.curve_length(CurveId::new(index), &curve.trace),
            corners: curve.ends.map(|ends| ends.map(|c| c.index())),
            boundaries: curve.fins.iter().map(|fin| boundary(fin.patch)).collect(),
        };
        let body = |body: &csg::Body| BodyLine {
            number: body.number,
            name: body.material.clone().unwrap_or_else(|| body.name.clone()),
            maxh: body.maxh,
            line: Some(body.span.line),
        };
        Self {
            bounds: [features.bounds.min.into(), features.bounds.max.into()],
            bodies: geometry.bodies.iter().map(body).collect(),
            patches: features.patches.iter().map(patch).collect(),
            curves: features.curves.iter().enumerate().map(curve).collect(),
            corners: features.corners.iter().map(|c| c.point.into()).collect(),
            periodic: periodic_lines(features),
            singular: singular_lines(model),
        }
    }

    /// Describes triangulated solids.
    pub fn of_facets(FacetSolid { model, names, exact, .. }: &FacetSolid) -> Self {
        let beside = model.patches_of_curves();
        let number = |body: Option<BodyId>| body.map_or(0, |b| names.bodies[b.index()].number);
        let patch = |(index, patch): (usize, &crate::mesher::facets::FacetPatch)| {
            let id = PatchId::new(index);
            PatchLine {
                boundary: names.patches[index].number,
                name: names.patches[index].name().map(str::to_owned),
                surface: match exact {
                    Some(exact) => exact.kind(id),
                    None if model.projector.is_flat_patch(id) => "plane",
                    None => "facets",
                },
                solid: None,
                line: None,
                bodies: [number(patch.inside), number(patch.outside)],
                curves: (0..beside.len()).filter(|&curve| beside[curve].contains(&id)).collect(),
                maxh: None,
                cutout: None,
            }
        };
        let point = |v: u32| model.points[v as usize];
        let curve = |(index, curve): (usize, &crate::mesher::facets::FacetCurve)| CurveLine {
            length: curve.vertices.windows(2).map(|w| (point(w[1]) - point(w[0])).norm()).sum(),
            corners: curve.ends.map(|ends| ends.map(|c| c.index())),
            boundaries: beside[index].iter().map(|patch| names.patches[patch.index()].number).collect(),
        };
        let body = |label: &Label| BodyLine {
            number: label.number,
            name: label.name().unwrap_or_default().to_owned(),
            maxh: None,
            line: None,
        };
        Self {
            bounds: [model.bounds.min.into(), model.bounds.max.into()],
            bodies: names.bodies.iter().map(body).collect(),
            patches: model.patches.iter().enumerate().map(patch).collect(),
            curves: model.curves.iter().enumerate().map(curve).collect(),
            corners: model.corners.iter().map(|&v| point(v).into()).collect(),
            periodic: Vec::new(),
            singular: Vec::new(),
        }
    }
}

fn periodic_lines(features: &Features) -> Vec<PeriodicLine> {
    let lines = (1..).zip(&features.identified).flat_map(|(identification, identified)| {
        let matrix = identified.motion.to_homogeneous();
        let motion = [0, 1, 2].map(|i| [0, 1, 2, 3].map(|j| matrix[(i, j)]));
        identified.patches.iter().map(move |patches| {
            let boundaries = patches.map(|id| features.patch(id).bc);
            PeriodicLine { identification, boundaries, motion }
        })
    });
    lines.collect()
}

fn singular_lines(CsgModel { geometry, features, .. }: &CsgModel) -> Vec<SingularLine> {
    let Singular { patches, curves, corners } = features.singular(geometry);
    let line = |kind, number, factor| SingularLine { kind, number, factor };
    let patches =
        patches.into_iter().map(|(id, factor)| line("patch", features.patch(id).bc as usize, factor));
    let curves = curves.into_iter().map(|(id, factor)| line("curve", id.index(), factor));
    let corners = corners.into_iter().map(|(id, factor)| line("corner", id.index(), factor));
    patches.chain(curves).chain(corners).collect()
}

/// A number rounded to nine digits.
fn nine_digits(number: f64) -> f64 {
    format!("{number:.8e}").parse().unwrap_or(number)
}

impl fmt::Display for Inspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [min, max] = self.bounds;
        writeln!(f, "box {min:?} to {max:?}")?;
        writeln!(f, "\n{}", counted(self.bodies.len(), "body"))?;
        for body in &self.bodies {
            let maxh = body.maxh.map_or(String::new(), |h| format!("  maxh {h}"));
            let line = body.line.map_or(String::new(), |line| format!(" line {line}"));
            writeln!(f, "  {:>4}  {:20}{line}{maxh}", body.number, body.name)?;
        }
        writeln!(
            f,
            "\n{} (boundary number, name, surface, bodies behind and in front, curves)",
            counted(self.patches.len(), "patch")
        )?;
        for patch in &self.patches {
            let [behind, front] = patch.bodies;
            let surface = match (&patch.solid, patch.line) {
                (Some(solid), Some(line)) => format!("{} of {solid} (line {line})", patch.surface),
                _ => patch.surface.to_owned(),
            };
            let maxh = patch.maxh.map_or(String::new(), |h| format!("  maxh {h}"));
            let cutout = patch.cutout.as_ref().map_or(String::new(), |solid| format!("  cut out by {solid}"));
            writeln!(
                f,
                "  {:>4}  {:16} {surface:36} {behind} | {front}  {}{maxh}{cutout}",
                patch.boundary,
                patch.name.as_deref().unwrap_or("-"),
                counted(patch.curves.len(), "curve")
            )?;
        }
        let curves = counted(self.curves.len(), "curve");
        writeln!(f, "\n{curves} (length, corners, boundary numbers beside)")?;
        for (i, curve) in self.curves.iter().enumerate() {
            let ends = curve.corners.map_or("closed".into(), |[a, b]| format!("{a} to {b}"));
            writeln!(f, "  {i:>4}  {:<12?} {ends:12} {:?}", nine_digits(curve.length), curve.boundaries)?;
        }
        writeln!(f, "\n{}", counted(self.corners.len(), "corner"))?;
        for (i, [x, y, z]) in self.corners.iter().enumerate() {
            writeln!(f, "  {i:>4}  ({x}, {y}, {z})")?;
        }
        if !self.periodic.is_empty() {
            writeln!(
                f,
                "\n{} (identification, boundary numbers, motion)",
                counted(self.periodic.len(), "periodic patch")
            )?;
        }
        for line in &self.periodic {
            let [of, image] = line.boundaries;
            let [x, y, z] = line.motion.map(|row| row[3]);
            let turns = [0, 1, 2].iter().any(|&i| line.motion[i][i] != 1.0);
            let turned = if turns { "turned, then " } else { "" };
            writeln!(f, "  {:>4}  {of} to {image}, {turned}moved by ({x}, {y}, {z})", line.identification)?;
        }
        if !self.singular.is_empty() {
            let entities = counted(self.singular.len(), "singular entity");
            writeln!(f, "\n{entities} (patch, curve or corner, factor)")?;
        }
        for SingularLine { kind, number, factor } in &self.singular {
            writeln!(f, "  {kind} {number}, factor {factor}")?;
        }
        Ok(())
    }
}

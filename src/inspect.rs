//! What a geometry consists of, for people and as JSON.

use crate::pipeline::CsgModel;
use csg::{BodyId, Curve, PatchId};
use serde::Serialize;
use std::fmt;

/// A geometry's bodies, patches, curves and corners.
#[derive(Clone, Debug, Serialize)]
pub struct Inspection {
    /// The least and the largest corner of the box around the bodies.
    pub bounds: [[f64; 3]; 2],
    /// The bodies.
    pub bodies: Vec<BodyLine>,
    /// The patches.
    pub patches: Vec<PatchLine>,
    /// The curves.
    pub curves: Vec<CurveLine>,
    /// The corners.
    pub corners: Vec<[f64; 3]>,
}

/// A body.
#[derive(Clone, Debug, Serialize)]
pub struct BodyLine {
    /// Its number in the mesh files.
    pub number: u32,
    /// Its name: the material, else the solid.
    pub name: String,
    /// Its largest element size, where the file gives one.
    pub maxh: Option<f64>,
    /// The line of the file that makes it a body.
    pub line: u32,
}

/// A patch.
#[derive(Clone, Debug, Serialize)]
pub struct PatchLine {
    /// Its boundary number.
    pub boundary: u32,
    /// Its boundary name.
    pub name: String,
    /// The kind of its surface.
    pub surface: &'static str,
    /// The solid and the line of the file where its surface stands.
    pub solid: String,
    /// The line.
    pub line: u32,
    /// The numbers of the bodies behind and in front of it; 0 is the exterior.
    pub bodies: [u32; 2],
    /// The curves of its boundary, by index.
    pub curves: Vec<usize>,
    /// Largest element size on it, where the file gives one.
    pub maxh: Option<f64>,
}

/// A curve.
#[derive(Clone, Debug, Serialize)]
pub struct CurveLine {
    /// Its length.
    pub length: f64,
    /// The corners at its ends, by index; null where it is closed.
    pub corners: Option<[usize; 2]>,
    /// The boundary numbers of the patches beside it.
    pub boundaries: Vec<u32>,
}

impl Inspection {
    /// Looks at a geometry.
    pub fn new(model: &CsgModel) -> Self {
        let CsgModel { geometry, features, .. } = model;
        let number = |body: Option<BodyId>| body.map_or(0, |b| geometry.bodies[b.index()].number);
        let patch = |patch: &csg::Patch| {
            let info = &geometry.surface_info[patch.surface.index()];
            PatchLine {
                boundary: patch.bc,
                name: patch.name.clone(),
                surface: kind(&geometry.surfaces[patch.surface.index()]),
                solid: info.solid.clone(),
                line: info.span.line,
                bodies: [number(patch.inside), number(patch.outside)],
                curves: patch.boundary.iter().map(|(curve, _)| curve.index()).collect(),
                maxh: info.maxh,
            }
        };
        let boundary = |id: PatchId| features.patch(id).bc;
        let curve = |curve: &Curve| CurveLine {
            length: curve.length(),
            corners: curve.ends.map(|ends| ends.map(|c| c.index())),
            boundaries: curve.fins.iter().map(|fin| boundary(fin.patch)).collect(),
        };
        let body = |body: &csg::Body| BodyLine {
            number: body.number,
            name: body.material.clone().unwrap_or_else(|| body.name.clone()),
            maxh: body.maxh,
            line: body.span.line,
        };
        Self {
            bounds: [features.bounds.min.into(), features.bounds.max.into()],
            bodies: geometry.bodies.iter().map(body).collect(),
            patches: features.patches.iter().map(patch).collect(),
            curves: features.curves.iter().map(curve).collect(),
            corners: features.corners.iter().map(|c| c.point.into()).collect(),
        }
    }
}

fn kind(surface: &csg::Surface) -> &'static str {
    match surface {
        csg::Surface::Plane(_) => "plane",
        csg::Surface::Sphere(_) => "sphere",
        csg::Surface::Cylinder(_) => "cylinder",
        csg::Surface::Cone(_) => "cone",
        csg::Surface::Torus(_) => "torus",
        csg::Surface::Ellipsoid(_) => "ellipsoid",
        csg::Surface::EllipticCylinder(_) => "elliptic cylinder",
        csg::Surface::EllipticCone(_) => "elliptic cone",
    }
}

impl fmt::Display for Inspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [min, max] = self.bounds;
        writeln!(f, "box {min:?} to {max:?}")?;
        writeln!(f, "\n{} bodies", self.bodies.len())?;
        for body in &self.bodies {
            let maxh = body.maxh.map_or(String::new(), |h| format!("  maxh {h}"));
            writeln!(f, "  {:>4}  {:20} line {}{maxh}", body.number, body.name, body.line)?;
        }
        writeln!(
            f,
            "\n{} patches (boundary number, name, surface, bodies behind and in front, curves)",
            self.patches.len()
        )?;
        for patch in &self.patches {
            let [behind, front] = patch.bodies;
            let surface = format!("{} of {} (line {})", patch.surface, patch.solid, patch.line);
            let maxh = patch.maxh.map_or(String::new(), |h| format!("  maxh {h}"));
            writeln!(
                f,
                "  {:>4}  {:16} {surface:36} {behind} | {front}  {} curves{maxh}",
                patch.boundary,
                patch.name,
                patch.curves.len()
            )?;
        }
        writeln!(f, "\n{} curves (length, corners, boundary numbers beside)", self.curves.len())?;
        for (i, curve) in self.curves.iter().enumerate() {
            let ends = curve.corners.map_or("closed".into(), |[a, b]| format!("{a} to {b}"));
            writeln!(f, "  {i:>4}  {:<12.6} {ends:12} {:?}", curve.length, curve.boundaries)?;
        }
        writeln!(f, "\n{} corners", self.corners.len())?;
        for (i, [x, y, z]) in self.corners.iter().enumerate() {
            writeln!(f, "  {i:>4}  ({x}, {y}, {z})")?;
        }
        Ok(())
    }
}

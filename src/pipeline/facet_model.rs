//! Triangulated surfaces as input for the mesher.

use super::coarse::{self, Allowed, Attempt, CoarseSettings};
use super::coarse_error::CoarseError;
use super::coarse_mesh::CoarseMesh;
use super::contacts::Meeting;
use super::error::{Error, InputError};
use super::expected;
use super::fill::{Improvement, fill};
use super::retries::{Budget, Once};
use super::settings::InputSettings;
use super::solids::{Cad, Tessellated, tessellated};
use crate::Point;
use crate::files::surface::{self, Surface};
use crate::ground::kernel::simplex::volume6;
use crate::ground::mesh::{BoundaryTriangle, Class, Label, Names, Segment, VertexId};
use crate::ground::progress::Work;
use crate::ground::projector::{BrepProjector, Projector};
use crate::ground::size::{Closeness, Evaluation, SizeField, SizeSettings, Source, WatchedSize};
use crate::mesher::facets::{
    FacetBodies, FacetError, FacetModel, FacetPatch, FacetSize, FacetSmoothness, Facets, Marks, SharpPlaces,
    keep, unfold,
};
use crate::mesher::improve::Smoothness;
use crate::mesher::smoothness::BrepSmoothness;
use crate::mesher::surface::SurfaceMesh;
use crate::mesher::surface::closeness::{ThinRegions, Walls, thin_regions};
use csg::{BodyId, CornerId, CurveId, PatchId};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Solids bounded by facets, with the names in their files.
#[derive(Clone, Debug)]
pub struct FacetSolid {
    /// Bodies, patches, curves and corners.
    pub model: FacetModel,
    /// Numbers and names of the bodies and patches.
    pub names: Names,
    /// Points inside that become vertices of the mesh.
    pub kept_points: Vec<Point>,
    /// Edges inside that become edges of the mesh; only with `keep_surface`, because otherwise
    /// their ends need not be vertices.
    pub kept_edges: Vec<[Point; 2]>,
    /// Whether the facets themselves are the surface mesh.
    pub keep_surface: bool,
    /// The exact faces and edges that the facets approximate, if there are any.
    pub exact: Option<BrepProjector>,
    /// The model that they come from, unless its small faces and edges are kept.
    pub(super) cad: Option<Arc<Cad>>,
    /// The names of the surfaces, for messages.
    pub(super) files: Vec<String>,
    /// Where solids overlap, if any do.
    pub(super) overlap: Option<Meeting>,
    /// Whether what solids had in common was given to one of them.
    pub(super) overlaps_are_cut: bool,
}

/// Edges further from their faces than this (fraction of the size of the model) are told.
const SAID_GAP: f64 = 1e-4;

impl FacetSolid {
    /// The volume of all bodies.
    pub(super) fn volume(&self) -> f64 {
        let of = |t: &BoundaryTriangle| {
            let [a, b, c] = t.vertices.map(|v| &self.model.points[v.index()]);
            volume6(&self.model.bounds.min, a, b, c) / 6.0
        };
        // Interfaces have bodies on both sides, which cancel.
        let outer = |t: &&BoundaryTriangle| self.model.patch(t.patch).outside.is_none();
        self.model.triangles.iter().filter(outer).map(of).sum::<f64>().abs()
    }

    /// Reads one or several surfaces.
    ///
    /// # Errors
    /// Files that cannot be read, or whose triangles do not bound bodies, with the location.
    pub fn read(
        paths: &[impl AsRef<Path>],
        settings: &InputSettings,
        note: &mut dyn FnMut(&str),
    ) -> Result<Self, Error> {
        let mut surfaces = Vec::new();
        for path in paths {
            let surface = surface::read(path.as_ref())?;
            let name = path.as_ref().display();
            surface.notes.iter().for_each(|text| note(&format!("{name}: {text}")));
            if surface.regions.iter().any(|region| region.max_volume.is_some()) {
                note(&format!(
                    "{name}: the largest volumes of its regions are left out; sizes come from the options"
                ));
            }
            if !surface.loose_edges.is_empty() && !settings.keep_surface {
                let count = surface.loose_edges.len();
                note(&format!(
                    "{name}: {count} edges on no facet are left out: they are kept with the surface only"
                ));
            }
            surfaces.push(surface);
        }
        let stems: Vec<String> = paths
            .iter()
            .map(|p| p.as_ref().file_stem().unwrap_or_default().to_string_lossy().into())
            .collect();
        let solid = Self::of(surfaces, &stems, settings).map_err(|error| {
            if let FacetError::Overlap { place, files: [a, b] } = error
                && a != b
            {
                let files = [a, b].map(|file| paths[file].as_ref().to_path_buf());
                return InputError::Overlap { files: Box::new(files), place }.into();
            }
            let path = if let [path] = paths { Some(path.as_ref().to_path_buf()) } else { None };
            Error::Facets { path, error: Box::new(error) }
        })?;
        Ok(Self { files: paths.iter().map(|path| path.as_ref().display().to_string()).collect(), ..solid })
    }

    /// Makes solids of surfaces, with a name for each surface.
    ///
    /// # Errors
    /// Triangles that do not bound bodies, with the location.
    pub fn of(
        surfaces: Vec<Surface>,
        stems: &[String],
        settings: &InputSettings,
    ) -> Result<Self, FacetError> {
        let facets: Vec<Facets> = surfaces.iter().map(facets_of).collect();
        let model = FacetModel::new(&facets, &settings.facets)?;
        let names = names(&model, &surfaces, stems);
        let edges = surfaces.iter().filter(|_| settings.keep_surface).flat_map(|s| &s.loose_edges);
        let kept_edges = edges.copied().collect();
        let kept_points = surfaces.into_iter().flat_map(|surface| surface.loose_points).collect();
        let (keep_surface, files) = (settings.keep_surface, stems.to_vec());
        Ok(Self {
            model,
            names,
            kept_points,
            kept_edges,
            keep_surface,
            exact: None,
            cad: None,
            files,
            overlap: None,
            overlaps_are_cut: false,
        })
    }

    /// Projection to patches and curves. Kept facets need none, because points between those of a
    /// facet lie on it.
    pub fn projector(&self) -> Projector {
        match &self.exact {
            _ if self.keep_surface => Projector::Flat,
            Some(exact) => exact.clone().into(),
            None => self.model.projector.clone().into(),
        }
    }

    /// The smoothness of the faces; none of kept facets, which are not projected to.
    fn smoothness(&self) -> Option<Box<dyn Smoothness + '_>> {
        match &self.exact {
            _ if self.keep_surface => None,
            Some(exact) => Some(Box::new(BrepSmoothness(exact))),
            None => Some(Box::new(FacetSmoothness(&self.model.projector))),
        }
    }

    /// Takes the solids of a boundary representation from a file.
    ///
    /// # Errors
    /// Shapes that cannot be meshed, with the location.
    pub fn of_brep(
        path: &Path,
        brep: brep::Model,
        settings: &InputSettings,
        note: &mut dyn FnMut(&str),
    ) -> Result<Self, Error> {
        let refuse = |error| Error::Brep { path: path.to_path_buf(), error: Box::new(error) };
        let Tessellated { cad, facets: model, exact, touching, overlap } =
            tessellated(brep).map_err(refuse)?;
        let brep = &cad.model;
        brep.notes.iter().for_each(|text| note(&format!("{}: {text}", path.display())));
        model
            .bounds
            .refuse_out_of_range()
            .map_err(|range| InputError::OutOfRange { path: Some(path.to_path_buf()), range })?;
        if let Some((face, gap)) = cad.tessellation.widest_gap()
            && gap > SAID_GAP * model.bounds.diagonal()
        {
            note(&format!(
                "{}: edges are up to {gap:.1e} away from their faces, those of face {} most: the file is no more \
                 accurate there, and so is the mesh",
                path.display(),
                face + 1
            ));
        }
        let patches = named(&brep.patch_names, model.patches.len(), |i| format!("face{i}"));
        let names = Names { bodies: labels(body_names(brep, path)), patches: labels(patches) };
        let solid = Self {
            model,
            names,
            kept_points: Vec::new(),
            kept_edges: Vec::new(),
            keep_surface: settings.keep_surface,
            exact: Some(exact),
            cad: (!settings.keep_small && !settings.keep_surface).then(|| Arc::new(cad)),
            files: vec![path.display().to_string()],
            overlap,
            overlaps_are_cut: settings.overlap_to.is_some(),
        };
        if let Some(text) = solid.touching_note(&touching) {
            note(&format!("{}: {text}", path.display()));
        }
        Ok(solid)
    }

    /// Moves the vertices of a surface mesh from the facets onto the exact faces and edges.
    pub(super) fn snap(&self, surface: &mut SurfaceMesh) -> Result<(), CoarseError> {
        let Some(exact) = &self.exact else { return Ok(()) };
        let before = surface.points.clone();
        surface.points.par_iter_mut().zip(&surface.classes).try_for_each(|(point, class)| {
            *point = match *class {
                Class::Curve(curve) => exact.project_curve(curve, point)?,
                Class::Patch(patch) => exact.project_patch(patch, point)?,
                Class::Corner(_) | Class::Body(_) => *point,
            };
            Ok::<_, CoarseError>(())
        })?;
        Ok(unfold(surface, &before, exact)?)
    }

    /// Makes a coarse mesh with the given sizes, which are lowered where surfaces are too close to
    /// each other.
    pub(super) fn coarse_mesh(
        &self,
        settings: &mut CoarseSettings,
        budget: &Budget,
        work: &Work,
    ) -> Result<CoarseMesh, CoarseError> {
        // Triangles that intersect have no thickness between them: they would be made ever smaller.
        if !self.keep_surface
            && let Some(meeting) = self.deep_meeting()
        {
            return Err(meeting);
        }
        let mut coarse = coarse::corrected(settings, budget, work, |settings, allowed| {
            self.attempt(settings, allowed, budget, work)
        })?;
        coarse.report.sharp_places = SharpPlaces::of(&self.model);
        coarse.report.facets_volume = Some(self.volume());
        Ok(coarse)
    }

    /// The size field.
    pub(super) fn size_field(&self, settings: &SizeSettings, evaluation: Evaluation) -> FacetSize {
        if self.keep_surface {
            return FacetSize::of_kept(&self.model, settings);
        }
        FacetSize::evaluated(&self.model, settings, evaluation)
    }

    /// The number of tets that a size field lets expect, see [`expected::tets`].
    pub(super) fn expected_tets(&self, size: &dyn SizeField, few: f64) -> f64 {
        expected::tets(&self.model.bounds, size, few, || {
            let bodies = FacetBodies::new(&self.model);
            move |p: &Point| bodies.contain(p)
        })
    }

    fn attempt(&self, settings: &CoarseSettings, allowed: Allowed, budget: &Budget, work: &Work) -> Attempt {
        let own = self.size_field(&settings.size, Evaluation::Fine);
        let size = WatchedSize::new(&own, work);
        let expected = self.expected_tets(&size, expected::FEW);
        if let Err(error) = budget.expect(expected, work) {
            return Attempt::Failed(error.into());
        }
        let regions = |id: PatchId| self.model.bodies_beside(id);
        if allowed.thin && !self.keep_surface {
            let (sources, found) = self.thin_regions(&size, &regions, settings.size.scaled_closeness());
            if found.places > 0 {
                return Attempt::Thin(sources, found);
            }
        }
        let (mut surface, touching, new) = match self.surface(&size) {
            Ok(made) => made,
            Err(error) => return Attempt::Failed(error),
        };
        budget.warn(Once::Touching, || self.touching_note(&new), work);
        if let Err(cancelled) = work.proceed() {
            return Attempt::Failed(cancelled.into());
        }
        self.add_kept_points(&mut surface);
        self.add_kept_edges(&mut surface);
        let smoothness = self.smoothness();
        let CoarseSettings { effort, is_final, .. } = *settings;
        let how = Improvement { effort, is_final, smoothness: smoothness.as_deref() };
        match fill(surface, regions, &touching, &size, &how) {
            Ok(made) => Attempt::Made(Box::new(made)),
            Err(error) => {
                // If triangles intersect, smaller sizes were tried already.
                let crossed = matches!(error, CoarseError::NotClosed { .. });
                if let Some(meeting) = crossed.then(|| self.any_meeting()).flatten() {
                    return Attempt::Failed(meeting);
                }
                let may_lower = allowed.lower && !self.keep_surface && !crossed;
                let lowered = if may_lower { error.remedy(&[], &size) } else { Vec::new() };
                if lowered.is_empty() { Attempt::Failed(error) } else { Attempt::Lower(lowered) }
            }
        }
    }

    /// Finds thin regions between the facets themselves.
    fn thin_regions(
        &self,
        size: &dyn SizeField,
        regions: &(dyn Fn(PatchId) -> [Option<BodyId>; 2] + Sync),
        closeness: Closeness,
    ) -> (Vec<Source>, ThinRegions) {
        let project = |_, point: &Point| *point;
        let is_ignored = |facet| self.model.is_merged(facet);
        let mesh = &keep(&self.model);
        let (is_ignored, project, touching) = (&is_ignored, &project, &self.model.touching);
        thin_regions(&Walls { mesh, is_ignored, regions, touching, project, size, closeness })
    }

    /// Adds points on no triangle as vertices inside.
    fn add_kept_points(&self, surface: &mut SurfaceMesh) {
        for (index, point) in self.kept_points.iter().enumerate() {
            surface.points.push(*point);
            surface.classes.push(Class::Corner(CornerId::new(self.model.corners.len() + index)));
        }
    }

    /// Adds edges on no triangle as segments inside, each with its own curve.
    fn add_kept_edges(&self, surface: &mut SurfaceMesh) {
        // Adding zero turns −0 into 0, so that equal points have equal bits.
        let key = |p: &Point| p.coords.add_scalar(0.0).data.0[0].map(f64::to_bits);
        let mut at: BTreeMap<[u64; 3], VertexId> = if self.kept_edges.is_empty() {
            BTreeMap::new()
        } else {
            surface.points.iter().map(key).zip((0..).map(VertexId)).collect()
        };
        for (index, ends) in self.kept_edges.iter().enumerate() {
            let vertices = ends.map(|end| {
                *at.entry(key(&end)).or_insert_with(|| {
                    surface.points.push(end);
                    surface
                        .classes
                        .push(Class::Corner(CornerId::new(self.model.corners.len() + surface.points.len())));
                    VertexId::new(surface.points.len() - 1)
                })
            });
            surface.segments.push(Segment { vertices, curve: CurveId::new(self.model.curves.len() + index) });
        }
    }
}

/// The names of the bodies of a CAD file; those without one have that of the file.
pub(super) fn body_names(brep: &brep::Model, path: &Path) -> Vec<String> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let of_body = |i: usize| if i == 1 { stem.to_string() } else { format!("{stem}_{i}") };
    named(&brep.body_names, brep.bodies, of_body)
}

/// The names of a file, numbered from 1; `other` is the name of those that have none.
fn named(given: &[Option<String>], count: usize, other: impl Fn(usize) -> String) -> Vec<String> {
    let name = |i: usize| given.get(i - 1).cloned().flatten().unwrap_or_else(|| other(i));
    (1..=count).map(name).collect()
}

/// Labels with these names, numbered from 1.
fn labels(names: Vec<String>) -> Vec<Label> {
    (1..).zip(names).map(|(number, name)| Label::new(number, name)).collect()
}

fn facets_of(surface: &Surface) -> Facets {
    Facets {
        points: surface.points.clone(),
        triangles: surface.triangles.clone(),
        groups: surface.group.clone(),
        marks: surface.unoriented.then(|| marks_of(surface)),
    }
}

fn marks_of(surface: &Surface) -> Marks {
    // TetGen's attributes are any numbers; those of regions are small integers.
    let regions = surface.regions.iter().map(|region| (region.place, region.attribute.round() as i64));
    Marks { holes: surface.holes.clone(), regions: regions.collect() }
}

/// Numbers and names of bodies and patches. Bodies have the numbers of their file if it numbers all
/// of them, else consecutive ones, and the names of their files. If files have groups of triangles,
/// the groups are the boundaries; else each patch is one.
fn names(model: &FacetModel, surfaces: &[Surface], stems: &[String]) -> Names {
    let all_numbered = surfaces.len() == 1 && model.bodies.iter().all(|b| b.number.is_some_and(|n| n > 0));
    let mut bodies: Vec<Label> = Vec::new();
    for body in &model.bodies {
        let stem = &stems[body.file as usize];
        let taken = |name: &String| bodies.iter().any(|body| body.name() == Some(name));
        let numbered = (2..).map(|k| format!("{stem}_{k}"));
        let name = std::iter::once(stem.clone())
            .chain(numbered)
            .find(|name| !taken(name))
            .expect("an unused name in an endless list");
        let number = body.number.filter(|_| all_numbered).and_then(|number| u32::try_from(number).ok());
        bodies.push(Label::new(number.unwrap_or(bodies.len() as u32 + 1), name));
    }
    let groups: Vec<(usize, usize)> = surfaces
        .iter()
        .enumerate()
        .flat_map(|(file, surface)| (0..surface.groups.len()).map(move |group| (file, group)))
        .collect();
    let has_groups = surfaces.iter().any(|surface| surface.groups.len() > 1);
    let patch = |(index, patch): (usize, &FacetPatch)| {
        let (file, group) = patch.labels.first().map_or((0, 0), |&(f, g)| (f as usize, g as usize));
        let at = groups.binary_search(&(file, group)).ok().filter(|_| has_groups);
        match at {
            Some(at) => Label::new(group_number(surfaces, &groups, at), surfaces[file].groups[group].clone()),
            None => Label::new(index as u32 + 1, format!("patch{}", index + 1)),
        }
    };
    Names { bodies, patches: model.patches.iter().enumerate().map(patch).collect() }
}

/// The number of a group in its file, if that is the only file and numbers all groups positively;
/// else its index from 1.
fn group_number(surfaces: &[Surface], groups: &[(usize, usize)], at: usize) -> u32 {
    let own = |&(file, group): &(usize, usize)| {
        u32::try_from(surfaces[file].group_numbers[group]).ok().filter(|&number| number > 0)
    };
    let all_own = surfaces.len() == 1 && groups.iter().all(|group| own(group).is_some());
    own(&groups[at]).filter(|_| all_own).unwrap_or(at as u32 + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit cube from x = `from`, whose face at x = 1 has this diagonal.
    fn cube(from: u32, diagonal: [[u32; 3]; 2]) -> String {
        let mut text = String::from("OFF\n8 7 0\n");
        for k in 0..8 {
            text += &format!("{} {} {}\n", from + (k & 1), k >> 1 & 1, k >> 2);
        }
        let [low, high] = ["4 0 4 6 2\n", "4 1 3 7 5\n"];
        let other = if from == 0 { low } else { high };
        let shared = diagonal.map(|[a, b, c]| format!("3 {a} {b} {c}\n")).concat();
        text + other + &shared + "4 0 1 5 4\n4 2 6 7 3\n4 0 2 3 1\n4 4 5 7 6\n"
    }

    #[test]
    fn files_that_share_a_face_with_other_triangles_are_named() {
        let dir = tempfile::tempdir().unwrap();
        let paths = ["a.off", "b.off"].map(|name| dir.path().join(name));
        let read = |second: [[u32; 3]; 2]| {
            std::fs::write(&paths[0], cube(0, [[1, 3, 7], [1, 7, 5]])).unwrap();
            std::fs::write(&paths[1], cube(1, second)).unwrap();
            FacetSolid::read(&paths, &InputSettings::default(), &mut |_| ())
        };
        assert_eq!(read([[0, 4, 6], [0, 6, 2]]).unwrap().model.bodies.len(), 2);
        let error = read([[0, 4, 2], [4, 6, 2]]).unwrap_err();
        let Error::Input(InputError::Overlap { files, place }) = &error else { panic!("{error}") };
        assert_eq!((files.as_slice(), place.x), (paths.as_slice(), 1.0));
        let said = error.to_string();
        assert!(said.contains("a.off and ") && said.contains("both need the same triangles"), "{said}");
    }
}

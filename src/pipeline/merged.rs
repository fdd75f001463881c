//! The way into all methods: a CAD file is meshed with its small faces and edges merged, or as it
//! is if there is no such mesh.

use super::error::Error;
use super::facet_model::FacetSolid;
use super::generate::generate_of;
use super::geometry::Geometry;
use super::model::Model;
use super::options;
use super::result::Generated;
use super::settings::{GenerateSettings, Request, Wanted};
use crate::ground::comm::Communicator;
use crate::ground::error::{ErrorKind, HasKind};
use crate::ground::progress::{Progress, Stage};
use crate::mesher::facets::{Kept, MergedSmall};

/// A geometry is merged so often, at most: each time without the small faces and edges beside which
/// there was no mesh before.
const TRIALS: usize = 4;

/// **Collective.** Makes the mesh; only rank 0 needs the geometry and reports `progress`.
///
/// The settings must be the same on all ranks, except the sources, the size function and `disk`,
/// which rank 0 alone uses, and `memory`.
///
/// # Errors
/// The same on all ranks: impossible or different settings, no geometry on rank 0, no coarse mesh,
/// more parts than tets, too many vertices on a rank, inverted tets that no finer coarse mesh
/// avoids, a faulty mesh.
pub fn generate(
    comm: &dyn Communicator,
    geometry: Option<&Geometry>,
    settings: &GenerateSettings,
    progress: &Progress,
) -> Result<Generated, Error> {
    options::refuse_different(comm, geometry.is_some(), settings)?;
    comm.agree(options::refuse_impossible(settings))?;
    let model = geometry.filter(|_| comm.rank() == 0).map(|geometry| &geometry.model);
    let mut kept = Kept::default();
    let mut trials = 0;
    loop {
        trials += 1;
        let (merged, report) = match model {
            Some(Model::Facets(solid)) if solid.may_be_merged() => {
                merge_small(solid, settings, &kept, progress)
            }
            _ => (None, MergedSmall::default()),
        };
        let keep = |error: &Error| match (model, error) {
            (Some(Model::Facets(solid)), Error::Coarse(error)) if trials < TRIALS => {
                solid.keep_beside(&error.all_places(), &report, &mut kept)
            }
            _ => false,
        };
        let made = of_merged(comm, merged.as_ref(), model, settings, progress, keep)?;
        if let Some((mut made, is_merged)) = made {
            if let Some(coarse) = made.coarse.as_mut().filter(|_| is_merged) {
                coarse.report.merged_small = report;
            }
            return Ok(made);
        }
    }
}

/// **Collective.** Generates the mesh of rank 0's merged model, or if that has no mesh, or there is
/// none, of its own one; on rank 0 also returns whether it was the merged one. `None` if more is
/// kept after an error, so that the model should be merged again; only rank 0 is asked that.
fn of_merged(
    comm: &dyn Communicator,
    merged: Option<&Model>,
    model: Option<&Model>,
    settings: &GenerateSettings,
    progress: &Progress,
    mut keep: impl FnMut(&Error) -> bool,
) -> Result<Option<(Generated, bool)>, Error> {
    match generate_of(comm, merged.or(model), settings, progress) {
        Ok(made) => Ok(Some((made, merged.is_some()))),
        Err(error) => {
            let may_help = merged.is_some() && may_come_from_merging(&error);
            let mut next = vec![u8::from(may_help), u8::from(may_help && keep(&error))];
            let is_heard = comm.broadcast(0, &mut next).is_ok();
            if !is_heard || next[0] == 0 {
                return Err(error);
            }
            let is_again = next[1] == 1;
            let which = if is_again { "some small faces and edges" } else { "small faces and edges" };
            progress.note(&format!("{which} are kept, because there is no mesh with them merged: {error}"));
            match is_again {
                true => Ok(None),
                false => Ok(Some((generate_of(comm, model, settings, progress)?, false))),
            }
        }
    }
}

/// Whether a geometry that has no mesh may have one where nothing is merged.
fn may_come_from_merging(error: &Error) -> bool {
    let is_of_mesh =
        matches!(error, Error::Coarse(_) | Error::Cut(_) | Error::Fill { .. } | Error::Invalid(_));
    is_of_mesh || (error.is_elsewhere() && error.kind() == ErrorKind::NoMesh)
}

/// Merges what is small in a CAD file, with a note.
fn merge_small(
    solid: &FacetSolid,
    settings: &GenerateSettings,
    kept: &Kept,
    progress: &Progress,
) -> (Option<Model>, MergedSmall) {
    /// The volume of a regular tet with edges of length 1.
    const TET: f64 = 0.118;
    let of_count = |tets: u64| (solid.volume() / (TET * tets.max(1) as f64)).cbrt();
    let Request { wanted, refined, .. } = settings.before_refinement();
    let (largest, pieces) = match wanted {
        Wanted::Sizes { pieces: own } => (f64::INFINITY, refined * own),
        Wanted::Coarse { tets, pieces: own } => (of_count(tets), refined * own),
        // The subdivisions are chosen later: the elements themselves decide.
        Wanted::Elements(count) => (of_count(count), refined),
    };
    // Nodes of second order divide edges, too.
    let pieces = pieces * settings.coarse.order.degree();
    let (merged, report) = progress
        .stage(Stage::Merge, |work| solid.merge_small(&settings.coarse.size, largest, pieces, kept, work));
    report.notes().iter().for_each(|text| progress.note(text));
    (merged.map(|solid| Model::Facets(Box::new(solid))), report)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::surface;
    use crate::ground::comm::thread;
    use crate::ground::progress::Silent;
    use crate::pipeline::settings::InputSettings;

    /// Boxes of edge 1 from these places on the diagonal.
    fn boxes(places: &[f64]) -> Model {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("boxes.off");
        let mut text = format!("OFF\n{} {} 0\n", 8 * places.len(), 6 * places.len());
        for x in places {
            (0..8).for_each(|k| {
                let [a, b, c] = [k & 1, k >> 1 & 1, k >> 2].map(|bit| x + f64::from(bit));
                text += &format!("{a} {b} {c}\n");
            });
        }
        for k in 0..places.len() {
            for face in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
                let [a, b, c, d] = face.map(|v| v + 8 * k);
                text += &format!("4 {a} {b} {c} {d}\n");
            }
        }
        std::fs::write(&path, text).unwrap();
        let surfaces = vec![surface::read(&path).unwrap()];
        let solid = FacetSolid::of(surfaces, &["boxes".to_owned()], &InputSettings::default()).unwrap();
        Model::Facets(Box::new(solid))
    }

    #[test]
    fn what_has_no_mesh_when_merged_is_meshed_as_it_is() {
        let (crossed, sound) = (boxes(&[0.0, 0.5]), boxes(&[0.0]));
        let run = |merged: Option<&Model>, model: &Model| {
            thread::run(2, |comm| {
                let is_first = comm.rank() == 0;
                let models = [merged, Some(model)].map(|model| model.filter(|_| is_first));
                let settings = GenerateSettings::default();
                of_merged(comm, models[0], models[1], &settings, &Progress::new(&Silent), |_| false)
                    .map(|made| made.map(|(made, is_merged)| (made.check.tets, is_merged)))
                    .map_err(|error| error.to_string())
            })
            .unwrap()
        };
        let again = thread::run(2, |comm| {
            let is_first = comm.rank() == 0;
            let models = [&crossed, &sound].map(|model| Some(model).filter(|_| is_first));
            let settings = GenerateSettings::default();
            // Only the first rank knows what to keep.
            let keep = |error: &Error| is_first && matches!(error, Error::Coarse(_));
            of_merged(comm, models[0], models[1], &settings, &Progress::new(&Silent), keep)
                .map(|made| made.is_none())
                .map_err(|error| error.to_string())
        });
        assert_eq!(again.unwrap(), [Ok(true), Ok(true)]);
        let expected = run(None, &sound);
        assert!(expected.iter().all(Result::is_ok), "{expected:?}");
        assert_eq!(run(Some(&crossed), &sound), expected);
        assert!(run(Some(&crossed), &crossed).iter().all(Result::is_err));
        assert!(run(Some(&sound), &crossed)[0].as_ref().is_ok_and(|made| made.is_some_and(|made| made.1)));
    }
}

//! Checks of the settings of a run, before anything is meshed.

use super::coarse::CoarseSettings;
use super::error::{Error, RequestError};
use super::model::Model;
use super::settings::{GenerateSettings, InputSettings, Method, Wanted};
use crate::ground::comm::Communicator;
use crate::ground::kernel::hash::WordHasher;
use crate::ground::size::{SizeSettings, Source};
use crate::mesher::facets;
use crate::parallel::decompose::CutPlane;
use crate::parallel::refine::possible_pieces;
use std::f64::consts::PI;
use std::fmt::Debug;
use std::hash::Hasher;

const POSITIVE: &str = "positive numbers";
/// Steeper sizes need ever more samples of the surface, and make no fewer tets.
const MOST_GRADING: f64 = 10.0;

const NOT_NEGATIVE: &str = "0 and positive numbers";

fn refused(name: &'static str, value: impl ToString, allowed: impl ToString) -> RequestError {
    RequestError::Option { name, value: value.to_string(), allowed: allowed.to_string() }
}

/// Refuses a number that is not positive, infinite, or no number.
fn positive(name: &'static str, value: f64) -> Result<(), RequestError> {
    if value > 0.0 && value.is_finite() { Ok(()) } else { Err(refused(name, value, POSITIVE)) }
}

/// Refuses a number that is negative, infinite, or no number.
fn not_negative(name: &'static str, value: f64) -> Result<(), RequestError> {
    if value >= 0.0 && value.is_finite() { Ok(()) } else { Err(refused(name, value, NOT_NEGATIVE)) }
}

/// *Local.* Refuses settings that no mesh can have.
///
/// # Errors
/// The first such setting.
pub(super) fn refuse_impossible(settings: &GenerateSettings) -> Result<(), Error> {
    if let Method::Decompose(cuts) = &settings.method {
        refuse_planes(&cuts.planes)?;
    }
    if settings.refine > 0 && settings.method == Method::Refine {
        let allowed = "0: the method `refine` has `levels` and `pieces`";
        return Err(refused("refine", settings.refine, allowed).into());
    }
    possible_pieces(1_u32.checked_shl(settings.refine).unwrap_or(u32::MAX), settings.coarse.order)?;
    refuse_impossible_coarse(&settings.coarse, settings.wanted)
}

/// *Local.* Refuses sizes that the coordinates of a geometry cannot resolve.
///
/// # Errors
/// The first such size.
pub(super) fn refuse_unresolved(model: &Model, size: &SizeSettings) -> Result<(), RequestError> {
    let Some(least) = model.least_size() else { return Ok(()) };
    let allowed = format_args!("{least:.1e} and more: coordinates of this geometry resolve no smaller sizes");
    if let Some(largest) = size.maxh.filter(|&largest| largest < least) {
        return Err(refused("max_size", format_args!("{largest:?}"), allowed));
    }
    match size.sources.iter().find(|source| source.size < least) {
        Some(Source { point, size }) => {
            let value = format!("size {size:?} at ({}, {}, {})", point.x, point.y, point.z);
            Err(refused("sources", value, allowed))
        }
        None => Ok(()),
    }
}

/// *Local.* Refuses settings that no coarse mesh can have.
///
/// # Errors
/// The first such setting.
pub(super) fn refuse_impossible_coarse(coarse: &CoarseSettings, wanted: Wanted) -> Result<(), Error> {
    refuse_sizes(&coarse.size)?;
    match wanted {
        Wanted::Sizes { pieces } => possible_pieces(pieces, coarse.order)?,
        Wanted::Coarse { tets, pieces } => {
            if tets == 0 || tets > u64::from(u32::MAX) {
                return Err(refused("coarse_tets", tets, format_args!("1 to {}", u32::MAX)).into());
            }
            possible_pieces(pieces, coarse.order)?
        }
        Wanted::Elements(0) => return Err(refused("tets", 0, "1 and more").into()),
        Wanted::Elements(_) => 1,
    };
    Ok(())
}

/// Options that must be the same on all ranks, with a number for each value.
///
/// Sources and the size function are used on rank 0 only, like the geometry. The memory belongs to
/// a machine, and the disk to rank 0.
fn compared(settings: &GenerateSettings) -> [(&'static str, u64); 12] {
    let GenerateSettings { method, coarse, wanted, refine, nested, allow_off_surface, .. } = settings;
    let CoarseSettings { size, effort, order, .. } = coarse;
    let preset = (size.curvature_safety, size.segments_per_curve, size.scale);
    [
        ("method", value_of(method)),
        ("nested", value_of(nested)),
        ("effort", value_of(effort)),
        ("order", value_of(order)),
        ("allow_off_surface", value_of(allow_off_surface)),
        ("tets, coarse_tets, levels or pieces", value_of(wanted)),
        ("refine", u64::from(*refine)),
        ("max_size", value_of(&size.maxh)),
        ("min_size", value_of(&size.minh)),
        ("grading", value_of(&size.grading)),
        ("closeness", value_of(&size.closeness)),
        ("preset", value_of(&preset)),
    ]
}

/// A number that is the same for equal values, on all ranks of a job.
fn value_of(setting: &dyn Debug) -> u64 {
    let mut hasher = WordHasher::default();
    hasher.write(format!("{setting:?}").as_bytes());
    hasher.finish()
}

/// **Collective.** Refuses a run without a geometry on rank 0, or whose ranks have different
/// settings: they would make different meshes, or wait for each other without end.
///
/// # Errors
/// The same on all ranks.
pub(super) fn refuse_different(
    comm: &dyn Communicator,
    has_geometry: bool,
    settings: &GenerateSettings,
) -> Result<(), Error> {
    let mine = compared(settings);
    let mut numbers = [u64::from(has_geometry); 13];
    numbers.iter_mut().zip(&mine).for_each(|(number, (_, value))| *number = *value);
    let all = comm.all_gather_one(numbers)?;
    let [first @ .., has_geometry] = all[0];
    if has_geometry == 0 {
        return Err(RequestError::NoGeometry.into());
    }
    for (rank, values) in (0..).zip(&all) {
        if let Some(differs) = first.iter().zip(values).position(|(first, value)| first != value) {
            return Err(RequestError::OtherSettings { rank, option: mine[differs].0 }.into());
        }
    }
    Ok(())
}

fn refuse_sizes(size: &SizeSettings) -> Result<(), RequestError> {
    size.maxh.map_or(Ok(()), |largest| positive("max_size", largest))?;
    not_negative("min_size", size.minh)?;
    if let Some(largest) = size.maxh.filter(|&largest| size.minh > largest) {
        return Err(refused("min_size", size.minh, format_args!("0 to max_size, which is {largest}")));
    }
    if !(size.grading > 0.0 && size.grading <= MOST_GRADING) {
        let allowed = format_args!("positive numbers up to {MOST_GRADING}");
        return Err(refused("grading", size.grading, allowed));
    }
    // An infinite ratio ignores thin regions, which a user requests by 0.
    if !(size.closeness.ratio > 0.0 && size.closeness.most >= 1.0) {
        return Err(refused("closeness", size.closeness.ratio, NOT_NEGATIVE));
    }
    positive("curvature_safety", size.curvature_safety)?;
    not_negative("segments_per_curve", size.segments_per_curve)?;
    positive("scale", size.scale)?;
    let is_possible = |source: &Source| {
        source.size > 0.0 && source.size.is_finite() && source.point.iter().all(|x| x.is_finite())
    };
    match size.sources.iter().find(|source| !is_possible(source)) {
        Some(Source { point, size }) => {
            let value = format!("size {size} at ({}, {}, {})", point.x, point.y, point.z);
            Err(refused("sources", value, "positive sizes at finite points"))
        }
        None => Ok(()),
    }
}

pub(super) fn refuse_planes(planes: &[CutPlane]) -> Result<(), RequestError> {
    let is_possible = |plane: &&CutPlane| {
        plane.point.iter().all(|x| x.is_finite())
            && plane.normal.norm() > 0.0
            && plane.normal.norm().is_finite()
    };
    match planes.iter().position(|plane| !is_possible(&plane)) {
        Some(index) => {
            Err(refused("planes", format_args!("plane {index}"), "finite points and unit normals"))
        }
        None => Ok(()),
    }
}

/// *Local.* Refuses thresholds for facets that are no angles or lengths.
///
/// # Errors
/// The first such setting.
pub(super) fn refuse_impossible_input(settings: &InputSettings) -> Result<(), RequestError> {
    let facets::Settings { feature_angle, least_angle, corner_angle, tip_angle, shortest_end } =
        settings.facets;
    if !(feature_angle > 0.0 && feature_angle <= PI) {
        return Err(refused("feature_angle", feature_angle, "angles above 0 and up to π"));
    }
    not_negative("least_angle", least_angle)?;
    not_negative("corner_angle", corner_angle)?;
    not_negative("tip_angle", tip_angle)?;
    not_negative("shortest_end", shortest_end)?;
    settings.merge.map_or(Ok(()), |merge| not_negative("merge", merge))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::comm::thread;
    use crate::ground::error::{ErrorKind, HasKind};
    use crate::ground::size::Preset;
    use crate::mesher::improve::Effort;
    use crate::parallel::refine::RefineError;
    use crate::parallel::refine::lattice::MAX_PIECES;
    use crate::{Geometry, Mesher, Point};

    /// The name of the option for which a mesher refuses its settings.
    fn refusal(mesher: Mesher) -> &'static str {
        let ball = Geometry::from_text("algebraic3d solid b = sphere (0, 0, 0; 1); tlo b;").unwrap();
        let error = mesher.generate(&ball).expect_err("it is refused");
        assert_eq!(error.kind(), ErrorKind::Input);
        let Error::Request(RequestError::Option { name, .. }) = error else { panic!("{error}") };
        name
    }

    #[test]
    fn numbers_that_no_mesh_can_have_are_refused_by_name() {
        let new = Mesher::new;
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(refusal(new().max_size(bad)), "max_size");
            assert_eq!(refusal(new().grading(bad)), "grading");
            let point = Point::origin();
            assert_eq!(refusal(new().sources([Source { point, size: bad }])), "sources");
        }
        for bad in [-1.0, f64::NAN] {
            assert_eq!(refusal(new().min_size(bad)), "min_size");
            assert_eq!(refusal(new().closeness(bad)), "closeness");
        }
        assert_eq!(refusal(new().grading(11.0)), "grading");
        // The ball's diagonal is 3.5.
        assert_eq!(refusal(new().max_size(1e-300)), "max_size");
        assert_eq!(refusal(new().sources([Source { point: Point::origin(), size: 3e-14 }])), "sources");
        assert_eq!(refusal(new().min_size(0.5).max_size(0.4)), "min_size");
        assert_eq!(refusal(new().tets(0)), "tets");
        assert_eq!(refusal(new().coarse_tets(0)), "coarse_tets");
        assert_eq!(refusal(new().coarse_tets(u64::MAX)), "coarse_tets");
        let point = Point::new(f64::NAN, 0.0, 0.0);
        assert_eq!(refusal(new().sources([Source { point, size: 1.0 }])), "sources");
    }

    #[test]
    fn the_refusal_has_the_name_the_value_and_the_possible_values() {
        let size = SizeSettings { maxh: Some(1.0), minh: 2.0, ..SizeSettings::default() };
        assert_eq!(
            refuse_sizes(&size).unwrap_err().to_string(),
            "`min_size` cannot be 2: possible are 0 to max_size, which is 1"
        );
        let size = SizeSettings { grading: f64::NAN, ..SizeSettings::default() };
        assert_eq!(
            refuse_sizes(&size).unwrap_err().to_string(),
            "`grading` cannot be NaN: possible are positive numbers up to 10"
        );
    }

    #[test]
    fn all_presets_are_possible() {
        for (preset, _) in Preset::ALL {
            refuse_impossible_coarse(&SizeSettings::from(preset).into(), Wanted::default()).unwrap();
        }
        refuse_impossible_input(&InputSettings::default()).unwrap();
    }

    #[test]
    fn pieces_beyond_the_finest_lattice_are_refused_however_they_are_requested() {
        let ball = Geometry::from_text("algebraic3d solid b = sphere (0, 0, 0; 1); tlo b;").unwrap();
        let refusal = |mesher: Mesher| mesher.generate(&ball).expect_err("it is refused");
        for mesher in [
            Mesher::new().pieces(0),
            Mesher::new().pieces(MAX_PIECES + 1),
            Mesher::new().levels(11),
            Mesher::new().levels(33),
            Mesher::new().levels(40),
            Mesher::new().levels(u32::MAX),
            Mesher::new().coarse_tets(1000).levels(32),
        ] {
            let error = refusal(mesher);
            assert!(matches!(error, Error::Refine(RefineError::Pieces { .. })), "{error}");
            assert!(error.to_string().contains("1 to 1024 are possible"), "{error}");
        }
    }

    /// A mesh of one tet.
    fn tet() -> Geometry {
        let points = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let arrays = crate::MeshArrays { points: &points, tets: &[[0, 1, 2, 3]], ..Default::default() };
        Geometry::from_mesh(&arrays).unwrap()
    }

    #[test]
    fn a_mesh_that_no_lattice_refines_to_the_number_is_refused() {
        let error = Mesher::new().tets(10_000_000_000).generate(&tet()).expect_err("1024³ are too few");
        assert!(matches!(error, Error::Refine(RefineError::Pieces { .. })), "{error}");
    }

    /// The refusal that all ranks return alike.
    fn common_refusal(run: impl Fn(&dyn Communicator) -> Result<(), Error> + Sync) -> RequestError {
        let errors = thread::run(3, |comm| run(comm).expect_err("it is refused")).unwrap();
        let refusals = errors.into_iter().map(|error| match error {
            Error::Request(refusal) => refusal,
            error => panic!("{error}"),
        });
        refusals.reduce(|first, other| if first == other { first } else { panic!("{other}") }).unwrap()
    }

    #[test]
    fn a_run_without_geometry_is_refused_on_all_ranks() {
        let tet = tet();
        let refusal = common_refusal(|comm| {
            let mine = Some(&tet).filter(|_| comm.rank() > 0);
            Mesher::new().generate_on(comm, mine).map(|_| ())
        });
        assert_eq!(refusal, RequestError::NoGeometry);
    }

    #[test]
    fn options_that_differ_between_ranks_are_refused_on_all_ranks_by_name() {
        let tet = tet();
        type Change = for<'a> fn(Mesher<'a>) -> Mesher<'a>;
        let changes: [(Change, &str); 9] = [
            (|mesher| mesher.method(Method::Surface), "method"),
            (|mesher| mesher.nested(), "nested"),
            (|mesher| mesher.effort(Effort::Quick), "effort"),
            (|mesher| mesher.levels(1), "tets, coarse_tets, levels or pieces"),
            (|mesher| mesher.max_size(0.5), "max_size"),
            (|mesher| mesher.min_size(0.5), "min_size"),
            (|mesher| mesher.grading(0.5), "grading"),
            (|mesher| mesher.closeness(0.5), "closeness"),
            (|mesher| mesher.preset(Preset::Fine), "grading"),
        ];
        for (change, option) in changes {
            let refusal = common_refusal(|comm| {
                let mesher = if comm.rank() == 2 { change(Mesher::new()) } else { Mesher::new() };
                mesher.generate_on(comm, Some(&tet)).map(|_| ())
            });
            assert_eq!(refusal, RequestError::OtherSettings { rank: 2, option });
            assert!(refusal.to_string().starts_with("rank 2 has another setting than rank 0: "));
        }
    }

    #[test]
    fn sources_and_functions_are_needed_on_rank_0_only() {
        let ball = Geometry::from_text("algebraic3d solid b = sphere (0, 0, 0; 1); tlo b;").unwrap();
        let meshes = thread::run(2, |comm| {
            let mesher = match comm.rank() {
                0 => Mesher::new().size(|_| 0.5).sources([Source { point: Point::origin(), size: 0.4 }]),
                _ => Mesher::new().size(|_| panic!("only rank 0 calls its function")),
            };
            mesher.generate_on(comm, (comm.rank() == 0).then_some(&ball)).unwrap().check.tets
        });
        let meshes = meshes.unwrap();
        assert_eq!(meshes[0], meshes[1]);
    }

    #[test]
    fn an_impossible_source_of_rank_0_ends_all_ranks() {
        let tet = tet();
        let errors = thread::run(2, |comm| {
            let size = if comm.rank() == 0 { 0.0 } else { 1.0 };
            let mesher = Mesher::new().sources([Source { point: Point::origin(), size }]);
            mesher.generate_on(comm, Some(&tet)).map(|_| ()).unwrap_err().to_string()
        });
        let errors = errors.unwrap();
        assert_eq!(errors[1], format!("rank 0: {}", errors[0]));
    }

    #[test]
    fn angles_of_features_are_refused_when_a_surface_is_taken() {
        let mut settings = InputSettings::default();
        settings.facets.feature_angle = f64::NAN;
        let error = Geometry::from_surface(&crate::SurfaceArrays::default(), &settings).unwrap_err();
        assert!(error.to_string().contains("`feature_angle`"), "{error}");
    }
}

//! Boxes, a ball and two bodies in pieces.

use super::*;
use crate::ground::comm::thread;
use crate::ground::mesh::stream::{BoundaryBlock, MeshStream, NO_TET};
use crate::ground::progress::{Progress, Silent, Work};
use crate::mesher::model::CsgModel;
use crate::parallel::skin::Skin;
use crate::pipeline::model::Model;
use crate::pipeline::retries::Budget;
use crate::pipeline::{CoarseSettings, CutSettings, GenerateSettings, Geometry, Method, Wanted, generate};
use crate::{Point, Vector};
use csg::BodyId;

const BAR: &str = "algebraic3d
solid bar = orthobrick (0, 0, 0; 4, 1, 1) -maxh=0.5;
tlo bar;";

/// A ball in a box, with a named boundary.
const PEARL: &str = "algebraic3d
solid pearl = sphere (0, 0, 0; 1) -bcname=skin;
solid box = orthobrick (-2, -2, -2; 2, 2, 2) and not pearl;
tlo pearl -material=lime; tlo box -transparent;";

fn model(source: &str) -> CsgModel {
    CsgModel::new(csg::language::parse_geometry(source, "test.geo").expect("a geometry").geometry)
        .expect("features")
}

fn statistics(model: &CsgModel, parts: u32) -> CutStatistics {
    let whole = Geometry::from(Model::Csg(Box::new(model.clone())));
    let made = whole
        .model
        .coarse_mesh(&mut CoarseSettings::default(), &Budget::default(), Work::unwatched())
        .expect("a mesh");
    let expected = vec![8.0; made.mesh.tets.len()];
    CutStatistics::of(&made.mesh, model, &expected, 2, parts).expect("a mesh that can be refined")
}

fn plane(point: [f64; 3], normal: [f64; 3]) -> CutPlane {
    CutPlane { point: point.into(), normal: Vector::from(normal) }
}

/// The method `decompose` with these planes, or with automatic ones if there are none.
fn settings(planes: Vec<CutPlane>) -> GenerateSettings {
    GenerateSettings {
        method: Method::Decompose(CutSettings { planes, ..CutSettings::default() }),
        coarse: CoarseSettings::default(),
        wanted: Wanted::Sizes { pieces: 1 },
        refine: 0,
        memory: None,
        disk: None,
        nested: false,
        allow_off_surface: false,
        periodic_together: false,
    }
}

/// The shares of the samples in each piece, times the number of pieces.
fn shares(cuts: &Cuts, statistics: &CutStatistics) -> Vec<f64> {
    let mut shares = vec![0.0; cuts.leaves.len()];
    let one = cuts.leaves.len() as f64 / statistics.samples.len() as f64;
    statistics.samples.iter().for_each(|sample| shares[cuts.leaf_of(&sample.point)] += one);
    shares
}

#[test]
fn a_bar_is_cut_across_into_equal_parts_of_any_number() {
    let bar = model(BAR);
    for parts in [1, 2, 3, 4] {
        let statistics = statistics(&bar, parts);
        let cuts = plan(&statistics, parts, &PlanSettings::default()).expect("enough tets");
        assert_eq!((cuts.leaves.len(), cuts.planes.len()), (parts as usize, parts as usize - 1));
        for plane in &cuts.planes {
            assert!(plane.normal.x.abs() > 0.999, "{parts} parts: {plane:?}");
        }
        let shares = shares(&cuts, &statistics);
        assert!(shares.iter().all(|share| (share - 1.0).abs() < 0.05), "{parts} parts: {shares:?}");
        assert_eq!(plan(&statistics, parts, &PlanSettings::default()).expect("the same"), cuts);
    }
}

#[test]
fn more_parts_than_can_be_told_apart_are_refused() {
    let bar = model(BAR);
    let few = statistics(&bar, 1);
    let parts = few.samples.len() as u32;
    assert_eq!(plan(&few, parts, &PlanSettings::default()), Err(TooManyParts::Samples(parts)));
}

#[test]
fn planes_of_the_user_cut_what_they_meet() {
    let statistics = statistics(&model(BAR), 4);
    let across = plane([1.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
    let outside = plane([9.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
    let along = plane([0.0, 0.5, 0.0], [0.0, 1.0, 0.0]);
    let cuts = Cuts::by_planes(&[across, outside, along], &statistics);
    assert_eq!(cuts.leaves.len(), 4);
    let leaves =
        [[0.5, 0.2], [0.5, 0.8], [2.0, 0.2], [2.0, 0.8]].map(|[x, y]| cuts.leaf_of(&Point::new(x, y, 0.5)));
    assert_eq!(leaves, [0, 1, 2, 3]);
}

#[test]
fn what_lies_on_the_geometry_keeps_its_patch_and_cuts_lie_in_their_body() {
    let whole = model(PEARL);
    let cuts = Cuts::by_planes(&[plane([0.0, 0.0, 0.1], [0.0, 0.6, 0.8])], &statistics(&whole, 2));
    let all: Vec<(usize, BodyId)> =
        [0, 1].into_iter().flat_map(|part| [0, 1].map(|b| (part, BodyId(b)))).collect();
    let cut = CutModel::new(&whole, &cuts, all).expect("pieces");
    let mut inside = [0, 0];
    let mut seen = vec![0; whole.features.patches.len()];
    for (patch, face) in cut.model.features.patches.iter().zip(&cut.faces) {
        match *face {
            cut::Face::Old(id, _) => {
                seen[id.index()] += 1;
                assert_eq!(whole.features.patch(id).surface, patch.surface);
            }
            cut::Face::Cut(body) => inside[body.index()] += 1,
        }
    }
    assert_eq!(inside, [1, 1], "a disc in the ball, and what is round it");
    assert!(
        seen.iter().all(|&count| count == 1 || count == 2),
        "each patch is there, whole or in two: {seen:?}"
    );
    assert_eq!(seen.iter().filter(|&&count| count == 2).count(), 5, "the sphere and four sides");
}

#[test]
fn a_piece_that_was_forgotten_is_found_out() {
    let whole = model(PEARL);
    let cuts = Cuts::by_planes(&[plane([0.0, 0.0, 0.1], [0.0, 0.6, 0.8])], &statistics(&whole, 2));
    let pieces = vec![(0, BodyId(0)), (0, BodyId(1)), (1, BodyId(1))];
    assert!(matches!(CutModel::new(&whole, &cuts, pieces), Err(CutError::NewFace { .. })));
}

/// A cube without one of its octants: planes through its inner corner are planes of the file.
const FICHERA: &str = "algebraic3d
solid fichera = orthobrick (-1, -1, -1; 1, 1, 1) and not orthobrick (0, 0, 0; 2, 2, 2) -maxh=0.5;
tlo fichera;";

#[test]
fn a_cut_in_a_plane_of_the_file_is_no_boundary_where_a_body_goes_on() {
    let whole = model(FICHERA);
    let along = plane([0.0; 3], [0.0, -1.0, 0.0]);
    let cuts = Cuts::by_planes(&[along], &statistics(&whole, 2));
    let cut = CutModel::new(&whole, &cuts, vec![(0, BodyId(0)), (1, BodyId(0))]).expect("pieces");
    assert_eq!(cut.faces.iter().filter(|face| matches!(face, cut::Face::Cut(_))).count(), 1);
    let on_patches =
        cut.curves.iter().filter(|class| matches!(class, crate::ground::mesh::Class::Patch(_))).count();
    assert_eq!(on_patches, 4, "the cut ends on four sides of the cube, and at two edges of the hole");
    let whole = Geometry::from(Model::Csg(Box::new(whole)));
    let made = thread::run(2, |comm| {
        let model = (comm.rank() == 0).then_some(&whole);
        let made = generate(comm, model, &settings(vec![along]), &Progress::new(&Silent));
        made.map(|made| (made.check.faults, made.check.volume)).map_err(|error| error.to_string())
    });
    for made in made.expect("no rank fails") {
        let (faults, volume) = made.expect("a mesh");
        assert!(faults == 0 && (volume - 7.0).abs() < 1e-12, "{faults} faults, volume {volume}");
    }
}

#[test]
fn the_text_of_the_pieces_is_a_geometry_of_the_same_volume_and_names() {
    let whole = model(PEARL);
    let cuts = Cuts::by_planes(&[plane([0.0, 0.0, 0.1], [0.0, 0.6, 0.8])], &statistics(&whole, 2));
    let pieces: Vec<(usize, BodyId)> =
        [0, 1].into_iter().flat_map(|part| [0, 1].map(|b| (part, BodyId(b)))).collect();
    let text = geo_text(PEARL, &whole.geometry, &cuts, &pieces);
    let parsed = csg::language::parse_geometry(&text, "cut.geo").expect("a geometry");
    assert!(parsed.warnings.is_empty(), "{:?}", parsed.warnings);
    let materials: Vec<_> = parsed.geometry.bodies.iter().filter_map(|body| body.material.clone()).collect();
    assert_eq!(materials, ["lime", "box", "lime", "box"]);
    let cut = CsgModel::new(parsed.geometry).expect("features");
    let sphere = cut.features.patches.iter().filter(|patch| patch.name.as_deref() == Some("skin")).count();
    assert_eq!(sphere, 2);
}

#[test]
fn a_skin_is_the_same_after_a_message() {
    let skin = |sources: &[u32]| -> Skin {
        let mut skin = Skin { names: vec![3, 9], on_triangles: 1, ..Skin::default() };
        skin.points = vec![Point::new(1.0, 2.0, 3.0), Point::new(-0.0, 5e-324, 1e300)];
        skin.classes = vec![
            crate::ground::mesh::Class::Curve(csg::CurveId(4)),
            crate::ground::mesh::Class::Body(BodyId(1)),
        ];
        skin.triangles = vec![crate::parallel::skin::SkinTriangle {
            vertices: [0, 1, 0],
            beside: [Some(BodyId(1)), None],
            patch: Some((csg::PatchId(2), false)),
        }];
        skin.edges = vec![([0, 1], crate::ground::mesh::Class::Patch(csg::PatchId(7)))];
        skin.shared.push(1, sources.iter().copied());
        skin
    };
    let sent = skin(&[0, 2]);
    let message = pack(&sent);
    let mut rest = &message[..];
    assert_eq!(format!("{:?}", unpack(&mut rest)), format!("{sent:?}"));
    assert!(rest.is_empty());
}

#[test]
fn pieces_meshed_each_on_its_rank_are_one_mesh() {
    let whole = Geometry::from(Model::Csg(Box::new(model(PEARL))));
    for (ranks, planes) in [(1, vec![]), (5, vec![]), (2, vec![plane([0.0, 0.0, 0.1], [0.0, 0.6, 0.8])])] {
        let settings = settings(planes);
        let made = thread::run(ranks, |comm| {
            let model = (comm.rank() == 0).then_some(&whole);
            let made = generate(comm, model, &settings, &Progress::new(&Silent))
                .map_err(|error| error.to_string())?;
            Ok::<_, String>((
                made.check.faults,
                made.checksum.open,
                made.check.volume,
                made.part.stream().counts().tets,
            ))
        });
        for made in made.expect("no rank fails") {
            let (faults, open, volume, tets) = made.expect("a mesh");
            assert_eq!((faults, open), (0, 0));
            assert!((volume - 64.0).abs() < 1e-11, "{ranks} ranks: {volume}");
            assert!(tets > 0);
        }
    }
}

#[test]
fn planes_that_miss_the_geometry_are_refused() {
    let settings = settings(vec![plane([9.0; 3], [0.0, 0.0, 1.0])]);
    let whole = Geometry::from(Model::Csg(Box::new(model(BAR))));
    let refused = thread::run(2, |comm| {
        let model = (comm.rank() == 0).then_some(&whole);
        generate(comm, model, &settings, &Progress::new(&Silent))
            .map(|_| ())
            .map_err(|error| error.to_string())
    });
    for refused in refused.expect("no rank panics") {
        assert!(refused.expect_err("one piece for two parts").contains("1 pieces, for 2 parts"));
    }
}

#[test]
fn tets_between_cuts_that_nearly_touch_are_improved_across_them() {
    let whole = Geometry::from(Model::Csg(Box::new(model(BAR))));
    // A slab a tenth as thick as the edges of the mesh.
    let planes = [1.9, 1.95].map(|x| plane([x, 0.0, 0.0], [1.0, 0.0, 0.0]));
    let made = thread::run(3, |comm| {
        let model = (comm.rank() == 0).then_some(&whole);
        let made = generate(comm, model, &settings(planes.to_vec()), &Progress::new(&Silent));
        let made = made.map_err(|error| error.to_string())?;
        Ok::<_, String>((made.check.faults, made.checksum.open, made.check.volume, made.across))
    });
    for made in made.expect("no rank fails") {
        let (faults, open, volume, across) = made.expect("a mesh");
        assert_eq!((faults, open), (0, 0));
        assert!((volume - 4.0).abs() < 1e-12, "{volume}");
        let across = across.expect("the slab has bad tets");
        assert!(across.smallest_before < 18.0 && across.smallest_after > 24.0, "{across:?}");
        assert!(across.merged > 0, "the slab leaves a narrow strip on the sides: {across:?}");
    }
}

/// For a part: the volume enclosed by its tet faces on patches; and for a ball of radius 1 the
/// maximum volume lost by chords.
fn enclosed(part: &dyn MeshStream) -> [f64; 2] {
    let mut block = BoundaryBlock::default();
    let (mut sixfold, mut between) = (0.0, 0.0);
    for index in 0..part.boundary_blocks() {
        part.boundary_block(index, &mut block);
        for (triangle, parents) in block.triangles.iter().zip(&block.parents) {
            let [a, b, c] = triangle.map(|v| Vector::from(part.points()[v as usize]));
            let sides = parents.map(|tet| f64::from(u8::from(tet != NO_TET)));
            sixfold += (sides[0] - sides[1]) * a.cross(&b).dot(&c);
            let normal = (b - a).cross(&(c - a));
            let from_centre = a.dot(&normal) / normal.norm();
            between += sides[0] * 0.5 * normal.norm() * (1.0 - from_centre);
        }
    }
    [sixfold / 6.0, between]
}

#[test]
fn parts_fill_what_their_surface_encloses_which_is_a_ball_but_for_the_chords() {
    let ball = "algebraic3d\nsolid ball = sphere (0, 0, 0; 1);\ntlo ball;";
    let whole = Geometry::from(Model::Csg(Box::new(model(ball))));
    let exact = 4.0 / 3.0 * std::f64::consts::PI;
    for method in [Method::Surface, Method::Decompose(CutSettings::default())] {
        let settings = GenerateSettings { method, wanted: Wanted::Sizes { pieces: 2 }, ..settings(vec![]) };
        let made = thread::run(5, |comm| {
            let model = (comm.rank() == 0).then_some(&whole);
            let made = generate(comm, model, &settings, &Progress::new(&Silent));
            made.map(|made| (made.check.volume, enclosed(made.part.stream())))
                .map_err(|error| error.to_string())
        });
        let made: Result<Vec<_>, String> = made.expect("no rank fails").into_iter().collect();
        let made = made.expect("a mesh");
        let volume = made[0].0;
        let [enclosed, between] = [0, 1].map(|k| made.iter().map(|part| part.1[k]).sum::<f64>());
        assert!((volume / enclosed - 1.0).abs() < 1e-12, "{volume} {enclosed}");
        // The volume of a cap is at most its base on the surface times its height.
        assert!(volume < exact && exact - volume < 1.1 * between, "{volume} of {exact}, chords {between}");
    }
}

/// A geometry of the repository.
fn own(name: &str) -> CsgModel {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("geometries/{name}.geo"));
    model(&std::fs::read_to_string(path).unwrap())
}

#[test]
fn planes_cut_periodic_faces_and_their_copies_alike() {
    for name in ["unit_cell", "sheared_cell", "rotor_sector"] {
        let model = own(name);
        for parts in [2, 3, 5, 8] {
            let statistics = statistics(&model, parts);
            let cuts = plan(&statistics, parts, &PlanSettings::default()).unwrap();
            assert_eq!(cuts.leaves.len(), parts as usize, "{name}");
            for faces in &statistics.periodic {
                let neighbours = faces.neighbours();
                assert!(!neighbours.is_empty(), "{name}");
                // A cut between two triangles is one between their copies. Faces that do not touch
                // may be in one part, and their copies in two.
                for [[one, its_copy], [other, other_copy]] in neighbours {
                    let is_cut = |a: &Point, b: &Point| cuts.leaf_of(a) != cuts.leaf_of(b);
                    let are_alike = is_cut(&one, &other) == is_cut(&its_copy, &other_copy);
                    assert!(are_alike, "{name} in {parts} parts at {one} and {other}");
                }
            }
        }
    }
}

#[test]
fn periodic_faces_stay_with_their_copies_on_request() {
    let together = PlanSettings { together: true, ..PlanSettings::default() };
    for name in ["sheared_cell", "rotor_sector"] {
        let statistics = statistics(&own(name), 4);
        let cuts = plan(&statistics, 4, &together).unwrap();
        assert_eq!((cuts.leaves.len(), statistics.separated(&cuts)), (4, 0), "{name}");
        let apart = plan(&statistics, 4, &PlanSettings::default()).unwrap();
        assert!(statistics.separated(&apart) > 0, "{name}");
    }
    // Each plane between faces that are periodic in three directions separates some.
    let mut statistics = statistics(&own("unit_cell"), 2);
    assert_eq!(plan(&statistics, 2, &together), Err(TooManyParts::Separated(2)));
    statistics.periodic.clear();
    assert_eq!(plan(&statistics, 2, &together).unwrap().leaves.len(), 2);
}

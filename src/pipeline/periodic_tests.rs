//! Tests of periodic geometries from the file to the fine mesh.

use crate::files::{elmer, serial};
use crate::ground::comm::thread;
use crate::ground::mesh::periodic::{self, PeriodicMap};
use crate::ground::progress::{Progress, Silent, Work};
use crate::ground::size::{PeriodicSize, Preset, SizeField, SizeSettings, Source};
use crate::pipeline::model::Model;
use crate::pipeline::retries::Budget;
use crate::pipeline::{CoarseSettings, GenerateSettings, Generated, Geometry, Method, Wanted, generate};
use crate::{Point, Vector};
use std::path::Path;

fn model(name: &str) -> Geometry {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("geometries").join(name).with_extension("geo");
    model_of(&std::fs::read_to_string(path).unwrap())
}

fn model_of(source: &str) -> Geometry {
    let parsed = csg::language::parse_geometry(source, "t.geo").unwrap_or_else(|error| panic!("{error}"));
    Geometry::from_csg(parsed.geometry).unwrap()
}

fn settings(levels: u32, sources: &[Source]) -> GenerateSettings {
    let size = SizeSettings { sources: sources.to_vec(), ..Preset::VeryCoarse.into() };
    GenerateSettings {
        method: Method::Refine,
        coarse: CoarseSettings::from(size),
        wanted: Wanted::Sizes { pieces: 1 << levels },
        refine: 0,
        memory: None,
        disk: None,
        nested: false,
        allow_off_surface: false,
        periodic_together: false,
    }
}

fn made(model: &Geometry, ranks: u32, levels: u32) -> Vec<Generated> {
    let run = |comm: &dyn crate::ground::comm::Communicator| {
        let model = (comm.rank() == 0).then_some(model);
        generate(comm, model, &settings(levels, &[]), &Progress::new(&Silent)).unwrap()
    };
    thread::run(ranks, run).unwrap()
}

/// Geometries of our own, with the boundary numbers of their periodic copies.
const GEOMETRIES: [(&str, usize); 3] = [("unit_cell", 6), ("sheared_cell", 2), ("rotor_sector", 1)];

#[test]
fn images_are_where_the_motions_put_them_at_every_level_and_on_every_rank() {
    for (name, links) in GEOMETRIES {
        let model = model(name);
        let mut ids_of_pairs = Vec::new();
        for (ranks, levels) in [(1, 0), (1, 2), (3, 2)] {
            let parts = made(&model, ranks, levels);
            assert_eq!(parts[0].part.stream().links().len(), links, "{name}");
            let mut pairs = Vec::new();
            for Generated { part, periodic, .. } in &parts {
                let (part, checked) = (part.stream(), periodic.expect("faces are periodic"));
                assert!(checked.lost == 0 && checked.furthest < 1e-14, "{name}: {checked:?}");
                for index in 0..links {
                    let ids =
                        part.images(index).into_iter().map(|(local, of)| (index, part.vertex_id(local), of));
                    pairs.extend(ids);
                }
            }
            pairs.sort_unstable();
            pairs.dedup();
            assert!(pairs.len() > 4 << (2 * levels), "{name}: {} pairs", pairs.len());
            ids_of_pairs.push(pairs);
        }
        assert_eq!(ids_of_pairs[1], ids_of_pairs[2], "{name}: the pairs do not depend on the ranks");
    }
}

#[test]
fn all_corners_of_a_cell_are_one_vertex_in_the_end() {
    let parts = made(&model("unit_cell"), 1, 1);
    let part = parts[0].part.stream();
    let origins = part.masters();
    let corner = |p: &[f64; 3]| p.iter().all(|&x| x == 0.0 || x == 1.0);
    let mut first: Vec<u64> =
        origins.iter().filter(|(v, _)| corner(&part.points()[*v as usize])).map(|o| o.1).collect();
    assert_eq!(first.len(), 7);
    first.dedup();
    let [first] = first[..] else { panic!("{first:?}") };
    assert_eq!(part.points()[first as usize], [0.0; 3]);
    assert!(origins.iter().all(|(_, of)| !origins.iter().any(|(image, _)| u64::from(*image) == *of)));
}

#[test]
fn a_size_wanted_at_one_face_is_the_size_at_its_image() {
    let Model::Csg(model) = model("unit_cell").model else { panic!("a geometry") };
    struct Fine;
    impl SizeField for Fine {
        fn size_at(&self, p: &Point) -> f64 {
            0.01 + 0.5 * (p - Point::new(1.0, 1.0, 0.5)).norm()
        }
    }
    let size = PeriodicSize::new(&Fine, &model.features, 0.5);
    for (x, y) in [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)] {
        assert!((size.size_at(&Point::new(x, y, 0.5)) - 0.01).abs() < 1e-12);
    }
}

#[test]
fn a_mesh_that_is_fine_at_one_face_is_fine_at_its_image() {
    let source = "algebraic3d solid l = plane (0,0,0; -1,0,0); solid r = plane (2,0,0; 1,0,0);
        solid b = l and r and plane (0,0,0; 0,-1,0) and plane (0,1,0; 0,1,0) and plane (0,0,0; 0,0,-1) and plane (0,0,1; 0,0,1);
        tlo b; identify periodic l r;";
    let fine = [Source { point: Point::new(2.0, 0.5, 0.5), size: 0.05 }];
    let alone = thread::alone();
    let progress = Progress::new(&Silent);
    let on_first = |sources: &[Source]| {
        let made = generate(&alone, Some(&model_of(source)), &settings(0, sources), &progress).unwrap();
        made.part.stream().points().iter().filter(|p| p[0] == 0.0).count()
    };
    assert!(on_first(&fine) > 5 * on_first(&[]));
}

#[test]
fn a_map_survives_its_encoding_and_a_mesh_that_is_not_periodic_has_none() {
    let model = model("rotor_sector");
    let mut settings = CoarseSettings::from(SizeSettings::from(Preset::VeryCoarse));
    let mut mesh =
        model.model.coarse_mesh(&mut settings, &Budget::default(), Work::unwatched()).unwrap().mesh;
    let Model::Csg(csg) = &model.model else { panic!("a geometry") };
    let map = PeriodicMap::of(&mesh, periodic::links(&csg.features), &csg.features.bounds).unwrap();
    assert_eq!(PeriodicMap::decode(&map.encode()), map);
    let image = map.pairs[0].0[0][0].image as usize;
    mesh.points[image] += Vector::new(1e-6, 0.0, 0.0);
    let error =
        PeriodicMap::of(&mesh, periodic::links(&csg.features), &csg.features.bounds).unwrap_err().to_string();
    assert!(error.contains("has no partner on patch"), "{error}");
}

/// The numbers on the lines of a file between two words.
fn block(text: &str, from: &str, to: &str) -> Vec<Vec<f64>> {
    let inner = text.split(from).nth(1).unwrap_or_else(|| panic!("no {from}")).split(to).next().unwrap();
    let numbers = |line: &str| line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    inner.trim().lines().map(numbers).collect()
}

#[test]
fn gmsh_and_netgen_files_hold_the_pairs() {
    let generated = made(&model("rotor_sector"), 1, 0).remove(0);
    let dir = tempfile::tempdir().unwrap();
    let read = |name: &str| {
        let path = dir.path().join(name);
        serial::write(generated.part.stream(), &generated.names, &path).unwrap();
        std::fs::read_to_string(path).unwrap()
    };
    let points = generated.part.stream().points();
    let point = |number: f64| Point::from(points[number as usize - 1]);
    let motion = generated.part.stream().links()[0].motion;
    let gmsh = block(&read("m.msh"), "$Periodic", "$EndPeriodic");
    // One link: its tags, the matrix, the number of pairs, the pairs.
    assert_eq!((gmsh[0][0], gmsh[1][0], gmsh[2].len()), (1.0, 2.0, 17));
    assert_eq!((gmsh[2][4], gmsh[2][16]), (motion.translation.x, 1.0));
    assert_eq!(gmsh[3][0] as usize, gmsh.len() - 4);
    for pair in &gmsh[4..] {
        assert!((motion * point(pair[1]) - point(pair[0])).norm() < 1e-14);
    }
    let text = read("m.vol");
    let netgen = block(&text, "identifications\n", "identificationtypes");
    assert_eq!(netgen[0][0] as usize, netgen.len() - 1);
    assert_eq!(netgen.len() - 1, gmsh.len() - 4);
    for line in &netgen[1..] {
        assert!((motion * point(line[0]) - point(line[1])).norm() < 1e-14 && line[2] == 1.0);
    }
    assert!(text.contains("identificationtypes\n1\n2\n"));
}

#[test]
fn pairs_are_those_of_the_whole_mesh_whatever_the_number_of_ranks() {
    let dir = tempfile::tempdir().unwrap();
    let model = model("unit_cell");
    let counts = [1, 3].map(|ranks| {
        let run = |comm: &dyn crate::ground::comm::Communicator| {
            let given = (comm.rank() == 0).then_some(&model);
            let made = generate(comm, given, &settings(1, &[]), &Progress::new(&Silent)).unwrap();
            for name in ["m.msh", "m.vol"] {
                let path = dir.path().join(name);
                let format = serial::Format::of(&path).unwrap();
                serial::write_joined(comm, made.part.stream(), &made.names, format, &path).unwrap();
            }
            made.part.stream().links().to_vec()
        };
        let links = thread::run(ranks, run).unwrap().remove(0);
        let read = |name: &str| std::fs::read_to_string(dir.path().join(name)).unwrap();
        let (gmsh, netgen) = (read("m.msh"), read("m.vol"));
        let nodes = block(&gmsh, "$Nodes", "$EndNodes");
        // After two lines of counts all vertex numbers, ascending from 1, then all coordinates.
        let places = &nodes[2 + nodes[0][1] as usize..];
        let place = |number: f64| Point::from_slice(&places[number as usize - 1]);
        let lines = block(&gmsh, "$Periodic", "$EndPeriodic");
        let mut rest = &lines[1..];
        let mut pairs = Vec::new();
        for link in &links {
            assert_eq!(rest[0], [2.0, f64::from(link.image.0) + 1.0, f64::from(link.of.0) + 1.0]);
            let count = rest[2][0] as usize;
            for pair in &rest[3..3 + count] {
                assert!((link.motion * place(pair[1]) - place(pair[0])).norm() < 1e-14);
            }
            pairs.push(count);
            rest = &rest[3 + count..];
        }
        assert!(rest.is_empty());
        let identified = block(&netgen, "identifications\n", "identificationtypes");
        assert_eq!(identified[0][0] as usize, identified.len() - 1);
        for line in &identified[1..] {
            let link = links.iter().find(|link| f64::from(link.identification) == line[2]).unwrap();
            assert!((link.motion * place(line[0]) - place(line[1])).norm() < 1e-14);
        }
        (pairs, identified.len())
    });
    assert_eq!(counts[0], counts[1]);
    assert!(counts[0].1 > 100);
}

#[test]
fn elmers_companion_file_pairs_its_own_numbers() {
    let dir = tempfile::tempdir().unwrap();
    let model = model("unit_cell");
    let run = |comm: &dyn crate::ground::comm::Communicator| {
        let given = (comm.rank() == 0).then_some(&model);
        let made = generate(comm, given, &settings(1, &[]), &Progress::new(&Silent)).unwrap();
        crate::files::elmer::write(comm, made.part.stream(), &made.names, dir.path()).unwrap();
        let motions: Vec<_> =
            made.part.stream().links().iter().map(|link| (link.identification, link.motion)).collect();
        motions
    };
    let motions = thread::run(3, run).unwrap().remove(0);
    let mut points = std::collections::BTreeMap::new();
    for part in 1..=3 {
        let nodes =
            std::fs::read_to_string(dir.path().join(format!("partitioning.3/part.{part}.nodes"))).unwrap();
        for line in nodes.lines() {
            let words: Vec<f64> = line.split_whitespace().map(|word| word.parse().unwrap()).collect();
            points.insert(words[0] as u64, Point::new(words[2], words[3], words[4]));
        }
    }
    let file = dir.path().join("partitioning.3/mesh.periodic");
    let text = std::fs::read_to_string(&file).unwrap();
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let [image, of, number] = line.split(' ').map(|word| word.parse().unwrap()).collect::<Vec<u64>>()[..]
        else {
            panic!("{line}")
        };
        let motion =
            motions.iter().find(|(identification, _)| u64::from(*identification) == number).unwrap().1;
        assert!((motion * points[&of] - points[&image]).norm() < 1e-14, "{line}");
    }
    assert!(text.lines().count() > 100);
    let faults = || crate::files::elmer::check_elmer(dir.path()).unwrap().remove(0).1;
    assert!(faults().is_empty(), "{}", faults());
    let wrong = text
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| line.split_once(' ').unwrap().0)
        .max()
        .unwrap();
    std::fs::write(&file, format!("{text}{wrong} {wrong} 1\n999999 1 1\n")).unwrap();
    let said = faults().to_string();
    assert!(
        said.contains("periodic nodes that do not match: 1") && said.contains("node that the part lacks: 1"),
        "{said}"
    );
}

#[test]
fn netgen_files_hold_singular_points_and_faces() {
    let source = "algebraic3d solid top = plane (0,0,1; 0,0,1); solid right = plane (1,0,0; 1,0,0); solid front = plane (0,0,0; 0,-1,0);
        solid box = orthobrick (0,0,0; 1,1,1) and top and right and front; tlo box;
        singular face box top -factor=3; singular point top right front -factor=2;";
    let model = model_of(source);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("m.vol");
    // The corner may be on any rank, not only on rank 0.
    for ranks in [1, 4] {
        let run = |comm: &dyn crate::ground::comm::Communicator| {
            let given = (comm.rank() == 0).then_some(&model);
            let made = generate(comm, given, &settings(1, &[]), &Progress::new(&Silent)).unwrap();
            let format = serial::Format::of(&path).unwrap();
            serial::write_joined(comm, made.part.stream(), &made.names, format, &path).unwrap();
        };
        thread::run(ranks, run).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let points = block(&text, "singular_points\n", "singular_face_inside");
        let [count, point] = &points[..] else { panic!("{points:?}") };
        assert_eq!((count[0], point[1]), (1.0, 2.0));
        assert_eq!(block(&text, "\npoints\n", "singular_points")[point[0] as usize], [1.0, 0.0, 1.0]);
        assert!(block(&text, "singular_face_outside\n", "materials")[1][1] == 3.0);
    }
}

#[test]
fn cells_far_from_the_origin_and_of_any_size_are_periodic() {
    for (at, size) in [(1e6, 1.0), (0.0, 1e-6), (-3e5, 1e6)] {
        let far = at + size;
        let source = format!(
            "algebraic3d solid l = plane ({at},0,0; -1,0,0); solid r = plane ({far},0,0; 1,0,0);
            solid ball = sphere ({at},{half},{half}; {radius});
            solid b = l and r and plane (0,0,0; 0,-1,0) and plane (0,{size},0; 0,1,0) and plane (0,0,0; 0,0,-1)
            and plane (0,0,{size}; 0,0,1) and not ball and not translate ({size},0,0; ball); tlo b; identify periodic l r;",
            half = 0.5 * size,
            radius = 0.3 * size,
        );
        let checked = made(&model_of(&source), 2, 1)[0].periodic.unwrap();
        assert!(checked.lost == 0 && checked.pairs > 30, "{source}: {checked:?}");
    }
}

#[test]
fn periodic_meshes_of_files_are_refined_as_such_and_written_again() {
    let dir = tempfile::tempdir().unwrap();
    for (name, links) in GEOMETRIES {
        let first = made(&model(name), 1, 0).remove(0);
        for ending in ["msh", "vol"] {
            let path = dir.path().join(format!("{name}.{ending}"));
            serial::write(first.part.stream(), &first.names, &path).unwrap();
            let given = Geometry::from_file(&path).unwrap();
            let notes = given.notes();
            assert!(!notes.iter().any(|note| note.contains("periodic")), "{name}.{ending}: {notes:?}");
            let checked = first.periodic.unwrap();
            let again = made(&given, 1, 0).remove(0);
            assert_eq!(again.part.stream().links().len(), links, "{name}.{ending}");
            assert_eq!(again.periodic.unwrap().pairs, checked.pairs, "{name}.{ending}");
            // Refined in parts, written and read again.
            let fine = made(&given, 3, 1).remove(0).periodic.unwrap();
            assert!(fine.lost == 0 && fine.pairs > 2 * checked.pairs && fine.furthest < 1e-12, "{fine:?}");
            serial::write(again.part.stream(), &again.names, &path).unwrap();
            let once_more = made(&Geometry::from_file(&path).unwrap(), 1, 0).remove(0);
            let motions = |made: &Generated| -> Vec<_> {
                let links = made.part.stream().links().iter();
                links.map(|l| (l.identification, l.of, l.image, l.motion)).collect()
            };
            assert_eq!(motions(&once_more), motions(&again), "{name}.{ending}");
        }
    }
}

#[test]
fn parts_have_periodic_faces_together_with_their_images() {
    for name in ["unit_cell", "rotor_sector"] {
        for ranks in [2, 5, 9] {
            let dir = tempfile::tempdir().unwrap();
            let model = model(name);
            let written = thread::run(ranks, |comm| {
                let model = (comm.rank() == 0).then_some(&model);
                let progress = Progress::new(&Silent);
                let coarse = CoarseSettings::from(SizeSettings::from(Preset::Moderate));
                let settings =
                    GenerateSettings { coarse, nested: false, periodic_together: true, ..settings(1, &[]) };
                let made = generate(comm, model, &settings, &progress).unwrap();
                elmer::write(comm, made.part.stream(), &made.names, dir.path()).unwrap();
                made.coarse.map(|coarse| (coarse.partition.lost_ties, coarse.partition.imbalance))
            });
            let (lost, imbalance) = written.unwrap()[0].unwrap();
            assert_eq!(lost, 0, "{name} in {ranks} parts");
            assert!(imbalance < 1.4, "{name} in {ranks} parts: {imbalance}");
            let (_, faults) = elmer::check_elmer(dir.path()).unwrap().remove(0);
            assert!(faults.is_empty(), "{name} in {ranks} parts: {faults}");
        }
    }
}

#[test]
fn periodic_partitions_of_elmer_are_read_as_such() {
    let model = model("rotor_sector");
    let pairs = made(&model, 1, 0)[0].periodic.unwrap().pairs;
    for ranks in [1, 3] {
        let dir = tempfile::tempdir().unwrap();
        let write = |comm: &dyn crate::ground::comm::Communicator| {
            let model = (comm.rank() == 0).then_some(&model);
            let made = generate(comm, model, &settings(0, &[]), &Progress::new(&Silent)).unwrap();
            elmer::write(comm, made.part.stream(), &made.names, dir.path()).unwrap();
        };
        thread::run(ranks, write).unwrap();
        let given = Geometry::from_file(dir.path()).unwrap();
        let notes = given.notes();
        assert!(!notes.iter().any(|note| note.contains("periodic")), "{notes:?}");
        let again = made(&given, 1, 0).remove(0);
        assert_eq!(again.part.stream().links().len(), 1, "{ranks} parts");
        assert_eq!(again.periodic.unwrap().pairs, pairs, "{ranks} parts");
        assert_eq!(made(&given, 2, 0).remove(0).coarse.unwrap().partition.lost_ties, 0);
    }
}

#[test]
fn parts_that_are_filled_separately_are_periodic_and_have_pairs_together() {
    for (name, links) in GEOMETRIES {
        for (ranks, refine) in [(1, 0), (3, 0), (4, 1)] {
            let dir = tempfile::tempdir().unwrap();
            let model = model(name);
            let run = |comm: &dyn crate::ground::comm::Communicator| {
                let model = (comm.rank() == 0).then_some(&model);
                let coarse = CoarseSettings::from(SizeSettings::from(Preset::Coarse));
                let settings = GenerateSettings {
                    method: Method::Surface,
                    coarse,
                    refine,
                    periodic_together: true,
                    ..settings(1, &[])
                };
                let made = generate(comm, model, &settings, &Progress::new(&Silent)).unwrap();
                elmer::write(comm, made.part.stream(), &made.names, dir.path()).unwrap();
                made
            };
            let parts = thread::run(ranks, run).unwrap();
            let what = format!("{name}, {ranks} ranks, refined {refine} times");
            assert!(parts.iter().all(|made| made.part.stream().links().len() == links), "{what}");
            let checked = parts[0].periodic.expect("faces are periodic");
            assert!(checked.lost == 0 && checked.furthest < 1e-14, "{what}: {checked:?}");
            assert!(checked.pairs > 16 << (2 * refine), "{what}: {checked:?}");
            let (_, faults) = elmer::check_elmer(dir.path()).unwrap().remove(0);
            assert!(faults.is_empty(), "{what}: {faults}");
        }
    }
}

#[test]
fn pieces_between_planes_are_periodic_too() {
    for (name, ranks, refine, together) in
        [("unit_cell", 4, 1, false), ("sheared_cell", 6, 0, false), ("rotor_sector", 3, 1, true)]
    {
        let model = model(name);
        let settings = GenerateSettings {
            method: Method::Decompose(Default::default()),
            refine,
            periodic_together: together,
            ..settings(0, &[])
        };
        let run = |comm: &dyn crate::ground::comm::Communicator| {
            let model = (comm.rank() == 0).then_some(&model);
            generate(comm, model, &settings, &Progress::new(&Silent)).unwrap()
        };
        let mut all = thread::run(ranks, run).unwrap();
        let first = all.remove(0);
        let periodic = first.periodic.as_ref().unwrap();
        assert!(
            periodic.pairs > 20 && periodic.lost == 0 && periodic.furthest < 1e-14,
            "{name}: {periodic:?}"
        );
        let lost = first.coarse.unwrap().partition.lost_ties;
        assert_eq!(lost == 0, together, "{name}");
    }
}

//! The public surface as programs use it: meshes in memory, on one rank and on several.

use std::collections::BTreeMap;
use tetmill::comm::thread;
use tetmill::error::{ErrorKind, HasKind, RefineError, RequestError};
use tetmill::mesh::{Arrays, By, EdgeId, FaceId, Sharing, VertexId, blocks};
use tetmill::{Error, Geometry, InputSettings, MeshArrays, Mesher, Method, SurfaceArrays};

const BALL: &str = "algebraic3d solid b = sphere (0, 0, 0; 1); tlo b;";

fn ball() -> Geometry {
    BALL.parse().expect("a geometry")
}

/// The corners and triangles of the unit cube, counterclockwise from outside, and the number of
/// each triangle's side.
fn cube() -> (Vec<[f64; 3]>, Vec<[u32; 3]>, Vec<u32>) {
    let points = (0..8).map(|i| [0, 1, 2].map(|axis| f64::from(i >> axis & 1))).collect();
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let numbers = (0..12).map(|triangle| 10 + triangle / 2).collect();
    (points, triangles, numbers)
}

#[test]
fn blocks_of_any_size_are_the_arrays() {
    let mesh = Mesher::new().levels(1).generate(&ball()).unwrap();
    let arrays = mesh.arrays();
    for size in [1, 7, 1000, usize::MAX] {
        let (mut tets, mut ids, mut bodies) = (Vec::new(), Vec::new(), Vec::new());
        for block in blocks::tets(mesh.stream(), size) {
            assert!(block.tets.len() <= size && block.first == tets.len() as u64);
            tets.extend(block.tets);
            ids.extend(block.ids);
            bodies.extend(block.bodies);
        }
        assert_eq!(
            (tets, ids, bodies),
            (arrays.tets.clone(), arrays.tet_ids.clone(), arrays.tet_bodies.clone())
        );
        let vertices = blocks::vertices(mesh.stream(), size);
        let points: Vec<[f64; 3]> = vertices.flat_map(|block| block.points).collect();
        assert_eq!(points, arrays.points);
        let vertices = blocks::vertices(mesh.stream(), size);
        assert_eq!(vertices.flat_map(|block| block.ids).collect::<Vec<_>>(), arrays.vertex_ids);
    }
}

#[test]
fn ranks_agree_on_who_holds_and_owns_a_vertex() {
    let ball = ball();
    let parts = thread::run(4, |comm| {
        let mesh = Mesher::new().levels(1).generate_on(comm, Some(&ball)).unwrap();
        let (arrays, sharing) = (mesh.arrays(), mesh.sharing());
        let mut copies = vec![1.0; arrays.points.len()];
        sharing.sum(comm, &mut copies).unwrap();
        let mut flags: Vec<bool> = (0..arrays.points.len()).map(|v| sharing.is_owned(v as u32)).collect();
        sharing.any(comm, &mut flags).unwrap();
        assert!(flags.iter().all(|&flag| flag), "each vertex has an owner");
        let vertices = 0..arrays.points.len() as u32;
        vertices
            .map(|v| {
                assert_eq!(copies[v as usize], sharing.holders(v).len() as f64);
                (arrays.vertex_ids[v as usize], sharing.holders(v).to_vec(), sharing.owner(v))
            })
            .collect::<Vec<_>>()
    });
    let mut known = BTreeMap::new();
    for (rank, part) in (0..).zip(parts.unwrap()) {
        for (id, holders, owner) in part {
            assert!(holders.contains(&rank) && holders.contains(&owner));
            assert_eq!(*known.entry(id).or_insert_with(|| (holders.clone(), owner)), (holders, owner));
        }
    }
    let (first, last) = (known.first_key_value().unwrap().0, known.last_key_value().unwrap().0);
    assert_eq!((*first, *last + 1), (0, known.len() as u64), "ids without gaps");
}

#[test]
fn edges_and_faces_are_numbered_over_all_ranks() {
    let ball = ball();
    for ranks in [1, 3] {
        let counts = thread::run(ranks, |comm| {
            let mesh = Mesher::new().levels(1).generate_on(comm, Some(&ball)).unwrap();
            let ghosts = mesh.ghosts(comm, By::Vertices).unwrap().tets.len();
            assert_eq!(ghosts > 0, comm.size() > 1);
            let mesh = mesh.with_edges_and_faces(comm).unwrap();
            mesh.check(comm).unwrap();
            mesh.totals
        });
        let totals = counts.unwrap()[0];
        let [v, e, f, t] = [totals.vertices, totals.edges, totals.faces, totals.tets].map(|n| n as i64);
        assert_eq!(v - e + f - t, 1, "Euler's number of a ball");
    }
}

#[test]
fn edges_and_faces_have_one_owner_each_and_ids_without_gaps() {
    let ball = ball();
    let refined = Mesher::new().max_size(0.6).levels(1);
    let surface = Mesher::new().max_size(0.6).method(Method::Surface);
    for mesher in [refined, surface] {
        let parts = thread::run(3, |comm| {
            let mesh = mesher.generate_on(comm, Some(&ball)).unwrap();
            let (arrays, sharing) = (mesh.arrays(), mesh.sharing());
            let mesh = mesh.with_edges_and_faces(comm).unwrap();
            let points: Vec<[f64; 3]> = mesh.points.iter().map(|&point| point.into()).collect();
            let tets: Vec<[u32; 4]> = mesh.tets.iter().map(|tet| tet.map(|v| v.0)).collect();
            assert_eq!((&points, &mesh.vertex_ids), (&arrays.points, &arrays.vertex_ids));
            assert_eq!((&tets, &mesh.tet_ids), (&arrays.tets, &arrays.tet_ids));
            let vertices = 0..points.len() as u32;
            assert!(vertices.into_iter().all(|v| mesh.owns_vertex(VertexId(v)) == sharing.is_owned(v)));

            let owned: Vec<bool> = (0..mesh.edges.len() as u32).map(|e| mesh.owns_edge(EdgeId(e))).collect();
            let mut copies = vec![1.0; owned.len()];
            mesh.shared_edges.sum(comm, &mut copies).unwrap();
            let mut flags = owned.clone();
            mesh.shared_edges.any(comm, &mut flags).unwrap();
            assert!(flags.iter().all(|&flag| flag), "each edge has an owner");
            let holders = |e: usize| mesh.edge_holders(EdgeId(e as u32)).len() as f64;
            assert!(copies.iter().enumerate().all(|(e, &copies)| copies == holders(e)));

            let ids = |ids: &[u64], owned: &dyn Fn(u32) -> bool| {
                (0..).zip(ids).filter(|(local, _)| owned(*local)).map(|(_, &id)| id).collect::<Vec<_>>()
            };
            let edges = ids(&mesh.edge_ids, &|e| owned[e as usize]);
            (edges, ids(&mesh.face_ids, &|f| mesh.owns_face(FaceId(f))), mesh.totals)
        });
        let (mut edges, mut faces, mut totals) = (Vec::new(), Vec::new(), None);
        for (of_rank, faces_of_rank, of_mesh) in parts.unwrap() {
            edges.extend(of_rank);
            faces.extend(faces_of_rank);
            totals = Some(of_mesh);
        }
        edges.sort_unstable();
        faces.sort_unstable();
        assert!(edges.into_iter().eq(0..totals.unwrap().edges));
        assert!(faces.into_iter().eq(0..totals.unwrap().faces));
    }
}

#[test]
#[should_panic(expected = "but the part of rank 0 has")]
fn a_slice_that_is_not_one_value_for_each_vertex_panics_with_a_sentence() {
    let mesh = Mesher::new().generate(&ball()).unwrap();
    let mut values = vec![0.0; mesh.arrays().points.len() - 1];
    let _ = mesh.sharing().sum(&thread::alone(), &mut values);
}

#[test]
fn a_boundary_is_found_by_its_name_and_a_misspelt_name_is_an_error() {
    let text = "algebraic3d solid b = sphere (0, 0, 0; 1) -bcname=wall; tlo b -material=air;";
    let mesh = Mesher::new().generate(&Geometry::from_text(text).unwrap()).unwrap();
    let wall = mesh.names.patches_named("wall").unwrap();
    assert!(mesh.arrays().triangle_patches.iter().all(|patch| wall.contains(patch)));
    assert_eq!(mesh.names.bodies_named("air").unwrap(), [mesh.arrays().tet_bodies[0]]);
    let error = mesh.names.patches_named("wal").unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Input);
    assert!(error.to_string().contains("did you mean `wall`?"), "{error}");
}

#[test]
fn surfaces_in_memory_keep_their_numbers_and_names() {
    let (points, triangles, numbers) = cube();
    let names = BTreeMap::from([(10, "floor".to_owned())]);
    let surface = SurfaceArrays { points: &points, triangles: &triangles, numbers: &numbers, names };
    let geometry = Geometry::from_surface(&surface, &InputSettings::default()).unwrap();
    let mesh = Mesher::new().max_size(0.4).generate(&geometry).unwrap();
    assert!((mesh.check.volume - 1.0).abs() < 1e-12);
    let labels: Vec<u32> = mesh.names.patches.iter().map(|patch| patch.number).collect();
    assert_eq!(labels, [10, 11, 12, 13, 14, 15]);
    assert_eq!(mesh.names.patches[0].name(), Some("floor"));
    let arrays = mesh.arrays();
    let on_floor = |k: &usize| arrays.triangle_patches[*k].index() == 0;
    for triangle in (0..arrays.triangles.len()).filter(on_floor).map(|k| arrays.triangles[k]) {
        assert!(triangle.iter().all(|&v| arrays.points[v as usize][2] == 0.0));
    }
}

#[test]
fn meshes_in_memory_are_refined_as_they_are() {
    let first = Mesher::new().generate(&ball()).unwrap().arrays();
    let given = MeshArrays { points: &first.points, tets: &first.tets, ..MeshArrays::default() };
    let geometry = Geometry::from_mesh(&given).unwrap();
    assert!(geometry.is_mesh());
    let fine = Mesher::new().levels(1).generate(&geometry).unwrap();
    assert_eq!(fine.check.tets, 8 * first.tets.len() as u64);
}

#[test]
fn arrays_that_do_not_fit_are_refused_with_the_place() {
    let (points, mut triangles, numbers) = cube();
    let refusal = |points: &[[f64; 3]], triangles: &[[u32; 3]], numbers: &[u32]| {
        let surface = SurfaceArrays { points, triangles, numbers, ..SurfaceArrays::default() };
        let error = Geometry::from_surface(&surface, &InputSettings::default()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Input);
        error.to_string()
    };
    assert_eq!(refusal(&points, &triangles, &numbers[..3]), "3 boundary numbers for 12 elements");
    let mut infinite = points.clone();
    infinite[2][1] = f64::INFINITY;
    assert!(refusal(&infinite, &triangles, &[]).starts_with("point 2: "));
    triangles[5][0] = 8;
    assert_eq!(refusal(&points, &triangles, &[]), "triangle 5 names point 8, and there are 8");
    triangles.pop();
    triangles[5][0] = 0;
    let surface = SurfaceArrays { points: &points, triangles: &triangles, ..SurfaceArrays::default() };
    let open = Geometry::from_surface(&surface, &InputSettings::default());
    assert!(matches!(open, Err(Error::Facets { .. })), "{:?}", open.map(|_| ()));
}

#[test]
fn text_with_errors_and_parts_without_tets_are_told_by_their_types() {
    let Err(Error::Language(diagnostics)) =
        Geometry::from_text("algebraic3d solid a = spere (0,0,0; 1); tlo a;")
    else {
        panic!("a misspelt primitive")
    };
    assert!(diagnostics.to_string().contains("spere"), "{diagnostics}");
    let ball = ball();
    let mesher = Mesher::new().max_size(1.0);
    let errors = thread::run(500, |comm| mesher.generate_on(comm, Some(&ball)).map(|_| ()).unwrap_err());
    let errors = errors.unwrap();
    assert!(matches!(errors[0], Error::Partition(_)), "{}", errors[0]);
    assert!(errors.iter().all(|error| error.kind() == ErrorKind::Input));
}

#[test]
fn parents_are_on_the_same_rank_and_lead_to_the_coarse_mesh() {
    let ball = ball();
    let checked = thread::run(3, |comm| {
        let mesh = Mesher::new().levels(3).nested().generate_on(comm, Some(&ball)).unwrap();
        let hierarchy = mesh.hierarchy().unwrap().expect("levels");
        assert_eq!(hierarchy.levels.len(), 4);
        for k in 1..4 {
            let (coarse, fine) = (Arrays::of(&*hierarchy.levels[k - 1]), Arrays::of(&*hierarchy.levels[k]));
            let parents = hierarchy.vertex_parents(k);
            assert_eq!(parents.len(), fine.points.len());
            let mut used = vec![false; coarse.points.len()];
            for (point, [p, q]) in fine.points.iter().zip(parents) {
                let [a, b] = [p, q].map(|v| coarse.points[v as usize]);
                let off: f64 = (0..3).map(|x| (point[x] - 0.5 * (a[x] + b[x])).powi(2)).sum();
                // Snapping to the sphere moves the middle of a chord by an eighth of its square.
                let chord: f64 = (0..3).map(|x| (a[x] - b[x]).powi(2)).sum();
                assert!(off.sqrt() <= 0.3 * chord, "{point:?} between {a:?} and {b:?}");
                if p == q {
                    assert_eq!(*point, a);
                    used[p as usize] = true;
                }
            }
            assert!(used.iter().all(|&used| used), "each vertex stays on the next level");
            let mut children = vec![0; coarse.tets.len()];
            hierarchy.tet_parents(k).expect("nested").iter().for_each(|&t| children[t as usize] += 1);
            assert!(children.iter().all(|&count| count == 8));
            assert_eq!(Sharing::of(&*hierarchy.levels[k]).neighbours().len(), 2);
        }
        comm.barrier().unwrap();
    });
    assert_eq!(checked.unwrap().len(), 3);
}

#[test]
fn a_failed_run_has_the_error_of_rank_0_and_options_that_differ_have_their_name() {
    let ball = ball();
    let refused = thread::try_run(3, |comm| -> Result<u64, Error> {
        Ok(Mesher::new().levels(11).generate_on(comm, Some(&ball))?.check.tets)
    });
    assert!(matches!(refused, Err(Error::Refine(RefineError::Pieces { n: 2048, .. }))), "{refused:?}");
    let refused = thread::try_run(3, |comm| -> Result<u64, Error> {
        Ok(Mesher::new().levels(comm.rank()).generate_on(comm, Some(&ball))?.check.tets)
    });
    let Err(Error::Request(RequestError::OtherSettings { rank: 1, option })) = refused else {
        panic!("{refused:?}")
    };
    assert!(option.contains("levels"), "{option}");
    let refused = thread::try_run(3, |comm| Mesher::new().generate_on(comm, None).map(|_| ()));
    assert!(matches!(refused, Err(Error::Request(RequestError::NoGeometry))), "{refused:?}");
    let refused = Mesher::new().max_size(0.0).generate(&ball).map(|_| ());
    assert!(
        matches!(refused, Err(Error::Request(RequestError::Option { name: "max_size", .. }))),
        "{refused:?}"
    );
}

#[test]
fn notes_have_no_prefix() {
    struct Notes(std::sync::Mutex<Vec<String>>);
    impl tetmill::progress::Observer for Notes {
        fn note(&self, text: &str) {
            self.0.lock().unwrap().push(text.to_owned());
        }
    }
    let notes = Notes(Default::default());
    let mesher = Mesher::new().levels(4).observer(&notes);
    mesher.memory(2_000_000).generate(&ball()).unwrap();
    let notes = notes.0.into_inner().unwrap();
    assert!(!notes.is_empty() && notes.iter().all(|text| !text.starts_with("note")), "{notes:?}");
}

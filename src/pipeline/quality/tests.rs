use super::*;
use crate::ground::mesh::VertexId;
use crate::ground::mesh::fixtures::lattice_cube;
use csg::BodyId;

fn regular() -> [Point; 4] {
    [[1., 1., 1.], [-1., 1., -1.], [1., -1., -1.], [-1., -1., 1.]].map(Point::from)
}

#[test]
fn the_regular_tet_has_badness_one_and_its_radius_edge_ratio() {
    assert!((netgen_badness(&regular()) - 1.0).abs() < 1e-12, "{}", netgen_badness(&regular()));
    assert!((radius_edge_ratio(&regular()) - 0.375_f64.sqrt()).abs() < 1e-12);
    let [a, b, c, d] = regular();
    assert_eq!(netgen_badness(&[b, a, c, d]), WORST_BADNESS);
}

#[test]
fn the_cube_in_six_tets_is_as_netgen_counts_it() {
    // A Kuhn tet of the unit cube: edges 1, 1, 1, √2, √2, √3, so Q = 10 and V = 1/6.
    let quality = measure(&lattice_cube(1));
    assert_eq!((quality.tets, quality.vertices, quality.boundary, quality.bodies), (6, 8, 12, 1));
    assert!((quality.volume - 1.0).abs() < 1e-14);
    let badness = 216_f64.sqrt() / (6_f64.powi(4) * 2_f64.sqrt()) * 1000_f64.sqrt() * 6.0;
    assert!((quality.mean_badness - badness).abs() < 1e-12);
    assert!((quality.total_badness - 6.0 * badness).abs() < 1e-11);
    // 1/badness is 0.657, between 13/20 and 14/20.
    assert_eq!(quality.badness_histogram[13], 6);
    assert!(
        (quality.smallest_dihedral - 45.0).abs() < 1e-9 && (quality.largest_dihedral - 90.0).abs() < 1e-9
    );
    assert!((quality.median_dihedral - 45.0).abs() < 1e-9);
    assert!((quality.worst_radius_edge - 0.75_f64.sqrt()).abs() < 1e-12);
    assert_eq!(quality.inverted, 0);
    assert_eq!(quality.smallest_dihedral_histogram.iter().sum::<usize>(), 6);
}

#[test]
fn percentiles_are_of_the_tets_smallest_angles() {
    // 99 regular tets and one flat one, which is the 1st percentile but not the 5th.
    let mut mesh = Mesh { points: regular().to_vec(), ..Mesh::default() };
    mesh.points.extend([[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0.3, 0.3, 0.01]].map(Point::from));
    mesh.tets = vec![[0, 1, 2, 3].map(VertexId); 99];
    mesh.tets.push([4, 5, 6, 7].map(VertexId));
    mesh.bodies = vec![BodyId(0); 100];
    let quality = measure(&mesh);
    assert!(quality.smallest_dihedral < 3.0);
    assert_eq!(quality.first_percentile_dihedral, quality.smallest_dihedral);
    assert!((quality.fifth_percentile_dihedral - 70.528_779_365_509_31).abs() < 1e-9);
    assert_eq!(quality.smallest_dihedral_histogram[14], 99);
}

#[test]
fn an_inverted_tet_is_counted_and_the_worst_of_all() {
    let mut mesh = lattice_cube(2);
    mesh.tets[5].swap(0, 1);
    let quality = measure(&mesh);
    assert_eq!((quality.inverted, quality.smallest_dihedral, quality.largest_dihedral), (1, 0.0, 180.0));
    assert!(quality.worst_mean_ratio < 0.0);
    assert_eq!(quality.worst_badness, WORST_BADNESS);
    assert_eq!(quality.badness_histogram[0], 1);
}

#[test]
fn any_number_of_threads_measures_the_same_bits() {
    let mut mesh = lattice_cube(10);
    for (k, point) in mesh.points.iter_mut().enumerate() {
        point.x += 0.01 * (k as f64).sin();
    }
    let of = |threads| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| measure(&mesh))
    };
    assert!(mesh.tets.len() > CHUNK);
    assert_eq!(of(1), of(3));
}

#[test]
fn tables_and_pictures_have_a_column_or_line_for_each_mesh() {
    let named = |name: &str, n| Quality { mesh: name.into(), ..measure(&lattice_cube(n)) };
    let mut meshes = vec![named("a/cube.vtu", 1), named("b/cube.vtu", 2), named("b/x<y.msh", 3)];
    meshes[2].notes.push("all turned".into());
    let text = table(&meshes);
    let tets = text.lines().find(|line| line.starts_with("tets ")).unwrap();
    assert_eq!(tets.split_whitespace().collect::<Vec<_>>(), ["tets", "6", "48", "162"]);
    for expected in
        ["a/cube.vtu", "b/cube.vtu", "45° to 50°", "0.65 to 0.70", "x<y.msh: all turned", "45.00°"]
    {
        assert!(text.contains(expected), "no `{expected}` in\n{text}");
    }
    let svg = histograms(&meshes);
    assert_eq!(svg.matches("stroke-width=\"1.6\"").count(), 9);
    assert!(svg.contains("x&lt;y.msh: 162 tets") && svg.ends_with("</svg>\n"));
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
}

#[test]
fn a_mesh_without_tets_has_zeros() {
    let quality = measure(&Mesh::default());
    assert_eq!(
        (quality.tets, quality.volume, quality.smallest_dihedral, quality.mean_badness),
        (0, 0.0, 0.0, 0.0)
    );
}

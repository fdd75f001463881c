//! The writers through the public interface of the library.

use std::fs;
use tetmill::Point;
use tetmill::comm::thread;
use tetmill::files::{elmer, geomview, picture, serial, vtu};
use tetmill::internals::PlainPart;
use tetmill::mesh::{BoundaryTriangle, Class, Label, Mesh, Names, VertexId};

/// The unit cube around its centre: two tets and one patch on each side; the upper half is its own
/// part.
fn cube() -> (Mesh, Names, Vec<u32>) {
    let mut mesh = Mesh::default();
    for k in 0..8_u32 {
        mesh.points.push(Point::from([k & 1, k >> 1 & 1, k >> 2].map(f64::from)));
        mesh.classes.push(Class::Corner(csg::CornerId(k)));
    }
    mesh.points.push(Point::new(0.5, 0.5, 0.5));
    mesh.classes.push(Class::Body(csg::BodyId(0)));
    let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    for (patch, [a, b, c, d]) in sides.into_iter().enumerate() {
        for triangle in [[a, b, c], [a, c, d]] {
            let vertices = triangle.map(VertexId);
            mesh.triangles.push(BoundaryTriangle { vertices, patch: csg::PatchId::new(patch) });
            mesh.tets.push([VertexId(8), vertices[0], vertices[1], vertices[2]]);
            mesh.bodies.push(csg::BodyId(0));
        }
    }
    let patches = (1..=6).map(|k| Label::new(k, format!("side {k}"))).collect();
    let tet_to_rank = (0..12).map(|t| u32::from(t >= 10)).collect();
    (mesh, Names { bodies: vec![Label::new(1, "cube")], patches }, tet_to_rank)
}

#[test]
fn every_format_of_a_cube_in_two_parts_is_written_to_one_folder() {
    let (mesh, names, tet_to_rank) = cube();
    let dir = tempfile::tempdir().unwrap();
    thread::run(2, |comm| {
        let part = PlainPart::part(&mesh, &tet_to_rank, 2, comm.rank());
        elmer::write(comm, &part, &names, dir.path()).unwrap();
        vtu::write(comm, &part, &names, &dir.path().join("cube.vtu")).unwrap();
        geomview::write(comm, &part, &geomview::Settings::default(), &dir.path().join("skin")).unwrap();
    })
    .unwrap();
    for (layout, faults) in elmer::check_elmer(dir.path()).unwrap() {
        assert!(faults.is_empty(), "{layout:?}\n{faults}");
    }
    let mut found: Vec<_> = fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    found.sort();
    let expected =
        ["cube.boundary.pvtu", "cube.parts", "cube.pvtu", "mesh.names", "partitioning.2", "skin.list"];
    assert_eq!(found[..6], expected);
    assert_eq!(found[6..], ["skin.parts"]);
}

#[test]
fn one_part_is_written_in_each_format_and_drawn() {
    let (mesh, names, _) = cube();
    let part = PlainPart::whole(&mesh);
    let dir = tempfile::tempdir().unwrap();
    for end in ["vtu", "msh", "mesh", "vol", "off"] {
        let path = dir.path().join("cube").with_extension(end);
        let written = serial::write(&part, &names, &path).unwrap();
        assert!(written.bytes >= fs::metadata(&path).unwrap().len(), "{end}");
    }
    let look = picture::Look { color_by: picture::ColorBy::Patch, cut: None };
    let scene = picture::scene_of_part(&part, &look);
    assert_eq!(scene.triangles.len(), 12);
    let image = picture::render(&scene, &picture::Settings::default());
    let drawn = image.pixels.iter().filter(|pixel| **pixel != [255; 3]).count();
    assert!(drawn > image.pixels.len() / 4, "{drawn} pixels");
    picture::write_png(&image, &dir.path().join("cube.png")).unwrap();
}

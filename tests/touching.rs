//! Solids of CAD files that touch each other in lines and points.

use crate::folders::own;
use std::collections::{BTreeMap, BTreeSet};
use tetmill::comm::thread;
use tetmill::mesh::Arrays;
use tetmill::{Geometry, InputSettings, Mesher, Method};

/// The pairs of bodies that have common vertices, and the volume of each body.
fn common_vertices_and_volumes(arrays: &Arrays, bodies: usize) -> (BTreeSet<[usize; 2]>, Vec<f64>) {
    let mut at: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
    let mut volumes = vec![0.0; bodies];
    for (tet, body) in arrays.tet_bodies.iter().enumerate() {
        let [a, b, c, d] = arrays.corners(tet).map(tetmill::Point::from);
        volumes[body.index()] += (b - a).dot(&(c - a).cross(&(d - a))) / 6.0;
        for v in arrays.tets[tet] {
            at.entry(v as usize).or_default().insert(body.index());
        }
    }
    let pairs = |bodies: &BTreeSet<usize>| -> Vec<[usize; 2]> {
        let above =
            |&a: &usize| bodies.iter().filter(move |b| **b > a).map(move |&b| [a, b]).collect::<Vec<_>>();
        bodies.iter().flat_map(above).collect()
    };
    (at.values().flat_map(pairs).collect(), volumes)
}

#[test]
fn solids_that_touch_in_lines_and_points_are_meshed_each_by_itself() {
    // On a plate a roller that touches it in a line, a ball in a point, and a ring that stands on
    // it; in the bore of the ring a pin that touches it in a line.
    let path = own("step").with_extension("").join("rollers.step");
    let mut notes = Vec::new();
    let geometry =
        Geometry::read(&[&path], &InputSettings::default(), &mut |note| notes.push(note.to_owned())).unwrap();
    assert!(notes.iter().any(|note| note.contains("touch without a common face near (")), "{notes:?}");
    // By the CAD program.
    let exact = [60.0, 15.708, 9.2028, 16.085, 7.0882];
    let check = |arrays: &Arrays| {
        let (common, volumes) = common_vertices_and_volumes(arrays, 5);
        assert_eq!(common, BTreeSet::from([[0, 3]]), "the ring and the plate have a common face");
        for (found, exact) in volumes.iter().zip(exact) {
            assert!((found / exact - 1.0).abs() < 0.01, "{volumes:?}");
        }
    };
    let mesher = Mesher::new().levels(2);
    let mesh = mesher.generate(&geometry).unwrap();
    check(&mesh.arrays());
    let angle = mesh.coarse.as_ref().unwrap().report.quality.smallest_dihedral;
    assert!(angle > 20.0, "{angle}°");
    let together =
        thread::try_run(2, |comm| mesher.generate_on(comm, Some(&geometry)).map(|mesh| mesh.checksum));
    assert_eq!(together.unwrap(), vec![mesh.checksum; 2]);

    let surface = Mesher::new().method(Method::Surface).pieces(2);
    let parts = thread::try_run(2, |comm| {
        let part = surface.generate_on(comm, Some(&geometry))?;
        Ok::<_, tetmill::Error>(common_vertices_and_volumes(&part.arrays(), exact.len()))
    });
    let (common, volumes): (Vec<_>, Vec<_>) = parts.unwrap().into_iter().unzip();
    assert!(common.iter().flatten().all(|pair| *pair == [0, 3]), "{common:?}");
    for (body, exact) in exact.into_iter().enumerate() {
        let found: f64 = volumes.iter().map(|of| of[body]).sum();
        assert!((found / exact - 1.0).abs() < 0.05, "{body}: {found}");
    }
}

#[test]
fn solids_that_touch_and_overlap_are_refused() {
    // A pin as high as its hole and thicker by 2·10⁻⁵, and blocks with four pairs of sides in one
    // plane: none of their faces cross.
    for name in ["tight_pin", "flush_blocks"] {
        let path = own("step").with_extension("").join(name).with_extension("step");
        let error = Mesher::new().generate(&Geometry::from_file(path).unwrap()).unwrap_err().to_string();
        assert!(error.contains("the solids 1 (") && error.contains(") overlap, near ("), "{name}: {error}");
    }
}

//! Remeshed skins of a cube, a ball and a cylinder.

use super::tests::parts;
use super::*;
use crate::Point;
use crate::ground::comm::thread;
use crate::ground::mesh::{Class, Rank};
use crate::ground::size::UniformSize;
use crate::mesher::improve::Settings;
use crate::parallel::check::{PartReport, check, checksum_of_all};
use crate::parallel::distribution::{distribute, number_shared};
use crate::parallel::refine::fixtures::{Fixture, ball, cube, cylinder};
use crate::parallel::refine::{self, refine};
use csg::PatchId;
use std::collections::{BTreeMap, HashSet};

/// Parts of equal numbers of tets, one beside the other.
fn in_slabs(fixture: &Fixture, ranks: u32) -> Vec<Rank> {
    let Fixture { mesh, .. } = fixture;
    let middle = |t: &usize| mesh.tets[*t].iter().map(|v| mesh.points[v.index()].x).sum::<f64>();
    let mut order: Vec<usize> = (0..mesh.tets.len()).collect();
    order.sort_by(|s, t| middle(s).total_cmp(&middle(t)));
    let mut rank_of = vec![0; order.len()];
    (0..).zip(&order).for_each(|(k, &t)| rank_of[t] = (k * ranks as usize / order.len()) as Rank);
    rank_of
}

/// A skin remeshed with edges of this length, except on the patches to `stay`; `None` if nothing
/// may change.
fn remeshed(fixture: &Fixture, skin: &Skin, h: f64, stay: &HashSet<PatchId>) -> Option<Skin> {
    let free = FreeFaces::of(skin, &fixture.projector, stay)?;
    Some(free.remeshed(&UniformSize(h)).expect("a skin"))
}

/// Meshes parts inside their remeshed skins; returns the check report.
fn filled(fixture: &Fixture, n: u32, ranks: u32, h: f64) -> PartReport {
    let rank_of = in_slabs(fixture, ranks);
    let reports = thread::run(ranks, |comm| {
        let mesh = (comm.rank() == 0).then(|| (fixture.mesh.clone(), rank_of.clone()));
        let part = distribute(comm, mesh).expect("a classified mesh");
        let lattice = skin(&part, &fixture.projector, n).expect("a skin");
        let how = Improvement { settings: &Settings::default(), smoothness: None };
        let free = FreeFaces::of(&lattice.skin, &fixture.projector, &HashSet::new());
        let of_lattice = (&lattice, free.as_ref());
        let (remeshed, filled) =
            remesh_and_fill(&part, &fixture.projector, of_lattice, &UniformSize(h), how).expect("tets");
        assert_eq!((&filled.refused, &filled.kept), (&None, &None), "rank {}", comm.rank());
        let of_lattice = lattice.numbering.totals().boundary;
        let new = remeshed.unwrap_or_else(|| lattice.skin.clone());
        let boundary = boundary(comm, [&lattice.skin, &new], of_lattice).expect("all ranks");
        let bare = number(comm, new, filled, boundary).expect("all ranks");
        let whole = number_shared(comm, bare).expect("a mesh");
        whole.check(comm).expect("a distributed mesh");
        let mesh = refine(whole, &fixture.projector, 1, &refine::Settings::default()).expect("positive tets");
        let settings = crate::parallel::check::Settings::default();
        let report = check(comm, &mesh, Some(&fixture.projector), &settings).expect("all ranks");
        assert_eq!(checksum_of_all(comm, &mesh).expect("all ranks").open, 0, "each face is matched");
        report
    });
    reports.expect("no rank fails").swap_remove(0)
}

#[test]
fn parts_in_remeshed_skins_fit_and_fill_the_bodies() {
    let pi = std::f64::consts::PI;
    for (fixture, h, volume, error) in [
        (ball(1.0), 0.2, 4.0 / 3.0 * pi, 0.02),
        (cylinder(2), 0.2, f64::NAN, 0.02),
        (cube(4, true), 0.12, 1.0, 1e-12),
    ] {
        let finest = filled(&fixture, 3, 1, h).volume;
        for ranks in [1, 2, 5, 16] {
            let report = filled(&fixture, 3, ranks, h);
            assert_eq!(report.faults, 0, "{ranks} ranks: {:?}", report.described);
            let volume = if volume.is_nan() { finest } else { volume };
            assert!((report.volume / volume - 1.0).abs() < error, "{ranks} ranks: {}", report.volume);
        }
    }
}

/// The bits of a triangle's corners, in ascending order.
fn bits(skin: &Skin, triangle: &SkinTriangle) -> [[u64; 3]; 3] {
    let mut corners = triangle.vertices.map(|v| {
        let p = skin.points[v as usize];
        [p.x, p.y, p.z].map(f64::to_bits)
    });
    corners.sort_unstable();
    corners
}

#[test]
fn both_sides_of_an_interface_keep_their_triangles_and_names() {
    let fixture = ball(1.0);
    let mut seen = BTreeMap::new();
    let mut changed = 0;
    for part in parts(&fixture, &in_slabs(&fixture, 3)) {
        let old = skin(&part, &fixture.projector, 4).expect("a skin").skin;
        let new = remeshed(&fixture, &old, 0.6, &HashSet::new()).expect("triangles that may change");
        let shared = |skin: &Skin| -> Vec<_> {
            let vertex = |(v, holders): (u32, &[Rank])| {
                (skin.names[v as usize], skin.points[v as usize], skin.classes[v as usize], holders.to_vec())
            };
            skin.shared.iter().map(vertex).collect()
        };
        assert_eq!(shared(&old), shared(&new));
        changed += old.triangles.len() - new.triangles.len();
        for triangle in new.triangles.iter().filter(|t| t.patch.is_none()) {
            *seen.entry(bits(&new, triangle)).or_insert(0) += 1;
        }
    }
    assert!(seen.values().all(|&count| count == 2) && !seen.is_empty());
    assert!(changed > 50, "sizes of 0.6 need fewer triangles: {changed} fewer");
}

/// A cube whose lowest layer is a twentieth as high as wide: the triangles of its lattice there are
/// as narrow.
fn with_thin_layer() -> Fixture {
    let mut fixture = cube(2, false);
    fixture.mesh.points.iter_mut().filter(|p| p.z == 0.5).for_each(|p| p.z = 0.05);
    fixture
}

/// The smallest angle of the triangles on patches, degrees.
fn smallest_angle(skin: &Skin) -> f64 {
    let angle = |t: &SkinTriangle| {
        let p = t.vertices.map(|v| skin.points[v as usize]);
        let at = |k: usize| (p[(k + 1) % 3] - p[k]).angle(&(p[(k + 2) % 3] - p[k]));
        (0..3).map(at).fold(f64::INFINITY, f64::min).to_degrees()
    };
    skin.triangles.iter().filter(|t| t.patch.is_some()).map(angle).fold(f64::INFINITY, f64::min)
}

#[test]
fn triangles_across_a_thin_layer_are_no_longer_narrow() {
    let fixture = with_thin_layer();
    let old = skin(&parts(&fixture, &in_slabs(&fixture, 1))[0], &fixture.projector, 4).expect("a skin").skin;
    assert!(smallest_angle(&old) < 6.0);
    let new = remeshed(&fixture, &old, 0.1, &HashSet::new()).expect("triangles that may change");
    assert!(smallest_angle(&new) > 25.0, "{}", smallest_angle(&new));
}

/// Otherwise edges beside those would be halved without end, each time into flatter triangles.
#[test]
fn edges_that_stay_may_be_much_longer_than_the_wanted_size() {
    let fixture = cube(2, false);
    for part in parts(&fixture, &in_slabs(&fixture, 2)) {
        let old = skin(&part, &fixture.projector, 1).expect("a skin").skin;
        let new = remeshed(&fixture, &old, 0.06, &HashSet::new()).expect("triangles that may change");
        assert!(new.triangles.len() > 5 * old.triangles.len(), "{}", new.triangles.len());
        assert!(smallest_angle(&new) > 10.0, "{}", smallest_angle(&new));
    }
}

#[test]
fn corners_and_patches_that_are_to_stay_do() {
    let fixture = with_thin_layer();
    let old = skin(&parts(&fixture, &in_slabs(&fixture, 1))[0], &fixture.projector, 4).expect("a skin").skin;
    let bottom = old.triangles.iter().find(|t| t.vertices.iter().all(|&v| old.points[v as usize].z == 0.0));
    let (bottom, _) = bottom.and_then(|t| t.patch).expect("a triangle at the bottom");
    let stay = HashSet::from([bottom]);
    let new = remeshed(&fixture, &old, 0.1, &stay).expect("triangles that may change");
    let of = |skin: &Skin, patch: PatchId| -> Vec<_> {
        let on = skin.triangles.iter().filter(|t| t.patch.is_some_and(|(of, _)| of == patch));
        let mut on: Vec<_> = on.map(|t| bits(skin, t)).collect();
        on.sort_unstable();
        on
    };
    assert_eq!(of(&old, bottom), of(&new, bottom));
    let corners = |skin: &Skin| -> Vec<Point> {
        let corner = |(_, class): &(&Point, &Class)| matches!(class, Class::Corner(_));
        skin.points.iter().zip(&skin.classes).filter(corner).map(|(p, _)| *p).collect()
    };
    assert_eq!(corners(&old), corners(&new));
    assert_eq!(corners(&new).len(), 8);
    let all: HashSet<PatchId> =
        old.triangles.iter().filter_map(|t| t.patch).map(|(patch, _)| patch).collect();
    assert!(remeshed(&fixture, &old, 0.1, &all).is_none());
}

/// All edges of curves are in the list of edges, each with the class of its curve.
#[test]
fn curves_stay_curves() {
    for fixture in [cylinder(2), cube(4, false)] {
        let old =
            skin(&parts(&fixture, &in_slabs(&fixture, 1))[0], &fixture.projector, 3).expect("a skin").skin;
        let new = remeshed(&fixture, &old, 0.15, &HashSet::new()).expect("triangles that may change");
        let lengths = |skin: &Skin| {
            let mut lengths: BTreeMap<Class, f64> = BTreeMap::new();
            for ([a, b], class) in &skin.edges {
                let [a, b] = [a, b].map(|v| skin.points[*v as usize]);
                if matches!(class, Class::Curve(_)) {
                    *lengths.entry(*class).or_default() += (b - a).norm();
                }
            }
            lengths
        };
        let (before, after) = (lengths(&old), lengths(&new));
        assert!(!before.is_empty());
        assert!(before.keys().eq(after.keys()));
        assert!(before.values().zip(after.values()).all(|(a, b)| (a / b - 1.0).abs() < 0.05));
        let on = |p: &Point, class: &Class| match class {
            Class::Curve(curve) => (fixture.projector.project_curve(*curve, p).expect("a place") - p).norm(),
            Class::Patch(patch) => fixture.projector.patch_distance(*patch, p),
            _ => 0.0,
        };
        assert!(new.points.iter().zip(&new.classes).all(|(p, class)| on(p, class) < 1e-12));
    }
}

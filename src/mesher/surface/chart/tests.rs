use super::*;
use csg::primitive::{Cone, Cylinder, Nappe, Revolved, Sphere, Torus};

fn surfaces() -> Vec<Surface> {
    let axis = Vector::new(1.0, 2.0, -0.5).normalize();
    let point = Point::new(0.3, 0.1, 0.2);
    vec![
        Surface::Sphere(Sphere { center: point, radius: 2.0 }),
        Surface::Cylinder(Cylinder { point, axis, radius: 0.7 }),
        Surface::Cone(Cone { point, axis, radius: 0.7, slope: 0.4 }),
        Surface::Cone(Cone { point, axis, radius: 0.7, slope: -0.4 }),
        Surface::Torus(Torus { center: point, axis, major: 2.0, minor: 0.5 }),
        Surface::Nappe(Nappe { point, axis, radius: 0.7, slope: 0.4 }),
        Surface::Nappe(Nappe { point, axis, radius: 0.7, slope: -0.4 }),
        revolved(1.5),
        revolved(0.3),
        revolved(-0.3),
        sweep(Section::Ellipse(Ellipse { center: [0.1, 0.0], axis: [0.6, 0.8], radii: [0.5, 0.4] })),
    ]
}

fn sweep(section: Section) -> Surface {
    let (axis, start, up) = (Vector::z(), Vector::x(), Vector::new(0.48, 0.36, 0.8));
    Surface::Sweep(Sweep { center: Point::new(0.3, 0.1, 0.2), axis, start, radii: [1.2; 2], up, section })
}

fn revolved(distance: f64) -> Surface {
    let profile = Ellipse { center: [distance, 0.1], axis: [0.8, 0.6], radii: [1.0, 0.6] };
    Surface::Revolved(Revolved { point: Point::new(0.3, 0.1, 0.2), axis: Vector::z(), profile })
}

#[test]
fn a_start_has_only_positive_triangles_and_is_closed() {
    for surface in surfaces() {
        let chart = Chart::new(&surface, 1.0);
        for attempt in 0..3 {
            let start = chart.start([0.0, 1.0], attempt);
            for t in &start.triangles {
                let [a, b, c] = t.map(|v| start.sites[v as usize]);
                assert_eq!(chart.orient(&a, &b, &c), Sign::Positive, "{surface:?} {t:?}");
            }
            let edges = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
            let all: Vec<_> = start.triangles.iter().flat_map(edges).collect();
            assert!(all.iter().all(|&[a, b]| all.contains(&[b, a])));
        }
    }
}

#[test]
fn a_small_triangle_turns_in_the_chart_as_it_does_in_space() {
    let strip = sweep(Section::Line { normal: [0.28, 0.96], offset: 0.2 });
    for surface in surfaces().into_iter().chain([strip]) {
        for k in 0..40 {
            let t = f64::from(k);
            let near = Point::new(0.3 + t.sin() * 2.0, 0.1 + (2.3 * t).cos(), 0.2 + (1.7 * t).sin() * 0.9);
            let Ok(a) = surface.project(&near) else { continue };
            let n = surface.normal(&a);
            let [x, y] = frame(&n);
            let [b, c] = [x, y].map(|d| surface.project(&(a + d * 1e-3)).expect("near the surface"));
            let chart = Chart::new(&surface, nappe(&surface, &a));
            let [a, b, c] = [a, b, c].map(|p| chart.site(&surface, &p));
            assert_eq!(chart.orient(&a, &b, &c), Sign::Positive, "{surface:?} at {near}");
            assert_ne!(chart.orient(&a, &c, &b), Sign::Positive);
            let back = chart.point(&b).expect("a point that is no pole");
            assert_eq!(chart.orient(&a, &b, &c), Sign::Positive);
            assert!((surface.project(&back).expect("near the surface") - back).norm() < 1e-12);
            let middle = chart.middle(&a, &b).expect("no poles");
            assert!(surface.distance(&middle) < 1e-12, "{surface:?}");
        }
    }
}

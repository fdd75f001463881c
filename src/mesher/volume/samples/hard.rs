//! Closed surfaces that are hard to recover; all are valid unless stated otherwise.

use super::{BodyId, INSIDE, Point, Random, Soup, TET_FACES, Vector};
use std::collections::{BTreeMap, HashMap};
use std::f64::consts::TAU;

pub const A: Option<BodyId> = Some(BodyId(0));
pub const B: Option<BodyId> = Some(BodyId(1));

/// Stacked prisms of n sides, each rotated by `turn` relative to the one below.
///
/// Sides are bent inward along their diagonals if `turn` is negative, outward if positive. Between
/// the prisms are interfaces; the bodies alternate between 0 and 1. With three sides and a negative
/// turn it is the polyhedron of Schönhardt (1928), which has no tetrahedralisation without interior
/// points.
pub fn twisted_prisms(sides: u32, turn: f64, height: f64, layers: u32) -> Soup {
    let at = |i: u32, layer: u32| {
        let angle = TAU * f64::from(i % sides) / f64::from(sides) + turn * f64::from(layer);
        Point::new(angle.cos(), angle.sin(), height * f64::from(layer))
    };
    let body = |layer: u32| (layer < layers).then_some(BodyId(layer % 2));
    let mut soup = Soup::default();
    for layer in 0..=layers {
        let below = layer.checked_sub(1).and_then(body);
        for i in 1..sides - 1 {
            soup.add([at(0, layer), at(i, layer), at(i + 1, layer)], [below, body(layer)]);
        }
    }
    for layer in 0..layers {
        for i in 0..sides {
            let [a, b, c, d] = [at(i, layer), at(i + 1, layer), at(i + 1, layer + 1), at(i, layer + 1)];
            soup.add([a, b, d], [body(layer), None]);
            soup.add([b, c, d], [body(layer), None]);
        }
    }
    soup
}

/// The largest backward turn of a prism of n sides: there the diagonals of all sides intersect.
pub fn twist_limit(sides: u32) -> f64 {
    std::f64::consts::PI * (1.0 - 2.0 / f64::from(sides))
}

/// Boundary of random bodies in a lattice of n³ cubes of six tets each.
///
/// The lattice is scaled, sheared and bent so that it is far from Delaunay, and each tet is in some
/// body or none, so the surface touches itself in many places. Since it bounds tets, it can be
/// filled. Each face is split into `pieces`² triangles, as in uniform refinement.
pub fn lattice_skin(
    n: u32,
    squeeze: [f64; 3],
    shear: f64,
    bend: f64,
    pieces: u32,
    mut body: impl FnMut() -> Option<BodyId>,
) -> Soup {
    let at = |c: [u32; 3]| {
        let [x, y, z] = [0, 1, 2].map(|k| f64::from(c[k]) * squeeze[k]);
        // The map is triangular with constant diagonal, so all tets keep their volumes up to a
        // factor.
        Point::new(x, y + shear * x, z + shear * y + bend * (x * x + y * y))
    };
    let mut points = Vec::new();
    let mut number = HashMap::new();
    let mut tets = Vec::new();
    for i in 0..n * n * n {
        let base = [i % n, i / n % n, i / n / n];
        for path in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
            let mut tet = [base; 4];
            for (k, &axis) in path.iter().enumerate() {
                tet[k + 1] = tet[k];
                tet[k + 1][axis] += 1;
            }
            let tet = tet.map(|c| {
                *number.entry(c).or_insert_with(|| {
                    points.push(at(c));
                    points.len() as u32 - 1
                })
            });
            tets.push((tet, body()));
        }
    }
    skin_of(&points, &tets, pieces)
}

/// The faces between tets of different bodies or the outside, each split into `pieces`² triangles.
pub fn skin_of(points: &[Point], tets: &[([u32; 4], Option<BodyId>)], pieces: u32) -> Soup {
    let at = |v: u32| points[v as usize];
    let mut sides = BTreeMap::<[u32; 3], Vec<([u32; 3], Option<BodyId>)>>::new();
    for &(mut tet, body) in tets {
        let [a, b, c, d] = tet.map(at);
        if (b - a).cross(&(c - a)).dot(&(d - a)) < 0.0 {
            tet.swap(0, 1);
        }
        for face in TET_FACES {
            let face = face.map(|k| tet[k]);
            let mut key = face;
            key.sort_unstable();
            sides.entry(key).or_default().push((face, body));
        }
    }
    let mut soup = Soup::default();
    for (key, found) in &sides {
        let (face, behind) = found[0];
        let front = found.get(1).and_then(|other| other.1);
        if behind == front {
            continue;
        }
        // From the lower vertex, so that neighbours split a common edge at the same points.
        let place = |v: u32, w: u32, i: u32| {
            let (v, w, i) = if v < w { (v, w, i) } else { (w, v, pieces - i) };
            if i == pieces { at(w) } else { at(v) + (at(w) - at(v)) * (f64::from(i) / f64::from(pieces)) }
        };
        let [a, b, c] = *key;
        let inner = |i: u32, j: u32| match (i, j) {
            (i, 0) => place(a, b, i),
            (0, j) => place(a, c, j),
            (i, j) if i + j == pieces => place(b, c, j),
            (i, j) => {
                let weights = [pieces - i - j, i, j].map(|w| f64::from(w) / f64::from(pieces));
                Point::from(at(a).coords * weights[0] + at(b).coords * weights[1] + at(c).coords * weights[2])
            }
        };
        let even = (0..3).any(|k| face == [key[k], key[(k + 1) % 3], key[(k + 2) % 3]]);
        let regions = if even { [behind, front] } else { [front, behind] };
        for i in 0..pieces {
            for j in 0..pieces - i {
                soup.add([inner(i, j), inner(i + 1, j), inner(i, j + 1)], regions);
                if i + j + 1 < pieces {
                    soup.add([inner(i + 1, j), inner(i + 1, j + 1), inner(i, j + 1)], regions);
                }
            }
        }
    }
    soup
}

/// A block with n notches from below along y and n from above along x, whose edges nearly meet on
/// the saddle z = xy (after Chazelle 1984): every tetrahedralisation needs many interior points.
pub fn notched_block(n: usize, gap: f64) -> Soup {
    let side = n as f64 + 1.0;
    // Far enough that the sides of the notches, bent along their diagonals, do not reach the
    // saddle.
    let (low, high) = (-side, side * side + side);
    // The profile across the notches: position and, at the tip of a notch, its index.
    let mut profile = vec![(0.0, None)];
    for i in 1..=n {
        let x = i as f64;
        profile.extend([(x - 0.25, None), (x, Some(x)), (x + 0.25, None)]);
    }
    profile.push((side, None));
    let below = |(x, tip): (f64, Option<f64>), y: f64| Point::new(x, y, tip.map_or(low, |i| i * y - gap));
    let above = |(y, tip): (f64, Option<f64>), x: f64| Point::new(x, y, tip.map_or(high, |j| x * j + gap));
    let mut soup = Soup::default();
    for pair in profile.windows(2) {
        let [p, q] = [pair[0], pair[1]];
        soup.quad([below(p, 0.0), below(p, side), below(q, side), below(q, 0.0)], INSIDE);
        soup.quad([above(p, 0.0), above(p, side), above(q, side), above(q, 0.0)], INSIDE);
    }
    for end in [0.0, side] {
        let outward = if end > 0.0 { 1.0 } else { -1.0 };
        let mut outline: Vec<Point> = profile.iter().map(|&p| below(p, end)).collect();
        outline.extend([Point::new(side, end, high), Point::new(0.0, end, high)]);
        add_polygon(&mut soup, outline, Vector::y() * outward);
        let mut outline: Vec<Point> = profile.iter().map(|&p| above(p, end)).collect();
        outline.extend([Point::new(end, side, low), Point::new(end, 0.0, low)]);
        add_polygon(&mut soup, outline, Vector::x() * outward);
    }
    soup
}

/// Adds a polygon in a plane normal to an axis by ear clipping (Meisters 1975); its vertices may
/// have either orientation.
fn add_polygon(soup: &mut Soup, mut outline: Vec<Point>, outward: Vector) {
    let turn = |a: &Point, b: &Point, c: &Point| (b - a).cross(&(c - a)).dot(&outward);
    let area: f64 = (1..outline.len() - 1).map(|i| turn(&outline[0], &outline[i], &outline[i + 1])).sum();
    if area < 0.0 {
        outline.reverse();
    }
    while outline.len() >= 3 {
        let n = outline.len();
        let is_ear = |&i: &usize| {
            let [a, b, c] = [(i + n - 1) % n, i, (i + 1) % n].map(|k| outline[k]);
            let beside = |p: &Point| {
                [[a, b], [b, c], [c, a]].iter().any(|[s, t]| turn(s, t, p) < 0.0) || [a, b, c].contains(p)
            };
            turn(&a, &b, &c) > 0.0 && outline.iter().all(beside)
        };
        let i = (0..n).find(is_ear).expect("a polygon has an ear");
        soup.add([(i + n - 1) % n, i, (i + 1) % n].map(|k| outline[k]), INSIDE);
        outline.remove(i);
    }
}

/// A lens: two sheets of n×n squares over the unit square with a common outline, `gap` apart
/// inside.
///
/// The points of each sheet are perturbed independently and `flips` random edges of each are
/// flipped. The lens is in a box with body 1.
pub fn lens(n: usize, gap: f64, flips: usize, random: &mut Random) -> Soup {
    let mut soup = Soup::default();
    for upper in [false, true] {
        let mut points = Vec::new();
        for j in 0..=n {
            for i in 0..=n {
                let inside = i % n != 0 && j % n != 0;
                let shift = |random: &mut Random| {
                    if inside { 0.4 * (random.unit() - 0.5) } else { 0.0 }
                };
                let x = (i as f64 + shift(random)) / n as f64;
                let y = (j as f64 + shift(random)) / n as f64;
                let z = if !inside { 0.0 } else { gap * if upper { 0.5 } else { -0.5 } };
                points.push(Point::new(x, y, z));
            }
        }
        let at = |i: usize, j: usize| (j * (n + 1) + i) as u32;
        let mut triangles = Vec::new();
        for j in 0..n {
            for i in 0..n {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                // Corner squares are split through the corner, else both sheets would share a
                // triangle.
                let corner = |i: usize| (i == 0, i == n - 1);
                let along = match (corner(i), corner(j)) {
                    ((true, _), (true, _)) | ((_, true), (_, true)) => true,
                    ((true, _), (_, true)) | ((_, true), (true, _)) => false,
                    _ => upper,
                };
                if along {
                    triangles.extend([[a, b, c], [a, c, d]]);
                } else {
                    triangles.extend([[a, b, d], [b, c, d]]);
                }
            }
        }
        let turns = |a: u32, b: u32, c: u32| {
            let [a, b, c] = [a, b, c].map(|v: u32| points[v as usize]);
            (b - a).cross(&(c - a)).z > 1e-3 / (n * n) as f64
        };
        let on_outline = |v: u32| points[v as usize].z == 0.0;
        let allowed = |quad: [u32; 4]| {
            let [a, b, c, d] = quad;
            turns(a, b, c)
                && turns(a, c, d)
                && ![a, b, c].into_iter().all(on_outline)
                && ![a, c, d].into_iter().all(on_outline)
        };
        flip_at_random(&mut triangles, flips, random, allowed);
        let regions = if upper { [A, B] } else { [B, A] };
        for t in triangles {
            soup.add(t.map(|v| points[v as usize]), regions);
        }
    }
    soup.brick([-0.5; 3], [1.5; 3], 2, [B, None]);
    soup
}

/// Flips random edges where `allowed`: triangles a, b, d and b, c, d become a, b, c and a, c, d.
fn flip_at_random(
    triangles: &mut [[u32; 3]],
    flips: usize,
    random: &mut Random,
    allowed: impl Fn([u32; 4]) -> bool,
) {
    let mut beside: HashMap<[u32; 2], usize> = HashMap::new();
    for (t, &[a, b, c]) in triangles.iter().enumerate() {
        beside.extend([([a, b], t), ([b, c], t), ([c, a], t)]);
    }
    for _ in 0..flips {
        let t = (random.bits() % triangles.len() as u64) as usize;
        let k = (random.bits() % 3) as usize;
        let [d, a, b] = [0, 1, 2].map(|i| triangles[t][(i + k) % 3]);
        let Some(&other) = beside.get(&[b, d]) else { continue };
        let c = triangles[other].into_iter().find(|v| *v != b && *v != d).expect("a third corner");
        if a == c || beside.contains_key(&[a, c]) || beside.contains_key(&[c, a]) || !allowed([a, b, c, d]) {
            continue;
        }
        (triangles[t], triangles[other]) = ([a, b, c], [a, c, d]);
        beside.remove(&[b, d]);
        beside.remove(&[d, b]);
        beside.extend([
            ([a, b], t),
            ([b, c], t),
            ([c, a], t),
            ([a, c], other),
            ([c, d], other),
            ([d, a], other),
        ]);
    }
}

/// A sphere with random radii from 1 to `reach`, most of them small, and `flips` random edge flips.
///
/// It stays star-shaped about its centre, so it never intersects itself. With `outer`, it is in a
/// box with body 1.
pub fn spiked_ball(levels: u32, reach: f64, flips: usize, outer: bool, random: &mut Random) -> Soup {
    let mut ball = Soup::default();
    ball.sphere(Point::origin(), 1.0, levels, INSIDE);
    let points = ball.points.clone();
    let turns = |a: u32, b: u32, c: u32| {
        let [a, b, c] = [a, b, c].map(|v: u32| points[v as usize].coords);
        // Not degenerate up to rounding as seen from the centre.
        a.cross(&b).dot(&c) > 1e-6
    };
    flip_at_random(&mut ball.triangles, flips, random, |[a, b, c, d]| turns(a, b, c) && turns(a, c, d));
    let radii: Vec<f64> = points.iter().map(|_| reach.powf(random.unit().powi(4))).collect();
    let mut soup = Soup::default();
    for t in &ball.triangles {
        let corners = t.map(|v| Point::from(points[v as usize].coords * radii[v as usize]));
        soup.add(corners, if outer { [A, B] } else { INSIDE });
    }
    if outer {
        soup.brick([-1.1 * reach; 3], [1.1 * reach; 3], 2, [B, None]);
    }
    soup
}

/// A ball of rings of triangles whose size decreases geometrically to `finest` at one pole.
pub fn graded_ball(rings: u32, around: u32, finest: f64) -> Soup {
    let at = |i: u32, j: u32| {
        if i > rings {
            return Point::new(0.0, 0.0, -1.0);
        }
        let polar = 2.8 * (finest / 2.8).powf(1.0 - f64::from(i) / f64::from(rings));
        let turn = TAU * (f64::from(j % around) + 0.5 * f64::from(i % 2)) / f64::from(around);
        Point::new(polar.sin() * turn.cos(), polar.sin() * turn.sin(), polar.cos())
    };
    let mut soup = Soup::default();
    for j in 0..around {
        soup.add([Point::new(0.0, 0.0, 1.0), at(0, j), at(0, j + 1)], INSIDE);
        soup.add([at(rings, j), at(rings + 1, 0), at(rings, j + 1)], INSIDE);
        for i in 0..rings {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            // Odd rings are shifted by half a step.
            if i % 2 == 0 {
                soup.add([a, b, d], INSIDE);
                soup.add([b, c, d], INSIDE);
            } else {
                soup.add([a, b, c], INSIDE);
                soup.add([a, c, d], INSIDE);
            }
        }
    }
    soup
}

/// Unit cubes in a cubic grid, each in some body or none, which touch in edges and vertices.
///
/// Corners are shifted by up to `shift` in each coordinate (above 0.1 the surface may intersect
/// itself).
pub fn staircase(
    n: u32,
    shift: f64,
    random: &mut Random,
    mut body: impl FnMut(&mut Random) -> Option<BodyId>,
) -> Soup {
    let cells: Vec<Option<BodyId>> = (0..n * n * n).map(|_| body(random)).collect();
    let m = n + 1;
    let points: Vec<Point> = (0..m * m * m)
        .map(|i| {
            let shifts = [0; 3].map(|_| 2.0 * shift * (random.unit() - 0.5));
            Point::new(f64::from(i % m), f64::from(i / m % m), f64::from(i / m / m)) + Vector::from(shifts)
        })
        .collect();
    let cell = |c: [u32; 3]| {
        c.iter().all(|&x| x < n).then(|| cells[((c[2] * n + c[1]) * n + c[0]) as usize]).flatten()
    };
    let at = |c: [u32; 3]| points[((c[2] * m + c[1]) * m + c[0]) as usize];
    let mut soup = Soup::default();
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for i in 0..m * m * m {
            let base = [i % m, i / m % m, i / m / m];
            if base[u] == n || base[v] == n {
                continue;
            }
            let mut below = base;
            below[axis] = below[axis].wrapping_sub(1);
            let regions = [cell(below), cell(base)];
            if regions[0] == regions[1] {
                continue;
            }
            let corner = |i: u32, j: u32| {
                let mut c = base;
                (c[u], c[v]) = (c[u] + i, c[v] + j);
                at(c)
            };
            soup.quad([corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)], regions);
        }
    }
    soup
}

/// Point i of a regular polygon around the z axis.
fn on_ring(sides: u32, i: u32, radius: f64, z: f64) -> Point {
    let angle = TAU * f64::from(i % sides) / f64::from(sides);
    Point::new(radius * angle.cos(), radius * angle.sin(), z)
}

/// A tube of n sides, radius 1 and thickness `wall`, whose sides are needles `aspect` times as long
/// as wide, as CAD programs export cylinders.
pub fn needle_tube(sides: u32, aspect: f64, wall: f64) -> Soup {
    let height = aspect * TAU / f64::from(sides);
    let at = |i: u32, inner: bool, upper: bool| {
        on_ring(sides, i, if inner { 1.0 - wall } else { 1.0 }, if upper { height } else { 0.0 })
    };
    let mut soup = Soup::default();
    for i in 0..sides {
        let quad = |inner: [bool; 4], upper: [bool; 4]| {
            [0, 1, 2, 3].map(|k| at(i + u32::from(k == 1 || k == 2), inner[k], upper[k]))
        };
        soup.quad(quad([false; 4], [false, false, true, true]), INSIDE);
        soup.quad(quad([true; 4], [true, true, false, false]), INSIDE);
        soup.quad(quad([true, true, false, false], [false; 4]), INSIDE);
        soup.quad(quad([false, false, true, true], [true; 4]), INSIDE);
    }
    soup
}

/// A cone of n sides and radius 1 made of needles that meet in the apex, its base a fan of needles
/// from one corner.
pub fn needle_cone(sides: u32, aspect: f64) -> Soup {
    let apex = Point::new(0.0, 0.0, aspect * TAU / f64::from(sides));
    let at = |i: u32| on_ring(sides, i, 1.0, 0.0);
    let mut soup = Soup::default();
    for i in 0..sides {
        soup.add([at(i), at(i + 1), apex], INSIDE);
    }
    for i in 1..sides - 1 {
        soup.add([at(0), at(i + 1), at(i)], INSIDE);
    }
    soup
}

//! Curves divided into segments.
//!
//! A curve of metric length L = ∫ ds/h gets round(L) segments of equal metric length (Schöberl
//! 1997, section 3). It gets more if a segment would turn by more than 60°, if two curves would
//! become the same edge, or if a chord would come close to another curve.

use super::{SurfaceMesh, cusp};
use crate::ground::mesh::{Class, Segment, VertexId};
use crate::ground::size::{SizeField, Source};
use crate::{Point, Vector};
use csg::{CornerId, Curve, CurveId, Features, ProjectionFailed, Projector};
use std::collections::BTreeMap;

/// Largest turning angle of a segment (radians): a full circle has at least six, so that the chords
/// resemble it and lattice points are less than 14 % of the radius off before they are snapped.
const MAX_TURN: f64 = std::f64::consts::FRAC_PI_3 * 1.001;

/// Step of the integration of 1/h, in units of h.
const STEP: f64 = 0.25;

/// A curve whose points could not be projected.
#[derive(Clone, Debug, thiserror::Error)]
#[error("curve {}: {failed}", curve.0)]
pub struct CurveError {
    /// The curve.
    pub curve: CurveId,
    /// The failed projection.
    pub failed: ProjectionFailed,
}

/// Divides all curves into segments: vertices on corners (vertex i is corner i) and on curves,
/// segments in curve order.
///
/// Periodic copies get the segments of their masters.
///
/// # Errors
/// [`CurveError`] if a point cannot be projected onto its curve.
pub fn mesh_curves(
    features: &Features,
    projector: &Projector,
    size: &dyn SizeField,
) -> Result<SurfaceMesh, CurveError> {
    let samplings: Vec<Sampling> = features.curves.iter().map(|c| Sampling::new(c, size)).collect();
    let mut counts: Vec<usize> = features.curves.iter().zip(&samplings).map(|(c, s)| s.segments(c)).collect();
    let masters = features.masters();
    let master = |i: usize| masters.curves[i].map_or(i, |master| master.index);
    // A periodic copy gets the same segments as its master, so subdividing one subdivides the
    // other. That can make a third curve coincide with one of them; repeat until nothing changes.
    loop {
        for i in 0..counts.len() {
            counts[i] = counts[master(i)];
        }
        let same = curves_with_the_same_ends(features, &counts);
        if same.is_empty() {
            break;
        }
        same.into_iter().for_each(|i| counts[master(i)] = 2);
    }

    let mut mesh = SurfaceMesh::default();
    for (i, corner) in features.corners.iter().enumerate() {
        mesh.points.push(match masters.corners[i] {
            Some(master) => master.motion * features.corners[master.index].point,
            None => corner.point,
        });
        mesh.classes.push(Class::Corner(CornerId::new(i)));
    }
    let placed = |i: usize| {
        let id = CurveId::new(i);
        samplings[i]
            .inner_points(counts[i], features.curves[i].ends.is_none())
            .map(|p| projector.project_curve(id, &p))
            .collect::<Result<Vec<Point>, _>>()
            .map_err(|failed| CurveError { curve: id, failed })
    };
    let is_master = |i: usize| masters.curves[i].is_none();
    let of_master = |i: usize| if is_master(i) { placed(i) } else { Ok(Vec::new()) };
    let mut inner = (0..counts.len()).map(of_master).collect::<Result<Vec<_>, _>>()?;
    cusp::align(features, projector, &is_master, &mut inner);
    for (i, curve) in features.curves.iter().enumerate() {
        let inner = match masters.curves[i] {
            Some(master) => {
                let mut points: Vec<Point> = inner[master.index].iter().map(|p| master.motion * p).collect();
                if master.reversed {
                    points.reverse();
                }
                points
            }
            None => inner[i].clone(),
        };
        add_curve(&mut mesh, CurveId::new(i), curve, inner);
    }
    Ok(mesh)
}

/// Adds the interior vertices of a curve and its segments.
fn add_curve(mesh: &mut SurfaceMesh, id: CurveId, curve: &Curve, inner: Vec<Point>) {
    let first = mesh.points.len();
    let mut chain: Vec<VertexId> = (first..first + inner.len()).map(VertexId::new).collect();
    mesh.classes.extend(inner.iter().map(|_| Class::Curve(id)));
    mesh.points.extend(inner);
    match curve.ends {
        Some([start, end]) => {
            chain.insert(0, VertexId(start.0));
            chain.push(VertexId(end.0));
        }
        None => chain.push(chain[0]),
    }
    mesh.segments.extend(chain.windows(2).map(|w| Segment { vertices: [w[0], w[1]], curve: id }));
}

/// The curves with a single segment between the same corners as another one: except for the
/// shortest, they need a second segment.
fn curves_with_the_same_ends(features: &Features, counts: &[usize]) -> Vec<usize> {
    let mut single: Vec<([CornerId; 2], f64, usize)> = features
        .curves
        .iter()
        .enumerate()
        .filter(|(i, _)| counts[*i] == 1)
        .filter_map(|(i, curve)| {
            let [a, b] = curve.ends?;
            Some(([a.min(b), a.max(b)], length(&curve.trace), i))
        })
        .collect();
    single.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
    single.windows(2).filter(|w| w[0].0 == w[1].0).map(|w| w[1].2).collect()
}

fn length(trace: &[Point]) -> f64 {
    trace.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
}

/// Points of a trace with the metric length up to each.
struct Sampling {
    points: Vec<Point>,
    metric: Vec<f64>,
    turn: f64,
}

impl Sampling {
    fn new(curve: &Curve, size: &dyn SizeField) -> Self {
        let trace = &curve.trace;
        let mut points = vec![trace[0]];
        let mut metric = vec![0.0];
        let mut sum = 0.0;
        for w in trace.windows(2) {
            let mut at = 0.0;
            let step: Vector = w[1] - w[0];
            let whole = step.norm();
            // The step uses h at its start: along it the size can shrink only by the grading.
            while at < 1.0 {
                let h = size.size_at(&(w[0] + at * step));
                let next = (at + STEP * h / whole).min(1.0);
                let middle = w[0] + 0.5 * (at + next) * step;
                sum += (next - at) * whole / size.size_at(&middle);
                points.push(w[0] + next * step);
                metric.push(sum);
                at = next;
            }
        }
        Self { points, metric, turn: turn(trace, curve.ends.is_none()) }
    }

    /// The number of segments of the curve.
    fn segments(&self, curve: &Curve) -> usize {
        let wanted = self.metric.last().map_or(0.0, |l| l.round()) as usize;
        let least = match curve.ends {
            None => 6,
            Some([a, b]) if a == b => 3,
            Some(_) => 1,
        };
        wanted.max(least).max((self.turn / MAX_TURN).ceil() as usize)
    }

    /// The points that divide the curve into `count` segments of equal metric length, with the
    /// first point if it is closed.
    fn inner_points(&self, count: usize, closed: bool) -> impl Iterator<Item = Point> {
        let total = self.metric[self.metric.len() - 1];
        (usize::from(!closed)..count).map(move |k| self.at(total * k as f64 / count as f64))
    }

    fn at(&self, metric: f64) -> Point {
        let after = self.metric.partition_point(|m| *m <= metric).clamp(1, self.metric.len() - 1);
        let (low, high) = (self.metric[after - 1], self.metric[after]);
        let t = if high > low { (metric - low) / (high - low) } else { 0.0 };
        self.points[after - 1] + t * (self.points[after] - self.points[after - 1])
    }
}

/// The total turning angle of a trace.
fn turn(trace: &[Point], closed: bool) -> f64 {
    let direction = |w: &[Point]| (w[1] - w[0]).try_normalize(0.0);
    let mut directions: Vec<Vector> = trace.windows(2).filter_map(direction).collect();
    if closed {
        directions.extend(directions.first().copied());
    }
    // The ends of an open trace contribute half a step each.
    let turns: Vec<f64> =
        directions.windows(2).map(|w| w[0].cross(&w[1]).norm().atan2(w[0].dot(&w[1]))).collect();
    let ends =
        if closed { 0.0 } else { 0.5 * (turns.first().unwrap_or(&0.0) + turns.last().unwrap_or(&0.0)) };
    turns.iter().sum::<f64>() + ends
}

/// Sources that shorten chords that deviate too far from their curve to stay clear of another
/// segment.
///
/// Two segments without a common vertex must be farther apart than the sum of their sagittas (the
/// largest distance of chord and curve), else disjoint patches would overlap in the mesh. Each
/// source is below the length that was used, because with steep grading a chord is longer than the
/// size at its middle.
pub fn crowded(mesh: &SurfaceMesh, features: &Features, size: &dyn SizeField) -> Crowded {
    let sagittas = sagittas(mesh, features);
    let ends = |i: usize| mesh.segments[i].vertices.map(|v| mesh.points[v.index()]);
    // Sweep along x: the interval of each chord, extended by its clearance.
    let spans: Vec<[f64; 2]> = (0..mesh.segments.len())
        .map(|i| {
            let [a, b] = ends(i).map(|p| p.x);
            let room = CLEARANCE * sagittas[i];
            [a.min(b) - room, a.max(b) + room]
        })
        .collect();
    let mut order: Vec<usize> = (0..spans.len()).collect();
    order.sort_by(|&i, &j| spans[i][0].total_cmp(&spans[j][0]).then(i.cmp(&j)));
    let mut found = Crowded::default();
    for (k, &i) in order.iter().enumerate() {
        for &j in order[k + 1..].iter().take_while(|&&j| spans[j][0] <= spans[i][1]) {
            let [s, t] = [&mesh.segments[i], &mesh.segments[j]];
            if sagittas[i] + sagittas[j] == 0.0 || s.vertices.iter().any(|v| t.vertices.contains(v)) {
                continue;
            }
            let (distance, at) = segment_distance(ends(i), ends(j));
            let is_near = distance < CLEARANCE * (sagittas[i] + sagittas[j]);
            if is_near && !cusp::are_aligned(mesh, features, [s, t]) {
                let segment = if sagittas[i] >= sagittas[j] { i } else { j };
                let [a, b] = ends(segment);
                let length = (b - a).norm();
                found.places.push(CrowdedPlace {
                    segment,
                    length,
                    curves: [s.curve, t.curve],
                    bend: bend([sagittas[i], sagittas[j]], [ends(i), ends(j)]),
                    source: Source { point: at, size: SHORTENED * size.size_at(&at).min(length) },
                });
            }
        }
    }
    found
}

/// Places at which segments are too long for the distance of two curves.
#[derive(Debug, Default)]
pub struct Crowded {
    /// Each place.
    pub places: Vec<CrowdedPlace>,
}

/// A place at which a segment is too long for the distance of two curves.
#[derive(Debug)]
pub struct CrowdedPlace {
    /// The source that shortens it.
    pub source: Source,
    /// The two curves.
    curves: [CurveId; 2],
    /// The segment, and its length.
    segment: usize,
    length: f64,
    /// The sum of sagittas of the two curves at a chord of length 1, for short chords (1/length).
    bend: f64,
}

/// A place where two curves without a common corner are very close to each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// The curves.
    pub curves: [CurveId; 2],
    /// A point between them.
    pub at: Point,
    /// Their distance there (length).
    pub width: f64,
    /// The length of segments that stay apart there.
    pub needed: f64,
    /// The number of segments that all such gaps need.
    pub segments: f64,
}

impl Crowded {
    /// The gap that needs the shortest segments.
    pub fn gap(&self, features: &Features, projector: &Projector) -> Option<Gap> {
        // Curves of the same surfaces cannot be told apart by projection.
        let meet = |curves: [CurveId; 2]| {
            let [c, d] = curves.map(|curve| features.curve(curve));
            let [ends, other] = [c, d].map(|curve| curve.ends.into_iter().flatten());
            c.surfaces == d.surfaces || ends.into_iter().any(|end| other.clone().any(|o| o == end))
        };
        let mut gap: Option<Gap> = None;
        // The number of pieces of each segment.
        let mut pieces: BTreeMap<usize, f64> = BTreeMap::new();
        for place in self.places.iter().filter(|place| !meet(place.curves)) {
            let [a, b] = place.curves.map(|curve| projector.project_curve(curve, &place.source.point));
            let (Ok(a), Ok(b)) = (a, b) else { continue };
            let width = (a - b).norm();
            let needed = (width / (CLEARANCE * place.bend)).sqrt();
            let most = pieces.entry(place.segment).or_default();
            *most = most.max(place.length / needed);
            if gap.is_none_or(|gap| needed < gap.needed) {
                let at = nalgebra::center(&a, &b);
                gap = Some(Gap { curves: place.curves, at, width, needed, segments: 0.0 });
            }
        }
        gap.map(|gap| Gap { segments: pieces.values().sum(), ..gap })
    }
}

/// The sum of sagittas of two curves at a chord of length 1, from those at their segments.
fn bend(sagittas: [f64; 2], segments: [[Point; 2]; 2]) -> f64 {
    let of = |(sagitta, [a, b]): (f64, [Point; 2])| sagitta / (b - a).norm_squared();
    sagittas.into_iter().zip(segments).map(of).sum()
}

/// Factor by which a chord too close to another is shortened: its sagitta falls to about a third.
const SHORTENED: f64 = 0.6;

/// Least distance of two chords, in sums of their sagittas.
const CLEARANCE: f64 = 1.2;

/// The largest distance of each segment's chord from its curve's trace.
fn sagittas(mesh: &SurfaceMesh, features: &Features) -> Vec<f64> {
    let mut out = Vec::with_capacity(mesh.segments.len());
    for group in mesh.segments.chunk_by(|a, b| a.curve == b.curve) {
        let curve = features.curve(group[0].curve);
        // An arc of turning angle θ and chord c has the sagitta c/2·tan(θ/4).
        let angle = turn(&curve.trace, curve.ends.is_none()) / group.len() as f64;
        let chord =
            |s: &Segment| (mesh.points[s.vertices[1].index()] - mesh.points[s.vertices[0].index()]).norm();
        // Equal metric lengths need not turn equally: the angle is doubled for safety, up to 1.2,
        // before the tangent grows without bound. Below 10⁻⁹ the curve is straight up to rounding.
        let share = if angle < 1e-9 { 0.0 } else { (0.5 * angle).min(1.2).tan() };
        out.extend(group.iter().map(|s| 0.5 * chord(s) * share));
    }
    out
}

/// The least distance of two segments, and the midpoint of the shortest connection.
fn segment_distance(s: [Point; 2], t: [Point; 2]) -> (f64, Point) {
    let (d1, d2, r) = (s[1] - s[0], t[1] - t[0], s[0] - t[0]);
    let (a, e, b) = (d1.norm_squared(), d2.norm_squared(), d1.dot(&d2));
    let (c, f) = (d1.dot(&r), d2.dot(&r));
    let denominator = a * e - b * b;
    let ratio = |x: f64, y: f64| if y > 0.0 { (x / y).clamp(0.0, 1.0) } else { 0.0 };
    let u = ratio(b * f - c * e, denominator.max(0.0));
    let v = ratio(b * u + f, e);
    let u = ratio(b * v - c, a);
    let (p, q) = (s[0] + u * d1, t[0] + v * d2);
    ((q - p).norm(), nalgebra::center(&p, &q))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::size::UniformSize;

    fn arc(radius: f64, from: f64, to: f64) -> Vec<Point> {
        (0..=64)
            .map(|i| from + (to - from) * f64::from(i) / 64.0)
            .map(|a| Point::new(radius * a.cos(), radius * a.sin(), 0.0))
            .collect()
    }

    fn curve(trace: Vec<Point>, ends: Option<[CornerId; 2]>) -> Curve {
        Curve { surfaces: [csg::SurfaceId(0), csg::SurfaceId(1)], ends, trace, fins: Vec::new() }
    }

    #[test]
    fn a_coarse_circle_has_six_segments_and_a_fine_one_as_many_as_fit() {
        let circle = curve(arc(1.0, 0.0, std::f64::consts::TAU), None);
        assert_eq!(Sampling::new(&circle, &UniformSize(10.0)).segments(&circle), 6);
        assert_eq!(Sampling::new(&circle, &UniformSize(0.1)).segments(&circle), 63);
        let points: Vec<Point> = Sampling::new(&circle, &UniformSize(0.1)).inner_points(8, true).collect();
        assert_eq!(points.len(), 8);
        assert!((points[2] - Point::new(0.0, 1.0, 0.0)).norm() < 1e-3, "{}", points[2]);
    }

    #[test]
    fn a_graded_size_gives_segments_that_grow() {
        struct Growing;
        impl SizeField for Growing {
            fn size_at(&self, p: &Point) -> f64 {
                0.1 + 0.3 * p.x
            }
        }
        let line =
            curve(vec![Point::new(0., 0., 0.), Point::new(1., 0., 0.)], Some([CornerId(0), CornerId(1)]));
        let sampling = Sampling::new(&line, &Growing);
        // The integral of dx / (0.1 + 0.3x) from 0 to 1 is ln(4)/0.3 = 4.62.
        assert!((sampling.metric.last().unwrap() - 4.621).abs() < 0.02);
        let points: Vec<f64> = sampling.inner_points(5, false).map(|p| p.x).collect();
        assert_eq!(points.len(), 4);
        assert!(points[0] < 0.2 && points[3] < 0.8 && points.is_sorted());
    }

    #[test]
    fn two_circles_that_nearly_touch_are_crowded_until_their_chords_are_short() {
        let tau = std::f64::consts::TAU;
        let curves = vec![curve(arc(1.0, 0.0, tau), None), curve(arc(0.9, 0.5, 0.5 + tau), None)];
        let features = Features {
            corners: vec![],
            curves,
            patches: vec![],
            bounds: csg::Aabb { min: Point::new(-1., -1., 0.), max: Point::new(1., 1., 0.) },
            identified: vec![],
        };
        let cut = |h: f64| {
            let mut mesh = SurfaceMesh::default();
            for (i, c) in features.curves.iter().enumerate() {
                let sampling = Sampling::new(c, &UniformSize(h));
                let inner = sampling.inner_points(sampling.segments(c), true).collect();
                add_curve(&mut mesh, CurveId::new(i), c, inner);
            }
            mesh
        };
        let long = crowded(&cut(1.0), &features, &UniformSize(0.5));
        assert!(!long.places.is_empty() && long.places.iter().all(|place| place.source.size <= 0.3));
        assert!(crowded(&cut(0.2), &features, &UniformSize(0.2)).places.is_empty());
    }

    #[test]
    fn the_distance_of_skew_segments_is_that_of_their_lines() {
        let p = |x: f64, y: f64, z: f64| Point::new(x, y, z);
        let (d, at) = segment_distance([p(0., 0., 0.), p(2., 0., 0.)], [p(1., -1., 3.), p(1., 1., 3.)]);
        assert!((d - 3.0).abs() < 1e-12 && (at - p(1., 0., 1.5)).norm() < 1e-12);
        let (d, _) = segment_distance([p(0., 0., 0.), p(1., 0., 0.)], [p(2., 0., 0.), p(3., 0., 0.)]);
        assert!((d - 1.0).abs() < 1e-12);
    }
}

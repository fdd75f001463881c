//! Common parts of revolutions and extrusions: profiles whose sides become surfaces in space.

use super::forest::inside_of;
use super::primitive::Shape;
use super::profile::{Bound, Profile, ProfileError};
use crate::primitive::{Cylinder, Ellipse, Ellipsoid, Nappe, Plane, Revolved, Sphere, Torus};
use crate::{Point, Solid, Surface, Vector};

/// Why a swept solid cannot be made.
pub(super) enum SweepError {
    /// The input is invalid: message and help.
    Wrong(String, &'static str),
    /// The input is valid, but cannot be meshed.
    Unsupported(String),
}

impl From<ProfileError> for SweepError {
    fn from(error: ProfileError) -> Self {
        match error {
            ProfileError::Crossing(i, j) if i == j => Self::Wrong(
                format!("segment {} of the profile crosses itself", i + 1),
                "segments may meet at their ends only",
            ),
            ProfileError::Crossing(i, j) => Self::Wrong(
                format!(
                    "segments {} and {} of the profile cross, touch, or meet at a zero angle",
                    i + 1,
                    j + 1
                ),
                "segments may meet only at their ends and at a nonzero angle",
            ),
            ProfileError::Empty => {
                Self::Wrong("the profile encloses no area".into(), "its segments must enclose an area")
            }
            ProfileError::Slanted(i) => Self::Unsupported(format!(
                "segment {} of the profile is curved and does not meet the axis at a right angle, which cannot \
                 be meshed yet",
                i + 1
            )),
        }
    }
}

/// The face number (see [`RawSurface::face`](super::forest::RawSurface)) of surfaces that belong to
/// no segment.
pub(super) const NO_FACE: usize = usize::MAX;

/// A smooth joint of a path, as indices of the surfaces of a primitive.
///
/// The surfaces that one side of the profile sweeps before and after the joint meet in the plane
/// perpendicular to the path.
#[derive(Clone, Copy, Debug)]
pub(super) struct Joint {
    /// The surfaces before and after.
    pub sides: [usize; 2],
    /// The plane of the joint.
    pub plane: usize,
}

/// Collects the surfaces of a swept solid.
#[derive(Default)]
pub(super) struct Assembly {
    surfaces: Vec<Surface>,
    faces: Vec<usize>,
    joints: Vec<Joint>,
}

/// The solid swept by a profile.
pub(super) struct Swept {
    pub inside: Solid,
    /// The half-space swept by each literal of the profile.
    pub sides: Vec<Solid>,
}

impl Assembly {
    /// The negative or the positive side of a surface.
    pub fn side(&mut self, surface: Surface, positive: bool, face: usize) -> Solid {
        let known = (0..self.surfaces.len()).find(|&i| self.faces[i] == face && self.surfaces[i] == surface);
        let index = known.unwrap_or_else(|| {
            self.surfaces.push(surface);
            self.faces.push(face);
            self.surfaces.len() - 1
        });
        if positive { complement(inside_of(index)) } else { inside_of(index) }
    }

    /// The half-space behind the plane through a point.
    pub fn behind(&mut self, point: Vector, normal: Vector, face: usize) -> Solid {
        let normal = normal.normalize();
        self.side(Surface::Plane(Plane { point: Point::from(point), normal }), false, face)
    }

    /// The primitive with the given Boolean tree.
    pub fn shape(self, inside: Solid) -> Shape {
        Shape { surfaces: self.surfaces, inside, faces: self.faces, joints: self.joints }
    }

    /// Records that the surfaces swept by the same literals before and after a plane meet there.
    pub fn join(&mut self, [before, after]: [&[Solid]; 2], plane: &Solid) {
        let Some(plane) = surface_of(plane) else { return };
        let sides = before.iter().zip(after).filter_map(|(p, q)| Some([surface_of(p)?, surface_of(q)?]));
        self.joints.extend(sides.filter(|[p, q]| p != q).map(|sides| Joint { sides, plane }));
    }

    /// The tree of a profile with each literal replaced by the result of `swept`.
    pub fn sweep(
        &mut self,
        profile: &Profile,
        mut swept: impl FnMut(&mut Self, &Bound, usize) -> Result<Solid, SweepError>,
    ) -> Result<Swept, SweepError> {
        let sides = profile.literals.iter().map(|literal| swept(self, &literal.bound, literal.segment));
        let sides = sides.collect::<Result<Vec<_>, _>>()?;
        Ok(Swept { inside: substituted(&profile.inside, &sides), sides })
    }
}

/// The index of the surface of a half-space.
fn surface_of(solid: &Solid) -> Option<usize> {
    match solid {
        Solid::Half { surface, .. } => Some(surface.index()),
        _ => None,
    }
}

pub(super) fn everything() -> Solid {
    Solid::And(Vec::new())
}

pub(super) fn nothing() -> Solid {
    Solid::Or(Vec::new())
}

pub(super) fn complement(solid: Solid) -> Solid {
    match solid {
        Solid::Half { surface, positive } => Solid::Half { surface, positive: !positive },
        Solid::And(members) if members.is_empty() => nothing(),
        Solid::Or(members) if members.is_empty() => everything(),
        Solid::Not(member) => *member,
        other => Solid::Not(Box::new(other)),
    }
}

/// The tree with its half-spaces replaced and simplified for empty and full members.
fn substituted(solid: &Solid, leaves: &[Solid]) -> Solid {
    let members = |members: &[Solid], neutral: Solid, decisive: Solid, join: fn(Vec<Solid>) -> Solid| {
        let parts: Vec<Solid> =
            members.iter().map(|m| substituted(m, leaves)).filter(|m| *m != neutral).collect();
        if parts.contains(&decisive) { decisive } else { join(parts) }
    };
    match solid {
        Solid::Half { surface, positive: false } => leaves[surface.index()].clone(),
        Solid::Half { surface, positive: true } => complement(leaves[surface.index()].clone()),
        Solid::Not(member) => complement(substituted(member, leaves)),
        Solid::And(all) => members(all, everything(), nothing(), Solid::And),
        Solid::Or(all) => members(all, nothing(), everything(), Solid::Or),
    }
}

/// An axis of revolution.
pub(super) struct Turn {
    /// A point on the axis.
    pub point: Vector,
    /// Unit direction of the axis.
    pub axis: Vector,
    /// Lengths below this count as zero.
    pub tolerance: f64,
}

/// A line whose angle has a smaller sine is parallel or perpendicular to the axis. Decimals have
/// six digits or more where it matters; then the ends of a segment get the same radius or height.
const PARALLEL: f64 = 1e-9;

impl Turn {
    fn at(&self, height: f64) -> Point {
        Point::from(self.point + self.axis * height)
    }

    /// The half-space swept by a side of the profile, in coordinates (height along the axis,
    /// distance from it).
    pub fn turned(&self, into: &mut Assembly, bound: &Bound, face: usize) -> Solid {
        match bound {
            Bound::Left(from, to) => self.turned_line(into, *from, *to, face),
            Bound::Inside(ellipse) => into.side(self.turned_ellipse(ellipse), false, face),
        }
    }

    /// The half-space swept by the left side of a line.
    fn turned_line(&self, into: &mut Assembly, from: [f64; 2], to: [f64; 2], face: usize) -> Solid {
        let [x, y] = [0, 1].map(|i| to[i] - from[i]);
        let length = x.hypot(y);
        let axis = self.axis;
        if from[1].max(to[1]) <= self.tolerance {
            // A line along the axis: everything is on one side.
            return if x > 0.0 { everything() } else { nothing() };
        }
        if x.abs() <= PARALLEL * length {
            let normal = if y > 0.0 { axis } else { -axis };
            let point = self.at(0.5 * (from[0] + to[0]));
            return into.side(Surface::Plane(Plane { point, normal }), false, face);
        }
        let surface = if y.abs() <= PARALLEL * length {
            Surface::Cylinder(Cylinder { point: self.at(from[0]), axis, radius: 0.5 * (from[1] + to[1]) })
        } else {
            let wide = if from[1] > to[1] { from } else { to };
            Surface::Nappe(Nappe { point: self.at(wide[0]), axis, radius: wide[1], slope: y / x })
        };
        into.side(surface, x > 0.0, face)
    }

    fn turned_ellipse(&self, ellipse: &Ellipse) -> Surface {
        let Ellipse { center: [height, distance], axis: [c, s], radii } = *ellipse;
        let center = self.at(height);
        let axis = self.axis;
        let is_round = radii[0] == radii[1];
        if is_round && distance.abs() <= self.tolerance {
            return Surface::Sphere(Sphere { center, radius: radii[0] });
        }
        if is_round && distance > radii[0] + self.tolerance {
            return Surface::Torus(Torus { center, axis, major: distance, minor: radii[0] });
        }
        let (along, across) = (s.abs() <= PARALLEL, c.abs() <= PARALLEL);
        if distance.abs() <= self.tolerance && (along || across) {
            let [up, out] = if along { radii } else { [radii[1], radii[0]] };
            let (u, v) = crate::primitive::quadric::tangents(&axis);
            return Surface::Ellipsoid(Ellipsoid { center, axes: [u, v, axis], radii: [out, out, up] });
        }
        // In (distance, height), the coordinates of the axis are exchanged. The second axis becomes
        // its opposite, which gives the same ellipse.
        let profile = Ellipse { center: [distance, 0.0], axis: [s, c], radii };
        Surface::Revolved(Revolved { point: center, axis, profile })
    }
}

//! The periodic map of a coarse mesh: its pairs by patch, and the master of each copy.

use super::{Link, Pair, Pairs, PeriodicFaces};
use crate::Point;
use crate::ground::mesh::{GlobalId, Mesh};
use csg::{Aabb, PatchId};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use std::collections::BTreeMap;

/// The periodic entities of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PeriodicMap {
    /// Patches that are periodic copies.
    pub links: Vec<Link>,
    /// For each link the pairs on the patch and its boundary.
    pub pairs: Vec<Pairs>,
    /// All copies with their masters, which are not copies themselves.
    pub origins: Pairs,
    /// The distance tolerance by which the partner of a vertex is found.
    pub distance: f64,
}

/// The error for a mesh whose faces are not periodic although its geometry is.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MapError {
    /// A vertex has no periodic copy.
    #[error("vertex {vertex} at ({}, {}, {}) of a periodic face has no partner on patch {}", .place.x, .place.y, .place.z, .patch.0)]
    Vertex {
        /// The vertex.
        vertex: GlobalId,
        /// Its position.
        place: Point,
        /// The patch that its copy should be on.
        patch: PatchId,
    },
    /// A triangle has no periodic copy.
    #[error("the triangles of patch {} near ({}, {}, {}) do not match those of its partner", .patch.0, .place.x, .place.y, .place.z)]
    Triangle {
        /// The patch of the copy.
        patch: PatchId,
        /// Its position.
        place: Point,
    },
}

/// Relative tolerance for finding vertices of a copy, as a fraction of the diagonal: far above
/// rounding near the origin, far below the smallest edge.
const SAME_PLACE: f64 = 1e-10;
/// Tolerance far from the origin, in units in the last place of the largest coordinate; moving a
/// point rounds several times.
const ROUNDINGS: f64 = 64.0;

/// The distance within which a vertex matches a moved point.
pub fn same_place(bounds: &Aabb) -> f64 {
    let largest = bounds.min.coords.amax().max(bounds.max.coords.amax());
    f64::max(SAME_PLACE * bounds.diagonal(), ROUNDINGS * f64::EPSILON * largest)
}

impl PeriodicMap {
    /// The pairs of a coarse mesh; `bounds` are those of the geometry. Edges and faces are numbered
    /// as in `distribute`.
    ///
    /// # Errors
    /// [`MapError`] if a vertex or triangle has no partner.
    pub fn of(mesh: &Mesh, links: Vec<Link>, bounds: &Aabb) -> Result<Self, MapError> {
        let distance = same_place(bounds);
        if links.is_empty() {
            return Ok(Self { distance, ..Self::default() });
        }
        Self::of_faces(&PeriodicFaces::of(mesh, &links), links, distance)
    }

    /// The pairs of the triangles on periodic patches; those within `distance` are equal.
    ///
    /// # Errors
    /// [`MapError`] if a vertex or triangle has no partner.
    pub(crate) fn of_faces(faces: &PeriodicFaces, links: Vec<Link>, distance: f64) -> Result<Self, MapError> {
        let pairs: Vec<Pairs> =
            links.iter().map(|link| faces.pairs(link, distance)).collect::<Result<_, _>>()?;
        let origins = [0, 1, 2].map(|kind| masters(pairs.iter().flat_map(|of| of.0[kind].iter().copied())));
        Ok(Self { links, pairs, origins: Pairs(origins), distance })
    }

    /// Encodes the map as numbers for messages: the distance, the links, then for each link and for
    /// the masters the pairs of vertices, edges and faces.
    pub fn encode(&self) -> Vec<u64> {
        let mut out = vec![self.distance.to_bits(), self.links.len() as u64];
        for Link { identification, of, image, motion } in &self.links {
            out.extend([identification, &of.0, &image.0].map(|&number| u64::from(number)));
            let numbers = motion.rotation.coords.iter().chain(motion.translation.vector.iter());
            out.extend(numbers.map(|x| x.to_bits()));
        }
        for Pairs(kinds) in self.pairs.iter().chain([&self.origins]) {
            for pairs in kinds {
                out.push(pairs.len() as u64);
                for Pair { image, of, corners } in pairs {
                    let [a, b, c] = corners.map(u64::from);
                    out.extend([*image, *of, a | b << 8 | c << 16]);
                }
            }
        }
        out
    }

    /// The inverse of [`encode`](Self::encode).
    ///
    /// # Panics
    /// If the numbers are not an encoded map.
    pub fn decode(numbers: &[u64]) -> Self {
        let mut numbers = numbers.iter().copied();
        let mut next = || numbers.next().expect("an encoded map");
        let distance = f64::from_bits(next());
        let links = (0..next())
            .map(|_| {
                let [identification, of, image] = [next(), next(), next()].map(|number| number as u32);
                let q = [next(), next(), next(), next()].map(f64::from_bits);
                let t = [next(), next(), next()].map(f64::from_bits);
                let rotation = UnitQuaternion::new_unchecked(Quaternion::from(q));
                let motion = Isometry3::from_parts(Translation3::from(t), rotation);
                Link { identification, of: PatchId(of), image: PatchId(image), motion }
            })
            .collect::<Vec<Link>>();
        let mut pairs = || {
            Pairs([(); 3].map(|()| {
                let count = next();
                let pair = |_| {
                    let (image, of, packed) = (next(), next(), next());
                    Pair { image, of, corners: [0, 8, 16].map(|shift| (packed >> shift) as u8) }
                };
                (0..count).map(pair).collect()
            }))
        };
        let of_links = links.iter().map(|_| pairs()).collect();
        Self { pairs: of_links, origins: pairs(), links, distance }
    }
}

/// For each copy the master at the end of its chain; in a cycle the smallest entity.
fn masters(pairs: impl Iterator<Item = Pair>) -> Vec<Pair> {
    let mut steps: BTreeMap<u64, Vec<Pair>> = BTreeMap::new();
    let mut is_image: BTreeMap<u64, bool> = BTreeMap::new();
    for pair in pairs.filter(|pair| pair.image != pair.of) {
        steps.entry(pair.of).or_default().push(pair);
        steps.entry(pair.image).or_default().push(pair.reversed());
        is_image.entry(pair.of).or_insert(false);
        is_image.insert(pair.image, true);
    }
    let (images, firsts): (Vec<_>, Vec<_>) = is_image.into_iter().partition(|(_, is_image)| *is_image);
    let mut origins: BTreeMap<u64, Pair> = BTreeMap::new();
    for (start, _) in firsts.into_iter().chain(images) {
        let identity = Pair { image: start, of: start, corners: [0, 1, 2] };
        let mut open = vec![identity];
        while let Some(at) = open.pop() {
            if origins.contains_key(&at.image) {
                continue;
            }
            origins.insert(at.image, at);
            open.extend(steps[&at.image].iter().map(|step| step.after(at)));
        }
    }
    origins.into_values().filter(|pair| pair.image != pair.of).collect()
}

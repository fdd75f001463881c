//! Faces that a file has twice: the copies are left out, because a surface that passes a place
//! twice in the same direction bounds nothing there.
//!
//! Two faces with the same corners in opposite order are none: they bound two solids that touch.

use super::Surface;
use crate::files::input::counted;
use crate::ground::kernel::random::mix;
use rayon::prelude::*;

/// Identifies a face by its corners: a triangle exactly, a polygon by 127 bits of a hash.
pub(super) type Key = [u64; 2];

/// Turns the place of a face into text, such as `line 7`.
pub(super) type Place<'a> = &'a dyn Fn(usize) -> String;

/// The key of a face with these corners, wherever the order begins; if faces are unoriented,
/// whatever its direction.
pub(super) fn key(corners: &[u32], unoriented: bool) -> Key {
    let Some(start) = (0..corners.len()).min_by_key(|&k| corners[k]) else { return [0; 2] };
    let count = corners.len();
    let forward = |k: usize| corners[(start + k) % count];
    let backward = |k: usize| corners[(start + count - k) % count];
    let reversed = unoriented && count > 2 && backward(1) < forward(1);
    let corner = |k: usize| if reversed { backward(k) } else { forward(k) };
    if count == 3 {
        return [u64::from(corner(0)) << 32 | u64::from(corner(1)), u64::from(corner(2))];
    }
    let hash = |seed: u64| (0..count).fold(seed, |hash, k| mix(hash ^ mix(u64::from(corner(k)) + seed)));
    [hash(1), hash(2) | 1 << 63]
}

/// Removes the triangles of faces that equal earlier ones. Returns a note if there are any.
pub(super) fn leave_out(
    surface: &mut Surface,
    faces: &[(Key, usize)],
    face_of: &[u32],
    place: Place,
) -> Option<String> {
    let mut order: Vec<(Key, u32)> = faces.iter().map(|(key, _)| *key).zip(0..).collect();
    order.par_sort_unstable();
    // Collapsed faces have no triangles.
    let mut is_used = vec![false; faces.len()];
    face_of.iter().for_each(|&face| is_used[face as usize] = true);
    let mut copies: Vec<[u32; 2]> = Vec::new();
    for same in order.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() > 1) {
        let mut used = same.iter().map(|(_, face)| *face).filter(|&face| is_used[face as usize]);
        let Some(first) = used.next() else { continue };
        copies.extend(used.map(|copy| [copy, first]));
    }
    let [copy, first] = *copies.iter().min()?;
    let mut is_kept = vec![true; faces.len()];
    copies.iter().for_each(|[copy, _]| is_kept[*copy as usize] = false);
    let mut of = face_of.iter();
    surface.triangles.retain(|_| of.next().is_none_or(|&face| is_kept[face as usize]));
    let mut of = face_of.iter();
    surface.group.retain(|_| of.next().is_none_or(|&face| is_kept[face as usize]));
    let [at, before] = [copy, first].map(|face| place(faces[face as usize].1));
    Some(format!(
        "{} listed before left out, the first at {at}: it is at {before}",
        counted(copies.len(), "face")
    ))
}

//! Splits the surface mesh of the pieces into the skins of the parts.

use super::cut::{CutModel, Face};
use crate::ground::comm::pack::{put, take};
use crate::ground::mesh::{Class, Rank};
use crate::parallel::distribution::Shared;

use crate::mesher::surface::SurfaceMesh;
use crate::parallel::skin::{Skin, SkinTriangle, sorted_ends};
use csg::{BodyId, PatchId};

/// The error for a segment without triangles: an edge inside a body, which this method cannot keep.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("edges inside bodies are kept by the methods `refine` and `surface` only")]
pub struct LooseEdge;

/// No vertex.
const NONE: u32 = u32::MAX;

/// The skins of all parts.
///
/// The name of a vertex is its index in the surface mesh; its holders are the parts of the
/// triangles around it.
///
/// # Errors
/// [`LooseEdge`] if a body has a prescribed interior edge.
pub fn skins(cut: &CutModel, surface: &SurfaceMesh, parts: usize) -> Result<Vec<Skin>, LooseEdge> {
    let mut of_parts: Vec<Vec<SkinTriangle>> = vec![Vec::new(); parts];
    for triangle in &surface.triangles {
        push_sides(cut, triangle.patch, triangle.vertices.map(|v| v.0), &mut of_parts);
    }
    let holders = holders(surface.points.len(), &of_parts);
    let inside = user_points(cut, surface, &holders);
    let mut segments: Vec<([u32; 2], Class)> = surface
        .segments
        .iter()
        .map(|s| (sorted_ends(s.vertices.map(|v| v.0)), cut.curves[s.curve.index()]))
        .filter(|(_, class)| !matches!(class, Class::Body(_)))
        .collect();
    segments.sort_unstable();
    let mut seen = vec![false; segments.len()];
    let mut place = vec![NONE; surface.points.len()];
    let mut skins = Vec::with_capacity(parts);
    for (part, triangles) in of_parts.into_iter().enumerate() {
        let mut skin = Skin { triangles, ..Skin::default() };
        let mut used: Vec<u32> = skin.triangles.iter().flat_map(|t| t.vertices).collect();
        used.sort_unstable();
        used.dedup();
        skin.on_triangles = used.len();
        used.extend(inside.iter().filter(|(_, of)| *of == part).map(|(v, _)| *v));
        for side in skin.sides() {
            if let Ok(k) = segments.binary_search_by_key(&side, |segment| segment.0) {
                seen[k] = true;
                skin.edges.push(segments[k]);
            }
        }
        for (new, &v) in (0..).zip(&used) {
            place[v as usize] = new;
            skin.names.push(u64::from(v));
            skin.points.push(surface.points[v as usize]);
            skin.classes.push(cut.class(surface.classes[v as usize]));
            if let several @ [_, _, ..] = holders.of(v) {
                skin.shared.push(new, several.iter().copied());
            }
        }
        let placed = |v: u32| place[v as usize];
        skin.triangles.iter_mut().for_each(|t| t.vertices = t.vertices.map(placed));
        skin.edges.iter_mut().for_each(|(ends, _)| *ends = ends.map(placed));
        skins.push(skin);
    }
    if seen.iter().all(|&seen| seen) { Ok(skins) } else { Err(LooseEdge) }
}

/// Adds a triangle to the part behind it, and, reversed, to the part in front of it if that is a
/// different one.
fn push_sides(cut: &CutModel, patch: PatchId, [a, b, c]: [u32; 3], of_parts: &mut [Vec<SkinTriangle>]) {
    let [behind, before] = cut.beside(patch);
    let seen = |is_back: bool| match cut.faces[patch.index()] {
        Face::Old(patch, same) => Some((patch, same == is_back)),
        Face::Cut(_) => None,
    };
    if let Some((part, body)) = behind {
        let front = before.filter(|(other, _)| *other == part).map(|(_, body)| body);
        let triangle = SkinTriangle { vertices: [a, b, c], beside: [Some(body), front], patch: seen(true) };
        of_parts[part].push(triangle);
    }
    if let Some((part, body)) = before.filter(|(part, _)| behind.is_none_or(|(other, _)| other != *part)) {
        let triangle = SkinTriangle { vertices: [a, c, b], beside: [Some(body), None], patch: seen(false) };
        of_parts[part].push(triangle);
    }
}

/// The parts with triangles at each vertex, ascending.
struct Holders {
    parts: Vec<Rank>,
    /// For each vertex the start of its parts, then the end.
    starts: Vec<usize>,
}

impl Holders {
    fn of(&self, vertex: u32) -> &[Rank] {
        &self.parts[self.starts[vertex as usize]..self.starts[vertex as usize + 1]]
    }
}

fn holders(vertices: usize, of_parts: &[Vec<SkinTriangle>]) -> Holders {
    let mut pairs: Vec<(u32, Rank)> = Vec::new();
    for (part, triangles) in (0..).zip(of_parts) {
        pairs.extend(triangles.iter().flat_map(|t| t.vertices).map(|v| (v, part)));
    }
    pairs.sort_unstable();
    pairs.dedup();
    let starts = (0..=vertices as u32).map(|v| pairs.partition_point(|pair| pair.0 < v)).collect();
    Holders { parts: pairs.iter().map(|pair| pair.1).collect(), starts }
}

/// Prescribed vertices inside bodies, and the parts that contain them.
fn user_points(cut: &CutModel, surface: &SurfaceMesh, holders: &Holders) -> Vec<(u32, usize)> {
    let isolated = (0..surface.points.len() as u32).filter(|&v| holders.of(v).is_empty());
    let of = |v: u32| {
        let point = &surface.points[v as usize];
        let geometry = &cut.model.geometry;
        let is_in =
            |body: &csg::Body| body.solid.side(&geometry.surfaces, point, 0.0) == csg::solid::Side::Inside;
        let piece = geometry.bodies.iter().position(is_in)?;
        Some((v, cut.pieces[piece].0))
    };
    isolated.filter_map(of).collect()
}

/// Serialises a skin.
pub fn pack(skin: &Skin) -> Vec<u8> {
    let triangle = |t: &SkinTriangle| {
        let body = |body: Option<BodyId>| body.map_or(NONE, |body| body.0);
        let (patch, back) = t.patch.map_or((NONE, false), |(patch, back)| (patch.0, back));
        let [a, b, c] = t.vertices;
        [a, b, c, body(t.beside[0]), body(t.beside[1]), patch, u32::from(back)]
    };
    let edge = |&([a, b], class): &([u32; 2], Class)| {
        let [kind, id] = class.code();
        [a, b, kind, id]
    };
    let mut message = Vec::new();
    put(&mut message, &[skin.on_triangles as u64]);
    put(&mut message, &skin.names);
    put(&mut message, &skin.points.iter().map(|p| [p.x, p.y, p.z]).collect::<Vec<_>>());
    put(&mut message, &skin.classes.iter().map(|class| class.code()).collect::<Vec<_>>());
    put(&mut message, &skin.triangles.iter().map(triangle).collect::<Vec<_>>());
    put(&mut message, &skin.edges.iter().map(edge).collect::<Vec<_>>());
    put(&mut message, &skin.shared.ids);
    put(&mut message, &skin.shared.offsets);
    put(&mut message, &skin.shared.holders);
    message
}

/// The inverse of [`pack`]: reads a skin from the front of a message.
///
/// # Panics
/// If the message is not a skin.
pub fn unpack(message: &mut &[u8]) -> Skin {
    let m = message;
    let some = |id: u32| (id != NONE).then_some(id);
    let triangle = |[a, b, c, behind, front, patch, back]: [u32; 7]| SkinTriangle {
        vertices: [a, b, c],
        beside: [behind, front].map(|body| some(body).map(BodyId)),
        patch: some(patch).map(|patch| (PatchId(patch), back == 1)),
    };
    let edge = |[a, b, kind, id]: [u32; 4]| ([a, b], Class::decode([kind, id]));
    let on_triangles = take::<u64>(m)[0] as usize;
    let names = take(m);
    let points = take::<[f64; 3]>(m).into_iter().map(Into::into).collect();
    let classes = take::<[u32; 2]>(m).into_iter().map(Class::decode).collect();
    let triangles = take::<[u32; 7]>(m).into_iter().map(triangle).collect();
    let edges = take::<[u32; 4]>(m).into_iter().map(edge).collect();
    let shared = Shared { ids: take(m), offsets: take(m), holders: take(m) };
    Skin { names, shared, on_triangles, points, classes, triangles, edges }
}

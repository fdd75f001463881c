//! Collects points and polygons, and cleans them.

use super::Surface;
use super::merge::Merger;
use super::polygon::{self, PolygonFault};
use super::repeated::{self, Place};
use crate::Point;
use crate::files::input::{Fault, counted};

/// A surface under construction from merged points.
pub(super) struct Builder {
    surface: Surface,
    /// The merged index of each point of the file, if any were merged.
    to_merged: Option<Vec<u32>>,
    merged: usize,
    collapsed: usize,
    corners: Vec<u32>,
    /// The key and the place of each face with triangles.
    faces: Vec<(repeated::Key, usize)>,
    /// The face of each triangle.
    face_of: Vec<u32>,
}

impl Builder {
    /// Merges points at the same place.
    ///
    /// # Errors
    /// More points than can be numbered.
    pub fn new(points: Vec<Point>) -> Result<Self, Fault> {
        let mut merger = Merger::default();
        let to_merged: Vec<u32> = points.iter().map_while(|p| merger.number(*p)).collect();
        if to_merged.len() < points.len() {
            return Err(Fault::file("the file has more than 2^32 points"));
        }
        let kept = merger.into_points();
        let merged = points.len() - kept.len();
        let mut builder = Self::of_distinct(kept);
        builder.merged = merged;
        builder.to_merged = (merged > 0).then_some(to_merged);
        Ok(builder)
    }

    /// Starts with distinct points.
    pub fn of_distinct(points: Vec<Point>) -> Self {
        let surface = Surface { points, ..Surface::default() };
        Self {
            surface,
            to_merged: None,
            merged: 0,
            collapsed: 0,
            corners: Vec::new(),
            faces: Vec::new(),
            face_of: Vec::new(),
        }
    }

    /// The points.
    pub fn points(&self) -> &[Point] {
        &self.surface.points
    }

    /// The merged index of a point of the file.
    pub fn merged(&self, vertex: u32) -> u32 {
        self.to_merged.as_ref().map_or(vertex, |to_merged| to_merged[vertex as usize])
    }

    /// The coordinates of a point of the file.
    pub fn place(&self, vertex: u32) -> Point {
        self.surface.points[self.merged(vertex) as usize]
    }

    /// Adds a group; empty groups are dropped at the end.
    pub fn group(&mut self, name: String, number: i64) -> u32 {
        self.surface.groups.push(name);
        self.surface.group_numbers.push(number);
        self.surface.groups.len() as u32 - 1
    }

    /// Begins a face at this place of the file; the polygons and triangles that follow are its own.
    /// `corners` are merged points.
    pub fn face(&mut self, corners: &[u32], at: usize) {
        let key = repeated::key(corners, self.surface.unoriented);
        self.faces.push((key, at));
    }

    /// The order of corners is arbitrary: faces with either order are the same.
    pub fn set_unoriented(&mut self) {
        self.surface.unoriented = true;
    }

    /// Adds a polygon at this place of the file by the file's indices of its corners. With fewer
    /// than three distinct corners it counts as collapsed.
    pub fn polygon(&mut self, corners: &[u32], group: u32, at: usize) -> Result<(), PolygonFault> {
        let mut ring = std::mem::take(&mut self.corners);
        ring.clear();
        ring.extend(corners.iter().map(|&v| self.merged(v)));
        ring.dedup();
        while ring.len() > 1 && ring.first() == ring.last() {
            ring.pop();
        }
        self.face(&ring, at);
        let done = match ring[..] {
            [] | [_] | [_, _] => {
                self.collapsed += 1;
                Ok(())
            }
            [a, b, c] => {
                self.triangles(&[[a, b, c]], group);
                Ok(())
            }
            _ => polygon::triangulate(&self.surface.points, &ring).map(|t| self.triangles(&t, group)),
        };
        self.corners = ring;
        done
    }

    /// Adds triangles of merged points to the last face.
    pub fn triangles(&mut self, triangles: &[[u32; 3]], group: u32) {
        for &[a, b, c] in triangles {
            if a == b || b == c || c == a {
                self.collapsed += 1;
            } else {
                self.surface.triangles.push([a, b, c]);
                self.surface.group.push(group);
                self.face_of.push(self.faces.len() as u32 - 1);
            }
        }
    }

    /// Drops repeated faces, unused points and empty groups, and notes what was changed; `place`
    /// turns the places of faces into text.
    pub fn finish(self, place: Place) -> Surface {
        let Self { mut surface, merged, collapsed, faces, face_of, .. } = self;
        let repeated = repeated::leave_out(&mut surface, &faces, &face_of, place);
        drop_unused(&mut surface);
        drop_empty_groups(&mut surface);
        let note = |count: usize, what: &str, done: &str| {
            (count > 0).then(|| format!("{} {done}", counted(count, what)))
        };
        let loose = surface.loose_points.len();
        surface.notes.extend(note(merged, "point", "at the very place of others merged with them"));
        surface.notes.extend(note(collapsed, "face", "with fewer than three different corners left out"));
        surface.notes.extend(repeated);
        surface.notes.extend(note(loose, "point", "in no face"));
        surface
    }
}

/// Moves points that no triangle uses to the loose points.
pub(super) fn drop_unused(surface: &mut Surface) {
    let mut to_kept = vec![u32::MAX; surface.points.len()];
    surface.triangles.iter().flatten().for_each(|&v| to_kept[v as usize] = 0);
    if to_kept.iter().all(|&used| used == 0) {
        return;
    }
    let mut kept = Vec::new();
    for (point, to_kept) in surface.points.iter().zip(&mut to_kept) {
        if *to_kept == 0 {
            *to_kept = kept.len() as u32;
            kept.push(*point);
        } else {
            surface.loose_points.push(*point);
        }
    }
    surface.points = kept;
    surface.triangles.iter_mut().flatten().for_each(|v| *v = to_kept[*v as usize]);
}

fn drop_empty_groups(surface: &mut Surface) {
    let mut to_kept = vec![u32::MAX; surface.groups.len()];
    surface.group.iter().for_each(|&g| to_kept[g as usize] = 0);
    let mut kept = 0;
    for (old, to_kept) in to_kept.iter_mut().enumerate() {
        if *to_kept == 0 {
            *to_kept = kept;
            surface.groups.swap(kept as usize, old);
            surface.group_numbers.swap(kept as usize, old);
            kept += 1;
        }
    }
    surface.groups.truncate(kept as usize);
    surface.group_numbers.truncate(kept as usize);
    surface.group.iter_mut().for_each(|g| *g = to_kept[*g as usize]);
}

//! What was merged, for the report and for notes.

use serde::Serialize;

/// A narrow face that was merged into a neighbour.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MergedFace {
    /// The number of the face.
    pub face: usize,
    /// Its name in the file.
    pub name: Option<String>,
    /// The number of the face that it is merged into.
    pub into: usize,
    /// Its width (length).
    pub width: f64,
}

/// A short edge that was merged into a curve.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MergedEdge {
    /// The number of the edge.
    pub edge: usize,
    /// All edges of the curve.
    pub curve: Vec<usize>,
    /// Its length.
    pub length: f64,
}

/// A narrow face that was not merged because of its name.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NamedFace {
    /// The number of the face.
    pub face: usize,
    /// Its name in the file.
    pub name: String,
    /// Its width (length).
    pub width: f64,
}

/// A narrow tip of a face that was merged into a neighbour.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MergedTip {
    /// The number of the face.
    pub face: usize,
    /// The number of the face that it is merged into.
    pub into: usize,
    /// The corner at its end.
    pub point: [f64; 3],
    /// Its width at the other end, where it was cut off (length).
    pub width: f64,
}

/// Faces and edges that are smaller than the elements.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct MergedSmall {
    /// Faces that were merged.
    pub faces: Vec<MergedFace>,
    /// Tips of faces that were merged.
    pub tips: Vec<MergedTip>,
    /// Edges that were merged.
    pub edges: Vec<MergedEdge>,
    /// Narrow faces that were not merged because their neighbours have other names.
    pub named: Vec<NamedFace>,
}

/// The most faces or edges that a note lists; the report has all.
const MOST_LISTED: usize = 5;

impl MergedSmall {
    /// Sentences for the user.
    pub fn notes(&self) -> Vec<String> {
        let list = |items: &mut dyn Iterator<Item = String>, count: usize| {
            let listed: Vec<String> = items.take(MOST_LISTED).collect();
            let more = if count > MOST_LISTED {
                format!(" and {} more", count - MOST_LISTED)
            } else {
                String::new()
            };
            listed.join(", ") + &more
        };
        let named = |face: usize, name: Option<&str>| match name {
            Some(name) => format!("face {face} `{name}`"),
            None => format!("face {face}"),
        };
        let mut notes = Vec::new();
        if !self.faces.is_empty() {
            let mut each = self.faces.iter().map(|merged| {
                let face = named(merged.face, merged.name.as_deref());
                format!("{face} ({:.1e} wide) into face {}", merged.width, merged.into)
            });
            let listed = list(&mut each, self.faces.len());
            notes.push(format!(
                "faces far narrower than the elements are merged: {listed} (--keep-small keeps them)"
            ));
        }
        if !self.tips.is_empty() {
            let mut each = self.tips.iter().map(|tip| {
                let MergedTip { face, into, point: [x, y, z], width } = tip;
                format!("face {face} near ({x:.4}, {y:.4}, {z:.4}), up to {width:.1e} wide, into face {into}")
            });
            let listed = list(&mut each, self.tips.len());
            notes.push(format!(
                "tips of faces far narrower than the elements are merged: {listed} (--keep-small keeps them)"
            ));
        }
        if !self.edges.is_empty() {
            let mut each = self.edges.iter().map(|merged| {
                let others = merged.curve.iter().filter(|other| **other != merged.edge);
                let others: Vec<String> = others.map(usize::to_string).collect();
                format!("edge {} ({:.1e}) with {}", merged.edge, merged.length, others.join(" and "))
            });
            let listed = list(&mut each, self.edges.len());
            notes.push(format!(
                "edges far shorter than the elements are joined: {listed} (--keep-small keeps them)"
            ));
        }
        if !self.named.is_empty() {
            let mut each = self
                .named
                .iter()
                .map(|kept| format!("{} ({:.1e} wide)", named(kept.face, Some(&kept.name)), kept.width));
            let listed = list(&mut each, self.named.len());
            notes.push(format!(
                "narrow faces are kept, with small elements, because their neighbours have other names: {listed}"
            ));
        }
        notes
    }
}

//! Edges whose vertices are in the wrong order.

use super::volumes;
use crate::{Model, Settings, Tessellation, Unit};

/// A file of the repository, and the places of the records of edges with two vertices.
fn file(name: &str) -> (String, Vec<usize>) {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../geometries/step");
    let text = std::fs::read_to_string(folder.join(name)).expect("a file of the repository");
    let places = text.match_indices("EDGE_CURVE('',").map(|(place, word)| place + word.len());
    let edges: Vec<usize> = places
        .filter(|&place| {
            let [a, b, ..] = text[place..].splitn(3, ',').collect::<Vec<_>>()[..] else { return false };
            a != b
        })
        .collect();
    (text, edges)
}

/// Exchanges the vertices of edges, given by the places of their records.
fn exchanged(text: &str, edges: &[usize]) -> String {
    let mut out = text.to_owned();
    for &place in edges {
        let [a, b, ..] = text[place..].splitn(3, ',').collect::<Vec<_>>()[..] else { panic!("two vertices") };
        out.replace_range(place..place + a.len() + 1 + b.len(), &format!("{b},{a}"));
    }
    out
}

/// Asserts that files with exchanged vertices have the volume of the right one, and say so.
fn assert_mended(name: &str, sets: impl Fn(&[usize]) -> Vec<Vec<usize>>) {
    let (text, edges) = file(name);
    let (model, exact) = volumes(&text, Unit::OfFile);
    assert!(model.notes.is_empty(), "{:?}", model.notes);
    for set in sets(&edges) {
        let (model, found) = volumes(&exchanged(&text, &set), Unit::OfFile);
        assert!((found[0] / exact[0] - 1.0).abs() < 1e-9, "{name}, {set:?}: {found:?}, not {exact:?}");
        let edges = if set.len() == 1 { "an edge has".into() } else { format!("{} edges have", set.len()) };
        assert!(matches!(&model.notes[..], [note] if note.starts_with(&edges)), "{:?}", model.notes);
    }
}

#[test]
fn vertices_in_the_wrong_order_are_exchanged() {
    // Lines and quarters of circles.
    assert_mended("rounded_cube.step", |edges| {
        let mut sets: Vec<Vec<usize>> = edges.chunks(1).map(<[_]>::to_vec).collect();
        sets.push(edges.iter().copied().step_by(3).collect());
        sets
    });
    // Halves of circles, of which two bound a face.
    assert_mended("cylinder_step.step", |edges| edges.chunks(1).map(<[_]>::to_vec).collect());
}

#[test]
fn loops_that_stay_open_are_refused_and_nothing_is_exchanged() {
    let (text, edges) = file("plate.step");
    // The second vertex of an edge becomes its first one, too: no order of its vertices is right.
    let [a, b, ..] = text[edges[0]..].splitn(3, ',').collect::<Vec<_>>()[..] else { panic!("two vertices") };
    let mut damaged = exchanged(&text, &edges[1..2]);
    damaged.replace_range(edges[0]..edges[0] + a.len() + 1 + b.len(), &format!("{a},{a}"));
    let mut model = Model::read_step(damaged.as_bytes(), Unit::OfFile).unwrap();
    assert!(model.notes.is_empty(), "{:?}", model.notes);
    let error = Tessellation::of(&mut model, &Settings { chord: 1e-3, angle: 0.2 }).unwrap_err();
    assert!(error.to_string().contains("face 1: "), "{error}");
}

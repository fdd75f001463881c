//! Tables that compare several meshes, as text.

use super::{ANGLE_STEP, Quality};
use std::path::Path;

/// A table with a column for each mesh, followed by both histograms and the notes.
pub fn table(meshes: &[Quality]) -> String {
    let heads = column_heads(meshes);
    let widths: Vec<usize> = heads.iter().map(|head| head.chars().count().max(LEAST_WIDTH)).collect();
    let mut text = String::new();
    line(&mut text, "", &heads, &widths);
    let mut row = |title: &str, value: &dyn Fn(&Quality) -> String| {
        line(&mut text, title, &meshes.iter().map(value).collect::<Vec<_>>(), &widths);
    };
    row("vertices", &|q| q.vertices.to_string());
    row("tets", &|q| q.tets.to_string());
    row("boundary triangles", &|q| q.boundary.to_string());
    row("bodies", &|q| q.bodies.to_string());
    row("volume", &|q| number(q.volume));
    row("inverted tets", &|q| q.inverted.to_string());
    if meshes.iter().any(|q| q.order > 1) {
        let shown = |value: Option<String>| value.unwrap_or_else(|| "-".into());
        row("order", &|q| q.order.to_string());
        row("not valid in order 2", &|q| shown(q.not_valid.map(|count| count.to_string())));
        row("scaled Jacobian", &|q| shown(q.scaled_jacobian.map(|scaled| format!("{scaled:.4}"))));
    }
    row("dihedral angle: smallest", &|q| degrees(q.smallest_dihedral));
    row("  1st percentile of tets", &|q| degrees(q.first_percentile_dihedral));
    row("  5th percentile of tets", &|q| degrees(q.fifth_percentile_dihedral));
    row("  median of tets", &|q| degrees(q.median_dihedral));
    row("  mean of tets", &|q| degrees(q.mean_dihedral));
    row("  largest", &|q| degrees(q.largest_dihedral));
    row("mean ratio: worst", &|q| format!("{:.4}", q.worst_mean_ratio));
    row("  mean", &|q| format!("{:.4}", q.mean_mean_ratio));
    row("radius-edge ratio: worst", &|q| number(q.worst_radius_edge));
    row("NETGEN badness: mean", &|q| number(q.mean_badness));
    row("  worst", &|q| number(q.worst_badness));
    row("  total", &|q| number(q.total_badness));
    histogram(
        &mut text,
        "tets by smallest dihedral angle",
        meshes,
        &widths,
        |q| &q.smallest_dihedral_histogram,
        &|k| format!("{:.0}° to {:.0}°", k as f64 * ANGLE_STEP, (k + 1) as f64 * ANGLE_STEP),
    );
    histogram(&mut text, "tets by 1 / badness (NETGEN)", meshes, &widths, |q| &q.badness_histogram, &|k| {
        format!("{:.2} to {:.2}", k as f64 / 20.0, (k + 1) as f64 / 20.0)
    });
    for (head, mesh) in heads.iter().zip(meshes) {
        mesh.notes.iter().for_each(|note| text += &format!("{head}: {note}\n"));
    }
    text
}

const LEAST_WIDTH: usize = 10;
const TITLE_WIDTH: usize = 26;

/// File names, or paths if file names are not unique.
pub(super) fn column_heads(meshes: &[Quality]) -> Vec<String> {
    let name =
        |q: &Quality| Path::new(&q.mesh).file_name().map_or(q.mesh.clone(), |n| n.to_string_lossy().into());
    let names: Vec<String> = meshes.iter().map(name).collect();
    let is_unique = |name: &String| names.iter().filter(|n| *n == name).count() == 1;
    names.iter().zip(meshes).map(|(n, q)| if is_unique(n) { n.clone() } else { q.mesh.clone() }).collect()
}

fn line(text: &mut String, title: &str, cells: &[String], widths: &[usize]) {
    let mut line = format!("{title:<TITLE_WIDTH$}");
    cells.iter().zip(widths).for_each(|(cell, width)| line += &format!("  {cell:>width$}"));
    *text += line.trim_end();
    text.push('\n');
}

/// Prints the classes from the first to the last that has tets of any mesh.
fn histogram(
    text: &mut String,
    title: &str,
    meshes: &[Quality],
    widths: &[usize],
    of: impl Fn(&Quality) -> &Vec<usize>,
    class: &dyn Fn(usize) -> String,
) {
    let used = |k: &usize| meshes.iter().any(|q| of(q)[*k] > 0);
    let classes = meshes.first().map_or(0, |q| of(q).len());
    let (Some(first), Some(last)) = ((0..classes).find(used), (0..classes).rev().find(used)) else { return };
    *text += &format!("{title}\n");
    for k in first..=last {
        let cells: Vec<String> = meshes.iter().map(|q| of(q)[k].to_string()).collect();
        line(text, &format!("  {}", class(k)), &cells, widths);
    }
}

fn degrees(angle: f64) -> String {
    format!("{angle:.2}°")
}

/// Formats six digits, or an exponent if that is shorter.
fn number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || (1e-3..1e7).contains(&size) {
        let before = if size >= 1.0 { size.log10() as usize + 1 } else { 1 };
        format!("{value:.*}", 6_usize.saturating_sub(before).max(1))
    } else {
        format!("{value:.4e}")
    }
}

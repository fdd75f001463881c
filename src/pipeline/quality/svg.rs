//! Superimposed histograms of several meshes, as SVG.

use super::{ANGLE_STEP, Quality, table};
use std::fmt::Write;

/// One histogram: title, classes, counts.
struct Panel {
    title: &'static str,
    /// Start and end of the axis, and its unit.
    axis: (f64, f64, &'static str),
    /// Distance between labels of the axis.
    tick: f64,
    counts: fn(&Quality) -> &[usize],
    /// Width of a class.
    step: f64,
}

/// The smallest angle of a tet is at most the regular tet's 70.5°, the largest at least that.
const PANELS: [Panel; 3] = [
    Panel {
        title: "smallest dihedral angle of each tet",
        axis: (0.0, 75.0, "°"),
        tick: 15.0,
        counts: |q| &q.smallest_dihedral_histogram,
        step: ANGLE_STEP,
    },
    Panel {
        title: "largest dihedral angle of each tet",
        axis: (70.0, 180.0, "°"),
        tick: 20.0,
        counts: |q| &q.largest_dihedral_histogram,
        step: ANGLE_STEP,
    },
    Panel {
        title: "1 / badness (NETGEN)",
        axis: (0.0, 1.0, ""),
        tick: 0.2,
        counts: |q| &q.badness_histogram,
        step: 0.05,
    },
];

/// Size of the axes' rectangle, and the space around it, in pixels.
const WIDTH: f64 = 300.0;
const HEIGHT: f64 = 200.0;
const LEFT: f64 = 52.0;
const TOP: f64 = 34.0;
const PITCH: f64 = WIDTH + LEFT + 18.0;
/// Height of a line of the legend.
const LINE: f64 = 18.0;

/// Draws histograms of the smallest and largest dihedral angle and of the badness, as fractions of
/// each mesh's tets, with a coloured line for each mesh.
pub fn histograms(meshes: &[Quality]) -> String {
    let width = PITCH * PANELS.len() as f64 + 10.0;
    let legend_top = TOP + HEIGHT + 44.0;
    let height = legend_top + LINE * meshes.len() as f64 + 8.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    for (k, panel) in PANELS.iter().enumerate() {
        draw_panel(&mut svg, panel, meshes, PITCH * k as f64 + LEFT);
    }
    for (k, name) in table::column_heads(meshes).iter().enumerate() {
        let y = legend_top + LINE * k as f64;
        let (color, from, to) = (color(k), LEFT, LEFT + 24.0);
        let text = format!(
            "{}: {} tets, smallest angle {:.2}°, 1st percentile {:.2}°",
            escaped(name),
            meshes[k].tets,
            meshes[k].smallest_dihedral,
            meshes[k].first_percentile_dihedral
        );
        let text_y = y + 4.0;
        put(&mut svg, format_args!("<path d=\"M{from} {y}H{to}\" stroke=\"{color}\" stroke-width=\"3\"/>"));
        put(&mut svg, format_args!("<text x=\"{}\" y=\"{text_y}\">{text}</text>", to + 8.0));
    }
    svg + "</svg>\n"
}

fn put(svg: &mut String, element: std::fmt::Arguments) {
    writeln!(svg, "{element}").expect("writing to a string cannot fail");
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Colours that also differ with red-green colour blindness (Okabe, Ito 2008).
fn color(k: usize) -> &'static str {
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#8c6d31"][k % 8]
}

/// The fraction of each mesh's tets in each class.
fn shares(panel: &Panel, mesh: &Quality) -> Vec<f64> {
    (panel.counts)(mesh).iter().map(|&count| count as f64 / mesh.tets.max(1) as f64).collect()
}

fn draw_panel(svg: &mut String, panel: &Panel, meshes: &[Quality], left: f64) {
    let (from, to, unit) = panel.axis;
    let (right, bottom) = (left + WIDTH, TOP + HEIGHT);
    let most = meshes.iter().flat_map(|mesh| shares(panel, mesh)).fold(0.0, f64::max);
    // The axis ends at the next multiple of five percent.
    let top_share = ((most * 20.0).ceil() / 20.0).max(0.05);
    let x = |value: f64| left + (value - from) / (to - from) * WIDTH;
    let y = |share: f64| bottom - share / top_share * HEIGHT;
    put(
        svg,
        format_args!("<text x=\"{left}\" y=\"{}\" font-weight=\"bold\">{}</text>", TOP - 12.0, panel.title),
    );
    for k in 0..=4 {
        let share = top_share * f64::from(k) / 4.0;
        let at = y(share);
        put(svg, format_args!("<path d=\"M{left} {at:.1}H{right}\" stroke=\"#dddddd\"/>"));
        let (x, at, percent) = (left - 6.0, at + 4.0, (1000.0 * share).round() / 10.0);
        put(svg, format_args!("<text x=\"{x}\" y=\"{at:.1}\" text-anchor=\"end\">{percent}%</text>"));
    }
    let ticks = ((to - from) / panel.tick).round() as u32;
    for k in 0..=ticks {
        let value = from + panel.tick * f64::from(k);
        if value > to + 1e-9 {
            break;
        }
        let label = if panel.tick < 1.0 { format!("{value:.1}") } else { format!("{value:.0}{unit}") };
        let at = bottom + 16.0;
        put(
            svg,
            format_args!("<text x=\"{:.1}\" y=\"{at}\" text-anchor=\"middle\">{label}</text>", x(value)),
        );
    }
    for (k, mesh) in meshes.iter().enumerate() {
        let mut path = format!("M{:.1} {bottom}", x(from));
        for (class, share) in shares(panel, mesh).into_iter().enumerate() {
            let (begin, end) = (class as f64 * panel.step, (class + 1) as f64 * panel.step);
            if end > from + 1e-9 && begin < to - 1e-9 {
                path += &format!("V{:.1}H{:.1}", y(share), x(end));
            }
        }
        let color = color(k);
        put(
            svg,
            format_args!(
                "<path d=\"{path}V{bottom}\" fill=\"{color}\" fill-opacity=\"0.12\" stroke=\"{color}\" stroke-width=\"1.6\"/>"
            ),
        );
    }
    put(svg, format_args!("<path d=\"M{left} {TOP}V{bottom}H{right}\" fill=\"none\" stroke=\"black\"/>"));
}

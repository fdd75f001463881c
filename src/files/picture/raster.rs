//! Rasterizes triangles: a depth buffer, flat shading, and edges as thin lines.

use super::scene::{Cut, Scene, Triangle};
use crate::files::color::Color;
use nalgebra::Vector3;
use rayon::prelude::*;

/// Settings of the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Width of the image, in pixels.
    pub width: u32,
    /// Height of the image, in pixels.
    pub height: u32,
    /// Direction of the viewer: angle about z from the x axis, in degrees.
    pub azimuth: f64,
    /// Elevation of the viewer above the xy-plane, in degrees; below 90, and z points up in the
    /// image.
    pub elevation: f64,
    /// Width of the triangles' edges, in pixels; 0 for none.
    pub edge_width: f32,
    /// Colour of the triangles' edges.
    pub edge_color: Color,
    /// Background colour.
    pub background: Color,
    /// Margin around the scene, as a fraction of the image.
    pub margin: f32,
}

impl Settings {
    /// A view of the face that a cut opens: the tets that are drawn are behind the plane.
    pub fn facing(cut: &Cut) -> Self {
        /// Beside the normal, so that other faces are visible too (degrees).
        const ASIDE: f64 = 30.0;
        /// Largest elevation, so that the picture has an upper end (degrees).
        const STEEPEST: f64 = 65.0;
        let normal = Vector3::from(cut.normal);
        let level = normal.xy().norm();
        let rise = normal.z.atan2(level).to_degrees();
        let default = Self::default();
        // The normal of a level cut has no azimuth.
        let azimuth = if level > 1e-6 * normal.norm() {
            normal.y.atan2(normal.x).to_degrees() + ASIDE
        } else {
            default.azimuth
        };
        let elevation = (rise + default.elevation).clamp(-STEEPEST, STEEPEST);
        Self { azimuth, elevation, ..default }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            width: 1200,
            height: 900,
            azimuth: -60.0,
            elevation: 25.0,
            edge_width: 1.0,
            edge_color: [0.13, 0.13, 0.16],
            background: [1.0; 3],
            margin: 0.04,
        }
    }
}

/// An image, line by line from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Width, in pixels.
    pub width: u32,
    /// Height, in pixels.
    pub height: u32,
    /// Red, green, blue of each pixel.
    pub pixels: Vec<[u8; 3]>,
}

/// Samples per pixel in each direction, for antialiasing.
const SAMPLES: u32 = 2;

/// Edges have their full colour in triangles that are this many line widths across. With 4, a mesh
/// of 3-pixel triangles turns grey; with 12, lines are pale although there is room for them.
const FULL_LINES_AT: f32 = 8.0;

/// Image lines that one thread draws at a time.
const BAND: u32 = 32;

/// Draws a scene scaled to the image. The result does not depend on the number of threads.
pub fn render(scene: &Scene, settings: &Settings) -> Image {
    let (width, height) = (settings.width.max(1), settings.height.max(1));
    let drawn = place(scene, settings, width * SAMPLES, height * SAMPLES);
    let bands = height.div_ceil(BAND);
    let lines = |band: u32| band * BAND..height.min((band + 1) * BAND);
    let pixels: Vec<Vec<[u8; 3]>> = (0..bands)
        .into_par_iter()
        .map(|band| {
            let lines = lines(band);
            let mut canvas =
                Canvas::new(width * SAMPLES, lines.start * SAMPLES, lines.end * SAMPLES, settings);
            drawn.iter().for_each(|triangle| canvas.draw(triangle));
            canvas.pixels(width)
        })
        .collect();
    Image { width, height, pixels: pixels.concat() }
}

/// A triangle in pixels: x to the right, y down, z away from the viewer.
struct Drawn {
    corners: [[f32; 3]; 3],
    color: Color,
    edges: [bool; 3],
    pieces: u32,
}

/// The directions right and down in the image, and away from the viewer.
fn directions(settings: &Settings) -> [Vector3<f64>; 3] {
    let (a, e) = (settings.azimuth.to_radians(), settings.elevation.to_radians());
    let away = -Vector3::new(a.cos() * e.cos(), a.sin() * e.cos(), e.sin());
    let right = Vector3::new(-a.sin(), a.cos(), 0.0);
    [right, away.cross(&right), away]
}

/// Transforms the scene to pixels and shades it.
fn place(scene: &Scene, settings: &Settings, width: u32, height: u32) -> Vec<Drawn> {
    let axes = directions(settings);
    let turn = |corner: [f64; 3]| axes.map(|axis| axis.dot(&Vector3::from(corner)));
    let turned: Vec<[[f64; 3]; 3]> = scene.triangles.iter().map(|t| t.corners.map(turn)).collect();
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for corner in turned.iter().flatten() {
        for k in 0..3 {
            low[k] = low[k].min(corner[k]);
            high[k] = high[k].max(corner[k]);
        }
    }
    let size = [f64::from(width), f64::from(height)];
    let room = 1.0 - 2.0 * f64::from(settings.margin);
    let fit = |k: usize| room * size[k] / (high[k] - low[k]).max(f64::MIN_POSITIVE);
    let scale = fit(0).min(fit(1));
    // Single precision suffices from here on, because numbers are as small as the image.
    let to_pixel = |c: [f64; 3]| {
        let from_middle = |k: usize| scale * (c[k] - 0.5 * (low[k] + high[k]));
        [0.5 * size[0] + from_middle(0), 0.5 * size[1] + from_middle(1), from_middle(2)].map(|x| x as f32)
    };
    let draw = |(corners, triangle): (&[[f64; 3]; 3], &Triangle)| {
        let corners = corners.map(to_pixel);
        let Triangle { color, edges, pieces, .. } = *triangle;
        Drawn { corners, color: color.map(|c| c * brightness(&corners)), edges, pieces }
    };
    turned.iter().zip(&scene.triangles).map(draw).collect()
}

/// Light comes from the viewer's upper left; both sides of a triangle are lit equally.
fn brightness(corners: &[[f32; 3]; 3]) -> f32 {
    let [a, b, c] = corners.map(Vector3::from);
    let normal = (b - a).cross(&(c - a));
    let normal = normal / normal.norm().max(f32::MIN_POSITIVE);
    let normal = if normal.z > 0.0 { -normal } else { normal };
    let light = Vector3::new(-0.35_f32, -0.55, -0.76);
    0.58 + 0.42 * normal.dot(&light).max(0.0)
}

/// Some lines of the image, in samples.
struct Canvas<'a> {
    settings: &'a Settings,
    width: u32,
    first: u32,
    end: u32,
    depth: Vec<f32>,
    color: Vec<Color>,
}

impl<'a> Canvas<'a> {
    fn new(width: u32, first: u32, end: u32, settings: &'a Settings) -> Self {
        let samples = width as usize * (end - first) as usize;
        Self {
            settings,
            width,
            first,
            end,
            depth: vec![f32::INFINITY; samples],
            color: vec![settings.background; samples],
        }
    }

    /// Draws a triangle where nothing is nearer. Samples are at the centres of their squares.
    fn draw(&mut self, triangle: &Drawn) {
        let [a, b, c] = triangle.corners;
        let area = cross(a, b, c);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let range = |k: usize, first: u32, end: u32| {
            let low = a[k].min(b[k]).min(c[k]).floor().max(first as f32);
            let high = a[k].max(b[k]).max(c[k]).ceil().min(end as f32);
            low as u32..(high as u32).max(low as u32)
        };
        let (columns, lines) = (range(0, 0, self.width), range(1, self.first, self.end));
        // Heights over the edges opposite a, b, c: a barycentric coordinate times its height is a
        // distance.
        let heights = [(b, c), (c, a), (a, b)].map(|(p, q)| area.abs() / (q[0] - p[0]).hypot(q[1] - p[1]));
        let line = self.settings.edge_width * SAMPLES as f32;
        // Lines fade with the size of the face, so that small faces do not become all dark.
        // The size is the square root of the area: heights differ more between neighbours, which
        // looks blotched.
        let strength = (triangle.pieces as f32 * area.abs().sqrt() / (FULL_LINES_AT * line)).min(1.0);
        for y in lines {
            for x in columns.clone() {
                let p = [x as f32 + 0.5, y as f32 + 0.5, 0.0];
                let w = [cross(b, c, p), cross(c, a, p), cross(a, b, p)].map(|w| w / area);
                if w.iter().any(|&w| w < 0.0) {
                    continue;
                }
                let z = w[0] * a[2] + w[1] * b[2] + w[2] * c[2];
                let sample = (y - self.first) as usize * self.width as usize + x as usize;
                if z < self.depth[sample] {
                    self.depth[sample] = z;
                    let on_line = (0..3).any(|k| triangle.edges[k] && w[k] * heights[k] < 0.5 * line);
                    self.color[sample] = if on_line {
                        mixed(triangle.color, self.settings.edge_color, strength)
                    } else {
                        triangle.color
                    };
                }
            }
        }
    }

    /// The mean of the samples of each pixel.
    fn pixels(&self, width: u32) -> Vec<[u8; 3]> {
        let lines = (self.end - self.first) / SAMPLES;
        let pixel = |line: u32, column: u32| {
            let mut sum = [0.0; 3];
            for sample in 0..SAMPLES * SAMPLES {
                let (x, y) = (column * SAMPLES + sample % SAMPLES, line * SAMPLES + sample / SAMPLES);
                let color = self.color[y as usize * self.width as usize + x as usize];
                (0..3).for_each(|k| sum[k] += color[k]);
            }
            sum.map(|s| (255.0 * s / (SAMPLES * SAMPLES) as f32).round().clamp(0.0, 255.0) as u8)
        };
        (0..lines)
            .flat_map(|line| (0..width).map(move |column| (line, column)))
            .map(|(l, c)| pixel(l, c))
            .collect()
    }
}

/// Twice the signed area of a, b, c in the image.
fn cross(a: [f32; 3], b: [f32; 3], c: [f32; 3]) -> f32 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

fn mixed(color: Color, other: Color, share: f32) -> Color {
    std::array::from_fn(|k| color[k] + share * (other[k] - color[k]))
}

#[cfg(test)]
mod tests {
    use super::*;

    const RED: Color = [1.0, 0.0, 0.0];
    const BLUE: Color = [0.0, 0.0, 1.0];

    #[test]
    fn the_view_of_a_cut_faces_it_from_any_side() {
        let axes = [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 0.5], [1.0, -1.0, 3.0]];
        for normal in axes.into_iter().flat_map(|n| [n, n.map(|x| -x)]) {
            let [_, _, away] = directions(&Settings::facing(&Cut { point: [0.0; 3], normal }));
            let cosine = -away.dot(&Vector3::from(normal).normalize());
            assert!(cosine > 0.6, "{normal:?}: {cosine}");
        }
        let facing = Settings::facing(&Cut { point: [0.0; 3], normal: [0.0, -1.0, 0.0] });
        assert_eq!(facing, Settings::default());
    }

    /// Seen from the x direction, with y to the right and z up; no margin, no lines.
    fn settings() -> Settings {
        Settings {
            width: 40,
            height: 40,
            azimuth: 0.0,
            elevation: 0.0,
            margin: 0.0,
            edge_width: 0.0,
            ..Settings::default()
        }
    }

    /// Half of the square −1 … 1 in y and z, at this x.
    fn half(x: f64, color: Color) -> Triangle {
        let corners = [[x, -1., -1.], [x, 1., -1.], [x, -1., 1.]];
        Triangle { corners, color, edges: [true; 3], pieces: 1 }
    }

    fn at(image: &Image, column: u32, line: u32) -> [u8; 3] {
        image.pixels[(line * image.width + column) as usize]
    }

    #[test]
    fn a_triangle_is_where_it_belongs() {
        let image = render(&Scene { triangles: vec![half(0.0, RED)] }, &settings());
        assert_eq!(at(&image, 35, 4), [255; 3], "nothing at the upper right");
        let [red, green, blue] = at(&image, 4, 35);
        assert!(red > 200 && green == 0 && blue == 0, "red at the lower left: {:?}", (red, green, blue));
        let drawn = image.pixels.iter().filter(|p| p[1] == 0).count();
        assert!((760..=820).contains(&drawn), "half of 1600: {drawn}");
    }

    #[test]
    fn the_nearer_triangle_hides_the_other_in_any_order() {
        for triangles in [[half(0.0, RED), half(0.1, BLUE)], [half(0.1, BLUE), half(0.0, RED)]] {
            let image = render(&Scene { triangles: triangles.to_vec() }, &settings());
            assert_eq!(at(&image, 4, 35)[0], 0);
        }
    }

    #[test]
    fn edges_are_drawn_as_dark_lines() {
        let settings = Settings { edge_width: 2.0, edge_color: [0.0; 3], ..settings() };
        let image = render(&Scene { triangles: vec![half(0.0, RED)] }, &settings);
        assert_eq!(at(&image, 0, 20), [0; 3]);
        assert!(at(&image, 10, 30)[0] > 200);
    }

    #[test]
    fn every_number_of_threads_draws_the_same() {
        let triangles =
            (0..50).map(|k| half(f64::from(k).sin(), crate::files::color::of_number(k))).collect();
        let scene = Scene { triangles };
        let draw = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| render(&scene, &settings()))
        };
        assert_eq!(draw(1), draw(3));
    }

    #[test]
    fn an_empty_scene_is_background() {
        let image = render(&Scene::default(), &settings());
        assert!(image.pixels.iter().all(|p| *p == [255; 3]));
        assert_eq!(image.pixels.len(), 1600);
    }
}

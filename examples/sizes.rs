//! Sizes by a function: small elements along a line through a block, for example a weld.
//!
//! ```sh
//! cargo run --release --example sizes
//! ```

use tetmill::{Error, Geometry, Mesher, Point};

/// The wanted element size at a distance from the line.
fn wanted(point: Point) -> f64 {
    let distance = (point.y - 0.5).hypot(point.z - 0.5);
    0.03 + 0.3 * distance
}

fn main() -> Result<(), Error> {
    let block = Geometry::from_text("algebraic3d solid block = orthobrick (0, 0, 0; 2, 1, 1); tlo block;")?;
    let mesh = Mesher::new().size(wanted).generate(&block)?.arrays();

    // The mean ratio of edge length and wanted size at the middle, near the line and far from it.
    let mut near = (0.0, 0);
    let mut far = (0.0, 0);
    for tet in 0..mesh.tets.len() {
        let corners = mesh.corners(tet).map(Point::from);
        for (i, j) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
            let length = (corners[j] - corners[i]).norm();
            let size = wanted(nalgebra::center(&corners[i], &corners[j]));
            let (sum, count) = if size < 0.06 { &mut near } else { &mut far };
            *sum += length / size;
            *count += 1;
        }
    }
    let [near, far] = [near, far].map(|(sum, count)| sum / f64::from(count));
    println!(
        "{} tets; edges are {near:.2} of the wanted size near the line, {far:.2} elsewhere",
        mesh.tets.len()
    );
    assert!((0.7..1.4).contains(&near) && (0.7..1.4).contains(&far));
    Ok(())
}

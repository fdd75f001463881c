//! Meshes a part and writes it for ParaView and other readers of VTU.
//!
//! ```sh
//! cargo run --release --example part_to_vtu [PART.geo [FOLDER]]
//! ```

use std::path::PathBuf;
use tetmill::{Error, Geometry, Mesher, comm::thread, files::vtu};

/// A plate with a hole, its ends named.
const PLATE: &str = "
algebraic3d
solid left = plane (0, 0, 0; -1, 0, 0) -bcname=fixed;
solid right = plane (4, 0, 0; 1, 0, 0) -bcname=pulled;
solid plate = orthobrick (-1, 0, 0; 5, 2, 0.2) and left and right;
solid hole = cylinder (2, 1, -1; 2, 1, 1; 0.5);
solid part = plate and not hole;
tlo part;
";

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let geometry = match arguments.next() {
        Some(file) => Geometry::from_file(file)?,
        None => Geometry::from_text(PLATE)?,
    };
    let folder = arguments.next().map_or_else(|| std::env::temp_dir().join("tetmill_example"), PathBuf::from);

    let mesh = Mesher::new().levels(1).generate(&geometry)?;
    for patch in &mesh.names.patches {
        println!("boundary {}: {}", patch.number, patch.name().unwrap_or("without name"));
    }
    let shape = mesh.check.shape.as_ref().expect("the mesh has tets");
    println!("{} tets, smallest dihedral angle {:.1} degrees", mesh.check.tets, shape.smallest_angle.value);

    let written = vtu::write(&thread::alone(), mesh.stream(), &mesh.names, &folder.join("part"))?;
    println!("{} files in {}", written.files, folder.display());
    Ok(())
}

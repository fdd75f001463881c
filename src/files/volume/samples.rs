//! The two tets of [`two_tets`] as files of all formats.

use crate::files::testing::two_tets;

/// `two_tets` for Gmsh 2.2, with ids that have a gap.
pub(super) const MSH22: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 5 \"skin\"\n3 7 \"body a\"\n$EndPhysicalNames\n\
    $Nodes\n5\n10 0 0 0\n20 1 0 0\n30 0 1 0\n40 0 0 1\n41 1 1 1\n$EndNodes\n$Comments\nanything\n$EndComments\n\
    $Elements\n10\n1 15 2 0 1 10\n2 1 2 0 1 10 20\n3 2 2 5 1 10 30 20\n4 2 2 5 1 10 20 40\n5 2 2 5 1 10 40 30\n\
    6 2 2 5 1 20 30 41\n7 2 2 5 1 20 41 40\n8 2 2 5 1 30 40 41\n9 4 2 7 1 10 20 30 40\n10 4 4 7 1 1 1 20 30 40 41\n$EndElements\n";

/// The same for Gmsh 4.1.
pub(super) const MSH41: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 7 \"body\"\n$EndPhysicalNames\n\
    $Entities\n1 0 1 1\n1 0 0 0 0\n3 0 0 0 1 1 1 1 5 0\n4 0 0 0 1 1 1 1 7 1 -3\n$EndEntities\n\
    $Nodes\n3 5 1 5\n0 1 0 1\n1\n0 0 0\n2 3 1 2\n2\n3\n1 0 0 0.5 0.5\n0 1 0 0.5 0.5\n3 4 0 2\n4\n5\n0 0 1\n1 1 1\n$EndNodes\n\
    $Elements\n2 8 1 8\n2 3 2 6\n1 1 3 2\n2 1 2 4\n3 1 4 3\n4 2 3 5\n5 2 5 4\n6 3 4 5\n\
    3 4 4 2\n7 1 2 3 4\n8 2 3 4 5\n$EndElements\n";

/// The mesh of [`MSH41`] in binary.
pub(super) fn msh41_binary() -> Vec<u8> {
    let mut file = b"$MeshFormat\n4.1 1 8\n\x01\0\0\0\n$EndMeshFormat\n$Entities\n".to_vec();
    fn int(file: &mut Vec<u8>, numbers: &[i32]) {
        numbers.iter().for_each(|n| file.extend(n.to_le_bytes()));
    }
    fn size(file: &mut Vec<u8>, numbers: &[u64]) {
        numbers.iter().for_each(|n| file.extend(n.to_le_bytes()));
    }
    size(&mut file, &[0, 0, 1, 1]);
    for (tag, physical, bounds) in [(3, 5, None), (4, 7, Some(-3))] {
        int(&mut file, &[tag]);
        (0..6).for_each(|_| file.extend(0.5_f64.to_le_bytes()));
        size(&mut file, &[1]);
        int(&mut file, &[physical]);
        size(&mut file, &[u64::from(bounds.is_some())]);
        bounds.iter().for_each(|b| int(&mut file, &[*b]));
    }
    file.extend(b"\n$EndEntities\n$Nodes\n");
    size(&mut file, &[1, 5, 1, 5]);
    int(&mut file, &[3, 4, 0]);
    size(&mut file, &[5, 1, 2, 3, 4, 5]);
    two_tets().points.iter().flat_map(|p| [p.x, p.y, p.z]).for_each(|x| file.extend(x.to_le_bytes()));
    file.extend(b"\n$EndNodes\n$Elements\n");
    size(&mut file, &[2, 8, 1, 8]);
    int(&mut file, &[2, 3, 2]);
    size(&mut file, &[6]);
    for triangle in two_tets().triangles {
        size(&mut file, &[1]);
        triangle.vertices.iter().for_each(|v| size(&mut file, &[u64::from(v.0) + 1]));
    }
    int(&mut file, &[3, 4, 4]);
    size(&mut file, &[2]);
    for tet in two_tets().tets {
        size(&mut file, &[1]);
        tet.iter().for_each(|v| size(&mut file, &[u64::from(v.0) + 1]));
    }
    file.extend(b"\n$EndElements\n");
    file
}

/// The same for NETGEN.
pub(super) const VOL: &str = "# by hand\nmesh3d\ndimension\n3\ngeomtype\n0\n# surfnr bcnr domin domout np p1 p2 p3\nsurfaceelementsgi\n6\n\
    1 5 7 0 3 1 3 2 0 0 0\n1 5 7 0 3 1 2 4 0 0 0\n1 5 7 0 3 1 4 3 0 0 0\n1 5 7 0 3 2 3 5 0 0 0\n1 5 7 0 3 2 5 4 0 0 0\n1 5 7 0 3 3 4 5 0 0 0\n\
    volumeelements\n2\n7 4 2 1 3 4\n7 4 3 2 4 5\nedgesegmentsgi2\n1\n1 0 1 2 -1 -1 1 2 3 0 3 1.5\n\
    points\n5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\nmaterials\n1\n7 points\nbcnames\n1\n5 skin of it\nendmesh\n";

/// The same for Medit.
pub(super) const MEDIT: &str = "MeshVersionFormatted 2\n\nDimension\n3\n\nVertices\n5\n0 0 0 1\n1 0 0 1\n0 1 0 1\n0 0 1 1\n1 1 1 1 # last\n\
    Corners\n1\n1\nRequiredVertices\n2\n1 2\nTriangles\n6\n1 3 2 5\n1 2 4 5\n1 4 3 5\n2 3 5 5\n2 5 4 5\n3 4 5 5\n\
    Tetrahedra\n2\n1 2 3 4 7\n2 3 4 5 7\nEnd\n";

/// The same for Medit, in binary.
pub(super) fn meshb(version: i32, big: bool) -> Vec<u8> {
    struct File {
        bytes: Vec<u8>,
        big: bool,
    }
    impl File {
        fn put<const N: usize>(&mut self, mut little: [u8; N]) {
            if self.big {
                little.reverse();
            }
            self.bytes.extend(little);
        }
    }
    let mut file = File { bytes: Vec::new(), big };
    file.put(1_i32.to_le_bytes());
    file.put(version.to_le_bytes());
    let long = |file: &mut File, n: u64| {
        if version >= 3 { file.put(n.to_le_bytes()) } else { file.put((n as u32).to_le_bytes()) }
    };
    let int = |file: &mut File, n: u64| {
        if version == 4 { file.put(n.to_le_bytes()) } else { file.put((n as u32).to_le_bytes()) }
    };
    let position = if version >= 3 { 8 } else { 4 };
    let size = if version == 4 { 8 } else { 4 };
    let real = if version == 1 { 4 } else { 8 };
    let next = |file: &File, length: u64| file.bytes.len() as u64 + position + length;
    file.put(3_i32.to_le_bytes());
    let after = next(&file, 4);
    long(&mut file, after);
    file.put(3_i32.to_le_bytes());
    file.put(4_i32.to_le_bytes());
    let after = next(&file, size + 5 * (3 * real + size));
    long(&mut file, after);
    int(&mut file, 5);
    for p in two_tets().points {
        p.iter().for_each(|x| {
            if version == 1 { file.put((*x as f32).to_le_bytes()) } else { file.put(x.to_le_bytes()) }
        });
        int(&mut file, 0);
    }
    // A keyword that is not read.
    file.put(20_i32.to_le_bytes());
    let after = next(&file, 3);
    long(&mut file, after);
    file.put([1, 2, 3]);
    let elements: [(i32, Vec<Vec<u32>>, u64); 2] = [
        (6, two_tets().triangles.iter().map(|t| t.vertices.map(|v| v.0).to_vec()).collect(), 5),
        (8, two_tets().tets.iter().map(|t| t.map(|v| v.0).to_vec()).collect(), 7),
    ];
    for (code, list, number) in elements {
        file.put(code.to_le_bytes());
        let after = next(&file, size * (1 + list.iter().map(|e| e.len() as u64 + 1).sum::<u64>()));
        long(&mut file, after);
        int(&mut file, list.len() as u64);
        for element in list {
            element.iter().for_each(|&v| int(&mut file, u64::from(v) + 1));
            int(&mut file, number);
        }
    }
    file.put(54_i32.to_le_bytes());
    long(&mut file, 0);
    file.bytes
}

/// Points for TetGen.
pub(super) const NODE: &str = "5 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n4 1 1 1\n";
/// Tets for TetGen.
pub(super) const ELE: &str = "2 4 1\n0 0 1 2 3 7\n1 1 2 3 4 7.0\n";
/// Faces for TetGen, one of them inside.
pub(super) const FACE: &str =
    "7 1\n0 0 2 1 5\n1 0 1 3 5\n2 0 3 2 5\n3 1 2 4 5\n4 1 4 3 5\n5 2 3 4 5\n6 1 2 3 0\n# done\n";

/// Bytes in base64.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for chunk in bytes.chunks(3) {
        let bits = chunk.iter().enumerate().fold(0_u32, |bits, (k, b)| bits | u32::from(*b) << (16 - 8 * k));
        for k in 0..4 {
            let digit = DIGITS[(bits >> (18 - 6 * k)) as usize & 63];
            text.push(if k <= chunk.len() { digit.into() } else { '=' });
        }
    }
    text
}

/// How the arrays of a `.vtu` are stored.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Stored {
    Text,
    Inline,
    InlineSplit,
    Zlib,
    AppendedRaw,
    AppendedBase64,
}

/// The same for VTK.
pub(super) fn vtu(stored: Stored) -> Vec<u8> {
    use std::io::Write;
    let mesh = two_tets();
    let floats: Vec<f64> = mesh.points.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
    let mut connectivity: Vec<i32> =
        mesh.triangles.iter().flat_map(|t| t.vertices.map(|v| v.0 as i32)).collect();
    connectivity.extend(mesh.tets.iter().flat_map(|t| t.map(|v| v.0 as i32)));
    let offsets: Vec<i64> = (1..=6).map(|k| 3 * k).chain([22, 26]).collect();
    let types: Vec<u8> = [[5_u8; 6].as_slice(), &[10, 10]].concat();
    let numbers: Vec<i32> = [[5; 6].as_slice(), &[7, 7]].concat();
    let arrays: [(&str, &str, &str, Vec<u8>, String); 5] = [
        (
            "Points",
            "",
            "Float64",
            floats.iter().flat_map(|x| x.to_le_bytes()).collect(),
            format!("{floats:?}"),
        ),
        (
            "Cells",
            "connectivity",
            "Int32",
            connectivity.iter().flat_map(|x| x.to_le_bytes()).collect(),
            format!("{connectivity:?}"),
        ),
        (
            "Cells",
            "offsets",
            "Int64",
            offsets.iter().flat_map(|x| x.to_le_bytes()).collect(),
            format!("{offsets:?}"),
        ),
        ("Cells", "types", "UInt8", types.clone(), format!("{types:?}")),
        (
            "CellData",
            "medit:ref",
            "Int32",
            numbers.iter().flat_map(|x| x.to_le_bytes()).collect(),
            format!("{numbers:?}"),
        ),
    ];
    let compressor = if stored == Stored::Zlib { " compressor=\"vtkZLibDataCompressor\"" } else { "" };
    let mut head = format!(
        "<?xml version=\"1.0\"?>\n<!-- <Piece> -->\n<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\"{compressor}>\n\
         <UnstructuredGrid>\n<Piece NumberOfPoints=\"5\" NumberOfCells='8'>\n"
    );
    let mut appended: Vec<u8> = Vec::new();
    for (section, name, kind, bytes, text) in arrays {
        let length = (bytes.len() as u32).to_le_bytes();
        let (format, inline) = match stored {
            Stored::Text => ("ascii", text.trim_matches(['[', ']']).replace(',', " ")),
            Stored::Inline => ("binary", base64(&[length.to_vec(), bytes].concat())),
            Stored::InlineSplit => ("binary", base64(&length) + &base64(&bytes)),
            Stored::Zlib => {
                let block = 16;
                let mut header =
                    vec![bytes.len().div_ceil(block) as u32, block as u32, (bytes.len() % block) as u32];
                let mut blocks = Vec::new();
                for block in bytes.chunks(block) {
                    let mut encoder =
                        flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
                    encoder.write_all(block).unwrap();
                    let block = encoder.finish().unwrap();
                    header.push(block.len() as u32);
                    blocks.extend(block);
                }
                let header: Vec<u8> = header.into_iter().flat_map(u32::to_le_bytes).collect();
                ("binary", base64(&header) + &base64(&blocks))
            }
            Stored::AppendedRaw => {
                head += &format!(
                    "<{section}><DataArray type=\"{kind}\" Name=\"{name}\" format=\"appended\" offset=\"{}\"/></{section}>\n",
                    appended.len()
                );
                appended.extend(length);
                appended.extend(bytes);
                continue;
            }
            Stored::AppendedBase64 => {
                head += &format!(
                    "<{section}><DataArray type=\"{kind}\" Name=\"{name}\" format=\"appended\" offset=\"{}\"/></{section}>\n",
                    appended.len()
                );
                appended.extend(base64(&[length.to_vec(), bytes].concat()).bytes());
                continue;
            }
        };
        head += &format!(
            "<{section}><DataArray type=\"{kind}\" Name=\"{name}\" format=\"{format}\">\n {inline}\n</DataArray></{section}>\n"
        );
    }
    head += "</Piece>\n</UnstructuredGrid>\n";
    let mut file = head.into_bytes();
    if !appended.is_empty() {
        let encoding = if stored == Stored::AppendedRaw { "raw" } else { "base64" };
        file.extend(format!("<AppendedData encoding=\"{encoding}\">\n _").into_bytes());
        file.extend(appended);
        file.extend(b"\n</AppendedData>\n");
    }
    file.extend(b"</VTKFile>\n");
    file
}

/// All of them.
pub(super) const ALL_STORED: [Stored; 6] = [
    Stored::Text,
    Stored::Inline,
    Stored::InlineSplit,
    Stored::Zlib,
    Stored::AppendedRaw,
    Stored::AppendedBase64,
];

/// One sample of each format.
pub(super) fn samples() -> Vec<(&'static str, Vec<u8>)> {
    let mut samples: Vec<(&str, Vec<u8>)> = vec![
        ("m.msh", MSH22.into()),
        ("m.msh", MSH41.into()),
        ("m.msh", msh41_binary()),
        ("m.vol", VOL.into()),
        ("m.mesh", MEDIT.into()),
        ("m.meshb", meshb(2, false)),
        ("m.meshb", meshb(4, true)),
    ];
    let periodic = "$Periodic\n1\n2 1 1\nAffine 1 0 0\n2\n10 20\n30 40\n$EndPeriodic\n";
    samples.push(("m.msh", (MSH22.to_owned() + periodic).into()));
    let identified = "identifications\n2\n1 2 1\n3 4 1\nidentificationtypes\n1\n2\nendmesh";
    samples.push(("m.vol", VOL.replace("endmesh", identified).into()));
    samples.extend(ALL_STORED.map(|stored| ("m.vtu", vtu(stored))));
    samples
}

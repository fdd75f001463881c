//! `.geo` files in UTF-8: names arrive unchanged in the files that other programs read.

use crate::common::{succeed, tetmill};
use std::fs;

const GEOMETRY: &str = "algebraic3d # Prüfkörper
solid würfel = orthobrick (0,0,0; 1,1,1) -bcname=wände;
solid 球 = sphere (3,0,0; 1) -bcname=Außenwand_é;
tlo würfel -material=Stähl -maxh=0.5;
tlo 球 -maxh=0.5;
";

const NAMES: [&str; 4] = ["Stähl", "球", "wände", "Außenwand_é"];

#[test]
fn names_in_utf_8_arrive_unchanged_in_all_formats() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    fs::write(at("a.geo"), GEOMETRY).unwrap();
    for (file, options) in [("a.msh", &[][..]), ("a.vtu", &["--boundary", "in"]), ("a.vol", &[])] {
        succeed(tetmill().arg("mesh").arg(at("a.geo")).arg("-q").args(options).arg("-o").arg(at(file)));
        let bytes = fs::read(at(file)).unwrap();
        for name in NAMES {
            assert!(bytes.windows(name.len()).any(|found| found == name.as_bytes()), "{file}: {name}");
        }
    }
    succeed(tetmill().arg("generate").arg(at("a.geo")).args(["-n", "2", "-q", "-o"]).arg(at("elmer")));
    let names = fs::read_to_string(at("elmer/mesh.names")).unwrap();
    assert!(NAMES.iter().all(|name| names.contains(&format!("$ {name} = "))), "{names}");
    // And back: our readers keep them.
    for mesh in ["a.msh", "a.vtu", "a.vol", "elmer"] {
        succeed(tetmill().arg("generate").arg(at(mesh)).args(["-q", "-o"]).arg(at("again")));
        let again = fs::read_to_string(at("again/mesh.names")).unwrap();
        assert!(NAMES.iter().all(|name| again.contains(&format!("$ {name} = "))), "{mesh}: {again}");
    }
}

#[test]
fn byte_order_marks_and_line_ends_change_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let mesh = |name: &str, text: &str| {
        let [geo, mesh] = ["geo", "msh"].map(|ending| dir.path().join(name).with_extension(ending));
        fs::write(&geo, text).unwrap();
        succeed(tetmill().arg("mesh").arg(&geo).arg("-q").arg("-o").arg(&mesh));
        fs::read(mesh).unwrap()
    };
    let plain = mesh("plain", GEOMETRY);
    for (name, text) in [
        ("mark", format!("\u{feff}{GEOMETRY}")),
        ("crlf", GEOMETRY.replace('\n', "\r\n")),
        ("cr", GEOMETRY.replace('\n', "\r")),
    ] {
        assert!(mesh(name, &text) == plain, "{name}");
    }
}

#[test]
fn other_encodings_are_refused_with_line_and_column() {
    let dir = tempfile::tempdir().unwrap();
    let refused = |bytes: &[u8]| {
        let file = dir.path().join("a.geo");
        fs::write(&file, bytes).unwrap();
        let output = tetmill().arg("inspect").arg(file).output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8(output.stderr).unwrap()
    };
    let latin = refused(b"algebraic3d # Pr\xfcfk\xf6rper\nsolid w\xfcrfel = sphere (0,0,0; 1);\ntlo a;\n");
    assert!(latin.contains("a.geo:2:8: error") && latin.contains("save it as UTF-8"), "{latin}");
    let utf_16: Vec<u8> = "\u{feff}algebraic3d\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let message = refused(&utf_16);
    assert!(message.contains("a.geo:1:1: error") && message.contains("save it as UTF-8"), "{message}");
}

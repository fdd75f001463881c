use super::*;
use proptest::prelude::*;
use std::fs;

/// The regular tet of the format examples: four points, four faces oriented outward.
const POINTS: [[f64; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]];
const FACES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

/// Reads a file of this name and content.
fn read_as(name: &str, content: impl AsRef<[u8]>) -> Result<Surface, String> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    fs::write(&path, content).unwrap();
    read(&path).map_err(|error| error.to_string().replace(&format!("{}/", dir.path().display()), ""))
}

/// Reads a file that must contain the tet, with its points in any order.
#[track_caller]
fn reads_tet(name: &str, content: impl AsRef<[u8]>) -> Surface {
    let surface = read_as(name, content).unwrap();
    assert_eq!(surface.points.len(), 4);
    let place = |v: u32| POINTS.iter().position(|p| Point::from(*p) == surface.points[v as usize]);
    let rotated = |t: [u32; 3]| {
        let least = (0..3).min_by_key(|&k| t[k]).unwrap();
        [0, 1, 2].map(|k| t[(k + least) % 3])
    };
    let mut found: Vec<[u32; 3]> =
        surface.triangles.iter().map(|t| rotated(t.map(|v| place(v).expect("a corner") as u32))).collect();
    let mut expected = FACES.map(rotated).to_vec();
    found.sort_unstable();
    expected.sort_unstable();
    assert_eq!(found, expected);
    assert_eq!(surface.group.len(), 4);
    assert!(surface.group.iter().all(|&g| (g as usize) < surface.groups.len()));
    surface
}

#[track_caller]
fn refused(name: &str, content: impl AsRef<[u8]>, place: &str, reason: &str) {
    let said = read_as(name, content).expect_err("it is refused");
    // A place ending in a star is a prefix.
    let start = place.strip_suffix('*').map_or(format!("{name}{place}: "), |place| format!("{name}{place}"));
    assert!(said.starts_with(&start), "no `{start}` in: {said}");
    assert!(said.contains(reason), "no `{reason}` in: {said}");
}

fn stl_text(name: &str, faces: &[[u32; 3]]) -> String {
    let mut text = format!("solid {name}\n");
    for face in faces {
        text += " facet normal 0 0 0\n  outer loop\n";
        for [x, y, z] in face.map(|v| POINTS[v as usize]) {
            text += &format!("   vertex {x} {y} {z}\n");
        }
        text += "  endloop\n endfacet\n";
    }
    text + &format!("endsolid {name}\n")
}

fn stl_binary(head: &[u8], points: &[[f64; 3]], faces: &[[u32; 3]]) -> Vec<u8> {
    let mut bytes = [0; 80].to_vec();
    bytes[..head.len()].copy_from_slice(head);
    bytes.extend((faces.len() as u32).to_le_bytes());
    for face in faces {
        bytes.extend([0; 12]);
        face.iter().flat_map(|&v| points[v as usize]).for_each(|x| bytes.extend((x as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

#[test]
fn stl_is_read_as_text_and_binary() {
    let surface = reads_tet("a.stl", stl_text("part", &FACES));
    assert_eq!((surface.groups, surface.notes), (vec!["part".to_string()], vec![]));
    reads_tet("a.STL", stl_text("part", &FACES).to_uppercase());
    reads_tet("a.stl", stl_text("part", &FACES).replace('\n', "\r\n"));
    let surface = reads_tet("a.stl", stl_binary(b"solid though binary", &POINTS, &FACES));
    assert_eq!(surface.groups, ["surface"]);
}

#[test]
fn several_solids_of_an_stl_become_groups() {
    let text = stl_text("bottom", &FACES[..1]) + &stl_text("", &FACES[1..3]) + &stl_text("top", &FACES[3..]);
    let surface = reads_tet("a.stl", text);
    assert_eq!(surface.groups, ["bottom", "solid 2", "top"]);
    assert_eq!(surface.group, [0, 1, 1, 2]);
    assert_eq!(surface.group_numbers, [1, 2, 3]);
}

#[test]
fn an_stl_that_was_rounded_apart_is_closed_and_says_so() {
    let text = stl_text("part", &FACES).replacen("vertex 1 0 0", "vertex 1.0000001 0 0", 1);
    let surface = read_as("a.stl", text).unwrap();
    assert_eq!(surface.points.len(), 4);
    let [note] = &surface.notes[..] else { panic!("{:?}", surface.notes) };
    assert!(
        note.starts_with("1 point within ") && note.ends_with("which closed 4 of 4 open edges"),
        "{note}"
    );
    assert!(surface.loose_points.is_empty());
}

#[test]
fn broken_stl_files_are_refused_with_their_place() {
    let text = stl_text("part", &FACES);
    refused("a.stl", &text[..text.len() - 14], ":30", "cut off");
    refused("a.stl", text.replacen("vertex 1", "vertex nan", 1), ":6", "`nan`");
    refused("a.stl", text.replacen("endloop", "vertex 0 0 0", 1), ":7", "expected `endloop`, found `vertex`");
    refused("a.stl", "solid empty\nendsolid empty\n", "", "no triangles");
    let binary = stl_binary(b"", &POINTS, &FACES);
    refused("a.stl", &binary[..200], ", byte 80", "4 triangles are announced, which take 284 bytes");
    let mut lies = binary.clone();
    lies[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    refused("a.stl", lies, ", byte 80", "4294967295 triangles");
    let mut endless = binary;
    endless[96..100].copy_from_slice(&f32::INFINITY.to_le_bytes());
    refused("a.stl", endless, ", byte 96", "not a finite number");
    refused("a.stl", "", "", "the file is empty");
    refused("a.stl", "hello", "", "neither a text");
}

const OFF: &str =
    "4 4 6\n0 0 0\n1 0 0\n0 1 0 # y\n0 0 1\n3 0 2 1 255 0 0\n3 0 1 3 1\n3 0 3 2\n3 1 2 3 0.5 0.5 0.5\n";

#[test]
fn off_is_read_with_its_prefixes_colours_and_comments() {
    reads_tet("a.off", format!("OFF\n{OFF}"));
    reads_tet("a.off", format!("# made by hand\nOFF {OFF}"));
    reads_tet("a.off", OFF);
    reads_tet("a.off", format!("OFF\n{}", OFF.replacen("4 4 6", "4 4", 1)));
    reads_tet("a.off", format!("OFF\n{}", OFF.replacen("4 4 6", "4\n4\n6", 1)));
    for (prefix, extras) in [("C", " 1 0 0 1"), ("N", " 0 0 1"), ("STCN", " 0 0 1 1 1 1 1 0 0")] {
        let text = OFF
            .replace("1 0 0\n", &format!("1 0 0{extras}\n"))
            .replace("0 0 0\n", &format!("0 0 0{extras}\n"));
        reads_tet("a.off", format!("{prefix}OFF\n{text}"));
    }
}

#[test]
fn our_own_off_is_read() {
    let mesh = crate::files::testing::two_tets();
    let part = crate::files::plain::PlainPart::whole(&mesh);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.off");
    crate::files::serial::write(&part, &crate::files::testing::names(), &path).unwrap();
    let surface = read(&path).unwrap();
    assert_eq!((surface.points.len(), surface.triangles.len()), (5, 6));
}

#[test]
fn polygons_become_triangles() {
    let cube = "OFF\n8 6 12\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n\
        4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n";
    let surface = read_as("a.off", cube).unwrap();
    assert_eq!(surface.triangles.len(), 12);
    // An arrow head: only one diagonal is inside.
    let arrow = "OFF\n4 1 0\n0 0 0\n2 0 0\n0.5 0.5 0\n0 2 0\n4 0 1 2 3\n";
    assert_eq!(read_as("a.off", arrow).unwrap().triangles, [[0, 1, 2], [0, 2, 3]]);
    let arrow = "OFF\n4 1 0\n2 0 0\n0.5 0.5 0\n0 2 0\n0 0 0\n4 0 1 2 3\n";
    assert_eq!(read_as("a.off", arrow).unwrap().triangles, [[1, 2, 3], [1, 3, 0]]);
}

#[test]
fn equal_points_are_merged_and_collapsed_faces_dropped_with_notes() {
    let text = "OFF\n6 3 0\n0 0 0\n1 0 0\n0 1 0\n-0 0 0\n9 9 9\n0 1 0\n3 0 1 2\n3 0 3 1\n4 3 1 2 5\n";
    let surface = read_as("a.off", text).unwrap();
    assert_eq!(surface.points.len(), 3);
    assert_eq!(surface.triangles, [[0, 1, 2]]);
    assert_eq!(surface.loose_points, [Point::new(9., 9., 9.)]);
    assert_eq!(
        surface.notes,
        [
            "2 points at the very place of others merged with them",
            "1 face with fewer than three different corners left out",
            "1 face listed before left out, the first at line 11: it is at line 9",
            "1 point in no face",
        ]
    );
}

#[test]
fn broken_off_files_are_refused_with_their_place() {
    refused("a.off", "OFF BINARY\n\0\0\0\x04", ":1", "binary OFF is not read");
    refused("a.off", format!("4OFF\n{OFF}"), ":1", "three coordinates");
    refused("a.off", "{ LIST }", ":1", "braces");
    refused("a.off", "FOO\n1", ":1", "expected the keyword `OFF`");
    refused(
        "a.off",
        format!("OFF\n{}", OFF.replace("3 0 3 2", "3 0 3 4")),
        ":9",
        "no vertex 4: the vertices are 0 to 3",
    );
    refused("a.off", "OFF\n1000000000 4 0\n0 0 0\n", ":2", "1000000000 points are announced");
    refused("a.off", "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 x\n0 0 1\n3 0 1 2\n3 0 1 2 3 4", ":5", "`x`");
    let bow = "OFF\n5 1 0\n0 0 0\n1 1 0\n1 0 0\n0 3 0\n0 0.5 1\n4 0 1 2 3\n";
    refused("a.off", bow, ":8", "its edges cross");
    refused("a.off", "OFF\n1 0 0\n0 0 0\n", "", "no faces");
    refused("a.off", stl_text("", &FACES), "", "the content is .stl");
}

#[test]
fn obj_is_read_with_negative_numbers_and_continued_lines() {
    let points = "# tet\nv 0 0 0\nv 1 0 0 1.0\nv 0 1 0 0.5 0.5 0.5\nvn 0 0 1\nv 0 0 1\nvt 0 0\n";
    let surface = reads_tet(
        "a.obj",
        format!("{points}f 1 3 2\nf 1//1 2//1 4//1\nf -4/1/1 -1/1/1 \\\n -2/1/1\nf 2/1 3/1 4/1\n"),
    );
    assert_eq!((surface.groups, surface.notes), (vec!["surface".to_string()], vec![]));
}

#[test]
fn obj_groups_are_named_by_their_differing_labels() {
    let points = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    let one = "o part\ng wall\nusemtl steel\nf 1 3 2\n";
    let text = format!("{points}{one}g lid\nf 1 2 4\ng wall\nf 1 4 3\nusemtl ice\nf 2 3 4\n");
    let surface = reads_tet("a.obj", text);
    assert_eq!(surface.groups, ["wall/steel", "lid/steel", "wall/ice"]);
    assert_eq!(surface.group, [0, 1, 0, 2]);
    let surface = reads_tet("a.obj", format!("{points}{one}f 1 2 4\nf 1 4 3\nf 2 3 4\nl 1 2\n"));
    assert_eq!(surface.groups, ["part"]);
    assert_eq!(surface.notes, ["1 line, point or free-form element left out"]);
}

#[test]
fn broken_obj_files_are_refused_with_their_place() {
    let points = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    refused("a.obj", format!("{points}f 1 2 4\n"), ":4", "no vertex 4: the file has 3");
    refused("a.obj", format!("{points}f 1 2 -4\n"), ":4", "no vertex -4");
    refused("a.obj", format!("{points}f 1 2 0\n"), ":4", "found `0`");
    refused("a.obj", format!("{points}f 1 2\n"), ":4", "three corners");
    refused("a.obj", "v 0 0\n\nf 1 1 1\n", ":3", "found `f`");
    refused("a.obj", points, "", "no faces");
    refused("a.obj", "\u{1}\u{2}", ":1", "begins no line");
}

fn ply_text(format: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment made by hand\nelement vertex 4\nproperty uchar red\nproperty float x\n\
         property double y\nproperty float z\nelement face 4\nproperty list uchar int vertex_indices\n\
         property list short float more\nelement edge 1\nproperty int vertex1\nend_header\n"
    )
}

#[test]
fn ply_is_read_as_text_and_in_both_orders_of_bytes() {
    let mut text = ply_text("ascii");
    POINTS.iter().for_each(|[x, y, z]| text += &format!("200 {x} {y} {z}\n"));
    FACES.iter().for_each(|[a, b, c]| text += &format!("3 {a} {b} {c} 2 0.5 nan\n"));
    reads_tet("a.ply", format!("{text}7\n"));
    for big in [false, true] {
        let mut bytes = ply_text(if big { "binary_big_endian" } else { "binary_little_endian" }).into_bytes();
        let mut put = |little: &[u8]| {
            let mut value = little.to_vec();
            if big {
                value.reverse();
            }
            bytes.extend(value);
        };
        for [x, y, z] in POINTS {
            put(&[200]);
            put(&(x as f32).to_le_bytes());
            put(&y.to_le_bytes());
            put(&(z as f32).to_le_bytes());
        }
        for face in FACES {
            put(&[3]);
            face.iter().for_each(|v| put(&v.to_le_bytes()));
            put(&1_u16.to_le_bytes());
            put(&0.5_f32.to_le_bytes());
        }
        put(&7_i32.to_le_bytes());
        reads_tet("a.ply", bytes);
    }
}

#[test]
fn broken_ply_files_are_refused_with_their_place() {
    let head = ply_text("ascii");
    refused("a.ply", &head, ":14", "4 elements `vertex` are announced");
    refused("a.ply", head.replace("ascii", "binary_little_endian"), ", byte *", "announced");
    refused("a.ply", head.replace("ascii", "utf8"), ":1", "`utf8` is not known");
    refused("a.ply", head.replace("property float x", "property real x"), ":6", "`real` is not a PLY type");
    refused("a.ply", head.replace("element vertex", "element v"), "", "no element `vertex`");
    refused(
        "a.ply",
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n",
        ":5",
        "ends before `end_header`",
    );
    refused("a.ply", "plx\n", ":1", "expected `ply`");
    let small = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_index\nend_header\n0 0 0\n1 0 0\n0 1 0\n";
    assert_eq!(read_as("a.ply", format!("{small}3 0 1 2\n")).unwrap().triangles, [[0, 1, 2]]);
    refused("a.ply", format!("{small}3 0 1 3\n"), ":13", "no vertex 3: the file has 3, from 0");
    refused("a.ply", format!("{small}3 0 1 -1\n"), ":13", "no vertex -1");
    refused("a.ply", format!("{small}200 0 1 2\n"), ":13", "200 entries");
    refused("a.ply", format!("{}3 0 1 2\n", small.replace("1 0 0", "inf 0 0")), ":11", "not a finite number");
}

/// A PLY with the strips of a tet: a header with this format, and a list of `int`.
fn strips_head(format: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n\
         element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
    )
}

/// Two strips, and a vertex that is repeated to turn a corner.
const STRIPS: [i32; 10] = [0, 2, 1, 3, -1, 1, 1, 0, 3, 2];

#[test]
fn ply_strips_become_triangles_in_text_and_binary() {
    // The first strip is (0 2 1) and (1 2 3), the second (1 0 3) reversed, and (0 3 2).
    let numbers: Vec<String> = STRIPS.iter().map(i32::to_string).collect();
    let mut text = strips_head("ascii");
    POINTS.iter().for_each(|[x, y, z]| text += &format!("{x} {y} {z}\n"));
    text += &format!("10 {}\n", numbers.join(" "));
    assert!(reads_tet("a.ply", &text).notes.is_empty());
    refused("a.ply", text.replace(" 3 2\n", " 4 2\n"), ":14", "no vertex 4: the file has 4, from 0");
    refused("a.ply", text.replace("10 0", "11 0"), ":15", "the file ends before a value");
    refused("a.ply", text.replace("10 0 2 1 3 -1 1 1 0 3 2", "2 0 1"), "", "no faces");
    for big in [false, true] {
        let head = strips_head(if big { "binary_big_endian" } else { "binary_little_endian" });
        let int = |n: i32| if big { n.to_be_bytes() } else { n.to_le_bytes() };
        let double = |x: f64| if big { x.to_be_bytes() } else { x.to_le_bytes() };
        let mut bytes = head.into_bytes();
        bytes.extend(POINTS.iter().flatten().flat_map(|&x| double(x)));
        bytes.extend(int(10));
        bytes.extend(STRIPS.iter().flat_map(|&n| int(n)));
        reads_tet("a.ply", &bytes);
        // Without a sign the mark of a new strip is the largest number.
        let at = bytes.windows(7).position(|w| w == b"int int").unwrap() + 4;
        bytes.insert(at, b'u');
        reads_tet("a.ply", &bytes);
    }
}

#[test]
fn a_face_that_a_file_has_twice_is_left_out_with_its_place() {
    let [a, b, c, d] = ["0 2 1", "0 1 3", "0 3 2", "1 2 3"];
    let points = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
    let note = |at: &str, before: &str| {
        format!("1 face listed before left out, the first at {at}: it is at {before}")
    };
    let off = format!("OFF\n4 5 0\n{points}3 {a}\n3 {b}\n3 {c}\n3 {d}\n3 3 0 1\n");
    assert_eq!(reads_tet("a.off", off).notes, [note("line 11", "line 8")]);
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\ng a\nf 1 3 2\nf 1 2 4\nf 1 4 3\ng b\nf 2 3 4\nf 3 4 2\n";
    assert_eq!(reads_tet("a.obj", obj).notes, [note("line 11", "line 10")]);
    let head = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        element face 5\nproperty list uchar int vertex_index\nend_header\n";
    let ply = format!("{head}{points}3 {a}\n3 {b}\n3 {c}\n3 {d}\n3 {a}\n");
    assert_eq!(reads_tet("a.ply", ply).notes, [note("line 18", "line 14")]);
    let twice = [FACES.as_slice(), &FACES[..1]].concat();
    assert_eq!(reads_tet("a.stl", stl_text("a", &twice)).notes, [note("line 30", "line 2")]);
    assert_eq!(reads_tet("a.stl", stl_binary(b"", &POINTS, &twice)).notes, [note("byte 284", "byte 84")]);
    // TetGen's facets have no direction.
    let nodes = "4 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n";
    let smesh = format!("{nodes}5 0\n3 {a}\n3 {b}\n3 {c}\n3 {d}\n3 0 1 2\n0\n0\n");
    assert_eq!(reads_tet("a.smesh", smesh).notes, [note("line 11", "line 7")]);
}

#[test]
fn a_polygon_twice_is_left_out_wherever_it_begins() {
    let cube = "OFF\n8 7 12\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n\
        4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n4 5 6 7 4\n";
    let surface = read_as("a.off", cube).unwrap();
    assert_eq!((surface.triangles.len(), surface.notes.len()), (12, 1));
}

#[test]
fn a_face_of_two_solids_that_touch_is_kept_in_both_directions() {
    let text = "OFF\n5 8 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 0 -1\n\
        3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n3 0 1 2\n3 1 0 4\n3 2 1 4\n3 0 2 4\n";
    let surface = read_as("a.off", text).unwrap();
    assert_eq!((surface.triangles.len(), surface.notes.len()), (8, 0));
}

#[test]
fn coordinates_without_a_mesh_are_refused_with_their_place() {
    for number in ["1e999", "1e61", "-1e999"] {
        let text = stl_text("a", &FACES).replacen("vertex 1", &format!("vertex {number}"), 1);
        refused("a.stl", text, ":6", "a");
        refused("a.off", format!("OFF\n{}", OFF.replacen("1 0 0", &format!("{number} 0 0"), 1)), ":4", "a");
        refused("a.obj", format!("v 0 0 0\nv 0 {number} 0\nv 0 0 1\nf 1 2 3\n"), ":2", "a");
        refused("a.poly", POLY.replacen("2 4 0 0", &format!("2 4 {number} 0"), 1), ":4", "a");
        refused("a.smesh", format!("3 3\n0 0 0 0\n1 1 0 0\n2 0 1 {number}\n1\n3 0 1 2\n"), ":4", "a");
        let head = strips_head("ascii").replace("tristrips", "face");
        refused(
            "a.ply",
            format!("{head}0 0 0\n0 {number} 0\n1 1 1\n0 1 0\n3 0 1 2\n"),
            ":11",
            "a coordinate is",
        );
    }
}

/// A cube 0 … 4 with a square window through its top facet, in TetGen's format.
const POLY: &str = "# a box\n12 3 0 0\n1 0 0 0\n2 4 0 0\n3 4 4 0\n4 0 4 0\n5 0 0 4\n6 4 0 4\n7 4 4 4\n8 0 4 4\n\
    9 1 1 4\n10 3 1 4\n11 3 3 4\n12 1 3 4\n\
    6 1\n1 0 -1\n4 1 2 3 4\n2 1 7 # with a window\n4 5 6 7 8\n4 9 10 11 12\n1 2 2 4\n\
    1 0 3\n4 1 2 6 5\n1 0 3\n4 2 3 7 6\n1 0 3\n4 3 4 8 7\n1 0 3\n4 4 1 5 8\n\
    1\n1 2 2 2\n2\n1 1 1 1 5 0.1\n2 3 3 3 6 -1\n";

#[test]
fn tetgen_facets_keep_markers_windows_holes_and_regions() {
    let surface = read_as("a.poly", POLY).unwrap();
    assert_eq!(surface.groups, ["marker -1", "marker 7", "marker 3"]);
    assert_eq!(surface.group_numbers, [-1, 7, 3]);
    let in_group = |g: u32| surface.group.iter().filter(|&&group| group == g).count();
    assert_eq!([0, 1, 2].map(in_group), [2, 8, 8]);
    assert_eq!(surface.holes, [Point::new(2., 2., 2.)]);
    let region = |x, attribute, max_volume| Region { place: Point::new(x, x, x), attribute, max_volume };
    assert_eq!(surface.regions, [region(1.0, 5.0, Some(0.1)), region(3.0, 6.0, None)]);
    assert!(surface.notes.is_empty(), "{:?}", surface.notes);
}

#[test]
fn a_smesh_takes_its_points_from_the_file_beside_it() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.smesh");
    fs::write(&path, "0 3 0 0\n4 1\n3 0 2 1 4\n3 0 1 3 4\n3 0 3 2 4\n3 1 2\n3 5\n0\n").unwrap();
    let error = read(&path).unwrap_err().to_string();
    assert!(error.starts_with("cannot read ") && error.contains("a.node"), "{error}");
    fs::write(dir.path().join("a.node"), "4 3 1 0\n0 0 0 0 7\n1 1 0 0 7\n2 0 1 0 7\n3 0 0 1 7\n").unwrap();
    let surface = read(&path).unwrap();
    assert_eq!(surface.triangles, FACES);
    assert_eq!(
        (surface.groups, surface.group),
        (vec!["marker 4".into(), "marker 5".into()], vec![0, 0, 0, 1])
    );
}

#[test]
fn edges_and_points_of_a_poly_without_a_facet_are_loose() {
    let text =
        "6 3\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 5\n4 0 0 6\n5 7 7 7\n3\n1\n3 0 1 2\n1\n2 3 4\n1\n1 5\n0\n0\n";
    let surface = read_as("a.poly", text).unwrap();
    assert_eq!(surface.triangles, [[0, 1, 2]]);
    assert_eq!(surface.loose_edges, [[Point::new(0., 0., 5.), Point::new(0., 0., 6.)]]);
    assert!(surface.loose_points.contains(&Point::new(7., 7., 7.)));
}

#[test]
fn broken_poly_files_are_refused_with_their_place() {
    refused(
        "a.poly",
        POLY.replacen("4 1 2 3 4", "4 1 2 3 14", 1),
        ":17",
        "no vertex 14: the vertices are 1 to 12",
    );
    refused("a.poly", POLY.replacen("\n3 4 4 0", "\n4 4 4 0", 1), ":5", "expected point 3, found 4");
    refused("a.poly", POLY.replacen("\n12 3", "\n12 2", 1), ":2", "dimension");
    refused("a.poly", POLY.replacen("4 1 2 3 4", "4 1 3 2 4", 1), ":16", "crosses itself");
    refused("a.poly", &POLY[..200], ":*", "announced");
    refused("a.smesh", "3 3\n5 0 0 0\n6 1 0 0\n7 0 1 0\n1\n3 5 6 7\n", ":2", "0 or 1 is expected");
}

#[test]
fn an_unknown_ending_lists_the_known_ones() {
    let said = read_as("a.step", "x").unwrap_err();
    assert!(said.contains("a.step") && said.contains(".stl") && said.contains(".smesh"), "{said}");
}

/// All examples of this file, for the tests with random damage.
fn samples() -> Vec<(&'static str, Vec<u8>)> {
    let mut ply = ply_text("binary_little_endian").into_bytes();
    ply.extend((0..200_u8).map(|k| k % 4));
    vec![
        ("a.stl", stl_text("part", &FACES).into()),
        ("a.stl", stl_binary(b"", &POINTS, &FACES)),
        ("a.off", format!("OFF\n{OFF}4 0 1 2 3\n").into()),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\ng a\nf 1 2 3\nf -1 -2 -3\nf 1 2 3 4\n".into()),
        ("a.ply", ply),
        ("a.ply", (ply_text("ascii") + &"1 0 0 1 ".repeat(40)).into()),
        ("a.poly", POLY.into()),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig {
        rng_seed: proptest::test_runner::RngSeed::Fixed(1),
        failure_persistence: None,
        cases: 400,
        ..Default::default()
    })]

    #[test]
    fn damaged_files_never_panic(
        sample in 0..7_usize,
        cut in 0.0..1.0,
        changes in prop::collection::vec((0.0..1.0, any::<u8>()), 0..6),
        digits in any::<bool>(),
    ) {
        let (name, mut content) = samples().swap_remove(sample);
        for (place, byte) in changes {
            let place = (place * content.len() as f64) as usize;
            content[place] = if digits { b'0' + byte % 10 } else { byte };
        }
        if cut > 0.5 {
            content.truncate((2.0 * (cut - 0.5) * content.len() as f64) as usize);
        }
        match read_as(name, &content) {
            Ok(surface) => {
                prop_assert_eq!(surface.triangles.len(), surface.group.len());
                prop_assert!(surface.triangles.iter().flatten().all(|&v| (v as usize) < surface.points.len()));
                prop_assert!(surface.points.iter().all(|p| p.iter().all(|x| x.is_finite())));
                prop_assert!(surface.group.iter().all(|&g| (g as usize) < surface.groups.len()));
            }
            Err(said) => prop_assert!(said.len() > 10),
        }
    }

    #[test]
    fn random_bytes_never_panic(
        ending in prop::sample::select(vec!["stl", "off", "obj", "ply", "poly", "smesh"]),
        content in prop::collection::vec(any::<u8>(), 1..300),
    ) {
        let _ = read_as(&format!("a.{ending}"), content);
    }
}

//! Files of other programs and hand-made ones: faces without seams, units, damage.

mod odd;
mod order;
mod parts;

use super::text::decoded;
use crate::{BrepError, Model, Point, Settings, Tessellation, Unit, tessellate};
use std::f64::consts::PI;
use std::fmt::Write;

/// The text of a file that grows record by record.
struct Text(String, u32);

impl Text {
    fn new() -> Self {
        Self("ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n".into(), 0)
    }

    fn add(&mut self, record: &str) -> u32 {
        self.1 += 1;
        writeln!(self.0, "#{} = {record};", self.1).unwrap();
        self.1
    }

    fn point(&mut self, x: f64, y: f64, z: f64) -> u32 {
        self.add(&format!("CARTESIAN_POINT('',({x:?},{y:?},{z:?}))"))
    }

    /// A coordinate system with its z axis up or down.
    fn frame(&mut self, z: f64, up: f64) -> u32 {
        let origin = self.point(0.0, 0.0, z);
        let axis = self.add(&format!("DIRECTION('',(0.,0.,{up:?}))"));
        self.add(&format!("AXIS2_PLACEMENT_3D('',#{origin},#{axis},$)"))
    }

    /// A circle around the z axis as an edge with one vertex, at the angle `at`.
    fn circle(&mut self, radius: f64, z: f64, at: f64) -> u32 {
        let point = self.point(radius * at.cos(), radius * at.sin(), z);
        let vertex = self.add(&format!("VERTEX_POINT('',#{point})"));
        let frame = self.frame(z, 1.0);
        let circle = self.add(&format!("CIRCLE('',#{frame},{radius:?})"));
        self.add(&format!("EDGE_CURVE('',#{vertex},#{vertex},#{circle},.T.)"))
    }

    /// A coordinate system with axes z and x.
    fn frame_at(&mut self, origin: [f64; 3], z: [f64; 3], x: [f64; 3]) -> u32 {
        let [a, b, c] = origin;
        let origin = self.point(a, b, c);
        let [z, x] = [z, x].map(|[a, b, c]| self.add(&format!("DIRECTION('',({a:?},{b:?},{c:?}))")));
        self.add(&format!("AXIS2_PLACEMENT_3D('',#{origin},#{z},#{x})"))
    }

    /// A line from a point in a direction.
    fn line(&mut self, start: u32, [x, y, z]: [f64; 3], length: f64) -> u32 {
        let direction = self.add(&format!("DIRECTION('',({x:?},{y:?},{z:?}))"));
        let vector = self.add(&format!("VECTOR('',#{direction},{length:?})"));
        self.add(&format!("LINE('',#{start},#{vector})"))
    }

    /// A bound of one edge.
    fn bound(&mut self, edge: u32, is_forward: bool) -> u32 {
        let flag = if is_forward { "T" } else { "F" };
        let used = self.add(&format!("ORIENTED_EDGE('',*,*,#{edge},.{flag}.)"));
        let edges = self.add(&format!("EDGE_LOOP('',(#{used}))"));
        self.add(&format!("FACE_BOUND('',#{edges},.T.)"))
    }

    /// A bound without edges.
    fn vertex_bound(&mut self) -> u32 {
        let point = self.point(0.0, 0.0, 1.0);
        let vertex = self.add(&format!("VERTEX_POINT('',#{point})"));
        let bound = self.add(&format!("VERTEX_LOOP('',#{vertex})"));
        self.add(&format!("FACE_BOUND('',#{bound},.T.)"))
    }

    fn face(&mut self, surface: u32, bounds: &[u32]) -> u32 {
        let bounds: Vec<String> = bounds.iter().map(|b| format!("#{b}")).collect();
        self.add(&format!("ADVANCED_FACE('side',({}),#{surface},.T.)", bounds.join(",")))
    }

    /// A flat face inside of a circle, that looks up or down.
    fn disk(&mut self, edge: u32, z: f64, is_up: bool) -> u32 {
        let frame = self.frame(z, if is_up { 1.0 } else { -1.0 });
        let plane = self.add(&format!("PLANE('',#{frame})"));
        let bound = self.bound(edge, is_up);
        self.face(plane, &[bound])
    }

    fn shell(&mut self, faces: &[u32]) -> u32 {
        let faces: Vec<String> = faces.iter().map(|f| format!("#{f}")).collect();
        self.add(&format!("CLOSED_SHELL('',({}))", faces.join(",")))
    }

    /// The text of a file with one solid.
    fn solid(mut self, faces: &[u32]) -> String {
        let shell = self.shell(faces);
        let solid = self.add(&format!("MANIFOLD_SOLID_BREP('part',#{shell})"));
        self.of_solid(solid)
    }

    /// The text of a file with a solid.
    fn of_solid(mut self, solid: u32) -> String {
        let unit = self.add("( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) )");
        let context = self.add(&format!(
            "( GEOMETRIC_REPRESENTATION_CONTEXT(3) GLOBAL_UNIT_ASSIGNED_CONTEXT((#{unit})) \
             REPRESENTATION_CONTEXT('','') )"
        ));
        self.add(&format!("ADVANCED_BREP_SHAPE_REPRESENTATION('',(#{solid}),#{context})"));
        self.0 + "ENDSEC;\nEND-ISO-10303-21;\n"
    }
}

/// The text of a file with a cylinder of radius 1 and height 2 (millimetres) on the origin. The
/// vertex of its upper circle is at the angle `at`; `is_forward` is the way around of its side's
/// lower edge, the other one of its upper.
fn cylinder(at: f64, is_forward: bool) -> String {
    let mut text = Text::new();
    let (low, high) = (text.circle(1.0, 0.0, 0.0), text.circle(1.0, 2.0, at));
    let frame = text.frame(0.0, 1.0);
    let surface = text.add(&format!("CYLINDRICAL_SURFACE('',#{frame},1.)"));
    let bounds = [text.bound(low, is_forward), text.bound(high, !is_forward)];
    let faces = [text.face(surface, &bounds), text.disk(low, 0.0, false), text.disk(high, 2.0, true)];
    text.solid(&faces)
}

/// The volumes of the bodies of a file.
fn volumes(text: &str, unit: Unit) -> (Model, Vec<f64>) {
    let mut model = Model::read_step(text.as_bytes(), unit).unwrap_or_else(|error| panic!("{error}"));
    let tessellation = Tessellation::of(&mut model, &Settings { chord: 1e-3, angle: 0.2 }).unwrap();
    let all = (0..model.bodies).map(|body| tessellate::volume(&model, &tessellation, body)).collect();
    (model, all)
}

fn assert_near(found: f64, exact: f64) {
    assert!((found / exact - 1.0).abs() < 1e-2, "{found} is not {exact}");
}

/// A file of the repository.
fn assembly() -> String {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../geometries/step/assembly.step");
    std::fs::read_to_string(path).expect("a file of the repository")
}

#[test]
fn a_cylinder_needs_no_seam() {
    // The vertices of the two circles are not above each other.
    for at in [0.0, 1.0, 4.0] {
        let (model, volumes) = volumes(&cylinder(at, true), Unit::OfFile);
        assert_near(volumes[0], 2.0 * PI);
        assert_eq!(model.body_names, [Some("part".to_owned())]);
        assert!(model.patch_names.iter().all(|name| name.as_deref() == Some("side")));
    }
}

#[test]
fn a_loop_around_a_sphere_or_a_cone_ends_at_its_pole() {
    let mut text = Text::new();
    let rim = text.circle(1.0, 0.0, 0.5);
    let frame = text.frame(0.0, 1.0);
    let surface = text.add(&format!("SPHERICAL_SURFACE('',#{frame},1.)"));
    let bound = text.bound(rim, true);
    let faces = [text.face(surface, &[bound]), text.disk(rim, 0.0, false)];
    assert_near(volumes(&text.solid(&faces), Unit::OfFile).1[0], 2.0 / 3.0 * PI);

    // A cone that narrows downward: radius 1 at height 0, tip at -1. Its radius is given far above.
    for height in [0.0, 1e6] {
        let mut text = Text::new();
        let rim = text.circle(1.0, 0.0, 0.5);
        let frame = text.frame(height, 1.0);
        let surface = text.add(&format!("CONICAL_SURFACE('',#{frame},{:?},{:?})", 1.0 + height, PI / 4.0));
        let bound = text.bound(rim, false);
        let faces = [text.face(surface, &[bound]), text.disk(rim, 0.0, true)];
        let (model, volumes) = volumes(&text.solid(&faces), Unit::OfFile);
        assert_near(volumes[0], PI / 3.0);
        let foot =
            crate::project_to_surface(&model.patches[0].surface, &Point::new(0.3, 0.4, -0.5), [1.0, 0.1]);
        assert!(foot.is_converged && (foot.point - Point::new(0.3, 0.4, -0.5)).norm() < 1e-9, "{foot:?}");
    }
}

#[test]
fn whole_spheres_and_tori_need_no_edges() {
    for (surface, exact) in [
        ("SPHERICAL_SURFACE('',#3,1.5)", 4.0 / 3.0 * PI * 1.5_f64.powi(3)),
        ("TOROIDAL_SURFACE('',#3,2.,0.5)", 2.0 * PI * PI * 2.0 * 0.25),
    ] {
        let mut text = Text::new();
        text.frame(0.0, 1.0);
        let surface = text.add(surface);
        let bound = text.vertex_bound();
        let face = text.face(surface, &[bound]);
        assert_near(volumes(&text.solid(&[face]), Unit::OfFile).1[0], exact);
    }
}

#[test]
fn a_torus_with_a_negative_radius_is_the_inner_side_of_one_that_crosses_itself() {
    // A barrel: the arc at distance 2 from the circle of radius 1 on the other side of the axis.
    let mut text = Text::new();
    let radius = 3.0_f64.sqrt() - 1.0;
    let (low, high) = (text.circle(radius, -1.0, 0.0), text.circle(radius, 1.0, 0.0));
    let frame = text.frame(0.0, 1.0);
    let surface = text.add(&format!("TOROIDAL_SURFACE('',#{frame},-1.,2.)"));
    let bounds = [text.bound(low, true), text.bound(high, false)];
    let faces = [text.face(surface, &bounds), text.disk(low, -1.0, false), text.disk(high, 1.0, true)];
    let (_, volumes) = volumes(&text.solid(&faces), Unit::OfFile);
    let exact = PI * (28.0 / 3.0 - 2.0 * (3.0_f64.sqrt() + 2.0 * PI / 3.0));
    assert_near(volumes[0], exact);
}

#[test]
fn an_elbow_needs_no_seam() {
    // A quarter of a torus: its loops go around the tube, in the other direction than those above.
    let mut text = Text::new();
    let mut disks = Vec::new();
    let mut bounds = Vec::new();
    // At both ends: the way out, the axis around which the tube's angle grows, and its start.
    for (out, z, x, is_start) in [
        ([0.0, -1.0, 0.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0], true),
        ([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], false),
    ] {
        let center = x.map(|x| 2.0 * x);
        let [a, b, c] = x.map(|x| 2.5 * x);
        let point = text.point(a, b, c);
        let vertex = text.add(&format!("VERTEX_POINT('',#{point})"));
        let frame = text.frame_at(center, z, x);
        let circle = text.add(&format!("CIRCLE('',#{frame},0.5)"));
        let edge = text.add(&format!("EDGE_CURVE('',#{vertex},#{vertex},#{circle},.T.)"));
        let frame = text.frame_at(center, out, x);
        let plane = text.add(&format!("PLANE('',#{frame})"));
        let bound = text.bound(edge, is_start);
        disks.push(text.face(plane, &[bound]));
        bounds.push(text.bound(edge, !is_start));
    }
    let frame = text.frame(0.0, 1.0);
    let surface = text.add(&format!("TOROIDAL_SURFACE('',#{frame},2.,0.5)"));
    disks.push(text.face(surface, &bounds));
    assert_near(volumes(&text.solid(&disks), Unit::OfFile).1[0], PI * PI / 4.0);
}

#[test]
fn loops_the_wrong_way_around_are_turned() {
    assert_near(volumes(&cylinder(0.0, false), Unit::OfFile).1[0], 2.0 * PI);
}

#[test]
fn an_assembly_has_placed_and_named_solids_in_any_unit() {
    // A plate of 40 × 40 × 5 mm and four bolts in two pairs, in inches.
    let bolt = PI * (4.0 * 7.0 + 16.0 * 3.0);
    for (unit, millimetres) in [("file", 25.4), ("mm", 1.0), ("m", 1000.0), ("in", 25.4)] {
        let (model, volumes) = volumes(&assembly(), unit.parse().unwrap());
        let scale: f64 = millimetres * millimetres * millimetres;
        assert_near(volumes[0] * scale, 8000.0);
        volumes[1..].iter().for_each(|&volume| assert_near(volume * scale, bolt));
        let names: Vec<&str> = model.body_names.iter().flatten().map(String::as_str).collect();
        assert_eq!(names, ["plate", "bolt", "bolt", "bolt", "bolt"]);
        assert_eq!(model.metres, Some(millimetres / 1000.0));
        // The plate lies 20 mm below the origin, the first bolt stands on (-5, -5, 20).
        let heights = model.corners.iter().map(|corner| corner.point.z * millimetres);
        assert!((heights.fold(f64::INFINITY, f64::min) + 25.0).abs() < 1e-9);
        let is_foot = |x: f64, y: f64| {
            let off = |p: &crate::Point| (p.coords * millimetres - crate::Vector::new(x, y, 20.0)).norm();
            model.corners.iter().any(|corner| (off(&corner.point) - 2.0).abs() < 1e-9)
        };
        assert!(is_foot(-5.0, -5.0));
    }
    assert!("furlong".parse::<Unit>().unwrap_err().contains("mm"));
}

#[test]
fn surface_models_that_enclose_solids_are_solids_with_their_names_at_their_places() {
    let text = assembly();
    let mut parts = text.split("MANIFOLD_SOLID_BREP(");
    let mut surfaces = parts.next().unwrap().to_owned();
    for part in parts {
        let (label, rest) = part.split_once(",#").unwrap();
        let (shell, rest) = rest.split_once(')').unwrap();
        surfaces += &format!("SHELL_BASED_SURFACE_MODEL({label},(#{shell})){rest}");
    }
    let (model, found) = volumes(&surfaces, Unit::OfFile);
    let (solids, exact) = volumes(&text, Unit::OfFile);
    assert_eq!((model.body_names, model.metres), (solids.body_names, solids.metres));
    let faces = solids.patches.len();
    assert_eq!(
        model.notes,
        [format!("there is no solid, but {faces} faces enclose 5: they are taken as solids")]
    );
    found.iter().zip(&exact).for_each(|(found, exact)| assert_near(*found, *exact));

    // A surface that cannot be read is an error if there is no solid.
    let damaged = surfaces.replace("CYLINDRICAL_SURFACE", "ROUND_SURFACE");
    assert!(matches!(Model::read_step(damaged.as_bytes(), Unit::OfFile), Err(BrepError::Syntax { .. })));
}

#[test]
fn damaged_files_give_an_error_with_a_line() {
    let text = assembly();
    let refused = |text: &[u8]| match Model::read_step(text, Unit::OfFile) {
        Err(BrepError::Syntax { line, .. }) => line > 0,
        Err(_) => true,
        Ok(_) => false,
    };
    // Without its end a file is incomplete.
    let end = text.find("END-ISO").unwrap();
    assert!((0..end).step_by(211).all(|length| refused(&text.as_bytes()[..length])));
    // Changed characters are an error or change a number or name.
    let mut random = 1_u64;
    for _ in 0..400 {
        random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let mut bytes = text.clone().into_bytes();
        let at = (random >> 33) as usize % bytes.len();
        bytes[at] = b"#(),;'.$*0A-"[(random >> 20) as usize % 12];
        if let Ok(mut model) = Model::read_step(&bytes, Unit::OfFile) {
            let _ = Tessellation::of(&mut model, &Settings::default());
        }
    }
}

#[test]
fn an_assembly_without_a_shape_of_its_own_still_places_its_parts() {
    let whole = assembly();
    let record = "#3 = SHAPE_DEFINITION_REPRESENTATION(#4,#10);";
    assert!(whole.contains(record));
    let read = |text: &str| Model::read_step(text.as_bytes(), "mm".parse().unwrap()).unwrap();
    assert_eq!(read(&whole.replace(record, "")), read(&whole));
}

#[test]
fn a_part_that_contains_itself_ends_with_an_error() {
    let mut text = Text::new();
    let frame = text.frame(0.0, 1.0);
    let unit = text.add("( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT($,.METRE.) )");
    let context =
        text.add(&format!("( GLOBAL_UNIT_ASSIGNED_CONTEXT((#{unit})) REPRESENTATION_CONTEXT('','') )"));
    // Two items of a representation place the representation itself, and a solid makes it wanted.
    let (map, shape) = (text.1 + 1, text.1 + 5);
    text.add(&format!("REPRESENTATION_MAP(#{frame},#{shape})"));
    let items: Vec<u32> = (0..2).map(|_| text.add(&format!("MAPPED_ITEM('',#{map},#{frame})"))).collect();
    let shell = text.add("CLOSED_SHELL('',())");
    let product = "PRODUCT_DEFINITION_SHAPE('','',#100)";
    text.add(&format!("SHAPE_REPRESENTATION('',(#{},#{},#99),#{context})", items[0], items[1]));
    assert_eq!(text.1, shape);
    let text = format!(
        "{}#99 = MANIFOLD_SOLID_BREP('',#{shell});\n#98 = {product};\n#100 = PRODUCT_DEFINITION('','',$,$);\n\
         #97 = SHAPE_DEFINITION_REPRESENTATION(#98,#{shape});\nENDSEC;\nEND-ISO-10303-21;\n",
        text.0
    );
    let error = Model::read_step(text.as_bytes(), Unit::OfFile).unwrap_err().to_string();
    assert!(error.contains("nested more than"), "{error}");
}

#[test]
fn errors_name_the_record_and_its_line() {
    let error = |from: &str, to: &str| {
        Model::read_step(assembly().replacen(from, to, 1).as_bytes(), Unit::OfFile).unwrap_err().to_string()
    };
    let unknown = error("CYLINDRICAL_SURFACE", "MY_SURFACE");
    assert!(unknown.contains("line ") && unknown.contains("MY_SURFACE is no surface"), "{unknown}");
    let missing = error("EDGE_LOOP('',(#", "EDGE_LOOP('',(#99999");
    assert!(missing.contains("line ") && missing.contains("there is no #99999"), "{missing}");
    let none = Model::read_step(b"ISO-10303-21;HEADER;ENDSEC;DATA;ENDSEC;END-ISO-10303-21;", Unit::OfFile);
    assert!(matches!(none, Err(BrepError::NoSolid { .. })));
    assert!(Model::read_step(b"solid", Unit::OfFile).unwrap_err().to_string().contains("no STEP file"));
}

#[test]
fn texts_are_decoded() {
    let all = [
        (r"it''s", "it's"),
        (r"M\X2\00FC\X0\ller", "Müller"),
        (r"\X4\0001F600\X0\", "😀"),
        (r"\X\E9t\X\E9", "été"),
        (r"\S\V", "Ö"),
        (r"a\\b", r"a\b"),
        ("Größe", "Größe"),
        (r"\X2\00F", r"\X2\00F"),
    ];
    for (text, expected) in all {
        assert_eq!(decoded(text.as_bytes()), expected);
    }
    assert_eq!(decoded(&[0xe9]), "é");
}

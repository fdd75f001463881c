//! Assemblies whose parts are in other files.

use super::{Text, assert_near, cylinder};
use crate::{BrepError, Model, Settings, Tessellation, Unit, tessellate};
use std::f64::consts::PI;
use std::io;

/// How an assembly names the file of a part.
#[derive(Clone, Copy)]
enum Link {
    /// A document of the product.
    Document,
    /// A property of the product's representation.
    Property,
}

/// A product with a shape of its coordinate system alone: its definition and representation.
fn product(text: &mut Text, name: &str, frame: u32, context: u32) -> [u32; 2] {
    let product = text.add(&format!("PRODUCT('{name}','{name}','',())"));
    let version = text.add(&format!("PRODUCT_DEFINITION_FORMATION('','',#{product})"));
    let definition = text.add(&format!("PRODUCT_DEFINITION('','',#{version},$)"));
    let shape = text.add(&format!("PRODUCT_DEFINITION_SHAPE('','',#{definition})"));
    let representation = text.add(&format!("SHAPE_REPRESENTATION('',(#{frame}),#{context})"));
    text.add(&format!("SHAPE_DEFINITION_REPRESENTATION(#{shape},#{representation})"));
    [definition, representation]
}

/// The text of an assembly in centimetres of parts in other files, at these places on the x axis.
fn assembly(parts: &[(&str, f64, Link)]) -> String {
    let mut text = Text::new();
    let unit = text.add("( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.CENTI.,.METRE.) )");
    let context = text.add(&format!(
        "( GEOMETRIC_REPRESENTATION_CONTEXT(3) GLOBAL_UNIT_ASSIGNED_CONTEXT((#{unit})) \
         REPRESENTATION_CONTEXT('','') )"
    ));
    let origin = text.frame(0.0, 1.0);
    let [whole, whole_shape] = product(&mut text, "whole", origin, context);
    for &(file, x, link) in parts {
        let [part, part_shape] = product(&mut text, "part", origin, context);
        let used = text.add(&format!("NEXT_ASSEMBLY_USAGE_OCCURRENCE('','','',#{whole},#{part},$)"));
        let placed = text.add(&format!("PRODUCT_DEFINITION_SHAPE('','',#{used})"));
        let frame = text.frame_at([x, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
        let moved = text.add(&format!("ITEM_DEFINED_TRANSFORMATION('','',#{origin},#{frame})"));
        let relation = text.add(&format!(
            "( REPRESENTATION_RELATIONSHIP('','',#{part_shape},#{whole_shape}) \
             REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#{moved}) SHAPE_REPRESENTATION_RELATIONSHIP() )"
        ));
        text.add(&format!("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#{relation},#{placed})"));
        let document = text.add(&format!("DOCUMENT_FILE('{file}','','',$,'',$)"));
        match link {
            Link::Document => text.add(&format!("APPLIED_DOCUMENT_REFERENCE(#{document},'',(#{part}))")),
            Link::Property => {
                let property =
                    text.add(&format!("PROPERTY_DEFINITION('external definition','',#{document})"));
                text.add(&format!("PROPERTY_DEFINITION_REPRESENTATION(#{property},#{part_shape})"))
            }
        };
    }
    text.0 + "ENDSEC;\nEND-ISO-10303-21;\n"
}

/// Reads an assembly of `row.stp`, a row of two cylinders, and of a cylinder; both in other files.
fn read(text: &str) -> Result<Model, BrepError> {
    let other = |name: &str| match name {
        "cylinder.stp" => Ok(cylinder(0.0, true).into_bytes()),
        "row.stp" => {
            let parts = [("cylinder.stp", 0.0, Link::Document), ("cylinder.stp", 1.0, Link::Property)];
            Ok(assembly(&parts).into_bytes())
        }
        "damaged.stp" => Ok(cylinder(0.0, true).replace("PLANE", "PLAIN").into_bytes()),
        "itself.stp" => Ok(assembly(&[("itself.stp", 1.0, Link::Document)]).into_bytes()),
        "twice.stp" => Ok(assembly(&[("twice.stp", 1.0, Link::Document); 2]).into_bytes()),
        _ => Err(io::ErrorKind::NotFound.into()),
    };
    Model::read_step_with(text.as_bytes(), Unit::OfFile, &other)
}

#[test]
fn parts_are_placed_where_nested_assemblies_place_them() {
    let parts = [
        ("row.stp", 10.0, Link::Property),
        ("cylinder.stp", 5.0, Link::Document),
        ("row.stp", 20.0, Link::Document),
    ];
    let mut model = read(&assembly(&parts)).unwrap();
    // The unit of the assembly: centimetres.
    assert_eq!((model.bodies, model.metres), (5, Some(0.01)));
    assert!(model.body_names.iter().all(|name| name.as_deref() == Some("part")));
    let tessellation = Tessellation::of(&mut model, &Settings { chord: 1e-4, angle: 0.2 }).unwrap();
    let mut places: Vec<i64> = Vec::new();
    for body in 0..model.bodies {
        assert_near(tessellate::volume(&model, &tessellation, body), 2.0 * PI * 1e-3);
        let corner = model.patches.iter().find(|patch| patch.bodies.contains(&Some(body))).unwrap();
        let crate::On::Curve(curve) = corner.loops[0][0].on else { panic!("{corner:?}") };
        // The vertex is 0.1 beside the axis.
        places.push(((model.corners[model.curves[curve].ends[0]].point.x - 0.1) * 1e6).round() as i64);
    }
    places.sort_unstable();
    assert_eq!(places, [5, 10, 11, 20, 21].map(|x| x * 1_000_000));
}

#[test]
fn parts_that_cannot_be_read_are_named() {
    let error = |parts: &[&str]| {
        let parts: Vec<_> = parts.iter().map(|name| (*name, 0.0, Link::Document)).collect();
        read(&assembly(&parts)).unwrap_err().to_string()
    };
    let missing = error(&["b.stp", "cylinder.stp", "a.stp", "b.stp"]);
    assert!(missing.contains("not beside it: a.stp, b.stp: put them there"), "{missing}");
    let damaged = error(&["cylinder.stp", "damaged.stp"]);
    assert!(damaged.contains("in its part damaged.stp: line") && damaged.contains("PLAIN"), "{damaged}");
    for endless in ["itself.stp", "twice.stp"] {
        let endless = error(&[endless]);
        assert!(endless.contains("nested more than"), "{}", &endless[..200]);
    }
}

#[test]
fn parts_in_the_format_of_a_program_are_named() {
    let error = read(&assembly(&[("part.prt", 0.0, Link::Document)])).unwrap_err().to_string();
    assert!(error.contains("not beside it: part.prt"), "{error}");
}

#[test]
fn the_drawing_of_an_assembly_is_no_part() {
    let text = assembly(&[("cylinder.stp", 0.0, Link::Document)]);
    let whole = text.lines().find(|line| line.contains("PRODUCT_DEFINITION('',")).unwrap();
    let id = whole.split_whitespace().next().unwrap();
    let drawing = format!(
        "#900 = DOCUMENT_FILE('drawing.pdf','','',$,'',$);\n\
         #901 = APPLIED_DOCUMENT_REFERENCE(#900,'',({id}));\nENDSEC;\nEND"
    );
    // The text has two ends of sections; the last is that of the data.
    let (data, _) = text.rsplit_once("ENDSEC;\nEND").unwrap();
    assert_eq!(read(&format!("{data}{drawing}-ISO-10303-21;\n")).unwrap().bodies, 1);
}

//! Boundary numbers and names, and body numbers.

use super::*;
use crate::geometry::{BoundaryLabel, SurfaceInfo};
use crate::{BodyId, SurfaceId};

fn numbers(geometry: &Geometry) -> Vec<Option<u32>> {
    geometry.surface_info.iter().map(|info| info.bc).collect()
}

#[test]
fn the_number_of_the_innermost_solid_applies() {
    let text = "solid a = plane (0,0,0; -1,0,0) and plane (1,0,0; 1,0,0) -bc=2;
                solid c = a and plane (0,0,0; 0,1,0) -bc=1; tlo c;";
    assert_eq!(numbers(&geometry(text)), [Some(2), Some(2), Some(1)]);
}

#[test]
fn a_number_applies_to_the_whole_named_solid() {
    let geometry = geometry("solid a = sphere (0,0,0; 1) and plane (0,0,0; 0,0,1) -bc=7; tlo a;");
    assert_eq!(numbers(&geometry), [Some(7), Some(7)]);
}

#[test]
fn lists_follow_the_order_of_surfaces() {
    let text = "solid a = orthobrick (0,0,0; 1,1,1) -bc=[1,2,3,4,5,6] -bcname=[b,t,s,n,w,e]; tlo a;";
    let geometry = geometry(text);
    assert_eq!(numbers(&geometry), [1, 2, 3, 4, 5, 6].map(Some));
    assert_eq!(geometry.surface_info[5].bc_name.as_deref(), Some("e"));
}

#[test]
fn lists_of_wrong_length_give_a_warning() {
    let text = "solid a = orthobrick (0,0,0; 1,1,1) -bc=[1,2]; tlo a;";
    assert!(warning(text).contains("the list of -bc has 2 values for 6 surfaces"));
    assert_eq!(numbers(&parsed(text).geometry), [Some(1), Some(2), None, None, None, None]);
}

#[test]
fn the_list_of_a_polyhedron_counts_its_faces() {
    let cube = "solid a = polyhedron (0,0,0; 1,0,0; 1,1,0; 0,1,0; 0,0,1; 1,0,1; 1,1,1; 0,1,1 ;;
        1,4,3,2; 5,6,7,8; 1,2,6,5; 2,3,7,6; 3,4,8,7; 4,1,5,8) -bc=[1,2,3,4,5,6]; tlo a;";
    assert_eq!(numbers(&geometry(cube)), [1, 2, 3, 4, 5, 6].map(Some));
}

#[test]
fn the_flags_of_the_first_of_equal_surfaces_apply() {
    let text = "solid a = orthobrick (0,0,0; 1,1,1) -bc=1;\nsolid b = orthobrick (0,0,-1; 1,1,0) -bc=2; tlo a; tlo b;";
    assert!(warning(text).contains("`b` is also one of `a` (line 2)"));
    let numbers = numbers(&parsed(text).geometry);
    assert_eq!(numbers, [Some(1), Some(1), Some(1), Some(1), Some(1), Some(1), Some(2)]);
}

#[test]
fn the_mesh_size_of_a_surface_is_the_least_of_all() {
    let text = "solid a = orthobrick (0,0,0; 1,1,1); solid b = orthobrick (0,0,-1; 1,1,0) -maxh=0.1;
                solid c = sphere (0,0,9; 1) -maxh=2; solid d = c and plane (0,0,9; 0,0,1) -maxh=0.5;
                tlo a; tlo b; tlo d;";
    let geometry = geometry(text);
    let sizes: Vec<_> = geometry.surface_info.iter().map(|info| info.maxh).collect();
    let [fine, none, half] = [Some(0.1), None, Some(0.5)];
    assert_eq!(sizes, [fine, none, fine, fine, fine, fine, fine, half, half]);
    assert_eq!(geometry.bodies.iter().map(|b| b.maxh).collect::<Vec<_>>(), [None, fine, half]);
}

#[test]
fn the_size_of_a_tlo_overrides_that_of_its_solid() {
    let geometry = geometry("solid a = sphere (0,0,0; 1) -maxh=0.5; tlo a -maxh=0.2;");
    assert_eq!(geometry.bodies[0].maxh, Some(0.2));
    assert_eq!(geometry.surface_info[0].maxh, Some(0.5));
}

#[test]
fn moved_copies_have_no_flags_but_the_originals_keep_theirs() {
    let text = "solid b = sphere (0,0,0; 1) -bc=3; solid a = multitranslate (5,0,0; 1; b) -bc=4; tlo a;";
    assert!(warning(text).contains("transformed copies do not inherit -bc"));
    assert_eq!(numbers(&parsed(text).geometry), [Some(3), Some(4)]);
}

#[test]
fn surfaces_know_their_solid_and_place() {
    let geometry = geometry("solid b = sphere (0,0,0; 1);\nsolid a = b and\n  plane (0,0,0; 0,0,1); tlo a;");
    let SurfaceInfo { solid, span, .. } = &geometry.surface_info[1];
    assert_eq!((solid.as_str(), span.line, span.column), ("a", 4, 3));
    assert_eq!(geometry.surface_info[0].solid, "b");
}

#[test]
fn boundary_conditions_name_surfaces_and_a_body() {
    let text = "solid p = plane (0.5,0,0; 1,0,0); solid a = orthobrick (0,0,0; 1,1,1) and p;
                solid b = orthobrick (0,0,-1; 1,1,0) and p; tlo a; tlo b;
                boundarycondition p b 3; boundaryconditionname a a wall;";
    let geometry = geometry(text);
    let [number, name] = &geometry.boundary_overrides[..] else { panic!() };
    assert_eq!((number.body, &number.label), (BodyId(1), &BoundaryLabel::Number(3)));
    assert_eq!(number.surfaces, [SurfaceId(0)]);
    assert_eq!((name.body, &name.label), (BodyId(0), &BoundaryLabel::Name("wall".into())));
    assert_eq!(name.surfaces.len(), 7);
}

#[test]
fn a_boundary_condition_without_effect_gives_a_warning() {
    let text =
        "solid p = plane (0.5,0,0; 1,0,0); solid a = sphere (0,0,0; 1); tlo a; boundarycondition p a 3;";
    assert!(warning(text).contains("no surface of this solid bounds `a`"));
}

#[test]
fn bodies_have_numbers_in_file_order() {
    let text = "solid a = sphere (0,0,0; 1); solid b = sphere (5,0,0; 1); tlo b; tlo a;";
    let bodies = geometry(text).bodies;
    assert_eq!(bodies.iter().map(|b| (b.name.as_str(), b.number)).collect::<Vec<_>>(), [("b", 1), ("a", 2)]);
}

//! Flags of statements.

use super::*;

#[test]
fn a_tlo_keeps_all_its_flags() {
    let text =
        "solid a = sphere (0,0,0; 1); tlo a -col=[1,0.5,0] -transparent -material=air -layer=2 -maxh=0.3;";
    let body = &geometry(text).bodies[0];
    assert_eq!(body.color, Some([1.0, 0.5, 0.0]));
    assert!(body.transparent);
    assert_eq!((body.material.as_deref(), body.layer, body.maxh), (Some("air"), 2, Some(0.3)));
}

#[test]
fn a_tlo_without_flags_has_none() {
    let body = &solid("sphere (0,0,0; 1)").bodies[0];
    assert_eq!((body.color, body.transparent, body.layer, body.maxh), (None, false, 1, None));
    assert_eq!(body.material, None);
}

#[test]
fn the_last_of_repeated_flags_applies() {
    let geometry = geometry("solid a = sphere (0,0,0; 1); tlo a -maxh=1 -maxh=2;");
    assert_eq!(geometry.bodies[0].maxh, Some(2.0));
}

#[test]
fn misspelled_flags_give_a_warning() {
    let text = warning("solid a = sphere (0,0,0; 1) -mxah=0.1; tlo a;");
    assert!(
        text.contains("the unknown flag -mxah is ignored") && text.contains("did you mean `maxh`?"),
        "{text}"
    );
}

#[test]
fn flags_in_the_wrong_place_give_a_warning() {
    assert!(warning("solid a = sphere (0,0,0; 1); tlo a -bc=2;").contains("it belongs on the `solid`"));
    assert!(warning("solid a = sphere (0,0,0; 1) -material=air; tlo a;").contains("it belongs on the `tlo`"));
}

#[test]
fn wrong_values_are_errors() {
    for (flag, part) in [
        ("-maxh=0", "-maxh=0 is not a mesh size"),
        ("-maxh=-1", "-maxh=-1 is not a mesh size"),
        ("-maxh=fine", "-maxh has a wrong value"),
        ("-maxh", "-maxh has a wrong value"),
        ("-bc=0", "-bc has a wrong value"),
        ("-bc=-1", "-bc has a wrong value"),
        ("-bc=wall", "-bc has a wrong value"),
        ("-bc=[1,0]", "-bc has a wrong value"),
        ("-bcname=3", "-bcname has a wrong value"),
    ] {
        let text = error(&format!("solid a = sphere (0,0,0; 1) {flag}; tlo a;"));
        assert!(text.contains(part), "{flag}: {text}");
    }
    for flag in ["-col=[1,0]", "-col=red", "-transparent=1", "-material=7", "-layer=top"] {
        let text = error(&format!("solid a = sphere (0,0,0; 1); tlo a {flag};"));
        assert!(text.contains("has a wrong value"), "{flag}: {text}");
    }
}

#[test]
fn different_layers_give_a_warning() {
    let text = "solid a = sphere (0,0,0; 1); solid b = sphere (5,0,0; 1); tlo a; tlo b -layer=2;";
    assert!(warning(text).contains("`a` and `b` are in different layers"));
}

//! Any text gives a geometry or errors, and every message has a position in the text.

use super::*;
use proptest::prelude::*;

/// Sources with every construct, to be mutated.
const SOURCES: [&str; 4] = [
    "algebraic3d
solid c1 = plane (0, 0, 0; 0, 0, -1) and plane (1, 1, 1; 0, 0, 1)
   and (cylinder (0.5, 0.75, 0; 0.5, 0.75, 2; 0.3) or not sphere (0,0,0; 0.5)) -bc=2 -maxh=0.1;
solid c2 = orthobrick (0,0,0; 1,1,1) and not c1 -bcname=[a,b];
tlo c2 -col=[1,0,0] -transparent -material=air; # end
boundarycondition c1 c2 3; boundaryconditionname c1 c2 wall;
boundingbox (-1,-1,-1; 2,2,2); point (0.5,0.5,0.5); singular edge c1 c2 -factor=2;",
    "algebraic3d
solid cyls = multitranslate (0, 1, 0; 3; multitranslate (1, 0, 0; 3; cylinder (0,0,-1; 0,0,3; 0.2)));
solid m = orthobrick (0,0,0; 10,10,1) and not multirotate (0,0,0; 0.5,0,0; 4; cyls);
solid r = rotate (1,2,3; 0.1,0.2,0.3; translate (1,1,1; torus (0,0,0; 0,0,1; 2; 0.5)));
tlo m; tlo r -layer=1;",
    "algebraic3d
solid p = polyhedron (0,0,0; 1,0,0; 1,1,0; 0,1,0; 0,0,1; 1,0,1; 1,1,1; 0,1,1 ;;
   1,4,3,2; 5,6,7,8; 1,2,6,5; 2,3,7,6; 3,4,8,7; 4,1,5,8) -bc=[1,2,3,4,5,6];
solid e = ellipsoid (0,0,0; 2,0,0; 0,1,0; 0,0,1) or ellipticcylinder (0,0,0; 1,0,0; 0,2,0)
   or ellipticcone (0,0,0; 2,0,0; 0,1,0; 3; 0.5) or cone (0,0,0; 1; 0,0,3; 0.1);
tlo p; tlo e p -bc=2; identify periodic p e; identify closesurfaces p e -tlo=p;",
    "algebraic3d
curve2d profile = (3; 1,1; 1,2; 2,2; 3; 2,1,2; 2,2,3; 2,3,1);
curve3d path = (3; 0,0,0; 10,0,5; 10,10,10; 1; 3,1,2,3);
solid x = extrusion (path; profile; 0,0,1) or revolution (0,0,0; 1,0,0; profile);
define constant identprec = 1e-5; tlo x;",
];

/// Words, marks and numbers for random token sequences.
const TOKENS: [&str; 42] = [
    "solid",
    "tlo",
    "a",
    "b",
    "c",
    "=",
    "(",
    ")",
    ";",
    ",",
    "-",
    "[",
    "]",
    "and",
    "or",
    "not",
    "sphere",
    "plane",
    "orthobrick",
    "polyhedron",
    "translate",
    "multirotate",
    "curve2d",
    "curve3d",
    "extrusion",
    "identify",
    "periodic",
    "singular",
    "point",
    "edge",
    "boundarycondition",
    "boundingbox",
    "define",
    "constant",
    "0",
    "1",
    "2.5",
    "1e400",
    "1e",
    "-bc",
    "\n",
    "\u{e4}",
];

/// Parses the source and checks that messages point into it.
fn survives(source: &str) -> Result<(), TestCaseError> {
    let messages = match parse_geometry(source, "fuzz.geo") {
        Ok(parsed) => {
            let count = parsed.geometry.surfaces.len();
            prop_assert_eq!(parsed.geometry.surface_info.len(), count);
            for body in &parsed.geometry.bodies {
                prop_assert!(surfaces_exist(&body.solid, count));
            }
            parsed.warnings
        }
        Err(errors) => {
            prop_assert!(errors.errors().count() > 0);
            prop_assert!(!errors.to_string().is_empty());
            errors.messages
        }
    };
    for message in messages {
        let (line, column) = (message.span.line as usize, message.span.column as usize);
        prop_assert!(line >= 1 && line <= source.split(['\n', '\r']).count(), "{}", message);
        prop_assert!(column >= 1 && column <= message.source_line.chars().count() + 1, "{}", message);
    }
    Ok(())
}

fn surfaces_exist(solid: &Solid, count: usize) -> bool {
    match solid {
        Solid::Half { surface, .. } => surface.index() < count,
        Solid::And(members) | Solid::Or(members) => members.iter().all(|m| surfaces_exist(m, count)),
        Solid::Not(member) => surfaces_exist(member, count),
    }
}

/// Mutates a text: at given positions, replaces some characters by a token.
fn mutate(source: &str, changes: &[(prop::sample::Index, usize, &str)]) -> String {
    let mut characters: Vec<char> = source.chars().collect();
    for (place, removed, token) in changes {
        let at = place.index(characters.len() + 1);
        let end = (at + removed).min(characters.len());
        characters.splice(at..end, token.chars());
    }
    characters.into_iter().collect()
}

proptest! {
    #![proptest_config(ProptestConfig {
        rng_seed: proptest::test_runner::RngSeed::Fixed(20),
        failure_persistence: None,
        ..ProptestConfig::with_cases(600)
    })]

    #[test]
    fn mutated_sources_do_not_panic(
        source in prop::sample::select(&SOURCES[..]),
        changes in prop::collection::vec(
            (any::<prop::sample::Index>(), 0..6_usize, prop::sample::select(&TOKENS[..])),
            0..6,
        ),
    ) {
        survives(&mutate(source, &changes))?;
    }

    #[test]
    fn token_sequences_do_not_panic(tokens in prop::collection::vec(prop::sample::select(&TOKENS[..]), 0..80)) {
        survives(&format!("algebraic3d {}", tokens.join(" ")))?;
    }

    #[test]
    fn arbitrary_text_does_not_panic(text in any::<String>(), bytes in any::<Vec<u8>>()) {
        survives(&text)?;
        survives(&format!("algebraic3d\nsolid {text}"))?;
        survives(&String::from_utf8_lossy(&bytes))?;
    }

    #[test]
    fn extreme_numbers_do_not_panic(numbers in prop::collection::vec(extreme(), 13), place in 0..12_usize) {
        let n: Vec<String> = numbers.iter().map(|x| format!("{x:e}")).collect();
        let v = |i: usize| format!("{},{},{}", n[i], n[i + 1], n[i + 2]);
        let primitives = [
            format!("plane ({}; {})", v(0), v(3)),
            format!("sphere ({}; {})", v(0), n[3]),
            format!("cylinder ({}; {}; {})", v(0), v(3), n[6]),
            format!("cone ({}; {}; {}; {})", v(0), n[3], v(4), n[7]),
            format!("ellipticcylinder ({}; {}; {})", v(0), v(3), v(6)),
            format!("ellipticcone ({}; {}; {}; {}; {})", v(0), v(3), v(6), n[9], n[10]),
            format!("ellipsoid ({}; {}; {}; {})", v(0), v(3), v(6), v(9)),
            format!("orthobrick ({}; {})", v(0), v(3)),
            format!("torus ({}; {}; {}; {})", v(0), v(3), n[6], n[7]),
            format!("polyhedron ({}; {}; {}; {} ;; 1,3,2; 1,2,4; 2,3,4; 1,4,3)", v(0), v(3), v(6), v(9)),
            format!("rotate ({}; {}; orthobrick (0,0,0; {}))", v(0), v(3), v(6)),
            format!("multitranslate ({}; 2; sphere ({}; {}))", v(0), v(3), n[6]),
        ];
        let text = format!("solid a = {0}; solid b = {0} or plane (0,0,0; 0,0,1); tlo a; tlo b;", primitives[place]);
        survives(&format!("algebraic3d\n{text}"))?;
        if let Ok(parsed) = parse_geometry(&format!("algebraic3d\n{text}"), "t.geo") {
            for surface in &parsed.geometry.surfaces {
                prop_assert!(!format!("{surface:?}").contains("NaN"), "{:?}", surface);
                prop_assert!(!format!("{surface:?}").contains("inf"), "{:?}", surface);
            }
        }
    }
}

/// Numbers of ordinary size, and extreme ones.
fn extreme() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -3.0..3.0_f64,
        2 => prop::sample::select(&[0.0, 1.0, -1.0, 1e-300, 1e300, -1e300, 5e-324, 1e-8, 1e59, 1e-59][..]),
        1 => any::<f64>().prop_filter("finite", |x| x.is_finite()),
    ]
}

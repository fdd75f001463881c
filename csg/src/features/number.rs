//! Boundary-condition numbers and names.

use super::Patch;
use crate::Geometry;
use crate::geometry::BoundaryLabel;

/// The name of a boundary that the file does not name.
const DEFAULT_NAME: &str = "default";

/// Gives each patch its number and name: those of its surface, else the next free number; then what the file
/// says of single boundaries of bodies ([`BoundaryOverride`](crate::geometry::BoundaryOverride)).
///
/// Unlike NETGEN's, the counter starts after the numbers of all statements, so that a number that the file does
/// not give twice is not given twice.
pub(super) fn number(geometry: &Geometry, patches: &mut [Patch]) {
    let of_surfaces = geometry.surface_info.iter().filter_map(|info| info.bc);
    let of_overrides = geometry.boundary_overrides.iter().filter_map(|o| match o.label {
        BoundaryLabel::Number(number) => Some(number),
        BoundaryLabel::Name(_) => None,
    });
    let mut last = of_surfaces.chain(of_overrides).max().unwrap_or(0);
    let mut fresh = || {
        last += 1;
        last
    };
    for patch in &mut *patches {
        let info = &geometry.surface_info[patch.surface.index()];
        patch.bc = info.bc.unwrap_or_else(&mut fresh);
        patch.name = info.bc_name.clone().unwrap_or_else(|| DEFAULT_NAME.to_owned());
    }
    for over in &geometry.boundary_overrides {
        let named = |patch: &&mut Patch| {
            [patch.inside, patch.outside].contains(&Some(over.body))
                && over.surfaces.binary_search(&patch.surface).is_ok()
        };
        for patch in patches.iter_mut().filter(named) {
            match &over.label {
                BoundaryLabel::Number(number) => patch.bc = *number,
                BoundaryLabel::Name(name) => {
                    // A number that other patches have too would get their names mixed up.
                    if geometry.surface_info[patch.surface.index()].bc == Some(patch.bc) {
                        patch.bc = fresh();
                    }
                    patch.name.clone_from(name);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::Features;
    use crate::language::parse_geometry;

    fn boundaries(statements: &str) -> Vec<(u32, String)> {
        let source = format!(
            "algebraic3d\nsolid low = orthobrick (0,0,0; 1,1,1);\nsolid high = orthobrick (0,0,1; 1,1,2);\n\
             solid top = plane (0,0,2; 0,0,1);\ntlo low;\ntlo high;\n{statements}"
        );
        let geometry = parse_geometry(&source, "two.geo").unwrap().geometry;
        let features = Features::find(&geometry).unwrap();
        features.patches.iter().map(|p| (p.bc, p.name.clone())).collect()
    }

    #[test]
    fn each_patch_has_a_number_of_its_own_unless_the_file_says_otherwise() {
        let mut numbers: Vec<u32> = boundaries("").into_iter().map(|(bc, _)| bc).collect();
        numbers.sort_unstable();
        assert_eq!(numbers, (1..=11).collect::<Vec<_>>());
    }

    #[test]
    fn a_statement_gives_one_boundary_of_a_body_its_number_and_name() {
        let named = boundaries("boundarycondition top high 40;\nboundaryconditionname top high lid;\n");
        assert_eq!(named.iter().filter(|(bc, name)| (*bc, name.as_str()) == (40, "lid")).count(), 1, "{named:?}");
        assert_eq!(named.iter().filter(|(bc, _)| *bc > 40).count(), 10, "{named:?}");
    }
}

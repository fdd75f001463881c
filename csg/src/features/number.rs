//! Boundary-condition numbers and names.

use super::Patch;
use crate::{BoundaryLabel, Geometry};

/// Assigns each patch its boundary number and name: those of its cutout, else those of its surface,
/// else the next free number. Then applies the statements for single boundaries of bodies in file
/// order.
///
/// Free numbers start above all numbers in the file. NETGEN's start above those of surfaces only,
/// so a `boundarycondition` may assign one of them again.
pub(super) fn number(geometry: &Geometry, patches: &mut [Patch]) {
    let of_surfaces = geometry.surface_info.iter().filter_map(|info| info.bc);
    let of_overrides = geometry.boundary_overrides.iter().filter_map(|over| match over.label {
        BoundaryLabel::Number(number) => Some(number),
        BoundaryLabel::Name(_) => None,
    });
    let of_cutouts = geometry.cutouts.iter().filter_map(|cutout| cutout.bc);
    let mut last = of_surfaces.chain(of_overrides).chain(of_cutouts).max().unwrap_or(0);
    let mut next = || {
        last += 1;
        last
    };
    for patch in &mut *patches {
        let info = &geometry.surface_info[patch.surface.index()];
        let cutout = patch.cutout.map(|i| &geometry.cutouts[i as usize]);
        patch.bc = cutout.and_then(|cutout| cutout.bc).or(info.bc).unwrap_or_else(&mut next);
        patch.name = cutout.and_then(|cutout| cutout.bc_name.clone()).or_else(|| info.bc_name.clone());
    }
    for over in &geometry.boundary_overrides {
        let sides = |patch: &Patch| [patch.inside, patch.outside].contains(&Some(over.body));
        for patch in patches.iter_mut().filter(|p| over.surfaces.contains(&p.surface) && sides(p)) {
            match &over.label {
                BoundaryLabel::Number(number) => patch.bc = *number,
                BoundaryLabel::Name(name) => {
                    patch.name = Some(name.clone());
                    // Other patches with this number keep their name, so this patch needs its own
                    // number.
                    if geometry.surface_info[patch.surface.index()].bc == Some(patch.bc) {
                        patch.bc = next();
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{Features, language};

    fn labels(statements: &str) -> Vec<(u32, Option<String>)> {
        let source = format!(
            "algebraic3d
            solid right = plane (0.5, 0, 0; -1, 0, 0);
            solid low = orthobrick (0, 0, 0; 1, 1, 1) -bc=2;
            solid high = orthobrick (0, 0, 1; 1, 1, 2) -bcname=high;
            tlo low; tlo high; {statements}"
        );
        let geometry = language::parse_geometry(&source, "bricks.geo").unwrap().geometry;
        let features = Features::find(&geometry).unwrap();
        features.patches.into_iter().map(|p| (p.bc, p.name)).collect()
    }

    #[test]
    fn patches_get_the_numbers_of_their_surfaces_or_the_next_free_ones() {
        let labels = labels("");
        // Number 2: the interface and five sides of the low brick, and four sides of the high brick
        // that lie in the planes of the low one. The top of the high brick has a name.
        assert_eq!(labels.iter().filter(|l| l.0 == 2).count(), 10);
        assert_eq!(labels.iter().filter(|l| **l == (3, Some("high".to_owned()))).count(), 1);
    }

    #[test]
    fn statements_for_one_body_change_its_patches_only() {
        let labels = labels("boundarycondition low high 7; boundaryconditionname low low bottom;");
        // Four sides of the high brick and the interface get 7. Then all patches of the low brick
        // get a name, and its five outer patches, which still have the surface's number, get new
        // numbers. (8 is the top of the high brick.)
        assert_eq!(labels.iter().filter(|l| l.0 == 7).count(), 5);
        assert_eq!(labels.iter().filter(|l| l.1.as_deref() == Some("bottom")).count(), 6);
        let mut own: Vec<u32> =
            labels.iter().filter(|l| l.1.as_deref() == Some("bottom") && l.0 != 7).map(|l| l.0).collect();
        own.sort_unstable();
        assert_eq!(own, [9, 10, 11, 12, 13]);
    }
}

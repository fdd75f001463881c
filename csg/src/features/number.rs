//! Boundary-condition numbers and names.

use super::Patch;
use crate::Geometry;

/// The name of a boundary that the file does not name.
const DEFAULT_NAME: &str = "default";

/// Gives each patch its number and name: those of its surface; else the next free number.
///
/// Unlike NETGEN's, the counter starts after the numbers of all statements, so that a number that the file does
/// not give twice is not given twice.
pub(super) fn number(geometry: &Geometry, patches: &mut [Patch]) {
    let given = geometry.surface_info.iter().filter_map(|info| info.bc);
    let mut last = given.max().unwrap_or(0);
    for patch in &mut *patches {
        let info = &geometry.surface_info[patch.surface.index()];
        patch.bc = info.bc.unwrap_or_else(|| {
            last += 1;
            last
        });
        patch.name = info.bc_name.clone().unwrap_or_else(|| DEFAULT_NAME.to_owned());
    }
}

//! The check of tets of second order: the proof that their Jacobian determinants are positive.

use super::report::Extreme;
use super::{Fault, PartReport, Settings};
use crate::Point;
use crate::ground::kernel::jacobian;
use crate::ground::kernel::simplex::volume6;
use crate::ground::mesh::stream::LocalBlock;

/// Proves the ten-node tets of a block, and adds the difference that their curved faces make to the
/// volumes. `points` are those of the block's vertices.
pub(super) fn check_block(
    block: &LocalBlock,
    points: &[[f64; 3]],
    settings: &Settings,
    report: &mut PartReport,
) {
    let tets = &block.tets;
    let mut curved_volume6 = 0.0;
    for (id, (corners, edges)) in (tets.first_id..).zip(tets.tets.iter().zip(&tets.edge_nodes)) {
        let nodes = jacobian::nodes(*corners, *edges, |k| points[k as usize]);
        // Straight tets count as 1, and only the first tet of all can be the least with that.
        let is_straight = jacobian::is_straight(&nodes);
        if is_straight && report.scaled_jacobian.is_some() {
            continue;
        }
        let range = jacobian::range(&nodes);
        let [p, q, r, s] = [0, 1, 2, 3].map(|corner| Point::from(nodes[corner]));
        let place = ((p.coords + q.coords + r.coords + s.coords) / 4.0).into();
        let scaled = if is_straight { 1.0 } else { range.scaled() };
        let this = Extreme { value: scaled, tet: id, place };
        report.scaled_jacobian = Some(report.scaled_jacobian.map_or(this, |least| least.least(this)));
        if !range.is_positive() {
            report.add_fault(Fault::NotProved { tet: id, scaled, place }, settings.described);
        }
        curved_volume6 += range.volume6 - volume6(&p, &q, &r, &s);
    }
    report.add_volume(tets.body, curved_volume6 / 6.0);
}

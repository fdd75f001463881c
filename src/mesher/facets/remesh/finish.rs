//! Conversion to a surface mesh, numbered by corners, then curves, then patches.

use super::sheet::{Kind, NONE, Sheet};
use crate::ground::mesh::{BoundaryTriangle, Class, Segment, VertexId};
use crate::mesher::surface::SurfaceMesh;
use csg::CurveId;

/// The surface mesh of all triangles in use.
pub(super) fn finish(sheet: &Sheet) -> SurfaceMesh {
    let on_curves = on_curves(sheet);
    let mut order: Vec<u32> = sheet.model.corners.clone();
    order.extend(on_curves.iter().flatten());
    let in_patches = (0..sheet.points.len() as u32).filter(|&v| {
        matches!(sheet.kinds[v as usize], Kind::Patch(_)) && !sheet.around[v as usize].is_empty()
    });
    order.extend(in_patches);
    let mut new = vec![NONE; sheet.points.len()];
    order.iter().enumerate().for_each(|(i, &v)| new[v as usize] = i as u32);
    let id = |v: u32| VertexId(new[v as usize]);

    let class = |v: &u32| match sheet.kinds[*v as usize] {
        Kind::Corner(corner) => Class::Corner(corner),
        Kind::Curve(curve, _) => Class::Curve(curve),
        Kind::Patch(patch) => Class::Patch(patch),
    };
    let mut triangles: Vec<BoundaryTriangle> = sheet
        .living()
        .map(|t| BoundaryTriangle { vertices: sheet.at(t).v.map(id), patch: sheet.at(t).patch })
        .collect();
    triangles.sort_by_key(|t| t.patch);
    let mut segments = Vec::new();
    for (c, inner) in on_curves.iter().enumerate() {
        let mut chain = inner.clone();
        match sheet.polylines[c].ends {
            Some([start, end]) => {
                chain.insert(0, sheet.model.corners[start.index()]);
                chain.push(sheet.model.corners[end.index()]);
            }
            None => chain.push(chain[0]),
        }
        let curve = CurveId::new(c);
        segments.extend(chain.windows(2).map(|w| Segment { vertices: [id(w[0]), id(w[1])], curve }));
    }
    SurfaceMesh {
        points: order.iter().map(|&v| sheet.points[v as usize]).collect(),
        classes: order.iter().map(class).collect(),
        segments,
        triangles,
    }
}

/// The interior vertices of each curve, in its order.
fn on_curves(sheet: &Sheet) -> Vec<Vec<u32>> {
    let mut found: Vec<Vec<(f64, u32)>> = vec![Vec::new(); sheet.polylines.len()];
    for v in 0..sheet.points.len() as u32 {
        if let Kind::Curve(curve, place) = sheet.kinds[v as usize]
            && !sheet.around[v as usize].is_empty()
        {
            found[curve.index()].push((place, v));
        }
    }
    let sorted = |mut on: Vec<(f64, u32)>| {
        on.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        on.into_iter().map(|(_, v)| v).collect()
    };
    found.into_iter().map(sorted).collect()
}

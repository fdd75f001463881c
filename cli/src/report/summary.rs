//! The summary of a run as text.

use super::{Report, counted, grouped, tets, vertices};
use std::fmt;
use tetmill::memory::sized;
use tetmill::run::{
    CoarseReport, DeliveredSizes, Entities, Evened, FlatPlace, PeriodicCheck, Refused, SharpPlace,
    StraightEdge,
};

/// Writes the line about thin regions.
fn write_thin_regions(f: &mut fmt::Formatter<'_>, coarse: &CoarseReport) -> fmt::Result {
    let walls = &coarse.thin_regions;
    let (Some(thinnest), Some([x, y, z])) = (walls.thinnest, walls.thinnest_at) else { return Ok(()) };
    write!(f, "           walls as thin as {thinnest:.3e}, at ({x:.4e}, {y:.4e}, {z:.4e}): ")?;
    match walls.limited {
        0 => write!(f, "sizes lowered there")?,
        limited if limited < walls.places => {
            write!(f, "sizes lowered there, except where this takes far more tets (--closeness forces it)")?;
        }
        _ => write!(f, "too thin, sizes not lowered (--closeness forces it, at the cost of many tets)")?,
    }
    if let Some(place) = &walls.flattest {
        let (FlatPlace { point: [x, y, z], thickness, size }, angle) = (place, place.prism_angle());
        write!(
            f,
            "\n           one layer of tets of size {size:.3e} in a wall of {thickness:.3e} has angles below \
             {angle:.1}°: at ({x:.4e}, {y:.4e}, {z:.4e})"
        )?;
    }
    writeln!(f)
}

/// Writes the line about places where the input is sharp.
fn write_sharp_places(f: &mut fmt::Formatter<'_>, coarse: &CoarseReport) -> fmt::Result {
    let places = &coarse.sharp_places;
    let Some(SharpPlace { point: [x, y, z], angle, .. }) = places.sharpest.first() else { return Ok(()) };
    let count = counted(places.count, "place", "places");
    writeln!(f, "           the surface is sharper than 10° at {count}, {angle:.2}° at ({x}, {y}, {z})")
}

/// How the volume of a mesh differs from that of the geometry, if that is worth knowing.
fn other_volume(of_mesh: f64, of_geometry: f64) -> Option<String> {
    /// Smaller differences come from the chords of curved faces at usual sizes, and from the
    /// triangles that stand for the geometry.
    const WORTH_TELLING: f64 = 0.02;
    let share = of_mesh / of_geometry - 1.0;
    let which = if share < 0.0 { "less" } else { "more" };
    let percent = 100.0 * share.abs();
    (share.abs() > WORTH_TELLING).then(|| {
        format!("about {percent:.0} % {which} volume than the geometry: smaller sizes follow it better")
    })
}

/// The subdivision of coarse edges as text.
fn cut_into(pieces: u32) -> String {
    if pieces == 1 {
        "not refined".into()
    } else if pieces.is_power_of_two() {
        counted(pieces.ilog2().into(), "level", "levels")
    } else {
        format!("{pieces} pieces an edge")
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.geometry_and_coarse_mesh(f)?;
        self.mesh_and_check(f)?;
        self.periodic_faces(f)?;
        self.parts(f)?;
        if let Some(halo) = &self.halo {
            write!(f, "{halo}")?;
        }
        self.time_and_files(f)?;
        write!(f, "checksum   {}", self.mesh.checksum)
    }
}

impl Report {
    /// The lines `geometry` and `coarse`.
    fn geometry_and_coarse_mesh(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Entities { bodies, corners, curves, patches } = self.entities;
        writeln!(
            f,
            "geometry   {}: {}, {}, {}, {}",
            self.geometry,
            counted(bodies as u64, "body", "bodies"),
            counted(patches as u64, "patch", "patches"),
            counted(curves as u64, "curve", "curves"),
            counted(corners as u64, "corner", "corners")
        )?;
        let coarse = &self.coarse;
        write!(f, "coarse     {}, {}", tets(coarse.tets), vertices(coarse.vertices))?;
        writeln!(
            f,
            ", worst mean ratio {:.3}, mean {:.3}",
            coarse.quality.worst_mean_ratio, coarse.quality.average_mean_ratio
        )?;
        if coarse.illegal_repaired + coarse.illegal_left > 0 {
            writeln!(
                f,
                "           {} that refinement would flatten repaired, {} left",
                tets(coarse.illegal_repaired),
                coarse.illegal_left
            )?;
        }
        if coarse.curved_edges > 0 {
            let edges = counted(coarse.curved_edges, "edge", "edges");
            writeln!(f, "           {edges} curved for better refined tets")?;
        }
        write_thin_regions(f, coarse)?;
        write_sharp_places(f, coarse)
    }

    /// The lines `mesh`, `quality`, `by level` and `checked`.
    fn mesh_and_check(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mesh = &self.mesh;
        writeln!(
            f,
            "mesh       {}, {}, {}, {}",
            tets(mesh.tets),
            vertices(mesh.vertices),
            counted(mesh.boundary, "boundary triangle", "boundary triangles"),
            cut_into(self.pieces)
        )?;
        writeln!(
            f,
            "quality    mean ratio {:.3} at worst, {:.3} in the mean; dihedral angles {:.1}° to {:.1}°, 1st percentile {:.1}°",
            mesh.worst_mean_ratio,
            mesh.mean_mean_ratio,
            mesh.smallest_dihedral,
            mesh.largest_dihedral,
            mesh.first_percentile_dihedral
        )?;
        if self.quality_by_level.len() > 1 {
            let worst: Vec<String> = self
                .quality_by_level
                .iter()
                .map(|l| format!("{:.1}° {:.1}°", l.smallest_dihedral, l.first_percentile_dihedral))
                .collect();
            writeln!(f, "by level   smallest dihedral angle and 1st percentile: {}", worst.join(", "))?;
        }
        if let Some(scaled) = mesh.scaled_jacobian {
            let levels = self.quality_by_level.iter().map(|level| match level.scaled_jacobian {
                Some(scaled) => format!("{scaled:.2}"),
                None => "not valid".into(),
            });
            let levels: Vec<String> = levels.collect();
            let by_level =
                if levels.len() > 1 { format!("; by level {}", levels.join(", ")) } else { String::new() };
            writeln!(f, "order 2    scaled Jacobian {scaled:.3} at worst{by_level}")?;
        }
        if let Some(StraightEdge { place: [x, y, z], .. }) = mesh.straight_edges.first() {
            let count = counted(mesh.straight_edges.len() as u64, "edge is", "edges are");
            let furthest = mesh.straight_edges.iter().map(|edge| edge.distance).fold(0.0, f64::max);
            writeln!(
                f,
                "           {count} straight and up to {furthest:.1e} off the surface; the first at ({x:.4e}, {y:.4e}, {z:.4e})"
            )?;
        }
        let proved = if self.order > 1 { " and proved valid" } else { "" };
        write!(f, "checked    every tet positive{proved}; volume {}", mesh.volume)?;
        if let Some(distance) = mesh.furthest_off_surface {
            match distance {
                0.0 => write!(f, "; boundary vertices exactly on their patches, which are flat")?,
                _ => write!(f, "; boundary vertices within {distance:.1e} of their patch")?,
            }
        }
        writeln!(f)?;
        let difference = self.coarse.facets_volume.and_then(|volume| other_volume(mesh.volume, volume));
        difference.map_or(Ok(()), |difference| writeln!(f, "           {difference}"))
    }

    /// The line `periodic`, if there are such faces.
    fn periodic_faces(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(PeriodicCheck { pairs, furthest, .. }) = self.periodic {
            let parts = match self.partition.split_periodic {
                _ if self.ranks == 1 => String::new(),
                0 => "; each face in one part with its partner".into(),
                lost => format!(
                    "; {} NOT in one part with those at the partner faces: no `Periodic BC` of Elmer",
                    counted(lost, "coarse tet", "coarse tets")
                ),
            };
            writeln!(
                f,
                "periodic   {}, within {furthest:.1e} of their motions{parts}",
                counted(pairs, "pair of vertices", "pairs of vertices")
            )?;
        }
        Ok(())
    }

    /// The lines about parts, and about what was done where they meet.
    fn parts(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.ranks > 1 {
            let p = &self.partition;
            writeln!(
                f,
                "partition  {} by {}, imbalance {:.3}, {} cut, {} shared",
                counted(p.parts.into(), "part", "parts"),
                p.method,
                p.imbalance,
                counted(p.edge_cut, "coarse face", "coarse faces"),
                vertices(p.shared_vertices)
            )?;
        }
        if let Some(DeliveredSizes { mean, low, high }) = self.delivered {
            writeln!(
                f,
                "sizes      edges {mean:.2} of the size field in the mean, 90 % of them between {low:.2} and {high:.2}"
            )?;
        }
        if let Some(across) = &self.across {
            writeln!(
                f,
                "interfaces {} beside them improved in {}, {} sent to other parts for it; smallest angle {:.1}°, was {:.1}°; {} below {}°, were {}",
                tets(across.tets),
                counted(across.rounds.into(), "round", "rounds"),
                grouped(across.moved),
                across.smallest_after,
                across.smallest_before,
                tets(across.bad_after),
                across.angle,
                grouped(across.bad_before)
            )?;
        }
        if let Some(Evened { imbalance, moved }) = self.evened {
            let moved = tets(moved);
            writeln!(f, "evened     {moved} went to other parts; the imbalance was {imbalance:.3}")?;
        }
        if let Some(Refused { skins, first: Some((rank, reason)), .. }) = &self.skins {
            writeln!(
                f,
                "skins      {skins} refused by the mesher and filled by the lattice; that of rank {rank}: {reason}"
            )?;
        }
        if let Some(Refused { kept: kept @ 1.., .. }) = &self.skins {
            let parts = counted(*kept, "part", "parts");
            writeln!(
                f,
                "skins      the boundary of {parts} is that of the refined coarse mesh: it could not be remeshed"
            )?;
        }
        Ok(())
    }

    /// The lines `seconds`, of the processes, and `written`.
    fn time_and_files(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let stages: Vec<String> =
            self.stages.iter().map(|s| format!("{} {:.2}", s.name, s.seconds)).collect();
        writeln!(f, "seconds    {} in all: {}", format_args!("{:.2}", self.seconds), stages.join(", "))?;
        write!(f, "{}", self.processes)?;
        if self.files > 0 {
            writeln!(f, "written    {}, {}", counted(self.files, "file", "files"), sized(self.bytes))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_volume_far_from_that_of_the_geometry_is_told() {
        let said = other_volume(1.72, 2.0).unwrap();
        assert!(said.starts_with("about 14 % less volume than the geometry"), "{said}");
        assert!(other_volume(2.1, 2.0).unwrap().starts_with("about 5 % more volume"));
        assert_eq!(other_volume(1.98, 2.0), None);
    }
}

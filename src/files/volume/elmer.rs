//! Reads an Elmer mesh, serial or partitioned, with the reader of `check`.

use super::assemble::assemble;
use super::raw::{Label, PeriodicPairs, Raw, Shape};
use super::{VolumeMesh, gmsh::Ids};
use crate::files::elmer::{ElmerMesh, PairsOfNodes, names_of, pairs_of, read as read_elmer};
use crate::files::input::{Fault, ReadError, coordinate};
use crate::files::node_order::VTK;
use std::collections::BTreeSet;
use std::path::Path;

/// Reads the mesh of a folder with its periodic pairs; names come from `mesh.names` there or in the
/// parent of a partition.
pub(super) fn read(folder: &Path) -> Result<VolumeMesh, ReadError> {
    let mesh = read_elmer(folder)?;
    check_coordinates(&mesh)?;
    let at = mesh.layout.folder().to_path_buf();
    let mut raw = joined(&mesh, pairs_of(&at)?).map_err(|fault| fault.in_file(&at, b""))?;
    [raw.body_names, raw.patch_names] = names_of(&at);
    assemble(raw).map_err(|fault| fault.in_file(&at, b""))
}

/// Refuses coordinates of which no mesh can be made; each node has a line.
fn check_coordinates(mesh: &ElmerMesh) -> Result<(), ReadError> {
    for part in &mesh.parts {
        for (node, line) in part.nodes.iter().zip(1..) {
            let checked = node.point.iter().try_for_each(|&x| coordinate(x).map(drop));
            checked.map_err(|message| ReadError::line(part.file("nodes"), line, message))?;
        }
    }
    Ok(())
}

/// Joins all parts; nodes and elements are sorted by id.
fn joined(mesh: &ElmerMesh, pairs: PairsOfNodes) -> Result<Raw, Fault> {
    let mut nodes: Vec<_> = mesh.parts.iter().flat_map(|part| &part.nodes).collect();
    nodes.sort_by_key(|node| node.id);
    nodes.dedup_by_key(|node| node.id);
    let ids: Vec<u64> = nodes.iter().map(|node| node.id.into()).collect();
    let ids = Ids::new(&ids)?;
    let mut raw = Raw {
        points: nodes.iter().map(|node| node.point).collect(),
        edge_order: Some(&VTK),
        ..Raw::default()
    };
    let place = |id: u32, what: &str, of: u32| {
        ids.place(id.into())
            .ok_or_else(|| Fault::file(format!("{what} {of} names node {id}, which is not there")))
    };
    for (identification, pairs) in pairs {
        let places = |[image, of]: [u32; 2]| {
            let node = |id: u32| place(id, "a pair of identification", identification);
            Ok([node(image)?, node(of)?])
        };
        let pairs = pairs.into_iter().map(places).collect::<Result<_, Fault>>()?;
        raw.periodic.push(PeriodicPairs { identification: identification.into(), pairs });
    }
    let mut elements: Vec<_> = mesh.parts.iter().flat_map(|part| &part.elements).collect();
    elements.sort_by_key(|element| element.id);
    for element in elements {
        let places = element.all_nodes().map(|node| place(node, "element", element.id));
        let places = places.collect::<Result<Vec<u32>, Fault>>()?;
        raw.add(Shape::Tet, &places, Label::number(element.body.into())).map_err(Fault::file)?;
        raw.tet_numbers.push(element.id.into());
    }
    let mut triangles: Vec<_> = mesh.parts.iter().flat_map(|part| &part.boundary).collect();
    triangles.sort_by_key(|triangle| triangle.id);
    let mut seen = BTreeSet::new();
    for triangle in triangles {
        // A triangle between two parts may be in both.
        let mut key = triangle.nodes;
        key.sort_unstable();
        if !seen.insert(key) {
            continue;
        }
        let places = triangle.all_nodes().map(|node| place(node, "boundary element", triangle.id));
        let places = places.collect::<Result<Vec<u32>, Fault>>()?;
        raw.add(Shape::Triangle, &places, Label::number(triangle.boundary.into())).map_err(Fault::file)?;
    }
    Ok(raw)
}

//! NETGEN's `.vol`: keywords, counts and lists, in any order. Tets are stored negatively.

use super::raw::{Label, PeriodicPairs, Raw, Shape};
use crate::files::input::{Fault, Words, counted};
use crate::files::node_order::LEXICOGRAPHIC;
use std::collections::BTreeMap;

pub(super) fn parse(content: &[u8]) -> Result<Raw, Fault> {
    let mut words = Words::with_comments(content);
    words.expect("mesh3d")?;
    let mut raw = Raw { edge_order: Some(&LEXICOGRAPHIC), ..Raw::default() };
    let mut has_points = false;
    let mut types = Vec::new();
    while let Some(word) = words.next() {
        match word {
            b"dimension" => {
                let dimension = words.int("the dimension")?;
                if dimension != 3 {
                    return Err(words.fault(format!("a mesh of dimension {dimension}; 3 is needed")));
                }
            }
            b"surfaceelements" | b"surfaceelementsgi" | b"surfaceelementsuv" => {
                surface_elements(&mut words, &mut raw)?
            }
            b"volumeelements" => volume_elements(&mut words, &mut raw)?,
            b"edgesegmentsgi2" => segments(&mut words, 10, |n| ([n[2], n[3]], n[8]), &mut raw)?,
            b"edgesegmentsgi3" => {
                segments(&mut words, 7, |n| ([n[0], n[1]], n[6].saturating_add(1)), &mut raw)?
            }
            b"points" => {
                let count = words.count("points", 3)?;
                raw.points = Vec::with_capacity(count);
                for _ in 0..count {
                    raw.points.push(words.point("a coordinate")?);
                }
                has_points = true;
            }
            b"materials" => names(&mut words, &mut raw.body_names)?,
            b"bcnames" => names(&mut words, &mut raw.patch_names)?,
            b"identifications" => identifications(&mut words, &mut raw)?,
            b"identificationtypes" => types = identification_types(&mut words)?,
            // Lists whose words could be taken for keywords.
            b"cd2names" | b"cd3names" => names(&mut words, &mut Default::default())?,
            b"endmesh" => break,
            _ => {}
        }
    }
    if !has_points {
        return Err(Fault::file("the file has no `points`: it is cut off, or no mesh of NETGEN"));
    }
    keep_periodic(&types, &mut raw);
    Ok(raw)
}

/// Parses `surface boundary inside outside count vertex…`; the rest of each line is skipped.
fn surface_elements(words: &mut Words, raw: &mut Raw) -> Result<(), Fault> {
    let count = words.count("surface elements", 8)?;
    let mut nodes = Vec::new();
    for _ in 0..count {
        let entity = words.int("the number of a surface")?;
        let number = words.int("the number of a boundary")?;
        words.int("the domain inside")?;
        words.int("the domain outside")?;
        read_nodes(words, &mut nodes)?;
        let shape = match nodes.len() {
            3 | 6 => Shape::Triangle,
            _ => Shape::Other("surface element that is not a triangle"),
        };
        raw.add(shape, &nodes, Label { entity, number }).map_err(|message| words.fault(message))?;
        words.rest_of_line();
    }
    Ok(())
}

/// Parses `domain count vertex…`.
fn volume_elements(words: &mut Words, raw: &mut Raw) -> Result<(), Fault> {
    let count = words.count("volume elements", 6)?;
    let mut nodes = Vec::new();
    for _ in 0..count {
        // NETGEN itself reads domain 0 as 1.
        let domain = words.int("the number of a domain")?.max(1);
        read_nodes(words, &mut nodes)?;
        let shape = match nodes.len() {
            4 | 10 => Shape::Tet,
            _ => Shape::Other("volume element that is not a tetrahedron"),
        };
        raw.add(shape, &nodes, Label::number(domain)).map_err(|message| words.fault(message))?;
        words.rest_of_line();
    }
    Ok(())
}

fn read_nodes(words: &mut Words, nodes: &mut Vec<u32>) -> Result<(), Fault> {
    let count = words.count("vertices of an element", 1)?;
    nodes.clear();
    for _ in 0..count {
        nodes.push(words.vertex_to_come(1)?);
    }
    Ok(())
}

/// Parses segments of `numbers` integers; `pick` selects the two vertices and the edge number.
fn segments(
    words: &mut Words,
    numbers: usize,
    pick: impl Fn(&[i64]) -> ([i64; 2], i64),
    raw: &mut Raw,
) -> Result<(), Fault> {
    let count = words.count("edge segments", numbers)?;
    for _ in 0..count {
        let mut values = Vec::with_capacity(numbers);
        for _ in 0..numbers {
            // Distances along the edge may be among the integers; they are not used.
            values.push(words.float("a number")? as i64);
        }
        words.rest_of_line();
        let (vertices, edge) = pick(&values);
        let index = |number: i64| number.checked_sub(1).and_then(|n| u32::try_from(n).ok());
        let [Some(a), Some(b)] = vertices.map(index) else {
            return Err(words.fault("a segment names a vertex below 1"));
        };
        raw.add(Shape::Edge, &[a, b], Label::number(edge)).map_err(|message| words.fault(message))?;
    }
    Ok(())
}

fn names(words: &mut Words, names: &mut BTreeMap<i64, Vec<String>>) -> Result<(), Fault> {
    let count = words.count("names", 1)?;
    for _ in 0..count {
        let number = words.int("the number of a name")?;
        let name = String::from_utf8_lossy(words.rest_of_line()).into_owned();
        // NETGEN's name for unnamed boundaries.
        if name != "default" {
            names.insert(number, vec![name]);
        }
    }
    Ok(())
}

/// Parses `master copy identification`.
fn identifications(words: &mut Words, raw: &mut Raw) -> Result<(), Fault> {
    let count = words.count("pairs of vertices", 3)?;
    let mut by_number: BTreeMap<i64, Vec<[u32; 2]>> = BTreeMap::new();
    for _ in 0..count {
        let [of, image] = [words.vertex_to_come(1)?, words.vertex_to_come(1)?];
        by_number.entry(words.int("the number of an identification")?).or_default().push([image, of]);
    }
    let pairs = by_number.into_iter().map(|(identification, pairs)| PeriodicPairs { identification, pairs });
    raw.periodic.extend(pairs);
    Ok(())
}

/// Parses the types of identifications 1, 2, ….
fn identification_types(words: &mut Words) -> Result<Vec<i64>, Fault> {
    let count = words.count("types of identifications", 1)?;
    (0..count).map(|_| words.int("the type of an identification")).collect()
}

/// Drops identifications of other types, such as close surfaces and edges.
fn keep_periodic(types: &[i64], raw: &mut Raw) {
    const PERIODIC: i64 = 2;
    let type_of =
        |number: i64| number.checked_sub(1).and_then(|place| types.get(usize::try_from(place).ok()?));
    let before = raw.periodic.len();
    raw.periodic.retain(|pairs| type_of(pairs.identification) == Some(&PERIODIC));
    if raw.periodic.len() < before {
        let left_out = counted(before - raw.periodic.len(), "identification");
        raw.notes.push(format!("{left_out} that are not periodic left out"));
    }
}

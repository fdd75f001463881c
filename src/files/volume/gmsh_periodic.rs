//! The section `$Periodic` of Gmsh's MSH: pairs of nodes. The motion in the file is not used; it is
//! fitted to the pairs.
//!
//! ```text
//! 2.x   count   then each: dimension entity master / [Affine 16 numbers] / pairs / node master…
//! 4.1   count   then each: dimension entity master / 0 or 16, numbers / pairs / node master…
//! ```
//! The pairs of a surface include those of its curves and points.

use super::gmsh::{Ids, NO_NODES, id};
use super::gmsh4::Source;
use super::raw::{PeriodicPairs, Raw};
use crate::files::input::{Fault, Words};

pub(super) fn version_2(words: &mut Words, ids: &Option<Ids>, raw: &mut Raw) -> Result<(), Fault> {
    let ids = ids.as_ref().ok_or_else(|| words.fault(NO_NODES))?;
    for _ in 0..words.count("periodic entities", 4)? {
        let dimension = words.int("a dimension")?;
        words.int("the tag of an entity")?;
        words.int("the tag of an entity")?;
        if words.peek() == Some(b"Affine") {
            // On a line of its own.
            words.next();
            words.rest_of_line();
        }
        let count = words.count("pairs of nodes", 2)?;
        let pairs = (0..count).map(|_| Ok([id(words)?, id(words)?])).collect::<Result<Vec<_>, Fault>>()?;
        add(dimension, &pairs, ids, raw);
    }
    Ok(())
}

pub(super) fn version_4(source: &mut Source, ids: &Option<Ids>, raw: &mut Raw) -> Result<(), Fault> {
    let ids = ids.as_ref().ok_or_else(|| source.fault(NO_NODES))?;
    for _ in 0..source.size("the number of periodic entities")? {
        let dimension = source.int("a dimension")?;
        source.int("the tag of an entity")?;
        source.int("the tag of an entity")?;
        for _ in 0..source.count("numbers of a matrix", 1, 8)? {
            source.float("a number of a matrix")?;
        }
        let count = source.count("pairs of nodes", 2, 16)?;
        let mut pairs = Vec::with_capacity(count);
        for _ in 0..count {
            pairs.push([source.size("the id of a node")?, source.size("the id of a node")?]);
        }
        add(dimension, &pairs, ids, raw);
    }
    Ok(())
}

/// Keeps the pairs of surfaces. Nodes that are missing in the file belong to entities that were not
/// saved.
fn add(dimension: i64, pairs: &[[u64; 2]], ids: &Ids, raw: &mut Raw) {
    if dimension == 2 {
        let places = pairs.iter().filter_map(|&[image, of]| Some([ids.place(image)?, ids.place(of)?]));
        raw.periodic.push(PeriodicPairs { identification: 0, pairs: places.collect() });
    }
}

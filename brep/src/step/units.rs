//! Units of length and angle, and the accuracy of a part's data.

use super::record::Node;
use crate::BrepError;

/// The unit of lengths in a file or of the result.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Unit {
    /// That of the file: of its first part, if parts have several.
    #[default]
    OfFile,
    /// A unit of this many metres.
    Metres(f64),
}

impl std::str::FromStr for Unit {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let known = |(own, metres): &(&str, f64)| (*own == name).then_some(Self::Metres(*metres));
        let names = || NAMED.map(|(name, _)| name).join(", ");
        match name {
            "file" => Ok(Self::OfFile),
            _ => NAMED
                .iter()
                .find_map(known)
                .ok_or_else(|| format!("`{name}` is no unit of length; there are file, {}", names())),
        }
    }
}

/// Units by their names, in metres.
const NAMED: [(&str, f64); 7] =
    [("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6), ("km", 1e3), ("in", 0.0254), ("ft", 0.3048)];

/// The units of a representation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Units {
    /// Metres.
    pub length: f64,
    /// Radians.
    pub angle: f64,
    /// How accurate coordinates are, in units of length; 0 if the file does not say.
    pub accuracy: f64,
}

/// Units may be defined by others this often.
const DEEPEST: usize = 8;

impl Units {
    /// Those of a context; millimetres and radians, if it has none.
    pub fn of(context: Node) -> Result<Self, BrepError> {
        let mut units = Self { length: 1e-3, angle: 1.0, accuracy: 0.0 };
        if let Some(all) = context.get("GLOBAL_UNIT_ASSIGNED_CONTEXT") {
            for unit in all.refers_all(0)? {
                if unit.is("LENGTH_UNIT") {
                    units.length = factor(unit, DEEPEST)?;
                } else if unit.is("PLANE_ANGLE_UNIT") {
                    units.angle = factor(unit, DEEPEST)?;
                }
            }
        }
        if let Some(all) = context.get("GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT") {
            for measure in all.refers_all(0)? {
                if let Some(fields) = measure.get("UNCERTAINTY_MEASURE_WITH_UNIT")
                    && fields.refers(1)?.is("LENGTH_UNIT")
                {
                    let own = factor(fields.refers(1)?, DEEPEST)?;
                    units.accuracy = fields.number(0)?.max(0.0) * own / units.length;
                }
            }
        }
        Ok(units)
    }
}

/// A unit in metres or radians.
fn factor(unit: Node, depth: usize) -> Result<f64, BrepError> {
    if let Some(si) = unit.get("SI_UNIT") {
        // The first attribute of a record of one part is that of NAMED_UNIT.
        let at = usize::from(unit.kind() == "SI_UNIT");
        return match si.name_of(at) {
            None => Ok(1.0),
            Some(prefix) => {
                let power = |(name, power): &(&str, i32)| (*name == prefix).then_some(10f64.powi(*power));
                PREFIXES
                    .iter()
                    .find_map(power)
                    .ok_or_else(|| unit.error(format!("{prefix} is no prefix of a unit")))
            }
        };
    }
    let converted = unit.get("CONVERSION_BASED_UNIT").filter(|_| depth > 0);
    let Some(converted) = converted else { return Err(unit.error("the unit has no size")) };
    let at = usize::from(unit.kind() == "CONVERSION_BASED_UNIT");
    let measure = converted.refers(at + 1)?;
    const MEASURES: [&str; 3] =
        ["LENGTH_MEASURE_WITH_UNIT", "PLANE_ANGLE_MEASURE_WITH_UNIT", "MEASURE_WITH_UNIT"];
    let fields = measure.any(&MEASURES).ok_or_else(|| measure.error("a measure with a unit is expected"))?;
    Ok(fields.length(0)? * factor(fields.refers(1)?, depth - 1)?)
}

/// The prefixes of the International System of Units with their powers of ten.
const PREFIXES: [(&str, i32); 16] = [
    ("EXA", 18),
    ("PETA", 15),
    ("TERA", 12),
    ("GIGA", 9),
    ("MEGA", 6),
    ("KILO", 3),
    ("HECTO", 2),
    ("DECA", 1),
    ("DECI", -1),
    ("CENTI", -2),
    ("MILLI", -3),
    ("MICRO", -6),
    ("NANO", -9),
    ("PICO", -12),
    ("FEMTO", -15),
    ("ATTO", -18),
];

//! NETGEN's named fineness levels, with its parameters except for curvature at the two coarsest.

/// How far sizes are lowered in thin regions of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closeness {
    /// The largest size there, in units of the thickness; infinity for no limit.
    pub ratio: f64,
    /// The size is lowered at most by this factor, so that a sheet of paper is not meshed at the
    /// size of its thickness by default.
    pub most: f64,
}

impl Closeness {
    /// Thin regions do not affect the sizes.
    pub const OFF: Self = Self { ratio: f64::INFINITY, most: 1.0 };

    /// Sizes of `ratio` thicknesses, lowered by a factor of 200 at most; 0 for no limit. A negative
    /// ratio is kept, and refused when meshing.
    pub fn of_ratio(ratio: f64) -> Self {
        if ratio == 0.0 { Self::OFF } else { Self { ratio, most: 200.0 } }
    }
}

/// The size in thin regions of the two coarsest presets, in units of the thickness.
///
/// One layer of prisms of height 1 over regular triangles of side k, each split into three tets,
/// has a smallest dihedral angle of atan(2/(√3·k)): 15° for k = 4.3. Edges are up to √2 longer than
/// the size, which leaves k = 3; and the triangulations on both sides are independent and curved.
/// The heat exchanger of `benches/results/coarser-2026-11-23.md` has a smallest angle of 14.2° for
/// 2.5 and 16.1° for 2.2.
const COARSEST_RATIO: f64 = 2.2;

/// A named fineness level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// Curvature radius / 1.75, grading 0.7.
    VeryCoarse,
    /// Curvature radius / 1.75, grading 0.5.
    Coarse,
    /// Curvature radius / 2, grading 0.3.
    #[default]
    Moderate,
    /// Curvature radius / 3, grading 0.2.
    Fine,
    /// Curvature radius / 5, grading 0.1.
    VeryFine,
}

impl Preset {
    /// All presets, from coarse to fine, with their names.
    pub const ALL: [(Self, &str); 5] = [
        (Self::VeryCoarse, "very-coarse"),
        (Self::Coarse, "coarse"),
        (Self::Moderate, "moderate"),
        (Self::Fine, "fine"),
        (Self::VeryFine, "very-fine"),
    ];

    /// Elements per radius of curvature: the size there is `1 / (safety · curvature)`.
    ///
    /// Below 1.75 a ball loses more than 15 % of its volume: NETGEN takes 1 and 1.5 for the first
    /// two presets, and loses 38 % and 16 %.
    pub fn curvature_safety(self) -> f64 {
        match self {
            Self::VeryCoarse | Self::Coarse => 1.75,
            Self::Moderate => 2.0,
            Self::Fine => 3.0,
            Self::VeryFine => 5.0,
        }
    }

    /// The minimum number of segments of a curve.
    pub fn segments_per_curve(self) -> f64 {
        match self {
            Self::VeryCoarse => 0.3,
            Self::Coarse => 0.5,
            Self::Moderate => 1.0,
            Self::Fine => 2.0,
            Self::VeryFine => 3.0,
        }
    }

    /// How far sizes are lowered in thin regions.
    pub fn closeness(self) -> Closeness {
        match self {
            Self::VeryCoarse | Self::Coarse => Closeness { ratio: COARSEST_RATIO, most: 8.0 },
            Self::Moderate => Closeness { ratio: 2.0, most: 8.0 },
            Self::Fine => Closeness { ratio: 1.5, most: 16.0 },
            Self::VeryFine => Closeness { ratio: 1.0, most: 32.0 },
        }
    }

    /// Growth of the size per unit of distance.
    pub fn grading(self) -> f64 {
        match self {
            Self::VeryCoarse => 0.7,
            Self::Coarse => 0.5,
            Self::Moderate => 0.3,
            Self::Fine => 0.2,
            Self::VeryFine => 0.1,
        }
    }
}

impl std::str::FromStr for Preset {
    type Err = String;

    /// Parses a name; hyphens and underscores are equivalent.
    fn from_str(name: &str) -> Result<Self, String> {
        let name = name.replace('_', "-");
        Self::ALL
            .iter()
            .find(|(_, n)| *n == name)
            .map(|(preset, _)| *preset)
            .ok_or_else(|| format!("no preset `{name}`; there are {}", Self::ALL.map(|(_, n)| n).join(", ")))
    }
}

impl std::fmt::Display for Preset {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = Self::ALL.iter().find(|(preset, _)| preset == self).map_or("", |(_, name)| name);
        f.write_str(name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_preset_is_found_by_either_spelling() {
        assert_eq!("very_fine".parse(), Ok(Preset::VeryFine));
        assert_eq!("very-fine".parse(), Ok(Preset::VeryFine));
        assert_eq!(Preset::VeryCoarse.to_string(), "very-coarse");
        assert!("finest".parse::<Preset>().unwrap_err().contains("very-coarse"));
    }
}

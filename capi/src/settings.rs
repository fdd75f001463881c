//! The values of options, by the names of the command line.

use crate::callbacks::{self, IsCancelled, OnProgress, Refusal, Size};
use crate::fault::Fault;
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Arc;
use tetmill::files::mesh_size;
use tetmill::mesh::Order;
use tetmill::run::{Candidates, CutPlane, CutSettings, MAX_PIECES, PlanSettings};
use tetmill::size::{Effort, Preset, SizeFunction, Source};
use tetmill::{Error, Geometry, InputSettings, Mesher, Method, OverlapTo, Unit};

/// All options.
#[derive(Clone, Debug, Default)]
pub struct Settings {
    // Sizes of the coarse mesh.
    preset: Option<Preset>,
    maxh: Option<f64>,
    minh: Option<f64>,
    grading: Option<f64>,
    closeness: Option<f64>,
    mesh_size_file: Option<PathBuf>,
    effort: Option<Effort>,
    coarse: Option<u64>,
    pub sources: Vec<Source>,
    pub size: Option<Size>,
    pub background: Option<SizeFunction>,
    // How the fine mesh is made.
    method: Option<Kind>,
    elements: Option<u64>,
    levels: Option<u32>,
    pieces: Option<u32>,
    nested: Option<bool>,
    refine: Option<u32>,
    order: Option<Order>,
    allow_off_surface: Option<bool>,
    memory: Option<u64>,
    planes: Option<Candidates>,
    pub cut_planes: Vec<CutPlane>,
    // How surfaces are read.
    keep_surface: Option<bool>,
    keep_small: Option<bool>,
    merge: Option<f64>,
    feature_angle: Option<f64>,
    unit: Option<Unit>,
    solids: Vec<String>,
    overlap_to: Option<OverlapTo>,
    // The observer.
    pub progress: Option<OnProgress>,
    pub cancel: Option<IsCancelled>,
}

/// The names of `tetmill_options_set`.
const NAMES: [&str; 25] = [
    "preset",
    "maxh",
    "minh",
    "grading",
    "closeness",
    "mesh-size-file",
    "effort",
    "coarse",
    "method",
    "elements",
    "levels",
    "pieces",
    "nested",
    "refine",
    "order",
    "allow-off-surface",
    "memory",
    "planes",
    "keep-surface",
    "keep-small",
    "merge",
    "feature-angle",
    "unit",
    "solid",
    "overlap-to",
];

#[derive(Clone, Copy, Debug)]
enum Kind {
    Refine,
    Surface,
    Decompose,
}

impl FromStr for Kind {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            "refine" => Ok(Self::Refine),
            "surface" => Ok(Self::Surface),
            "decompose" => Ok(Self::Decompose),
            _ => Err("expected refine, surface or decompose".into()),
        }
    }
}

fn candidates(name: &str) -> Result<Candidates, String> {
    match name {
        "best" => Ok(Candidates::All),
        "axes" => Ok(Candidates::Axes),
        "principal" => Ok(Candidates::Principal),
        "random" => Ok(Candidates::Random),
        "median" => Ok(Candidates::Median),
        _ => Err("expected best, axes, principal, random or median".into()),
    }
}

fn number(text: &str, is_possible: impl Fn(f64) -> bool, expected: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|&number: &f64| number.is_finite() && is_possible(number));
    number.ok_or_else(|| format!("expected {expected}"))
}

fn positive(text: &str) -> Result<f64, String> {
    number(text, |number| number > 0.0, "a positive number")
}

fn not_negative(text: &str) -> Result<f64, String> {
    number(text, |number| number >= 0.0, "a number that is not negative")
}

fn angle(text: &str) -> Result<f64, String> {
    number(text, |number| number > 0.0 && number <= 180.0, "an angle above 0 and up to 180 degrees")
}

/// A count, also written as 1e9 or 2.5e6.
fn count(text: &str) -> Result<u64, String> {
    let expected = "a count such as 50000 or 1e9";
    match text.trim().parse::<u64>() {
        Ok(0) => Err(format!("expected {expected}")),
        Ok(count) => Ok(count),
        // Counts above 2^53 are not exact in a double, and out of reach.
        Err(_) => {
            number(text, |count| (1.0..9e15).contains(&count), expected).map(|count| count.round() as u64)
        }
    }
}

fn integer(text: &str, least: u32, most: u32) -> Result<u32, String> {
    let number = text.trim().parse().ok().filter(|number| (least..=most).contains(number));
    number.ok_or_else(|| format!("expected {least} to {most}"))
}

fn order(text: &str) -> Result<Order, String> {
    text.trim().parse().ok().and_then(Order::of_degree).ok_or_else(|| "expected 1 or 2".into())
}

fn flag(text: &str) -> Result<bool, String> {
    match text {
        "true" | "1" => Ok(true),
        "false" | "0" => Ok(false),
        _ => Err("expected true or false".into()),
    }
}

impl Settings {
    /// Sets an option from its text, or to its default.
    pub fn set(&mut self, name: &str, value: Option<&str>) -> Result<(), Fault> {
        self.set_inner(&name.replace('_', "-"), value).map_err(|reason| match value {
            Some(value) => Fault::usage(format!("option {name} cannot be `{value}`: {reason}")),
            None => Fault::usage(format!("option {name}: {reason}")),
        })
    }

    fn set_inner(&mut self, name: &str, value: Option<&str>) -> Result<(), String> {
        fn of<T>(
            value: Option<&str>,
            parse: impl Fn(&str) -> Result<T, String>,
        ) -> Result<Option<T>, String> {
            value.map(parse).transpose()
        }
        match name {
            "preset" => self.preset = of(value, Preset::from_str)?,
            "maxh" => self.maxh = of(value, positive)?,
            "minh" => self.minh = of(value, positive)?,
            "grading" => self.grading = of(value, positive)?,
            "closeness" => self.closeness = of(value, not_negative)?,
            "mesh-size-file" => self.mesh_size_file = value.map(PathBuf::from),
            "effort" => self.effort = of(value, Effort::from_str)?,
            "coarse" => self.coarse = of(value, count)?,
            "method" => self.method = of(value, Kind::from_str)?,
            "elements" => self.elements = of(value, count)?,
            "levels" => self.levels = of(value, |text| integer(text, 0, MAX_PIECES.ilog2()))?,
            "pieces" => self.pieces = of(value, |text| integer(text, 1, MAX_PIECES))?,
            "nested" => self.nested = of(value, flag)?,
            "refine" => self.refine = of(value, |text| integer(text, 0, MAX_PIECES.ilog2()))?,
            "order" => self.order = of(value, order)?,
            "allow-off-surface" => self.allow_off_surface = of(value, flag)?,
            "memory" => self.memory = of(value, count)?,
            "planes" => self.planes = of(value, candidates)?,
            "keep-surface" => self.keep_surface = of(value, flag)?,
            "keep-small" => self.keep_small = of(value, flag)?,
            "merge" => self.merge = of(value, positive)?,
            "feature-angle" => self.feature_angle = of(value, angle)?,
            "unit" => self.unit = of(value, Unit::from_str)?,
            "solid" => match value {
                Some(solid) => self.solids.push(solid.to_owned()),
                None => self.solids.clear(),
            },
            "overlap-to" => self.overlap_to = of(value, OverlapTo::from_str)?,
            "parts" | "ranks" => return Err("the number of parts is an argument of tetmill_generate".into()),
            "threads" => return Err("use tetmill_set_threads".into()),
            _ => return Err(format!("there is no such option; there are {}", NAMES.join(", "))),
        }
        Ok(())
    }

    /// How surfaces are read.
    pub fn input(&self) -> InputSettings {
        let mut settings = InputSettings {
            keep_surface: self.keep_surface.unwrap_or(false),
            keep_small: self.keep_small.unwrap_or(false),
            merge: self.merge,
            unit: self.unit.unwrap_or_default(),
            solids: self.solids.clone(),
            overlap_to: self.overlap_to,
            ..InputSettings::default()
        };
        if let Some(degrees) = self.feature_angle {
            settings.facets.feature_angle = degrees.to_radians();
        }
        settings
    }

    /// The mesher with these settings. Only the rank with the geometry reads the mesh-size file.
    pub fn mesher(
        &self,
        geometry: Option<&Geometry>,
        refusal: &Arc<Refusal>,
    ) -> Result<Mesher<'static>, Fault> {
        self.refuse_conflicts(geometry)?;
        let mut mesher = self.sized(Mesher::new(), refusal);
        if let (Some(file), Some(geometry)) = (&self.mesh_size_file, geometry) {
            let least = geometry.least_size().unwrap_or(0.0);
            mesher = mesher.sources(mesh_size::read_from(file, least).map_err(Error::from)?);
        }
        mesher = match self.method {
            None | Some(Kind::Refine) => mesher,
            Some(Kind::Surface) => mesher.method(Method::Surface),
            Some(Kind::Decompose) => mesher.method(Method::Decompose(self.cuts())),
        };
        if let Some(bytes) = self.memory {
            mesher = mesher.memory(bytes);
        }
        if self.nested == Some(true) {
            mesher = mesher.nested();
        }
        mesher = mesher.refine(self.refine.unwrap_or(0)).order(self.order.unwrap_or_default());
        Ok(if self.allow_off_surface == Some(true) { mesher.allow_off_surface() } else { mesher })
    }

    fn sized(&self, mut mesher: Mesher<'static>, refusal: &Arc<Refusal>) -> Mesher<'static> {
        /// Passes a value on if it was set.
        fn with<T>(
            mesher: Mesher<'static>,
            value: Option<T>,
            set: impl Fn(Mesher<'static>, T) -> Mesher<'static>,
        ) -> Mesher<'static> {
            match value {
                Some(value) => set(mesher, value),
                None => mesher,
            }
        }
        // The preset comes first, because it sets what the others change.
        mesher = with(mesher, self.preset, Mesher::preset);
        mesher = with(mesher, self.maxh, Mesher::max_size);
        mesher = with(mesher, self.minh, Mesher::min_size);
        mesher = with(mesher, self.grading, Mesher::grading);
        mesher = with(mesher, self.closeness, Mesher::closeness);
        mesher = with(mesher, self.effort, Mesher::effort);
        mesher = with(mesher, self.coarse, Mesher::coarse_tets);
        mesher = with(mesher, self.levels, Mesher::levels);
        mesher = with(mesher, self.pieces, Mesher::pieces);
        mesher = with(mesher, self.elements, Mesher::tets);
        mesher = with(mesher, self.size, |mesher, size| {
            mesher.size(callbacks::size_function(size, Arc::clone(refusal)))
        });
        mesher = with(mesher, self.background.clone(), Mesher::size_function);
        mesher.sources(self.sources.iter().copied())
    }

    fn cuts(&self) -> CutSettings {
        let plan = PlanSettings { candidates: self.planes.unwrap_or_default(), ..PlanSettings::default() };
        CutSettings { plan, planes: self.cut_planes.clone() }
    }

    /// Refuses what the command line refuses.
    fn refuse_conflicts(&self, geometry: Option<&Geometry>) -> Result<(), Fault> {
        let numbers = [
            ("coarse", self.coarse.is_some()),
            ("levels", self.levels.is_some()),
            ("pieces", self.pieces.is_some()),
        ];
        if self.elements.is_some()
            && let Some((name, _)) = numbers.iter().find(|(_, is_set)| *is_set)
        {
            return Err(Fault::input(format!("options elements and {name} exclude each other")));
        }
        if self.levels.is_some() && self.pieces.is_some() {
            return Err(Fault::input("options levels and pieces exclude each other"));
        }
        let lengths = [self.maxh, self.minh, self.grading, self.closeness];
        let is_sized = lengths.iter().any(Option::is_some)
            || self.preset.is_some()
            || self.effort.is_some()
            || self.coarse.is_some()
            || self.mesh_size_file.is_some()
            || self.size.is_some()
            || self.background.is_some()
            || !self.sources.is_empty();
        if is_sized && geometry.is_some_and(Geometry::is_mesh) {
            return Err(Fault::input(
                "the geometry is a mesh already and is taken as it is: leave out the sizes (preset, maxh, minh, \
                 grading, closeness, mesh-size-file, size function, background mesh, sources), effort and coarse",
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_can_be_set_and_unset() {
        let values = [
            "very-fine",
            "0.5",
            "0.1",
            "0.3",
            "0",
            "sizes.msz",
            "quick",
            "1e4",
            "surface",
            "2.5e6",
            "3",
            "12",
            "true",
            "1",
            "2",
            "true",
            "8e9",
            "axes",
            "1",
            "true",
            "1e-6",
            "30",
            "mm",
            "bolt",
            "smaller",
        ];
        assert_eq!(NAMES.len(), values.len());
        let mut settings = Settings::default();
        for (name, value) in NAMES.iter().zip(values) {
            settings.set(name, Some(value)).unwrap();
        }
        assert_eq!(
            (settings.coarse, settings.elements, settings.levels),
            (Some(10_000), Some(2_500_000), Some(3))
        );
        NAMES.iter().for_each(|name| settings.set(name, None).unwrap());
        assert_eq!(format!("{settings:?}"), format!("{:?}", Settings::default()));
    }

    #[test]
    fn a_wrong_value_is_refused_with_the_option_and_what_is_possible() {
        let refusal = |name, value| Settings::default().set(name, Some(value)).unwrap_err().to_string();
        assert_eq!(refusal("maxh", "nan"), "option maxh cannot be `nan`: expected a positive number");
        assert_eq!(refusal("levels", "11"), "option levels cannot be `11`: expected 0 to 10");
        assert_eq!(refusal("order", "3"), "option order cannot be `3`: expected 1 or 2");
        assert!(refusal("max-size", "1").contains("there are preset, maxh"));
        assert!(refusal("parts", "4").contains("an argument of tetmill_generate"));
    }

    #[test]
    fn options_that_exclude_each_other_are_refused() {
        let mut settings = Settings::default();
        settings.set("elements", Some("1e6")).unwrap();
        settings.set("levels", Some("2")).unwrap();
        let refused = settings.mesher(None, &Arc::default()).err().map(|fault| fault.to_string());
        assert_eq!(refused.as_deref(), Some("options elements and levels exclude each other"));
    }
}

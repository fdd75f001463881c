//! Flags by name and type.

use super::super::ast::{Flag, FlagValue};
use super::super::diagnostic::Report;
use crate::geometry::Span;
use crate::language::suggest::did_you_mean;
use std::collections::BTreeSet;

/// The flags of a statement. The last of repeated flags applies.
pub(super) struct Flags<'a> {
    flags: &'a [Flag],
}

/// A flag that is accepted without effect, and what to do instead.
pub(super) type Idle = (&'static str, &'static str);

impl<'a> Flags<'a> {
    /// Checks names: `known` flags are read later, `idle` flags have no effect here, all others are
    /// unknown. An unknown flag without a value that is the name of one of `solids` is an error:
    /// the author means a difference, as in `block - hole`.
    pub fn new(
        flags: &'a [Flag],
        known: &[&str],
        idle: &[Idle],
        solids: &BTreeSet<&str>,
        report: &mut Report,
    ) -> Self {
        for flag in flags {
            let name = flag.name.as_str();
            if known.contains(&name) {
                continue;
            }
            if let Some((_, help)) = idle.iter().find(|(idle, _)| *idle == name) {
                report.warn(flag.span, format!("the flag -{name} has no effect here"), help);
                continue;
            }
            if flag.value == FlagValue::Nothing && solids.contains(name) {
                let message = format!("there is no operator `-`, and `{name}` is a solid, not a flag");
                let help = format!("write `and not {name}` in the definition of the solid");
                report.meaning(flag.span, message, &help);
                continue;
            }
            let mut help = did_you_mean(name, known.iter().copied());
            if help.is_empty() && !known.is_empty() {
                help = format!("known flags are -{}", known.join(", -"));
            }
            report.warn(flag.span, format!("the unknown flag -{name} is ignored"), &help);
        }
        Self { flags }
    }

    fn find(&self, name: &str) -> Option<&'a Flag> {
        self.flags.iter().rfind(|flag| flag.name == name)
    }

    /// The position of a flag.
    pub fn span(&self, name: &str) -> Option<Span> {
        self.find(name).map(|flag| flag.span)
    }

    fn typed<T>(
        &self,
        name: &str,
        example: &str,
        report: &mut Report,
        read: impl Fn(&'a FlagValue) -> Option<T>,
    ) -> Option<T> {
        let flag = self.find(name)?;
        let value = read(&flag.value);
        if value.is_none() {
            report.meaning(
                flag.span,
                format!("the flag -{name} has a wrong value"),
                &format!("write it as {example}"),
            );
        }
        value
    }

    /// `-name=number`
    fn number(&self, name: &str, example: &str, report: &mut Report) -> Option<f64> {
        self.typed(name, example, report, |value| match value {
            FlagValue::Number(number) => Some(*number),
            _ => None,
        })
    }

    /// `-maxh=h`
    pub fn maxh(&self, report: &mut Report) -> Option<f64> {
        let maxh = self.number("maxh", "-maxh=0.1", report)?;
        if maxh <= 0.0 {
            let span = self.span("maxh")?;
            report.meaning(
                span,
                format!("-maxh={maxh} is not a mesh size"),
                "a mesh size is a positive length",
            );
            return None;
        }
        Some(maxh)
    }

    /// `-layer=k`
    pub fn layer(&self, report: &mut Report) -> Option<i32> {
        self.number("layer", "-layer=1", report).map(|layer| layer as i32)
    }

    /// Whether `-factor=k` is given with k ≠ 0.
    pub fn has_factor(&self, report: &mut Report) -> bool {
        self.number("factor", "-factor=1", report).is_some_and(|factor| factor != 0.0)
    }

    /// `-factor=k`
    pub fn factor(&self, report: &mut Report) -> Option<i32> {
        self.number("factor", "-factor=1", report).map(|factor| factor as i32)
    }

    /// `-name=word`
    pub fn word(&self, name: &str, report: &mut Report) -> Option<&'a str> {
        let example = format!("-{name}=air, a word of letters, digits and _");
        self.typed(name, &example, report, |value| match value {
            FlagValue::Word(word) => Some(word.as_str()),
            _ => None,
        })
    }

    /// `-name`
    pub fn is_set(&self, name: &str, report: &mut Report) -> bool {
        let read = |value: &FlagValue| (*value == FlagValue::Nothing).then_some(());
        self.typed(name, &format!("-{name}, without a value"), report, read).is_some()
    }

    /// `-col=[r,g,b]`
    pub fn color(&self, report: &mut Report) -> Option<[f64; 3]> {
        let example = "-col=[1,0,0]: red, green and blue from 0 to 1";
        self.typed("col", example, report, |value| match value {
            FlagValue::Numbers(numbers) => numbers.get(..3)?.try_into().ok(),
            _ => None,
        })
    }

    /// `-bc=k` or `-bc=[k1,k2]`
    pub fn boundary_numbers(&self, report: &mut Report) -> Option<PerSurface<u32>> {
        let number = |value: &f64| (1.0..=f64::from(i32::MAX)).contains(value).then_some(*value as u32);
        self.typed("bc", "-bc=2 or -bc=[1,2,3], numbers from 1", report, |value| match value {
            FlagValue::Number(value) => number(value).map(PerSurface::All),
            FlagValue::Numbers(values) => {
                values.iter().map(number).collect::<Option<_>>().map(PerSurface::Each)
            }
            _ => None,
        })
    }

    /// `-bcname=word` or `-bcname=[w1,w2]`
    pub fn boundary_names(&self, report: &mut Report) -> Option<PerSurface<String>> {
        self.typed("bcname", "-bcname=inlet or -bcname=[inlet,wall]", report, |value| match value {
            FlagValue::Word(word) => Some(PerSurface::All(word.clone())),
            FlagValue::Words(words) => Some(PerSurface::Each(words.clone())),
            _ => None,
        })
    }
}

/// A value for all surfaces of a solid, or one for each.
pub(super) enum PerSurface<T> {
    All(T),
    Each(Vec<T>),
}

impl<T> PerSurface<T> {
    /// The value for the surface at `index` of the list.
    pub fn get(&self, index: usize) -> Option<&T> {
        match self {
            PerSurface::All(value) => Some(value),
            PerSurface::Each(values) => values.get(index),
        }
    }

    /// The value, if it is not a list.
    pub fn single(self) -> Option<T> {
        match self {
            PerSurface::All(value) => Some(value),
            PerSurface::Each(_) => None,
        }
    }

    /// The length of the list, if it is one.
    pub fn len(&self) -> Option<usize> {
        match self {
            PerSurface::All(_) => None,
            PerSurface::Each(values) => Some(values.len()),
        }
    }
}

//! Kinds of errors, by which a program can decide what to do.

use std::fmt;

/// The kind of an error. All ranks of a run return errors of the same kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum ErrorKind {
    /// The input or the request is invalid. Other input or other settings help.
    Input = 1,
    /// No valid mesh could be made.
    NoMesh = 2,
    /// Memory, disk space, or the range of ids is insufficient.
    Resources = 3,
    /// A rank failed, or ranks cannot communicate.
    Rank = 4,
    /// The observer cancelled the run.
    Cancelled = 5,
}

impl ErrorKind {
    const ALL: [Self; 5] = [Self::Input, Self::NoMesh, Self::Resources, Self::Rank, Self::Cancelled];

    /// The kind with this number, as received from other ranks.
    pub(crate) fn of_number(number: u8) -> Self {
        Self::ALL.into_iter().find(|kind| *kind as u8 == number).unwrap_or(Self::Rank)
    }
}

/// An error with a kind.
pub trait HasKind: fmt::Display {
    /// Its kind.
    fn kind(&self) -> ErrorKind;

    /// Whether this rank stopped only because another rank did, whose error says why.
    fn is_elsewhere(&self) -> bool {
        false
    }
}

//! A size field that reports progress.

use super::SizeField;
use crate::Point;
use crate::ground::progress::Work;

/// A size field with the [`Work`] of its run.
///
/// All stages of meshing have the field, so all can report progress and be cancelled.
pub struct WatchedSize<'a> {
    field: &'a dyn SizeField,
    work: &'a Work<'a>,
}

impl<'a> WatchedSize<'a> {
    /// Wraps a field.
    pub fn new(field: &'a dyn SizeField, work: &'a Work<'a>) -> Self {
        Self { field, work }
    }
}

impl SizeField for WatchedSize<'_> {
    fn size_at(&self, point: &Point) -> f64 {
        self.field.size_at(point)
    }

    fn work(&self) -> &Work<'_> {
        self.work
    }
}

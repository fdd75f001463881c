//! A model whose solids do not overlap.

use crate::BrepError;
use crate::model::Model;
use crate::shapes::{Care, Cuts, Shapes};
use crate::tessellate::{Settings, Shell, Tessellation, volume};

/// How finely faces are triangulated to find where they cross.
const SETTINGS: Settings = Settings { chord: 5e-4, angle: 0.15 };

/// Which of two solids that overlap keeps the common part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OverlapTo {
    /// The one that is first in the file.
    First,
    /// The one that is last in the file.
    Last,
    /// The one with the smaller volume; of equal ones the first.
    Smaller,
}

impl std::str::FromStr for OverlapTo {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "first" => Ok(Self::First),
            "last" => Ok(Self::Last),
            "smaller" => Ok(Self::Smaller),
            _ => Err("expected first, last or smaller".into()),
        }
    }
}

impl Model {
    /// Leaves the common part of solids that overlap to one of them and cuts it out of the others,
    /// with a note that names them. The cut face is an interface of both. A solid that repeats
    /// another one is left out, with a note.
    ///
    /// # Errors
    /// - Those of a tessellation,
    /// - [`BrepError::Solid`] if it cannot be decided what is inside of what, and for a solid of
    ///   which nothing is left.
    pub fn cut_overlaps(&mut self, to: OverlapTo) -> Result<(), BrepError> {
        if self.bodies < 2 {
            return Ok(());
        }
        let (tessellation, shells) = Tessellation::of_overlapping(self, &SETTINGS)?;
        let mut order: Vec<usize> = (0..self.bodies).collect();
        match to {
            OverlapTo::First => {}
            OverlapTo::Last => order.reverse(),
            OverlapTo::Smaller => {
                let volumes: Vec<f64> =
                    (0..self.bodies).map(|body| volume(self, &tessellation, body)).collect();
                order.sort_by(|&a, &b| volumes[a].total_cmp(&volumes[b]));
            }
        }
        let mut rank = vec![0; self.bodies];
        order.into_iter().enumerate().for_each(|(place, body)| rank[body] = place);
        let cut = |care: Care| self.cut(care, &tessellation, &shells, &rank);
        let made = match cut(Care::Usual) {
            Ok(Some(made)) => Some(made),
            Ok(None) | Err(_) => cut(Care::High)?,
        };
        let Some((mut model, Cuts { pairs: cut, repeated })) = made else { return Ok(()) };
        for &[body, other] in &repeated {
            let note = format!("{} repeats {}: left out", self.solid(body), self.solid(other));
            model.notes.push(note);
        }
        /// So many pairs are named.
        const NAMED: usize = 5;
        let pairs: Vec<String> = cut
            .iter()
            .take(NAMED)
            .map(|&[kept, cut]| format!("{} out of {}", self.solid(kept), self.solid(cut)))
            .collect();
        let more = if cut.len() > NAMED { format!(" and {} more", cut.len() - NAMED) } else { String::new() };
        if !pairs.is_empty() {
            model.notes.push(format!("solids overlap: cut {}{more}", pairs.join(", ")));
        }
        *self = model;
        Ok(())
    }

    /// The model with the common parts cut out, which is checked, and what was cut; `None` if
    /// nothing was.
    fn cut(
        &self,
        care: Care,
        tessellation: &Tessellation,
        shells: &[Vec<Shell>],
        rank: &[usize],
    ) -> Result<Option<(Self, Cuts)>, BrepError> {
        let mut shapes = Shapes::of(self);
        let cuts = shapes.cut_overlaps(care, tessellation, shells, rank)?;
        if cuts.pairs.is_empty() && cuts.repeated.is_empty() {
            return Ok(None);
        }
        let gone: Vec<usize> = cuts.repeated.iter().map(|pair| pair[0]).collect();
        let model = shapes.remake(self, &gone)?;
        Tessellation::of(&mut model.clone(), &SETTINGS)?;
        Ok(Some((model, cuts)))
    }

    /// A body as messages name it.
    fn solid(&self, body: usize) -> String {
        let number = body + 1;
        match self.body_names.get(body).cloned().flatten() {
            Some(name) => format!("{name} (solid {number})"),
            None => format!("solid {number}"),
        }
    }
}

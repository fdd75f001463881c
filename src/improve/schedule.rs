//! What is tried when: worst first, and only where something changed.

use crate::improve::complex::Complex;
use crate::improve::legality::{Legality, Smoothness};
use crate::improve::objective::{Measure, Objective};
use crate::improve::smooth::Smoother;
use crate::improve::swap::Swapper;
use crate::kernel::quality::QualitySummary;
use crate::mesh::Mesh;
use crate::size::SizeField;
use serde::{Deserialize, Serialize};

/// How much is done, and by what measure.
#[derive(Clone, Debug)]
pub struct Settings {
    /// How shapes are measured.
    pub measure: Measure,
    /// Passes over the bad tets at most.
    pub passes: u32,
    /// Tets with a measure below this are bad: they are tried to be swapped and their vertices to be moved.
    pub target: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { measure: Measure::default(), passes: 8, target: 0.6 }
    }
}

/// What was done.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Report {
    /// The shapes before.
    pub before: QualitySummary,
    /// The shapes after.
    pub after: QualitySummary,
    /// Vertices moved.
    pub moves: usize,
    /// Edges and faces removed by swaps.
    pub swaps: usize,
}

/// Improves.
pub fn improve(mesh: &mut Mesh, size: &dyn SizeField, settings: &Settings) -> Report {
    run(mesh, size, None, settings)
}

/// Refinable.
pub fn make_refinable(
    mesh: &mut Mesh,
    size: &dyn SizeField,
    smoothness: &dyn Smoothness,
    settings: &Settings,
) -> Report {
    let legality = Legality::new(mesh, smoothness);
    run(mesh, size, Some(&legality), settings)
}

fn run(mesh: &mut Mesh, _size: &dyn SizeField, legality: Option<&Legality>, settings: &Settings) -> Report {
    let mut report = Report { before: QualitySummary::of(mesh), ..Report::default() };
    let t0 = std::time::Instant::now();
    let mut complex = Complex::new(mesh);
    let objective = Objective { measure: settings.measure, legality };
    for t in 0..complex.tets.len() {
        complex.scores[t] = objective.score(&complex.points, complex.tets[t]);
    }
    eprintln!("build {:?}", t0.elapsed());
    let mut swapper = Swapper::default();
    let mut smoother = Smoother::default();
    for pass in 1..=settings.passes {
        complex.pass = pass;
        for v in 0..complex.points.len() as u32 {
            if pass == 1 || complex.touched[v as usize] + 1 >= pass {
                report.moves += usize::from(smoother.improve(&mut complex, &objective, v, settings.target));
            }
        }
        eprintln!("smooth {:?}", t0.elapsed());
        let mut bad: Vec<(f64, u32)> = complex
            .living()
            .filter(|&t| complex.scores[t as usize] < settings.target)
            .filter(|&t| complex.tets[t as usize].iter().any(|&v| complex.touched[v as usize] + 1 >= pass))
            .map(|t| (complex.scores[t as usize], t))
            .collect();
        bad.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let n = bad.len();
        for (score, t) in bad {
            if complex.is_alive(t) && complex.scores[t as usize] == score {
                report.swaps += usize::from(swapper.improve(&mut complex, &objective, t));
            }
        }
        eprintln!("swap {:?} {} bad; {} moves, {} swaps", t0.elapsed(), n, report.moves, report.swaps);
    }
    complex.store(mesh);
    report.after = QualitySummary::of(mesh);
    report
}

//! `tetmill decompose`, and the options for planes.

use super::{coarse_settings, read_sized_geometry, reading, wanted_coarse, write_whole};
use crate::failure::Failure;
use crate::options::{Decompose, PlaneOptions, Planes};
use crate::report::counted;
use crate::terminal::Terminal;
use std::path::Path;
use tetmill::error::{Error, ReadError};
use tetmill::progress::{Progress, Stage};
use tetmill::run::{Candidates, CutPlane, CutSettings, PlanSettings as Settings, planned};
use tetmill::{Point, Vector};

/// `tetmill decompose`
pub fn run_decompose(options: &Decompose) -> Result<(), Failure> {
    let outputs = reading(&options.input, &options.size)
        .and_reading(options.planes.planes_from.as_ref())
        .file("-o", Some(&options.output));
    outputs.prepare()?;
    let terminal = Terminal::new(options.quiet);
    let progress = Progress::new(&terminal);
    let geometry =
        progress.stage(Stage::Read, |_| read_sized_geometry(&options.input, &options.size, &progress))?;
    let cuts = cut_settings(&options.planes)?;
    let coarse = coarse_settings(&options.size, Some(&geometry))?;
    let wanted = wanted_coarse(&options.size, options.pieces);
    let planned = planned(options.parts, &geometry, &cuts, &coarse, wanted, &progress)?;
    let source = read_text(&options.input.files[0])?;
    let text = planned.geo_text(&geometry, &source).map_err(Error::from)?;
    write_whole(&options.output, &text)?;
    terminal.finish();
    if !options.quiet {
        let file = options.output.display();
        let parts = counted(options.parts.into(), "part", "parts");
        let planes = counted(planned.planes().len() as u64, "plane", "planes");
        let bodies = counted(planned.bodies() as u64, "body", "bodies");
        outputs.show(format_args!("{file}: {parts} by {planes}, {bodies}\n"))?;
    }
    Ok(())
}

/// Settings for cutting a geometry.
pub(super) fn cut_settings(options: &PlaneOptions) -> Result<CutSettings, Failure> {
    let candidates = match options.planes {
        Planes::Best => Candidates::All,
        Planes::Axes => Candidates::Axes,
        Planes::Principal => Candidates::Principal,
        Planes::Random => Candidates::Random,
        Planes::Median => Candidates::Median,
    };
    let planes = options.planes_from.as_deref().map(read_planes).transpose()?.unwrap_or_default();
    Ok(CutSettings { plan: Settings { candidates, ..Settings::default() }, planes })
}

fn read_text(path: &Path) -> Result<String, Failure> {
    let bytes = std::fs::read(path).map_err(ReadError::io(path))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Reads planes, one a line: a point and a normal, six numbers separated by blanks or commas. `#`
/// starts a comment.
fn read_planes(path: &Path) -> Result<Vec<CutPlane>, Failure> {
    let mut planes = Vec::new();
    for (number, line) in (1..).zip(read_text(path)?.lines()) {
        let code = line.split('#').next().unwrap_or_default();
        let words: Vec<&str> = code
            .split(|c: char| c == ',' || c == ';' || c.is_whitespace())
            .filter(|w| !w.is_empty())
            .collect();
        if words.is_empty() {
            continue;
        }
        let wrong = |what: &str| {
            Failure::input(format!(
                "{}:{number}: {what}; a plane is a point and a normal: X Y Z NX NY NZ",
                path.display()
            ))
        };
        let numbers: Result<Vec<f64>, _> = words.iter().map(|word| word.parse()).collect();
        let &[x, y, z, nx, ny, nz] = &numbers.unwrap_or_default()[..] else {
            return Err(wrong("these are not six numbers"));
        };
        let normal = Vector::new(nx, ny, nz).try_normalize(0.0).filter(|n| n.iter().all(|x| x.is_finite()));
        let point = Point::new(x, y, z);
        match normal.filter(|_| point.iter().all(|x| x.is_finite())) {
            Some(normal) => planes.push(CutPlane { point, normal }),
            None => return Err(wrong("the normal has no direction, or a number is not finite")),
        }
    }
    if planes.is_empty() {
        return Err(Failure::input(format!("{}: there is no plane", path.display())));
    }
    Ok(planes)
}

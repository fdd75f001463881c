//! `tetmill decompose`, and how planes are chosen.

use super::{STAGES, coarse_settings, read_sized_model, reading, wanted_coarse, write_whole};
use crate::cli::{Decompose, PlaneOptions, Planes};
use std::path::Path;
use tetmill::decompose::{Candidates, CutPlane, Settings, geo_text};
use tetmill::error::Failure;
use tetmill::pipeline::decompose::{CutSettings, planned};
use tetmill::pipeline::{Model, input};
use tetmill::progress::Progress;
use tetmill::{Point, Vector};

/// `tetmill decompose`
pub fn run_decompose(options: &Decompose) -> Result<(), Failure> {
    let outputs = reading(&options.input, &options.size)
        .and_reading(options.planes.planes_from.as_ref())
        .file("-o", Some(&options.output));
    outputs.prepare()?;
    let progress = Progress::new(options.quiet, STAGES);
    let model = progress.stage("read", || read_sized_model(&options.input, &options.size, &progress))?;
    let cuts = cut_settings(&options.planes)?;
    let coarse = coarse_settings(&options.size, true)?;
    let wanted = wanted_coarse(&options.size, options.pieces);
    let planned = planned(options.parts, &model, &cuts, &coarse, wanted, &progress)?;
    let Model::Csg(whole) = &model else { unreachable!("only geometries are cut") };
    if !whole.geometry.boundary_overrides.is_empty() || !whole.geometry.singularities.is_empty() {
        return Err(Failure::input(
            "`boundarycondition` and `singular` name bodies, of which only pieces would be left: take them out of the file, or \
             `generate -m decompose`, which keeps them",
        ));
    }
    let source = read_text(&options.input.files[0])?;
    let text = geo_text(&source, &whole.geometry, &planned.cuts, &planned.model.pieces);
    write_whole(&options.output, &text)?;
    progress.finish();
    if !options.quiet {
        let (planes, pieces) = (planned.cuts.planes.len(), planned.model.pieces.len());
        let (file, parts) = (options.output.display(), options.parts);
        outputs.show(format_args!("{file}: {parts} parts by {planes} planes, {pieces} bodies\n"))?;
    }
    Ok(())
}

/// How a geometry is cut, as the options say.
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
    Ok(String::from_utf8_lossy(&input::read_bytes(path)?).into_owned())
}

/// Planes, a line each: three coordinates of a point and three of a normal, with blanks or commas between. `#` begins a comment.
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

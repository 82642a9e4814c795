//! `build` and `demo`: make a whole kit.

use std::path::{Path, PathBuf};

use serde_json::json;
use shellock::Severity;
use shellock::design::Params;
use shellock_job::build::{Begun, Made, check_options};
use shellock_job::input::{self, Model};
use shellock_job::options::Pieces;
use shellock_job::output::Destination;
use shellock_job::place::Standing;
use shellock_job::shape::shape_warnings;
use shellock_job::stopwatch::StageTime;
use shellock_job::told::wall_kinds;
use shellock_job::work;
use shellock_job::{Failure, Options};

use super::USUAL_EFFORT_S;
use crate::args::{JobOptions, Out};
use crate::print::{Finished, print_failures, print_input_warnings, print_warnings};
use crate::progress::{Display, Shown};
use crate::{Session, config};

/// Runs `shellock build` and returns the exit code.
pub fn build(session: &Session, file: &Path, options: &Options, out: Out) -> Result<u8, Failure> {
    let params = check_options(options)?;
    let stem = file
        .file_stem()
        .map_or_else(|| "model".into(), |s| s.to_string_lossy().into_owned());
    let to = Destination::new(
        out.out.unwrap_or_else(|| PathBuf::from(format!("{stem}-kit"))),
        out.force,
    )?;
    let model = input::simple_model(&session.job, file, options)?;
    make(session, &model, options, &params, &to)
}

/// Runs `shellock demo` and returns the exit code. Unless a limit is given, the work is limited instead of
/// the time, so that a slow machine makes the same kit.
pub fn demo(session: &Session, figure: &str, given: &JobOptions, out: Out) -> Result<u8, Failure> {
    /// Default number of pieces of the squirrel: fewer than usual, which lock sooner.
    const OF_SQUIRREL: usize = 7;
    let mut options = given.options.clone();
    if !config::is_limited(given) {
        options.effort = Some(USUAL_EFFORT_S);
    }
    let options = &options;
    let mut params = check_options(options)?;
    if figure == "squirrel" && options.pieces == Pieces::Auto {
        params.n_pieces = Some(OF_SQUIRREL);
    }
    let to = Destination::new(
        out.out.unwrap_or_else(|| PathBuf::from("shellock-demo")),
        out.force,
    )?;
    let model = input::figure(figure, options)?;
    make(session, &model, options, &params, &to)
}

fn make(
    session: &Session,
    model: &Model,
    options: &Options,
    params: &Params,
    to: &Destination,
) -> Result<u8, Failure> {
    let begun = Begun::new(&session.job, model, options, params)?;
    let n_told = begun.notes().len();
    let is_for_people = session.progress_form == Shown::ForPeople;
    if is_for_people {
        let s = model.solid.mesh().bounds().size();
        println!("{}: {:.1} × {:.1} × {:.1} mm", model.name, s.x, s.y, s.z);
        begun.notes().iter().for_each(|n| println!("note: {n}"));
    }
    print_input_warnings(session, model);
    if is_for_people {
        shape_warnings(model, options)
            .iter()
            .for_each(|w| println!("warning: {w}"));
    }
    let display = Display::of_kit(session.progress_form);
    let made = begun.make(&session.job, &|p| display.show(p));
    display.finish();
    let made = made?;
    if is_for_people {
        made.notes[n_told..].iter().for_each(|n| println!("note: {n}"));
    }
    to.write(&made.files)?;
    let code = u8::from(!made.has_passed());
    let standing = Standing::of(options.up, model.solid.mesh());
    // The model's own warnings were printed with the first lines.
    let mut warnings = made.warnings.clone();
    warnings.retain(|w| !model.warnings.contains(w));
    if session.is_json {
        let stages = display.stages();
        print_json(to, &made, &stages, code);
    } else if session.progress_form == Shown::Nothing {
        warnings.retain(|w| w.severity() > Severity::Note);
        print_warnings(session, &warnings, &standing);
        print_failures(&made.design.kit.verification, &standing);
    } else {
        let finished = Finished {
            to,
            design: &made.design,
            settings: &made.design.settings,
            summary: &made.summary,
            warnings: &warnings,
            upright: &standing,
            printing: &made.printing,
        };
        finished.print(session);
    }
    Ok(code)
}

fn print_json(to: &Destination, made: &Made, stages: &[StageTime], code: u8) {
    let (kit, strength) = (&made.design.kit, made.design.strength.as_ref());
    let summary = &made.summary;
    let value = json!({
        "status": if code == 0 { "verified" } else { "failed" },
        "out": to.folder(), "notes": made.notes,
        "pieces": kit.pieces.len(), "key_piece": kit.plan.key(),
        "volume_ratio": summary.volume_ratio, "grams": summary.grams,
        "walls": wall_kinds(&made.design, summary.grams),
        "print": made.printing.entry().time, "fits_within_mm": made.design.fit.within_mm,
        "connector_share": summary.connector_share,
        "thin_share": summary.thin_share, "thickness_mm": kit.thickness_mm,
        "stress_mpa": strength.map(|s| s.stress_mpa),
        "is_too_weak": strength.map(|s| s.is_too_weak), "connector_size": kit.sizes.largest_mm(),
        "key_slides_on_rails_mm": kit.rails_mm(),
        "bears": kit.holding.summary(),
        "checks": kit.verification.checks, "findings": kit.verification.findings,
        "effort": made.design.effort, "stages": stages, "work": work::counts(),
        "warnings": made.warnings, "exit_code": code,
    });
    println!("{value}");
}

//! `build` and `demo`: the whole job.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use serde_json::json;
use shellock::context::Progress;
use shellock::design::{Design, DesignOutcome, Params, Settings, design};
use shellock::{Ctx, Severity, Warning};

use crate::Session;
use crate::args::{Options, Out, Pieces};
use crate::bed::{fitted, too_large};
use crate::failure::Failure;
use crate::input::{self, Model};
use crate::inspect::thin_warnings;
use crate::output::{Destination, Summary, files};
use crate::place::Standing;
use crate::printing::Printing;
use crate::progress::{Deadline, Display, PlanClock, Shown};
use crate::stopwatch::StageTime;
use crate::told::{Finished, print_failures, print_warnings};

/// `shellock build`.
pub fn build(session: &Session, file: &Path, options: &Options, out: Out) -> Result<u8, Failure> {
    let params = checked(options)?;
    let stem = file
        .file_stem()
        .map_or_else(|| "model".into(), |s| s.to_string_lossy().into_owned());
    let to = Destination::new(
        out.out.unwrap_or_else(|| PathBuf::from(format!("{stem}-kit"))),
        out.force,
    )?;
    let model = input::simple_model(session, file, options)?;
    make(session, &model, options, &params, &to)
}

/// `shellock demo`.
pub fn demo(session: &Session, figure: &str, options: &Options, out: Out) -> Result<u8, Failure> {
    /// Pieces of the squirrel where none are asked for: fewer than usual, which lock sooner.
    const OF_SQUIRREL: usize = 7;
    let mut params = checked(options)?;
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

/// The parameters, or all that is wrong with them.
pub fn checked(options: &Options) -> Result<Params, Failure> {
    let printer = options.chosen_printer().map_err(Failure::Wrong)?;
    let params = options.params(&printer);
    let mut problems = params.problems();
    problems.extend(printer.problems().iter().map(ToString::to_string));
    // An infinite time is one: until the proof is closed.
    if options.time.is_nan() || options.time < 0.0 {
        problems.push(format!("time is {} s; it must be 0 or more", options.time));
    }
    if options.plan_time.is_nan() || options.plan_time < 0.0 {
        problems.push(format!(
            "plan time is {} s; it must be 0 or more",
            options.plan_time
        ));
    }
    if !(0.0..=0.1).contains(&options.resolution) {
        problems.push(format!(
            "resolution is {} mm; it must be from 0 to 0.1",
            options.resolution
        ));
    }
    if problems.is_empty() {
        Ok(params)
    } else {
        Err(Failure::Wrong(problems.join("\nerror: ")))
    }
}

fn make(
    session: &Session,
    model: &Model,
    options: &Options,
    params: &Params,
    to: &Destination,
) -> Result<u8, Failure> {
    let printer = options.chosen_printer().map_err(Failure::Wrong)?;
    let params = &fitted(session, params, options, model)?;
    let settings = &Settings::resolve(params);
    let mut notes = model.notes.clone();
    notes.extend(too_large(session, settings, &printer, model)?);
    if session.shown == Shown::ForPeople {
        let s = model.solid.mesh().bounds().size();
        println!("{}: {:.1} × {:.1} × {:.1} mm", model.name, s.x, s.y, s.z);
        notes.iter().for_each(|n| println!("note: {n}"));
        thin_warnings(model, options)
            .iter()
            .for_each(|w| println!("warning: {w}"));
    }
    let display = Display::of_kit(session.shown);
    let clock = PlanClock::new(options.plan_time);
    let report = |p: Progress<'_>| {
        clock.see(&p);
        display.show(p);
    };
    let is_time_up = || clock.is_up();
    let deadline = Deadline::new(options.time, session.since);
    let seconds_left = || deadline.seconds_left();
    let ctx = Ctx::new(&report, &session.stop)
        .with_time_limit(&is_time_up)
        .with_deadline(&seconds_left);
    let outcome =
        design(&ctx, params, &model.solid, model.labels.as_deref()).inspect_err(|_| display.finish())?;
    let made = match outcome {
        DesignOutcome::Made(made) => made,
        DesignOutcome::NoPlan { reason, blockers } => {
            display.finish();
            return Err(no_plan(&reason, &blockers));
        }
    };
    if let Some(asked) = params.n_pieces.filter(|asked| made.kit.pieces.len() > asked + 1) {
        let note = format!(
            "{} pieces instead of {asked}: some were divided until every piece locks",
            made.kit.pieces.len()
        );
        if session.shown == Shown::ForPeople {
            println!("note: {note}");
        }
        notes.push(note);
    }
    let mut warnings = made.warnings.clone();
    display.show(Progress::Stage {
        name: "files and pictures",
        n_steps: 0,
    });
    let printing = Printing::of(
        &printer,
        made.kit.pieces.as_slice(),
        &made.kit.surface.mesh,
        &model.solid,
    );
    warnings.extend(printing.warnings());
    let (files, summary) = files(model, options, settings, &made, &warnings, &printing);
    display.finish();
    if session.stop.load(Ordering::Relaxed) {
        return Err(Failure::Stopped);
    }
    to.write(&files)?;
    let code = u8::from(!made.kit.verification.passed());
    let standing = Standing::of(options.up, model.solid.mesh());
    if session.is_json {
        let course = Course {
            notes: &notes,
            stages: &display.stages(),
        };
        print_json(to, &course, &made, &summary, &warnings, &printing, code);
    } else if session.shown == Shown::Nothing {
        warnings.retain(|w| w.severity() > Severity::Note);
        print_warnings(session, &warnings, &standing);
        print_failures(&made.kit.verification, &standing);
    } else {
        let finished = Finished {
            to,
            made: &made,
            settings,
            summary: &summary,
            warnings: &warnings,
            standing: &standing,
            printing: &printing,
        };
        finished.print(session);
    }
    Ok(code)
}

fn no_plan(reason: &str, blockers: &[shellock::plan::Blocker]) -> Failure {
    let mut text = format!("no plan was found: {reason}");
    for b in blockers {
        let [x, y, z] = b.at;
        let share = 100.0 * b.occluded;
        text += &format!(
            "\n  piece {} is in the way of piece {} at ({x:.1}, {y:.1}, {z:.1}) mm: it hides {share:.0} % of it",
            b.by, b.piece
        );
    }
    Failure::NoPlan(text)
}

/// How a job went.
struct Course<'a> {
    notes: &'a [String],
    stages: &'a [StageTime],
}

fn print_json(
    to: &Destination,
    course: &Course<'_>,
    made: &Design,
    summary: &Summary,
    warnings: &[Warning],
    printing: &Printing,
    code: u8,
) {
    let value = json!({
        "status": if code == 0 { "verified" } else { "failed" },
        "out": to.folder(), "notes": course.notes,
        "pieces": made.kit.pieces.len(), "key_piece": made.kit.plan.key(),
        "volume_ratio": summary.volume_ratio, "grams": summary.grams, "print": printing.entry().time, "fits_within_mm": made.fit.within_mm, "connector_share": summary.connector_share,
        "thin_share": summary.thin_share, "thickness_mm": made.kit.thickness_mm,
        "stress_mpa": made.strength.as_ref().map(|s| s.stress_mpa),
        "is_too_weak": made.strength.as_ref().map(|s| s.is_too_weak), "connector_size": made.kit.sizes.largest_mm(),
        "key_slides_on_rails_mm": made.kit.rails_mm(),
        "bears": made.kit.holding.summary(),
        "checks": made.kit.verification.checks, "findings": made.kit.verification.findings,
        "effort": made.effort, "stages": course.stages,
        "warnings": warnings, "exit_code": code,
    });
    println!("{value}");
}

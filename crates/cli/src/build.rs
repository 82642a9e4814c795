//! `build` and `demo`: make a whole kit.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use serde_json::json;
use shellock::context::Progress;
use shellock::design::{Design, DesignOutcome, Params, Settings, design};
use shellock::{Ctx, Severity, Warning};
use shellock_print::Printer;

use crate::Session;
use crate::args::{Options, Out, Pieces};
use crate::bed::{fitted, too_large};
use crate::failure::Failure;
use crate::fonts;
use crate::input::{self, Model};
use crate::output::{Destination, Summary, files};
use crate::place::Standing;
use crate::printing::Printing;
use crate::progress::{Deadline, Display, PlanClock, Shown};
use crate::shape::shape_warnings;
use crate::stopwatch::StageTime;
use crate::told::{Finished, print_failures, print_input_warnings, print_warnings};

/// Runs `shellock build` and returns the exit code.
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

/// Runs `shellock demo` and returns the exit code.
pub fn demo(session: &Session, figure: &str, options: &Options, out: Out) -> Result<u8, Failure> {
    /// Default number of pieces of the squirrel: fewer than usual, which lock sooner.
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

/// Returns the parameters, or all problems with the options in one error.
pub fn checked(options: &Options) -> Result<Params, Failure> {
    let printer = options.chosen_printer().map_err(Failure::Wrong)?;
    let params = options.params(&printer);
    let mut problems = params.problems();
    problems.extend(printer.problems().iter().map(ToString::to_string));
    for (option, mm) in [("size", options.size), ("height", options.height)] {
        problems.extend(
            mm.and_then(|mm| input::length(option, mm).err())
                .map(|e| e.to_string()),
        );
    }
    // An infinite time is allowed: the search then runs until the proof is closed.
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

/// A kit that is made but not yet written.
pub struct Made {
    pub design: Box<Design>,
    /// Notes on changes to the model and to the choices.
    pub notes: Vec<String>,
    /// Warnings about the kit and its plates.
    pub warnings: Vec<Warning>,
    pub printing: Printing,
    /// All files of the kit, each with its name in the kit's folder.
    pub files: Vec<(String, Vec<u8>)>,
    pub summary: Summary,
}

impl Made {
    /// Returns true if every check passes.
    pub fn passed(&self) -> bool {
        self.design.kit.verification.passed()
    }
}

/// A job whose choices have been adapted to its model and printer.
pub struct Begun<'a> {
    model: &'a Model,
    options: &'a Options,
    params: Params,
    printer: Printer,
    notes: Vec<String>,
}

impl<'a> Begun<'a> {
    /// Prepares a job for `model`; fails if it cannot be made.
    pub fn new(
        session: &Session,
        model: &'a Model,
        options: &'a Options,
        params: &Params,
    ) -> Result<Self, Failure> {
        let printer = options.chosen_printer().map_err(Failure::Wrong)?;
        let params = fitted(session, params, options, model)?;
        let settings = Settings::resolve(&params);
        let mut notes = model.notes.clone();
        notes.extend(too_large(session, &settings, &printer, model)?);
        Ok(Self {
            model,
            options,
            params,
            printer,
            notes,
        })
    }

    /// Makes the kit and reports progress to `show`.
    pub fn made(self, session: &Session, show: &(dyn Fn(Progress<'_>) + Sync)) -> Result<Made, Failure> {
        let (model, options) = (self.model, self.options);
        let clock = PlanClock::new(options.plan_time);
        let report = |p: Progress<'_>| {
            clock.see(&p);
            show(p);
        };
        let is_time_up = || clock.is_up();
        let deadline = Deadline::new(options.time, session.since);
        let seconds_left = || deadline.seconds_left();
        let ctx = Ctx::new(&report, &session.stop)
            .with_time_limit(&is_time_up)
            .with_deadline(&seconds_left);
        let design = match design(&ctx, &self.params, &model.solid, model.labels.as_deref())? {
            DesignOutcome::Made(made) => made,
            DesignOutcome::NoPlan {
                reason,
                blockers,
                is_cut_short,
            } => {
                let told = no_plan(&reason, &blockers);
                return Err(Failure::NoPlan { told, is_cut_short });
            }
        };
        let mut notes = self.notes;
        if let Some(asked) = self
            .params
            .n_pieces
            .filter(|asked| design.kit.pieces.len() > asked + 1)
        {
            notes.push(format!(
                "{} pieces instead of {asked}: some were divided until every piece locks",
                design.kit.pieces.len()
            ));
        }
        show(Progress::Stage {
            name: "files and pictures",
            n_steps: 0,
        });
        let printing = Printing::of(
            &self.printer,
            design.kit.pieces.as_slice(),
            &design.kit.surface.mesh,
            &model.solid,
        );
        let mut warnings = model.warnings.clone();
        warnings.extend(design.warnings.iter().cloned());
        warnings.extend(printing.warnings());
        warnings.extend(fonts::warning(model, options));
        let (files, summary) = files(model, options, &design.settings, &design, &warnings, &printing);
        if session.stop.load(Ordering::Relaxed) {
            return Err(Failure::Stopped);
        }
        Ok(Made {
            design,
            notes,
            warnings,
            printing,
            files,
            summary,
        })
    }
}

fn make(
    session: &Session,
    model: &Model,
    options: &Options,
    params: &Params,
    to: &Destination,
) -> Result<u8, Failure> {
    let begun = Begun::new(session, model, options, params)?;
    let n_told = begun.notes.len();
    let is_for_people = session.shown == Shown::ForPeople;
    if is_for_people {
        let s = model.solid.mesh().bounds().size();
        println!("{}: {:.1} × {:.1} × {:.1} mm", model.name, s.x, s.y, s.z);
        begun.notes.iter().for_each(|n| println!("note: {n}"));
    }
    print_input_warnings(session, model);
    if is_for_people {
        shape_warnings(model, options)
            .iter()
            .for_each(|w| println!("warning: {w}"));
    }
    let display = Display::of_kit(session.shown);
    let made = begun.made(session, &|p| display.show(p));
    display.finish();
    let made = made?;
    if is_for_people {
        made.notes[n_told..].iter().for_each(|n| println!("note: {n}"));
    }
    to.write(&made.files)?;
    let code = u8::from(!made.passed());
    let standing = Standing::of(options.up, model.solid.mesh());
    // The model's own warnings were printed with the first lines.
    let mut warnings = made.warnings.clone();
    warnings.retain(|w| !model.warnings.contains(w));
    if session.is_json {
        let stages = display.stages();
        print_json(to, &made, &stages, code);
    } else if session.shown == Shown::Nothing {
        warnings.retain(|w| w.severity() > Severity::Note);
        print_warnings(session, &warnings, &standing);
        print_failures(&made.design.kit.verification, &standing);
    } else {
        let finished = Finished {
            to,
            made: &made.design,
            settings: &made.design.settings,
            summary: &made.summary,
            warnings: &warnings,
            standing: &standing,
            printing: &made.printing,
        };
        finished.print(session);
    }
    Ok(code)
}

fn no_plan(reason: &str, blockers: &[shellock::plan::Blocker]) -> String {
    let mut text = format!("no plan was found: {reason}");
    for b in blockers {
        let [x, y, z] = b.at;
        let share = 100.0 * b.occluded;
        text += &format!(
            "\n  piece {} is in the way of piece {} at ({x:.1}, {y:.1}, {z:.1}) mm: it hides {share:.0} % \
             of it",
            b.by, b.piece
        );
    }
    text
}

fn print_json(to: &Destination, made: &Made, stages: &[StageTime], code: u8) {
    let (kit, strength) = (&made.design.kit, made.design.strength.as_ref());
    let summary = &made.summary;
    let value = json!({
        "status": if code == 0 { "verified" } else { "failed" },
        "out": to.folder(), "notes": made.notes,
        "pieces": kit.pieces.len(), "key_piece": kit.plan.key(),
        "volume_ratio": summary.volume_ratio, "grams": summary.grams,
        "print": made.printing.entry().time, "fits_within_mm": made.design.fit.within_mm,
        "connector_share": summary.connector_share,
        "thin_share": summary.thin_share, "thickness_mm": kit.thickness_mm,
        "stress_mpa": strength.map(|s| s.stress_mpa),
        "is_too_weak": strength.map(|s| s.is_too_weak), "connector_size": kit.sizes.largest_mm(),
        "key_slides_on_rails_mm": kit.rails_mm(),
        "bears": kit.holding.summary(),
        "checks": kit.verification.checks, "findings": kit.verification.findings,
        "effort": made.design.effort, "stages": stages,
        "warnings": made.warnings, "exit_code": code,
    });
    println!("{value}");
}

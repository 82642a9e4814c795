//! A whole job: from a model and options to the files of a kit.

use shellock::Progress;
use shellock::design::{self, Design, DesignOutcome, NoPlan, Params, Planned, Settings, design};
use shellock::{Ctx, Warning};
use shellock_print::Printer;

use crate::Session;
use crate::bed::{fit_params, too_large};
use crate::clock::{Deadline, PlanClock};
use crate::failure::Failure;
use crate::fonts;
use crate::input::{self, Model};
use crate::options::Options;
use crate::output::{Summary, files};
use crate::printing::Printing;

/// Returns the parameters, or all problems with the options in one error.
pub fn check_options(options: &Options) -> Result<Params, Failure> {
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
    if options.effort.is_some_and(|s| s.is_nan() || s <= 0.0) {
        problems.push("effort must be above 0 s".to_owned());
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
    /// Design of the finished kit.
    pub design: Box<Design>,
    /// Notes on changes to the model and to the choices.
    pub notes: Vec<String>,
    /// Warnings about the kit and its plates.
    pub warnings: Vec<Warning>,
    /// Plates of the kit.
    pub printing: Printing,
    /// All files of the kit, each with its name in the kit's folder.
    pub files: Vec<(String, Vec<u8>)>,
    /// Figures of the kit.
    pub summary: Summary,
}

impl Made {
    /// Returns true if every check passes.
    pub fn has_passed(&self) -> bool {
        self.design.kit.verification.has_passed()
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
        let params = fit_params(session, params, options, model)?;
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

    /// Notes on changes to the model and to the choices.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Makes the kit and reports progress to `show`.
    pub fn make(self, session: &Session, show: &(dyn Fn(Progress<'_>) + Sync)) -> Result<Made, Failure> {
        let (model, options) = (self.model, self.options);
        let designed = with_limits(session, options, show, |ctx| {
            design(ctx, &self.params, &model.solid, model.labels.as_deref())
        });
        let design = match designed? {
            DesignOutcome::Made(made) => made,
            DesignOutcome::NoPlan(none) => return Err(no_plan(&none)),
        };
        let mut notes = self.notes;
        notes.extend(
            self.params
                .n_pieces
                .and_then(|asked| other_number(asked, &design)),
        );
        show(Progress::Stage {
            name: "files and pictures",
            n_steps: 0,
        });
        let printing = Printing::of(
            &self.printer,
            design.settings.body.thickness_mm,
            design.kit.pieces.as_slice(),
            &design.kit.surface.mesh,
            &model.solid,
        );
        let mut warnings = model.warnings.clone();
        warnings.extend(design.warnings.iter().cloned());
        warnings.extend(printing.warnings());
        warnings.extend(fonts::warning(model, options));
        let (files, summary) = files(model, options, &design.settings, &design, &warnings, &printing);
        if session.is_stopped() {
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

/// Divides and plans a model as a kit would be, without making it, and reports progress to `show`.
pub fn plan_model(
    session: &Session,
    model: &Model,
    options: &Options,
    params: &Params,
    show: &(dyn Fn(Progress<'_>) + Sync),
) -> Result<Planned, Failure> {
    let planned = with_limits(session, options, show, |ctx| {
        design::plan(ctx, params, &model.solid, model.labels.as_deref())
    });
    planned?.map_err(|none| no_plan(&none))
}

/// Runs `work` with the limits that the options set: of work, which needs no clock, or of time.
fn with_limits<T>(
    session: &Session,
    options: &Options,
    show: &(dyn Fn(Progress<'_>) + Sync),
    work: impl FnOnce(&Ctx<'_>) -> T,
) -> T {
    if options.effort.is_some() {
        return work(&Ctx::new(show, &session.stop));
    }
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
    work(&ctx)
}

/// Says why a kit has more or fewer pieces than were asked for; `None` if it has about as many.
fn other_number(asked: usize, design: &Design) -> Option<String> {
    /// Share of the number asked for by which a kit may miss it without a word.
    const ABOUT: f64 = 0.1;
    let made = design.kit.pieces.len();
    if made > asked + 1 {
        return Some(format!(
            "{made} pieces instead of {asked}: some were divided further so that every piece locks"
        ));
    }
    if made as f64 >= (1.0 - ABOUT) * asked as f64 - 1.0 {
        return None;
    }
    let has_joined = |words: &str| design.effort.steps.iter().any(|step| step.contains(words));
    let why = if has_joined("rattle") {
        "pieces were joined that would rattle"
    } else if has_joined("part under") {
        "pieces were joined that would part under a load"
    } else {
        "smaller ones have too short seams for connectors"
    };
    Some(format!(
        "{made} pieces instead of {asked}: {why}; a larger model has room for more (--size)"
    ))
}

/// Reason why there is no kit, in words.
fn no_plan(none: &NoPlan) -> Failure {
    let NoPlan {
        reason,
        blockers,
        is_cut_short,
        ..
    } = none;
    let mut text = match is_cut_short {
        true => format!("{reason}; allow more time (--time)"),
        false => format!("no plan was found: {reason}"),
    };
    for b in blockers {
        let [x, y, z] = b.at;
        let share = 100.0 * b.occluded;
        text += &format!(
            "\n  piece {} blocks piece {} at ({x:.1}, {y:.1}, {z:.1}) mm: it covers {share:.0} % of it",
            b.by, b.piece
        );
    }
    Failure::NoPlan {
        reason: text,
        is_cut_short: *is_cut_short,
    }
}

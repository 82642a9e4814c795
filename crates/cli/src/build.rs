//! `build` and `demo`: the whole job.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use serde_json::json;
use shellock::context::Progress;
use shellock::design::{Design, DesignOutcome, Params, Settings, design};
use shellock::metric::Holding;
use shellock::plan::key::KeyDirections;
use shellock::plan::{PlanProof, ProofScope};
use shellock::strength::{Strength, StrengthParams};
use shellock::verify::Verification;
use shellock::verify::words::PlaceWords;
use shellock::{Ctx, Warning, play};

use crate::Session;
use crate::args::{Options, Out, Pieces};
use crate::bears;
use crate::bed::{fitted, too_large};
use crate::failure::Failure;
use crate::input::{self, Model};
use crate::inspect::thin_warnings;
use crate::output::{Destination, Summary, files};
use crate::place::Standing;
use crate::printing::Printing;
use crate::progress::{Deadline, Display, PlanClock, Shown};
use crate::stopwatch::StageTime;

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
    let display = Display::new(session.shown);
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
        print_failures(&made.kit.verification, &standing);
        print_warnings(&warnings, &standing);
    } else {
        print_text(to, &made, settings, &summary, &warnings, &standing);
        println!("{}", printing.words());
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

fn print_text(
    to: &Destination,
    made: &Design,
    settings: &Settings,
    summary: &Summary,
    warnings: &[Warning],
    standing: &Standing,
) {
    println!(
        "{} pieces, the last is piece {}; walls {:.2} mm; material {:.0} % of the solid model",
        made.kit.pieces.len(),
        made.kit.plan.key(),
        made.kit.thickness_mm,
        100.0 * summary.volume_ratio
    );
    if let Some(strength) = &made.strength {
        println!("{}", bearing(strength, settings, standing));
    }
    println!("{}", quality(&made.kit.proof));
    bears::lines(&made.kit.holding, standing)
        .into_iter()
        .for_each(|line| println!("{line}"));
    weakest(&made.kit.holding, standing)
        .into_iter()
        .for_each(|line| println!("{line}"));
    println!("pieces sit {}", play::words(&made.kit.play));
    println!(
        "connectors on {:.0} % of the seam length that fits any",
        100.0 * summary.connector_share
    );
    if let Some(line) = fits(made) {
        println!("{line}");
    }
    print_verdict(&made.kit.verification, standing);
    print_warnings(warnings, standing);
    println!(
        "written to {}: open report.html in a browser, print plates.3mf",
        to.folder().display()
    );
}

/// What the wall bears, in words.
pub fn bearing(strength: &Strength, settings: &Settings, standing: &Standing) -> String {
    let StrengthParams { drop_m, material, .. } = &settings.strength;
    let hollow = 100.0 * (1.0 - strength.solid_share());
    // Hardly anything was judged where hardly anything is hollow.
    let judged = if hollow < 80.0 {
        format!(" (judged on the {hollow:.0} % of the surface that are hollow)")
    } else {
        String::new()
    };
    format!(
        "in a fall from {drop_m} m the wall's stress{judged} reaches {:.0} MPa of the {:.0} that the material bears ({})",
        strength.stress_mpa,
        material.strength_mpa,
        standing.words(strength.at.to_array())
    )
}

/// How good a plan is, in words.
pub fn quality(proof: &PlanProof) -> String {
    let PlanProof {
        cost,
        lower_bound,
        gap,
        least_cost,
        key_lower_bound,
        ..
    } = proof;
    let scope = scope(proof);
    // Bounds that meet the least known cost are proofs; what is left is rounding.
    let is_met = |bound: &f64| *bound >= least_cost * (1.0 - 1e-9);
    let chosen = match least_cost < cost {
        true => {
            format!("{cost:.3}, chosen since it holds better than those from {least_cost:.3} on; that is")
        }
        false => format!("{cost:.3},"),
    };
    if is_met(lower_bound) {
        return format!("plan: its worst piece costs {chosen} proven to be the least with {scope}");
    }
    let of_key = if is_met(key_lower_bound) {
        " the least with its key;"
    } else {
        " not proven to be the least;"
    };
    let percent = 100.0 * gap;
    format!(
        "plan: its worst piece costs {chosen}{of_key} none with {scope} costs less than {lower_bound:.3} ({percent:.1} % below)"
    )
}

/// For which plans a proof holds, in words.
pub fn scope(proof: &PlanProof) -> String {
    let ProofScope {
        keys,
        slides,
        n_lessons,
    } = &proof.proven_for;
    let who = match &keys[..] {
        [key] => format!("piece {key} as the key"),
        all if all.len() == proof.piece_costs.len() => "any piece as the key".into(),
        some => {
            let mut names: Vec<String> = some.iter().map(ToString::to_string).collect();
            let last = names.pop().unwrap_or_default();
            format!("piece {} or {last} as the key", names.join(", "))
        }
    };
    let how = match slides {
        KeyDirections::WithinPlane => "within its plane",
        KeyDirections::OutOfPlane => "out of its plane",
    };
    let lessons = match n_lessons {
        0 => String::new(),
        1 => ", and what one lesson of failed kits leaves".into(),
        n => format!(", and what {n} lessons of failed kits leave"),
    };
    format!("{who}, sliding {how}{lessons}")
}

/// Where a plan is weakest: a seam, or each piece that comes apart.
pub fn weakest(holding: &Holding, standing: &Standing) -> Vec<String> {
    let seam = holding.seams.first().map(|s| {
        let (later, earlier, opening_mm) = (s.later, s.earlier, s.opening_mm);
        let at = standing.words(s.at);
        format!(
            "weakest seam ({at}): pieces {later} and {earlier} open by {opening_mm:.2} mm at 10 N/m: {}",
            s.reason
        )
    });
    let loose = holding.loose.iter().map(|l| {
        format!(
            "comes apart at 10 N/m: piece {}, {}",
            l.piece,
            standing.words(l.at)
        )
    });
    seam.into_iter().chain(loose).collect()
}

/// How exact a printer must be; nothing where surfaces cross, which is warned of.
pub fn fits(made: &Design) -> Option<String> {
    let within_mm = made.fit.within_mm.filter(|mm| *mm > 0.0)?;
    let least_mm = 2.0 * within_mm;
    let as_drawn = |piece| made.kit.play.estimates[piece].map_or(f64::INFINITY, |play| play.translation_mm);
    let thin = match made.fit.loosest {
        Some((piece, play)) if play.translation_mm.is_finite() => format!(
            "; where all stand back by as much, piece {piece} rattles about {:.1} mm instead of {:.1} mm",
            play.translation_mm,
            as_drawn(piece)
        ),
        Some((piece, _)) => format!("; where all stand back by as much, piece {piece} comes loose"),
        None => String::new(),
    };
    Some(format!(
        "fits if printed faces stand out by no more than {within_mm:.2} mm: the least gap is {least_mm:.2} mm, at rest and on every way out{thin}"
    ))
}

/// Each on a line, with its place.
pub fn print_warnings(warnings: &[Warning], standing: &Standing) {
    for w in warnings {
        let place =
            w.at.map_or_else(String::new, |at| format!(" [{}]", standing.words(at)));
        println!("warning: {w}{place}");
    }
}

/// Each check on a line, and loudly what failed and where.
pub fn print_verdict(verdict: &Verification, words: &dyn PlaceWords) {
    for c in &verdict.checks {
        println!(
            "{}  {:52} {}",
            if c.ok { "ok  " } else { "FAIL" },
            c.name,
            c.figure
        );
    }
    print_failures(verdict, words);
}

/// What failed and where, if something did.
fn print_failures(verdict: &Verification, words: &dyn PlaceWords) {
    if !verdict.passed() {
        eprintln!(
            "FAILED: this kit does not hold together as it should; do not print it. What failed, and where:"
        );
        for finding in &verdict.findings {
            eprintln!("  {}", finding.told(words));
        }
    }
}

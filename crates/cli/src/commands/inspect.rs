//! `inspect`: says what a file holds and what would be made of it.

use std::path::Path;

use serde_json::{Value, json};
use shellock::Ctx;
use shellock_formats::Loaded;
use shellock_geom::check::{Inspection, inspect as inspection};
use shellock_geom::repair::repair;
use shellock_geom::weld::weld;
use shellock_job::division::{self, Division, divide};
use shellock_job::failure::list_names;
use shellock_job::input::{Model, load_selection, model_of, objects, repair_mode, selection};
use shellock_job::place::Standing;
use shellock_job::shape::shape_warnings;
use shellock_job::{Failure, Options};
use shellock_kit::plan_file::RepairEntry;

use crate::Session;
use crate::print::{print_warnings, sentence};
use crate::progress::Display;

/// Extent of the questions about a model.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Wanted {
    /// Contents of the file only.
    File,
    /// Division of the surface, too.
    Division,
}

/// Runs `shellock inspect` and returns the exit code.
pub fn inspect(session: &Session, file: &Path, options: &Options, wanted: Wanted) -> Result<u8, Failure> {
    let (loaded, bytes) = session
        .job
        .during("reading", || load_selection(file, &selection(options)))?;
    let found = inspection(&weld(&loaded.mesh).mesh);
    if !session.is_json {
        print_file(&loaded, &found);
    }
    let (model, thin) = session.job.during("checking the surface", || {
        let model = model_of(file, &loaded, &bytes, options);
        let thin = model
            .as_ref()
            .map(|model| shape_warnings(model, options))
            .unwrap_or_default();
        (model, thin)
    });
    let division = match (&model, wanted) {
        (Ok(model), Wanted::Division) => Some(shown_division(session, model, options)?),
        _ => None,
    };
    if session.is_json {
        println!("{}", describe(&loaded, &found, &model, &thin, division.as_ref()));
        // The printed JSON holds the reason.
        return Ok(model.err().map_or(0, |failure| failure.exit_code()));
    }
    let model = model.inspect_err(|_| loaded.notes.iter().for_each(|note| println!("note: {note}")))?;
    print_model(session, &model, &thin, division.as_ref(), options);
    Ok(0)
}

/// Divides the model, and shows progress meanwhile.
fn shown_division(session: &Session, model: &Model, options: &Options) -> Result<Division, Failure> {
    let params = division::params(&session.job, model, options)?;
    let display = Display::new(session.progress_form);
    let report = |p: shellock::Progress<'_>| display.show(p);
    let division = divide(Ctx::new(&report, &session.job.stop), params, model, options);
    display.finish();
    division
}

/// Prints the contents of the file for people.
fn print_file(loaded: &Loaded, found: &Inspection) {
    let (n, size) = (found.bodies.len(), loaded.bounds().size());
    let bodies = if n == 1 { "body" } else { "bodies" };
    println!(
        "{} file, {} faces, {n} {bodies}",
        loaded.format,
        loaded.n_file_faces()
    );
    println!(
        "size {:.4} × {:.4} × {:.4} file units{}",
        size.x,
        size.y,
        size.z,
        unit(loaded)
    );
    println!(
        "{} open edges, {} edges shared by more than two faces",
        found.edges.open.count, found.edges.non_manifold.count
    );
    let objects = objects(loaded);
    if !objects.is_empty() {
        println!("objects {}", list_names(&objects));
    }
    if !loaded.labellings.is_empty() {
        println!("can be divided by {}", labellings(loaded).join(", "));
    }
}

fn labellings(loaded: &Loaded) -> Vec<String> {
    loaded.labellings.iter().map(|l| l.source.to_string()).collect()
}

/// Prints what would be made of the model, for people.
fn print_model(
    session: &Session,
    model: &Model,
    thin: &[String],
    division: Option<&Division>,
    options: &Options,
) {
    model.notes.iter().for_each(|note| println!("note: {note}"));
    model
        .warnings
        .iter()
        .for_each(|warning| println!("warning: {}", sentence(warning)));
    thin.iter().for_each(|warning| println!("warning: {warning}"));
    let made = model.solid.mesh().bounds().size();
    let state = if model.repairs.is_empty() {
        "one closed body"
    } else {
        "one closed body after repair"
    };
    println!(
        "{state}: it can be made, {:.1} × {:.1} × {:.1} mm",
        made.x, made.y, made.z
    );
    if let Some(division) = division {
        let standing = Standing::of(options.up, model.solid.mesh());
        print_warnings(session, &division.warnings, &standing);
        division
            .lines(&standing)
            .iter()
            .for_each(|line| println!("{line}"));
    }
}

/// Builds the whole answer as JSON.
fn describe(
    loaded: &Loaded,
    found: &Inspection,
    model: &Result<Model, Failure>,
    thin: &[String],
    division: Option<&Division>,
) -> Value {
    let is_sound = repair(&loaded.mesh, repair_mode(true, false)).is_ok();
    let (repairs, notes): (Vec<RepairEntry>, &[String]) = model.as_ref().map_or_else(
        |_| (Vec::new(), &[][..]),
        |m| (m.repairs.iter().map(RepairEntry::of).collect(), &m.notes),
    );
    let error = model.as_ref().err().map(ToString::to_string);
    // A model that cannot be made still has notes from reading.
    let notes = if model.is_ok() { notes } else { &loaded.notes[..] };
    let of_model = model.iter().flat_map(|m| &m.warnings).map(ToString::to_string);
    let warnings: Vec<String> = of_model.chain(thin.iter().cloned()).collect();
    let size_mm = model.as_ref().map_or_else(
        |_| loaded.unit_mm.map(|mm| mm * loaded.bounds().size()),
        |m| Some(m.solid.mesh().bounds().size()),
    );
    let mut value = json!({ "format": loaded.format.to_string(), "faces": loaded.n_file_faces(),
        "bodies": found.bodies.len(), "size": loaded.bounds().size().to_array(),
        "unit_mm": loaded.unit_mm, "unit_is_stated": loaded.has_unit,
        "volume_mm3": model.as_ref().ok().map(|m| m.solid.volume()),
        "size_mm": size_mm.map(|size| size.to_array()), "objects": objects(loaded),
        "open_edges": found.edges.open.count,
        "shared_edges": found.edges.non_manifold.count, "has_labels": loaded.face_labels().is_some(),
        "divided_by": labellings(loaded), "is_sound": is_sound,
        "repairs": repairs, "notes": notes, "warnings": warnings,
        "can_be_made": model.is_ok(), "error": error });
    if let Some(division) = division {
        value["division"] = json!(division.figures);
        value["division"]["warnings"] = json!(division.warnings);
    }
    value
}

fn unit(loaded: &Loaded) -> String {
    loaded
        .unit_mm
        .map_or_else(String::new, |mm| format!(" of {mm} mm"))
}

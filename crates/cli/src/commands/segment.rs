//! `segment`: divides the surface of a model, and writes the division.

use std::path::Path;

use serde_json::json;
use shellock::Ctx;
use shellock_formats::{write_labels, write_ply};
use shellock_job::build::check_options;
use shellock_job::division::{divide_model, labels_of_file};
use shellock_job::files::{extension, write};
use shellock_job::paint::paint_patches;
use shellock_job::place::Standing;
use shellock_job::{Failure, Options, input};

use crate::Session;
use crate::print::{print_input_warnings, print_warnings};
use crate::progress::Display;

/// Runs `shellock segment` and returns the exit code.
pub fn segment(session: &Session, file: &Path, options: &Options, out: &Path) -> Result<u8, Failure> {
    check_options(options)?;
    let kind = extension(out);
    if !["ply", "3mf", "seg"].contains(&kind.as_str()) {
        return Err(Failure::Wrong(format!(
            "{}: choose a name that ends in .ply, .3mf or .seg",
            out.display()
        )));
    }
    let model = input::model(&session.job, file, options)?;
    let display = Display::new(session.progress_form);
    let report = |p: shellock::Progress<'_>| display.show(p);
    let ctx = Ctx::new(&report, &session.job.stop);
    let surface = divide_model(&session.job, &ctx, &model, options)?;
    display.finish();
    let mut notes = model.notes.clone();
    let bytes = match kind.as_str() {
        "ply" => {
            let labels: Vec<i32> = surface.patch_of_face.iter().map(|p| p.number() as i32).collect();
            write_ply(&surface.mesh, Some(&labels))
        }
        "3mf" => {
            let (bytes, is_distinct) = paint_patches(&model.name, &surface);
            if !is_distinct {
                notes
                    .push("slicers have 16 colours of paint: pieces that do not touch share some".to_owned());
            }
            bytes
        }
        _ => write_labels(&labels_of_file(&model, &surface)),
    };
    write(out, &bytes)?;
    print_input_warnings(session, &model);
    let mut warnings = ctx.into_warnings();
    if session.is_json {
        warnings.splice(0..0, model.warnings.iter().cloned());
    }
    if session.is_json {
        let value = json!({ "status": "done", "out": out, "pieces": surface.n_patches, "notes": notes,
                            "warnings": warnings });
        println!("{value}");
    } else {
        notes.iter().for_each(|n| println!("note: {n}"));
        let standing = Standing::of(options.up, model.solid.mesh());
        print_warnings(session, &warnings, &standing);
        println!("{} pieces, written to {}", surface.n_patches, out.display());
    }
    Ok(0)
}

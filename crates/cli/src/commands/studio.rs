//! `studio`: serves a page in the browser and the functions behind it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::json;
use shellock_job::Failure;
use shellock_studio::Bench;

use crate::Session;
use crate::args::StudioOptions;

/// Runs `shellock studio` until it is stopped; returns the exit code.
pub fn studio(session: &Session, options: &StudioOptions) -> Result<u8, Failure> {
    let folder = options
        .project
        .clone()
        .unwrap_or_else(|| usual_folder(options.model.as_deref()));
    let bench = Bench::open(folder)?;
    if let Some(model) = &options.model {
        bench.take(model)?;
    }
    let bench = Arc::new(bench);
    let opening = Arc::clone(&bench);
    // The page comes up at once, however large the model is.
    std::thread::spawn(move || opening.load());
    let ready = |address: &shellock_studio::Address| {
        let url = address.url();
        if session.is_json {
            println!("{}", json!({ "address": url }));
        } else {
            println!("Studio at {url}\n(Ctrl-C ends it; the project stays)");
        }
        if !options.no_open && open::that_detached(&url).is_err() {
            eprintln!("note: no browser could be opened: open that address in one");
        }
    };
    shellock_studio::serve(bench, options.port, &session.job.stop, ready).map_err(|e| {
        Failure::Wrong(format!(
            "the studio cannot start at port {}: {e}; choose another with --port",
            options.port
        ))
    })?;
    Ok(0)
}

/// Default project folder: in the working folder, named after the model.
fn usual_folder(model: Option<&Path>) -> PathBuf {
    let stem = model.and_then(Path::file_stem);
    let stem = stem.map_or_else(|| "shellock".into(), |s| s.to_string_lossy());
    PathBuf::from(format!("{stem}-studio"))
}

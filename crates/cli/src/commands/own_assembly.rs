//! `verify` for a user's own assembly.

use std::path::Path;

use serde_json::json;
use shellock::Ctx;
use shellock::verify::words::Coordinates;
use shellock_job::Failure;
use shellock_job::own_assembly::{ASSEMBLY, OwnAssembly};

use crate::Session;
use crate::print::print_verdict;
use crate::progress::Display;

/// Runs `shellock verify FOLDER` for a folder with an `assembly.json`; returns the exit code.
pub fn verify(session: &Session, folder: &Path, model: Option<&Path>) -> Result<u8, Failure> {
    if let Some(model) = model {
        return Err(Failure::Wrong(format!(
            "the assembly of {ASSEMBLY} is verified without a model: leave {} out",
            model.display()
        )));
    }
    let own = OwnAssembly::read(folder)?;
    let display = Display::new(session.progress_form);
    let report = |p: shellock::Progress<'_>| display.show(p);
    let found = own.verify(&Ctx::new(&report, &session.job.stop));
    display.finish();
    let found = found?;
    let code = u8::from(!found.has_passed());
    if session.is_json {
        println!(
            "{}",
            json!({ "passed": found.has_passed(), "checks": found.checks, "findings": found.findings,
                    "exit_code": code })
        );
    } else {
        print_verdict(&found, &Coordinates);
    }
    Ok(code)
}

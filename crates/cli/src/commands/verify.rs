//! `verify`: checks a finished kit again, from its files.

use std::path::Path;

use serde_json::json;
use shellock::Ctx;
use shellock::verify::words::Coordinates;
use shellock_job::Failure;
use shellock_job::kits::Finished;

use crate::Session;
use crate::print::print_verdict;
use crate::progress::Display;

/// Runs `shellock verify` and returns the exit code: 0 if every check passes, else 1.
pub fn verify(session: &Session, kit: &Path, model: Option<&Path>) -> Result<u8, Failure> {
    let kit = Finished::read(kit, model)?;
    let display = Display::new(session.progress_form);
    let report = |p: shellock::Progress<'_>| display.show(p);
    let verdict = kit.verify(&Ctx::new(&report, &session.job.stop));
    display.finish();
    let verdict = verdict?;
    let code = u8::from(!verdict.has_passed());
    if session.is_json {
        println!(
            "{}",
            json!({ "passed": verdict.has_passed(), "checks": verdict.checks, "findings": verdict.findings,
                    "exit_code": code })
        );
    } else {
        match kit.upright() {
            Some(standing) => print_verdict(&verdict, &standing),
            None => print_verdict(&verdict, &Coordinates),
        }
    }
    Ok(code)
}

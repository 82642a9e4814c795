//! Command `shellock-check OUT`: confirms or refutes each claim in `OUT/certificate.json`, one line a claim,
//! and then states the overall result.
//!
//! Exit code 0: every claim is confirmed; 1: some claim is refuted; 2: the certificate could not be read.

use std::path::Path;
use std::process::ExitCode;

use shellock_check::Verdict;

const USAGE: &str = "usage: shellock-check OUT, where OUT is the folder of a kit with its \
                     certificate.json\nConfirms or refutes what the certificate claims of the pieces. Exit \
                     code 0: nothing refuted, 1: something refuted, 2: nothing to check.";
const NOT_TESTED: &str = "Not tested: that the outside looks like the model, and how thick walls are \
                          (`shellock verify` does), and what report.html and the pictures show";

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().skip(1).collect();
    let is = |names: &[&str]| arguments.len() == 1 && names.iter().any(|name| arguments[0] == *name);
    if is(&["-h", "--help"]) {
        println!("{USAGE}");
        return ExitCode::SUCCESS;
    }
    if is(&["-V", "--version"]) {
        println!("shellock-check {}", env!("CARGO_PKG_VERSION"));
        return ExitCode::SUCCESS;
    }
    let [folder] = &arguments[..] else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    match shellock_check::check(Path::new(folder)) {
        Ok(findings) => {
            findings.iter().for_each(|f| println!("{f}"));
            let count = |verdict: Verdict| findings.iter().filter(|f| f.verdict == verdict).count();
            let [n_refuted, n_unproven] = [Verdict::Refuted, Verdict::Unproven].map(count);
            let n_claimed = findings.len() - n_unproven;
            let unproven = if n_unproven > 0 {
                format!(", {n_unproven} unproven")
            } else {
                String::new()
            };
            match n_refuted {
                0 => println!("all {n_claimed} confirmed{unproven}. {NOT_TESTED}"),
                n => println!("{n} of {n_claimed} REFUTED{unproven}: do not trust this kit"),
            }
            ExitCode::from(u8::from(n_refuted > 0))
        }
        Err(why) => {
            eprintln!("error: {why}");
            ExitCode::from(2)
        }
    }
}

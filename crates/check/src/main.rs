//! `shellock-check OUT`: confirms or refutes each claim in `OUT/certificate.json`, one line a claim.
//!
//! Exit code 0: everything is confirmed; 1: something is refuted; 2: the certificate could not be read.

use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().skip(1).collect();
    let [folder] = &arguments[..] else {
        eprintln!("usage: shellock-check OUT, where OUT is the folder of a kit with its certificate.json");
        return ExitCode::from(2);
    };
    match shellock_check::check(Path::new(folder)) {
        Ok(findings) => {
            findings.iter().for_each(|f| println!("{f}"));
            ExitCode::from(u8::from(findings.iter().any(|f| !f.is_confirmed)))
        }
        Err(why) => {
            eprintln!("error: {why}");
            ExitCode::from(2)
        }
    }
}

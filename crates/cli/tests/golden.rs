//! Tests that kits of the program's own figures are unchanged, byte for byte.

use std::path::Path;

use shellock_testkit::golden::{Goldens, QUICK, machine, of_figures, run};

/// Slow test (some seconds a kit). `cargo xtask golden --update` rewrites the digests after intended changes.
#[test]
fn kits_of_figures_are_what_they_were() {
    let goldens = Goldens::read(&of_figures()).unwrap();
    if goldens.machine != machine() {
        // Sums on other vector units or with other C libraries differ in their last bits.
        eprintln!(
            "skipped: digests are of \"{}\", this is \"{}\"",
            goldens.machine,
            machine()
        );
        return;
    }
    let program = Path::new(env!("CARGO_BIN_EXE_shellock"));
    let mut changes = Vec::new();
    for case in &QUICK {
        let ending = run(program, case, 2, None).unwrap();
        let before = goldens
            .endings
            .get(case.name)
            .unwrap_or_else(|| panic!("{} has no digests", case.name));
        changes.extend(
            ending
                .changes_since(before)
                .into_iter()
                .map(|change| format!("{}: {change}", case.name)),
        );
    }
    assert!(
        changes.is_empty(),
        "`cargo xtask golden --update` if that is meant: {changes:#?}"
    );
}

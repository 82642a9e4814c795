//! Tests that a kit takes no more work than before. Work is counted, so that the test fails on any machine.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// Share by which work may grow before the test fails.
const MORE: f64 = 0.1;

/// Slow test: it makes one kit of some seconds, the first. If more work is meant, or less was achieved,
/// replace the counts in the file by those that the test prints.
#[test]
fn a_kit_takes_no_more_work_than_before() {
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_shellock"))
        .args([
            "--json", "demo", "--figure", "vase", "--size", "60", "--pieces", "4",
        ])
        .args(["--time", "0", "--out"])
        .arg(folder.path().join("kit"))
        .output()
        .unwrap();
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    let now: BTreeMap<String, u64> = serde_json::from_value(result["work"].clone()).unwrap();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../testkit/golden/work.json");
    let before: BTreeMap<String, u64> = serde_json::from_slice(&fs::read(file).unwrap()).unwrap();
    assert!(now.keys().eq(before.keys()), "{now:#?}");
    let grown: Vec<&String> = before
        .iter()
        .filter(|(name, n)| now[*name] as f64 > (1.0 + MORE) * **n as f64)
        .map(|(name, _)| name)
        .collect();
    assert!(
        grown.is_empty(),
        "more work than before: {grown:?}\nbefore {before:#?}\nnow {now:#?}"
    );
}

//! The order of the stages, read from the sources.

use std::fs;
use std::path::{Path, PathBuf};

/// Each module may name those before it. `plan` stands before `body` because bodies are split along a plan.
const ORDER: [&str; 17] = [
    "motion",
    "strength",
    "segmentation",
    "key",
    "sizes",
    "plan",
    "metric",
    "stress_test",
    "body",
    "connector",
    "piece",
    "verify",
    "play",
    "certificate",
    "report",
    "feedback",
    "pipeline",
];

fn rust_files(src: &Path, module: &str) -> Vec<PathBuf> {
    let mut files = vec![src.join(format!("{module}.rs"))];
    let mut folders = vec![src.join(module)];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() { folders.push(path) } else { files.push(path) }
        }
    }
    files.retain(|f| f.extension().is_some_and(|e| e == "rs"));
    files
}

#[test]
fn modules_depend_only_on_earlier_modules() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut upward = Vec::new();
    for (i, module) in ORDER.iter().enumerate() {
        for file in rust_files(&src, module) {
            let text = fs::read_to_string(&file).unwrap();
            for later in &ORDER[i + 1..] {
                // Feedback reads finished designs, which the pipeline defines.
                let is_known = *module == "feedback" && *later == "pipeline";
                if !is_known && text.contains(&format!("crate::{later}::")) {
                    upward.push(format!("{} names crate::{later}", file.display()));
                }
            }
        }
    }
    assert!(upward.is_empty(), "{upward:#?}");
}

#[test]
fn library_crates_touch_no_file_clock_or_stdout() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned();
    let mut found = Vec::new();
    for krate in ["geom", "mechanics", "shellock"] {
        let mut folders = vec![root.join(krate).join("src")];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).unwrap().flatten() {
                let path = entry.path();
                if path.is_dir() {
                    folders.push(path);
                    continue;
                }
                let text = fs::read_to_string(&path).unwrap();
                for forbidden in ["std::fs", "Instant::now", "SystemTime", "println!", "eprintln!", "std::env"] {
                    if text.contains(forbidden) {
                        found.push(format!("{} uses {forbidden}", path.display()));
                    }
                }
            }
        }
    }
    assert!(found.is_empty(), "{found:#?}");
}

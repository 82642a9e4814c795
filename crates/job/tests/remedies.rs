//! Messages name options that exist.

use std::fs;
use std::path::{Path, PathBuf};

use shellock_job::options::declaration;

/// Arguments of the program that are no options of a job.
const OF_PROGRAM: [&str; 4] = ["force", "json", "out", "stop-with-stdin"];
/// File with arguments of a slicer.
const OF_SLICER: &str = "savings.rs";

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap().flatten() {
        let path = entry.path();
        if path.is_dir() {
            sources(&path, found);
        } else if !path.ends_with(OF_SLICER) {
            found.push(path);
        }
    }
}

/// Words of a text that follow `--`.
fn option_names(text: &str) -> impl Iterator<Item = &str> {
    let is_name = |c: char| c.is_ascii_lowercase() || c == '-';
    let after = text.match_indices("--").map(|(at, _)| &text[at + 2..]);
    let names = after.map(move |rest| &rest[..rest.find(|c| !is_name(c)).unwrap_or(rest.len())]);
    names.filter(|name| name.starts_with(|c: char| c.is_ascii_lowercase()))
}

#[test]
fn every_option_that_a_message_names_exists() {
    let mut files = Vec::new();
    sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut files);
    let mut n_named = 0;
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        for name in option_names(&text) {
            let is_known = declaration(name).is_some() || OF_PROGRAM.contains(&name);
            assert!(is_known, "{}: --{name}", file.display());
            n_named += 1;
        }
    }
    assert!(n_named > 30, "{n_named}");
}

#[test]
fn every_setting_that_a_warning_names_is_an_option() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut files = Vec::new();
    sources(&crates, &mut files);
    let causes = files.iter().filter(|file| file.ends_with("causes.rs"));
    let mut n_named = 0;
    for file in causes {
        let text = fs::read_to_string(file).unwrap();
        // Lists of settings are the only lists of texts in these files.
        let lists = text
            .split("&[\"")
            .skip(1)
            .map(|rest| &rest[..rest.find("\"]").unwrap()]);
        for name in lists.flat_map(|list| list.split("\", \"")) {
            assert!(declaration(name).is_some(), "{}: {name}", file.display());
            n_named += 1;
        }
    }
    assert!(n_named > 15, "{n_named}");
}

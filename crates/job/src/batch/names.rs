//! Names in a batch: which files of a folder are models, and where their kits and records go.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs;
use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::files::with_slashes;
use crate::input::sha256;
use crate::output::PLAN;

/// A model and its kit, as paths within their folders.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Path of the model.
    pub model: PathBuf,
    /// Path of the kit.
    pub kit: PathBuf,
}

/// Endings of the names of models.
pub const ENDINGS: [&str; 9] = ["stl", "obj", "ply", "off", "3mf", "glb", "gltf", "gz", "zip"];
/// Folder of the records, within the folder for kits.
pub const RECORDS: &str = ".batch";
/// Name of the table for machines.
pub const TABLE: &str = "batch.csv";
/// Name of the table for people, with pictures.
pub const PAGE: &str = "batch.html";
/// Kit names reserved for the tables and the records.
const TAKEN: [&str; 3] = [PAGE, TABLE, RECORDS];
/// Number of letters of a kit's name that its record's name repeats.
const TOLD_LETTERS: usize = 60;

/// Lists all models below `folder`, except those in `out` and in kits: each model's path within `folder`,
/// with the name of its kit. A subfolder that cannot be read is listed itself, in place of its contents.
pub fn models(folder: &Path, out: Option<&Path>) -> Result<VecDeque<(PathBuf, PathBuf)>, Failure> {
    let out = out.and_then(|out| out.canonicalize().ok());
    let mut found = BTreeSet::new();
    let mut left = vec![PathBuf::new()];
    while let Some(below) = left.pop() {
        let here = folder.join(&below);
        let entries = match fs::read_dir(&here).and_then(Iterator::collect::<Result<Vec<_>, _>>) {
            Ok(entries) => entries,
            Err(source) if below.as_os_str().is_empty() => {
                return Err(Failure::Unreadable { path: here, source });
            }
            Err(_) => {
                found.insert(below);
                continue;
            }
        };
        if is_kit(&here) {
            continue;
        }
        for entry in entries {
            let (name, path) = (below.join(entry.file_name()), entry.path());
            let is_hidden = entry.file_name().to_string_lossy().starts_with('.');
            if is_hidden || out.is_some() && path.canonicalize().ok() == out {
                continue;
            }
            // Links to folders are not followed, since they could form cycles.
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                left.push(name);
            } else if is_model(&name) && path.is_file() {
                found.insert(name);
            }
        }
    }
    Ok(name_kits(found))
}

fn is_model(name: &Path) -> bool {
    let extension = name.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    extension.is_some_and(|e| ENDINGS.contains(&&e[..]))
}

/// Returns true if a folder is a kit of this program.
fn is_kit(folder: &Path) -> bool {
    fs::read_to_string(folder.join(PLAN)).is_ok_and(|plan| plan.contains("\"shellock-plan\""))
}

/// Assigns each model a unique kit name: unique ignoring case, and never the name of a folder that contains
/// other kits.
fn name_kits(models: BTreeSet<PathBuf>) -> VecDeque<(PathBuf, PathBuf)> {
    let lower = |name: &str| name.to_lowercase();
    let stem = |model: &Path| with_slashes(&model.with_extension(""));
    let mut stems: BTreeMap<String, usize> = BTreeMap::new();
    let mut taken: BTreeSet<String> = TAKEN.iter().map(|name| lower(name)).collect();
    for model in &models {
        *stems.entry(lower(&stem(model))).or_default() += 1;
        let folders = model.ancestors().skip(1);
        taken.extend(folders.map(|folder| lower(&with_slashes(folder))));
    }
    let is_alone = |name: &str| stems.get(&lower(name)).is_none_or(|n| *n == 1);
    let mut kits: BTreeMap<&PathBuf, String> = BTreeMap::new();
    // Models with a unique stem come first, so that no other takes it.
    for model in &models {
        let name = stem(model);
        if is_alone(&name) && taken.insert(lower(&name)) {
            kits.insert(model, name);
        }
    }
    for model in &models {
        if !kits.contains_key(model) {
            let file = model
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .replace('.', "-");
            let full = with_slashes(&model.with_file_name(file));
            let numbered = (2..).map(|n| format!("{full}-{n}"));
            let mut free = std::iter::once(full.clone()).chain(numbered);
            let name = free
                .find(|name| taken.insert(lower(name)))
                .expect("numbers do not end");
            kits.insert(model, name);
        }
    }
    models
        .iter()
        .map(|model| (model.clone(), PathBuf::from(&kits[model])))
        .collect()
}

/// Path of a kit's record.
pub fn record_file(out: &Path, kit: &str) -> PathBuf {
    out.join(RECORDS).join(format!("{}.json", record_name(kit)))
}

/// Name of a kit's record: unique for each kit, and not too long.
pub fn record_name(kit: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '-' };
    let told: String = kit.chars().take(TOLD_LETTERS).map(plain).collect();
    format!("{told}-{}", &sha256(kit.as_bytes())[..12])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kits(names: &[&str]) -> Vec<(String, String)> {
        let dir = tempfile::tempdir().unwrap();
        for name in names {
            let path = dir.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, "").unwrap();
        }
        fs::create_dir_all(dir.path().join("kit")).unwrap();
        fs::write(
            dir.path().join("kit").join(PLAN),
            r#"{"format": "shellock-plan"}"#,
        )
        .unwrap();
        fs::write(dir.path().join("kit/piece.stl"), "").unwrap();
        let found = models(dir.path(), Some(&dir.path().join("out"))).unwrap();
        let found: Vec<(String, String)> = found
            .into_iter()
            .map(|(model, kit)| (with_slashes(&model), kit.display().to_string()))
            .collect();
        let records: BTreeSet<PathBuf> = found
            .iter()
            .map(|(_, kit)| record_file(dir.path(), kit))
            .collect();
        assert_eq!(records.len(), found.len(), "each has a record of its own");
        found
    }

    fn pairs(expected: &[(&str, &str)]) -> Vec<(String, String)> {
        expected
            .iter()
            .map(|(m, k)| ((*m).to_owned(), (*k).to_owned()))
            .collect()
    }

    #[test]
    fn every_model_has_a_kit_of_its_own_and_what_is_no_model_has_none() {
        let names = [
            "a.stl",
            "a.obj",
            "b.STL",
            "c/a.ply",
            "c/.hidden.stl",
            "notes.txt",
            "out/d.stl",
            "p.1.stl",
            "p.2.stl",
        ];
        let expected = [
            ("a.obj", "a-obj"),
            ("a.stl", "a-stl"),
            ("b.STL", "b"),
            ("c/a.ply", "c/a"),
            ("p.1.stl", "p.1"),
            ("p.2.stl", "p.2"),
        ];
        assert_eq!(kits(&names), pairs(&expected));
    }

    #[test]
    fn no_kit_lies_in_another_or_has_the_name_of_one_or_of_a_table() {
        let names = [
            "a-stl.ply",
            "a.obj",
            "a.stl",
            "b/c.stl",
            "b.stl",
            "batch.html.stl",
        ];
        let expected = [
            ("a-stl.ply", "a-stl"),
            ("a.obj", "a-obj"),
            ("a.stl", "a-stl-2"),
            ("b/c.stl", "b/c"),
            ("b.stl", "b-stl"),
            ("batch.html.stl", "batch-html-stl"),
        ];
        assert_eq!(kits(&names), pairs(&expected));
        assert_eq!(
            kits(&["Dragon.STL", "dragon.obj"])
                .iter()
                .filter(|(_, kit)| kit.to_lowercase() == "dragon")
                .count(),
            0
        );
    }

    #[test]
    fn the_name_of_a_kit_has_slashes_between_its_parts_on_every_system() {
        for file in ["a.stl", "a.obj"] {
            let models = ["a.stl", file].map(|file| ["b", "c", file].iter().collect());
            let kits = name_kits(BTreeSet::from(models));
            assert!(
                kits.iter()
                    .all(|(_, kit)| kit.to_str().unwrap().starts_with("b/c/a")),
                "{kits:?}"
            );
        }
    }

    #[test]
    fn a_record_of_a_long_name_has_a_short_one() {
        let file = record_file(Path::new("out"), &"x".repeat(251));
        assert!(file.file_name().unwrap().len() < 100);
    }
}

//! Folder of a project: the project file, the model as given, the labels, and the kit that was made last.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use shellock::segmentation::MOST_PIECES;
use shellock_formats::{read_labels, write_labels};
use shellock_job::files::write;
use shellock_job::input::{read, sha256};
use shellock_job::options::{Choice, Choices, relabel};
use shellock_job::output::PLAN;
use shellock_job::project::{ModelOf, Project, beside};
use shellock_job::{Failure, config};
use toml_edit::Item;

/// Name of the project file.
const PROJECT: &str = "figure.shellock.toml";
/// Name of the file of labels: one label a face of the model's file.
const LABELS: &str = "figure.labels.seg";
/// Name of the file with the result of the last kit and a hash of its inputs.
const LAST: &str = "figure.kit.json";
/// Name of the folder of that kit.
const KIT: &str = "kit";
/// Number of labels that pieces on the page may have, from 0. The page gives a new piece a new label, so
/// there are more labels than pieces.
pub const N_LABELS: u32 = 8 * MOST_PIECES as u32;
/// Length limit of the stored name of a model's file, characters.
const LONGEST_NAME: usize = 100;

/// Project folder that the studio reads and writes.
pub struct Store {
    folder: PathBuf,
    /// The user's own printers, as their configuration declares them.
    printers: Option<Item>,
}

/// Contents of a project that was found.
#[derive(Default)]
pub struct Found {
    pub model: Option<ModelOf>,
    /// Chosen options; piece numbers in them count from 1.
    pub choices: Choices,
    /// Painted labels, one a face of the file, from 0; `None` if nothing was painted.
    pub labels: Option<Vec<u32>>,
}

impl Store {
    /// Creates the folder if there is none, and reads the project in it if there is one.
    pub fn open(folder: PathBuf) -> Result<(Self, Found), Failure> {
        fs::create_dir_all(&folder).map_err(Failure::unwritable(&folder))?;
        let folder = folder.canonicalize().map_err(Failure::unwritable(&folder))?;
        let (mut printers, mut found) = (config::usual_printers(), Found::default());
        let path = folder.join(PROJECT);
        if path.is_file() {
            let wrong = |problem: String| Failure::Wrong(format!("{}: {problem}", path.display()));
            let text = fs::read_to_string(&path).map_err(|e| wrong(e.to_string()))?;
            let file: toml_edit::DocumentMut = text
                .parse()
                .map_err(|e: toml_edit::TomlError| wrong(e.to_string()))?;
            printers = file.get("printers").cloned().or(printers);
            found.model = config::project_model(&text).map_err(&wrong)?;
            let (choices, is_labelled) = choices_of(&file).map_err(wrong)?;
            found.choices = choices;
            if is_labelled {
                let (labels, numbering) = labels_in(&folder.join(LABELS))?;
                found.choices = relabel(&found.choices, |label| numbering.number(label));
                found.labels = Some(numbering.pieces(&labels));
            }
        }
        Ok((Self { folder, printers }, found))
    }

    pub fn folder(&self) -> &Path {
        &self.folder
    }

    pub fn kit_folder(&self) -> PathBuf {
        self.folder.join(KIT)
    }

    pub fn project_file(&self) -> PathBuf {
        self.folder.join(PROJECT)
    }

    /// Printers that are stored in the project.
    pub fn printers(&self) -> Option<&Item> {
        self.printers.as_ref()
    }

    /// Path of the model's file.
    pub fn model_path(&self, model: &ModelOf) -> Result<PathBuf, Failure> {
        model.path(&self.folder).map_err(Failure::Wrong)
    }

    /// Saves the project: labels first, since the project file names them. In files, pieces count from 1, as
    /// for people.
    pub fn save(
        &self,
        model: Option<&ModelOf>,
        choices: &Choices,
        labels: Option<&[u32]>,
    ) -> Result<(), Failure> {
        let mut choices = choices.clone();
        if let Some(labels) = labels {
            let counted: Vec<u32> = labels.iter().map(|label| label + 1).collect();
            write(&self.folder.join(LABELS), &write_labels(&counted))?;
            choices.push(("labels".to_owned(), Choice::Text(LABELS.to_owned())));
        }
        let project = Project {
            model,
            choices: &choices,
            printers: self.printers.as_ref(),
        };
        write(&self.project_file(), project.to_toml().as_bytes())
    }

    /// Stores a model's file under a name like `name` that no other file of the folder has.
    pub fn keep(&self, name: &str, bytes: &[u8]) -> Result<ModelOf, Failure> {
        let hash = sha256(bytes);
        let is_free = |name: &str| {
            let path = self.folder.join(name);
            !path.exists() || path.is_file() && read(&path).is_ok_and(|there| there == bytes)
        };
        let file = names_like(name)
            .find(|name| is_free(name))
            .expect("numbers do not end");
        let path = beside(&self.folder, &file).map_err(Failure::Wrong)?;
        if !path.exists() {
            write(&path, bytes)?;
        }
        Ok(ModelOf { file, sha256: hash })
    }

    /// Hash of the inputs of a kit: the project file and the labels.
    pub fn state(&self) -> String {
        let bytes = |name: &str| fs::read(self.folder.join(name)).unwrap_or_default();
        sha256(&[bytes(PROJECT), bytes(LABELS)].concat())
    }

    /// Notes the result of a kit that was made from `state`.
    pub fn note_kit(&self, state: &str, code: i32, result: Value) -> Result<(), Failure> {
        let noted = Noted {
            made_of: state.to_owned(),
            passed: code == 0,
            summary: result,
        };
        let text = serde_json::to_string(&noted).expect("numbers and strings can be written");
        write(&self.folder.join(LAST), text.as_bytes())
    }

    /// Describes the last kit; `None` if there is none.
    pub fn kit(&self) -> Option<LastKit> {
        if !self.kit_folder().join(PLAN).is_file() {
            return None;
        }
        let noted = fs::read(self.folder.join(LAST)).ok();
        let noted: Noted = noted
            .and_then(|bytes| serde_json::from_slice(&bytes).ok())
            .unwrap_or_default();
        Some(LastKit {
            has_passed: noted.passed,
            is_current: noted.made_of == self.state(),
            summary: noted.summary,
        })
    }
}

/// Result of a kit as it is noted in the project's folder.
#[derive(Default, Serialize, Deserialize)]
#[serde(default)]
struct Noted {
    /// Hash of the kit's inputs.
    made_of: String,
    passed: bool,
    /// Result of `build` as it was printed.
    summary: Value,
}

/// Result of the kit that was made last.
#[derive(Debug)]
pub struct LastKit {
    /// True if it passes every check.
    pub has_passed: bool,
    /// True if it is of the project's present state.
    pub is_current: bool,
    /// Result of `build` as it was printed.
    pub summary: Value,
}

/// Options that a project file sets; also returns true if it names labels.
fn choices_of(file: &toml_edit::DocumentMut) -> Result<(Choices, bool), String> {
    let mut choices = Choices::new();
    let mut is_labelled = false;
    for (name, item) in file
        .iter()
        .filter(|(name, _)| !["model", "printers"].contains(name))
    {
        if name == "labels" {
            is_labelled = true;
            continue;
        }
        let text = |value: &toml_edit::Value| match value {
            toml_edit::Value::String(text) => Some(text.value().clone()),
            toml_edit::Value::Integer(number) => Some(number.value().to_string()),
            toml_edit::Value::Float(number) => Some(number.value().to_string()),
            _ => None,
        };
        let choice = match item.as_value() {
            Some(toml_edit::Value::Boolean(is_on)) if !*is_on.value() => continue,
            Some(toml_edit::Value::Boolean(_)) => Some(Choice::On),
            Some(toml_edit::Value::Array(all)) => {
                all.iter().map(text).collect::<Option<_>>().map(Choice::Many)
            }
            Some(value) => text(value).map(Choice::Text),
            None => None,
        };
        let choice =
            choice.ok_or_else(|| format!("\"{name}\" must be a text, a number, true or a list of texts"))?;
        choices.push((name.to_owned(), choice));
    }
    Ok((choices, is_labelled))
}

/// Reads the labels in the file at `path`, and numbers the pieces that they define.
fn labels_in(path: &Path) -> Result<(Vec<i64>, Numbering), Failure> {
    let labels = read_labels(&read(path)?).map_err(|source| Failure::NotAMesh {
        path: path.to_owned(),
        source,
    })?;
    let numbering = Numbering::of(&labels);
    let n_labels = numbering.places.len();
    if n_labels > N_LABELS as usize {
        return Err(Failure::Wrong(format!(
            "{}: {n_labels} labels, but at most {MOST_PIECES} pieces can be made: give all faces of a piece \
             the same label",
            path.display(),
        )));
    }
    Ok((labels, numbering))
}

/// Maps labels of a file to piece numbers, from 1. The file may be from another program: its labels may count
/// from 0 or be far apart.
struct Numbering {
    /// Offset to add to a label; `None` if labels are far apart and are numbered by rank.
    shift: Option<i64>,
    /// Rank of each label, from 1.
    places: BTreeMap<i64, i64>,
}

impl Numbering {
    /// Creates the numbering for these labels. Labels written by this program keep their numbers.
    fn of(labels: &[i64]) -> Self {
        let all: BTreeSet<i64> = labels.iter().copied().collect();
        let first = all.first().map_or(1, |&first| first.min(1));
        let is_dense = all.last().is_none_or(|last| last - first < i64::from(N_LABELS));
        Self {
            shift: is_dense.then_some(1 - first),
            places: all.into_iter().zip(1..).collect(),
        }
    }

    /// Number of the piece with this label; a number that no piece has if no face has the label.
    fn number(&self, label: i64) -> Option<i64> {
        match self.shift {
            Some(shift) => label.checked_add(shift),
            None => Some(self.places.get(&label).copied().unwrap_or(0)),
        }
    }

    /// Piece of each face, from 0.
    fn pieces(&self, labels: &[i64]) -> Vec<u32> {
        let piece = |&label: &i64| self.number(label).map_or(0, |number| (number - 1) as u32);
        labels.iter().map(piece).collect()
    }
}

/// Generates names for a model's file: first like `name`, without characters and names that file systems or
/// projects reserve, then the same with numbers.
fn names_like(name: &str) -> impl Iterator<Item = String> {
    let last = name.rsplit(['/', '\\']).next().unwrap_or_default();
    let is_plain = |c: &char| c.is_alphanumeric() || " ._-()".contains(*c);
    let plain: String = last.chars().map(|c| if is_plain(&c) { c } else { '_' }).collect();
    let plain = plain.trim_start_matches(['.', ' ']).trim_end_matches(['.', ' ']);
    let (stem, extension) = plain.rsplit_once('.').unwrap_or((plain, ""));
    let stem: String = stem.chars().take(LONGEST_NAME).collect();
    let extension: String = extension.chars().take(8).collect();
    let is_taken = stem.is_empty() || stem == KIT || plain.starts_with("figure.");
    let stem = if is_taken { format!("model-{stem}") } else { stem };
    let numbered = move |i: usize| {
        let stem = if i == 0 {
            stem.clone()
        } else {
            format!("{stem}-{}", i + 1)
        };
        if extension.is_empty() {
            stem
        } else {
            format!("{stem}.{extension}")
        }
    };
    (0..).map(numbered)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_models_name_stays_within_the_folder() {
        let first = |name: &str| names_like(name).next().unwrap();
        assert_eq!(first("dragon.stl"), "dragon.stl");
        assert_eq!(first("../../etc/passwd"), "passwd");
        assert_eq!(first("C:\\x\\a:b.obj"), "a_b.obj");
        assert_eq!(first("figure.shellock.toml"), "model-figure.shellock.toml");
        assert_eq!(first(".hidden"), "hidden");
        assert_eq!(first("kit"), "model-kit");
        for odd in ["", "..", "/", "...", " "] {
            assert!(first(odd).starts_with("model-"), "{odd}: {}", first(odd));
        }
        assert_eq!(names_like("a.stl").nth(1).unwrap(), "a-2.stl");
    }

    #[test]
    fn a_project_is_read_as_it_was_saved() {
        let dir = tempfile::tempdir().unwrap();
        let (store, found) = Store::open(dir.path().join("new")).unwrap();
        assert!(found.model.is_none() && found.choices.is_empty());
        let model = store.keep("a.stl", b"solid").unwrap();
        let choices: Choices = vec![
            ("size".into(), Choice::Text("150".into())),
            ("keep-whole".into(), Choice::Many(vec!["1,2,3,4".into()])),
            ("key-grip".into(), Choice::On),
        ];
        store.save(Some(&model), &choices, Some(&[1, 2, 2])).unwrap();
        let (again, found) = Store::open(dir.path().join("new")).unwrap();
        assert_eq!(
            (&found.model, &found.choices, &found.labels),
            (&Some(model), &choices, &Some(vec![1, 2, 2]))
        );
        let before = store.state();
        again
            .save(found.model.as_ref(), &found.choices, found.labels.as_deref())
            .unwrap();
        assert_eq!(again.state(), before, "opening a project does not change it");
        assert!(again.kit().is_none());
    }

    #[test]
    fn no_file_of_the_folder_is_replaced_by_a_model() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("a.stl"), "mine").unwrap();
        let (store, _) = Store::open(dir.path().to_owned()).unwrap();
        assert_eq!(store.keep("a.stl", b"yours").unwrap().file, "a-2.stl");
        assert_eq!(store.keep("a.stl", b"mine").unwrap().file, "a.stl");
        assert_eq!(fs::read(dir.path().join("a.stl")).unwrap(), b"mine");
    }

    /// A folder with a project from elsewhere: these lines, and these labels.
    fn project_of(lines: &str, labels: &str) -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        fs::write(
            dir.path().join(PROJECT),
            format!("labels = \"{LABELS}\"\n{lines}\n"),
        )
        .unwrap();
        fs::write(dir.path().join(LABELS), labels).unwrap();
        dir
    }

    /// For each option that may name a label: the faces that have the label, or else the option's own text.
    fn meaning(folder: &Path) -> Vec<String> {
        let labels = read_labels(&fs::read(folder.join(LABELS)).unwrap()).unwrap();
        let faces = |text: String| match text.parse::<i64>() {
            Ok(label) => format!("{:?}", labels.iter().map(|l| *l == label).collect::<Vec<_>>()),
            Err(_) => text,
        };
        let file: toml::Table = fs::read_to_string(folder.join(PROJECT)).unwrap().parse().unwrap();
        let text = |value: &toml::Value| {
            let number = value.as_integer().map(|number| number.to_string());
            number.unwrap_or_else(|| value.as_str().unwrap().to_owned())
        };
        let texts = ["key", "keep-whole"].map(|name| match &file[name] {
            toml::Value::Array(all) => all.iter().map(text).collect(),
            one => vec![text(one)],
        });
        texts.concat().into_iter().map(faces).collect()
    }

    #[test]
    fn options_that_name_labels_mean_the_same_faces_after_a_project_is_saved() {
        for labels in ["0\n1\n2\n2\n", "1\n2\n3\n3\n", "2\n5\n5\n9\n", "0\n2\n1\n70000\n"] {
            for lines in [
                "key = 2\nkeep-whole = [\"0\", \"1\", \"0,0,9,5\"]",
                "key = \"2\"\nkeep-whole = 1",
                "key = \"auto\"\nkeep-whole = [2]",
                "key = \"1,2,3\"\nkeep-whole = \"2\"",
            ] {
                let dir = project_of(lines, labels);
                let before = meaning(dir.path());
                let (store, found) = Store::open(dir.path().to_owned()).unwrap();
                store.save(None, &found.choices, found.labels.as_deref()).unwrap();
                assert_eq!(meaning(dir.path()), before, "{lines} {labels:?}");
                let (_, again) = Store::open(dir.path().to_owned()).unwrap();
                assert_eq!((again.choices, again.labels), (found.choices, found.labels));
            }
        }
    }

    #[test]
    fn labels_far_apart_are_numbered_and_more_than_can_be_painted_are_refused() {
        let dir = project_of(
            "key = 9\nkeep-whole = [7]",
            "9\n4294967295\n9223372036854775807\n",
        );
        let (_, found) = Store::open(dir.path().to_owned()).unwrap();
        assert_eq!(found.labels, Some(vec![0, 1, 2]));
        let choices: Choices = vec![
            ("key".into(), Choice::Text("1".into())),
            ("keep-whole".into(), Choice::Many(vec!["0".into()])),
        ];
        assert_eq!(found.choices, choices, "no face has label 7");
        let too_many: String = (0..=N_LABELS).map(|label| format!("{label}\n")).collect();
        let dir = project_of("", &too_many);
        let refused = Store::open(dir.path().to_owned()).err().expect("it is refused");
        assert!(refused.to_string().contains("1025 labels"), "{refused}");
    }
}

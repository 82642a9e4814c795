//! Project file: a model by its hash, and all that was chosen for it. `build` makes the same kit of it
//! anywhere.
//!
//! ```toml
//! size = "150mm"
//! printer = "fdm"
//! labels = "labels.seg"       # beside this file
//!
//! [model]
//! file = "dragon.stl"         # beside this file
//! sha256 = "9f86d081884c7d65…"
//! ```
//!
//! It is a configuration file (`config`) that names its model, too. Options have their names on the command
//! line; the user's own printers may follow.

use std::ffi::OsStr;
use std::path::{Component, Path, PathBuf};

use serde::Deserialize;
use toml_edit::{DocumentMut, Item, Table, Value, value};

use crate::options::Choice;

/// Ending of a project file's name.
pub const SUFFIX: &str = ".shellock.toml";

/// Reference to a project's model.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelOf {
    /// Name of the model's file, beside the project file.
    pub file: String,
    /// SHA-256 of the file's bytes.
    pub sha256: String,
}

impl ModelOf {
    /// Path of the model's file for a project in `folder`; fails if the name leads out of the folder.
    pub fn path(&self, folder: &Path) -> Result<PathBuf, String> {
        beside(folder, &self.file)
    }
}

/// Path of `name` in `folder`; fails unless `name` is a plain file name.
pub fn beside(folder: &Path, name: &str) -> Result<PathBuf, String> {
    let mut parts = Path::new(name).components();
    match (parts.next(), parts.next()) {
        (Some(Component::Normal(part)), None) if part == OsStr::new(name) => Ok(folder.join(name)),
        _ => Err(format!(
            "\"{name}\" must be the name of a file beside the project file"
        )),
    }
}

/// Returns true if `path` has the ending of project files.
pub fn is_project(path: &Path) -> bool {
    path.file_name()
        .is_some_and(|name| name.to_string_lossy().ends_with(SUFFIX))
}

/// Contents of a project file that is to be written.
pub struct Project<'a> {
    /// Model of the project.
    pub model: Option<&'a ModelOf>,
    /// Chosen options by their long names.
    pub choices: &'a [(String, Choice)],
    /// `[printers]` of the configuration file that the project began with, unchanged.
    pub printers: Option<&'a Item>,
}

impl Project<'_> {
    /// Text of the project file.
    pub fn to_toml(&self) -> String {
        let mut file = DocumentMut::new();
        for (name, choice) in self.choices {
            file[name.as_str()] = match choice {
                Choice::On => value(true),
                Choice::Text(text) => value(text.as_str()),
                Choice::Many(texts) => value(texts.iter().map(String::as_str).collect::<Value>()),
            };
        }
        if let Some(model) = self.model {
            let mut table = Table::new();
            table["file"] = value(model.file.as_str());
            table["sha256"] = value(model.sha256.as_str());
            file["model"] = Item::Table(table);
        }
        if let Some(printers) = self.printers {
            file["printers"] = printers.clone();
        }
        format!("# A project of Shellock: `shellock build` makes its kit.\n{file}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_a_configuration_and_a_model() {
        let model = ModelOf {
            file: "a \"b\".stl".into(),
            sha256: "00ff".into(),
        };
        let choices = [
            ("size".to_owned(), Choice::Text("150mm".into())),
            ("key-grip".to_owned(), Choice::On),
            (
                "keep-whole".to_owned(),
                Choice::Many(vec!["1,2,3,4".into(), "5".into()]),
            ),
        ];
        let text = Project {
            model: Some(&model),
            choices: &choices,
            printers: None,
        }
        .to_toml();
        let table: toml::Table = text.parse().expect("it is TOML");
        assert_eq!(table["size"].as_str(), Some("150mm"));
        assert_eq!(table["key-grip"].as_bool(), Some(true));
        assert_eq!(table["keep-whole"].as_array().map(Vec::len), Some(2));
        let read: ModelOf = table["model"].clone().try_into().expect("it is a model");
        assert_eq!(read, model);
    }

    #[test]
    fn a_model_lies_beside_its_project() {
        let folder = Path::new("/tmp/x");
        assert_eq!(beside(folder, "a.stl"), Ok(folder.join("a.stl")));
        for elsewhere in ["../a.stl", "/etc/passwd", "a/b.stl", "", ".", "..", "a.stl/"] {
            assert!(beside(folder, elsewhere).is_err(), "{elsewhere}");
        }
    }
}

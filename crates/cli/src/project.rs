//! A project file: a model by its hash, and all that was chosen for it. `build` makes it into the same kit anywhere.
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
//! It is a configuration file (`config`) that names its model, too: options have the names that they have on the command
//! line, and printers of one's own may follow.

use std::ffi::OsStr;
use std::path::{Component, Path, PathBuf};

use serde::Deserialize;
use toml_edit::{DocumentMut, Item, Table, Value, value};

/// How the name of a project file ends.
pub const SUFFIX: &str = ".shellock.toml";

/// Where a project's model is.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelOf {
    /// Its file, beside the project file.
    pub file: String,
    /// Of the file's bytes.
    pub sha256: String,
}

impl ModelOf {
    /// The file of a project in `folder`; fails where its name leads elsewhere.
    pub fn path(&self, folder: &Path) -> Result<PathBuf, String> {
        beside(folder, &self.file)
    }
}

/// `name` in `folder`, where it is a plain name.
pub fn beside(folder: &Path, name: &str) -> Result<PathBuf, String> {
    let mut parts = Path::new(name).components();
    match (parts.next(), parts.next()) {
        (Some(Component::Normal(part)), None) if part == OsStr::new(name) => Ok(folder.join(name)),
        _ => Err(format!(
            "\"{name}\" must be the name of a file beside the project file"
        )),
    }
}

/// Whether `path` is named as project files are.
pub fn is_project(path: &Path) -> bool {
    path.file_name()
        .is_some_and(|name| name.to_string_lossy().ends_with(SUFFIX))
}

/// What is chosen of one option.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Choice {
    /// A flag is set.
    On,
    /// It has this value.
    Text(String),
    /// It is given several times.
    Many(Vec<String>),
}

/// A project as it is written.
pub struct Project<'a> {
    pub model: Option<&'a ModelOf>,
    /// Options by their long names.
    pub choices: &'a [(String, Choice)],
    /// `[printers]` of the configuration file that it began with, as it stands there.
    pub printers: Option<&'a Item>,
}

impl Project<'_> {
    /// The file's text.
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

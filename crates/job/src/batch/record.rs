//! Result of one model in a batch.

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::Entry;
use crate::failure::{Failure, TIME_UP};
use crate::files::with_slashes;
use crate::files::write;
use crate::input::sha256;
use crate::output::PLAN;

/// Outcome for one model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// The kit passes every check.
    Verified,
    /// The kit fails a check.
    Failed,
    /// No plan was found.
    NoPlan,
    /// The model is not a closed body, is too thin, or is broken.
    Refused,
    /// The model took longer than allowed.
    TooLong,
    /// The program ended abnormally.
    Crashed,
}

impl Status {
    /// All statuses, the best first.
    pub const ALL: [Self; 6] = [
        Self::Verified,
        Self::Failed,
        Self::NoPlan,
        Self::Refused,
        Self::TooLong,
        Self::Crashed,
    ];

    /// Status for the exit code of `build`; crashed for unknown codes and for none.
    pub fn of_code(code: Option<i32>) -> Self {
        match code {
            Some(0) => Self::Verified,
            Some(1) => Self::Failed,
            Some(3) => Self::NoPlan,
            Some(2) => Self::Refused,
            _ => Self::Crashed,
        }
    }

    /// Name of the status in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Verified => "verified",
            Self::Failed => "failed",
            Self::NoPlan => "no-plan",
            Self::Refused => "refused",
            Self::TooLong => "too-long",
            Self::Crashed => "crashed",
        }
    }

    /// Returns true if there is a kit, whether it passes or not.
    pub fn has_kit(self) -> bool {
        matches!(self, Self::Verified | Self::Failed)
    }

    /// Returns true if the same inputs would give the same status again.
    fn is_final(self) -> bool {
        !matches!(self, Self::TooLong | Self::Crashed)
    }
}

/// Result of one model, as stored and as shown.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Record {
    /// Hash of all inputs: the model's bytes, the options, the configuration file, the program.
    pub made_of: String,
    /// Path of the model, within the folder of models.
    pub model: String,
    /// Path of the kit, within the folder for kits.
    pub kit: String,
    /// Outcome of the run.
    pub status: Status,
    /// Time that the run took, s.
    pub seconds: f64,
    /// Peak memory, MB; `None` if the system does not report it.
    pub peak_mb: Option<f64>,
    /// Number of pieces of the kit.
    pub pieces: Option<u64>,
    /// Volume of the pieces over that of the solid model.
    pub volume_ratio: Option<f64>,
    /// Number of its warnings, notes apart.
    pub n_warnings: usize,
    /// Number of its problems, which are severe.
    pub n_problems: usize,
    /// Messages, most severe first.
    pub said: Vec<String>,
    /// Fingerprint of the kit's folder, from [`kit_is`]; `None` if there is no kit.
    #[serde(default)]
    pub kit_is: Option<String>,
    /// True if the time ran out before a kit passed, while other models shared the cores. The model is then
    /// made again.
    #[serde(default)]
    pub lacks_time: bool,
    /// True if the record is from an earlier run.
    #[serde(skip)]
    pub is_old: bool,
    /// Failure to write a record, which ends the batch with an error.
    #[serde(skip)]
    pub unwritten: Option<String>,
}

/// Fingerprint of a kit's folder, from the names and sizes of its files and its plan; `None` if there is no
/// folder.
pub fn kit_is(folder: &Path) -> Option<String> {
    let mut told: Vec<String> = Vec::new();
    let mut left = vec![folder.to_owned()];
    while let Some(here) = left.pop() {
        for entry in fs::read_dir(here).ok()?.flatten() {
            let (path, data) = (entry.path(), entry.metadata().ok()?);
            if data.is_dir() {
                left.push(path);
            } else {
                told.push(format!(
                    "{} {}",
                    with_slashes(path.strip_prefix(folder).ok()?),
                    data.len()
                ));
            }
        }
    }
    told.sort_unstable();
    told.push(sha256(&fs::read(folder.join(PLAN)).unwrap_or_default()));
    Some(sha256(told.join("\n").as_bytes()))
}

impl Record {
    /// Record of a model that has no result yet.
    pub fn blank(entry: &Entry, made_of: String) -> Self {
        Self {
            made_of,
            model: with_slashes(&entry.model),
            kit: with_slashes(&entry.kit),
            status: Status::Refused,
            seconds: 0.0,
            peak_mb: None,
            pieces: None,
            volume_ratio: None,
            n_warnings: 0,
            n_problems: 0,
            said: Vec::new(),
            kit_is: None,
            lacks_time: false,
            is_old: false,
            unwritten: None,
        }
    }

    /// Reads the record at `path`. `None` unless it was made from the same inputs, its status is final, and
    /// the kit's folder is unchanged. A run without a kit matches only an absent folder: leftovers may have
    /// caused the failure.
    pub fn read(path: &Path, made_of: &str, kit: &Path) -> Option<Self> {
        let bytes = fs::read(path).ok()?;
        let record: Self = serde_json::from_slice(&bytes).ok()?;
        let has_kit = record.kit_is == kit_is(kit) && record.kit_is.is_some() == record.status.has_kit();
        let is_same = record.made_of == made_of && record.status.is_final() && has_kit;
        is_same.then_some(Self {
            is_old: true,
            ..record
        })
    }

    /// Writes the record as JSON.
    pub fn write(&self, path: &Path) -> Result<(), Failure> {
        let text = serde_json::to_string_pretty(self).expect("it is plain data");
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(Failure::unwritable(folder))?;
        }
        write(path, text.as_bytes())
    }

    /// Adds the results in the output of `build --json`.
    pub fn of_output(mut self, output: &str) -> Self {
        let told: Value = output
            .lines()
            .next_back()
            .and_then(|line| serde_json::from_str(line).ok())
            .unwrap_or_default();
        self.pieces = told["pieces"].as_u64();
        self.volume_ratio = told["volume_ratio"].as_f64();
        let text = |value: &Value| value.as_str().map(str::to_owned);
        let warnings = told["warnings"].as_array().cloned().unwrap_or_default();
        let with = |severity: &str| warnings.iter().filter(|w| w["severity"] == severity).count();
        (self.n_warnings, self.n_problems) = (with("warning"), with("problem"));
        self.lacks_time = told["code"] == TIME_UP || warnings.iter().any(|w| w["code"] == TIME_UP);
        self.said.extend(text(&told["error"]));
        let failed = told["checks"].as_array().into_iter().flatten();
        let failed = failed.filter(|check| check["ok"] == false);
        self.said.extend(failed.filter_map(|check| {
            Some(format!(
                "{}: {}",
                check["name"].as_str()?,
                check["figure"].as_str()?
            ))
        }));
        for severity in ["problem", "warning"] {
            let of = warnings.iter().filter(|w| w["severity"] == severity);
            self.said.extend(of.filter_map(|w| text(&w["message"])));
        }
        self
    }

    /// Summary in one line for people.
    pub fn line(&self) -> String {
        let pieces = self.pieces.map_or(String::new(), |n| format!(", {n} pieces"));
        let why = match self.status {
            Status::Verified => "",
            _ => self
                .said
                .first()
                .map_or("", |said| said.lines().next().unwrap_or("")),
        };
        let why = if why.is_empty() {
            String::new()
        } else {
            format!(": {why}")
        };
        let old = if self.is_old { ", as it was" } else { "" };
        format!(
            "{} {}{pieces}, {:.0} s{old}{why}",
            self.model,
            self.status.name(),
            self.seconds
        )
    }
}

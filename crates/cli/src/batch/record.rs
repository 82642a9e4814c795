//! What came of one model.

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use shellock_studio::with_slashes;

use super::run::Job;
use crate::failure::{Failure, TIME_UP};
use crate::input::sha256;
use crate::output::PLAN;
use crate::stages::write;

/// How a model ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// A kit that passes every check.
    Verified,
    /// A kit that does not.
    Failed,
    /// No plan was found.
    NoPlan,
    /// The model is no closed body, too thin, or broken.
    Refused,
    /// It took longer than it may.
    TooLong,
    /// The program ended as it should never.
    Crashed,
}

impl Status {
    pub const ALL: [Self; 6] = [
        Self::Verified,
        Self::Failed,
        Self::NoPlan,
        Self::Refused,
        Self::TooLong,
        Self::Crashed,
    ];

    /// That `build` ended with this exit code.
    pub fn of_code(code: Option<i32>) -> Self {
        match code {
            Some(0) => Self::Verified,
            Some(1) => Self::Failed,
            Some(3) => Self::NoPlan,
            Some(2) => Self::Refused,
            _ => Self::Crashed,
        }
    }

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

    /// Whether there is a kit, be it good or not.
    pub fn has_kit(self) -> bool {
        matches!(self, Self::Verified | Self::Failed)
    }

    /// Whether the same inputs would end so again.
    fn is_final(self) -> bool {
        !matches!(self, Self::TooLong | Self::Crashed)
    }
}

/// What came of one model, as it is kept and told.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Record {
    /// Hash of all that it was made of: the model's bytes, the options, the program.
    pub made_of: String,
    /// The model, within the folder.
    pub model: String,
    /// Its kit, within the folder for kits.
    pub kit: String,
    pub status: Status,
    pub seconds: f64,
    /// Most memory that it took; `None` where the system does not tell.
    pub peak_mb: Option<f64>,
    pub pieces: Option<u64>,
    pub volume_ratio: Option<f64>,
    pub n_warnings: usize,
    pub n_problems: usize,
    /// What was said, the most severe first.
    pub said: Vec<String>,
    /// What tells its kit from any other that lies there later; `None` where there is none.
    #[serde(default)]
    pub kit_is: Option<String>,
    /// Whether the time was over before a kit passed, with a share of the cores: alone it may, and is made again.
    #[serde(default)]
    pub lacks_time: bool,
    /// Whether it was there already.
    #[serde(skip)]
    pub is_old: bool,
    /// A failure to write anything: no use to go on.
    #[serde(skip)]
    pub unwritten: Option<String>,
}

/// The files of a kit with their sizes, and what its plan says, in one word; `None` where nothing lies there.
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
    /// Of a model of which nothing came yet.
    pub fn blank(job: &Job, made_of: String) -> Self {
        Self {
            made_of,
            model: with_slashes(&job.model),
            kit: with_slashes(&job.kit),
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

    /// The one at `path`, where it is of the same inputs, final, and its kit is as it was: none where there was none, as
    /// what lay there may have been why.
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

    pub fn write(&self, path: &Path) -> Result<(), Failure> {
        let text = serde_json::to_string_pretty(self).expect("it is plain data");
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(Failure::unwritable(folder))?;
        }
        write(path, text.as_bytes())
    }

    /// What `build --json` said.
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

    /// A line for people.
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

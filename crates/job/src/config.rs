//! Contents of a configuration file: options by their names, and the user's own printers.
//!
//! ```toml
//! printer = "workshop"
//! size = 180
//! key-grip = true
//!
//! [printers.workshop]
//! like = "fdm"            # what is not said here is taken from this one
//! bed = [300, 300, 340]   # width, depth, height, mm
//! clearance = 0.18
//! ```

use std::fs;
use std::path::Path;

use serde::Deserialize;
use shellock_print::printer::Pace;
use shellock_print::{Printer, Process};

use crate::options::material;
use crate::printers;
use crate::project::ModelOf;

/// Name of the file that is read without being named.
pub const USUAL: &str = "shellock.toml";
/// Size limit of a configuration file, bytes.
const MOST_BYTES: u64 = 1 << 20;

/// Contents of a configuration file.
pub struct Config {
    /// Options by their names.
    pub options: toml::Table,
    /// Printers of the user.
    pub printers: Vec<Printer>,
    /// Model of a project file; `None` in a plain configuration.
    pub model: Option<ModelOf>,
}

/// One printer as the file declares it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct Own {
    title: Option<String>,
    like: Option<String>,
    process: Option<String>,
    bed: Option<[f64; 3]>,
    clearance: Option<f64>,
    key_clearance: Option<f64>,
    #[serde(alias = "wall-gap")]
    tolerance: Option<f64>,
    min_wall: Option<f64>,
    layer: Option<f64>,
    material: Option<String>,
    fast: Option<bool>,
}

impl Own {
    fn pace(&self) -> Option<Pace> {
        self.fast
            .map(|is_fast| if is_fast { Pace::Fast } else { Pace::Usual })
    }
}

/// Reads a configuration file.
pub fn read(path: &Path) -> Result<Config, String> {
    let size = fs::metadata(path).map_err(|e| e.to_string())?.len();
    if size > MOST_BYTES {
        return Err(format!("{size} bytes are too many for a configuration"));
    }
    parse(&fs::read_to_string(path).map_err(|e| e.to_string())?)
}

/// Returns `[printers]` of the usual file, unchanged. `None` if there is no such file or it cannot be read.
pub fn usual_printers() -> Option<toml_edit::Item> {
    let text = fs::read_to_string(USUAL).ok()?;
    let file: toml_edit::DocumentMut = text.parse().ok()?;
    file.get("printers").cloned()
}

/// Returns the model that a project file names.
pub fn project_model(text: &str) -> Result<Option<ModelOf>, String> {
    Ok(parse(text)?.model)
}

/// Returns the printers of a configuration.
pub fn printers_of(text: &str) -> Result<Vec<Printer>, String> {
    Ok(parse(text)?.printers)
}

fn parse(text: &str) -> Result<Config, String> {
    let mut options: toml::Table = text.parse().map_err(|e: toml::de::Error| e.to_string())?;
    let printers = match options.remove("printers") {
        None => Vec::new(),
        Some(toml::Value::Table(printers)) => printers_in(printers, printers::shipped())?,
        Some(_) => return Err("\"printers\" must be a table; write for example [printers.mine]".to_owned()),
    };
    let model = options.remove("model").map(toml::Value::try_into).transpose();
    let model = model.map_err(|e: toml::de::Error| format!("[model]: {}", e.message()))?;
    Ok(Config {
        options,
        printers,
        model,
    })
}

/// Returns the printers that a text declares, each under its name, like one of `known`.
pub(crate) fn table_of_printers(text: &str, known: &[Printer]) -> Result<Vec<Printer>, String> {
    printers_in(text.parse().map_err(|e: toml::de::Error| e.to_string())?, known)
}

fn printers_in(table: toml::Table, known: &[Printer]) -> Result<Vec<Printer>, String> {
    let printers = table.into_iter();
    printers
        .map(|(name, value)| own_printer(name, value, known))
        .collect()
}

fn own_printer(name: String, value: toml::Value, known: &[Printer]) -> Result<Printer, String> {
    let fault = |problem: String| format!("printer \"{name}\": {problem}");
    let own: Own = value
        .try_into()
        .map_err(|e: toml::de::Error| fault(e.message().to_owned()))?;
    let process = own.process.as_deref().map(|p| {
        let names = || Process::ALL.map(|(name, _)| name).join(", ");
        Process::from_name(p)
            .ok_or_else(|| fault(format!("there is no process \"{p}\"; choose one of {}", names())))
    });
    let process = process.transpose()?;
    let is_base = |p: &Printer| match (&own.like, process) {
        (Some(like), _) => p.name.eq_ignore_ascii_case(like),
        (None, process) => p.process == process.unwrap_or(Process::Sla),
    };
    let unknown = || {
        fault(format!(
            "it is like \"{}\", which does not exist",
            own.like.as_deref().unwrap_or_default()
        ))
    };
    let base = known.iter().find(|p| is_base(p)).cloned().ok_or_else(unknown)?;
    let material = own.material.as_deref().map(material).transpose().map_err(fault)?;
    let printer = Printer {
        process: process.unwrap_or(base.process),
        bed_mm: own.bed.unwrap_or(base.bed_mm),
        clearance_mm: own.clearance.unwrap_or(base.clearance_mm),
        key_clearance_mm: own.key_clearance.unwrap_or(base.key_clearance_mm),
        tolerance_mm: own.tolerance.unwrap_or(base.tolerance_mm),
        min_wall_mm: own.min_wall.unwrap_or(base.min_wall_mm),
        layer_mm: own.layer.unwrap_or(base.layer_mm),
        material: material.unwrap_or(base.material),
        pace: own.pace().or(base.pace),
        title: own.title.unwrap_or(base.title),
        name: name.clone(),
    };
    match printer.problems().first() {
        Some(problem) => Err(fault(problem.to_string())),
        None => Ok(printer),
    }
}

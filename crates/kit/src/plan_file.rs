//! `plan.json`: pieces, order, directions and figures of a kit.
//!
//! Each object of the file has a type, and fields have the file's names. Places and directions are in
//! assembly space, lengths in mm. Fields that no command needs are optional. Files of other versions are
//! rejected.

mod checked;
mod entries;
mod error;
mod fill;
#[cfg(test)]
mod tests;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;
use shellock::design::Effort;
use shellock::metric::{Bears, Holding};
use shellock::plan::PlanProof;
use shellock_assembly::PressFit;
use shellock_report::PatchId;
use shellock_report::WarningEntry;

pub use entries::{
    ContactEntry, GapsEntry, InputEntry, JointEntry, KeyEntry, LaidEntry, LoosestEntry, PairSizeEntry,
    PieceEntry, PlayEntry, PrintingEntry, RattleEntry, RepairEntry, SolidEntry, StrengthEntry, TimeEntry,
    TriedEntry, VerdictEntry,
};
pub use error::PlanFileError;
pub use fill::{Source, Told, piece_file};

/// Value of the field `format`.
pub const FORMAT: &str = "shellock-plan";
/// Value of the field `version`. It grows when a reader of the previous version would misinterpret the file.
pub const VERSION: u64 = 2;

/// All contents of `plan.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlanFile {
    /// Kind of file: [`FORMAT`].
    pub format: Option<String>,
    /// Version of the format: [`VERSION`].
    pub version: Option<u64>,
    /// Unit of lengths: "mm".
    pub units: Option<String>,
    /// Version of the program that made the kit.
    pub program: Option<String>,
    /// Model that the kit was made from.
    pub input: Option<InputEntry>,
    /// Seed of all random choices.
    #[serde(default)]
    pub seed: u64,
    /// Thickness of the walls, mm.
    pub shell_thickness: Option<f64>,
    /// Strength of the walls; `None` if it could not be computed.
    pub strength: Option<StrengthEntry>,
    /// Gap between mating faces, mm: the larger of the connectors' clearance and the gap between both sides
    /// of a seam.
    #[serde(default)]
    pub clearance: f64,
    /// Size D of the connectors, mm; the largest if pairs have sizes of their own.
    pub connector_size: Option<f64>,
    /// Connector sizes of pairs; `None` if all pairs have the same size.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub connector_sizes: Option<Vec<PairSizeEntry>>,
    /// Distance by which each side of a seam is set back, mm.
    pub wall_gap: Option<f64>,
    /// Upward direction of the standing model, of any length.
    pub up: Option<[f64; 3]>,
    /// Thinnest wall that is made, mm.
    pub min_wall: Option<f64>,
    /// Piece that is installed last.
    pub key_piece: Option<PatchId>,
    /// Cut of the key; `None` if the key is one of the pieces.
    pub key: Option<KeyEntry>,
    /// Press fits of the key.
    #[serde(default, deserialize_with = "null_is_none")]
    pub press_fits: Vec<PressFit>,
    /// Pieces, each at the index of its id.
    pub pieces: Vec<PieceEntry>,
    /// Ids of the pieces in order of installation.
    pub installation_order: Vec<PatchId>,
    /// Quality of the plan.
    pub plan: Option<PlanProof>,
    /// Simulated resistance of the plan to separation.
    pub holding: Option<Holding>,
    /// Summary of the loads that the kit withstands.
    pub bears: Option<Bears>,
    /// Material of all pieces divided by that of the solid model.
    pub volume_ratio: Option<f64>,
    /// Length of connectors made divided by the length that the seams' geometry allows, in [0, 1].
    pub connector_share: Option<f64>,
    /// Runs of connectors, with the result of carving.
    #[serde(default)]
    pub joints: Vec<JointEntry>,
    /// Seams, with the length usable for connectors.
    #[serde(default)]
    pub contacts: Vec<ContactEntry>,
    /// Least gaps between pieces.
    pub gaps: Option<GapsEntry>,
    /// Computing effort to find the kit, in units of work. Independent of machine and number of threads.
    pub effort: Option<Effort>,
    /// Verdict on the finished pieces.
    pub verification: Option<VerdictEntry>,
    /// Warnings for the user.
    #[serde(default)]
    pub warnings: Vec<WarningEntry>,
    /// Layout of the pieces on the plates of a printer.
    pub printing: Option<PrintingEntry>,
}

/// Rejects a plan of another format or version.
fn check_version(plan: &Value) -> Result<(), PlanFileError> {
    if plan["format"] != FORMAT {
        return Err(PlanFileError::OtherFormat);
    }
    match plan["version"].as_u64() {
        Some(VERSION) => Ok(()),
        Some(version @ 1..) => Err(PlanFileError::OtherVersion { version }),
        _ => Err(PlanFileError::OtherFormat),
    }
}

impl PlanFile {
    /// Parses a plan from the bytes of its file.
    ///
    /// Consistency of its parts is checked by the methods that rely on it, such as [`Self::order`].
    ///
    /// Errors: no JSON, no object, another format or version, or a field that is missing or mistyped.
    pub fn read(bytes: &[u8]) -> Result<Self, PlanFileError> {
        let value: Value = serde_json::from_slice(bytes).map_err(PlanFileError::NotJson)?;
        if !value.is_object() {
            return Err(PlanFileError::NotAnObject);
        }
        check_version(&value)?;
        serde_path_to_error::deserialize(value).map_err(|e| PlanFileError::Mistyped {
            field: e.path().to_string(),
            problem: e.into_inner().to_string(),
        })
    }

    /// Writes the file, with fields in alphabetical order, one per line.
    pub fn to_bytes(&self) -> Vec<u8> {
        // A JSON value sorts its fields.
        let text = serde_json::to_value(self).and_then(|value| serde_json::to_string_pretty(&value));
        let mut text = text.expect("numbers and strings can be written");
        text.push('\n');
        text.into_bytes()
    }
}

/// Deserialises a `T`, or `None` from a value of another form.
fn if_readable<'de, D: Deserializer<'de>, T: DeserializeOwned>(from: D) -> Result<Option<T>, D::Error> {
    let value = Value::deserialize(from)?;
    Ok(serde_json::from_value(value).ok())
}

/// Deserialises a list; null gives an empty one.
fn null_is_none<'de, D: Deserializer<'de>, T: Deserialize<'de>>(from: D) -> Result<Vec<T>, D::Error> {
    Ok(Option::<Vec<T>>::deserialize(from)?.unwrap_or_default())
}

/// Deserialises `Some` even from null, so that null differs from a missing field.
fn even_null<'de, D: Deserializer<'de>, T: Deserialize<'de>>(from: D) -> Result<Option<T>, D::Error> {
    T::deserialize(from).map(Some)
}

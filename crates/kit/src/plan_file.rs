//! `plan.json`: pieces, order, directions and figures of a kit.
//!
//! There is one type for each object of the file, and fields have the file's names. Places and directions are
//! in assembly space, lengths in mm. What a kit of an earlier version may lack is optional. Files of former versions
//! are converted before they are read, those of later versions are refused.

mod checked;
mod entries;
mod error;
mod fill;
mod former;
#[cfg(test)]
mod tests;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;
use shellock::design::Effort;
use shellock::metric::{Bears, Holding};
use shellock::plan::PlanProof;
use shellock_assembly::warning::WarningEntry;
use shellock_assembly::{PatchId, PressFit};

pub use entries::{
    ContactEntry, GapsEntry, InputEntry, JointEntry, KeyEntry, LaidEntry, LoosestEntry, PairSizeEntry,
    PieceEntry, PlayEntry, PrintingEntry, RattleEntry, RepairEntry, SolidEntry, StrengthEntry, TimeEntry,
    TriedEntry, VerdictEntry,
};
pub use error::PlanFileError;
pub use fill::{Source, Told, piece_file};

/// What `format` says.
pub const FORMAT: &str = "shellock-plan";
/// What `version` says. It grows where a reader of before would misunderstand what is written now.
pub const VERSION: u64 = 2;

/// The whole file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlanFile {
    /// [`FORMAT`].
    pub format: Option<String>,
    /// [`VERSION`].
    pub version: Option<u64>,
    /// Unit of lengths: "mm".
    pub units: Option<String>,
    /// Version of the program that made the kit.
    pub program: Option<String>,
    /// The model that it was made from.
    pub input: Option<InputEntry>,
    /// Seed of all random choices.
    #[serde(default)]
    pub seed: u64,
    /// Thickness of the walls, mm.
    pub shell_thickness: Option<f64>,
    /// What the walls bear; `None` where that could not be computed.
    pub strength: Option<StrengthEntry>,
    /// Gap between mating faces, mm: that of connectors or of both sides of a seam, whichever is more.
    #[serde(default)]
    pub clearance: f64,
    /// Size D of the connectors, mm; the largest where pairs have sizes of their own.
    pub connector_size: Option<f64>,
    /// Sizes of pairs; only where pairs have sizes of their own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub connector_sizes: Option<Vec<PairSizeEntry>>,
    /// How far each side of a seam stays back, mm.
    pub wall_gap: Option<f64>,
    /// Which way is up when the model stands: a direction of any length.
    pub up: Option<[f64; 3]>,
    /// Thinnest wall that is made, mm.
    pub min_wall: Option<f64>,
    /// The piece that goes in last.
    pub key_piece: Option<PatchId>,
    /// How the key was cut; `None` where it is one of the pieces.
    pub key: Option<KeyEntry>,
    /// Places where the key presses on purpose.
    #[serde(default, deserialize_with = "null_is_none")]
    pub press_fits: Vec<PressFit>,
    /// The pieces, each at the place of its id.
    pub pieces: Vec<PieceEntry>,
    /// Their ids, first to last.
    pub installation_order: Vec<PatchId>,
    /// How good the plan is; `None` where version 1 told it in another way.
    pub plan: Option<PlanProof>,
    /// How the plan holds by simulation; `None` where version 1 told it in another way.
    pub holding: Option<Holding>,
    /// What the kit bears, in short; `None` in kits of version 1.
    pub bears: Option<Bears>,
    /// Material of all pieces over the solid model's.
    pub volume_ratio: Option<f64>,
    /// Length of connectors made over the length that the seams' geometry allows, in [0, 1].
    pub connector_share: Option<f64>,
    /// Runs of connectors and how they came out.
    #[serde(default)]
    pub joints: Vec<JointEntry>,
    /// Seams and what they offered for connectors.
    #[serde(default)]
    pub contacts: Vec<ContactEntry>,
    /// How near pieces come.
    pub gaps: Option<GapsEntry>,
    /// What it took to find the kit, in work: the same on any machine and number of threads.
    pub effort: Option<Effort>,
    /// The verdict on the finished pieces.
    pub verification: Option<VerdictEntry>,
    /// What the user should know.
    #[serde(default)]
    pub warnings: Vec<WarningEntry>,
    /// The pieces on the plates of a printer.
    pub printing: Option<PrintingEntry>,
}

impl PlanFile {
    /// The plan that these bytes are. Whether its parts agree is asked by those who need them, such as
    /// [`Self::order`].
    pub fn read(bytes: &[u8]) -> Result<Self, PlanFileError> {
        let value: Value = serde_json::from_slice(bytes).map_err(PlanFileError::NotJson)?;
        if !value.is_object() {
            return Err(PlanFileError::NotAnObject);
        }
        serde_path_to_error::deserialize(former::converted(value)?)
            .map_err(|e| PlanFileError::of_field(&e.path().to_string(), &e.inner().to_string()))
    }

    /// As it is written: fields in alphabetical order, a line each.
    pub fn to_bytes(&self) -> Vec<u8> {
        // By way of a value, whose fields are sorted.
        let text = serde_json::to_value(self).and_then(|value| serde_json::to_string_pretty(&value));
        let mut text = text.expect("numbers and strings can be written");
        text.push('\n');
        text.into_bytes()
    }
}

/// `None` where it is of another form than `T`.
fn if_readable<'de, D: Deserializer<'de>, T: DeserializeOwned>(from: D) -> Result<Option<T>, D::Error> {
    let value = Value::deserialize(from)?;
    Ok(serde_json::from_value(value).ok())
}

/// An empty list for null.
fn null_is_none<'de, D: Deserializer<'de>, T: Deserialize<'de>>(from: D) -> Result<Vec<T>, D::Error> {
    Ok(Option::<Vec<T>>::deserialize(from)?.unwrap_or_default())
}

/// Something, even if it is null.
fn even_null<'de, D: Deserializer<'de>, T: Deserialize<'de>>(from: D) -> Result<Option<T>, D::Error> {
    T::deserialize(from).map(Some)
}

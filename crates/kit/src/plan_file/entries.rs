//! The objects within the file. Places and directions are in assembly space unless said otherwise.

use serde::{Deserialize, Serialize};
use shellock::strength::Material;
use shellock_assembly::PatchId;
use shellock_assembly::verify::{Check, Finding, ThinFeature};

use super::{even_null, if_readable};

/// The model that a kit was made from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InputEntry {
    /// Name of its file, without folders.
    #[serde(default)]
    pub file: String,
    /// SHA-256 of that file, in lower-case hexadecimal digits.
    #[serde(default)]
    pub sha256: String,
    /// Assembly space from the file's coordinates: 4 × 4, row by row.
    pub transform: [f64; 16],
    /// Whether only the largest body of the file was taken.
    #[serde(default)]
    pub largest_only: bool,
    /// The object of the file that was taken, where one was chosen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// The plate of the slicer's project that was taken, where one was chosen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plate: Option<String>,
    /// What was changed to make one body of it.
    #[serde(default)]
    pub repairs: Vec<RepairEntry>,
}

/// What was changed to make one body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RepairEntry {
    /// A short name for machines.
    pub kind: String,
    /// How often; at least once.
    pub count: usize,
    /// The first place, in the file's own units and coordinates.
    pub at: [f64; 3],
    /// For people.
    pub message: String,
}

/// What the walls bear.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StrengthEntry {
    /// What they are made of; `None` where version 1 told it in another way.
    pub material: Option<Material>,
    /// Height of the falls, m.
    pub drop_m: f64,
    /// How many falls were computed.
    pub n_falls: usize,
    /// The stress that counts, MPa.
    pub stress_mpa: f64,
    /// Whether no wall in the limits bears its stress.
    pub is_too_weak: bool,
    /// Where that stress is, mm.
    pub at: [f64; 3],
    /// Number of the fall that decides, from 1.
    pub deciding_fall: usize,
    /// What is down in that fall, a unit vector.
    pub down: [f64; 3],
    /// All thicknesses that were looked at, ascending.
    #[serde(default)]
    pub tried: Vec<TriedEntry>,
    /// Where the model is too thin to be hollow, the largest first.
    #[serde(default)]
    pub solid: Vec<SolidEntry>,
}

/// The stress of one thickness.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TriedEntry {
    /// Thickness of the wall, mm.
    pub thickness_mm: f64,
    /// The stress that counts, in the worst fall, MPa.
    pub stress_mpa: f64,
}

/// A part of the surface with no cavity below.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SolidEntry {
    /// Its area, mm².
    pub area_mm2: f64,
    /// Its middle, mm.
    pub at: [f64; 3],
}

/// Size of the connectors between two pieces.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairSizeEntry {
    /// The two, the lower id first.
    pub pieces: [PatchId; 2],
    /// Size D, mm.
    pub size_mm: f64,
}

/// How the key was cut.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeyEntry {
    /// Length of the rails that it slides on, mm; 0 where it has none.
    pub rails: f64,
    /// Its surface, mm².
    pub area_mm2: f64,
    /// Share of its surface on its plane, in [0, 1].
    pub flat_share: f64,
    /// The same along the worse of its two sides, in [0, 1].
    pub side_share: f64,
    /// The way that it slides out, a unit vector.
    pub slide: [f64; 3],
    /// Normal of its plane, a unit vector.
    pub plane_normal: [f64; 3],
}

/// A piece.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PieceEntry {
    /// Its number: the first to go in is 1. Pieces are listed in this order.
    pub id: PatchId,
    /// Its mesh, as a path within the kit.
    pub file: Option<String>,
    /// Pieces that share a seam with it, ascending.
    #[serde(default)]
    pub neighbors: Vec<PatchId>,
    /// Its volume, mm³.
    pub volume_mm3: Option<f64>,
    /// Along which it moves in, a unit vector.
    pub installation_direction: [f64; 3],
    /// Triangles of its mesh.
    pub n_triangles: Option<usize>,
    /// Share of its volume that is thinner than the thinnest wall, in [0, 1].
    pub thin_share: Option<f64>,
    /// Its sheets that may break off and slots that may fuse, 2 mm or longer, the longest first.
    #[serde(default)]
    pub thin_places: Vec<ThinFeature>,
    /// How far it moves within its gaps; `None` where nothing ends its motions.
    pub rattle: Option<RattleEntry>,
}

/// How far a piece moves while no other does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RattleEntry {
    /// Greatest displacement of its centroid, mm.
    pub translation_mm: f64,
    /// Greatest turn, degrees.
    pub rotation_deg: f64,
    /// Whether no path of motions of any size goes farther.
    #[serde(default)]
    pub is_proven: bool,
    /// How far it moves while all but one piece may; only where that was asked for, and null where nothing is
    /// proven.
    #[serde(
        default,
        deserialize_with = "even_null",
        skip_serializing_if = "Option::is_none"
    )]
    pub together: Option<Option<PlayEntry>>,
}

/// How far a piece moves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlayEntry {
    /// Greatest displacement of its centroid, mm.
    pub translation_mm: f64,
    /// Greatest turn, degrees.
    pub rotation_deg: f64,
    /// Whether no path of motions of any size goes farther.
    #[serde(default)]
    pub is_proven: bool,
}

/// A run of connectors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointEntry {
    /// The piece with the pin.
    pub male: PatchId,
    /// The piece with the channel.
    pub female: PatchId,
    /// Length along the seam, mm; 0 where the run was given up.
    pub length_mm: f64,
    /// Volume of the pin and of the channel below the wall, mm³.
    pub volume_mm3: [f64; 2],
    /// Share of each half that survived the carving, in [0, 1].
    pub kept: [f64; 2],
    /// Its middle, mm.
    pub at: [f64; 3],
}

/// A seam on the inner surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactEntry {
    /// The piece installed later.
    pub later: PatchId,
    /// The piece installed earlier.
    pub earlier: PatchId,
    /// Its length, mm.
    pub length_mm: f64,
    /// Length on which a connector can be, mm.
    pub usable_mm: f64,
    /// A point in its middle, mm.
    pub at: [f64; 3],
}

/// Least gaps between pieces, mm; beneath the rim means all but what is meant to touch. `None` where no two
/// come near.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GapsEntry {
    /// In the assembly, mm.
    pub at_rest_mm: Option<f64>,
    /// In the assembly beneath the rim, mm.
    pub at_rest_beneath_rim_mm: Option<f64>,
    /// On the way in, mm.
    pub on_the_way_mm: Option<f64>,
    /// On the way in beneath the rim, mm.
    pub on_the_way_beneath_rim_mm: Option<f64>,
    /// On the key's way in beneath the rim, mm.
    pub key_on_the_way_beneath_rim_mm: Option<f64>,
    /// How far printed faces may stand out, each on its side, mm.
    pub fits_within_mm: Option<f64>,
    /// What rattles most where they all stand back by as much; `None` where nobody looked.
    #[serde(default)]
    pub loosest_if_thin: Option<LoosestEntry>,
}

/// How far a piece moves where all faces are printed thin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoosestEntry {
    /// Which piece.
    pub piece: PatchId,
    /// For small motions, mm; `None` where nothing ends them.
    pub translation_mm: Option<f64>,
    /// For small motions, degrees; `None` where nothing ends them.
    pub rotation_deg: Option<f64>,
}

/// The verdict on the finished pieces.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VerdictEntry {
    /// Whether every check holds.
    pub passed: bool,
    /// All checks, in the order they were made.
    #[serde(default)]
    pub checks: Vec<Check>,
    /// What failed, in the same order; `None` where play without end is among it, which JSON has no number
    /// for, or where version 1 told it in another way.
    #[serde(default, deserialize_with = "if_readable")]
    pub findings: Option<Vec<Finding>>,
}

/// The pieces on the plates of a printer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PrintingEntry {
    /// What people call the printer.
    pub printer: String,
    /// How it prints: "sla", "fdm" or "sls".
    pub process: Option<String>,
    /// Width, depth and height of what it can make, mm.
    pub bed: [f64; 3],
    /// Height of a layer, mm.
    pub layer: f64,
    /// How many plates there are.
    pub plates: usize,
    /// How pieces lie, in order; what is too large is left out.
    #[serde(default)]
    pub laid: Vec<LaidEntry>,
    /// Pieces that the printer cannot make.
    #[serde(default)]
    pub too_large: Vec<PatchId>,
    /// Print time.
    pub time: Option<TimeEntry>,
}

/// How a piece lies on its plate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LaidEntry {
    /// The piece.
    pub piece: PatchId,
    /// The plate, from 1.
    pub plate: usize,
    /// Width, depth and height as it lies, mm.
    pub size: [f64; 3],
    /// Where the x, y and z axes go.
    pub turned: [[f64; 3]; 3],
    /// Where it is moved after that, mm, in the frame of its plate.
    pub moved: [f64; 3],
    /// All surface that needs support, mm².
    pub support_mm2: f64,
    /// Outer skin that needs support, mm².
    pub outer_support_mm2: f64,
}

/// Print time and material, with supports.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimeEntry {
    /// How it was found: "closed form".
    pub by: String,
    /// Of all plates, s.
    pub pieces_s: f64,
    /// Of the whole model as people print it, s; 0 where the printer cannot make it.
    pub solid_s: f64,
    /// The one over the other; `None` where the printer cannot make the solid model.
    pub ratio: Option<f64>,
    /// Material of all plates, g.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pieces_g: Option<f64>,
    /// Material of the whole model, g.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solid_g: Option<f64>,
    /// How people print the whole model: "at 15 % infill".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solid_as: Option<String>,
}

//! Objects within the file. Places and directions are in assembly space unless stated otherwise.

use serde::{Deserialize, Serialize};
use shellock::strength::Material;
use shellock_assembly::verify::{Check, Finding, ThinFeature};
use shellock_report::PatchId;

use super::{even_null, if_readable};

/// Model that a kit was made from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InputEntry {
    /// Name of the model's file, without folders.
    #[serde(default)]
    pub file: String,
    /// SHA-256 of that file, in lower-case hexadecimal digits.
    #[serde(default)]
    pub sha256: String,
    /// Transform from the file's coordinates to assembly space: 4 × 4, row by row.
    pub transform: [f64; 16],
    /// True if only the largest body of the file was taken.
    #[serde(default)]
    pub largest_only: bool,
    /// Object of the file that was taken, if one was chosen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// Plate of the slicer's project that was taken, if one was chosen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plate: Option<String>,
    /// Repairs that made one body of it.
    #[serde(default)]
    pub repairs: Vec<RepairEntry>,
}

/// A kind of repair made to get one body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RepairEntry {
    /// Short machine-readable name of the repair.
    pub kind: String,
    /// Number of such repairs, at least 1.
    pub count: usize,
    /// Place of the first one, in the file's own units and coordinates.
    pub at: [f64; 3],
    /// Message for the user.
    pub message: String,
}

/// Strength of the walls in falls.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StrengthEntry {
    /// Material of the walls; `None` if version 1 gave it in another form.
    pub material: Option<Material>,
    /// Height of the falls, m.
    pub drop_m: f64,
    /// Number of falls computed.
    pub n_falls: usize,
    /// Decisive stress of the walls, MPa: all but the worst 0.5 % of the hollow wall stay below.
    pub stress_mpa: f64,
    /// True if no wall thickness within the limits withstands its stress.
    pub is_too_weak: bool,
    /// Place of that stress, mm.
    pub at: [f64; 3],
    /// Number of the fall that decides, from 1.
    pub deciding_fall: usize,
    /// Downward direction in that fall, a unit vector.
    pub down: [f64; 3],
    /// All thicknesses that were examined, ascending.
    #[serde(default)]
    pub tried: Vec<TriedEntry>,
    /// Regions where the model is too thin to be hollow, largest first.
    #[serde(default)]
    pub solid: Vec<SolidEntry>,
}

/// Stress at one wall thickness.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TriedEntry {
    /// Thickness of the wall, mm.
    pub thickness_mm: f64,
    /// Decisive stress in the worst fall, MPa.
    pub stress_mpa: f64,
}

/// A part of the surface without a cavity below.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SolidEntry {
    /// Area of the part, mm².
    pub area_mm2: f64,
    /// Middle of the part, mm.
    pub at: [f64; 3],
}

/// Size of the connectors between two pieces.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairSizeEntry {
    /// Ids of both pieces, the lower one first.
    pub pieces: [PatchId; 2],
    /// Connector size D, mm.
    pub size_mm: f64,
}

/// Geometry of the key's cut.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeyEntry {
    /// Length of the rails that the key slides on, mm; 0 if it has none.
    pub rails: f64,
    /// Surface area of the key, mm².
    pub area_mm2: f64,
    /// Share of the key's surface on its plane, in [0, 1].
    pub flat_share: f64,
    /// Share of the surface on the plane along the worse of the key's two sides, in [0, 1].
    pub side_share: f64,
    /// Direction in which the key slides out, a unit vector.
    pub slide: [f64; 3],
    /// Normal of the key's plane, a unit vector.
    pub plane_normal: [f64; 3],
}

/// A piece of the kit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PieceEntry {
    /// Number of the piece: the first to be installed is 1. Pieces are listed in this order.
    pub id: PatchId,
    /// Path of its mesh within the kit.
    pub file: Option<String>,
    /// Pieces that share a seam with it, ascending.
    #[serde(default)]
    pub neighbors: Vec<PatchId>,
    /// Volume of the piece, mm³.
    pub volume_mm3: Option<f64>,
    /// Direction in which the piece moves into its place, a unit vector.
    pub installation_direction: [f64; 3],
    /// Number of triangles of its mesh.
    pub n_triangles: Option<usize>,
    /// Share of its volume that is thinner than the thinnest wall, in [0, 1].
    pub thin_share: Option<f64>,
    /// Sheets that may break off and slots that may fuse, 2 mm or longer, longest first.
    #[serde(default)]
    pub thin_places: Vec<ThinFeature>,
    /// Play of the piece within its gaps; `None` if nothing stops its motions.
    pub rattle: Option<RattleEntry>,
}

/// Play of a piece while no other moves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RattleEntry {
    /// Greatest displacement of its centroid, mm.
    pub translation_mm: f64,
    /// Greatest rotation of the piece, degrees.
    pub rotation_deg: f64,
    /// True if it is proven that no path of motions of any size goes farther.
    #[serde(default)]
    pub is_proven: bool,
    /// Play of the piece if all but one may move. Present only on request, and null if nothing is proven.
    #[serde(
        default,
        deserialize_with = "even_null",
        skip_serializing_if = "Option::is_none"
    )]
    pub together: Option<Option<PlayEntry>>,
}

/// Play of a piece, by motions of any size.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlayEntry {
    /// Greatest displacement of its centroid, mm.
    pub translation_mm: f64,
    /// Greatest rotation of the piece, degrees.
    pub rotation_deg: f64,
    /// True if it is proven that no path of motions of any size goes farther.
    #[serde(default)]
    pub is_proven: bool,
}

/// A run of connectors along a seam.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointEntry {
    /// Piece with the pin.
    pub male: PatchId,
    /// Piece with the channel.
    pub female: PatchId,
    /// Length along the seam, mm.
    pub length_mm: f64,
    /// Volumes of the pin and of the channel below the wall, mm³.
    pub volume_mm3: [f64; 2],
    /// Share of each half below the wall that carving left, in [0, 1].
    pub kept: [f64; 2],
    /// Middle of the run, mm.
    pub at: [f64; 3],
}

/// A seam on the inner surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactEntry {
    /// Piece that is installed later.
    pub later: PatchId,
    /// Piece that is installed earlier.
    pub earlier: PatchId,
    /// Length of the seam, mm.
    pub length_mm: f64,
    /// Length usable for a connector, mm.
    pub usable_mm: f64,
    /// A point in the middle of the seam, mm.
    pub at: [f64; 3],
}

/// Least gaps between pieces, mm. "Beneath the rim" means everything except faces that are meant to touch.
/// `None` if no two pieces come near.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GapsEntry {
    /// Least gap in the assembly, mm.
    pub at_rest_mm: Option<f64>,
    /// Least gap in the assembly beneath the rim, mm.
    pub at_rest_beneath_rim_mm: Option<f64>,
    /// Least gap during installation, mm.
    pub on_the_way_mm: Option<f64>,
    /// Least gap during installation beneath the rim, mm.
    pub on_the_way_beneath_rim_mm: Option<f64>,
    /// Least gap during the key's installation beneath the rim, mm.
    pub key_on_the_way_beneath_rim_mm: Option<f64>,
    /// Largest outward deviation of printed faces, on each side, with which the kit still fits, mm.
    pub fits_within_mm: Option<f64>,
    /// Loosest piece if all faces deviate inwards by as much; `None` if it was not examined.
    #[serde(default)]
    pub loosest_if_thin: Option<LoosestEntry>,
}

/// Play of a piece if all faces are printed thin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoosestEntry {
    /// Id of the piece.
    pub piece: PatchId,
    /// Displacement in small motions, mm; `None` if nothing stops them.
    pub translation_mm: Option<f64>,
    /// Rotation in small motions, degrees; `None` if nothing stops them.
    pub rotation_deg: Option<f64>,
}

/// Verdict on the finished pieces.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VerdictEntry {
    /// True if every check holds.
    pub passed: bool,
    /// All checks, in the order they were made.
    #[serde(default)]
    pub checks: Vec<Check>,
    /// Findings of failed checks, in the same order. `None` if one is unlimited play, for which JSON has no
    /// number, or if version 1 gave them in another form.
    #[serde(default, deserialize_with = "if_readable")]
    pub findings: Option<Vec<Finding>>,
}

/// Layout of the pieces on the plates of a printer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PrintingEntry {
    /// Common name of the printer.
    pub printer: String,
    /// Process of the printer: "sla", "fdm" or "sls".
    pub process: Option<String>,
    /// Width, depth and height of the build volume, mm.
    pub bed: [f64; 3],
    /// Height of a layer, mm.
    pub layer: f64,
    /// Number of plates in use.
    pub plates: usize,
    /// Poses of the pieces, in order, without those that are too large.
    #[serde(default)]
    pub laid: Vec<LaidEntry>,
    /// Pieces that are too large for the printer.
    #[serde(default)]
    pub too_large: Vec<PatchId>,
    /// Print time and material.
    pub time: Option<TimeEntry>,
}

/// Pose of a piece on its plate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LaidEntry {
    /// Id of the piece.
    pub piece: PatchId,
    /// Number of the plate, from 1.
    pub plate: usize,
    /// Width, depth and height in this pose, mm.
    pub size: [f64; 3],
    /// Images of the x, y and z axes.
    pub turned: [[f64; 3]; 3],
    /// Translation after the rotation, mm, in the frame of the plate.
    pub moved: [f64; 3],
    /// Area of all surface that needs support, mm².
    pub support_mm2: f64,
    /// Area of outer skin that needs support, mm².
    pub outer_support_mm2: f64,
    /// Area of the first layer of a filament print, mm²; `None` for other processes.
    #[serde(default)]
    pub foothold_mm2: Option<f64>,
    /// True if a filament print needs a raft.
    #[serde(default)]
    pub raft: bool,
}

/// Print time and material, including supports.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimeEntry {
    /// Method of the estimate: "closed form".
    pub by: String,
    /// Print time of all plates, s.
    pub pieces_s: f64,
    /// Print time of the whole model as people print it, s; 0 if the printer cannot make it.
    pub solid_s: f64,
    /// Ratio of `pieces_s` to `solid_s`; `None` if the printer cannot make the solid model.
    pub ratio: Option<f64>,
    /// Material of all plates, g.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pieces_g: Option<f64>,
    /// Material of the whole model, g.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solid_g: Option<f64>,
    /// Usual way to print the whole model, such as "at 15 % infill".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solid_as: Option<String>,
}

//! Press fits: places where pieces press on each other on purpose.

use serde::{Deserialize, Serialize};
use shellock_geom::Vec3;

use crate::PatchId;

/// Greatest extent of detents and ribs around their places, mm.
const REACH_MM: f64 = 4.0;

/// Kind of a press fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PressFitKind {
    /// A bump on a rail's tongue that snaps into a dimple in the key's groove.
    Detent,
    /// A rib on the key's side of a seam that rubs on the other side.
    Rib,
}

/// Place where pressing holds the key.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PressFit {
    /// Kind of the press fit.
    pub kind: PressFitKind,
    /// Piece that carries the bump or rib.
    pub piece: PatchId,
    /// Place of the press fit, mm.
    pub at: [f64; 3],
    /// Interference with the other piece on the way in, mm.
    pub interference_mm: f64,
    /// Length of the last part of the way on which it presses, mm.
    pub travel_mm: f64,
}

impl PressFit {
    /// Greatest interference that counts as intended, mm.
    pub const MOST_INTERFERENCE_MM: f64 = 0.4;

    /// Returns true if `point`, mm, is near enough to belong to the press fit.
    pub fn reaches(&self, point: Vec3) -> bool {
        point.distance(Vec3::from_array(self.at)) < REACH_MM
    }
}

//! Places where pieces press on each other on purpose.

use serde::{Deserialize, Serialize};
use shellock_geom::Vec3;

use crate::PatchId;

/// Detents and ribs are no larger than this around their places, mm.
const REACH_MM: f64 = 4.0;

/// What presses on purpose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PressFitKind {
    /// A bump on a rail's tongue that snaps into a dimple in the key's groove.
    Detent,
    /// A rib on the key's side of a seam that rubs on the other side.
    Rib,
}

/// A place where the key is held by being pressed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PressFit {
    /// Which kind it is.
    pub kind: PressFitKind,
    /// The piece that it stands on.
    pub piece: PatchId,
    /// Its place, mm.
    pub at: [f64; 3],
    /// By how much it presses on the other piece on the way in, mm.
    pub interference_mm: f64,
    /// On how much of the way, mm: the last of it.
    pub travel_mm: f64,
}

impl PressFit {
    /// More than this presses nowhere on purpose, mm.
    pub const MOST_INTERFERENCE_MM: f64 = 0.4;

    /// Whether `point`, mm, is so near that it can be part of what presses.
    pub fn reaches(&self, point: Vec3) -> bool {
        point.distance(Vec3::from_array(self.at)) < REACH_MM
    }
}

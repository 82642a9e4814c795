//! Connectors under the seams (Sect. 4.2): a pin on one piece, a channel around it on the other.
//!
//! Cross-section of a seam, seen along its tangent, for a piece that leaves straight outwards (left) and one
//! that slides away sideways (right); M male, F female:
//!
//! ```text
//!      outside                          outside
//!  ─────────┬─────────              ─────────┬─────────
//!   M M M M │ F F F F                M M M M │ F F F F
//!  ───────┐M│F┌───────              ──────┐M └────────┐F
//!      F┌┐│M│F│     cavity                │M M M M M┐ │F
//!      F│└┘ ┘F│                           └───────┐M│ │F
//!      F└─────┘                            F└─────┴─┘─┘F
//! ```
//!
//! A run of connectors is one profile swept along the seam. Its shape changes smoothly with the angle between
//! the separation direction and the surface. The socket is the swept pin grown by the clearance, so the pin
//! can leave along the separation direction and along no other. A run is made where its whole section is
//! clear of walls and of other connectors, and is smaller where there is less room. A seam that has no such
//! place gets a run that carving reduces. Runs are then shortened to the stretches that carving leaves whole,
//! and their channels are closed at the ends (`connector::stop`).
//!
//! No such profile holds where a key slides along its seam. There the key's neighbour carries a straight
//! tongue under the key's wall, and the key has a groove around it (`connector::rail`).

mod contacts;
mod frame;
mod free;
mod outline;
mod profile;
mod rail;
mod run;
mod station;
mod stop;
mod taken;

pub(crate) use contacts::contacts;
pub use frame::{Curve, curves};
pub use free::is_unobstructed;
pub(crate) use outline::{Half, whole_half};
pub(crate) use profile::WHOLE;
pub use profile::{ProfileRect, Section};
pub(crate) use rail::{rail_places, stop_mm};
pub use run::{SeamRoom, runs};
use shellock_plan::sizes::SizeChoice;
use shellock_report::ParamProblem;
pub use station::{RailPart, Run, RunShape, RunStation};
pub(crate) use stop::{with_stops, without_thin_stops};

/// Parameters of connectors. Lengths in mm.
#[derive(Clone, Debug, PartialEq)]
pub struct ConnectorParams {
    /// Connector size D, depth and width of the channel: one for all pairs of pieces, or one for each pair.
    /// 2.5 for all.
    ///
    /// The walls of channel and pin come out at about 0.45 D.
    pub size: SizeChoice,
    /// Gap between mating faces. [0.03, 0.6]; 0.12.
    ///
    /// Resin printers hold 0.05–0.15 mm a side, filament printers want 0.15–0.3.
    pub clearance_mm: f64,
    /// Gap between a key that slides on rails and its neighbours, so that it can be taken out by hand; never
    /// less than the other clearance. [0.03, 0.8]; 0.15.
    pub key_clearance_mm: f64,
    /// Interference of the bump on each rail with the key's groove before it snaps into its dimple. [0, 0.4];
    /// 0, none.
    ///
    /// The detent keeps the key from creeping out. It must bend the groove's wall on the way: by a tenth of
    /// its thickness for 0.1 mm.
    pub detent_mm: f64,
    /// Interference of the ribs of a key without rails with the pieces around it: only friction holds such a
    /// key. [0, 0.3]; 0.08.
    pub key_rib_mm: f64,
    /// Thickness below which places of pieces are reported, and that walls of rails have at least. [0.1, 2];
    /// 0.4, one extrusion line or eight pixels of a resin printer.
    pub min_wall_mm: f64,
}

impl Default for ConnectorParams {
    fn default() -> Self {
        Self {
            size: SizeChoice::default(),
            clearance_mm: 0.12,
            key_clearance_mm: 0.15,
            detent_mm: 0.0,
            key_rib_mm: 0.08,
            min_wall_mm: 0.4,
        }
    }
}

impl ConnectorParams {
    /// Clearance of connectors, mm: that of a key that slides on rails, or that of all others.
    pub fn clearance_of(&self, is_sliding_key: bool) -> f64 {
        if is_sliding_key {
            self.key_clearance_mm.max(self.clearance_mm)
        } else {
            self.clearance_mm
        }
    }

    /// Depth below the wall that connectors up to `size_mm` may take, mm: that of a channel under the
    /// steepest backward seam.
    pub fn room_mm(&self, size_mm: f64) -> f64 {
        2.1 * size_mm + self.clearance_mm
    }

    /// Lists every value out of range.
    pub fn problems(&self) -> Vec<ParamProblem> {
        let others = [
            ParamProblem::unless_within("clearance", "mm", self.clearance_mm, 0.03, 0.6),
            ParamProblem::unless_within("key clearance", "mm", self.key_clearance_mm, 0.03, 0.8),
            ParamProblem::unless_within("detent", "mm", self.detent_mm, 0.0, 0.4),
            ParamProblem::unless_within("press of the key's ribs", "mm", self.key_rib_mm, 0.0, 0.3),
            ParamProblem::unless_within("minimum wall", "mm", self.min_wall_mm, 0.1, 2.0),
        ];
        self.size
            .problems()
            .into_iter()
            .chain(others.into_iter().flatten())
            .collect()
    }
}

//! Finished pieces: bodies with their connectors, carved so that every path stays free, ready to print.
//!
//! Pieces are carved in the disassembly sequence. A piece's half connectors lose the parts that block its own
//! way out, and the parts that a later piece, with its bodies and connectors, passes on its way out: the
//! socket is the swept volume of the pin. Where a joined piece still comes too near to another, that is cut
//! off too. Last, its number is engraved into the inner side of its wall.

mod carve;
mod finish;
mod halves;
mod key_parts;
mod label;
mod relief;
mod ribs;
mod trim;

pub use finish::{Connectors, FinishParams, Finished, FinishedJoint, PieceError, make};
pub use key_parts::Grip;
pub use label::LabelParams;
pub use relief::Relief;
pub use shellock_assembly::{PressFit, PressFitKind};
use shellock_geom::Volume;

use crate::connector::{ConnectorParams, Half, Run, whole_half};

/// The male and the female half of a run, before carving.
pub(crate) fn whole_halves(params: &ConnectorParams, run: &Run) -> [Volume; 2] {
    [Half::Male, Half::Female].map(|half| whole_half(params, run, half))
}

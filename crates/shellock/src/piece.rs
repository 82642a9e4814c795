//! Finished pieces: bodies with their connectors, carved so that every path stays free, ready to print.
//!
//! Pieces are taken in the order of taking apart. From a piece's half connectors goes whatever lies in its
//! own way out, and whatever a later piece, its bodies and its connectors, passes on its way out: the socket
//! is what the pin sweeps. Where a joined piece still comes too near to another, that is taken off too. Last,
//! its number is cut into the inner side of its wall.

mod carve;
mod finish;
mod key_parts;
mod label;
mod relief;
mod ribs;
mod thin;

pub use crate::{PressFit, PressFitKind};
pub use finish::{FinishParams, Finished, FinishedJoint, PieceError, make};
pub use key_parts::Grip;
pub use label::LabelParams;
pub use relief::Relief;

use shellock_geom::Volume;

use crate::connector::{ConnectorParams, Run};

/// The male and the female half of a run as they are before anything is carved.
pub(crate) fn whole_halves(params: &ConnectorParams, run: &Run) -> [Volume; 2] {
    [carve::Half::Male, carve::Half::Female].map(|half| carve::whole_half(params, run, half))
}

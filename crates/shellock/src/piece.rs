//! Finished pieces: bodies with their connectors, carved so that every path stays free, ready to print.
//!
//! Pieces are taken in the order of taking apart. From a piece's half connectors goes whatever lies in its own way out,
//! and whatever a later piece, its bodies and its connectors, passes on its way out: the socket is what the pin sweeps.

mod carve;
mod finish;
mod key_parts;

pub use finish::{Finished, Joint, PieceError, make};
pub use key_parts::{Detent, Grip};

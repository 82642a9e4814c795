//! From finished pieces to printing and assembly: printers, build plates, print time, and the assembly
//! booklet.
//!
//! Nothing in this crate changes the shape of a piece. Pieces come as meshes in assembled position and are
//! only turned, moved and drawn.

pub mod booklet;
pub mod columns;
pub mod fonts;
pub mod load;
mod pdf;
pub mod plates;
pub mod printer;
pub mod slicing;
mod supports;
pub mod time;

pub use plates::{Plates, lay};
pub use printer::{Printer, Process};

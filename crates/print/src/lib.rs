//! From finished pieces to the printer and the workbench: printers, plates, print time, and the booklet.
//!
//! Nothing here changes a piece. Pieces come as meshes in assembled position and are only turned, moved and
//! drawn.

pub mod booklet;
pub mod columns;
pub mod load;
mod pdf;
pub mod plates;
pub mod printer;
pub mod time;

pub use plates::{Plates, lay};
pub use printer::{Printer, Process};

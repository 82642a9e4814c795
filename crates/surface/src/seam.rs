//! Seams: the borders of patches, the neighbours that they make, and the rules for connectors under them.

mod frame;
pub mod graph;
mod line;
pub mod rules;

pub use frame::{FramedLine, later_is_male};
pub use line::{seam_half_edges, stretches};

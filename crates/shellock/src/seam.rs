//! Seams: where two patches meet, which pieces they make neighbours of, and the rules for connectors under
//! them.

mod frame;
pub mod graph;
mod line;
pub mod rules;

pub(crate) use frame::{FramedLine, later_is_male};
pub(crate) use line::{seam_half_edges, stretches};

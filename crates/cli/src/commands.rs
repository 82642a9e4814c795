//! Commands: each reads its input, lets a job run, and prints what came of it.

pub mod batch;
pub mod build;
pub mod coupon;
pub mod figure;
pub mod inspect;
pub mod own_assembly;
pub mod plan;
pub mod printers;
pub mod report;
pub mod segment;
pub mod studio;
pub mod test;
pub mod verify;

/// Work on a kit of a batch or of the demo if neither time nor work is limited, s. Such a kit does not depend
/// on the machine, nor on what runs beside it.
const USUAL_EFFORT_S: f64 = 60.0;

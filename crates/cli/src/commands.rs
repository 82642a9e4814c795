//! Commands: each reads its input, lets a job run, and prints what came of it.

pub mod batch;
pub mod build;
pub mod coupon;
pub mod figure;
pub mod inspect;
pub mod own_assembly;
pub mod plan;
pub mod report;
pub mod segment;
pub mod studio;
pub mod test;
pub mod verify;

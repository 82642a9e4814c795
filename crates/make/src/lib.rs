//! Printable pieces of a plan.
//!
//! [`mod@body`] builds the wall and splits it along the plan, [`connector`] decides what is under each seam,
//! and [`piece`] makes the finished meshes. [`make_parts`] makes walls and connectors, [`join_parts`] joins
//! them. [`coupon`] makes a pair of small pieces to test the fit.

pub mod body;
mod causes;
pub mod connector;
pub mod coupon;
mod handover;
pub mod piece;
mod recipe;

pub use causes::Cause;
pub use recipe::{MakeError, Parts, Recipe, join_parts, make_parts, weak_joints};

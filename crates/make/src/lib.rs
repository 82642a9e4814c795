//! Printable pieces of a plan.
//!
//! [`mod@body`] builds the wall and splits it along the plan, [`connector`] decides what is under each seam,
//! and [`piece`] makes the finished meshes. [`coupon`] makes a pair of small pieces to test the fit.

pub mod body;
mod causes;
pub mod connector;
pub mod coupon;
pub mod piece;

pub use causes::Cause;

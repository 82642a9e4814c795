//! Division of a closed surface into patches, one for each piece.
//!
//! [`mod@segmentation`] divides the surface by one of several methods or by the user's labels, smooths the
//! borders and repairs patches that no piece can be made of. [`key`] finds a place where the last piece can
//! slide out and makes it a patch of its own.

mod causes;
pub mod key;
pub mod segmentation;
mod widen;

pub use causes::Cause;
pub use widen::{WithKey, least_width_mm, widen};

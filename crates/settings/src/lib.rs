//! Parameters of a kit: what a user may set ([`Params`]), and the parameters of each stage ([`Settings`]).
//!
//! Each value is set in one place. [`Settings`] are resolved once, from the user's parameters and the
//! thickness of the wall. Stages read them and never change them.

mod params;
mod stages;

pub use params::{KeySource, Params, Rounds, Thickness, WallChoice};
pub use stages::Settings;

//! What people look at.
pub mod stills;

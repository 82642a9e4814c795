//! Helpers shared by the tests of several crates.

pub mod golden;
pub mod plain;
pub mod property;
pub mod shapes;

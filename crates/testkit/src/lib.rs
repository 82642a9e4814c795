//! What tests of several crates share.

pub mod golden;
pub mod plain;
pub mod property;
pub mod shapes;

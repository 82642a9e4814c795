//! Loads: what a wall withstands, how well a plan holds, and what the finished kit carries.
//!
//! [`strength`] chooses the thickness of the wall (Sect. 4.3). [`handling`] has the loads of everyday
//! use, [`metric`] rates plans by simulation under them (Sect. 5), and [`stress_test`] punches and drops a
//! finished kit (Sect. 7).

mod causes;
pub mod handling;
pub mod impact;
pub mod metric;
pub mod strength;
pub mod stress_test;

pub use causes::Cause;

//! A whole job of Shellock: from a model's file and options to a kit's folder.
//!
//! ```text
//!  file ─► input ─► shape, bed ─► build ─► output: plan.json, pieces, plates, page, booklet
//!            ▲                      ▲
//!         options ──────────────────┘        kits: a finished folder ─► verify, stress, savings
//! ```
//!
//! [`options::Options`] is what a person chooses, as plain data. [`embed`] makes kits without files; the
//! command line, the studio and Python are built on this crate. It prints nothing and reads no arguments;
//! [`Session`] is its bond with its caller.

pub mod batch;
mod bears;
pub mod bed;
pub mod build;
mod causes;
pub mod child;
pub mod clock;
pub mod config;
pub mod course;
pub mod division;
pub mod embed;
pub mod failure;
pub mod files;
mod fonts;
pub mod input;
pub mod kits;
mod loads;
mod model;
mod names;
pub mod options;
pub mod output;
pub mod own_assembly;
mod page;
pub mod paint;
pub mod place;
pub mod printers;
pub mod printing;
pub mod project;
pub mod savings;
mod session;
pub mod shape;
pub mod shares;
pub mod stopwatch;
pub mod stress;
mod summary;
mod tabs;
pub mod told;
mod upright;
pub mod work;

pub use bears::lines as bears_lines;
pub use failure::Failure;
pub use options::Options;
pub use session::Session;

/// Programs in the guide, compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/guide/library.md")]
struct Guide;

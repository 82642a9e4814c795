//! From a closed mesh to interlocking, printable shell pieces, the plan to install them and the proof that
//! they hold.
//!
//! After Yao, Chen, Xu, Wang, "Modeling, Evaluation and Optimization of Interlocking Shell Pieces", Computer
//! Graphics Forum 36(7), Pacific Graphics 2017.
//!
// Made by `cargo xtask pictures`; in the text itself, so that it needs no address.
#![doc = include_str!("../doc/kit.svg")]
//!
//! ```no_run
//! use shellock::{Ctx, DesignOutcome, Params, design, figure};
//!
//! let squirrel = figure::make(figure::Figure::Squirrel, 150.0, 1.5);
//! let mut params = Params::default();
//! params.n_pieces = Some(8);
//! if let DesignOutcome::Made(made) = design(&Ctx::quiet(), &params, &squirrel, None)? {
//!     assert!(made.kit.verification.has_passed() && made.kit.pieces.len() >= 8);
//! }
//! # Ok::<(), shellock::DesignError>(())
//! ```
//!
//! [`mod@design`] is the whole job. Its stages, in the only direction that data flows, each a module with its
//! parameters and a plain function: [`strength`] (how thick the wall) → [`segmentation`] (which pieces) →
//! [`key`] (where the last one slides out) → [`sizes`] (of connectors) → [`plan`] (order and directions) and
//! [`metric`] (which plan holds best) → [`body`] (the wall, split) → [`connector`] (what is under its seams)
//! → [`piece`] (finished meshes) → [`mod@verify`], [`play`] and [`certificate`], which know nothing of the
//! stages before and judge anybody's assembly.

pub mod design;

/// Causes of warnings, by the stage that finds them.
pub mod causes {
    pub use shellock_assembly::Cause as Verify;
    pub use shellock_divide::Cause as Divide;
    pub use shellock_make::Cause as Make;
    pub use shellock_plan::Cause as Plan;
    pub use shellock_rate::Cause as Rate;

    pub use crate::design::Cause as Design;
}

pub use design::{Design, DesignError, DesignOutcome, Kit, Params, Settings, design};
pub use shellock_assembly::{
    Direction, InstallationPlan, InstallationStep, LatticeDirection, PressFit, PressFitKind, Verdict,
    certificate, direction, motion, play, push, verify,
};
pub use shellock_divide::{key, segmentation};
pub use shellock_figures as figure;
pub use shellock_make::{MakeError, body, connector, coupon, piece};
pub use shellock_plan as plan;
pub use shellock_plan::sizes::{self, ConnectorSizes};
pub use shellock_rate::{handling, metric, strength, stress_test};
pub use shellock_report::{
    Cancelled, Ctx, Diagnostic, IdVec, ParamProblem, PatchId, Progress, Severity, Told, Warning, WarningEntry,
};
pub use shellock_surface as surface;
pub use shellock_surface::seam::graph::{Adjacency, ContactGraph};
pub use shellock_surface::{Seam, SegmentedSurface, seam};

//! Assembly order and separation direction of each piece (Sect. 6).
//!
//! [`survey`] measures the segmented surface once: who occludes whom along the 26 directions, how good a
//! connector each seam could carry, and how flat each piece is. [`search`] then finds a plan and proves how
//! good any other plan could be. It runs again each time a later stage objects. The cost of a piece is one
//! trait, [`PieceCosts`].
//!
//! Deviations from the paper: a plan must also pass the cluster test ([`cluster`]), which the paper leaves to
//! simulation; seams too short for a connector join nothing; and the key is only chosen here, never cut anew.

#[cfg(test)]
mod bound_tests;
mod causes;
pub mod cluster;
mod diagnose;
mod draw;
mod exact;
mod handover;
mod improve;
pub mod interface;
pub mod key;
pub mod lesson;
pub mod local_cost;
pub mod local_tests;
mod neighbours;
pub mod occlusion;
mod params;
mod piece_set;
mod pool;
mod sample;
pub mod score;
mod search;
#[cfg(test)]
mod search_tests;
pub mod sizes;
mod space;
pub mod study;
mod survey;
pub mod types;

pub use causes::{Cause, SizeLimit};
pub use exact::REVISIONS;
pub use handover::Handover;
pub use local_cost::{PieceCosts, SeamCosts};
pub use neighbours::{Neighbourhood, PlanName};
pub use params::PlanParams;
pub use piece_set::PieceSet;
pub use sample::random_plans;
pub use score::PlanScore;
pub use search::{MakeCosts, raise_bounds, search, search_with};
pub use space::score;
pub use survey::{PlanSurvey, survey};
pub use types::{
    Blocker, FoundPlan, LatticePlan, LatticeStep, PlanConstraints, PlanOutcome, PlanProof, ProofScope,
    RankedPlan,
};

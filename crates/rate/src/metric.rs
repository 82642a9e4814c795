//! Quality of a plan, by simulation (Sect. 5.1 and 5.2).
//!
//! [`PlanModel`] is the mechanical model of the segmented surface: a coarse mesh of each patch, and stations
//! along the seams. A plan makes a joint of each station that can carry a connector; the solvers of
//! `shellock-mechanics` then compute the openings of the seams. The quality `Q = −max w d` is in mm at the
//! separation force of 10 N/m; higher is better.

mod choice;
mod climb;
mod data_driven;
mod deform;
mod foreseen;
mod foresight;
mod handover;
mod model;
mod question;
mod rating;
#[cfg(test)]
mod tests;
mod what_if;

pub use choice::{
    BY_SIMULATION, Bears, ChoiceError, Chosen, GivesWay, Holding, LoadBorne, LoosePiece, MOST_TIMES,
    SeamHolding, Stand, WeakestUse, choose, choose_or_change,
};
pub use climb::{ClimbError, ClimbParams, ClimbRules, Climbed, climb};
pub use data_driven::{data_driven, pieces_alone};
pub use deform::{Deformed, DeformedLoad, Told, Touch};
pub use foreseen::{Foreseen, foreseen};
pub use foresight::{Expected, Foresight};
pub use model::{EvenSurface, MetricParams, PlanModel};
pub use question::Choice;
pub use rating::{Bench, RESERVE, Rated};
pub use what_if::{WhatIf, is_worth, weakest_use};

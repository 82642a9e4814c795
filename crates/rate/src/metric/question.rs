//! Question to the choice of a plan: the pieces, their plans so far and their loads.

use shellock_plan::sizes::ConnectorSizes;
use shellock_plan::{LatticePlan, PlanConstraints, PlanParams, PlanSurvey};
use shellock_surface::SegmentedSurface;

use super::EvenSurface;
use super::climb::ClimbParams;
use crate::handling::Handling;

/// Input of the choice of a plan.
pub struct Choice<'a> {
    /// Parameters by which plans are judged.
    pub params: &'a PlanParams,
    /// Surface of the pieces.
    pub surface: &'a SegmentedSurface,
    /// Surface of the pieces with even triangles.
    pub even: &'a EvenSurface,
    /// Connector sizes of each pair.
    pub sizes: &'a ConnectorSizes,
    /// Survey of the pieces.
    pub survey: &'a PlanSurvey,
    /// Constraints learned from earlier kits.
    pub constraints: &'a PlanConstraints,
    /// Loads that the kit is to withstand.
    pub handling: &'a Handling,
    /// Limits of the climb's effort.
    pub climb: ClimbParams,
    /// The strongest plan of the same pieces with other connectors, if there is one: a start of the climb.
    pub former: Option<&'a LatticePlan>,
}

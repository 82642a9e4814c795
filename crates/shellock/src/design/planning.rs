//! Input of the search for a plan, with the loads and criteria that follow from it.

use shellock_geom::Vec3;

use super::division::Division;
use super::ways::Input;
use crate::handling::Handling;
use crate::key::Turn;
use crate::metric::{Choice, ClimbParams, EvenSurface};
use crate::plan::{LatticePlan, PlanConstraints, PlanSurvey};
use crate::strength::Cavity;

/// Input of the search for a plan.
pub(super) struct Planning<'a> {
    pub input: Input<'a>,
    /// Estimates of the model's cavity.
    pub cavity: &'a Cavity,
    /// Turn of the model for the division.
    pub turn: &'a Turn,
    pub division: &'a Division,
    /// The division's surface with even triangles.
    pub even: &'a EvenSurface,
    pub survey: &'a PlanSurvey,
    pub constraints: &'a PlanConstraints,
}

impl Planning<'_> {
    /// Loads on the kit, in the space of the division.
    pub fn handling(&self) -> Handling {
        let params = self.input.params;
        let up = self.turn.apply(Vec3::from_array(params.up)).to_array();
        let thickness_mm = self.division.settings.body.thickness_mm;
        Handling::new(up, thickness_mm, params.material)
    }

    /// Criteria by which plans are compared.
    ///
    /// A climb keeps `reserve_s` back for the kit.
    pub fn choice<'b>(
        &'b self,
        handling: &'b Handling,
        former: Option<&'b LatticePlan>,
        reserve_s: f64,
    ) -> Choice<'b> {
        Choice {
            params: &self.division.settings.plan,
            surface: &self.division.surface,
            even: self.even,
            sizes: &self.division.sizes.sizes,
            survey: self.survey,
            constraints: self.constraints,
            handling,
            climb: ClimbParams {
                reserve_s,
                ..ClimbParams::default()
            },
            former,
        }
    }
}

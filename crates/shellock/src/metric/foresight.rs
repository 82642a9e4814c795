//! How far the pieces of each plan that a search found will rattle, before any of them is simulated.

use rayon::prelude::*;

use super::choice::Choice;
use super::{MetricParams, PlanModel, foreseen};
use crate::plan::{FoundPlan, LatticePlan, RankedPlan};

/// Plans whose cost is at most this share above the least may be chosen.
///
/// Costs know what the verification asks for and the simulation does not (what carving takes, how firmly pins
/// hold). With 0.15 three of five kits bear a tenth to a quarter less of the worst use, with 0.5 one bears a
/// third more and the others, up to what is enough, hardly more: docs/notes/metrics.md.
pub(super) const COST_SLACK: f64 = 0.25;

/// Play is foreseen within a factor of about one and a half; pieces that are foreseen to have less than this
/// share of what they may have hardly ever rattle.
const SURE_PLAY: f64 = 0.85;

/// Plans whose widest play is within this share of the least are alike.
const PLAY_TIE: f64 = 0.05;

/// The pieces as mechanics sees them, and the plans that may be chosen.
pub struct Foresight {
    pub(super) model: PlanModel,
    /// With how far each piece goes, as a share of what it may.
    plans: Vec<(RankedPlan, Vec<f64>)>,
    size_mm: f64,
    clearance_mm: f64,
}

impl Foresight {
    /// Of those plans of `found` that cost little enough.
    pub fn of(choice: &Choice<'_>, found: &FoundPlan) -> Self {
        let model = PlanModel::new(
            &MetricParams::of_plan(choice.params, choice.sizes, choice.handling.material),
            choice.surface,
            choice.sizes,
        );
        let most_cost = found.score.worst * (1.0 + COST_SLACK);
        let mut foresight = Self {
            model,
            plans: Vec::new(),
            size_mm: choice.surface.mesh.bounds().size().max_element(),
            clearance_mm: choice.params.clearance_mm,
        };
        foresight.plans = (found.pool.par_iter())
            .filter(|p| p.score.worst <= most_cost)
            .map(|p| (p.clone(), foresight.excess(&p.plan)))
            .collect();
        foresight
    }

    /// How far each piece goes, as a share of what it may.
    fn excess(&self, plan: &LatticePlan) -> Vec<f64> {
        let meetings = self.model.meetings(plan);
        foreseen(&self.model, plan, &meetings, self.size_mm, self.clearance_mm).excess
    }

    /// The plan whose loosest piece rattles least, the first of equals, and how far each of its pieces goes, as
    /// a share of what it may.
    pub fn steadiest(&self) -> Option<(&RankedPlan, &[f64])> {
        let steadiest = (self.plans.iter()).min_by(|a, b| widest(&a.1).total_cmp(&widest(&b.1)))?;
        Some((&steadiest.0, &steadiest.1))
    }

    /// Plans that rattle about as little as any.
    pub(super) fn steady(&self) -> Vec<RankedPlan> {
        let most = self.most();
        let steady = self.plans.iter().filter(|p| widest(&p.1) <= most);
        steady.map(|p| p.0.clone()).collect()
    }

    /// Whether a plan does.
    pub(super) fn is_steady(&self, plan: &LatticePlan) -> bool {
        widest(&self.excess(plan)) <= self.most()
    }

    fn most(&self) -> f64 {
        let least = self
            .plans
            .iter()
            .map(|p| widest(&p.1))
            .fold(f64::INFINITY, f64::min);
        least * (1.0 + PLAY_TIE)
    }
}

/// How far the loosest piece goes; no less than what surely passes.
fn widest(excess: &[f64]) -> f64 {
    excess.iter().copied().fold(SURE_PLAY, f64::max)
}

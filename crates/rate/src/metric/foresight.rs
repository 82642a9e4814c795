//! Predicted play of the pieces of each plan that a search found, before any of them is simulated.

use rayon::prelude::*;
use shellock_assembly::motion::{Contact, LOOSE, SLIGHT};
use shellock_plan::interface::{Interface, pin_contacts, wall_contacts};
use shellock_plan::{FoundPlan, LatticePlan, PlanParams, RankedPlan};
use shellock_report::PatchId;

use super::question::Choice;
use super::{Foreseen, MetricParams, PlanModel, foreseen};

/// Greatest excess of a plan's cost over the least, as a share, with which it may be chosen.
///
/// Costs contain requirements of the verification that the simulation does not know: losses by carving, and
/// how firmly pins hold. With 0.15, three of five kits have load factors of the worst use lower by a tenth to
/// a quarter. With 0.5 one has a third more and the others, up to what is enough, hardly more:
/// docs/notes/metrics.md.
pub(super) const COST_SLACK: f64 = 0.25;

/// Share of the allowed play below which pieces hardly ever rattle. Four of five finished pieces have 0.74 to
/// 1.2 times the predicted play.
const SURE_PLAY: f64 = 0.85;

/// Share of the allowed play above which pieces of a plan are expected to rattle too much. It lies below
/// [`SLIGHT`], since runs may come out shorter than planned.
const LIKELY_RATTLE: f64 = 1.05;

/// Margin of predictions above a limit where runs are known, as a factor. Finished pieces of a cat and a
/// teddy have 0.9 to 1.1 times the play that is then predicted.
const SURE: f64 = 1.05;

/// Predicted play of each piece, as a share of the allowed play, where the runs of connectors are known.
pub struct ExpectedPlay {
    key: PatchId,
    excess: Vec<f64>,
}

impl ExpectedPlay {
    /// Pieces but the key that surely rattle too much, the loosest first.
    pub fn rattlers(&self) -> Vec<(PatchId, f64)> {
        loosest_first(self.key, &self.excess, SURE * SLIGHT)
    }

    /// Pieces but the key whose play no kit may have, the loosest first.
    pub fn loose(&self) -> Vec<PatchId> {
        let loose = loosest_first(self.key, &self.excess, SURE * LOOSE).into_iter();
        loose.map(|l| l.0).collect()
    }
}

/// Relative difference of the widest play up to which plans count as alike.
const PLAY_TIE: f64 = 0.05;

/// Mechanical model of the pieces, and the plans that may be chosen.
pub struct Foresight {
    pub(super) model: PlanModel,
    /// Plans with the predicted play of each piece, as a share of the allowed play.
    plans: Vec<(RankedPlan, Vec<f64>)>,
    /// Seams of the pieces, with their runs of connectors.
    interfaces: Vec<Interface>,
    params: PlanParams,
    size_mm: f64,
}

impl Foresight {
    /// Predicts the play for those plans of `found` that cost little enough.
    pub fn of(choice: &Choice<'_>, found: &FoundPlan) -> Self {
        let params = MetricParams::of_plan(choice.params, choice.sizes, choice.handling.material);
        let model = PlanModel::of_even(&params, choice.even, choice.sizes);
        let most_cost = found.score.worst * (1.0 + COST_SLACK);
        let mut foresight = Self {
            model,
            plans: Vec::new(),
            size_mm: choice.surface.mesh.bounds().size().max_element(),
            interfaces: choice.survey.contacts.clone(),
            params: choice.params.clone(),
        };
        foresight.plans = (found.pool.par_iter())
            .filter(|p| p.score.worst <= most_cost)
            .map(|p| (p.clone(), foresight.play(&p.plan).excess))
            .collect();
        foresight
    }

    /// Predicted play of each piece in a plan.
    pub(super) fn play(&self, plan: &LatticePlan) -> Foreseen {
        self.play_with(plan, &pin_contacts(&self.params, &self.interfaces, plan))
    }

    /// Predicted play of each piece in a plan whose connectors touch at `joints`.
    fn play_with(&self, plan: &LatticePlan, joints: &[Contact]) -> Foreseen {
        let mut contacts = wall_contacts(&self.params, &self.interfaces, plan);
        contacts.extend(joints);
        let clearance_mm = self.params.clearance_mm;
        foreseen(&self.model, plan, &contacts, clearance_mm, self.size_mm)
    }

    /// Predicted play in a plan whose connectors touch at `joints`.
    pub fn expected_play(&self, plan: &LatticePlan, joints: &[Contact]) -> ExpectedPlay {
        ExpectedPlay {
            key: plan.key(),
            excess: self.play_with(plan, joints).excess,
        }
    }

    /// Pieces but the key that are expected to rattle too much even in the plan whose loosest piece has the
    /// least play, the loosest first. Each comes with its play, as a share of the allowed play.
    pub fn rattlers(&self) -> Vec<(PatchId, f64)> {
        let steadiest = self.steadiest();
        steadiest.map_or_else(Vec::new, |(plan, excess)| {
            loosest_first(plan.plan.key(), excess, LIKELY_RATTLE)
        })
    }

    /// The plan whose loosest piece has the least play, the first of equals, with the play of each piece as a
    /// share of the allowed play.
    pub fn steadiest(&self) -> Option<(&RankedPlan, &[f64])> {
        let steadiest = (self.plans.iter()).min_by(|a, b| widest(&a.1).total_cmp(&widest(&b.1)))?;
        Some((&steadiest.0, &steadiest.1))
    }

    /// Plans with about the least play.
    pub(super) fn steady(&self) -> Vec<RankedPlan> {
        let most = self.most();
        let steady = self.plans.iter().filter(|p| widest(&p.1) <= most);
        steady.map(|p| p.0.clone()).collect()
    }

    /// Returns true if a plan has about the least play.
    pub(super) fn is_steady(&self, plan: &LatticePlan) -> bool {
        widest(&self.play(plan).excess) <= self.most()
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

/// Play of the loosest piece, as a share of the allowed play; at least the share that surely passes.
fn widest(excess: &[f64]) -> f64 {
    excess.iter().copied().fold(SURE_PLAY, f64::max)
}

/// Pieces but the key with a wider play than `most`, the loosest first; play is a share of the allowed play.
fn loosest_first(key: PatchId, excess: &[f64], most: f64) -> Vec<(PatchId, f64)> {
    let excess = excess
        .iter()
        .enumerate()
        .map(|(i, excess)| (PatchId::from(i), *excess));
    let mut wide: Vec<(PatchId, f64)> = excess
        .filter(|(piece, excess)| *excess > most && *piece != key)
        .collect();
    wide.sort_by(|a, b| b.1.total_cmp(&a.1));
    wide
}

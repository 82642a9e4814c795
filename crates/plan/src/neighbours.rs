//! Plans near a plan, and the conditions that each must satisfy. A search with an objective other than costs
//! climbs through them.

use std::collections::BTreeSet;

use shellock_assembly::LatticeDirection;
use shellock_report::PatchId;

use super::key::{KeyChoice, choices};
use super::score::just_above;
use super::space::{Relations, Space};
use super::{FoundPlan, LatticePlan, LatticeStep, PlanConstraints, PlanParams, PlanSurvey, RankedPlan};

/// Plans with the key of a found plan that satisfy all conditions of its search and cost no more than a
/// limit.
pub struct Neighbourhood<'a> {
    space: Space<'a>,
    key_ways: Vec<LatticeDirection>,
    most_cost: f64,
    /// Pieces that are loose in the found plan. No other piece may be loose.
    loose: Vec<PatchId>,
    /// Pieces that are not held firmly in the found plan. All others must be.
    infirm: Vec<PatchId>,
}

/// Identity of a plan. Plans with equal names join the same pieces along the same directions.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PlanName(Relations);

impl<'a> Neighbourhood<'a> {
    /// Creates the neighbourhood of `found`, with its key. `survey` must count joints as `found` did
    /// ([`FoundPlan::apply_counts`]).
    pub fn new(
        params: &PlanParams,
        survey: &'a PlanSurvey,
        constraints: &'a PlanConstraints,
        found: &FoundPlan,
        most_cost: f64,
    ) -> Self {
        let piece = found.plan.key();
        let is_key = |k: &KeyChoice| k.piece == piece && k.slides == found.scope.slides;
        let key = choices(params, survey).into_iter().find(is_key);
        let space = Space::new(survey, constraints, found.tolerance);
        Self {
            infirm: space.infirm(&found.plan),
            space,
            key_ways: key.map_or_else(|| vec![found.plan.separation(piece)], |k| k.directions),
            most_cost,
            loose: found.pool.first().map_or(Vec::new(), |p| p.loose.clone()),
        }
    }

    /// Returns the plan with its costs if it satisfies all conditions.
    pub fn rank(&self, plan: LatticePlan) -> Option<RankedPlan> {
        let score = self.space.score(&plan);
        if score.worst > just_above(self.most_cost) || !self.space.allows(&plan) {
            return None;
        }
        let loose = self.space.loose(&plan);
        let is_known = loose.iter().all(|p| self.loose.contains(p));
        let is_firm = || self.space.infirm(&plan).iter().all(|p| self.infirm.contains(p));
        (is_known && is_firm()).then_some(RankedPlan { plan, score, loose })
    }

    /// Returns the identity of a plan.
    pub fn name(&self, plan: &LatticePlan) -> PlanName {
        PlanName(self.space.relations(plan))
    }

    /// Plans in which `piece` alone changes: its direction or its place in the order. Plans in `seen` are
    /// left out, and the new ones are added to `seen`. The conditions are not checked.
    pub fn moves(
        &self,
        plan: &LatticePlan,
        piece: PatchId,
        seen: &mut BTreeSet<PlanName>,
    ) -> Vec<LatticePlan> {
        let at = plan.position(piece);
        let mut moves = Vec::new();
        let mut add = |other: LatticePlan| {
            if seen.insert(self.name(&other)) {
                moves.push(other);
            }
        };
        if at > 0 {
            let ways = LatticeDirection::all().filter(|s| piece != plan.key() || self.key_ways.contains(s));
            ways.for_each(|s| add(self.with_way(plan.clone(), piece, s)));
        }
        // The key stays last.
        if piece != plan.key() {
            for to in (0..plan.steps.len() - 1).filter(|to| *to != at) {
                add(self.move_step(plan, at, to));
            }
        }
        moves
    }

    fn with_way(&self, mut plan: LatticePlan, piece: PatchId, s: LatticeDirection) -> LatticePlan {
        let at = plan.position(piece);
        plan.steps[at].separation = s;
        plan
    }

    /// Moves the step at `at` to `to`. The direction of a first piece has no meaning, so it is set straight
    /// outwards as in other plans. A piece that was first gets that direction, too.
    fn move_step(&self, plan: &LatticePlan, at: usize, to: usize) -> LatticePlan {
        let mut steps = plan.steps.clone();
        let step = steps.remove(at);
        steps.insert(to, step);
        let outwards = |step: &mut LatticeStep| {
            step.separation = LatticeDirection::nearest(self.space.survey.mean_normal[step.piece]);
        };
        outwards(&mut steps[0]);
        if at == 0 {
            outwards(&mut steps[to]);
        }
        LatticePlan { steps }
    }
}

//! Plans near a plan, and the conditions that any must keep: what a search climbs through that has another
//! objective than costs.

use std::collections::BTreeSet;

use super::key::{KeyChoice, choices};
use super::score::just_above;
use super::space::{Relations, Space};
use super::{FoundPlan, LatticePlan, LatticeStep, PlanConstraints, PlanParams, PlanSurvey, RankedPlan};
use crate::{LatticeDirection, PatchId};

/// The plans with the key of a plan that was found that keep all conditions under which it was found, and
/// that cost no more than is allowed.
pub struct Neighbourhood<'a> {
    space: Space<'a>,
    key_ways: Vec<LatticeDirection>,
    most_cost: f64,
    /// Pieces that hardly anything holds in the plan that was found; others may not be.
    loose: Vec<PatchId>,
    /// Pieces that are not held firmly there; others must be.
    infirm: Vec<PatchId>,
}

/// What tells plans apart that join different pieces, or along different ways.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PlanName(Relations);

impl<'a> Neighbourhood<'a> {
    /// Around `found` and of its key; `survey` counts joints as `found` did ([`FoundPlan::counted`]).
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

    /// The plan with its costs, where it keeps all conditions.
    pub fn ranked(&self, plan: LatticePlan) -> Option<RankedPlan> {
        let score = self.space.score(&plan);
        if score.worst > just_above(self.most_cost) || !self.space.allows(&plan) {
            return None;
        }
        let loose = self.space.loose(&plan);
        let is_known = loose.iter().all(|p| self.loose.contains(p));
        let is_firm = || self.space.infirm(&plan).iter().all(|p| self.infirm.contains(p));
        (is_known && is_firm()).then_some(RankedPlan { plan, score, loose })
    }

    /// Names a plan.
    pub fn name(&self, plan: &LatticePlan) -> PlanName {
        PlanName(self.space.relations(plan))
    }

    /// Plans in which `piece` alone goes elsewhere: along another way, or earlier or later, none of them
    /// `seen`; whether they keep the conditions is not looked at.
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
                add(self.moved(plan, at, to));
            }
        }
        moves
    }

    fn with_way(&self, mut plan: LatticePlan, piece: PatchId, s: LatticeDirection) -> LatticePlan {
        let at = plan.position(piece);
        plan.steps[at].separation = s;
        plan
    }

    /// The step at `at` comes to be the one at `to`. The way of a first piece says nothing: as others do, it
    /// gets the one straight outwards, and so does the piece that was first.
    fn moved(&self, plan: &LatticePlan, at: usize, to: usize) -> LatticePlan {
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

//! The best plans found so far that differ in what they join (Sect. 6.2).

use std::collections::BTreeSet;

use super::InstallationPlan;
use super::score::{COST_TIE, PlanScore};
use super::space::{Relations, Space};

/// Plans kept.
pub(super) const MOST_PLANS: usize = 100;

/// Different plans, best first.
#[derive(Default)]
pub(super) struct Pool {
    plans: Vec<(PlanScore, InstallationPlan)>,
    seen: BTreeSet<Relations>,
}

impl Pool {
    /// Takes in a plan that keeps all conditions, unless one with the same relations was met before.
    pub fn add(&mut self, space: &Space<'_>, score: PlanScore, plan: InstallationPlan) {
        if !self.seen.insert(space.relations(&plan)) {
            return;
        }
        // Of equal plans the one met first stays in front. Keys are rounded so that ties are an equivalence.
        let key = |s: &PlanScore| ((s.worst / COST_TIE).round(), s.mean);
        let rank = key(&score);
        let at = self.plans.partition_point(|(s, _)| {
            let other = key(s);
            other.0 < rank.0 || (other.0 == rank.0 && other.1 <= rank.1)
        });
        self.plans.insert(at, (score, plan));
        self.plans.truncate(MOST_PLANS);
    }

    /// The best plan.
    pub fn best(&self) -> Option<&(PlanScore, InstallationPlan)> {
        self.plans.first()
    }

    /// Cost of the best plan; infinite where there is none.
    pub fn least_cost(&self) -> f64 {
        self.best().map_or(f64::INFINITY, |b| b.0.worst)
    }

    /// All plans, best first.
    pub fn plans(&self) -> &[(PlanScore, InstallationPlan)] {
        &self.plans
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.plans.len()
    }
}

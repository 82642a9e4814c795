//! The best plans found so far that differ in their relations (Sect. 6.2).

use std::collections::BTreeMap;

use super::LatticePlan;
use super::score::{PlanScore, round_cost};
use super::space::{Relations, Space};

/// Greatest number of plans kept.
pub(super) const MOST_PLANS: usize = 100;

/// Different plans, best first.
#[derive(Default)]
pub(super) struct Pool {
    plans: Vec<(PlanScore, LatticePlan)>,
    /// Least cost met with each set of relations, whether the plan was kept or not.
    least_costs: BTreeMap<Relations, f64>,
}

impl Pool {
    /// Adds a plan that satisfies all conditions, unless one with the same relations that costs no more was
    /// met before.
    ///
    /// Pieces that do not touch may still be in each other's way. Then their order changes the cost but not
    /// the joints.
    pub fn add(&mut self, space: &Space<'_>, score: PlanScore, plan: LatticePlan) {
        let relations = space.relations(&plan);
        match self.least_costs.get(&relations) {
            Some(&least) if round_cost(least) <= round_cost(score.worst) => return,
            Some(_) => self
                .plans
                .retain(|(_, other)| space.relations(other) != relations),
            None => {}
        }
        self.least_costs.insert(relations, score.worst);
        // Among equal plans, the one met first stays in front. Keys are rounded so that ties are an
        // equivalence.
        let key = |s: &PlanScore| (round_cost(s.worst), s.mean);
        let rank = key(&score);
        let at = self.plans.partition_point(|(s, _)| {
            let other = key(s);
            other.0 < rank.0 || (other.0 == rank.0 && other.1 <= rank.1)
        });
        self.plans.insert(at, (score, plan));
        self.plans.truncate(MOST_PLANS);
    }

    /// Best plan of the pool.
    pub fn best(&self) -> Option<&(PlanScore, LatticePlan)> {
        self.plans.first()
    }

    /// Cost of the best plan; infinite if the pool is empty.
    pub fn least_cost(&self) -> f64 {
        self.best().map_or(f64::INFINITY, |b| b.0.worst)
    }

    /// All plans in the pool, best first.
    pub fn plans(&self) -> &[(PlanScore, LatticePlan)] {
        &self.plans
    }

    /// Number of plans in the pool.
    pub fn len(&self) -> usize {
        self.plans.len()
    }
}

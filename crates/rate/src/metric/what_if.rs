//! Load factors of a plan with other connectors or walls: uses alone, by the surface model.

use shellock_geom::sparse::SparseError;
use shellock_plan::sizes::{ChosenSizes, ConnectorSizes};
use shellock_plan::{PlanParams, RankedPlan};
use shellock_report::PatchId;

use super::choice::{LoadBorne, bears};
use super::rating::{Bench, Rank};
use super::{EvenSurface, MetricParams, PlanModel};
use crate::handling::Handling;

/// Changes aim at the load factor that is asked plus this, since they lead to another plan.
const AIM: f64 = 0.1;
/// Least factor by which a change must raise the load factor to be worth it.
const GAIN: f64 = 1.05;
/// Most rounds in which connectors grow: once one seam holds, another may open first.
const MOST_ROUNDS: usize = 6;
/// Most walls that are rated.
const MOST_WALLS: usize = 4;
/// Steps of wall thickness per mm.
const WALLS_A_MM: f64 = 10.0;

/// A plan that is rated with other connectors or walls.
pub struct WhatIf<'a> {
    /// Parameters of the plan's search.
    pub params: &'a PlanParams,
    /// Surface divided into the pieces, with even triangles.
    pub even: &'a EvenSurface,
    /// Present sizes of connectors.
    pub sizes: &'a ChosenSizes,
    /// Loads of everyday use, with the present wall.
    pub handling: &'a Handling,
    /// The plan that is rated, with its costs.
    pub plan: &'a RankedPlan,
    /// Load factor that is asked for.
    pub least_factor: f64,
    /// Factor by which the climb is expected to strengthen the plan further; 1 at its end.
    pub gain: f64,
}

impl WhatIf<'_> {
    /// Returns true if a load factor is what is asked for, with a margin for the plan that a change leads to.
    pub fn is_enough(&self, factor: f64) -> bool {
        factor >= self.least_factor + AIM
    }

    /// Enlarges, to the largest that fits, the connectors of every pair that opens under a load which the kit
    /// does not withstand; `bears` are its load factors. Repeats, since another pair may then open first.
    /// Returns the best round's sizes and the least load factor that is expected with them.
    pub fn enlarge(&self, bears: &[LoadBorne]) -> Result<(ChosenSizes, f64), SparseError> {
        let mut best = (self.sizes.clone(), self.least(bears));
        let (mut sizes, mut uses) = (best.0.clone(), bears.to_vec());
        for _ in 0..MOST_ROUNDS {
            let failing = uses
                .iter()
                .filter(|b| b.deed.is_use() && !self.is_enough(self.gain * factor(b)));
            let parting: Vec<(&LoadBorne, [PatchId; 2])> =
                failing.filter_map(|b| Some((b, b.first?.between))).collect();
            let mut has_grown = false;
            for (load, pair) in parting {
                has_grown |= sizes.raise(pair, load.deed.words());
            }
            if !has_grown {
                break;
            }
            uses = self.rate(self.handling.wall_mm, &sizes.sizes)?;
            if self.least(&uses) > best.1 {
                best = (sizes.clone(), self.least(&uses));
            }
            if self.is_enough(best.1) {
                break;
            }
        }
        Ok(best)
    }

    /// Finds the thinnest wall up to `most_mm` that is strong enough with connectors of these sizes. If none
    /// is, returns the thickest, provided that it gains something over the expected load factor `before`;
    /// `None` if the model is not hollow with such a wall.
    pub fn thicken(
        &self,
        sizes: &ConnectorSizes,
        before: f64,
        most_mm: f64,
        is_hollow: impl Fn(f64) -> bool,
    ) -> Result<Option<f64>, SparseError> {
        let (mut wall_mm, mut borne) = (self.handling.wall_mm, before);
        for _ in 0..MOST_WALLS {
            // Plates stiffen with the cube of their thickness, but openings shrink by less than that. The
            // plan that is found with this wall is stronger than the present one.
            let wanted_mm = wall_mm * (self.least_factor / borne.max(0.1)).sqrt();
            let stepped_mm = (wanted_mm * WALLS_A_MM).ceil() / WALLS_A_MM;
            let next_mm = stepped_mm.max(wall_mm + 1.0 / WALLS_A_MM).min(most_mm);
            if next_mm <= wall_mm + 0.5 / WALLS_A_MM || !is_hollow(next_mm) {
                break;
            }
            wall_mm = next_mm;
            borne = self.least(&self.rate(wall_mm, sizes)?);
            if borne >= self.least_factor {
                break;
            }
        }
        Ok((wall_mm > self.handling.wall_mm && is_worth(before, borne)).then_some(wall_mm))
    }

    /// Least load factor in use that is expected at the end of the climb.
    fn least(&self, bears: &[LoadBorne]) -> f64 {
        let uses = bears.iter().filter(|b| b.deed.is_use());
        self.gain * uses.map(factor).fold(f64::INFINITY, f64::min)
    }

    /// Load factors of the plan in each use, with a wall of this thickness and connectors of these sizes.
    fn rate(&self, wall_mm: f64, sizes: &ConnectorSizes) -> Result<Vec<LoadBorne>, SparseError> {
        let params = &PlanParams {
            wall_mm,
            ..self.params.clone()
        };
        let handling = &Handling {
            wall_mm,
            ..*self.handling
        };
        let metric = MetricParams::of_plan(params, sizes, handling.material);
        let model = PlanModel::of_even(&metric, self.even, sizes);
        let bench = Bench::of_uses(handling, &model)?;
        let mut rated = bench.begun(self.plan.clone(), None)?;
        for goal in bench.goals(Rank::Use) {
            rated.ask(goal, None)?;
        }
        Ok(bears(&model, &bench, &rated))
    }
}

/// Returns true if a change is worth it that raises the least load factor from `before` to `after`. A plan
/// that holds under no load has the factor 0, of which any multiple is 0.
pub fn is_worth(before: f64, after: f64) -> bool {
    after > before && after >= GAIN * before
}

/// Returns the use with the least load factor, and that factor, if it is less than asked.
pub fn weakest_use(bears: &[LoadBorne], asked: f64) -> Option<(&LoadBorne, f64)> {
    let uses = bears.iter().filter(|b| b.deed.is_use() && b.first.is_some());
    let worst = uses.min_by(|a, b| factor(a).total_cmp(&factor(b)))?;
    (factor(worst) < asked).then_some((worst, factor(worst)))
}

fn factor(load: &LoadBorne) -> f64 {
    load.factor.unwrap_or(f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_that_gains_nothing_is_not_worth_it() {
        assert!(!is_worth(0.0, 0.0), "a twentieth more than nothing is nothing");
        assert!(is_worth(0.0, 0.1) && is_worth(1.0, GAIN));
        assert!(!is_worth(1.0, 1.04) && !is_worth(1.0, 0.5));
    }
}

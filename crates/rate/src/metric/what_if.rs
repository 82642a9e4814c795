//! Load factors of a plan with other connectors or walls: uses alone, by the surface model.

use shellock_geom::sparse::SparseError;
use shellock_plan::sizes::ConnectorSizes;
use shellock_plan::{PlanParams, RankedPlan};
use shellock_surface::SegmentedSurface;

use super::choice::{LoadBorne, bears};
use super::rating::{Bench, Rank};
use super::{MetricParams, PlanModel};
use crate::handling::Handling;

/// Load factors of `plan` in each use, with connectors of these sizes and walls as thick as `handling` and
/// `params` say.
pub fn bears_with(
    params: &PlanParams,
    surface: &SegmentedSurface,
    sizes: &ConnectorSizes,
    handling: &Handling,
    plan: &RankedPlan,
) -> Result<Vec<LoadBorne>, SparseError> {
    let model = PlanModel::new(
        &MetricParams::of_plan(params, sizes, handling.material),
        surface,
        sizes,
    );
    let bench = Bench::of_uses(handling, &model)?;
    let mut rated = bench.begun(plan.clone(), None)?;
    for goal in bench.goals(Rank::Use) {
        rated.ask(goal, None)?;
    }
    Ok(bears(&model, &bench, &rated))
}

//! Parameters of planning that the user may set.

use serde::{Deserialize, Serialize};
use shellock_assembly::LatticeDirection;
use shellock_geom::Vec3;
use shellock_report::PatchId;

/// Parameters by which plans are judged and searched. Lengths in mm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PlanParams {
    /// Seed of all random streams of this stage. One seed gives one plan on any number of threads.
    pub seed: u64,
    /// Wall thickness. [0, 10]; 0, the outer surface. Seam lengths are those on the inner side of the wall,
    /// where connectors lie.
    pub wall_mm: f64,
    /// Gap between mating faces. [0.03, 0.6]; 0.12. A push must cross this gap before it is resisted.
    pub clearance_mm: f64,
    /// Gap between the walls of two pieces. [0, 0.8]; 0.1.
    pub wall_gap_mm: f64,
    /// Gap between the walls of the key and of its neighbours. [0, 0.8]; 0.15.
    pub key_gap_mm: f64,
    /// Floor β of the connector weight (Eq. 4). [0, 1]; 0.1.
    ///
    /// Keeps a perfect connector from costing nothing at all.
    pub beta: f64,
    /// Share of a piece that another may occlude while the path still counts as free. [0, 0.2]; 0.01. Carving
    /// absorbs this share.
    pub occlusion_tolerance: f64,
    /// Occlusion tolerance of a second attempt, with a warning, if the first gives no plan.
    /// [`occlusion_tolerance`, 0.2]; 0.03.
    ///
    /// [`occlusion_tolerance`]: Self::occlusion_tolerance
    pub relaxed_tolerance: f64,
    /// Piece to use as the key. `None` takes the flattest piece that works.
    pub key: Option<PatchId>,
    /// Only direction along which `key` may leave, with rails under its sides. `None` allows any of the 26,
    /// without rails.
    pub key_slide: Option<LatticeDirection>,
    /// Up direction of the standing model; a key underneath is preferred. Any length but 0; +z.
    pub up: [f64; 3],
    /// Number of plans that the random search compares. [1, 100 000]; 300.
    pub n_plans: usize,
    /// Number of pieces that the random search may remove in all before it gives up. [1, 10⁸]; 200 000.
    ///
    /// Bounds hopeless cases, for each counted run length and each of the two tolerances. If plans exist, the
    /// search ends long before.
    pub max_tries: usize,
    /// Work limit of the exact search: number of pieces revised. [0, 10⁹]; 100 000. With 0, only the trivial
    /// bound 0 is proven.
    pub proof_budget: usize,
}

impl Default for PlanParams {
    fn default() -> Self {
        Self {
            seed: 0,
            wall_mm: 0.0,
            clearance_mm: 0.12,
            wall_gap_mm: 0.1,
            key_gap_mm: 0.15,
            beta: 0.1,
            occlusion_tolerance: 0.01,
            relaxed_tolerance: 0.03,
            key: None,
            key_slide: None,
            up: [0.0, 0.0, 1.0],
            n_plans: 300,
            max_tries: 200_000,
            proof_budget: 100_000,
        }
    }
}

impl PlanParams {
    /// Returns true if `later`, the later piece of a pair, is the key that slides on rails along `s`.
    pub fn slides_on_rails(&self, later: PatchId, s: LatticeDirection) -> bool {
        self.key == Some(later) && self.key_slide == Some(s)
    }

    /// Returns every problem at once, with advice on what to do; empty if all values are valid.
    pub fn problems(&self) -> Vec<String> {
        let mut problems = Vec::new();
        let mut range = |name: &str, value: f64, low: f64, high: f64| {
            if !(low..=high).contains(&value) {
                problems.push(format!("`{name}` is {value}; choose a value in [{low}, {high}]"));
            }
        };
        range("wall_mm", self.wall_mm, 0.0, 10.0);
        range("clearance_mm", self.clearance_mm, 0.03, 0.6);
        range("wall_gap_mm", self.wall_gap_mm, 0.0, 0.8);
        range("key_gap_mm", self.key_gap_mm, 0.0, 0.8);
        range("beta", self.beta, 0.0, 1.0);
        range("occlusion_tolerance", self.occlusion_tolerance, 0.0, 0.2);
        range(
            "relaxed_tolerance",
            self.relaxed_tolerance,
            self.occlusion_tolerance,
            0.2,
        );
        range("n_plans", self.n_plans as f64, 1.0, 1e5);
        range("proof_budget", self.proof_budget as f64, 0.0, 1e9);
        range("max_tries", self.max_tries as f64, 1.0, 1e8);
        if Vec3::from(self.up).try_normalize().is_none() {
            problems.push("`up` has no direction; give a vector such as (0, 0, 1)".into());
        }
        problems
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_in_range_and_every_fault_is_named() {
        assert_eq!(PlanParams::default().problems(), Vec::<String>::new());
        let bad = PlanParams {
            beta: -1.0,
            n_plans: 0,
            up: [0.0; 3],
            ..PlanParams::default()
        };
        assert_eq!(bad.problems().len(), 3);
    }
}

//! Space that the connectors chosen so far occupy or pass through.

use shellock_geom::Vec3;
use shellock_geom::bvh::TriangleBvh;
use shellock_plan::LatticePlan;
use shellock_report::PatchId;

use super::ConnectorParams;
use super::outline::{Half, whole_half};
use super::station::Run;

/// Half connectors that are chosen, in their places.
pub(super) struct Taken<'a> {
    plan: &'a LatticePlan,
    halves: Vec<(PatchId, TriangleBvh)>,
}

impl<'a> Taken<'a> {
    /// Creates the space without any connectors.
    pub fn none(plan: &'a LatticePlan) -> Self {
        Self {
            plan,
            halves: Vec::new(),
        }
    }

    /// Adds both halves of a run.
    pub fn add(&mut self, params: &ConnectorParams, run: &Run) {
        for (piece, half) in [(run.male, Half::Male), (run.female, Half::Female)] {
            let skin = TriangleBvh::new(&whole_half(params, run, half).to_mesh());
            self.halves.push((piece, skin));
        }
    }

    /// Returns true if `piece` may have a connector at `point`: none of a later piece passes there on its way
    /// out, and it passes none of an earlier piece on its own.
    pub fn leaves_free(&self, piece: PatchId, point: Vec3) -> bool {
        let place = self.plan.position(piece);
        let own_way = self.plan.separation(piece).unit();
        self.halves.iter().all(|(other, skin)| {
            let towards = match self.plan.position(*other).cmp(&place) {
                std::cmp::Ordering::Greater => -self.plan.separation(*other).unit(),
                std::cmp::Ordering::Less => own_way,
                std::cmp::Ordering::Equal => return true,
            };
            skin.first_hit(point, towards, f64::INFINITY).is_none()
        })
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::connector::{RunShape, RunStation};
    use shellock_assembly::LatticeDirection;
    use shellock_plan::LatticeStep;

    /// Piece 2 leaves first, along y; piece 1 next, along z. A run along x joins pieces 2 and 0.
    #[test]
    fn connectors_keep_later_pieces_ways_free_and_their_own_way_clear_of_earlier_ones() {
        let step = |piece: u32, along: Vec3| LatticeStep {
            piece: PatchId(piece),
            separation: LatticeDirection::nearest(along),
        };
        let plan = LatticePlan {
            steps: vec![step(0, Vec3::X), step(1, Vec3::Z), step(2, Vec3::Y)],
        };
        let at = |x: f64| RunStation {
            point: x * Vec3::X,
            tangent: Vec3::X,
            n: Vec3::Z,
            s: Vec3::Y,
            theta: 0.0,
            depth: 1.0,
            arc_mm: x,
            size_mm: 2.5,
            clearance_mm: 0.12,
            shape: RunShape::Seam,
        };
        let mut taken = Taken::none(&plan);
        taken.add(
            &ConnectorParams::default(),
            &Run {
                male: PatchId(2),
                female: PatchId(0),
                stations: vec![at(0.0), at(10.0)],
            },
        );
        let is_free = |piece: u32, y: f64, z: f64| taken.leaves_free(PatchId(piece), Vec3::new(5.1, y, z));
        // Piece 2 carries its pin along y, over these points.
        assert!(!is_free(0, 5.0, -0.5) && !is_free(1, 5.0, -0.5));
        assert!(is_free(0, -9.0, -0.5) && is_free(0, 5.0, -9.0));
        // Piece 1 would run into the channel of piece 0 from below it, and piece 2 from behind it.
        assert!(!is_free(1, -2.0, -9.0) && is_free(1, -9.0, -9.0));
        assert!(!is_free(2, -9.0, -2.0) && is_free(2, -9.0, 9.0));
    }
}

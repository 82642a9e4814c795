//! Connectors of a pair that the other piece's wall would obstruct.
//!
//! Below the wall, half a connector deep, each piece has its half. The later piece's half must not hit the
//! earlier piece on its way out. Nor may the later piece's far wall sweep over the earlier piece's half:
//!
//! ```text
//!   ─────a──────┬──────b─────        a later, leaving along s: blocked where
//!          x_a  │  x_b               the ray from x_a along s meets b, or
//!                                    the ray from x_b along −s meets a, or,
//!   ─────a─────────────b─────        as b's channel reaches to x_a if a has the pin, from x_a along −s a
//! ```
//!
//! Round thin limbs, where the far wall is near, little more than the limb's axis remains as a direction.
//! Limits: only the two pieces of the seam are checked, since the order of the others is not known yet.

use shellock_assembly::LatticeDirection;
use shellock_geom::Vec3;
use shellock_geom::bvh::TriangleBvh;
use shellock_report::PatchId;
use shellock_surface::SegmentedSurface;

use crate::PlanParams;

/// Position at which a half connector is checked, in connector sizes: below the wall and beside the seam.
const DEPTH_SIZES: f64 = 0.5;
const BESIDE_SIZES: f64 = 0.5;
/// The wall above the connector is no obstacle: hits within this multiple of the distance to a flat wall do
/// not count.
const LOCAL_WALL: f64 = 1.3;
/// Least cosine between a ray and the surface normal at which the ray leaves through the wall above.
const LEAVES_ABOVE: f64 = 0.3;
/// Share of the wall thickness at which a point counts as below a wall. The search for such a point ends
/// after this number of moves from wall to wall.
const ENOUGH_WALL: f64 = 0.95;
const MOST_MOVES: usize = 8;
/// Greatest number of walls that a ray is followed through, and step past each, mm.
const MOST_WALLS: usize = 8;
const PAST_WALL_MM: f64 = 0.01;

/// The surface as rays see it.
pub(super) struct Obstructions<'a> {
    surface: &'a SegmentedSurface,
    bvh: TriangleBvh,
    wall_mm: f64,
    far_mm: f64,
}

/// One bit for each blocked pair of an order (0 if the piece with the lower id is later) and a direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Blocked(u64);

impl Blocked {
    /// Returns true if the later piece cannot leave along `s` with a connector here.
    pub fn has(self, order: usize, s: LatticeDirection) -> bool {
        self.0 >> (order * LatticeDirection::COUNT + s.index()) & 1 == 1
    }
}

impl<'a> Obstructions<'a> {
    /// Prepares the surface for rays. `None` if walls have no thickness, so that there is no room to check.
    pub fn new(params: &PlanParams, surface: &'a SegmentedSurface) -> Option<Self> {
        (params.wall_mm > 0.0).then(|| Self {
            surface,
            bvh: TriangleBvh::new(&surface.mesh),
            wall_mm: params.wall_mm,
            far_mm: surface.mesh.bounds().diagonal(),
        })
    }

    /// Moves `point` to the inner side of all walls. The point lies below one wall by the wall's thickness,
    /// but may be nearer to another, as below an edge of the model. `None` if the walls leave no cavity.
    pub fn at_depth(&self, mut point: Vec3) -> Option<Vec3> {
        for _ in 0..MOST_MOVES {
            let limit_mm = ENOUGH_WALL * self.wall_mm;
            let Some(near) = self.bvh.nearest(point, limit_mm * limit_mm) else {
                return Some(point);
            };
            let inwards = (point - near.point).try_normalize()?;
            if inwards.dot(self.surface.mesh.face_normal(near.face as usize)) >= 0.0 {
                return None;
            }
            point = near.point + self.wall_mm * inwards;
        }
        None
    }

    /// Orders and directions in which a connector of `size_mm` between `a` and `b` is obstructed. The
    /// connector lies below `point` of the outer surface; `across` leads from a to b.
    pub fn at(&self, [a, b]: [PatchId; 2], size_mm: f64, point: Vec3, normal: Vec3, across: Vec3) -> Blocked {
        let height_mm = self.wall_mm + DEPTH_SIZES * size_mm;
        let below = point - height_mm * normal;
        let beside = BESIDE_SIZES * size_mm * across;
        let (in_a, in_b) = (below - beside, below + beside);
        let seen = |origin: Vec3| {
            LatticeDirection::all()
                .map(|s| self.met(origin, normal, height_mm, s, [a, b]))
                .collect()
        };
        let (from_a, from_b): (Vec<[bool; 2]>, Vec<[bool; 2]>) = (seen(in_a), seen(in_b));
        let mut blocked = 0;
        for s in LatticeDirection::all() {
            let (on, back) = (s.index(), s.opposite().index());
            let later_is_male = s.unit().dot(normal) >= 0.0;
            // For each order: hits from the later and from the earlier piece's side, and the indices of the
            // two patches.
            for (order, (later, earlier, own, other)) in [(&from_a, &from_b, 0, 1), (&from_b, &from_a, 1, 0)]
                .into_iter()
                .enumerate()
            {
                // The channel reaches under the male's wall, so one of the halves lies on the other piece's
                // side as well.
                let channel = if later_is_male {
                    later[back][own]
                } else {
                    earlier[on][other]
                };
                if later[on][other] || earlier[back][own] || channel {
                    blocked |= 1 << (order * LatticeDirection::COUNT + on);
                }
            }
        }
        Blocked(blocked)
    }

    /// Tells for each of two patches if the ray along `s` hits it. The ray starts at `origin`, `height_mm`
    /// below the surface; the wall right above does not count.
    fn met(
        &self,
        origin: Vec3,
        normal: Vec3,
        height_mm: f64,
        s: LatticeDirection,
        patches: [PatchId; 2],
    ) -> [bool; 2] {
        let along = s.unit();
        let up = along.dot(normal);
        let mut travel_mm = if up > LEAVES_ABOVE {
            LOCAL_WALL * height_mm / up
        } else {
            0.0
        };
        let mut met = [false; 2];
        for _ in 0..MOST_WALLS {
            let Some((face, on_mm)) = self.bvh.first_hit(origin + travel_mm * along, along, self.far_mm)
            else {
                break;
            };
            let patch = self.surface.patch_of_face[face as usize];
            met = [met[0] || patch == patches[0], met[1] || patch == patches[1]];
            travel_mm += on_mm + PAST_WALL_MM;
        }
        met
    }
}

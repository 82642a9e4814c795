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
//! As long as the order of the pieces is not known, only the two pieces of the seam are checked
//! ([`Blocked`]). For a whole plan the same rays tell of all pieces ([`Sights::is_blocked`]).

use shellock_assembly::LatticeDirection;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{TriMesh, Vec3};
use shellock_report::PatchId;

use crate::{LatticePlan, LatticeStep, PieceSet};

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
pub struct Obstructions<'a> {
    mesh: &'a TriMesh,
    patch_of_face: &'a [PatchId],
    bvh: TriangleBvh,
    wall_mm: f64,
    far_mm: f64,
}

/// Way of a piece out of a kit.
#[derive(Clone, Copy, Debug)]
pub struct Leave {
    /// The piece that leaves.
    pub piece: PatchId,
    /// Direction in which it leaves.
    pub s: LatticeDirection,
    /// Place of the piece in the order of installation.
    pub place: usize,
}

impl Leave {
    /// Ways of all pieces of a plan.
    pub fn all(plan: &LatticePlan) -> Vec<Self> {
        let leave = |(place, step): (usize, &LatticeStep)| Self {
            piece: step.piece,
            s: step.separation,
            place,
        };
        plan.steps.iter().enumerate().map(leave).collect()
    }
}

/// Pieces that rays from the two halves of a connector between patches a and b meet along the lattice
/// directions: first from the half on the side of a, then from the other.
#[derive(Clone, Debug)]
pub struct Sights {
    seen: [[PieceSet; LatticeDirection::COUNT]; 2],
    normal: Vec3,
}

impl Sights {
    /// Returns true if the connector has no free way. `leaves` are the pieces that count as obstacles, the
    /// connector's own two among them.
    pub fn is_blocked(&self, pair: [PatchId; 2], a_is_later: bool, leaves: &[Leave]) -> bool {
        let of = |piece: PatchId| {
            leaves
                .iter()
                .find(|l| l.piece == piece)
                .expect("both pieces leave")
        };
        let own = pair.map(of);
        let later = usize::from(!a_is_later);
        let later_is_male = own[later].s.unit().dot(self.normal) >= 0.0;
        let male = if later_is_male { later } else { 1 - later };
        // The channel reaches under the male's wall, so parts of both pieces lie on that side.
        [(0, 0), (1, 1), (male, 1 - male)]
            .into_iter()
            .any(|(side, owner)| {
                leaves.iter().any(|other| {
                    let along = match other.place.cmp(&own[owner].place) {
                        std::cmp::Ordering::Less => own[owner].s,
                        std::cmp::Ordering::Greater => other.s.opposite(),
                        std::cmp::Ordering::Equal => return false,
                    };
                    self.seen[side][along.index()].contains(other.piece)
                })
            })
    }

    /// Orders and directions in which one of the two pieces blocks the connector between them.
    pub(super) fn blocked(&self, [a, b]: [PatchId; 2]) -> Blocked {
        let mut blocked = 0;
        for (order, [later, earlier]) in [[a, b], [b, a]].into_iter().enumerate() {
            for s in LatticeDirection::all() {
                let leave = |piece, place| Leave { piece, s, place };
                if self.is_blocked([a, b], later == a, &[leave(later, 1), leave(earlier, 0)]) {
                    blocked |= 1 << (order * LatticeDirection::COUNT + s.index());
                }
            }
        }
        Blocked(blocked)
    }
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
    pub fn new(wall_mm: f64, mesh: &'a TriMesh, patch_of_face: &'a [PatchId]) -> Option<Self> {
        (wall_mm > 0.0).then(|| Self {
            mesh,
            patch_of_face,
            bvh: TriangleBvh::new(mesh),
            wall_mm,
            far_mm: mesh.bounds().diagonal(),
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
            if inwards.dot(self.mesh.face_normal(near.face as usize)) >= 0.0 {
                return None;
            }
            point = near.point + self.wall_mm * inwards;
        }
        None
    }

    /// Pieces that the two halves of a connector of `size_mm` see along all directions. The connector lies
    /// below `point` of the outer surface; `across` leads from the first half to the second.
    pub fn sights(&self, size_mm: f64, point: Vec3, normal: Vec3, across: Vec3) -> Sights {
        let height_mm = self.wall_mm + DEPTH_SIZES * size_mm;
        let below = point - height_mm * normal;
        let beside = BESIDE_SIZES * size_mm * across;
        let mut seen = [[PieceSet::EMPTY; LatticeDirection::COUNT]; 2];
        for (half, origin) in seen.iter_mut().zip([below - beside, below + beside]) {
            for s in LatticeDirection::all() {
                half[s.index()] = self.met(origin, normal, height_mm, s);
            }
        }
        Sights { seen, normal }
    }

    /// Pieces that the ray along `s` meets. The ray starts at `origin`, `height_mm` below the surface; the
    /// wall right above does not count.
    fn met(&self, origin: Vec3, normal: Vec3, height_mm: f64, s: LatticeDirection) -> PieceSet {
        let along = s.unit();
        let up = along.dot(normal);
        let mut travel_mm = if up > LEAVES_ABOVE {
            LOCAL_WALL * height_mm / up
        } else {
            0.0
        };
        let mut met = PieceSet::EMPTY;
        for _ in 0..MOST_WALLS {
            let Some((face, on_mm)) = self.bvh.first_hit(origin + travel_mm * along, along, self.far_mm)
            else {
                break;
            };
            met = met.union(PieceSet::one(self.patch_of_face[face as usize]));
            travel_mm += on_mm + PAST_WALL_MM;
        }
        met
    }
}

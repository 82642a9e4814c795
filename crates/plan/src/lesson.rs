//! Lessons from a plan or a kit that failed, and the constraints on later plans that follow.

mod kit;

pub use kit::of_kit;
use shellock_assembly::LatticeDirection;
use shellock_geom::Vec3;
use shellock_report::PatchId;

use crate::types::{LatticePlan, PlanConstraints};

/// One lesson from a plan or kit that failed.
#[derive(Clone, Debug, PartialEq)]
pub enum Lesson {
    /// Connectors came out too short to hold their pieces together.
    WeakJoints(Vec<WeakJoint>),
    /// A piece rubs on another along its direction.
    RubbingPath {
        /// Id of the piece's patch.
        piece: PatchId,
        /// Direction in which the piece leaves.
        separation: LatticeDirection,
        /// Earlier piece with the worst overlap.
        against: PatchId,
        /// Distance of the overlap from the assembled position, mm.
        travel_mm: f64,
        /// Mean thickness of the overlap, mm.
        thickness_mm: f64,
        /// Volume of the overlap, mm³.
        volume_mm3: f64,
    },
    /// A piece that moves out would leave most of its wall behind.
    Blocked {
        /// Id of the piece's patch.
        piece: PatchId,
        /// Direction in which the piece leaves.
        separation: LatticeDirection,
        /// Share of the wall that could move out with the piece, in [0, 1].
        free_share: f64,
    },
    /// A piece lost outer surface because it was cut to pass others along its direction.
    SkinLost {
        /// Id of the piece's patch.
        piece: PatchId,
        /// Direction in which the piece leaves.
        separation: LatticeDirection,
        /// Deepest point of the hole, mm.
        at: Vec3,
    },
    /// Connectors hold a piece by much less than the plan foresaw.
    BadlyHeld {
        /// Id of the piece's patch.
        piece: PatchId,
        /// Share of the foreseen hold, in [0, 1).
        share: f64,
    },
    /// The plan as a whole failed, whatever the reason.
    FailedPlan {
        /// Plan to reject, in patches of the division.
        plan: LatticePlan,
        /// Pieces that were loose, or moved in a cluster.
        loose: Vec<PatchId>,
    },
}

/// Pair of pieces whose connectors are too short when the later piece leaves along `separation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeakJoint {
    /// Piece of the pair installed later.
    pub later: PatchId,
    /// Piece of the pair installed earlier.
    pub earlier: PatchId,
    /// Direction in which the later piece leaves.
    pub separation: LatticeDirection,
    /// Length of the pair's connectors, mm.
    pub length_mm: f64,
    /// Length of the pair's seams on the inner side of the wall, mm.
    pub seam_mm: f64,
}

impl Lesson {
    /// Adds the lesson to the constraints on later plans.
    pub fn teach(&self, constraints: &mut PlanConstraints) {
        match self {
            Self::WeakJoints(joints) => {
                constraints
                    .weak_joints
                    .extend(joints.iter().map(|j| (j.later, j.earlier, j.separation)));
            }
            Self::RubbingPath {
                piece,
                separation,
                against,
                ..
            } => {
                constraints.forbidden.insert((*piece, *separation));
                *constraints.rubs.entry((*piece, *against)).or_default() += 1;
            }
            Self::Blocked {
                piece, separation, ..
            }
            | Self::SkinLost {
                piece, separation, ..
            } => {
                constraints.forbidden.insert((*piece, *separation));
            }
            Self::BadlyHeld { piece, share } => {
                let least = constraints.held_shares.entry(*piece).or_insert(*share);
                *least = least.min(*share);
            }
            Self::FailedPlan { plan, .. } => constraints.rejections.push(plan.clone()),
        }
    }

    /// Pieces whose division into smaller ones may help.
    pub fn suspects(&self) -> Vec<PatchId> {
        match self {
            Self::WeakJoints(_) | Self::BadlyHeld { .. } => Vec::new(),
            Self::RubbingPath { piece, .. } | Self::Blocked { piece, .. } | Self::SkinLost { piece, .. } => {
                vec![*piece]
            }
            Self::FailedPlan { loose, .. } => loose.clone(),
        }
    }

    /// Returns the pieces that came out loose.
    pub fn loose(&self) -> Vec<PatchId> {
        if let Self::FailedPlan { loose, .. } = self {
            loose.clone()
        } else {
            Vec::new()
        }
    }
}

impl std::fmt::Display for Lesson {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::WeakJoints(joints) => {
                let line = |j: &WeakJoint| {
                    let WeakJoint {
                        later,
                        earlier,
                        length_mm,
                        seam_mm,
                        ..
                    } = j;
                    format!("{later} and {earlier} ({length_mm:.1} mm on {seam_mm:.0} mm of seam)")
                };
                let list: Vec<String> = joints.iter().map(line).collect();
                write!(
                    f,
                    "connectors came out too short between pieces {}",
                    list.join(", ")
                )
            }
            Self::RubbingPath {
                piece,
                against,
                travel_mm,
                thickness_mm,
                ..
            } => write!(
                f,
                "piece {piece} would rub on piece {against} on its way in, {travel_mm:.1} mm before it \
                 sits, {thickness_mm:.2} mm deep"
            ),
            Self::Blocked {
                piece,
                free_share: kept,
                ..
            } => {
                write!(
                    f,
                    "piece {piece} could take only {:.0} % of its wall along on its way out",
                    100.0 * kept
                )
            }
            Self::SkinLost { piece, at, .. } => {
                write!(
                    f,
                    "piece {piece} would lose outer surface on its way out, at {at:.0} mm"
                )
            }
            Self::BadlyHeld { piece, share } => {
                let percent = 100.0 * share;
                write!(
                    f,
                    "connectors hold piece {piece} by {percent:.0} % of what was foreseen"
                )
            }
            Self::FailedPlan { loose, .. } if loose.is_empty() => {
                write!(f, "the kit failed its verification")
            }
            Self::FailedPlan { loose, .. } => {
                let list: Vec<String> = loose.iter().map(ToString::to_string).collect();
                write!(
                    f,
                    "{} {} would come loose",
                    if list.len() == 1 { "piece" } else { "pieces" },
                    list.join(", ")
                )
            }
        }
    }
}

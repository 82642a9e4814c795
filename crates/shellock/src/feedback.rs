//! What a finished kit that failed its verification teaches the next round.

use std::collections::BTreeMap;

use crate::pipeline::{Design, Params};
use crate::plan::{InstallationPlan, PlanConstraints};
use crate::verify::Finding;
use crate::{LatticeDirection, PatchId};

/// A contact holds if its connectors are at least this long in all, in connector sizes. One run is at least 1.2 long; on
/// the models tried, joints under this were the ones that came loose.
const LEAST_JOINT: f64 = 1.2;

/// One thing learned.
#[derive(Clone, Debug, PartialEq)]
pub enum Lesson {
    /// The connectors between two pieces came out too short to hold.
    WeakContact {
        /// The pieces, lower id first.
        pair: (PatchId, PatchId),
        /// Length of their connectors, mm.
        length_mm: f64,
        /// Length of the seams between them on the inner side of the wall, mm.
        seam_mm: f64,
        /// Length of these on which ends, angles and turns allow connectors, mm.
        usable_mm: f64,
    },
    /// A piece rubs on its way along a direction.
    RubbingPath {
        /// The piece.
        piece: PatchId,
        /// The direction.
        separation: LatticeDirection,
        /// The earlier piece that is worst in its way.
        against: PatchId,
        /// How far from its place, mm.
        travel_mm: f64,
        /// Mean thickness of the overlap, mm.
        thickness_mm: f64,
        /// Volume of the overlap, mm³.
        volume_mm3: f64,
    },
    /// The plan as a whole failed.
    FailedPlan {
        /// The plan.
        plan: InstallationPlan,
        /// Pieces that were loose or moved.
        loose: Vec<PatchId>,
    },
}

impl Lesson {
    /// Adds what was learned to what plans must respect.
    pub fn teach(&self, constraints: &mut PlanConstraints) {
        match self {
            Self::WeakContact { pair, .. } => {
                constraints.weak_contacts.insert(*pair);
            }
            Self::RubbingPath { piece, separation, against, .. } => {
                constraints.forbidden.insert((*piece, *separation));
                *constraints.rubbed.entry((*piece, *against)).or_default() += 1;
            }
            Self::FailedPlan { plan, .. } => constraints.rejected.push(plan.clone()),
        }
    }

    /// The pieces whose division may help.
    pub fn blamed(&self) -> Vec<PatchId> {
        match self {
            Self::WeakContact { .. } => Vec::new(),
            Self::RubbingPath { piece, .. } => vec![*piece],
            Self::FailedPlan { loose, .. } => loose.clone(),
        }
    }
}

impl std::fmt::Display for Lesson {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::WeakContact { pair: (a, b), length_mm, seam_mm, usable_mm } => write!(
                f,
                "connectors between pieces {a} and {b} came out only {length_mm:.1} mm long; their seam has {seam_mm:.1} mm, {usable_mm:.1} mm of them fit for connectors"
            ),
            Self::RubbingPath { piece, against, travel_mm, thickness_mm, volume_mm3, .. } => write!(
                f,
                "piece {piece} rubs on its way in: {travel_mm:.1} mm from its place it meets piece {against} by {volume_mm3:.1} mm³, {thickness_mm:.2} mm thick"
            ),
            Self::FailedPlan { loose, .. } if loose.is_empty() => write!(f, "the kit failed its verification"),
            Self::FailedPlan { loose, .. } => {
                let list: Vec<String> = loose.iter().map(ToString::to_string).collect();
                write!(f, "pieces {} came out loose", list.join(", "))
            }
        }
    }
}

/// The lessons of a kit; none where it passed. The last one always rules this plan out.
pub fn lessons(design: &Design, params: &Params) -> Vec<Lesson> {
    if design.verification.passed() {
        return Vec::new();
    }
    let mut loose = Vec::new();
    let mut learned = Vec::new();
    for finding in &design.verification.findings {
        match finding {
            &Finding::PathRubs { piece, against, travel_mm, thickness_mm, volume_mm3, .. } => {
                let separation = design.plan.separation(piece);
                learned.push(Lesson::RubbingPath { piece, separation, against, travel_mm, thickness_mm, volume_mm3 });
            }
            Finding::Loose { piece, .. } => loose.push(*piece),
            Finding::ClusterMoves { motions } => loose.extend(motions.iter().map(|m| m.piece)),
            _ => {}
        }
    }
    loose.sort_unstable();
    loose.dedup();
    learned.extend(weak_contacts(design, params, &loose));
    learned.push(Lesson::FailedPlan { plan: design.plan.clone(), loose });
    learned
}

/// Contacts of loose pieces whose connectors are too short: they must not be counted on again.
fn weak_contacts(design: &Design, params: &Params, loose: &[PatchId]) -> Vec<Lesson> {
    let mut lengths: BTreeMap<(PatchId, PatchId), [f64; 3]> = BTreeMap::new();
    let ordered = |a: PatchId, b: PatchId| (a.min(b), a.max(b));
    for contact in &design.contacts {
        let of_pair = lengths.entry(ordered(contact.later, contact.earlier)).or_default();
        of_pair[1] += contact.length_mm;
        of_pair[2] += contact.usable_mm;
    }
    for joint in &design.joints {
        lengths.entry(ordered(joint.male, joint.female)).or_default()[0] += joint.length_mm;
    }
    lengths
        .into_iter()
        .filter(|((a, b), _)| loose.contains(a) || loose.contains(b))
        .filter(|(_, [length_mm, ..])| *length_mm < LEAST_JOINT * params.connector.size_mm)
        .map(|(pair, [length_mm, seam_mm, usable_mm])| Lesson::WeakContact { pair, length_mm, seam_mm, usable_mm })
        .collect()
}

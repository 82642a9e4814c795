//! What a finished kit that failed its verification teaches the next round.

use std::collections::BTreeMap;

use crate::connector::Contact;
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
    },
    /// A piece rubs on its way along a direction.
    RubbingPath {
        /// The piece.
        piece: PatchId,
        /// The direction.
        separation: LatticeDirection,
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
            Self::RubbingPath { piece, separation } => {
                constraints.forbidden.insert((*piece, *separation));
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
            Self::WeakContact { pair: (a, b), length_mm } => {
                write!(f, "connectors between pieces {a} and {b} came out only {length_mm:.1} mm long")
            }
            Self::RubbingPath { piece, .. } => write!(f, "piece {piece} rubs on its way in"),
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
            Finding::PathRubs { piece, .. } => {
                learned.push(Lesson::RubbingPath { piece: *piece, separation: design.plan.separation(*piece) });
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
    let mut length: BTreeMap<(PatchId, PatchId), f64> = BTreeMap::new();
    let ordered = |a: PatchId, b: PatchId| (a.min(b), a.max(b));
    for Contact { later, earlier, .. } in &design.contacts {
        length.entry(ordered(*later, *earlier)).or_default();
    }
    for joint in &design.joints {
        *length.entry(ordered(joint.male, joint.female)).or_default() += joint.length_mm;
    }
    length
        .into_iter()
        .filter(|((a, b), _)| loose.contains(a) || loose.contains(b))
        .filter(|(_, length_mm)| *length_mm < LEAST_JOINT * params.connector.size_mm)
        .map(|(pair, length_mm)| Lesson::WeakContact { pair, length_mm })
        .collect()
}

//! Certificate of a finished kit: its claims, each with the data that an independent check needs.
//!
//! A verdict ([`mod@crate::verify`]) asks for trust in the program that made it. A certificate does not. It
//! names the files by their hashes, and records the results that are hard to find: the contacts that hold the
//! pieces, and their forces. Checking them takes arithmetic only. The package `shellock-check` does that
//! without any of this code. docs/notes/certificate.md describes the format, the derivation and what is *not*
//! proven.
//!
//! Coordinates are mm in assembly space. Motions are twists about [`Certificate::center`].

mod bounded;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

use bounded::list_bounds;
pub use bounded::{BearingPoint, Bounded};
use serde::{Deserialize, Serialize};
use shellock_geom::{TriMesh, Vec3};

use crate::InstallationPlan;
use crate::PressFit;
use crate::motion::proof::{LockProof, frame, prove_lock};
use crate::play::{KitPlay, Slide};
use crate::verify::clearance::{KitGaps, NearestPlace};
use crate::verify::contact::{Contact, REACH_MM};
use crate::verify::{Finding, Play, Verification};
use crate::{IdVec, PatchId};

/// Value of [`Certificate::format`] that marks a certificate.
pub const FORMAT: &str = "shellock-certificate";
/// Value of [`Certificate::version`]; readers reject versions that they do not know.
pub const VERSION: u32 = 4;

/// File of a piece, with its hash and play.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PieceFile {
    /// Piece that the file holds.
    pub id: PatchId,
    /// Path of the file within the kit.
    pub file: String,
    /// SHA-256 of the file's bytes, in lower-case hexadecimal digits.
    pub sha256: String,
    /// Play of the piece while all others are held, if it is proven.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub play: Option<Play>,
}

/// Another file of a kit.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct OtherFile {
    /// Path of the file within the kit.
    pub file: String,
    /// SHA-256 of the file's bytes, in lower-case hexadecimal digits.
    pub sha256: String,
}

/// Place where one piece keeps another from coming nearer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HoldingContact {
    /// Piece that the point lies on.
    pub a: PatchId,
    /// Piece that the point faces.
    pub b: PatchId,
    /// Position of the contact, mm.
    pub point: [f64; 3],
    /// Outward unit normal of `a` at the point, towards `b`.
    pub normal: [f64; 3],
    /// Distance from the point to `b`, mm.
    pub gap_mm: f64,
}

/// Least distance between two bodies, and its place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeastGap {
    /// Distance between the bodies, mm; negative where they overlap.
    pub gap_mm: f64,
    /// Travel of the moving body at that moment, mm; 0 if nothing moves.
    pub travel_mm: f64,
    /// Place of the least distance, mm.
    pub at: [f64; 3],
    /// Other piece of the pair.
    pub against: PatchId,
}

/// Least of several gaps, once for whole surfaces, which touch at the outer rim, and once for the part
/// beneath the rim.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LeastGaps {
    /// Least gap of whole surfaces; `None` if it was not computed, or nothing comes within a millimetre.
    pub overall: Option<LeastGap>,
    /// Least gap of the part beneath the rim.
    pub beneath_rim: Option<LeastGap>,
}

impl LeastGaps {
    /// Least of `gaps`, overall and beneath the rim; each gap comes with its other piece.
    fn of(gaps: impl Iterator<Item = (PatchId, NearestPlace, Option<NearestPlace>)> + Clone) -> Self {
        let named = |against: PatchId, p: NearestPlace| LeastGap {
            gap_mm: p.gap_mm,
            travel_mm: p.travel_mm,
            at: p.at,
            against,
        };
        let less = |x: &LeastGap, y: &LeastGap| x.gap_mm.total_cmp(&y.gap_mm);
        Self {
            overall: gaps.clone().map(|(id, place, _)| named(id, place)).min_by(less),
            beneath_rim: gaps
                .filter_map(|(id, _, place)| Some(named(id, place?)))
                .min_by(less),
        }
    }
}

/// One claim about a kit, with its proof where it needs one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "claim", rename_all = "kebab-case")]
pub enum Claim {
    /// While the held piece does not move, only `leaves` can move: no other pieces can, alone or together, by
    /// however little.
    Locked {
        /// Piece that does not move; the choice of piece does not matter.
        held: Vec<PatchId>,
        /// Key, which is allowed to move.
        leaves: PatchId,
        /// Contacts, by their indices in the certificate's list, with positive multipliers.
        multipliers: Vec<(usize, f64)>,
        /// Length of the sum of the wrenches times their multipliers. Less than `hold`, which proves the
        /// claim.
        residual: f64,
        /// Least singular value that remains for the other pieces, of the contacts' wrenches weighted by
        /// their multipliers up to 1.
        hold: f64,
    },
    /// Some pieces stay within their play on every path of motions of any size, at the given clearance.
    Bounded(Bounded),
    /// The key can be removed: it moves along `direction` without collision.
    KeyLeaves {
        /// Key of the kit.
        piece: PatchId,
        /// Unit vector of the motion.
        direction: [f64; 3],
        /// Least gaps to other pieces along the whole way.
        least: LeastGaps,
    },
    /// The piece can be installed: it reaches its place along `direction` past all pieces that are already
    /// there.
    Installs {
        /// Piece that is installed.
        piece: PatchId,
        /// Unit vector of the motion.
        direction: [f64; 3],
        /// Least gaps to other pieces along the whole way.
        least: LeastGaps,
    },
    /// The assembled pieces do not overlap.
    Apart {
        /// Least gaps of all pairs of pieces.
        least: LeastGaps,
    },
}

/// Claims about a kit, with the data of their proofs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// Format of the file: [`FORMAT`].
    pub format: String,
    /// Version of the format: [`VERSION`].
    pub version: u32,
    /// Gap left between mating faces, mm.
    pub clearance_mm: f64,
    /// Greatest distance between faces that hold each other, mm.
    pub reach_mm: f64,
    /// Point that twists are about.
    pub center: [f64; 3],
    /// Distance at which spins count as velocities, mm: half the diagonal of the kit.
    pub length_mm: f64,
    /// Key: the piece installed last.
    pub key: PatchId,
    /// Order of installation, first to last.
    pub installation_order: Vec<PatchId>,
    /// All pieces, in order of their ids.
    pub pieces: Vec<PieceFile>,
    /// Contacts used in the proof of the lock.
    pub contacts: Vec<HoldingContact>,
    /// Contacts with an area, used in proofs of play.
    pub bearings: Vec<BearingPoint>,
    /// Distance that the key may have slid for the play to be proven.
    pub slide: Option<Slide>,
    /// Places where the key is pressed on purpose; claims of gaps exclude them.
    #[serde(default)]
    pub press_fits: Vec<PressFit>,
    /// Failed checks of the verification, by name and figure. A kit with any of them must not be printed.
    pub failed: Vec<String>,
    /// Files besides those of the pieces.
    pub files: Vec<OtherFile>,
    /// All claims about the kit.
    pub claims: Vec<Claim>,
}

impl Certificate {
    /// Sets the places where the key is pressed on purpose.
    #[must_use]
    pub fn with_press_fits(mut self, press_fits: Vec<PressFit>) -> Self {
        self.press_fits = press_fits;
        self
    }

    /// Sets the hashes of other files.
    #[must_use]
    pub fn with_files(mut self, files: Vec<OtherFile>) -> Self {
        self.files = files;
        self
    }
}

/// Results of examining a finished kit.
#[derive(Clone, Copy, Debug)]
pub struct Evidence<'a> {
    /// Contacts between the pieces, from [`crate::verify::examine`].
    pub contacts: &'a [Contact],
    /// Verdict of the same examination; claims that it contradicts are not made.
    pub verdict: &'a Verification,
    /// Least gaps between pieces; they are reported with the claims of paths.
    pub gaps: &'a KitGaps,
    /// Play of the pieces, from [`crate::play::measure`]; without it, no play is claimed.
    pub play: Option<&'a KitPlay>,
}

/// Makes the claims that can be proven of finished `pieces`, written as `files` and installed by `plan`.
///
/// `None` if the plan does not name every piece once, or there are fewer than two. Takes 0.04 s for 9 pieces
/// with 12 000 contacts.
pub fn certify(
    mut files: Vec<PieceFile>,
    pieces: &IdVec<PatchId, TriMesh>,
    plan: &InstallationPlan,
    evidence: &Evidence<'_>,
    clearance_mm: f64,
) -> Option<Certificate> {
    let &Evidence {
        contacts,
        verdict,
        gaps,
        play,
    } = evidence;
    let mut named: Vec<PatchId> = plan.steps.iter().map(|s| s.piece).collect();
    named.sort_unstable();
    if named.len() < 2 || !named.into_iter().eq(pieces.ids()) {
        return None;
    }
    let (center, length_mm) = frame(pieces);
    let mut claims: Vec<Claim> = claim_lock(plan, contacts, pieces).into_iter().collect();
    let contacts = keep_contacts(contacts, &mut claims);
    let (bearings, proven) = play.map_or_else(Default::default, list_bounds);
    claims.extend(proven.into_iter().map(Claim::Bounded));
    claims.extend(claim_paths(plan, verdict, gaps));
    for file in &mut files {
        file.play = play
            .and_then(|play| play.alone[file.id])
            .filter(|play| play.is_proven);
    }
    Some(Certificate {
        format: FORMAT.into(),
        version: VERSION,
        clearance_mm,
        reach_mm: clearance_mm + REACH_MM,
        center: center.to_array(),
        length_mm,
        key: plan.key(),
        installation_order: plan.steps.iter().map(|s| s.piece).collect(),
        pieces: files,
        contacts,
        bearings,
        slide: play.map(|play| play.slide),
        press_fits: Vec::new(),
        failed: verdict
            .checks
            .iter()
            .filter(|c| !c.ok)
            .map(|c| format!("{}: {}", c.name, c.figure))
            .collect(),
        files: Vec::new(),
        claims,
    })
}

/// Claims the lock with its proof, if there is one: with the first piece held, only the key moves.
fn claim_lock(
    plan: &InstallationPlan,
    contacts: &[Contact],
    pieces: &IdVec<PatchId, TriMesh>,
) -> Option<Claim> {
    let LockProof {
        multipliers,
        residual,
        hold,
    } = prove_lock(plan, contacts, pieces)?;
    Some(Claim::Locked {
        held: vec![plan.steps[0].piece],
        leaves: plan.key(),
        multipliers,
        residual,
        hold,
    })
}

/// Claims that the key leaves, that all but the first piece can be installed, and that nothing overlaps, as
/// far as the verdict has no finding against it.
fn claim_paths(plan: &InstallationPlan, verdict: &Verification, gaps: &KitGaps) -> Vec<Claim> {
    let is_free = |id: PatchId| {
        let rubs = |f: &Finding| matches!(f, Finding::PathRubs { piece, .. } if *piece == id);
        !verdict.findings.iter().any(rubs)
    };
    let on_way = |id: PatchId| {
        let of_piece = gaps.paths.iter().filter(move |p| p.piece == id);
        LeastGaps::of(of_piece.map(|p| (p.against, p.overall, p.beneath_rim)))
    };
    let mut claims = Vec::new();
    let key = plan.key();
    if is_free(key) {
        let direction = plan.separation(key).unit().to_array();
        claims.push(Claim::KeyLeaves {
            piece: key,
            direction,
            least: on_way(key),
        });
    }
    for step in plan.steps[1..].iter().filter(|step| is_free(step.piece)) {
        let direction = (-step.separation.unit() + 0.0).to_array();
        claims.push(Claim::Installs {
            piece: step.piece,
            direction,
            least: on_way(step.piece),
        });
    }
    if !verdict
        .findings
        .iter()
        .any(|f| matches!(f, Finding::Overlap { .. }))
    {
        let pairs = gaps.pairs.iter().map(|p| (p.b, p.overall, p.beneath_rim));
        claims.push(Claim::Apart {
            least: LeastGaps::of(pairs),
        });
    }
    claims
}

/// Keeps the contacts that proofs use, and renumbers them in the proofs.
fn keep_contacts(contacts: &[Contact], claims: &mut [Claim]) -> Vec<HoldingContact> {
    let named = |claim: &Claim| match claim {
        Claim::Locked { multipliers, .. } => multipliers.iter().map(|m| m.0).collect(),
        _ => Vec::new(),
    };
    let used: BTreeSet<usize> = claims.iter().flat_map(named).collect();
    let place: BTreeMap<usize, usize> = used.iter().copied().zip(0..).collect();
    for claim in claims {
        if let Claim::Locked { multipliers, .. } = claim {
            multipliers.iter_mut().for_each(|m| m.0 = place[&m.0]);
        }
    }
    let array = |v: Vec3| v.to_array();
    let holding = |c: &Contact| HoldingContact {
        a: c.a,
        b: c.b,
        point: array(c.point),
        normal: array(c.normal),
        gap_mm: c.gap_mm,
    };
    used.iter().map(|&i| holding(&contacts[i])).collect()
}

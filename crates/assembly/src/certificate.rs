//! What is claimed of a finished kit, each claim with what a stranger needs to check it.
//!
//! A verdict ([`mod@crate::verify`]) asks for trust in the program that made it. A certificate does not: it
//! names the files by their hashes, and what is hard to find (which contacts hold the pieces, and with what
//! forces) is written down, so that checking takes arithmetic only. The package `shellock-check` does that
//! without any of this code. The format, the derivation and what is *not* proven are told in
//! docs/notes/certificate.md.
//!
//! Coordinates are mm in assembly space. Motions are twists about [`Certificate::center`].

mod bounded;
mod proof;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};
use shellock_geom::{Aabb, TriMesh, Vec3};

use crate::InstallationPlan;
use crate::PressFit;
use crate::motion::Freedom;
use crate::play::{KitPlay, Slide};
use crate::verify::clearance::{KitGaps, NearestPlace};
use crate::verify::contact::{Contact, REACH_MM};
use crate::verify::{Finding, Play, Verification};
use crate::{IdVec, PatchId};
use bounded::bounded;
pub use bounded::{BearingPoint, Bounded};
use proof::{Proof, Question, prove};

/// What [`Certificate::format`] says.
pub const FORMAT: &str = "shellock-certificate";
/// What [`Certificate::version`] says: readers refuse what they do not know.
pub const VERSION: u32 = 4;

/// A file of a kit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PieceFile {
    /// The piece.
    pub id: PatchId,
    /// Its path within the kit.
    pub file: String,
    /// SHA-256 of the file's bytes, in lower-case hexadecimal digits.
    pub sha256: String,
    /// How far the piece moves while all others are held, where that is proven.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub play: Option<Play>,
}

/// Another file of a kit.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct OtherFile {
    /// Its path within the kit.
    pub file: String,
    /// SHA-256 of the file's bytes, in lower-case hexadecimal digits.
    pub sha256: String,
}

/// A place where one piece keeps another from coming nearer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HoldingContact {
    /// The piece the point lies on.
    pub a: PatchId,
    /// The piece it faces.
    pub b: PatchId,
    /// The point.
    pub point: [f64; 3],
    /// Outward unit normal of `a` there, towards `b`.
    pub normal: [f64; 3],
    /// Distance to `b`, mm.
    pub gap_mm: f64,
}

/// How near two bodies come: the distance, and where.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeastGap {
    /// Distance, mm; negative where they overlap.
    pub gap_mm: f64,
    /// How far the moving one is from its place then, mm; 0 where nothing moves.
    pub travel_mm: f64,
    /// Where.
    pub at: [f64; 3],
    /// The other piece.
    pub against: PatchId,
}

/// The least of some gaps: of whole surfaces, which touch at the outer rim, and beneath it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LeastGaps {
    /// Of whole surfaces; `None` where that was not computed, or nothing comes within a millimetre.
    pub overall: Option<LeastGap>,
    /// Of what lies beneath the rim.
    pub beneath_rim: Option<LeastGap>,
}

impl LeastGaps {
    /// The least of `gaps`: the other piece, overall and beneath the rim.
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

/// One statement about a kit, with its proof where it needs one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "claim", rename_all = "kebab-case")]
pub enum Claim {
    /// Whatever pieces move, alone or together, by however little, while the held one does not: only `leaves`
    /// can.
    Locked {
        /// The piece that does not move; which one it is does not matter.
        held: Vec<PatchId>,
        /// The key, which may move.
        leaves: PatchId,
        /// Contacts, by their places in the certificate's list, with positive multipliers.
        multipliers: Vec<(usize, f64)>,
        /// Length of the multipliers' sum of wrenches. Less than `hold`, which is the proof.
        residual: f64,
        /// Least singular value of the contacts' wrenches, weighted by their multipliers up to 1, that is
        /// left for the other pieces.
        hold: f64,
    },
    /// Some pieces stay within their play on every path of motions of any size, at the clearance as it is.
    Bounded(Bounded),
    /// The key can be taken out: it moves along `direction` and meets nothing.
    KeyLeaves {
        /// The key.
        piece: PatchId,
        /// Unit vector.
        direction: [f64; 3],
        /// Where it comes nearest to another piece on its whole way.
        least: LeastGaps,
    },
    /// The piece can be put in: along `direction` it comes to its place past all that are there already.
    Installs {
        /// The piece.
        piece: PatchId,
        /// Unit vector.
        direction: [f64; 3],
        /// Where it comes nearest to another piece on its whole way.
        least: LeastGaps,
    },
    /// The assembled pieces do not overlap.
    Apart {
        /// The least distance of all pairs.
        least: LeastGaps,
    },
}

/// What is claimed of a kit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// [`FORMAT`].
    pub format: String,
    /// [`VERSION`].
    pub version: u32,
    /// Gap left between mating faces, mm.
    pub clearance_mm: f64,
    /// Faces farther apart than this hold nothing, mm.
    pub reach_mm: f64,
    /// The point that twists are about.
    pub center: [f64; 3],
    /// Spins count as velocities at this distance, mm: half the diagonal of the kit.
    pub length_mm: f64,
    /// The piece installed last.
    pub key: PatchId,
    /// First to last.
    pub installation_order: Vec<PatchId>,
    /// All pieces, in order of their ids.
    pub pieces: Vec<PieceFile>,
    /// Contacts with a part in the proof of the lock.
    pub contacts: Vec<HoldingContact>,
    /// Contacts with an area, with a part in a proof of play.
    pub bearings: Vec<BearingPoint>,
    /// How far the key may have slid while the play is proven.
    pub slide: Option<Slide>,
    /// Where the key is pressed on purpose: claims of gaps are but for these.
    #[serde(default)]
    pub press_fits: Vec<PressFit>,
    /// The checks of the verification that failed, by name and figure: a kit with any is not to be printed.
    pub failed: Vec<String>,
    /// Files besides the pieces' own.
    pub files: Vec<OtherFile>,
    /// The claims.
    pub claims: Vec<Claim>,
}

impl Certificate {
    /// The same, where the key is pressed at these places on purpose.
    #[must_use]
    pub fn with_press_fits(mut self, press_fits: Vec<PressFit>) -> Self {
        self.press_fits = press_fits;
        self
    }

    /// The same, with the hashes of other files.
    #[must_use]
    pub fn with_files(mut self, files: Vec<OtherFile>) -> Self {
        self.files = files;
        self
    }
}

/// What was found of a finished kit.
#[derive(Clone, Copy, Debug)]
pub struct Evidence<'a> {
    /// Where its pieces touch, from [`crate::verify::examine`], and its verdict: what that speaks against is
    /// not claimed.
    pub contacts: &'a [Contact],
    /// The verdict.
    pub verdict: &'a Verification,
    /// How near pieces come; they go with the claims of paths.
    pub gaps: &'a KitGaps,
    /// How far pieces move, from [`crate::play::measure`]; where there is none, nothing is claimed of it.
    pub play: Option<&'a KitPlay>,
}

/// Claims what can be proven of finished `pieces`, written as `files`, that are installed as `plan` says.
///
/// `None` where the plan does not name every piece once, of at least two. Takes 0.04 s for 9 pieces with 12
/// 000 contacts.
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
    let mut claims: Vec<Claim> = claim_lock(plan, contacts, center, length_mm)
        .into_iter()
        .collect();
    let contacts = keep_holding(contacts, &mut claims);
    let (bearings, proven) = play.map_or_else(Default::default, bounded);
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

/// The middle of all pieces and half their diagonal, mm: what twists are about, and at what distance spins
/// count.
fn frame(pieces: &IdVec<PatchId, TriMesh>) -> (Vec3, f64) {
    let bounds = pieces
        .as_slice()
        .iter()
        .fold(Aabb::EMPTY, |all, mesh| all.union(mesh.bounds()));
    (bounds.center(), 0.5 * bounds.diagonal())
}

/// The lock with its proof, if there is one: with the first piece held, nothing but the key moves.
fn claim_lock(plan: &InstallationPlan, contacts: &[Contact], center: Vec3, length_mm: f64) -> Option<Claim> {
    let centered: Vec<Contact> = contacts
        .iter()
        .map(|c| Contact {
            point: c.point - center,
            ..*c
        })
        .collect();
    let (held, key) = (vec![plan.steps[0].piece], plan.key());
    let leaves = Some((key, plan.separation(key).unit()));
    let freedom = Freedom::Rigid;
    let proof = prove(
        &centered,
        &Question {
            n_pieces: plan.steps.len(),
            held: &held,
            leaves,
            length_mm,
            freedom,
        },
    )?;
    let Proof {
        multipliers,
        residual,
        hold,
    } = proof;
    Some(Claim::Locked {
        held,
        leaves: key,
        multipliers,
        residual,
        hold,
    })
}

/// That the key leaves, that all but the first piece can be installed, and that nothing overlaps: as far as
/// the verdict found nothing against it.
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

/// The contacts that proofs name; the proofs then name them by their new places.
fn keep_holding(contacts: &[Contact], claims: &mut [Claim]) -> Vec<HoldingContact> {
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

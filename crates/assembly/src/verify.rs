//! Verification that the finished pieces are solids, keep the model's look, can be assembled, and hold.
//!
//! Works only on the meshes as they will be written and on the plan, and knows nothing of how they were made.
//! The limits and their reasons are in [`limits`]. A broken piece is reported and left out of the checks that
//! need its volume.
//!
//! Limits: motions are infinitesimal here, and contacts count as touching; [`crate::play`] accounts for the
//! clearance. Real walls may bend, and friction is ignored.

pub mod clearance;
pub mod contact;
pub mod limits;
pub mod sample;

mod body;
mod columns;
mod cover;
mod folds;
mod hanging;
#[cfg(test)]
pub(crate) mod kits;
mod overlap;
mod path;
mod probe;
#[cfg(test)]
mod tests;
mod thin;
pub mod words;

use contact::Contact;
use serde::{Deserialize, Serialize};
use shellock_geom::{Aabb, Solid, TriMesh, Vec3};
pub use thin::{ThinFeature, ThinKind, ThinShare, thin_places, thin_share};

use crate::InstallationPlan;
use crate::PressFit;
use crate::motion::proof::prove_lock;
use crate::motion::{self, Freedom, Twist};
use crate::{Cancelled, Ctx, IdVec, PatchId};

/// Parameters for judging the finished kit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct VerifyParams {
    /// Gap left between mating faces, mm. [0, 1]; 0.12. Faces up to 0.15 mm farther apart still hold each
    /// other.
    pub clearance_mm: f64,
    /// Seed of the sample points; any number.
    pub seed: u64,
}

impl Default for VerifyParams {
    fn default() -> Self {
        Self {
            clearance_mm: 0.12,
            seed: 0,
        }
    }
}

/// One check of the verdict, with its figure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// Name of the check, as a statement that should hold.
    pub name: String,
    /// True if the statement holds.
    pub ok: bool,
    /// Measured figure, for people.
    pub figure: String,
}

impl Check {
    pub(crate) fn new(name: &str, ok: bool, figure: String) -> Self {
        Self {
            name: name.to_owned(),
            ok,
            figure,
        }
    }
}

/// Motion of one piece, relative to the fastest of all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Piece that performs the motion.
    pub piece: PatchId,
    /// Velocity of the piece at the origin; components in [−1, 1].
    pub velocity: [f64; 3],
    /// Spin times half the diagonal of the model; components in [−1, 1].
    pub spin: [f64; 3],
}

impl From<&Twist> for Motion {
    fn from(t: &Twist) -> Self {
        Self {
            piece: t.piece,
            velocity: t.velocity.to_array(),
            spin: t.spin.to_array(),
        }
    }
}

/// Play of a piece: the farthest that it moves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Play {
    /// Greatest displacement of the centroid, mm.
    pub translation_mm: f64,
    /// Greatest rotation of the piece, degrees.
    pub rotation_deg: f64,
    /// True if no path of motions of any size goes farther; otherwise the play is an estimate for small
    /// motions.
    pub is_proven: bool,
}

impl Play {
    /// Play of a piece that nothing holds.
    pub const ENDLESS: Self = Self {
        translation_mm: f64::INFINITY,
        rotation_deg: f64::INFINITY,
        is_proven: false,
    };
}

/// Defect of a kit, with its place and pieces. Places are mm in assembly space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Finding {
    /// The plan does not name `piece` exactly once, or there is no such piece. Checks that need a plan were
    /// skipped.
    PlanBroken {
        /// Piece in question, by its id.
        piece: PatchId,
    },
    /// The mesh is open, turned inside out or flat, or bounds no volume.
    NotClosed {
        /// Piece with this mesh.
        piece: PatchId,
    },
    /// Edges have more than two triangles, after merging equal points.
    SharedEdges {
        /// Piece with these edges.
        piece: PatchId,
        /// Number of such edges.
        count: usize,
        /// Midpoint of the first edge.
        at: [f64; 3],
    },
    /// The surface of a piece folds back on itself, so that faces have material right in front of them.
    Folded {
        /// Piece with these faces.
        piece: PatchId,
        /// Area of such faces, mm².
        area_mm2: f64,
        /// Middle of the first face.
        at: [f64; 3],
    },
    /// The piece is not one connected body.
    SeveralBodies {
        /// Piece that falls apart.
        piece: PatchId,
        /// Number of bodies, crumbs not counted.
        count: usize,
    },
    /// A part of a piece hangs on the rest by a bridge so thin that it breaks.
    Hanging {
        /// Piece with this part.
        piece: PatchId,
        /// Volume of the part without its outermost layer, mm³.
        volume_mm3: f64,
        /// Width below which the bridge is, mm.
        width_mm: f64,
        /// Middle of the part.
        at: [f64; 3],
    },
    /// Two pieces overlap in the assembly.
    Overlap {
        /// Piece with the lower id.
        a: PatchId,
        /// Piece with the higher id.
        b: PatchId,
        /// Common volume of both, mm³.
        volume_mm3: f64,
        /// Centre of the common part.
        at: [f64; 3],
    },
    /// Pieces protrude from the model.
    Outside {
        /// Volume outside, of all pieces, mm³.
        volume_mm3: f64,
    },
    /// The piece collides with `against` on its way.
    PathRubs {
        /// Piece that is installed.
        piece: PatchId,
        /// Earlier piece with the worst collision.
        against: PatchId,
        /// Distance of the piece from its place, mm.
        travel_mm: f64,
        /// Mean thickness `2V/A` of the overlap, mm.
        thickness_mm: f64,
        /// Volume of the overlap, mm³.
        volume_mm3: f64,
        /// Centre of the overlap.
        at: [f64; 3],
    },
    /// A piece other than the key can leave its place alone.
    Loose {
        /// Piece that is loose.
        piece: PatchId,
        /// Unit vectors along which nothing holds the piece.
        directions: Vec<[f64; 3]>,
    },
    /// Pieces besides the key move, alone or together, by however little, while the first piece is held.
    ClusterMoves {
        /// Motions of the pieces, without the key.
        motions: Vec<Motion>,
    },
    /// A piece has more play within the clearance than a kit may have.
    PlayTooWide {
        /// Piece with this play.
        piece: PatchId,
        /// Play of the piece.
        play: Play,
        /// Greatest play allowed: mm and degrees.
        most: [f64; 2],
        /// Centroid of the piece.
        at: [f64; 3],
    },
    /// A piece other than the key can be taken out by turning and shifting it past its connectors.
    ComesOut {
        /// Piece that comes out.
        piece: PatchId,
        /// Centroid of the piece.
        at: [f64; 3],
    },
    /// Parts of the model's surface are on no piece.
    SurfaceLost {
        /// Lost share of the surface.
        fraction: f64,
        /// Point farthest from any piece.
        at: [f64; 3],
    },
}

impl Finding {
    /// Place of the finding, mm in assembly space, if it is at one place.
    pub fn place(&self) -> Option<[f64; 3]> {
        match self {
            Self::SharedEdges { at, .. }
            | Self::Folded { at, .. }
            | Self::Hanging { at, .. }
            | Self::Overlap { at, .. }
            | Self::PathRubs { at, .. }
            | Self::PlayTooWide { at, .. }
            | Self::ComesOut { at, .. }
            | Self::SurfaceLost { at, .. } => Some(*at),
            _ => None,
        }
    }
}

/// Verdict on a kit: its checks and findings.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Verification {
    /// All checks, in the order they were made.
    pub checks: Vec<Check>,
    /// Findings of the failed checks, in the same order.
    pub findings: Vec<Finding>,
}

impl Verification {
    /// Returns true if every check holds.
    pub fn has_passed(&self) -> bool {
        self.checks.iter().all(|c| c.ok)
    }

    /// Adds a check with its findings.
    pub fn add(&mut self, (check, findings): (Check, impl IntoIterator<Item = Finding>)) {
        self.checks.push(check);
        self.findings.extend(findings);
    }
}

/// Finished kit to be verified.
#[derive(Clone, Copy, Debug)]
pub struct Assembly<'a> {
    /// Model that the assembled pieces should look like; `None` if their outside does not matter.
    pub model: Option<&'a Solid>,
    /// Pieces, as they will be written.
    pub pieces: &'a IdVec<PatchId, TriMesh>,
    /// Order and directions of installation.
    pub plan: &'a InstallationPlan,
    /// Places where the key presses on purpose; common volume there is no overlap.
    pub press_fits: &'a [PressFit],
}

impl Assembly<'_> {
    /// Bounding box of the model, or of all pieces.
    pub fn bounds(&self) -> Aabb {
        let of_pieces = || {
            self.pieces
                .as_slice()
                .iter()
                .fold(Aabb::EMPTY, |all, mesh| all.union(mesh.bounds()))
        };
        self.model.map_or_else(of_pieces, |model| model.mesh().bounds())
    }
}

/// Judges the finished pieces of a model and their plan; every ending but a stop is an answer. Also returns
/// the contacts of the pieces, from which a certificate is made.
///
/// There are no contacts if the plan is broken, or a piece reaches farther out of the model than the model's
/// own size. In that case paths and motions are not checked either.
///
/// A function of its arguments alone, on any number of threads. Ten pieces of 26 000 triangles take 3.5 s on
/// two cores if every contact is doubtful because no joint has a gap or a connector; most of it goes into the
/// pushes.
pub fn examine(
    ctx: &Ctx,
    params: &VerifyParams,
    assembly: &Assembly<'_>,
) -> Result<(Verification, Vec<Contact>), Cancelled> {
    let &Assembly {
        model,
        pieces,
        plan,
        press_fits,
    } = assembly;
    ctx.stage("verify", 0)?;
    let mut verdict = Verification::default();
    verdict.add(check_plan(pieces, plan));
    let is_plan = verdict.has_passed();
    let bodies = body::read(ctx, pieces, model.map(Solid::mesh))?;
    let (checks, findings) = body::check(&bodies);
    verdict.checks.extend(checks);
    verdict.findings.extend(findings);

    verdict.add(overlap::check_pairs(ctx, &bodies, press_fits)?);
    if let Some(model) = model {
        verdict.add(overlap::check_outside(model, &bodies));
        verdict.add(cover::check(model, &bodies, params.seed));
    }
    if !is_plan || reaches_far_out(assembly) {
        return Ok((verdict, Vec::new()));
    }
    let length_mm = assembly.bounds().diagonal();
    verdict.add(path::check(ctx, &bodies, &plan.steps, length_mm)?);
    let contacts = contact::find(ctx, &bodies, params.clearance_mm, params.seed)?;
    verdict.add(probe::check(
        ctx,
        &bodies,
        &contacts,
        plan.key(),
        params.clearance_mm,
    )?);
    for (name, freedom) in [
        (
            "no cluster but the key slides (translations)",
            Freedom::Translations,
        ),
        ("nothing but the key moves (6 dof)", Freedom::Rigid),
    ] {
        ctx.check()?;
        let (check, finding) = check_motion(name, plan, &contacts, 0.5 * length_mm, freedom);
        let check = match freedom {
            Freedom::Translations => check,
            Freedom::Rigid => with_proof(check, assembly, &contacts),
        };
        verdict.add((check, finding));
    }
    Ok((verdict, contacts))
}

/// Returns true if a piece is of another size, or at another place, than the model. The cost of further
/// checks would grow with that size, and no result would matter.
pub(crate) fn reaches_far_out(assembly: &Assembly<'_>) -> bool {
    let Some(model) = assembly.model else {
        return false;
    };
    let bounds = model.mesh().bounds();
    let room = bounds.grown(bounds.diagonal());
    let boxes = assembly.pieces.as_slice().iter().map(TriMesh::bounds);
    let is_out = |corner: Vec3| corner.cmplt(room.min).any() || corner.cmpgt(room.max).any();
    boxes
        .flat_map(|b| [b.min, b.max])
        .any(|corner| corner.is_finite() && is_out(corner))
}

fn check_plan(pieces: &IdVec<PatchId, TriMesh>, plan: &InstallationPlan) -> (Check, Vec<Finding>) {
    let mut named: Vec<usize> = plan.steps.iter().map(|s| s.piece.into()).collect();
    named.sort_unstable();
    let n = named.last().map_or(0, |last| last + 1).max(pieces.len());
    let times = |piece: usize| named.partition_point(|&x| x <= piece) - named.partition_point(|&x| x < piece);
    // An id far beyond the pieces is reported once, not with all ids below it.
    let suspects = (0..pieces.len()).chain(named.iter().copied().filter(|&p| p >= pieces.len()));
    let wrong: Vec<Finding> = suspects
        .filter(|&p| p >= pieces.len() || times(p) != 1)
        .map(|p| Finding::PlanBroken { piece: p.into() })
        .collect();
    let ok = wrong.is_empty() && n >= 2;
    (
        Check::new(
            "plan names every piece once",
            ok,
            format!("{} steps, {} pieces", named.len(), pieces.len()),
        ),
        wrong,
    )
}

/// Checks that contacts, taken as touching, allow no motion of pieces other than the key while the first
/// piece rests.
///
/// The choice of the held piece does not matter: either a moving group or the rest of the pieces lacks it.
/// The key may move; otherwise its own way out, seen from the key, would count as a motion of all others.
fn check_motion(
    name: &str,
    plan: &InstallationPlan,
    contacts: &[Contact],
    scale_mm: f64,
    freedom: Freedom,
) -> (Check, Option<Finding>) {
    let held = [plan.steps[0].piece];
    let moving = motion::free_motion(
        contacts,
        plan.steps.len(),
        &held,
        Some(plan.key()),
        scale_mm,
        freedom,
    );
    let figure = format!("{} pieces move; {} contacts", moving.len(), contacts.len());
    let motions = || moving.iter().map(Motion::from).collect();
    let finding = (!moving.is_empty()).then(|| Finding::ClusterMoves { motions: motions() });
    (Check::new(name, moving.is_empty(), figure), finding)
}

/// Returns the check unless it passed and no proof of the lock is found: no motion was found then, but a
/// certificate without that proof would be refused.
fn with_proof(check: Check, assembly: &Assembly<'_>, contacts: &[Contact]) -> Check {
    let is_proven = || prove_lock(assembly.plan, contacts, assembly.pieces).is_some();
    if !check.ok || is_proven() {
        return check;
    }
    let figure = format!("{}, but no proof is found", check.figure);
    Check::new(&check.name, false, figure)
}

/// Rounds `x` to six decimals: no printer or judge resolves more, and the order in which threads add up does
/// not show.
fn round(x: f64) -> f64 {
    (x * 1e6).round() / 1e6
}

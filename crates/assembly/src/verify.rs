//! Whether the finished pieces are solids, keep the model's look, go together and hold.
//!
//! Works on the meshes as they will be written and the plan alone, and knows nothing of how they were made.
//! The limits and their reasons are in [`limits`]. A broken piece is reported and left out of the checks that
//! need its volume.
//!
//! Limits: motions are infinitesimal here and contacts taken as touching; what the clearance leaves is the
//! question of [`crate::play`]. Walls may bend in reality, and friction is ignored.

pub mod clearance;
pub mod contact;
pub mod limits;
pub mod sample;

mod body;
mod columns;
mod cover;
#[cfg(test)]
pub(crate) mod kits;
mod overlap;
mod path;
mod probe;
#[cfg(test)]
mod tests;
mod thin;
pub mod words;

use serde::{Deserialize, Serialize};
use shellock_geom::{Aabb, Solid, TriMesh, Vec3};

use crate::InstallationPlan;
use crate::PressFit;
use crate::motion::{self, Freedom, Twist};
use crate::{Cancelled, Ctx, IdVec, PatchId};
use contact::Contact;
pub use thin::{ThinFeature, ThinKind, ThinPoint, ThinShare, thin_places, thin_points, thin_share};

/// How the finished kit is judged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct VerifyParams {
    /// Gap left between mating faces, mm. [0, 1]; 0.12. Faces up to 0.15 mm farther apart still hold each
    /// other.
    pub clearance_mm: f64,
    /// Where the sample points fall; any number.
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

/// One line of the verdict.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// What was checked, as a statement that should hold.
    pub name: String,
    /// Whether it holds.
    pub ok: bool,
    /// The measured figure, for people.
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

/// The motion of one piece, relative to the fastest of all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// The piece.
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

/// How far a piece moves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Play {
    /// Greatest displacement of the centroid, mm.
    pub translation_mm: f64,
    /// Greatest turn, degrees.
    pub rotation_deg: f64,
    /// Whether no path of motions of any size goes farther; else it is an estimate for small motions.
    pub is_proven: bool,
}

impl Play {
    /// That of a piece that nothing holds.
    pub const ENDLESS: Self = Self {
        translation_mm: f64::INFINITY,
        rotation_deg: f64::INFINITY,
        is_proven: false,
    };
}

/// What is wrong, where, and with whom. Places are mm in assembly space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Finding {
    /// The plan does not name `piece` exactly once, or there is no such piece; what needs a plan was not
    /// checked.
    PlanBroken {
        /// The piece.
        piece: PatchId,
    },
    /// The mesh is open, turned inside out or flat, or bounds no volume.
    NotClosed {
        /// The piece.
        piece: PatchId,
    },
    /// Edges of more than two triangles, once equal points are one.
    SharedEdges {
        /// The piece.
        piece: PatchId,
        /// How many edges.
        count: usize,
        /// Middle of the first.
        at: [f64; 3],
    },
    /// Not one connected body.
    SeveralBodies {
        /// The piece.
        piece: PatchId,
        /// How many, crumbs not counted.
        count: usize,
    },
    /// Two pieces want the same place.
    Overlap {
        /// The piece with the lower id.
        a: PatchId,
        /// The other.
        b: PatchId,
        /// Common volume.
        volume_mm3: f64,
        /// Middle of the common part.
        at: [f64; 3],
    },
    /// Pieces leave the model.
    Outside {
        /// Volume outside, of all pieces.
        volume_mm3: f64,
    },
    /// `piece` runs into `against` on its way.
    PathRubs {
        /// The piece that is installed.
        piece: PatchId,
        /// The earlier piece that is worst in its way.
        against: PatchId,
        /// How far from its place.
        travel_mm: f64,
        /// Mean thickness `2V/A` of the overlap.
        thickness_mm: f64,
        /// Volume of the overlap.
        volume_mm3: f64,
        /// Middle of the overlap.
        at: [f64; 3],
    },
    /// A piece that is not the key leaves its place alone.
    Loose {
        /// The piece.
        piece: PatchId,
        /// Unit vectors along which nothing holds it.
        directions: Vec<[f64; 3]>,
    },
    /// Pieces besides the key move, alone or together, by however little, while the first piece is held.
    ClusterMoves {
        /// Who moves and how; the key is left out.
        motions: Vec<Motion>,
    },
    /// A piece moves farther within the clearance than a kit may rattle.
    PlayTooWide {
        /// The piece.
        piece: PatchId,
        /// How far.
        play: Play,
        /// How far it may: mm and degrees.
        most: [f64; 2],
        /// Its centroid.
        at: [f64; 3],
    },
    /// A piece that is not the key can be taken out by turning and shifting it past its connectors.
    ComesOut {
        /// The piece.
        piece: PatchId,
        /// Its centroid.
        at: [f64; 3],
    },
    /// Parts of the model's surface are on no piece.
    SurfaceLost {
        /// Share of the surface.
        fraction: f64,
        /// The point farthest from any piece.
        at: [f64; 3],
    },
}

impl Finding {
    /// Where it is, mm in assembly space, if it is at one place.
    pub fn place(&self) -> Option<[f64; 3]> {
        match self {
            Self::SharedEdges { at, .. }
            | Self::Overlap { at, .. }
            | Self::PathRubs { at, .. }
            | Self::PlayTooWide { at, .. }
            | Self::ComesOut { at, .. }
            | Self::SurfaceLost { at, .. } => Some(*at),
            _ => None,
        }
    }
}

/// The verdict.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Verification {
    /// All checks, in the order they were made.
    pub checks: Vec<Check>,
    /// What failed, in the same order.
    pub findings: Vec<Finding>,
}

impl Verification {
    /// Whether every check holds.
    pub fn passed(&self) -> bool {
        self.checks.iter().all(|c| c.ok)
    }

    /// One more check, with what it found.
    pub fn add(&mut self, (check, findings): (Check, impl IntoIterator<Item = Finding>)) {
        self.checks.push(check);
        self.findings.extend(findings);
    }
}

/// A finished kit.
#[derive(Clone, Copy, Debug)]
pub struct Assembly<'a> {
    /// What the pieces are to look like together; `None` where nothing is asked of their outside.
    pub model: Option<&'a Solid>,
    /// The pieces, as they will be written.
    pub pieces: &'a IdVec<PatchId, TriMesh>,
    /// Their order and directions.
    pub plan: &'a InstallationPlan,
    /// Where the key presses on purpose: what is shared there is no overlap.
    pub press_fits: &'a [PressFit],
}

impl Assembly<'_> {
    /// The box of the model, or of all pieces.
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

/// Judges the finished pieces of a model and their plan; every ending but a stop is an answer. Also the
/// contacts of the pieces, from which a certificate is made; none where the plan is broken, or a piece reaches
/// farther out of the model than that is large: paths, contacts and motions are not asked then.
///
/// A function of its arguments alone, on any number of threads. Ten pieces of 26 000 triangles take 3.5 s on
/// two cores where every contact is doubtful, because no joint has a gap or a connector; most of it goes into
/// the pushes.
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
    let is_plan = verdict.passed();
    let bodies = body::read(ctx, pieces)?;
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
        verdict.add(check_motion(name, plan, &contacts, 0.5 * length_mm, freedom));
    }
    Ok((verdict, contacts))
}

/// Whether a piece is of another size, or at another place, than the model: what would be asked of it next costs
/// what it measures, and no answer would matter.
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

/// Whether contacts, taken as touching, allow a motion of other pieces than the key while the first piece
/// rests.
///
/// Which piece is held does not matter: of a group that moves and the rest, one lacks it. The key may move:
/// else its own way out, seen from the key, would count as a motion of all others.
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

/// `x` to six decimals: no printer or judge sees more, and the order in which threads add up does not show.
fn rounded(x: f64) -> f64 {
    (x * 1e6).round() / 1e6
}

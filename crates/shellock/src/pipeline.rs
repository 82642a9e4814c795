//! The whole job: from a closed mesh to interlocking pieces that were verified.
//!
//! Feedback goes one way: what a finished kit teaches becomes a constraint for the next round of planning; when plans run
//! out, the segmentation is mended at the piece to blame, and planning starts afresh.

use shellock_geom::{Aabb, Solid, TriMesh};

use crate::body::{BodyError, BodyParams, GridError, PatchDistances, ShellGrid};
use crate::connector::{ConnectorParams, Contact, has_no_bar};
use crate::feedback::{Lesson, lessons};
use crate::metric::{ChoiceError, Holding};
use crate::piece::{Joint, PieceError};
use crate::plan::{Blocker, InstallationPlan, PlanConstraints, PlanOutcome, PlanParams, PlanProof, PlanSurvey};
use crate::segmentation::{SegmentationError, SegmentationParams};
use crate::sizes::{CONTACT_SIZES, ChosenSizes, LEAST_CONTACT_SIZES, SizeParams, StressField};
use crate::strength::{Strength, StrengthError, StrengthParams, StressMap};
use crate::verify::{Verification, VerifyParams};
use crate::{
    Cancelled, ConnectorSizes, Ctx, IdVec, PatchId, SegmentedSurface, Warning, body, connector, metric, piece, plan,
    segmentation, sizes, strength, verify,
};

/// Everything that may be set. Each stage's parameters are declared beside it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Params {
    /// How the surface is divided.
    pub segmentation: SegmentationParams,
    /// Where the wall's thickness comes from.
    pub thickness: ThicknessChoice,
    /// What the wall must bear.
    pub strength: StrengthParams,
    /// How plans are judged and searched.
    pub plan: PlanParams,
    /// How the wall is made and cut.
    pub body: BodyParams,
    /// How connectors are made.
    pub connector: ConnectorParams,
    /// How the finished kit is judged.
    pub verify: VerifyParams,
    /// How often a kit that failed its verification is planned and made again.
    pub rounds: Rounds,
}

/// Where the wall's thickness comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ThicknessChoice {
    /// From [`BodyParams::thickness_mm`]; its stress is told.
    #[default]
    Given,
    /// The least that bears a fall.
    Auto,
}

/// Bounds of the feedback loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rounds {
    /// Kits made for one segmentation, at most. ≥ 1; 3.
    pub kits: usize,
    /// Segmentations mended after the first, at most; 4.
    pub mendings: usize,
    /// Kits made of all segmentations, at most. ≥ 1; 8.
    pub kits_in_all: usize,
}

impl Default for Rounds {
    fn default() -> Self {
        Self { kits: 3, mendings: 4, kits_in_all: 8 }
    }
}

impl Params {
    /// Every problem of every stage, in words.
    pub fn problems(&self) -> Vec<String> {
        let words = |p: Vec<crate::params::ParamProblem>| p.into_iter().map(|p| p.to_string());
        let stages = [self.body.problems(), self.connector.problems(), self.strength.problems()];
        let mut problems: Vec<String> = stages.into_iter().flat_map(words).collect();
        problems.extend(self.segmentation.problems());
        problems.extend(self.plan.problems());
        problems
    }

    /// The parameters with what one stage owns and others need set alike everywhere.
    pub fn agreed(&self) -> Self {
        /// Two lines on either side of a seam's pin.
        const LEAST_WALLS: f64 = 4.0;
        let mut p = self.clone();
        let least_mm = (LEAST_WALLS * p.connector.min_wall_mm).max(0.8).max(2.0 * p.body.cell_mm.unwrap_or(0.0));
        p.strength.least_mm = least_mm.min(5.0);
        p.strength.most_mm = p.strength.most_mm.max(p.strength.least_mm);
        let smallest_mm = p.connector.size.smallest_mm();
        p.segmentation.min_contact_mm = CONTACT_SIZES * smallest_mm;
        p.segmentation.least_contact_mm = LEAST_CONTACT_SIZES * smallest_mm;
        p.segmentation.wall_mm = p.body.thickness_mm;
        p.plan.wall_mm = p.body.thickness_mm;
        p.plan.clearance_mm = p.connector.clearance_mm;
        p.verify.clearance_mm = p.connector.clearance_mm.max(2.0 * p.body.wall_gap_mm);
        p
    }

    /// What decides on connector sizes.
    pub fn sizes(&self) -> SizeParams {
        SizeParams {
            choice: self.connector.size,
            wall_mm: self.body.thickness_mm,
            clearance_mm: self.connector.clearance_mm,
            strength_mpa: self.strength.material.strength_mpa,
        }
    }
}

/// A finished kit.
pub struct Design {
    /// The segmented surface it was made from.
    pub surface: SegmentedSurface,
    /// Connector sizes of its pairs of pieces.
    pub sizes: ConnectorSizes,
    /// Order and directions.
    pub plan: InstallationPlan,
    /// Thickness of its walls, mm.
    pub thickness_mm: f64,
    /// What the wall bears; `None` where the stress could not be computed, which is warned of.
    pub strength: Option<Strength>,
    /// How good the plan is; `None` where it was given and not searched.
    pub proof: Option<PlanProof>,
    /// How it holds by simulation, and where it is weak; `None` where its plan was given.
    pub holding: Option<Holding>,
    /// One printable mesh a piece, in assembled position, mm.
    pub pieces: IdVec<PatchId, TriMesh>,
    /// Connector runs and how they came out.
    pub joints: Vec<Joint>,
    /// What the seams offered.
    pub contacts: Vec<Contact>,
    /// The verdict on the finished meshes.
    pub verification: Verification,
    /// Where the finished pieces touch.
    pub touching: Vec<verify::contact::Contact>,
    /// What the user should know about this kit; kits that were given up keep their warnings to themselves.
    pub warnings: Vec<Warning>,
}

/// How the job ended.
pub enum DesignOutcome {
    /// There is a kit. Whether it passed is in its verification.
    Made(Box<Design>),
    /// No plan was found for any segmentation.
    NoPlan {
        /// Why, for people.
        reason: String,
        /// Who is in whose way.
        blockers: Vec<Blocker>,
    },
}

/// Why the job could not be done.
#[derive(Debug, thiserror::Error)]
pub enum DesignError {
    /// No thickness can be found.
    #[error(transparent)]
    Strength(StrengthError),
    /// The surface cannot be divided.
    #[error(transparent)]
    Segmentation(#[from] SegmentationError),
    /// The wall cannot be made.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// The wall cannot be split.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// Plans cannot be compared.
    #[error(transparent)]
    Choice(ChoiceError),
    /// A piece cannot be finished.
    #[error(transparent)]
    Piece(#[from] PieceError),
    /// The user asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<StrengthError> for DesignError {
    fn from(e: StrengthError) -> Self {
        match e {
            StrengthError::Cancelled(c) => c.into(),
            other => Self::Strength(other),
        }
    }
}

impl From<ChoiceError> for DesignError {
    fn from(e: ChoiceError) -> Self {
        match e {
            ChoiceError::Cancelled(c) => c.into(),
            other => Self::Choice(other),
        }
    }
}

/// Makes a kit of `model` (mm), from `labels` (one a triangle) where given. Kits are made until one passes or the rounds
/// are used up; then the best of them is returned, its failures told.
pub fn design(ctx: &Ctx, params: &Params, model: &Solid, labels: Option<&[i64]>) -> Result<DesignOutcome, DesignError> {
    let (params, bearing) = with_thickness(ctx, params, model)?;
    let params = &params;
    let stress = bearing.strength.as_ref().map(StressMap::new);
    let stress_at = stress.as_ref().map(|map| |place| map.at(place));
    let stress_mpa = stress_at.as_ref().map(|at| at as StressField);
    let mut surface = segmentation::segment(ctx, &params.segmentation, model, labels)?;
    let mut sizes = sizes::choose(ctx, &params.sizes(), &surface, stress_mpa)?;
    let mut room_mm = params.connector.room_mm(sizes.sizes.largest_mm());
    ctx.stage("grid", 0)?;
    let mut grid = ShellGrid::new(&params.body, model, room_mm)?;
    let mut kits = Kits { best: None, n_left: params.rounds.kits_in_all };
    let mut mending = 0;
    let attempt = loop {
        let attempt = with_segmentation(ctx, params, model, &grid, &surface, &sizes, &mut kits)?;
        let Attempt::Failed { blamed, loose, .. } = &attempt else { break attempt };
        if mending == params.rounds.mendings || kits.n_left == 0 {
            break attempt;
        }
        let is_hopeless = kits.best.is_none() && 2 * mending >= params.rounds.mendings;
        let mended = mended(ctx, params, &surface, blamed, loose, is_hopeless);
        let Some(mended) = mended else { break attempt };
        ctx.note(&format!("another segmentation: {} pieces instead of {}", mended.n_patches, surface.n_patches));
        surface = mended;
        mending += 1;
        sizes = sizes::choose(ctx, &params.sizes(), &surface, stress_mpa)?;
        let least_mm = params.connector.room_mm(sizes.sizes.largest_mm());
        if least_mm > room_mm {
            room_mm = least_mm;
            grid = ShellGrid::new(&params.body, model, room_mm)?;
        }
    };
    // Warnings of segmentations and plans that were given up go with them.
    ctx.take_warnings();
    if let Some(best) = &mut kits.best {
        best.warnings.extend(bearing.warnings);
        best.strength = bearing.strength;
    }
    finish(ctx, params, model, labels, kits.best, attempt)
}

/// The parameters with the thickness of the wall, what it bears, and what to tell of it.
fn with_thickness(ctx: &Ctx, params: &Params, model: &Solid) -> Result<(Params, Bearing), DesignError> {
    let mut params = params.agreed();
    let found = match params.thickness {
        ThicknessChoice::Given => strength::stress(ctx, &params.strength, model, params.body.thickness_mm),
        ThicknessChoice::Auto => strength::thickness(ctx, &params.strength, model),
    };
    match found {
        Ok(strength) => {
            params.body.thickness_mm = strength.thickness_mm;
            let warnings = strength.warnings(&params.strength);
            Ok((params.agreed(), Bearing { strength: Some(strength), warnings }))
        }
        Err(StrengthError::Shell(e)) if params.thickness == ThicknessChoice::Given => {
            let message = format!(
                "what the wall bears could not be computed ({e}); connectors are sized as if nothing pressed on them"
            );
            let warning = Warning { code: "strength-unknown".into(), message, pieces: Vec::new(), at: None };
            Ok((params, Bearing { strength: None, warnings: vec![warning] }))
        }
        Err(e) => Err(e.into()),
    }
}

/// What the wall bears, and what to tell of it.
struct Bearing {
    strength: Option<Strength>,
    warnings: Vec<Warning>,
}

/// The surface with other pieces, which may do better.
///
/// Dividing comes first, as it keeps the user's labels. What came loose where seams are short would only get shorter ones: it is joined
/// to a neighbour; so is what stood in the way of every plan until half of the rounds were gone.
fn mended(
    ctx: &Ctx,
    params: &Params,
    surface: &SegmentedSurface,
    blamed: &[PatchId],
    loose: &[PatchId],
    is_hopeless: bool,
) -> Option<SegmentedSurface> {
    /// Pieces joined at once; more would change what holds.
    const MOST_JOINED: usize = 2;
    let params = &params.segmentation;
    let divided = || blamed.iter().find_map(|&p| segmentation::divide(ctx, params, surface, p));
    let united = |pieces: &[PatchId]| segmentation::unite(ctx, params, surface, pieces);
    if is_hopeless {
        return blamed.iter().find_map(|&p| united(&[p]));
    }
    let is_thin = !loose.is_empty() && segmentation::has_short_contacts(params, surface);
    let joined = is_thin.then(|| united(&loose[..loose.len().min(MOST_JOINED)])).flatten();
    joined.or_else(divided)
}

/// The kits made so far.
struct Kits {
    /// The one with the fewest failures, the earliest of several.
    best: Option<Design>,
    n_left: usize,
}

impl Kits {
    /// Counts a kit and keeps it where it is the best so far.
    fn add(&mut self, design: Design) {
        self.n_left -= 1;
        if self.best.as_ref().is_none_or(|b| failures(&design) < failures(b)) {
            self.best = Some(design);
        }
    }
}

/// How one segmentation went.
enum Attempt {
    Passed,
    Failed {
        reason: String,
        blockers: Vec<Blocker>,
        /// Pieces whose division may help, most promising first.
        blamed: Vec<PatchId>,
        /// Pieces that came out loose in the last kit.
        loose: Vec<PatchId>,
    },
}

fn finish(
    ctx: &Ctx,
    params: &Params,
    model: &Solid,
    labels: Option<&[i64]>,
    best: Option<Design>,
    attempt: Attempt,
) -> Result<DesignOutcome, DesignError> {
    Ok(match (best, attempt) {
        (Some(mut design), _) => {
            segmentation::tell(ctx, &params.segmentation, model, labels, &design.surface)?;
            design.warnings.splice(0..0, ctx.take_warnings());
            DesignOutcome::Made(Box::new(design))
        }
        (None, Attempt::Failed { reason, blockers, .. }) => DesignOutcome::NoPlan { reason, blockers },
        (None, Attempt::Passed) => unreachable!("what passed was kept"),
    })
}

/// Plans of one segmentation that may be given up because a piece could not take its wall along; they cost seconds.
const MOST_BLOCKED: usize = 8;

/// Plans and makes kits of one segmentation until one passes or nothing new can be tried.
fn with_segmentation(
    ctx: &Ctx,
    params: &Params,
    model: &Solid,
    grid: &ShellGrid,
    surface: &SegmentedSurface,
    chosen: &ChosenSizes,
    kits: &mut Kits,
) -> Result<Attempt, DesignError> {
    let sizes = &chosen.sizes;
    let survey: PlanSurvey = plan::survey(ctx, &params.plan, surface, &surface.seams(), sizes)?;
    let mut distances: Option<PatchDistances> = None;
    let mut constraints = PlanConstraints::default();
    let (mut blamed, mut loose) = (Vec::new(), Vec::new());
    let most_kits = params.rounds.kits.min(kits.n_left);
    let (mut kit, mut n_blocked) = (0, 0);
    while kit < most_kits && n_blocked < MOST_BLOCKED {
        ctx.take_warnings();
        chosen.tell(ctx);
        let found = match plan::search(ctx, &params.plan, &survey, &constraints)? {
            PlanOutcome::Found(found) => found,
            PlanOutcome::Infeasible { reason, blockers, articulations } => {
                blamed.splice(0..0, articulations.into_iter().chain(blockers.iter().map(|b| b.piece)));
                return Ok(Attempt::Failed { reason, blockers, blamed, loose });
            }
        };
        let (found, holding) = metric::choose(ctx, &params.plan, surface, sizes, *found)?;
        ctx.stage("distances to the patches", 0)?;
        let distances = distances.get_or_insert_with(|| PatchDistances::measure(grid, surface));
        let proof = Some(found.proof());
        let design = match make(ctx, params, model, grid, distances, surface, sizes, found.plan) {
            Err(DesignError::Body(BodyError::Blocked { piece, separation, kept })) => {
                let lesson = Lesson::Blocked { piece, separation, kept };
                ctx.note(&format!("another plan: {lesson}"));
                blamed.extend(lesson.blamed());
                lesson.teach(&mut constraints);
                n_blocked += 1;
                continue;
            }
            made => Design { proof, holding: Some(holding), ..made? },
        };
        kit += 1;
        let learned: Vec<Lesson> = lessons(&design);
        kits.add(design);
        if learned.is_empty() {
            return Ok(Attempt::Passed);
        }
        blamed.extend(learned.iter().flat_map(Lesson::blamed));
        loose = learned.iter().flat_map(Lesson::loose).collect();
        if kit < params.rounds.kits {
            learned.iter().for_each(|lesson| ctx.note(&format!("another plan: {lesson}")));
        }
        learned.iter().for_each(|lesson| lesson.teach(&mut constraints));
    }
    let reason = "no kit passed its verification within the allowed rounds".into();
    Ok(Attempt::Failed { reason, blockers: Vec::new(), blamed, loose })
}

fn failures(design: &Design) -> usize {
    design.verification.checks.iter().filter(|c| !c.ok).count()
}

/// Makes and verifies the kit of one plan. The grid must have room for connectors of the largest of `sizes`.
#[expect(clippy::too_many_arguments, reason = "the data of all earlier stages, each once")]
pub fn make(
    ctx: &Ctx,
    params: &Params,
    model: &Solid,
    grid: &ShellGrid,
    distances: &PatchDistances,
    surface: &SegmentedSurface,
    sizes: &ConnectorSizes,
    plan: InstallationPlan,
) -> Result<Design, DesignError> {
    let rooms = rooms(params, surface, sizes);
    let shell = body::build(ctx, &params.body, grid, distances, &plan, &rooms)?;
    let curves = shell.inner.as_ref().map_or(Vec::new(), |inner| connector::curves(grid, inner, &plan));
    let is_free = has_no_bar(&params.connector, grid, &shell);
    let (runs, contacts) = connector::runs(&params.connector, sizes, &plan, &curves, &is_free);
    let finished = piece::make(ctx, &params.connector, grid, &shell, &plan, &runs, &rooms)?;
    let (verification, touching) = verify::examine(ctx, &params.verify, model, &finished.meshes, &plan)?;
    warn_of_bare_seams(ctx, sizes, &contacts, &finished.joints);
    Ok(Design {
        surface: surface.clone(),
        sizes: sizes.clone(),
        plan,
        thickness_mm: params.body.thickness_mm,
        strength: None,
        proof: None,
        holding: None,
        pieces: finished.meshes,
        joints: finished.joints,
        contacts,
        verification,
        touching,
        warnings: ctx.take_warnings(),
    })
}

/// Says which long seams came out without any connector.
fn warn_of_bare_seams(ctx: &Ctx, sizes: &ConnectorSizes, contacts: &[Contact], joints: &[Joint]) {
    let has_room = |c: &&Contact| c.length_mm >= CONTACT_SIZES * sizes.of(c.later, c.earlier);
    for contact in contacts.iter().filter(has_room) {
        let pair = [contact.later, contact.earlier];
        let joins = |j: &&Joint| pair.contains(&j.male) && pair.contains(&j.female);
        if joints.iter().filter(joins).all(|j| j.length_mm == 0.0) {
            ctx.warn(Warning {
                code: "seam-without-connector".into(),
                message: format!(
                    "the seam of {:.0} mm between pieces {} and {} has no connector; other seams hold these pieces",
                    contact.length_mm, contact.later, contact.earlier
                ),
                pieces: pair.to_vec(),
                at: Some(contact.at.to_array()),
            });
        }
    }
}

/// The box around each patch and all connectors its piece can have.
fn rooms(params: &Params, surface: &SegmentedSurface, sizes: &ConnectorSizes) -> IdVec<PatchId, Aabb> {
    /// Carving shifts seams by less than this, mm.
    const SHIFT_MM: f64 = 2.0;
    let mut rooms: IdVec<PatchId, Aabb> = IdVec::from_fn(surface.n_patches, |_| Aabb::EMPTY);
    for (face, &p) in surface.patch_of_face.iter().enumerate() {
        rooms[p] = rooms[p].union(Aabb::around(surface.mesh.corners(face)));
    }
    let reach = params.body.thickness_mm + params.connector.room_mm(sizes.largest_mm()) + SHIFT_MM;
    rooms.as_slice().iter().map(|r| r.grown(reach)).collect()
}

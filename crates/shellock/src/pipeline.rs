//! The whole job: from a closed mesh to interlocking pieces that were verified.
//!
//! Feedback goes one way: what a finished kit teaches becomes a constraint for the next round of planning; when plans run
//! out, the segmentation is mended at the piece to blame, and planning starts afresh.

mod cut_key;
mod lesson;
mod rounds;

use std::borrow::Cow;

use shellock_geom::{Aabb, Solid, TriMesh, Vec3};

use crate::body::{BodyError, BodyParams, GridError, PatchDistances, ShellGrid};
use crate::connector::{ConnectorParams, Contact, Run, has_no_bar};
use crate::key::{KeySite, Turn};
use crate::metric::{ChoiceError, Holding};
use crate::piece::{FinishParams, Finished, Grip, Joint, LabelParams, PieceError, PressFit, PressFitKind, Relief};
use crate::plan::{Blocker, InstallationPlan, PlanParams, PlanProof};
use crate::play::{KitPlay, PlayParams};
use crate::segmentation::{SegmentationError, SegmentationParams};
use crate::sizes::{CONTACT_SIZES, LEAST_CONTACT_SIZES, SizeParams, StressField};
use crate::strength::{Strength, StrengthError, StrengthParams, StressMap};
use crate::verify::clearance::{KitGaps, kit_gaps};
use crate::verify::{Verification, VerifyParams};
use crate::{
    Cancelled, ConnectorSizes, Ctx, IdVec, PatchId, SegmentedSurface, Warning, body, connector, piece, play,
    segmentation, sizes, strength, verify,
};
use cut_key::CutKey;
use rounds::{Attempt, Kits, WallGrid, joined, mended, only_rattles, with_segmentation};

/// Everything that may be set. Each stage's parameters are declared beside it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Params {
    /// How the surface is divided.
    pub segmentation: SegmentationParams,
    /// Where the wall's thickness comes from.
    pub thickness: ThicknessChoice,
    /// What the wall must bear.
    pub strength: StrengthParams,
    /// Where the key comes from.
    pub key: KeySource,
    /// Whether a key that is cut gets a notch for a fingernail.
    pub has_grip: bool,
    /// Where that notch is; the key's place decides.
    grip: Option<Grip>,
    /// How the pieces' numbers are engraved; not at all where `None`.
    pub label: Option<LabelParams>,
    /// How plans are judged and searched.
    pub plan: PlanParams,
    /// How the wall is made and cut.
    pub body: BodyParams,
    /// How connectors are made.
    pub connector: ConnectorParams,
    /// How the finished kit is judged.
    pub verify: VerifyParams,
    /// Whether the play of all pieces together is looked for, too.
    pub play_together: bool,
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

/// Where the key comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KeySource {
    /// It is cut out of the surface where it slides best, see [`crate::key`]; where no such kit passes, as with `Piece`.
    #[default]
    Cut,
    /// It is one of the pieces: that of [`PlanParams::key`], or the flattest that works.
    Piece,
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
        let label = self.label.map_or_else(Vec::new, |l| l.problems());
        let stages = [self.body.problems(), self.connector.problems(), self.strength.problems(), label];
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

    /// The least gaps that finished pieces keep beneath the rim: those of connectors and of walls, whichever is narrower.
    fn relief(&self) -> Relief {
        let gap_mm = self.connector.clearance_mm.min(2.0 * self.body.wall_gap_mm);
        let of_key = |side_mm: f64| self.connector.key_clearance_mm.min(2.0 * side_mm);
        Relief { rim_mm: self.body.rim_mm, gap_mm, key_gap_mm: self.body.key_gap_mm.map_or(gap_mm, of_key) }
    }

    /// How the play of finished kits is measured.
    pub fn play(&self) -> PlayParams {
        PlayParams {
            clearance_mm: self.verify.clearance_mm,
            slide_mm: play::SLIDE_MM,
            is_together: self.play_together,
            seed: self.verify.seed,
        }
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

/// A finished kit. All places are in assembly space: the model as it was given, turned by `turn`.
pub struct Design {
    /// How the model was turned to make it.
    pub turn: Turn,
    /// How its key was cut; `None` where the key is one of the pieces.
    pub key: Option<KeySite>,
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
    /// What clicks on the key's way in.
    pub press_fits: Vec<PressFit>,
    /// What the seams offered.
    pub contacts: Vec<Contact>,
    /// The verdict on the finished meshes.
    pub verification: Verification,
    /// Where the finished pieces touch.
    pub touching: Vec<verify::contact::Contact>,
    /// How far the finished pieces move within their gaps.
    pub play: KitPlay,
    /// How near pieces come, at rest and on their way.
    pub gaps: KitGaps,
    /// What the user should know about this kit; kits that were given up keep their warnings to themselves.
    pub warnings: Vec<Warning>,
}

impl Design {
    /// Length of the rails that the key slides on, mm; 0 where it has none.
    pub fn rails_mm(&self) -> f64 {
        self.joints.iter().filter(|j| j.is_rail).map(|j| j.length_mm).fold(0.0, |sum, mm| sum + mm)
    }
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
    Segmentation(SegmentationError),
    /// The wall cannot be made.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// The wall cannot be split.
    #[error(transparent)]
    Body(BodyError),
    /// Plans cannot be compared.
    #[error(transparent)]
    Choice(ChoiceError),
    /// A piece cannot be finished.
    #[error(transparent)]
    Piece(PieceError),
    /// The user asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// A stage's error becomes the job's; a stop inside of a stage is a stop of the job.
macro_rules! from_stage {
    ($($stage:ident => $variant:ident),+ $(,)?) => {$(
        impl From<$stage> for DesignError {
            fn from(e: $stage) -> Self {
                match e {
                    $stage::Cancelled(stop) => stop.into(),
                    other => Self::$variant(other),
                }
            }
        }
    )+};
}

from_stage! {
    StrengthError => Strength,
    SegmentationError => Segmentation,
    BodyError => Body,
    ChoiceError => Choice,
    PieceError => Piece,
}

/// Makes a kit of `model` (mm), from `labels` (one a triangle) where given. Kits are made until one passes or the rounds
/// are used up; then the best of them is returned, its failures told.
pub fn design(ctx: &Ctx, params: &Params, model: &Solid, labels: Option<&[i64]>) -> Result<DesignOutcome, DesignError> {
    let (params, bearing) = with_thickness(ctx, params, model)?;
    let params = &params;
    let surface = segmentation::segment(ctx, &params.segmentation, model, labels)?;
    let job = Job { params, model, labels, bearing: &bearing, surface: &surface };
    let cut = if params.key == KeySource::Cut { cut_key::design(ctx, &job)? } else { cut_key::Cut::default() };
    // A piece as it is rattles no less as the key than one that was cut.
    if cut.best.as_ref().is_some_and(|d| d.verification.passed() || only_rattles(d)) {
        return Ok(DesignOutcome::Made(Box::new(cut.best.expect("it was looked at"))));
    }
    let outcome = job.kit(ctx, params, &Laid::of(&job), None)?;
    Ok(cut.compared_with(outcome))
}

/// How often pieces are joined because they rattle in a kit that was made and is sound else.
const MOST_RATTLING: usize = 2;

/// How often pieces are joined because they are foreseen to rattle, which costs a search for a plan each time and no kit.
const MOST_JOININGS: usize = 5;

/// What all kits of a job have in common, as it was given.
struct Job<'a> {
    params: &'a Params,
    model: &'a Solid,
    labels: Option<&'a [i64]>,
    bearing: &'a Bearing,
    surface: &'a SegmentedSurface,
}

/// The model and its pieces, turned.
struct Laid<'a> {
    turn: Turn,
    model: Cow<'a, Solid>,
    surface: SegmentedSurface,
}

impl<'a> Laid<'a> {
    /// As it was given.
    fn of(job: &Job<'a>) -> Self {
        Self { turn: Turn::default(), model: Cow::Borrowed(job.model), surface: job.surface.clone() }
    }
}

impl Job<'_> {
    /// Kits of `laid` until one passes or the rounds are used up; then the best of them. With `key`, its piece is cut again after every
    /// change of the pieces.
    fn kit(
        &self,
        ctx: &Ctx,
        params: &Params,
        laid: &Laid<'_>,
        key: Option<&CutKey>,
    ) -> Result<DesignOutcome, DesignError> {
        let (turn, back) = (laid.turn, laid.turn.inverse());
        let stress = self.bearing.strength.as_ref().map(StressMap::new);
        let stress_at = stress.as_ref().map(|map| |place| map.at(back.apply(place)));
        let stress_mpa = stress_at.as_ref().map(|at| at as StressField);
        let mut params = params.clone();
        let mut surface = laid.surface.clone();
        let cut_again = |params: &mut Params, surface: SegmentedSurface| match key {
            Some(key) => key.cut(ctx, params, surface),
            None => Ok(Some(surface)),
        };
        let no_key = || DesignOutcome::NoPlan { reason: "the key falls apart".into(), blockers: Vec::new() };
        let Some(cut) = cut_again(&mut params, surface)? else { return Ok(no_key()) };
        surface = cut;
        let choose = |params: &Params, surface: &SegmentedSurface| {
            let mut chosen = sizes::choose(ctx, &params.sizes(), surface, stress_mpa)?;
            if let Some(piece) = params.plan.key.filter(|_| key.is_some()) {
                // Its rails have as much room as it was cut for.
                chosen.sizes.cap(piece, params.connector.size.usual_mm());
            }
            Ok::<_, DesignError>(chosen)
        };
        let mut sizes = choose(&params, &surface)?;
        let body = params.body.clone();
        let mut grid = WallGrid { params: &body, model: &laid.model, room_mm: 0.0, made: None };
        let mut kits = Kits { best: None, n_left: params.rounds.kits_in_all, may_join: true };
        let mut n_joined = 0;
        let (mut mending, mut n_rattled) = (0, 0);
        let attempt = loop {
            grid.make_room(params.connector.room_mm(sizes.sizes.largest_mm()));
            let attempt = with_segmentation(ctx, &params, &mut grid, &surface, &sizes, &mut kits)?;
            let attempt = match attempt {
                Attempt::Joined(fewer) => {
                    n_joined += 1;
                    kits.may_join = n_joined < MOST_JOININGS;
                    if let Some(fewer) = cut_again(&mut params, fewer)? {
                        ctx.note(&format!(
                            "pieces would rattle: {} pieces instead of {}",
                            fewer.n_patches, surface.n_patches
                        ));
                        surface = fewer;
                        sizes = choose(&params, &surface)?;
                    } else {
                        kits.may_join = false;
                    }
                    continue;
                }
                other => other,
            };
            let Attempt::Failed { blamed, loose, rattling, .. } = &attempt else { break attempt };
            let is_last = match rattling.is_empty() {
                true => mending == params.rounds.mendings,
                false => n_rattled == MOST_RATTLING,
            };
            if is_last || kits.n_left == 0 {
                break attempt;
            }
            let is_hopeless = kits.best.is_none() && 2 * mending >= params.rounds.mendings;
            let mended = match rattling.is_empty() {
                false => joined(ctx, &params, &surface, rattling)?,
                true => mended(ctx, &params, &surface, blamed, loose, is_hopeless)?,
            };
            let Some(mended) = mended else { break attempt };
            let Some(mended) = cut_again(&mut params, mended)? else { break attempt };
            ctx.note(&format!("another segmentation: {} pieces instead of {}", mended.n_patches, surface.n_patches));
            surface = mended;
            if rattling.is_empty() {
                mending += 1;
            } else {
                n_rattled += 1;
            }
            sizes = choose(&params, &surface)?;
        };
        // Warnings of segmentations and plans that were given up go with them.
        ctx.take_warnings();
        if let Some(best) = &mut kits.best {
            let place = |at: [f64; 3]| turn.apply(Vec3::from(at)).to_array();
            let turned = |w: &Warning| Warning { at: w.at.map(place), ..w.clone() };
            best.warnings.extend(self.bearing.warnings.iter().map(turned));
            best.strength = self.bearing.strength.clone().map(|s| s.turned(|v| turn.apply(v)));
            best.turn = turn;
            best.key = key.map(|k| k.site);
        }
        finish(ctx, &params, &laid.model, self.labels, kits.best, attempt)
    }
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
            design.gaps = kit_gaps(ctx, model, &design.pieces, &design.plan, params.body.rim_mm)?;
            design.warnings.extend(crossing(&design));
            DesignOutcome::Made(Box::new(design))
        }
        (None, Attempt::Failed { reason, blockers, .. }) => DesignOutcome::NoPlan { reason, blockers },
        (None, Attempt::Passed | Attempt::Joined(_)) => unreachable!("what passed was kept"),
    })
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
    let runs_for = |slide| connector::runs(&params.connector, sizes, &plan, &curves, slide, &is_free);
    let (runs, contacts) = match params.plan.key.and(params.plan.key_slide) {
        Some(cut) => runs_for(Some(cut.unit())),
        // A piece that is the key has rails where its seams happen to allow them.
        None => {
            let own = runs_for(plan.steps.last().map(|step| step.separation.unit()));
            if own.0.iter().any(Run::is_rail) { own } else { runs_for(None) }
        }
    };
    let grip = params.grip.map(|grip| Grip { key: plan.key(), ..grip });
    let finish = FinishParams { connector: &params.connector, relief: params.relief(), grip, label: params.label };
    let finished = piece::make(ctx, &finish, grid, &shell, &plan, &runs, &rooms)?;
    warn_of_press_fits(ctx, &finished);
    let assembly = verify::Assembly { model, pieces: &finished.meshes, plan: &plan, press_fits: &finished.press_fits };
    let (mut verification, touching) = verify::examine(ctx, &params.verify, &assembly)?;
    let mut measured = play::measure(ctx, &params.play(), &finished.meshes, &plan)?;
    let size_mm = model.mesh().bounds().size().max_element();
    verification.add(play::check(&measured, &finished.meshes, size_mm, params.verify.clearance_mm));
    if verification.passed() {
        // It is slow; what fails already is not given out.
        play::look_for_ways_out(ctx, params.verify.clearance_mm, &finished.meshes, &mut measured)?;
        play::check_ways_out(&measured, &finished.meshes).into_iter().for_each(|check| verification.add(check));
    }
    play::warning(&measured).into_iter().for_each(|warning| ctx.warn(warning));
    warn_of_bare_seams(ctx, sizes, &contacts, &finished.joints);
    Ok(Design {
        turn: Turn::default(),
        key: None,
        surface: surface.clone(),
        sizes: sizes.clone(),
        plan,
        thickness_mm: params.body.thickness_mm,
        strength: None,
        proof: None,
        holding: None,
        pieces: finished.meshes,
        joints: finished.joints,
        press_fits: finished.press_fits,
        contacts,
        verification,
        touching,
        play: measured,
        gaps: KitGaps::default(),
        warnings: ctx.take_warnings(),
    })
}

/// Says what the key must be pressed past, and what holds a key without rails.
fn warn_of_press_fits(ctx: &Ctx, finished: &Finished) {
    let of = |kind: PressFitKind| finished.press_fits.iter().filter(move |f| f.kind == kind);
    for d in of(PressFitKind::Detent) {
        ctx.warn(Warning {
            code: "detent".into(),
            message: format!(
                "on the last {:.1} mm of its way the key is pressed past a bump of piece {} that is {:.2} mm too high for its \
                 groove, on purpose: it clicks; the proofs of free paths are without it",
                d.travel_mm, d.piece, d.interference_mm
            ),
            pieces: vec![d.piece],
            at: Some(d.at),
        });
    }
    if let Some(rib) = of(PressFitKind::Rib).next() {
        ctx.warn(Warning {
            code: "key-ribs".into(),
            message: format!(
                "the key has no rails: {} ribs on its sides press by {:.2} mm on the last {:.1} mm of its way, on purpose, so that it \
                 stays in; file them down if it is too tight; the proofs of free paths are without them",
                of(PressFitKind::Rib).count(), rib.interference_mm, rib.travel_mm
            ),
            pieces: vec![rib.piece],
            at: Some(rib.at),
        });
    }
}

/// Says where finished pieces cross that are not meant to press: on a way out, or at rest.
fn crossing(design: &Design) -> Option<Warning> {
    /// Less is rounding, mm.
    const LEAST_MM: f64 = 0.02;
    let deepest = design.gaps.paths.iter().min_by(|a, b| a.overall.gap_mm.total_cmp(&b.overall.gap_mm))?;
    let place = deepest.overall;
    let is_meant = deepest.piece == design.plan.key() && !design.press_fits.is_empty();
    (place.gap_mm < -LEAST_MM && !is_meant).then(|| Warning {
        code: "surfaces-cross".into(),
        message: format!(
            "pieces {} and {} cross by {:.2} mm after {:.1} mm of the way of the first; it will rub there: sand it a little",
            deepest.piece, deepest.against, -place.gap_mm, place.travel_mm
        ),
        pieces: vec![deepest.piece, deepest.against],
        at: Some(place.at),
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

#[cfg(test)]
mod tests;

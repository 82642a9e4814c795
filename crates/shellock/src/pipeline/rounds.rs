//! Rounds of plans and kits for one segmentation, and what is changed after them.

use shellock_geom::Solid;

use super::lesson::{Lesson, lessons};
use super::{Design, DesignError, KeySource, Params, make};
use crate::body::{BodyError, BodyParams, GridError, PatchDistances, ShellGrid};
use crate::metric::Holding;
use crate::plan::{Blocker, FoundPlan, InstallationPlan, PlanConstraints, PlanOutcome, PlanSurvey};
use crate::segmentation::SegmentationError;
use crate::sizes::ChosenSizes;
use crate::verify::Finding;
use crate::{ConnectorSizes, Ctx, PatchId, SegmentedSurface, key, metric, plan, segmentation};

/// The surface with other pieces, which may do better.
///
/// Dividing comes first, as it keeps the user's labels. What came loose where seams are short would only get shorter ones: it is joined
/// to a neighbour; so is what stood in the way of every plan until half of the rounds were gone.
pub(super) fn mended(
    ctx: &Ctx,
    params: &Params,
    surface: &SegmentedSurface,
    blamed: &[PatchId],
    loose: &[PatchId],
    is_hopeless: bool,
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    /// Pieces joined at once; more would change what holds.
    const MOST_JOINED: usize = 2;
    let params = &params.segmentation;
    let united = |pieces: &[PatchId]| segmentation::unite(ctx, params, surface, pieces);
    if is_hopeless {
        return first(blamed, |p| united(&[p]));
    }
    if !loose.is_empty() && segmentation::has_short_contacts(params, surface) {
        let joined = united(&loose[..loose.len().min(MOST_JOINED)])?;
        if joined.is_some() {
            return Ok(joined);
        }
    }
    first(blamed, |p| segmentation::divide(ctx, params, surface, p))
}

/// The first change of a piece that can be made.
fn first<T>(
    pieces: &[PatchId],
    mut change: impl FnMut(PatchId) -> Result<Option<T>, SegmentationError>,
) -> Result<Option<T>, SegmentationError> {
    for &piece in pieces {
        let changed = change(piece)?;
        if changed.is_some() {
            return Ok(changed);
        }
    }
    Ok(None)
}

/// The pieces that rattle, the loosest first; the key, which is cut where there is room for it, is left out.
pub(super) fn rattling(design: &Design) -> Vec<PatchId> {
    let piece = |f: &Finding| match f {
        Finding::PlayTooWide { piece, .. } if *piece != design.plan.key() => Some(*piece),
        _ => None,
    };
    design.verification.findings.iter().filter_map(piece).collect()
}

/// The pieces that are foreseen to rattle far more than they may, the loosest first.
fn foreseen_to_rattle(found: &FoundPlan, holding: &Holding) -> Vec<PatchId> {
    /// Play is foreseen within about this factor.
    const SURELY: f64 = 1.4;
    let excess = holding.foreseen_excess.iter().enumerate().map(|(i, excess)| (PatchId::from(i), *excess));
    let mut wide: Vec<(PatchId, f64)> =
        excess.filter(|(p, excess)| *excess > SURELY && *p != found.plan.key()).collect();
    wide.sort_by(|a, b| b.1.total_cmp(&a.1));
    wide.into_iter().map(|w| w.0).collect()
}

/// The surface with the loosest pieces joined to neighbours; `None` where that leaves nothing to lock.
pub(super) fn joined(
    ctx: &Ctx,
    params: &Params,
    surface: &SegmentedSurface,
    rattling: &[PatchId],
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    /// More would change what holds.
    const MOST_JOINED: usize = 2;
    let loosest = &rattling[..rattling.len().min(MOST_JOINED)];
    if loosest.is_empty() { Ok(None) } else { segmentation::unite(ctx, &params.segmentation, surface, loosest) }
}

/// The kits made so far.
pub(super) struct Kits {
    /// The one with the fewest failures, then that rattles least, the earliest of several.
    pub best: Option<Design>,
    pub n_left: usize,
    /// Whether pieces that are foreseen to rattle may still be joined.
    pub may_join: bool,
}

impl Kits {
    /// Counts a kit and keeps it where it is the best so far.
    fn add(&mut self, design: Design) {
        self.n_left -= 1;
        if self.best.as_ref().is_none_or(|b| is_better(&design, b)) {
            self.best = Some(design);
        }
    }
}

/// How one segmentation went.
pub(super) enum Attempt {
    Passed,
    /// Nothing was made, since pieces are foreseen to rattle; with these pieces less.
    Joined(SegmentedSurface),
    Failed {
        reason: String,
        blockers: Vec<Blocker>,
        /// Pieces whose division may help, most promising first.
        blamed: Vec<PatchId>,
        /// Pieces that came out loose in the last kit.
        loose: Vec<PatchId>,
        /// Pieces that rattle in the last kit, where nothing else is wrong with it; the loosest first, and without the key.
        rattling: Vec<PatchId>,
    },
}

/// The grid of a model's wall, made when it is first asked for.
pub(super) struct WallGrid<'a> {
    pub params: &'a BodyParams,
    pub model: &'a Solid,
    /// Room for connectors below the wall.
    pub room_mm: f64,
    pub made: Option<ShellGrid>,
}

impl WallGrid<'_> {
    /// Makes sure that there will be so much room.
    pub(super) fn make_room(&mut self, room_mm: f64) {
        if room_mm > self.room_mm {
            (self.room_mm, self.made) = (room_mm, None);
        }
    }

    fn get(&mut self) -> Result<&ShellGrid, GridError> {
        if self.made.is_none() {
            self.made = Some(ShellGrid::new(self.params, self.model, self.room_mm)?);
        }
        Ok(self.made.as_ref().expect("it was made just now"))
    }
}

/// Plans of one segmentation that may be given up because a piece could not take its wall along; they cost seconds.
const MOST_BLOCKED: usize = 8;

/// Plans and makes kits of one segmentation until one passes or nothing new can be tried.
pub(super) fn with_segmentation(
    ctx: &Ctx,
    params: &Params,
    wall: &mut WallGrid<'_>,
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
        // The proof of a plan runs on one thread; the grid and distances in it are made beside it.
        let (measured, outcome) = rayon::join(
            || {
                let grid = wall.get()?;
                distances.get_or_insert_with(|| PatchDistances::measure(grid, surface));
                Ok::<(), GridError>(())
            },
            || planned(ctx, params, surface, &survey, sizes, &constraints),
        );
        measured?;
        let (found, holding) = match outcome? {
            Planned::Found(found, holding) => (found, holding),
            Planned::Infeasible { reason, blockers, articulations } => {
                blamed.splice(0..0, articulations.into_iter().chain(blockers.iter().map(|b| b.piece)));
                return Ok(Attempt::Failed { reason, blockers, blamed, loose, rattling: Vec::new() });
            }
        };
        if kits.may_join
            && let Some(surface) = joined(ctx, params, surface, &foreseen_to_rattle(&found, &holding))?
        {
            return Ok(Attempt::Joined(surface));
        }
        let (model, grid) = (wall.model, wall.get()?);
        let distances = distances.as_ref().expect("they were measured beside the plan");
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
        let rattling = only_rattles(&design).then(|| rattling(&design));
        kits.add(design);
        if learned.is_empty() {
            return Ok(Attempt::Passed);
        }
        if let Some(rattling) = rattling {
            // The plan was chosen to rattle least: other pieces are what helps.
            let reason = "pieces rattle".into();
            return Ok(Attempt::Failed {
                reason,
                blockers: Vec::new(),
                blamed: Vec::new(),
                loose: Vec::new(),
                rattling,
            });
        }
        blamed.extend(learned.iter().flat_map(Lesson::blamed));
        loose = learned.iter().flat_map(Lesson::loose).collect();
        if kit < params.rounds.kits {
            learned.iter().for_each(|lesson| ctx.note(&format!("another plan: {lesson}")));
        }
        learned.iter().for_each(|lesson| lesson.teach(&mut constraints));
    }
    let reason = "no kit passed its verification within the allowed rounds".into();
    Ok(Attempt::Failed { reason, blockers: Vec::new(), blamed, loose, rattling: Vec::new() })
}

/// A plan that holds best of those that cost about the least, or why there is none.
enum Planned {
    Found(Box<FoundPlan>, Holding),
    Infeasible { reason: String, blockers: Vec<Blocker>, articulations: Vec<PatchId> },
}

fn planned(
    ctx: &Ctx,
    params: &Params,
    surface: &SegmentedSurface,
    survey: &PlanSurvey,
    sizes: &ConnectorSizes,
    constraints: &PlanConstraints,
) -> Result<Planned, DesignError> {
    Ok(match plan::search(ctx, &params.plan, survey, constraints)? {
        PlanOutcome::Found(found) => {
            let (found, holding) = metric::choose(ctx, &params.plan, surface, sizes, *found)?;
            if params.plan.key_slide.is_none() {
                warn_of_key(ctx, params, surface, sizes, &found.plan);
            }
            Planned::Found(Box::new(found), holding)
        }
        PlanOutcome::Infeasible { reason, blockers, articulations } => {
            Planned::Infeasible { reason, blockers, articulations }
        }
    })
}

/// Says which conditions a key breaks that was not cut to meet them.
fn warn_of_key(
    ctx: &Ctx,
    params: &Params,
    surface: &SegmentedSurface,
    sizes: &ConnectorSizes,
    plan: &InstallationPlan,
) {
    let may_be_cut = params.key == KeySource::Piece;
    let Some(last) = plan.steps.last() else { return };
    if let Some(found) = key::conditions(surface, last.piece, last.separation.unit()) {
        found.problems(last.piece, sizes.largest_mm(), may_be_cut).into_iter().for_each(|problem| ctx.warn(problem));
    }
}

pub(super) fn failures(design: &Design) -> usize {
    design.verification.checks.iter().filter(|c| !c.ok).count()
}

/// Whether the only thing wrong with a kit is that pieces rattle.
pub(super) fn only_rattles(design: &Design) -> bool {
    let is_rattle = |f: &Finding| matches!(f, Finding::PlayTooWide { .. });
    failures(design) == 1
        && !design.verification.findings.is_empty()
        && design.verification.findings.iter().all(is_rattle)
}

/// Whether a kit has fewer failures, or as many and rattles less.
pub(super) fn is_better(design: &Design, than: &Design) -> bool {
    let excess = |finding: &Finding| match finding {
        Finding::PlayTooWide { play, most, .. } => (play.translation_mm / most[0]).max(play.rotation_deg / most[1]),
        _ => 0.0,
    };
    let rattles = |d: &Design| d.verification.findings.iter().map(excess).fold(0.0, f64::max);
    let (own, other) = (failures(design), failures(than));
    own < other || (own == other && rattles(design) < rattles(than))
}

//! End of a job: the best kit with its measurements, or the reason why there is none.

use shellock_assembly::{PrintedFit, fit};
use shellock_geom::TriMesh;

use super::agenda::{Agenda, Effort};
use super::best::{Best, Kept};
use super::causes::Cause;
use super::wall::WallChoices;
use super::ways::Input;
use super::{KeySource, Kit, Planned, Settings};
use crate::body::GridError;
use crate::key::KeySite;
use crate::metric::ChoiceError;
use crate::plan::Blocker;
use crate::segmentation::{self, SegmentationError};
use crate::strength::{Strength, StrengthError};
use crate::verify::clearance::{KitGaps, kit_gaps};
use crate::verify::limits::LEAST_SLOT_MM;
use crate::verify::{ThinFeature, thin_places};
use crate::{Cancelled, Ctx, IdVec, MakeError, PatchId, Warning};

/// Finished kit and the wall that it is made of. Places are in the space of the model as given.
#[non_exhaustive]
pub struct Design {
    /// Pieces, their plan and their verification.
    pub kit: Kit,
    /// Parameters of the stages that made it, for its own wall and division. Those that only a cut key has
    /// are left out.
    pub settings: Settings,
    /// Site where the key was cut; `None` if the key is one of the pieces.
    pub key: Option<KeySite>,
    /// The kinds of wall that the user may choose from; `None` if the user gave the thickness.
    pub walls: Option<WallChoices>,
    /// Stress analysis of the wall; `None` if the stress could not be computed, which is warned of.
    pub strength: Option<Strength>,
    /// Gaps between pieces, at rest and on their ways out.
    pub gaps: KitGaps,
    /// Tolerance of the kit to printing errors, and its play if faces are printed too far inwards.
    pub fit: PrintedFit,
    /// Places of each piece that are too thin to print well, the longest first.
    pub thin: IdVec<PatchId, Vec<ThinFeature>>,
    /// Cost of the whole job, including all failed trials.
    pub effort: Effort,
    /// Warnings about this kit. Those of kits that were given up are left out.
    pub warnings: Vec<Warning>,
}

/// End of the job.
pub enum DesignOutcome {
    /// A kit was made. It may have failed its verification.
    Made(Box<Design>),
    /// No plan was found for any division that was tried.
    NoPlan(NoPlan),
}

/// Reason why there is no plan.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct NoPlan {
    /// Explanation of the failure, for people.
    pub reason: String,
    /// Pieces that block the way out of others.
    pub blockers: Vec<Blocker>,
    /// True if the time was over before all was tried: with more of it one may be found.
    pub is_cut_short: bool,
    /// Time that the first kit needs in all, s, where that can be said.
    pub needed_s: Option<f64>,
}

impl Best<Planned> {
    /// Concludes a job that seeks a plan.
    pub fn conclude(self, ctx: &Ctx, agenda: &Agenda) -> Result<Result<Planned, NoPlan>, DesignError> {
        Ok(self.into_answer(ctx, agenda)?.map(|kept| {
            let mut planned = kept.end;
            planned.warnings.extend(agenda.is_cut_short().then(|| time_up(0)));
            planned
        }))
    }
}

impl Best<Kit> {
    /// Concludes a job: completes the measurements of the best kit, and collects its warnings.
    pub fn conclude(
        self,
        ctx: &Ctx,
        input: &Input<'_>,
        agenda: &Agenda,
        effort: Effort,
    ) -> Result<DesignOutcome, DesignError> {
        let kept = match self.into_answer(ctx, agenda)? {
            Ok(kept) => kept,
            Err(none) => return Ok(DesignOutcome::NoPlan(none)),
        };
        let mut design = finish(ctx, input, kept, effort)?;
        let kits = design.effort.kits;
        design
            .warnings
            .extend(agenda.is_cut_short().then(|| time_up(kits)));
        Ok(DesignOutcome::Made(Box::new(design)))
    }
}

/// Measures the gaps and thin places of a kit and the play that printing errors would give it, and collects
/// the kit's warnings.
fn finish(ctx: &Ctx, input: &Input<'_>, kept: Kept<Kit>, effort: Effort) -> Result<Design, DesignError> {
    let Kept {
        end: kit,
        key,
        wall,
        reasons,
        ..
    } = kept;
    let settings = wall.settings.clone();
    let rim_mm = settings.body.rim_mm;
    let gaps = kit_gaps(ctx, Some(input.model), &kit.pieces, &kit.plan, rim_mm)?;
    let has_passed = kit.verification.has_passed();
    let fit = PrintedFit::of(ctx, &kit.assembly(input.model), &gaps, &kit.play, has_passed)?;
    let least_wall_mm = settings.connector.min_wall_mm;
    let thin = |mesh: &TriMesh| thin_places(mesh, least_wall_mm, LEAST_SLOT_MM);
    let thin: IdVec<PatchId, Vec<ThinFeature>> = kit.pieces.as_slice().iter().map(thin).collect();
    let ctx = ctx.fork();
    segmentation::tell(
        &ctx,
        &settings.segmentation,
        input.model,
        input.labels,
        &kit.surface,
    )?;
    let mut warnings = ctx.into_warnings();
    warnings.extend(kit.warnings.iter().cloned());
    warnings.extend(wall.warnings());
    warnings.extend(fit::crossing_warning(&kit.assembly(input.model), &gaps));
    warnings.extend(fit::thin_warning(&thin));
    warnings.extend(key_warning(input, &kit, key.as_ref(), reasons));
    Ok(Design {
        kit,
        settings,
        key,
        strength: wall.strength.clone(),
        walls: wall.choices,
        gaps,
        fit,
        thin,
        effort,
        warnings,
    })
}

/// Warns of a cut key without rails, or of a piece that became the key because none could be cut.
fn key_warning(
    input: &Input<'_>,
    kit: &Kit,
    key: Option<&KeySite>,
    mut reasons: Vec<String>,
) -> Option<Warning> {
    match key {
        Some(site) => (kit.rails_mm() <= 0.0).then(|| {
            let at = site.prism.origin.to_array();
            Warning::new(Cause::KeyWithoutRails, vec![kit.plan.key()], Some(at))
        }),
        None if !input.params.key.is_cut() => None,
        None => {
            if reasons.is_empty() {
                reasons.push(match input.params.key {
                    KeySource::CutNear(_) => {
                        "the surface is not flat, free and thick enough near the place that you chose".into()
                    }
                    _ => "nowhere is the surface flat, free and thick enough to cut one".into(),
                });
            }
            Some(Warning::new(
                Cause::KeyNotCut { reasons },
                vec![kit.plan.key()],
                None,
            ))
        }
    }
}

/// Warns that the time was over after so many kits; after none, the warning speaks of the plan.
fn time_up(kits: usize) -> Warning {
    Warning::new(Cause::TimeUp { kits }, Vec::new(), None)
}

/// Reason why the job could not be done.
#[derive(Debug, thiserror::Error)]
pub enum DesignError {
    /// No thickness can be found.
    #[error(transparent)]
    Strength(StrengthError),
    /// The surface cannot be divided.
    #[error(transparent)]
    Segmentation(SegmentationError),
    /// There is no room for the wall.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// Plans cannot be compared.
    #[error(transparent)]
    Choice(ChoiceError),
    /// The wall cannot be split, or a piece cannot be finished.
    #[error(transparent)]
    Make(MakeError),
    /// No triangle has the label that the key is to have.
    #[error("no part of the model has the label {0}, which the key is to have")]
    NoLabelOfKey(i64),
    /// No piece has the number that the key is to have.
    #[error("there is no piece {0} to be the key: the model is divided into pieces 1 to {1}")]
    NoPieceOfKey(i64, usize),
    /// The user asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Converts errors of stages into errors of the job. A stop within a stage stops the job.
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
    ChoiceError => Choice,
    MakeError => Make,
}

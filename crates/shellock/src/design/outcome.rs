//! End of a job: the best kit with its measurements, or the reason why there is none.

use std::sync::Arc;

use shellock_geom::TriMesh;

use super::agenda::{Agenda, Effort, Grade};
use super::attempt::Failure;
use super::candidate;
use super::causes::Cause;
use super::wall::Wall;
use super::ways::Input;
use super::{KeySource, Kit, Planned, Settings};
use crate::body::{BodyError, GridError};
use crate::key::KeySite;
use crate::metric::ChoiceError;
use crate::piece::PieceError;
use crate::plan::Blocker;
use crate::play;
use crate::segmentation::{self, SegmentationError};
use crate::strength::{NoRoom, Strength, StrengthError, TooThin};
use crate::verify::clearance::{KitGaps, kit_gaps};
use crate::verify::limits::LEAST_SLOT_MM;
use crate::verify::{Play, ThinFeature, ThinKind, thin_places};
use crate::{Cancelled, Ctx, IdVec, PatchId, Warning};

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

/// Effect of printing errors on a kit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PrintedFit {
    /// Largest distance by which every printed face may lie too far outwards, mm. Half of the least gap
    /// between two pieces, at rest and on any way out; gaps of a key with ribs or bumps, which press on
    /// purpose, do not count. ≤ 0 if surfaces cross; `None` if no two pieces come near each other.
    pub within_mm: Option<f64>,
    /// Piece with the most play, for small motions, if every face lies `within_mm` too far inwards, and that
    /// play; endless if the piece comes loose. `None` if the kit fails, or if `within_mm` is not positive.
    pub loosest: Option<(PatchId, Play)>,
}

/// End of the job.
pub enum DesignOutcome {
    /// A kit was made. It may have failed its verification.
    Made(Box<Design>),
    /// No plan was found for any division that was tried.
    NoPlan {
        /// Reason why there is no plan, for people.
        reason: String,
        /// Pieces that block the way out of others.
        blockers: Vec<Blocker>,
        /// True if the time was over before all was tried: with more of it one may be found.
        is_cut_short: bool,
        /// Time that the first kit needs in all, s, where that can be said.
        needed_s: Option<f64>,
    },
}

/// Reason why there is no plan.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct NoPlan {
    /// Explanation of the failure, for people.
    pub reason: String,
    /// True if the time was over before all was tried: with more of it one may be found.
    pub is_cut_short: bool,
    /// Time that the first kit needs in all, s, where that can be said.
    pub needed_s: Option<f64>,
}

/// The best end so far, a kit or a plan, and the reasons why other trials failed.
pub(super) struct Best<T> {
    entry: Option<Kept<T>>,
    /// Reasons why keys that were cut with the present wall fail, for people.
    reasons: Vec<String>,
    /// First failure with a piece as the key.
    failure: Option<Failure>,
    /// Last error with a piece as the key, or of a model that could not be divided.
    error: Option<DesignError>,
    /// Failure of the present key so far.
    present: Failure,
    /// Grade of the best end with the present key, and its faults for people.
    of_key: Option<(Grade, Vec<String>)>,
}

/// An end with what it was made of.
struct Kept<T> {
    end: T,
    grade: Grade,
    key: Option<KeySite>,
    wall: Arc<Wall>,
    /// Reasons why keys that were cut with its wall fail.
    reasons: Vec<String>,
}

impl<T> Best<T> {
    pub fn new() -> Self {
        Self {
            entry: None,
            reasons: Vec::new(),
            failure: None,
            error: None,
            present: Failure::default(),
            of_key: None,
        }
    }

    /// Keeps an end, with these `faults`, if its grade is better than that of the best one so far. Of equals,
    /// the earlier one stays.
    pub fn offer(
        &mut self,
        end: T,
        (grade, faults): (Grade, Vec<String>),
        key: Option<KeySite>,
        wall: &Arc<Wall>,
    ) {
        if self
            .of_key
            .as_ref()
            .is_none_or(|(best, _)| grade.is_better_than(best))
        {
            self.of_key = Some((grade, faults));
        }
        if self
            .entry
            .as_ref()
            .is_none_or(|kept| grade.is_better_than(&kept.grade))
        {
            self.entry = Some(Kept {
                end,
                grade,
                key,
                wall: wall.clone(),
                reasons: self.reasons.clone(),
            });
        }
    }

    /// Keeps the reason why the present trial fails.
    pub fn fail(&mut self, failure: Failure) {
        if !failure.reason.is_empty() {
            self.present = failure;
        }
    }

    /// Closes a key: its failure becomes a reason for people, or the failure of the job.
    pub fn close_key(&mut self, ctx: &Ctx, site: Option<&KeySite>) {
        let failure = std::mem::take(&mut self.present);
        let kit = self.of_key.take().map(|(_, faults)| faults);
        let Some(site) = site else {
            if kit.is_none() && !failure.reason.is_empty() {
                self.failure.get_or_insert(failure);
            }
            return;
        };
        let words = candidate::words(site);
        let reason = match kit {
            Some(faults) if faults.is_empty() => return,
            Some(faults) => format!("{words}: {}", plainly(&faults)),
            None if failure.reason.is_empty() => return,
            None => format!("{words}: no plan, as {}", failure.reason),
        };
        self.reject(ctx, reason);
    }

    /// Closes a key that cannot be made. The error is the job's only if a piece is the key and no kit was
    /// made.
    pub fn close_key_with(&mut self, ctx: &Ctx, site: Option<&KeySite>, error: DesignError) {
        (self.present, self.of_key) = (Failure::default(), None);
        match site {
            Some(site) => self.reject(ctx, format!("{} cannot be made: {error}", candidate::words(site))),
            None => {
                if self.has_end() {
                    ctx.note(&format!("with a piece as the key it cannot be made: {error}"));
                }
                self.error = Some(error);
            }
        }
    }

    pub fn has_end(&self) -> bool {
        self.entry.is_some()
    }

    /// Reason to divide in another way, for people.
    pub fn words(&self) -> String {
        match (&self.entry, &self.error) {
            (Some(_), _) => "no kit of these pieces passes".to_owned(),
            (None, Some(error)) => format!("these pieces cannot be made: {error}"),
            (None, None) => "these pieces have no plan".to_owned(),
        }
    }

    /// Begins another wall, whose keys fail for reasons of their own.
    pub fn begin_wall(&mut self) {
        self.reasons.clear();
    }

    /// Returns the best end; fails with the error of the job if there is none.
    pub fn into_end(self) -> Result<Option<T>, DesignError> {
        match (self.entry, self.error) {
            (Some(kept), _) => Ok(Some(kept.end)),
            (None, Some(error)) => Err(error),
            (None, None) => Ok(None),
        }
    }

    fn reject(&mut self, ctx: &Ctx, reason: String) {
        ctx.note(&reason);
        self.reasons.push(reason);
    }

    /// Reason why there is no end: a failure, else an error, else nothing but a lack of time.
    fn why(self) -> Result<Failure, DesignError> {
        match (self.failure, self.error) {
            (Some(failure), _) => Ok(failure),
            (None, Some(error)) => Err(error),
            (None, None) => Ok(self.present),
        }
    }
}

impl Best<Planned> {
    /// Concludes a job that seeks a plan.
    pub fn conclude(self, ctx: &Ctx, agenda: &Agenda) -> Result<Result<Planned, NoPlan>, DesignError> {
        let is_cut_short = agenda.is_cut_short();
        if let Some(kept) = self.entry {
            let mut planned = kept.end;
            planned.warnings.extend(is_cut_short.then(|| time_up(0)));
            return Ok(Ok(planned));
        }
        let reason = match self.why() {
            Ok(failure) => failure.reason,
            Err(error) if is_cut_short => error.to_string(),
            Err(error) => return Err(error),
        };
        let needed_s = agenda.needed_s(ctx).filter(|_| is_cut_short);
        Ok(Err(NoPlan {
            reason: if is_cut_short {
                report_lateness(&reason, needed_s)
            } else {
                reason
            },
            is_cut_short,
            needed_s,
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
        let is_cut_short = agenda.is_cut_short();
        let Some(kept) = self.entry else {
            let failure = match self.why() {
                // Other pieces that were left out might have been made.
                Err(error) if is_cut_short => Failure::of(&error.to_string()),
                why => why?,
            };
            let needed_s = agenda.needed_s(ctx).filter(|_| is_cut_short);
            return Ok(DesignOutcome::NoPlan {
                reason: if is_cut_short {
                    report_lateness(&failure.reason, needed_s)
                } else {
                    failure.reason
                },
                blockers: failure.blockers,
                is_cut_short,
                needed_s,
            });
        };
        let mut design = finish(ctx, input, kept, effort)?;
        design
            .warnings
            .extend(is_cut_short.then(|| time_up(design.effort.kits)));
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
    let gaps = kit_gaps(
        ctx,
        Some(input.model),
        &kit.pieces,
        &kit.plan,
        settings.body.rim_mm,
    )?;
    let fit = PrintedFit::of(ctx, &kit, &gaps)?;
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
    warnings.extend(crossing_warning(&kit, &gaps));
    warnings.extend(thin_in_all(&thin));
    warnings.extend(key_warning(input, &kit, key.as_ref(), reasons));
    Ok(Design {
        kit,
        settings,
        key,
        strength: wall.strength.clone(),
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
        Some(key) => (kit.rails_mm() <= 0.0).then(|| without_rails(kit, key)),
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
            Some(not_cut(kit, reasons))
        }
    }
}

/// Warns that an uncut piece became the key, with the reasons.
fn not_cut(kit: &Kit, reasons: Vec<String>) -> Warning {
    let key = kit.plan.key();
    Warning::new(Cause::KeyNotCut { reasons }, vec![key], None)
}

/// Warns that the time was over after so many kits; after none, the warning speaks of the plan.
pub(super) fn time_up(kits: usize) -> Warning {
    Warning::new(Cause::TimeUp { kits }, Vec::new(), None)
}

/// Reason why there is no kit where the time was over: the time that the first one needs, and what failed so
/// far.
pub(super) fn report_lateness(reason: &str, needed_s: Option<f64>) -> String {
    /// Step of the time that is told, s.
    const STEP_S: f64 = 10.0;
    let needed = needed_s.map_or_else(String::new, |s| {
        format!("; a kit takes about {:.0} s", (s / STEP_S).ceil() * STEP_S)
    });
    match reason {
        "" => format!("the time was over before a kit was made{needed}"),
        reason => format!("the time was over before a kit was made{needed}; so far {reason}"),
    }
}

/// Warns that a cut key has no rails.
fn without_rails(kit: &Kit, site: &KeySite) -> Warning {
    let key = kit.plan.key();
    Warning::new(
        Cause::KeyWithoutRails,
        vec![key],
        Some(site.prism.origin.to_array()),
    )
}

/// Warns of pieces with sheets that may break off or slots that may fuse.
fn thin_in_all(thin: &IdVec<PatchId, Vec<ThinFeature>>) -> Option<Warning> {
    let all = || thin.as_slice().iter().flatten();
    let longest = all().max_by(|a, b| a.length_mm.total_cmp(&b.length_mm))?;
    let n_sheets = all().filter(|place| place.kind == ThinKind::Sheet).count();
    Some(Warning::new(
        Cause::ThinPlaces {
            n_sheets,
            n_slots: all().count() - n_sheets,
            longest_mm: longest.length_mm,
            thickness_mm: longest.thickness_mm,
            is_slot: longest.kind == ThinKind::Slot,
        },
        thin.iter()
            .filter(|(_, places)| !places.is_empty())
            .map(|(p, _)| p)
            .collect(),
        Some(longest.at),
    ))
}

impl PrintedFit {
    fn of(ctx: &Ctx, kit: &Kit, gaps: &KitGaps) -> Result<Self, Cancelled> {
        let within_mm = fits_within_mm(kit, gaps);
        let tried_mm = within_mm.filter(|mm| *mm > 0.0 && kit.verification.has_passed());
        let loosest = tried_mm.map(|mm| {
            let plays = play::printed_thin(ctx, &kit.pieces, &kit.play, mm)?;
            let plays = plays
                .iter()
                .map(|(piece, play)| (piece, play.unwrap_or(Play::ENDLESS)));
            Ok(plays.max_by(|a, b| a.1.translation_mm.total_cmp(&b.1.translation_mm)))
        });
        Ok(Self {
            within_mm,
            loosest: loosest.transpose()?.flatten(),
        })
    }
}

/// Returns half of the least gap between pieces that do not press on purpose, mm.
fn fits_within_mm(kit: &Kit, gaps: &KitGaps) -> Option<f64> {
    let (key, presses) = (kit.plan.key(), !kit.press_fits.is_empty());
    let is_pressed = |a: PatchId, b: PatchId| presses && (a == key || b == key);
    let at_rest = gaps
        .pairs
        .iter()
        .filter(|p| !is_pressed(p.a, p.b))
        .map(|p| p.overall.gap_mm);
    let on_ways = gaps
        .paths
        .iter()
        .filter(|p| !is_pressed(p.piece, p.against))
        .map(|p| p.overall.gap_mm);
    at_rest
        .chain(on_ways)
        .min_by(f64::total_cmp)
        .map(|gap_mm| 0.5 * gap_mm)
}

/// Warns of the deepest crossing of finished pieces, on a way out or at rest, unless it is a key
/// with press fits that crosses.
fn crossing_warning(kit: &Kit, gaps: &KitGaps) -> Option<Warning> {
    /// Least depth that is not rounding, mm.
    const LEAST_MM: f64 = 0.02;
    let deepest = gaps
        .paths
        .iter()
        .min_by(|a, b| a.overall.gap_mm.total_cmp(&b.overall.gap_mm))?;
    let place = deepest.overall;
    let is_meant = deepest.piece == kit.plan.key() && !kit.press_fits.is_empty();
    (place.gap_mm < -LEAST_MM && !is_meant).then(|| {
        Warning::new(
            Cause::SurfacesCross {
                by_mm: -place.gap_mm,
                after_mm: place.travel_mm,
            },
            vec![deepest.piece, deepest.against],
            Some(place.at),
        )
    })
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
    /// Too little of the model can be hollow.
    #[error(transparent)]
    TooThin(#[from] TooThin),
    /// Connectors have no room behind the thinnest walls.
    #[error(transparent)]
    NoRoom(#[from] NoRoom),
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
    BodyError => Body,
    ChoiceError => Choice,
    PieceError => Piece,
}

/// Describes the faults of a kit that fails these checks, each once.
fn plainly(checks: &[String]) -> String {
    let mut words: Vec<&str> = Vec::new();
    for check in checks {
        let word = match check.as_str() {
            "pieces sit within their play" => "a piece would rattle",
            "every piece but the key is blocked"
            | "no cluster but the key slides (translations)"
            | "nothing but the key moves (6 dof)"
            | "no piece can be worked out by hand" => "pieces would come loose",
            "outer surface kept" => "some of the outer surface would be lost",
            "every installation path is free" => "a piece would rub on its way in",
            "assembled pieces do not overlap" => "pieces would overlap",
            other => other,
        };
        if !words.contains(&word) {
            words.push(word);
        }
    }
    words.join(", ")
}

#[cfg(test)]
mod tests {
    use super::plainly;

    #[test]
    fn checks_that_mean_the_same_are_told_once() {
        let failed = [
            "every piece but the key is blocked",
            "nothing but the key moves (6 dof)",
            "a new one",
        ];
        let failed: Vec<String> = failed.map(String::from).into();
        assert_eq!(plainly(&failed), "pieces would come loose, a new one");
    }
}

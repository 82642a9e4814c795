//! How a job ends.

use shellock_geom::TriMesh;

use super::attempt::Failure;
use super::budget::RATTLING_KEYS;
use super::candidate::{self, Candidate};
use super::{Effort, Explored, Job, KeySource, Kit, Planned, Settings};
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
use crate::{Cancelled, Cause, Ctx, IdVec, PatchId, Warning};

/// A finished kit and the wall that it is made of. All places are those of the model as it was given.
#[non_exhaustive]
pub struct Design {
    /// The pieces, their plan and the verdict on them.
    pub kit: Kit,
    /// Parameters of the stages that made it, for its own wall and division. Those that only a cut key has are left out.
    pub settings: Settings,
    /// How its key was cut; `None` where the key is one of the pieces.
    pub key: Option<KeySite>,
    /// What the wall bears; `None` where the stress could not be computed, which is warned of.
    pub strength: Option<Strength>,
    /// How near pieces come, at rest and on their way.
    pub gaps: KitGaps,
    /// How far faces may stand out as they are printed, and what becomes of the play where they stand back.
    pub fit: PrintedFit,
    /// Where each piece is too thin to print well, the longest place first.
    pub thin: IdVec<PatchId, Vec<ThinFeature>>,
    /// Cost of the whole job, with all that was tried in vain.
    pub effort: Effort,
    /// What the user should know about this kit; kits that were given up keep their warnings to themselves.
    pub warnings: Vec<Warning>,
}

/// What a printer's error does to a kit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PrintedFit {
    /// How far printed faces may stand out, each on its side, mm: half of the least gap between two pieces, at
    /// rest and on any way out, but for a key's ribs or bumps, which are to press. ≤ 0 where surfaces cross;
    /// `None` where no two pieces come near.
    pub within_mm: Option<f64>,
    /// The piece that rattles most where all faces stand back by as much, and how far, for small motions; play
    /// without end where it comes loose. `None` for kits that fail anyway.
    pub loosest: Option<(PatchId, Play)>,
}

/// How the job ended.
pub enum DesignOutcome {
    /// There is a kit. Whether it passed is in its verification.
    Made(Box<Design>),
    /// No plan was found for any division that was tried.
    NoPlan {
        /// Why, for people.
        reason: String,
        /// Who is in whose way.
        blockers: Vec<Blocker>,
        /// Whether the time was over before all was tried: with more of it one may be found.
        is_cut_short: bool,
    },
}

/// Reason why there is no plan.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct NoPlan {
    /// Reason, for people.
    pub reason: String,
    /// True where the time was over before all keys were tried: with more of it one may be found.
    pub is_cut_short: bool,
}

/// Adds to a plan, or to the reason why there is none, that the time was over.
pub(super) fn conclude_plan(planned: Result<Planned, String>, is_cut_short: bool) -> Result<Planned, NoPlan> {
    match planned {
        Ok(mut planned) => {
            planned.warnings.extend(is_cut_short.then(|| time_up(0)));
            Ok(planned)
        }
        Err(reason) => Err(NoPlan {
            reason: if is_cut_short {
                report_lateness(&reason)
            } else {
                reason
            },
            is_cut_short,
        }),
    }
}

impl DesignOutcome {
    pub(super) fn kit(&self) -> Option<&Kit> {
        match self {
            Self::Made(design) => Some(&design.kit),
            Self::NoPlan { .. } => None,
        }
    }

    /// Whether it has a kit where the other has none, or a better one.
    pub(super) fn is_better_than(&self, other: &Self) -> bool {
        let is_better = |kit: &Kit| other.kit().is_none_or(|other| kit.is_better_than(other));
        self.kit().is_some_and(is_better)
    }
}

/// The best kit so far, and why the keys that were cut did not do.
#[derive(Default)]
pub(super) struct Best<'a> {
    kit: Option<Kept<'a>>,
    /// Why keys that were cut fail, for people.
    reasons: Vec<String>,
    /// How many of their kits fail by pieces that rattle alone.
    n_rattling: usize,
    /// Why there is no plan where a piece is the key.
    failure: Failure,
}

/// A kit and what it was made for.
struct Kept<'a> {
    kit: Kit,
    candidate: Candidate<'a>,
}

impl<'a> Best<'a> {
    pub fn has_kit(&self) -> bool {
        self.kit.is_some()
    }

    /// Whether a key at `place` need not be tried. A piece as it is rattles no less as the key than one that
    /// was cut.
    pub fn is_enough(&self, place: Option<&KeySite>) -> bool {
        let is_enough = |kit: &Kit| kit.is_firm() || (place.is_none() && kit.only_rattles());
        let rattles = place.is_some() && self.n_rattling == RATTLING_KEYS;
        rattles || self.kit.as_ref().is_some_and(|kept| is_enough(&kept.kit))
    }

    /// Keeps the kit of a candidate where it is better; says why it will not do. What goes wrong with a key
    /// that is cut need not with another.
    pub fn add(
        &mut self,
        ctx: &Ctx,
        place: Option<&KeySite>,
        candidate: Candidate<'a>,
        explored: Result<Explored, DesignError>,
    ) -> Result<(), DesignError> {
        let Some(site) = place else {
            let Explored { kit, failure, .. } = match explored {
                Err(e) if self.kit.is_some() && !matches!(e, DesignError::Cancelled(_)) => {
                    // A kit with a key that was cut is there, if it fails.
                    ctx.note(&format!("with a piece as the key it cannot be made: {e}"));
                    return Ok(());
                }
                explored => explored?,
            };
            self.failure = failure;
            if let Some(kit) = kit {
                self.keep(kit, candidate);
            }
            return Ok(());
        };
        let words = candidate::words(site);
        let reason = match explored {
            Err(DesignError::Cancelled(stop)) => return Err(stop.into()),
            Err(e) => format!("{words} cannot be made: {e}"),
            Ok(Explored {
                kit: None, failure, ..
            }) => {
                format!("{words}: no plan, as {}", failure.reason)
            }
            Ok(Explored { kit: Some(kit), .. }) => {
                let failed = kit.failures();
                // Where other pieces than the key rattle, another key changes little.
                self.n_rattling += usize::from(kit.only_rattles() && !kit.rattling().is_empty());
                self.keep(kit, candidate);
                if failed.is_empty() {
                    return Ok(());
                }
                format!("{words}: {}", plainly(&failed))
            }
        };
        ctx.note(&reason);
        self.reasons.push(reason);
        Ok(())
    }

    /// Keeps the kit where it is better than the best before; of equals the earlier stays.
    fn keep(&mut self, kit: Kit, candidate: Candidate<'a>) {
        if self.kit.as_ref().is_none_or(|b| kit.is_better_than(&b.kit)) {
            self.kit = Some(Kept { kit, candidate });
        }
    }

    /// The best kit with all that is known of it, after so much `effort`.
    pub fn finished(self, ctx: &Ctx, job: &Job<'_>, effort: Effort) -> Result<DesignOutcome, DesignError> {
        let Self {
            kit,
            mut reasons,
            failure: Failure { reason, blockers, .. },
            ..
        } = self;
        let Some(Kept { kit, candidate }) = kit else {
            return Ok(DesignOutcome::NoPlan {
                reason,
                blockers,
                is_cut_short: false,
            });
        };
        let key = candidate.key.map(|key| key.given);
        let gaps = kit_gaps(
            ctx,
            Some(job.model),
            &kit.pieces,
            &kit.plan,
            job.settings().body.rim_mm,
        )?;
        let fit = PrintedFit::of(ctx, &kit, &gaps)?;
        let least_wall_mm = job.settings().connector.min_wall_mm;
        let thin = |mesh: &TriMesh| thin_places(mesh, least_wall_mm, LEAST_SLOT_MM);
        let thin: IdVec<PatchId, Vec<ThinFeature>> = kit.pieces.as_slice().iter().map(thin).collect();
        let ctx = ctx.fork();
        segmentation::tell(
            &ctx,
            &job.settings().segmentation,
            job.model,
            job.labels,
            &kit.surface,
        )?;
        let mut warnings = ctx.into_warnings();
        warnings.extend(kit.warnings.iter().cloned());
        warnings.extend(job.wall.warnings.iter().cloned());
        warnings.extend(crossing(&kit, &gaps));
        warnings.extend(thin_in_all(&thin));
        match &key {
            Some(key) if kit.rails_mm() <= 0.0 => warnings.push(without_rails(&kit, key)),
            None if job.params.key.is_cut() => {
                if reasons.is_empty() {
                    reasons.push(match job.params.key {
                        KeySource::CutNear(_) => {
                            "the surface is not flat, free and thick enough near the place that you chose"
                                .into()
                        }
                        _ => "nowhere is the surface flat, free and thick enough to cut one".into(),
                    });
                }
                warnings.push(not_cut(&kit, reasons));
            }
            _ => {}
        }
        let strength = job.wall.strength.clone();
        Ok(DesignOutcome::Made(Box::new(Design {
            kit,
            settings: job.settings().clone(),
            key,
            strength,
            gaps,
            fit,
            thin,
            effort,
            warnings,
        })))
    }
}

/// Says why a piece as it is became the key.
fn not_cut(kit: &Kit, reasons: Vec<String>) -> Warning {
    let key = kit.plan.key();
    Warning {
        cause: Cause::KeyNotCut { reasons },
        pieces: vec![key],
        at: None,
    }
}

/// Warns that the time was over after so many kits; after none, the warning speaks of the plan.
pub(super) fn time_up(kits: usize) -> Warning {
    Warning {
        cause: Cause::TimeUp { kits },
        pieces: Vec::new(),
        at: None,
    }
}

/// Says in a reason that the time was over.
pub(super) fn report_lateness(reason: &str) -> String {
    match reason {
        "" => "the time was over (--time)".to_owned(),
        reason => format!("the time was over (--time); {reason}"),
    }
}

/// Says that a key slides on nothing.
fn without_rails(kit: &Kit, site: &KeySite) -> Warning {
    let key = kit.plan.key();
    Warning {
        cause: Cause::KeyWithoutRails,
        pieces: vec![key],
        at: Some(site.prism.origin.to_array()),
    }
}

/// Says which pieces have sheets that may break off or slots that may fuse.
fn thin_in_all(thin: &IdVec<PatchId, Vec<ThinFeature>>) -> Option<Warning> {
    let all = || thin.as_slice().iter().flatten();
    let longest = all().max_by(|a, b| a.length_mm.total_cmp(&b.length_mm))?;
    let n_sheets = all().filter(|place| place.kind == ThinKind::Sheet).count();
    Some(Warning {
        cause: Cause::ThinPlaces {
            n_sheets,
            n_slots: all().count() - n_sheets,
            longest_mm: longest.length_mm,
            thickness_mm: longest.thickness_mm,
            is_slot: longest.kind == ThinKind::Slot,
        },
        pieces: thin
            .iter()
            .filter(|(_, places)| !places.is_empty())
            .map(|(p, _)| p)
            .collect(),
        at: Some(longest.at),
    })
}

impl PrintedFit {
    fn of(ctx: &Ctx, kit: &Kit, gaps: &KitGaps) -> Result<Self, Cancelled> {
        let within_mm = fits_within_mm(kit, gaps);
        let tried_mm = within_mm.filter(|mm| *mm > 0.0 && kit.verification.passed());
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

/// Half of the least gap that is to be one, mm.
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

/// Says where finished pieces cross that are not meant to press: on a way out, or at rest.
fn crossing(kit: &Kit, gaps: &KitGaps) -> Option<Warning> {
    /// Less is rounding, mm.
    const LEAST_MM: f64 = 0.02;
    let deepest = gaps
        .paths
        .iter()
        .min_by(|a, b| a.overall.gap_mm.total_cmp(&b.overall.gap_mm))?;
    let place = deepest.overall;
    let is_meant = deepest.piece == kit.plan.key() && !kit.press_fits.is_empty();
    (place.gap_mm < -LEAST_MM && !is_meant).then(|| Warning {
        cause: Cause::SurfacesCross {
            by_mm: -place.gap_mm,
            after_mm: place.travel_mm,
        },
        pieces: vec![deepest.piece, deepest.against],
        at: Some(place.at),
    })
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
    /// Hardly anything of it can be hollow.
    #[error(transparent)]
    TooThin(#[from] TooThin),
    /// Connectors have no room behind the thinnest walls.
    #[error(transparent)]
    NoRoom(#[from] NoRoom),
    /// No triangle has the label that the key is to have.
    #[error("no part of the model has the label {0}, which the key is to have (--key)")]
    NoLabelOfKey(i64),
    /// No piece has the number that the key is to have.
    #[error("there is no piece {0} to be the key (--key): the model is divided into pieces 1 to {1}")]
    NoPieceOfKey(i64, usize),
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

/// What is wrong with a kit that fails these checks, in words: each once.
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

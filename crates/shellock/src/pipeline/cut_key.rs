//! Kits whose key is cut out of the surface.

use std::borrow::Cow;

use super::rounds::{is_better, only_rattles, rattling};
use super::{Design, DesignError, DesignOutcome, Job, Laid, Params};
use crate::key::{self, KeyParams, KeyPrism, KeySite};
use crate::piece::Grip;
use crate::segmentation::SegmentationError;
use crate::{Ctx, LatticeDirection, PatchId, SegmentedSurface, Warning, segmentation};

/// Kits that are made for each of the best places for a key, before one of the pieces becomes the key: where the best does not do,
/// others seldom do.
const MOST_KITS: [usize; 3] = [3, 2, 2];
/// Keys whose kits fail by pieces that rattle alone before no others are tried.
const MOST_RATTLING: usize = 2;
/// Kits made for one segmentation, and mendings of it.
const MOST_KITS_EACH: usize = 2;
const MOST_MENDINGS: usize = 1;

/// A place for a key in assembly space.
pub(super) struct CutKey {
    pub site: KeySite,
    along: LatticeDirection,
}

impl CutKey {
    /// A notch across the key, nearer to its front.
    fn grip(&self) -> Grip {
        /// Of its length.
        const FROM_BACK: f64 = 0.65;
        let prism = self.site.prism;
        let KeyPrism { origin, slide, normal, .. } = prism;
        // Which piece the key is the plan says.
        Grip { key: PatchId(0), at: origin + FROM_BACK * prism.length_mm() * slide, slide, normal }
    }

    /// The surface with the key as a patch, which `params` then name; `None` where it does not come out as one piece.
    ///
    /// Where the key leaves a piece hanging on another, the pieces are mended first.
    pub(super) fn cut(
        &self,
        ctx: &Ctx,
        params: &mut Params,
        surface: SegmentedSurface,
    ) -> Result<Option<SegmentedSurface>, SegmentationError> {
        let faults = |s: &SegmentedSurface| {
            let p = &params.segmentation;
            s.contact_graph_below(p.wall_mm, p.least_contact_mm).n_faults()
        };
        let Some(mut best) = key::imprint(&surface, &self.site.prism) else { return Ok(None) };
        if faults(&best.0) > 0
            && let Some(mended) = segmentation::mended_again(ctx, &params.segmentation, &best.0)?
            && let Some(again) = key::imprint(&mended, &self.site.prism)
            && faults(&again.0) < faults(&best.0)
        {
            best = again;
        }
        params.plan.key = Some(best.1);
        params.plan.key_slide = Some(self.along);
        params.body.key_gap_mm = Some(params.body.wall_gap_mm.max(0.5 * params.connector.key_clearance_mm));
        params.grip = params.has_grip.then(|| self.grip());
        Ok(Some(best.0))
    }
}

/// The best kit whose key was cut, and why none passed.
#[derive(Default)]
pub(super) struct Cut {
    pub best: Option<Design>,
    /// What failed, for people; empty where nothing was tried.
    reasons: Vec<String>,
}

impl Cut {
    /// The better of this kit and that of `outcome`, whose key is one of the pieces; it is told that no key was cut.
    pub(super) fn compared_with(self, mut outcome: DesignOutcome) -> DesignOutcome {
        let failures = |d: &Design| d.verification.checks.iter().filter(|c| !c.ok).count();
        match (self.best, &mut outcome) {
            (Some(best), DesignOutcome::Made(other)) if failures(&best) < failures(other) => {
                DesignOutcome::Made(Box::new(best))
            }
            (Some(best), DesignOutcome::NoPlan { .. }) => DesignOutcome::Made(Box::new(best)),
            (_, DesignOutcome::Made(design)) if !self.reasons.is_empty() => {
                let key = design.plan.key();
                design.warnings.push(Warning {
                    code: "key-not-cut".into(),
                    message: format!("piece {key} is the key as it is, without rails: {}", self.reasons.join("; ")),
                    pieces: vec![key],
                    at: None,
                });
                outcome
            }
            _ => outcome,
        }
    }
}

/// Makes kits with keys cut at the best places, until one passes.
pub(super) fn design(ctx: &Ctx, job: &Job<'_>) -> Result<Cut, DesignError> {
    let mut cut = Cut::default();
    let mut n_rattling = 0;
    let mut params = job.params.clone();
    params.rounds.kits = params.rounds.kits.min(MOST_KITS_EACH);
    params.rounds.mendings = params.rounds.mendings.min(MOST_MENDINGS);
    let sites = key::sites(ctx, &key_params(job), job.surface)?;
    if sites.is_empty() {
        cut.reasons.push("nowhere is the surface flat, free and thick enough to cut one".into());
    }
    for (site, most_kits) in sites.iter().zip(MOST_KITS) {
        ctx.note(&told(site));
        params.rounds.kits_in_all = job.params.rounds.kits_in_all.min(most_kits);
        let Some((laid, key)) = laid(job, site) else { continue };
        let reason = match job.kit(ctx, &params, &laid, Some(&key)) {
            Err(DesignError::Cancelled(stop)) => return Err(stop.into()),
            // What goes wrong with this key need not with another.
            Err(e) => format!("with {} it cannot be made: {e}", told(site)),
            Ok(DesignOutcome::Made(mut made)) => {
                let failed: Vec<String> =
                    made.verification.checks.iter().filter(|c| !c.ok).map(|c| c.name.clone()).collect();
                if made.rails_mm() <= 0.0 {
                    made.warnings.push(without_rails(&made, site));
                }
                if failed.is_empty() {
                    return Ok(Cut { best: Some(*made), reasons: Vec::new() });
                }
                let reason = format!("with {} it fails: {}", told(site), failed.join(", "));
                // Where other pieces than the key rattle, another key changes little: one more is tried.
                n_rattling += usize::from(only_rattles(&made) && !rattling(&made).is_empty());
                if cut.best.as_ref().is_none_or(|best| is_better(&made, best)) {
                    cut.best = Some(*made);
                }
                if n_rattling == MOST_RATTLING {
                    cut.reasons.push(reason);
                    break;
                }
                reason
            }
            Ok(DesignOutcome::NoPlan { reason, .. }) => format!("with {} there is no plan: {reason}", told(site)),
        };
        ctx.note(&reason);
        cut.reasons.push(reason);
    }
    Ok(cut)
}

/// Says that a key slides on nothing.
fn without_rails(made: &Design, site: &KeySite) -> Warning {
    let key = made.plan.key();
    Warning {
        code: "key-without-rails".into(),
        message: format!(
            "piece {key} is the key, but nothing straight runs under its sides: it slides along its plane without rails and is held by \
             its other connectors"
        ),
        pieces: vec![key],
        at: Some(made.turn.apply(site.prism.origin).to_array()),
    }
}

/// A site in words.
fn told(site: &KeySite) -> String {
    let (s, [x, y, z]) = (site.prism.slide, site.prism.origin.to_array());
    format!(
        "a key of {:.0} mm² cut at ({x:.0}, {y:.0}, {z:.0}) mm, sliding along ({:.2}, {:.2}, {:.2}), {:.0} % flat, straight along its sides for {:.0} mm",
        site.area_mm2,
        s.x,
        s.y,
        s.z,
        100.0 * site.flat_share,
        site.rail_mm
    )
}

fn key_params(job: &Job<'_>) -> KeyParams {
    let params = job.params;
    KeyParams {
        seed: params.segmentation.seed,
        wall_mm: params.body.thickness_mm,
        size_mm: params.connector.size.usual_mm(),
        piece_mm2: job.surface.mesh.area() / job.surface.n_patches as f64,
        up: params.plan.up,
    }
}

/// The model turned so that the key's slide is a lattice direction; `None` where rounding leaves no solid.
fn laid<'a>(job: &Job<'a>, site: &KeySite) -> Option<(Laid<'a>, CutKey)> {
    let (turn, along) = key::Turn::laying(site.prism.normal, site.prism.slide);
    let site = turn.site(site, along);
    let mut laid = Laid::of(job);
    if !turn.is_none() {
        laid.model = Cow::Owned(turn.solid(job.model).ok()?);
        laid.surface.mesh = turn.mesh(&laid.surface.mesh);
        laid.turn = turn;
    }
    Some((laid, CutKey { site, along }))
}

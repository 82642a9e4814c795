//! One kit: the finished pieces of a plan, and their verification.

use shellock_geom::{Solid, TriMesh};
use shellock_make::Parts;
use shellock_report::words;

use super::agenda::Grade;
use super::division::Division;
use super::{DesignError, Params};
use crate::body::{PatchDistances, ShellGrid};
use crate::connector::SeamRoom;
use crate::key::Turn;
use crate::metric::{Chosen, Deformed, Holding};
use crate::motion::{RelativePlay, SLIGHT};
use crate::piece::{FinishParams, FinishedJoint, PressFit};
use crate::plan::lesson::{self, Lesson};
use crate::plan::{Handover, PlanProof};
use crate::play::{KitPlay, Rattle};
use crate::verify::{self, Assembly, Finding, Verification};
use crate::{ConnectorSizes, Ctx, IdVec, InstallationPlan, PatchId, SegmentedSurface, Warning};

/// Finished pieces of a plan, with their verification and measurements. Places and directions are in the
/// space of the model as given. Pieces are numbered in the order of installation.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Kit {
    /// Segmented surface that the pieces were made from.
    pub surface: SegmentedSurface,
    /// Connector size of each pair of pieces.
    pub sizes: ConnectorSizes,
    /// Order and directions of installation.
    pub plan: InstallationPlan,
    /// Proven bound of the plan's cost.
    pub proof: PlanProof,
    /// Load factors and weak places, by simulation.
    pub holding: Holding,
    /// Motion of the pieces under each reported load, by simulation.
    pub deformation: Deformed,
    /// Thickness of the walls, mm.
    pub thickness_mm: f64,
    /// One printable mesh per piece, in assembled position, mm.
    pub pieces: IdVec<PatchId, TriMesh>,
    /// Connector runs after carving, with the lengths that are left.
    pub joints: Vec<FinishedJoint>,
    /// Features that press on purpose on the key's way in.
    pub press_fits: Vec<PressFit>,
    /// Room for connectors on each seam.
    pub contacts: Vec<SeamRoom>,
    /// Checks of the finished meshes, with their findings.
    pub verification: Verification,
    /// Contacts between the finished pieces.
    pub touches: Vec<verify::contact::Contact>,
    /// Play of the finished pieces: motion within their gaps.
    pub play: KitPlay,
    /// Pieces that rattle, the loosest first.
    pub rattles: Vec<Rattle>,
    /// Warnings of the stages that made the kit.
    pub warnings: Vec<Warning>,
    /// Map from the kit's pieces to the patches that they were made of.
    pub(super) handover: Handover,
}

impl Kit {
    /// Length of the rails that the key slides on, mm; 0 if it has none.
    pub fn rails_mm(&self) -> f64 {
        self.joints
            .iter()
            .filter(|j| j.is_rail)
            .map(|j| j.length_mm)
            .fold(0.0, |sum, mm| sum + mm)
    }

    /// Names of the checks that the kit fails.
    pub fn failures(&self) -> Vec<String> {
        self.verification
            .checks
            .iter()
            .filter(|c| !c.ok)
            .map(|c| c.name.clone())
            .collect()
    }

    /// The fault of a kit that is not firm, in words.
    pub(super) fn fault(&self) -> Option<String> {
        let failures = self.failures();
        if !failures.is_empty() {
            return Some(format!("it fails \"{}\"", failures.join("\", \"")));
        }
        let loose: Vec<PatchId> = self.rattles.iter().map(|r| r.piece).collect();
        let verb = words::plural(loose.len(), "rattles", "rattle");
        (!loose.is_empty()).then(|| format!("it passes, but {} {verb}", words::pieces(&loose)))
    }

    /// Returns true if the kit passed its verification and no piece rattles more than slightly.
    pub fn is_firm(&self) -> bool {
        self.verification.has_passed() && self.strong_rattles().next().is_none()
    }

    /// Rattles that are worth another kit, the loosest first.
    fn strong_rattles(&self) -> impl Iterator<Item = &Rattle> {
        self.rattles.iter().filter(|rattle| rattle.excess > SLIGHT)
    }

    /// Finished pieces and their plan, as an assembly of `model`.
    pub(super) fn assembly<'a>(&'a self, model: &'a Solid) -> Assembly<'a> {
        Assembly {
            model: Some(model),
            pieces: &self.pieces,
            plan: &self.plan,
            press_fits: &self.press_fits,
        }
    }

    /// Returns true if the time was over before ways out were sought that a proof does not rule out.
    pub(super) fn is_hurried(&self) -> bool {
        self.verification.has_passed() && self.play.ways_out.is_none()
    }

    /// Returns true if rattling is the only fault: a piece rattles more than slightly, and either no check
    /// fails, or one fails and all findings are of play that is too wide.
    pub fn only_rattles(&self) -> bool {
        let is_rattle = |f: &Finding| matches!(f, Finding::PlayTooWide { .. });
        let n_failures = self.failures().len();
        let findings = &self.verification.findings;
        let is_all = n_failures == 0 || (n_failures == 1 && findings.iter().all(is_rattle));
        is_all && self.strong_rattles().next().is_some()
    }

    /// Returns the lessons of a kit that failed, in patches of its division. The last one rejects its plan.
    pub(super) fn lessons(&self) -> Vec<Lesson> {
        let weak = || shellock_make::weak_joints(&self.handover, &self.sizes, &self.contacts, &self.joints);
        lesson::of_kit(&self.verification, &self.handover, &self.surface, weak)
    }

    /// Pieces other than the key that rattle more than slightly, the loosest first. The key is left out
    /// because it is cut where there is room for it.
    pub fn rattling_pieces(&self) -> Vec<RelativePlay> {
        let of_piece = |r: &Rattle| RelativePlay {
            piece: r.piece,
            excess: r.excess,
        };
        let others = self.strong_rattles().filter(|r| r.piece != self.plan.key());
        others.map(of_piece).collect()
    }

    /// Returns the grade by which kits are compared.
    pub(super) fn grade(&self) -> Grade {
        Grade {
            n_pieces: self.pieces.len(),
            n_failures: self.failures().len(),
            rattle: self.rattles.first().map_or(0.0, |r| r.excess),
            only_rattles: self.only_rattles(),
            others_rattle: !self.rattling_pieces().is_empty(),
        }
    }
}

/// Inputs of a kit, each from an earlier stage.
pub(super) struct Recipe<'a> {
    pub params: &'a Params,
    pub division: &'a Division,
    /// Model as given, before `turn` turns it for the division.
    pub model: &'a Solid,
    pub turn: &'a Turn,
    /// Grid of the wall, with room for the division's largest connectors.
    pub grid: &'a ShellGrid,
    pub distances: &'a PatchDistances,
    pub choice: Chosen,
}

/// Makes and verifies the kit of one plan. `ctx` holds the warnings collected while planning. `change` sees
/// the plan and its parts; what it returns is returned in place of a kit, and no pieces are finished.
pub(super) fn make<T>(
    ctx: Ctx<'_>,
    recipe: Recipe<'_>,
    change: impl FnOnce(&Handover, &Parts) -> Result<Option<T>, DesignError>,
) -> Result<Result<Kit, T>, DesignError> {
    let Recipe { division, choice, .. } = recipe;
    let (surface, settings) = (&division.surface, &division.settings);
    let (sizes, proof) = (&division.sizes.sizes, choice.search_result.proof());
    let handover = Handover::new(recipe.turn, choice.search_result.plan);
    let of_pieces = shellock_make::Recipe {
        body: &settings.body,
        finish: FinishParams {
            connector: &settings.connector,
            relief: settings.relief(),
            rim_mm: settings.body.rim_mm,
            grip: division.grip,
            label: recipe.params.label,
            turn: *handover.turn(),
        },
        surface,
        sizes,
        grid: recipe.grid,
        distances: recipe.distances,
        plan: handover.found_plan(),
        key_slide: settings.plan.key.and(settings.plan.key_slide),
    };
    let parts = shellock_make::make_parts(&ctx, &of_pieces)?;
    if let Some(changed) = change(&handover, &parts)? {
        return Ok(Err(changed));
    }
    let made = shellock_make::join_parts(&ctx, &of_pieces, parts)?;
    let (finished, plan) = (made.0.hand_over(&handover), handover.plan());
    // The verdict, from the finished meshes alone.
    let judging = ctx.fork();
    let assembly = Assembly {
        model: Some(recipe.model),
        pieces: &finished.meshes,
        plan: &plan,
        press_fits: &finished.press_fits,
    };
    let judged = shellock_assembly::judge(&judging, &settings.verify, &settings.play, &assembly)?;
    let mut warnings = handover.warnings(ctx.into_warnings());
    warnings.extend(judging.into_warnings());
    warnings.extend(judged.warnings());
    Ok(Ok(Kit {
        surface: handover.surface(surface),
        sizes: handover.sizes(sizes),
        plan,
        proof: handover.proof(proof),
        holding: choice.holding.hand_over(&handover),
        deformation: choice.deformation.hand_over(&handover),
        thickness_mm: settings.body.thickness_mm,
        pieces: finished.meshes,
        joints: finished.joints,
        press_fits: finished.press_fits,
        contacts: made.1.into_iter().map(|room| room.hand_over(&handover)).collect(),
        verification: judged.verification,
        touches: judged.contacts,
        play: judged.play,
        rattles: judged.rattles,
        warnings,
        handover,
    }))
}

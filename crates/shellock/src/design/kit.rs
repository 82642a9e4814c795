//! One kit: the finished pieces of a plan, and their verification.

use shellock_geom::{Aabb, Solid, TriMesh};

use super::agenda::Grade;
use super::causes::Cause;
use super::division::Division;
use super::handover::Handover;
use super::{DesignError, Params, Settings};
use crate::body::{PatchDistances, ShellBodies, ShellGrid};
use crate::connector::{Run, SeamRoom, is_unobstructed};
use crate::key::Turn;
use crate::metric::{Chosen, Deformed, Holding};
use crate::piece::{FinishParams, Finished, FinishedJoint, PressFit, PressFitKind};
use crate::plan::{LatticePlan, PlanProof};
use crate::play::{self, KitPlay, Rattle};
use crate::sizes::CONTACT_SIZES;
use crate::verify::{self, Finding, Verification};
use crate::{
    ConnectorSizes, Ctx, IdVec, InstallationPlan, PatchId, SegmentedSurface, Warning, body, connector, piece,
};

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

    /// Returns true if the kit passed its verification and no piece rattles.
    pub fn is_firm(&self) -> bool {
        self.verification.has_passed() && self.rattles.is_empty()
    }

    /// Returns true if the time was over before ways out were sought that a proof does not rule out.
    pub(super) fn is_hurried(&self) -> bool {
        self.verification.has_passed() && self.play.ways_out.is_none()
    }

    /// Returns true if rattling is the only fault: a piece rattles, and either no check fails, or one fails
    /// and all findings are of play that is too wide.
    pub fn only_rattles(&self) -> bool {
        let is_rattle = |f: &Finding| matches!(f, Finding::PlayTooWide { .. });
        let n_failures = self.failures().len();
        let findings = &self.verification.findings;
        let is_all = n_failures == 0 || (n_failures == 1 && findings.iter().all(is_rattle));
        is_all && !self.rattles.is_empty()
    }

    /// Pieces other than the key that rattle, the loosest first. The key is left out because it is cut
    /// where there is room for it.
    pub fn rattling_pieces(&self) -> Vec<PatchId> {
        let pieces = self.rattles.iter().map(|r| r.piece);
        pieces.filter(|piece| *piece != self.plan.key()).collect()
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

/// Makes and verifies the kit of one plan. `ctx` holds the warnings collected while planning.
pub(super) fn make(ctx: Ctx<'_>, recipe: Recipe<'_>) -> Result<Kit, DesignError> {
    let Recipe {
        params,
        division,
        model,
        turn,
        grid,
        distances,
        choice:
            Chosen {
                search_result: found,
                holding,
                deformation,
                ..
            },
    } = recipe;
    let Division {
        surface,
        settings,
        sizes: chosen,
        grip,
        ..
    } = division;
    let (sizes, proof) = (&chosen.sizes, found.proof());
    let handover = Handover::new(turn, found.plan);
    let plan = handover.found_plan();
    let rooms = rooms(settings, surface, sizes);
    // The wall, split along the plan.
    let shell = body::build(&ctx, &settings.body, grid, distances, plan, &rooms)?;
    // Connectors under its seams.
    let (runs, contacts) = connectors(settings, sizes, grid, &shell, plan);
    // Pieces, joined and carved.
    let finish = FinishParams {
        connector: &settings.connector,
        relief: settings.relief(),
        rim_mm: settings.body.rim_mm,
        grip: *grip,
        label: params.label,
        turn: *handover.turn(),
    };
    let made = piece::make(&ctx, &finish, grid, &shell, plan, &runs, &rooms)?;
    warn_of_press_fits(&ctx, &made);
    warn_of_bare_seams(&ctx, sizes, &contacts, &made.joints);
    let (finished, plan) = (handover.convert_pieces(made), handover.plan());
    // The verdict, from the finished meshes alone.
    let judging = ctx.fork();
    let judged = judge(&judging, settings, model, &finished, &plan)?;
    let warnings = judged.warnings(handover.warnings(ctx.into_warnings()), judging.into_warnings());
    Ok(Kit {
        surface: handover.surface(surface),
        sizes: handover.sizes(sizes),
        plan,
        proof: handover.proof(proof),
        holding: handover.convert_holding(holding),
        deformation: handover.convert_deformation(deformation),
        thickness_mm: settings.body.thickness_mm,
        pieces: finished.meshes,
        joints: finished.joints,
        press_fits: finished.press_fits,
        contacts: handover.rooms(contacts),
        verification: judged.verification,
        touches: judged.touches,
        play: judged.play,
        rattles: judged.rattles,
        warnings,
        handover,
    })
}

/// Places connectors along the seams. Returns their runs, and the room that each seam has for them.
fn connectors(
    settings: &Settings,
    sizes: &ConnectorSizes,
    grid: &ShellGrid,
    shell: &ShellBodies,
    plan: &LatticePlan,
) -> (Vec<Run>, Vec<SeamRoom>) {
    let curves = shell
        .inner
        .as_ref()
        .map_or(Vec::new(), |inner| connector::curves(grid, inner, plan));
    let is_free = is_unobstructed(&settings.connector, grid, shell);
    let runs_for = |slide| connector::runs(&settings.connector, sizes, plan, &curves, slide, &is_free);
    match settings.plan.key.and(settings.plan.key_slide) {
        Some(cut) => runs_for(Some(cut.unit())),
        // If one of the pieces is the key, it gets rails only if its seams happen to allow them.
        None => {
            let own = runs_for(plan.steps.last().map(|step| step.separation.unit()));
            if own.0.iter().any(Run::is_rail) {
                own
            } else {
                runs_for(None)
            }
        }
    }
}

/// Verification and play of the finished meshes.
struct Judged {
    verification: Verification,
    touches: Vec<verify::contact::Contact>,
    play: KitPlay,
    rattles: Vec<Rattle>,
}

impl Judged {
    /// Warnings of the making and of the judging, and those of the pieces' play.
    fn warnings(&self, of_making: Vec<Warning>, of_judging: Vec<Warning>) -> Vec<Warning> {
        let mut warnings = [of_making, of_judging].concat();
        warnings.extend(play::warning_of_rattles(&self.rattles));
        warnings.extend(play::warning(&self.play));
        warnings
    }
}

/// Verifies the finished meshes, and measures their contacts and play. The checks include those on play.
fn judge(
    ctx: &Ctx,
    settings: &Settings,
    model: &Solid,
    finished: &Finished,
    plan: &InstallationPlan,
) -> Result<Judged, DesignError> {
    let assembly = verify::Assembly {
        model: Some(model),
        pieces: &finished.meshes,
        plan,
        press_fits: &finished.press_fits,
    };
    let (mut verification, touching) = verify::examine(ctx, &settings.verify, &assembly)?;
    let mut measured = play::measure(ctx, &settings.play, &finished.meshes, plan)?;
    let size_mm = model.mesh().bounds().size().max_element();
    let rattles = play::rattles(&measured, &finished.meshes, size_mm, settings.verify.clearance_mm);
    verification.add(play::check(&measured, &rattles));
    if verification.has_passed() {
        // The search for ways out is slow, so kits that already fail are not searched.
        let clearance_mm = settings.verify.clearance_mm;
        match play::look_for_ways_out(ctx, clearance_mm, &finished.meshes, &mut measured) {
            // A kit outlives the end of the time in it, since it only confirms what holds.
            Err(_) if ctx.is_time_over() => ctx.warn(way_out_warning(&measured)),
            searched => searched?,
        }
        play::check_ways_out(&measured, &finished.meshes)
            .into_iter()
            .for_each(|check| verification.add(check));
    }
    Ok(Judged {
        verification,
        touches: touching,
        play: measured,
        rattles,
    })
}

/// Warning of pieces for which no way out was sought.
fn way_out_warning(play: &KitPlay) -> Warning {
    let key = play.slide.key;
    let pieces = play.unproven().filter(|piece| *piece != key).collect();
    Warning::new(Cause::WaysOutNotSought, pieces, None)
}

/// Warns of detents that the key must be pressed past, and of ribs that hold a key without rails.
fn warn_of_press_fits(ctx: &Ctx, finished: &Finished) {
    let of = |kind: PressFitKind| finished.press_fits.iter().filter(move |f| f.kind == kind);
    for d in of(PressFitKind::Detent) {
        ctx.warn(Warning::new(
            Cause::Detent {
                interference_mm: d.interference_mm,
                travel_mm: d.travel_mm,
            },
            vec![d.piece],
            Some(d.at),
        ));
    }
    if let Some(rib) = of(PressFitKind::Rib).next() {
        ctx.warn(Warning::new(
            Cause::KeyRibs {
                n: of(PressFitKind::Rib).count(),
                interference_mm: rib.interference_mm,
                travel_mm: rib.travel_mm,
            },
            vec![rib.piece],
            Some(rib.at),
        ));
    }
}

/// Warns of seams that have the length for a connector, but came out without one.
fn warn_of_bare_seams(ctx: &Ctx, sizes: &ConnectorSizes, contacts: &[SeamRoom], joints: &[FinishedJoint]) {
    let has_room = |c: &&SeamRoom| c.length_mm >= CONTACT_SIZES * sizes.of(c.later, c.earlier);
    for contact in contacts.iter().filter(has_room) {
        let pair = [contact.later, contact.earlier];
        let joins = |j: &&FinishedJoint| pair.contains(&j.male) && pair.contains(&j.female);
        if joints.iter().filter(joins).all(|j| j.length_mm == 0.0) {
            ctx.warn(Warning::new(
                Cause::SeamWithoutConnector {
                    length_mm: contact.length_mm,
                },
                pair.to_vec(),
                Some(contact.at.to_array()),
            ));
        }
    }
}

/// Returns a box around each patch and all connectors that its piece can have.
fn rooms(settings: &Settings, surface: &SegmentedSurface, sizes: &ConnectorSizes) -> IdVec<PatchId, Aabb> {
    /// Upper bound of the shift of seams by carving, mm.
    const SHIFT_MM: f64 = 2.0;
    let mut rooms: IdVec<PatchId, Aabb> = IdVec::from_fn(surface.n_patches, |_| Aabb::EMPTY);
    for (face, &p) in surface.patch_of_face.iter().enumerate() {
        rooms[p] = rooms[p].union(Aabb::around(surface.mesh.corners(face)));
    }
    let reach = settings.body.thickness_mm + settings.connector.room_mm(sizes.largest_mm()) + SHIFT_MM;
    rooms.as_slice().iter().map(|r| r.grown(reach)).collect()
}

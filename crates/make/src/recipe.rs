//! Pieces of a plan, in one call.

use std::collections::BTreeMap;

use shellock_assembly::motion::Contact;
use shellock_assembly::{LatticeDirection, PressFitKind};
use shellock_geom::Aabb;
use shellock_plan::lesson::{Lesson, WeakJoint};
use shellock_plan::sizes::{CONTACT_SIZES, ConnectorSizes};
use shellock_plan::{Handover, LatticePlan};
use shellock_report::{Cancelled, Ctx, IdVec, PatchId, Warning};
use shellock_surface::SegmentedSurface;
use shellock_surface::seam::rules::SHORTEST_RUN_SIZES;

use crate::body::{self, BodyError, BodyParams, PatchDistances, ShellBodies, ShellGrid};
use crate::causes::Cause;
use crate::connector::{self, Run, SeamRoom, is_unobstructed};
use crate::piece::{self, Connectors, FinishParams, Finished, FinishedJoint, PieceError};

/// Inputs of the pieces of a plan.
pub struct Recipe<'a> {
    /// Parameters of the wall and its split into shell bodies.
    pub body: &'a BodyParams,
    /// Parameters of connectors and of the finish.
    pub finish: FinishParams<'a>,
    /// Surface divided into the pieces.
    pub surface: &'a SegmentedSurface,
    /// Connector size of each pair of pieces.
    pub sizes: &'a ConnectorSizes,
    /// Grid of the wall, with room for the largest connectors.
    pub grid: &'a ShellGrid,
    /// Distances of the grid's nodes to the pieces.
    pub distances: &'a PatchDistances,
    /// Order and directions of installation.
    pub plan: &'a LatticePlan,
    /// Direction in which a cut key slides; `None` if the key is one of the pieces.
    pub key_slide: Option<LatticeDirection>,
}

/// Reason why the pieces of a plan cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum MakeError {
    /// The wall cannot be split.
    #[error(transparent)]
    Body(BodyError),
    /// A piece cannot be finished.
    #[error(transparent)]
    Piece(PieceError),
    /// The user asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<BodyError> for MakeError {
    fn from(e: BodyError) -> Self {
        match e {
            BodyError::Cancelled(stop) => stop.into(),
            other => Self::Body(other),
        }
    }
}

impl From<PieceError> for MakeError {
    fn from(e: PieceError) -> Self {
        match e {
            PieceError::Cancelled(stop) => stop.into(),
            other => Self::Piece(other),
        }
    }
}

/// Walls and connectors of a plan, before they are joined to pieces.
pub struct Parts {
    shell: ShellBodies,
    connectors: Connectors,
    /// Room for connectors on each seam.
    rooms: Vec<SeamRoom>,
    /// Places where the halves of connectors touch each other, each a clearance apart.
    pub contacts: Vec<Contact>,
}

/// Makes the parts of a plan: the wall, split along it, and connectors under the seams.
///
/// Warns of parts that a piece lost.
pub fn make_parts(ctx: &Ctx, recipe: &Recipe<'_>) -> Result<Parts, MakeError> {
    let Recipe {
        body,
        finish,
        surface,
        sizes,
        grid,
        distances,
        plan,
        ..
    } = recipe;
    let boxes = boxes(body, finish, surface, sizes);
    let shell = body::build(ctx, body, grid, distances, plan, &boxes)?;
    let (runs, rooms) = connectors(recipe, &shell);
    let connectors = Connectors::carve(ctx, finish.connector, grid, &shell, plan, &runs, &boxes)?;
    let contacts = connectors.contacts(finish.connector);
    Ok(Parts {
        shell,
        connectors,
        rooms,
        contacts,
    })
}

impl Parts {
    /// Pairs of pieces whose connectors are too short to hold them together, as a lesson for later plans;
    /// `sizes` are those of the division.
    pub fn weak_joints(&self, handover: &Handover, sizes: &ConnectorSizes) -> Option<Lesson> {
        let rooms: Vec<SeamRoom> = self
            .rooms
            .iter()
            .map(|room| room.clone().hand_over(handover))
            .collect();
        let joints: Vec<FinishedJoint> = self
            .connectors
            .joints()
            .map(|joint| joint.hand_over(handover))
            .collect();
        weak_joints(handover, &handover.sizes(sizes), &rooms, &joints)
    }
}

/// Joins the parts of a plan to finished meshes. Also returns the room for connectors on each seam.
///
/// Warns of a key without ribs, a notch or a number, of places that press on purpose, and of seams without a
/// connector.
pub fn join_parts(
    ctx: &Ctx,
    recipe: &Recipe<'_>,
    parts: Parts,
) -> Result<(Finished, Vec<SeamRoom>), MakeError> {
    let Recipe {
        finish,
        sizes,
        grid,
        plan,
        ..
    } = recipe;
    let finished = piece::make(ctx, finish, grid, &parts.shell, plan, &parts.connectors)?;
    warn_of_press_fits(ctx, &finished);
    warn_of_bare_seams(ctx, sizes, &parts.rooms, &finished.joints);
    Ok((finished, parts.rooms))
}

/// Places connectors along the seams. Returns their runs, and the room that each seam has for them.
fn connectors(recipe: &Recipe<'_>, shell: &ShellBodies) -> (Vec<Run>, Vec<SeamRoom>) {
    let Recipe {
        grid, plan, sizes, ..
    } = recipe;
    let params = recipe.finish.connector;
    let curves = shell
        .inner
        .as_ref()
        .map_or(Vec::new(), |inner| connector::curves(grid, inner, plan));
    let is_free = is_unobstructed(params, grid, shell);
    let runs_for = |slide| connector::runs(params, sizes, plan, &curves, slide, &is_free);
    match recipe.key_slide {
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
        if !joints.iter().any(|j| joins(&j)) {
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
fn boxes(
    body: &BodyParams,
    finish: &FinishParams<'_>,
    surface: &SegmentedSurface,
    sizes: &ConnectorSizes,
) -> IdVec<PatchId, Aabb> {
    /// Upper bound of the shift of seams by carving, mm.
    const SHIFT_MM: f64 = 2.0;
    let mut boxes: IdVec<PatchId, Aabb> = IdVec::from_fn(surface.n_patches, |_| Aabb::EMPTY);
    for (face, &p) in surface.patch_of_face.iter().enumerate() {
        boxes[p] = boxes[p].union(Aabb::around(surface.mesh.corners(face)));
    }
    let reach = body.thickness_mm + finish.connector.room_mm(sizes.largest_mm()) + SHIFT_MM;
    boxes.as_slice().iter().map(|b| b.grown(reach)).collect()
}

/// Finds pairs of pieces whose connectors came out too short to hold them together. Later plans must not rely
/// on them along the same direction. Pieces of seams and joints are those of the kit, in the order of
/// installation.
pub fn weak_joints(
    handover: &Handover,
    sizes: &ConnectorSizes,
    contacts: &[SeamRoom],
    joints: &[FinishedJoint],
) -> Option<Lesson> {
    let mut lengths: BTreeMap<[PatchId; 2], [f64; 2]> = BTreeMap::new();
    let by_order = |a: PatchId, b: PatchId| if a > b { [a, b] } else { [b, a] };
    for contact in contacts {
        let pair = by_order(contact.later, contact.earlier);
        lengths.entry(pair).or_default()[1] += contact.length_mm;
    }
    for joint in joints {
        let pair = by_order(joint.male, joint.female);
        lengths.entry(pair).or_default()[0] += joint.length_mm;
    }
    let is_short = |[a, b]: [PatchId; 2], length_mm: f64| length_mm < SHORTEST_RUN_SIZES * sizes.of(a, b);
    let weak: Vec<WeakJoint> = lengths
        .into_iter()
        .filter(|(pair, [length_mm, _])| is_short(*pair, *length_mm))
        .map(|(pair, [length_mm, seam_mm])| {
            let [later, earlier] = pair.map(|piece| handover.patch(piece));
            WeakJoint {
                later,
                earlier,
                separation: handover.found_plan().separation(later),
                length_mm,
                seam_mm,
            }
        })
        .collect();
    (!weak.is_empty()).then_some(Lesson::WeakJoints(weak))
}

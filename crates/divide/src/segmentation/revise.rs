//! Changes of a division after its plans or kits failed.

use shellock_geom::{Solid, Topology};
use shellock_report::{Ctx, PatchId};
use shellock_surface::SegmentedSurface;
use shellock_surface::seam::graph::Adjacency;

use super::ground::Ground;
use super::mirror::Twins;
use super::refine::refine_on;
use super::smooth::smooth_and_cut;
use super::split::split_between_regions;
use super::{FaceLabels, SegmentationError, SegmentationParams, has_short_contacts, kept_limit_mm};

/// Pieces joined at once; more would change too much of the structure.
const MOST_JOINED: usize = 2;

/// Changes pieces after a failure; `None` if nothing can be changed.
///
/// Dividing one of the `suspects`, most promising first, keeps the user's labels, so it comes first. Pieces
/// that came `loose` where seams are short would only get shorter seams: they are joined to a neighbour, as
/// are their `twins`.
pub fn revise(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    suspects: &[PatchId],
    loose: &[PatchId],
    twins: &Twins,
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    if !loose.is_empty() && has_short_contacts(params, surface) {
        let joined = join(ctx, params, surface, loose, twins)?;
        if joined.is_some() {
            return Ok(joined);
        }
    }
    first(suspects, |piece| divide(ctx, params, surface, piece))
}

/// Joins the first two of `pieces` to neighbours, and their `twins` likewise. If that leaves nothing to lock,
/// the twins stay; `None` if nothing is left to lock even so.
pub fn join(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    pieces: &[PatchId],
    twins: &Twins,
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    let first = &pieces[..pieces.len().min(MOST_JOINED)];
    if first.is_empty() {
        return Ok(None);
    }
    let alike = unite(ctx, params, surface, first, twins)?;
    let has_twins = first.iter().any(|piece| twins.of(*piece).is_some());
    match alike {
        None if has_twins => unite(ctx, params, surface, first, &Twins::default()),
        alike => Ok(alike),
    }
}

/// Joins the first of `pieces` that can be joined to a neighbour, and its twin likewise.
pub fn join_first(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    pieces: &[PatchId],
    twins: &Twins,
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    first(pieces, |piece| join(ctx, params, surface, &[piece], twins))
}

/// Makes the first change of a piece that is possible.
fn first(
    pieces: &[PatchId],
    mut change: impl FnMut(PatchId) -> Result<Option<SegmentedSurface>, SegmentationError>,
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    for &piece in pieces {
        let changed = change(piece)?;
        if changed.is_some() {
            return Ok(changed);
        }
    }
    Ok(None)
}

/// Divides `patch` of the surface in two, then refines and smooths again. `None` if it cannot be divided.
///
/// The feedback loop uses this if no plan takes the piece out or holds it. Patches may be renumbered. Fails
/// if the user stopped, or if the seams cannot be smoothed.
pub fn divide(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    patch: PatchId,
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    try_change(ctx, params, surface, |solid, labels| {
        split_between_regions(
            &Ground::with_regions(params, solid, &surface.source_face),
            labels,
            patch,
        )
    })
}

/// Refines and smooths the surface again with its present patches. `None` if a patch would vanish. Patches
/// may be renumbered.
pub fn refined_again(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    try_change(ctx, params, surface, |_, labels| Some(labels.clone()))
}

/// Joins each of `patches` to the neighbour with the longest common seam, and their `twins` to that
/// neighbour's twin, then refines and smooths again. `None` if too few pieces would be left to lock, or if
/// nothing is joined.
///
/// The feedback loop uses this if dividing did not help. Patches may be renumbered.
pub fn unite(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    patches: &[PatchId],
    twins: &Twins,
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    let graph = surface.contact_graph(0.0);
    let touching = |patch: PatchId| {
        let contacts = graph.contacts().iter();
        contacts.filter(move |c| c.a == patch || c.b == patch)
    };
    let other = |patch: PatchId, c: &Adjacency| if c.a == patch { c.b } else { c.a };
    let mut pairs: Vec<[PatchId; 2]> = Vec::new();
    for &patch in patches {
        let longest = touching(patch).max_by(|c, d| c.total_mm.total_cmp(&d.total_mm));
        let Some(into) = longest.map(|c| other(patch, c)) else {
            return Ok(None);
        };
        pairs.push([patch, into]);
        let beyond = [patch, into].map(|p| twins.of(p));
        if let [Some(twin), into_twin] = beyond
            && !patches.contains(&twin)
        {
            let into = into_twin.unwrap_or(into);
            if touching(twin).any(|c| other(twin, c) == into) {
                pairs.push([twin, into]);
            }
        }
    }
    unite_pairs(ctx, params, surface, &pairs)
}

/// Joins two pieces that touch, and their `twins`, then refines and smooths again. `None` if too few pieces
/// would be left to lock.
pub fn unite_two(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    [a, b]: [PatchId; 2],
    twins: &Twins,
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    let beyond = [a, b].map(|p| twins.of(p).unwrap_or(p));
    unite_pairs(ctx, params, surface, &[[a, b], beyond])
}

/// Gives the pieces of each pair one label. Parts that do not touch become pieces of their own again.
fn unite_pairs(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    pairs: &[[PatchId; 2]],
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    let mut number: Vec<u32> = (0..surface.n_patches as u32).collect();
    for pair in pairs {
        let [own, into] = pair.map(|p| number[usize::from(p)]);
        number.iter_mut().filter(|k| **k == own).for_each(|k| *k = into);
    }
    try_change(ctx, params, surface, |solid, labels| {
        let label: Vec<u32> = labels.as_slice().iter().map(|&k| number[k as usize]).collect();
        let joined = FaceLabels::from_components(&Topology::new(solid), &label);
        accept_join(joined, surface)
    })
}

/// Returns `joined` if it has fewer patches than `surface` and still at least three: of two pieces, each can
/// leave the other.
fn accept_join(joined: FaceLabels, surface: &SegmentedSurface) -> Option<FaceLabels> {
    const FEWEST: usize = 3;
    (FEWEST..surface.n_patches)
        .contains(&joined.n_patches())
        .then_some(joined)
}

/// Changes the labels of `surface`, then refines and smooths again. `None` if nothing is changed, or if a
/// patch would vanish.
pub(super) fn try_change(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    change: impl Fn(&Solid, &FaceLabels) -> Option<FaceLabels>,
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    let limited = SegmentationParams {
        min_contact_mm: kept_limit_mm(params, surface),
        ..params.clone()
    };
    let Ok(solid) = Solid::new(surface.mesh.clone()) else {
        return Ok(None);
    };
    let label: Vec<u32> = surface.patch_of_face.iter().map(|p| p.0).collect();
    let labels = FaceLabels::from_components(&Topology::new(&solid), &label);
    let Some(changed) = change(&solid, &labels) else {
        return Ok(None);
    };
    let ground = Ground::with_regions(params, &solid, &surface.source_face);
    let refined = refine_on(ctx, &limited, &ground, &changed)?;
    let mut next = match smooth_and_cut(ctx, params, &solid, &refined) {
        // Another choice of pieces may succeed.
        Err(SegmentationError::PatchVanished { .. }) => return Ok(None),
        made => made?,
    };
    next.source_face
        .iter_mut()
        .for_each(|f| *f = surface.source_face[*f as usize]);
    Ok(Some(next))
}

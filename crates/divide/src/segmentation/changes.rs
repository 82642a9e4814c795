//! Changes to the user's labels, reported for the final surface.

use crate::causes::Cause;
use shellock_geom::Solid;
use shellock_report::{Ctx, PatchId, Warning};
use shellock_surface::SegmentedSurface;

use super::keep_whole::{place_in, tell_cut};
use super::{FaceLabels, SegmentationError, SegmentationParams, kept_limit_mm, resolve_regions, user_labels};

/// Least share of area for a label to lie mainly in a piece, or a piece mainly in a label. Smoothing moves
/// less.
const MAIN_SHARE: f64 = 0.5;

/// Share of the surface that must have changed its piece to be reported.
const MOVED_SHARE: f64 = 0.02;

/// Correspondence of labels and pieces.
pub(super) struct Changes {
    /// For each label, the pieces that belong mainly to it.
    pieces_of: Vec<Vec<PatchId>>,
    /// For each piece, the labels that lie mainly in it, and the one in which it mainly lies.
    labels_of: Vec<Vec<usize>>,
    /// Share of the surface in a piece that its label neither owns nor shares.
    moved_share: f64,
}

impl Changes {
    /// Compares `labels` of a mesh with the pieces of `surface`, whose source triangles are those of the
    /// mesh.
    pub fn between(labels: &FaceLabels, surface: &SegmentedSurface) -> Self {
        let (n_labels, n_pieces) = (labels.n_patches(), surface.n_patches);
        let mut common = vec![vec![0.0; n_pieces]; n_labels];
        for (face, piece) in surface.patch_of_face.iter().enumerate() {
            let label = usize::from(labels.patch(surface.source_face[face] as usize));
            common[label][usize::from(*piece)] += surface.mesh.face_area(face);
        }
        let of_label: Vec<f64> = common.iter().map(|row| row.iter().sum()).collect();
        let of_piece: Vec<f64> = (0..n_pieces)
            .map(|p| common.iter().map(|row| row[p]).sum())
            .collect();
        let is_own = |label: usize, piece: usize| common[label][piece] > MAIN_SHARE * of_piece[piece];
        let is_within = |label: usize, piece: usize| common[label][piece] > MAIN_SHARE * of_label[label];
        let own = |label| {
            (0..n_pieces)
                .filter(move |&p| is_own(label, p))
                .map(PatchId::from)
                .collect()
        };
        let within = |piece| {
            (0..n_labels)
                .filter(move |&l| is_within(l, piece) || is_own(l, piece))
                .collect()
        };
        let labels_of: Vec<Vec<usize>> = (0..n_pieces).map(within).collect();
        let of_other = |piece: usize| -> f64 {
            let others = (0..n_labels).filter(|label| !labels_of[piece].contains(label));
            others.map(|label| common[label][piece]).sum()
        };
        let moved_mm2: f64 = (0..n_pieces).map(of_other).sum();
        Self {
            pieces_of: (0..n_labels).map(own).collect(),
            moved_share: moved_mm2 / of_label.iter().sum::<f64>().max(f64::MIN_POSITIVE),
            labels_of,
        }
    }

    /// Number of labels that lost their own piece to another label with which they share it.
    pub fn n_lost(&self) -> usize {
        self.labels_of
            .iter()
            .map(|labels| labels.len().saturating_sub(1))
            .sum()
    }
}

/// Warns of what the user should know about `surface`: labels that were cleaned (see [`user_labels`]),
/// divided (`piece-split`) or joined (`piece-joined`), or whose borders moved (`borders-moved`); regions to
/// keep whole that were cut (`keep-whole-cut`); contacts shorter than wanted (`short-contacts`); and pieces
/// that are still the only link to others (`weak-graph`).
pub fn tell(
    ctx: &Ctx,
    params: &SegmentationParams,
    solid: &Solid,
    labels: Option<&[i64]>,
    surface: &SegmentedSurface,
) -> Result<(), SegmentationError> {
    if let Some(given) = labels {
        let cleaned = user_labels(ctx, params, solid, given)?;
        let names = names(solid, given, &cleaned);
        let changes = Changes::between(&cleaned, surface);
        tell_divisions(ctx, &changes, &names, surface);
        tell_joins(ctx, &changes, &names, surface);
        if changes.moved_share > MOVED_SHARE {
            let share = changes.moved_share;
            ctx.warn(Warning::new(Cause::BordersMoved { share }, Vec::new(), None));
        }
    }
    let keep = resolve_regions(&params.keep_whole, solid, labels)?;
    tell_cut(ctx, &keep, surface);
    let limit_mm = kept_limit_mm(params, surface);
    if limit_mm < params.min_contact_mm {
        tell_short(ctx, params, surface, limit_mm);
    }
    let graph = surface.contact_graph_below(params.wall_mm, limit_mm);
    if graph.n_faults() > 0 {
        let pieces = graph.articulation_pieces();
        // A region to keep whole may be the reason why the fault remained.
        let at = place_in(&keep, surface, &pieces);
        ctx.warn(Warning::new(Cause::WeakGraph, pieces, at));
    }
    Ok(())
}

/// User's name of each patch: the label of most of its area.
fn names(solid: &Solid, given: &[i64], cleaned: &FaceLabels) -> Vec<i64> {
    let mut area = vec![std::collections::BTreeMap::<i64, f64>::new(); cleaned.n_patches()];
    for (face, label) in given.iter().enumerate() {
        *area[usize::from(cleaned.patch(face))].entry(*label).or_default() += solid.mesh().face_area(face);
    }
    let most =
        |of: &std::collections::BTreeMap<i64, f64>| of.iter().max_by(|x, y| x.1.total_cmp(y.1)).map(|x| *x.0);
    area.iter().map(|of| most(of).unwrap_or_default()).collect()
}

fn tell_divisions(ctx: &Ctx, changes: &Changes, names: &[i64], surface: &SegmentedSurface) {
    let divided: Vec<usize> = (0..names.len())
        .filter(|&l| changes.pieces_of[l].len() > 1)
        .collect();
    let Some(&first) = divided.first() else { return };
    let into = divided
        .iter()
        .map(|&l| (names[l], changes.pieces_of[l].clone()))
        .collect();
    let pieces: Vec<PatchId> = divided
        .iter()
        .flat_map(|&l| changes.pieces_of[l].clone())
        .collect();
    let at = middle(surface, changes.pieces_of[first][0]);
    ctx.warn(Warning::new(Cause::LabelsDivided { into }, pieces, at));
}

fn tell_joins(ctx: &Ctx, changes: &Changes, names: &[i64], surface: &SegmentedSurface) {
    for (piece, labels) in changes
        .labels_of
        .iter()
        .enumerate()
        .filter(|(_, labels)| labels.len() > 1)
    {
        let piece = PatchId::from(piece);
        ctx.warn(Warning::new(
            Cause::LabelsJoined {
                labels: labels.iter().map(|&l| names[l]).collect(),
            },
            vec![piece],
            middle(surface, piece),
        ));
    }
}

/// Warns of seams that are shorter than wanted but had to count as contacts.
fn tell_short(ctx: &Ctx, params: &SegmentationParams, surface: &SegmentedSurface, limit_mm: f64) {
    let graph = surface.contact_graph_below(params.wall_mm, limit_mm);
    let short: Vec<_> = graph
        .contacts()
        .iter()
        .filter(|c| graph.counts(c) && c.longest_mm < params.min_contact_mm)
        .collect();
    let mut pieces: Vec<PatchId> = short.iter().flat_map(|c| [c.a, c.b]).collect();
    pieces.sort_unstable();
    pieces.dedup();
    ctx.warn(Warning::new(
        Cause::ShortContacts {
            from_mm: limit_mm,
            to_mm: params.min_contact_mm,
        },
        pieces,
        None,
    ));
}

/// Middle of some triangle of `piece`, mm.
fn middle(surface: &SegmentedSurface, piece: PatchId) -> Option<[f64; 3]> {
    let face = surface.patch_of_face.iter().position(|&p| p == piece)?;
    Some(surface.mesh.face_center(face).to_array())
}

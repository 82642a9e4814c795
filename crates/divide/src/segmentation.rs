//! Division of a closed surface into patches, along which the shell is cut (Sect. 4).
//!
//! Labels come from the user or from clustering. They are refined until every patch is a disk and no single
//! piece is the only link to others. Then the seams are smoothed and the triangles cut along them. Deviation
//! from the paper, which takes the labels as given: without refining, most labelled models have no plan that
//! locks (see [`shellock_surface::seam::graph`]).

mod changes;
mod coarsen;
mod creases;
mod cut;
mod dual_graph;
mod error;
mod fewer;
pub mod figures;
mod ground;
mod halve;
mod keep_whole;
mod lengthen;
mod mend;
mod method;
mod mirror;
mod reassign;
mod refine;
mod revise;
mod settle;
mod smooth;
mod split;
mod user;

use changes::Changes;
pub use changes::tell;
pub use coarsen::coarsen;
pub use creases::usual_n_pieces;
pub use error::SegmentationError;
use fewer::{disagreement, with_fewer_parts};
use ground::Ground;
use halve::halve_long_edges;
pub use keep_whole::{KeepWhole, resolve_regions, whole};
pub use lengthen::{Wish, lengthen};
use mend::{Mended, held_twice, mirror_images};
pub use method::{Method, automatic_labels, mirrored_labels, symmetry_plane};
use method::{automatic_on, creases_on};
pub use mirror::Twins;
pub use reassign::{Reassignment, reassign};
pub use refine::refine;
pub use revise::{divide, join, join_first, refined_again, revise, unite, unite_two};
use serde::{Deserialize, Serialize};
use shellock_geom::topology::components;
use shellock_geom::{Solid, Topology};
use shellock_report::{Ctx, PatchId};
use shellock_segment::mirrored::Mirrored;
pub use shellock_segment::symmetry::Plane;
use shellock_surface::SegmentedSurface;
pub use smooth::smooth_and_cut;
use split::split_between_regions;
pub use split::split_piece;
pub use user::user_labels;

/// Greatest number of pieces, as many as can be planned.
pub const MOST_PIECES: usize = 128;

/// Parameters of the division of a surface. Lengths in mm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SegmentationParams {
    /// Method that finds patches if there are no labels; [`Method::Auto`], which cuts where people would.
    pub method: Method,
    /// Number of patches that automatic segmentation begins with; refining adds some. [2, [`MOST_PIECES`]];
    /// `None`. With `None`, the method decides; in creases, the area does: 10 for a 150 mm figure.
    pub n_pieces: Option<usize>,
    /// Regions that no seam may divide; none.
    pub keep_whole: Vec<KeepWhole>,
    /// True if [`Method::Auto`] and [`Method::RandomCuts`] divide both sides of a model's plane of symmetry
    /// alike; false.
    pub symmetric: bool,
    /// Seed of all random choices; 0.
    pub seed: u64,
    /// Diffusion that smooths the seams, mm². [0, 100]; 7. It rounds off features narrower than its root, 2.6
    /// mm, about a connector.
    pub smoothing_mm2: f64,
    /// Shortest single seam stretch that counts as a contact. [0, 100]; 9: 3.5 connectors of 2.5 mm, since a
    /// run loses 1.5 of them at each end.
    pub min_contact_mm: f64,
    /// Shortest such stretch if longer ones would require too many pieces. [0, [`min_contact_mm`]]; 9.
    ///
    /// [`min_contact_mm`]: Self::min_contact_mm
    pub least_contact_mm: f64,
    /// Depth at which those stretches are measured, where connectors lie. [0, 10]; 0, the outer surface.
    pub wall_mm: f64,
    /// Smallest patch, mm². [1, 10 000]; 60: a smaller piece has no room for connectors on two sides. Smaller
    /// patches are merged.
    pub min_piece_mm2: f64,
    /// Longest edge before patches are drawn; longer ones are halved. [0.5, 100]; 5: a tenth of a patch's
    /// width.
    pub max_edge_mm: f64,
    /// Greatest number of pieces that refining may add. [0, 500]; 40.
    pub max_splits: usize,
}

impl Default for SegmentationParams {
    fn default() -> Self {
        Self {
            method: Method::default(),
            n_pieces: None,
            keep_whole: Vec::new(),
            symmetric: false,
            seed: 0,
            smoothing_mm2: 7.0,
            min_contact_mm: 9.0,
            least_contact_mm: 9.0,
            wall_mm: 0.0,
            min_piece_mm2: 60.0,
            max_edge_mm: 5.0,
            max_splits: 40,
        }
    }
}

impl SegmentationParams {
    /// Returns every problem at once, as messages for people; empty if there is none.
    pub fn problems(&self) -> Vec<String> {
        let mut found = Vec::new();
        if self.n_pieces.is_some_and(|n| !(2..=MOST_PIECES).contains(&n)) {
            found.push(format!(
                "pieces is {}, but must be from 2 to {MOST_PIECES}",
                self.n_pieces.unwrap_or_default()
            ));
        }
        for (name, value, low, high) in [
            ("smoothing_mm2", self.smoothing_mm2, 0.0, 100.0),
            ("min_contact_mm", self.min_contact_mm, 0.0, 100.0),
            ("least_contact_mm", self.least_contact_mm, 0.0, 100.0),
            ("wall_mm", self.wall_mm, 0.0, 10.0),
            ("min_piece_mm2", self.min_piece_mm2, 1.0, 10_000.0),
            ("max_edge_mm", self.max_edge_mm, 0.5, 100.0),
        ] {
            if !(low..=high).contains(&value) {
                found.push(format!("{name} is {value}, but must be from {low} to {high}"));
            }
        }
        found.extend(self.keep_whole.iter().filter_map(KeepWhole::problem));
        if self.max_splits > 500 {
            found.push(format!(
                "max_splits is {}, but must be at most 500",
                self.max_splits
            ));
        }
        found
    }
}

/// One patch for each triangle of a solid: ids 0 … n − 1, each patch connected across edges and not empty.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceLabels {
    patch_of_face: Vec<u32>,
    n_patches: usize,
}

impl FaceLabels {
    /// Makes each connected set of equal `label` a patch. Patches are numbered by label, then by their lowest
    /// triangle.
    pub fn from_components(topology: &Topology, label: &[u32]) -> Self {
        let (component, n_patches) = components(topology, |f, g| label[f as usize] == label[g as usize]);
        let mut order: Vec<(u32, u32)> = vec![(u32::MAX, 0); n_patches];
        for (face, &c) in component.iter().enumerate() {
            order[c as usize] = (label[face], c);
        }
        order.sort_unstable();
        let mut id = vec![0; n_patches];
        for (patch, &(_, c)) in order.iter().enumerate() {
            id[c as usize] = patch as u32;
        }
        Self {
            patch_of_face: component.into_iter().map(|c| id[c as usize]).collect(),
            n_patches,
        }
    }

    /// Takes labels as they are. Each must be connected and below `n_patches`.
    fn of_connected(label: &[u32], n_patches: usize) -> Self {
        Self {
            patch_of_face: label.to_vec(),
            n_patches,
        }
    }

    /// Patch that contains triangle `face`.
    pub fn patch(&self, face: usize) -> PatchId {
        PatchId(self.patch_of_face[face])
    }

    /// Patch number of each triangle, in order.
    pub fn as_slice(&self) -> &[u32] {
        &self.patch_of_face
    }

    /// Number of patches in all.
    pub fn n_patches(&self) -> usize {
        self.n_patches
    }

    fn inherit(&self, source_face: &[u32]) -> Self {
        let patch_of_face = source_face
            .iter()
            .map(|&f| self.patch_of_face[f as usize])
            .collect();
        Self {
            patch_of_face,
            n_patches: self.n_patches,
        }
    }
}

/// Number of limits on contacts that are tried in turn, from `min_contact_mm` down to `least_contact_mm`.
const N_CONTACT_LIMITS: usize = 3;

/// Prices of a fault of the contact graph, of a label that lost its piece to another, and of each step to
/// shorter contacts, in pieces that refining may add instead. A kit with a fault does not lock; the other two
/// are a matter of taste.
const FAULT_COST: f64 = 100.0;
const LOST_LABEL_COST: f64 = 8.0;
const SHORTER_COST: f64 = 2.0;
/// Divisor of the wanted number of pieces. It gives the least number for a drawn division that keeps regions
/// whole.
const FEWEST_SHARE: usize = 2;
/// Price of a drawn division that was replaced entirely, in pieces beyond the welcome number.
const DISAGREEMENT_COST: f64 = 30.0;

/// Runs the whole stage: takes the user's labels or automatic ones, refines, smooths and cuts. `source_face`
/// of the result refers to triangles of `solid`.
///
/// Warns as [`tell`] does.
pub fn segment(
    ctx: &Ctx,
    params: &SegmentationParams,
    solid: &Solid,
    labels: Option<&[i64]>,
) -> Result<SegmentedSurface, SegmentationError> {
    ctx.stage("segmentation", 0)?;
    let params = &SegmentationParams {
        keep_whole: resolve_regions(&params.keep_whole, solid, labels)?,
        ..params.clone()
    };
    let given = labels.map(|l| user_labels(ctx, params, solid, l)).transpose()?;
    if given.is_none() && params.symmetric && !params.method.knows_symmetry() {
        let method = params.method.name();
        ctx.note(&format!("{method} knows no symmetry: auto and random-cuts do"));
    }
    let (fine, source_face) = halve_long_edges(params, solid);
    let ground = Ground::with_regions(params, &fine, &source_face);
    let mut surface = match given {
        Some(labels) => {
            let labels = labels.inherit(&source_face);
            let kept = keep_whole::gather_regions(ctx, params, &fine, &ground.whole, labels.clone())?;
            if kept != labels {
                ctx.note(
                    "what is kept whole lies in several labels: it is given to the one that has most of it",
                );
            }
            let labels = kept;
            let found = best_contacts(ctx, params, &ground, &labels, LabelOrigin::User, f64::INFINITY)?;
            found.expect("nothing is dearer than that").1
        }
        None if params.method == Method::Creases => try_clusterings(ctx, params, &ground)?,
        None => propose(ctx, params, &ground)?,
    };
    surface
        .source_face
        .iter_mut()
        .for_each(|f| *f = source_face[*f as usize]);
    tell(ctx, params, solid, labels, &surface)?;
    Ok(surface)
}

/// Tries clusterings with different seeds until one is cheap to repair. Returns the cheapest.
fn try_clusterings(
    ctx: &Ctx,
    params: &SegmentationParams,
    ground: &Ground<'_>,
) -> Result<SegmentedSurface, SegmentationError> {
    /// Greatest number of seeds worth trying.
    const CLUSTERINGS: u64 = 4;
    let mut best: Option<(f64, SegmentedSurface)> = None;
    for attempt in 0..CLUSTERINGS {
        let reseeded = SegmentationParams {
            seed: params.seed.wrapping_add(attempt << 32),
            ..params.clone()
        };
        let labels = creases_on(ctx, &reseeded, ground.solid, &ground.whole)?;
        let origin = LabelOrigin::Automatic;
        let limit = best.as_ref().map_or(f64::INFINITY, |b| b.0);
        best = best_contacts(ctx, params, ground, &labels, origin, limit)?.or(best);
        let enough = origin.good_cost(labels.n_patches());
        if best.as_ref().is_some_and(|b| b.0 <= enough) {
            break;
        }
    }
    Ok(best.expect("there is at least one try").1)
}

/// Divides by the method of `params`. If that leads to too many pieces, tries divisions with fewer parts as
/// well. Returns the cheapest.
fn propose(
    ctx: &Ctx,
    params: &SegmentationParams,
    ground: &Ground<'_>,
) -> Result<SegmentedSurface, SegmentationError> {
    let Some(drawn) = automatic_on(ctx, params, ground.solid, &ground.whole)? else {
        return try_clusterings(ctx, params, ground);
    };
    let (drawn, wanted) = match params.n_pieces {
        Some(n) => (divide_largest(ctx, params, ground, drawn, n)?, n),
        None => (drawn, usual_n_pieces(ground.solid.mesh().area())),
    };
    let mirrored = mirror_images(params, ground);
    let origin = LabelOrigin::Drawn {
        labels: &drawn,
        goal: wanted,
        mirror: mirrored.as_ref(),
    };
    let mut best: Option<(f64, SegmentedSurface)> = None;
    for labels in with_fewer_parts(ground.solid, &drawn, wanted) {
        ctx.check()?;
        let limit = best.as_ref().map_or(f64::INFINITY, |b| b.0);
        best = best_contacts(ctx, params, ground, &labels, origin, limit)?.or(best);
    }
    let (_, drawn) = best.expect("nothing is dearer than the first");
    if !params.keep_whole.is_empty() && drawn.n_patches * FEWEST_SHARE < wanted {
        ctx.note("what is kept whole leaves few places to cut: pieces of similar size");
        return try_clusterings(ctx, params, ground);
    }
    Ok(drawn)
}

/// Divides the largest patch until there are `wanted` ones. People cut a figure into twenty parts at most, so
/// more pieces are halves of these.
fn divide_largest(
    ctx: &Ctx,
    params: &SegmentationParams,
    ground: &Ground<'_>,
    mut labels: FaceLabels,
    wanted: usize,
) -> Result<FaceLabels, SegmentationError> {
    /// Least area of a patch that is divided, in smallest patches.
    const LEAST_TO_DIVIDE: f64 = 3.0;
    let mut is_divisible = vec![true; labels.n_patches()];
    while labels.n_patches() < wanted {
        ctx.check()?;
        let mut area_mm2 = vec![0.0; labels.n_patches()];
        for (face, &patch) in labels.as_slice().iter().enumerate() {
            area_mm2[patch as usize] += ground.faces.area[face];
        }
        let is_large = |&i: &usize| is_divisible[i] && area_mm2[i] > LEAST_TO_DIVIDE * params.min_piece_mm2;
        let largest = (0..area_mm2.len())
            .filter(is_large)
            .max_by(|&i, &j| area_mm2[i].total_cmp(&area_mm2[j]));
        let Some(largest) = largest else {
            break;
        };
        match split_between_regions(ground, &labels, PatchId(largest as u32)) {
            Some(divided) => {
                labels = divided;
                is_divisible.push(true);
            }
            None => is_divisible[largest] = false,
        }
    }
    Ok(labels)
}

/// Origin of the patches that are changed. A user wants to recognise the labels; an automatic choice should
/// have the number of pieces requested.
#[derive(Clone, Copy, Debug)]
enum LabelOrigin<'a> {
    User,
    Automatic,
    /// Drawn by a method that cuts where people would; the result should have few enough pieces.
    Drawn {
        labels: &'a FaceLabels,
        goal: usize,
        /// Mirror image of each triangle, if both sides are to be divided alike.
        mirror: Option<&'a Mirrored>,
    },
}

impl LabelOrigin<'_> {
    fn mirror(&self) -> Option<&Mirrored> {
        match self {
            Self::Drawn { mirror: mirrored, .. } => *mirrored,
            _ => None,
        }
    }

    /// Cost of the changes from `labels` to `surface`, in pieces.
    fn cost(self, labels: &FaceLabels, surface: &SegmentedSurface) -> f64 {
        let (before, after) = (labels.n_patches() as f64, surface.n_patches as f64);
        match self {
            // Fewer pieces are worse than more: they are larger than requested.
            Self::Automatic => (after - before).max(2.0 * (before - after)),
            Self::User => {
                let n_lost = Changes::between(labels, surface).n_lost() as f64;
                LOST_LABEL_COST * n_lost + (after + n_lost - before)
            }
            Self::Drawn {
                labels, goal: wanted, ..
            } => DISAGREEMENT_COST * disagreement(labels, surface) + excess(surface.n_patches, wanted),
        }
    }

    /// Lower bound on the cost of the changes from `labels` to `mended`, before seams are smoothed:
    /// [`Self::cost`] without labels that lose their piece.
    fn least_cost(self, labels: &FaceLabels, mended: &FaceLabels) -> f64 {
        let (before, after) = (labels.n_patches() as f64, mended.n_patches() as f64);
        match self {
            Self::Automatic => (after - before).max(2.0 * (before - after)),
            Self::User => (after - before).max(0.0),
            Self::Drawn { goal: wanted, .. } => excess(mended.n_patches(), wanted),
        }
    }

    /// Cost at which no further division is tried, given `n` patches in the beginning.
    fn good_cost(self, n: usize) -> f64 {
        match self {
            Self::Automatic => 2.0 + 0.25 * n as f64,
            Self::User => f64::max(4.0, 0.5 * n as f64),
            Self::Drawn { .. } => 0.5 * SHORTER_COST,
        }
    }
}

/// Number of pieces beyond the welcome number if `wanted` are wanted.
fn excess(n: usize, wanted: usize) -> f64 {
    /// Multiple of the wanted number that is still welcome.
    const WELCOME: f64 = 1.2;
    (n as f64 - WELCOME * wanted as f64).max(0.0)
}

/// Limits on contacts that are tried in turn, mm.
fn contact_limits(params: &SegmentationParams) -> Vec<f64> {
    let (most, least) = (
        params.min_contact_mm,
        params.least_contact_mm.min(params.min_contact_mm),
    );
    let step = (most - least) / (N_CONTACT_LIMITS - 1) as f64;
    let mut limits: Vec<f64> = (0..N_CONTACT_LIMITS).map(|i| most - step * i as f64).collect();
    limits.dedup();
    limits
}

/// Limit that the contacts of `surface` satisfy, mm: the longest with the fewest faults of the contact graph.
fn kept_limit_mm(params: &SegmentationParams, surface: &SegmentedSurface) -> f64 {
    let faults = |limit_mm: &f64| surface.contact_graph_below(params.wall_mm, *limit_mm).n_faults();
    contact_limits(params)
        .into_iter()
        .min_by_key(faults)
        .expect("there is at least one limit")
}

/// Repairs `labels` for long contacts, and for shorter ones if those cost too much. Returns the cheapest
/// surface that costs less than `limit`, with its cost.
fn best_contacts(
    ctx: &Ctx,
    params: &SegmentationParams,
    ground: &Ground<'_>,
    labels: &FaceLabels,
    origin: LabelOrigin,
    limit: f64,
) -> Result<Option<(f64, SegmentedSurface)>, SegmentationError> {
    let mut best: Option<(f64, SegmentedSurface)> = None;
    // Patches whose contacts are longer than any later limit. Under it they would cost more, as only their
    // seams could settle a little better.
    let mut held: Option<FaceLabels> = None;
    for (i, limit_mm) in contact_limits(params).into_iter().enumerate() {
        let limited = SegmentationParams {
            min_contact_mm: limit_mm,
            ..params.clone()
        };
        let shorter = SHORTER_COST * i as f64;
        let limit = best.as_ref().map_or(limit, |b| b.0);
        let not_worth = |mended: &FaceLabels| {
            held.as_ref() == Some(mended) || origin.least_cost(labels, mended) + shorter >= limit
        };
        if let Some(mended) = held_twice(ctx, &limited, ground, labels, origin, not_worth)? {
            let Mended {
                n_faults, surface, ..
            } = mended;
            let cost = FAULT_COST * n_faults as f64 + origin.cost(labels, &surface) + shorter;
            if cost < limit {
                best = Some((cost, surface));
            }
            if n_faults == 0 {
                held = Some(mended.labels);
            }
        }
        if best
            .as_ref()
            .is_some_and(|b| b.0 <= origin.good_cost(labels.n_patches()))
        {
            break;
        }
    }
    Ok(best)
}

/// Returns true if some of the contacts that hold `surface` together are shorter than wanted.
pub fn has_short_contacts(params: &SegmentationParams, surface: &SegmentedSurface) -> bool {
    kept_limit_mm(params, surface) < params.min_contact_mm
}

#[cfg(test)]
mod tests;

//! From a closed surface to patches: where the shell is cut (Sect. 4).
//!
//! Labels come from the user or from clustering; they are mended until every patch is a disk and no single piece holds others alone;
//! then the seams are smoothed and the triangles cut along them. Deviation from the paper, which takes the labels as given: without
//! mending most labelled models have no plan that locks (see [`crate::contact_graph`]).

mod auto;
mod cut;
mod dual_graph;
mod mend;
mod smooth;
mod split;
mod user;

use serde::{Deserialize, Serialize};
use shellock_geom::subdivide::halve_edges;
use shellock_geom::topology::{components, ends};
use shellock_geom::{Solid, Topology};

pub use auto::auto_labels;
pub use mend::mend;
pub use smooth::smooth_and_cut;
pub use split::split_piece;
pub use user::user_labels;

use crate::{Cancelled, Ctx, PatchId, SegmentedSurface};

/// How the surface is divided. Lengths in mm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SegmentationParams {
    /// Patches that automatic segmentation begins with; mending adds some. [2, 200]; `None`: from the area, 10 for a 150 mm figure.
    pub n_pieces: Option<usize>,
    /// Seed of all random choices; 0.
    pub seed: u64,
    /// Diffusion that smooths the seams, mm². [0, 100]; 7: rounds off what is narrower than its root, 2.6 mm, about a connector.
    pub smoothing_mm2: f64,
    /// Shortest single seam stretch that counts as a contact. [0, 100]; 9: 3.5 connectors of 2.5 mm, as a run loses 1.5 at each end.
    pub min_contact_mm: f64,
    /// Smallest patch, mm². [1, 10 000]; 60: a smaller piece has no room for connectors on two sides. Smaller ones are merged.
    pub min_piece_mm2: f64,
    /// Edges longer than this are halved before patches are drawn. [0.5, 100]; 5: a tenth of a patch's width.
    pub max_edge_mm: f64,
    /// Most pieces that mending may add. [0, 500]; 40.
    pub max_splits: usize,
}

impl Default for SegmentationParams {
    fn default() -> Self {
        Self {
            n_pieces: None,
            seed: 0,
            smoothing_mm2: 7.0,
            min_contact_mm: 9.0,
            min_piece_mm2: 60.0,
            max_edge_mm: 5.0,
            max_splits: 40,
        }
    }
}

impl SegmentationParams {
    /// Every problem at once, for people; empty where there is none.
    pub fn problems(&self) -> Vec<String> {
        let mut found = Vec::new();
        if self.n_pieces.is_some_and(|n| !(2..=200).contains(&n)) {
            found.push(format!("n_pieces is {}, but must be from 2 to 200", self.n_pieces.unwrap_or_default()));
        }
        for (name, value, low, high) in [
            ("smoothing_mm2", self.smoothing_mm2, 0.0, 100.0),
            ("min_contact_mm", self.min_contact_mm, 0.0, 100.0),
            ("min_piece_mm2", self.min_piece_mm2, 1.0, 10_000.0),
            ("max_edge_mm", self.max_edge_mm, 0.5, 100.0),
        ] {
            if !(low..=high).contains(&value) {
                found.push(format!("{name} is {value}, but must be from {low} to {high}"));
            }
        }
        if self.max_splits > 500 {
            found.push(format!("max_splits is {}, but must be at most 500", self.max_splits));
        }
        found
    }
}

/// Why there are no patches.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SegmentationError {
    /// The user stopped.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A label is missing or left over.
    #[error(
        "there are {n_labels} labels for {n_faces} triangles: give one label for each triangle, in the order of the model file"
    )]
    LabelCount {
        /// Labels given.
        n_labels: usize,
        /// Triangles of the model.
        n_faces: usize,
    },
    /// Nothing to take apart.
    #[error("all {n_faces} triangles have the label {label}: give at least two labels, or none for automatic patches")]
    OneLabel {
        /// The label.
        label: i64,
        /// Triangles of the model.
        n_faces: usize,
    },
    /// Labels that number triangles rather than patches.
    #[error(
        "{n_faces} triangles have {n_labels} different labels: give patches of at least 3 triangles on average, at most 1000"
    )]
    TooManyLabels {
        /// Different labels.
        n_labels: usize,
        /// Triangles of the model.
        n_faces: usize,
    },
    /// Everything was merged away.
    #[error(
        "after merging patches below {min_piece_mm2} mm² only one is left: lower min_piece_mm2 or scale the model up"
    )]
    AllTooSmall {
        /// The limit.
        min_piece_mm2: f64,
    },
    /// More patches than triangles.
    #[error("{n_pieces} pieces are wanted of {n_faces} triangles: ask for fewer pieces")]
    TooManyPieces {
        /// Pieces wanted.
        n_pieces: usize,
        /// Triangles of the model.
        n_faces: usize,
    },
    /// The patch is smaller than the mesh can show, even unsmoothed.
    #[error(
        "patch {patch} of {area_mm2:.1} mm² vanishes when seams are smoothed: merge it with a neighbour or raise min_piece_mm2"
    )]
    PatchVanished {
        /// The patch.
        patch: PatchId,
        /// Its area.
        area_mm2: f64,
    },
    /// The smoothing matrix could not be factorised: coordinates far outside of any printer.
    #[error("seams cannot be smoothed: {0}; check the model's scale")]
    Solve(#[from] shellock_geom::sparse::SparseError),
}

/// One patch for each triangle of a solid: ids 0 … n − 1, each patch connected across edges and not empty.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceLabels {
    patch_of_face: Vec<u32>,
    n_patches: usize,
}

impl FaceLabels {
    /// Patches are the connected sets of equal `label`, numbered by label, then by their lowest triangle.
    pub(crate) fn from_connected(topology: &Topology, label: &[u32]) -> Self {
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
        Self { patch_of_face: component.into_iter().map(|c| id[c as usize]).collect(), n_patches }
    }

    /// The patch of triangle `face`.
    pub fn patch(&self, face: usize) -> PatchId {
        PatchId(self.patch_of_face[face])
    }

    /// The patch number of each triangle, in order.
    pub fn as_slice(&self) -> &[u32] {
        &self.patch_of_face
    }

    /// How many patches there are.
    pub fn n_patches(&self) -> usize {
        self.n_patches
    }

    fn inherited(&self, source_face: &[u32]) -> Self {
        let patch_of_face = source_face.iter().map(|&f| self.patch_of_face[f as usize]).collect();
        Self { patch_of_face, n_patches: self.n_patches }
    }
}

/// Whose patches are changed: a user is told, an automatic choice is just improved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LabelOrigin {
    /// The user gave one label a triangle.
    User,
    /// [`auto_labels`] made them.
    Automatic,
}

/// How often mending is repeated with a stricter limit when smoothing shortened a contact below the limit.
const MAX_MEND_ROUNDS: usize = 4;
/// How much stricter each repetition is.
const STRICTER: f64 = 1.15;

/// How many clusterings automatic segmentation tries before it is content with one that hangs together only once.
const MAX_AUTOMATIC_TRIES: u64 = 4;

/// The whole stage: labels (the user's, or automatic ones), mended, smoothed and cut; `source_face` names triangles of `solid`.
///
/// Warns `weak-graph` where some piece still holds others alone.
pub fn segment(
    ctx: &Ctx,
    params: &SegmentationParams,
    solid: &Solid,
    labels: Option<&[i64]>,
) -> Result<SegmentedSurface, SegmentationError> {
    let given = labels.map(|l| user_labels(ctx, params, solid, l)).transpose()?;
    let (fine, source_face) = halve_long_edges(params, solid);
    let (faults, mut surface) = match given {
        Some(labels) => held_twice(ctx, params, &fine, labels.inherited(&source_face), LabelOrigin::User)?,
        None => {
            let mut best: Option<(usize, SegmentedSurface)> = None;
            for attempt in 0..MAX_AUTOMATIC_TRIES {
                let reseeded = SegmentationParams { seed: params.seed.wrapping_add(attempt << 32), ..params.clone() };
                let labels = auto_labels(ctx, &reseeded, &fine)?;
                let (faults, surface) = held_twice(ctx, params, &fine, labels, LabelOrigin::Automatic)?;
                if best.as_ref().is_none_or(|b| faults < b.0) {
                    best = Some((faults, surface));
                }
                if faults == 0 {
                    break;
                }
            }
            best.expect("there is at least one try")
        }
    };
    if faults > 0 {
        warn_weak_graph(ctx, &surface.contact_graph(params.min_contact_mm));
    }
    surface.source_face.iter_mut().for_each(|f| *f = source_face[*f as usize]);
    Ok(surface)
}

/// Mends, smooths and cuts until the smooth seams hold every piece twice; the best round and its faults where none does.
fn held_twice(
    ctx: &Ctx,
    params: &SegmentationParams,
    solid: &Solid,
    mut labels: FaceLabels,
    origin: LabelOrigin,
) -> Result<(usize, SegmentedSurface), SegmentationError> {
    let mut strict = params.clone();
    let mut best: Option<(usize, SegmentedSurface)> = None;
    for _ in 0..MAX_MEND_ROUNDS {
        labels = mend(ctx, &strict, solid, &labels, origin)?;
        let surface = smooth_and_cut(ctx, params, solid, &labels)?;
        let faults = surface.contact_graph(params.min_contact_mm).n_faults();
        if best.as_ref().is_none_or(|b| faults < b.0) {
            best = Some((faults, surface));
        }
        if faults == 0 {
            break;
        }
        strict.min_contact_mm *= STRICTER;
    }
    Ok(best.expect("there is at least one round"))
}

/// The same surface with `patch` divided in two, mended and smoothed again; `None` where it cannot be divided.
///
/// The feedback loop asks for this where no plan takes the piece out or holds it. Patches may be renumbered.
pub fn divide(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    patch: PatchId,
) -> Option<SegmentedSurface> {
    let solid = Solid::new(surface.mesh.clone()).ok()?;
    let label: Vec<u32> = surface.patch_of_face.iter().map(|p| p.0).collect();
    let labels = FaceLabels::from_connected(&Topology::new(&solid), &label);
    let divided = split_piece(&solid, &labels, patch)?;
    let mended = mend(ctx, params, &solid, &divided, LabelOrigin::Automatic).ok()?;
    let mut next = smooth_and_cut(ctx, params, &solid, &mended).ok()?;
    next.source_face.iter_mut().for_each(|f| *f = surface.source_face[*f as usize]);
    Some(next)
}

fn warn_weak_graph(ctx: &Ctx, graph: &crate::ContactGraph) {
    let pieces = graph.articulation_pieces();
    let list = pieces.iter().map(|p| format!("\"{p}\"")).collect::<Vec<_>>().join(", ");
    ctx.warn(crate::Warning {
        code: "weak-graph".into(),
        message: format!(
            "pieces {list} alone hold others, which may come loose: give other labels or raise max_splits"
        ),
        pieces,
        at: None,
    });
}

/// Halves edges until none is longer than the limit, which grows with models far larger than 300 mm to bound their triangles.
fn halve_long_edges(params: &SegmentationParams, solid: &Solid) -> (Solid, Vec<u32>) {
    let limit_mm = params.max_edge_mm.max((solid.mesh().area() / 20_000.0).sqrt());
    let mut fine = solid.clone();
    let mut source_face: Vec<u32> = (0..solid.mesh().triangles.len() as u32).collect();
    loop {
        let mesh = fine.mesh();
        let is_long = |a: u32, b: u32| mesh.points[a as usize].distance(mesh.points[b as usize]) > limit_mm;
        if !mesh.triangles.iter().any(|&[a, b, c]| is_long(a, b) || is_long(b, c) || is_long(c, a)) {
            return (fine, source_face);
        }
        let (next, parent) = halve_edges(&fine, &Topology::new(&fine), is_long);
        source_face = parent.iter().map(|&f| source_face[f as usize]).collect();
        fine = next;
    }
}

/// Halves edges near seams so that curves have points enough to be smooth.
fn halve_edges_near_seams(solid: &Solid, labels: &FaceLabels, limit_mm: f64) -> (Solid, FaceLabels, Vec<u32>) {
    /// Rings of triangles beside the seam that are refined; the smoothed seam stays within them.
    const N_RINGS: usize = 2;
    let (mut fine, mut fine_labels) = (solid.clone(), labels.clone());
    let mut source_face: Vec<u32> = (0..solid.mesh().triangles.len() as u32).collect();
    loop {
        let (mesh, topology) = (fine.mesh(), Topology::new(&fine));
        let mut is_near = vec![false; mesh.points.len()];
        for h in 0..topology.n_half_edges() as u32 {
            let (f, g) = (h as usize / 3, topology.opposite(h) as usize / 3);
            is_near[ends(mesh, h).0 as usize] |= fine_labels.patch_of_face[f] != fine_labels.patch_of_face[g];
        }
        for _ in 0..N_RINGS {
            let before = is_near.clone();
            for t in mesh.triangles.iter().filter(|t| t.iter().any(|&v| before[v as usize])) {
                t.iter().for_each(|&v| is_near[v as usize] = true);
            }
        }
        let wants = |a: u32, b: u32| {
            is_near[a as usize]
                && is_near[b as usize]
                && mesh.points[a as usize].distance(mesh.points[b as usize]) > limit_mm
        };
        if !mesh.triangles.iter().any(|&[a, b, c]| wants(a, b) || wants(b, c) || wants(c, a)) {
            return (fine, fine_labels, source_face);
        }
        let (next, parent) = halve_edges(&fine, &topology, wants);
        source_face = parent.iter().map(|&f| source_face[f as usize]).collect();
        fine_labels = fine_labels.inherited(&parent);
        fine = next;
    }
}

#[cfg(test)]
mod tests;

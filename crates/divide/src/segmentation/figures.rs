//! Figures of a division: sizes of its pieces, course and visibility of its seams, and how well its pieces
//! hold each other. Nothing is planned for the division.
//!
//! Seams are sampled in steps of at most a millimetre. The section across a seam tells if it lies in a
//! crease:
//!
//! ```text
//!    \      |      /
//!     \     | n   /         bend = the rise of both ends over the sample's tangent plane, as angles:
//!  3 mm\    |    / 3 mm     > 0 in a hollow, 0 on a plane, < 0 over an edge
//!       `---o---´
//! ```

mod cone;
mod seams;
#[cfg(test)]
mod tests;

pub use cone::Cone;
use rayon::prelude::*;
use serde::Serialize;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::topology::components;
use shellock_geom::{Topology, Vec3};
use shellock_report::PatchId;
pub use shellock_segment::symmetry::Plane;
use shellock_surface::SegmentedSurface;
use shellock_surface::seam::graph::{Adjacency, ContactGraph};

use super::split::euler_characteristics;

/// Parameters of the figures beside the division. Lengths in mm.
#[derive(Clone, Debug, PartialEq)]
pub struct FigureParams {
    /// Up direction of the standing model, a unit vector; z.
    pub up: [f64; 3],
    /// Depth at which contacts are measured, where connectors lie. [0, 10]; 0, the outer surface.
    pub wall_mm: f64,
    /// Shortest stretch of seam that counts as a contact. [0, 100]; 9, as in the division of pieces.
    pub min_contact_mm: f64,
    /// Plane of symmetry of the model, if there is one.
    pub mirror: Option<Plane>,
}

impl Default for FigureParams {
    fn default() -> Self {
        Self {
            up: [0.0, 0.0, 1.0],
            wall_mm: 0.0,
            min_contact_mm: 9.0,
            mirror: None,
        }
    }
}

/// All figures of a division. Shares are in [0, 1].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DivisionFigures {
    /// Number of pieces in all.
    pub n_pieces: usize,
    /// Areas of the pieces' skins.
    pub area_mm2: Spread,
    /// Course and visibility of the seams.
    pub seams: SeamFigures,
    /// Contacts by which pieces hold each other.
    pub contacts: ContactFigures,
    /// Figures of each piece, by its number.
    pub pieces: Vec<PieceFigures>,
    /// Share of the surface whose mirror image belongs to the image of its piece; `None` without a plane.
    pub mirrored_share: Option<f64>,
}

/// Least, median and largest of several values; all 0 if there are none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// Least of the values.
    pub least: f64,
    /// Middle value, or the mean of the two in the middle.
    pub median: f64,
    /// Largest of the values.
    pub largest: f64,
}

/// Course of the seams, as shares of their length; all 0 if there is no seam.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SeamFigures {
    /// Length of all seams, mm.
    pub length_mm: f64,
    /// Share in concave creases, where the surface bends inwards by more than 10° within 3 mm on each side.
    pub concave_share: f64,
    /// Share where the surface bends by at most 10° either way.
    pub flat_share: f64,
    /// Share over convex edges, where the surface bends outwards by more than 10°.
    pub convex_share: f64,
    /// Visible share, as the mean of eight level views around the model, 45° apart.
    pub visible_share: f64,
    /// Share visible from the front that does not lie in a concave crease.
    pub front_share: f64,
    /// Number of points at which three or more pieces meet.
    pub n_triple_points: usize,
}

/// Contacts by which pieces hold each other. For each pair of pieces, the longest stretch of seam counts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ContactFigures {
    /// Pairs of pieces with a stretch that is long enough.
    pub n_contacts: usize,
    /// Length of the shortest of those stretches, mm, at the depth requested; `None` if there is none.
    pub shortest_mm: Option<f64>,
    /// Pairs of pieces that touch, but only by shorter stretches.
    pub n_short: usize,
    /// Number of faults of the contact graph, in pieces; 0 if no piece is the only link to others.
    pub n_faults: usize,
    /// Articulation pieces, each the only link between others.
    pub hold_alone: Vec<PatchId>,
}

/// Figures of one piece.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PieceFigures {
    /// Number of the piece.
    pub piece: PatchId,
    /// Area of its skin, mm².
    pub area_mm2: f64,
    /// True if its skin is connected, with one border and no handle.
    pub is_disk: bool,
    /// Cone of directions that its skin faces.
    pub faces: Cone,
}

/// Direction from a model to the viewer of its front, as a level unit vector. The model stands with `up`, a
/// unit vector, upwards.
///
/// A model with z up is viewed from −y, as 3D programs do. Other models are first turned by the least angle
/// that makes them stand. So a model with y up has its front towards z. This convention is defined only here.
pub fn front_of(up: [f64; 3]) -> [f64; 3] {
    /// Distance of 1 + up.z from 0 below which the model is upside down: then all turns are equally short.
    const OPPOSITE: f64 = 1e-9;
    let (up, z, front) = (Vec3::from(up), Vec3::Z, Vec3::NEG_Y);
    let both = z + up;
    if 1.0 + up.z < OPPOSITE {
        return front.to_array();
    }
    // Rodrigues' formula for the turn from z to `up`, of a vector at right angles to z.
    (front - both.dot(front) / (1.0 + up.z) * both).to_array()
}

/// Measures all figures of `surface`.
///
/// # Panics
/// If its mesh is not closed, which a [`SegmentedSurface`] promises to be.
pub fn figures(params: &FigureParams, surface: &SegmentedSurface) -> DivisionFigures {
    let topology = Topology::of_mesh(&surface.mesh).expect("a segmented surface is closed");
    let bvh = TriangleBvh::new(&surface.mesh);
    let pieces = pieces(surface, &topology);
    let areas: Vec<f64> = pieces.iter().map(|p| p.area_mm2).collect();
    let mirrored = |plane: &Plane| super::mirror::mirrored_share(plane, surface, &bvh);
    DivisionFigures {
        n_pieces: surface.n_patches,
        area_mm2: Spread::of(areas),
        seams: seams::seam_figures(params.up, surface, &topology, &bvh),
        contacts: ContactFigures::of(&surface.contact_graph_below(params.wall_mm, params.min_contact_mm)),
        pieces,
        mirrored_share: params.mirror.as_ref().map(mirrored),
    }
}

impl Spread {
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let n = values.len();
        if n == 0 {
            return Self::default();
        }
        Self {
            least: values[0],
            median: 0.5 * (values[(n - 1) / 2] + values[n / 2]),
            largest: values[n - 1],
        }
    }
}

impl ContactFigures {
    fn of(graph: &ContactGraph) -> Self {
        let (counted, short): (Vec<&Adjacency>, Vec<_>) =
            graph.contacts().iter().partition(|c| graph.counts(c));
        Self {
            n_contacts: counted.len(),
            shortest_mm: counted.iter().map(|c| c.longest_mm).min_by(f64::total_cmp),
            n_short: short.len(),
            n_faults: graph.n_faults(),
            hold_alone: graph.articulation_pieces(),
        }
    }
}

fn pieces(surface: &SegmentedSurface, topology: &Topology) -> Vec<PieceFigures> {
    let (mesh, n) = (&surface.mesh, surface.n_patches);
    let label: Vec<u32> = surface.patch_of_face.iter().map(|p| p.0).collect();
    let euler = euler_characteristics(mesh, topology, &label, n);
    let (component, n_components) = components(topology, |f, g| label[f as usize] == label[g as usize]);
    let mut n_parts = vec![0; n];
    let mut is_counted = vec![false; n_components];
    let mut skins = vec![Vec::new(); n];
    for (face, &patch) in label.iter().enumerate() {
        let is_known = std::mem::replace(&mut is_counted[component[face] as usize], true);
        n_parts[patch as usize] += usize::from(!is_known);
        skins[patch as usize].push((mesh.face_normal(face), mesh.face_area(face)));
    }
    let piece = |patch: usize| PieceFigures {
        piece: PatchId::from(patch),
        area_mm2: skins[patch].iter().map(|s| s.1).sum(),
        is_disk: n_parts[patch] == 1 && euler[patch] == 1,
        faces: cone::narrowest(&skins[patch]),
    };
    (0..n).into_par_iter().map(piece).collect()
}

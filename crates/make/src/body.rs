//! Shell bodies: the wall of the model, split into pieces that can leave (Sect. 4.1, Eq. 1).
//!
//! The wall `model − inner region` is split in the disassembly sequence, key first. The bodies therefore
//! partition the wall except for the gaps in the seams, and the outer triangles stay those of the model. Each
//! cut is the zero level of a field
//!
//! ```text
//! φ_p                                            beyond the sheets through p's seams (`sheets`);
//!                                                away from them ½ (min_j d_j − d_p), nearer to
//!                                                patch p than to any patch j that remains
//! U   = max_{t ≥ 0} skin_p(x − t s) + draft(t)   ahead of p's outer skin: must go with p
//! V   = max_{t ≥ 0} (E' + m)(x + t s) + draft(t) behind what remains, by a margin m: must stay
//! g_p = min(max(φ_p, U), −V)                     p's side is positive
//! ```
//!
//! so that along every line in direction s all remaining material comes before p: p leaves freely by
//! construction. Minima and maxima are rounded where two fields are about equal. A fragment that a cut
//! leaves on one side is given to the other side (`fragments`). The piece then keeps out of the way of the
//! fragments it gave, and takes along all that is ahead of those it got. Fragments smaller than the grid
//! resolves can still break off a body; they go to the neighbouring body (`chips`). The two sides of a cut
//! keep a small gap of constant width, from the inner side to the outer rim. Where outer patches hide each
//! other a little, only the seam shifts. The first-installed piece is the remainder.

mod cache;
mod chips;
mod error;
mod fragments;
mod grid;
mod separate;
mod sheets;
mod split;
#[cfg(test)]
mod tests;

pub use cache::WallGrid;
pub use error::BodyError;
pub(crate) use grid::outward;
pub use grid::{GridError, LocalField, PatchDistances, ShellGrid};
pub use separate::{ShellBodies, build};
use shellock_report::ParamProblem;

/// Parameters of making and cutting the wall. Lengths in mm.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyParams {
    /// Wall thickness, measured inwards from the model's surface. [0.8, 10]; 2.
    ///
    /// Published shells of this kind are 1.9–2.8 mm thick at 150 mm (Table 1).
    pub thickness_mm: f64,
    /// Spacing of the grid that fields are sampled on. (0, thickness / 2]; `None` takes the thickness over
    /// 2.5.
    ///
    /// At a third of the thickness the inner surface is off by 0.003 mm on average. For a 2 mm wall, 0.8 mm
    /// takes 0.6 of the time of that and passes the same checks. The shape of connectors does not depend on
    /// the spacing.
    pub cell_mm: Option<f64>,
    /// Distance by which each side of a seam stays back from the cut. [0, 0.4]; 0.05.
    pub seam_gap_mm: f64,
    /// Seam gap of a key that slides on rails, which is to be taken out by hand. [0, 0.4]; `None` where the
    /// key does not slide on rails.
    pub key_gap_mm: Option<f64>,
    /// Depth of the rim, within which gaps are reported apart from those beneath. [0.05, 5]; 1.
    pub rim_mm: f64,
}

impl Default for BodyParams {
    fn default() -> Self {
        Self {
            thickness_mm: 2.0,
            cell_mm: None,
            seam_gap_mm: 0.05,
            key_gap_mm: None,
            rim_mm: 1.0,
        }
    }
}

impl BodyParams {
    /// Grid spacing in mm: the chosen one, else the thickness over 2.5.
    pub fn cell_mm(&self) -> f64 {
        self.cell_mm.unwrap_or(self.thickness_mm / 2.5)
    }

    /// Lists every value out of range.
    pub fn problems(&self) -> Vec<ParamProblem> {
        let cell = self.cell_mm();
        [
            ParamProblem::unless_within("thickness", "mm", self.thickness_mm, 0.8, 10.0),
            ParamProblem::unless_within("grid spacing", "mm", cell, 0.05, self.thickness_mm / 2.0),
            ParamProblem::unless_within("seam gap", "mm", self.seam_gap_mm, 0.0, 0.4),
            self.key_gap_mm
                .and_then(|mm| ParamProblem::unless_within("gap of the key", "mm", mm, 0.0, 0.4)),
            ParamProblem::unless_within("rim", "mm", self.rim_mm, 0.05, 5.0),
        ]
        .into_iter()
        .flatten()
        .collect()
    }
}

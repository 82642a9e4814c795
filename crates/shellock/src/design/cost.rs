//! Expected cost of a job, from the size of what is made.
//!
//! Costs are linear in the area of the surface, its triangles and the number of pieces, as the stages are:
//! fields and cuts follow the area, the division follows the triangles, and contacts and connectors follow
//! the pieces. The coefficients fit first kits of 150 to 2200 cm² within a factor of 1.7, but for one that
//! took thrice as long (docs/notes/time.md). The climb to a stronger plan is left out, since it takes as much
//! time as it is given.

use crate::SegmentedSurface;

/// Expected cost of each part of a job, s on the reference machine: two cores with nothing beside.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Cost {
    /// Thickness of the wall.
    pub wall_s: f64,
    /// Division into pieces, with its key.
    pub division_s: f64,
    /// Plan of the pieces, without improvement.
    pub plan_s: f64,
    /// Pieces of a plan, with their verification.
    pub kit_s: f64,
}

/// Cost of one part, s: in all, for 100 cm² of surface, for 100 000 triangles, for a piece.
type Coefficients = [f64; 4];

const WALL: Coefficients = [1.3, 0.1, 0.5, 0.0];
const DIVISION: Coefficients = [1.0, 0.2, 0.7, 0.05];
const PLAN: Coefficients = [0.0, 0.15, 0.0, 0.1];
const KIT: Coefficients = [3.0, 1.0, 0.0, 0.3];

impl Cost {
    /// Expected cost of a job whose pieces are those of `surface`, mm.
    pub fn of(surface: &SegmentedSurface) -> Self {
        let area_mm2: f64 = surface.areas().iter().map(|(_, mm2)| mm2).sum();
        let n_triangles = surface.mesh.triangles.len() as f64;
        let size = [1.0, area_mm2 / 1e4, n_triangles / 1e5, surface.n_patches as f64];
        let of = |part: Coefficients| part.iter().zip(size).map(|(c, x)| c * x).sum();
        Self {
            wall_s: of(WALL),
            division_s: of(DIVISION),
            plan_s: of(PLAN),
            kit_s: of(KIT),
        }
    }
}

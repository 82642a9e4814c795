//! Curves along the seams on the inner surface, with a smooth frame at every point.

use shellock_geom::Vec3;
use shellock_plan::LatticePlan;
use shellock_report::PatchId;
use shellock_surface::seam::FramedLine;
use shellock_surface::{Seam, SegmentedSurface};

use crate::body::{ShellGrid, outward};

/// A seam on the inner surface between two pieces.
#[derive(Clone, Debug)]
pub struct Curve {
    /// The piece installed later.
    pub later: PatchId,
    /// The piece installed earlier.
    pub earlier: PatchId,
    /// Points about 1 mm apart. A loop's last point is its first.
    pub points: Vec<Vec3>,
    /// Unit tangents `u` along the curve.
    pub tangents: Vec<Vec3>,
    /// Outward unit normals `N`, perpendicular to `u`.
    pub normals: Vec<Vec3>,
    /// Unit vectors `v = ± N × u`, from the later piece to the earlier one.
    pub across: Vec<Vec3>,
    /// True if the curve is closed.
    pub is_loop: bool,
}

/// Makes one curve for each seam of the inner surface that is long enough to be resampled.
pub fn curves(grid: &ShellGrid, inner: &SegmentedSurface, plan: &LatticePlan) -> Vec<Curve> {
    inner
        .seams()
        .iter()
        .filter_map(|seam| curve(grid, seam, plan))
        .collect()
}

fn curve(grid: &ShellGrid, seam: &Seam, plan: &LatticePlan) -> Option<Curve> {
    let is_loop = seam.is_loop();
    let FramedLine {
        points,
        tangents,
        normals,
    } = FramedLine::along(&seam.points, is_loop, |_, p| outward(grid, p))?;
    let a_is_later = plan.position(seam.a) > plan.position(seam.b);
    let (later, earlier) = if a_is_later {
        (seam.a, seam.b)
    } else {
        (seam.b, seam.a)
    };
    // N × u points to the left, where patch a lies.
    let side = if a_is_later { -1.0 } else { 1.0 };
    let across = normals
        .iter()
        .zip(&tangents)
        .map(|(n, u)| side * n.cross(*u))
        .collect();
    Some(Curve {
        later,
        earlier,
        points,
        tangents,
        normals,
        across,
        is_loop,
    })
}

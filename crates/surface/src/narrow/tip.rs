//! Tips of patches: corners between two seams that meet at a sharp angle.
//!
//! A disk of radius r that rolls within the patch does not reach the end of a corner. Between seams at an
//! angle θ, the end is r / sin(θ/2) away from the disk's centre: r along a straight seam, 1.4 r in a right
//! angle, 2 r at 60°, 3.9 r at 30°.

use shellock_geom::Vec3;
use shellock_report::PatchId;

use super::web::Web;

/// Least distance of a tip's end from the core, in radii of the disk: seams at less than [`TIP_DEG`].
const LEAST_REACH: f64 = 2.37;
/// Greatest angle of a tip, degrees.
pub const TIP_DEG: f64 = 50.0;
/// Distance from the core at which a tip begins, in radii. Along a straight seam, distances along edges are
/// up to a quarter too long.
const BEGIN: f64 = 1.25;

/// A sharp corner of a patch.
#[derive(Clone, Debug, PartialEq)]
pub struct Tip {
    /// Patch with the corner.
    pub patch: PatchId,
    /// Angle of the corner that reaches as far, degrees.
    pub angle_deg: f64,
    /// End of the corner.
    pub at: Vec3,
    /// Triangles of the surface that are mostly in the corner.
    pub part: Vec<u32>,
}

/// Finds the corners of less than [`TIP_DEG`] that a disk of `radius_mm` does not fill, longest first.
/// `depth` is the distance of every point from the border, mm.
pub(super) fn tips(web: &Web, depth: &[f64], radius_mm: f64) -> Vec<Tip> {
    let is_core = |v: usize| depth[v] >= radius_mm;
    let reach: Vec<f64> = web
        .distances(is_core)
        .into_iter()
        .map(|mm| mm / radius_mm)
        .collect();
    let mut ends: Vec<u32> = (0..reach.len() as u32)
        .filter(|&v| reach[v as usize].is_finite() && reach[v as usize] > LEAST_REACH)
        .collect();
    ends.sort_by(|&a, &b| reach[b as usize].total_cmp(&reach[a as usize]).then(a.cmp(&b)));
    let mut is_taken = vec![false; reach.len()];
    let mut found = Vec::new();
    for end in ends {
        if is_taken[end as usize] {
            continue;
        }
        let is_tip = web.reach(end, |v| reach[v].is_finite() && reach[v] > BEGIN);
        (0..is_tip.len())
            .filter(|&v| is_tip[v])
            .for_each(|v| is_taken[v] = true);
        let patch = web.patch[end as usize];
        let holds = |t: [u32; 3]| t.into_iter().any(|v| is_tip[v as usize]);
        found.push(Tip {
            patch,
            angle_deg: 2.0 * (1.0 / reach[end as usize]).asin().to_degrees(),
            at: web.place(end),
            part: web.sources_with(patch, holds),
        });
    }
    found
}

//! Necks of patches, between two seams or between a seam and the key.
//!
//! Every point of a patch has a distance to the patch's border. Where it is largest, the patch has a core; on
//! the way from one core to another it is least at a saddle, where the patch is twice that distance wide:
//!
//! ```text
//!     ____________            ________
//!    |            \__________/        |
//!    |    core   ·   saddle  ·  core  |
//!    |             __________         |
//!    |____________/          \________|
//! ```
//!
//! Points are visited from the largest distance to the smallest, and joined to their neighbours that were
//! visited before. Where two components meet that both have a core, there is a saddle.

use shellock_geom::Vec3;
use shellock_geom::union_find::root;
use shellock_report::PatchId;

use super::web::Web;

/// A narrow place of a patch, with a part of the patch beyond it.
#[derive(Clone, Debug, PartialEq)]
pub struct Neck {
    /// Patch with the narrow place.
    pub patch: PatchId,
    /// Width of the patch there, mm.
    pub width_mm: f64,
    /// Middle of the neck.
    pub at: Vec3,
    /// Area of the smaller part, mm².
    pub part_mm2: f64,
    /// Triangles of the surface that are mostly in the smaller part.
    pub part: Vec<u32>,
}

/// The place where two parts of a patch meet.
struct Saddle {
    point: u32,
    /// Deepest points of the two parts.
    cores: [u32; 2],
}

/// Finds the places nearer to the border than `core_mm` where two parts meet that reach deeper than that,
/// narrowest first. `depth` is the distance of every point from the border, mm.
pub(super) fn necks(web: &Web, depth: &[f64], core_mm: f64) -> Vec<Neck> {
    let saddles = saddles(web, depth, core_mm);
    let mut found: Vec<Neck> = saddles.into_iter().map(|s| neck(web, &s, depth)).collect();
    found.sort_by(|a, b| a.width_mm.total_cmp(&b.width_mm));
    found
}

fn saddles(web: &Web, depth: &[f64], core_mm: f64) -> Vec<Saddle> {
    let mut order: Vec<u32> = (0..depth.len() as u32)
        .filter(|&v| depth[v as usize].is_finite())
        .collect();
    order.sort_by(|&a, &b| depth[b as usize].total_cmp(&depth[a as usize]).then(a.cmp(&b)));
    // The root of each component is its deepest point.
    let mut parent = vec![u32::MAX; depth.len()];
    let mut found = Vec::new();
    for v in order {
        parent[v as usize] = v;
        for &(w, _) in &web.links[v as usize] {
            if parent[w as usize] == u32::MAX {
                continue;
            }
            let (a, b) = (root(&mut parent, v), root(&mut parent, w));
            if a == b {
                continue;
            }
            let (deep, shallow) = if depth[a as usize] >= depth[b as usize] {
                (a, b)
            } else {
                (b, a)
            };
            if depth[v as usize] < core_mm && depth[shallow as usize] >= core_mm {
                found.push(Saddle {
                    point: v,
                    cores: [deep, shallow],
                });
            }
            parent[shallow as usize] = deep;
        }
    }
    found
}

fn neck(web: &Web, saddle: &Saddle, depth: &[f64]) -> Neck {
    let limit_mm = depth[saddle.point as usize];
    let reach = |core: u32| web.reach(core, |v| depth[v] > limit_mm);
    let [one, other] = saddle.cores.map(reach);
    let (from_one, from_other) = (web.distances(|v| one[v]), web.distances(|v| other[v]));
    let area = |a: &[f64], b: &[f64]| -> f64 {
        let nearer = (0..a.len()).filter(|&v| a[v] < b[v]);
        nearer.map(|v| web.area_mm2[v]).sum()
    };
    let areas = [area(&from_one, &from_other), area(&from_other, &from_one)];
    let (small, large) = if areas[0] < areas[1] {
        (&from_one, &from_other)
    } else {
        (&from_other, &from_one)
    };
    let patch = web.patch[saddle.point as usize];
    let lead_mm = |v: u32| (large[v as usize].min(1e9) - small[v as usize].min(1e9)).clamp(-1e3, 1e3);
    Neck {
        patch,
        width_mm: 2.0 * limit_mm,
        at: web.place(saddle.point),
        part_mm2: areas[0].min(areas[1]),
        part: web.sources_with(patch, |t| t.into_iter().map(lead_mm).sum::<f64>() > 0.0),
    }
}

//! Regions where a model is too thin to be hollow.
//!
//! There is a cavity below a point of the surface if the point H below it is as far from the whole surface.
//! Otherwise the wall of the other side, or of a near bend, meets this one, and the piece is solid there.

use serde::Serialize;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::topology::components;
use shellock_geom::{Topology, TriMesh, Vec3};

/// Least distance of the point below from the surface, as a share of H: flat faces of a coarse mesh lie a
/// little inside the surface.
pub(super) const LEAST_SHARE: f64 = 0.9;

/// A connected part of the surface with no cavity below.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SolidRegion {
    /// Area of the region, mm².
    pub area_mm2: f64,
    /// Centre of the region, weighted by area, mm.
    pub at: [f64; 3],
}

/// Returns true if walls of `thickness_mm` leave no cavity below triangle `t`.
pub(super) fn is_solid(mesh: &TriMesh, bvh: &TriangleBvh, t: usize, thickness_mm: f64) -> bool {
    let below = mesh.face_center(t) - thickness_mm * mesh.face_normal(t);
    bvh.nearest(below, (LEAST_SHARE * thickness_mm).powi(2)).is_some()
}

/// Connected regions of triangles with no hollow area, the largest first.
pub(super) fn regions(mesh: &TriMesh, hollow_mm2: &[f64]) -> Vec<SolidRegion> {
    let Some(topology) = Topology::of_mesh(mesh) else {
        return Vec::new();
    };
    let is_solid = |t: u32| hollow_mm2[t as usize] == 0.0;
    let (region_of_face, n_regions) = components(&topology, |a, b| is_solid(a) == is_solid(b));
    let mut sums = vec![(0.0, Vec3::ZERO); n_regions];
    for (t, region) in (0..).zip(region_of_face).filter(|(t, _)| is_solid(*t)) {
        let (area_mm2, moment) = &mut sums[region as usize];
        *area_mm2 += mesh.face_area(t as usize);
        *moment += mesh.face_area(t as usize) * mesh.face_center(t as usize);
    }
    sums.retain(|(area_mm2, _)| *area_mm2 > 0.0);
    sums.sort_by(|a, b| b.0.total_cmp(&a.0));
    sums.into_iter()
        .map(|(area_mm2, moment)| SolidRegion {
            area_mm2,
            at: (moment / area_mm2).to_array(),
        })
        .collect()
}

//! Checks that the pieces together still show the model's outer surface.

use rayon::prelude::*;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{Solid, TriMesh, Vec3};

use super::body::Body;
use super::limits::{LEAST_KEPT, WIDEST_HALF_GAP_MM};
use super::{Check, Finding, sample};
use crate::{IdVec, PatchId};

/// Number of sample points. The share of lost surface is known to 0.1 % (one sigma at the limit).
const N_SAMPLES: usize = 20_000;
/// Distance to a piece below which a point of the model counts as kept, mm.
const KEPT_MM: f64 = 0.02;

/// Samples the model and measures the distance to the nearest piece.
pub fn check(model: &Solid, bodies: &IdVec<PatchId, Body>, seed: u64) -> (Check, Option<Finding>) {
    let mut all = TriMesh::default();
    for body in bodies.as_slice() {
        let first = all.points.len() as u32;
        all.points.extend(&body.mesh.points);
        all.triangles
            .extend(body.mesh.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    let bvh = TriangleBvh::new(&all);
    let samples = sample::on_surface(model.mesh(), N_SAMPLES, seed);
    let distances: Vec<f64> = samples
        .par_iter()
        .map(|s| {
            bvh.nearest(s.point, f64::INFINITY)
                .map_or(f64::INFINITY, |n| n.distance_sq.sqrt())
        })
        .collect();
    let n_lost = distances.iter().filter(|&&d| d >= KEPT_MM).count();
    let fraction = n_lost as f64 / samples.len().max(1) as f64;
    let (mut farthest_mm, mut at) = (0.0, Vec3::ZERO);
    for (sample, &distance) in samples.iter().zip(&distances) {
        if distance > farthest_mm {
            (farthest_mm, at) = (distance, sample.point);
        }
    }
    let ok = 1.0 - fraction > LEAST_KEPT && farthest_mm < WIDEST_HALF_GAP_MM;
    let figure = format!(
        "{:.3} % of the surface; farthest {farthest_mm:.3} mm",
        100.0 * (1.0 - fraction)
    );
    let finding = (!ok).then_some(Finding::SurfaceLost {
        fraction,
        at: at.to_array(),
    });
    (Check::new("outer surface kept", ok, figure), finding)
}

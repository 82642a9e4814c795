//! Cone of directions that a piece's skin faces.

use serde::Serialize;
use shellock_geom::Vec3;

/// Share of the area that a cone must hold. The rest is rolled edges and noise.
const HELD: f64 = 0.95;

/// Steps of the search for the axis, rad. Each is repeated while it improves the cone; then the next, half as
/// long, follows.
const STEPS_RAD: [f64; 7] = [0.4, 0.2, 0.1, 0.05, 0.025, 0.0125, 0.00625];

/// Number of directions in which each step is tried.
const N_WAYS: usize = 8;

/// Greatest number of steps of one length.
const MOST_STEPS: usize = 8;

/// The narrowest cone found that holds the normals of 95 % of a piece's skin.
///
/// Up to 90° the piece faces one way: no part of that skin is undercut along the axis. So its own shape lets
/// it leave along the axis, and it prints with that side up. Pieces around it may still block it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Cone {
    /// Unit vector of the axis.
    pub axis: [f64; 3],
    /// Angle from the axis to the cone's side, [0, 180]°.
    pub half_angle_deg: f64,
}

impl Cone {
    /// Returns true if no part of the skin in the cone is undercut along its axis.
    pub fn is_one_way(&self) -> bool {
        /// Greatest half angle of a piece that faces one way. The last triangles of a half ball face level;
        /// more is a matter of rounding.
        const LEVEL_DEG: f64 = 90.0;
        self.half_angle_deg <= LEVEL_DEG
    }
}

/// Finds the narrowest cone of a skin's normals, each given with its area. Descends from the best of the mean
/// normal and the axes.
pub(super) fn narrowest(skin: &[(Vec3, f64)]) -> Cone {
    let mean: Vec3 = skin.iter().map(|&(normal, area)| area * normal).sum();
    let axes = [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|a| [a, -a]);
    let mut ordered = Vec::with_capacity(skin.len());
    let mut least_dot = |axis: Vec3| least_dot(skin, axis, &mut ordered);
    let first = mean.normalize_or(Vec3::Z);
    let mut best = (first, least_dot(first));
    for axis in axes {
        let dot = least_dot(axis);
        if dot > best.1 {
            best = (axis, dot);
        }
    }
    for step in STEPS_RAD {
        for _ in 0..MOST_STEPS {
            let around = directions_around(best.0, step).map(|axis| (axis, least_dot(axis)));
            let next = around
                .into_iter()
                .fold(best, |b, a| if a.1 > b.1 { a } else { b });
            if next.1 <= best.1 {
                break;
            }
            best = next;
        }
    }
    Cone {
        axis: best.0.to_array(),
        half_angle_deg: best.1.clamp(-1.0, 1.0).acos().to_degrees(),
    }
}

/// Directions at `angle_rad` from `axis`, evenly around it.
fn directions_around(axis: Vec3, angle_rad: f64) -> [Vec3; N_WAYS] {
    let (u, v) = axis.any_orthonormal_pair();
    std::array::from_fn(|i| {
        let (sin, cos) = (std::f64::consts::TAU * i as f64 / N_WAYS as f64).sin_cos();
        (axis * angle_rad.cos() + (u * cos + v * sin) * angle_rad.sin()).normalize()
    })
}

/// Cosine of the half angle of the cone around `axis` that holds the required share; 1 if there is no area.
fn least_dot(skin: &[(Vec3, f64)], axis: Vec3, ordered: &mut Vec<(f64, f64)>) -> f64 {
    ordered.clear();
    ordered.extend(skin.iter().map(|&(normal, area)| (normal.dot(axis), area)));
    ordered.sort_unstable_by(|x, y| y.0.total_cmp(&x.0).then(x.1.total_cmp(&y.1)));
    let enough = HELD * skin.iter().map(|s| s.1).sum::<f64>();
    let mut held = 0.0;
    for &(dot, area) in ordered.iter() {
        held += area;
        if held >= enough {
            return if area > 0.0 { dot } else { 1.0 };
        }
    }
    1.0
}

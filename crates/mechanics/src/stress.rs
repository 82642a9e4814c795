//! Stress levels of material, and a robust measure of them.
//!
//! At re-entrant corners and under point forces, elasticity has no largest stress: the finer the mesh, the
//! higher the value. So the figure to compare with a material's strength is the one that all but
//! [`PEAK_SHARE`] of the volume stay under.

use shellock_geom::Vec3;

/// Share of the volume whose stress counts as a peak: an artefact of the model, which a ductile print evens
/// out.
pub const PEAK_SHARE: f64 = 0.005;

/// Stress level of some of the material, MPa (von Mises).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StressLevel {
    /// Largest stress of all samples.
    pub largest_mpa: f64,
    /// Stress that all but 0.5 % of the volume stay under.
    pub robust_mpa: f64,
    /// Position of the smallest sample that is not below `robust_mpa`.
    pub at: Vec3,
}

/// Stress at one point, with the volume that the point represents.
#[derive(Clone, Copy, Debug)]
pub struct StressSample {
    /// Von Mises stress, MPa, ≥ 0.
    pub stress_mpa: f64,
    /// Volume that the sample represents, mm³.
    pub volume_mm3: f64,
    /// Position of the sample, mm.
    pub at: Vec3,
}

impl StressLevel {
    /// Stress level of all samples; zero if there are none.
    pub fn of(mut samples: Vec<StressSample>) -> Self {
        samples.sort_by(|a, b| b.stress_mpa.total_cmp(&a.stress_mpa));
        let Some(largest) = samples.first() else {
            return Self::default();
        };
        let peak_mm3 = PEAK_SHARE * samples.iter().map(|s| s.volume_mm3).sum::<f64>();
        let mut above_mm3 = 0.0;
        let robust = samples.iter().find(|s| {
            above_mm3 += s.volume_mm3;
            above_mm3 >= peak_mm3
        });
        let robust = robust.unwrap_or(largest);
        Self {
            largest_mpa: largest.stress_mpa,
            robust_mpa: robust.stress_mpa,
            at: robust.at,
        }
    }
}

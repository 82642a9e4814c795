//! Pushes that a held piece must resist: the plan estimates them and the verification tries them.

use shellock_geom::Vec3;

use crate::LatticeDirection;

/// Number of pushes: the 26 directions of the lattice and 40 spread over the sphere.
pub const N_PUSHES: usize = LatticeDirection::COUNT + N_SPHERE;

const N_SPHERE: usize = 40;

/// Length of a push beyond three clearances, mm: more than all play and the roundness of printed edges.
const PUSH_MM: f64 = 0.6;

/// Unit vectors of the pushes: the lattice's, then points of a spiral over the sphere.
pub fn directions() -> [Vec3; N_PUSHES] {
    let spiral = (0..N_SPHERE).map(|i| {
        let i = i as f64 + 0.5;
        let (turn, z) = (
            std::f64::consts::PI * (1.0 + 5f64.sqrt()) * i,
            1.0 - 2.0 * i / N_SPHERE as f64,
        );
        let radius = (1.0 - z * z).sqrt();
        Vec3::new(radius * turn.cos(), radius * turn.sin(), z)
    });
    let mut all = LatticeDirection::all().map(LatticeDirection::unit).chain(spiral);
    std::array::from_fn(|_| all.next().expect("as many as N_PUSHES"))
}

/// Length of a push, mm, for faces that are `clearance_mm` apart.
pub fn length_mm(clearance_mm: f64) -> f64 {
    3.0 * clearance_mm + PUSH_MM
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_direction_is_farther_than_25_degrees_from_a_push() {
        let pushes = directions();
        assert!(pushes.iter().all(|d| (d.length() - 1.0).abs() < 1e-12));
        for i in 0..2000 {
            let t = f64::from(i);
            let d = Vec3::new((1.7 * t).sin(), (2.3 * t).cos(), (0.9 * t + 1.0).sin()).normalize();
            let nearest = pushes.iter().map(|p| p.dot(d)).fold(-1.0, f64::max);
            assert!(nearest > 25f64.to_radians().cos(), "{d}");
        }
    }
}

//! Stresses in walls and connectors.
//!
//! Von Mises stress is sampled at the corners of the tetrahedra, where bending stress is largest, each with a
//! quarter of the volume.

use shellock_geom::Vec3;
use shellock_mechanics::{Material, StressSample};

use super::element::{Order, lame, volume_6, von_mises_mpa};

/// Stress samples at the four corners of a tetrahedron.
pub(super) fn samples(
    order: Order,
    corners: [Vec3; 4],
    material: &Material,
    displacement_mm: &[Vec3; 10],
) -> [StressSample; 4] {
    let volume_mm3 = volume_6(corners).abs() / 24.0;
    std::array::from_fn(|i| {
        let mut l = [0.0; 4];
        l[i] = 1.0;
        let stress_mpa = von_mises_mpa(order, corners, lame(material), displacement_mm, l);
        StressSample {
            stress_mpa,
            volume_mm3,
            at: corners[i],
        }
    })
}

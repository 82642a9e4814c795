//! Stresses at both faces of each triangle.

use nalgebra::{SVector, Vector3};
use rayon::prelude::*;

use super::solver::{Displacements, ShellSolver};

/// Plane stress at one face of the wall.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FaceStress {
    /// Von Mises' equivalent stress, MPa. ≥ 0.
    pub von_mises_mpa: f64,
    /// Principal stresses in the face, the greater first, MPa; positive in tension. The third, normal to the
    /// face, is 0.
    pub principal_mpa: [f64; 2],
}

/// Stress at the centre of a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShellStress {
    /// Stress at the face that the normal points out of.
    pub outer: FaceStress,
    /// Stress at the opposite face.
    pub inner: FaceStress,
}

impl ShellStress {
    /// Von Mises' equivalent stress at the face where it is greater, MPa.
    pub fn von_mises_mpa(&self) -> f64 {
        self.outer.von_mises_mpa.max(self.inner.von_mises_mpa)
    }
}

impl FaceStress {
    /// Computes the stresses from σ_x, σ_y and τ_xy.
    fn new(stress: Vector3<f64>) -> Self {
        let (mean, half, shear) = (0.5 * (stress.x + stress.y), 0.5 * (stress.x - stress.y), stress.z);
        let radius = half.hypot(shear);
        Self {
            von_mises_mpa: mean.hypot(3.0_f64.sqrt() * radius),
            principal_mpa: [mean + radius, mean - radius],
        }
    }
}

impl ShellSolver<'_> {
    /// Cauchy stress at both faces of every triangle, in the order of the mesh's triangles.
    ///
    /// # Panics
    /// If `displacements` has fewer points than the shell.
    pub fn stresses(&self, displacements: &Displacements) -> Vec<ShellStress> {
        let model = self.model;
        let at_face = 0.5 * self.thickness_mm;
        (model.triangles.par_iter().zip(&model.elements))
            .map(|(corners, element)| {
                let mut u = SVector::<f64, 18>::zeros();
                for (slot, &v) in u.as_mut_slice().chunks_mut(6).zip(corners) {
                    slot[..3].copy_from_slice(&displacements.moves_mm[v as usize].to_array());
                    slot[3..].copy_from_slice(&displacements.turns_rad[v as usize].to_array());
                }
                let (mean, bent) = (element.membrane * u, element.curvature * u * at_face);
                ShellStress {
                    outer: FaceStress::new(model.elasticity * (mean + bent)),
                    inner: FaceStress::new(model.elasticity * (mean - bent)),
                }
            })
            .collect()
    }
}

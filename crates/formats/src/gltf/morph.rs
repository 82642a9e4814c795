//! Morph targets: points moved by weighted differences.

use glam::DVec3;

use super::super::ReadError;
use super::document::Primitive;
use super::error;
use super::primitives::Piece;
use super::values::{Accessors, Shape};

impl Accessors<'_> {
    /// Adds the weighted differences of each target to the points of `piece`. Targets without a weight or
    /// without positions have no effect.
    pub(super) fn morph(
        &self,
        primitive: &Primitive,
        weights: &[f64],
        piece: &mut Piece,
    ) -> Result<(), ReadError> {
        self.effort.spend(primitive.targets.len().min(weights.len()))?;
        for (target, &weight) in primitive.targets.iter().zip(weights) {
            let Some(&which) = target.get("POSITION").filter(|_| weight != 0.0) else {
                continue;
            };
            let differences = self.values_or_zeros(which, Shape::Vec3)?;
            if differences.count != piece.n_rows {
                return Err(error(format!(
                    "a morph target has {} points instead of {}",
                    differences.count, piece.n_rows
                )));
            }
            self.effort.spend(piece.used.len())?;
            for (point, &row) in piece.points.iter_mut().zip(&piece.used) {
                *point += weight * DVec3::from_array(differences.row(row as usize));
            }
        }
        Ok(())
    }
}

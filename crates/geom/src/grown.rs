//! Growing of small bodies on all sides, by the distance to their surface on a grid.

use crate::band::Band;
use crate::marching_cubes::{OffBand, contour};
use crate::signed_distance::SignedDistance;
use crate::{Solid, Volume};

/// Number of grid cells along the distance grown. The new surface is accurate to about a tenth of a cell.
const CELLS: f64 = 2.0;

/// Grows `body` by `by_mm` on all sides. `None` if `body` is empty or too large for such a fine grid.
pub fn grown(body: &Volume, by_mm: f64) -> Option<Volume> {
    let solid = Solid::new(body.to_mesh()).ok()?;
    let cell_mm = by_mm / CELLS;
    let around_mm = by_mm + 2.0 * cell_mm;
    let distance = SignedDistance::new(&solid);
    let bounds = solid.mesh().bounds();
    let (band, depth) = Band::along(&distance, bounds, cell_mm, around_mm, cell_mm, around_mm).ok()?;
    let field: Vec<f32> = depth.iter().map(|d| d + by_mm as f32).collect();
    Volume::from_closed_mesh(&contour(&band, &field, OffBand::LikeNeighbours)).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Aabb, Vec3};

    #[test]
    fn a_cube_grows_by_plates_quarter_rods_and_a_ball() {
        let (side, by) = (4.0, 0.5);
        let cube = Volume::cuboid(Aabb {
            min: Vec3::ZERO,
            max: Vec3::splat(side),
        });
        let pi = std::f64::consts::PI;
        let volume =
            side.powi(3) + 6.0 * side * side * by + 3.0 * pi * by * by * side + 4.0 / 3.0 * pi * by.powi(3);
        let grown = grown(&cube, by).expect("small");
        assert!((grown.volume() / volume - 1.0).abs() < 0.01, "{}", grown.volume());
        assert!(cube.subtract(&grown).volume() < 1e-9);
    }

    #[test]
    fn nothing_grows_to_nothing() {
        assert!(grown(&Volume::empty(), 1.0).is_none());
    }
}

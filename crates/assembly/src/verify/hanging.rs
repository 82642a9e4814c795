//! Parts of pieces that hang on a neck so thin that it breaks.

use shellock_geom::TriMesh;
use shellock_geom::opening::hanging_parts;
use shellock_report::PatchId;

use super::Finding;
use super::limits::{NECK_WALLS, NECKS};

/// Edge of the voxels, as a share of a neck's width.
const VOXEL_SHARE: f64 = 1.0 / 6.0;

/// Finds the largest part of a closed `mesh` that hangs on a thin neck.
///
/// Necks are thinner than the mean wall of the piece, twice its volume over its area, so that the wall itself
/// is none. A neck of the `model` itself does not count: no division avoids it.
pub fn largest_part(piece: PatchId, mesh: &TriMesh, model: Option<&TriMesh>) -> Option<Finding> {
    let wall_mm = 2.0 * mesh.signed_volume() / mesh.area();
    let mut found = NECKS.into_iter().filter_map(|(neck_mm, part_mm3)| {
        let width_mm = neck_mm.min(NECK_WALLS * wall_mm);
        let parts = hanging_parts(mesh, model, width_mm, VOXEL_SHARE * width_mm, part_mm3);
        parts.first().map(|part| Finding::Hanging {
            piece,
            volume_mm3: part.core_mm3,
            width_mm,
            at: part.at.to_array(),
        })
    });
    found.next()
}

#[cfg(test)]
mod tests {
    use shellock_geom::Volume;
    use shellock_testkit::shapes::cuboid;

    use super::*;

    /// Two plates with a bar of this width between them.
    fn plates(wall_mm: f64, bar_mm: f64) -> TriMesh {
        let plate = |x: f64| cuboid([x, 0.0, 0.0], [x + 15.0, 15.0, wall_mm]);
        let bar = cuboid([14.0, 7.0, 0.0], [18.0, 7.0 + bar_mm, wall_mm]);
        let all: Volume = plate(0.0).union(&plate(17.0)).union(&bar);
        all.to_mesh()
    }

    #[test]
    fn a_plate_on_a_narrow_bar_hangs_and_one_on_a_wide_bar_or_a_thin_wall_does_not() {
        let width = |wall_mm, bar_mm| match largest_part(PatchId(2), &plates(wall_mm, bar_mm), None) {
            Some(Finding::Hanging { width_mm, .. }) => Some(width_mm),
            _ => None,
        };
        assert_eq!(width(2.0, 0.7), Some(NECKS[0].0));
        assert_eq!(width(2.5, 1.1), Some(NECKS[1].0));
        assert_eq!(width(2.0, 1.6), None);
        assert_eq!(width(0.8, 1.0), None);
    }
}

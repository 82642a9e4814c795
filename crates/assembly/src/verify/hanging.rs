//! Parts of pieces that hang on a neck so thin that it breaks.

use shellock_geom::TriMesh;
use shellock_geom::opening::{Neck, hanging_parts};
use shellock_report::PatchId;

use super::Finding;
use super::limits::{NECK_PUSH_N, NECK_STRENGTH_MPA, NECK_WALLS, NECKS};

/// Edge of the voxels, as a share of a neck's width.
const VOXEL_SHARE: f64 = 1.0 / 6.0;

/// Finds the largest part of a closed `mesh` that hangs on a thin neck.
///
/// Necks are thinner than the mean wall of the piece, twice its volume over its area, so that the wall itself
/// is none. A neck of the `model` itself does not count: no division avoids it. A neck of the greater width
/// does not count where it is so long that it bears a push.
pub fn largest_part(piece: PatchId, mesh: &TriMesh, model: Option<&TriMesh>) -> Option<Finding> {
    let wall_mm = 2.0 * mesh.signed_volume() / mesh.area();
    let [thin, wider] = NECKS;
    let mut found =
        [(thin, false), (wider, true)]
            .into_iter()
            .filter_map(|((neck_mm, part_mm3), may_be_long)| {
                let width_mm = neck_mm.min(NECK_WALLS * wall_mm);
                let mut parts = hanging_parts(mesh, model, width_mm, VOXEL_SHARE * width_mm, part_mm3);
                if may_be_long {
                    parts.retain(|part| !part.neck.is_some_and(bears_a_push));
                }
                parts.first().map(|part| Finding::Hanging {
                    piece,
                    volume_mm3: part.core_mm3,
                    width_mm,
                    at: part.at.to_array(),
                })
            });
    found.next()
}

/// Returns true if a neck that is no thinner than the first of [`NECKS`] bears a push at the far end of what
/// hangs on it, such as the root of a channel's wall that is as long as the channel: `σ A t / 6 ≥ F l`, the
/// bending of a strip.
fn bears_a_push(neck: Neck) -> bool {
    let thick_mm = NECKS[0].0;
    NECK_STRENGTH_MPA * neck.area_mm2 * thick_mm / 6.0 >= NECK_PUSH_N * neck.lever_mm
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
    fn a_rib_on_a_long_root_does_not_hang_and_one_on_a_short_root_does() {
        // A wall of 3 mm with a rib along it, whose root is 1.1 mm thick and 2 mm high.
        let on_root = |root_mm: f64| {
            let wall = cuboid([0.0; 3], [50.0, 40.0, 3.0]);
            let root = cuboid([5.0, 19.0, 2.0], [5.0 + root_mm, 20.1, 6.0]);
            let rib = cuboid([5.0, 18.0, 5.0], [45.0, 21.0, 8.0]);
            let mesh = wall.union(&root).union(&rib).to_mesh();
            largest_part(PatchId(2), &mesh, None).is_some()
        };
        assert!(!on_root(40.0));
        assert!(on_root(8.0));
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

//! Points in which the surface touches itself: each fan of triangles gets its own point.

use super::{Draft, Repair, RepairKind};
use crate::Vec3;
use crate::check::fans;

/// Gives each fan of triangles around a point its own copy of that point. The surface's shape stays the same.
pub(super) fn part(draft: &mut Draft) -> Option<Repair> {
    let mut fan_of_corner = fans(&draft.mesh);
    let n_points = draft.mesh.points.len();
    // The first fan of a point keeps it; each other fan gets a copy.
    let mut first_fan = vec![None; n_points];
    let mut copy_of_fan = std::collections::BTreeMap::new();
    let (mut is_pinched, mut at) = (vec![false; n_points], Vec3::ZERO);
    for corner in 0..3 * draft.mesh.triangles.len() as u32 {
        let fan = fan_of_corner.find(corner);
        let slot = &mut draft.mesh.triangles[corner as usize / 3][corner as usize % 3];
        let point = *slot as usize;
        if *first_fan[point].get_or_insert(fan) == fan {
            continue;
        }
        let points = &mut draft.mesh.points;
        if copy_of_fan.is_empty() {
            at = points[point];
        }
        *slot = *copy_of_fan.entry(fan).or_insert_with(|| {
            points.push(points[point]);
            points.len() as u32 - 1
        });
        is_pinched[point] = true;
    }
    let count = is_pinched.iter().filter(|pinched| **pinched).count();
    (count > 0).then_some(Repair {
        kind: RepairKind::Parted,
        count,
        at,
    })
}

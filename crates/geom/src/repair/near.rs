//! Cracks: points along open edges that should be one.

use std::collections::BTreeMap;

use super::{Draft, NEAR_SHARE, Repair, RepairKind};
use crate::Vec3;
use crate::check::open_edges;
use crate::weld::reindex;

/// Merges points on open edges within [`NEAR_SHARE`] of the diagonal. Keeps the draft if that closes nothing.
///
/// A point merges into the first one near it that is not merged itself, so that a row of near points does not
/// become one point.
pub(super) fn merge(draft: &mut Draft) -> Option<Repair> {
    let open = open_edges(&draft.mesh);
    if open.is_empty() {
        return None;
    }
    let within = NEAR_SHARE * draft.mesh.bounds().diagonal();
    let mut ends: Vec<u32> = open.iter().flat_map(|edge| [edge.from, edge.to]).collect();
    ends.sort_unstable();
    ends.dedup();
    let mut stands_for: Vec<u32> = (0..draft.mesh.points.len() as u32).collect();
    // Unmerged points keep this distance from each other, so cells of that size hold few of them.
    let mut standing: BTreeMap<[i64; 3], Vec<u32>> = BTreeMap::new();
    let (mut count, mut at) = (0, Vec3::ZERO);
    for point in ends {
        let position = draft.mesh.points[point as usize];
        let near = neighbours(cell(position, within))
            .filter_map(|c| standing.get(&c))
            .flatten();
        let near = near
            .copied()
            .filter(|&p| draft.mesh.points[p as usize].distance(position) <= within)
            .min();
        match near {
            Some(other) => {
                stands_for[point as usize] = other;
                if count == 0 {
                    at = position;
                }
                count += 1;
            }
            None => standing.entry(cell(position, within)).or_default().push(point),
        }
    }
    let merged = reindex(&draft.mesh, &stands_for);
    let source = merged
        .kept_face
        .iter()
        .map(|&face| draft.source[face as usize])
        .collect();
    let merged = Draft {
        mesh: merged.mesh,
        source,
    };
    if count == 0 || merged.mesh.triangles.is_empty() || merged.n_open() >= open.len() {
        return None;
    }
    *draft = merged;
    Some(Repair {
        kind: RepairKind::Merged { within },
        count,
        at,
    })
}

fn cell(point: Vec3, size: f64) -> [i64; 3] {
    point.to_array().map(|x| (x / size).floor() as i64)
}

/// Indices of the cell and the 26 cells around it.
fn neighbours(at: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    (0..27).map(move |i: i64| {
        let step = [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1];
        std::array::from_fn(|axis| at[axis].saturating_add(step[axis]))
    })
}

//! Pairs of nearby triangles, found by descending two hierarchies at once.

use super::pair::{box_distance_sq, sweep_box, swept_box};
use crate::bvh::TriangleBvh;

/// Calls `near(i, j, apart_sq, limit_sq)` for all pairs of triangles with bounding boxes within `√limit_sq`
/// of each other. `i` is a triangle of `a`, moved along z by all `travels`, and `j` one of `b`, both in leaf
/// order.
/// `apart_sq` is the squared distance of the boxes. `near` may lower the limit. Nearer boxes come first.
pub(super) fn for_near_pairs(
    a: &TriangleBvh,
    b: &TriangleBvh,
    travels: [f64; 2],
    limit_sq: &mut f64,
    mut near: impl FnMut(usize, usize, f64, &mut f64),
) {
    let apart = |i: u32, j: u32| {
        box_distance_sq(
            sweep_box(a.nodes[i as usize].bounds, travels),
            b.nodes[j as usize].bounds,
        )
    };
    if a.faces.is_empty() || b.faces.is_empty() {
        return;
    }
    let mut todo = vec![(0u32, 0u32, apart(0, 0))];
    while let Some((i, j, apart_sq)) = todo.pop() {
        if apart_sq > *limit_sq {
            continue;
        }
        let (m, n) = (&a.nodes[i as usize], &b.nodes[j as usize]);
        let splits_first = match (m.count > 0, n.count > 0) {
            (true, true) => {
                for k in m.triangles() {
                    let around = swept_box(a.corners[k], travels);
                    for l in n.triangles() {
                        let apart_sq = box_distance_sq(around, swept_box(b.corners[l], [0.0; 2]));
                        if apart_sq <= *limit_sq {
                            near(k, l, apart_sq, limit_sq);
                        }
                    }
                }
                continue;
            }
            (true, false) => false,
            (false, true) => true,
            (false, false) => m.bounds.size().length_squared() > n.bounds.size().length_squared(),
        };
        let [mut x, mut y] = if splits_first {
            [m.first, m.first + 1].map(|c| (c, j, apart(c, j)))
        } else {
            [n.first, n.first + 1].map(|c| (i, c, apart(i, c)))
        };
        if x.2 < y.2 {
            std::mem::swap(&mut x, &mut y);
        }
        todo.extend([x, y]);
    }
}

//! Moves seams into creases, and shortens them elsewhere.
//!
//! Dividing cuts by planes and by equal distance, whatever the shape there. Afterwards each seam is free
//! within a band and takes the cheapest path. The price is its length, reduced in concave creases
//! ([`border::prices`]).

use shellock_geom::Topology;
use shellock_segment::border;

use super::ground::Ground;
use super::refine::n_faults;
use super::{FaceLabels, SegmentationParams};

/// Greatest distances that seams may move, mm, in consecutive rounds.
const BANDS_MM: [f64; 2] = [8.0, 4.0];
/// Least share of its area that a piece keeps. Without creases, the shortest seam would enclose nothing.
const LEAST_KEPT: f64 = 0.7;

/// Settles the seams of `labels`. A seam stays where it is if its move would shrink a piece too far, lose
/// one, cut a region to keep whole, or add a fault.
pub(super) fn settle_seams(
    params: &SegmentationParams,
    ground: &Ground<'_>,
    labels: &FaceLabels,
) -> FaceLabels {
    let graph = ground.graph();
    let settler = border::Settler::new(graph);
    let mut label = labels.as_slice().to_vec();
    let areas = |label: &[u32]| {
        let mut areas = vec![0.0; labels.n_patches()];
        for (f, &k) in label.iter().enumerate() {
            areas[k as usize] += graph.area_mm2[f];
        }
        areas
    };
    let first = areas(&label);
    let mut n_before = n_faults(params, ground, labels);
    for band_mm in BANDS_MM {
        settler.settle(band_mm, &mut label, |moved, pair| {
            let now = areas(moved);
            let is_worn = |side: u32| now[side as usize] < LEAST_KEPT * first[side as usize];
            if pair.into_iter().any(is_worn)
                || ground.whole.is_parted(moved, pair)
                || !pair
                    .into_iter()
                    .all(|side| is_connected(&ground.topology, moved, side))
            {
                return false;
            }
            // Patches stay connected, so their numbers stay, too.
            let n_after = n_faults(
                params,
                ground,
                &FaceLabels::of_connected(moved, labels.n_patches()),
            );
            n_after <= n_before && {
                n_before = n_after;
                true
            }
        });
    }
    FaceLabels::from_components(&ground.topology, &label)
}

/// Returns true if the triangles of a label are not empty, and linked by their edges.
fn is_connected(topology: &Topology, label: &[u32], own: u32) -> bool {
    let is_own = |f: u32| label[f as usize] == own;
    let n_own = label.iter().filter(|&&k| k == own).count();
    let mut is_reached = vec![false; label.len()];
    let mut front: Vec<u32> = (0..label.len() as u32).find(|&f| is_own(f)).into_iter().collect();
    front.iter().for_each(|&f| is_reached[f as usize] = true);
    let mut n_reached = front.len();
    while let Some(face) = front.pop() {
        for next in topology.neighbours(face) {
            if is_own(next) && !is_reached[next as usize] {
                is_reached[next as usize] = true;
                n_reached += 1;
                front.push(next);
            }
        }
    }
    n_reached > 0 && n_reached == n_own
}

#[cfg(test)]
mod tests {
    use shellock_geom::{Solid, Vec3};
    use shellock_testkit::shapes::torus;

    use super::*;

    /// A ring whose tube is pinched at both ends of the x axis, where its narrowest sections lie.
    fn ring_with_pinches() -> Solid {
        let mut ring = torus(30.0, 10.0, [72, 24]);
        for p in &mut ring.points {
            let axis = Vec3::new(p.x, p.y, 0.0).normalize_or_zero() * 30.0;
            let pinch = 1.0 - 0.5 * (-(axis.y / 6.0).powi(2)).exp();
            *p = axis + (*p - axis) * pinch;
        }
        Solid::new(ring).expect("closed")
    }

    fn halves(solid: &Solid, y: f64) -> FaceLabels {
        let label: Vec<u32> = (0..solid.mesh().triangles.len())
            .map(|f| u32::from(solid.mesh().face_center(f).y > y))
            .collect();
        FaceLabels::from_components(&Topology::new(solid), &label)
    }

    #[test]
    fn seams_move_to_the_narrowest_place_within_reach_and_every_piece_stays() {
        let solid = ring_with_pinches();
        let ground = Ground::new(&solid);
        let labels = halves(&solid, 5.0);
        let params = SegmentationParams::default();
        let settled = settle_seams(&params, &ground, &labels);
        assert_eq!(settled.n_patches(), labels.n_patches());
        assert!(n_faults(&params, &ground, &settled) <= n_faults(&params, &ground, &labels));
        let mesh = solid.mesh();
        for f in 0..mesh.triangles.len() {
            let y = mesh.face_center(f).y;
            assert!(
                y.abs() < 3.0
                    || settled.patch(f) == labels.patch(if y > 0.0 { top(&solid) } else { bottom(&solid) }),
                "{y}"
            );
        }
    }

    fn top(solid: &Solid) -> usize {
        extreme(solid, 1.0)
    }

    fn bottom(solid: &Solid) -> usize {
        extreme(solid, -1.0)
    }

    fn extreme(solid: &Solid, sign: f64) -> usize {
        let height = |f: &usize| sign * solid.mesh().face_center(*f).y;
        (0..solid.mesh().triangles.len())
            .max_by(|f, g| height(f).total_cmp(&height(g)))
            .expect("it has triangles")
    }
}

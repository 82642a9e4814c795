//! Conditions on the shape of a user's key, so that it slides on rails [Yao2017, Sect. 4.2 and 6.1].

use crate::causes::Cause;
use shellock_geom::Vec3;
use shellock_report::{Ctx, PatchId, Warning};
use shellock_surface::SegmentedSurface;
use shellock_surface::plane::{Plane, Spot};

/// Least share of a key's area on its plane.
const LEAST_FLAT: f64 = 0.5;
/// Least straight seam along the slide on one side, in connector sizes: shorter rails do not guide.
const LEAST_STRAIGHT_SIZES: f64 = 3.0;
/// Bounds for a seam to run along the slide: least |t·s|, and greatest |s·N| for it to stay within the
/// surface.
const ALONG: f64 = 0.95;
const MOST_OUTWARDS: f64 = 0.25;
/// Number of planes tried, through places spread over the piece.
const N_PLANES: usize = 64;
/// Greatest deviation of a straight stretch from its line, mm.
const STRAIGHT_MM: f64 = 0.4;

/// Measures of a piece against the conditions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyConditions {
    /// Share of the piece's area on the plane nearest to it, in [0, 1].
    pub flat_share: f64,
    /// The point farthest from that plane, and its distance, mm.
    pub farthest: (Vec3, f64),
    /// Length of the longest straight stretch of the piece's seams along the slide, mm, and its middle.
    /// Without any stretch, 0 and the place where the seam comes nearest to the condition.
    pub straight: (f64, Vec3),
}

/// Measures `key`, which slides out along the unit vector `slide`; `None` where the piece has no area or no
/// seam.
pub fn conditions(surface: &SegmentedSurface, key: PatchId, slide: Vec3) -> Option<KeyConditions> {
    let (flat_share, farthest) = flatness(surface, key)?;
    Some(KeyConditions {
        flat_share,
        farthest,
        straight: longest_straight(surface, key, slide)?,
    })
}

/// Warns of the conditions that a `key` which was not cut breaks, see [`KeyConditions::problems`]; it slides
/// out along a unit vector.
pub fn warn_of_conditions(
    ctx: &Ctx,
    surface: &SegmentedSurface,
    (key, slide): (PatchId, Vec3),
    connector_mm: f64,
    may_be_cut: bool,
) {
    if let Some(found) = conditions(surface, key, slide) {
        for problem in found.problems(key, connector_mm, may_be_cut) {
            ctx.warn(problem);
        }
    }
}

impl KeyConditions {
    /// Warnings for the conditions that are broken, with places. `connector_mm` is the size of the key's
    /// connectors; `may_be_cut` is true if cutting a key instead is possible and was not tried.
    pub fn problems(&self, key: PatchId, connector_mm: f64, may_be_cut: bool) -> Vec<Warning> {
        let warning = |at: Vec3, cause: Cause| Warning::new(cause, vec![key], Some(at.to_array()));
        let mut found = Vec::new();
        if self.flat_share < LEAST_FLAT {
            let (at, off_mm) = self.farthest;
            let flat_share = self.flat_share;
            found.push(warning(
                at,
                Cause::KeyNotFlat {
                    flat_share,
                    least_share: LEAST_FLAT,
                    off_mm,
                    may_be_cut,
                },
            ));
        }
        let (straight_mm, at) = self.straight;
        let least_mm = LEAST_STRAIGHT_SIZES * connector_mm;
        if straight_mm < least_mm {
            found.push(warning(
                at,
                Cause::KeyNotStraight {
                    straight_mm,
                    least_mm,
                    may_be_cut,
                },
            ));
        }
        found
    }
}

fn flatness(surface: &SegmentedSurface, key: PatchId) -> Option<(f64, (Vec3, f64))> {
    let faces: Vec<usize> = (0..surface.patch_of_face.len())
        .filter(|&f| surface.patch_of_face[f] == key)
        .collect();
    let spots: Vec<Spot> = Spot::sample(&surface.mesh, faces.iter().copied(), 1)
        .into_iter()
        .filter(|s| s.normal != Vec3::ZERO)
        .collect();
    let total: f64 = spots.iter().map(|s| s.area).sum();
    let tolerance_mm = Plane::tolerance_mm(surface.mesh.bounds().size().max_element());
    let through = |s: &Spot| Plane {
        at: s.center,
        normal: s.normal,
        tolerance_mm,
    };
    let step = spots.len().div_ceil(N_PLANES).max(1);
    let planes = spots.iter().step_by(step).map(|s| through(s).refine(&spots));
    let best = planes.max_by(|a, b| a.area_mm2(&spots).total_cmp(&b.area_mm2(&spots)))?;
    let off_mm = |s: &Spot| (s.center - best.at).dot(best.normal).abs();
    let farthest = spots.iter().max_by(|a, b| off_mm(a).total_cmp(&off_mm(b)))?;
    (total > 0.0).then(|| (best.area_mm2(&spots) / total, (farthest.center, off_mm(farthest))))
}

fn longest_straight(surface: &SegmentedSurface, key: PatchId, slide: Vec3) -> Option<(f64, Vec3)> {
    let mut best: Option<(f64, Vec3)> = None;
    let mut nearest: Option<(f64, Vec3)> = None;
    for seam in surface.seams().iter().filter(|s| s.a == key || s.b == key) {
        let steps: Vec<(Vec3, Vec3, f64)> = (1..seam.points.len())
            .map(|i| {
                let (p, q) = (seam.points[i - 1], seam.points[i]);
                let leaves = (0.5 * (seam.normals[i - 1] + seam.normals[i])).dot(slide).abs();
                let along = (q - p).normalize_or_zero().dot(slide).abs();
                (p, q, if leaves < MOST_OUTWARDS { along } else { 0.0 })
            })
            .collect();
        let mut from = 0;
        while from < steps.len() {
            let (start, _, along) = steps[from];
            if nearest.is_none_or(|n| along > n.0) {
                nearest = Some((along, start));
            }
            let aside = |q: Vec3| ((q - start) - (q - start).dot(slide) * slide).length();
            let n = steps[from..]
                .iter()
                .take_while(|(_, q, along)| *along > ALONG && aside(*q) < STRAIGHT_MM)
                .count();
            if n > 0 {
                let end = steps[from + n - 1].1;
                let length_mm = start.distance(end);
                if best.is_none_or(|b| length_mm > b.0) {
                    best = Some((length_mm, 0.5 * (start + end)));
                }
            }
            from += 1;
        }
    }
    best.or(nearest.map(|(_, at)| (0.0, at)))
}

#[cfg(test)]
mod tests {
    use shellock_testkit::shapes::cuboid;

    use super::*;

    /// A cube of 40 mm whose top is the key; its other faces alternate between two pieces.
    fn cube() -> SegmentedSurface {
        let mesh = cuboid([0.0; 3], [40.0; 3]).to_mesh();
        let label = |f: usize| {
            let n = mesh.face_normal(f);
            if n.z > 0.5 {
                0
            } else if n.x.abs() > 0.5 {
                1
            } else {
                2
            }
        };
        let patch_of_face = (0..mesh.triangles.len()).map(|f| PatchId(label(f))).collect();
        let source_face = (0..mesh.triangles.len() as u32).collect();
        SegmentedSurface {
            mesh,
            patch_of_face,
            source_face,
            n_patches: 3,
        }
    }

    #[test]
    fn a_square_lid_is_flat_and_straight_along_its_edges_and_nothing_is_broken() {
        let found = conditions(&cube(), PatchId(0), Vec3::X).unwrap();
        assert!((found.flat_share - 1.0).abs() < 1e-9 && found.farthest.1 < 1e-9);
        assert!((found.straight.0 - 40.0).abs() < 1e-9, "{found:?}");
        assert_eq!(found.problems(PatchId(0), 2.5, true), []);
    }

    #[test]
    fn a_lid_that_leaves_across_its_edges_has_no_straight_side_and_is_told_where() {
        let diagonal = Vec3::new(1.0, 1.0, 0.0).normalize();
        let found = conditions(&cube(), PatchId(0), diagonal).unwrap();
        let problems = found.problems(PatchId(0), 2.5, true);
        assert_eq!(
            problems.iter().map(|p| p.code()).collect::<Vec<_>>(),
            ["key-not-straight"]
        );
        assert!(problems[0].at.is_some_and(|at| (at[2] - 40.0).abs() < 1e-9));
    }

    #[test]
    fn a_piece_bent_over_two_sides_is_told_where_it_is_off_its_plane() {
        let found = conditions(&cube(), PatchId(1), Vec3::Y).unwrap();
        assert!((found.flat_share - 0.5).abs() < 1e-9 && found.farthest.1 > 39.0);
    }
}

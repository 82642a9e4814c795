//! Polygons in space, cut into triangles.

use crate::Vec3;
use crate::boolean::cut_by_ears;

/// Corners up to which a fan is kept where it does not fold; larger ones would have slivers that all meet at
/// one corner.
const LARGEST_FAN: usize = 32;
/// Share of the polygon's area by which its triangles may differ from it, and by which one may face the other
/// way: above the rounding of coordinates in 32 bits.
const AREA_SLACK: f64 = 1e-6;

/// Cuts a polygon into triangles of its corners, as many as it has corners less two, which face as it does.
///
/// A fan around the first corner where that does not fold, else ears in the plane that fits the polygon best
/// (Newell's normal). Corners in a line are kept, so that neighbours still meet edge to edge. `None` where no
/// triangles in that plane cover the polygon once: it crosses itself, or is far from flat. Cost: O(n log n).
pub fn triangulate(corners: &[Vec3]) -> Option<Vec<[u32; 3]>> {
    let n = u32::try_from(corners.len()).ok().filter(|&n| n >= 3)?;
    let normal = double_area_vector(corners).try_normalize()?;
    let fan: Vec<[u32; 3]> = (1..n - 1).map(|i| [0, i, i + 1]).collect();
    if corners.len() <= LARGEST_FAN && covers_once(corners, &fan, normal) {
        return Some(fan);
    }
    let (u, v) = normal.any_orthonormal_pair();
    // Counter-clockwise as seen from the side to which the normal points.
    let v = if u.cross(v).dot(normal) < 0.0 { -v } else { v };
    let flat: Vec<[f64; 2]> = corners.iter().map(|p| [p.dot(u), p.dot(v)]).collect();
    let ears = cut_by_ears(&flat);
    covers_once(corners, &ears, normal).then_some(ears)
}

/// True if the polygon, seen from the direction in which it looks largest, has an area.
pub fn has_area(corners: &[Vec3]) -> bool {
    double_area_vector(corners).try_normalize().is_some()
}

/// Twice the area of the polygon times its normal (Newell's method).
fn double_area_vector(corners: &[Vec3]) -> Vec3 {
    let [first, rest @ ..] = corners else {
        return Vec3::ZERO;
    };
    rest.windows(2)
        .map(|pair| (pair[0] - first).cross(pair[1] - first))
        .sum()
}

/// True if `triangles` are as many as the polygon needs and none faces against `normal`, so that each place
/// of the polygon is covered by one.
fn covers_once(corners: &[Vec3], triangles: &[[u32; 3]], normal: Vec3) -> bool {
    let all = double_area_vector(corners).dot(normal);
    let slack = AREA_SLACK * all;
    let doubled = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| corners[i as usize]);
        (b - a).cross(c - a).dot(normal)
    };
    let sum: f64 = triangles.iter().map(doubled).sum();
    triangles.len() + 2 == corners.len()
        && triangles.iter().all(|t| doubled(t) >= -slack)
        && (sum - all).abs() <= slack
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn flat(points: &[[f64; 2]]) -> Vec<Vec3> {
        points.iter().map(|&[x, y]| Vec3::new(x, y, 0.3 * x)).collect()
    }

    /// Each edge of the outline once, every other edge once each way.
    fn assert_outline(corners: &[Vec3], triangles: &[[u32; 3]]) {
        let n = corners.len() as u32;
        let mut edges: Vec<(u32, u32)> = triangles
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
            .collect();
        for i in 0..n {
            let at = edges.iter().position(|&e| e == (i, (i + 1) % n));
            edges.swap_remove(at.unwrap_or_else(|| panic!("edge {i} is on no triangle")));
        }
        for &(a, b) in &edges {
            assert!(edges.contains(&(b, a)), "edge {a} {b} has one side");
        }
    }

    #[test]
    fn a_convex_polygon_stays_a_fan() {
        let square = flat(&[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]);
        assert_eq!(triangulate(&square), Some(vec![[0, 1, 2], [0, 2, 3]]));
    }

    #[test]
    fn notches_are_left_out_and_corners_in_a_line_stay() {
        let u = flat(&[
            [0.0, 0.0],
            [1.5, 0.0],
            [3.0, 0.0],
            [3.0, 3.0],
            [2.0, 3.0],
            [2.0, 1.0],
            [1.0, 1.0],
            [1.0, 3.0],
            [0.0, 3.0],
        ]);
        for start in 0..u.len() {
            let mut turned = u.clone();
            turned.rotate_left(start);
            let triangles = triangulate(&turned).unwrap();
            assert_outline(&turned, &triangles);
            let area = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|i| turned[i as usize]);
                0.5 * (b - a).cross(c - a).length()
            };
            let sum: f64 = triangles.iter().map(area).sum();
            // 7 squares, leaning.
            assert!((sum - 7.0 * 1.09f64.sqrt()).abs() < 1e-9, "{sum}");
        }
    }

    #[test]
    fn what_crosses_itself_or_has_no_area_has_no_triangles() {
        let crossed = flat(&[[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 1.0]]);
        assert_eq!(triangulate(&crossed), None);
        assert_eq!(triangulate(&[Vec3::ZERO, Vec3::X, 2.0 * Vec3::X]), None);
        assert_eq!(triangulate(&[Vec3::ZERO, Vec3::X]), None);
    }

    #[test]
    fn a_round_polygon_of_many_corners_has_no_corner_that_all_triangles_share() {
        let n = 20_000;
        let at = |i: u32| std::f64::consts::TAU * f64::from(i) / f64::from(n);
        let round: Vec<Vec3> = (0..n).map(|i| Vec3::new(at(i).cos(), at(i).sin(), 0.0)).collect();
        let triangles = triangulate(&round).unwrap();
        let mut uses = vec![0; n as usize];
        triangles.iter().flatten().for_each(|&i| uses[i as usize] += 1);
        assert!(uses.iter().max() < Some(&100));
    }

    proptest! {
        #[test]
        fn stars_are_covered_once_wherever_they_start(
            radii in proptest::collection::vec(0.2..3.0f64, 3..60), start in 0..60usize,
        ) {
            let n = radii.len();
            let point = |(i, r): (usize, &f64)| {
                let (sin, cos) = (std::f64::consts::TAU * i as f64 / n as f64).sin_cos();
                [r * cos, r * sin]
            };
            let mut star = flat(&radii.iter().enumerate().map(point).collect::<Vec<_>>());
            star.rotate_left(start % n);
            let triangles = triangulate(&star).unwrap();
            assert_outline(&star, &triangles);
        }
    }
}

//! Subdivision of triangles without a change of the surface.

use crate::topology::{Topology, ends};
use crate::{Solid, TriMesh, Vec3};

/// Halves the chosen edges of `solid`. Returns the new solid, and the source triangle of each new triangle.
///
/// `wants_split` is asked once per edge, with the edge's two end points. Triangles with chosen edges are cut
/// into 2 to 4 parts.
pub fn halve_edges(
    solid: &Solid,
    topology: &Topology,
    wants_split: impl Fn(u32, u32) -> bool,
) -> (Solid, Vec<u32>) {
    const NO_POINT: u32 = u32::MAX;
    let mesh = solid.mesh();
    let mut points = mesh.points.clone();
    let mut middle = vec![NO_POINT; topology.n_half_edges()];
    for h in 0..topology.n_half_edges() as u32 {
        let (from, to) = ends(mesh, h);
        if h < topology.opposite(h) && wants_split(from, to) {
            middle[h as usize] = points.len() as u32;
            middle[topology.opposite(h) as usize] = points.len() as u32;
            points.push(0.5 * (mesh.points[from as usize] + mesh.points[to as usize]));
        }
    }
    let mut triangles = Vec::with_capacity(mesh.triangles.len());
    let mut source_face = Vec::with_capacity(mesh.triangles.len());
    for (face, &t) in mesh.triangles.iter().enumerate() {
        let m = [0, 1, 2].map(|corner| middle[3 * face + corner]);
        let before = triangles.len();
        cut_triangle(
            &points,
            t,
            m.map(|p| (p != NO_POINT).then_some(p)),
            &mut triangles,
        );
        source_face.extend(std::iter::repeat_n(face as u32, triangles.len() - before));
    }
    let refined =
        Solid::new(TriMesh { points, triangles }).expect("halving edges keeps a mesh closed and its volume");
    (refined, source_face)
}

/// Appends the parts of triangle `t`, whose edge `c` has the midpoint `m[c]`.
fn cut_triangle(points: &[Vec3], t: [u32; 3], m: [Option<u32>; 3], out: &mut Vec<[u32; 3]>) {
    // Rotated so that no case needs a mirror image: one midpoint is on edge 0, two are on edges 0 and 1.
    let turn = (0..3)
        .find(|&r| m[r].is_some() && (m[(r + 2) % 3].is_none() || m.iter().all(Option::is_some)))
        .unwrap_or(0);
    let [a, b, c] = [0, 1, 2].map(|i| t[(i + turn) % 3]);
    match [0, 1, 2].map(|i| m[(i + turn) % 3]) {
        [Some(ab), Some(bc), Some(ca)] => out.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]),
        [Some(ab), Some(bc), None] => {
            // The shorter diagonal of the quadrilateral a ab bc c.
            let length = |p: u32, q: u32| points[p as usize].distance_squared(points[q as usize]);
            out.push([ab, b, bc]);
            if length(a, bc) <= length(ab, c) {
                out.extend([[a, ab, bc], [a, bc, c]]);
            } else {
                out.extend([[a, ab, c], [ab, bc, c]]);
            }
        }
        [Some(ab), None, None] => out.extend([[a, ab, c], [ab, b, c]]),
        _ => out.push(t),
    }
}

/// Appends the parts of a triangle with further points on its sides. `on_sides[k]` is in order from corner
/// `k` on.
///
/// Every point becomes a corner, no part has three points on one side, and the orientation is kept; O(n log
/// n).
pub fn fill_triangle([a, b, c]: [u32; 3], on_sides: [&[u32]; 3], out: &mut Vec<[u32; 3]>) {
    let fullest = (0..3)
        .rev()
        .max_by_key(|&k| on_sides[k].len())
        .unwrap_or_default();
    if on_sides[fullest].is_empty() {
        out.push([a, b, c]);
        return;
    }
    // Cut from the middle of the fullest side to the opposite corner.
    let [a, b, c] = [0, 1, 2].map(|k| [a, b, c][(fullest + k) % 3]);
    let [ab, bc, ca] = [0, 1, 2].map(|k| on_sides[(fullest + k) % 3]);
    let at = ab.len() / 2;
    fill_triangle([a, ab[at], c], [&ab[..at], &[], ca], out);
    fill_triangle([ab[at], b, c], [&ab[at + 1..], bc, &[]], out);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::tetrahedron;

    #[test]
    fn halving_keeps_area_and_volume_whatever_edges_are_chosen() {
        let solid = Solid::new(tetrahedron()).unwrap();
        let topology = Topology::new(&solid);
        for chosen in 0..64u32 {
            let edges = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
            let wants = |a: u32, b: u32| {
                let edge = edges.iter().position(|&e| e == (a.min(b), a.max(b))).unwrap();
                chosen >> edge & 1 == 1
            };
            let (fine, source) = halve_edges(&solid, &topology, wants);
            assert_eq!(source.len(), 4 + 2 * chosen.count_ones() as usize);
            assert!((fine.volume() - solid.volume()).abs() < 1e-15);
            assert!((fine.mesh().area() - solid.mesh().area()).abs() < 1e-14);
        }
    }

    #[test]
    fn a_triangle_with_points_on_its_sides_is_filled_without_gaps() {
        // Points 3 and 4 are on side 0, 5 is on side 1, and 6, 7 and 8 are on side 2.
        let points: Vec<Vec3> = [
            (0, 0),
            (12, 0),
            (0, 12),
            (4, 0),
            (8, 0),
            (6, 6),
            (0, 9),
            (0, 6),
            (0, 3),
        ]
        .map(|(x, y)| Vec3::new(f64::from(x), f64::from(y), 0.0))
        .to_vec();
        let mut triangles = Vec::new();
        fill_triangle([0, 1, 2], [&[3, 4], &[5], &[6, 7, 8]], &mut triangles);
        // The result fills a polygon of nine corners.
        assert_eq!(triangles.len(), 7);
        let mesh = TriMesh { points, triangles };
        assert!((0..7).all(|face| mesh.double_area_vector(face).z > 0.0));
        assert!((mesh.area() - 72.0).abs() < 1e-12);
    }
}

//! Merging of points with equal coordinates, so that triangles know their neighbours.
//!
//! Only points of exactly equal coordinates are merged (−0 equals 0), since an STL repeats the corners of
//! each triangle bit for bit. Points that merely lie close together stay separate; closing such cracks
//! belongs to repair, not to reading.

use crate::check::edges::inspect_edges;
use crate::{TriMesh, Vec3};

/// A mesh after merging of equal points.
#[derive(Clone, Debug, PartialEq)]
pub struct Welded {
    /// Mesh whose points are all used. The order of points and triangles is kept.
    pub mesh: TriMesh,
    /// Old index of each triangle; ascending.
    pub kept_face: Vec<u32>,
    /// Number of triangles dropped because two of their corners became one.
    pub n_collapsed: usize,
}

/// Merges points of equal coordinates. Drops triangles that collapse as a result, and points that no triangle
/// uses.
///
/// The result is the same on every run. O(n log n) at worst, near O(n) on real meshes.
///
/// # Panics
/// Panics if a triangle names a missing point.
pub fn weld(mesh: &TriMesh) -> Welded {
    reindex(mesh, &first_equal(&mesh.points))
}

/// Keeps the mesh's own indexing if that is closed and manifold; otherwise welds the mesh.
///
/// Welding can break a mesh that is sound as indexed but touches itself: along a touching edge four triangles
/// would meet. Unused points, and triangles that name a point twice, are always dropped. If a triangle has
/// two corners at the same place, the file was rounded, not deliberately joined, and its indexing is not
/// trusted.
///
/// # Panics
/// Panics if a triangle names a missing point.
pub fn close(mesh: &TriMesh) -> Welded {
    let as_indexed = reindex(mesh, &(0..mesh.points.len() as u32).collect::<Vec<_>>());
    // In a closed mesh each point has at least two triangles. An STL has one per point, and need not be
    // examined further.
    let may_be_closed = 2 * as_indexed.mesh.points.len() <= 3 * as_indexed.mesh.triangles.len();
    let has_collapsed = || {
        (0..as_indexed.mesh.triangles.len()).any(|face| {
            let [a, b, c] = as_indexed.mesh.corners(face);
            a == b || b == c || c == a
        })
    };
    if may_be_closed && !has_collapsed() && inspect_edges(&as_indexed.mesh).is_closed() {
        as_indexed
    } else {
        weld(mesh)
    }
}

/// Index of the first point with equal coordinates, for each point.
pub fn first_equal(points: &[Vec3]) -> Vec<u32> {
    // Adding 0 turns −0 into 0 and changes nothing else, so equal coordinates have equal bits.
    let bits = |i: u32| points[i as usize].to_array().map(|x| (x + 0.0).to_bits());
    // A hash puts equal points into the same bucket, and sorting the few points of a bucket finds them.
    // Buckets overfilled by a hostile file cost a sort, not a square.
    let n_bits = points.len().next_power_of_two().ilog2().max(1);
    let bucket_of: Vec<u32> = (0..points.len() as u32)
        .map(|i| (hash(bits(i)) >> (64 - n_bits)) as u32)
        .collect();
    let mut begin = vec![0_u32; (1 << n_bits) + 1];
    bucket_of
        .iter()
        .for_each(|&bucket| begin[bucket as usize + 1] += 1);
    for bucket in 1..begin.len() {
        begin[bucket] += begin[bucket - 1];
    }
    let mut next = begin.clone();
    let mut order = vec![0_u32; points.len()];
    for (&bucket, i) in bucket_of.iter().zip(0..) {
        order[next[bucket as usize] as usize] = i;
        next[bucket as usize] += 1;
    }

    let mut first = vec![0; points.len()];
    for range in begin.windows(2) {
        let bucket = &mut order[range[0] as usize..range[1] as usize];
        bucket.sort_unstable_by_key(|&i| (bits(i), i));
        for equal in bucket.chunk_by(|&i, &j| bits(i) == bits(j)) {
            equal.iter().for_each(|&i| first[i as usize] = equal[0]);
        }
    }
    first
}

/// Spreads coordinates over 64 bits, the upper ones best.
fn hash(bits: [u64; 3]) -> u64 {
    /// Multiplier 2⁶⁴ over the golden ratio, odd, as usual in multiplicative hashing.
    const MULTIPLIER: u64 = 0x9E37_79B9_7F4A_7C15;
    bits.iter()
        .fold(0, |h: u64, &b| {
            let mixed = (h ^ b).wrapping_mul(MULTIPLIER);
            mixed ^ (mixed >> 29)
        })
        .wrapping_mul(MULTIPLIER)
}

/// Replaces each point by its entry in `stands_for`, then drops collapsed triangles and unused points.
pub(crate) fn reindex(mesh: &TriMesh, stands_for: &[u32]) -> Welded {
    let mut kept_face = Vec::with_capacity(mesh.triangles.len());
    let mut triangles = Vec::with_capacity(mesh.triangles.len());
    let mut is_used = vec![false; mesh.points.len()];
    for (face, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = triangle.map(|v| stands_for[v as usize]);
        if a == b || b == c || c == a {
            continue;
        }
        [a, b, c].iter().for_each(|&v| is_used[v as usize] = true);
        triangles.push([a, b, c]);
        kept_face.push(face as u32);
    }

    let mut new_index = vec![0; mesh.points.len()];
    let mut points = Vec::new();
    for (old, _) in is_used.iter().enumerate().filter(|(_, used)| **used) {
        new_index[old] = points.len() as u32;
        points.push(mesh.points[old]);
    }
    triangles
        .iter_mut()
        .for_each(|t| *t = t.map(|v| new_index[v as usize]));
    let n_collapsed = mesh.triangles.len() - triangles.len();
    Welded {
        mesh: TriMesh { points, triangles },
        kept_face,
        n_collapsed,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(coordinates: &[[f64; 3]]) -> Vec<Vec3> {
        coordinates.iter().copied().map(Vec3::from_array).collect()
    }

    #[test]
    fn equal_points_merge_and_minus_zero_is_zero() {
        let mesh = TriMesh {
            points: points(&[
                [9.0; 3],
                [0.0; 3],
                [1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [1.0, -0.0, 0.0],
                [-0.0; 3],
                [1.0; 3],
            ]),
            triangles: vec![[1, 2, 3], [5, 4, 6], [1, 5, 6]],
        };
        let welded = weld(&mesh);
        assert_eq!(
            welded.mesh.points,
            points(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0; 3]])
        );
        assert_eq!(welded.mesh.triangles, [[0, 1, 2], [0, 1, 3]]);
        assert_eq!((welded.kept_face, welded.n_collapsed), (vec![0, 1], 1));
    }

    #[test]
    fn neighbouring_floats_stay_apart() {
        let next = 1.0_f64.next_up();
        let mesh = TriMesh {
            points: points(&[[1.0, 0.0, 0.0], [next, 0.0, 0.0], [0.0, 1.0, 0.0]]),
            triangles: vec![[0, 1, 2]],
        };
        assert_eq!(weld(&mesh).mesh, mesh);
    }
}

//! Compact encoding of meshes.
//!
//! The viewer draws points and triangles in any order. Points are sorted along a space-filling curve through
//! their bounding box, and triangles by their first point. Numbers are stored as differences, in byte planes:
//! all low bytes before the higher ones. Deflate shrinks this to less than half.

use serde::Serialize;
use shellock_geom::{TriMesh, Vec3};

use crate::arrays::align;

/// Number of steps of a coordinate across the box.
const STEPS: f64 = 65_535.0;

/// Position of a mesh in the arrays, and its layout. Read by `viewer/src/data.js`.
#[derive(Serialize)]
pub(crate) struct PackedMesh {
    offset: usize,
    points: usize,
    triangles: usize,
    /// Bytes per corner index: 2 or 4.
    bytes: usize,
    min: [f64; 3],
    max: [f64; 3],
}

/// Appends `mesh` to `arrays`, with coordinates rounded to 1/65 535 of its box.
pub(crate) fn append(mesh: &TriMesh, arrays: &mut Vec<u8>) -> PackedMesh {
    let (min, size) = if mesh.points.is_empty() {
        (Vec3::ZERO, Vec3::ZERO)
    } else {
        (mesh.bounds().min, mesh.bounds().size())
    };
    // A flat box has one value along that axis.
    let per_mm = size.map(|side| if side > 0.0 { STEPS / side } else { 0.0 });
    let steps: Vec<[u16; 3]> = mesh
        .points
        .iter()
        .map(|&p| ((p - min) * per_mm).to_array().map(|x| x.round() as u16))
        .collect();
    let mut order: Vec<u32> = (0..steps.len() as u32).collect();
    order.sort_by_key(|&v| (along_curve(steps[v as usize]), v));
    let mut place = vec![0u32; steps.len()];
    for (new, &old) in order.iter().enumerate() {
        place[old as usize] = new as u32;
    }
    align(arrays);
    let packed = PackedMesh {
        offset: arrays.len(),
        points: steps.len(),
        triangles: mesh.triangles.len(),
        bytes: if steps.len() <= 65_536 { 2 } else { 4 },
        min: min.to_array(),
        max: (min + size).to_array(),
    };
    let ordered = order.iter().map(|&v| steps[v as usize]);
    append_planes(&point_differences(ordered), 2, arrays);
    append_planes(&corner_differences(mesh, &place), packed.bytes, arrays);
    packed
}

/// Morton code of a point: interleaved bits of its three coordinates, highest first.
fn along_curve(steps: [u16; 3]) -> u64 {
    (0..16).rev().fold(0, |key, bit| {
        steps
            .iter()
            .fold(key, |key, s| (key << 1) | u64::from((s >> bit) & 1))
    })
}

/// Delta-encodes points: each coordinate less that of the previous point, modulo 2¹⁶.
fn point_differences(points: impl Iterator<Item = [u16; 3]>) -> Vec<u32> {
    let mut last = [0u16; 3];
    points
        .flat_map(|p| {
            let d = std::array::from_fn::<u32, 3, _>(|k| u32::from(p[k].wrapping_sub(last[k])));
            last = p;
            d
        })
        .collect()
}

/// Delta-encodes triangles sorted by lowest index: (a − a of the previous triangle, b − a, c − a).
fn corner_differences(mesh: &TriMesh, place: &[u32]) -> Vec<u32> {
    let mut triangles: Vec<[u32; 3]> = mesh
        .triangles
        .iter()
        .map(|t| {
            let mut t = t.map(|v| place[v as usize]);
            let lowest = (0..3).min_by_key(|&k| t[k]).unwrap_or(0);
            t.rotate_left(lowest);
            t
        })
        .collect();
    triangles.sort_unstable();
    let mut last = 0;
    triangles
        .into_iter()
        .flat_map(|[a, b, c]| {
            let d = [a - last, b - a, c - a];
            last = a;
            d
        })
        .collect()
}

/// Appends the values in byte planes: the lowest byte of each value, then the next of each, and so on.
fn append_planes(values: &[u32], bytes: usize, arrays: &mut Vec<u8>) {
    for byte in 0..bytes {
        arrays.extend(values.iter().map(|v| (v >> (8 * byte)) as u8));
    }
}

#[cfg(test)]
mod tests {
    use shellock_testkit::shapes::sphere;

    use super::*;

    /// Decodes a mesh as the viewer does.
    fn unpack(packed: &PackedMesh, arrays: &[u8]) -> (Vec<[u16; 3]>, Vec<[u32; 3]>) {
        let (n, m) = (3 * packed.points, 3 * packed.triangles);
        let value = |at: usize, i: usize, n: usize, bytes: usize| {
            (0..bytes).fold(0u32, |v, b| v | u32::from(arrays[at + b * n + i]) << (8 * b))
        };
        let mut points: Vec<[u16; 3]> = Vec::new();
        let mut last = [0u16; 3];
        for i in 0..packed.points {
            last =
                std::array::from_fn(|k| last[k].wrapping_add(value(packed.offset, 3 * i + k, n, 2) as u16));
            points.push(last);
        }
        let at = packed.offset + 2 * n;
        let mut first = 0;
        let triangles = (0..packed.triangles).map(|i| {
            let d: [u32; 3] = std::array::from_fn(|k| value(at, 3 * i + k, m, packed.bytes));
            first += d[0];
            [first, first + d[1], first + d[2]]
        });
        (points, triangles.collect())
    }

    #[test]
    fn a_mesh_comes_back_with_its_triangles_in_another_order() {
        let ball = sphere(3, Vec3::new(5.0, 7.0, 9.0));
        let mut arrays = vec![1, 2, 3];
        let packed = append(&ball, &mut arrays);
        let (points, triangles) = unpack(&packed, &arrays);
        let steps = |p: Vec3| {
            let (min, size) = (ball.bounds().min, ball.bounds().size());
            ((p - min) / size * STEPS).to_array().map(|x| x.round() as u16)
        };
        let turned = |mut t: [[u16; 3]; 3]| {
            let lowest = (0..3).min_by_key(|&k| t[k]).unwrap();
            t.rotate_left(lowest);
            t
        };
        let mut expected: Vec<[[u16; 3]; 3]> = ball
            .triangles
            .iter()
            .map(|t| turned(t.map(|v| steps(ball.points[v as usize]))))
            .collect();
        let mut found: Vec<[[u16; 3]; 3]> = triangles
            .iter()
            .map(|t| turned(t.map(|v| points[v as usize])))
            .collect();
        expected.sort_unstable();
        found.sort_unstable();
        assert_eq!(found, expected);
    }

    #[test]
    fn an_empty_mesh_takes_no_bytes() {
        let mut arrays = Vec::new();
        let packed = append(&TriMesh::default(), &mut arrays);
        assert_eq!((packed.points, packed.triangles, arrays.len()), (0, 0, 0));
    }
}

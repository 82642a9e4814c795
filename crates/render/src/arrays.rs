//! Arrays of points and triangles in the block that a page carries.

use serde::Serialize;
use shellock_geom::{TriMesh, Vec3};

/// Position of points in the arrays, and their box.
#[derive(Serialize)]
pub(crate) struct PointArray {
    offset: usize,
    count: usize,
    min: [f64; 3],
    max: [f64; 3],
}

/// Position of triangles in the arrays, and the width of their indices.
#[derive(Serialize)]
pub(crate) struct TriangleArray {
    offset: usize,
    count: usize,
    /// Bytes per corner index: 2 or 4.
    bytes: usize,
}

/// Appends the points of `mesh`, rounded to 1/65 535 of its box.
pub(crate) fn append_points(mesh: &TriMesh, arrays: &mut Vec<u8>) -> PointArray {
    let bounds = mesh.bounds();
    let (min, size) = if mesh.points.is_empty() {
        (Vec3::ZERO, Vec3::ZERO)
    } else {
        (bounds.min, bounds.size())
    };
    align(arrays);
    let offset = arrays.len();
    // A flat box has one value along that axis.
    let steps_per_mm = size.map(|side| if side > 0.0 { 65_535.0 / side } else { 0.0 });
    for &p in &mesh.points {
        for step in ((p - min) * steps_per_mm).to_array() {
            arrays.extend((step.round() as u16).to_le_bytes());
        }
    }
    PointArray {
        offset,
        count: mesh.points.len(),
        min: min.to_array(),
        max: (min + size).to_array(),
    }
}

/// Appends the triangles of `mesh` as indices of its points.
pub(crate) fn append_triangles(mesh: &TriMesh, arrays: &mut Vec<u8>) -> TriangleArray {
    align(arrays);
    let offset = arrays.len();
    let bytes = if mesh.points.len() <= 65_536 { 2 } else { 4 };
    for &v in mesh.triangles.as_flattened() {
        arrays.extend(&v.to_le_bytes()[..bytes]);
    }
    TriangleArray {
        offset,
        count: mesh.triangles.len(),
        bytes,
    }
}

/// Pads to a multiple of 4 bytes, as typed arrays begin at multiples of their element size.
pub(crate) fn align(arrays: &mut Vec<u8>) {
    arrays.resize(arrays.len().next_multiple_of(4), 0);
}

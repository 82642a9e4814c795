//! Shading normals, lighting and contour lines.

use rayon::prelude::*;
use shellock_geom::{TriMesh, Vec3};

use super::sample::Sample;

/// Cosine of the angle up to which neighbouring triangles share a smooth normal: 40°.
const SMOOTH_COS: f64 = 0.766;

/// Depth jump beyond a plane from which a line is drawn, in samples: three pixels at a picture's scale.
const DEPTH_JUMP: f32 = 14.0;

/// Cosine of the angle between normals two samples apart from which a crease begins to show: 35°.
const CREASE_COS: f32 = 0.82;

/// Computes unit normals at the corners of each triangle: the area-weighted mean over those triangles around
/// the corner whose normals differ by less than 40°.
pub fn crease_normals(mesh: &TriMesh) -> Vec<[Vec3; 3]> {
    let (first, faces) = faces_around_points(mesh);
    let doubled: Vec<Vec3> = (0..mesh.triangles.len())
        .into_par_iter()
        .map(|f| mesh.double_area_vector(f))
        .collect();
    let units: Vec<Vec3> = doubled.par_iter().map(|n| n.normalize_or_zero()).collect();
    (0..mesh.triangles.len())
        .into_par_iter()
        .map(|face| {
            mesh.triangles[face].map(|v| {
                let around = &faces[first[v as usize] as usize..first[v as usize + 1] as usize];
                let alike = around
                    .iter()
                    .filter(|&&f| units[f as usize].dot(units[face]) > SMOOTH_COS);
                alike
                    .map(|&f| doubled[f as usize])
                    .sum::<Vec3>()
                    .normalize_or(units[face])
            })
        })
        .collect()
}

/// Lists the triangles at each point: those of point `v` are `faces[first[v]..first[v + 1]]`.
fn faces_around_points(mesh: &TriMesh) -> (Vec<u32>, Vec<u32>) {
    let mut first = vec![0_u32; mesh.points.len() + 2];
    for &v in mesh.triangles.as_flattened() {
        first[v as usize + 2] += 1;
    }
    for v in 2..first.len() {
        first[v] += first[v - 1];
    }
    let mut faces = vec![0; 3 * mesh.triangles.len()];
    for (at, &v) in mesh.triangles.as_flattened().iter().enumerate() {
        let place = &mut first[v as usize + 1];
        faces[*place as usize] = (at / 3) as u32;
        *place += 1;
    }
    (first, faces)
}

/// Linear light that a surface of a given linear colour sends to the viewer.
pub(super) fn lit(color: [f32; 3], normal: [f32; 3]) -> [f32; 3] {
    // Key light, fill light, and the half-way vector of the key light, as unit vectors; x right, y down, z to
    // the viewer.
    const KEY: [f32; 3] = [-0.46, -0.60, 0.654];
    const FILL: [f32; 3] = [0.80, 0.10, 0.59];
    const HALF: [f32; 3] = [-0.253, -0.330, 0.909];
    let length = dot(normal, normal).sqrt().max(1e-12);
    // The inside of an open mesh is lit as if it were the outside.
    let towards = if normal[2] < 0.0 { -length } else { length };
    let n = normal.map(|x| x / towards);
    let sky = 0.5 - 0.5 * n[1];
    let key = dot(n, KEY).max(0.0);
    let fill = dot(n, FILL).max(0.0);
    let diffuse = 0.16 + 0.20 * sky + 0.66 * key + 0.12 * fill;
    let gloss = 0.07 * dot(n, HALF).max(0.0).powi(24);
    color.map(|c| c * diffuse + gloss)
}

/// Strength of a line at `here`, judged by the samples on both sides, in [0, 1].
pub(super) fn line_between(before: Sample, here: Sample, after: Sample) -> f32 {
    if before.mesh == 0 || after.mesh == 0 {
        return 1.0;
    }
    // Only the nearer side of a jump is darkened, so that the line lies on the surface that it bounds.
    let behind = here.depth - before.depth.min(after.depth);
    let bend = 2.0 * here.depth - before.depth - after.depth;
    if bend > DEPTH_JUMP && behind > DEPTH_JUMP {
        return 0.9;
    }
    if before.mesh != here.mesh || after.mesh != here.mesh {
        return 0.85;
    }
    let (m, n) = (before.normal, after.normal);
    let cos = dot(m, n) / (dot(m, m) * dot(n, n)).sqrt().max(1e-12);
    ((CREASE_COS - cos) * 2.5).clamp(0.0, 0.55)
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

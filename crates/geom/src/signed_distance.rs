//! Signed distance to the surface of a solid, positive inside.

use crate::bvh::{Feature, TriangleBvh};
use crate::{Solid, Vec3};

/// Signed distance queries for one solid. The sign comes from angle-weighted pseudo-normals, which are
/// correct for every nearest point of a surface that does not cross itself. [Bærentzen and Aanæs 2005]
pub struct SignedDistance {
    bvh: TriangleBvh,
    triangles: Vec<[u32; 3]>,
    face_normals: Vec<Vec3>,
    vertex_normals: Vec<Vec3>,
    /// Triangle across the edge that starts at each corner 0, 1, 2 of each triangle.
    across: Vec<[u32; 3]>,
}

/// A signed distance, and the point of the surface nearest to the query.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceDistance {
    /// Distance, mm, positive inside the solid.
    pub signed_mm: f64,
    /// Index of the nearest triangle.
    pub face: u32,
    /// Nearest point of the surface, mm.
    pub point: Vec3,
}

impl SignedDistance {
    /// Prepares queries for the surface of `solid`; O(n log n).
    pub fn new(solid: &Solid) -> Self {
        let mesh = solid.mesh();
        let n = mesh.triangles.len();
        let face_normals: Vec<Vec3> = (0..n).map(|f| mesh.face_normal(f)).collect();
        let mut vertex_normals = vec![Vec3::ZERO; mesh.points.len()];
        for (f, t) in mesh.triangles.iter().enumerate() {
            let corners = mesh.corners(f);
            for i in 0..3 {
                let (a, b) = (
                    corners[(i + 1) % 3] - corners[i],
                    corners[(i + 2) % 3] - corners[i],
                );
                let angle = a.cross(b).length().atan2(a.dot(b));
                vertex_normals[t[i] as usize] += angle * face_normals[f];
            }
        }
        Self {
            bvh: TriangleBvh::new(mesh),
            across: faces_across(&mesh.triangles),
            triangles: mesh.triangles.clone(),
            face_normals,
            vertex_normals,
        }
    }

    /// Signed distance at `q`; `None` if the surface is farther than `limit_mm`.
    pub fn at(&self, q: Vec3, limit_mm: f64) -> Option<SurfaceDistance> {
        let near = self.bvh.nearest(q, limit_mm * limit_mm)?;
        let f = near.face as usize;
        let normal = match near.feature {
            Feature::Face => self.face_normals[f],
            Feature::Edge(e) => self.face_normals[f] + self.face_normals[self.across[f][e as usize] as usize],
            Feature::Corner(c) => self.vertex_normals[self.triangles[f][c as usize] as usize],
        };
        let distance = near.distance_sq.sqrt();
        let inside = (near.point - q).dot(normal) >= 0.0;
        Some(SurfaceDistance {
            signed_mm: if inside { distance } else { -distance },
            face: near.face,
            point: near.point,
        })
    }

    /// Returns true if the surface passes between `a` and `b`. Triangles parallel to the line do not count.
    pub fn is_between(&self, a: Vec3, b: Vec3) -> bool {
        let way = b - a;
        self.bvh
            .first_hit(a, way.normalize_or_zero(), way.length())
            .is_some()
    }
}

/// Triangles across the three edges of each triangle of a closed mesh.
fn faces_across(triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut edges: Vec<(u32, u32, u32)> = Vec::with_capacity(triangles.len() * 3);
    for (f, t) in triangles.iter().enumerate() {
        for e in 0..3 {
            let (a, b) = (t[e], t[(e + 1) % 3]);
            edges.push((a.min(b), a.max(b), (f * 3 + e) as u32));
        }
    }
    edges.sort_unstable();
    let mut across = vec![[0; 3]; triangles.len()];
    for pair in edges.chunks_exact(2) {
        let (x, y) = (pair[0].2, pair[1].2);
        across[x as usize / 3][x as usize % 3] = y / 3;
        across[y as usize / 3][y as usize % 3] = x / 3;
    }
    across
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Aabb;
    use crate::samples::cuboid;

    #[test]
    fn distances_to_a_box_are_exact_with_their_sign() {
        let b = Aabb {
            min: Vec3::ZERO,
            max: Vec3::new(4.0, 3.0, 2.0),
        };
        let solid = Solid::new(cuboid(b.min, b.max).to_mesh()).unwrap();
        let field = SignedDistance::new(&solid);
        for i in 0..1000 {
            let p = Vec3::new(f64::from(i % 10), f64::from(i / 10 % 10), f64::from(i / 100)) * 0.71 - 1.3;
            let outside = b.distance_sq(p).sqrt();
            let inside = (p - b.min).min(b.max - p).min_element();
            let expected = if b.contains(p) { inside } else { -outside };
            assert!(
                (field.at(p, 100.0).unwrap().signed_mm - expected).abs() < 1e-12,
                "{p}"
            );
        }
    }
}

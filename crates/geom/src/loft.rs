//! Regions swept by a polygon that moves.

use crate::{TriMesh, Vec3, Volume, polygon};

impl Volume {
    /// Region swept by a polygon that moves through `rings`: one closed loft with flat ends. All rings must
    /// have the same number of points, in the same order, and the loft must not fold back through itself.
    /// Empty for fewer than two rings, and where the first or the last ring bounds no polygon.
    pub fn loft(rings: &[Vec<Vec3>]) -> Self {
        let [first, .., last] = rings else {
            return Self::empty();
        };
        let Some((back, front)) = polygon::triangulate(first).zip(polygon::triangulate(last)) else {
            return Self::empty();
        };
        let n = first.len() as u32;
        let mut mesh = TriMesh {
            points: rings.concat(),
            triangles: Vec::new(),
        };
        for ring in 0..rings.len() as u32 - 1 {
            for i in 0..n {
                let (a, b) = (ring * n + i, ring * n + (i + 1) % n);
                mesh.triangles.extend([[a, b, b + n], [a, b + n, a + n]]);
            }
        }
        let to_last = (rings.len() as u32 - 1) * n;
        mesh.triangles.extend(back.iter().map(|&[a, b, c]| [a, c, b]));
        mesh.triangles
            .extend(front.iter().map(|t| t.map(|i| to_last + i)));
        if mesh.signed_volume() < 0.0 {
            mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        Self::from_closed_mesh(&mesh).unwrap_or_else(|_| Self::empty())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loft_of_a_square_is_a_box() {
        let ring = |x: f64| {
            [(0.0, 0.0), (1.0, 0.0), (1.0, 2.0), (0.0, 2.0)]
                .map(|(y, z)| Vec3::new(x, y, z))
                .to_vec()
        };
        for rings in [
            [ring(0.0), ring(1.0), ring(3.0)],
            [ring(3.0), ring(1.0), ring(0.0)],
        ] {
            assert!((Volume::loft(&rings).volume() - 6.0).abs() < 1e-12);
        }
    }
}

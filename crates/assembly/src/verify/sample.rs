//! Points spread evenly over a surface, reproducible on every run.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use shellock_geom::{TriMesh, Vec3};

/// Point on a surface and the triangle that it lies on.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Position of the point, mm.
    pub point: Vec3,
    /// Unit normal of the triangle, outwards.
    pub normal: Vec3,
    /// Index of the triangle.
    pub face: usize,
}

/// Samples `n` points on `mesh`, one in each of `n` strata of equal area; a function of the mesh, `n` and
/// `seed` alone.
///
/// Strata follow the order of the faces, so every region of more than two strata's area gets a point. Empty
/// for a mesh without area.
pub fn on_surface(mesh: &TriMesh, n: usize, seed: u64) -> Vec<Sample> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let areas: Vec<f64> = (0..mesh.triangles.len()).map(|f| mesh.face_area(f)).collect();
    let stratum = areas.iter().sum::<f64>() / n as f64;
    if !(stratum > 0.0 && stratum.is_finite()) {
        return Vec::new();
    }
    let mut samples = Vec::with_capacity(n);
    let (mut before, mut next) = (0.0, stratum * rng.random::<f64>());
    for (face, area) in areas.into_iter().enumerate() {
        before += area;
        let [a, b, c] = mesh.corners(face);
        while next < before && samples.len() < n {
            // The square root makes the density uniform over the triangle.
            let (toward_bc, along_bc) = (rng.random::<f64>().sqrt(), rng.random::<f64>());
            let point = a + (b - a + (c - b) * along_bc) * toward_bc;
            samples.push(Sample {
                point,
                normal: mesh.face_normal(face),
                face,
            });
            next = stratum * (samples.len() as f64 + rng.random::<f64>());
        }
    }
    samples
}

#[cfg(test)]
mod tests {
    use shellock_testkit::shapes::cuboid;

    use super::*;

    #[test]
    fn each_face_of_a_box_gets_its_share_of_the_points() {
        let mesh = cuboid([0.0; 3], [1.0, 2.0, 3.0]).to_mesh();
        let samples = on_surface(&mesh, 2200, 5);
        assert!((samples.len() as i32 - 2200).abs() <= 1);
        for (normal, area) in [(Vec3::X, 6.0), (Vec3::Y, 3.0), (Vec3::Z, 2.0)] {
            let met = samples.iter().filter(|s| s.normal.dot(normal) > 0.9).count();
            assert!(
                (met as f64 - area * 100.0).abs() < 5.0,
                "{met} points on {area} mm²"
            );
        }
    }
}

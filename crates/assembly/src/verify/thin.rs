//! How much of a piece is too thin to print well.

use rayon::prelude::*;
use shellock_geom::TriMesh;
use shellock_geom::bvh::TriangleBvh;

use super::sample;

/// Rays shot into a piece. The share is known to 1 % (two sigma at one half).
const N_SAMPLES: usize = 10_000;
/// Cosine of the greatest angle between two sides that make a wall; beyond 30° they make an edge, which
/// always is thin.
const COS_WALL: f64 = 0.866_025_403_784_438_6;
/// Where the ray starts below the surface, mm: more than rounding to single precision, less than any wall.
const START_MM: f64 = 1e-4;
/// One stream of random numbers for every piece.
const SEED: u64 = 0x7468_696e;

/// What [`thin_share`] found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinShare {
    /// Volume in walls thinner than asked for, over the piece's volume, in [0, 1].
    pub share: f64,
    /// The thinnest wall met: its place on the surface and its thickness, mm. `None` where no wall is too
    /// thin.
    pub worst: Option<([f64; 3], f64)>,
}

/// Share of a closed mesh's volume in walls thinner than `min_wall_mm`, and the thinnest place met.
///
/// Rays go inwards from 10 000 surface points; one counts where it meets, within `min_wall_mm`, a surface
/// that faces away within 30°. Each side of a wall owns half its volume. Nothing is thin in an empty mesh.
pub fn thin_share(mesh: &TriMesh, min_wall_mm: f64) -> ThinShare {
    let samples = sample::on_surface(mesh, N_SAMPLES, SEED);
    let volume = mesh.signed_volume();
    if samples.is_empty() || volume <= 0.0 {
        return ThinShare {
            share: 0.0,
            worst: None,
        };
    }
    let bvh = TriangleBvh::new(mesh);
    let walls_mm: Vec<Option<f64>> = samples
        .par_iter()
        .map(|s| {
            let inwards = -s.normal;
            let (face, distance) =
                bvh.first_hit(s.point + inwards * START_MM, inwards, min_wall_mm - START_MM)?;
            (mesh.face_normal(face as usize).dot(inwards) >= COS_WALL).then_some(distance + START_MM)
        })
        .collect();
    let mut worst: Option<([f64; 3], f64)> = None;
    let mut sum_mm = 0.0;
    for (sample, wall_mm) in samples.iter().zip(&walls_mm) {
        let Some(wall_mm) = *wall_mm else { continue };
        sum_mm += wall_mm;
        if worst.is_none_or(|w| wall_mm < w.1) {
            worst = Some((sample.point.to_array(), wall_mm));
        }
    }
    let share = 0.5 * sum_mm * mesh.area() / samples.len() as f64 / volume;
    ThinShare {
        share: share.min(1.0),
        worst,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shellock_geom::{Vec3, Volume};
    use shellock_testkit::shapes::cuboid;

    #[test]
    fn the_thin_part_of_a_block_with_a_fin_is_the_fin() {
        // 1000 mm³ of block, 10 × 10 × 0.5 = 50 mm³ of fin.
        let mesh = cuboid([0.0; 3], [10.0; 3])
            .union(&cuboid([0.0, 4.0, 10.0], [10.0, 4.5, 20.0]))
            .to_mesh();
        let thin = thin_share(&mesh, 0.8);
        assert!((thin.share - 50.0 / 1050.0).abs() < 0.003, "{thin:?}");
        let (at, wall_mm) = thin.worst.unwrap();
        assert!((wall_mm - 0.5).abs() < 1e-3 && at[2] > 9.9, "{thin:?}");
        assert_eq!(
            thin_share(&mesh, 0.4),
            ThinShare {
                share: 0.0,
                worst: None
            }
        );
    }

    #[test]
    fn a_sharp_wedge_is_no_thin_wall() {
        let wedge = Volume::hull(&[
            Vec3::ZERO,
            Vec3::new(10.0, 0.0, 0.0),
            Vec3::new(10.0, 7.0, 0.0),
            Vec3::new(0.0, 0.0, 9.0),
            Vec3::new(10.0, 0.0, 9.0),
            Vec3::new(10.0, 7.0, 9.0),
        ]);
        assert_eq!(thin_share(&wedge.to_mesh(), 0.8).share, 0.0);
        assert_eq!(thin_share(&TriMesh::default(), 0.8).share, 0.0);
    }
}

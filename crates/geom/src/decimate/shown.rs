//! Decimation for pictures: sharp edges stay where the eye looks for them.

use super::decimate;
use crate::TriMesh;
use crate::topology::Topology;

/// Least angle between two triangles whose common edge a viewer sees as an edge: 30°.
const SHARP_COS: f64 = 0.866;
/// Share of the tolerance at points of sharp edges. Two pieces meet there with a gap of a tenth of a
/// millimetre, so an edge that moves by more opens a notch in the picture.
const SHARP_SHARE: f64 = 0.2;

/// Decimates `mesh` like [`decimate`], for display: points of sharp edges have a fifth of `tolerance_mm`.
pub fn decimate_for_display(mesh: &TriMesh, tolerance_mm: f64) -> TriMesh {
    let mut tolerance = vec![tolerance_mm; mesh.points.len()];
    if let Some(topology) = Topology::of_mesh(mesh) {
        let normals: Vec<_> = (0..mesh.triangles.len()).map(|f| mesh.face_normal(f)).collect();
        for (face, corners) in mesh.triangles.iter().enumerate() {
            for (k, other) in topology.neighbours(face as u32).into_iter().enumerate() {
                if normals[face].dot(normals[other as usize]) < SHARP_COS {
                    tolerance[corners[k] as usize] = SHARP_SHARE * tolerance_mm;
                    tolerance[corners[(k + 1) % 3] as usize] = SHARP_SHARE * tolerance_mm;
                }
            }
        }
    }
    decimate(mesh.clone(), &tolerance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;
    use crate::bvh::TriangleBvh;
    use crate::decimate::tests::two_balls;

    /// Two balls of radius 10 mm; the second one's middle is here.
    const SECOND: Vec3 = Vec3::new(7.03, 1.02, 0.51);

    #[test]
    fn sharp_edges_move_less_than_half_as_far() {
        let both = two_balls();
        let off = |p: &Vec3, middle: Vec3| (p.distance(middle) - 10.0).abs();
        let is_crease = |p: &&Vec3| off(p, Vec3::ZERO) < 0.02 && off(p, SECOND) < 0.02;
        let crease: Vec<Vec3> = both.points.iter().filter(is_crease).copied().collect();
        assert!(crease.len() > 50, "{}", crease.len());
        let mean_mm = |mesh: &TriMesh| {
            let bvh = TriangleBvh::new(mesh);
            let away = |p: &Vec3| bvh.nearest(*p, 1.0).expect("within 1 mm").distance_sq.sqrt();
            crease.iter().map(away).sum::<f64>() / crease.len() as f64
        };
        let plain = decimate(both.clone(), &vec![0.2; both.points.len()]);
        let shown = decimate_for_display(&both, 0.2);
        let [shown_mm, plain_mm] = [&shown, &plain].map(mean_mm);
        assert!(shown_mm < 0.5 * plain_mm, "{shown_mm} {plain_mm}");
        assert!(shown.triangles.len() < both.triangles.len() / 4);
    }
}

//! Detection of thin places of a solid.

use rayon::prelude::*;

use crate::bvh::TriangleBvh;
use crate::topology::{Topology, components};
use crate::{Solid, Vec3};

/// Cosine of the greatest angle between two sides that form a wall. Beyond 30° they form an edge, which is
/// always thin.
const COS_WALL: f64 = 0.866_025_403_784_438_6;
/// Depth below the surface at which a ray starts, as a share of the thickness requested: more than rounding,
/// less than any wall.
const START_SHARE: f64 = 1e-6;

/// A connected part of the surface with another part close below it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinPlace {
    /// Area of the place, mm²; both sides of a wall that ends in an edge count.
    pub area_mm2: f64,
    /// Median thickness by area, mm. The least thickness says little, since edges taper off to nothing.
    pub thickness_mm: f64,
    /// A point of the surface with that thickness, mm.
    pub at: Vec3,
}

/// Thickness of the solid at each triangle, mm, measured as in [`thin_places`]; `None` where it is at least
/// `below_mm`.
pub fn thin_faces(solid: &Solid, below_mm: f64) -> Vec<Option<f64>> {
    let mesh = solid.mesh();
    let bvh = TriangleBvh::new(mesh);
    let start = START_SHARE * below_mm;
    (0..mesh.triangles.len())
        .into_par_iter()
        .map(|face| {
            let inwards = -mesh.face_normal(face);
            let (other, distance) = bvh.first_hit(
                mesh.face_center(face) + start * inwards,
                inwards,
                below_mm - start,
            )?;
            (mesh.face_normal(other as usize).dot(inwards) >= COS_WALL).then_some(distance + start)
        })
        .collect()
}

/// Finds the places where the solid is thinner than `below_mm`, largest first.
///
/// Thickness is measured from the centre of each triangle straight inwards, to a surface that faces away
/// within 30°. Triangles should therefore be smaller than the places sought. O(n log n); the same on any
/// number of threads.
pub fn thin_places(solid: &Solid, below_mm: f64) -> Vec<ThinPlace> {
    let mesh = solid.mesh();
    let thickness_mm = thin_faces(solid, below_mm);
    let is_thin = |face: u32| thickness_mm[face as usize].is_some();
    let topology = Topology::new(solid);
    let (place_of_face, n_places) = components(&topology, |a, b| is_thin(a) == is_thin(b));
    let mut faces_of: Vec<Vec<(f64, usize)>> = vec![Vec::new(); n_places];
    for (face, place) in place_of_face.iter().enumerate() {
        faces_of[*place as usize].extend(thickness_mm[face].map(|mm| (mm, face)));
    }
    let mut places: Vec<ThinPlace> = faces_of
        .into_iter()
        .filter_map(|mut faces| {
            faces.sort_by(|a, b| a.0.total_cmp(&b.0));
            let area_mm2 = faces.iter().map(|&(_, face)| mesh.face_area(face)).sum();
            let mut below_mm2 = 0.0;
            let median = faces.iter().find(|&&(_, face)| {
                below_mm2 += mesh.face_area(face);
                2.0 * below_mm2 >= area_mm2
            });
            median.map(|&(thickness_mm, face)| ThinPlace {
                area_mm2,
                thickness_mm,
                at: mesh.face_center(face),
            })
        })
        .collect();
    places.sort_by(|a, b| b.area_mm2.total_cmp(&a.area_mm2));
    places
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::cuboid;

    #[test]
    fn a_fin_on_a_block_is_found_with_its_thickness_and_both_sides() {
        let mesh = cuboid([0.0; 3], [10.0; 3])
            .union(&cuboid([0.0, 4.0, 10.0], [10.0, 4.5, 20.0]))
            .to_mesh();
        let solid = Solid::new(mesh).unwrap();
        let places = thin_places(&solid, 1.0);
        assert!(
            (places.iter().map(|p| p.area_mm2).sum::<f64>() - 200.0).abs() < 1e-9,
            "{places:?}"
        );
        assert!(
            places
                .iter()
                .all(|p| (p.thickness_mm - 0.5).abs() < 1e-9 && p.at.z > 10.0)
        );
        assert_eq!(thin_places(&solid, 0.4), []);
    }
}

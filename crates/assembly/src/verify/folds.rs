//! Folds of a piece's surface, as the verification reports them.

use shellock_geom::bvh::TriangleBvh;
use shellock_geom::fold::folded_faces;
use shellock_geom::{TriMesh, Vec3};

/// Faces of a mesh that have material right in front of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fold {
    /// Number of the faces, one at least.
    pub n_faces: usize,
    /// Area of the faces, mm².
    pub area_mm2: f64,
    /// Middle of the first face.
    pub at: Vec3,
}

impl Fold {
    /// Finds the faces of a closed mesh that have material right in front of them; `None` if there are none.
    pub fn of(mesh: &TriMesh) -> Option<Self> {
        let faces = folded_faces(mesh, &TriangleBvh::new(mesh));
        Some(Self {
            n_faces: faces.len(),
            area_mm2: faces.iter().map(|&face| mesh.face_area(face as usize)).sum(),
            at: mesh.face_center(*faces.first()? as usize),
        })
    }
}

#[cfg(test)]
mod tests {
    use shellock_testkit::shapes::cuboid;

    use super::*;

    #[test]
    fn faces_inside_other_material_are_a_fold_and_those_of_a_cavity_are_none() {
        let outer = cuboid([0.0; 3], [10.0; 3]);
        let inner = cuboid([2.0; 3], [8.0; 3]);
        assert_eq!(Fold::of(&outer.subtract(&inner).to_mesh()), None);
        // Both surfaces at once, not united: the inner one lies within the material of the outer one.
        let (mut both, inner) = (outer.to_mesh(), inner.to_mesh());
        let first = both.points.len() as u32;
        both.points.extend(&inner.points);
        both.triangles
            .extend(inner.triangles.iter().map(|t| t.map(|v| v + first)));
        let fold = Fold::of(&both).expect("the inner faces have material in front");
        assert_eq!(fold.n_faces, inner.triangles.len());
        assert!((fold.area_mm2 - inner.area()).abs() < 1e-9);
        assert!((fold.at - Vec3::splat(5.0)).abs().max_element() > 2.9);
        // Faces of less than 0.01 mm² are not judged.
        let points = both.points.iter().map(|p| 1e-2 * *p).collect();
        assert_eq!(Fold::of(&TriMesh { points, ..both }), None);
    }
}

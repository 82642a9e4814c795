//! Subtraction of closed meshes from another.

use rayon::prelude::*;

use super::closed;
use crate::boolean::Volume;
use crate::bvh::TriangleBvh;
use crate::check::InputError;
use crate::{TriMesh, Vec3};

/// Result of subtracting cutters from a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Cut {
    /// Closed surface of the remaining body, which may be in several parts.
    pub mesh: TriMesh,
    /// Source triangle of each triangle.
    pub faces: Vec<CutFace>,
    /// True for each cutter that removes anything.
    pub is_met: Vec<bool>,
}

/// Origin of a triangle after a cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CutFace {
    /// A triangle of the body.
    Body(usize),
    /// A triangle of a cutter.
    Cutter {
        /// Index of the cutter in the list.
        cutter: usize,
        /// Index of the triangle in the cutter.
        face: usize,
        /// Triangle of the body nearest to it.
        nearest: usize,
    },
}

impl CutFace {
    /// Triangle of the body that this one is a part of, or is nearest to.
    pub fn nearest(self) -> usize {
        match self {
            Self::Body(face) => face,
            Self::Cutter { nearest, .. } => nearest,
        }
    }
}

/// Reason why a cut cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{reason}")]
pub struct CutError {
    /// Cutter at fault; `None` if it is the body.
    pub cutter: Option<usize>,
    /// Description of the problem, with a remedy.
    pub reason: String,
}

/// Cuts `cutters` out of `body`, by exact arithmetic. All of them are first repaired as by [`super::repair`],
/// and may have several bodies.
///
/// Fails if a mesh bounds no volume, and if the cut leaves nothing.
pub fn cut_out(body: &TriMesh, cutters: &[&TriMesh]) -> Result<Cut, CutError> {
    let refused = |cutter| {
        move |error: InputError| CutError {
            cutter,
            reason: error.to_string(),
        }
    };
    let volume = volume(body).map_err(refused(None))?;
    let mut left = volume.clone();
    let mut is_met = Vec::new();
    for (k, cutter) in cutters.iter().enumerate() {
        let cutter = self::volume(cutter).map_err(refused(Some(k)))?;
        is_met.push(!volume.intersect(&cutter).is_empty());
        left = left.subtract(&cutter);
    }
    if left.is_empty() {
        return Err(CutError {
            cutter: None,
            reason: "nothing is left of it; make what is cut out smaller".to_owned(),
        });
    }
    let mesh = left.to_mesh();
    let faces = origins(&mesh, body, cutters);
    Ok(Cut { mesh, faces, is_met })
}

fn volume(mesh: &TriMesh) -> Result<Volume, InputError> {
    let (closed, at) = (closed(mesh)?, mesh.face_center(0));
    Volume::from_closed_mesh(&closed).map_err(|_| InputError::Crossing { count: 1, at })
}

/// Origin of each triangle of a cut: the source triangle nearest to its centre.
fn origins(mesh: &TriMesh, body: &TriMesh, cutters: &[&TriMesh]) -> Vec<CutFace> {
    let of_body = TriangleBvh::new(body);
    let of_cutters: Vec<TriangleBvh> = cutters.iter().map(|cutter| TriangleBvh::new(cutter)).collect();
    let nearest = |tree: &TriangleBvh, point: Vec3| {
        let found = tree.nearest(point, f64::INFINITY);
        found.map_or((f64::INFINITY, 0), |n| (n.distance_sq, n.face as usize))
    };
    (0..mesh.triangles.len())
        .into_par_iter()
        .map(|face| {
            let point = mesh.face_center(face);
            let (body_sq, own) = nearest(&of_body, point);
            let of_cutter = of_cutters
                .iter()
                .enumerate()
                .map(|(k, tree)| (k, nearest(tree, point)));
            match of_cutter.min_by(|a, b| a.1.0.total_cmp(&b.1.0)) {
                Some((cutter, (distance_sq, face))) if distance_sq < body_sq => CutFace::Cutter {
                    cutter,
                    face,
                    nearest: own,
                },
                _ => CutFace::Body(own),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::cuboid;

    #[test]
    fn what_is_cut_out_is_missing_and_every_triangle_knows_its_origin() {
        let body = cuboid([0.0; 3], [10.0; 3]).to_mesh();
        let through = cuboid([4.0, 4.0, -1.0], [6.0, 6.0, 11.0]).to_mesh();
        let beside = cuboid([20.0; 3], [21.0; 3]).to_mesh();
        let cut = cut_out(&body, &[&through, &beside]).unwrap();
        assert!((cut.mesh.signed_volume() - (1000.0 - 40.0)).abs() < 1e-9);
        assert_eq!(cut.is_met, [true, false]);
        for (face, origin) in cut.faces.iter().enumerate() {
            let [x, y, _] = cut.mesh.face_center(face).to_array();
            let is_inner =
                (x - 5.0).abs() < 1.5 && (y - 5.0).abs() < 1.5 && cut.mesh.face_normal(face).z == 0.0;
            assert_eq!(
                matches!(origin, CutFace::Cutter { cutter: 0, .. }),
                is_inner,
                "{x} {y}"
            );
        }
    }

    #[test]
    fn open_cutters_and_cuts_that_leave_nothing_are_refused() {
        let body = cuboid([0.0; 3], [10.0; 3]).to_mesh();
        let mut open = cuboid([4.0; 3], [20.0; 3]).to_mesh();
        open.triangles.truncate(6);
        let refused = cut_out(&body, &[&body.clone(), &open]).unwrap_err();
        assert_eq!(refused.cutter, Some(1));
        assert!(refused.reason.contains("not closed"), "{refused}");
        let all = cuboid([-1.0; 3], [11.0; 3]).to_mesh();
        assert!(
            cut_out(&body, &[&all])
                .unwrap_err()
                .reason
                .contains("nothing is left")
        );
    }
}

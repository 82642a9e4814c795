//! Subtraction of closed meshes from another.

use rayon::prelude::*;

use super::close_surface;
use crate::boolean::Volume;
use crate::bvh::TriangleBvh;
use crate::check::InputError;
use crate::{TriMesh, Vec3};

/// Result of subtracting cutters from a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Carving {
    /// Closed surface of the remaining body, which may be in several parts.
    pub mesh: TriMesh,
    /// Source triangle of each triangle.
    pub faces: Vec<CutFace>,
    /// True for each cutter that removes anything.
    pub is_met: Vec<bool>,
    /// For each cutter whether it had holes, which were closed.
    pub was_open: Vec<bool>,
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
pub enum CutError {
    /// The body bounds no volume.
    #[error("{0}")]
    Body(InputError),
    /// A cutter, by its place in the list, bounds no volume.
    #[error("{1}")]
    Cutter(usize, InputError),
    /// The cutters take all of the body away.
    #[error("nothing is left")]
    NothingLeft,
}

/// Cuts `cutters` out of `body`, by exact arithmetic. All of them are first repaired as by [`super::repair`],
/// and may have several bodies.
///
/// Fails if a mesh bounds no volume, and if the cut leaves nothing.
pub fn cut_out(body: &TriMesh, cutters: &[&TriMesh]) -> Result<Carving, CutError> {
    let (volume, _) = volume(body).map_err(CutError::Body)?;
    let mut left = volume.clone();
    let (mut is_met, mut was_open) = (Vec::new(), Vec::new());
    for (k, cutter) in cutters.iter().enumerate() {
        let (cutter, had_holes) = self::volume(cutter).map_err(|error| CutError::Cutter(k, error))?;
        was_open.push(had_holes);
        is_met.push(!volume.intersect(&cutter).is_empty());
        left = left.subtract(&cutter);
    }
    if left.is_empty() {
        return Err(CutError::NothingLeft);
    }
    let mesh = left.to_mesh();
    let faces = origins(&mesh, body, cutters);
    Ok(Carving {
        mesh,
        faces,
        is_met,
        was_open,
    })
}

/// Returns the volume inside a surface, and true if holes had to be closed for it.
fn volume(mesh: &TriMesh) -> Result<(Volume, bool), InputError> {
    let ((closed, had_holes), at) = (close_surface(mesh)?, mesh.face_center(0));
    let volume = Volume::from_closed_mesh(&closed).map_err(|_| InputError::Crossing { count: 1, at })?;
    Ok((volume, had_holes))
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
        assert!(matches!(refused, CutError::Cutter(1, _)));
        assert!(refused.to_string().contains("not closed"), "{refused}");
        let mut less_open = cuboid([4.0; 3], [20.0; 3]).to_mesh();
        less_open.triangles.truncate(11);
        let cut = cut_out(&body, &[&less_open, &cuboid([8.0; 3], [11.0; 3]).to_mesh()]).unwrap();
        assert_eq!(cut.was_open, [true, false]);
        let all = cuboid([-1.0; 3], [11.0; 3]).to_mesh();
        assert_eq!(cut_out(&body, &[&all]), Err(CutError::NothingLeft));
    }
}

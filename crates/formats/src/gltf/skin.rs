//! Skins: points moved by joints.
//!
//! A point p of a mesh with a skin is moved to Σ wₖ · Gₖ · Bₖ · p, where wₖ is its weight for joint k. Gₖ is
//! the transform from that joint to the scene, Bₖ the inverse bind matrix, from the mesh to the joint. The
//! transform of the node that has the mesh is ignored.

use glam::{DAffine3, DMat3, DMat4, DVec3};

use super::super::ReadError;
use super::document::Primitive;
use super::nodes::Nodes;
use super::primitives::Piece;
use super::values::{Accessors, Shape, Values};
use super::{error, missing_error};

/// Largest number of joints that points can address, in 16 bits.
const MAX_JOINTS: usize = 1 << 16;
/// Joints per point in a set of JOINTS_n and WEIGHTS_n.
const JOINTS_PER_SET: usize = 4;

/// A skin in the pose of its joints.
pub(super) struct Pose {
    skin: usize,
    /// Matrix Gₖ · Bₖ of each joint.
    scene_from_mesh: Vec<DAffine3>,
}

/// Points moved by joints, in the scene.
pub(super) struct Posed {
    pub(super) points: Vec<DVec3>,
    /// Determinant of each point's blended matrix; negative if the matrix mirrors.
    pub(super) determinants: Vec<f64>,
}

/// Pairs of JOINTS_n and WEIGHTS_n with equal n.
type Sets<'a> = Vec<(Values<'a>, Values<'a>)>;

impl Accessors<'_> {
    /// Computes the pose of skin `which`. Missing inverse bind matrices are identities.
    pub(super) fn pose(&self, which: usize, nodes: &Nodes) -> Result<Pose, ReadError> {
        let skin = self.document.skins.get(which);
        let skin = skin.ok_or_else(|| missing_error("skin", which))?;
        let binds = skin.inverse_bind_matrices;
        let binds = binds.map(|b| self.values(b, Shape::Mat4)).transpose()?;
        let joints = &skin.joints[..skin.joints.len().min(MAX_JOINTS)];
        if let Some(binds) = binds.as_ref().filter(|binds| binds.count < joints.len()) {
            return Err(error(format!(
                "skin {which} has {} joints, but {} inverse bind matrices",
                joints.len(),
                binds.count
            )));
        }
        self.effort.spend(joints.len())?;
        let scene_from_mesh = joints.iter().enumerate().map(|(k, &joint)| {
            let placed = nodes
                .transforms
                .get(joint)
                .ok_or_else(|| missing_error("node", joint))?;
            let bind = binds.as_ref().map_or(DAffine3::IDENTITY, |binds| {
                DAffine3::from_mat4(DMat4::from_cols_array(&binds.row(k)))
            });
            let matrix = *placed * bind;
            if matrix.is_finite() {
                Ok(matrix)
            } else {
                Err(error(format!(
                    "the matrix of joint {k} of skin {which} is not finite"
                )))
            }
        });
        Ok(Pose {
            skin: which,
            scene_from_mesh: scene_from_mesh.collect::<Result<_, _>>()?,
        })
    }

    /// Moves the points of `piece` to `pose`; `None` if the primitive has no joints or no weights.
    pub(super) fn apply_pose(
        &self,
        primitive: &Primitive,
        pose: &Pose,
        piece: &Piece,
    ) -> Result<Option<Posed>, ReadError> {
        let sets = self.joint_sets(primitive, piece)?;
        if sets.is_empty() {
            return Ok(None);
        }
        let mut posed = Posed {
            points: Vec::with_capacity(piece.used.len()),
            determinants: Vec::with_capacity(piece.used.len()),
        };
        for (&row, &point) in piece.used.iter().zip(&piece.points) {
            let matrix = pose.blend(&sets, row as usize)?;
            posed.points.push(matrix.transform_point3(point));
            posed.determinants.push(matrix.matrix3.determinant());
        }
        Ok(Some(posed))
    }

    /// Reads all sets of joints and weights of a primitive.
    fn joint_sets(&self, primitive: &Primitive, piece: &Piece) -> Result<Sets<'_>, ReadError> {
        let mut sets = Vec::new();
        loop {
            let attribute = |name: &str| primitive.attributes.get(&format!("{name}_{}", sets.len()));
            let (Some(&joints), Some(&weights)) = (attribute("JOINTS"), attribute("WEIGHTS")) else {
                return Ok(sets);
            };
            self.effort
                .spend(piece.used.len().saturating_mul(JOINTS_PER_SET))?;
            let set = (
                self.values(joints, Shape::Vec4)?,
                self.values(weights, Shape::Vec4)?,
            );
            if set.0.count != piece.n_rows || set.1.count != piece.n_rows {
                return Err(error(format!(
                    "{} points have {} rows of joints and {} of weights",
                    piece.n_rows, set.0.count, set.1.count
                )));
            }
            sets.push(set);
        }
    }
}

impl Pose {
    /// Weighted mean of the joints' matrices for the point in `row`. Weights are normalised to a sum of 1. If
    /// all are 0, the point follows its first joint, as in three.js.
    fn blend(&self, sets: &Sets, row: usize) -> Result<DAffine3, ReadError> {
        let (mut sum, mut linear, mut shift) = (0.0, DMat3::ZERO, DVec3::ZERO);
        for (joints, weights) in sets {
            let joints: [f64; JOINTS_PER_SET] = joints.row(row);
            let weights: [f64; JOINTS_PER_SET] = weights.row(row);
            for (joint, weight) in joints.into_iter().zip(weights) {
                if weight != 0.0 {
                    let matrix = self.joint(joint, row)?;
                    sum += weight;
                    linear += weight * matrix.matrix3;
                    shift += weight * matrix.translation;
                }
            }
        }
        if !sum.is_finite() {
            return Err(error(format!(
                "a weight of point {row} for skin {} is not a finite number",
                self.skin
            )));
        }
        if sum <= 0.0 {
            let first = sets
                .first()
                .map_or(0.0, |(joints, _)| joints.row::<JOINTS_PER_SET>(row)[0]);
            return self.joint(first, row);
        }
        Ok(DAffine3 {
            matrix3: linear * (1.0 / sum),
            translation: shift / sum,
        })
    }

    fn joint(&self, joint: f64, row: usize) -> Result<DAffine3, ReadError> {
        let found = self.scene_from_mesh.get(joint as usize);
        found.copied().ok_or_else(|| {
            error(format!(
                "point {row} follows joint {joint} of skin {}, which has {}",
                self.skin,
                self.scene_from_mesh.len()
            ))
        })
    }
}

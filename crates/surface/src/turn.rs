//! Rotation of the model so that a wanted direction is one of the 26.

use glam::{DMat3, DQuat};
use shellock_assembly::LatticeDirection;
use shellock_geom::{NotSolid, Solid, TriMesh, Vec3, Volume};

/// Least rotation that counts, rad: a smaller one moves nothing by more than 0.001 mm over 300 mm.
const LEAST_TURN: f64 = 3e-6;

/// A rotation about the origin, from the model as it was given to the model as its pieces are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn(DMat3);

impl Default for Turn {
    fn default() -> Self {
        Self(DMat3::IDENTITY)
    }
}

impl Turn {
    /// Smallest rotation that takes `normal` to an axis and `slide`, perpendicular to it, to a lattice
    /// direction perpendicular to that axis. Also returns that direction.
    pub fn align(normal: Vec3, slide: Vec3) -> (Self, LatticeDirection) {
        let axis = [Vec3::X, Vec3::Y, Vec3::Z]
            .into_iter()
            .flat_map(|a| [a, -a])
            .max_by(|a, b| a.dot(normal).total_cmp(&b.dot(normal)))
            .expect("there are six axes");
        let tip = DMat3::from_quat(DQuat::from_rotation_arc(normal, axis));
        let tipped = tip * slide;
        let flat = LatticeDirection::all().filter(|s| s.unit().dot(axis).abs() < 0.5);
        let direction = flat
            .max_by(|a, b| a.unit().dot(tipped).total_cmp(&b.unit().dot(tipped)))
            .expect("eight lie in the plane");
        let to = direction.unit();
        let angle = tipped.cross(to).dot(axis).atan2(tipped.dot(to));
        let whole = DMat3::from_axis_angle(axis, angle) * tip;
        let is_none = DQuat::from_mat3(&whole).to_axis_angle().1.abs() < LEAST_TURN;
        (if is_none { Self::default() } else { Self(whole) }, direction)
    }

    /// Returns true if the rotation is the identity.
    pub fn is_none(&self) -> bool {
        self.0 == DMat3::IDENTITY
    }

    /// Rotation angle, rad, in [0, π].
    pub fn angle(&self) -> f64 {
        DQuat::from_mat3(&self.0).to_axis_angle().1.abs()
    }

    /// The inverse of this rotation.
    pub fn inverse(&self) -> Self {
        Self(self.0.transpose())
    }

    /// Rotates a point or a direction.
    pub fn apply(&self, v: Vec3) -> Vec3 {
        if self.is_none() { v } else { self.0 * v }
    }

    /// Rotates a mesh, keeping its triangles.
    pub fn mesh(&self, mesh: &TriMesh) -> TriMesh {
        TriMesh {
            points: mesh.points.iter().map(|&p| self.apply(p)).collect(),
            triangles: mesh.triangles.clone(),
        }
    }

    /// Rotates a solid; fails where rounding leaves no volume.
    pub fn solid(&self, solid: &Solid) -> Result<Solid, NotSolid> {
        Solid::new(self.mesh(solid.mesh()))
    }

    /// Rotates the region of a volume.
    pub fn volume(&self, volume: &Volume) -> Volume {
        if self.is_none() {
            volume.clone()
        } else {
            volume.rotate([self.0.x_axis, self.0.y_axis, self.0.z_axis])
        }
    }
}

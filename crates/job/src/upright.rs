//! Turns of vectors between a model as it was given and as it stands, with z up.

use shellock_geom::Vec3;

use crate::options::Axis;

/// Turns a vector so that `up` becomes z.
pub fn turn_upright(up: Axis, v: Vec3) -> Vec3 {
    match up {
        Axis::X => Vec3::new(-v.z, v.y, v.x),
        Axis::Y => Vec3::new(v.x, -v.z, v.y),
        Axis::Z => v,
    }
}

/// Turns a vector back: `turn_back(up, turn_upright(up, v))` is `v`.
pub fn turn_back(up: Axis, v: Vec3) -> Vec3 {
    match up {
        Axis::X => Vec3::new(v.z, v.y, -v.x),
        Axis::Y => Vec3::new(v.x, v.z, -v.y),
        Axis::Z => v,
    }
}

//! Places in words, for somebody who stands in front of the model; coordinates are for machines.

use shellock::verify::words::PlaceWords;
use shellock_geom::{Aabb, TriMesh, Vec3};

use crate::options::Axis;
use crate::upright::turn_upright;

/// A model in upright position.
pub struct Standing {
    up: Axis,
    /// Bounding box with z up, mm. The front is towards −y, as [`shellock::segmentation::figures::front_of`]
    /// says, the left towards −x.
    bounds: Aabb,
}

impl Standing {
    /// Creates it for a mesh whose axis `up` points upwards.
    pub fn of(up: Axis, mesh: &TriMesh) -> Self {
        let bounds = Aabb::around(mesh.points.iter().map(|&p| turn_upright(up, p)));
        Self { up, bounds }
    }

    /// Describes a place as in "left front, 42 mm up" or "underneath, in the middle".
    pub fn words(&self, at: [f64; 3]) -> String {
        /// Share of the height within which a place counts as at the bottom or at the top.
        const END: f64 = 0.03;
        let from_corner = turn_upright(self.up, Vec3::from(at)) - self.bounds.min;
        let share = from_corner / self.bounds.size().max(Vec3::splat(f64::MIN_POSITIVE));
        let third = |share: f64, ends: [&'static str; 2]| match share {
            s if s < 1.0 / 3.0 => Some(ends[0]),
            s if s > 2.0 / 3.0 => Some(ends[1]),
            _ => None,
        };
        let around = [
            third(share.x, ["left", "right"]),
            third(share.y, ["front", "back"]),
        ];
        let around: Vec<&str> = around.into_iter().flatten().collect();
        let around = match &around[..] {
            [] => "in the middle".to_owned(),
            [one] => format!("at the {one}"),
            both => both.join(" "),
        };
        match share.z {
            z if z < END => format!("underneath, {around}"),
            z if z > 1.0 - END => format!("on top, {around}"),
            _ => format!("{around}, {:.0} mm up", from_corner.z),
        }
    }
}

impl PlaceWords for Standing {
    fn place(&self, at: [f64; 3]) -> String {
        self.words(at)
    }

    /// Describes a direction as in "to the left and up".
    fn way(&self, along: [f64; 3]) -> String {
        /// Components below this share of the length are left out: 22.5°.
        const LEAST: f64 = 0.38;
        let d = turn_upright(self.up, Vec3::from(along)).normalize_or_zero();
        let part = |x: f64, ways: [&'static str; 2]| (x.abs() > LEAST).then(|| ways[usize::from(x > 0.0)]);
        let parts = [
            part(d.x, ["to the left", "to the right"]),
            part(d.y, ["to the front", "to the back"]),
            part(d.z, ["down", "up"]),
        ];
        let parts: Vec<&str> = parts.into_iter().flatten().collect();
        parts.join(" and ")
    }
}

#[cfg(test)]
mod tests {
    use shellock::segmentation::figures::front_of;

    use super::*;

    #[test]
    fn places_are_told_as_one_sees_them_from_the_front() {
        let mesh = TriMesh {
            points: vec![Vec3::ZERO, Vec3::new(90.0, 60.0, 100.0)],
            triangles: Vec::new(),
        };
        let z_up = Standing::of(Axis::Z, &mesh);
        assert_eq!(z_up.words([1.0, 1.0, 42.0]), "left front, 42 mm up");
        assert_eq!(z_up.words([80.0, 30.0, 1.0]), "underneath, at the right");
        assert_eq!(z_up.words([45.0, 30.0, 99.0]), "on top, in the middle");
        assert_eq!(z_up.way([0.0, 0.0, -2.0]), "down");
        assert_eq!(z_up.way([-1.0, 0.1, 1.0]), "to the left and up");
        // With y up, points with the greatest z are at the front.
        let y_up = Standing::of(Axis::Y, &mesh);
        assert_eq!(y_up.words([45.0, 30.0, 99.0]), "at the front, 30 mm up");
    }

    /// The front is defined by [`front_of`]; places are described, and pictures drawn, of models turned by
    /// [`turn_upright`].
    #[test]
    fn the_front_is_where_the_library_has_it() {
        for up in [Axis::X, Axis::Y, Axis::Z] {
            let front = turn_upright(up, Vec3::from(front_of(up.unit())));
            assert_eq!(front + 0.0, Vec3::NEG_Y);
        }
    }
}

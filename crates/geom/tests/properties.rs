//! Properties of booleans and measures that hold for all bodies.

use proptest::prelude::*;
use shellock_geom::{Solid, Vec3, Volume};
use shellock_testkit::property::{cases, turns, vectors};
use shellock_testkit::shapes::{ball, cuboid, sphere};

/// A body near the origin, 2 to 10 mm wide.
#[derive(Clone, Copy, Debug)]
enum Body {
    Cuboid { at: Vec3, size: Vec3 },
    Ball { at: Vec3, radius_mm: f64 },
}

impl Body {
    fn volume(self) -> Volume {
        match self {
            Self::Cuboid { at, size } => cuboid(at, at + size),
            Self::Ball { at, radius_mm } => Volume::from_closed_mesh(&ball(2, at, radius_mm)).unwrap(),
        }
    }
}

fn bodies() -> impl Strategy<Value = Body> {
    let sizes = prop::array::uniform3(2.0..10.0f64).prop_map(Vec3::from_array);
    prop_oneof![
        (vectors(4.0), sizes).prop_map(|(at, size)| Body::Cuboid { at, size }),
        (vectors(4.0), 1.0..5.0f64).prop_map(|(at, radius_mm)| Body::Ball { at, radius_mm }),
    ]
}

/// Relative rounding error of volumes, which are exact except for coordinates that are rounded where surfaces
/// cross.
const ROUNDING: f64 = 1e-9;

proptest! {
    #![proptest_config(cases(60))]

    #[test]
    fn volumes_of_two_bodies_are_those_of_their_union_and_their_common_part(a in bodies(), b in bodies()) {
        let [a, b] = [a, b].map(Body::volume);
        let sum = a.volume() + b.volume();
        let parts = a.union(&b).volume() + a.intersect(&b).volume();
        prop_assert!((sum - parts).abs() < ROUNDING * sum, "{sum} is not {parts}");
    }

    #[test]
    fn what_is_taken_away_and_what_is_common_is_the_whole(a in bodies(), b in bodies()) {
        let [a, b] = [a, b].map(Body::volume);
        let parts = a.subtract(&b).volume() + a.intersect(&b).volume();
        prop_assert!((a.volume() - parts).abs() < ROUNDING * a.volume());
        let (inside, outside) = a.split(&b);
        prop_assert!((inside.volume() - a.intersect(&b).volume()).abs() < ROUNDING * a.volume());
        prop_assert!((outside.volume() - a.subtract(&b).volume()).abs() < ROUNDING * a.volume());
    }

    #[test]
    fn booleans_do_not_mind_the_order_of_operands(a in bodies(), b in bodies(), c in bodies()) {
        let [a, b, c] = [a, b, c].map(Body::volume);
        let all = Volume::union_all(vec![a.clone(), b.clone(), c.clone()]).volume();
        let other = c.union(&b.union(&a)).volume();
        prop_assert!((all - other).abs() < ROUNDING * all, "{all} is not {other}");
    }

    #[test]
    fn a_motion_keeps_volume_and_area_and_takes_the_centroid_along(
        turn in turns(), shift in vectors(200.0), radii in prop::array::uniform3(1.0..30.0f64),
    ) {
        let mesh = sphere(2, Vec3::from_array(radii));
        let moved = turn.mesh(&mesh, shift);
        let solid = Solid::new(moved.clone()).unwrap();
        prop_assert!((solid.volume() / mesh.signed_volume() - 1.0).abs() < 1e-9);
        prop_assert!((moved.area() / mesh.area() - 1.0).abs() < 1e-12);
        prop_assert!(moved.centroid().distance(turn.apply(mesh.centroid()) + shift) < 1e-9);
    }
}

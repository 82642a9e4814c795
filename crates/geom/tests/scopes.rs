//! Gaps for both scopes in one query, against a query for each scope.

use shellock_geom::clearance::{Scope, Shape, Translation, least_gap, least_gaps, swept_gap, swept_gaps};
use shellock_geom::{Solid, Vec3};
use shellock_testkit::shapes;

/// Ball of which only the triangles above a plane count.
fn ball(center: Vec3, radius_mm: f64, counts_above_mm: f64) -> Shape {
    let mesh = shapes::ball(3, center, radius_mm);
    let solid = Solid::new(mesh).expect("a ball is closed");
    let above: Vec<bool> = (0..solid.mesh().triangles.len())
        .map(|face| solid.mesh().face_center(face).z > counts_above_mm)
        .collect();
    Shape::new(&solid).count_only(|face| above[face])
}

/// Balls that are apart, touch, cross, or are too far; none, some or all of their triangles count.
fn pairs() -> Vec<(Shape, Shape)> {
    let offsets = [
        Vec3::new(20.3, 0.4, 1.0),
        Vec3::new(19.0, 3.0, -2.0),
        Vec3::new(16.0, 4.0, 6.0),
        Vec3::new(40.0, 0.0, 0.0),
    ];
    let limits = [-20.0, 0.5, 3.0, 20.0];
    let ball_at = |offset, limit| (ball(Vec3::ZERO, 10.0, limit), ball(offset, 10.0, 0.5 * limit));
    offsets
        .iter()
        .flat_map(|offset| limits.iter().map(move |limit| ball_at(*offset, *limit)))
        .collect()
}

#[test]
fn gaps_at_rest_are_those_of_each_scope() {
    for (a, b) in pairs() {
        let both = least_gaps(&a, &b, 2.0);
        let of = |scope| least_gap(&a, &b, scope, 2.0).map(|gap| gap.gap_mm);
        assert_eq!(both.everything.map(|gap| gap.gap_mm), of(Scope::Everything));
        assert_eq!(both.what_counts.map(|gap| gap.gap_mm), of(Scope::WhatCounts));
    }
}

#[test]
fn gaps_on_a_way_are_those_of_each_scope() {
    for along in [Vec3::X, Vec3::new(0.3, 1.0, 0.2), -Vec3::Z] {
        let way = Translation {
            along,
            from_mm: 0.0,
            far_mm: f64::INFINITY,
        };
        for (a, b) in pairs() {
            let both = swept_gaps(&a, &b, &way, 2.0);
            let of = |scope| swept_gap(&a, &b, &way, scope, 2.0).map(|gap| gap.gap_mm);
            assert_eq!(both.everything.map(|gap| gap.gap_mm), of(Scope::Everything));
            assert_eq!(both.what_counts.map(|gap| gap.gap_mm), of(Scope::WhatCounts));
        }
    }
}

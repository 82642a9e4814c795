use super::pair::at_rest;
use super::*;
use crate::Volume;
use crate::bvh::nearest_on_triangle;
use crate::contour::contour;
use crate::samples::cuboid;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

fn solid(volume: &Volume) -> Solid {
    Solid::new(volume.to_mesh()).expect("a solid")
}

fn shape(volume: &Volume) -> Shape {
    Shape::new(&solid(volume))
}

fn random_point(rng: &mut ChaCha8Rng) -> Vec3 {
    Vec3::new(rng.random(), rng.random(), rng.random())
}

/// Body of a few random tetrahedra, united.
fn lump(rng: &mut ChaCha8Rng, shift: Vec3) -> Volume {
    let mut part = || Volume::hull(&[0; 4].map(|_| shift + 3.0 * random_point(rng)));
    Volume::union_all(vec![part(), part(), part()])
}

fn shift(t: [Vec3; 3], by: Vec3) -> [Vec3; 3] {
    t.map(|p| p + by)
}

/// Least distance over all pairs of triangles, with `a` moved by `by`.
fn by_brute_force(a: &TriMesh, b: &TriMesh, by: Vec3) -> f64 {
    let faces = |m: &TriMesh| 0..m.triangles.len();
    faces(a)
        .flat_map(|i| faces(b).map(move |j| (i, j)))
        .filter_map(|(i, j)| at_rest(shift(a.corners(i), by), b.corners(j), f64::INFINITY))
        .map(|found| found.distance_sq.sqrt())
        .fold(f64::INFINITY, f64::min)
}

fn translation(along: Vec3, from_mm: f64, far_mm: f64) -> Translation {
    Translation {
        along,
        from_mm,
        far_mm,
    }
}

#[test]
fn distance_of_triangles_is_that_of_dense_points() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let n = 60;
    for case in 0..60 {
        let shift = f64::from(case % 3) * Vec3::new(0.5, 0.3, 0.4);
        let a = [0; 3].map(|_| random_point(&mut rng));
        let mut b = [0; 3].map(|_| random_point(&mut rng) + shift);
        if case % 5 == 0 {
            b[2] = b[0].lerp(b[1], 0.3);
        }
        let found = at_rest(a, b, f64::INFINITY).unwrap();
        let mut sampled = f64::INFINITY;
        for i in 0..=n {
            for j in 0..=n - i {
                let (u, v) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                let p = a[0] + u * (a[1] - a[0]) + v * (a[2] - a[0]);
                sampled = sampled.min(pair::nearest_on(b, p).distance(p));
            }
        }
        let exact = found.distance_sq.sqrt();
        assert!(
            exact <= sampled + 1e-12 && sampled <= exact + 1.5 / f64::from(n),
            "case {case}: {exact} {sampled}"
        );
        assert!((found.on_a.distance(found.on_b) - exact).abs() < 1e-12);
        for (t, x) in [(a, found.on_a), (b, found.on_b)] {
            assert!(
                pair::nearest_on(t, x).distance(x) < 1e-9,
                "case {case}: the point is not on its triangle"
            );
        }
    }
}

#[test]
fn least_gap_is_that_of_all_pairs_of_triangles() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for case in 0..20 {
        let (a, b) = (
            lump(&mut rng, Vec3::ZERO),
            lump(&mut rng, Vec3::new(3.2, 1.0, 0.5)),
        );
        let exact = by_brute_force(&a.to_mesh(), &b.to_mesh(), Vec3::ZERO);
        let found = least_gap(&shape(&a), &shape(&b), Scope::Everything, f64::INFINITY).unwrap();
        assert!(
            (found.gap_mm - exact).abs() < 1e-12,
            "case {case}: {found:?} {exact}"
        );
        assert!((found.on_a.distance(found.on_b) - exact).abs() < 1e-12);
        assert!(least_gap(&shape(&a), &shape(&b), Scope::Everything, 0.99 * exact).is_none());
        assert_eq!(
            least_gap(&shape(&a), &shape(&b), Scope::Everything, 1.01 * exact)
                .unwrap()
                .gap_mm,
            found.gap_mm
        );
    }
}

#[test]
fn swept_gap_is_the_least_of_all_travels() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut n_apart = 0;
    for case in 0..16 {
        let (a, b) = (
            lump(&mut rng, Vec3::ZERO),
            lump(&mut rng, Vec3::new(2.5, 3.6, 3.0)),
        );
        let along = (random_point(&mut rng) - 0.3).normalize();
        let [from, far] = [-1.0, 6.0];
        let (a_mesh, b_mesh) = (a.to_mesh(), b.to_mesh());
        let found = swept_gap(
            &shape(&a),
            &shape(&b),
            &translation(along, from, far),
            Scope::Everything,
            f64::INFINITY,
        )
        .unwrap();
        let n = 70;
        let travel = |i: i32| from + (far - from) * f64::from(i) / f64::from(n);
        let sampled = (0..=n)
            .map(|i| by_brute_force(&a_mesh, &b_mesh, travel(i) * along))
            .fold(f64::INFINITY, f64::min);
        if sampled > 0.5 * (far - from) / f64::from(n) {
            n_apart += 1;
            let there = by_brute_force(&a_mesh, &b_mesh, found.travel_mm * along);
            assert!(
                (there - found.gap_mm).abs() < 1e-9,
                "case {case}: {found:?} but {there} at that travel"
            );
            assert!(
                found.gap_mm <= sampled + 1e-12,
                "case {case}: {found:?} {sampled}"
            );
        } else if sampled == 0.0 {
            assert!(found.gap_mm <= 0.0, "case {case}: {found:?}");
        }
    }
    assert!((4..16).contains(&n_apart), "{n_apart}");
}

#[test]
fn one_travel_is_rest_and_the_length_of_the_direction_does_not_matter() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    for shift in [Vec3::new(3.2, 1.0, 0.5), Vec3::new(1.0, 0.2, 0.4)] {
        let (a, b) = (shape(&lump(&mut rng, Vec3::ZERO)), shape(&lump(&mut rng, shift)));
        let along = Vec3::new(0.3, -1.0, 0.7);
        let rest = least_gap(&a, &b, Scope::Everything, f64::INFINITY).unwrap();
        let swept = swept_gap(
            &a,
            &b,
            &translation(along, 0.0, 0.0),
            Scope::Everything,
            f64::INFINITY,
        )
        .unwrap();
        assert!(
            (rest.gap_mm - swept.gap_mm).abs() < 2.0 * depth::DEPTH_TOLERANCE_MM,
            "{rest:?} {swept:?}"
        );
        assert!(rest.gap_mm < 0.0 || (rest.gap_mm - swept.gap_mm).abs() < 1e-12);
        assert_eq!(swept.travel_mm, 0.0);
        let none = swept_gap(
            &a,
            &b,
            &translation(Vec3::ZERO, 1.0, 2.0),
            Scope::Everything,
            f64::INFINITY,
        )
        .unwrap();
        assert_eq!((none.gap_mm, none.at), (rest.gap_mm, rest.at));
        let [once, again] = [1.0, 1000.0].map(|scale| {
            swept_gap(
                &a,
                &b,
                &translation(scale * along, 0.0, 5.0),
                Scope::Everything,
                f64::INFINITY,
            )
            .unwrap()
        });
        assert!(
            (once.gap_mm - again.gap_mm).abs() < 1e-12 && (once.travel_mm - again.travel_mm).abs() < 1e-9
        );
    }
}

#[test]
fn a_cube_in_a_channel_keeps_the_gap_of_its_walls() {
    let channel =
        cuboid([-2.0, -2.0, 0.0], [2.0, 2.0, 20.0]).subtract(&cuboid([-1.0, -1.0, -1.0], [1.0, 1.0, 21.0]));
    let cube = cuboid([-0.93, -0.9, 1.0], [0.9, 0.9, 3.0]);
    for turn in [Vec3::Z, Vec3::new(1.0, 1.0, 1.0), Vec3::new(-1.0, 0.0, 1.0)] {
        let (x, y) = turn.normalize().any_orthonormal_pair();
        let turned = |v: &Volume| {
            let mut mesh = v.to_mesh();
            mesh.points
                .iter_mut()
                .for_each(|p| *p = p.x * x + p.y * y + p.z * turn.normalize());
            Shape::new(&Solid::new(mesh).unwrap())
        };
        let found = swept_gap(
            &turned(&cube),
            &turned(&channel),
            &translation(turn, 0.0, 100.0),
            Scope::Everything,
            1.0,
        )
        .unwrap();
        assert!((found.gap_mm - 0.07).abs() < 1e-12, "{found:?}");
    }
    // The cube reaches a ring in its path, and enters it as deeply as the ring protrudes.
    let ring =
        cuboid([-1.5, -1.5, 9.0], [1.5, 1.5, 11.0]).subtract(&cuboid([-0.88, -1.4, 8.0], [1.4, 1.4, 12.0]));
    let found = swept_gap(
        &shape(&cube),
        &shape(&ring),
        &translation(Vec3::Z, 0.0, 100.0),
        Scope::Everything,
        1.0,
    )
    .unwrap();
    assert!((found.gap_mm + 0.05).abs() < 2e-4, "{found:?}");
    assert!(found.travel_mm > 6.0 && found.travel_mm < 10.0, "{found:?}");
    let before = swept_gap(
        &shape(&cube),
        &shape(&ring),
        &translation(Vec3::Z, 0.0, 5.8),
        Scope::Everything,
        1.0,
    )
    .unwrap();
    assert!(
        (before.gap_mm - 0.2).abs() < 1e-12 && before.travel_mm == 5.8,
        "{before:?}"
    );
}

#[test]
fn a_ball_passes_a_cylinder_at_the_distance_of_their_axes() {
    let bounds = Aabb {
        min: Vec3::splat(-2.3),
        max: Vec3::splat(2.3),
    };
    let ball = Shape::new(&Solid::new(contour(bounds, 0.25, |p| 2.0 - p.length())).unwrap());
    let n = 96;
    let ring = |z: f64| {
        let at = |i: i32| std::f64::consts::TAU * f64::from(i) / f64::from(n);
        (0..n)
            .map(|i| Vec3::new(9.0 + 1.5 * at(i).cos(), 4.0 + 1.5 * at(i).sin(), z))
            .collect::<Vec<_>>()
    };
    let cylinder = shape(&Volume::loft(&[ring(-6.0), ring(6.0)]));
    let found = swept_gap(
        &ball,
        &cylinder,
        &translation(Vec3::X, 0.0, 30.0),
        Scope::Everything,
        5.0,
    )
    .unwrap();
    // The axes are 4 mm apart at the nearest; both bodies are polyhedra inside the round shapes.
    assert!(found.gap_mm > 0.5 && found.gap_mm < 0.53, "{found:?}");
    assert!(
        (found.travel_mm - 9.0).abs() < 0.5 && found.at.distance(Vec3::new(9.0, 2.25, 0.0)) < 0.7,
        "{found:?}"
    );
}

#[test]
fn a_wedge_drawn_out_of_its_seat_never_comes_nearer_than_it_sat() {
    let wedge = |grown: f64| {
        let at = |x: f64, z: f64| [-1.0, 1.0].map(|y| Vec3::new(x, y * (1.0 + grown), z));
        Volume::hull(
            &[
                at(-1.0 - grown, 0.0),
                at(1.0 + grown, 0.0),
                at(-2.0 - grown, 3.0),
                at(2.0 + grown, 3.0),
            ]
            .concat(),
        )
    };
    let block = cuboid([-4.0, -4.0, -1.0], [4.0, 4.0, 3.0])
        .subtract(&wedge(0.1))
        .subtract(&cuboid([-1.05, -1.05, -0.2], [1.05, 1.05, 0.1]));
    let rest = least_gap(&shape(&wedge(0.0)), &shape(&block), Scope::Everything, 1.0).unwrap();
    let out = swept_gap(
        &shape(&wedge(0.0)),
        &shape(&block),
        &translation(Vec3::Z, 0.0, 50.0),
        Scope::Everything,
        1.0,
    )
    .unwrap();
    assert_eq!((out.gap_mm, out.travel_mm), (rest.gap_mm, 0.0));
    let inwards = swept_gap(
        &shape(&wedge(0.0)),
        &shape(&block),
        &translation(Vec3::Z, -0.3, 50.0),
        Scope::Everything,
        1.0,
    )
    .unwrap();
    assert!(
        inwards.gap_mm < 0.0 && (-0.3..=-0.19).contains(&inwards.travel_mm),
        "{inwards:?}"
    );
}

#[test]
fn touching_is_a_gap_of_zero_and_overlap_is_as_deep_as_it_was_made() {
    let base = shape(&cuboid([0.0; 3], [4.0; 3]));
    let above = |z: f64| shape(&cuboid([1.0, 1.2, z], [2.9, 3.0, z + 5.0]));
    assert_eq!(
        least_gap(&above(4.0), &base, Scope::Everything, 1.0)
            .unwrap()
            .gap_mm,
        0.0
    );
    for depth in [1e-5, 3e-3, 0.25] {
        for [a, b] in [[&above(4.0 - depth), &base], [&base, &above(4.0 - depth)]] {
            let found = least_gap(a, b, Scope::Everything, 1.0).unwrap();
            assert!(
                (found.gap_mm + depth).abs() < 1e-4 && found.gap_mm < 0.0,
                "{found:?} for {depth}"
            );
            let off = found.on_a.distance(found.on_b);
            assert!((off + found.gap_mm).abs() < 1e-12 && (found.at.z - 4.0).abs() <= depth);
        }
    }
}

#[test]
fn crossed_bars_are_as_deep_as_their_edges_reach() {
    // No corner of either is inside the other.
    let [x, y] = [
        cuboid([-5.0, -1.0, 0.0], [5.0, 1.0, 2.0]),
        cuboid([-1.0, -5.0, 1.9], [1.0, 5.0, 4.0]),
    ];
    let found = least_gap(&shape(&x), &shape(&y), Scope::Everything, 1.0).unwrap();
    assert!((found.gap_mm + 0.1).abs() < 2e-4, "{found:?}");
}

#[test]
fn what_is_swallowed_whole_is_deep_though_no_surfaces_meet() {
    let (small, large) = (
        shape(&cuboid([4.0; 3], [5.0; 3])),
        shape(&cuboid([0.0; 3], [10.0; 3])),
    );
    for found in [
        least_gap(&small, &large, Scope::Everything, 0.1),
        least_gap(&large, &small, Scope::Everything, 0.1),
    ] {
        assert!((found.unwrap().gap_mm + 5.0).abs() < 2e-4, "{found:?}");
    }
    let hollow = shape(&cuboid([0.0; 3], [10.0; 3]).subtract(&cuboid([3.5; 3], [5.6; 3])));
    assert!((least_gap(&small, &hollow, Scope::Everything, 9.0).unwrap().gap_mm - 0.5).abs() < 1e-12);
}

#[test]
fn only_what_counts_is_taken_into_account() {
    let (a, b) = (
        cuboid([0.0; 3], [1.0; 3]),
        cuboid([1.01, 0.0, 0.0], [2.0, 3.0, 1.0]),
    );
    let faces_up = |v: &Volume| {
        let solid = solid(v);
        Shape::new(&solid).count_only(|f| solid.mesh().face_normal(f).y > 0.5)
    };
    let found = least_gap(&faces_up(&a), &faces_up(&b), Scope::WhatCounts, 5.0).unwrap();
    assert!((found.gap_mm - 0.01f64.hypot(2.0)).abs() < 1e-12, "{found:?}");
    assert!(
        least_gap(
            &shape(&a).count_only(|_| false),
            &shape(&b),
            Scope::WhatCounts,
            5.0
        )
        .is_none()
    );
}

#[test]
fn triangles_without_area_and_odd_travels_change_nothing() {
    let mut split = cuboid([0.0; 3], [2.0; 3]).to_mesh();
    let [a, b, c] = split.triangles[0];
    let (middle, new) = (
        split.points[a as usize].midpoint(split.points[b as usize]),
        split.points.len() as u32,
    );
    split.points.push(middle);
    split.triangles[0] = [a, new, c];
    split.triangles.extend([[new, b, c], [a, b, new]]);
    let split = Shape::new(&Solid::new(split).unwrap());
    for shift in [
        Vec3::new(2.3, 1.0, 0.4),
        Vec3::new(-2.2, 0.1, 2.1),
        Vec3::new(0.4, 1.5, 1.9),
    ] {
        let other = shape(&cuboid([0.0; 3], [2.0; 3]).translate(shift));
        let plain = shape(&cuboid([0.0; 3], [2.0; 3]));
        for [from, far] in [
            [0.0, 4.0],
            [f64::NAN, f64::INFINITY],
            [3.0, -3.0],
            [f64::NEG_INFINITY, 1.0],
            [9.0, 99.0],
        ] {
            let motion = translation(Vec3::new(0.1, 0.0, 1.0), from, far);
            let [x, y] =
                [&split, &plain].map(|a| swept_gap(a, &other, &motion, Scope::Everything, 100.0).unwrap());
            assert!((x.gap_mm - y.gap_mm).abs() < 2e-4, "{x:?} {y:?}");
        }
    }
    assert!(
        swept_gap(
            &split,
            &split,
            &translation(Vec3::NAN, 0.0, 1.0),
            Scope::Everything,
            f64::NAN
        )
        .is_none_or(|g| g.gap_mm < 0.0)
    );
}

#[test]
fn nearest_points_of_triangles_with_area_are_those_of_the_bvh() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for _ in 0..200 {
        let (t, q) = (
            [0; 3].map(|_| random_point(&mut rng)),
            2.0 * random_point(&mut rng),
        );
        assert_eq!(pair::nearest_on(t, q), nearest_on_triangle(t, q).0);
    }
}

/// Undersides of two keys that slide within one plane: their shadows are collinear up to rounding.
#[test]
fn where_triangles_in_one_plane_come_nearest_both_of_them_are() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for case in 0..20_000 {
        let size = 10f64.powf(1.0 - 4.0 * rng.random::<f64>());
        let along = (random_point(&mut rng) - 0.5 * Vec3::ONE).normalize();
        let (x, y) = along.any_orthonormal_pair();
        // The motion is not along an axis, where rounding would do no harm.
        let (sin, cos) = rng.random::<f64>().sin_cos();
        let x = cos * x + sin * y;
        let origin = 100.0 * random_point(&mut rng);
        let mut corner = || origin + size * (rng.random::<f64>() * along + rng.random::<f64>() * x);
        let (a, mut b) = ([0; 3].map(|_| corner()), [0; 3].map(|_| corner()));
        // The second triangle is beside, behind or in the path, near or far.
        let off_mm = size * 10f64.powi(case % 5 - 1);
        b = shift(
            b,
            off_mm * (f64::from(case % 4) - 1.0) * along + off_mm * f64::from(case % 3) * x,
        );
        let axes = axes_along(along);
        let seen = |t: [Vec3; 3]| t.map(|p| Vec3::from(axes.map(|axis| axis.dot(p))));
        let (a, b) = (seen(a), seen(b));
        let Some(found) = pair::swept(a, b, [0.0, 50.0], f64::INFINITY) else {
            panic!("there is no limit");
        };
        let there = shift(a, found.travel_mm * Vec3::Z);
        let off = |t: [Vec3; 3], p: Vec3| nearest_on_triangle(t, p).0.distance(p);
        assert!(
            off(there, found.on_a) < 1e-6 && off(b, found.on_b) < 1e-6,
            "case {case}: {found:?}"
        );
        let told = found.distance_sq.sqrt();
        assert!(
            (found.on_a.distance(found.on_b) - told).abs() < 1e-6,
            "case {case}: {found:?}"
        );
    }
}

use super::*;
use crate::Volume;
use crate::samples::{ball, cuboid, torus};

/// A rod of 24 sides between two points.
fn rod(from: Vec3, to: Vec3, width: f64) -> Volume {
    let along = (to - from).normalize();
    let across = along.any_orthonormal_vector();
    let ring = |at: Vec3| {
        let point = |i: u32| {
            let (s, c) = (f64::from(i) * std::f64::consts::TAU / 24.0).sin_cos();
            at + 0.5 * width * (c * across + s * along.cross(across))
        };
        (0..24).map(point).collect()
    };
    Volume::loft(&[ring(from), ring(to)])
}

fn sphere(center: Vec3, radius: f64) -> Volume {
    Volume::from_closed_mesh(&ball(center, radius, 4)).unwrap()
}

fn solid(volume: &Volume) -> Solid {
    Solid::new(volume.to_mesh()).unwrap()
}

fn find(volume: &Volume) -> Option<HollowBody> {
    find_hollow(&solid(volume), LEAST_SHARE)
}

/// Asserts that `drained` is `whole` with `cavity` and holes, given by place and width. Filling must give
/// `whole` again, with the correct source of every triangle.
fn assert_hollow(drained: &Volume, whole: f64, cavity: f64, wall: f64, holes: &[(Vec3, f64)]) {
    let drained = solid(drained);
    let hollow = find_hollow(&drained, LEAST_SHARE).expect("it is hollow");
    assert!(
        (hollow.wall_mm / wall - 1.0).abs() < 0.05,
        "{} is not {wall}",
        hollow.wall_mm
    );
    assert!(
        (hollow.cavity_mm3 / cavity - 1.0).abs() < 0.02,
        "{} is not {cavity}",
        hollow.cavity_mm3
    );
    assert_eq!(hollow.openings.len(), holes.len(), "{:?}", hollow.openings);
    for (opening, &(at, width)) in hollow.openings.iter().zip(holes) {
        assert!(
            opening.at.distance(at) < 0.6 * wall + 0.5,
            "{opening:?} is not at {at}"
        );
        assert!(
            (opening.width_mm / width - 1.0).abs() < 0.05,
            "{opening:?} is not {width}"
        );
    }
    let filled = fill(&drained, &hollow).unwrap();
    assert!(
        (filled.solid.volume() / whole - 1.0).abs() < 2e-3,
        "{} is not {whole}",
        filled.solid.volume()
    );
    assert_eq!(find_hollow(&filled.solid, LEAST_SHARE), None);
    let mesh = filled.solid.mesh();
    assert_eq!(filled.source_face.len(), mesh.triangles.len());
    let same =
        |&face: &usize| mesh.corners(face) == drained.mesh().corners(filled.source_face[face] as usize);
    let n_same = (0..mesh.triangles.len()).filter(same).count();
    assert!(n_same + 120 * holes.len() > mesh.triangles.len());
}

#[test]
fn a_hollow_ball_with_a_drain_hole_has_its_wall_and_opening() {
    let whole = sphere(Vec3::ZERO, 40.0);
    // The second hole is narrower than a cell; the last wall is thicker than its hole is wide.
    for (wall, width, out) in [
        (2.4, 6.0, Vec3::NEG_Z),
        (1.0, 1.0, Vec3::new(0.6, 0.0, 0.8)),
        (5.0, 8.0, Vec3::Y),
        (12.0, 4.0, Vec3::new(-0.48, 0.64, 0.6)),
    ] {
        let inner = sphere(Vec3::ZERO, 40.0 - wall);
        let drained = whole
            .subtract(&inner)
            .subtract(&rod(20.0 * out, 45.0 * out, width));
        let middle = (40.0 - 0.5 * wall) * out;
        assert_hollow(&drained, whole.volume(), inner.volume(), wall, &[(middle, width)]);
    }
}

#[test]
fn a_hollow_figure_with_two_holes_has_both() {
    let parts = |by: f64| {
        sphere(Vec3::ZERO, 30.0 - by)
            .union(&sphere(Vec3::new(0.0, 0.0, 38.0), 18.0 - by))
            .union(&rod(Vec3::ZERO, Vec3::new(55.0 - by, 0.0, 10.0), 16.0 - 2.0 * by))
    };
    let (whole, inner) = (parts(0.0), parts(2.0));
    let holes = rod(Vec3::ZERO, Vec3::new(0.0, 0.0, -40.0), 5.0).union(&rod(
        Vec3::new(0.0, 0.0, 38.0),
        Vec3::new(0.0, 30.0, 38.0),
        3.0,
    ));
    let drained = whole.subtract(&inner).subtract(&holes);
    let at = [
        (Vec3::new(0.0, 0.0, -29.0), 5.0),
        (Vec3::new(0.0, 17.0, 38.0), 3.0),
    ];
    assert_hollow(&drained, whole.volume(), inner.volume(), 2.0, &at);
}

#[test]
fn a_hollow_box_of_few_triangles_is_filled_to_the_box() {
    let (whole, inner) = (
        cuboid([0.0; 3], [60.0, 40.0, 30.0]),
        cuboid([3.0; 3], [57.0, 37.0, 27.0]),
    );
    let hole = rod(Vec3::new(20.0, 15.0, -1.0), Vec3::new(20.0, 15.0, 10.0), 4.0);
    let drained = whole.subtract(&inner).subtract(&hole);
    assert_hollow(
        &drained,
        whole.volume(),
        inner.volume(),
        3.0,
        &[(Vec3::new(20.0, 15.0, 1.5), 4.0)],
    );
}

#[test]
fn solid_bodies_vessels_and_cages_are_not_hollow() {
    let ball = sphere(Vec3::ZERO, 40.0);
    let inner = sphere(Vec3::ZERO, 37.0);
    let up = |z: f64| Vec3::new(0.0, 0.0, z);
    let mug = rod(up(0.0), up(50.0), 40.0).subtract(&rod(up(3.0), up(60.0), 34.0));
    let bowl = ball
        .subtract(&inner)
        .subtract(&cuboid([-50.0, -50.0, 0.0], [50.0; 3]));
    let vase = ball.subtract(&inner).subtract(&rod(up(0.0), up(50.0), 44.0));
    let pipe = rod(up(0.0), up(90.0), 20.0).subtract(&rod(up(-1.0), up(91.0), 16.0));
    let mut cage = cuboid([0.0; 3], [60.0; 3]).subtract(&cuboid([3.0; 3], [57.0; 3]));
    for i in 0..3 {
        for j in 0..3 {
            let (a, b) = (6.0 + 18.0 * f64::from(i), 6.0 + 18.0 * f64::from(j));
            let window = cuboid([a, b, -1.0], [a + 12.0, b + 12.0, 61.0]);
            cage = cage.subtract(&window);
        }
    }
    let ring = Volume::from_closed_mesh(&torus(30.0, 12.0, [60, 30])).unwrap();
    for body in [ball, mug, bowl, vase, pipe, cage, ring] {
        assert_eq!(find(&body), None);
    }
}

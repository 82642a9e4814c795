//! Tests of the plane of symmetry, and of divisions that are symmetric about it.

use shellock_geom::bvh::TriangleBvh;
use shellock_geom::contour::contour;
use shellock_geom::{Aabb, Quat, TriMesh, Vec3};
use shellock_segment::auto::{self, AutoParams};
use shellock_segment::random_cuts::{self, Divided, RandomCutsParams};
use shellock_segment::symmetry::{Plane, plane};
use shellock_segment::whole::Whole;

/// Start, end and radius of a capsule.
type Capsule = (Vec3, Vec3, f64);

/// A body along z with a head, two arms and two legs, symmetric about x = 0 and about no other plane.
fn figure() -> Vec<Capsule> {
    let limb = |from: [f64; 3], to: [f64; 3], radius_mm: f64| (Vec3::from(from), Vec3::from(to), radius_mm);
    let one_side = [
        limb([7.0, 0.0, 7.0], [27.0, 6.0, 13.0], 3.0),
        limb([5.0, 0.0, -12.0], [9.0, 4.0, -36.0], 3.5),
    ];
    let other = one_side.map(|(a, b, r)| (flip(a), flip(b), r));
    let middle = [
        limb([0.0, 0.0, -9.0], [0.0, 0.0, 8.0], 9.0),
        limb([0.0, 3.0, 23.0], [0.0, 5.0, 23.0], 7.0),
    ];
    one_side.into_iter().chain(other).chain(middle).collect()
}

fn flip(p: Vec3) -> Vec3 {
    p.with_x(-p.x)
}

/// A rod bent twice, out of its plane, with arms of three lengths.
fn bent() -> Vec<Capsule> {
    let corners = [
        [-16.0, -10.0, -12.0],
        [18.0, -10.0, -12.0],
        [18.0, 14.0, -12.0],
        [18.0, 14.0, 34.0],
    ];
    let corners = corners.map(Vec3::from);
    corners.windows(2).map(|ends| (ends[0], ends[1], 5.0)).collect()
}

/// Triangle mesh of the turned union, on a grid that is not symmetric. Each corner is moved by a tenth of a
/// triangle.
fn mesh(capsules: &[Capsule], turn: Quat) -> TriMesh {
    let turned: Vec<Capsule> = capsules
        .iter()
        .map(|&(a, b, r)| (turn * a, turn * b, r))
        .collect();
    let value = |p: Vec3| {
        let inside = turned.iter().map(|&(a, b, r)| {
            let along = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
            r - p.distance(a + along * (b - a))
        });
        inside.fold(f64::NEG_INFINITY, f64::max)
    };
    let bounds = Aabb {
        min: Vec3::splat(-46.0),
        max: Vec3::splat(46.0),
    };
    let mut mesh = contour(bounds, 1.1, value);
    for (point, i) in mesh.points.iter_mut().zip(0..) {
        let way = |k: f64| (f64::from(i) * k).sin();
        *point += 0.1 * Vec3::new(way(12.9), way(78.2), way(37.7));
    }
    mesh
}

fn turns() -> [Quat; 3] {
    let axis = Vec3::new(1.0, -2.0, 0.7).normalize();
    [0.0, 0.9, 2.3].map(|rad| Quat::from_axis_angle(axis, rad))
}

#[test]
fn the_plane_of_a_figure_is_found_within_a_degree_however_it_is_turned() {
    for turn in turns() {
        let found = plane(&mesh(&figure(), turn)).expect("it has a plane");
        let off_deg = found
            .normal
            .dot(turn * Vec3::X)
            .abs()
            .min(1.0)
            .acos()
            .to_degrees();
        assert!(off_deg < 1.0, "{off_deg}°");
        assert!(found.height(Vec3::ZERO).abs() < 0.3, "{found:?}");
    }
}

#[test]
fn what_is_bent_has_no_plane_and_a_ball_has_one_through_its_centre() {
    for turn in turns() {
        assert_eq!(plane(&mesh(&bent(), turn)), None);
    }
    let ball = shellock_testkit::plain::sphere(3, Vec3::splat(10.0));
    let ball = TriMesh {
        points: ball.0,
        triangles: ball.1,
    };
    assert!(plane(&ball).unwrap().height(Vec3::ZERO).abs() < 0.2);
    assert_eq!(plane(&TriMesh::default()), None);
}

/// Share of the area whose mirror image lies in its part's counterpart. Two parts are counterparts if each
/// has most of the other's image.
fn mirrored_share(mesh: &TriMesh, plane: &Plane, part: &[u32]) -> f64 {
    let bvh = TriangleBvh::new(mesh);
    let n = part.iter().max().map_or(0, |&p| p as usize + 1);
    let mut common = vec![vec![0.0; n]; n];
    for face in 0..part.len() {
        let image = bvh.nearest(plane.image(mesh.face_center(face)), f64::INFINITY);
        common[part[face] as usize][part[image.unwrap().face as usize] as usize] += mesh.face_area(face);
    }
    let image = |p: usize| {
        (0..n)
            .max_by(|&a, &b| common[p][a].total_cmp(&common[p][b]))
            .unwrap()
    };
    let mirrored = (0..n).filter(|&p| image(image(p)) == p);
    mirrored.map(|p| common[p][image(p)]).sum::<f64>() / mesh.area()
}

fn both_ways(cuts: &RandomCutsParams, mesh: &TriMesh) -> [Divided; 2] {
    let whole = Whole::default();
    let auto = AutoParams { cuts: cuts.clone() };
    [
        auto::divide_with_whole(&auto, mesh, &whole),
        random_cuts::divide_with_whole(cuts, mesh, &whole),
    ]
}

#[test]
fn a_symmetric_figure_has_symmetric_parts() {
    let symmetric = RandomCutsParams {
        symmetric: true,
        ..RandomCutsParams::default()
    };
    for turn in turns() {
        let mesh = mesh(&figure(), turn);
        for found in both_ways(&symmetric, &mesh) {
            let share = mirrored_share(&mesh, &found.plane.unwrap(), &found.part_of_face);
            assert!(share >= 0.97, "{share}");
            assert!(found.part_of_face.iter().any(|&p| p > 3), "its limbs are parts");
        }
    }
}

/// Five parts should be the body and four limbs; three are the body and two matching limbs.
#[test]
fn no_more_parts_are_made_than_are_asked_for() {
    let mesh = mesh(&figure(), turns()[1]);
    for n_parts in [1, 2, 3, 4, 6] {
        let asked = RandomCutsParams {
            symmetric: true,
            n_parts: Some(n_parts),
            ..RandomCutsParams::default()
        };
        for found in both_ways(&asked, &mesh) {
            let n = found.part_of_face.iter().max().unwrap() + 1;
            assert!(n as usize <= n_parts, "{n} parts instead of {n_parts}");
            let share = mirrored_share(&mesh, &found.plane.unwrap(), &found.part_of_face);
            assert!(share >= 0.97, "{share} with {n_parts} parts");
        }
    }
}

#[test]
fn what_has_no_plane_is_divided_as_if_nothing_had_been_asked() {
    let mesh = mesh(&bent(), turns()[0]);
    let symmetric = RandomCutsParams {
        symmetric: true,
        ..RandomCutsParams::default()
    };
    for (asked, plain) in both_ways(&symmetric, &mesh)
        .into_iter()
        .zip(both_ways(&RandomCutsParams::default(), &mesh))
    {
        assert!(asked == plain && asked.plane.is_none());
    }
}

#[test]
fn a_limb_without_a_twin_stays_a_part_and_gets_no_image() {
    let mut capsules = figure();
    let (root, tip) = (Vec3::new(5.0, -5.0, -4.0), Vec3::new(10.0, -18.0, -4.0));
    capsules.push((root, tip, 1.8));
    let mesh = mesh(&capsules, Quat::IDENTITY);
    let symmetric = RandomCutsParams {
        symmetric: true,
        ..RandomCutsParams::default()
    };
    let found = auto::divide_with_whole(&AutoParams { cuts: symmetric }, &mesh, &Whole::default());
    assert!(found.plane.is_some());
    let bvh = TriangleBvh::new(&mesh);
    let part = |p: Vec3| found.part_of_face[bvh.nearest(p, f64::INFINITY).unwrap().face as usize];
    let body = part(flip(root));
    assert_ne!(part(tip), body);
    // The part at the missing twin's place, the body, lies across the plane.
    let reaches = |side: f64| {
        let mut faces = (0..found.part_of_face.len()).filter(|&f| found.part_of_face[f] == body);
        faces.any(|f| side * mesh.face_center(f).x > 4.0)
    };
    assert!(reaches(1.0) && reaches(-1.0));
}

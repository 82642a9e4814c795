use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::samples::{ball, both, cube, cuboid, flip, unweld};
use crate::topology::Topology;
use crate::{Vec3, Volume};

fn mend(mesh: &TriMesh) -> Repaired {
    repair(mesh, RepairMode::Repair).unwrap_or_else(|e| panic!("{e}"))
}

/// Repairs, and asserts the kinds and counts of changes and the volume. Also asserts that nothing is done
/// without permission.
fn assert_repair(mesh: &TriMesh, codes: &[(&str, usize)], volume: f64) -> Repaired {
    let repaired = mend(mesh);
    let done: Vec<(&str, usize)> = repaired
        .repairs
        .iter()
        .map(|r| (r.kind.code(), r.count))
        .collect();
    assert_eq!(done, codes, "{:?}", repaired.repairs);
    assert!(
        (repaired.solid.volume() - volume).abs() < 1e-6 * volume,
        "{} is not {volume}",
        repaired.solid.volume()
    );
    assert_eq!(repaired.source_face.len(), repaired.solid.mesh().triangles.len());
    assert!(
        repaired
            .source_face
            .iter()
            .all(|&f| (f as usize) < mesh.triangles.len())
    );
    assert!(repair(mesh, RepairMode::Refuse).is_err());
    // A repaired mesh needs no further repair.
    let again = mend(repaired.solid.mesh());
    assert_eq!(
        (again.repairs.len(), again.solid.mesh()),
        (0, repaired.solid.mesh())
    );
    repaired
}

fn base() -> TriMesh {
    ball(Vec3::new(3.0, -2.0, 1.0), 10.0, 3)
}

#[test]
fn a_sound_mesh_comes_out_bit_by_bit_with_leave_or_without() {
    for mesh in [base(), unweld(&base())] {
        let (solid, kept) = into_solid(&mesh).unwrap();
        for mending in [RepairMode::Refuse, RepairMode::Repair, RepairMode::KeepLargest] {
            let repaired = repair(&mesh, mending).unwrap();
            assert_eq!((&repaired.solid, &repaired.source_face), (&solid, &kept));
            assert_eq!(repaired.repairs, []);
        }
    }
}

#[test]
fn cracks_are_closed_and_gaps_are_not() {
    let mut cracked = unweld(&base());
    let move_by = |i: usize, by: f64| {
        by * Vec3::new(
            ((7 * i) % 11) as f64 - 5.0,
            ((5 * i) % 7) as f64 - 3.0,
            (i % 3) as f64,
        )
    };
    cracked
        .points
        .iter_mut()
        .enumerate()
        .for_each(|(i, p)| *p += move_by(i, 1e-6));
    let repaired = mend(&cracked);
    assert_eq!(repaired.repairs[0].kind.code(), "points-merged");
    assert!((repaired.solid.volume() / base().signed_volume() - 1.0).abs() < 1e-5);
    assert_eq!(repaired.solid.mesh().points.len(), base().points.len());
    cracked
        .points
        .iter_mut()
        .enumerate()
        .for_each(|(i, p)| *p += move_by(i, 1e-3));
    assert!(matches!(
        repair(&cracked, RepairMode::Repair),
        Err(InputError::Loose { .. })
    ));
}

#[test]
fn copies_are_removed_and_those_back_to_back_cancel() {
    let mut doubled = base();
    doubled.triangles.extend_from_within(..50);
    let repaired = assert_repair(&doubled, &[("copies-removed", 50)], base().signed_volume());
    assert_eq!(repaired.solid.mesh(), &base());
    // A flap attached to an edge: two triangles back to back.
    let mut flap = base();
    let [a, b, _] = flap.triangles[7];
    flap.points.push(Vec3::splat(20.0));
    let tip = flap.points.len() as u32 - 1;
    flap.triangles.extend([[a, b, tip], [b, a, tip]]);
    assert_repair(&flap, &[("copies-removed", 2)], base().signed_volume());
}

#[test]
fn turned_triangles_are_turned_back_and_bodies_inside_out_too() {
    let mut some = base();
    some.triangles.iter_mut().step_by(3).for_each(|t| t.swap(0, 1));
    let n = some.triangles.len().div_ceil(3);
    assert_repair(&some, &[("triangles-turned", n)], base().signed_volume());
    assert_repair(&flip(base()), &[("body-turned", 1)], base().signed_volume());
    let mut most = flip(base());
    most.triangles.iter_mut().step_by(3).for_each(|t| t.swap(0, 1));
    assert_repair(
        &most,
        &[("triangles-turned", n), ("body-turned", 1)],
        base().signed_volume(),
    );
}

#[test]
fn corners_on_edges_are_joined() {
    let mut divided = base();
    // Every twentieth triangle is divided on its first side; its neighbour is not.
    for face in (0..divided.triangles.len()).step_by(20) {
        let [a, b, c] = divided.triangles[face];
        divided
            .points
            .push(0.6 * divided.points[a as usize] + 0.4 * divided.points[b as usize]);
        let m = divided.points.len() as u32 - 1;
        divided.triangles[face] = [a, m, c];
        divided.triangles.push([m, b, c]);
    }
    let n = base().triangles.len().div_ceil(20);
    assert_repair(&divided, &[("edges-joined", n)], base().signed_volume());
}

#[test]
fn holes_of_three_edges_and_small_ones_are_closed_and_large_ones_refused_with_their_place() {
    let mut three = base();
    three.triangles.swap_remove(17);
    let repaired = assert_repair(&three, &[("holes-closed", 1)], base().signed_volume());
    assert!(repaired.repairs[0].at.distance(Vec3::new(3.0, -2.0, 1.0)) > 9.0);
    // All triangles around a point are removed, which leaves a hole of five or six edges.
    let around = |mesh: &TriMesh, n: usize| {
        let mut holed = mesh.clone();
        holed.triangles.retain(|t| !t.contains(&(n as u32)));
        holed
    };
    let fine = ball(Vec3::ZERO, 10.0, 7);
    let repaired = mend(&around(&fine, 0));
    assert_eq!(repaired.repairs[0].kind.code(), "holes-closed");
    assert!((repaired.solid.volume() / fine.signed_volume() - 1.0).abs() < 1e-5);
    let refused = repair(&around(&base(), 100), RepairMode::Repair).unwrap_err();
    assert!(
        matches!(refused, InputError::Open { n_holes: 1, .. }),
        "{refused}"
    );
    assert!(
        refused
            .to_string()
            .contains("1 hole (6 open edges), first near ("),
        "{refused}"
    );
}

#[test]
fn touching_in_a_point_is_parted_and_touching_along_an_edge_leaves_two_bodies() {
    // Two cones that meet in their tips, joined by a belt: one body with one pinched point.
    let hourglass = both(cube(Vec3::ZERO, 1.0), cube(Vec3::ONE, 1.0));
    assert!(matches!(
        repair(&crate::weld::weld(&hourglass).mesh, RepairMode::Repair),
        Err(InputError::Bodies(b)) if b.len() == 2
    ));
    let edge = both(cube(Vec3::ZERO, 1.0), cube(Vec3::new(1.0, 1.0, 0.0), 1.0));
    let refused = repair(&unweld(&edge), RepairMode::Repair).unwrap_err();
    assert!(
        matches!(&refused, InputError::Bodies(b) if b.len() == 2),
        "{refused}"
    );
    assert!(
        (repair(&unweld(&edge), RepairMode::KeepLargest)
            .unwrap()
            .solid
            .volume()
            - 1.0)
            .abs()
            < 1e-12
    );
    // A point of the far side is moved to a point of the near side.
    let mut pinched = base();
    let (near, far) = (pinched.triangles[0][0], pinched.triangles[300][0]);
    pinched.points[far as usize] = pinched.points[near as usize];
    let repaired = mend(&unweld(&pinched));
    assert!(
        repaired
            .repairs
            .iter()
            .any(|r| matches!(r.kind, RepairKind::Parted | RepairKind::United { .. }))
    );
}

#[test]
fn specks_inner_bodies_and_cavities_are_left_out() {
    let volume = base().signed_volume();
    let speck = |i: u32| ball(Vec3::new(15.0, f64::from(i), 0.0), 0.02, 0);
    let specks = (0..20).fold(base(), |mesh, i| both(mesh, speck(i)));
    assert_repair(&specks, &[("specks-removed", 20)], volume);
    let inner = ball(Vec3::new(4.0, -2.0, 1.0), 3.0, 2);
    assert_repair(
        &both(base(), flip(inner.clone())),
        &[("cavities-filled", 1)],
        volume,
    );
    assert_repair(&both(base(), inner.clone()), &[("cavities-filled", 1)], volume);
    assert_repair(
        &both(flip(base()), inner),
        &[("body-turned", 2), ("cavities-filled", 1)],
        volume,
    );
}

#[test]
fn parts_that_overlap_are_united_and_parts_apart_are_refused_unless_one_is_enough() {
    let other = ball(Vec3::new(12.3, 0.4, 1.7), 6.0, 3);
    let union = [base(), other.clone()].map(|m| Volume::from_closed_mesh(&m).unwrap());
    let union = union[0].union(&union[1]).volume();
    let repaired = mend(&both(base(), other));
    assert!((repaired.solid.volume() - union).abs() < 1e-6 * union);
    assert!(matches!(
        repaired.repairs[..],
        [Repair {
            kind: RepairKind::United { .. },
            count: 1..,
            ..
        }]
    ));
    // Each triangle lies on its source triangle.
    let as_read = both(base(), ball(Vec3::new(12.3, 0.4, 1.7), 6.0, 3));
    for (face, &source) in repaired.source_face.iter().enumerate() {
        let [a, _, _] = as_read.corners(source as usize);
        let away = (repaired.solid.mesh().face_center(face) - a).dot(as_read.face_normal(source as usize));
        assert!(away.abs() < 1e-9, "{away}");
    }
    let apart = both(base(), ball(Vec3::new(40.0, 0.0, 0.0), 6.0, 2));
    assert!(
        matches!(repair(&apart, RepairMode::Repair), Err(InputError::Bodies(bodies)) if bodies.len() == 2)
    );
    let largest = repair(&apart, RepairMode::KeepLargest).unwrap();
    assert_eq!(
        (largest.solid.mesh(), largest.repairs[0].kind),
        (&base(), RepairKind::LeftOut)
    );
}

#[test]
fn bodies_that_touch_with_faces_are_united() {
    // First they share half of a side, then a part of the volume, with sides in common planes.
    for (at, volume) in [(Vec3::new(1.0, 0.5, 0.0), 2.0), (Vec3::new(0.5, 0.0, 0.0), 1.5)] {
        let pair = both(cube(Vec3::ZERO, 1.0), cube(at, 1.0));
        assert_repair(&pair, &[("bodies-united", 2)], volume);
    }
}

#[test]
fn a_surface_pushed_through_itself_is_found_and_resolved() {
    let mut pushed = base();
    // A cap of the ball is pushed through the other side.
    pushed
        .points
        .iter_mut()
        .filter(|p| p.z > 9.0)
        .for_each(|p| *p += Vec3::new(0.37, -0.21, -19.0));
    let found = crossings(&pushed);
    assert!(found.count > 10, "{found:?}");
    assert_eq!(
        repair(&pushed, RepairMode::Refuse),
        Err(InputError::Crossing {
            count: found.count,
            at: found.first
        })
    );
    match repair(&pushed, RepairMode::Repair) {
        Ok(repaired) => assert_eq!(crossings(repaired.solid.mesh()).count, 0),
        Err(error) => assert!(matches!(error, InputError::Bodies(_)), "{error}"),
    }
    assert_eq!(crossings(&base()).count, 0);
    assert_eq!(crossings(&TriMesh::default()).count, 0);
}

#[test]
fn one_sided_surfaces_soups_and_flat_things_are_refused() {
    // A band of 12 quads with half a turn, closed by doubling: a Klein bottle of two loops of points.
    let (n, m) = (12_u32, 8_u32);
    let at = |i: u32, j: u32| if i == n { (m - j % m) % m } else { i * m + j % m };
    let mut points = Vec::new();
    for i in 0..n {
        for j in 0..m {
            let (u, v) = (
                f64::from(i) / f64::from(n),
                std::f64::consts::TAU * f64::from(j) / f64::from(m),
            );
            let (s, c) = (std::f64::consts::TAU * u).sin_cos();
            let (s2, c2) = (std::f64::consts::PI * u).sin_cos();
            let r = 5.0 + c2 * v.sin() - s2 * (2.0 * v).sin();
            points.push(Vec3::new(
                r * c,
                r * s,
                s2 * v.sin() + c2 * (2.0 * v).sin() + 0.1 * v,
            ));
        }
    }
    let quads =
        (0..n).flat_map(|i| (0..m).map(move |j| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]));
    let triangles = quads.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let refused = repair(&TriMesh { points, triangles }, RepairMode::Repair).unwrap_err();
    assert!(matches!(refused, InputError::OneSided { .. }), "{refused}");

    let soup = TriMesh {
        points: (0..30)
            .map(|i| Vec3::new(f64::from(i * 7 % 11), f64::from(i * 5 % 13), f64::from(i * 3 % 7)))
            .collect(),
        triangles: (0..10).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
    };
    assert!(matches!(
        repair(&soup, RepairMode::Repair),
        Err(InputError::Loose { .. })
    ));
    let flat = TriMesh {
        points: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2], [0, 2, 1]],
    };
    assert_eq!(repair(&flat, RepairMode::Repair), Err(InputError::Flat));
    assert_eq!(
        repair(&TriMesh::default(), RepairMode::Repair),
        Err(InputError::Empty)
    );
}

#[test]
fn coordinates_rounded_too_coarsely_are_told_as_such() {
    let mut rounded = both(cube(Vec3::ZERO, 1.0), cube(Vec3::splat(2.0), 3.0));
    rounded.points[0] = rounded.points[1];
    rounded.triangles.pop();
    let refused = repair(&rounded, RepairMode::Repair).unwrap_err();
    assert!(matches!(refused, InputError::Collapsed { .. }), "{refused}");
}

#[test]
fn repairs_say_what_how_many_and_where() {
    let mut three = base();
    three.triangles.swap_remove(17);
    let text = mend(&three).repairs[0].to_string();
    assert!(
        text.starts_with("1 small hole was closed, up to ") && text.contains("; first near ("),
        "{text}"
    );
}

/// Found by fuzzing: from some points all rays that the library casts along axes and diagonals meet edges.
#[test]
fn tetrahedra_on_whole_numbers_are_united() {
    let points = [
        [4, 2, 2],
        [0, 2, 0],
        [0, 0, 2],
        [3, 1, 1],
        [1, 1, 1],
        [2, 3, 2],
        [1, 3, 1],
        [1, 1, 3],
    ];
    let points = points
        .map(|p: [i8; 3]| Vec3::from_array(p.map(f64::from)))
        .to_vec();
    let triangles = vec![
        [0, 2, 1],
        [0, 1, 3],
        [1, 1, 2],
        [0, 3, 2],
        [4, 7, 6],
        [7, 5, 6],
        [5, 6, 4],
        [4, 7, 6],
    ];
    let mesh = TriMesh { points, triangles };
    // The second is inside out, and 1/120 of it lies in the first.
    let asked = repair(&mesh, RepairMode::Repair).unwrap_err();
    assert!(matches!(asked, InputError::Cutter { count: 1, .. }), "{asked}");
    let repaired = repair_as(&mesh, RepairMode::Repair, InsideOut::Unite).unwrap();
    let bounds = repaired.solid.mesh().bounds();
    assert_eq!((bounds.min, bounds.max), (Vec3::ZERO, Vec3::new(4.0, 3.0, 3.0)));
    // The volumes are 2 and 2/3, of which 1/120 is common.
    assert!(
        (repaired.solid.volume() - 319.0 / 120.0).abs() < 1e-12,
        "{}",
        repaired.solid.volume()
    );
}

/// A box as its 12 triangles, without those over `missing` sides: 0 and 1 for x, 2 and 3 for y, 4 and 5 for
/// z.
fn box_without(min: Vec3, max: Vec3, missing: &[usize]) -> TriMesh {
    let mut mesh = crate::samples::cuboid(min, max).to_mesh();
    let sides: Vec<usize> = (0..mesh.triangles.len())
        .map(|face| {
            let normal = mesh.face_normal(face);
            let axis = (0..3).find(|&axis| normal[axis].abs() > 0.5).unwrap();
            2 * axis + usize::from(normal[axis] > 0.0)
        })
        .collect();
    let mut side = sides.iter();
    mesh.triangles.retain(|_| !missing.contains(side.next().unwrap()));
    mesh
}

#[test]
fn walls_between_glued_boxes_are_removed() {
    // Four rooms around an edge, each with its four outer walls, and one wall between each pair of
    // neighbours.
    let room = |x: f64, y: f64, missing: &[usize]| {
        box_without(Vec3::new(x, y, 0.0), Vec3::new(x + 2.0, y + 3.0, 4.0), missing)
    };
    let two = both(room(0.0, 0.0, &[]), room(2.0, 0.0, &[0]));
    assert_repair(&unweld(&two), &[("inner-walls-removed", 2)], 48.0);
    let four = [room(0.0, 3.0, &[2]), room(2.0, 3.0, &[0, 2])]
        .into_iter()
        .fold(two.clone(), both);
    let repaired = assert_repair(&unweld(&four), &[("inner-walls-removed", 8)], 96.0);
    assert!(repaired.repairs[0].at.z.fract() != 0.0);
    // The result does not depend on the way the walls face.
    let turned = both(room(0.0, 0.0, &[1]), flip(room(2.0, 0.0, &[])));
    let repaired = mend(&unweld(&turned));
    assert!((repaired.solid.volume() - 48.0).abs() < 1e-12);
}

/// A ball divided by the disc within its equator, every point of which is one of the ball's; also the
/// equator's points.
fn ball_with_disc() -> (TriMesh, Vec<u32>) {
    let mut ball = ball(Vec3::ZERO, 10.0, 3);
    let mut equator: Vec<u32> = (0..ball.points.len() as u32)
        .filter(|&v| ball.points[v as usize].z.abs() < 1e-9)
        .collect();
    let angle = |v: u32| ball.points[v as usize].y.atan2(ball.points[v as usize].x);
    equator.sort_by(|&a, &b| angle(a).total_cmp(&angle(b)));
    for k in 1..equator.len() - 1 {
        ball.triangles.push([equator[0], equator[k], equator[k + 1]]);
    }
    (ball, equator)
}

#[test]
fn a_wall_across_a_body_is_removed_and_one_that_comes_out_is_refused() {
    let whole = ball(Vec3::ZERO, 10.0, 3);
    let (divided, equator) = ball_with_disc();
    assert_repair(
        &divided,
        &[("inner-walls-removed", equator.len() - 2)],
        whole.signed_volume(),
    );
    // A square that touches the cube's sides where they have no points, and one that protrudes from them.
    let sheet = |half: f64| TriMesh {
        points: [(-half, -half), (half, -half), (half, half), (-half, half)]
            .map(|(x, y)| Vec3::new(x, y, 0.3))
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let cube = cube(Vec3::splat(-5.0), 10.0);
    for half in [5.0, 4.0, 5.0 + 1e-6] {
        assert_repair(
            &both(cube.clone(), sheet(half)),
            &[("inner-walls-removed", 2)],
            1000.0,
        );
    }
    for half in [5.1, 9.0] {
        let refused = repair(&both(cube.clone(), sheet(half)), RepairMode::Repair).unwrap_err();
        assert!(
            matches!(refused, InputError::Open { n_holes: 1, .. }),
            "{refused}"
        );
        assert!((refused.at().unwrap().z - 0.3).abs() < 1e-9, "{refused}");
    }
    // Beside the cube the square bounds nothing, either, but is not a wall inside.
    let mut beside = sheet(2.0);
    beside.points.iter_mut().for_each(|p| p.x += 20.0);
    assert!(repair(&both(cube, beside), RepairMode::Repair).is_err());
}

#[test]
fn a_fin_of_a_body_is_refused_with_its_place() {
    let mut fin = base();
    let [a, b, _] = fin.triangles[7];
    fin.points.push(Vec3::splat(20.0));
    let tip = fin.points.len() as u32 - 1;
    fin.triangles.push([a, b, tip]);
    assert!(repair(&fin, RepairMode::Repair).unwrap_err().at().is_some());
}

#[test]
fn a_body_inside_out_that_overlaps_another_is_asked_about_and_cut_or_united() {
    let other = ball(Vec3::new(12.3, 0.4, 1.7), 6.0, 3);
    let flush = cuboid([-2.0, -2.0, 4.0], [2.0, 2.0, 10.0]).to_mesh();
    let block = cuboid([-10.0; 3], [10.0; 3]).to_mesh();
    for (body, tool) in [(base(), other), (block, flush)] {
        let cutter = both(body.clone(), flip(tool.clone()));
        for mode in [RepairMode::Repair, RepairMode::KeepLargest] {
            let asked = repair(&cutter, mode).unwrap_err();
            assert!(matches!(asked, InputError::Cutter { count: 1, .. }), "{asked}");
            assert!(asked.at().unwrap().distance(tool.bounds().center()) < 1e-9);
        }
        let [whole, part] = [&body, &tool].map(|m| Volume::from_closed_mesh(m).unwrap());
        for (wanted, volume, code) in [
            (InsideOut::Cut, whole.subtract(&part).volume(), "bodies-cut-out"),
            (InsideOut::Unite, whole.union(&part).volume(), "body-turned"),
        ] {
            let made = repair_as(&cutter, RepairMode::Repair, wanted).unwrap();
            assert!((made.solid.volume() - volume).abs() < 1e-6 * volume, "{wanted:?}");
            assert_eq!((made.repairs[0].kind.code(), made.repairs[0].count), (code, 1));
            assert!(
                made.source_face
                    .iter()
                    .all(|&f| (f as usize) < cutter.triangles.len())
            );
        }
    }
}

#[test]
fn a_body_inside_out_beside_another_or_within_it_is_no_cutter() {
    let beside = both(base(), flip(ball(Vec3::new(40.0, 0.0, 0.0), 6.0, 2)));
    assert!(matches!(
        repair(&beside, RepairMode::Repair),
        Err(InputError::Bodies(_))
    ));
    let touching = both(cube(Vec3::ZERO, 1.0), flip(cube(Vec3::new(1.0, 0.5, 0.0), 1.0)));
    assert!((mend(&touching).solid.volume() - 2.0).abs() < 1e-12);
    // All of it is inside out, so it overlaps only itself.
    let all = flip(both(base(), ball(Vec3::new(12.3, 0.4, 1.7), 6.0, 3)));
    assert_eq!(mend(&all).repairs[0].kind.code(), "body-turned");
}

/// A flat box of 20 × 20 × 5 with a point of its top moved across a diagonal: one triangle of the top lies
/// upside down, `depth` above or below the others.
fn folded_box(depth: f64) -> TriMesh {
    let (low, high) = (-5.0, 0.0);
    let corner = |x: f64, y: f64, z: f64| Vec3::new(x, y, z);
    let points = vec![
        corner(-10.0, -10.0, low),
        corner(10.0, -10.0, low),
        corner(10.0, 10.0, low),
        corner(-10.0, 10.0, low),
        corner(-10.0, -10.0, high),
        corner(10.0, -10.0, high),
        corner(10.0, 10.0, high),
        corner(-10.0, 10.0, high),
        // Belongs to the triangle above the diagonal from 4 to 6, and lies below it.
        corner(2.0, -2.0, depth),
    ];
    let triangles = vec![
        [0, 2, 1],
        [0, 3, 2],
        [0, 1, 5],
        [0, 5, 4],
        [1, 2, 6],
        [1, 6, 5],
        [2, 3, 7],
        [2, 7, 6],
        [3, 0, 4],
        [3, 4, 7],
        [4, 5, 6],
        [4, 6, 8],
        [6, 7, 8],
        [7, 4, 8],
    ];
    TriMesh { points, triangles }
}

fn folded(mesh: &TriMesh) -> Vec<u32> {
    crate::fold::folded_faces(mesh, &TriangleBvh::new(mesh))
}

#[test]
fn a_triangle_upside_down_on_its_neighbour_is_turned_without_moving_a_point() {
    for depth in [-1e-4, 1e-4] {
        let mesh = folded_box(depth);
        let before = into_solid(&mesh).unwrap().0;
        assert_eq!(folded(&mesh).len(), 1, "at {depth}");
        let repaired = repair(&mesh, RepairMode::Repair).unwrap();
        let after = repaired.solid.mesh();
        assert!(folded(after).is_empty(), "at {depth}");
        assert_eq!(after.points, before.mesh().points);
        assert!((after.signed_volume() - 2000.0).abs() < 1.0);
        let kinds: Vec<(RepairKind, usize)> = repaired.repairs.iter().map(|r| (r.kind, r.count)).collect();
        assert_eq!(kinds, [(RepairKind::Unfolded, 1)], "at {depth}");
        // The flipped pair comes from the triangle that is seen.
        assert_eq!(repaired.source_face[10], 10);
        assert_eq!(repaired.source_face[11], 10);
        assert_eq!(repair(&mesh, RepairMode::Refuse).unwrap().solid, before);
    }
}

/// A cube of 40 with a grid on its sides, of which one point in the middle of a side moves along that side,
/// out of its polygon.
#[test]
fn a_point_that_left_its_polygon_leaves_no_fold_wherever_it_went() {
    let mut grid = Solid::new(cube(Vec3::splat(-20.0), 40.0)).unwrap();
    for _ in 0..4 {
        grid = crate::subdivide::halve_edges(&grid, &Topology::new(&grid), |_, _| true).0;
    }
    let top = |p: &Vec3| p.z == 20.0 && p.x.abs().max(p.y.abs()) < 15.0;
    let inner: Vec<usize> = (0..grid.mesh().points.len())
        .filter(|&v| top(&grid.mesh().points[v]))
        .collect();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut n_folded = 0;
    for _ in 0..200 {
        let mut mesh = grid.mesh().clone();
        let moved = inner[rng.random_range(0..inner.len())];
        let mut by = |most: f64| rng.random_range(-most..most);
        mesh.points[moved] += Vec3::new(by(5.0), by(5.0), by(5e-4));
        n_folded += usize::from(!folded(&mesh).is_empty());
        let repaired = repair(&mesh, RepairMode::Repair).unwrap();
        let after = repaired.solid.mesh();
        assert!(folded(after).is_empty(), "{:?}", mesh.points[moved]);
        assert!((after.signed_volume() - 64e3).abs() < 0.1);
        assert_eq!(repaired.source_face.len(), after.triangles.len());
    }
    assert!(n_folded > 100, "{n_folded}");
}

use std::collections::{BTreeMap, BTreeSet};

use super::*;
use crate::Solid;
use crate::bvh::TriangleBvh;
use crate::samples::{cuboid, ellipsoid, torus};

fn label(mesh: &TriMesh, at: impl Fn(Vec3) -> u32) -> Vec<u32> {
    (0..mesh.triangles.len())
        .map(|f| at(mesh.face_center(f)))
        .collect()
}

fn octant(p: Vec3) -> u32 {
    u32::from(p.x > 0.0) + 2 * u32::from(p.y > 0.0) + 4 * u32::from(p.z > 0.0)
}

/// Label of the nearest of `n` sites spread over a ball.
fn voronoi(n: u32, radius_mm: f64) -> impl Fn(Vec3) -> u32 {
    let site = move |i: u32| {
        let (t, z) = (
            f64::from(i) * 2.399_963,
            1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(n),
        );
        radius_mm * Vec3::new((1.0 - z * z).sqrt() * t.cos(), (1.0 - z * z).sqrt() * t.sin(), z)
    };
    move |p| {
        (0..n)
            .min_by(|&i, &j| {
                p.distance_squared(site(i))
                    .total_cmp(&p.distance_squared(site(j)))
            })
            .unwrap_or(0)
    }
}

/// Border edges: their labels, lower first, and their end points.
fn borders(mesh: &TriMesh, labels: &[u32]) -> Vec<([u32; 2], [u32; 2])> {
    let mut owner = BTreeMap::new();
    for (f, &[a, b, c]) in mesh.triangles.iter().enumerate() {
        for edge in [(a, b), (b, c), (c, a)] {
            owner.insert(edge, labels[f]);
        }
    }
    owner
        .iter()
        .filter(|(e, l)| **l < owner[&(e.1, e.0)])
        .map(|(e, &l)| ([l, owner[&(e.1, e.0)]], [e.0, e.1]))
        .collect()
}

/// Length of the border between each pair of labels, mm.
fn seam_lengths(mesh: &TriMesh, labels: &[u32]) -> BTreeMap<[u32; 2], f64> {
    let mut lengths = BTreeMap::new();
    for (pair, [u, v]) in borders(mesh, labels) {
        *lengths.entry(pair).or_insert(0.0) += mesh.points[u as usize].distance(mesh.points[v as usize]);
    }
    lengths
}

/// Points where three or more labels meet: the bits of the coordinates, and the labels.
fn corners(mesh: &TriMesh, labels: &[u32]) -> BTreeSet<([u64; 3], Vec<u32>)> {
    let mut around = vec![BTreeSet::new(); mesh.points.len()];
    for (t, &l) in mesh.triangles.iter().zip(labels) {
        t.iter().for_each(|&v| {
            around[v as usize].insert(l);
        });
    }
    let is_corner = around.iter().enumerate().filter(|(_, labels)| labels.len() > 2);
    is_corner
        .map(|(v, l)| {
            (
                mesh.points[v].to_array().map(f64::to_bits),
                l.iter().copied().collect(),
            )
        })
        .collect()
}

/// Lengths of all edges in target lengths, sorted.
fn edge_lengths(mesh: &TriMesh, target_mm: f64) -> Vec<f64> {
    let sides = mesh
        .triangles
        .iter()
        .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let mut lengths: Vec<f64> = sides
        .filter(|(a, b)| a < b)
        .map(|(a, b)| mesh.points[a as usize].distance(mesh.points[b as usize]) / target_mm)
        .collect();
    lengths.sort_by(f64::total_cmp);
    lengths
}

/// Share of edges between 0.6 and 1.5 target lengths.
fn even_share(mesh: &TriMesh, target_mm: f64) -> f64 {
    let lengths = edge_lengths(mesh, target_mm);
    lengths.iter().filter(|l| (0.6..=1.5).contains(*l)).count() as f64 / lengths.len() as f64
}

/// Largest distance from the points and centres of `from` to `to`, mm.
fn farthest_mm(from: &TriMesh, to: &TriMesh) -> f64 {
    let bvh = TriangleBvh::new(to);
    let centers = (0..from.triangles.len()).map(|f| from.face_center(f));
    let distances = from
        .points
        .iter()
        .copied()
        .chain(centers)
        .filter_map(|p| bvh.nearest(p, f64::INFINITY));
    distances.map(|n| n.distance_sq).fold(0.0, f64::max).sqrt()
}

fn n_bridged(mesh: &TriMesh, labels: &[u32]) -> usize {
    let on_border: BTreeSet<u32> = borders(mesh, labels).into_iter().flat_map(|b| b.1).collect();
    mesh.triangles
        .iter()
        .filter(|t| t.iter().all(|v| on_border.contains(v)))
        .count()
}

fn n_against(mesh: &TriMesh, input: &TriMesh) -> usize {
    let bvh = TriangleBvh::new(input);
    let is_against = |f: usize| {
        let nearest = bvh.nearest(mesh.face_center(f), f64::INFINITY).unwrap();
        mesh.face_normal(f).dot(input.face_normal(nearest.face as usize)) <= 0.0
    };
    (0..mesh.triangles.len()).filter(|&f| is_against(f)).count()
}

/// Number of connected regions of each label.
fn n_regions(mesh: &TriMesh, labels: &[u32]) -> BTreeMap<u32, usize> {
    let topology = crate::Topology::of_mesh(mesh).unwrap();
    let (component, n) =
        crate::topology::components(&topology, |a, b| labels[a as usize] == labels[b as usize]);
    let mut label_of = vec![0; n];
    component
        .iter()
        .zip(labels)
        .for_each(|(&c, &l)| label_of[c as usize] = l);
    label_of.iter().fold(BTreeMap::new(), |mut counts, &l| {
        *counts.entry(l).or_insert(0) += 1;
        counts
    })
}

/// Asserts the properties that every result has.
fn assert_same_map(input: &TriMesh, labels: &[u32], out: &Remeshed) {
    assert!(Solid::new(out.mesh.clone()).is_ok());
    let euler = |m: &TriMesh| 2 * m.points.len() as i64 - m.triangles.len() as i64;
    assert_eq!(euler(&out.mesh), euler(input));
    assert_eq!(n_regions(&out.mesh, &out.labels), n_regions(input, labels));
    let pairs = |m: &TriMesh, l: &[u32]| seam_lengths(m, l).into_keys().collect::<Vec<_>>();
    assert_eq!(pairs(&out.mesh, &out.labels), pairs(input, labels));
    assert_eq!(corners(&out.mesh, &out.labels), corners(input, labels));
    assert_eq!(n_bridged(&out.mesh, &out.labels), 0);
    assert_eq!(n_against(&out.mesh, input), 0);
}

fn assert_near(a: f64, b: f64, share: f64) {
    assert!(
        (a - b).abs() <= share * b.abs(),
        "{a} is not within {share} of {b}"
    );
}

const ROUNDS: u32 = 6;

#[test]
fn octants_of_a_ball_keep_their_map_size_and_shape() {
    let ball = ellipsoid(6, Vec3::splat(30.0));
    let labels = label(&ball, octant);
    let out = remesh(
        &RemeshParams {
            target_edge_mm: 5.0,
            n_rounds: ROUNDS,
        },
        &ball,
        &labels,
    );
    assert_same_map(&ball, &labels, &out);
    assert_near(out.mesh.area(), ball.area(), 0.02);
    assert_near(out.mesh.signed_volume(), ball.signed_volume(), 0.03);
    assert!(
        even_share(&out.mesh, 5.0) > 0.97,
        "{}",
        even_share(&out.mesh, 5.0)
    );
    // The sagitta of a triangle with edges of 1.5 targets: 7.5² / 3 / (2 · 30).
    assert!(farthest_mm(&out.mesh, &ball) < 0.32 && farthest_mm(&ball, &out.mesh) < 0.32);
    let before = seam_lengths(&ball, &labels);
    for (pair, length) in seam_lengths(&out.mesh, &out.labels) {
        assert_near(length, before[&pair], 0.02);
    }
}

#[test]
fn seam_points_lie_on_the_seams_of_the_input() {
    let body = ellipsoid(6, Vec3::new(40.0, 30.0, 25.0));
    let labels = label(&body, voronoi(9, 30.0));
    let out = remesh(
        &RemeshParams {
            target_edge_mm: 5.0,
            n_rounds: ROUNDS,
        },
        &body,
        &labels,
    );
    assert_same_map(&body, &labels, &out);
    let lines = borders(&body, &labels);
    for (pair, ends) in borders(&out.mesh, &out.labels) {
        for v in ends {
            let p = out.mesh.points[v as usize];
            let distances = lines.iter().filter(|l| l.0 == pair).map(|(_, [a, b])| {
                let (a, b) = (body.points[*a as usize], body.points[*b as usize]);
                let t = ((p - a).dot(b - a) / a.distance_squared(b)).clamp(0.0, 1.0);
                p.distance(a.lerp(b, t))
            });
            assert!(distances.fold(f64::INFINITY, f64::min) < 1e-9);
        }
    }
}

#[test]
fn a_torus_keeps_its_hole_and_loops() {
    let ring = torus(30.0, 10.0, [240, 80]);
    // Two half tubes meet in closed seams without a corner; the four quarters of the other half have corners.
    let labels = label(&ring, |p| {
        if p.y > 0.0 {
            u32::from(p.z > 0.0)
        } else {
            2 + octant(p)
        }
    });
    for target_edge_mm in [3.0, 5.0] {
        let out = remesh(
            &RemeshParams {
                target_edge_mm,
                n_rounds: ROUNDS,
            },
            &ring,
            &labels,
        );
        assert_same_map(&ring, &labels, &out);
        assert_near(out.mesh.signed_volume(), ring.signed_volume(), 0.06);
    }
    let halves = label(&ring, |p| u32::from(p.z > 0.0));
    let out = remesh(
        &RemeshParams {
            target_edge_mm: 5.0,
            n_rounds: ROUNDS,
        },
        &ring,
        &halves,
    );
    assert_same_map(&ring, &halves, &out);
    assert!(
        even_share(&out.mesh, 5.0) > 0.95,
        "{}",
        even_share(&out.mesh, 5.0)
    );
}

#[test]
fn regions_narrower_than_an_edge_stay_and_have_inside_points() {
    let ball = ellipsoid(6, Vec3::splat(30.0));
    let strip = |p: Vec3| {
        if p.z.abs() < 0.8 {
            1
        } else {
            2 * u32::from(p.z > 0.0)
        }
    };
    let island = |p: Vec3| u32::from(p.distance(Vec3::new(30.0, 0.3, 0.2)) < 1.0);
    for labels in [label(&ball, strip), label(&ball, island)] {
        for target_edge_mm in [4.0, 8.0, 40.0] {
            let out = remesh(
                &RemeshParams {
                    target_edge_mm,
                    n_rounds: ROUNDS,
                },
                &ball,
                &labels,
            );
            assert_same_map(&ball, &labels, &out);
        }
    }
}

#[test]
fn points_that_only_touch_become_two() {
    let one = ellipsoid(4, Vec3::splat(10.0));
    let touching = one.points.iter().position(|p| p.x == 10.0).unwrap() as u32;
    let mut two = one.clone();
    // The ball mirrored in the plane x = 10 shares the point (10, 0, 0).
    let name = |v: u32| {
        if v == touching {
            v
        } else {
            v + one.points.len() as u32
        }
    };
    two.points
        .extend(one.points.iter().map(|p| Vec3::new(20.0 - p.x, p.y, p.z)));
    two.triangles
        .extend(one.triangles.iter().map(|&[a, b, c]| [name(a), name(c), name(b)]));
    let labels = vec![0; two.triangles.len()];
    let out = remesh(
        &RemeshParams {
            target_edge_mm: 3.0,
            n_rounds: ROUNDS,
        },
        &two,
        &labels,
    );
    assert!(Solid::new(out.mesh.clone()).is_ok());
    assert_near(out.mesh.signed_volume(), two.signed_volume(), 0.05);
    assert_eq!(n_against(&out.mesh, &two), 0);
}

#[test]
fn what_is_no_task_comes_back_unchanged() {
    let ball = ellipsoid(2, Vec3::splat(30.0));
    let labels = label(&ball, octant);
    let params = |target_edge_mm| RemeshParams {
        target_edge_mm,
        n_rounds: ROUNDS,
    };
    for target_edge_mm in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let out = remesh(&params(target_edge_mm), &ball, &labels);
        assert_eq!((out.mesh, out.labels), (ball.clone(), labels.clone()));
    }
    let mut open = ball.clone();
    open.triangles.pop();
    assert_eq!(remesh(&params(4.0), &open, &labels[1..]).mesh, open);
    assert_eq!(
        remesh(&params(4.0), &TriMesh::default(), &[]).mesh,
        TriMesh::default()
    );
}
/// For twelve triangles with edges of up to 128 mm, creases stay in place to a fraction of an edge, and no
/// triangle is a needle.
#[test]
fn a_plate_of_twelve_triangles_keeps_its_shape() {
    let plate = cuboid([0.0; 3], [100.0, 80.0, 8.0]).to_mesh();
    let out = remesh(
        &RemeshParams {
            target_edge_mm: 2.1,
            n_rounds: 5,
        },
        &plate,
        &[0; 12],
    );
    assert_near(out.mesh.signed_volume(), plate.signed_volume(), 0.02);
    assert_near(out.mesh.area(), plate.area(), 0.03);
    let share = |f: usize| {
        let [a, b, c] = out.mesh.corners(f);
        let longest_sq = a
            .distance_squared(b)
            .max(b.distance_squared(c))
            .max(c.distance_squared(a));
        (b - a).cross(c - a).length() / longest_sq
    };
    let least = (0..out.mesh.triangles.len()).map(share).fold(1.0, f64::min);
    assert!(least > 0.02, "a triangle's height is {least} of its longest edge");
}

#[test]
fn coarse_input_is_refined() {
    let octahedron = ellipsoid(0, Vec3::splat(30.0));
    let labels: Vec<u32> = (0..8).collect();
    let out = remesh(
        &RemeshParams {
            target_edge_mm: 4.0,
            n_rounds: ROUNDS,
        },
        &octahedron,
        &labels,
    );
    assert_same_map(&octahedron, &labels, &out);
    assert_near(out.mesh.signed_volume(), octahedron.signed_volume(), 1e-9);
    assert_near(out.mesh.area(), octahedron.area(), 1e-9);
    // Less than on larger regions, since the 24 region corners of 60° cannot have even triangles.
    assert!(even_share(&out.mesh, 4.0) > 0.9, "{}", even_share(&out.mesh, 4.0));
}

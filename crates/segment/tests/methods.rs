//! Promises that every method keeps, tested on bodies with obvious parts.

use std::f64::consts::TAU;

use shellock_geom::{TriMesh, Vec3};
use shellock_segment::auto::{self, AutoParams};
use shellock_segment::kmeans::{self, KMeansParams};
use shellock_segment::primitives::{self, PrimitivesParams};
use shellock_segment::random_cuts::{self, RandomCutsParams};
use shellock_segment::sdf::{self, SdfParams};
use shellock_segment::whole::Whole;
use shellock_segment::{border, coarse::Coarse, face_graph::FaceGraph, parts};

/// A body of revolution about z with the outline (z, radius), bottom first. Both ends are closed by a point
/// on the axis.
fn turn(outline: &[(f64, f64)], n_around: u32) -> TriMesh {
    let mut points = vec![Vec3::new(0.0, 0.0, outline[0].0)];
    for &(z, radius) in outline {
        points.extend((0..n_around).map(|i| {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(n_around)).sin_cos();
            Vec3::new(radius * cos, radius * sin, z)
        }));
    }
    points.push(Vec3::new(0.0, 0.0, outline[outline.len() - 1].0));
    let top = points.len() as u32 - 1;
    let at = |ring: u32, i: u32| 1 + ring * n_around + i % n_around;
    let mut triangles = Vec::new();
    let last = outline.len() as u32 - 1;
    for i in 0..n_around {
        triangles.push([0, at(0, i + 1), at(0, i)]);
        triangles.push([top, at(last, i), at(last, i + 1)]);
        for ring in 0..last {
            let [a, b, c, d] = [at(ring, i), at(ring, i + 1), at(ring + 1, i + 1), at(ring + 1, i)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    TriMesh { points, triangles }
}

/// Two balls of radius 10 about z = ±12, joined by a neck of radius 3 between z = ±2.5.
fn dumbbell() -> TriMesh {
    let outline: Vec<(f64, f64)> = (0..=40)
        .map(|i| {
            let z = -21.8 + 43.6 * f64::from(i) / 40.0;
            let ball = (100.0 - (z.abs() - 12.0_f64).powi(2)).max(0.0).sqrt();
            (z, ball.max(3.0))
        })
        .collect();
    turn(&outline, 20)
}

/// A cylinder of radius 5 and height 20, with plane faces at both ends.
fn cylinder() -> TriMesh {
    let ends = |z: f64| [1.25, 2.5, 3.75, 5.0].map(|r| (z, r));
    let side = (1..12).map(|i| (20.0 * f64::from(i) / 12.0, 5.0));
    let mut top = ends(20.0);
    top.reverse();
    let outline: Vec<(f64, f64)> = ends(0.0).into_iter().chain(side).chain(top).collect();
    turn(&outline, 24)
}

fn both(a: &TriMesh, b: &TriMesh) -> TriMesh {
    let n = a.points.len() as u32;
    let mut both = a.clone();
    both.points.extend(b.points.iter().map(|&p| p + Vec3::X * 60.0));
    both.triangles
        .extend(b.triangles.iter().map(|t| t.map(|v| v + n)));
    both
}

type Method = fn(&TriMesh, Option<usize>) -> Vec<u32>;

const METHODS: [(&str, Method); 5] = [
    ("sdf", |mesh, n_parts| {
        let params = SdfParams {
            n_parts,
            ..SdfParams::default()
        };
        sdf::divide(&params, mesh)
    }),
    ("kmeans", |mesh, n_parts| {
        let params = KMeansParams {
            n_parts,
            ..KMeansParams::default()
        };
        kmeans::divide(&params, mesh)
    }),
    ("random_cuts", |mesh, n_parts| {
        let params = RandomCutsParams {
            n_parts,
            ..RandomCutsParams::default()
        };
        random_cuts::divide(&params, mesh)
    }),
    ("primitives", |mesh, n_parts| {
        let params = PrimitivesParams {
            n_parts,
            ..PrimitivesParams::default()
        };
        primitives::divide(&params, mesh)
    }),
    ("auto", |mesh, n_parts| {
        let cuts = RandomCutsParams {
            n_parts,
            ..RandomCutsParams::default()
        };
        auto::divide(&AutoParams { cuts }, mesh)
    }),
];

fn n_parts(labels: &[u32]) -> usize {
    labels.iter().max().map_or(0, |&l| l as usize + 1)
}

#[test]
fn two_balls_on_a_neck_are_cut_at_the_neck() {
    let mesh = dumbbell();
    for (name, divide) in METHODS {
        let labels = divide(&mesh, Some(2));
        assert_eq!(n_parts(&labels), 2, "{name}");
        let [below, above] = [-1.0, 1.0].map(|sign| {
            let ball = (0..labels.len()).filter(|&f| sign * mesh.face_center(f).z > 4.0);
            let mut found: Vec<u32> = ball.map(|f| labels[f]).collect();
            found.sort_unstable();
            found.dedup();
            found
        });
        assert_eq!([below.len(), above.len()], [1, 1], "{name}: a ball is cut");
        assert_ne!(below, above, "{name}: the neck is not cut");
    }
}

#[test]
fn nobody_need_say_that_a_dumbbell_has_two_ends_and_a_ball_is_whole() {
    for divide in [METHODS[2].1, METHODS[4].1] {
        let dumbbell = dumbbell();
        let labels = divide(&dumbbell, None);
        let mut ends = (0..labels.len()).map(|f| (dumbbell.face_center(f).z, labels[f]));
        let first = ends.clone().min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
        assert!(ends.any(|(z, label)| z > 4.0 && label != first.1));
        let (points, triangles) = shellock_testkit::plain::sphere(3, Vec3::splat(10.0));
        assert_eq!(n_parts(&divide(&TriMesh { points, triangles }, None)), 1);
    }
}

#[test]
fn a_cylinder_is_a_round_side_and_two_planes() {
    let mesh = cylinder();
    for wanted in [Some(3), None] {
        let params = PrimitivesParams {
            n_parts: wanted,
            ..PrimitivesParams::default()
        };
        let labels = primitives::divide(&params, &mesh);
        assert_eq!(n_parts(&labels), 3, "{wanted:?}");
        let part = |face: usize| (mesh.face_normal(face).z * 1.5) as i32;
        for face in 0..labels.len() {
            let first = (0..labels.len()).find(|&f| part(f) == part(face)).unwrap();
            assert_eq!(labels[face], labels[first], "{wanted:?}");
        }
    }
}

#[test]
fn parts_are_connected_and_the_same_on_any_number_of_threads() {
    let mesh = both(&dumbbell(), &cylinder());
    let graph = FaceGraph::new(&mesh);
    let on = |n_threads: usize, divide: Method| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .build()
            .unwrap();
        pool.install(|| divide(&mesh, Some(6)))
    };
    for (name, divide) in METHODS {
        let labels = on(1, divide);
        assert_eq!(labels, on(2, divide), "{name}");
        assert_eq!(parts::number_parts(&graph, &labels).0, labels, "{name}");
    }
}

#[test]
fn broken_meshes_get_labels_and_no_panic() {
    let mut flat = dumbbell();
    flat.triangles
        .extend([[0, 0, 1], [3, 4, 3], [5, 6, 7], [5, 6, 7], [5, 6, 8]]);
    let mut open = dumbbell();
    open.triangles.truncate(1000);
    let point = TriMesh {
        points: vec![Vec3::ZERO; 3],
        triangles: vec![[0, 1, 2]; 4],
    };
    for mesh in [
        flat,
        open,
        point,
        both(&cylinder(), &cylinder()),
        TriMesh::default(),
    ] {
        for (name, divide) in METHODS {
            for wanted in [None, Some(1), Some(30)] {
                let labels = divide(&mesh, wanted);
                assert_eq!(labels.len(), mesh.triangles.len(), "{name}, {wanted:?}");
            }
        }
    }
}

#[test]
fn a_border_settles_in_the_crease_nearby() {
    let mesh = dumbbell();
    let graph = FaceGraph::new(&mesh);
    let mut labels: Vec<u32> = graph.center.iter().map(|c| u32::from(c.z > 5.0)).collect();
    border::settle(&graph, 6.0, &mut labels);
    // The neck ends in a crease at 2.5; outlines are drawn in steps of 1.1.
    for (center, &label) in graph.center.iter().zip(&labels) {
        assert!((center.z - 2.5).abs() < 1.2 || label == u32::from(center.z > 2.5));
    }
}

#[test]
fn labels_come_back_from_a_coarse_mesh_to_where_they_were() {
    let (points, triangles) = shellock_testkit::plain::sphere(5, Vec3::splat(10.0));
    let mesh = TriMesh { points, triangles };
    let fine = FaceGraph::new(&mesh);
    let coarse = Coarse::new(&mesh, 1000);
    assert!(coarse.graph.n_faces() <= 1000 && coarse.graph.n_faces() >= 400);
    let labels: Vec<u32> = coarse.graph.center.iter().map(|c| u32::from(c.z > 0.0)).collect();
    let back = coarse.bring_back(&fine, &labels);
    let top = (0..back.len())
        .max_by(|&f, &g| fine.center[f].z.total_cmp(&fine.center[g].z))
        .unwrap();
    // On a ball shorter borders are everywhere, so borders move as far as allowed: one and a half coarse
    // edges of 2.1.
    for (center, &label) in fine.center.iter().zip(&back) {
        assert!(center.z.abs() < 4.0 || (label == back[top]) == (center.z > 0.0));
    }
}

#[test]
fn parameters_out_of_range_are_all_told_of() {
    assert!(RandomCutsParams::default().problems().is_empty());
    let params = SdfParams {
        n_rays: 0,
        smoothness: f64::NAN,
        n_parts: Some(0),
        ..SdfParams::default()
    };
    assert_eq!(params.problems().len(), 3);
}

#[test]
fn no_border_of_cuts_divides_what_is_kept_whole() {
    let mesh = dumbbell();
    // A set around the neck, where every cut would run.
    let neck: Vec<u32> = (0..mesh.triangles.len() as u32)
        .filter(|&f| mesh.face_center(f as usize).z.abs() < 4.0)
        .collect();
    let whole = Whole::new(mesh.triangles.len(), [neck.clone()]);
    let by_auto = auto::divide_with_whole(&AutoParams::default(), &mesh, &whole).part_of_face;
    let by_cuts = random_cuts::divide_with_whole(&RandomCutsParams::default(), &mesh, &whole).part_of_face;
    for labels in [by_auto, by_cuts] {
        assert!(
            neck.iter()
                .all(|&f| labels[f as usize] == labels[neck[0] as usize])
        );
    }
}

use shellock_geom::{TriMesh, Vec3};
use shellock_test_surfaces::sphere;

use super::*;

fn with_ctx<T>(run: impl FnOnce(&Ctx) -> T) -> T {
    run(&Ctx::quiet())
}

/// Runs `run` and returns its result with the warnings.
fn with_warnings<T>(run: impl FnOnce(&Ctx) -> T) -> (T, Vec<shellock_report::Warning>) {
    let ctx = Ctx::quiet();
    (run(&ctx), ctx.into_warnings())
}

/// A sphere of `radius_mm` with four arms, star-shaped around its centre.
fn sphere_with_arms() -> Solid {
    let arms = [
        Vec3::X,
        Vec3::NEG_X,
        Vec3::Y,
        Vec3::new(0.1, 0.2, 1.0).normalize(),
    ];
    let radius = |d: Vec3| {
        30.0 + arms
            .iter()
            .map(|a| 60.0 * (-40.0 * (1.0 - a.dot(d))).exp())
            .sum::<f64>()
    };
    let sphere = sphere(5, Vec3::ONE);
    let points = sphere.points.iter().map(|&p| p * radius(p)).collect();
    Solid::new(TriMesh {
        points,
        triangles: sphere.triangles,
    })
    .unwrap()
}

/// One label for each arm's triangles and 0 for the body, which is the only link between the arms.
fn arm_labels(solid: &Solid) -> Vec<i64> {
    let mesh = solid.mesh();
    (0..mesh.triangles.len())
        .map(|f| {
            let c = mesh.face_center(f);
            match () {
                () if c.length() < 45.0 => 7,
                () if c.x > 40.0 => -3,
                () if c.x < -40.0 => 100,
                () if c.y > 40.0 => 12,
                () => 13,
            }
        })
        .collect()
}

fn assert_connected_patches(surface: &SegmentedSurface) {
    let topology = Topology::of_mesh(&surface.mesh).unwrap();
    let patch = &surface.patch_of_face;
    let (_, n) = components(&topology, |f, g| patch[f as usize] == patch[g as usize]);
    assert_eq!(n, surface.n_patches);
}

#[test]
fn automatic_patches_cover_the_closed_surface_and_hold_each_other_twice() {
    let solid = sphere_with_arms();
    let params = SegmentationParams::default();
    let surface = with_ctx(|ctx| segment(ctx, &params, &solid, None)).unwrap();
    let cut = Solid::new(surface.mesh.clone()).unwrap();
    assert!((cut.volume() / solid.volume() - 1.0).abs() < 1e-12);
    let area: f64 = surface.areas().as_slice().iter().sum();
    assert!((area / solid.mesh().area() - 1.0).abs() < 1e-12);
    assert_connected_patches(&surface);
    assert!(surface.contact_graph(params.min_contact_mm).is_two_connected());
    for (face, &source) in surface.source_face.iter().enumerate() {
        let normal = solid.mesh().face_normal(source as usize);
        let offset = surface.mesh.face_center(face) - solid.mesh().face_center(source as usize);
        assert!(
            offset.dot(normal).abs() < 1e-9,
            "triangle {face} does not lie in its source"
        );
    }
}

#[test]
fn the_same_seed_gives_the_same_patches() {
    let solid = sphere_with_arms();
    let run = || with_ctx(|ctx| segment(ctx, &SegmentationParams::default(), &solid, None)).unwrap();
    let (one, two) = (run(), run());
    assert_eq!((one.mesh, one.patch_of_face), (two.mesh, two.patch_of_face));
}

#[test]
fn arms_that_hang_on_one_body_are_held_twice_after_mending() {
    let solid = sphere_with_arms();
    let labels = arm_labels(&solid);
    let params = SegmentationParams::default();
    let (surface, warnings) = with_warnings(|ctx| segment(ctx, &params, &solid, Some(&labels)).unwrap());
    assert!(surface.n_patches > 5);
    assert!(surface.contact_graph(params.min_contact_mm).is_two_connected());
    assert!(
        warnings
            .iter()
            .any(|w| w.code() == "piece-split" && w.at.is_some())
    );
    assert_connected_patches(&surface);
}

/// Segments the arms' labels. A seam half round an arm lies between the two limits on contacts.
fn segment_thin_arms(
    least_contact_mm: f64,
) -> (
    SegmentationParams,
    SegmentedSurface,
    Vec<shellock_report::Warning>,
) {
    let solid = sphere_with_arms();
    let params = SegmentationParams {
        min_contact_mm: 45.0,
        least_contact_mm,
        ..Default::default()
    };
    let (surface, warnings) =
        with_warnings(|ctx| segment(ctx, &params, &solid, Some(&arm_labels(&solid))).unwrap());
    (params, surface, warnings)
}

#[test]
fn arms_too_thin_for_two_contacts_join_their_neighbour_and_the_user_is_told_where() {
    let (params, surface, warnings) = segment_thin_arms(45.0);
    assert!(surface.n_patches < 5);
    assert!(surface.contact_graph(params.min_contact_mm).is_two_connected());
    assert!(
        warnings
            .iter()
            .any(|w| w.code() == "piece-joined" && w.at.is_some())
    );
    assert_connected_patches(&surface);
}

#[test]
fn shorter_contacts_count_before_labels_are_joined_and_the_user_is_told() {
    let (params, surface, warnings) = segment_thin_arms(15.0);
    assert!(surface.n_patches > 5);
    assert!(surface.contact_graph(params.least_contact_mm).is_two_connected());
    let codes: Vec<&str> = warnings.iter().map(|w| w.code()).collect();
    assert_eq!(codes, ["piece-split", "short-contacts"]);
}

#[test]
fn other_numbers_for_the_same_patches_give_the_same_seams() {
    let solid = sphere_with_arms();
    let params = SegmentationParams::default();
    let (one, two) = with_ctx(|ctx| {
        let labels = user_labels(ctx, &params, &solid, &arm_labels(&solid)).unwrap();
        let n = labels.n_patches() as u32;
        let turned = labels.as_slice().iter().map(|k| (k + 2) % n).collect();
        let turned = FaceLabels {
            patch_of_face: turned,
            n_patches: labels.n_patches(),
        };
        (
            smooth_and_cut(ctx, &params, &solid, &labels).unwrap(),
            smooth_and_cut(ctx, &params, &solid, &turned).unwrap(),
        )
    });
    assert_eq!(one.mesh, two.mesh);
    let n = one.n_patches as u32;
    assert!(
        one.patch_of_face
            .iter()
            .zip(&two.patch_of_face)
            .all(|(p, q)| (p.0 + 2) % n == q.0)
    );
}

#[test]
fn seams_run_from_triple_point_to_triple_point_or_around() {
    let solid = sphere_with_arms();
    let surface = with_ctx(|ctx| segment(ctx, &SegmentationParams::default(), &solid, None)).unwrap();
    let seams = surface.seams();
    for seam in &seams {
        assert!(seam.a < seam.b && seam.points.len() == seam.normals.len() && seam.length() > 0.0);
        let ends = |p: &Vec3| {
            seams.iter().filter(|s| s.points.first() == Some(p)).count()
                + seams.iter().filter(|s| s.points.last() == Some(p)).count()
        };
        assert!(seam.is_loop() || (ends(&seam.points[0]) >= 3 && ends(seam.points.last().unwrap()) >= 3));
    }
}

#[test]
fn a_box_of_twelve_triangles_keeps_its_six_sides() {
    let corner = |i: usize| Vec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64) * 60.0;
    let sides = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles = sides
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    let solid = Solid::new(TriMesh {
        points: (0..8).map(corner).collect(),
        triangles,
    })
    .unwrap();
    let (fine, source) = halve_long_edges(&SegmentationParams::default(), &solid);
    let labels: Vec<i64> = source.iter().map(|f| i64::from(f / 2)).collect();
    let surface = with_ctx(|ctx| segment(ctx, &SegmentationParams::default(), &fine, Some(&labels))).unwrap();
    assert_eq!(surface.n_patches, 6);
    assert!(
        surface
            .areas()
            .as_slice()
            .iter()
            .all(|a| (a - 3600.0).abs() < 36.0)
    );
}

#[test]
fn both_halves_of_a_split_piece_are_connected_and_similar() {
    let solid = sphere_with_arms();
    let (whole, halves) = with_ctx(|ctx| {
        let labels = user_labels(ctx, &SegmentationParams::default(), &solid, &arm_labels(&solid)).unwrap();
        let halves = split_piece(&solid, &labels, PatchId(0)).unwrap();
        (labels, halves)
    });
    assert_eq!(halves.n_patches(), whole.n_patches() + 1);
    let area = |labels: &FaceLabels, k: usize| -> f64 {
        let own = (0..solid.mesh().triangles.len()).filter(|&f| usize::from(labels.patch(f)) == k);
        own.map(|f| solid.mesh().face_area(f)).sum()
    };
    let (one, two) = (area(&halves, 0), area(&halves, whole.n_patches()));
    assert!((one + two - area(&whole, 0)).abs() < 1e-9 && one.min(two) > 0.6 * one.max(two));
    let topology = Topology::new(&solid);
    assert_eq!(
        FaceLabels::from_components(&topology, halves.as_slice()).n_patches(),
        halves.n_patches()
    );
}

#[test]
fn labels_that_mean_no_patches_are_refused() {
    let solid = sphere_with_arms();
    let n_faces = solid.mesh().triangles.len();
    let run =
        |labels: &[i64]| with_ctx(|ctx| user_labels(ctx, &SegmentationParams::default(), &solid, labels));
    assert_eq!(
        run(&[1, 2]),
        Err(SegmentationError::LabelCount { n_labels: 2, n_faces })
    );
    assert_eq!(
        run(&vec![4; n_faces]),
        Err(SegmentationError::OneLabel { label: 4, n_faces })
    );
    let all: Vec<i64> = (0..n_faces as i64).collect();
    assert_eq!(
        run(&all),
        Err(SegmentationError::TooManyLabels {
            n_labels: n_faces,
            n_faces
        })
    );
}

#[test]
fn islands_join_what_surrounds_them_and_far_parts_become_pieces() {
    let solid = sphere_with_arms();
    let mut labels = arm_labels(&solid);
    labels.iter_mut().filter(|l| **l == 100).for_each(|l| *l = -3);
    let is_lone = |l: &i64| *l == 7;
    let lone = [labels.iter().position(is_lone), labels.iter().rposition(is_lone)];
    lone.into_iter().flatten().for_each(|face| labels[face] = 12);
    let (patches, warnings) =
        with_warnings(|ctx| user_labels(ctx, &SegmentationParams::default(), &solid, &labels).unwrap());
    assert_eq!(patches.n_patches(), 5);
    let codes: Vec<&str> = warnings.iter().map(|w| w.code()).collect();
    assert_eq!(codes, ["label-split", "label-island"]);
    assert!(
        warnings[1].to_string().starts_with("2 islands") && warnings[1].at.is_some(),
        "{warnings:?}"
    );
}

#[test]
fn default_parameters_have_no_problems_and_all_problems_are_listed() {
    assert!(SegmentationParams::default().problems().is_empty());
    let bad = SegmentationParams {
        n_pieces: Some(1),
        smoothing_mm2: f64::NAN,
        ..Default::default()
    };
    assert_eq!(bad.problems().len(), 2);
}

fn by(method: Method, solid: &Solid) -> FaceLabels {
    let params = SegmentationParams {
        method,
        ..SegmentationParams::default()
    };
    with_ctx(|ctx| automatic_labels(ctx, &params, solid))
        .unwrap()
        .expect("it divides")
}

#[test]
fn people_s_methods_make_a_part_of_each_arm() {
    let solid = sphere_with_arms();
    let arm_of_face = arm_labels(&solid);
    for method in [Method::Auto, Method::RandomCuts, Method::Sdf] {
        let found = by(method, &solid);
        let mut parts = std::collections::BTreeSet::new();
        for arm in [-3, 100, 12, 13] {
            // The tip of the arm is its farthest face.
            let tip = (0..arm_of_face.len())
                .filter(|f| arm_of_face[*f] == arm)
                .max_by(|a, b| {
                    let far = |f: &usize| solid.mesh().face_center(*f).length();
                    far(a).total_cmp(&far(b))
                })
                .unwrap();
            parts.insert(found.as_slice()[tip]);
        }
        assert_eq!(parts.len(), 4, "{method:?}");
        assert!(found.n_patches() >= 5, "{method:?}: the body is a part, too");
    }
}

#[test]
fn a_ball_is_divided_by_every_method() {
    let ball = Solid::new(sphere(4, 60.0 * Vec3::ONE)).unwrap();
    for method in Method::ALL {
        let params = SegmentationParams {
            method,
            ..SegmentationParams::default()
        };
        let surface = with_ctx(|ctx| segment(ctx, &params, &ball, None)).unwrap();
        assert!(surface.n_patches >= 2, "{method:?}");
        assert_eq!(Method::by_name(method.name()), Some(method));
    }
}

#[test]
fn of_a_limbed_body_few_enough_pieces_come_and_none_holds_others_alone() {
    let solid = sphere_with_arms();
    let params = SegmentationParams {
        method: Method::Auto,
        ..SegmentationParams::default()
    };
    let surface = with_ctx(|ctx| segment(ctx, &params, &solid, None)).unwrap();
    let most = 1.6 * usual_n_pieces(solid.mesh().area()) as f64;
    assert!((surface.n_patches as f64) <= most, "{} pieces", surface.n_patches);
    let graph = surface.contact_graph_below(params.wall_mm, params.least_contact_mm);
    assert_eq!(graph.n_faults(), 0);
}

#[test]
fn as_many_pieces_come_as_are_asked_for_even_of_a_body_with_few_limbs() {
    let solid = sphere_with_arms();
    for asked in [12, 20] {
        let params = SegmentationParams {
            method: Method::Auto,
            n_pieces: Some(asked),
            ..SegmentationParams::default()
        };
        let surface = with_ctx(|ctx| segment(ctx, &params, &solid, None)).unwrap();
        let share = surface.n_patches as f64 / asked as f64;
        assert!((0.9..=1.3).contains(&share), "{} of {asked}", surface.n_patches);
        let graph = surface.contact_graph_below(params.wall_mm, params.least_contact_mm);
        assert_eq!(graph.n_faults(), 0);
    }
}

fn ball(center_mm: [f64; 3], radius_mm: f64) -> KeepWhole {
    KeepWhole::Sphere { center_mm, radius_mm }
}

/// Share of the area within a ball that lies in one piece.
fn share_in_one_piece(surface: &SegmentedSurface, center_mm: [f64; 3], radius_mm: f64) -> f64 {
    let mut area = vec![0.0; surface.n_patches];
    for (face, patch) in surface.patch_of_face.iter().enumerate() {
        if surface.mesh.face_center(face).distance(Vec3::from(center_mm)) <= radius_mm {
            area[usize::from(*patch)] += surface.mesh.face_area(face);
        }
    }
    area.iter().copied().fold(0.0, f64::max) / area.iter().sum::<f64>()
}

#[test]
fn what_is_kept_whole_ends_in_one_piece_by_every_method() {
    let solid = sphere_with_arms();
    // The end of an arm, a place on the body, and the root of an arm, where people would cut.
    for (at, radius_mm) in [
        ([-90.0, 0.0, 0.0], 25.0),
        ([0.0, 0.0, -30.0], 20.0),
        ([10.0, 32.0, 0.0], 14.0),
    ] {
        for method in Method::ALL {
            let params = SegmentationParams {
                method,
                keep_whole: vec![ball(at, radius_mm)],
                ..SegmentationParams::default()
            };
            let (surface, warnings) = with_warnings(|ctx| segment(ctx, &params, &solid, None).unwrap());
            let share = share_in_one_piece(&surface, at, radius_mm);
            assert!(share > 0.98, "{method:?} at {at:?}: {share}");
            assert!(
                warnings.iter().all(|w| w.code() != "keep-whole-cut"),
                "{method:?}"
            );
            assert!(surface.n_patches > 2, "{method:?}");
        }
    }
}

#[test]
fn no_division_parts_what_is_kept_whole() {
    let solid = sphere_with_arms();
    let own: Vec<u32> = (0..solid.mesh().triangles.len() as u32).collect();
    let labels =
        with_ctx(|ctx| user_labels(ctx, &SegmentationParams::default(), &solid, &arm_labels(&solid)))
            .unwrap();
    let params = SegmentationParams {
        keep_whole: vec![ball([0.0, 0.0, -30.0], 25.0), ball([90.0, 0.0, 0.0], 20.0)],
        ..SegmentationParams::default()
    };
    let ground = Ground::with_regions(&params, &solid, &own);
    assert_eq!(ground.whole.sets().len(), 2);
    for patch in 0..labels.n_patches() {
        let halves = split::split_between_regions(&ground, &labels, PatchId::from(patch)).unwrap();
        let is_one = |set: &Vec<u32>| {
            set.iter()
                .all(|&f| halves.patch(f as usize) == halves.patch(set[0] as usize))
        };
        assert!(ground.whole.sets().iter().all(is_one), "patch {patch}");
    }
}

#[test]
fn a_region_across_labels_is_of_the_one_that_has_most_of_it() {
    let solid = sphere_with_arms();
    let at = [44.0, 0.0, 0.0];
    let params = SegmentationParams {
        keep_whole: vec![ball(at, 14.0)],
        ..SegmentationParams::default()
    };
    let labels = arm_labels(&solid);
    let surface = with_ctx(|ctx| segment(ctx, &params, &solid, Some(&labels))).unwrap();
    assert!(share_in_one_piece(&surface, at, 14.0) > 0.98);
    let without = SegmentationParams::default();
    let surface = with_ctx(|ctx| segment(ctx, &without, &solid, Some(&labels))).unwrap();
    assert!(
        share_in_one_piece(&surface, at, 14.0) < 0.9,
        "it is no theorem of its own"
    );
}

#[test]
fn a_label_that_is_kept_whole_stays_one_piece() {
    let solid = sphere_with_arms();
    let labels = arm_labels(&solid);
    let params = SegmentationParams {
        keep_whole: vec![KeepWhole::Label(12)],
        ..SegmentationParams::default()
    };
    let surface = with_ctx(|ctx| segment(ctx, &params, &solid, Some(&labels))).unwrap();
    let mut area = vec![0.0; surface.n_patches];
    for (face, patch) in surface.patch_of_face.iter().enumerate() {
        if labels[surface.source_face[face] as usize] == 12 {
            area[usize::from(*patch)] += surface.mesh.face_area(face);
        }
    }
    assert!(area.iter().copied().fold(0.0, f64::max) > 0.95 * area.iter().sum::<f64>());
}

#[test]
fn regions_that_cannot_be_kept_whole_are_refused_in_words() {
    let solid = sphere_with_arms();
    let labels = arm_labels(&solid);
    let error = |region: KeepWhole, labels: Option<&[i64]>| {
        resolve_regions(&[region], &solid, labels)
            .unwrap_err()
            .to_string()
    };
    let outside = error(ball([500.0, 0.0, 0.0], 20.0), None);
    assert!(
        outside.contains("(500.0, 0.0, 0.0)") && outside.contains("reaches from"),
        "{outside}"
    );
    assert!(error(ball([0.0; 3], 200.0), None).contains("100 % of the surface"));
    assert!(error(KeepWhole::Label(4), Some(&labels)).contains("label 4 has nothing"));
    assert!(error(KeepWhole::Label(7), None).contains("no labels"));
    let bad = SegmentationParams {
        keep_whole: vec![ball([0.0; 3], -1.0)],
        ..SegmentationParams::default()
    };
    assert_eq!(bad.problems().len(), 1);
}

/// The arms are nearly symmetric about x = 0, and about the plane between y and z.
#[test]
fn a_symmetric_division_tells_its_plane_and_a_method_without_says_so() {
    let solid = sphere_with_arms();
    let notes = |method: Method| {
        let params = SegmentationParams {
            method,
            symmetric: true,
            ..SegmentationParams::default()
        };
        let told = std::sync::Mutex::new(Vec::new());
        let report = |p: shellock_report::Progress<'_>| {
            if let shellock_report::Progress::Note(text) = p {
                told.lock().unwrap().push(text.to_owned());
            }
        };
        let stop = std::sync::atomic::AtomicBool::new(false);
        segment(&Ctx::new(&report, &stop), &params, &solid, None).unwrap();
        told.into_inner().unwrap().join("\n")
    };
    for method in [Method::Auto, Method::RandomCuts] {
        assert!(
            notes(method).contains("symmetric about the plane through"),
            "{method:?}"
        );
    }
    let other = notes(Method::Creases);
    assert!(other.contains("creases knows no symmetry"), "{other}");
    assert!(symmetry_plane(&SegmentationParams::default(), &solid).is_some());
}

#[test]
fn pieces_of_a_symmetric_division_are_more_of_them_each_others_images() {
    let solid = sphere_with_arms();
    let share = |symmetric: bool| {
        let params = SegmentationParams {
            method: Method::Auto,
            symmetric,
            ..SegmentationParams::default()
        };
        let surface = with_ctx(|ctx| segment(ctx, &params, &solid, None)).unwrap();
        let asked = figures::FigureParams {
            mirror: symmetry_plane(&params, &solid),
            ..Default::default()
        };
        let found = figures::figures(&asked, &surface);
        assert_eq!(found.contacts.n_faults, 0);
        found.mirrored_share.expect("there is a plane")
    };
    let (without, with) = (share(false), share(true));
    assert!(with > 0.85 && with > without + 0.05, "{without} {with}");
}

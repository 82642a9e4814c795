//! Keys and the effect of cutting them, on made-up surfaces.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use shellock_assembly::LatticeDirection;
use shellock_geom::{Topology, TriMesh, Vec3};
use shellock_report::Ctx;
use shellock_surface::SegmentedSurface;
use shellock_test_surfaces::{label, sphere, voronoi};

use super::*;

/// A ball of 50 mm with a flat foot 30 mm below its middle, in eight pieces.
fn footed_ball() -> SegmentedSurface {
    let mut ball = voronoi(sphere(6, Vec3::splat(50.0)), 8, 1);
    ball.mesh.points.iter_mut().for_each(|p| p.z = p.z.max(-30.0));
    ball
}

fn params_of(surface: &SegmentedSurface) -> KeyParams {
    KeyParams {
        piece_mm2: surface.mesh.area() / surface.n_patches as f64,
        ..KeyParams::default()
    }
}

fn sites_of(surface: &SegmentedSurface) -> Vec<KeySite> {
    sites(&Ctx::quiet(), &params_of(surface), surface).unwrap()
}

fn random_unit(rng: &mut ChaCha8Rng) -> Vec3 {
    Vec3::new(
        rng.random::<f64>() - 0.5,
        rng.random::<f64>() - 0.5,
        rng.random::<f64>() - 0.5,
    )
    .normalize()
}

fn random_prism(rng: &mut ChaCha8Rng) -> KeyPrism {
    let normal = random_unit(rng);
    let slide = random_unit(rng).reject_from_normalized(normal).normalize();
    KeyPrism {
        origin: Vec3::ZERO,
        slide,
        normal,
        half_width_mm: 10.0,
        depth_mm: 8.0,
        corner_mm: 2.0,
    }
}

#[test]
fn what_lies_in_a_prism_leaves_along_its_slide_and_meets_nothing_outside_it() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut n_inside = 0;
    for _ in 0..2000 {
        let prism = random_prism(&mut rng);
        let p = 30.0 * random_unit(&mut rng) * rng.random::<f64>();
        let travel = 40.0 * rng.random::<f64>();
        let (before, after) = (prism.inside_mm(p), prism.inside_mm(p + travel * prism.slide));
        assert!(after >= before - 1e-9, "{before} {after}");
        n_inside += usize::from(prism.contains(p));
    }
    assert!(n_inside > 200);
}

#[test]
fn laying_turns_as_little_as_it_can_and_not_at_all_where_all_fits() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for _ in 0..200 {
        let prism = random_prism(&mut rng);
        let (turn, along) = Turn::align(prism.normal, prism.slide);
        assert!(turn.apply(prism.slide).distance(along.unit()) < 1e-12);
        let axis = turn.apply(prism.normal);
        assert!(axis.abs().max_element() > 1.0 - 1e-12 && axis.dot(along.unit()).abs() < 1e-12);
        let p = 100.0 * random_unit(&mut rng);
        assert!(turn.inverse().apply(turn.apply(p)).distance(p) < 1e-10);
        // The turn goes at most from a cube's face to its corner, and half of 45° within the face.
        assert!(turn.angle() < 1.2, "{}", turn.angle());
    }
    for s in LatticeDirection::all().filter(|s| s.step()[2] == 0) {
        let (turn, along) = Turn::align(-Vec3::Z, s.unit());
        assert!(turn.is_none() && along == s);
    }
}

#[test]
fn the_best_key_of_a_ball_with_a_foot_is_in_the_foot_and_slides_level() {
    let found = sites_of(&footed_ball());
    assert!(!found.is_empty());
    let best = found[0];
    assert!(best.prism.normal.dot(-Vec3::Z) > 0.999 && best.prism.slide.z.abs() < 1e-9);
    assert!(best.side_share > 0.7, "{best:?}");
    // Of all directions round the foot it takes one for which the ball need not be turned.
    assert!(Turn::align(best.prism.normal, best.prism.slide).0.is_none());
    assert!(found.windows(2).all(|w| w[0].score >= w[1].score));
}

#[test]
fn a_key_that_is_wanted_somewhere_is_cut_there_and_not_where_one_would_be_best() {
    let ball = footed_ball();
    let edge_mm = params_of(&ball).piece_mm2.sqrt();
    for place in [
        Vec3::new(0.0, 0.0, 50.0),
        Vec3::new(0.0, -50.0, 0.0),
        Vec3::new(35.4, 0.0, 35.4),
    ] {
        let params = KeyParams {
            near: Some(place.to_array()),
            ..params_of(&ball)
        };
        let found = sites(&Ctx::quiet(), &params, &ball).unwrap();
        let best = found.first().expect("a ball has a place everywhere");
        let off_mm = best.prism.middle().distance(place);
        assert!(off_mm < 0.5 * edge_mm, "{off_mm} mm from {place}");
        assert!(
            found
                .iter()
                .all(|site| site.prism.middle().distance(place) < edge_mm)
        );
    }
}

#[test]
fn a_plain_ball_and_an_egg_have_a_place_for_a_key_too_and_a_thin_plate_has_none() {
    for radii in [Vec3::splat(50.0), Vec3::new(45.0, 45.0, 70.0)] {
        let found = sites_of(&voronoi(sphere(6, radii), 9, 1));
        assert!(!found.is_empty(), "{radii}");
    }
    let plate = voronoi(sphere(6, Vec3::new(60.0, 60.0, 3.0)), 6, 1);
    assert_eq!(sites_of(&plate), []);
}

/// Area of each patch, mm².
fn areas(surface: &SegmentedSurface) -> Vec<f64> {
    surface.areas().as_slice().to_vec()
}

#[test]
fn the_imprint_takes_what_the_prism_holds_and_nothing_else() {
    let ball = footed_ball();
    let site = sites_of(&ball)[0];
    let (surface, key) = imprint(&ball, &site.prism).unwrap();
    assert!(Topology::of_mesh(&surface.mesh).is_some());
    assert!((surface.mesh.area() - ball.mesh.area()).abs() < 1e-6 * ball.mesh.area());
    let of_key = areas(&surface)[usize::from(key)];
    assert!(
        (of_key - site.area_mm2).abs() < 0.03 * site.area_mm2,
        "{of_key} {}",
        site.area_mm2
    );
    for (face, &p) in surface.patch_of_face.iter().enumerate() {
        let inside = site.prism.inside_mm(surface.mesh.face_center(face));
        assert!(inside.abs() < 0.2 || (inside > 0.0) == (p == key), "{inside}");
    }
    assert_eq!(patch_in(&surface, &site.prism), Some(key));
    assert!(
        surface
            .source_face
            .iter()
            .all(|&f| (f as usize) < ball.mesh.triangles.len())
    );
}

#[test]
fn the_sides_of_an_imprinted_key_are_straight() {
    let ball = footed_ball();
    let site = sites_of(&ball)[0];
    let (surface, key) = imprint(&ball, &site.prism).unwrap();
    let mut n_beside = 0;
    for seam in surface.seams().iter().filter(|s| s.a == key || s.b == key) {
        for p in &seam.points {
            let [along, across, below] = site.prism.coordinates(*p);
            if along > 4.0 && below < 2.0 {
                n_beside += 1;
                assert!(
                    (across.abs() - site.prism.half_width_at(along)).abs() < 0.1,
                    "{across} at {along}"
                );
            }
        }
    }
    assert!(n_beside > 20);
}

#[test]
fn every_patch_is_connected_after_a_key_cut_one_in_two_and_crumbs_joined_their_neighbours() {
    // Stripes, some of which the key cuts in two.
    let mut mesh: TriMesh = sphere(6, Vec3::splat(50.0));
    mesh.points.iter_mut().for_each(|p| p.z = p.z.max(-30.0));
    let stripes = label(mesh, 6, |p| (((p.y + 50.0) / 16.7) as u32).min(5));
    let prism = KeyPrism {
        origin: Vec3::new(10.0, 0.0, -30.0),
        slide: Vec3::X,
        normal: -Vec3::Z,
        half_width_mm: 14.0,
        depth_mm: 8.0,
        corner_mm: 2.0,
    };
    let (surface, _) = imprint(&stripes, &prism).unwrap();
    let topology = Topology::of_mesh(&surface.mesh).unwrap();
    let patch = |f: u32| surface.patch_of_face[f as usize];
    let (_, n) = shellock_geom::topology::components(&topology, |f, g| patch(f) == patch(g));
    assert_eq!(n, surface.n_patches);
    let least = areas(&surface).into_iter().fold(f64::INFINITY, f64::min);
    assert!(least > 0.05 * surface.mesh.area() / 6.0, "{least}");
}

#[test]
fn no_key_is_cut_from_what_is_kept_whole() {
    let surface = footed_ball();
    let best = sites_of(&surface)[0];
    let at = best.prism.origin + 0.5 * best.prism.length_mm() * best.prism.slide;
    let params = KeyParams {
        keep_whole: vec![KeepWhole::Sphere {
            center_mm: at.to_array(),
            radius_mm: 8.0,
        }],
        ..params_of(&surface)
    };
    let others = sites(&Ctx::quiet(), &params, &surface).unwrap();
    assert!(!others.is_empty(), "there is room elsewhere");
    for face in 0..surface.mesh.triangles.len() {
        let center = surface.mesh.face_center(face);
        if center.distance(at) < 8.0 {
            assert!(others.iter().all(|site| !site.prism.contains(center)));
        }
    }
}

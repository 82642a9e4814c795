//! Properties of finished pieces, for an egg in eight pieces.

#[expect(dead_code, reason = "benches read more of it")]
#[path = "../benches/made/mod.rs"]
mod made;

use std::sync::LazyLock;

use made::Made;
use shellock::connector;
use shellock::plan::interface::contacts;
use shellock::seam::rules::SHORTEST_RUN_SIZES;
use shellock::segmentation::{SegmentationParams, segment};
use shellock::{Ctx, PatchId};
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::signed_distance::SignedDistance;
use shellock_geom::{Solid, TriMesh, Vec3};
use shellock_testkit::shapes::sphere;

fn egg() -> &'static Solid {
    static EGG: LazyLock<Solid> =
        LazyLock::new(|| Solid::new(sphere(4, Vec3::new(18.0, 16.5, 15.0))).unwrap());
    &EGG
}

/// Pieces made of the egg's eight octants.
fn kit() -> &'static Made {
    static KIT: LazyLock<Made> = LazyLock::new(|| {
        let octant = |f: usize| {
            let p = egg().mesh().face_center(f);
            i64::from(p.x > 0.0) + 2 * i64::from(p.y > 0.0) + 4 * i64::from(p.z > 0.0)
        };
        let labels: Vec<i64> = (0..egg().mesh().triangles.len()).map(octant).collect();
        let params = SegmentationParams::default();
        let surface = segment(&Ctx::quiet(), &params, egg(), Some(&labels)).unwrap();
        Made::new(egg(), surface)
    });
    &KIT
}

/// Greatest distance of a triangle's centre from the model's surface for it to count as skin, mm. The
/// rounding of 32-bit coordinates is smaller.
const SKIN_MM: f64 = 1e-4;

/// Greatest reach of a piece's skin over the border of its patch, in cells of the grid.
const CELLS_ACROSS: f64 = 2.0;

#[test]
fn no_point_of_a_piece_is_outside_of_the_model() {
    let distance = SignedDistance::new(egg());
    for (p, mesh) in kit().pieces.meshes.iter() {
        for &point in &mesh.points {
            let depth_mm = distance.at(point, 10.0).map_or(10.0, |d| d.signed_mm);
            assert!(depth_mm > -SKIN_MM, "piece {p} at {point}: {depth_mm} mm");
        }
    }
}

#[test]
fn every_outer_triangle_lies_on_its_own_patch_of_the_model_and_together_they_are_all_of_it() {
    let (kit, surface) = (kit(), &kit().surface);
    let model = TriangleBvh::new(&surface.mesh);
    let across_mm = CELLS_ACROSS * kit.settings.body.cell_mm();
    let mut skin_mm2 = vec![0.0; surface.n_patches];
    for (p, mesh) in kit.pieces.meshes.iter() {
        let own: Vec<usize> = (0..surface.patch_of_face.len())
            .filter(|&f| surface.patch_of_face[f] == p)
            .collect();
        let own = TriMesh {
            points: surface.mesh.points.clone(),
            triangles: own.iter().map(|&f| surface.mesh.triangles[f]).collect(),
        };
        let own = TriangleBvh::new(&own);
        for f in 0..mesh.triangles.len() {
            let center = mesh.face_center(f);
            let Some(near) = model.nearest(center, SKIN_MM * SKIN_MM) else {
                continue;
            };
            let normal = surface.mesh.face_normal(near.face as usize);
            if mesh.face_normal(f).dot(normal) < 0.99 {
                continue;
            }
            for corner in mesh.corners(f) {
                assert!(
                    model.nearest(corner, SKIN_MM * SKIN_MM).is_some(),
                    "piece {p} leaves the surface at {corner}"
                );
                assert!(
                    own.nearest(corner, across_mm * across_mm).is_some(),
                    "piece {p} has skin of another at {corner}"
                );
            }
            skin_mm2[usize::from(p)] += mesh.face_area(f);
        }
    }
    let areas = surface.areas();
    for (p, &mm2) in skin_mm2.iter().enumerate() {
        let whole = areas[PatchId::from(p)];
        assert!((mm2 / whole - 1.0).abs() < 0.1, "piece {p}: {mm2} of {whole} mm²");
    }
    let (all, whole) = (skin_mm2.iter().sum::<f64>(), egg().mesh().area());
    assert!(
        all < whole * (1.0 + 1e-6) && all > 0.98 * whole,
        "{all} of {whole} mm²"
    );
}

/// Greatest shortfall of a seam's usable length compared with its plan, as a share and in mm. At points where
/// three seams meet, the inner edge starts elsewhere than the outer one.
const SHORTER_SHARE: f64 = 0.15;
const SHORTER_MM: f64 = 2.0;

#[test]
fn a_plan_expects_no_longer_runs_than_angles_ends_and_turns_allow() {
    let kit = kit();
    let found = contacts(&kit.settings.plan, &kit.surface, &kit.surface.seams(), &kit.sizes);
    assert!(found.len() >= 12, "octants meet along twelve seams");
    let inner = kit.shell.inner.as_ref().unwrap();
    let curves = connector::curves(&kit.grid, inner, &kit.lattice_plan);
    let in_free_space = |_, _| Some(true);
    let (params, plan) = (&kit.settings.connector, &kit.lattice_plan);
    let (_, rooms) = connector::runs(params, &kit.sizes, plan, &curves, None, &in_free_space);
    for contact in &found {
        let pair = [contact.a, contact.b];
        let later = pair.into_iter().max_by_key(|&p| plan.position(p)).unwrap();
        let expected_mm = contact.joint(later, plan.separation(later)).run_mm;
        let usable_mm: f64 = rooms
            .iter()
            .filter(|room| pair.contains(&room.later) && pair.contains(&room.earlier))
            .map(|room| room.usable_mm)
            .sum();
        let shortest_mm = SHORTEST_RUN_SIZES * contact.size_mm;
        assert!(
            (1.0 - SHORTER_SHARE) * expected_mm < usable_mm + SHORTER_MM || expected_mm < shortest_mm,
            "{pair:?}: {expected_mm} mm expected, {usable_mm} mm usable"
        );
    }
}

use shellock_assembly::LatticeDirection;
use shellock_geom::{Aabb, Solid, Vec3, Volume};
use shellock_plan::{LatticePlan, LatticeStep};
use shellock_report::{Ctx, IdVec, PatchId};
use shellock_surface::SegmentedSurface;
use shellock_test_surfaces::{label, sphere};

use super::*;

const RADIUS_MM: f64 = 16.0;

/// Eight octants of a ball, the one at (−, −, −) first; each is to leave outwards.
fn octants() -> (SegmentedSurface, LatticePlan) {
    let octant = |p: Vec3| u32::from(p.x > 0.0) + 2 * u32::from(p.y > 0.0) + 4 * u32::from(p.z > 0.0);
    let steps = (0..8u32).map(|i| {
        let outwards = Vec3::from_array([i & 1, i >> 1 & 1, i >> 2].map(|bit| 2.0 * f64::from(bit) - 1.0));
        LatticeStep {
            piece: (i as usize).into(),
            separation: LatticeDirection::nearest(outwards),
        }
    });
    (
        label(sphere(5, Vec3::splat(RADIUS_MM)), 8, octant),
        LatticePlan {
            steps: steps.collect(),
        },
    )
}

fn make_bodies(
    params: &BodyParams,
    surface: &SegmentedSurface,
    plan: &LatticePlan,
) -> (ShellGrid, Result<ShellBodies, BodyError>) {
    let model = Solid::new(surface.mesh.clone()).unwrap();
    let ctx = Ctx::quiet();
    let grid = ShellGrid::new(params, &model, 4.0).unwrap();
    let distances = PatchDistances::measure(&grid, surface);
    let everywhere = Aabb {
        min: Vec3::splat(-50.0),
        max: Vec3::splat(50.0),
    };
    let rooms = IdVec::from_fn(surface.n_patches, |_| everywhere);
    let bodies = build(&ctx, params, &grid, &distances, plan, &rooms);
    (grid, bodies)
}

/// Asserts that every piece leaves what was installed before it, along its direction, with less than
/// `most_mm3` of overlap.
fn assert_leave_freely(bodies: &IdVec<PatchId, Volume>, plan: &LatticePlan, most_mm3: f64) {
    for (at, step) in plan.steps.iter().enumerate().skip(1) {
        for travel_mm in [0.0, 0.3, 1.0, 3.0, 8.0] {
            let moved = bodies[step.piece].translate(travel_mm * step.separation.unit());
            let overlap: f64 = plan.steps[..at]
                .iter()
                .map(|s| moved.intersect(&bodies[s.piece]).volume())
                .sum();
            assert!(
                overlap < most_mm3,
                "piece {} after {travel_mm} mm: {overlap} mm³",
                step.piece
            );
        }
    }
}

#[test]
fn bodies_part_the_wall_and_leave_freely() {
    let (surface, plan) = octants();
    let (grid, built) = make_bodies(&BodyParams::default(), &surface, &plan);
    let bodies = built.unwrap().bodies;
    let total: f64 = bodies.as_slice().iter().map(Volume::volume).sum();
    // Twelve seams of a quarter circle with two gaps each, 0.05 mm wide over 2 mm. Pieces keep out of each
    // other's ways where three seams meet, so that more is lost there.
    let gaps = 12.0 * 0.5 * std::f64::consts::PI * (RADIUS_MM - 1.0) * 0.1 * 2.0;
    let lost = grid.wall.volume() - total;
    assert!(
        lost > 0.9 * gaps && lost < 1.5 * gaps,
        "{lost} mm³ of gaps, {gaps} expected"
    );
    assert!(bodies.as_slice().iter().all(|b| b.components().len() == 1));
    assert_leave_freely(&bodies, &plan, 0.05);
}

#[test]
fn cut_faces_stand_straight_under_their_seams_at_the_gap_from_them() {
    let (surface, plan) = octants();
    let (_, built) = make_bodies(&BodyParams::default(), &surface, &plan);
    let bodies = built.unwrap().bodies;
    let (mut n_points, mut worst) = (0, 0.0f64);
    for body in bodies.as_slice() {
        for p in body.to_mesh().points {
            // Points between the two sides of the wall, not near the inner one, where the fields of both
            // meet. They are away from triple points: only one coordinate is small.
            let mut off = p.abs().to_array();
            off.sort_unstable_by(f64::total_cmp);
            if off[0] < 0.5 && off[1] > 3.0 && (p.length() - RADIUS_MM + 0.85).abs() < 0.75 {
                n_points += 1;
                worst = worst.max((off[0] - 0.05).abs());
            }
        }
    }
    assert!(
        n_points > 100 && worst < 0.04,
        "{n_points} points, {worst} mm off"
    );
}

/// Gives a patch an island around a point of another octant, too small to be more than a fragment.
fn add_island(surface: &mut SegmentedSurface, patch: PatchId, around: Vec3) {
    let island = around.normalize();
    let is_island = |f: usize| surface.mesh.face_center(f).normalize().dot(island) > 0.97;
    let faces: Vec<usize> = (0..surface.mesh.triangles.len())
        .filter(|&f| is_island(f))
        .collect();
    faces.iter().for_each(|&f| surface.patch_of_face[f] = patch);
    assert!(faces.len() > 20);
}

#[test]
fn a_fragment_goes_to_what_surrounds_it_and_the_piece_keeps_out_of_its_way() {
    let (mut surface, plan) = octants();
    // The island lies in the first-installed octant.
    add_island(&mut surface, plan.key(), Vec3::splat(-1.0));
    let (_, built) = make_bodies(&BodyParams::default(), &surface, &plan);
    let bodies = built.unwrap().bodies;
    assert!(bodies.as_slice().iter().all(|b| b.components().len() == 1));
    // The octant around the island got it: the first octant is as large as the others, except for what
    // carving shifts.
    assert!(bodies[plan.steps[0].piece].volume() > 0.8 * bodies[plan.steps[3].piece].volume());
    assert_leave_freely(&bodies, &plan, 0.05);
}

#[test]
fn a_cut_along_the_way_out_takes_one_draft_although_fragments_change_sides() {
    const GAP_AND_DRAFT_MM: f64 = 0.05 + 0.12;
    let (mut surface, mut plan) = octants();
    add_island(&mut surface, plan.steps[0].piece, Vec3::new(2.0, 1.0, 1.0));
    let key = plan.steps.len() - 1;
    plan.steps[key].separation = LatticeDirection::nearest(Vec3::X);
    let (grid, built) = make_bodies(&BodyParams::default(), &surface, &plan);
    // A layer of 1 mm on the rim, where other pieces lie ahead for some millimetres.
    let layer = Volume::cuboid(Aabb {
        min: Vec3::new(1.0, 3.0, 0.0),
        max: Vec3::new(5.0, 20.0, 1.0),
    });
    let [of_body, of_wall] =
        [&built.unwrap().bodies[plan.key()], &grid.wall].map(|solid| solid.intersect(&layer).volume());
    let off_mm = 1.0 - of_body / of_wall;
    assert!(off_mm > 0.05 && off_mm < GAP_AND_DRAFT_MM + 0.03, "{off_mm} mm");
}

#[test]
fn a_piece_that_would_leave_through_the_others_is_told() {
    let (surface, mut plan) = octants();
    let key = plan.steps.len() - 1;
    plan.steps[key].separation = plan.steps[key].separation.opposite();
    let (_, built) = make_bodies(&BodyParams::default(), &surface, &plan);
    let Err(BodyError::Blocked {
        piece,
        free_share: kept,
        ..
    }) = built
    else {
        panic!("it was built")
    };
    assert_eq!(piece, plan.key());
    assert!(kept < 0.5);
}

#[test]
fn a_wall_as_thick_as_the_model_has_no_cavity() {
    let model = Solid::new(sphere(3, Vec3::splat(3.0))).unwrap();
    let params = BodyParams {
        thickness_mm: 4.0,
        ..BodyParams::default()
    };
    assert!(matches!(
        ShellGrid::new(&params, &model, 4.0),
        Err(GridError::NoCavity { .. })
    ));
}

#[test]
fn a_crack_thinner_than_a_cell_parts_the_nodes_on_its_sides() {
    // Two thick plates that a web holds together at one end, 0.05 mm apart.
    let plate = |z: [f64; 2], x: [f64; 2]| {
        Volume::cuboid(Aabb {
            min: Vec3::new(x[0], -10.0, z[0]),
            max: Vec3::new(x[1], 10.0, z[1]),
        })
    };
    let parts = vec![
        plate([0.0, 12.0], [0.0, 30.0]),
        plate([12.05, 24.0], [0.0, 30.0]),
        plate([0.0, 24.0], [-6.0, 0.0]),
    ];
    let model = Solid::new(Volume::union_all(parts).to_mesh()).unwrap();
    let grid = ShellGrid::new(&BodyParams::default(), &model, 4.0).unwrap();
    let band = &grid.band;
    let (mut n_cut, mut n_across) = (0, 0);
    for n in 0..band.len() as u32 {
        let is_inside = |m: u32| grid.depth[m as usize] > 0.0;
        let at = band.position(n as usize);
        for m in band.face_neighbours(n).filter(|&m| is_inside(n) && is_inside(m)) {
            let other = band.position(m as usize);
            let is_across = (at.z < 12.02) != (other.z < 12.02) && at.x > 0.0;
            n_across += usize::from(is_across);
            let is_cut = grid.joined_neighbours(n).all(|joined| joined != m);
            n_cut += usize::from(is_cut);
            assert_eq!(is_cut, is_across, "{at} {other}");
        }
    }
    assert!(n_across > 1000 && n_cut == n_across);
}

#[test]
fn what_came_off_a_body_with_skin_goes_to_the_body_beside_it() {
    let (surface, plan) = octants();
    let params = BodyParams::default();
    let (grid, built) = make_bodies(&params, &surface, &plan);
    let mut parts: Vec<(PatchId, Volume)> = Vec::new();
    for (i, body) in built.unwrap().bodies.as_slice().iter().enumerate() {
        parts.push((i.into(), body.clone()));
    }
    // A block of the first octant's rim, of which a smaller one is left before the neighbour.
    let block = |x: f64, y: [f64; 2]| {
        Volume::cuboid(Aabb {
            min: Vec3::new(x, y[0], -20.0),
            max: Vec3::new(0.0, y[1], 0.0),
        })
    };
    let gone = block(-1.3, [-9.6, -3.4]);
    let chip = parts[0].1.intersect(&block(-0.7, [-9.0, -4.0]));
    assert!(chip.volume() > 2.0, "{} mm³", chip.volume());
    parts[0].1 = Volume::union_all(vec![parts[0].1.subtract(&gone), chip.clone()]);
    assert_eq!(parts[0].1.components().len(), 2);
    let neighbour_mm3 = parts[1].1.volume();
    let ctx = Ctx::quiet();
    let whole = super::chips::whole_bodies(&ctx, &grid, 2.0 * params.seam_gap_mm, parts);
    let told = ctx.into_warnings();
    assert!(chip.volume() > 5.0 && told.len() == 1 && told[0].code() == "part-given");
    assert_eq!(told[0].pieces, [0.into(), 1.into()]);
    assert!(whole.iter().all(|(_, body)| body.components().len() == 1));
    assert!(whole[1].1.volume() > neighbour_mm3 + chip.volume());
    assert!(whole[0].1.intersect(&whole[1].1).volume() < 1e-6);
}

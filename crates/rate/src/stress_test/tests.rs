use shellock_assembly::LatticeDirection;
use shellock_geom::{Aabb, Volume};
use shellock_plan::LatticeStep;
use shellock_test_surfaces::{octants, sphere};

use super::*;
use crate::handling::region::{around, lowest, spread};

/// A plan in which every octant leaves outwards.
fn outwards() -> LatticePlan {
    let direction =
        |i: u32| Vec3::from_array([i & 1, i >> 1 & 1, i >> 2].map(|bit| 2.0 * f64::from(bit) - 1.0));
    let step = |i: u32| LatticeStep {
        piece: PatchId(i),
        separation: LatticeDirection::nearest(direction(i)),
    };
    LatticePlan {
        steps: (0..8).map(step).collect(),
    }
}

fn as_it_lies(plan: &LatticePlan) -> InstallationPlan {
    InstallationPlan::new(plan.steps.iter().map(|s| (s.piece, s.separation.into())))
}

/// Parameters of a coarse mesh: the results tested here hold on any.
fn coarse() -> StressParams {
    StressParams {
        metric: MetricParams {
            edge_share: 2.5,
            ..MetricParams::default()
        },
        ..StressParams::default()
    }
}

#[test]
fn forces_are_spread_over_what_they_hit_and_add_up() {
    let model = PlanModel::new(&coarse().metric, &octants(), &ConnectorSizes::default());
    let a = &model.assembly;
    let height = |p: &u32| a.points[*p as usize].z;
    let top = highest(a, Vec3::Z).unwrap();
    let (hit, foot) = (around(a, Vec3::Z, top, PUNCH_RADIUS_MM), lowest(a, Vec3::Z));
    assert!(!hit.is_empty() && hit.iter().all(|p| height(p) > 30.0));
    assert!(foot.len() >= 3 && foot.iter().all(|p| height(p) < 0.0));
    // A ball's top is in its middle.
    assert_eq!(highest_in_the_middle(a, Vec3::Z, PUNCH_RADIUS_MM), Some(top));
    let forces_n = spread(a, &hit, -70.0 * Vec3::Z);
    assert!((forces_n.iter().sum::<Vec3>() + 70.0 * Vec3::Z).length() < 1e-9);
    assert!(
        (0..)
            .zip(&forces_n)
            .all(|(i, f)| hit.contains(&i) || *f == Vec3::ZERO)
    );
}

/// The octants of a hollow ball, each half a gap back from its neighbours.
fn finished_octants(gap_mm: f64) -> Vec<Solid> {
    let ball = |radius_mm: f64| Volume::from_closed_mesh(&sphere(4, Vec3::splat(radius_mm))).unwrap();
    let wall = ball(40.0).subtract(&ball(38.0));
    let octant = |i: u32| {
        let side = |bit: u32| {
            let (near, far) = (0.5 * gap_mm, 50.0);
            if i >> bit & 1 == 1 {
                (near, far)
            } else {
                (-far, -near)
            }
        };
        let of = [0, 1, 2].map(side);
        let cutter = Volume::cuboid(Aabb {
            min: of.map(|s| s.0).into(),
            max: of.map(|s| s.1).into(),
        });
        Solid::new(wall.intersect(&cutter).to_mesh()).unwrap()
    };
    (0..8).map(octant).collect()
}

/// A ball cut into octants without connectors is held by nothing but its shape, so it comes apart. The report
/// is of the printed pieces, of which there must be one for each patch.
#[test]
fn what_is_tested_is_what_is_printed() {
    let ctx = Ctx::quiet();
    let test = |pieces: &[Solid]| {
        let params = StressParams {
            cell_mm: 5.0,
            ..coarse()
        };
        stress_test(&ctx, &params, &octants(), &as_it_lies(&outwards()), pieces, None)
    };
    let tested = test(&finished_octants(0.2)).unwrap();
    // Walls of 2 mm around a ball of 40 mm, of 1.15 g/cm³.
    let shell_g = 4.0 / 3.0 * std::f64::consts::PI * (40.0_f64.powi(3) - 38.0_f64.powi(3)) * 1.15e-3;
    assert!((tested.mass_g / shell_g - 1.0).abs() < 0.03, "{}", tested.mass_g);
    assert_eq!(tested.printed.len(), FRICTION.len());
    // Octants without connectors fall apart.
    assert!(!tested.has_passed() && tested.compared.is_none());
    assert!(
        tested
            .printed
            .iter()
            .all(|p| p.drop.verdict == StressVerdict::ComesApart)
    );
    let refused = test(&finished_octants(0.2)[1..]);
    assert_eq!(
        refused,
        Err(StressError::Pieces {
            pieces: 7,
            patches: 8
        })
    );
}

#[test]
fn the_directions_of_a_turned_model_are_those_of_the_lattice_again() {
    let turn = Turn::align(Vec3::new(0.48, 0.6, 0.64), Vec3::new(0.8, 0.0, -0.6)).0;
    let params = StressParams { turn, ..coarse() };
    let ways = outwards().steps.into_iter().map(|s| {
        let way = turn.inverse().apply(s.separation.unit());
        (s.piece, shellock_assembly::Direction::of(way).unwrap())
    });
    let subject = TestSubject::new(&params, &octants(), &InstallationPlan::new(ways)).unwrap();
    assert_eq!(subject.plan.steps[1..], outwards().steps[1..]);
    let up = subject.params.plan.up;
    assert!(turn.inverse().apply(Vec3::from(up)).distance(Vec3::Z) < 1e-12);
}

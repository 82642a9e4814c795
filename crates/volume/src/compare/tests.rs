use shellock_assembly::LatticeDirection;
use shellock_plan::LatticeStep;
use shellock_rate::stress_test::{FRICTION, Printed, StressReport, chart};
use shellock_report::PatchId;
use shellock_test_surfaces::octants;

use super::*;

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
fn half_connectors_fare_worse_than_whole_ones_and_the_chart_says_so() {
    let compared = compare(&Ctx::quiet(), &coarse(), &octants(), &as_it_lies(&outwards())).unwrap();
    let (kit, half) = (&compared.kit, &compared.half_connectors);
    for (whole, half) in [(&kit.punch, &half.punch), (&kit.drop, &half.drop)] {
        assert!(half.opening_mm > whole.opening_mm, "{half:?} {whole:?}");
        assert!(half.connector_mpa > whole.connector_mpa && half.verdict >= whole.verdict);
    }
    let printed = FRICTION.map(|friction| Printed {
        friction,
        punch: kit.punch.clone(),
        drop: kit.drop.clone(),
    });
    let report = StressReport {
        printed: printed.to_vec(),
        compared: Some(compared.clone()),
        mass_g: 1.0,
        strength_mpa: 42.0,
    };
    let n_rows = FRICTION.len() + compared.designs().len();
    let drawing = chart(&report);
    assert_eq!(drawing.matches("<rect").count(), 1 + 4 * n_rows);
    assert_eq!(drawing.matches("<line").count(), 4 * n_rows);
    assert!(drawing.ends_with("</svg>\n"));
}

#[test]
fn a_stronger_material_bears_what_a_weaker_one_does_not() {
    // A touch so light opens nothing; the verdict depends on the material alone.
    let with_strength = |strength_mpa: f64| {
        let mut params = StressParams {
            punch_n: 1.0,
            ..coarse()
        };
        params.metric.material.strength_mpa = strength_mpa;
        let model = PlanModel::new(&params.metric, &octants(), &params.sizes);
        let bench = Bench::new(&params, &model).unwrap();
        bench.test(&model.meetings(&outwards()), None).unwrap().punch
    };
    let measured = with_strength(42.0);
    assert_eq!(measured.verdict, StressVerdict::Holds);
    let mpa = measured.wall_mpa.max(measured.connector_mpa);
    assert_eq!(with_strength(0.9 * mpa).verdict, StressVerdict::Yields);
    assert_eq!(with_strength(1.1 * mpa).verdict, StressVerdict::Holds);
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let ctx = Ctx::quiet();
    let mut plan = outwards();
    plan.steps.pop();
    let refused = compare(&ctx, &coarse(), &octants(), &as_it_lies(&plan));
    assert_eq!(
        refused,
        Err(CompareError::Test(StressError::Plan { steps: 7, patches: 8 }))
    );
    let mut astray = as_it_lies(&outwards());
    astray.steps[3].separation = shellock_assembly::Direction::of(Vec3::new(1.0, 0.2, 0.0)).unwrap();
    let refused = compare(&ctx, &coarse(), &octants(), &astray);
    assert_eq!(
        refused,
        Err(CompareError::Test(StressError::Direction(PatchId(3))))
    );
    let params = StressParams {
        punch_n: f64::NAN,
        drop_mm: -1.0,
        cell_mm: 0.0,
        ..coarse()
    };
    assert_eq!(params.problems().len(), 3);
}

#[test]
fn parts_that_come_apart_bear_nothing() {
    assert_eq!(borne_by_solids(&[], None, 42.0).factor, 0.0);
}

//! Tests the search against brute force, on made-up and on real surfaces.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use shellock_assembly::LatticeDirection;
use shellock_geom::Vec3;
use shellock_report::{Ctx, IdVec, PatchId};
use shellock_test_surfaces::{label, seams, sphere, voronoi};

use super::exact::{Budget, Candidate, lower_bound, prove};
use super::interface::{BlockingTable, Interface, Joint};
use super::key::{Flatness, KeyChoice, choices};
use super::local_cost::{ALL_DIRECTIONS, Role, RoleSet, SeamStates, Surroundings, directions_in, mask_of};
use super::occlusion::Occlusion;
use super::pool::Pool;
use super::space::Space;
use super::*;

pub fn on_ctx<T>(run: impl FnOnce(&Ctx<'_>) -> T) -> T {
    run(&Ctx::quiet())
}

fn run_search(params: &PlanParams, survey: &PlanSurvey, constraints: &PlanConstraints) -> PlanOutcome {
    on_ctx(|ctx| search(ctx, params, survey, constraints)).unwrap()
}

/// The plan that the search finds; `None` if there is none.
fn plan_of(params: &PlanParams, survey: &PlanSurvey, constraints: &PlanConstraints) -> Option<LatticePlan> {
    match run_search(params, survey, constraints) {
        PlanOutcome::Found(found) => Some(found.plan),
        PlanOutcome::Infeasible { .. } => None,
    }
}

fn run_survey(surface: &shellock_surface::SegmentedSurface) -> PlanSurvey {
    on_ctx(|ctx| {
        survey(
            ctx,
            &PlanParams::default(),
            surface,
            &seams(surface),
            &crate::sizes::ConnectorSizes::default(),
        )
    })
    .unwrap()
}

/// A made-up survey: random contacts and joints, and few free directions. Each contact holds each push by at
/// most a given amount.
pub fn made_up(
    n: usize,
    edges: &[(u32, u32)],
    share_free: f64,
    most_hold_mm3: f32,
    rng: &mut ChaCha8Rng,
) -> PlanSurvey {
    let mut occlusion = Occlusion::none(n);
    for p in (0..n).map(PatchId::from) {
        for s in LatticeDirection::all() {
            for q in (0..n).map(PatchId::from).filter(|&q| q != p) {
                // Only some lattice directions are ever free, to keep brute force short.
                if s.index() % 5 != 0 || rng.random_range(0.0..1.0) > share_free {
                    occlusion.block(p, q, s);
                }
            }
        }
    }
    let contacts = edges
        .iter()
        .map(|&(a, b)| {
            let mut tables = [(); 2].map(|()| [(); LatticeDirection::COUNT].map(|()| random_joint(rng)));
            tables[0].reverse();
            let hold = BlockingTable::made_up(|| rng.random_range(0.0..most_hold_mm3));
            Interface::made_up(
                PatchId(a),
                PatchId(b),
                move |p, s| tables[usize::from(p.0 != a)][s.index()],
                hold,
            )
        })
        .collect();
    PlanSurvey {
        n_pieces: n,
        occlusion,
        contacts,
        mean_normal: IdVec::from_fn(n, |_: PatchId| Vec3::new(0.1, 0.2, 0.3)),
        area_mm2: IdVec::from_fn(n, |p: PatchId| 100.0 + f64::from(p.0)),
        flatness: IdVec::from_fn(n, |p: PatchId| Flatness {
            normal: Vec3::Z,
            share: f64::from(p.0 % 2),
        }),
        beta: 0.1,
    }
}

fn random_joint(rng: &mut ChaCha8Rng) -> Joint {
    let usable = rng.random_range(0.0..1.0);
    Joint {
        weight: rng.random_range(0.1..1.1),
        usable,
        run_mm: if usable > 0.2 { 20.0 } else { 0.0 },
        holds: usable > 0.2,
    }
}

/// Best cost of all allowed plans with a key among `keys`, by trying every order and direction.
pub fn brute_force(space: &Space<'_>, keys: &[KeyChoice]) -> Option<f64> {
    fn extend(space: &Space<'_>, removal: &mut Vec<LatticeStep>, keys: &[KeyChoice], best: &mut Option<f64>) {
        let left = removal
            .iter()
            .fold(space.all(), |l, s| l.minus(PieceSet::one(s.piece)));
        if left.is_empty() {
            let plan = LatticePlan {
                steps: removal.iter().rev().copied().collect(),
            };
            if space.allows(&plan) {
                let cost = space.score(&plan).worst;
                *best = Some(best.map_or(cost, |b: f64| b.min(cost)));
            }
            return;
        }
        for piece in left.iter() {
            let rest = left.minus(PieceSet::one(piece));
            for separation in LatticeDirection::all() {
                let is_key_step = removal.is_empty();
                let is_choice = |k: &KeyChoice| k.piece == piece && k.directions.contains(&separation);
                let is_last = rest.is_empty();
                if (is_key_step && !keys.iter().any(is_choice))
                    || (is_last && separation.index() > 0)
                    || (!is_last && !space.is_free(piece, separation, rest))
                {
                    continue;
                }
                removal.push(LatticeStep { piece, separation });
                extend(space, removal, keys, best);
                removal.pop();
            }
        }
    }
    let mut best = None;
    extend(space, &mut Vec::new(), keys, &mut best);
    best
}

/// Key choices as good as the one of `plan`.
fn equals_of(keys: &[KeyChoice], plan: &LatticePlan) -> Vec<KeyChoice> {
    let is_choice =
        |k: &&KeyChoice| k.piece == plan.key() && k.directions.contains(&plan.separation(plan.key()));
    let own = keys.iter().find(is_choice).unwrap();
    keys.iter().filter(|k| k.is_as_good_as(own)).cloned().collect()
}

/// Bound for plans with `keys` after `n_revisions` revisions, and the plans found with each key.
fn proven(space: &Space<'_>, keys: &[KeyChoice], n_revisions: usize) -> (f64, Vec<Pool>) {
    let mut candidates: Vec<Candidate<'_>> = keys.iter().map(|k| Candidate::new(k, space.n)).collect();
    on_ctx(|ctx| prove(ctx, space, &mut candidates, &mut Budget::new(n_revisions))).unwrap();
    (
        lower_bound(&candidates),
        candidates.into_iter().map(|c| c.pool).collect(),
    )
}

#[test]
fn small_cases_are_found_iff_they_exist_and_with_the_best_cost_of_all_keys_as_good() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let params = PlanParams::default();
    let (mut n_found, mut n_none) = (0, 0);
    for round in 0..60 {
        let n = 3 + round % 3;
        let all: Vec<(u32, u32)> = (0..n as u32)
            .flat_map(|a| (a + 1..n as u32).map(move |b| (a, b)))
            .collect();
        let edges: Vec<(u32, u32)> = all
            .into_iter()
            .filter(|_| rng.random_range(0.0..1.0) < 0.85)
            .collect();
        let survey = made_up(n, &edges, if n == 5 { 0.55 } else { 0.6 }, 1.5, &mut rng);
        let constraints = PlanConstraints::default();
        let space = Space::new(&survey, &constraints, params.relaxed_tolerance);
        let keys = choices(&params, &survey);
        match run_search(&params, &survey, &constraints) {
            PlanOutcome::Infeasible { .. } => {
                assert_eq!(brute_force(&space, &keys), None, "round {round}");
                n_none += 1;
            }
            PlanOutcome::Found(found) => {
                assert!(space.allows(&found.plan));
                let equals = equals_of(&keys, &found.plan);
                assert!(found.scope.keys == equals.iter().map(|k| k.piece).collect::<Vec<_>>());
                let best = brute_force(&space, &equals).unwrap();
                let cost = found.score.worst;
                assert!(
                    found.is_optimal && (cost - best).abs() <= 1e-9,
                    "round {round}: {cost} is not {best}"
                );
                n_found += 1;
            }
        }
    }
    assert!(
        n_found >= 10 && n_none >= 10,
        "{n_found} found, {n_none} not: the cases must be of both kinds"
    );
}

#[test]
fn where_one_piece_joins_two_parts_no_plan_locks() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let params = PlanParams::default();
    // A bow tie: 2 joins the pairs 0–1 and 3–4.
    let edges = [(0, 1), (0, 2), (1, 2), (2, 3), (2, 4), (3, 4)];
    for _ in 0..5 {
        let survey = made_up(5, &edges, 0.6, 1.5, &mut rng);
        let constraints = PlanConstraints::default();
        let space = Space::new(&survey, &constraints, params.relaxed_tolerance);
        assert_eq!(brute_force(&space, &choices(&params, &survey)), None);
        let PlanOutcome::Infeasible {
            articulations, apart, ..
        } = run_search(&params, &survey, &constraints)
        else {
            panic!("an articulation piece lets no plan lock")
        };
        assert_eq!(articulations, [PatchId(2)]);
        assert_eq!(apart, [PatchId(3), PatchId(4)]);
    }
}

#[test]
fn a_ball_in_ten_pieces_gets_the_same_locking_plan_on_one_and_two_threads() {
    let survey = run_survey(&voronoi(sphere(5, Vec3::new(50.0, 55.0, 70.0)), 10, 1));
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| run_search(&PlanParams::default(), &survey, &PlanConstraints::default()))
    };
    let PlanOutcome::Found(found) = on(1) else {
        panic!("ten cells of a ball have a plan")
    };
    assert_eq!(on(2), PlanOutcome::Found(found.clone()));
    let constraints = PlanConstraints::default();
    let space = Space::new(&survey, &constraints, 0.03);
    // The pool holds different plans, all allowed, best first, with their costs.
    let relations: std::collections::BTreeSet<_> =
        found.pool.iter().map(|r| space.relations(&r.plan)).collect();
    assert_eq!(relations.len(), found.pool.len());
    assert!(found.pool.len() > 50 && found.pool[0].plan == found.plan);
    assert!(
        found
            .pool
            .is_sorted_by(|x, y| x.score.worst <= y.score.worst + 1e-8)
    );
    for ranked in &found.pool {
        assert!(space.allows(&ranked.plan));
        assert_eq!(ranked.score.worst, space.score(&ranked.plan).worst);
    }
}

#[test]
fn what_earlier_rounds_forbid_is_kept_to() {
    let survey = run_survey(&voronoi(sphere(4, Vec3::new(50.0, 55.0, 70.0)), 8, 1));
    let params = PlanParams {
        n_plans: 40,
        ..PlanParams::default()
    };
    let mut constraints = PlanConstraints::default();
    for _ in 0..4 {
        let plan = plan_of(&params, &survey, &constraints).expect("enough is left");
        assert!(!constraints.rejections.contains(&plan));
        assert!(
            plan.steps[1..]
                .iter()
                .all(|s| !constraints.forbidden.contains(&(s.piece, s.separation)))
        );
        constraints
            .forbidden
            .insert((plan.steps[3].piece, plan.steps[3].separation));
        constraints.rejections.push(plan);
    }
    // If all contacts of one piece are weak, it joins nothing.
    survey
        .contacts
        .iter()
        .filter(|c| c.a == PatchId(0))
        .for_each(|c| constraints.weaken(c.a, c.b));
    assert!(matches!(
        run_search(&params, &survey, &constraints),
        PlanOutcome::Infeasible { .. }
    ));
}

#[test]
fn a_piece_that_rubbed_twice_against_another_goes_in_before_it() {
    let survey = run_survey(&voronoi(sphere(4, Vec3::new(50.0, 55.0, 70.0)), 8, 1));
    let params = PlanParams {
        n_plans: 40,
        ..PlanParams::default()
    };
    let mut constraints = PlanConstraints::default();
    let plan = plan_of(&params, &survey, &constraints).expect("a ball has a plan");
    let (earlier, later) = (plan.steps[2].piece, plan.steps[5].piece);
    constraints.rubs.insert((later, earlier), 1);
    assert_eq!(plan_of(&params, &survey, &constraints), Some(plan));
    constraints.rubs.insert((later, earlier), 2);
    let plan = plan_of(&params, &survey, &constraints).expect("enough is left");
    assert!(plan.position(later) < plan.position(earlier));
}

#[test]
fn a_short_joint_counts_only_in_another_direction() {
    let survey = run_survey(&voronoi(sphere(4, Vec3::new(50.0, 55.0, 70.0)), 8, 1));
    let params = PlanParams {
        n_plans: 40,
        ..PlanParams::default()
    };
    let mut constraints = PlanConstraints::default();
    let plan = plan_of(&params, &survey, &constraints).expect("a ball has a plan");
    let (later, earlier) = (plan.steps[3], plan.steps[0].piece);
    constraints
        .weak_joints
        .insert((later.piece, earlier, later.separation));
    assert!(constraints.is_weak(later.piece, earlier, later.separation));
    assert!(!constraints.is_weak(later.piece, earlier, later.separation.opposite()));
    assert!(!constraints.is_weak(earlier, later.piece, later.separation));
}

#[test]
fn who_is_blocked_all_round_is_named_with_the_place() {
    // No simple shape blocks a piece all round, so every direction of every piece is marked as blocked.
    let mut survey = run_survey(&label(sphere(4, Vec3::splat(50.0)), 4, |p| {
        u32::from(p.x > 0.0) + 2 * u32::from(p.y > 0.0)
    }));
    for s in LatticeDirection::all() {
        for (p, q) in (0..4)
            .flat_map(|p| (0..4).map(move |q| (PatchId(p), PatchId(q))))
            .filter(|(p, q)| p != q)
        {
            survey.occlusion.block(p, q, s);
        }
    }
    let outcome = run_search(&PlanParams::default(), &survey, &PlanConstraints::default());
    let PlanOutcome::Infeasible { reason, blockers, .. } = outcome else {
        panic!("nothing can leave")
    };
    assert!(!blockers.is_empty(), "{reason}");
}

#[test]
fn one_piece_and_too_many_are_refused_in_words() {
    let survey = run_survey(&label(sphere(2, Vec3::splat(50.0)), 1, |_| 0));
    assert!(matches!(
        run_search(&PlanParams::default(), &survey, &PlanConstraints::default()),
        PlanOutcome::Infeasible { .. }
    ));
    let survey = run_survey(&label(sphere(2, Vec3::splat(50.0)), 200, |_| 0));
    let outcome = run_search(&PlanParams::default(), &survey, &PlanConstraints::default());
    assert!(matches!(outcome, PlanOutcome::Infeasible { reason, .. } if reason.contains("200")));
}

#[test]
fn a_key_that_is_no_piece_is_named_and_not_blamed_on_the_pieces() {
    let survey = run_survey(&label(sphere(2, Vec3::splat(50.0)), 2, |p| u32::from(p.z > 0.0)));
    for key in [2, u32::MAX - 1] {
        let params = PlanParams {
            key: Some(PatchId(key)),
            ..PlanParams::default()
        };
        let outcome = run_search(&params, &survey, &PlanConstraints::default());
        let PlanOutcome::Infeasible { reason, blockers, .. } = outcome else {
            panic!("there is no piece {key}")
        };
        assert!(
            reason.contains(&format!("piece {} ", PatchId(key))) && blockers.is_empty(),
            "{reason}"
        );
        assert!(reason.contains("pieces 1 to 2;"), "pieces count from 1: {reason}");
    }
}

#[test]
fn two_hemispheres_have_a_plan() {
    let survey = run_survey(&label(sphere(4, Vec3::splat(50.0)), 2, |p| u32::from(p.z > 0.0)));
    let constraints = PlanConstraints::default();
    let plan = plan_of(&PlanParams::default(), &survey, &constraints).expect("either leaves along the axis");
    let up = plan.separation(plan.key()).step()[2];
    assert_eq!(up, if plan.key() == PatchId(1) { 1 } else { -1 });
}

#[test]
fn the_exact_search_agrees_with_brute_force_and_no_budget_makes_its_bound_wrong() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let constraints = PlanConstraints::default();
    let (mut n_plans, mut n_none) = (0, 0);
    for round in 0..60 {
        let n = 3 + round % 3;
        let all: Vec<(u32, u32)> = (0..n as u32)
            .flat_map(|a| (a + 1..n as u32).map(move |b| (a, b)))
            .collect();
        let edges: Vec<(u32, u32)> = all
            .into_iter()
            .filter(|_| rng.random_range(0.0..1.0) < 0.85)
            .collect();
        let survey = made_up(n, &edges, if n == 5 { 0.55 } else { 0.6 }, 1.5, &mut rng);
        let space = Space::new(&survey, &constraints, 0.03);
        for key in choices(&PlanParams::default(), &survey)
            .iter()
            .filter(|k| !k.directions.is_empty())
            .take(2)
        {
            let best = brute_force(&space, std::slice::from_ref(key));
            for n_revisions in [1, 30, 1_000_000] {
                let (bound, pools) = proven(&space, std::slice::from_ref(key), n_revisions);
                let pool = &pools[0];
                assert!(
                    bound <= best.unwrap_or(f64::INFINITY) + 1e-8,
                    "round {round}: {bound} > {best:?}"
                );
                assert!(pool.plans().iter().all(|(_, plan)| space.allows(plan)));
                if n_revisions == 1_000_000 {
                    assert!(bound == pool.least_cost());
                    assert!(pool.best().map(|b| b.0.worst) == best || (bound - best.unwrap()).abs() <= 1e-8);
                }
            }
            *(if best.is_some() { &mut n_plans } else { &mut n_none }) += 1;
        }
    }
    assert!(
        n_plans >= 20 && n_none >= 20,
        "{n_plans} with a plan, {n_none} without: the cases must be of both kinds"
    );
}

#[test]
fn a_spent_budget_leaves_a_plan_and_a_bound_below_the_optimum() {
    let survey = run_survey(&voronoi(sphere(4, Vec3::new(50.0, 55.0, 70.0)), 8, 1));
    let constraints = PlanConstraints::default();
    let found = |proof_budget| {
        let params = PlanParams {
            n_plans: 40,
            proof_budget,
            ..PlanParams::default()
        };
        match run_search(&params, &survey, &constraints) {
            PlanOutcome::Found(found) => found,
            PlanOutcome::Infeasible { reason, .. } => panic!("{reason}"),
        }
    };
    let [without, little, much] = [0, 200, 1_000_000].map(found);
    assert!(much.is_optimal && much.gap() == 0.0);
    for less in [without, little] {
        assert!(Space::new(&survey, &constraints, 0.03).allows(&less.plan));
        assert!(less.lower_bound <= much.score.worst && much.score.worst <= less.score.worst);
    }
}

#[test]
fn bounds_that_are_raised_later_are_those_of_a_long_search_and_the_plan_stays() {
    let survey = run_survey(&voronoi(sphere(4, Vec3::new(50.0, 55.0, 70.0)), 8, 1));
    let constraints = PlanConstraints::default();
    let params = |proof_budget| PlanParams {
        n_plans: 40,
        proof_budget,
        ..PlanParams::default()
    };
    let found = |proof_budget| match run_search(&params(proof_budget), &survey, &constraints) {
        PlanOutcome::Found(found) => found,
        PlanOutcome::Infeasible { reason, .. } => panic!("{reason}"),
    };
    let (mut little, much) = (found(200), found(1_000_000));
    let plan = little.plan.clone();
    assert!(
        little.lower_bound < much.lower_bound,
        "there is something to raise"
    );
    on_ctx(|ctx| raise_bounds(ctx, &params(1_000_000), &survey, &constraints, &mut little)).unwrap();
    assert_eq!(little.plan, plan);
    assert_eq!(little.lower_bound, much.lower_bound.min(little.score.worst));
    assert_eq!(little.is_optimal, little.score.worst <= much.score.worst);
}

/// The default costs through `bound` alone, as another metric would give them.
pub struct BoundsAlone(pub SeamCosts);

impl PieceCosts for BoundsAlone {
    fn bound(&self, piece: PatchId, role: Role, around: &Surroundings) -> f64 {
        self.0.bound(piece, role, around)
    }
}

#[test]
fn a_metric_that_gives_bounds_alone_finds_the_same_optimum() {
    let survey = run_survey(&voronoi(sphere(4, Vec3::new(50.0, 55.0, 70.0)), 6, 2));
    let params = PlanParams {
        n_plans: 20,
        ..PlanParams::default()
    };
    let constraints = PlanConstraints::default();
    let make: MakeCosts<'_> = &|s, c| Box::new(BoundsAlone(SeamCosts::new(s, c)));
    let plain = run_search(&params, &survey, &constraints);
    let other = on_ctx(|ctx| search_with(ctx, &params, &survey, &constraints, make)).unwrap();
    let (PlanOutcome::Found(plain), PlanOutcome::Found(other)) = (plain, other) else {
        panic!("a ball has a plan")
    };
    assert!(plain.is_optimal && other.is_optimal && plain.score.worst == other.score.worst);
}

#[test]
fn a_bound_is_at_most_the_cost_of_every_state_it_leaves_open_and_narrowing_keeps_what_costs_little() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let edges = [(0, 1), (0, 2), (1, 2), (2, 3), (0, 3)];
    let surveys = [1.5, 30.0].map(|hold_mm3| made_up(4, &edges, 0.9, hold_mm3, &mut rng));
    let costs = surveys
        .each_ref()
        .map(|survey| SeamCosts::new(survey, &PlanConstraints::default()));
    let (piece, n_seams) = (PatchId(0), 3);
    for round in 0..600 {
        // The costs alternate between loosely held pieces and pieces held so well that only the seams cost.
        let costs = &costs[round % 2];
        let mut mask = || rng.random_range(1..=ALL_DIRECTIONS) & rng.random_range(1..=ALL_DIRECTIONS);
        let s = LatticeDirection::all()
            .nth(mask() as usize % LatticeDirection::COUNT)
            .unwrap();
        let seams: Vec<SeamStates> = (0..n_seams)
            .map(|_| SeamStates {
                own: mask() | mask_of(s),
                others: mask(),
            })
            .collect();
        let open = Surroundings {
            seams,
            remainder: PieceSet::EMPTY,
        };
        let choose = |(i, x): (usize, &SeamStates)| match directions_in(x.others).nth(i + 1) {
            Some(t) => SeamStates {
                own: 0,
                others: mask_of(t),
            },
            None => SeamStates {
                own: mask_of(s),
                others: 0,
            },
        };
        let seams = open.seams.iter().enumerate().map(choose).collect();
        let chosen = Surroundings {
            seams,
            remainder: PieceSet::first(4),
        };
        let mut open = open;
        // If all other seams are decided, the limit leaves the last one no room at all.
        (0..round % 4)
            .take(2)
            .for_each(|i| open.seams[i] = chosen.seams[i]);
        let cost = costs.bound(piece, Role::Between(s), &chosen);
        assert!(costs.bound(piece, Role::Between(s), &open) <= cost);
        let mut roles = RoleSet {
            separations: ALL_DIRECTIONS,
            may_be_first: true,
            is_key: false,
        };
        let mut left = open.clone();
        costs.narrow(piece, &mut roles, &mut left, cost);
        assert!(roles.separations & mask_of(s) != 0);
        for (left, chosen) in left.seams.iter().zip(&chosen.seams) {
            assert!(left.own & chosen.own == chosen.own && left.others & chosen.others == chosen.others);
        }
    }
}

//! Tests the proof against brute force on many small cases, with any amount of work: a bound may be low,
//! never wrong.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use shellock_assembly::LatticeDirection;
use shellock_report::PatchId;

use super::draw::{DrawLimits, draw};
use super::exact::{Budget, Candidate, least_cost, lower_bound, prove};
use super::key::{KeyChoice, choices};
use super::local_cost::{Role, SeamStates, Surroundings, directions_in, mask_of};
use super::search_tests::{BoundsAlone, brute_force, made_up, on_ctx};
use super::space::Space;
use super::*;

/// Costs as in Eq. 6: the maximum over pairs of states at a piece's seams, from a table.
struct PairCosts {
    by_piece: Vec<Vec<f64>>,
}

impl PairCosts {
    fn made_up(n: usize, mut cost: impl FnMut() -> f64) -> Self {
        Self {
            by_piece: (0..n).map(|_| (0..997).map(|_| cost()).collect()).collect(),
        }
    }

    fn of_pair(&self, p: PatchId, x: (usize, usize), y: (usize, usize)) -> f64 {
        let table = &self.by_piece[usize::from(p)];
        table[((x.0 * 53 + x.1) * 7919 + (y.0 * 53 + y.1) * 104_729) % table.len()]
    }
}

/// Possible states of a seam for a piece in `role`, as numbers.
fn states(role: Role, seam: SeamStates) -> Vec<usize> {
    let own = role
        .separation()
        .filter(|&s| seam.own & mask_of(s) != 0)
        .map(LatticeDirection::index);
    own.into_iter()
        .chain(directions_in(seam.others).map(|s| LatticeDirection::COUNT + s.index()))
        .collect()
}

impl PieceCosts for PairCosts {
    fn bound(&self, piece: PatchId, role: Role, around: &Surroundings) -> f64 {
        let states: Vec<Vec<usize>> = around.seams.iter().map(|&x| states(role, x)).collect();
        let least = |i: usize, j: usize| {
            let pairs = states[i]
                .iter()
                .flat_map(|&x| states[j].iter().map(move |&y| (x, y)));
            let pairs = pairs.filter(|(x, y)| i != j || x == y);
            pairs
                .map(|(x, y)| self.of_pair(piece, (i, x), (j, y)))
                .fold(f64::INFINITY, f64::min)
        };
        (0..states.len())
            .flat_map(|i| (0..=i).map(move |j| (i, j)))
            .map(|(i, j)| least(i, j))
            .fold(0.0, f64::max)
    }
}

/// A random survey with ties, seams of all lengths, pieces slightly in each other's way, and well or badly
/// held.
fn thrown(n: usize, rng: &mut ChaCha8Rng) -> PlanSurvey {
    let all = (0..n as u32).flat_map(|a| (a + 1..n as u32).map(move |b| (a, b)));
    let edges: Vec<(u32, u32)> = all.filter(|_| rng.random_range(0.0..1.0) < 0.95).collect();
    let share_free = if n == 5 { 0.5 } else { rng.random_range(0.6..0.95) };
    let most_hold_mm3 = if rng.random_range(0..3) == 0 { 1.5 } else { 30.0 };
    let mut survey = made_up(n, &edges, share_free, most_hold_mm3, rng);
    let lengths = rng.random_range(0..3);
    for c in &mut survey.contacts {
        c.length_mm = match lengths {
            0 => 20.0,
            1 => rng.random_range(1e-6..1e6),
            _ => f64::from(rng.random_range(0..4)),
        };
    }
    for (p, q) in (0..n)
        .flat_map(|p| (0..n).map(move |q| (p, q)))
        .filter(|(p, q)| p != q)
    {
        for s in LatticeDirection::all()
            .filter(|_| rng.random_range(0..4) == 0)
            .collect::<Vec<_>>()
        {
            if survey.occlusion.share(p.into(), q.into(), s) == 0.0 {
                survey
                    .occlusion
                    .occlude(p.into(), q.into(), s, rng.random_range(0.0..0.05));
            }
        }
    }
    survey
}

fn lessons(n: usize, rng: &mut ChaCha8Rng) -> PlanConstraints {
    let mut constraints = PlanConstraints::default();
    for _ in 0..rng.random_range(0..3) {
        let [p, q] = [(); 2].map(|()| PatchId(rng.random_range(0..n as u32)));
        let s = LatticeDirection::from_index(5 * rng.random_range(0..5)).unwrap();
        if p == q {
            continue;
        }
        match rng.random_range(0..4) {
            0 => constraints.weaken(p, q),
            1 => constraints.weak_joints.extend([(p, q, s)]),
            2 => constraints.forbidden.extend([(p, s)]),
            _ => constraints.rubs.extend([((p, q), 2)]),
        }
    }
    constraints
}

/// Costs of three kinds, in units from 10⁻⁹ to 10⁹.
fn costs(survey: &PlanSurvey, constraints: &PlanConstraints, rng: &mut ChaCha8Rng) -> Box<dyn PieceCosts> {
    let n_levels = rng.random_range(2..6);
    // Pairs take long if there are many neighbours.
    match rng.random_range(0..if survey.n_pieces > 3 { 4 } else { 6 }) {
        0..=2 => Box::new(SeamCosts::new(survey, constraints)),
        3 => Box::new(BoundsAlone(SeamCosts::new(survey, constraints))),
        4 => Box::new(PairCosts::made_up(survey.n_pieces, || {
            f64::from(rng.random_range(0..n_levels))
        })),
        _ => Box::new(PairCosts::made_up(survey.n_pieces, || {
            10f64.powf(rng.random_range(-9.0..9.0))
        })),
    }
}

/// Work allowed in all, and for the first questions per piece. Small questions are the ones that stay open.
const WORK: [(usize, usize); 7] = [
    (1, 60),
    (10, 1),
    (30, 2),
    (100, 1),
    (1_000_000, 1),
    (1_000_000, 3),
    (1_000_000, 60),
];

#[test]
fn whatever_the_work_the_bound_is_at_most_the_optimum_and_the_plan_costs_at_least_that() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let (mut n_plans, mut n_none, mut n_open) = (0, 0, 0);
    for round in 0..N_ROUNDS {
        let n = [2, 3, 4, 3, 4, 4, 3, 5][round % 8];
        let (survey, constraints) = (thrown(n, &mut rng), lessons(n, &mut rng));
        let space = Space::with_costs(
            &survey,
            &constraints,
            0.03,
            costs(&survey, &constraints, &mut rng),
        );
        let keys = choices(&PlanParams::default(), &survey);
        let first = keys.iter().find(|k| !k.directions.is_empty()).unwrap();
        let keys: Vec<&KeyChoice> = keys.iter().filter(|k| k.is_as_good_as(first)).collect();
        let of_key = |k: &&KeyChoice| brute_force(&space, std::slice::from_ref(*k)).unwrap_or(f64::INFINITY);
        let least: Vec<f64> = keys.iter().map(of_key).collect();
        let optimum = least.iter().copied().fold(f64::INFINITY, f64::min);
        let is_most = |bound: f64, cost: f64| bound <= cost * (1.0 + 1e-8) + 1e-12;
        for (n_left, first_per_piece) in WORK {
            let mut candidates: Vec<Candidate<'_>> = keys.iter().map(|k| Candidate::new(k, n)).collect();
            if round % 3 > 0 {
                // Some plan is known, as in the search.
                let limits = DrawLimits {
                    bound: f64::INFINITY,
                    max_tries: 20 * n,
                };
                let drawn = draw(&space, keys[0], super::search::stream(round as u64, 0), 3, limits);
                drawn
                    .plan
                    .into_iter()
                    .for_each(|plan| candidates[0].pool.add(&space, space.score(&plan), plan));
            }
            on_ctx(|ctx| {
                prove(
                    ctx,
                    &space,
                    &mut candidates,
                    &mut Budget {
                        n_left,
                        first_per_piece,
                    },
                )
            })
            .unwrap();
            let (bound, cost) = (lower_bound(&candidates), least_cost(&candidates));
            let name =
                format!("round {round}, work {n_left}/{first_per_piece}: {bound} ≤ {optimum} ≤ {cost}");
            assert!(is_most(bound, optimum) && is_most(optimum, cost), "{name}");
            for (candidate, &least) in candidates.iter().zip(&least) {
                assert!(
                    is_most(candidate.lower_bound, least),
                    "{name}, {:?}",
                    candidate.key
                );
                assert!(
                    candidate.pool.plans().iter().all(|(_, plan)| space.allows(plan)),
                    "{name}"
                );
            }
            if n_left == 1_000_000 {
                assert!(bound >= cost || is_most(cost, bound), "{name}");
            }
            n_open += usize::from(bound < cost);
        }
        *(if optimum.is_finite() {
            &mut n_plans
        } else {
            &mut n_none
        }) += 1;
    }
    let n_least = N_ROUNDS / 10;
    assert!(
        n_plans > n_least && n_none > n_least && n_open > n_least,
        "{n_plans}, {n_none}, {n_open}: all kinds"
    );
}

/// Number of rounds, which take about half a second. Rounds 5 and 10 are the first to fail for two faults: a
/// proof that takes an open question of a bisection for an answer, and narrowing that removes what costs more
/// than nine tenths of the limit.
const N_ROUNDS: usize = 16;

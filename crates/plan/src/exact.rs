//! The best plan with any of the given keys, and its proof: bisection on the cost of the worst piece.
//!
//! The question is whether a plan exists whose pieces all cost at most T. It needs a search of its own.
//! [`domains`] removes what is impossible. Then the piece or seam that is still open and caused most
//! conflicts is decided either way. This repeats until all is decided, and [`sequence`] turns the decisions
//! into an order. If the budget runs out, the question stays open. The answer "none" is a proof, so T bounds
//! all plans. Each key is asked on its own, with the best plan of all keys as the limit. Small questions come
//! before large ones, so that a key that is hard to prove does not block the others.
//!
//! Deviation: a depth-first search from the key backwards meets a contradiction between two distant pieces
//! only after it has tried every way to remove the others. Deciding pieces by conflicts, in any place, meets
//! it at once. The order is kept only as far as necessary, so orders that differ in pieces that do not touch
//! are one.
//!
//! The result does not depend on threads or time, except for the stop that [`Ctx::is_time_up`] requests.
//!
//! Sources: the weights of conflicts are those of Boussemart et al. 2004, *Boosting systematic search by
//! weighting constraints*.

mod domains;
mod sequence;

use domains::{Conflict, Domains, Propagator};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sequence::{Sequence, sequence};
use shellock_geom::work::Count;
use shellock_report::{Cancelled, Ctx, PatchId};

use super::draw::Draws;
use super::improve::improve;
use super::key::KeyChoice;
use super::local_cost::{Role, RoleSet};
use super::pool::Pool;
use super::score::{just_above, just_below};
use super::space::Space;
use super::{LatticePlan, PieceSet};

/// Domains that proofs revised.
pub static REVISIONS: Count = Count::new("proof_revisions");

/// Relative step of cost between two thresholds, below which bisection stops and each question gets more
/// work.
const FINEST_STEP: f64 = 0.002;

/// Initial limit on revisions for one question, per piece. It is multiplied by four each time that questions
/// stay open.
const FIRST_BUDGET_PER_PIECE: usize = 60;

/// Decisions before the first restart, and growth of later runs. Weights learned in one run guide the next.
const FIRST_RUN: usize = 50;
const RUN_GROWTH: f64 = 1.4;

/// Work limits of the exact search.
pub(super) struct Budget {
    /// Number of revisions of pieces that are left in all.
    pub n_left: usize,
    /// Initial limit on revisions for one question, per piece.
    pub first_per_piece: usize,
}

impl Budget {
    /// Allows at most `n` revisions in all.
    pub fn new(n: usize) -> Self {
        Self {
            n_left: n,
            first_per_piece: FIRST_BUDGET_PER_PIECE,
        }
    }
}

/// Answer to "is there a plan whose pieces all cost at most this?".
enum Answer {
    Plan(LatticePlan),
    None,
    Unknown,
}

/// One choice of the key, and what is known of the plans with it.
pub(super) struct Candidate<'k> {
    pub key: &'k KeyChoice,
    /// Best plans found with this key.
    pub pool: Pool,
    /// Lower bound on the cost of plans with this key; infinite if there is none.
    pub lower_bound: f64,
    /// State of the random draws.
    pub draws: Draws,
    /// Weight of each piece, which grows by 1 with each conflict there. One question guides the next.
    weights: Vec<f64>,
}

impl<'k> Candidate<'k> {
    /// Creates a candidate with `key` for `n` pieces, about whose plans nothing is known.
    pub fn new(key: &'k KeyChoice, n: usize) -> Self {
        Self {
            key,
            pool: Pool::default(),
            lower_bound: 0.0,
            draws: Draws::default(),
            weights: vec![1.0; n],
        }
    }

    fn add(&mut self, space: &Space<'_>, plan: LatticePlan) {
        let score = space.score(&plan);
        let improved = improve(space, self.key, plan.clone());
        self.pool.add(space, score, plan);
        self.pool.add(space, improved.score, improved.plan);
    }
}

/// Cost of the best plan of all candidates; infinite if none was found.
pub(super) fn least_cost(candidates: &[Candidate<'_>]) -> f64 {
    candidates
        .iter()
        .map(|c| c.pool.least_cost())
        .fold(f64::INFINITY, f64::min)
}

/// Proven bound: no plan of any candidate costs less.
pub(super) fn lower_bound(candidates: &[Candidate<'_>]) -> f64 {
    candidates
        .iter()
        .map(|c| c.lower_bound)
        .fold(f64::INFINITY, f64::min)
}

/// Proves a lower bound for each of `candidates` and adds better plans to their pools.
///
/// A bound at or above the least cost of all closes a candidate: no plan with that key is better than the
/// best known.
pub(super) fn prove(
    ctx: &Ctx<'_>,
    space: &Space<'_>,
    candidates: &mut [Candidate<'_>],
    budget: &mut Budget,
) -> Result<(), Cancelled> {
    let mut per_question = budget.first_per_piece * space.n;
    while budget.n_left > 0 && lower_bound(candidates) < least_cost(candidates) {
        // First the full question for each key: is there any better plan?
        for i in 0..candidates.len() {
            let mut is_answered = true;
            while is_answered && budget.n_left > 0 && candidates[i].lower_bound < least_cost(candidates) {
                let upper = least_cost(candidates);
                let limit = if upper.is_finite() {
                    just_below(upper)
                } else {
                    f64::MAX
                };
                match ask(ctx, space, &mut candidates[i], limit, per_question, budget)? {
                    Answer::None => candidates[i].lower_bound = upper,
                    Answer::Plan(plan) => candidates[i].add(space, plan),
                    Answer::Unknown => is_answered = false,
                }
            }
        }
        bisect(ctx, space, candidates, per_question, budget)?;
        per_question = per_question.saturating_mul(4);
    }
    Ok(())
}

/// Raises the least of the bounds by easier questions, as far as questions of this size can.
fn bisect(
    ctx: &Ctx<'_>,
    space: &Space<'_>,
    candidates: &mut [Candidate<'_>],
    per_question: usize,
    budget: &mut Budget,
) -> Result<(), Cancelled> {
    let mut high = just_below(least_cost(candidates));
    if !high.is_finite() {
        // Without a known plan, there is no scale for these questions.
        return Ok(());
    }
    while high - lower_bound(candidates) > FINEST_STEP * high && budget.n_left > 0 {
        let middle = 0.5 * (lower_bound(candidates) + high);
        // If one key leaves the question open, it stays open for all.
        let Some(i) = candidates.iter().position(|c| c.lower_bound < middle) else {
            break;
        };
        match ask(ctx, space, &mut candidates[i], middle, per_question, budget)? {
            Answer::None => candidates[i].lower_bound = middle,
            Answer::Unknown => high = middle,
            Answer::Plan(plan) => {
                candidates[i].add(space, plan);
                high = high.min(just_below(least_cost(candidates)));
            }
        }
    }
    Ok(())
}

/// Cost limits of further plans, as multiples of the least cost: some as good in the worst piece, some
/// nearly.
const FURTHER_LIMITS: [f64; 4] = [1.0, 1.0, 1.01, 1.03];

/// Number of further plans to search for, and revisions for each, per piece.
const N_FURTHER: usize = 16;
const FURTHER_BUDGET_PER_PIECE: usize = 60;

/// Adds plans nearly as good as the best of `pool`, found by deciding in random order. They have a lower mean
/// or are merely different.
pub(super) fn vary(ctx: &Ctx<'_>, space: &Space<'_>, key: &KeyChoice, pool: &mut Pool, rng: &mut ChaCha8Rng) {
    let least = pool.least_cost();
    let tries: Vec<(f64, Vec<f64>)> = (0..N_FURTHER)
        .map(|i| {
            let limit = just_above(FURTHER_LIMITS[i % FURTHER_LIMITS.len()] * least);
            (
                limit,
                (0..space.n).map(|_| rng.random_range(1.0..100.0)).collect(),
            )
        })
        .collect();
    let further = |(limit, mut weights): (f64, Vec<f64>)| {
        let n_revisions = FURTHER_BUDGET_PER_PIECE * space.n;
        let weights = &mut weights;
        let propagator = Propagator::new(space, key);
        let mut probe = Probe {
            ctx,
            propagator,
            limit,
            n_revisions,
            n_decisions: 0,
            run: 0,
            weights,
            is_time_up: false,
        };
        // Many plans exist at such limits, so removing roles one by one would only cost time.
        let mut d = probe.propagator.all();
        let is_none = probe.narrows_to_nothing(&mut d, space.all());
        let answer = if is_none {
            Answer::None
        } else {
            probe.with_restarts(&d)
        };
        if let Answer::Plan(plan) = answer {
            Some((improve(space, key, plan.clone()), plan))
        } else {
            None
        }
    };
    let found: Vec<_> = tries.into_par_iter().map(further).collect();
    for (improved, plan) in found.into_iter().flatten() {
        pool.add(space, space.score(&plan), plan);
        pool.add(space, improved.score, improved.plan);
    }
}

/// Answers one question with at most `n_revisions` revisions.
fn ask(
    ctx: &Ctx<'_>,
    space: &Space<'_>,
    candidate: &mut Candidate<'_>,
    limit: f64,
    n_revisions: usize,
    budget: &mut Budget,
) -> Result<Answer, Cancelled> {
    let (propagator, weights) = (Propagator::new(space, candidate.key), &mut candidate.weights);
    let n_revisions = n_revisions.min(budget.n_left);
    let mut probe = Probe {
        ctx,
        propagator,
        limit,
        n_revisions,
        n_decisions: 0,
        run: 0,
        weights,
        is_time_up: false,
    };
    let answer = probe.proof();
    REVISIONS.add(probe.propagator.n_revisions);
    budget.n_left = budget.n_left.saturating_sub(probe.propagator.n_revisions.max(1));
    if probe.is_time_up {
        budget.n_left = 0;
    }
    ctx.check()?;
    Ok(answer)
}

struct Probe<'a> {
    ctx: &'a Ctx<'a>,
    propagator: Propagator<'a>,
    limit: f64,
    /// Greatest number of revisions; beyond it the question stays open.
    n_revisions: usize,
    n_decisions: usize,
    /// Greatest number of decisions in this run.
    run: usize,
    /// Weight of each piece, which grows by 1 with each conflict there.
    weights: &'a mut Vec<f64>,
    is_time_up: bool,
}

/// A decision that is still open.
enum Question {
    Role(PatchId),
    /// Choice of the later piece of a contact.
    Later(usize),
}

impl Probe<'_> {
    /// Answers the question by propagation and, if that is not enough, by search.
    fn proof(&mut self) -> Answer {
        let mut d = self.propagator.all();
        let all = self.propagator.space.all();
        if self.narrows_to_nothing(&mut d, all) {
            return Answer::None;
        }
        if let Some(answer) = self.shave(&mut d) {
            return answer;
        }
        self.with_restarts(&d)
    }

    /// Decides what is open in `d`. Starts again each time that a run ends without an answer.
    fn with_restarts(&mut self, d: &Domains) -> Answer {
        let mut run = FIRST_RUN as f64;
        loop {
            self.n_decisions = 0;
            self.run = run as usize;
            match self.decide(d) {
                Answer::Unknown if !self.is_over() => run *= RUN_GROWTH,
                answer => return answer,
            }
        }
    }

    fn is_over(&mut self) -> bool {
        self.is_time_up |= self.ctx.is_time_up() || self.ctx.check().is_err();
        self.is_time_up || self.propagator.n_revisions >= self.n_revisions
    }

    fn narrows_to_nothing(&mut self, d: &mut Domains, changed: PieceSet) -> bool {
        match self.propagator.propagate(d, changed, self.limit) {
            Ok(()) => false,
            Err(Conflict(p)) => {
                self.weights[usize::from(p)] += 1.0;
                true
            }
        }
    }

    /// Removes every role that propagation alone refutes. Returns an answer only if no role is left.
    fn shave(&mut self, d: &mut Domains) -> Option<Answer> {
        let n = self.propagator.space.n;
        let (mut since_change, mut p) = (0, 0);
        while since_change < n {
            for role in d.roles[p].iter() {
                if d.roles[p].len() < 2 || self.is_over() {
                    break;
                }
                let mut trial = d.clone();
                trial.roles[p] = trial.roles[p].only(role);
                if self.narrows_to_nothing(&mut trial, PieceSet::one(p.into())) {
                    d.roles[p] = d.roles[p].without(role);
                    since_change = 0;
                    if self.narrows_to_nothing(d, PieceSet::one(p.into())) {
                        return Some(Answer::None);
                    }
                }
            }
            since_change += 1;
            p = (p + 1) % n;
        }
        None
    }

    /// Decides what is open in `d`, one alternative after the other.
    fn decide(&mut self, d: &Domains) -> Answer {
        let Some(question) = self.question(d) else {
            return match sequence(self.propagator.space, d, self.limit) {
                Sequence::Plan(plan) => Answer::Plan(plan),
                Sequence::None => Answer::None,
                Sequence::Unknown => Answer::Unknown,
            };
        };
        let mut is_open = false;
        for (mut child, changed) in self.children(d, &question) {
            self.n_decisions += 1;
            if self.n_decisions > self.run || self.is_over() {
                return Answer::Unknown;
            }
            if self.narrows_to_nothing(&mut child, changed) {
                continue;
            }
            match self.decide(&child) {
                Answer::Plan(plan) => return Answer::Plan(plan),
                Answer::None => {}
                Answer::Unknown => is_open = true,
            }
        }
        if is_open { Answer::Unknown } else { Answer::None }
    }

    /// Next decision: the one with few alternatives and many conflicts.
    fn question(&self, d: &Domains) -> Option<Question> {
        let mut best: Option<(f64, Question)> = None;
        let mut offer = |dispute: f64, question| {
            if best.as_ref().is_none_or(|b| dispute > b.0) {
                best = Some((dispute, question));
            }
        };
        for (p, roles) in d.roles.iter().enumerate().filter(|(_, roles)| roles.len() > 1) {
            offer(self.weights[p] / roles.len() as f64, Question::Role(p.into()));
        }
        for (i, seam) in d.seams.iter().enumerate() {
            if seam.contains(&0) {
                continue;
            }
            let c = &self.propagator.space.survey.contacts[i];
            let weight = self.weights[usize::from(c.a)] + self.weights[usize::from(c.b)];
            offer(0.25 * weight, Question::Later(i));
        }
        best.map(|b| b.1)
    }

    /// Alternatives of a decision, for a role cheapest first, with the pieces that they change.
    fn children(&self, d: &Domains, question: &Question) -> Vec<(Domains, PieceSet)> {
        match *question {
            Question::Role(p) => {
                let around = self.propagator.surroundings(d, p);
                let roles: RoleSet = d.roles[usize::from(p)];
                let cost = |role| self.propagator.space.costs.bound(p, role, &around);
                let mut by_cost: Vec<(f64, Role)> = roles.iter().map(|role| (cost(role), role)).collect();
                by_cost.sort_by(|x, y| x.0.total_cmp(&y.0));
                let child = |(_, role)| {
                    let mut child = d.clone();
                    child.roles[usize::from(p)] = roles.only(role);
                    (child, PieceSet::one(p))
                };
                by_cost.into_iter().map(child).collect()
            }
            Question::Later(i) => {
                let c = &self.propagator.space.survey.contacts[i];
                let child = |side: usize| {
                    let mut child = d.clone();
                    child.seams[i][1 - side] = 0;
                    (child, PieceSet::one(c.a).union(PieceSet::one(c.b)))
                };
                [0, 1].map(child).into_iter().collect()
            }
        }
    }
}

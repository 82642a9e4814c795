//! Climb to the strongest plan: raises the least load factor under the conditions of the search (Sect. 6.2).
//!
//! Plans of the pool are rated goal by goal, worst first, and rejected at the first use with a lower load
//! factor than that of the best so far. From the best plans the climb moves one piece at a time, along
//! another direction or to another place in the order. The station that decides a goal lies between two
//! pieces, so moves of these and of their neighbours are tried. A move is kept if it raises the load factor
//! of the worst use. If none does, moves for the next use are tried, without loss in those before (leximin).
//! The climb then continues for the pull on all seams, without loss in any use, and for falls, without loss
//! in both.
//!
//! Batches are of fixed size and ties go to the first, so the result does not depend on threads. It depends
//! on time only where a limit of time ends the climb, which is reported.

use std::collections::BTreeSet;

use rayon::prelude::*;
use shellock_geom::sparse::SparseError;
use shellock_plan::{LatticePlan, Neighbourhood, RankedPlan};
use shellock_report::{Cancelled, Ctx, PatchId};

use super::rating::{Bench, RESERVE, Rank, Rated};

/// Number of moves tried in parallel before the best of them is taken.
const BATCH: usize = 8;
/// Ratios of load factors from which on one counts as more, and as no less.
const MORE: f64 = 1.01;
const NO_LESS: f64 = 0.99;
/// Number of loads that each start may solve in the first heat of the race.
const FIRST_HEAT: usize = 120;
/// Share of the best value reached of a goal that must be kept for the sake of less important goals.
const LEAST_OF_PEAK: f64 = 0.97;

/// Limits of a climb's effort.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClimbParams {
    /// Greatest number of loads that may be solved for the sake of use.
    pub n_of_use: usize,
    /// Greatest number of loads that may be solved for the sake of the pull on all seams.
    pub n_of_pull: usize,
    /// Greatest number of loads that may be solved for the sake of falls.
    pub n_of_falls: usize,
    /// Number of plans from which the climb starts.
    pub n_starts: usize,
    /// Time to keep back for later work, s; ≥ 0. The climb ends when no more than that is left of a limited
    /// time.
    pub reserve_s: f64,
}

impl Default for ClimbParams {
    fn default() -> Self {
        Self {
            n_of_use: 2400,
            n_of_pull: 600,
            n_of_falls: 400,
            n_starts: 4,
            reserve_s: 0.0,
        }
    }
}

impl ClimbParams {
    /// Returns the limits for plans of `n_pieces` pieces. A load takes about as long as there are pieces, so
    /// fewer are solved of many pieces, and the climb takes no longer.
    fn for_pieces(self, n_pieces: usize) -> Self {
        /// Greatest number of pieces for which all loads are solved.
        const USUAL: usize = 20;
        let n = |n_solves: usize| n_solves * USUAL / n_pieces.max(USUAL);
        Self {
            n_of_use: n(self.n_of_use),
            n_of_pull: n(self.n_of_pull),
            n_of_falls: n(self.n_of_falls),
            ..self
        }
    }
}

/// Result of a climb.
pub struct Climbed<'a> {
    /// The strongest plan found.
    pub best: Rated<'a>,
    /// Number of plans that were rated.
    pub n_plans: usize,
    /// Number of loads that were solved.
    pub n_solves: usize,
    /// True if the time ended the climb.
    pub is_cut_short: bool,
}

/// Reason why a climb ended without a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ClimbError {
    /// There was no plan to start from.
    #[error("there is no plan to begin with")]
    NoPlan,
    /// The equations of a plan could not be solved.
    #[error(transparent)]
    Solve(#[from] SparseError),
    /// The user asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Conditions of a climb.
#[derive(Clone, Copy)]
pub struct ClimbRules<'c> {
    /// Limits of the climb's effort.
    pub params: ClimbParams,
    /// Moves of a plan that keep all conditions of the search.
    pub around: &'c Neighbourhood<'c>,
    /// Further condition on a plan before it is taken.
    pub may_be: &'c (dyn Fn(&RankedPlan) -> bool + Sync),
}

/// Climbs from `starts`, which keep all conditions, goal by goal to the end.
pub fn climb<'b>(
    ctx: &Ctx<'_>,
    rules: ClimbRules<'_>,
    bench: &'b Bench<'b>,
    starts: &[RankedPlan],
) -> Result<Climbed<'b>, ClimbError> {
    let mut ascent = Ascent::begin(ctx, rules, bench, starts)?;
    ascent.race()?;
    ascent.finish()
}

/// A climb for use, from several starts at once.
///
/// Starts race in heats: in each, every start may solve twice as many loads as in the one before. The first
/// plan that withstands enough wins, else the strongest one in the end.
pub(super) struct Ascent<'c, 'b> {
    climber: Climber<'c, 'b>,
    /// Plans that the starts reached, each with true if no move improves it any more.
    runners: Vec<(Rated<'b>, bool)>,
    /// Number of loads that each start may solve in the next heat.
    n_each: usize,
    limits: ClimbParams,
}

impl<'c, 'b> Ascent<'c, 'b> {
    /// Runs the first heat.
    pub fn begin(
        ctx: &'c Ctx<'c>,
        rules: ClimbRules<'c>,
        bench: &'b Bench<'b>,
        starts: &[RankedPlan],
    ) -> Result<Self, ClimbError> {
        let n_pieces = starts.first().map_or(0, |start| start.plan.steps.len());
        let limits = rules.params.for_pieces(n_pieces);
        let mut climber = Climber {
            ctx,
            bench,
            rules,
            n_plans: 0,
            n_solves: 0,
            is_cut_short: false,
            floors: vec![0.0; bench.ranks.len()],
        };
        let starts = climber.best_starts(starts, limits.n_starts)?;
        let mut ascent = Self {
            climber,
            runners: starts.into_iter().map(|start| (start, false)).collect(),
            n_each: FIRST_HEAT,
            limits,
        };
        ascent.run_heat()?;
        Ok(ascent)
    }

    /// Runs heats until a plan withstands enough, none can be improved, or the limit is reached.
    pub fn race(&mut self) -> Result<(), ClimbError> {
        while self.climber.n_solves < self.limits.n_of_use
            && !self.climber.is_cut_short
            && self.runners.iter().any(|runner| !runner.1)
        {
            self.run_heat()?;
        }
        Ok(())
    }

    fn run_heat(&mut self) -> Result<(), ClimbError> {
        let climber = &mut self.climber;
        for (at, is_top) in self.runners.iter_mut().filter(|runner| !runner.1) {
            let until = self.limits.n_of_use.min(climber.n_solves + self.n_each);
            (*at, *is_top) = climber.ascend(at.clone(), Rank::Use, until)?;
            if at.bears_enough() {
                self.runners = vec![(at.clone(), true)];
                return Ok(());
            }
        }
        self.n_each *= 2;
        Ok(())
    }

    /// The plan that withstands use best.
    pub fn best(&self) -> Result<&Rated<'b>, ClimbError> {
        let plans = self.runners.iter().map(|runner| &runner.0);
        let strongest = plans.reduce(|best, plan| match is_above(plan, best, Rank::Use) {
            true => plan,
            false => best,
        });
        strongest.ok_or(ClimbError::NoPlan)
    }

    /// Climbs for the other goals, without loss in use.
    pub fn finish(mut self) -> Result<Climbed<'b>, ClimbError> {
        let mut best = self.best()?.clone();
        let climber = &mut self.climber;
        climber.keep(&best, Rank::Use);
        for (rank, n_solves) in [
            (Rank::Pull, self.limits.n_of_pull),
            (Rank::Fall, self.limits.n_of_falls),
        ] {
            (best, _) = climber.ascend(best, rank, climber.n_solves + n_solves)?;
            climber.keep(&best, rank);
        }
        climber.complete(&mut best, Rank::Hang)?;
        Ok(Climbed {
            best,
            n_plans: climber.n_plans,
            n_solves: climber.n_solves,
            is_cut_short: climber.is_cut_short,
        })
    }
}

/// Returns true if `a` is stronger than `b`: in the first goal of that rank, from the worst on, in which they
/// differ. If they differ in no use, the pull decides.
fn is_above(a: &Rated<'_>, b: &Rated<'_>, rank: Rank) -> bool {
    let factors = |r: &Rated<'_>, rank| -> Vec<f64> { r.factors(rank) };
    let pairs = factors(a, rank).into_iter().zip(factors(b, rank));
    for (x, y) in pairs {
        if x > MORE * y || y > MORE * x {
            return x > y;
        }
    }
    rank == Rank::Use && is_above(a, b, Rank::Pull)
}

/// Load factor that must be kept of a goal that reached `reached`, for the sake of less important goals. No
/// use falls below what is asked of it.
fn floor(reached: f64, rank: Rank) -> f64 {
    let kept = LEAST_OF_PEAK * reached;
    if rank == Rank::Use && reached >= RESERVE {
        kept.max(RESERVE)
    } else {
        kept
    }
}

struct Climber<'c, 'b> {
    ctx: &'c Ctx<'c>,
    bench: &'b Bench<'b>,
    rules: ClimbRules<'c>,
    n_plans: usize,
    n_solves: usize,
    is_cut_short: bool,
    /// Least load factor to keep of each goal of the ranks that were climbed.
    floors: Vec<f64>,
}

impl<'b> Climber<'_, 'b> {
    /// The starts with the greatest load factors of their worst uses, best first.
    fn best_starts(&mut self, starts: &[RankedPlan], n: usize) -> Result<Vec<Rated<'b>>, ClimbError> {
        let allowed: Vec<RankedPlan> = (starts.par_iter())
            .filter_map(|start| self.rules.around.rank(start.plan.clone()))
            .collect();
        let Some((first, others)) = allowed.split_first() else {
            return Err(ClimbError::NoPlan);
        };
        let mut first = self.bench.begun(first.clone(), None)?;
        self.complete(&mut first, Rank::Use)?;
        self.complete(&mut first, Rank::Pull)?;
        let mut best = vec![first];
        for batch in others.chunks(BATCH) {
            self.ctx.check()?;
            if best[0].bears_enough() || self.is_time_over() {
                break;
            }
            // The least load factor of the last start kept is the bar for further starts.
            let floor = if best.len() < n {
                0.0
            } else {
                best[best.len() - 1].least()
            };
            let mut asked: Vec<(usize, f64)> = self
                .bench
                .goals(Rank::Use)
                .into_iter()
                .map(|g| (g, floor))
                .collect();
            asked.sort_by(|a, b| best[0].factor(a.0).total_cmp(&best[0].factor(b.0)));
            asked.extend(self.bench.goals(Rank::Pull).into_iter().map(|g| (g, 0.0)));
            best.extend(self.try_plans(batch, &best[0].clone(), &asked)?);
            best.sort_by(|a, b| b.least().total_cmp(&a.least()));
            best.truncate(n);
        }
        Ok(best)
    }

    /// Returns true if no more than the reserve is left of a limited time, and keeps that in mind.
    fn is_time_over(&mut self) -> bool {
        self.is_cut_short |= self.ctx.seconds_left() < self.rules.params.reserve_s;
        self.is_cut_short
    }

    /// Solves all goals of a rank.
    fn complete(&mut self, plan: &mut Rated<'b>, rank: Rank) -> Result<(), ClimbError> {
        for goal in self.bench.goals(rank) {
            self.n_solves += usize::from(plan.ask(goal, None)?);
        }
        Ok(())
    }

    /// Returns those of `plans` that meet the goals as `asked`. The others are rejected at the first goal
    /// that they do not meet. `like` is a similar plan, whose solutions are the starting points.
    fn try_plans(
        &mut self,
        plans: &[RankedPlan],
        like: &Rated<'b>,
        asked: &[(usize, f64)],
    ) -> Result<Vec<Rated<'b>>, ClimbError> {
        let one = |ranked: &RankedPlan| -> Result<(Option<Rated<'b>>, usize), SparseError> {
            let mut rated = self.bench.begun(ranked.clone(), Some(like))?;
            for (i, &(goal, least)) in asked.iter().enumerate() {
                rated.ask(goal, Some(like))?;
                if rated.factor(goal) < least {
                    return Ok((None, i + 1));
                }
            }
            Ok((Some(rated), asked.len()))
        };
        let all: Vec<_> = plans.par_iter().map(one).collect::<Result<_, _>>()?;
        self.n_plans += all.len();
        self.n_solves += all.iter().map(|t| t.1).sum::<usize>();
        Ok(all.into_iter().filter_map(|t| t.0).collect())
    }

    /// Climbs until no move improves the goals of a rank any more, or `most_solves` is reached. Returns the
    /// plan, and true in the first case.
    fn ascend(
        &mut self,
        start: Rated<'b>,
        rank: Rank,
        most_solves: usize,
    ) -> Result<(Rated<'b>, bool), ClimbError> {
        let mut at = start;
        let mut is_top = false;
        self.complete(&mut at, rank)?;
        let mut peak = at.least_of(rank);
        let mut place = 0;
        while self.n_solves < most_solves && !self.is_time_over() {
            let order = at.worst_first(rank);
            if place >= order.len() {
                is_top = true;
                break;
            }
            match self.step(&at, rank, &order[..], place, LEAST_OF_PEAK * peak, most_solves)? {
                Some(higher) => (at, place) = (higher, 0),
                None => place += 1,
            }
            peak = peak.max(at.least_of(rank));
        }
        Ok((at, is_top))
    }

    /// Makes the load factors of a plan floors for the ranks that follow.
    fn keep(&mut self, at: &Rated<'b>, rank: Rank) {
        for goal in self.bench.goals(rank) {
            self.floors[goal] = floor(at.factor(goal).min(rank.enough()), rank);
        }
    }

    /// Goals and least load factors of a move that improves the goal at `place` of `order`. That goal comes
    /// first, as most moves do not improve it.
    fn requests(
        &self,
        at: &Rated<'b>,
        rank: Rank,
        order: &[usize],
        place: usize,
        floor: f64,
    ) -> Vec<(usize, f64)> {
        let more = (MORE * at.factor(order[place])).min(rank.enough());
        let mut asked = vec![(order[place], more)];
        let before = order[..place]
            .iter()
            .map(|g| (*g, (NO_LESS * at.factor(*g)).max(floor)));
        asked.extend(before);
        let others = self
            .bench
            .goals(rank)
            .into_iter()
            .filter(|g| !order[..=place].contains(g));
        asked.extend(others.map(|g| (g, more)));
        let higher = (0..self.floors.len()).filter(|g| self.bench.ranks[*g] < rank);
        asked.extend(higher.map(|g| (g, self.floors[g])));
        asked
    }

    /// A move that improves the goal at `place` of `order`, without loss in those before; `None` if there is
    /// none.
    fn step(
        &mut self,
        at: &Rated<'b>,
        rank: Rank,
        order: &[usize],
        place: usize,
        floor: f64,
        most_solves: usize,
    ) -> Result<Option<Rated<'b>>, ClimbError> {
        let asked = self.requests(at, rank, order, place, floor);
        let mut seen = BTreeSet::from([self.rules.around.name(&at.candidate.plan)]);
        for pieces in self.movers(at, order[place]) {
            let mut moves = Vec::new();
            for piece in pieces {
                moves.extend(self.rules.around.moves(&at.candidate.plan, piece, &mut seen));
            }
            for batch in self.select_moves(moves).chunks(BATCH) {
                self.ctx.check()?;
                if self.is_time_over() {
                    return Ok(None);
                }
                let met = self.try_plans(batch, at, &asked)?;
                let best = self.highest(met, rank);
                if best.is_some() || self.n_solves >= most_solves {
                    return Ok(best);
                }
            }
        }
        Ok(None)
    }

    /// The strongest of the plans that `may_be` accepts; the first of equals.
    fn highest(&self, mut plans: Vec<Rated<'b>>, rank: Rank) -> Option<Rated<'b>> {
        while !plans.is_empty() {
            let best = (1..plans.len()).fold(0, |best, i| {
                if is_above(&plans[i], &plans[best], rank) {
                    i
                } else {
                    best
                }
            });
            let plan = plans.remove(best);
            if (self.rules.may_be)(&plan.candidate) {
                return Some(plan);
            }
        }
        None
    }

    /// The pieces whose moves may improve a goal: the two at its decisive station, then their neighbours.
    fn movers(&self, at: &Rated<'b>, goal: usize) -> Vec<Vec<PatchId>> {
        let Some(station) = at.station(goal) else {
            return Vec::new();
        };
        let two = self.bench.model.pieces_at(station as usize);
        let mut near: Vec<PatchId> = (0..self.bench.model.assembly.stations.len())
            .map(|i| self.bench.model.pieces_at(i))
            .filter(|pair| pair.iter().any(|p| two.contains(p)))
            .flatten()
            .filter(|p| !two.contains(p))
            .collect();
        near.sort_unstable();
        near.dedup();
        vec![two.to_vec(), near]
    }

    /// The `moves` that keep all conditions, with their costs.
    fn select_moves(&self, moves: Vec<LatticePlan>) -> Vec<RankedPlan> {
        let around = self.rules.around;
        let ranked: Vec<Option<RankedPlan>> = moves.into_par_iter().map(|plan| around.rank(plan)).collect();
        ranked.into_iter().flatten().collect()
    }
}

//! The plan that bears most: a climb of the least load factor under the conditions of the search (Sect. 6.2).
//!
//! Plans of the pool are rated goal by goal, worst first, and given up with the first use that they bear less
//! of than the best so far. From the best ones the climb moves one piece at a time, another way or another
//! place in the order. What decides a goal is a station between two pieces, so their moves and their
//! neighbours' are tried. A move is kept that lets the kit bear more of the worst use; where none does, more
//! of the next without losing any of those before (leximin). Then the same for the pull on all seams, without
//! losing of any use, and for falls, without losing of both.
//!
//! Batches are of fixed size, no clock is read and ties go to the first, so threads play no part.

use std::collections::BTreeSet;

use rayon::prelude::*;
use shellock_geom::sparse::SparseError;

use super::rating::{Bench, Rank, Rated};
use crate::plan::{LatticePlan, Neighbourhood, RankedPlan};
use crate::{Cancelled, Ctx, PatchId};

/// Moves that are tried side by side before the best of them is taken.
const BATCH: usize = 8;
/// What counts as bearing more, and what as no less.
const MORE: f64 = 1.01;
const NO_LESS: f64 = 0.99;
/// What was reached of a goal is not given up below this share for what is less important.
const LEAST_OF_PEAK: f64 = 0.97;

/// How much a climb may do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClimbParams {
    /// Loads that may be solved.
    pub n_solves: usize,
    /// Plans that are climbed from.
    pub n_starts: usize,
}

impl Default for ClimbParams {
    fn default() -> Self {
        Self {
            n_solves: 4000,
            n_starts: 4,
        }
    }
}

impl ClimbParams {
    /// Loads that may be solved until the goals of a rank, and those before, are climbed.
    fn until(&self, rank: Rank) -> usize {
        let tenths = match rank {
            Rank::Use => 6,
            Rank::Pull => 9,
            Rank::Fall | Rank::Hang => 10,
        };
        self.n_solves * tenths / 10
    }
}

/// What a climb found.
pub struct Climbed<'a> {
    /// The plan that bears most.
    pub best: Rated<'a>,
    /// Plans that were looked at.
    pub n_plans: usize,
    /// Loads that were solved.
    pub n_solves: usize,
}

/// Why a climb ended without a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ClimbError {
    /// There was nothing to begin with.
    #[error("there is no plan to begin with")]
    NoPlan,
    /// A plan's system could not be solved.
    #[error(transparent)]
    Solve(#[from] SparseError),
    /// The user asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Climbs from `starts`, which keep all conditions; `may_be` is asked of a plan before it is taken.
pub fn climb<'b>(
    ctx: &Ctx<'_>,
    params: ClimbParams,
    bench: &'b Bench<'b>,
    around: &Neighbourhood<'_>,
    starts: &[RankedPlan],
    may_be: &(dyn Fn(&RankedPlan) -> bool + Sync),
) -> Result<Climbed<'b>, ClimbError> {
    let mut climber = Climber {
        ctx,
        bench,
        around,
        may_be,
        n_plans: 0,
        n_solves: 0,
        floors: vec![0.0; bench.ranks.len()],
    };
    let starts = climber.best_starts(starts, params.n_starts)?;
    let (n, until) = (starts.len(), params.until(Rank::Use));
    let mut best: Option<Rated<'b>> = None;
    for (i, start) in starts.into_iter().enumerate() {
        // Each has its share of what is left.
        let left = until.saturating_sub(climber.n_solves);
        let top = climber.ascend(start, Rank::Use, climber.n_solves + left / (n - i))?;
        if best.as_ref().is_none_or(|b| is_above(&top, b, Rank::Use)) {
            best = Some(top);
        }
    }
    let mut best = best.ok_or(ClimbError::NoPlan)?;
    for rank in [Rank::Pull, Rank::Fall] {
        best = climber.ascend(best, rank, params.until(rank))?;
    }
    climber.complete(&mut best, Rank::Hang)?;
    Ok(Climbed {
        best,
        n_plans: climber.n_plans,
        n_solves: climber.n_solves,
    })
}

/// Whether `a` bears more: of the first goal of that rank, from the worst on, that they meet differently;
/// where there is none, of the next rank.
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

struct Climber<'c, 'b> {
    ctx: &'c Ctx<'c>,
    bench: &'b Bench<'b>,
    around: &'c Neighbourhood<'c>,
    may_be: &'c (dyn Fn(&RankedPlan) -> bool + Sync),
    n_plans: usize,
    n_solves: usize,
    /// What may not be lost of each goal of the ranks that were climbed.
    floors: Vec<f64>,
}

impl<'b> Climber<'_, 'b> {
    /// The starts that bear most of their worst uses, best first.
    fn best_starts(&mut self, starts: &[RankedPlan], n: usize) -> Result<Vec<Rated<'b>>, ClimbError> {
        let allowed: Vec<RankedPlan> = (starts.par_iter())
            .filter_map(|start| self.around.ranked(start.plan.clone()))
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
            // What the last one kept bears least decides who else is kept.
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
            best.extend(self.tried(batch, &best[0].clone(), &asked)?);
            best.sort_by(|a, b| b.least().total_cmp(&a.least()));
            best.truncate(n);
        }
        Ok(best)
    }

    /// Asks for all goals of a rank.
    fn complete(&mut self, plan: &mut Rated<'b>, rank: Rank) -> Result<(), ClimbError> {
        for goal in self.bench.goals(rank) {
            self.n_solves += usize::from(plan.ask(goal, None)?);
        }
        Ok(())
    }

    /// Those of `plans`, which are like `like`, that meet the goals as `asked`; the others are given up with
    /// the first that they do not meet.
    fn tried(
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

    /// To where no move helps the goals of a rank any more, or `most_solves` are done. What is reached counts
    /// as a floor for the ranks that come after.
    fn ascend(&mut self, start: Rated<'b>, rank: Rank, most_solves: usize) -> Result<Rated<'b>, ClimbError> {
        let mut at = start;
        self.complete(&mut at, rank)?;
        let mut peak = at.least_of(rank);
        let mut place = 0;
        while self.n_solves < most_solves {
            let order = at.worst_first(rank);
            if place >= order.len() {
                break;
            }
            match self.step(&at, rank, &order[..], place, LEAST_OF_PEAK * peak, most_solves)? {
                Some(higher) => (at, place) = (higher, 0),
                None => place += 1,
            }
            peak = peak.max(at.least_of(rank));
        }
        for goal in self.bench.goals(rank) {
            self.floors[goal] = LEAST_OF_PEAK * at.factor(goal).min(rank.enough());
        }
        Ok(at)
    }

    /// What a move must keep so that more is borne of the goal at that place of `order`, that goal first: most
    /// moves do not help it.
    fn asked(
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

    /// A move that meets more of the goal at that place of `order`, and no less of those before.
    fn step(
        &mut self,
        at: &Rated<'b>,
        rank: Rank,
        order: &[usize],
        place: usize,
        floor: f64,
        most_solves: usize,
    ) -> Result<Option<Rated<'b>>, ClimbError> {
        let asked = self.asked(at, rank, order, place, floor);
        let mut seen = BTreeSet::from([self.around.name(&at.ranked.plan)]);
        for pieces in self.movers(at, order[place]) {
            let mut moves = Vec::new();
            for piece in pieces {
                moves.extend(self.around.moves(&at.ranked.plan, piece, &mut seen));
            }
            for batch in self.allowed(moves).chunks(BATCH) {
                self.ctx.check()?;
                let met = self.tried(batch, at, &asked)?;
                let best = self.highest(met, rank);
                if best.is_some() || self.n_solves >= most_solves {
                    return Ok(best);
                }
            }
        }
        Ok(None)
    }

    /// The plan that bears most of those that may be; the first of equals.
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
            if (self.may_be)(&plan.ranked) {
                return Some(plan);
            }
        }
        None
    }

    /// The pieces whose moves may help a goal: the two that part, then their neighbours.
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

    /// Those of `moves` that keep all conditions.
    fn allowed(&self, moves: Vec<LatticePlan>) -> Vec<RankedPlan> {
        let ranked: Vec<Option<RankedPlan>> = moves
            .into_par_iter()
            .map(|plan| self.around.ranked(plan))
            .collect();
        ranked.into_iter().flatten().collect()
    }
}

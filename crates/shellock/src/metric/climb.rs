//! The plan that bears most: a climb of the least load factor under the conditions of the search (Sect. 6.2).
//!
//! Plans of the pool are rated load by load, worst first, and given up with the first load that they bear less
//! of than the best so far. From the best ones the climb moves one piece at a time, another way or another
//! place in the order. What decides a load is a station between two pieces, so their moves and their
//! neighbours' are tried. A move is kept that lets the kit bear more of the worst load; where none does, more
//! of the next without losing any of those before (leximin).
//!
//! Batches are of fixed size, no clock is read and ties go to the first, so threads play no part.

use std::cmp::Ordering;
use std::collections::BTreeSet;

use rayon::prelude::*;
use shellock_geom::Vec3;
use shellock_geom::sparse::SparseError;
use shellock_mechanics::{Closed, Drift, JoinedParts, Meeting, SurfaceModel};

use super::PlanModel;
use crate::handling::{Borne, Handling, LoadCase, borne, load_cases};
use crate::plan::{LatticePlan, Neighbourhood, PlanName, RankedPlan};
use crate::{Cancelled, Ctx, PatchId};

/// Moves that are tried side by side before the best of them is taken.
const BATCH: usize = 8;
/// What counts as bearing more, and what as no less.
const MORE: f64 = 1.01;
const NO_LESS: f64 = 0.99;
/// Below this share of the most that the worst load ever was borne, the climb does not go for other loads'
/// sake.
const LEAST_OF_PEAK: f64 = 0.97;
/// Loads that are borne that many times over are not worth a move.
const ENOUGH: f64 = 1.5;

/// The loads on one division and what solves them.
pub struct Bench<'a> {
    model: &'a PlanModel,
    surface: SurfaceModel,
    /// What is done.
    pub cases: Vec<LoadCase>,
    is_use: Vec<bool>,
    drifts: Vec<Drift>,
    strength_mpa: f64,
}

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

/// A plan and how much of each load it bears.
#[derive(Clone)]
pub struct Rated<'a> {
    /// With its costs.
    pub ranked: RankedPlan,
    /// What it makes of each station.
    pub meetings: Vec<Meeting>,
    /// In the order of the bench's cases.
    pub borne: Vec<Borne>,
    is_use: &'a [bool],
    joined: JoinedParts<'a>,
    closed: Vec<Closed>,
}

impl Rated<'_> {
    /// The least load factor of all uses.
    pub fn least(&self) -> f64 {
        let uses = self.borne.iter().zip(self.is_use).filter(|(_, is)| **is);
        uses.map(|(b, _)| b.factor).fold(f64::INFINITY, f64::min)
    }

    /// How far each point of the outer surface goes under a case, mm.
    pub(super) fn moved_mm(&self, bench: &Bench<'_>, case: usize) -> Result<Vec<Vec3>, SparseError> {
        let forces_n = &bench.cases[case].forces_n;
        self.joined.moved_mm(forces_n, Some(&self.closed[case]))
    }

    /// Cases from that which it bears least of on, uses before falls that may happen.
    fn worst_first(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.borne.len()).collect();
        order.sort_by(|a, b| {
            self.urgency(*a)
                .partial_cmp(&self.urgency(*b))
                .unwrap_or(Ordering::Equal)
        });
        order
    }

    /// What is not borne enough comes first.
    fn urgency(&self, case: usize) -> (bool, bool, f64) {
        let factor = self.borne[case].factor;
        (factor >= ENOUGH, !self.is_use[case], factor)
    }
}

impl<'a> Bench<'a> {
    /// Loads of `handling` on the pieces of `model`.
    pub fn new(handling: &Handling, model: &'a PlanModel) -> Result<Self, SparseError> {
        let surface = model.surface_model()?;
        let cases = load_cases(handling, &model.assembly);
        let drifts = cases
            .par_iter()
            .map(|case| surface.drift(&case.forces_n))
            .collect();
        Ok(Self {
            model,
            surface,
            is_use: cases.iter().map(|c| c.deed.is_use()).collect(),
            cases,
            drifts,
            strength_mpa: handling.material.strength_mpa,
        })
    }

    /// All loads on a plan, from the start.
    pub fn rated(&self, ranked: RankedPlan) -> Result<Rated<'_>, SparseError> {
        let order: Vec<usize> = (0..self.cases.len()).collect();
        let all = self.tried(ranked, None, &order, &|_| 0.0).map(|tried| tried.0)?;
        Ok(all.expect("no load is asked for more than nothing"))
    }

    /// The plan with its load factors, beginning `from` a plan that is nearly the same; none where it bears
    /// less of a load than `asked` of that case. And how many loads were solved.
    fn tried<'b>(
        &'b self,
        ranked: RankedPlan,
        from: Option<&Rated<'b>>,
        order: &[usize],
        asked: &dyn Fn(usize) -> f64,
    ) -> Result<(Option<Rated<'b>>, usize), SparseError> {
        let meetings = self.model.meetings(&ranked.plan);
        let joined = from.map_or_else(|| self.surface.joined(&meetings), |f| f.joined.changed(&meetings))?;
        let mut all = vec![Borne::ANY; self.cases.len()];
        let mut closed = vec![Closed::default(); self.cases.len()];
        for (n_solved, &case) in order.iter().enumerate() {
            let start = from.map(|f| &f.closed[case]);
            let (bearing, touching) = joined.bear(&meetings, &self.drifts[case], start)?;
            all[case] = borne(&meetings, &bearing, self.strength_mpa);
            closed[case] = touching;
            if all[case].factor < asked(case) {
                return Ok((None, n_solved + 1));
            }
        }
        let rated = Rated {
            ranked,
            meetings,
            borne: all,
            is_use: &self.is_use,
            joined,
            closed,
        };
        Ok((Some(rated), order.len()))
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
    bench: &'b Bench<'_>,
    around: &Neighbourhood<'_>,
    starts: &[RankedPlan],
    may_be: &(dyn Fn(&RankedPlan) -> bool + Sync),
) -> Result<Climbed<'b>, ClimbError> {
    let mut climber = Climber {
        ctx,
        bench,
        around,
        may_be,
        seen: BTreeSet::new(),
        n_plans: 0,
        n_solves: 0,
        most_solves: params.n_solves,
    };
    let starts = climber.best_starts(starts, params.n_starts)?;
    let mut best: Option<Rated<'b>> = None;
    for (i, start) in starts.into_iter().enumerate() {
        // Each has its share of what is left.
        climber.most_solves = climber.n_solves
            + (params.n_solves - climber.n_solves.min(params.n_solves)) / (params.n_starts - i).max(1);
        let top = climber.ascend(start)?;
        if best.as_ref().is_none_or(|b| is_above(&top, b)) {
            best = Some(top);
        }
    }
    Ok(Climbed {
        best: best.ok_or(ClimbError::NoPlan)?,
        n_plans: climber.n_plans,
        n_solves: climber.n_solves,
    })
}

/// Whether `a` bears more: of the first load by rank, from the worst on, that they bear differently.
fn is_above(a: &Rated<'_>, b: &Rated<'_>) -> bool {
    let factors = |r: &Rated<'_>| -> Vec<f64> {
        let mut uses: Vec<f64> = Vec::new();
        let mut falls: Vec<f64> = Vec::new();
        for (b, is_use) in r.borne.iter().zip(r.is_use) {
            if *is_use { &mut uses } else { &mut falls }.push(b.factor.min(ENOUGH));
        }
        uses.sort_by(f64::total_cmp);
        falls.sort_by(f64::total_cmp);
        uses.into_iter().chain(falls).collect()
    };
    for (x, y) in factors(a).into_iter().zip(factors(b)) {
        if x > MORE * y || y > MORE * x {
            return x > y;
        }
    }
    false
}

struct Climber<'c, 'b> {
    ctx: &'c Ctx<'c>,
    bench: &'b Bench<'b>,
    around: &'c Neighbourhood<'c>,
    may_be: &'c (dyn Fn(&RankedPlan) -> bool + Sync),
    seen: BTreeSet<PlanName>,
    n_plans: usize,
    n_solves: usize,
    most_solves: usize,
}

impl<'b> Climber<'_, 'b> {
    /// The starts that bear most of their worst loads, best first.
    fn best_starts(&mut self, starts: &[RankedPlan], n: usize) -> Result<Vec<Rated<'b>>, ClimbError> {
        let allowed: Vec<RankedPlan> = (starts.par_iter())
            .filter_map(|start| self.around.ranked(start.plan.clone()))
            .collect();
        let Some((first, others)) = allowed.split_first() else {
            return Err(ClimbError::NoPlan);
        };
        let mut best = vec![self.bench.rated(first.clone())?];
        self.n_solves += self.bench.cases.len();
        for batch in others.chunks(BATCH) {
            self.ctx.check()?;
            // What the last one kept bears least decides who else is kept.
            let order = best[0].worst_first();
            let floor = if best.len() < n {
                0.0
            } else {
                best[best.len() - 1].least()
            };
            let asked = |case: usize| if self.bench.is_use[case] { floor } else { 0.0 };
            let tried: Vec<_> = batch
                .par_iter()
                .map(|start| self.bench.tried(start.clone(), Some(&best[0]), &order, &asked))
                .collect::<Result<_, _>>()?;
            for (found, n_solved) in tried {
                self.n_solves += n_solved;
                best.extend(found);
            }
            self.n_plans += batch.len();
            best.sort_by(|a, b| b.least().total_cmp(&a.least()));
            best.truncate(n);
        }
        Ok(best)
    }

    /// To where no move helps any more, or the work is done.
    fn ascend(&mut self, start: Rated<'b>) -> Result<Rated<'b>, ClimbError> {
        let (mut at, mut peak) = (start, 0.0_f64);
        self.seen.insert(self.around.name(&at.ranked.plan));
        let mut rank = 0;
        while rank < at.borne.len() && self.n_solves < self.most_solves {
            self.ctx.check()?;
            let order = at.worst_first();
            peak = peak.max(at.least());
            if at.borne[order[rank]].factor >= ENOUGH {
                break;
            }
            match self.step(&at, &order, rank, LEAST_OF_PEAK * peak)? {
                Some(higher) => (at, rank) = (higher, 0),
                None => rank += 1,
            }
        }
        Ok(at)
    }

    /// A move that lets more of the load of that rank be borne, and no less of those before.
    fn step(
        &mut self,
        at: &Rated<'b>,
        order: &[usize],
        rank: usize,
        floor: f64,
    ) -> Result<Option<Rated<'b>>, ClimbError> {
        let target = order[rank];
        let asked_more = MORE * at.borne[target].factor;
        let asked = |case: usize| {
            let place = order.iter().position(|c| *c == case).unwrap_or(rank);
            if place < rank {
                (NO_LESS * at.borne[case].factor).max(if self.bench.is_use[case] { floor } else { 0.0 })
            } else if self.bench.is_use[case] == self.bench.is_use[target] {
                asked_more.min(ENOUGH)
            } else if self.bench.is_use[case] {
                (NO_LESS * at.borne[case].factor).min(ENOUGH)
            } else {
                0.0
            }
        };
        // The load that is to be helped comes first: most moves do not help it.
        let mut cases = vec![target];
        cases.extend(order.iter().filter(|c| **c != target));
        let mut seen = BTreeSet::new();
        for pieces in self.movers(at, target) {
            let mut moves = Vec::new();
            for piece in pieces {
                moves.extend(self.around.moves(&at.ranked.plan, piece, &mut seen));
            }
            for batch in self.allowed(moves).chunks(BATCH) {
                self.ctx.check()?;
                let tried: Vec<_> = batch
                    .par_iter()
                    .map(|ranked| self.bench.tried(ranked.clone(), Some(at), &cases, &asked))
                    .collect::<Result<_, _>>()?;
                self.n_plans += batch.len();
                self.n_solves += tried.iter().map(|t| t.1).sum::<usize>();
                let best = self.highest(tried.into_iter().filter_map(|t| t.0).collect());
                if best.is_some() || self.n_solves >= self.most_solves {
                    return Ok(best);
                }
            }
        }
        Ok(None)
    }

    /// The plan that bears most of those that may be; the first of equals.
    fn highest(&self, mut plans: Vec<Rated<'b>>) -> Option<Rated<'b>> {
        while !plans.is_empty() {
            let best = (1..plans.len()).fold(0, |best, i| {
                if is_above(&plans[i], &plans[best]) {
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

    /// The pieces whose moves may help `case`: the two that part, then their neighbours.
    fn movers(&self, at: &Rated<'b>, case: usize) -> Vec<Vec<PatchId>> {
        let Some((_, station)) = at.borne[case].first else {
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

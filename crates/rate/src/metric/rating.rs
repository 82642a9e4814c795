//! Load factors of plans: goals in ranks, solved only as far as needed.
//!
//! ```text
//!   rank    goals                                        enough
//!   use     presses, grips, the fall onto the feet       ENOUGH times the load
//!   pull    the separation force on all seams            there is no enough
//!   fall    falls onto any side                          ENOUGH times the load
//!   hang    the weight, held at one piece                ENOUGH times the load, exceeded several times
//! ```

use rayon::prelude::*;
use shellock_geom::Vec3;
use shellock_geom::sparse::SparseError;
use shellock_mechanics::{Closed, Drift, JoinedParts, Meeting, SurfaceModel};
use shellock_plan::{LatticePlan, RankedPlan};

use super::PlanModel;
use crate::handling::{Borne, Deed, Handling, LoadCase, load_cases, load_factor};

/// Load factor that kits are asked for. The surface model knows no play, so a reserve stands for that
/// (docs/notes/stress-test.md).
pub const RESERVE: f64 = 1.4;
/// Load factor above which a further increase is not worth a move: what is asked, with a margin for rounding
/// and for moves that serve less important goals.
pub const ENOUGH: f64 = 1.02 * RESERVE;

/// Ranks of goals, most important first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rank {
    /// Ordinary use of a kit by people.
    Use,
    /// Small openings of the seams when all are pulled apart.
    Pull,
    /// Rare falls onto any side; hardly any plan withstands those onto an ear or a tail.
    Fall,
    /// The kit's own weight.
    Hang,
}

impl Rank {
    fn of(deed: &Deed) -> Self {
        match deed {
            Deed::Fall { .. } => Self::Fall,
            Deed::Hang { .. } => Self::Hang,
            _ => Self::Use,
        }
    }

    /// Load factor above which all values count as equal; infinite for the pull.
    pub fn enough(self) -> f64 {
        if self == Self::Pull { f64::INFINITY } else { ENOUGH }
    }
}

/// The loads on one division of the model, and their solvers.
pub struct Bench<'a> {
    pub(super) model: &'a PlanModel,
    pub(super) surface: SurfaceModel,
    /// Loads, which are the first goals.
    pub cases: Vec<LoadCase>,
    drifts: Vec<Drift>,
    strength_mpa: f64,
    /// Rank of each goal: the cases, then the pull.
    pub(super) ranks: Vec<Rank>,
}

/// A plan and its load factors.
#[derive(Clone)]
pub struct Rated<'a> {
    /// The plan with its costs.
    pub candidate: RankedPlan,
    /// Walls and joints that the plan makes of each station.
    pub meetings: Vec<Meeting>,
    bench: &'a Bench<'a>,
    /// Answer to each goal that was solved.
    answers: Vec<Option<Answer>>,
    parts: JoinedParts<'a>,
}

#[derive(Clone)]
struct Answer {
    load_factor: Borne,
    closure: Closed,
}

impl<'a> Bench<'a> {
    /// Prepares the loads of `handling` on the pieces of `model`.
    pub fn new(handling: &Handling, model: &'a PlanModel) -> Result<Self, SparseError> {
        Self::of(handling, model, load_cases(handling, &model.assembly))
    }

    /// Prepares only the loads of ordinary use.
    pub(super) fn of_uses(handling: &Handling, model: &'a PlanModel) -> Result<Self, SparseError> {
        let mut cases = load_cases(handling, &model.assembly);
        cases.retain(|c| Rank::of(&c.deed) == Rank::Use);
        Self::of(handling, model, cases)
    }

    fn of(handling: &Handling, model: &'a PlanModel, cases: Vec<LoadCase>) -> Result<Self, SparseError> {
        let surface = model.surface_model()?;
        let drifts = cases
            .par_iter()
            .map(|case| surface.drift(&case.forces_n))
            .collect();
        let ranks = cases
            .iter()
            .map(|c| Rank::of(&c.deed))
            .chain([Rank::Pull])
            .collect();
        Ok(Self {
            model,
            surface,
            cases,
            drifts,
            strength_mpa: handling.material.strength_mpa,
            ranks,
        })
    }

    /// Least load factor of a plan in use, which is its score.
    pub fn least_use(&self, plan: &LatticePlan) -> Result<f64, SparseError> {
        let meetings = self.model.meetings(plan);
        let joined = self.surface.join(&meetings)?;
        let uses = self
            .drifts
            .iter()
            .zip(&self.ranks)
            .filter(|(_, rank)| **rank == Rank::Use);
        uses.map(|(load, _)| {
            let (bearing, _) = joined.bear(&meetings, load, None)?;
            Ok(load_factor(&meetings, &bearing, self.strength_mpa).factor)
        })
        .try_fold(f64::INFINITY, |least, factor| Ok(least.min(factor?)))
    }

    /// Solves all goals of a plan.
    pub fn rate(&self, ranked: RankedPlan) -> Result<Rated<'_>, SparseError> {
        let mut rated = self.begun(ranked, None)?;
        for goal in 0..self.ranks.len() {
            rated.ask(goal, None)?;
        }
        Ok(rated)
    }

    /// A plan with no goal solved yet; starts `from` a similar plan, if given.
    pub(super) fn begun<'b>(
        &'b self,
        ranked: RankedPlan,
        from: Option<&Rated<'b>>,
    ) -> Result<Rated<'b>, SparseError> {
        let meetings = self.model.meetings(&ranked.plan);
        let joined = from.map_or_else(|| self.surface.join(&meetings), |f| f.parts.rejoin(&meetings))?;
        Ok(Rated {
            candidate: ranked,
            meetings,
            bench: self,
            answers: vec![None; self.ranks.len()],
            parts: joined,
        })
    }

    /// Indices of the goals of a rank.
    pub(super) fn goals(&self, rank: Rank) -> Vec<usize> {
        (0..self.ranks.len()).filter(|g| self.ranks[*g] == rank).collect()
    }
}

impl<'b> Rated<'b> {
    /// Least load factor in use; infinite where nothing fails.
    pub fn least(&self) -> f64 {
        let uses = self.bench.goals(Rank::Use);
        uses.into_iter()
            .map(|g| self.factor(g))
            .fold(f64::INFINITY, f64::min)
    }

    /// Returns true if the plan withstands enough in every use.
    pub(super) fn bears_enough(&self) -> bool {
        self.least() >= ENOUGH
    }

    /// Load factors of the plan, in the order of the bench's cases; infinite for those not solved.
    pub fn load_factors(&self) -> Vec<Borne> {
        (0..self.bench.cases.len())
            .map(|goal| self.answer(goal))
            .collect()
    }

    fn answer(&self, goal: usize) -> Borne {
        self.answers[goal].as_ref().map_or(Borne::ANY, |a| a.load_factor)
    }

    /// Load factor of a goal; infinite where it was not solved.
    pub(super) fn factor(&self, goal: usize) -> f64 {
        self.answer(goal).factor
    }

    /// Station of the first failure under a goal.
    pub(super) fn station(&self, goal: usize) -> Option<u32> {
        self.answer(goal).first.map(|f| f.1)
    }

    /// Solves a goal, unless already solved; returns true if it was solved now. The solution starts from that
    /// of `like`, a similar plan.
    pub(super) fn ask(&mut self, goal: usize, like: Option<&Rated<'b>>) -> Result<bool, SparseError> {
        if self.answers[goal].is_some() {
            return Ok(false);
        }
        let start = like.and_then(|l| l.answers[goal].as_ref()).map(|a| &a.closure);
        let (meetings, bench) = (&self.meetings, self.bench);
        let (borne, closed) = match bench.drifts.get(goal) {
            Some(load) => {
                let (bearing, closed) = self.parts.bear(meetings, load, start)?;
                (load_factor(meetings, &bearing, bench.strength_mpa), closed)
            }
            None => {
                let (opening, closed) = self.parts.pull(meetings, start)?;
                (Borne::of_pull(&opening), closed)
            }
        };
        self.answers[goal] = Some(Answer {
            load_factor: borne,
            closure: closed,
        });
        Ok(true)
    }

    /// Least load factor of a rank.
    pub(super) fn least_of(&self, rank: Rank) -> f64 {
        self.factors(rank).first().copied().unwrap_or(f64::INFINITY)
    }

    /// Load factors of a rank, ascending; each is capped at the value that is enough.
    pub(super) fn factors(&self, rank: Rank) -> Vec<f64> {
        let capped = |g| self.factor(g).min(rank.enough());
        let mut factors: Vec<f64> = self.bench.goals(rank).into_iter().map(capped).collect();
        factors.sort_by(f64::total_cmp);
        factors
    }

    /// Displacement of each point of the outer surface under a case, mm.
    pub(super) fn moved_mm(&self, case: usize) -> Result<Vec<Vec3>, SparseError> {
        let forces_n = &self.bench.cases[case].forces_n;
        let closed = self.answers[case].as_ref().map(|a| &a.closure);
        self.parts.moved_mm(forces_n, closed)
    }

    /// Goals of a rank with less than enough, worst first.
    pub(super) fn worst_first(&self, rank: Rank) -> Vec<usize> {
        let mut goals = self.bench.goals(rank);
        goals.retain(|g| self.factor(*g) < rank.enough());
        goals.sort_by(|a, b| self.factor(*a).total_cmp(&self.factor(*b)));
        goals
    }
}

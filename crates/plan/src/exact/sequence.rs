//! An assembly order that satisfies every condition, from decided directions and seams.

use std::collections::HashSet;

use shellock_assembly::LatticeDirection;
use shellock_report::PatchId;

use super::super::space::Space;
use super::domains::Domains;
use crate::{LatticePlan, LatticeStep, PieceSet};

/// Sets of remaining pieces to examine before the question is left open.
const MOST_SETS: usize = 4000;

/// Result of the search for an order.
pub(super) enum Sequence {
    Plan(LatticePlan),
    /// No such order exists.
    None,
    /// Too many orders to try.
    Unknown,
}

struct Sequencer<'a> {
    space: &'a Space<'a>,
    d: &'a Domains,
    limit: f64,
    separations: Vec<LatticeDirection>,
    removals: Vec<LatticeStep>,
    /// Sets of remaining pieces from which no order was found; used only for membership tests.
    dead: HashSet<PieceSet>,
}

/// Finds an order compatible with `d`, in which each piece has one role and each seam one state.
pub(super) fn sequence(space: &Space<'_>, d: &Domains, limit: f64) -> Sequence {
    let separation = |p: usize| {
        let outwards = LatticeDirection::nearest(space.survey.mean_normal[PatchId::from(p)]);
        d.roles[p]
            .iter()
            .next()
            .and_then(|role| role.separation())
            .unwrap_or(outwards)
    };
    let separations = (0..space.n).map(separation).collect();
    let mut s = Sequencer {
        space,
        d,
        limit,
        separations,
        removals: Vec::new(),
        dead: HashSet::new(),
    };
    if !s.descend(space.all()) {
        return if s.dead.len() < MOST_SETS {
            Sequence::None
        } else {
            Sequence::Unknown
        };
    }
    s.removals.reverse();
    let plan = LatticePlan { steps: s.removals };
    // Relations are the same for all orders, so if one is rejected, all are.
    if space.allows(&plan) {
        Sequence::Plan(plan)
    } else {
        Sequence::None
    }
}

impl Sequencer<'_> {
    fn descend(&mut self, left: PieceSet) -> bool {
        if left.is_empty() {
            return true;
        }
        if self.dead.len() >= MOST_SETS || self.dead.contains(&left) {
            return false;
        }
        for p in left.iter() {
            let rest = left.minus(PieceSet::one(p));
            if self.may_leave(p, rest) {
                self.removals.push(LatticeStep {
                    piece: p,
                    separation: self.separations[usize::from(p)],
                });
                if self.descend(rest) {
                    return true;
                }
                self.removals.pop();
            }
        }
        self.dead.insert(left);
        false
    }

    fn may_leave(&self, p: PatchId, rest: PieceSet) -> bool {
        let step = LatticeStep {
            piece: p,
            separation: self.separations[usize::from(p)],
        };
        if !self.d.before[usize::from(p)].and(rest).is_empty()
            || !rest.is_connected(&self.space.neighbours)
            || (!rest.is_empty() && !self.space.is_free(p, step.separation, rest))
        {
            return false;
        }
        let gone: Vec<Option<LatticeDirection>> = (0..self.space.n)
            .map(|q| (!rest.contains(q.into()) && q != usize::from(p)).then(|| self.separations[q]))
            .collect();
        let (role, around) = self.space.departure(step, rest, &gone);
        self.space.costs.bound(p, role, &around) <= self.limit
    }
}

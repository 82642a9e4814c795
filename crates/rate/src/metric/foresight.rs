//! Predicted play and hold of the pieces of each plan that a search found, before any of them is simulated.

use std::collections::BTreeMap;

use rayon::prelude::*;
use shellock_assembly::motion::{Contact, LOOSE, RelativePlay, SLIGHT};
use shellock_plan::interface::{Interface, pin_contacts, wall_contacts};
use shellock_plan::score::ASKED_MM3;
use shellock_plan::{FoundPlan, LatticePlan, PlanParams, RankedPlan};
use shellock_report::PatchId;

use super::question::Choice;
use super::{Foreseen, MetricParams, PlanModel, foreseen};

/// Greatest excess of a plan's cost over the least, as a share, with which it may be chosen.
///
/// Costs contain requirements of the verification that the simulation does not know: losses by carving, and
/// how firmly pins hold. With 0.15, three of five kits have load factors of the worst use lower by a tenth to
/// a quarter. With 0.5 one has a third more and the others, up to what is enough, hardly more:
/// docs/notes/metrics.md.
pub(super) const COST_SLACK: f64 = 0.25;

/// Share of the allowed play below which pieces hardly ever rattle. Four of five finished pieces have 0.74 to
/// 1.2 times the predicted play.
const SURE_PLAY: f64 = 0.85;

/// Share of the allowed play above which pieces of a plan are expected to rattle too much. It lies below
/// [`SLIGHT`], since runs may come out shorter than planned.
const LIKELY_RATTLE: f64 = 1.05;

/// Margin of predictions above a limit where runs are known, as a factor. Finished pieces of a cat and a
/// teddy have 0.9 to 1.1 times the play that is then predicted.
const SURE: f64 = 1.05;

/// Hold below which a piece may well come out loose, mm³: five times what the verification requires, since
/// seams lean, and carving takes more off some runs than off others.
const SAFE_MM3: f64 = 5.0 * ASKED_MM3;

/// Predicted play and hold of each piece where the runs of connectors are known.
pub struct Expected {
    key: PatchId,
    foreseen: Foreseen,
    /// Hold of each piece that the plan alone promised, mm³.
    promised_mm3: Vec<f64>,
}

impl Expected {
    /// Pieces but the key that surely rattle too much, the loosest first.
    pub fn rattlers(&self) -> Vec<RelativePlay> {
        loosest_first(self.key, &self.foreseen.excess, SURE * SLIGHT)
    }

    /// Pieces but the key that hardly anything holds against some push.
    ///
    /// Of 283 pieces in 45 kits, 24 had so little hold, and 11 of the 13 pieces that came out loose were
    /// among them (docs/notes/metrics.md).
    fn badly_held(&self) -> impl Iterator<Item = PatchId> + '_ {
        let holds = self.foreseen.holds_mm3.iter().enumerate();
        let little = holds.filter(|(_, mm3)| **mm3 < SAFE_MM3);
        little
            .map(|(i, _)| PatchId::from(i))
            .filter(|piece| *piece != self.key)
    }

    /// Badly held pieces, each with the share of the hold that the plan promised, in [0, 1). Pieces that have
    /// all of it are left out.
    pub fn held_shares(&self) -> Vec<(PatchId, f64)> {
        let share = |piece: PatchId| {
            let of = |mm3: &[f64]| mm3[usize::from(piece)];
            let (has, promised) = (of(&self.foreseen.holds_mm3), of(&self.promised_mm3));
            (has < promised).then(|| (piece, has / promised))
        };
        self.badly_held().filter_map(share).collect()
    }

    /// Pieces but the key whose play no kit may have, the loosest first; then those that are badly held.
    pub fn loose(&self) -> Vec<PatchId> {
        let rattling = loosest_first(self.key, &self.foreseen.excess, SURE * LOOSE);
        let mut loose: Vec<PatchId> = rattling.iter().map(|l| l.piece).collect();
        let others: Vec<PatchId> = self.badly_held().filter(|piece| !loose.contains(piece)).collect();
        loose.extend(others);
        loose
    }
}

/// Relative difference of the widest play up to which plans count as alike.
const PLAY_TIE: f64 = 0.05;

/// Mechanical model of the pieces, and the plans that may be chosen.
pub struct Foresight {
    pub(super) model: PlanModel,
    /// Plans whose pieces are held well enough, with what is foreseen of them.
    plans: Vec<(RankedPlan, Foreseen)>,
    /// Hold that each piece must have, mm³; empty if holds do not count.
    needed_mm3: Vec<f64>,
    /// Seams of the pieces, with their runs of connectors.
    interfaces: Vec<Interface>,
    params: PlanParams,
    /// Share of its foreseen hold that each piece can count on, from plans that were given up.
    held_shares: BTreeMap<PatchId, f64>,
    size_mm: f64,
}

impl Foresight {
    /// Predicts play and hold for those plans of `found` that cost little enough. If a plan was given up
    /// before, since connectors held too little, plans of which that is foreseen are left out, as long as
    /// there are others.
    pub fn of(choice: &Choice<'_>, found: &FoundPlan) -> Self {
        let params = MetricParams::of_plan(choice.params, choice.sizes, choice.handling.material);
        let model = PlanModel::of_even(&params, choice.even, choice.sizes);
        let most_cost = found.score.worst * (1.0 + COST_SLACK);
        let mut foresight = Self {
            model,
            plans: Vec::new(),
            needed_mm3: Vec::new(),
            size_mm: choice.surface.mesh.bounds().size().max_element(),
            interfaces: choice.survey.contacts.clone(),
            params: choice.params.clone(),
            held_shares: choice.constraints.held_shares.clone(),
        };
        let all: Vec<(RankedPlan, Foreseen)> = (found.pool.par_iter())
            .filter(|p| p.score.worst <= most_cost)
            .map(|p| (p.clone(), foresight.play(&p.plan)))
            .collect();
        // The estimate is coarse: if it ruled out plans from the beginning, more kits would be lost than won
        // (docs/notes/metrics.md).
        if !foresight.held_shares.is_empty() {
            foresight.needed_mm3 = needed_mm3(all.iter().map(|(p, f)| (p.plan.key(), &f.holds_mm3[..])));
        }
        foresight.plans = all.into_iter().filter(|(_, f)| foresight.is_held(f)).collect();
        foresight
    }

    fn is_held(&self, foreseen: &Foreseen) -> bool {
        let mut holds = foreseen.holds_mm3.iter().zip(&self.needed_mm3);
        holds.all(|(mm3, needed)| mm3 >= needed)
    }

    /// Predicted play of each piece in a plan.
    pub(super) fn play(&self, plan: &LatticePlan) -> Foreseen {
        let mut foreseen = self.play_with(plan, &pin_contacts(&self.params, &self.interfaces, plan));
        for (piece, share) in &self.held_shares {
            foreseen.holds_mm3[usize::from(*piece)] *= share;
        }
        foreseen
    }

    /// Predicted play of each piece in a plan whose connectors touch at `joints`.
    fn play_with(&self, plan: &LatticePlan, joints: &[Contact]) -> Foreseen {
        let mut contacts = wall_contacts(&self.params, &self.interfaces, plan);
        contacts.extend(joints);
        let clearance_mm = self.params.clearance_mm;
        foreseen(&self.model, plan, &contacts, clearance_mm, self.size_mm)
    }

    /// Predicted play and hold in a plan whose connectors touch at `joints`.
    pub fn expect(&self, plan: &LatticePlan, joints: &[Contact]) -> Expected {
        Expected {
            key: plan.key(),
            foreseen: self.play_with(plan, joints),
            promised_mm3: self
                .play_with(plan, &pin_contacts(&self.params, &self.interfaces, plan))
                .holds_mm3,
        }
    }

    /// Pieces but the key that are expected to rattle too much even in the plan whose loosest piece has the
    /// least play, the loosest first.
    pub fn rattlers(&self) -> Vec<RelativePlay> {
        let steadiest = self.steadiest();
        steadiest.map_or_else(Vec::new, |(plan, excess)| {
            loosest_first(plan.plan.key(), excess, LIKELY_RATTLE)
        })
    }

    /// The plan whose loosest piece has the least play, the first of equals, with the play of each piece as a
    /// share of the allowed play.
    pub fn steadiest(&self) -> Option<(&RankedPlan, &[f64])> {
        let steadiest = (self.plans.iter()).min_by(|a, b| widest(&a.1).total_cmp(&widest(&b.1)))?;
        Some((&steadiest.0, &steadiest.1.excess))
    }

    /// Plans with about the least play.
    pub(super) fn steady(&self) -> Vec<RankedPlan> {
        let most = self.most();
        let steady = self.plans.iter().filter(|p| widest(&p.1) <= most);
        steady.map(|p| p.0.clone()).collect()
    }

    /// Returns true if a plan has about the least play, and its pieces are held well enough.
    pub(super) fn is_steady(&self, plan: &LatticePlan) -> bool {
        let foreseen = self.play(plan);
        self.is_held(&foreseen) && widest(&foreseen) <= self.most()
    }

    fn most(&self) -> f64 {
        let least = self
            .plans
            .iter()
            .map(|p| widest(&p.1))
            .fold(f64::INFINITY, f64::min);
        least * (1.0 + PLAY_TIE)
    }
}

/// Hold that each piece of a plan must have, mm³: what counts as held, or as much as in the plan that lacks
/// least. `plans` gives the key of each plan, which needs no hold, and the holds of its pieces.
fn needed_mm3<'a>(plans: impl Iterator<Item = (PatchId, &'a [f64])>) -> Vec<f64> {
    let capped = |(key, holds): (PatchId, &[f64])| -> Vec<f64> {
        let mut capped: Vec<f64> = holds.iter().map(|mm3| mm3.min(SAFE_MM3)).collect();
        capped[usize::from(key)] = 0.0;
        capped
    };
    let sum = |holds: &Vec<f64>| holds.iter().sum::<f64>();
    // The first of equals.
    let best = plans
        .map(capped)
        .reduce(|best, other| match sum(&other) > sum(&best) {
            true => other,
            false => best,
        });
    best.unwrap_or_default()
}

/// Play of the loosest piece, as a share of the allowed play; at least the share that surely passes.
fn widest(foreseen: &Foreseen) -> f64 {
    foreseen.excess.iter().copied().fold(SURE_PLAY, f64::max)
}

/// Pieces but the key with a wider play than `most`, the loosest first; play is a share of the allowed play.
fn loosest_first(key: PatchId, excess: &[f64], most: f64) -> Vec<RelativePlay> {
    let of_piece = |(i, excess): (usize, &f64)| RelativePlay {
        piece: PatchId::from(i),
        excess: *excess,
    };
    let all = excess.iter().enumerate().map(of_piece);
    let mut wide: Vec<RelativePlay> = all.filter(|p| p.excess > most && p.piece != key).collect();
    wide.sort_by(|a, b| b.excess.total_cmp(&a.excess));
    wide
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plans_need_the_hold_of_the_one_that_lacks_least_and_keys_need_none() {
        let firm = 3.0 * SAFE_MM3;
        let needed = |plans: &[(u32, [f64; 3])]| {
            needed_mm3(plans.iter().map(|(key, holds)| (PatchId(*key), &holds[..])))
        };
        assert_eq!(
            needed(&[(2, [firm, 1.0, 0.0]), (2, [firm, firm, 0.0])]),
            [SAFE_MM3, SAFE_MM3, 0.0]
        );
        assert_eq!(
            needed(&[(0, [0.0, 1.0, firm]), (0, [0.0, 0.2, firm])]),
            [0.0, 1.0, SAFE_MM3]
        );
        assert!(needed(&[]).is_empty());
    }

    #[test]
    fn pieces_with_much_play_or_little_hold_are_loose_but_for_the_key() {
        let expected = Expected {
            key: PatchId(0),
            foreseen: Foreseen {
                play: vec![[0.0; 2]; 4],
                excess: vec![9.0, 1.0, 2.0 * LOOSE, 1.0],
                holds_mm3: vec![0.0, 0.5 * SAFE_MM3, 0.0, 2.0 * SAFE_MM3],
            },
            promised_mm3: vec![0.0, 2.0 * SAFE_MM3, 0.0, 3.0 * SAFE_MM3],
        };
        assert_eq!(expected.loose(), [PatchId(2), PatchId(1)]);
        assert_eq!(expected.held_shares(), [(PatchId(1), 0.25)]);
    }
}

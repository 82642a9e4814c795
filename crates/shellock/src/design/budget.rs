//! What a job may cost: one table for all its bounds.

use std::sync::atomic::Ordering::Relaxed;
use std::sync::atomic::{AtomicBool, AtomicU64};

use serde::{Deserialize, Serialize};

use super::{Params, Rounds, Thickness};
use crate::Ctx;
use crate::sizes::SizeChoice;

/// Kits that are made for each of the best places for a key, before one of the pieces becomes the key: where
/// the best does not do, others seldom do.
pub(super) const KITS_OF_CUT_KEYS: [usize; 3] = [3, 2, 2];
/// Kits made for one division and divisions revised, with a key that was cut.
const KITS_WITH_CUT_KEY: usize = 2;
const REVISIONS_WITH_CUT_KEY: usize = 1;
/// Keys whose kits fail by pieces that rattle alone before no others are cut.
pub(super) const RATTLING_KEYS: usize = 2;
/// How often pieces are joined because they rattle in a kit that was made and is sound else.
const JOININGS_OF_RATTLING: usize = 2;
/// How often pieces are joined because they are foreseen to rattle, which costs a search for a plan each time
/// and no kit.
const JOININGS_FORESEEN: usize = 5;
/// Plans of one division that may be given up because a piece could not take its wall along; they cost
/// seconds.
pub(super) const BLOCKED_PLANS: usize = 8;

/// How often connectors grow and pieces are joined because the plan that bears most bears less than asked; each
/// costs a search for a plan and no kit.
const LARGER_CONNECTORS: usize = 2;
const WEAK_JOININGS: usize = 1;
/// How many times a kit is to bear what people do to it, by the surface model, which knows no play: a reserve for
/// that (docs/notes/stress-test.md). Where no kit passes with the wall that it takes, once will do.
pub(super) const RESERVE: f64 = 1.4;
/// What is tried with pieces that are cut where a person would before pieces of similar size are.
pub(super) const ROUNDS_BESIDE_OTHERS: Rounds = Rounds {
    kits: 1,
    refinements: 1,
    kits_in_all: 2,
};
/// How often a job begins anew with a thicker wall for the same reason.
pub(super) const THICKER_WALLS: usize = 2;

/// What may still be changed so that a kit bears more, before it is made.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Levers {
    /// The load factor below which they are used.
    pub asked: f64,
    /// How often connectors may grow.
    pub connectors: usize,
    /// Whether the wall may.
    pub wall: bool,
    /// How often pieces that part may be joined.
    pub weak_joinings: usize,
}

impl Levers {
    /// Those that the user leaves to us: what is set stays as it is.
    pub fn of(params: &Params, has_labels: bool, may_thicken: bool, asked: f64) -> Self {
        let grows = matches!(params.connector.size, SizeChoice::Auto(_));
        Self {
            asked,
            connectors: if grows { LARGER_CONNECTORS } else { 0 },
            wall: may_thicken && params.thickness == Thickness::Auto,
            weak_joinings: if has_labels { 0 } else { WEAK_JOININGS },
        }
    }
}

/// What a job has cost so far, in work and not in time: the same on any machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Effort {
    /// Places for a key that were tried; a piece as the key counts as one.
    pub keys: usize,
    /// Divisions into pieces that plans were searched for; the same pieces with other connectors count once.
    pub segmentations: usize,
    /// Plans that were searched for.
    pub plans: usize,
    /// Kits that were made and judged.
    pub kits: usize,
}

/// How long kits of this job take, by the context's clock; nothing where it has none.
#[derive(Debug, Default)]
pub(super) struct Pace {
    /// The slowest kit, s, as bits.
    slowest: AtomicU64,
    /// True where something was left out for want of time.
    is_cut_short: AtomicBool,
}

impl Pace {
    /// What a kit's files and gaps take on top of it, as a share of it, and what kits differ.
    const MORE: f64 = 1.5;

    /// A kit was begun with so many seconds left.
    pub fn made(&self, ctx: &Ctx, left_before_s: f64) {
        let took_s = left_before_s - ctx.seconds_left();
        if took_s.is_finite() {
            let slowest_s = f64::from_bits(self.slowest.load(Relaxed)).max(took_s);
            self.slowest.store(slowest_s.to_bits(), Relaxed);
        }
    }

    /// The slowest kit so far, s.
    pub fn slowest_s(&self) -> f64 {
        f64::from_bits(self.slowest.load(Relaxed))
    }

    /// Whether a kit that takes as long as the slowest would end too late.
    pub fn is_over(ctx: &Ctx, slowest_s: f64) -> bool {
        ctx.seconds_left() < Self::MORE * slowest_s || ctx.seconds_left() <= 0.0
    }

    /// Whether another kit would end too late. Before the first, only whether the time is over.
    pub fn is_late(&self, ctx: &Ctx) -> bool {
        Self::is_over(ctx, self.slowest_s())
    }

    /// Records that `what` is left out for want of time.
    pub fn skip(&self, ctx: &Ctx, what: &str) {
        ctx.note(&format!("no time is left for {what}"));
        self.is_cut_short.store(true, Relaxed);
    }

    /// True where something was left out for want of time.
    pub fn is_cut_short(&self) -> bool {
        self.is_cut_short.load(Relaxed)
    }
}

impl std::ops::AddAssign for Effort {
    fn add_assign(&mut self, other: Self) {
        self.keys += other.keys;
        self.segmentations += other.segmentations;
        self.plans += other.plans;
        self.kits += other.kits;
    }
}

/// What is left to one candidate for a key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Budget {
    /// Kits of one division, at most.
    pub kits_each: usize,
    /// Kits of all divisions that may still be made.
    pub kits: usize,
    /// Divisions that may still be revised for what failed, and how many there were at first.
    pub revisions: usize,
    revisions_at_first: usize,
    /// How often pieces that rattle may still be joined.
    pub joinings: usize,
    /// How often pieces that are foreseen to rattle may still be joined.
    pub foreseen_joinings: usize,
    /// What may still be changed for the sake of use.
    pub levers: Levers,
    /// What it has cost.
    pub spent: Effort,
}

impl Budget {
    /// Of the `i`-th place for a key that is cut.
    pub fn of_cut_key(rounds: &Rounds, i: usize) -> Self {
        Self {
            kits_each: rounds.kits.min(KITS_WITH_CUT_KEY),
            kits: rounds.kits_in_all.min(KITS_OF_CUT_KEYS[i]),
            ..Self::with(rounds, rounds.refinements.min(REVISIONS_WITH_CUT_KEY))
        }
    }

    /// Of a key that is one of the pieces.
    pub fn of_piece(rounds: &Rounds) -> Self {
        Self::with(rounds, rounds.refinements)
    }

    /// The same with what may be changed before a kit is made.
    pub fn with_levers(self, levers: Levers) -> Self {
        Self { levers, ..self }
    }

    fn with(rounds: &Rounds, revisions: usize) -> Self {
        Self {
            kits_each: rounds.kits,
            kits: rounds.kits_in_all,
            revisions,
            revisions_at_first: revisions,
            joinings: JOININGS_OF_RATTLING,
            foreseen_joinings: JOININGS_FORESEEN,
            levers: Levers::default(),
            spent: Effort {
                keys: 1,
                ..Effort::default()
            },
        }
    }

    /// True where pieces may be revised and a kit be made of them. Pieces that only rattle are joined, others are divided
    /// or united.
    pub fn may_revise(&self, rattles: bool) -> bool {
        let left = if rattles { self.joinings } else { self.revisions };
        left > 0 && self.kits > 0
    }

    /// Takes off one revision of that kind.
    pub fn revise(&mut self, rattles: bool) {
        if rattles {
            self.joinings -= 1;
        } else {
            self.revisions -= 1;
        }
    }

    /// Whether half of the revisions are gone.
    pub fn is_half_gone(&self) -> bool {
        2 * (self.revisions_at_first - self.revisions) >= self.revisions_at_first
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kit_is_begun_only_where_one_and_a_half_as_slow_as_the_slowest_are_in_time() {
        static STOP: AtomicBool = AtomicBool::new(false);
        let left_s = AtomicU64::new(60);
        let seconds_left = || left_s.load(Relaxed) as f64;
        let ctx = Ctx::new(&|_| {}, &STOP).with_deadline(&seconds_left);
        let pace = Pace::default();
        assert!(!pace.is_late(&ctx), "nothing is known yet");
        left_s.store(40, Relaxed);
        pace.made(&ctx, 60.0);
        assert!(!pace.is_late(&ctx));
        left_s.store(29, Relaxed);
        assert!(pace.is_late(&ctx));
        assert!(!pace.is_cut_short(), "a question changes nothing");
        pace.skip(&ctx, "another kit");
        assert!(pace.is_cut_short());
    }

    #[test]
    fn pieces_are_revised_while_a_kit_and_a_revision_of_their_kind_are_left() {
        let all = Budget::of_piece(&Rounds::default());
        let none = Budget { kits: 0, ..all };
        let (no_joinings, no_revisions) = (Budget { joinings: 0, ..all }, Budget { revisions: 0, ..all });
        for (budget, may) in [
            (all, [true, true]),
            (none, [false, false]),
            (no_joinings, [false, true]),
            (no_revisions, [true, false]),
        ] {
            assert_eq!([true, false].map(|rattles| budget.may_revise(rattles)), may);
        }
    }

    #[test]
    fn what_the_user_sets_is_not_changed_for_the_sake_of_use() {
        let ours = Params {
            thickness: Thickness::Auto,
            connector: crate::connector::ConnectorParams {
                size: SizeChoice::Auto(Default::default()),
                ..Default::default()
            },
            ..Params::default()
        };
        let all = Levers::of(&ours, false, true, 1.0);
        assert!(all.connectors > 0 && all.wall && all.weak_joinings > 0);
        assert_eq!(Levers::of(&Params::default(), true, true, 0.0), Levers::default());
        assert!(!Levers::of(&ours, false, false, 1.0).wall);
    }

    #[test]
    fn without_a_clock_nothing_is_late() {
        let (ctx, pace) = (Ctx::quiet(), Pace::default());
        pace.made(&ctx, ctx.seconds_left());
        assert!(!pace.is_late(&ctx));
    }
}

//! What a job may cost: one table for all its bounds.

use serde::{Deserialize, Serialize};

use super::Rounds;

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

/// What a job has cost so far, in work and not in time: the same on any machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Effort {
    /// Places for a key that were tried; a piece as the key counts as one.
    pub keys: usize,
    /// Divisions into pieces.
    pub segmentations: usize,
    /// Plans that were searched for.
    pub plans: usize,
    /// Kits that were made and judged.
    pub kits: usize,
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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

    fn with(rounds: &Rounds, revisions: usize) -> Self {
        Self {
            kits_each: rounds.kits,
            kits: rounds.kits_in_all,
            revisions,
            revisions_at_first: revisions,
            joinings: JOININGS_OF_RATTLING,
            foreseen_joinings: JOININGS_FORESEEN,
            spent: Effort {
                keys: 1,
                ..Effort::default()
            },
        }
    }

    /// Whether half of the revisions are gone.
    pub fn is_half_gone(&self) -> bool {
        2 * (self.revisions_at_first - self.revisions) >= self.revisions_at_first
    }
}

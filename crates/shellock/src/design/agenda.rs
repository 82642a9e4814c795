//! The agenda: what is tried next, how often, and until when.
//!
//! A trial is one division of the model with one key, one wall and one set of connectors. Its result offers
//! changes. The agenda takes the first one that [`table::TABLE`] still allows and for which time is left. If
//! there is none, it goes outwards: the next key, then less load, then the next way to divide. No geometry is
//! needed to know the order, so a text file keeps it (`agenda/order.txt`).
//!
//! ```text
//!  way ─► load asked ─► wall ─► key ─► division ─► plan ─► kit
//!   ▲         ▲          ▲       ▲        ▲          ▲      │
//!   └─────────┴──────────┴───────┴────────┴──────────┴──────┘
//!      a step begins its level anew, and all levels within
//! ```

mod clock;
mod table;
#[cfg(test)]
mod tests;

use clock::Clock;
use serde::{Deserialize, Serialize};
pub(super) use table::Step;
use table::{ANY, Level, TABLE};

use super::cost::Cost;
use super::ways::{Input, Walls, Way, ways};
use super::{Params, Rounds, Thickness, WallChoice};
use crate::Ctx;
use crate::metric::RESERVE;
use crate::motion::SLIGHT;
use crate::sizes::SizeChoice;

/// Number of places at which a key is cut before a piece becomes the key: if the best place fails, others
/// seldom help.
pub(super) const CUT_KEYS: usize = 3;
/// Keys whose kits fail by rattling alone, after which no others are tried: another key changes little.
const RATTLING_KEYS: usize = 2;
/// Load factor at which a kit withstands its loads, but has no reserve. It is asked for if no kit passes with
/// the wall that [`RESERVE`] takes.
const ONCE: f64 = 1.0;
/// Bounds of every way to divide but the last one.
const ROUNDS_BESIDE_OTHERS: Rounds = Rounds {
    kits: 1,
    refinements: 1,
    kits_in_all: 2,
};
/// Bounds of a job whose wall is thicker for the sake of use: if its kit fails, the wall becomes thin again.
const ROUNDS_WITH_THICK_WALL: Rounds = Rounds {
    kits: 1,
    refinements: 0,
    kits_in_all: 1,
};

/// Most kits with each of the places for a key that is cut.
const KITS_OF_CUT_KEYS: [usize; CUT_KEYS] = [3, 2, 2];

/// Answer to a step that a trial would offer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Permit {
    Yes,
    No,
    /// Allowed by the table, but it would end too late.
    Late,
}

/// Permits of one trial: it computes no change that is not allowed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Allowance {
    permits: [Permit; TABLE.len()],
    /// Load factor below which changes are sought.
    pub least_factor: f64,
    /// True if a hopeless climb may end early for a change. After the wall was thickened, few changes are
    /// left, so they must be right.
    pub may_end_climb: bool,
    /// True if half of the divisions are used up, and no kit was made: a piece that blocks plans is then
    /// joined.
    pub is_hopeless: bool,
    /// True if kits may be given up before they are finished.
    may_stop: bool,
    /// True if another kit is allowed with the present key.
    has_kits: bool,
    /// Time to keep back for the kit while its plan is improved, s.
    pub kit_reserve_s: f64,
    /// Time without which the kit is not begun, s.
    pub least_kit_s: f64,
}

impl Allowance {
    pub fn permit(&self, step: Step) -> Permit {
        self.permits[step as usize]
    }

    pub fn is_allowed(&self, step: Step) -> bool {
        self.permit(step) == Permit::Yes
    }

    /// Returns true if a kit may be given up before it is finished, for the sake of a step. Another plan of
    /// the same pieces counts by itself, not as a kit.
    pub fn may_stop_for(&self, step: Step) -> bool {
        let has_kits = self.has_kits || step == Step::Reconnect;
        self.may_stop && has_kits && self.is_allowed(step)
    }

    /// An allowance of these steps alone.
    #[cfg(test)]
    pub fn only(self, steps: &[(Step, Permit)]) -> Self {
        let permit = |row: table::Row| {
            let own = steps.iter().find(|(step, _)| *step == row.step);
            own.map_or(Permit::No, |(_, permit)| *permit)
        };
        Self {
            permits: TABLE.map(permit),
            ..self
        }
    }

    /// Returns true if the table allows a step, whether or not there is time for it.
    pub fn is_wanted(&self, step: Step) -> bool {
        self.permit(step) != Permit::No
    }

    /// Returns the step if a lack of time rules it out.
    pub fn late(&self, step: Step) -> Option<Step> {
        (self.permit(step) == Permit::Late).then_some(step)
    }
}

/// Grade of a kit. The one rule by which two kits are compared: fewer failures, then less rattling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grade {
    /// Number of pieces; it does not count in comparisons.
    pub n_pieces: usize,
    pub n_failures: usize,
    /// Largest play of a piece relative to what is allowed; 0 if none rattles.
    pub rattle: f64,
    /// True if pieces rattle more than slightly and nothing else is wrong.
    pub only_rattles: bool,
    /// True if another piece than the key rattles more than slightly.
    pub others_rattle: bool,
}

impl Grade {
    /// Grade of an end with which no fault can be found, such as a plan where only a plan is sought.
    pub const PERFECT: Self = Self {
        n_pieces: 0,
        n_failures: 0,
        rattle: 0.0,
        only_rattles: false,
        others_rattle: false,
    };

    pub fn is_better_than(&self, other: &Self) -> bool {
        (self.n_failures, self.rattle) < (other.n_failures, other.rattle)
    }

    fn passes(&self) -> bool {
        self.n_failures == 0
    }

    fn is_firm(&self) -> bool {
        self.passes() && self.rattle <= SLIGHT
    }
}

/// Result of one trial, without geometry.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Report {
    /// Grade of the kit, if one was made.
    pub kit: Option<Grade>,
    /// Changes that it offers, most promising first.
    pub offers: Vec<Step>,
    /// Change that it would have offered if more time were left.
    pub late: Option<Step>,
    /// True if the plan would have been improved further if more time were left.
    pub is_hurried: bool,
    /// True if a kit was given up before it was finished.
    pub is_stopped: bool,
}

/// Cost of a job in work, which is the same on any machine, and the list of what was tried.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Effort {
    /// Places for a key that were tried; a piece as the key counts as one.
    pub keys: usize,
    /// Divisions into pieces that plans were sought for; other connectors in the same pieces do not count.
    pub segmentations: usize,
    /// Plans that were sought.
    pub plans: usize,
    /// Kits that were made and judged.
    pub kits: usize,
    /// Steps that were taken, in order, in words for people.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub steps: Vec<String>,
}

impl Effort {
    /// Returns the cost of two runs of a job, one after the other.
    pub(super) fn and(mut self, then: Self) -> Self {
        self.keys += then.keys;
        self.segmentations += then.segmentations;
        self.plans += then.plans;
        self.kits += then.kits;
        self.steps.extend(then.steps);
        self
    }
}

/// Order of trials, with the counts and the clock that decide it.
pub(super) struct Agenda {
    ways: Vec<Way>,
    rounds: Rounds,
    /// Steps that the user's parameters rule out.
    forbidden: Vec<Step>,
    counts: [usize; TABLE.len()],
    /// Kits begun with the present key.
    n_kits: usize,
    /// Places for a key, of which the last is a piece as it is.
    n_keys: usize,
    /// Best kit with the present wall.
    best: Option<Grade>,
    /// Best kit with the present key.
    of_key: Option<Grade>,
    /// Cut keys of the present wall, before the present one, whose best kits only rattle.
    n_rattling: usize,
    /// True if kits may be given up before they are finished.
    may_stop: bool,
    /// True if a kit was given up before it was finished.
    has_stopped: bool,
    clock: Clock,
    steps: Vec<Step>,
}

impl Agenda {
    /// Agenda of a whole job.
    pub fn new(ctx: &Ctx, input: &Input<'_>) -> Self {
        let params = input.params;
        let mut forbidden = Vec::new();
        if !matches!(params.connector.size, SizeChoice::Auto(_)) {
            forbidden.push(Step::Enlarge);
        }
        if params.thickness != Thickness::Auto || params.wall == WallChoice::Light {
            forbidden.push(Step::Thicken);
        }
        if input.labels.is_some() {
            forbidden.push(Step::JoinWeak);
        }
        Self::with(clock(ctx, params), ways(input), params.rounds, forbidden)
    }

    /// Agenda that only goes from key to key.
    pub fn of_keys(ctx: &Ctx, input: &Input<'_>) -> Self {
        let others = TABLE.map(|row| row.step).into_iter();
        let forbidden = others.filter(|step| *step != Step::NextKey).collect();
        Self::with(
            clock(ctx, input.params),
            ways(input),
            input.params.rounds,
            forbidden,
        )
    }

    fn with(clock: Clock, ways: Vec<Way>, rounds: Rounds, forbidden: Vec<Step>) -> Self {
        Self {
            ways,
            rounds,
            forbidden,
            counts: [0; TABLE.len()],
            n_kits: 0,
            n_keys: 0,
            best: None,
            of_key: None,
            n_rattling: 0,
            may_stop: true,
            has_stopped: false,
            clock,
            steps: Vec::new(),
        }
    }

    /// The agenda with every kit that is begun finished.
    pub fn without_stops(self) -> Self {
        Self {
            may_stop: false,
            ..self
        }
    }

    /// True if a kit was given up before it was finished, since other pieces or another plan promised less
    /// play.
    pub fn has_stopped_kits(&self) -> bool {
        self.has_stopped
    }

    /// Present way to divide.
    pub fn way(&self) -> Way {
        self.ways[self.count(Step::NextWay)]
    }

    /// Number of the present place for the key, from 0.
    pub fn key(&self) -> usize {
        self.count(Step::NextKey)
    }

    /// Sets the number of places for a key, once the model is divided.
    pub fn set_keys(&mut self, n_keys: usize) {
        self.n_keys = n_keys;
    }

    /// Measures the first wall, which tells how fast the machine is.
    pub fn end_first_wall(&mut self, ctx: &Ctx, thickness: Thickness) {
        self.clock.end_first_wall(ctx, thickness == Thickness::Auto);
    }

    /// Learns what is expected of the present pieces.
    pub fn foresee(&mut self, ctx: &Ctx, cost: Cost) {
        self.clock.foresee(ctx, cost);
    }

    /// Time that the job needs for its first kit, s; `None` where its pieces are not known.
    pub fn needed_s(&self, ctx: &Ctx) -> Option<f64> {
        self.clock.needed_s(ctx)
    }

    /// Rules a step out until its count begins anew, since it could not be made.
    pub fn forgo(&mut self, step: Step) {
        self.counts[step as usize] = ANY;
    }

    /// True if a trial was left out for want of time.
    pub fn is_cut_short(&self) -> bool {
        self.clock.is_cut_short
    }

    /// Records that the clock ended the job within a trial.
    pub fn end_late(&mut self) {
        self.clock.is_cut_short = true;
    }

    /// Steps that were taken, in words.
    pub fn words(&self) -> Vec<String> {
        self.steps.iter().map(|step| step.words().to_owned()).collect()
    }

    /// Begins a trial: what it may offer.
    pub fn allowance(&mut self, ctx: &Ctx) -> Allowance {
        self.clock.begin_trial(ctx);
        let n_divided = self.count(Step::Divide);
        Allowance {
            permits: TABLE.map(|row| self.permit(ctx, row.step)),
            least_factor: self.least_factor(),
            may_end_climb: !self.is_wall_thick(),
            is_hopeless: self.n_kits == 0 && 2 * n_divided >= self.limit(Step::Divide),
            may_stop: self.may_stop,
            has_kits: self.n_kits + 1 < self.most_kits(),
            kit_reserve_s: self.clock.kit_reserve_s(),
            least_kit_s: self.clock.least_kit_s(),
        }
    }

    /// The next step after a trial; `None` at the end of the job.
    pub fn next(&mut self, ctx: &Ctx, report: &Report) -> Option<Step> {
        self.clock.count_trial(report.kit.is_some());
        self.clock.is_cut_short |= report.is_hurried;
        if let Some(grade) = report.kit {
            self.count_kit(ctx, grade);
        }
        if report.is_stopped {
            self.has_stopped = true;
            // Another plan of the same pieces has a limit of its own.
            self.n_kits += usize::from(!report.offers.contains(&Step::Reconnect));
        }
        if let Some(step) = report.late {
            self.skip(ctx, step);
        }
        let is_over = self.best.is_some_and(|best| best.is_firm());
        let step = if is_over { None } else { self.choose(ctx, report) };
        if let Some(step) = step {
            self.take(ctx, step);
        }
        step
    }

    /// The first offer that is allowed, else the innermost step outwards.
    fn choose(&mut self, ctx: &Ctx, report: &Report) -> Option<Step> {
        let is_before_kit = report.kit.is_none() && !report.is_stopped;
        let passes = self.best.is_some_and(|best| best.passes());
        let mut outwards = vec![Step::NextKey];
        if !passes && self.count(Step::Thicken) > 0 {
            outwards.push(Step::LowerLoad);
        }
        if !passes {
            outwards.push(Step::NextWay);
        }
        for &step in report.offers.iter().chain(&outwards) {
            // A change before a kit was allowed when its trial began. Without it the trial would end in
            // nothing.
            let permit = match step {
                Step::Enlarge | Step::Lengthen | Step::JoinPredicted | Step::JoinWeak | Step::Thicken
                    if is_before_kit =>
                {
                    self.permit_at_any_time(step)
                }
                // After a kit, longer seams cost another one.
                Step::Lengthen if self.is_late(ctx, Step::JoinRattling) => {
                    match self.permit_at_any_time(step) {
                        Permit::Yes => Permit::Late,
                        permit => permit,
                    }
                }
                _ => self.permit(ctx, step),
            };
            match permit {
                Permit::Yes => return Some(step),
                Permit::Late => self.skip(ctx, step),
                Permit::No => {}
            }
        }
        None
    }

    fn count_kit(&mut self, ctx: &Ctx, grade: Grade) {
        self.clock.end_kit(ctx, grade.n_pieces);
        self.n_kits += 1;
        for best in [&mut self.best, &mut self.of_key] {
            if best.is_none_or(|best| grade.is_better_than(&best)) {
                *best = Some(grade);
            }
        }
    }

    fn take(&mut self, ctx: &Ctx, step: Step) {
        let n_rattling = self.n_rattling_keys();
        self.counts[step as usize] += 1;
        let begins = TABLE[step as usize].begins;
        for row in TABLE.iter().filter(|row| row.within <= begins) {
            self.counts[row.step as usize] = 0;
        }
        if begins >= Level::Key {
            self.n_rattling = n_rattling;
            (self.n_kits, self.of_key) = (0, None);
        }
        if begins >= Level::Wall {
            (self.best, self.n_rattling, self.n_keys) = (None, 0, 0);
            self.clock.begin_wall(ctx);
        }
        if begins >= Level::Way {
            self.clock.begin_way();
        }
        if begins >= Level::Division {
            self.clock.count_division(begins >= Level::Wall);
        }
        self.steps.push(step);
    }

    fn skip(&mut self, ctx: &Ctx, step: Step) {
        ctx.note(&format!("no time is left to {}", step.words()));
        self.clock.is_cut_short = true;
    }

    fn count(&self, step: Step) -> usize {
        self.counts[step as usize]
    }

    fn is_key_cut(&self) -> bool {
        self.count(Step::NextKey) + 1 < self.n_keys
    }

    /// Number of cut keys of the present wall whose best kits only rattle.
    fn n_rattling_keys(&self) -> usize {
        let rattles = |grade: Grade| grade.only_rattles && grade.others_rattle;
        self.n_rattling + usize::from(self.is_key_cut() && self.of_key.is_some_and(rattles))
    }

    fn is_wall_thick(&self) -> bool {
        self.count(Step::Thicken) > 0
    }

    fn least_factor(&self) -> f64 {
        if self.count(Step::LowerLoad) > 0 {
            ONCE
        } else {
            RESERVE
        }
    }

    /// The user's bounds, and those of the present way and wall.
    fn rounds(&self) -> Rounds {
        let is_last = self.count(Step::NextWay) + 1 == self.ways.len();
        match (self.is_wall_thick(), is_last) {
            (true, _) => self.rounds.least(&ROUNDS_WITH_THICK_WALL),
            (_, true) => self.rounds,
            (_, false) => self.rounds.least(&ROUNDS_BESIDE_OTHERS),
        }
    }

    /// Most times that a step may be taken while its count runs.
    fn limit(&self, step: Step) -> usize {
        let rounds = self.rounds();
        let by_user = match step {
            Step::Remake => rounds.kits.saturating_sub(1),
            Step::Divide => rounds.refinements,
            Step::NextKey => self.n_keys.saturating_sub(1),
            Step::NextWay => self.ways.len() - 1,
            _ => ANY,
        };
        let [cut, piece] = TABLE[step as usize].most;
        by_user.min(if self.is_key_cut() { cut } else { piece })
    }

    fn most_kits(&self) -> usize {
        let of_key = match self.is_key_cut() {
            true => KITS_OF_CUT_KEYS[self.count(Step::NextKey)],
            false => ANY,
        };
        of_key.min(self.rounds().kits_in_all)
    }

    fn permit(&self, ctx: &Ctx, step: Step) -> Permit {
        match self.permit_at_any_time(step) {
            Permit::Yes if self.is_late(ctx, step) => Permit::Late,
            permit => permit,
        }
    }

    /// Permit by the table and by what the kits were like, whatever the time.
    fn permit_at_any_time(&self, step: Step) -> Permit {
        let is_left = self.count(step) < self.limit(step);
        match is_left && !self.forbidden.contains(&step) && self.makes_sense(step) {
            true => Permit::Yes,
            false => Permit::No,
        }
    }

    /// True if what is known of the kits so far does not rule a step out.
    fn makes_sense(&self, step: Step) -> bool {
        let has_kit = self.best.is_some();
        match step {
            Step::Remake | Step::Divide | Step::Lengthen | Step::JoinRattling => {
                self.n_kits < self.most_kits()
            }
            // What kits taught of these pieces would be lost.
            Step::Enlarge | Step::JoinWeak => self.count(Step::Remake) == 0,
            Step::Thicken => {
                let is_first = self.count(Step::NextKey) == 0 && self.count(Step::Remake) == 0;
                is_first && self.way().walls == Walls::ForUse && self.count(Step::LowerLoad) == 0
            }
            Step::NextKey => {
                let is_next_cut = self.count(Step::NextKey) + 2 < self.n_keys;
                // A piece as it is rattles no less as the key than one that was cut.
                let rattles = match is_next_cut {
                    true => self.n_rattling_keys() >= RATTLING_KEYS,
                    false => self.best.is_some_and(|best| best.only_rattles),
                };
                !(rattles || has_kit && self.is_wall_thick())
            }
            _ => true,
        }
    }

    /// True if a step would end after the time given.
    fn is_late(&self, ctx: &Ctx, step: Step) -> bool {
        let reserved_s = self.reserved_s();
        match step {
            Step::Replan
            | Step::Reconnect
            | Step::Remake
            | Step::Divide
            | Step::JoinRattling
            | Step::NextKey => self.clock.is_too_late_for_trial(ctx, reserved_s, 1.0),
            Step::Thicken => self.clock.is_too_late_for_wall(ctx, reserved_s),
            Step::NextWay => self
                .clock
                .is_too_late_for_trial(ctx, 0.0, self.share_of_next_way()),
            Step::Enlarge | Step::Lengthen | Step::JoinPredicted | Step::JoinWeak => {
                self.clock.is_too_late_for_change(ctx)
            }
            Step::LowerLoad => self.clock.is_over(ctx),
        }
    }

    /// Seconds kept for the ways after the present one; none once a kit passes, since no way follows then.
    fn reserved_s(&self) -> f64 {
        if self.best.is_some_and(|best| best.passes()) {
            return 0.0;
        }
        self.clock.reserved_s(self.count(Step::NextWay), self.ways.len())
    }

    /// Time of a kit of the next way relative to one of this way: a coarser one takes less.
    fn share_of_next_way(&self) -> f64 {
        let next = self.ways.get(self.count(Step::NextWay) + 1);
        match next.and_then(|way| way.n_pieces) {
            Some(n) if self.clock.n_pieces() > 0 => (n as f64 / self.clock.n_pieces() as f64).min(1.0),
            _ => 1.0,
        }
    }
}

/// Clock of a job: of work if that is limited, else of the time of its context.
fn clock(ctx: &Ctx, params: &Params) -> Clock {
    match params.effort_s {
        Some(work_s) => Clock::of_work(work_s),
        None => Clock::of_time(ctx.seconds_left()),
    }
}

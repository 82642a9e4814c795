//! Clock of an agenda: the seconds that are left, of time or of work.
//!
//! Time depends on the machine, so kits that must have the same bytes everywhere are limited by work. It is
//! counted in seconds of a reference machine, by the expected [`Cost`] of each step. With a time limit, the
//! same costs foresee how long the first kit will take: the part of the job that is done tells how fast this
//! machine is. Later kits are measured.

use crate::Ctx;
use crate::design::cost::Cost;

/// Safety factor on the time that a trial is expected to take: kits differ, and gaps are measured at the end.
const SPREAD: f64 = 1.5;
/// Share of the expected time that must be left where an attempt costs nothing: estimates may be wrong by a
/// factor of two.
const HOPE: f64 = 0.4;
/// Work that may be done before the first kit, as a multiple of the job's limit of work: a job that ends
/// without a kit was for nothing.
const FIRST_KIT_FACTOR: f64 = 2.0;
/// Shortest time that tells how fast the machine is, s.
const LEAST_MEASURED_S: f64 = 0.3;
/// Bounds of the machine's slowness, relative to the reference: what lies outside them is a wrong estimate.
const SLOWNESS: std::ops::RangeInclusive<f64> = 0.2..=10.0;

/// Clock of a job, with what was measured and what is expected of it. Seconds are of time, or of work.
pub(super) struct Clock {
    /// Seconds of the whole job; infinite without a limit.
    total_s: f64,
    /// Work that may be done and work that is done, s of the reference machine; `None` with a time limit.
    work_s: Option<[f64; 2]>,
    /// Time that was taken to choose the thickness of the first wall; `None` if the user gave it.
    first_wall_s: Option<f64>,
    /// Seconds left when the first wall was decided, and when the present wall and trial began.
    left_after_wall_s: f64,
    left_at_wall_s: f64,
    left_at_trial_s: f64,
    /// Time of the slowest trial with a kit, of the present way to divide.
    slowest_s: f64,
    /// Number of pieces of the last kit, which tells how fast a coarser one is made.
    n_pieces: usize,
    /// Expected cost of the present pieces.
    cost: Cost,
    /// Time of this machine for a second of the reference machine.
    slowness: f64,
    /// True if something was left out for want of time.
    pub is_cut_short: bool,
}

impl Clock {
    /// Clock of a job that may take this much time, s; infinite without a limit.
    pub fn of_time(total_s: f64) -> Self {
        Self {
            total_s,
            work_s: None,
            first_wall_s: None,
            left_after_wall_s: total_s,
            left_at_wall_s: total_s,
            left_at_trial_s: total_s,
            slowest_s: 0.0,
            n_pieces: 0,
            cost: Cost::default(),
            slowness: 1.0,
            is_cut_short: false,
        }
    }

    /// Clock of a job that may take this much work, s of the reference machine.
    pub fn of_work(total_s: f64) -> Self {
        Self {
            work_s: Some([total_s, 0.0]),
            ..Self::of_time(total_s)
        }
    }

    /// Seconds left of the whole job.
    pub fn left_s(&self, ctx: &Ctx) -> f64 {
        match self.work_s {
            Some([total_s, done_s]) => total_s - done_s,
            None => ctx.seconds_left(),
        }
    }

    /// Seconds in which a trial may begin: those that are left, and more of a limit of work before the first
    /// kit.
    fn left_to_begin_s(&self, ctx: &Ctx) -> f64 {
        let more_s = match self.work_s {
            Some([total_s, _]) if self.n_pieces == 0 => (FIRST_KIT_FACTOR - 1.0) * total_s,
            _ => 0.0,
        };
        self.left_s(ctx) + more_s
    }

    /// True if nothing more may begin.
    pub fn is_over(&self, ctx: &Ctx) -> bool {
        self.left_to_begin_s(ctx) <= 0.0
    }

    /// Measures the first wall, which tells how fast the machine is if its thickness `is_sought`.
    pub fn end_first_wall(&mut self, ctx: &Ctx, is_sought: bool) {
        self.left_after_wall_s = self.left_s(ctx);
        self.first_wall_s = is_sought.then_some(self.total_s - self.left_after_wall_s);
    }

    /// Learns what is expected of the present pieces, and at first how fast the machine is.
    pub fn foresee(&mut self, ctx: &Ctx, cost: Cost) {
        let is_first = self.cost == Cost::default();
        self.cost = cost;
        if !is_first {
            return;
        }
        self.count_division(true);
        // The search for a thickness is foreseen better than the division, but a given wall needs none.
        let slowness = match self.first_wall_s {
            Some(took_s) if took_s > LEAST_MEASURED_S => took_s / cost.wall_s,
            _ => (self.left_after_wall_s - self.left_s(ctx)) / cost.division_s,
        };
        if self.work_s.is_none() && slowness.is_finite() {
            self.slowness = slowness.clamp(*SLOWNESS.start(), *SLOWNESS.end());
        }
    }

    /// Counts work: the wall and the division of a step that begins them.
    pub fn count_division(&mut self, begins_wall: bool) {
        let wall_s = if begins_wall { self.cost.wall_s } else { 0.0 };
        self.count(wall_s + self.cost.division_s);
    }

    /// Counts work: one plan, and the kit of it if one was made.
    pub fn count_trial(&mut self, has_kit: bool) {
        let kit_s = if has_kit { self.cost.kit_s } else { 0.0 };
        self.count(self.cost.plan_s + kit_s);
    }

    fn count(&mut self, s: f64) {
        if let Some([_, done_s]) = &mut self.work_s {
            *done_s += s;
        }
    }

    pub fn begin_trial(&mut self, ctx: &Ctx) {
        self.left_at_trial_s = self.left_s(ctx);
    }

    pub fn begin_wall(&mut self, ctx: &Ctx) {
        self.left_at_wall_s = self.left_s(ctx);
    }

    pub fn begin_way(&mut self) {
        self.slowest_s = 0.0;
    }

    /// Measures the trial of a kit that has `n_pieces` pieces.
    pub fn end_kit(&mut self, ctx: &Ctx, n_pieces: usize) {
        let took_s = self.left_at_trial_s - self.left_s(ctx);
        if took_s.is_finite() {
            self.slowest_s = self.slowest_s.max(took_s);
        }
        self.n_pieces = n_pieces;
    }

    /// True if a thicker wall would end too late: all begins anew, so as much time must be left as the
    /// present wall has taken. The ways that follow have `reserved_s`.
    pub fn is_too_late_for_wall(&self, ctx: &Ctx, reserved_s: f64) -> bool {
        let left_s = self.left_to_begin_s(ctx) - reserved_s;
        let anew_s = self.slowness * (self.cost.wall_s + self.cost.division_s) + self.trial_s();
        2.0 * left_s < self.left_at_wall_s - reserved_s || self.is_unlikely(left_s, anew_s)
    }

    /// True if a change before a kit would end too late: another plan is sought, and then the kit is made.
    pub fn is_too_late_for_change(&self, ctx: &Ctx) -> bool {
        let left_s = self.left_to_begin_s(ctx);
        let expected_s = self.slowness * self.cost.plan_s + self.trial_s();
        left_s <= 0.0 || self.is_unlikely(left_s, expected_s)
    }

    /// True if another trial, which takes `share` of the usual time, would end too late. If there is no kit
    /// of this way yet, all is tried that may succeed.
    pub fn is_too_late_for_trial(&self, ctx: &Ctx, reserved_s: f64, share: f64) -> bool {
        let left_s = self.left_to_begin_s(ctx) - reserved_s;
        let factor = if self.slowest_s > 0.0 { SPREAD } else { HOPE };
        left_s < share * factor * self.trial_s() || left_s <= 0.0
    }

    /// True before the first kit of a way if work that is expected to take this long would hardly end in
    /// time.
    fn is_unlikely(&self, left_s: f64, expected_s: f64) -> bool {
        self.slowest_s == 0.0 && left_s < SPREAD * expected_s
    }

    /// Time to keep back for the kit while its plan is improved.
    pub fn kit_reserve_s(&self) -> f64 {
        SPREAD * self.kit_s()
    }

    /// Time without which a kit is not begun.
    pub fn least_kit_s(&self) -> f64 {
        HOPE * self.kit_s()
    }

    /// Time that the whole job needs for its first kit; `None` where its pieces are not known.
    pub fn needed_s(&self, ctx: &Ctx) -> Option<f64> {
        let gone_s = self.total_s - self.left_s(ctx);
        let planned_s = self.total_s - self.left_at_trial_s + self.slowness * self.cost.plan_s;
        (self.cost.kit_s > 0.0).then(|| planned_s.max(gone_s) + SPREAD * self.kit_s())
    }

    /// Seconds kept for the ways after the `i`-th of `n`: the first way has twice the share of each later
    /// one.
    pub fn reserved_s(&self, i: usize, n: usize) -> f64 {
        if i + 1 == n || self.total_s.is_infinite() {
            0.0
        } else {
            self.total_s * (n - 1 - i) as f64 / (n + 1) as f64
        }
    }

    /// Number of pieces of the last kit; 0 if there was none.
    pub fn n_pieces(&self) -> usize {
        self.n_pieces
    }

    /// Time of a trial that makes a kit: the slowest so far, else what is expected.
    fn trial_s(&self) -> f64 {
        if self.slowest_s > 0.0 {
            self.slowest_s
        } else {
            self.slowness * (self.cost.plan_s + self.cost.kit_s)
        }
    }

    /// Time of a kit whose plan is known.
    fn kit_s(&self) -> f64 {
        let Cost { plan_s, kit_s, .. } = self.cost;
        if kit_s > 0.0 {
            self.trial_s() * kit_s / (plan_s + kit_s)
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    const COST: Cost = Cost {
        wall_s: 3.0,
        division_s: 2.0,
        plan_s: 4.0,
        kit_s: 16.0,
    };

    /// Clock of 100 s after so many seconds, and the context that it reads the time of.
    fn after<T>(gone_s: f64, see: impl FnOnce(&Ctx<'_>, &mut Clock, &Mutex<f64>) -> T) -> T {
        let gone = Mutex::new(0.0);
        let left = || 100.0 - *gone.lock().expect("no test panics with it");
        let ctx = Ctx::quiet().with_deadline(&left);
        let mut clock = Clock::of_time(left());
        *gone.lock().expect("no test panics with it") = gone_s;
        see(&ctx, &mut clock, &gone)
    }

    #[test]
    fn a_machine_half_as_fast_needs_twice_the_time_for_what_follows() {
        // The wall was given, so the division of 2 s tells.
        for (gone_s, slowness) in [(2.0, 1.0), (4.0, 2.0), (0.1, 0.2), (90.0, 10.0)] {
            after(gone_s, |ctx, clock, _| {
                clock.foresee(ctx, COST);
                clock.begin_trial(ctx);
                let kit_s = 16.0 * slowness;
                assert!((clock.kit_reserve_s() - SPREAD * kit_s).abs() < 1e-9);
                let needed_s = gone_s + 4.0 * slowness + SPREAD * kit_s;
                assert!((clock.needed_s(ctx).expect("pieces are known") - needed_s).abs() < 1e-9);
            });
        }
        after(10.0, |ctx, clock, _| assert_eq!(clock.needed_s(ctx), None));
    }

    #[test]
    fn the_wall_tells_how_fast_the_machine_is_where_it_was_measured() {
        after(6.0, |ctx, clock, gone| {
            clock.end_first_wall(ctx, true);
            *gone.lock().expect("no test panics with it") = 60.0;
            clock.foresee(ctx, COST);
            assert!((clock.kit_reserve_s() - SPREAD * 16.0 * 2.0).abs() < 1e-9);
        });
    }

    #[test]
    fn before_the_first_kit_changes_leave_time_for_it_and_trials_are_given_up_last() {
        let late = |left_s: f64| {
            after(2.0, |ctx, clock, gone| {
                clock.foresee(ctx, COST);
                *gone.lock().expect("no test panics with it") = 100.0 - left_s;
                let change = clock.is_too_late_for_change(ctx);
                (change, clock.is_too_late_for_trial(ctx, 0.0, 1.0))
            })
        };
        // Another plan and then the kit with its own: 24 s, half as much again to be sure.
        assert_eq!(late(37.0), (false, false));
        assert_eq!(late(35.0), (true, false));
        assert_eq!(late(9.0), (true, false));
        assert_eq!(late(7.0), (true, true));
    }

    #[test]
    fn a_kit_that_was_made_tells_more_than_an_estimate() {
        after(5.0, |ctx, clock, gone| {
            clock.foresee(ctx, COST);
            clock.begin_trial(ctx);
            *gone.lock().expect("no test panics with it") = 45.0;
            clock.end_kit(ctx, 8);
            assert!((clock.kit_reserve_s() - SPREAD * 40.0 * 16.0 / 20.0).abs() < 1e-9);
            assert!(clock.is_too_late_for_trial(ctx, 0.0, 1.0));
            assert!(!clock.is_too_late_for_trial(ctx, 0.0, 0.5), "coarser pieces");
            assert!(
                !clock.is_too_late_for_change(ctx),
                "without it the trial would be for nothing"
            );
        });
    }

    #[test]
    fn work_is_counted_by_what_is_expected_of_it_on_any_machine() {
        let unread = || panic!("a limit of work reads no clock");
        let ctx = Ctx::quiet().with_deadline(&unread);
        let mut clock = Clock::of_work(100.0);
        clock.foresee(&ctx, COST);
        assert_eq!(clock.left_s(&ctx), 95.0);
        assert!(!clock.is_too_late_for_trial(&ctx, 185.0, 1.0), "no kit was made");
        clock.count_trial(false);
        clock.begin_trial(&ctx);
        clock.count_trial(true);
        clock.end_kit(&ctx, 8);
        assert_eq!(clock.left_s(&ctx), 71.0);
        assert!(
            !clock.is_too_late_for_trial(&ctx, 40.0, 1.0) && clock.is_too_late_for_trial(&ctx, 42.0, 1.0)
        );
        clock.count_division(true);
        assert_eq!(clock.left_s(&ctx), 66.0);
    }
}

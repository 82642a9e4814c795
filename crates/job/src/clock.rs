//! Time limits of a job: of the whole, and of a single search for a plan.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use shellock::Progress;

/// Time by which the whole job should be done.
pub struct Deadline(Option<Instant>);

impl Deadline {
    /// Deadline `seconds` after `since`; none if `seconds` is 0.
    pub fn new(seconds: f64, since: Instant) -> Self {
        let time = Duration::try_from_secs_f64(seconds).ok();
        let time = time.filter(|time| !time.is_zero());
        Self(time.and_then(|time| since.checked_add(time)))
    }

    /// Time left, s: negative after the deadline, infinite if there is none.
    pub fn seconds_left(&self) -> f64 {
        let Some(at) = self.0 else {
            return f64::INFINITY;
        };
        let now = Instant::now();
        at.checked_duration_since(now)
            .map_or_else(|| -(now - at).as_secs_f64(), |left| left.as_secs_f64())
    }
}

/// Limits the time of the current search for a plan.
pub struct PlanClock {
    since: Mutex<Instant>,
    limit: Duration,
}

impl PlanClock {
    /// Clock for searches that were allowed the work of `plan_time_s`. They get twice that time, and 10 s
    /// more to find a first plan.
    pub fn new(plan_time_s: f64) -> Self {
        const GRACE_S: f64 = 10.0;
        let limit = Duration::try_from_secs_f64(2.0 * plan_time_s + GRACE_S).unwrap_or(Duration::MAX);
        Self {
            since: Mutex::new(Instant::now()),
            limit,
        }
    }

    /// Restarts the clock at every stage, so that each search has its own time.
    pub fn see(&self, progress: &Progress<'_>) {
        if let Progress::Stage { .. } = progress {
            *self.since.lock().expect("no holder of this lock panics") = Instant::now();
        }
    }

    /// Returns true if the stage has taken longer than planning may.
    pub fn is_up(&self) -> bool {
        self.since
            .lock()
            .expect("no holder of this lock panics")
            .elapsed()
            > self.limit
    }
}

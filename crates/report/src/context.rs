//! Context that every stage receives: progress, warnings and cancellation.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::Warning;

/// Error: the user requested a stop, and nothing was kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("stopped by the user")]
pub struct Cancelled;

/// Progress report of a job.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress<'a> {
    /// A stage begins, with its number of steps (0 if unknown).
    Stage {
        /// Name of the stage, for people.
        name: &'a str,
        /// Number of steps to come.
        n_steps: usize,
    },
    /// One more step of the current stage is done.
    Step,
    /// A line worth keeping, such as the reason for another round.
    Note(&'a str),
}

/// Progress, cancellation and warnings of one job. Stages borrow the context and never keep it.
pub struct Ctx<'a> {
    report: &'a (dyn Fn(Progress<'_>) + Sync),
    stop: &'a AtomicBool,
    is_time_up: Option<&'a (dyn Fn() -> bool + Sync)>,
    seconds_left: Option<&'a (dyn Fn() -> f64 + Sync)>,
    ends_in_time: bool,
    warnings: Mutex<Vec<Warning>>,
}

impl<'a> Ctx<'a> {
    /// Creates a context that reports progress to `report` and stops soon after `stop` becomes true.
    pub fn new(report: &'a (dyn Fn(Progress<'_>) + Sync), stop: &'a AtomicBool) -> Self {
        Self {
            report,
            stop,
            is_time_up: None,
            seconds_left: None,
            ends_in_time: false,
            warnings: Mutex::new(Vec::new()),
        }
    }

    /// Creates a context that reports nothing and is never stopped.
    pub fn quiet() -> Ctx<'static> {
        static NEVER: AtomicBool = AtomicBool::new(false);
        Ctx::new(&|_| {}, &NEVER)
    }

    /// Adds a clock, since libraries do not read one: searches that improve with time end soon after it
    /// returns true.
    ///
    /// Their results then depend on the speed of the machine, so limits of work should end them earlier.
    pub fn with_time_limit(self, is_time_up: &'a (dyn Fn() -> bool + Sync)) -> Self {
        Self {
            is_time_up: Some(is_time_up),
            ..self
        }
    }

    /// Adds a clock of the seconds left for the whole job. A stage that retries until its result is good does
    /// not start again if that would end too late.
    ///
    /// The result of the job then depends on the speed of the machine; a warning reports this.
    pub fn with_deadline(self, seconds_left: &'a (dyn Fn() -> f64 + Sync)) -> Self {
        Self {
            seconds_left: Some(seconds_left),
            ..self
        }
    }

    /// Makes the end of the time a stop: work that is not done by then is given up. The caller tells it from
    /// a stop of the user by [`Ctx::check`] of the context that it came from.
    pub fn ending_in_time(self) -> Self {
        Self {
            ends_in_time: true,
            ..self
        }
    }

    /// Seconds left for the whole job; infinite without a clock.
    pub fn seconds_left(&self) -> f64 {
        self.seconds_left.map_or(f64::INFINITY, |left| left())
    }

    /// Returns true if searches should settle for their present result.
    pub fn is_time_up(&self) -> bool {
        self.is_time_up.is_some_and(|is_up| is_up())
    }

    /// Starts a stage of `n_steps` steps (0: unknown). Fails if the user requested a stop.
    pub fn stage(&self, name: &str, n_steps: usize) -> Result<(), Cancelled> {
        (self.report)(Progress::Stage { name, n_steps });
        self.check()
    }

    /// Completes one step of the stage. Fails if the user requested a stop.
    pub fn step(&self) -> Result<(), Cancelled> {
        (self.report)(Progress::Step);
        self.check()
    }

    /// Reports a line worth keeping.
    pub fn note(&self, text: &str) {
        (self.report)(Progress::Note(text));
    }

    /// Returns true if the end of the time stops the work, and not the user.
    pub fn is_time_over(&self) -> bool {
        self.ends_in_time && self.seconds_left() <= 0.0 && !self.stop.load(Ordering::Relaxed)
    }

    /// Fails if the user requested a stop, or at the end of the time where that is a stop. Long loops call it
    /// regularly.
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.stop.load(Ordering::Relaxed) || (self.ends_in_time && self.seconds_left() <= 0.0) {
            Err(Cancelled)
        } else {
            Ok(())
        }
    }

    /// Keeps a warning for the plan and the report.
    pub fn warn(&self, warning: Warning) {
        self.warnings
            .lock()
            .expect("no holder of this lock panics")
            .push(warning);
    }

    /// Creates a context of the same job with its own warnings: a discarded attempt takes them with it.
    pub fn fork(&self) -> Ctx<'a> {
        Ctx {
            report: self.report,
            stop: self.stop,
            is_time_up: self.is_time_up,
            seconds_left: self.seconds_left,
            ends_in_time: self.ends_in_time,
            warnings: Mutex::new(Vec::new()),
        }
    }

    /// Returns the warnings in the order they came, without duplicates.
    pub fn into_warnings(self) -> Vec<Warning> {
        let mut seen: Vec<Warning> = Vec::new();
        for w in self.warnings.into_inner().expect("no holder of this lock panics") {
            if !seen.contains(&w) {
                seen.push(w);
            }
        }
        seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_of_the_time_stops_only_work_that_ends_in_time() {
        for (left_s, is_over) in [(1.0, false), (0.0, true), (-1.0, true)] {
            let left = || left_s;
            let job = Ctx::quiet().with_deadline(&left);
            let part = job.fork().ending_in_time();
            assert!(job.check().is_ok());
            assert_eq!(part.check().is_err(), is_over);
            assert_eq!(
                part.fork().check().is_err(),
                is_over,
                "parts of a part end with it"
            );
        }
        assert!(
            Ctx::quiet().ending_in_time().check().is_ok(),
            "without a clock nothing ends"
        );
    }
}

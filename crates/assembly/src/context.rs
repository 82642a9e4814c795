//! What every stage gets first: where to say how far it is, where to warn, and whether to stop.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::Warning;

/// The user asked to stop; nothing was kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("stopped by the user")]
pub struct Cancelled;

/// How far the job is.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress<'a> {
    /// A stage begins, with so many steps (0 where unknown).
    Stage {
        /// What a person reads.
        name: &'a str,
        /// Steps to come.
        n_steps: usize,
    },
    /// One more step of the current stage is done.
    Step,
    /// A line worth keeping, such as why another round begins.
    Note(&'a str),
}

/// Progress, cancellation and warnings of one job. Stages borrow it and never keep it.
pub struct Ctx<'a> {
    report: &'a (dyn Fn(Progress<'_>) + Sync),
    stop: &'a AtomicBool,
    is_time_up: Option<&'a (dyn Fn() -> bool + Sync)>,
    seconds_left: Option<&'a (dyn Fn() -> f64 + Sync)>,
    warnings: Mutex<Vec<Warning>>,
}

impl<'a> Ctx<'a> {
    /// A context that tells `report` how far it is and ends soon after `stop` becomes true.
    pub fn new(report: &'a (dyn Fn(Progress<'_>) + Sync), stop: &'a AtomicBool) -> Self {
        Self {
            report,
            stop,
            is_time_up: None,
            seconds_left: None,
            warnings: Mutex::new(Vec::new()),
        }
    }

    /// A context that tells nobody and is never stopped.
    pub fn quiet() -> Ctx<'static> {
        static NEVER: AtomicBool = AtomicBool::new(false);
        Ctx::new(&|_| {}, &NEVER)
    }

    /// The same with a clock, which libraries do not read: searches that get better with time end soon after
    /// it says true.
    ///
    /// What they return then depends on how fast the machine is, so limits of work should end them before.
    pub fn with_time_limit(self, is_time_up: &'a (dyn Fn() -> bool + Sync)) -> Self {
        Self {
            is_time_up: Some(is_time_up),
            ..self
        }
    }

    /// The same with a clock that says how many seconds the whole job may still take: what is made again and again
    /// until it is good is not begun anew where that would end too late.
    ///
    /// What comes of the job then depends on how fast the machine is; it is warned of.
    pub fn with_deadline(self, seconds_left: &'a (dyn Fn() -> f64 + Sync)) -> Self {
        Self {
            seconds_left: Some(seconds_left),
            ..self
        }
    }

    /// Seconds that the whole job may still take; no end where there is no clock.
    pub fn seconds_left(&self) -> f64 {
        self.seconds_left.map_or(f64::INFINITY, |left| left())
    }

    /// Whether to be content with what was found.
    pub fn is_time_up(&self) -> bool {
        self.is_time_up.is_some_and(|is_up| is_up())
    }

    /// A stage of `n_steps` steps begins (0: unknown); fails where the user asked to stop.
    pub fn stage(&self, name: &str, n_steps: usize) -> Result<(), Cancelled> {
        (self.report)(Progress::Stage { name, n_steps });
        self.check()
    }

    /// One step of the stage is done; fails where the user asked to stop.
    pub fn step(&self) -> Result<(), Cancelled> {
        (self.report)(Progress::Step);
        self.check()
    }

    /// A line worth keeping.
    pub fn note(&self, text: &str) {
        (self.report)(Progress::Note(text));
    }

    /// Fails where the user asked to stop; long loops call it now and then.
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.stop.load(Ordering::Relaxed) {
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

    /// A context of the same job whose warnings are its own: what is given up takes them with it.
    pub fn fork(&self) -> Ctx<'a> {
        Ctx {
            report: self.report,
            stop: self.stop,
            is_time_up: self.is_time_up,
            seconds_left: self.seconds_left,
            warnings: Mutex::new(Vec::new()),
        }
    }

    /// The warnings, in the order they came; equal ones once.
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

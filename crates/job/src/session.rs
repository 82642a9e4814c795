//! Bond between a job and its caller: when to stop, when the job began, and how stages are shown.

use std::any::Any;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Function that shows a stage by name for as long as its result lives.
type Shows = dyn Fn(&str) -> Box<dyn Any> + Send + Sync;

/// Settings and state of a job that its caller decides.
pub struct Session {
    /// Flag that ends the job early.
    pub stop: Arc<AtomicBool>,
    /// Start time of the job, from which its time limit counts.
    pub since: Instant,
    shows: Box<Shows>,
}

impl Session {
    /// Creates a session that begins now, shows nothing and ends with `stop`.
    pub fn silent(stop: &Arc<AtomicBool>) -> Self {
        Self::new(stop, |_| Box::new(()))
    }

    /// Creates a session that begins now and ends with `stop`. `shows` shows a stage outside of a kit for as
    /// long as its result lives.
    pub fn new(stop: &Arc<AtomicBool>, shows: impl Fn(&str) -> Box<dyn Any> + Send + Sync + 'static) -> Self {
        Self {
            stop: Arc::clone(stop),
            since: Instant::now(),
            shows: Box::new(shows),
        }
    }

    /// Returns true once the job is to stop.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Runs `work` and shows `name` meanwhile.
    pub fn during<T>(&self, name: &str, work: impl FnOnce() -> T) -> T {
        let _shown = (self.shows)(name);
        work()
    }
}

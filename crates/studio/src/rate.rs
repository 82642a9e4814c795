//! Limit on the rate of requests.

use std::sync::Mutex;
use std::time::Instant;

/// Largest burst of requests, and the rate at which the budget refills, requests per second.
const MOST_AT_ONCE: f64 = 200.0;
const MOST_PER_SECOND: f64 = 100.0;

/// Token bucket that limits the rate of requests.
pub struct Rate(Mutex<(f64, Instant)>);

impl Rate {
    pub fn new() -> Self {
        Self(Mutex::new((MOST_AT_ONCE, Instant::now())))
    }

    /// Counts one more request. Returns false if it exceeds the limit.
    pub fn admits(&self) -> bool {
        let mut state = self.0.lock().expect("no holder of this lock panics");
        let now = Instant::now();
        let (left, since) = *state;
        let left = (left + MOST_PER_SECOND * (now - since).as_secs_f64()).min(MOST_AT_ONCE);
        let is_admitted = left >= 1.0;
        *state = (if is_admitted { left - 1.0 } else { left }, now);
        is_admitted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_burst_is_admitted_and_no_more() {
        let rate = Rate::new();
        let admitted = (0..1000).filter(|_| rate.admits()).count();
        assert!((200..300).contains(&admitted), "{admitted}");
    }
}

//! Progress of a kit: the number of the current stage, and an estimate of the time left.

use std::time::{Duration, Instant};

/// Stages of a kit in order, each with its share of the total time: means of nine models of 150 mm.
const STAGES: [(&str, f64); 20] = [
    ("thickness", 0.07),
    ("segmentation", 0.07),
    ("key", 0.03),
    ("connector sizes", 0.01),
    ("blocked directions", 0.01),
    ("search for a plan", 0.01),
    ("expected play", 0.01),
    ("strongest plan", 0.03),
    ("reinforcements", 0.03),
    ("stress", 0.04),
    ("wall", 0.04),
    ("cuts", 0.04),
    ("bodies", 0.04),
    ("connectors", 0.06),
    ("pieces", 0.16),
    ("verify", 0.03),
    ("play", 0.09),
    ("ways out", 0.02),
    ("gaps", 0.06),
    ("files and pictures", 0.15),
];
/// Share of a kit that must be done before the time left is estimated.
const LEAST_SHARE: f64 = 0.1;

/// Position of a stage among all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stand {
    /// Number of the stage, from 1.
    pub number: usize,
    /// Number of stages in all.
    pub of: usize,
    /// Estimated time until the kit is done, if it passes; `None` while too little is done.
    pub time_left: Option<Duration>,
}

/// Progress of a job. A kit that fails begins again at an earlier stage.
#[derive(Debug, Default)]
pub struct Course {
    /// Start time and first stage of the current kit.
    begun: Option<(Instant, usize)>,
    at: usize,
}

impl Course {
    /// Records that the stage `name` begins; `None` if it is not a stage of a kit.
    pub fn begin(&mut self, name: &str, now: Instant) -> Option<Stand> {
        let index = STAGES.iter().position(|(n, _)| *n == name)?;
        let (since, first) = match self.begun {
            Some(begun) if index > self.at => begun,
            _ => (now, index),
        };
        self.begun = Some((since, first));
        self.at = index;
        let share = |range: std::ops::Range<usize>| STAGES[range].iter().map(|s| s.1).sum::<f64>();
        let (done, rest) = (share(first..index), share(index..STAGES.len()));
        let left = (done >= LEAST_SHARE).then(|| (now - since).mul_f64(rest / done));
        Some(Stand {
            number: index + 1,
            of: STAGES.len(),
            time_left: left,
        })
    }
}

impl Stand {
    /// Writes the position as in "stage 5 of 20: gaps".
    pub fn words(&self, name: &str) -> String {
        format!("stage {} of {}: {name}", self.number, self.of)
    }

    /// Writes the position and the time left, which changes each time.
    pub fn timed_words(&self, name: &str) -> String {
        const STEP_S: f64 = 5.0;
        let left = self.time_left.map_or_else(String::new, |left| {
            let s = ((left.as_secs_f64() / STEP_S).ceil() * STEP_S).max(STEP_S);
            format!(", about {s:.0} s left unless a retry is needed")
        });
        self.words(name) + &left
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_is_told_by_what_was_done_of_this_kit() {
        let (mut course, start) = (Course::default(), Instant::now());
        let after = |s: f64| start + Duration::from_secs_f64(s);
        let first = course.begin("thickness", after(0.0)).unwrap();
        assert_eq!((first.number, first.of, first.time_left), (1, STAGES.len(), None));
        let key = course.begin("key", after(12.0)).unwrap();
        let left = key.time_left.unwrap().as_secs_f64();
        assert!((left - 12.0 / 0.14 * 0.86).abs() < 1.0, "{left}");
        // The kit fails: the next one has no estimate yet.
        course.begin("verify", after(50.0)).unwrap();
        assert_eq!(course.begin("segmentation", after(60.0)).unwrap().time_left, None);
        assert_eq!(course.begin("a plan of half the score", after(61.0)), None);
    }

    #[test]
    fn shares_are_of_one_kit() {
        let all: f64 = STAGES.iter().map(|s| s.1).sum();
        assert!((all - 1.0).abs() < 0.01, "{all}");
    }
}

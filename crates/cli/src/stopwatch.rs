//! What the stages of a job took, on the wall's clock and of the processors.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use cpu_time::ProcessTime;
use serde::Serialize;

/// What one stage took, all its rounds together.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StageTime {
    /// What a person reads.
    pub name: String,
    /// On the wall's clock, s. Of stages side by side the former has it until the latter begins.
    pub seconds: f64,
    /// Of all processors, s.
    pub cpu_seconds: f64,
    /// How often it began.
    pub rounds: usize,
}

/// Times stages from the moment it is made.
pub struct Stopwatch(Mutex<State>);

struct State {
    stages: Vec<StageTime>,
    /// The place of the stage that runs.
    current: usize,
    since: (Instant, ProcessTime),
}

impl Stopwatch {
    /// Begins with a stage of its own for what comes before the first.
    pub fn new() -> Self {
        let mut state = State {
            stages: Vec::new(),
            current: 0,
            since: (Instant::now(), ProcessTime::now()),
        };
        state.begin("begin");
        Self(Mutex::new(state))
    }

    /// A stage begins.
    pub fn begin(&self, name: &str) {
        let mut state = self.0.lock().expect("no holder of this lock panics");
        state.close();
        state.begin(name);
    }

    /// What all took until now, in the order in which they first began.
    pub fn stages(&self) -> Vec<StageTime> {
        let mut state = self.0.lock().expect("no holder of this lock panics");
        state.close();
        state.stages.clone()
    }
}

impl State {
    /// Adds what went by to the current stage.
    fn close(&mut self) {
        let (wall, cpu) = (self.since.0.elapsed(), self.since.1.elapsed());
        let stage = &mut self.stages[self.current];
        stage.seconds += seconds(wall);
        stage.cpu_seconds += seconds(cpu);
        self.since = (Instant::now(), ProcessTime::now());
    }

    fn begin(&mut self, name: &str) {
        let known = self.stages.iter().position(|s| s.name == name);
        self.current = known.unwrap_or_else(|| {
            self.stages.push(StageTime {
                name: name.to_owned(),
                seconds: 0.0,
                cpu_seconds: 0.0,
                rounds: 0,
            });
            self.stages.len() - 1
        });
        self.stages[self.current].rounds += 1;
    }
}

fn seconds(d: Duration) -> f64 {
    d.as_secs_f64()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_of_one_stage_add_up() {
        let watch = Stopwatch::new();
        for name in ["plan", "pieces", "plan"] {
            watch.begin(name);
        }
        let stages = watch.stages();
        let told: Vec<(&str, usize)> = stages.iter().map(|s| (s.name.as_str(), s.rounds)).collect();
        assert_eq!(told, [("begin", 1), ("plan", 2), ("pieces", 1)]);
        assert!(stages.iter().all(|s| s.seconds >= 0.0 && s.cpu_seconds >= 0.0));
    }
}

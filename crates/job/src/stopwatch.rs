//! Time that the stages of a job take: wall-clock time and processor time.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use cpu_time::ProcessTime;
use serde::{Deserialize, Serialize};

/// Time of one stage, summed over all its rounds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageTime {
    /// Processor time of all threads, s.
    pub cpu_seconds: f64,
    /// Name of the stage, for people.
    pub name: String,
    /// Number of times that the stage began.
    pub rounds: usize,
    /// Wall-clock time, s. Of stages that overlap, the earlier one counts until the later one begins.
    pub seconds: f64,
}

/// Times stages from the moment of its creation.
pub struct Stopwatch(Mutex<State>);

struct State {
    stages: Vec<StageTime>,
    /// Index of the running stage.
    current: usize,
    since: (Instant, ProcessTime),
}

impl Stopwatch {
    /// Starts with a stage of its own, "begin", for the time before the first stage.
    pub fn start() -> Self {
        let mut state = State {
            stages: Vec::new(),
            current: 0,
            since: (Instant::now(), ProcessTime::now()),
        };
        state.begin("begin");
        Self(Mutex::new(state))
    }

    /// Begins a stage, and ends the current one.
    pub fn begin(&self, name: &str) {
        let mut state = self.0.lock().expect("no holder of this lock panics");
        state.close();
        state.begin(name);
    }

    /// Times of all stages so far, in the order in which they first began.
    pub fn stages(&self) -> Vec<StageTime> {
        let mut state = self.0.lock().expect("no holder of this lock panics");
        state.close();
        state.stages.clone()
    }
}

impl State {
    /// Adds the elapsed time to the current stage.
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
        let watch = Stopwatch::start();
        for name in ["plan", "pieces", "plan"] {
            watch.begin(name);
        }
        let stages = watch.stages();
        let told: Vec<(&str, usize)> = stages.iter().map(|s| (s.name.as_str(), s.rounds)).collect();
        assert_eq!(told, [("begin", 1), ("plan", 2), ("pieces", 1)]);
        assert!(stages.iter().all(|s| s.seconds >= 0.0 && s.cpu_seconds >= 0.0));
    }
}

//! Queue of a batch: each model when there is room, then again, one by one, those that ran out of time.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use shellock_job::batch::{Entry, Record};

/// A model to be made.
pub struct Task {
    pub job: Entry,
    needs_mb: f64,
    /// Record of the first run beside others; `None` if the model was not made yet.
    pub first: Option<Box<Record>>,
}

/// Next action of a worker.
pub enum Next {
    Make(Task),
    /// Wait: there is no room now.
    Wait,
    /// Stop: nothing is left for this worker.
    Go,
}

/// Models that wait, and the memory left for them.
pub struct Queue {
    models: VecDeque<(PathBuf, PathBuf)>,
    again: VecDeque<(Entry, Box<Record>)>,
    free_mb: f64,
    n_running: usize,
}

impl Queue {
    pub fn new(models: VecDeque<(PathBuf, PathBuf)>, free_mb: f64) -> Self {
        Self {
            models,
            again: VecDeque::new(),
            free_mb,
            n_running: 0,
        }
    }

    /// Returns the next model once there is room for it; a single model always has room. After all were made
    /// once, the worker that ends last makes again, each alone, those that ran out of time.
    pub fn next(&mut self, needs_mb: impl Fn(&Path) -> f64) -> Next {
        let Some((model, _)) = self.models.front() else {
            return self.next_alone();
        };
        let needs_mb = needs_mb(model);
        if self.n_running > 0 && needs_mb > self.free_mb {
            return Next::Wait;
        }
        let (model, kit) = self.models.pop_front().expect("it was there");
        self.start(Task {
            job: Entry { model, kit },
            needs_mb,
            first: None,
        })
    }

    fn next_alone(&mut self) -> Next {
        if self.n_running > 0 {
            return Next::Go;
        }
        match self.again.pop_front() {
            None => Next::Go,
            Some((job, first)) => self.start(Task {
                job,
                needs_mb: 0.0,
                first: Some(first),
            }),
        }
    }

    fn start(&mut self, task: Task) -> Next {
        self.free_mb -= task.needs_mb;
        self.n_running += 1;
        Next::Make(task)
    }

    /// Frees the task's memory. Returns its record, or `None` if the model is to be made again.
    pub fn finish(&mut self, task: Task, record: Record) -> Option<Record> {
        self.free_mb += task.needs_mb;
        self.n_running -= 1;
        if record.lacks_time && task.first.is_none() {
            self.again.push_back((task.job, Box::new(record)));
            return None;
        }
        Some(record)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn task(queue: &mut Queue) -> Task {
        match queue.next(|_| 1.0) {
            Next::Make(task) => task,
            Next::Wait | Next::Go => panic!("there is room for one more"),
        }
    }

    fn record(task: &Task, lacks_time: bool) -> Record {
        let blank = Record::blank(&task.job, String::new());
        Record { lacks_time, ..blank }
    }

    #[test]
    fn what_lacks_time_is_made_again_at_the_end_with_nothing_beside_it() {
        let models = ["a", "b", "c", "d"].map(|name| (name.into(), name.into()));
        let mut queue = Queue::new(models.into(), 2.0);
        let (a, b) = (task(&mut queue), task(&mut queue));
        assert!(matches!(queue.next(|_| 1.0), Next::Wait), "two fill the room");
        let of_a = record(&a, true);
        assert!(queue.finish(a, of_a).is_none());
        let c = task(&mut queue);
        let of_b = record(&b, true);
        assert!(queue.finish(b, of_b).is_none());
        let d = task(&mut queue);
        assert_eq!(d.job.model, Path::new("d"));
        let (of_c, of_d) = (record(&c, false), record(&d, false));
        assert!(queue.finish(c, of_c).is_some());
        assert!(matches!(queue.next(|_| 1.0), Next::Go), "d is still being made");
        assert!(queue.finish(d, of_d).is_some());
        for name in ["a", "b"] {
            let again = task(&mut queue);
            assert_eq!(again.job.model, Path::new(name));
            assert!(again.first.is_some());
            assert!(matches!(queue.next(|_| 1.0), Next::Go), "it is alone");
            let record = record(&again, name == "a");
            assert!(queue.finish(again, record).is_some(), "twice is enough");
        }
        assert!(matches!(queue.next(|_| 1.0), Next::Go));
    }
}

//! `batch`: makes kits of all models in a folder, each in a process of its own. Existing kits are not made
//! again.

mod queue;
mod run;

use std::collections::{BTreeMap, VecDeque};
use std::fs;
use std::path::PathBuf;
use std::sync::{Condvar, Mutex, OnceLock};
use std::time::Duration;

use serde_json::json;
use shellock_job::batch::{ENDINGS, PAGE, RECORDS, Record, Status, models, tables};
use shellock_job::build::check_options;
use shellock_job::files::{with_slashes, write};
use shellock_job::input::sha256;
use shellock_job::{Failure, child};

use self::queue::{Next, Queue, Task};
use self::run::Run;
use crate::Session;
use crate::args::BatchOptions;
use crate::progress::Shown;

/// Share of the memory free at the start that all kits together may take.
const MEMORY_SHARE: f64 = 0.8;
/// Interval at which a worker checks for room.
const LOOK: Duration = Duration::from_millis(100);

/// Runs `shellock batch` and returns the exit code: 0 if every model has a verified kit, else 1.
pub fn batch(session: &Session, options: &BatchOptions) -> Result<u8, Failure> {
    check_options(&options.options.options)?;
    if options.options.options.labels.is_some() {
        return Err(Failure::Wrong(
            "--labels belongs to one model; in a batch, labels come from the models' files".to_owned(),
        ));
    }
    if options.memory.is_some_and(f64::is_nan) {
        return Err(Failure::Wrong("--memory must be a number of GB".to_owned()));
    }
    let models = models(&options.folder, Some(&options.out))?;
    if models.is_empty() {
        return Err(Failure::Wrong(format!(
            "{} contains no model: names end in {}",
            options.folder.display(),
            ENDINGS.join(", ")
        )));
    }
    let records = options.out.join(RECORDS);
    fs::create_dir_all(&records).map_err(Failure::unwritable(&records))?;
    let run = Run::new(options, models.len())?;
    let shop = Shop::new(session, &run, models, memory_mb(options));
    std::thread::scope(|scope| {
        for _ in 0..run.n_workers {
            scope.spawn(|| shop.work());
        }
    });
    let records = shop.records.into_inner().expect("no worker panics");
    if session.job.is_stopped() {
        return Err(Failure::BatchStopped);
    }
    for (name, bytes) in tables(&records) {
        write(&options.out.join(name), &bytes)?;
    }
    if let Some(problem) = records.iter().find_map(|r| r.unwritten.clone()) {
        return Err(Failure::Wrong(problem));
    }
    report_results(session, options, &records);
    Ok(u8::from(records.iter().any(|r| r.status != Status::Verified)))
}

/// Hash that identifies this program file, so that two builds of one version differ.
fn program() -> String {
    static OF_FILE: OnceLock<String> = OnceLock::new();
    let hash = || {
        let file = std::env::current_exe().ok().and_then(|path| fs::read(path).ok());
        sha256(&file.unwrap_or_else(|| env!("CARGO_PKG_VERSION").into()))
    };
    OF_FILE.get_or_init(hash).clone()
}

/// Memory limit for all kits together, MB.
fn memory_mb(options: &BatchOptions) -> f64 {
    let free = || child::available_mb().map_or(f64::INFINITY, |mb| MEMORY_SHARE * mb);
    options.memory.map_or_else(free, |gb| 1e3 * gb)
}

/// State that the workers share.
struct Shop<'a> {
    session: &'a Session,
    run: &'a Run,
    n_models: usize,
    queue: Mutex<Queue>,
    has_room: Condvar,
    records: Mutex<Vec<Record>>,
}

impl<'a> Shop<'a> {
    fn new(session: &'a Session, run: &'a Run, models: VecDeque<(PathBuf, PathBuf)>, free_mb: f64) -> Self {
        Self {
            session,
            run,
            n_models: models.len(),
            queue: Mutex::new(Queue::new(models, free_mb)),
            has_room: Condvar::new(),
            records: Mutex::default(),
        }
    }

    fn work(&self) {
        while let Some(task) = self.next() {
            let record = match &task.first {
                None => self.run.record(self.session, &task.job),
                Some(first) => self.run.again(self.session, &task.job, first),
            };
            let model = with_slashes(&task.job.model);
            let record = self.queue.lock().expect("no worker panics").finish(task, record);
            self.has_room.notify_all();
            if self.session.job.is_stopped() {
                return;
            }
            if let Some(record) = record {
                let mut done = self.records.lock().expect("no worker panics");
                let at = done.partition_point(|other| other.model < record.model);
                self.tell(&record, done.len() + 1);
                done.insert(at, record);
            } else {
                self.tell_of_another_time(&model);
            }
        }
    }

    /// Waits for room for the next model and returns it; `None` if no model is left or the batch stops.
    fn next(&self) -> Option<Task> {
        let mut queue = self.queue.lock().expect("no worker panics");
        loop {
            if self.session.job.is_stopped() {
                return None;
            }
            match queue.next(|model| self.run.needs_mb(model)) {
                Next::Make(task) => return Some(task),
                Next::Go => return None,
                Next::Wait => {}
            }
            queue = self
                .has_room
                .wait_timeout(queue, LOOK)
                .expect("no worker panics")
                .0;
        }
    }

    fn tell_of_another_time(&self, model: &str) {
        match self.session.progress_form {
            Shown::Nothing => {}
            Shown::Events => eprintln!("{}", json!({ "event": "again", "model": model })),
            Shown::ForPeople => {
                println!(
                    "{model}: the time ran out before a kit passed; it is made again alone after all others"
                );
            }
        }
    }

    fn tell(&self, record: &Record, number: usize) {
        match self.session.progress_form {
            Shown::Nothing => {}
            Shown::Events => eprintln!(
                "{}",
                json!({ "event": "model", "number": number, "of": self.n_models, "record": record })
            ),
            Shown::ForPeople => println!("{number}/{} {}", self.n_models, record.line()),
        }
    }
}

fn report_results(session: &Session, options: &BatchOptions, records: &[Record]) {
    let n = |status| records.iter().filter(|r| r.status == status).count();
    let verified = n(Status::Verified);
    if session.is_json {
        let all: BTreeMap<&str, usize> = Status::ALL.iter().map(|&s| (s.name(), n(s))).collect();
        println!(
            "{}",
            json!({ "status": if verified == records.len() { "verified" } else { "failed" },
                    "models": records.len(), "by_status": all, "out": options.out,
                    "exit_code": u8::from(verified < records.len()) })
        );
    } else if session.progress_form == Shown::ForPeople {
        println!(
            "{verified} of {} models have a kit that passes every check: {}",
            records.len(),
            options.out.join(PAGE).display()
        );
    }
}

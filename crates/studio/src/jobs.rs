//! Queue of kits to make: one process runs, others wait, each can be stopped.

use std::collections::VecDeque;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use serde::Serialize;
use serde_json::Value;
use shellock_job::child::{self, Ended, TO_STOP};
use tokio::sync::{Notify, broadcast};

use crate::refusal::Refusal;

/// Number of notes kept per job, the latest.
const MOST_NOTES: usize = 200;
/// Number of jobs kept, and of those that may wait.
const MOST_KEPT: usize = 50;
const MOST_WAITING: usize = 8;
/// Number of events that a slow page may be behind; it reloads the project after missing more.
const MOST_EVENTS: usize = 256;
/// Progress of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum JobState {
    Waiting,
    Running,
    /// A kit was made and passes all checks.
    Verified,
    /// A kit was made, but a check failed.
    Failed,
    /// No kit was made, because of an error.
    Error,
    Stopped,
}

/// A job as the page sees it.
#[derive(Clone, Debug, Serialize)]
pub struct Job {
    pub id: u64,
    pub state: JobState,
    /// Name of the current stage; its number, from 1, and the number of stages, both 0 while unknown.
    pub stage: String,
    pub number: usize,
    pub n_stages: usize,
    pub seconds_left: Option<f64>,
    /// Time since the job began to run, s.
    pub seconds: f64,
    /// Attempts that were given up, with the reason.
    pub notes: Vec<String>,
    pub error: Option<String>,
    pub exit_code: Option<i32>,
    #[serde(skip)]
    since: Option<Instant>,
    /// Flag that stops the process.
    #[serde(skip)]
    stop: Arc<AtomicBool>,
}

impl Job {
    fn new(id: u64) -> Self {
        Self {
            id,
            state: JobState::Waiting,
            stage: String::new(),
            number: 0,
            n_stages: 0,
            seconds_left: None,
            seconds: 0.0,
            notes: Vec::new(),
            error: None,
            exit_code: None,
            since: None,
            stop: Arc::default(),
        }
    }

    /// Marks the job as running, if it still waits.
    fn begin(&mut self) {
        if self.state == JobState::Waiting {
            (self.state, self.since) = (JobState::Running, Some(Instant::now()));
        }
    }

    fn is_over(&self) -> bool {
        !matches!(self.state, JobState::Waiting | JobState::Running)
    }

    fn snapshot(&self) -> Self {
        let seconds = match self.since {
            Some(since) if !self.is_over() => since.elapsed().as_secs_f64(),
            _ => self.seconds,
        };
        Self {
            seconds,
            ..self.clone()
        }
    }

    /// Processes an event of the process.
    fn hear(&mut self, event: child::Event) {
        match event {
            child::Event::Stage {
                name,
                number,
                n_stages,
                seconds_left,
                ..
            } => {
                self.stage = name;
                if let (Some(number), Some(of)) = (number, n_stages) {
                    (self.number, self.n_stages) = (number, of);
                    self.seconds_left = seconds_left.flatten();
                }
            }
            child::Event::Note { text, .. } => {
                self.notes.push(text);
                let excess = self.notes.len().saturating_sub(MOST_NOTES);
                self.notes.drain(..excess);
            }
            child::Event::Effort { .. } => {}
        }
    }
}

/// News pushed to the page.
#[derive(Clone, Debug)]
pub enum Event {
    Job(Box<Job>),
    /// The project has changed.
    Project {
        /// Name of the page that asked for the change; empty if none did.
        by: String,
    },
}

/// Source of the commands that make kits.
pub trait Maker: Send + Sync + 'static {
    /// Returns the command that makes the next kit.
    fn task(&self) -> Result<Command, Refusal>;
    /// Takes notice of the end of a command: its exit code, `None` after a signal, and its standard output.
    fn on_end(&self, code: Option<i32>, output: &str);
}

/// All jobs of this server.
pub struct Jobs {
    maker: Box<dyn Maker>,
    to_stop: Duration,
    all: Mutex<VecDeque<Job>>,
    work: Notify,
    events: broadcast::Sender<Event>,
}

impl Jobs {
    /// Creates an empty queue; [`Self::run`] runs its jobs.
    pub fn new(maker: impl Maker) -> Arc<Self> {
        Self::with_time_to_stop(maker, TO_STOP)
    }

    fn with_time_to_stop(maker: impl Maker, to_stop: Duration) -> Arc<Self> {
        Arc::new(Self {
            maker: Box::new(maker),
            to_stop,
            all: Mutex::default(),
            work: Notify::new(),
            events: broadcast::channel(MOST_EVENTS).0,
        })
    }

    /// Subscribes to all events from now on.
    pub fn events(&self) -> broadcast::Receiver<Event> {
        self.events.subscribe()
    }

    /// Tells all pages that the project has changed, and which page changed it.
    pub fn tell_project(&self, by: String) {
        // Sending fails if no page listens, which is no error.
        let _ = self.events.send(Event::Project { by });
    }

    /// Lists all jobs, the oldest first.
    pub fn list(&self) -> Vec<Job> {
        self.lock().iter().map(Job::snapshot).collect()
    }

    /// Adds a job for one more kit. Refused if too many jobs wait.
    pub fn add(&self) -> Result<Job, Refusal> {
        let mut all = self.lock();
        if all.iter().filter(|job| job.state == JobState::Waiting).count() >= MOST_WAITING {
            return Err(Refusal::too_many());
        }
        let job = Job::new(all.back().map_or(1, |last| last.id + 1));
        all.push_back(job.clone());
        if all.len() > MOST_KEPT && all[0].is_over() {
            all.pop_front();
        }
        drop(all);
        self.tell(job.id);
        self.work.notify_one();
        Ok(job)
    }

    /// Stops a job, running or waiting.
    pub fn stop(&self, id: u64) -> Result<Job, Refusal> {
        self.change(id, |job| {
            if !job.is_over() {
                job.seconds = job.snapshot().seconds;
                job.state = JobState::Stopped;
                job.stop.store(true, Ordering::Relaxed);
            }
        })
        .ok_or_else(|| Refusal::not_found("there is no such job"))
    }

    /// Stops all jobs, because the server ends.
    pub fn close(&self) {
        for job in self.lock().iter() {
            job.stop.store(true, Ordering::Relaxed);
        }
    }

    /// Runs job after job; never returns.
    pub async fn run(self: Arc<Self>) {
        loop {
            let next = self
                .lock()
                .iter()
                .find(|job| job.state == JobState::Waiting)
                .map(|job| job.id);
            match next {
                Some(id) => self.run_one(id).await,
                None => self.work.notified().await,
            }
        }
    }

    async fn run_one(self: &Arc<Self>, id: u64) {
        let jobs = Arc::clone(self);
        // A panic there is reported where it happens; the next job is not affected.
        let _ = tokio::task::spawn_blocking(move || jobs.make(id)).await;
    }

    /// Makes the kit of a job, if it still waits.
    fn make(&self, id: u64) {
        let begun = self.change(id, Job::begin);
        let Some(job) = begun.filter(|job| job.state == JobState::Running) else {
            // The job was stopped before it began.
            return;
        };
        let ended = self.maker.task().and_then(|mut command| {
            let must_stop = || job.stop.load(Ordering::Relaxed);
            let hear = |event| {
                self.change(id, |job| job.hear(event));
            };
            child::run(&mut command, self.to_stop, must_stop, hear)
                .map_err(|e| Refusal::unable(format!("the program could not be started: {e}")))
        });
        match ended {
            Ok(ended) => {
                self.maker.on_end(ended.code, &ended.output);
                self.change(id, |job| job.end(&ended));
                self.tell_project(String::new());
            }
            Err(refusal) => {
                self.change(id, |job| {
                    if job.state == JobState::Running {
                        (job.state, job.error) = (JobState::Error, Some(refusal.to_string()));
                    }
                });
            }
        }
    }

    fn change(&self, id: u64, change: impl FnOnce(&mut Job)) -> Option<Job> {
        let changed = self.lock().iter_mut().find(|job| job.id == id).map(|job| {
            change(job);
            job.snapshot()
        });
        self.tell(id);
        changed
    }

    fn tell(&self, id: u64) {
        let job = self.lock().iter().find(|job| job.id == id).map(Job::snapshot);
        if let Some(job) = job {
            // Sending fails if no page listens, which is no error.
            let _ = self.events.send(Event::Job(Box::new(job)));
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, VecDeque<Job>> {
        self.all.lock().expect("no holder of this lock panics")
    }
}

impl Job {
    /// Records the end of the process.
    fn end(&mut self, ended: &Ended) {
        if self.state == JobState::Running {
            self.seconds = self.snapshot().seconds;
            self.state = match ended.code {
                Some(0) => JobState::Verified,
                Some(1) => JobState::Failed,
                _ => JobState::Error,
            };
        }
        (self.exit_code, self.seconds_left) = (ended.code, None);
        if self.state == JobState::Error {
            let told = serde_json::from_str::<Value>(&ended.output).ok();
            let told = told.and_then(|value| value["error"].as_str().map(str::to_owned));
            let words = || match ended.errors.join("\n").trim() {
                "" => "the program ended without a message".to_owned(),
                errors => errors.to_owned(),
            };
            self.error = Some(told.unwrap_or_else(words));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_hears_its_stage_and_keeps_the_latest_notes() {
        let mut job = Job::new(1);
        let mut hear = |line: &str| job.hear(serde_json::from_str(line).unwrap());
        hear(r#"{"event":"stage","name":"bodies","n_steps":0,"number":12,"n_stages":19,"seconds_left":7.0}"#);
        hear(r#"{"event":"stage","name":"reading","n_steps":0}"#);
        (0..300).for_each(|i| hear(&format!(r#"{{"event":"note","text":"note {i}"}}"#)));
        assert_eq!((&job.stage[..], job.number, job.n_stages), ("reading", 12, 19));
        assert_eq!(job.seconds_left, Some(7.0));
        assert_eq!(
            (job.notes.len(), &job.notes[MOST_NOTES - 1][..]),
            (MOST_NOTES, "note 299")
        );
    }

    #[test]
    fn how_a_job_ended_is_told_by_its_code_and_its_own_words() {
        let ended = |code, output: &str, errors: &str| {
            let mut job = Job::new(1);
            job.state = JobState::Running;
            let (output, errors) = (output.to_owned(), vec![errors.to_owned()]);
            job.end(&Ended {
                code,
                output,
                errors,
                peak_mb: None,
            });
            job
        };
        assert_eq!(ended(Some(0), "{}", "").state, JobState::Verified);
        assert_eq!(ended(Some(1), "{}", "").state, JobState::Failed);
        let wrong = ended(Some(2), r#"{"error":"too thin"}"#, "");
        assert_eq!(
            (wrong.state, wrong.error.as_deref()),
            (JobState::Error, Some("too thin"))
        );
        assert_eq!(ended(None, "", "killed").error.as_deref(), Some("killed"));
        let mut stopped = Job::new(1);
        stopped.state = JobState::Stopped;
        stopped.end(&Ended {
            code: Some(130),
            ..Ended::default()
        });
        assert_eq!((stopped.state, stopped.error), (JobState::Stopped, None));
    }

    /// Stands in for kits: shell scripts, one after the other.
    #[cfg(unix)]
    struct Scripts(Mutex<VecDeque<&'static str>>);

    #[cfg(unix)]
    impl Maker for Scripts {
        fn task(&self) -> Result<Command, Refusal> {
            let script = self.0.lock().unwrap().pop_front();
            let mut command = Command::new("sh");
            command.arg("-c").arg(script.ok_or_else(Refusal::too_many)?);
            Ok(command)
        }

        fn on_end(&self, _: Option<i32>, _: &str) {}
    }

    /// Waits until the job is in none of these states, and returns it.
    #[cfg(unix)]
    async fn wait_past(jobs: &Jobs, id: u64, states: &[JobState]) -> Job {
        loop {
            let job = jobs.list().into_iter().find(|job| job.id == id).unwrap();
            if !states.contains(&job.state) {
                return job;
            }
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    }

    #[cfg(unix)]
    #[tokio::test]
    async fn a_stopped_job_that_does_not_end_holds_up_no_other() {
        // The second leaves a process behind that keeps its pipes open.
        for stuck in ["exec sleep 20", "sleep 20; true"] {
            let scripts = Scripts(Mutex::new([stuck, "exit 1"].into()));
            let jobs = Jobs::with_time_to_stop(scripts, Duration::from_millis(200));
            let ids = [(); 2].map(|()| jobs.add().unwrap().id);
            let running = tokio::spawn(Arc::clone(&jobs).run());
            wait_past(&jobs, ids[0], &[JobState::Waiting]).await;
            jobs.stop(ids[0]).unwrap();
            let next = wait_past(&jobs, ids[1], &[JobState::Waiting, JobState::Running]);
            let next = tokio::time::timeout(Duration::from_secs(10), next).await;
            assert_eq!(next.expect("it runs").state, JobState::Failed, "{stuck}");
            assert_eq!(jobs.list()[0].state, JobState::Stopped);
            running.abort();
        }
    }

    #[cfg(unix)]
    #[tokio::test]
    async fn a_stopped_job_may_end_by_itself_and_its_notes_are_kept() {
        let scripts = Scripts(Mutex::new(
            [r#"cat; echo '{"event":"note","text":"tidied up"}' >&2; exit 130"#].into(),
        ));
        let jobs = Jobs::new(scripts);
        let id = jobs.add().unwrap().id;
        let running = tokio::spawn(Arc::clone(&jobs).run());
        wait_past(&jobs, id, &[JobState::Waiting]).await;
        jobs.stop(id).unwrap();
        let ended = async {
            while jobs.list()[0].exit_code.is_none() {
                tokio::time::sleep(Duration::from_millis(10)).await;
            }
        };
        let ended = tokio::time::timeout(Duration::from_secs(10), ended).await;
        ended.expect("it ends with its standard input");
        let job = &jobs.list()[0];
        assert_eq!((job.state, job.exit_code), (JobState::Stopped, Some(130)));
        assert_eq!(job.notes, ["tidied up"]);
        running.abort();
    }
}

//! Queue of kits to make: one process runs, others wait, each can be stopped.
//!
//! A process is the program itself with `--json`. It reports progress as lines of JSON on standard error, and
//! the result on standard output. It ends when its standard input is closed, so none outlives this server. A
//! stopped process that does not end is killed.

use std::collections::VecDeque;
use std::process::Stdio;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use serde::Serialize;
use serde_json::Value;
use tokio::io::{AsyncBufReadExt, AsyncReadExt, BufReader};
use tokio::process::{Child, ChildStderr, ChildStdout, Command};
use tokio::sync::{Notify, broadcast};

use crate::{Refusal, Task, Workshop};

/// Number of notes kept per job, the latest.
const MOST_NOTES: usize = 200;
/// Number of jobs kept, and of those that may wait.
const MOST_KEPT: usize = 50;
const MOST_WAITING: usize = 8;
/// Number of events that a slow page may be behind; it reloads the project after missing more.
const MOST_EVENTS: usize = 256;
/// Time that a stopped process has to end by itself before it is killed.
///
/// `build` ends 0.3 s after its standard input is closed, or when the files that it is writing are complete:
/// `batch` waits as long.
const TO_STOP: Duration = Duration::from_secs(10);

/// Progress of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
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
    pub state: State,
    /// Name of the current stage; its number, from 1, and the number of stages, both 0 while unknown.
    pub stage: String,
    pub number: u64,
    pub n_stages: u64,
    pub seconds_left: Option<f64>,
    /// Time since the job began to run, s.
    pub seconds: f64,
    /// Attempts that were given up, with the reason.
    pub notes: Vec<String>,
    pub error: Option<String>,
    pub exit_code: Option<i32>,
    #[serde(skip)]
    since: Option<Instant>,
    /// Notified when the process is to stop.
    #[serde(skip)]
    stop: Arc<Notify>,
}

impl Job {
    fn new(id: u64) -> Self {
        Self {
            id,
            state: State::Waiting,
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
        if self.state == State::Waiting {
            (self.state, self.since) = (State::Running, Some(Instant::now()));
        }
    }

    fn is_over(&self) -> bool {
        !matches!(self.state, State::Waiting | State::Running)
    }

    fn told(&self) -> Self {
        let seconds = match self.since {
            Some(since) if !self.is_over() => since.elapsed().as_secs_f64(),
            _ => self.seconds,
        };
        Self {
            seconds,
            ..self.clone()
        }
    }

    /// Processes a line of the process's standard error.
    fn hear(&mut self, line: &str) {
        let Ok(event) = serde_json::from_str::<Value>(line) else {
            return;
        };
        match event["event"].as_str() {
            Some("stage") => {
                self.stage = event["name"].as_str().unwrap_or_default().to_owned();
                if let (Some(number), Some(of)) = (event["number"].as_u64(), event["n_stages"].as_u64()) {
                    (self.number, self.n_stages) = (number, of);
                    self.seconds_left = event["seconds_left"].as_f64();
                }
            }
            Some("note") => {
                self.notes.extend(event["text"].as_str().map(str::to_owned));
                let excess = self.notes.len().saturating_sub(MOST_NOTES);
                self.notes.drain(..excess);
            }
            _ => {}
        }
    }
}

/// News pushed to the page.
#[derive(Clone, Debug)]
pub enum Event {
    Job(Box<Job>),
    /// The project has changed.
    Project,
}

/// The part of a [`Workshop`] that makes kits.
pub trait Maker: Send + Sync + 'static {
    /// Returns the next task, as [`Workshop::task`].
    fn task(&self) -> Result<Task, Refusal>;
    /// Reports its end, as [`Workshop::ended`].
    fn ended(&self, code: Option<i32>, output: &str);
}

impl Maker for Arc<dyn Workshop> {
    fn task(&self) -> Result<Task, Refusal> {
        (**self).task()
    }

    fn ended(&self, code: Option<i32>, output: &str) {
        (**self).ended(code, output);
    }
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

    /// Tells all pages that the project has changed.
    pub fn tell_project(&self) {
        // Sending fails if no page listens, which is no error.
        let _ = self.events.send(Event::Project);
    }

    /// Lists all jobs, the oldest first.
    pub fn list(&self) -> Vec<Job> {
        self.lock().iter().map(Job::told).collect()
    }

    /// Adds a job for one more kit. Refused if too many jobs wait.
    pub fn add(&self) -> Result<Job, Refusal> {
        let mut all = self.lock();
        if all.iter().filter(|job| job.state == State::Waiting).count() >= MOST_WAITING {
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
                job.seconds = job.told().seconds;
                job.state = State::Stopped;
                job.stop.notify_one();
            }
        })
        .ok_or_else(|| Refusal::missing("there is no such job"))
    }

    /// Runs job after job; never returns.
    pub async fn run(self: Arc<Self>) {
        loop {
            let next = self
                .lock()
                .iter()
                .find(|job| job.state == State::Waiting)
                .map(|job| job.id);
            match next {
                Some(id) => self.run_one(id).await,
                None => self.work.notified().await,
            }
        }
    }

    async fn run_one(&self, id: u64) {
        let begun = self.change(id, Job::begin);
        let Some(job) = begun.filter(|job| job.state == State::Running) else {
            // The job was stopped before it began.
            return;
        };
        let started = self.maker.task().and_then(|task| {
            spawned(&task).map_err(|e| Refusal::unable(format!("the program could not be started: {e}")))
        });
        let child = match started {
            Ok(child) => child,
            Err(refusal) => {
                self.change(id, |job| {
                    if job.state == State::Running {
                        (job.state, job.error) = (State::Error, Some(refusal.to_string()));
                    }
                });
                return;
            }
        };
        let ended = watch(child, &job.stop, self.to_stop, |line| {
            self.change(id, |job| job.hear(line));
        });
        let Ended { code, output, errors } = ended.await;
        self.maker.ended(code, &output);
        self.change(id, |job| job.end(code, &output, errors));
        self.tell_project();
    }

    fn change(&self, id: u64, change: impl FnOnce(&mut Job)) -> Option<Job> {
        let changed = self.lock().iter_mut().find(|job| job.id == id).map(|job| {
            change(job);
            job.told()
        });
        self.tell(id);
        changed
    }

    fn tell(&self, id: u64) {
        let job = self.lock().iter().find(|job| job.id == id).map(Job::told);
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
    fn end(&mut self, code: Option<i32>, output: &str, errors: String) {
        if self.state == State::Running {
            self.seconds = self.told().seconds;
            self.state = match code {
                Some(0) => State::Verified,
                Some(1) => State::Failed,
                _ => State::Error,
            };
        }
        (self.exit_code, self.seconds_left) = (code, None);
        if self.state == State::Error {
            let told = serde_json::from_str::<Value>(output).ok();
            let told = told.and_then(|value| value["error"].as_str().map(str::to_owned));
            let words = || match errors.trim() {
                "" => "the program ended without a word".to_owned(),
                errors => errors.to_owned(),
            };
            self.error = Some(told.unwrap_or_else(words));
        }
    }
}

fn spawned(task: &Task) -> std::io::Result<Child> {
    Command::new(&task.program)
        .args(&task.arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .kill_on_drop(true)
        .spawn()
}

/// Result of a process that has ended.
#[derive(Default)]
struct Ended {
    /// Exit code; `None` if a signal ended the process.
    code: Option<i32>,
    /// Text of its standard output.
    output: String,
    /// Lines of its standard error that are no events.
    errors: String,
}

/// Waits for the end of `child`, and passes its events to `hear`.
///
/// Once `stop` is notified, the standard input of `child` is closed. If `child` has not ended `to_stop`
/// later, it is killed; a killed process has no output.
async fn watch(mut child: Child, stop: &Notify, to_stop: Duration, hear: impl FnMut(&str)) -> Ended {
    let stdin = child.stdin.take();
    let overdue = async {
        stop.notified().await;
        drop(stdin);
        tokio::time::sleep(to_stop).await;
    };
    let (stdout, stderr) = (child.stdout.take(), child.stderr.take());
    let listening = async {
        let (output, errors) = tokio::join!(printed(stdout), progress(stderr, hear));
        let status = child.wait().await;
        Ended {
            code: status.ok().and_then(|status| status.code()),
            output,
            errors,
        }
    };
    // Child processes of a killed one may keep its pipes open, so reading them is abandoned.
    let ended = tokio::select! {
        ended = listening => Some(ended),
        () = overdue => None,
    };
    if ended.is_none() {
        // Killing fails only if the process has just ended.
        let _ = child.kill().await;
    }
    ended.unwrap_or_default()
}

/// Reads a process's standard output to its end.
async fn printed(stdout: Option<ChildStdout>) -> String {
    let mut output = Vec::new();
    if let Some(mut stdout) = stdout {
        // A partial answer is no JSON, and is reported as such.
        let _ = stdout.read_to_end(&mut output).await;
    }
    String::from_utf8_lossy(&output).into_owned()
}

/// Passes events on standard error to `hear`. Returns the other lines.
async fn progress(stderr: Option<ChildStderr>, mut hear: impl FnMut(&str)) -> String {
    let mut errors = String::new();
    let Some(stderr) = stderr else { return errors };
    let mut lines = BufReader::new(stderr).lines();
    while let Ok(Some(line)) = lines.next_line().await {
        if line.starts_with('{') {
            hear(&line);
        } else {
            errors += &line;
            errors.push('\n');
        }
    }
    errors
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_hears_its_stage_and_keeps_the_latest_notes() {
        let mut job = Job::new(1);
        job.hear(
            r#"{"event":"stage","name":"bodies","n_steps":0,"number":12,"n_stages":19,"seconds_left":7.0}"#,
        );
        assert_eq!(
            (&job.stage[..], job.number, job.n_stages, job.seconds_left),
            ("bodies", 12, 19, Some(7.0))
        );
        job.hear(r#"{"event":"stage","name":"reading","n_steps":0}"#);
        assert_eq!((&job.stage[..], job.number), ("reading", 12));
        (0..300).for_each(|i| job.hear(&format!(r#"{{"event":"note","text":"note {i}"}}"#)));
        job.hear("no JSON");
        assert_eq!(
            (job.notes.len(), &job.notes[MOST_NOTES - 1][..]),
            (MOST_NOTES, "note 299")
        );
    }

    #[test]
    fn how_a_job_ended_is_told_by_its_code_and_its_own_words() {
        let ended = |code, output: &str, errors: &str| {
            let mut job = Job::new(1);
            job.state = State::Running;
            job.end(code, output, errors.to_owned());
            job
        };
        assert_eq!(ended(Some(0), "{}", "").state, State::Verified);
        assert_eq!(ended(Some(1), "{}", "").state, State::Failed);
        let wrong = ended(Some(2), r#"{"error":"too thin"}"#, "");
        assert_eq!(
            (wrong.state, wrong.error.as_deref()),
            (State::Error, Some("too thin"))
        );
        assert_eq!(ended(None, "", "killed\n").error.as_deref(), Some("killed"));
        let mut stopped = Job::new(1);
        stopped.state = State::Stopped;
        stopped.end(Some(130), "", String::new());
        assert_eq!((stopped.state, stopped.error), (State::Stopped, None));
    }

    /// Stands in for kits: shell scripts, one after the other.
    #[cfg(unix)]
    struct Scripts(Mutex<VecDeque<&'static str>>);

    #[cfg(unix)]
    impl Maker for Scripts {
        fn task(&self) -> Result<Task, Refusal> {
            let script = self.0.lock().unwrap().pop_front();
            Ok(Task {
                program: "sh".into(),
                arguments: vec!["-c".into(), script.ok_or_else(Refusal::too_many)?.into()],
            })
        }

        fn ended(&self, _: Option<i32>, _: &str) {}
    }

    /// Waits until the job is in none of these states, and returns it.
    #[cfg(unix)]
    async fn left(jobs: &Jobs, id: u64, states: &[State]) -> Job {
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
            left(&jobs, ids[0], &[State::Waiting]).await;
            jobs.stop(ids[0]).unwrap();
            let next = left(&jobs, ids[1], &[State::Waiting, State::Running]);
            let next = tokio::time::timeout(Duration::from_secs(10), next).await;
            assert_eq!(next.expect("it runs").state, State::Failed, "{stuck}");
            assert_eq!(jobs.list()[0].state, State::Stopped);
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
        left(&jobs, id, &[State::Waiting]).await;
        jobs.stop(id).unwrap();
        let ended = async {
            while jobs.list()[0].exit_code.is_none() {
                tokio::time::sleep(Duration::from_millis(10)).await;
            }
        };
        let ended = tokio::time::timeout(Duration::from_secs(10), ended).await;
        ended.expect("it ends with its standard input");
        let job = &jobs.list()[0];
        assert_eq!((job.state, job.exit_code), (State::Stopped, Some(130)));
        assert_eq!(job.notes, ["tidied up"]);
        running.abort();
    }
}

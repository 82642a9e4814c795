//! Shows progress on standard error.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use shellock::context::Progress;

use crate::course::{Course, Stand};
use crate::stopwatch::{StageTime, Stopwatch};

/// Form in which progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// A bar on a terminal, plain lines elsewhere.
    ForPeople,
    /// One JSON object a line: `{"event": "stage", "name", "n_steps", "seconds"}`, for stages of a kit also
    /// `number`, `n_stages` and `seconds_left` (null at first); `{"event": "note", "text", "seconds"}`; at
    /// the end `{"event": "effort", "stages": [{"name", "seconds", "cpu_seconds", "rounds"}], "seconds"}`.
    Events,
    /// No progress is shown.
    Nothing,
}

/// Shows stages as they begin.
pub struct Display {
    bar: Mutex<Option<ProgressBar>>,
    is_terminal: bool,
    shown: Shown,
    since: Instant,
    watch: Stopwatch,
    course: Option<Mutex<Course>>,
}

impl Display {
    /// Creates a display that has shown nothing yet.
    pub fn new(shown: Shown) -> Self {
        Self {
            bar: Mutex::new(None),
            is_terminal: std::io::stderr().is_terminal(),
            shown,
            since: Instant::now(),
            watch: Stopwatch::new(),
            course: None,
        }
    }

    /// Creates a display for a kit, whose stages are counted.
    pub fn of_kit(shown: Shown) -> Self {
        Self {
            course: Some(Mutex::new(Course::new())),
            ..Self::new(shown)
        }
    }

    fn stand(&self, name: &str) -> Option<Stand> {
        let mut course = self
            .course
            .as_ref()?
            .lock()
            .expect("no holder of this lock panics");
        course.begin(name, Instant::now())
    }

    /// Time that each stage has taken so far.
    pub fn stages(&self) -> Vec<StageTime> {
        self.watch.stages()
    }

    /// Shows a report of the library.
    pub fn show(&self, progress: Progress<'_>) {
        if let Progress::Stage { name, .. } = progress {
            self.watch.begin(name);
        }
        match self.shown {
            Shown::ForPeople => self.show_people(progress),
            Shown::Events => self.show_event(&progress),
            Shown::Nothing => {}
        }
    }

    fn show_event(&self, progress: &Progress<'_>) {
        let seconds = (1000.0 * self.since.elapsed().as_secs_f64()).round() / 1000.0;
        match progress {
            Progress::Stage { name, n_steps } => {
                let mut event =
                    json!({ "event": "stage", "name": name, "n_steps": n_steps, "seconds": seconds });
                if let Some(stand) = self.stand(name) {
                    event["number"] = stand.number.into();
                    event["n_stages"] = stand.of.into();
                    event["seconds_left"] = stand.left.map(|left| left.as_secs_f64().round()).into();
                }
                eprintln!("{event}");
            }
            Progress::Note(text) => {
                eprintln!("{}", json!({ "event": "note", "text": text, "seconds": seconds }))
            }
            Progress::Step => {}
        }
    }

    fn show_people(&self, progress: Progress<'_>) {
        let mut bar = self.bar.lock().expect("no holder of this lock panics");
        match progress {
            Progress::Stage { name, n_steps } if self.is_terminal => {
                if let Some(old) = bar.take() {
                    old.finish_and_clear();
                }
                *bar = Some(stage_bar(&self.named(name, Stand::timed_words), n_steps));
            }
            Progress::Stage { name, .. } => eprintln!("{} …", self.named(name, Stand::words)),
            Progress::Step => {
                if let Some(bar) = bar.as_ref() {
                    bar.inc(1);
                }
            }
            Progress::Note(text) => match bar.as_ref() {
                Some(bar) => bar.println(text),
                None => eprintln!("{text}"),
            },
        }
    }

    /// Name of a stage with its number, if it has one.
    fn named(&self, name: &str, words: impl Fn(&Stand, &str) -> String) -> String {
        self.stand(name)
            .map_or_else(|| name.to_owned(), |stand| words(&stand, name))
    }

    /// Removes the last bar; with events, also prints the time that the stages took.
    pub fn finish(&self) {
        if self.shown == Shown::Events {
            let seconds = self.since.elapsed().as_secs_f64();
            eprintln!(
                "{}",
                json!({ "event": "effort", "stages": self.stages(), "seconds": seconds })
            );
        }
        if let Some(bar) = self.bar.lock().expect("no holder of this lock panics").take() {
            bar.finish_and_clear();
        }
    }
}

/// Time by which the whole job should be done.
pub struct Deadline(Option<Instant>);

impl Deadline {
    /// Deadline `seconds` after `since`; none if `seconds` is 0.
    pub fn new(seconds: f64, since: Instant) -> Self {
        let time = Duration::try_from_secs_f64(seconds).ok();
        let time = time.filter(|time| !time.is_zero());
        Self(time.and_then(|time| since.checked_add(time)))
    }

    /// Time left, s: negative after the deadline, infinite if there is none.
    pub fn seconds_left(&self) -> f64 {
        let Some(at) = self.0 else {
            return f64::INFINITY;
        };
        let now = Instant::now();
        at.checked_duration_since(now)
            .map_or_else(|| -(now - at).as_secs_f64(), |left| left.as_secs_f64())
    }
}

/// Limits the time of the current search for a plan.
pub struct PlanClock {
    since: Mutex<Instant>,
    limit: Duration,
}

impl PlanClock {
    /// Clock for searches that were allowed the work of `plan_time_s`. They get twice that time, and 10 s
    /// more to find a first plan.
    pub fn new(plan_time_s: f64) -> Self {
        const GRACE_S: f64 = 10.0;
        let limit = Duration::try_from_secs_f64(2.0 * plan_time_s + GRACE_S).unwrap_or(Duration::MAX);
        Self {
            since: Mutex::new(Instant::now()),
            limit,
        }
    }

    /// Restarts the clock at every stage, so that each search has its own time.
    pub fn see(&self, progress: &Progress<'_>) {
        if let Progress::Stage { .. } = progress {
            *self.since.lock().expect("no holder of this lock panics") = Instant::now();
        }
    }

    /// Returns true if the stage has taken longer than planning may.
    pub fn is_up(&self) -> bool {
        self.since
            .lock()
            .expect("no holder of this lock panics")
            .elapsed()
            > self.limit
    }
}

fn stage_bar(name: &str, n_steps: usize) -> ProgressBar {
    let (bar, template) = if n_steps > 0 {
        (
            ProgressBar::new(n_steps as u64),
            "{elapsed:>4} {msg} {wide_bar} {pos}/{len}, {eta} left",
        )
    } else {
        (ProgressBar::new_spinner(), "{elapsed:>4} {msg} {spinner}")
    };
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar.set_message(name.to_owned());
    bar.enable_steady_tick(Duration::from_millis(120));
    bar
}

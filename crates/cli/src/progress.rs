//! Progress on standard error.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use shellock::context::Progress;

/// How progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// A bar on a terminal, plain lines elsewhere.
    ForPeople,
    /// One JSON object a line: `{"event": "stage", "name", "n_steps", "seconds"}`, `{"event": "note", "text",
    /// "seconds"}`.
    Events,
    /// Not at all.
    Nothing,
}

/// Shows stages as they come.
pub struct Display {
    bar: Mutex<Option<ProgressBar>>,
    is_terminal: bool,
    shown: Shown,
    since: Instant,
}

impl Display {
    /// A display that has shown nothing yet.
    pub fn new(shown: Shown) -> Self {
        Self {
            bar: Mutex::new(None),
            is_terminal: std::io::stderr().is_terminal(),
            shown,
            since: Instant::now(),
        }
    }

    /// What the library reports.
    pub fn show(&self, progress: Progress<'_>) {
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
                eprintln!(
                    "{}",
                    json!({ "event": "stage", "name": name, "n_steps": n_steps, "seconds": seconds })
                );
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
                *bar = Some(stage_bar(name, n_steps));
            }
            Progress::Stage { name, .. } => eprintln!("{name} …"),
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

    /// Takes the last bar away.
    pub fn finish(&self) {
        if let Some(bar) = self.bar.lock().expect("no holder of this lock panics").take() {
            bar.finish_and_clear();
        }
    }
}

/// How long the current search for a plan has been going on.
pub struct PlanClock {
    since: Mutex<Instant>,
    limit: Duration,
}

impl PlanClock {
    /// A clock for searches that were allowed work of `plan_time_s`; they get twice the time, and some to
    /// find any plan.
    pub fn new(plan_time_s: f64) -> Self {
        const GRACE_S: f64 = 10.0;
        let limit = Duration::try_from_secs_f64(2.0 * plan_time_s + GRACE_S).unwrap_or(Duration::MAX);
        Self {
            since: Mutex::new(Instant::now()),
            limit,
        }
    }

    /// Every stage starts the clock anew, so each search has its own time.
    pub fn see(&self, progress: &Progress<'_>) {
        if let Progress::Stage { .. } = progress {
            *self.since.lock().expect("no holder of this lock panics") = Instant::now();
        }
    }

    /// Whether the stage has gone on for longer than planning may.
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

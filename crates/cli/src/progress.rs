//! Shows progress on standard error.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use shellock::Progress;
use shellock_job::child::Event;
use shellock_job::course::{Course, Stand};
use shellock_job::stopwatch::{StageTime, Stopwatch};

/// Form in which progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// A bar on a terminal, plain lines elsewhere.
    ForPeople,
    /// An [`Event`] in JSON a line.
    Events,
    /// No progress is shown.
    Nothing,
}

/// Shows stages as they begin.
pub struct Display {
    bar: Mutex<Option<ProgressBar>>,
    is_terminal: bool,
    form: Shown,
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
            form: shown,
            since: Instant::now(),
            watch: Stopwatch::start(),
            course: None,
        }
    }

    /// Creates a display for a kit, whose stages are counted.
    pub fn of_kit(shown: Shown) -> Self {
        Self {
            course: Some(Mutex::new(Course::default())),
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
        match self.form {
            Shown::ForPeople => self.show_people(progress),
            Shown::Events => self.show_event(&progress),
            Shown::Nothing => {}
        }
    }

    fn show_event(&self, progress: &Progress<'_>) {
        let seconds = (1000.0 * self.since.elapsed().as_secs_f64()).round() / 1000.0;
        match *progress {
            Progress::Stage { name, n_steps } => {
                let stand = self.stand(name);
                print_event(&Event::Stage {
                    n_stages: stand.map(|stand| stand.of),
                    n_steps,
                    name: name.to_owned(),
                    number: stand.map(|stand| stand.number),
                    seconds,
                    seconds_left: stand.map(|stand| stand.time_left.map(|left| left.as_secs_f64().round())),
                });
            }
            Progress::Note(text) => print_event(&Event::Note {
                seconds,
                text: text.to_owned(),
            }),
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
                *bar = Some(stage_bar(&self.stage_name(name, Stand::timed_words), n_steps));
            }
            Progress::Stage { name, .. } => eprintln!("{} …", self.stage_name(name, Stand::words)),
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
    fn stage_name(&self, name: &str, words: impl Fn(&Stand, &str) -> String) -> String {
        self.stand(name)
            .map_or_else(|| name.to_owned(), |stand| words(&stand, name))
    }

    /// Removes the last bar; with events, also prints the time that the stages took.
    pub fn finish(&self) {
        if self.form == Shown::Events {
            print_event(&Event::Effort {
                seconds: self.since.elapsed().as_secs_f64(),
                stages: self.stages(),
            });
        }
        if let Some(bar) = self.bar.lock().expect("no holder of this lock panics").take() {
            bar.finish_and_clear();
        }
    }
}

fn print_event(event: &Event) {
    let text = serde_json::to_string(event).expect("numbers and strings can be written");
    eprintln!("{text}");
}

/// Display of a single stage, which ends when it is dropped.
pub struct OneStage(Display);

impl OneStage {
    /// Shows the stage `name`.
    pub fn begin(shown: Shown, name: &str) -> Self {
        let display = Display::new(shown);
        display.show(Progress::Stage { name, n_steps: 0 });
        Self(display)
    }
}

impl Drop for OneStage {
    fn drop(&mut self) {
        self.0.finish();
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

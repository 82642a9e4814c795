//! Kits made by processes of their own: the program itself, with `--json`.
//!
//! Such a process reports its progress as [`Event`]s, a line of JSON each on standard error, and its result
//! on standard output. It ends when its standard input is closed, so none outlives the process that began it.
//! A process that was asked to stop and does not end is killed.

use std::fs;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use crate::stopwatch::StageTime;

/// Time that a process has to end by itself before it is killed.
///
/// `build` ends 0.3 s after its standard input is closed, or when the files that it is writing are complete.
pub const TO_STOP: Duration = Duration::from_secs(10);
/// Interval at which a process is checked.
const LOOK: Duration = Duration::from_millis(40);

/// Progress of a process.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "lowercase")]
pub enum Event {
    /// A stage of the job begins.
    Stage {
        /// Number of stages in all, for stages of a kit.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        n_stages: Option<usize>,
        /// Number of steps of the stage; 0 if unknown.
        n_steps: usize,
        /// Name of the stage.
        name: String,
        /// Number of the stage, from 1, for stages of a kit.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        number: Option<usize>,
        /// Time since the process began, s.
        #[serde(default)]
        seconds: f64,
        /// Time left, s, for stages of a kit; `null` while too little is done.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        seconds_left: Option<Option<f64>>,
    },
    /// A decision was made.
    Note {
        /// Time since the process began, s.
        #[serde(default)]
        seconds: f64,
        /// Decision, in words for people.
        text: String,
    },
    /// All stages have ended.
    Effort {
        /// Time since the process began, s.
        seconds: f64,
        /// Time of each stage.
        stages: Vec<StageTime>,
    },
}

/// Command that makes the kit of `model` in the folder `out`, in place of an earlier one. Further arguments
/// may be added.
pub fn build(program: &Path, model: &Path, out: &Path) -> Command {
    let mut command = Command::new(program);
    command.arg("build").arg(model).arg("--out").arg(out);
    command.args(["--force", "--json", "--stop-with-stdin"]);
    command
}

/// Result of a process that has ended.
#[derive(Debug, Default)]
pub struct Ended {
    /// Exit code; `None` if a signal ended the process.
    pub code: Option<i32>,
    /// Text of its standard output; empty if it was killed.
    pub output: String,
    /// Lines of its standard error that are no events.
    pub errors: Vec<String>,
    /// Peak memory, MB; `None` if the system does not report it.
    pub peak_mb: Option<f64>,
}

/// Text from one of a process's pipes.
enum Said {
    /// All of its standard output.
    Output(String),
    /// A line of its standard error.
    Line(String),
}

impl Ended {
    fn hear(&mut self, said: Said, hear: &mut impl FnMut(Event)) {
        match said {
            Said::Output(text) => self.output = text,
            Said::Line(line) if line.starts_with('{') => {
                // Events of other kinds are of no use here.
                if let Ok(event) = serde_json::from_str(&line) {
                    hear(event);
                }
            }
            Said::Line(line) => self.errors.push(line),
        }
    }
}

/// Runs a process to its end, and passes its events to `hear`.
///
/// Once `must_stop` is true, its standard input is closed. If it has not ended `to_stop` later, it is killed.
pub fn run(
    command: &mut Command,
    to_stop: Duration,
    mut must_stop: impl FnMut() -> bool,
    mut hear: impl FnMut(Event),
) -> io::Result<Ended> {
    let pipes = command.stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = pipes.stderr(Stdio::piped()).spawn()?;
    let said = listen(&mut child);
    let mut ended = Ended::default();
    let (mut asked, mut is_open): (Option<Instant>, _) = (None, true);
    loop {
        if is_open {
            match said.recv_timeout(LOOK) {
                Ok(said) => ended.hear(said, &mut hear),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => is_open = false,
            }
        } else if let Some(status) = child.try_wait().transpose() {
            ended.code = status.ok().and_then(|status| status.code());
            return Ok(ended);
        } else {
            std::thread::sleep(LOOK);
        }
        ended.peak_mb = peak_mb(child.id()).or(ended.peak_mb);
        if asked.is_none() && must_stop() {
            asked = Some(Instant::now());
            drop(child.stdin.take());
        }
        if asked.is_some_and(|at| at.elapsed() > to_stop) {
            // Killing fails only if the process has just ended.
            let _ = child.kill();
            let _ = child.wait();
            // Child processes of a killed one may keep its pipes open, so reading them is abandoned.
            return Ok(Ended {
                peak_mb: ended.peak_mb,
                ..Ended::default()
            });
        }
    }
}

/// Reads both pipes of a process, each in a thread, because a process blocks when nobody reads its pipe.
fn listen(child: &mut Child) -> Receiver<Said> {
    let (send, receive) = channel();
    let (output, errors) = (child.stdout.take(), child.stderr.take());
    let to_all = send.clone();
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(mut output) = output {
            // Output before a read error is kept; a partial answer is reported as such.
            let _ = output.read_to_end(&mut bytes);
        }
        // Nobody listens to a process that was killed.
        let _ = to_all.send(Said::Output(String::from_utf8_lossy(&bytes).into_owned()));
    });
    std::thread::spawn(move || {
        let lines = errors
            .into_iter()
            .flat_map(|pipe| BufReader::new(pipe).split(b'\n'));
        for line in lines.map_while(Result::ok) {
            let line = String::from_utf8_lossy(&line);
            if send
                .send(Said::Line(line.trim_end_matches('\r').to_owned()))
                .is_err()
            {
                return;
            }
        }
    });
    receive
}

/// Peak memory of a process so far, MB; `None` if the system does not report it.
fn peak_mb(process: u32) -> Option<f64> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    megabytes(&status, "VmHWM:")
}

/// Free memory, MB; `None` if the system does not report it.
pub fn available_mb() -> Option<f64> {
    megabytes(&fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:")
}

/// Figure after `name` in a list of figures in kB, in MB.
fn megabytes(text: &str, name: &str) -> Option<f64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let number: f64 = line.split_whitespace().next()?.parse().ok()?;
    Some(number / 1e3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_are_written_as_they_are_read() {
        for line in [
            r#"{"event":"stage","n_stages":19,"n_steps":0,"name":"bodies","number":12,"seconds":3.25,"seconds_left":7.0}"#,
            r#"{"event":"stage","n_steps":4,"name":"reading","seconds":0.0}"#,
            r#"{"event":"note","seconds":1.5,"text":"joined"}"#,
            r#"{"event":"effort","seconds":2.0,"stages":[]}"#,
        ] {
            let event: Event = serde_json::from_str(line).unwrap();
            assert_eq!(serde_json::to_string(&event).unwrap(), line);
        }
    }

    #[cfg(unix)]
    fn script(text: &str) -> Command {
        let mut command = Command::new("sh");
        command.arg("-c").arg(text);
        command
    }

    #[cfg(unix)]
    #[test]
    fn a_process_is_heard_to_its_end() {
        let note = r#"{"event":"note","seconds":1.0,"text":"a note"}"#;
        let mut command = script(&format!("echo '{note}' >&2; echo wrong >&2; echo result; exit 3"));
        let mut notes = Vec::new();
        let ended = run(&mut command, TO_STOP, || false, |event| notes.push(event)).unwrap();
        assert_eq!((ended.code, &ended.output[..]), (Some(3), "result\n"));
        assert_eq!(ended.errors, ["wrong"]);
        assert_eq!(
            notes,
            [Event::Note {
                seconds: 1.0,
                text: "a note".into()
            }]
        );
    }

    #[cfg(unix)]
    #[test]
    fn a_process_that_does_not_stop_is_killed_and_its_pipes_are_left() {
        // The second leaves a process behind that keeps its pipes open.
        for stuck in ["exec sleep 20", "sleep 20; true"] {
            let since = Instant::now();
            let ended = run(&mut script(stuck), Duration::from_millis(100), || true, |_| ()).unwrap();
            assert!(
                ended.code.is_none() && since.elapsed() < Duration::from_secs(10),
                "{stuck}"
            );
        }
        let ended = run(&mut script("cat; exit 130"), TO_STOP, || true, |_| ()).unwrap();
        assert_eq!(ended.code, Some(130), "it ends with its standard input");
    }
}

//! Makes one model in a process of its own, so that its memory is separate and its failures do not reach the
//! others.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use shellock_job::Failure;
use shellock_job::batch::{Entry, Record, Status, kit_is, record_file};
use shellock_job::child::{self, Ended, TO_STOP};
use shellock_job::config::USUAL;
use shellock_job::input::{read, sha256};
use shellock_job::output::PLAN;

use crate::Session;
use crate::args::BatchOptions;
use crate::commands::USUAL_EFFORT_S;
use crate::config::{self, Limit};

/// Memory that a kit takes at least, and per MB of its model's file, MB: bunny_955k has 18 MB and takes 700.
const LEAST_MB: f64 = 600.0;
const MB_PER_MB: f64 = 12.0;
/// Message for a model that was made twice.
const AGAIN: &str = "made twice: beside others, the time (--time) ran out before a kit passed";
/// Message for a model without a kit whose folder holds an earlier one.
const OLD_KIT: &str = "the kit in its folder is from an earlier run";
/// Number of lines kept of a process's own last messages.
const KEPT_LINES: usize = 5;

/// Settings shared by all models.
pub struct Run {
    folder: PathBuf,
    out: PathBuf,
    program: PathBuf,
    /// Options of `build`, as they were given.
    arguments: Vec<String>,
    /// Hashes of all inputs except the model: program, options, configuration file.
    made_with: String,
    /// True if kits have a limit of time, so that a kit made alone may get farther.
    limits_time: bool,
    patience: Duration,
    pub n_workers: usize,
    cores: usize,
}

impl Run {
    pub fn new(options: &BatchOptions, n_models: usize) -> Result<Self, Failure> {
        // All cores, or --threads.
        let cores = rayon::current_num_threads();
        let n_workers = options.jobs.unwrap_or(cores).min(n_models).clamp(1, 256);
        let mut arguments = config::build_arguments(std::env::args_os().collect());
        let file = options
            .options
            .config
            .clone()
            .unwrap_or_else(|| PathBuf::from(USUAL));
        let content = fs::read(file).unwrap_or_default();
        let limit = config::limit(&arguments, &content);
        if limit.is_none() {
            arguments.push(format!("--effort={USUAL_EFFORT_S}"));
        }
        let made_with = [
            super::program().as_bytes(),
            arguments.join("\n").as_bytes(),
            &content[..],
        ]
        .map(|part: &[u8]| sha256(part))
        .concat();
        Ok(Self {
            folder: options.folder.clone(),
            out: options.out.clone(),
            program: std::env::current_exe()
                .map_err(|e| Failure::Wrong(format!("the program cannot find its own file: {e}")))?,
            arguments,
            made_with,
            limits_time: limit == Some(Limit::Time),
            patience: patience(options.patience)?,
            n_workers,
            cores,
        })
    }

    /// Estimate of the memory that a model's kit takes, MB.
    pub fn needs_mb(&self, model: &Path) -> f64 {
        let bytes = fs::metadata(self.folder.join(model)).map_or(0, |m| m.len());
        LEAST_MB + MB_PER_MB * bytes as f64 / 1e6
    }

    /// Makes the kit unless it exists. If no kit results but the folder holds an earlier one, the record says
    /// so.
    pub fn record(&self, session: &Session, job: &Entry) -> Record {
        let mut record = self.keep_or_make(session, job);
        if !record.status.has_kit() && self.out.join(&job.kit).join(PLAN).is_file() {
            record.said.push(OLD_KIT.to_owned());
        }
        record
    }

    /// Makes again, alone and on all cores, a kit that ran out of time beside others.
    pub fn again(&self, session: &Session, job: &Entry, first: &Record) -> Record {
        let blank = Record::blank(job, first.made_of.clone());
        let mut record = self.make(session, blank, job, true);
        let second = (record.status, record.said.first().cloned().unwrap_or_default());
        let seconds = record.seconds + first.seconds;
        let is_worse = first.status.has_kit() && !record.status.has_kit();
        if is_worse {
            // The first run's kit is still there; the next batch tries again.
            record = first.clone();
            record.said.push(format!(
                "the second run ended as {}: {}",
                second.0.name(),
                second.1
            ));
        } else {
            // The message goes after the first error and before the warnings.
            let at = usize::from(record.status != Status::Verified).min(record.said.len());
            record.said.insert(at, AGAIN.to_owned());
        }
        record.seconds = seconds;
        record.peak_mb = [record.peak_mb, first.peak_mb]
            .into_iter()
            .flatten()
            .reduce(f64::max);
        self.note(session, record, job)
    }

    fn keep_or_make(&self, session: &Session, job: &Entry) -> Record {
        let mut record = Record::blank(job, String::new());
        match read(&self.folder.join(&job.model)) {
            Ok(bytes) => record.made_of = sha256((sha256(&bytes) + &self.made_with).as_bytes()),
            Err(e) => {
                record.said.push(e.to_string());
                return record;
            }
        }
        let file = record_file(&self.out, &record.kit);
        if let Some(old) = Record::read(&file, &record.made_of, &self.out.join(&job.kit)) {
            return old;
        }
        let record = self.make(session, record, job, self.n_workers == 1);
        self.note(session, record, job)
    }

    /// Writes the record for the next run, unless this one is being stopped.
    fn note(&self, session: &Session, mut record: Record, job: &Entry) -> Record {
        record.kit_is = kit_is(&self.out.join(&job.kit)).filter(|_| record.status.has_kit());
        if session.job.is_stopped() {
            return record;
        }
        let written = record.write(&record_file(&self.out, &record.kit));
        let unwritten = written.err().map(|e| e.to_string());
        Record { unwritten, ..record }
    }

    fn make(&self, session: &Session, mut record: Record, job: &Entry, is_alone: bool) -> Record {
        let n_threads = if is_alone {
            self.cores
        } else {
            self.cores.div_ceil(self.n_workers)
        };
        let since = Instant::now();
        let mut is_late = false;
        let mut must_stop = || {
            is_late |= since.elapsed() > self.patience;
            is_late || session.job.is_stopped()
        };
        let mut command = self.command(job, n_threads);
        let ended = child::run(&mut command, TO_STOP, &mut must_stop, |_| ());
        record.seconds = since.elapsed().as_secs_f64();
        match ended {
            Ok(ended) if is_late => {
                let seconds = self.patience.as_secs_f64();
                record.peak_mb = ended.peak_mb;
                record.status = Status::TooLong;
                record
                    .said
                    .push(format!("it took longer than {seconds:.0} s (--patience)"));
            }
            Ok(ended) => record = with_result(record, ended, self.limits_time && !is_alone),
            Err(e) => {
                record.status = Status::Crashed;
                record.said.push(e.to_string());
            }
        }
        record
    }

    fn command(&self, job: &Entry, n_threads: usize) -> Command {
        let (model, kit) = (self.folder.join(&job.model), self.out.join(&job.kit));
        let mut command = child::build(&self.program, &model, &kit);
        command.arg("--threads").arg(n_threads.to_string());
        command.args(&self.arguments);
        command
    }
}

/// Adds the result of a process that ended in time. `may_try_again` is true where another run may get
/// farther.
fn with_result(mut record: Record, ended: Ended, may_try_again: bool) -> Record {
    record.status = Status::of_code(ended.code);
    record.peak_mb = ended.peak_mb;
    record = record.of_output(&ended.output);
    let may_pass = matches!(record.status, Status::Failed | Status::NoPlan);
    record.lacks_time &= may_pass && may_try_again;
    if record.status == Status::Crashed {
        let first = ended.errors.len().saturating_sub(KEPT_LINES);
        record.said.extend_from_slice(&ended.errors[first..]);
        if ended.code.is_none() {
            let killed = "it was killed, probably because memory ran out: run fewer at a time (--jobs, \
                          --memory)";
            record.said.push(killed.to_owned());
        }
    }
    record
}

/// Time limit for one model; unlimited if infinite. Fails unless it is above 0.
fn patience(seconds: f64) -> Result<Duration, Failure> {
    if seconds.is_nan() || seconds <= 0.0 {
        return Err(Failure::Wrong(format!("--patience {seconds} s must be above 0")));
    }
    Ok(Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A kit that is limited by work, or was made alone, would be the same kit again.
    #[test]
    fn a_kit_is_made_again_only_if_it_failed_for_lack_of_time_that_another_run_has() {
        let lacks_time = |code: i32, may_try_again: bool| {
            let entry = Entry {
                model: "a.stl".into(),
                kit: "a".into(),
            };
            let ended = Ended {
                code: Some(code),
                output: r#"{"warnings": [{"code": "time-up", "severity": "warning"}]}"#.into(),
                ..Ended::default()
            };
            with_result(Record::blank(&entry, String::new()), ended, may_try_again).lacks_time
        };
        let failed = (0..=9).find(|code| Status::of_code(Some(*code)) == Status::Failed);
        let failed = failed.expect("a kit that fails has an exit code");
        assert!(lacks_time(failed, true) && !lacks_time(failed, false) && !lacks_time(0, true));
    }
}

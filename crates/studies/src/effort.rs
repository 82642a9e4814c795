//! Effort for kits of many models: time by stage, rejected kits, and outcome. Runs the program itself.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use clap::Args;
use rayon::prelude::*;
use serde_json::Value;
use shellock_formats::write_stl_binary;

use crate::failure::Failure;
use crate::hard;
use crate::sheet::write_all;

/// Which models, and how they are made.
#[derive(Args)]
pub struct EffortOptions {
    /// Models, or folders of them
    models: Vec<PathBuf>,
    /// Add models that are hard to make kits of, made by code
    #[arg(long)]
    hard: bool,
    /// Longest edges, mm, separated by commas
    #[arg(long, value_delimiter = ',', default_value = "150")]
    sizes: Vec<f64>,
    /// The program that is measured
    #[arg(long, default_value = "target/release/shellock")]
    program: PathBuf,
    /// Jobs at once; times are worth something with one
    #[arg(long, default_value_t = 1)]
    jobs: usize,
    /// Seconds after which a job is given up
    #[arg(long, default_value_t = 300)]
    most_seconds: u64,
    /// Keep the kits, in this folder
    #[arg(long)]
    keep: Option<PathBuf>,
    /// Further options of `build`, after "--"
    #[arg(last = true)]
    options: Vec<String>,
}

/// Result of one job.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// Name of the model, with its size.
    pub name: String,
    /// Exit code; `None` if the job was stopped for its time or by a signal.
    pub exit_code: Option<i32>,
    /// Wall-clock time of the job, s.
    pub seconds: f64,
    /// Processor time of all stages, s.
    pub cpu_seconds: f64,
    /// Peak memory of the program, MB.
    pub peak_mb: f64,
    /// Processor seconds of each stage, largest first.
    pub stages: Vec<(String, f64)>,
    /// Number of kits made.
    pub kits: Option<u64>,
    /// Outcome in words: status, failed checks, or error.
    pub last: String,
    /// Notes of the program, such as why kits and divisions were rejected.
    pub notes: Vec<String>,
}

/// A program that makes kits, and the folders of what it says and makes.
pub struct Job<'a> {
    /// Program that is run.
    pub program: &'a Path,
    /// Folder of the program's answers and events.
    pub folder: &'a Path,
    /// Folder of the kits.
    pub kits: &'a Path,
    /// True if kits are not deleted.
    pub keeps_kit: bool,
    /// Seconds after which a job is given up.
    pub most_seconds: u64,
    /// Further options of `build`.
    pub options: &'a [String],
}

/// Runs all jobs; returns the file of the table.
pub fn run(options: &EffortOptions, out: &Path) -> Result<Vec<PathBuf>, Failure> {
    let folder = out.join("effort");
    let mut models = Vec::new();
    for path in &options.models {
        models.extend(models_in(path)?);
    }
    if options.hard {
        models.extend(write_family(&folder.join("hard"))?);
    }
    let jobs: Vec<(PathBuf, f64)> = models
        .iter()
        .flat_map(|m| options.sizes.iter().map(move |&size_mm| (m.clone(), size_mm)))
        .collect();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(options.jobs.max(1))
        .build()
        .expect("threads can be made");
    // Each line is printed when its job ends.
    let said = Mutex::new(());
    let runs: Result<Vec<Run>, Failure> = pool.install(|| {
        jobs.par_iter()
            .map(|(model, size_mm)| {
                let job = Job {
                    program: &options.program,
                    folder: &folder,
                    kits: options.keep.as_deref().unwrap_or(&folder),
                    keeps_kit: options.keep.is_some(),
                    most_seconds: options.most_seconds,
                    options: &options.options,
                };
                let run = job.run(model, *size_mm)?;
                let _one_at_a_time = said.lock().expect("no holder of this lock panics");
                println!("{}", line(&run).join(" | "));
                Ok(run)
            })
            .collect()
    });
    write_all(out, "effort", &[("effort.md".into(), text(&runs?))])
}

/// Returns the path of a model itself, or the models in a folder, sorted by name.
fn models_in(path: &Path) -> Result<Vec<PathBuf>, Failure> {
    const ENDINGS: [&str; 5] = ["stl", "obj", "ply", "off", "3mf"];
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let wrong = |source| Failure::File {
        path: path.to_owned(),
        source,
    };
    let mut models = Vec::new();
    for entry in fs::read_dir(path).map_err(wrong)? {
        let file = entry.map_err(wrong)?.path();
        let ending = file.extension().map(|e| e.to_ascii_lowercase());
        if ending.is_some_and(|e| ENDINGS.iter().any(|known| e == *known)) {
            models.push(file);
        }
    }
    models.sort();
    Ok(models)
}

/// Writes the hard family as files and returns their paths.
fn write_family(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let wrong = |path: &Path| {
        let path = path.to_owned();
        move |source| Failure::File { path, source }
    };
    fs::create_dir_all(folder).map_err(wrong(folder))?;
    hard::family()
        .into_iter()
        .map(|model| {
            let path = folder.join(format!("{}.stl", model.name));
            fs::write(&path, write_stl_binary(&model.mesh)).map_err(wrong(&path))?;
            Ok(path)
        })
        .collect()
}

impl Job<'_> {
    /// Runs the program on a model and watches it until it ends or its time is up.
    pub fn run(&self, model: &Path, size_mm: f64) -> Result<Run, Failure> {
        let folder = self.folder;
        let stem = model
            .file_stem()
            .map_or_else(String::new, |s| s.to_string_lossy().into_owned());
        let name = format!("{stem}-{size_mm}");
        let kit = self.kits.join(&name);
        let wrong = |source| Failure::File {
            path: self.program.to_owned(),
            source,
        };
        let [out, err] = ["json", "events"].map(|ending| folder.join(format!("{name}.{ending}")));
        fs::create_dir_all(folder).map_err(wrong)?;
        let since = Instant::now();
        let mut child = Command::new(self.program)
            .args(["--json", "build", "--force", "--size", &size_mm.to_string(), "-o"])
            .arg(&kit)
            .arg(model)
            .args(self.options)
            .stdin(Stdio::null())
            .stdout(fs::File::create(&out).map_err(wrong)?)
            .stderr(fs::File::create(&err).map_err(wrong)?)
            .spawn()
            .map_err(wrong)?;
        let mut peak_mb = 0.0f64;
        let ended = loop {
            if let Some(status) = child.try_wait().map_err(wrong)? {
                break status.code();
            }
            if since.elapsed() > Duration::from_secs(self.most_seconds) {
                let _ = child.kill();
                let _ = child.wait();
                break None;
            }
            peak_mb = peak_mb.max(resident_mb(child.id()));
            std::thread::sleep(Duration::from_millis(20));
        };
        let seconds = since.elapsed().as_secs_f64();
        if !self.keeps_kit {
            let _ = fs::remove_dir_all(&kit);
        }
        let (answer, events) = (read(&out), read(&err));
        Ok(Run {
            name,
            exit_code: ended,
            seconds,
            peak_mb,
            ..read_run(&answer, &events)
        })
    }
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_default()
}

/// Peak memory of a process, MB; 0 if the system does not report it.
fn resident_mb(pid: u32) -> f64 {
    let status = read(Path::new(&format!("/proc/{pid}/status")));
    let peak = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kb = peak.and_then(|l| l.trim().trim_end_matches(" kB").parse::<f64>().ok());
    kb.unwrap_or(0.0) / 1024.0
}

/// Reads the results of a job from the program's answer and events.
fn read_run(answer: &str, events: &str) -> Run {
    let answer: Value = answer.lines().last().map_or(Value::Null, json);
    let events: Vec<Value> = events.lines().map(json).collect();
    let of = |kind: &'static str| events.iter().filter(move |e| e["event"] == kind);
    let mut stages: BTreeMap<String, f64> = BTreeMap::new();
    for stage in of("effort").filter_map(|e| e["stages"].as_array()).flatten() {
        let name = stage["name"].as_str().unwrap_or_default().to_owned();
        *stages.entry(name).or_default() += stage["cpu_seconds"].as_f64().unwrap_or(0.0);
    }
    let cpu_seconds = stages.values().sum();
    let mut stages: Vec<(String, f64)> = stages.into_iter().collect();
    stages.sort_by(|a, b| b.1.total_cmp(&a.1));
    let text = |v: &Value| v.as_str().unwrap_or_default().to_owned();
    let failed = answer["checks"]
        .as_array()
        .into_iter()
        .flatten()
        .filter(|c| c["ok"] == false);
    let failed: Vec<String> = failed.map(|c| text(&c["name"])).collect();
    let last = match answer["status"].as_str() {
        Some("failed") => format!("fails: {}", failed.join(", ")),
        Some("error") => text(&answer["error"]),
        Some(status) => status.to_owned(),
        None => "no answer".into(),
    };
    Run {
        name: String::new(),
        exit_code: None,
        seconds: 0.0,
        cpu_seconds,
        peak_mb: 0.0,
        stages,
        kits: answer["effort"]["kits"].as_u64(),
        last,
        notes: of("note").map(|e| text(&e["text"])).collect(),
    }
}

fn json(line: &str) -> Value {
    serde_json::from_str(line).unwrap_or(Value::Null)
}

/// Cells of a job's row in the table.
fn line(run: &Run) -> Vec<String> {
    const LONGEST: usize = 90;
    let stages: Vec<String> = run
        .stages
        .iter()
        .take(4)
        .map(|(name, s)| format!("{name} {s:.1}"))
        .collect();
    let brief: String = run.last.chars().take(LONGEST).collect();
    vec![
        run.name.clone(),
        run.exit_code
            .map_or_else(|| "given up".into(), |code| code.to_string()),
        run.kits.map_or_else(String::new, |kits| kits.to_string()),
        format!("{:.1}", run.seconds),
        format!("{:.1}", run.cpu_seconds),
        format!("{:.0}", run.peak_mb),
        stages.join(", "),
        brief.replace(['|', '\n'], " "),
    ]
}

/// Table of all jobs, its sums, and the notes of each job.
fn text(runs: &[Run]) -> String {
    const HEAD: [&str; 8] = [
        "model",
        "exit code",
        "kits",
        "s",
        "CPU s",
        "MB",
        "most CPU s",
        "end",
    ];
    let mut text = String::from("# What kits cost\n\n");
    let row = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    text += &row(&HEAD.map(str::to_owned));
    text += &row(&HEAD.map(|_| "---".to_owned()));
    runs.iter().for_each(|run| text += &row(&line(run)));
    let made: Vec<u64> = runs.iter().filter_map(|r| r.kits).collect();
    let n = |code: i32| runs.iter().filter(|r| r.exit_code == Some(code)).count();
    let _ = write!(
        text,
        "\n{} jobs: {} verified, {} failed, {} without a plan, {} refused, {} given up; {:.2} kits made for \
         one; {:.0} CPU s in all; slowest {:.0} s\n",
        runs.len(),
        n(0),
        n(1),
        n(3),
        n(2),
        runs.iter().filter(|r| r.exit_code.is_none()).count(),
        made.iter().sum::<u64>() as f64 / made.len().max(1) as f64,
        runs.iter().map(|r| r.cpu_seconds).sum::<f64>(),
        runs.iter().map(|r| r.seconds).fold(0.0, f64::max)
    );
    for run in runs.iter().filter(|r| !r.notes.is_empty()) {
        let _ = write!(text, "\n## {}\n", run.name);
        run.notes.iter().for_each(|note| text += &format!("- {note}\n"));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_told_from_what_the_program_says() {
        let answer = r#"{"status":"failed","effort":{"kits":3},"checks":[{"name":"a","ok":true},{"name":"b","ok":false}]}"#;
        let events = concat!(
            r#"{"event":"note","text":"another plan"}"#,
            "\n",
            r#"{"event":"effort","stages":[{"name":"plan","cpu_seconds":2.0},{"name":"cut","cpu_seconds":3.0}]}"#
        );
        let run = read_run(answer, events);
        assert_eq!(
            (run.kits, run.last.as_str(), run.cpu_seconds),
            (Some(3), "fails: b", 5.0)
        );
        assert_eq!(run.stages[0].0, "cut");
        assert_eq!(run.notes, ["another plan"]);
        assert_eq!(read_run("", "").last, "no answer");
    }
}

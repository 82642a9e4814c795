//! Processor time by stage of two programs, which run in alternation so that both meet the same machine.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;

use crate::effort::{Job, Run};
use crate::failure::Failure;
use crate::sheet::write_all;

/// Models, and the programs that are compared.
#[derive(Args)]
pub struct SpeedOptions {
    /// Models to make kits of
    #[arg(required = true)]
    models: Vec<PathBuf>,
    /// Program that is measured
    #[arg(long, default_value = "target/release/shellock")]
    program: PathBuf,
    /// Program that it is compared with, such as one of an earlier commit
    #[arg(long)]
    against: PathBuf,
    /// Runs of each program; the median counts
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=99))]
    rounds: u32,
    /// Longest edge of the kits, mm
    #[arg(long, default_value_t = 150.0)]
    size: f64,
    /// Seconds after which a run is given up
    #[arg(long, default_value_t = 600)]
    most_seconds: u64,
    /// Further options of `build`, after "--"
    #[arg(last = true)]
    options: Vec<String>,
}

/// Runs both programs on each model, in turns; returns the file of the table.
pub fn run(options: &SpeedOptions, out: &Path) -> Result<Vec<PathBuf>, Failure> {
    let programs = [&options.against, &options.program];
    let folders = ["before", "after"].map(|name| out.join("speed").join(name));
    for folder in &folders {
        let wrong = |source| Failure::File {
            path: folder.clone(),
            source,
        };
        fs::create_dir_all(folder).map_err(wrong)?;
    }
    let mut text = String::from("# Processor seconds by stage, before and after\n");
    for model in &options.models {
        let mut runs: [Vec<Run>; 2] = [Vec::new(), Vec::new()];
        for _ in 0..options.rounds {
            for (which, runs) in runs.iter_mut().enumerate() {
                let job = Job {
                    program: programs[which],
                    folder: &folders[which],
                    kits: &folders[which],
                    keeps_kit: false,
                    most_seconds: options.most_seconds,
                    options: &options.options,
                };
                runs.push(job.run(model, options.size)?);
            }
        }
        let table = compare(&runs);
        println!("{table}");
        text += &table;
    }
    write_all(out, "speed", &[("speed.md".into(), text)])
}

/// Table of the stages of one model: median processor seconds of both programs, and their ratio.
fn compare(runs: &[Vec<Run>; 2]) -> String {
    let [before, after] = runs.each_ref().map(|runs| stages(runs));
    let mut names: Vec<&str> = Vec::new();
    for name in before.keys().chain(after.keys()) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    let of = |stages: &BTreeMap<String, f64>, name: &str| stages.get(name).copied().unwrap_or(0.0);
    names.sort_by(|a, b| of(&before, b).total_cmp(&of(&before, a)));
    let mut text = format!("\n## {}\n\n", runs[1][0].name);
    text += "| stage | before, s | after, s | ratio |\n| --- | --- | --- | --- |\n";
    let mut row = |name: &str, [a, b]: [f64; 2]| {
        let ratio = if a > 0.0 {
            format!("{:.2}", b / a)
        } else {
            "–".into()
        };
        let _ = writeln!(text, "| {name} | {a:.2} | {b:.2} | {ratio} |");
    };
    for name in names {
        row(name, [of(&before, name), of(&after, name)]);
    }
    row(
        "all",
        runs.each_ref()
            .map(|runs| median(runs.iter().map(|r| r.cpu_seconds))),
    );
    row(
        "wall clock",
        runs.each_ref().map(|runs| median(runs.iter().map(|r| r.seconds))),
    );
    let [before_mb, after_mb] = runs.each_ref().map(|runs| median(runs.iter().map(|r| r.peak_mb)));
    let ends = runs.each_ref().map(|runs| runs[0].last.as_str());
    let _ = writeln!(
        text,
        "\nPeak memory {before_mb:.0} MB before, {after_mb:.0} MB after. Ends: {} before, {} after.",
        ends[0], ends[1]
    );
    text
}

/// Median processor seconds of each stage.
fn stages(runs: &[Run]) -> BTreeMap<String, f64> {
    let mut seconds: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for (name, s) in runs.iter().flat_map(|run| &run.stages) {
        seconds.entry(name.clone()).or_default().push(*s);
    }
    seconds.into_iter().map(|(name, s)| (name, median(s))).collect()
}

/// Median, the mean of the middle two of an even number; 0 of nothing.
fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => 0.0,
        n => 0.5 * (values[(n - 1) / 2] + values[n / 2]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(stage: &str, cpu_seconds: f64) -> Run {
        Run {
            name: "ball-150".into(),
            stages: vec![(stage.into(), cpu_seconds)],
            cpu_seconds,
            last: "verified".into(),
            ..Run::default()
        }
    }

    #[test]
    fn the_median_of_each_stage_is_compared() {
        let before = [4.0, 2.0, 90.0].map(|s| run("cuts", s)).to_vec();
        let after = [1.0, 2.0, 3.0].map(|s| run("cuts", s)).to_vec();
        let table = compare(&[before, after]);
        assert!(table.contains("| cuts | 4.00 | 2.00 | 0.50 |"), "{table}");
        assert!(
            table.contains("Ends: verified before, verified after."),
            "{table}"
        );
    }

    #[test]
    fn a_stage_of_one_program_alone_has_a_row_too() {
        let table = compare(&[vec![run("cuts", 1.0)], vec![run("wall", 2.0)]]);
        assert!(table.contains("| cuts | 1.00 | 0.00 | 0.00 |"), "{table}");
        assert!(table.contains("| wall | 0.00 | 2.00 | – |"), "{table}");
    }
}

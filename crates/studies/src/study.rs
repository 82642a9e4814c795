//! Studies: the options and input of each, and the charts and tables that it writes.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};

use crate::agreement::agreement;
use crate::chart::{Corner, Curve, Labels, bands};
use crate::effort::{self, EffortOptions};
use crate::failure::Failure;
use crate::hours::{self, HoursOptions};
use crate::loads::{self, LoadsOptions};
use crate::metrics::{self, MetricsOptions};
use crate::search::{self, SearchOptions};
use crate::segmentations::{self, SegmentationsOptions};
use crate::sheet::{Sheet, write_all};
use crate::speed::{self, SpeedOptions};
use crate::statistics::band;
use crate::strength::{self, StrengthOptions};
use crate::table::Table;
use crate::worse::{self, WorseOptions};

/// Study to run, and folder of its charts.
#[derive(Args)]
pub struct Options {
    #[command(subcommand)]
    study: Study,
    /// Folder for the charts and tables
    #[arg(long, global = true, default_value = "out/study")]
    out: PathBuf,
}

#[derive(Subcommand)]
enum Study {
    /// Agreement of the metrics on random plans of a model
    Metrics(MetricsOptions),
    /// Load factors of random plans of a model, load by load, by the surface model and by the solid one
    Loads(LoadsOptions),
    /// Comparison with half connectors and with plans of half the score, under a punch and in a fall
    Worse(WorseOptions),
    /// Speed of the search for plans of a model, and the plans that its segmentations allow
    Search(SearchOptions),
    /// Comparison of a model's divisions by each method: plan, seams, time
    Segmentations(SegmentationsOptions),
    /// Influences on the thickness of a model's wall: analysis mesh, peaks, falls
    Strength(StrengthOptions),
    /// Effort for kits of many models: time by stage, kits made in vain
    Effort(EffortOptions),
    /// Processor time by stage of two programs, in alternation
    Speed(SpeedOptions),
    /// Agreement of print time and plastic by closed forms with PrusaSlicer's, on kits or on their pieces
    Hours(HoursOptions),
    /// Agreement of metrics: CSV with a column of scores for each metric, "name" or "name [unit]", and a row
    /// for each plan; the first column is the metric that the others are compared with
    Scores {
        /// CSV file with the scores
        file: PathBuf,
    },
    /// Progress of searches over time: CSV with the columns variant, seed, seconds and score, a row for each
    /// improvement
    Convergence {
        /// CSV file with the improvements
        file: PathBuf,
        /// Score that is proven to be the best, drawn as a line
        #[arg(long, allow_hyphen_values = true)]
        optimum: Option<f64>,
        /// Names of variants 0, 1, …, separated by commas
        #[arg(long, value_delimiter = ',')]
        names: Vec<String>,
    },
}

/// Runs the study; returns the files written.
pub fn run(options: &Options) -> Result<Vec<PathBuf>, Failure> {
    match &options.study {
        Study::Metrics(metrics) => metrics::run(metrics, &options.out),
        Study::Loads(loads) => loads::run(loads, &options.out),
        Study::Worse(worse) => worse::run(worse, &options.out),
        Study::Search(search) => search::run(search, &options.out),
        Study::Segmentations(segmentations) => segmentations::run(segmentations, &options.out),
        Study::Strength(strength) => strength::run(strength, &options.out),
        Study::Effort(effort) => effort::run(effort, &options.out),
        Study::Speed(speed) => speed::run(speed, &options.out),
        Study::Hours(hours) => hours::run(hours, &options.out),
        Study::Scores { file } => write_all(&options.out, &stem(file), &agreement(&read(file)?)?),
        Study::Convergence { file, optimum, names } => {
            let runs = runs(&read(file)?).map_err(|problem| Failure::Table {
                path: file.clone(),
                problem,
            })?;
            write_all(&options.out, &stem(file), &[convergence(&runs, names, *optimum)?])
        }
    }
}

/// Runs of each variant, in order; each run is a list of its improvements (seconds, score).
pub type Runs = BTreeMap<usize, Vec<Vec<(f64, f64)>>>;

/// Sorts a table with the columns variant, seed, seconds and score into runs.
fn runs(table: &Table) -> Result<Runs, String> {
    let column = |name: &str| table.column(name).ok_or(format!("there is no column \"{name}\""));
    let (variants, seeds, seconds, scores) = (
        column("variant")?,
        column("seed")?,
        column("seconds")?,
        column("score")?,
    );
    let mut by_seed: BTreeMap<(usize, u64), Vec<(f64, f64)>> = BTreeMap::new();
    for i in 0..variants.len() {
        let whole = |v: f64, what: &str| {
            let is_whole = v >= 0.0 && v.fract() == 0.0 && v < 1e15;
            if is_whole {
                Ok(v as u64)
            } else {
                Err(format!("row {}: {what} {v} is no whole number ≥ 0", i + 1))
            }
        };
        let key = (whole(variants[i], "variant")? as usize, whole(seeds[i], "seed")?);
        by_seed.entry(key).or_default().push((seconds[i], scores[i]));
    }
    let mut runs = Runs::new();
    for ((variant, _), mut run) in by_seed {
        run.sort_by(|a, b| a.0.total_cmp(&b.0));
        runs.entry(variant).or_default().push(run);
    }
    Ok(runs)
}

/// Chart of each variant's score over time, with its range over the seeds (Fig. 14 and 16).
pub fn convergence(runs: &Runs, names: &[String], optimum: Option<f64>) -> Result<Sheet, Failure> {
    let name = |i: &usize| names.get(*i).cloned().unwrap_or_else(|| format!("variant {i}"));
    let named: Vec<(String, _)> = runs.iter().map(|(i, runs)| (name(i), band(runs))).collect();
    let curves: Vec<Curve<'_>> = named
        .iter()
        .map(|(name, points)| Curve {
            name,
            points: points.clone(),
        })
        .collect();
    let n_seeds = runs.values().map(Vec::len).max().unwrap_or(0);
    let title = format!("Best score so far: median and range of {n_seeds} seeds");
    let labels = Labels {
        title: &title,
        x: "time, s",
        y: "score",
    };
    Ok((
        "convergence.svg".to_owned(),
        bands(&labels, &curves, optimum, Corner::LowerRight)?,
    ))
}

fn read(path: &Path) -> Result<Table, Failure> {
    let text = fs::read_to_string(path).map_err(|source| Failure::File {
        path: path.to_owned(),
        source,
    })?;
    Table::from_csv(&text).map_err(|problem| Failure::Table {
        path: path.to_owned(),
        problem,
    })
}

fn stem(path: &Path) -> String {
    path.file_stem()
        .map_or_else(|| "study".to_owned(), |s| s.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_sorted_by_variant_seed_and_time() {
        let csv = "variant,seed,seconds,score\n1,7,2,0.5\n0,3,1,0.1\n1,7,1,0.2\n1,8,0,0.3\n";
        let runs = runs(&Table::from_csv(csv).unwrap()).unwrap();
        assert_eq!(runs[&0], [vec![(1.0, 0.1)]]);
        assert_eq!(runs[&1], [vec![(1.0, 0.2), (2.0, 0.5)], vec![(0.0, 0.3)]]);
    }

    #[test]
    fn a_table_without_what_is_needed_is_refused() {
        let fault = |csv: &str| runs(&Table::from_csv(csv).unwrap()).unwrap_err();
        assert!(fault("variant,seed,score\n").contains("\"seconds\""));
        assert!(fault("variant,seed,seconds,score\n0.5,0,0,0\n").contains("variant 0.5"));
    }
}

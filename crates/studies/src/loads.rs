//! Load factors of a model's random plans by the surface model and by the solid model, load by load.

mod gain;

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use rayon::prelude::*;
use shellock::handling::{Borne, Deed, Failure as Way, Handling, LoadCase, load_cases, load_factor};
use shellock_mechanics::{Drift, Meeting};
use shellock_volume::VolumeModel;
use shellock_volume::compare::{borne_by_solids, volume_model};

use crate::failure::Failure;
use crate::metrics::{Subject, SubjectOptions, subject};
use crate::model::at_least_one;
use crate::sheet::write_all;
use crate::statistics::spearman;
use crate::table::{Table, markdown};

/// Which plans of which model.
#[derive(Args)]
pub struct LoadsOptions {
    #[command(flatten)]
    subject: SubjectOptions,
    /// Compare with the solid model, which takes some seconds a plan and load
    #[arg(long)]
    solid: bool,
    /// Climb from the search's plans with so many loads solved
    #[arg(long)]
    climb: Option<usize>,
    /// Compare the plan that a climb ends at with so many random plans; as many as --plans says, if not given
    #[arg(long, value_parser = at_least_one, requires = "climb")]
    random: Option<usize>,
    /// Cost that plans may have, over the least
    #[arg(long, default_value_t = 1.25)]
    slack: f64,
    /// The first so many loads only
    #[arg(long)]
    loads: Option<usize>,
}

/// Load factors of all plans under one load.
struct Row {
    case: LoadCase,
    surface: Vec<f64>,
    /// Stations that fail first, with the way in which each plan fails.
    stations: Vec<Option<(Way, u32)>>,
    /// Load factors by the solid model; NaN if it was not run.
    solid: Vec<f64>,
    /// Ways in which the plans fail, by the solid model.
    ways: Vec<Way>,
}

/// Runs the study; returns the files written.
pub fn run(options: &LoadsOptions, out: &std::path::Path) -> Result<Vec<PathBuf>, Failure> {
    let subject = subject(&options.subject)?;
    let params = subject.model.params;
    let up = options.subject.model.params().up;
    let handling = Handling::new(up, params.wall_mm, params.material);
    let mut cases = load_cases(&handling, &subject.model.assembly);
    cases.truncate(options.loads.unwrap_or(usize::MAX));
    let mut rows = by_surface(&subject, &cases)?;
    if options.solid {
        by_solid(&subject, &mut rows)?;
    }
    let mut sheets = tables(&rows, subject.plans.len());
    if let Some(n_solves) = options.climb {
        sheets.extend(gain::sheets(&subject, options, &handling, n_solves)?);
    }
    write_all(out, &format!("{}/loads", options.subject.model.name()), &sheets)
}

/// Tables of all load factors, and of the agreement of the two models.
fn tables(rows: &[Row], n_plans: usize) -> Vec<(String, String)> {
    let least = |of: fn(&Row) -> &Vec<f64>| -> Vec<f64> {
        let plan = |i: usize| rows.iter().map(|r| of(r)[i]).fold(f64::INFINITY, f64::min);
        (0..n_plans).map(plan).collect()
    };
    let mut table: Vec<Vec<String>> = rows.iter().map(cells_of).collect();
    let (surface, solid) = (least(|r| &r.surface), least(|r| &r.solid));
    table.push(line("least of all", &surface, &solid));
    let head = [
        "load",
        "factor: least",
        "median",
        "largest",
        "solid, median",
        "ρ with solid",
    ];
    let both = |r: &Row| {
        // The name of a column must not contain a comma.
        let name = deed(&r.case.deed).replace(',', "");
        [
            (format!("{name} surface"), r.surface.clone()),
            (format!("{name} solid"), r.solid.clone()),
        ]
    };
    let columns = rows.iter().flat_map(both).collect();
    vec![
        ("loads.md".to_owned(), markdown(&head, &table)),
        ("loads.csv".to_owned(), Table { columns }.to_csv()),
    ]
}

fn by_surface(subject: &Subject, cases: &[LoadCase]) -> Result<Vec<Row>, Failure> {
    let failed = |e| crate::metrics::failure_of("surface", &e);
    let start = Instant::now();
    let model = subject.model.surface_model().map_err(failed)?;
    let drifts: Vec<Drift> = cases.par_iter().map(|case| model.drift(&case.forces_n)).collect();
    eprintln!(
        "{} loads, {} stations, ready after {:.2} s",
        cases.len(),
        model.n_rows() / 8,
        start.elapsed().as_secs_f64()
    );
    let start = Instant::now();
    let strength_mpa = subject.model.params.material.strength_mpa;
    let all = subject
        .meetings
        .par_iter()
        .map(|plan| model.bear(plan, &drifts))
        .collect::<Result<Vec<_>, _>>()
        .map_err(failed)?;
    let seconds = start.elapsed().as_secs_f64();
    let steps: usize = all.iter().flatten().map(|b| b.n_iterations).sum();
    let worst = all.iter().flatten().map(|b| b.error).fold(0.0, f64::max);
    let n = (all.len() * cases.len()).max(1) as f64;
    eprintln!(
        "{:.2} ms a plan and load, {:.1} steps, error {worst:.1e}",
        1e3 * seconds / n,
        steps as f64 / n
    );
    let row = |(i, case): (usize, &LoadCase)| {
        let of = |(plan, bearings): (&Vec<Meeting>, &Vec<_>)| load_factor(plan, &bearings[i], strength_mpa);
        let found: Vec<_> = subject.meetings.iter().zip(&all).map(of).collect();
        Row {
            case: case.clone(),
            surface: found.iter().map(|b| b.factor).collect(),
            stations: found.iter().map(|b| b.first).collect(),
            solid: vec![f64::NAN; found.len()],
            ways: Vec::new(),
        }
    };
    Ok(cases.iter().enumerate().map(row).collect())
}

fn by_solid(subject: &Subject, rows: &mut [Row]) -> Result<(), Failure> {
    let failed = |e| crate::metrics::failure_of("volume", &e);
    let model = volume_model(&subject.model).map_err(failed)?;
    let forces: Vec<_> = rows.iter().map(|r| r.case.forces_n.clone()).collect();
    let start = Instant::now();
    let strength_mpa = subject.model.params.material.strength_mpa;
    let all: Vec<Vec<Borne>> = subject
        .meetings
        .par_iter()
        .map(|plan| factors(&model, plan, &forces, strength_mpa))
        .collect::<Result<_, _>>()
        .map_err(failed)?;
    let n = (all.len() * rows.len()).max(1) as f64;
    eprintln!(
        "solid: {:.2} s a plan and load",
        start.elapsed().as_secs_f64() / n
    );
    for (i, row) in rows.iter_mut().enumerate() {
        row.solid = all.iter().map(|plan| plan[i].factor).collect();
        row.ways = all.iter().filter_map(|plan| plan[i].first.map(|f| f.0)).collect();
    }
    Ok(())
}

/// Load factor of a plan under each load, and how it fails, by the solid model.
fn factors(
    model: &VolumeModel,
    plan: &[Meeting],
    forces: &[Vec<shellock_geom::Vec3>],
    strength_mpa: f64,
) -> Result<Vec<Borne>, shellock_volume::VolumeError> {
    let all = model.under_loads(plan, forces)?;
    Ok(all
        .iter()
        .map(|loaded| borne_by_solids(plan, loaded.as_ref().ok(), strength_mpa))
        .collect())
}

fn cells_of(row: &Row) -> Vec<String> {
    let yields = row
        .stations
        .iter()
        .flatten()
        .filter(|s| s.0 == Way::PinYields)
        .count();
    let mut cells = line(&deed(&row.case.deed), &row.surface, &row.solid);
    if yields > 0 {
        cells[0] += &format!(" (pins in {yields})");
    }
    let by = |way| row.ways.iter().filter(|w| **w == way).count();
    if !row.ways.is_empty() {
        cells[4] += &format!(
            " (pins in {}, walls in {})",
            by(Way::PinYields),
            by(Way::WallYields)
        );
    }
    cells
}

fn line(name: &str, surface: &[f64], solid: &[f64]) -> Vec<String> {
    let [least, median, largest] = quantiles(surface);
    let rho = spearman(solid, surface).map_or("–".to_owned(), |r| format!("{r:.3}"));
    let say = |x: f64| format!("{x:.2}");
    vec![
        name.to_owned(),
        say(least),
        say(median),
        say(largest),
        say(quantiles(solid)[1]),
        rho,
    ]
}

fn quantiles(values: &[f64]) -> [f64; 3] {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| {
        sorted
            .get((share * (sorted.len().max(1) - 1) as f64) as usize)
            .copied()
            .unwrap_or(f64::NAN)
    };
    [at(0.0), at(0.5), at(1.0)]
}

/// Describes a deed in words.
fn deed(deed: &Deed) -> String {
    let way = |d: &[f64; 3]| format!("{:.1} {:.1} {:.1}", d[0], d[1], d[2]);
    match deed {
        Deed::PressTop => "press, top".into(),
        Deed::PressMiddle => "press, middle".into(),
        Deed::PressSide { toward } => format!("press, side {}", way(toward)),
        Deed::GripNarrow => "grip, narrowest".into(),
        Deed::GripWide => "grip, widest".into(),
        Deed::FallUpright => "fall upright".into(),
        Deed::Fall { down } => format!("fall {}", way(down)),
        Deed::Hang { piece } => format!("hangs by {piece}"),
    }
}

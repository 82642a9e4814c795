//! Influences on the thickness of a wall besides the model: the analysis mesh, the peaks left out, the falls.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use shellock::Ctx;
use shellock::strength::{Strength, StrengthError, StrengthParams, stress, thickness};
use shellock_geom::Solid;

use crate::failure::Failure;
use crate::model::{ModelOptions, load, with_ctx};
use crate::sheet::write_all;
use crate::table::markdown;

/// Factors on the number of points of the analysis mesh.
const REFINEMENTS: [f64; 3] = [0.5, 1.0, 2.0];
/// Shares of the area that may have more than the stress that counts.
const PEAK_SHARES: [f64; 5] = [0.0, 0.001, 0.005, 0.01, 0.02];
/// Compared numbers of falls.
const FALLS: [usize; 3] = [12, 24, 48];
/// Number of seeds for each number of falls.
const N_SEEDS: u64 = 8;
/// Factor on the number of points of the mesh while seeds are compared.
const COARSE: f64 = 0.25;

/// Which model, and which wall.
#[derive(Args)]
pub struct StrengthOptions {
    #[command(flatten)]
    model: ModelOptions,
    /// Wall whose stress is looked at, mm
    #[arg(long, default_value_t = 2.0)]
    wall: f64,
}

/// Writes the tables; returns the file.
pub fn run(options: &StrengthOptions, out: &Path) -> Result<Vec<PathBuf>, Failure> {
    let path = &options.model.model;
    let solid = load(&options.model)?.solid;
    let params = StrengthParams {
        seed: options.model.seed,
        ..StrengthParams::default()
    };
    let fault = |e: StrengthError| Failure::Model {
        path: path.clone(),
        problem: e.to_string(),
    };
    let text = with_ctx(|ctx| tables(ctx, &params, &solid, options.wall)).map_err(fault)?;
    write_all(out, &options.model.name(), &[("strength.md".to_owned(), text)])
}

fn tables(
    ctx: &Ctx<'_>,
    params: &StrengthParams,
    solid: &Solid,
    wall_mm: f64,
) -> Result<String, StrengthError> {
    let bold = |title: &str, table: String| format!("**{title}**\n\n{table}\n");
    Ok([
        bold(
            "Thickness, as the analysis mesh is refined",
            thicknesses(ctx, params, solid)?,
        ),
        bold(
            &format!("Stress in MPa of a wall of {wall_mm} mm: mesh and peaks"),
            peaks(ctx, params, solid, wall_mm)?,
        ),
        bold(
            &format!("Stress in MPa of a wall of {wall_mm} mm: falls"),
            falls(ctx, params, solid, wall_mm)?,
        ),
    ]
    .concat())
}

fn thicknesses(ctx: &Ctx<'_>, params: &StrengthParams, solid: &Solid) -> Result<String, StrengthError> {
    let mut rows = Vec::new();
    for refinement in REFINEMENTS {
        let started = Instant::now();
        let Strength {
            thickness_mm,
            stress_mpa,
            is_too_weak,
            trials: tried,
            ..
        } = thickness(
            ctx,
            &StrengthParams {
                refinement,
                ..params.clone()
            },
            solid,
        )?;
        let verdict = if is_too_weak { "too weak" } else { "bears it" };
        rows.push(vec![
            format!("× {refinement}"),
            format!("{thickness_mm:.2}"),
            format!("{stress_mpa:.1}"),
            verdict.to_owned(),
            tried.len().to_string(),
            format!("{:.1}", started.elapsed().as_secs_f64()),
        ]);
    }
    Ok(markdown(
        &[
            "points",
            "thickness, mm",
            "stress, MPa",
            "",
            "thicknesses tried",
            "time, s",
        ],
        &rows,
    ))
}

fn peaks(
    ctx: &Ctx<'_>,
    params: &StrengthParams,
    solid: &Solid,
    wall_mm: f64,
) -> Result<String, StrengthError> {
    let mut rows = Vec::new();
    for refinement in REFINEMENTS {
        let mut row = vec![format!("× {refinement}")];
        for peak_share in PEAK_SHARES {
            let params = StrengthParams {
                refinement,
                peak_share,
                ..params.clone()
            };
            row.push(format!("{:.1}", stress(ctx, &params, solid, wall_mm)?.stress_mpa));
        }
        rows.push(row);
    }
    let shares = PEAK_SHARES.map(|share| format!("without {} %", 100.0 * share));
    let head: Vec<&str> = std::iter::once("points")
        .chain(shares.iter().map(String::as_str))
        .collect();
    Ok(markdown(&head, &rows))
}

fn falls(
    ctx: &Ctx<'_>,
    params: &StrengthParams,
    solid: &Solid,
    wall_mm: f64,
) -> Result<String, StrengthError> {
    let mut rows = Vec::new();
    for n_cases in FALLS {
        let of_seed = |seed: u64| {
            let params = StrengthParams {
                n_cases,
                seed,
                refinement: COARSE,
                ..params.clone()
            };
            Ok(stress(ctx, &params, solid, wall_mm)?.stress_mpa)
        };
        let mut found = (0..N_SEEDS)
            .map(of_seed)
            .collect::<Result<Vec<f64>, StrengthError>>()?;
        found.sort_by(f64::total_cmp);
        let figure = |i: usize| format!("{:.1}", found[i]);
        rows.push(vec![
            n_cases.to_string(),
            figure(0),
            figure(found.len() / 2),
            figure(found.len() - 1),
        ]);
    }
    Ok(markdown(
        &["falls", &format!("least of {N_SEEDS} seeds"), "median", "largest"],
        &rows,
    ))
}

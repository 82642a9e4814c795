//! Checks that designs which should be worse are worse (Fig. 15): half connectors, and plans of half the
//! score, under a punch and in a fall, modelled as walls and connectors without gaps.

use std::path::{Path, PathBuf};

use clap::Args;
use shellock::design::Settings;
use shellock::handling::Handling;
use shellock::metric::{Choice, ClimbParams, EvenSurface, Foresight, MetricParams, choose};
use shellock::plan::{PlanConstraints, PlanOutcome, search};
use shellock::stress_test::{Comparison, Outcome, StressParams, StressVerdict};
use shellock::{Ctx, InstallationPlan};
use shellock_volume::compare::compare;

use crate::failure::Failure;
use crate::metrics::failure_of;
use crate::model::{Divided, ModelOptions, at_least_one, divide, load, with_ctx};
use crate::sheet::write_all;
use crate::table::markdown;

/// Which kit, and how many plans of half its score.
#[derive(Args)]
pub struct WorseOptions {
    #[command(flatten)]
    model: ModelOptions,
    /// Plans of half the score, each of another drawing
    #[arg(long, default_value_t = 5, value_parser = at_least_one)]
    draws: usize,
}

/// Runs the study; returns the files written.
pub fn run(options: &WorseOptions, out: &Path) -> Result<Vec<PathBuf>, Failure> {
    let params = options.model.params();
    let settings = Settings::resolve(&params);
    let model = load(&options.model)?;
    let Divided {
        surface,
        sizes,
        survey,
    } = with_ctx(|ctx| divide(ctx, &params, &model, &options.model.model))?;
    let (ctx, constraints) = (Ctx::quiet(), PlanConstraints::default());
    let handling = Handling::new(params.up, settings.plan.wall_mm, params.material);
    let found = match search(&ctx, &settings.plan, &survey, &constraints) {
        Ok(PlanOutcome::Found(found)) => *found,
        Ok(_) => return Err(failure_of("search", &"no plan keeps all conditions")),
        Err(e) => return Err(failure_of("search", &e)),
    };
    let choice = Choice {
        params: &settings.plan,
        surface: &surface,
        even: &EvenSurface::new(&surface, 1.0),
        former: None,
        sizes: &sizes,
        survey: &survey,
        constraints: &constraints,
        handling: &handling,
        climb: ClimbParams::default(),
    };
    let foresight = Foresight::of(&choice, &found);
    let chosen = choose(&ctx, &choice, &foresight, found).map_err(|e| failure_of("choice", &e))?;
    let steps = chosen
        .search_result
        .plan
        .steps
        .iter()
        .map(|s| (s.piece, s.separation.into()));
    let plan = InstallationPlan::new(steps);
    let mut rows = Vec::new();
    for seed in 0..options.draws as u64 {
        let mut stress = StressParams {
            metric: MetricParams::of_plan(&settings.plan, &sizes, params.material),
            sizes: sizes.clone(),
            plan: settings.plan.clone(),
            ..StressParams::default()
        };
        stress.plan.seed = seed;
        let compared = compare(&ctx, &stress, &surface, &plan).map_err(|e| failure_of("stress test", &e))?;
        rows.extend(rows_of(seed, &compared));
    }
    let head = [
        "draw",
        "design",
        "score",
        "punch, mm",
        "verdict",
        "fall, mm",
        "verdict",
    ];
    let sheet = ("worse.md".to_owned(), markdown(&head, &rows));
    write_all(out, &format!("{}/worse", options.model.name()), &[sheet])
}

/// Rows of one draw. The kit and half connectors are the same in all draws and listed for the first only.
fn rows_of(draw: u64, compared: &Comparison) -> Vec<Vec<String>> {
    let designs = compared.designs().into_iter();
    let told = designs.filter(|(name, _)| draw == 0 || *name == "half score");
    told.map(|(name, pair)| {
        let score = pair.score.map_or("–".to_owned(), |s| format!("{s:.2}"));
        let mut cells = vec![draw.to_string(), name.to_owned(), score];
        for outcome in [&pair.punch, &pair.drop] {
            cells.extend([format!("{:.2}", outcome.opening_mm), verdict(outcome).to_owned()]);
        }
        cells
    })
    .collect()
}

fn verdict(outcome: &Outcome) -> &'static str {
    match outcome.verdict {
        StressVerdict::Holds => "holds",
        StressVerdict::Opens => "opens",
        StressVerdict::Yields => "yields",
        StressVerdict::ComesApart => "comes apart",
    }
}

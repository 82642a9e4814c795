//! Gain of a climb over the search's plan and over random plans: load factors, and openings of the seams
//! under the even force.

use std::time::Instant;

use rayon::prelude::*;
use shellock::design::Settings;
use shellock::handling::{Deed, Handling, LoadCase, load_factor};
use shellock::metric::{Bench, ClimbError, ClimbParams, ClimbRules, Climbed, Rated, climb};
use shellock::plan::{
    FoundPlan, LatticePlan, Neighbourhood, PlanConstraints, PlanOutcome, PlanParams, random_plans, search,
};
use shellock::{Ctx, PatchId};
use shellock_geom::sparse::SparseError;
use shellock_mechanics::{Drift, SurfaceModel};

use super::{LoadsOptions, deed};
use crate::failure::Failure;
use crate::metrics::{Subject, failure_of};
use crate::sheet::Sheet;
use crate::table::markdown;

/// Number of plans rated in parallel before the best of them sets the floor for rejecting others.
const BATCH: usize = 256;

/// Compares the plan that a climb ends at with the search's plan, load by load, and with random plans.
pub fn sheets(
    subject: &Subject,
    options: &LoadsOptions,
    handling: &Handling,
    n_solves: usize,
) -> Result<Vec<Sheet>, Failure> {
    let params = Settings::resolve(&options.subject.model.params()).plan;
    let (constraints, ctx) = (PlanConstraints::default(), Ctx::quiet());
    let found = find_plan(&ctx, &params, subject, &constraints)?;
    let counted = found.apply_counts(&subject.survey);
    let most_cost = found.score.worst * options.slack;
    let around = Neighbourhood::new(&params, &counted, &constraints, &found, most_cost);
    let bench = Bench::new(handling, &subject.model).map_err(surface_failure)?;
    let first = bench.rate(found.pool[0].clone()).map_err(surface_failure)?;
    let start = Instant::now();
    let rules = ClimbRules {
        params: ClimbParams {
            n_of_use: n_solves,
            ..Default::default()
        },
        around: &around,
        may_be: &|_| true,
    };
    let top = climb(&ctx, rules, &bench, &found.pool).map_err(|e: ClimbError| failure_of("climb", &e))?;
    let pace = pace(&top, start.elapsed().as_secs_f64());
    eprintln!(
        "{pace}; cost {:.3}, least {:.3}",
        top.best.candidate.score.worst, found.score.worst
    );

    let plans = of_one_key(subject, options, &params, found.plan.key());
    let scale = Scale::new(subject, &bench.cases).map_err(surface_failure)?;
    let drawn = scale.rate_all(&plans, &around).map_err(surface_failure)?;
    let openings = openings(&scale, &drawn, [&first, &top.best], &pace).map_err(surface_failure)?;
    Ok(vec![
        ("climb.md".to_owned(), load_by_load(&bench, &first, &top.best)),
        ("openings.md".to_owned(), openings),
    ])
}

/// Draws random plans with that key.
fn of_one_key(
    subject: &Subject,
    options: &LoadsOptions,
    params: &PlanParams,
    key: PatchId,
) -> Vec<LatticePlan> {
    let params = PlanParams {
        key: Some(key),
        ..params.clone()
    };
    let n = options.random.unwrap_or(options.subject.plans);
    random_plans(&params, &subject.survey, n)
}

fn surface_failure(e: SparseError) -> Failure {
    failure_of("surface", &e)
}

fn find_plan(
    ctx: &Ctx<'_>,
    params: &PlanParams,
    subject: &Subject,
    constraints: &PlanConstraints,
) -> Result<Box<FoundPlan>, Failure> {
    match search(ctx, params, &subject.survey, constraints) {
        Ok(PlanOutcome::Found(found)) => Ok(found),
        Ok(_) => Err(failure_of("search", &"no plan keeps all conditions")),
        Err(e) => Err(failure_of("search", &e)),
    }
}

/// Describes the speed of a climb in words.
fn pace(top: &Climbed<'_>, seconds: f64) -> String {
    format!(
        "climb: {} plans and {} loads solved in {seconds:.2} s, {:.0} plans and {:.0} loads a second",
        top.n_plans,
        top.n_solves,
        top.n_plans as f64 / seconds,
        top.n_solves as f64 / seconds
    )
}

fn load_by_load(bench: &Bench<'_>, first: &Rated<'_>, best: &Rated<'_>) -> String {
    let row = |name: String, from: f64, to: f64| vec![name, format!("{from:.2}"), format!("{to:.2}")];
    let mut table = vec![row("least use".into(), first.least(), best.least())];
    let all = bench
        .cases
        .iter()
        .zip(first.load_factors().into_iter().zip(best.load_factors()));
    table.extend(all.map(|(case, (from, to))| row(deed(&case.deed), from.factor, to.factor)));
    markdown(&["load", "the search's plan", "climbed"], &table)
}

/// Rates plans as a climb does, without costs.
struct Scale<'a> {
    subject: &'a Subject,
    surface: SurfaceModel,
    /// Loads that people apply to a kit in use.
    uses: Vec<Drift>,
    strength_mpa: f64,
}

/// Results for random plans.
struct Drawn {
    /// Weighted openings under the even force, −Q, mm, in increasing order.
    openings_mm: Vec<f64>,
    /// Openings of the plans that the climb may choose, mm, in increasing order.
    allowed_mm: Vec<f64>,
    /// Largest of the plans' least load factors of uses.
    most_factor: f64,
    /// Number of openings computed per second.
    openings_a_second: f64,
}

impl<'a> Scale<'a> {
    fn new(subject: &'a Subject, cases: &[LoadCase]) -> Result<Self, SparseError> {
        let surface = subject.model.surface_model()?;
        let is_use = |case: &&LoadCase| !matches!(case.deed, Deed::Fall { .. } | Deed::Hang { .. });
        let uses: Vec<&LoadCase> = cases.iter().filter(is_use).collect();
        Ok(Self {
            uses: uses.par_iter().map(|c| surface.drift(&c.forces_n)).collect(),
            surface,
            subject,
            strength_mpa: subject.model.params.material.strength_mpa,
        })
    }

    /// Opening of a plan's weakest seam under the even force, −Q, mm.
    fn opening_mm(&self, plan: &LatticePlan) -> Result<f64, SparseError> {
        let meetings = self.subject.model.meetings(plan);
        let (opening, _) = self.surface.join(&meetings)?.pull(&meetings, None)?;
        Ok(-opening.quality_mm)
    }

    /// Least load factor of uses; `None` if it is below `floor`.
    fn least(&self, plan: &LatticePlan, floor: f64) -> Result<Option<f64>, SparseError> {
        let meetings = self.subject.model.meetings(plan);
        let joined = self.surface.join(&meetings)?;
        let mut least = f64::INFINITY;
        for load in &self.uses {
            let (bearing, _) = joined.bear(&meetings, load, None)?;
            least = least.min(load_factor(&meetings, &bearing, self.strength_mpa).factor);
            if least < floor {
                return Ok(None);
            }
        }
        Ok(Some(least))
    }

    fn rate_all(&self, plans: &[LatticePlan], around: &Neighbourhood<'_>) -> Result<Drawn, SparseError> {
        let start = Instant::now();
        let mut openings_mm: Vec<f64> = (plans.par_iter())
            .map(|plan| self.opening_mm(plan))
            .collect::<Result<_, _>>()?;
        let openings_a_second = plans.len() as f64 / start.elapsed().as_secs_f64();
        let is_allowed = plans.par_iter().map(|plan| around.rank(plan.clone()).is_some());
        let is_allowed: Vec<bool> = is_allowed.collect();
        let pairs = openings_mm.iter().zip(is_allowed);
        let mut allowed_mm: Vec<f64> = pairs.filter(|(_, a)| *a).map(|(mm, _)| *mm).collect();
        openings_mm.sort_by(f64::total_cmp);
        allowed_mm.sort_by(f64::total_cmp);
        let mut most_factor = 0.0_f64;
        for batch in plans.chunks(BATCH) {
            let least: Vec<Option<f64>> = (batch.par_iter())
                .map(|plan| self.least(plan, most_factor))
                .collect::<Result<_, _>>()?;
            most_factor = least.into_iter().flatten().fold(most_factor, f64::max);
        }
        Ok(Drawn {
            openings_mm,
            allowed_mm,
            most_factor,
            openings_a_second,
        })
    }
}

/// Table of the openings and least uses of random plans, of the search's plan and of the climbed plan.
fn openings(
    scale: &Scale<'_>,
    drawn: &Drawn,
    [first, best]: [&Rated<'_>; 2],
    pace: &str,
) -> Result<String, SparseError> {
    let at = |share: f64| quantile(&drawn.openings_mm, share);
    let rated = |plan: &Rated<'_>| Ok((scale.opening_mm(&plan.candidate.plan)?, plan.least()));
    let allowed = format!(
        "random, best of the {} that the climb may take",
        drawn.allowed_mm.len()
    );
    let plans = [
        ("random, median", (at(0.5), f64::NAN)),
        ("random, best 1 %", (at(0.01), f64::NAN)),
        (&allowed, (quantile(&drawn.allowed_mm, 0.0), f64::NAN)),
        ("random, best of each column", (at(0.0), drawn.most_factor)),
        ("the search's", rated(first)?),
        ("climbed", rated(best)?),
    ];
    Ok(format!(
        "{} random plans with the climbed plan's key, {} pieces.\n\n{}\n{pace}. Random plans: {:.0} \
         openings a second.\n",
        drawn.openings_mm.len(),
        scale.subject.model.assembly.n_parts,
        beside_median(&plans, at(0.5)),
        drawn.openings_a_second
    ))
}

/// Table of plans with their openings, mm, relative to the median, and their least load factors of uses.
fn beside_median(plans: &[(&str, (f64, f64))], median_mm: f64) -> String {
    let row = |(name, (mm, least)): &(&str, (f64, f64))| {
        let figures = [number(*mm, 4), number(mm / median_mm, 3), number(*least, 3)];
        std::iter::once((*name).to_owned()).chain(figures).collect()
    };
    let head = [
        "plan",
        "opening −Q, mm",
        "over the random median",
        "least load factor of uses",
    ];
    markdown(&head, &plans.iter().map(row).collect::<Vec<_>>())
}

/// Writes a number with so many digits; a dash for NaN.
fn number(x: f64, digits: usize) -> String {
    if x.is_nan() {
        "–".to_owned()
    } else {
        format!("{x:.digits$}")
    }
}

/// Quantile of values in increasing order; NaN if there are none.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = (share * (sorted.len().max(1) - 1) as f64) as usize;
    sorted.get(at).copied().unwrap_or(f64::NAN)
}

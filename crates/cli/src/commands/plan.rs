//! `plan`: divides a model and plans its pieces.

use std::path::Path;

use serde_json::{Value, json};
use shellock::PatchId;
use shellock::design::Planned;
use shellock_job::bed::fit_params;
use shellock_job::build::{check_options, plan_model};
use shellock_job::place::Standing;
use shellock_job::told::{quality, weakest};
use shellock_job::{Failure, Options, bears_lines, input};

use crate::Session;
use crate::print::{print_input_warnings, print_warnings};
use crate::progress::Display;

/// Runs `shellock plan` and returns the exit code.
pub fn plan(session: &Session, file: &Path, options: &Options) -> Result<u8, Failure> {
    let model = input::simple_model(&session.job, file, options)?;
    let params = fit_params(&session.job, &check_options(options)?, options, &model)?;
    let display = Display::new(session.progress_form);
    print_input_warnings(session, &model);
    let planned = plan_model(&session.job, &model, options, &params, &|p| display.show(p));
    display.finish();
    let Planned {
        plan,
        proof,
        mean_cost,
        n_plans,
        holding,
        warnings,
        ..
    } = planned?;
    let steps = &plan.steps;
    if session.is_json {
        let warnings: Vec<_> = model.warnings.iter().chain(&warnings).collect();
        let order: Vec<PatchId> = steps.iter().map(|s| s.piece).collect();
        let steps: Vec<Value> = steps
            .iter()
            .map(|s| json!({ "piece": s.piece, "separation": (s.separation.unit() + 0.0).to_array() }))
            .collect();
        println!(
            "{}",
            json!({ "status": "found", "installation_order": order, "steps": steps, "plan": proof,
                    "holding": holding, "bears": holding.summary(),
                    "mean_cost": mean_cost, "n_plans": n_plans, "warnings": warnings })
        );
        return Ok(0);
    }
    for s in steps {
        let (cost, d) = (proof.piece_costs[s.piece], -s.separation.unit() + 0.0);
        let [x, y, z] = d.to_array();
        println!(
            "piece {:3} moves in along ({x:+.2}, {y:+.2}, {z:+.2}), cost {cost:.2}",
            s.piece
        );
    }
    println!("{}", quality(&proof));
    let standing = Standing::of(options.up, model.solid.mesh());
    bears_lines(&holding, &standing)
        .iter()
        .for_each(|line| println!("{line}"));
    weakest(&holding, &standing)
        .iter()
        .for_each(|line| println!("{line}"));
    print_warnings(session, &warnings, &standing);
    Ok(0)
}

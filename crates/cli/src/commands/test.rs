//! `test`: simulates a punch and a fall of a finished kit.

use std::path::Path;

use shellock::Ctx;
use shellock::stress_test::{Outcome, StressParams, StressReport, StressVerdict};
use shellock_job::Failure;
use shellock_job::stress::StressTest;
use shellock_volume::compare::{CompareError, compare};

use crate::Session;
use crate::args::Blows;
use crate::progress::Display;

/// Runs `shellock test` and returns the exit code: 0 if the kit holds, else 1.
pub fn test(session: &Session, kit: &Path, blows: &Blows) -> Result<u8, Failure> {
    let test = StressTest::read(kit, &blows.into())?;
    let display = Display::new(session.progress_form);
    let report = |p: shellock::Progress<'_>| display.show(p);
    let tested = run(&Ctx::new(&report, &session.job.stop), &test, blows.compare);
    display.finish();
    let tested = tested?;
    let value = test.write(&tested)?;
    if session.is_json {
        println!("{value}");
    } else {
        print_table(&test.params, &tested);
        println!("written to {}: stress.json, stress.svg", kit.display());
    }
    Ok(u8::from(!tested.has_passed()))
}

/// Runs the test, after the comparison with worse plans if that is asked for.
fn run(ctx: &Ctx<'_>, test: &StressTest, compares: bool) -> Result<StressReport, Failure> {
    let compared = compares.then(|| compare(ctx, &test.params, &test.surface, &test.order));
    let compared = compared.transpose().map_err(|error| match error {
        CompareError::Test(error) => error.into(),
        CompareError::Volume(error) => Failure::Wrong(error.to_string()),
    })?;
    test.run(ctx, compared)
}

fn print_table(params: &StressParams, tested: &StressReport) {
    println!(
        "pieces weigh {:.0} g; punch {:.0} N, fall from {:.2} m; material strength {} MPa",
        tested.mass_g,
        params.punch_n,
        params.drop_mm / 1000.0,
        tested.strength_mpa
    );
    println!(
        "design           test   force N  opening mm  play mm  between   walls MPa  connectors MPa  of \
         strength  verdict"
    );
    for (name, punch, drop) in tested.rows() {
        for (test, o) in [("punch", punch), ("fall", drop)] {
            print_row(&name, test, o);
        }
    }
    print_key(tested);
    let Some(compared) = &tested.compared else {
        return;
    };
    println!(
        "printed: finished pieces with their gaps; μ: coefficient of friction; others: walls and connectors \
         without gaps"
    );
    for (name, pair) in compared.designs() {
        if let Some(score) = pair.score {
            println!("{name:16} score (load factor in handling): {score:.2}");
        }
    }
    if compared.half_score.is_none() {
        println!("no other plan was found, so no plan with half the score was tested");
    }
}

/// Prints how far the key slides out in each test, if that is visible.
fn print_key(tested: &StressReport) {
    /// Least visible slide, mm; anything below is play.
    const SEEN_MM: f64 = 0.5;
    for printed in &tested.printed {
        for (done, o) in [("the punch", &printed.punch), ("the fall", &printed.drop)] {
            if o.key_slides_mm >= SEEN_MM && o.key_slides_mm.is_finite() {
                println!(
                    "with friction {} the key slides out by {:.1} mm in {done}: push it back, or build with \
                     --detent 0.2",
                    printed.friction, o.key_slides_mm
                );
            }
        }
    }
}

fn print_row(name: &str, test: &str, o: &Outcome) {
    let Outcome {
        force_n,
        opening_mm,
        play_mm,
        wall_mpa,
        connector_mpa,
        ..
    } = o;
    let between = o
        .between
        .map_or_else(String::new, |[a, b]| format!("{a} and {b}"));
    let percent = 100.0 * o.strength_share;
    let verdict = words(o.verdict);
    println!(
        "{name:16} {test:6} {force_n:7.0}  {opening_mm:10.3}  {play_mm:7.3}  {between:9} {wall_mpa:9.1}  \
         {connector_mpa:14.1}  {percent:9.0} %  {verdict}"
    );
}

fn words(verdict: StressVerdict) -> &'static str {
    match verdict {
        StressVerdict::Holds => "holds",
        StressVerdict::Opens => "OPENS",
        StressVerdict::Yields => "YIELDS",
        StressVerdict::ComesApart => "COMES APART",
    }
}

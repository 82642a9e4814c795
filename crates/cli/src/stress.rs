//! `test`: simulates a punch and a fall of a finished kit.

use std::path::Path;

use serde_json::json;
use shellock::design::{Params, Settings, Thickness};
use shellock::key::Turn;
use shellock::metric::MetricParams;
use shellock::sizes::SizeChoice;
use shellock::stress_test::{
    Outcome, PunchAt, StressParams, StressReport, StressVerdict, chart, stress_test,
};
use shellock::{Ctx, PatchId, SegmentedSurface};
use shellock_geom::check::into_solid;
use shellock_geom::{Solid, Vec3};
use shellock_kit::{PlanFile, PlanFileError};
use shellock_mechanics::Material;
use shellock_volume::compare::compare;

use crate::Session;
use crate::args::{Axis, Blows, Place};
use crate::failure::Failure;
use crate::input::load;
use crate::names::no_such;
use crate::output::PLAN;
use crate::progress::Display;
use crate::stages::{broken, plan_of, write};

/// Finds the material preset of that name, in any case.
pub fn material(name: &str) -> Result<Material, String> {
    let found = Material::PRESETS
        .into_iter()
        .find(|(preset, _)| preset.eq_ignore_ascii_case(name))
        .map(|(_, material)| material);
    found.ok_or_else(|| no_such("material", name, &Material::PRESETS.map(|(preset, _)| preset)))
}

/// Runs `shellock test` and returns the exit code: 0 if the kit holds, else 1.
pub fn test(session: &Session, kit: &Path, blows: &Blows) -> Result<u8, Failure> {
    if !kit.join(PLAN).exists() {
        return Err(Failure::Wrong(format!(
            "{}: there is no kit here, for it has no plan.json; `shellock build` makes one",
            kit.display()
        )));
    }
    let plan = plan_of(kit)?;
    let order = plan.order().map_err(broken(kit))?;
    check_kit(kit, &plan)?;
    let surface = surface_of(&kit.join("segmentation.ply"), order.steps.len())?;
    let params = params_of(&plan, blows).map_err(broken(kit))?;
    let pieces = pieces_of(kit, &plan)?;

    let display = Display::new(session.shown);
    let report = |p: shellock::context::Progress<'_>| display.show(p);
    let ctx = Ctx::new(&report, &session.stop);
    let tested = blows
        .compare
        .then(|| compare(&ctx, &params, &surface, &order))
        .transpose()
        .map_err(Failure::from)
        .and_then(|compared| Ok(stress_test(&ctx, &params, &surface, &order, &pieces, compared)?))
        .inspect_err(|_| display.finish())?;
    display.finish();

    let code = u8::from(!tested.passed());
    let value = json!({
        "format": "shellock-stress", "version": 2, "punch_n": params.punch_n,
        "punch_at": params.punch_at, "drop_mm": params.drop_mm,
        "material": params.metric.material, "connector_size": params.sizes.largest_mm(), "up": params.plan.up,
        "passed": tested.passed(), "report": tested,
    });
    let mut text = serde_json::to_string_pretty(&value).expect("numbers and strings can be written");
    text.push('\n');
    write(&kit.join("stress.json"), text.as_bytes())?;
    write(&kit.join("stress.svg"), chart(&tested).as_bytes())?;
    if session.is_json {
        println!("{value}");
    } else {
        print_table(&params, &tested);
        println!("written to {}: stress.json, stress.svg", kit.display());
    }
    Ok(code)
}

/// Checks that the plan's directions are valid and that all of the kit's piece files exist.
fn check_kit(kit: &Path, plan: &PlanFile) -> Result<(), Failure> {
    plan.check_directions().map_err(broken(kit))?;
    let mut files = plan.pieces.iter().filter_map(|piece| piece.file.as_ref());
    match files.find(|file| !kit.join(file).is_file()) {
        Some(file) => Err(broken(kit)(format!(
            "names {file}, which is not there; the kit is not complete"
        ))),
        None => Ok(()),
    }
}

/// Loads the finished pieces, in order of their ids.
fn pieces_of(kit: &Path, plan: &PlanFile) -> Result<Vec<Solid>, Failure> {
    let piece = |(number, file): (usize, Option<&String>)| {
        let missing = || {
            broken(kit)(format!(
                "names no file of piece {number}; the test is of finished pieces"
            ))
        };
        let path = kit.join(file.ok_or_else(missing)?);
        let (loaded, _) = load(&path)?;
        let solid = into_solid(&loaded.mesh);
        Ok(solid
            .map_err(|source| Failure::NotOneBody {
                path,
                source,
                objects: Vec::new(),
            })?
            .0)
    };
    (1..)
        .zip(plan.pieces.iter().map(|entry| entry.file.as_ref()))
        .map(piece)
        .collect()
}

/// Reads the surface with its patches that `build` wrote.
fn surface_of(path: &Path, n_pieces: usize) -> Result<SegmentedSurface, Failure> {
    let wrong = |what: &str| Failure::Wrong(format!("{}: {what}", path.display()));
    let (loaded, _) = load(path)?;
    let labels = loaded
        .face_labels()
        .ok_or_else(|| wrong("its faces have no labels"))?;
    let (solid, kept) = into_solid(&loaded.mesh).map_err(|source| Failure::NotOneBody {
        path: path.to_owned(),
        source,
        objects: Vec::new(),
    })?;
    // Kits of program 0.1 number pieces from 0 here, as in their plans.
    let first = i64::from(!labels.contains(&0));
    let patch = |&face: &u32| {
        let place = labels[face as usize].checked_sub(first);
        place
            .and_then(|place| u32::try_from(place).ok())
            .map(PatchId)
            .filter(|&piece| usize::from(piece) < n_pieces)
            .ok_or_else(|| wrong("a face has a label that is no piece of plan.json"))
    };
    let patch_of_face: Vec<PatchId> = kept.iter().map(patch).collect::<Result<_, _>>()?;
    if (0..n_pieces).any(|piece| !patch_of_face.contains(&piece.into())) {
        return Err(wrong("a piece of plan.json has no face"));
    }
    Ok(SegmentedSurface {
        mesh: solid.into_mesh(),
        patch_of_face,
        source_face: kept,
        n_patches: n_pieces,
    })
}

/// Parameters of the test for this kit; fails with a list of invalid values.
fn params_of(plan: &PlanFile, blows: &Blows) -> Result<StressParams, String> {
    let told = |e: PlanFileError| e.to_string();
    let sizes = plan.sizes().map_err(told)?;
    let mut params = Params::default();
    params.thickness = Thickness::Mm(plan.thickness_mm().map_err(told)?);
    params.connector.size = SizeChoice::Fixed(sizes.largest_mm());
    params.seed = plan.seed;
    let up = blows.up.map(Axis::unit).or(plan.up);
    params.up = up.unwrap_or_else(|| Axis::Z.unit());
    let problems = params.problems();
    if !problems.is_empty() {
        return Err(problems.join("; "));
    }
    let mut plan_params = Settings::resolve(&params).plan;
    let mut turn = Turn::default();
    if let Some(key) = &plan.key {
        let (laid, along) = Turn::laying(Vec3::from(key.plane_normal), Vec3::from(key.slide));
        plan_params.key = plan.key_piece;
        (turn, plan_params.key_slide) = (laid, Some(along));
    }
    let built = || plan.strength.as_ref().and_then(|s| s.material);
    let (material, edge_share) = (blows.material.or_else(built).unwrap_or_default(), blows.edges);
    let metric = MetricParams {
        edge_share,
        ..MetricParams::of_plan(&plan_params, &sizes, material)
    };
    let punch_at = match blows.at {
        Place::Top => PunchAt::Top,
        Place::Middle => PunchAt::Middle,
    };
    Ok(StressParams {
        punch_n: blows.punch,
        punch_at,
        drop_mm: 1000.0 * blows.drop,
        cell_mm: blows.cell,
        metric,
        sizes,
        plan: plan_params,
        turn,
    })
}

fn print_table(params: &StressParams, tested: &StressReport) {
    println!(
        "pieces weigh {:.0} g; punch {:.0} N, fall from {:.2} m; material bears {} MPa",
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
        "printed: the finished pieces with their gaps; μ: friction; the others: walls and connectors \
         without gaps"
    );
    for (name, pair) in compared.designs() {
        if let Some(score) = pair.score {
            println!("{name:16} score, by how many times it bears what people do to it: {score:.2}");
        }
    }
    if compared.half_score.is_none() {
        println!("no other plan was found, so none of half the score was tested");
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn materials_have_names() {
        assert!(material("pla").is_ok() && material("wood").is_err());
    }
}

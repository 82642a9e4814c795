//! `test`: what a punch and a fall do to a finished kit.

use std::path::Path;

use serde_json::{Value, json};
use shellock::design::{Params, Settings, Thickness};
use shellock::metric::MetricParams;
use shellock::sizes::SizeChoice;
use shellock::stress_test::{
    Outcome, Pair, PunchAt, StressParams, StressReport, Verdict, chart, stress_test,
};
use shellock::{ConnectorSizes, Ctx, LatticeDirection, PatchId, SegmentedSurface};
use shellock_geom::check::into_solid;
use shellock_mechanics::Material;

use crate::Session;
use crate::args::{Axis, Blows, Place};
use crate::failure::Failure;
use crate::input::{load, read};
use crate::progress::Display;
use crate::stages::{order_of, write};

/// A force in N: "70N", "0.07 kN" or "70".
pub fn newtons(text: &str) -> Result<f64, String> {
    let said = || format!("\"{text}\" is no force above 0 N; write for example 70N");
    with_unit(text, &[("kn", 1000.0), ("n", 1.0), ("", 1.0)]).ok_or_else(said)
}

/// A height in m: "2m", "200cm", "2000 mm" or "2".
pub fn metres(text: &str) -> Result<f64, String> {
    let said = || format!("\"{text}\" is no height above 0; write for example 2m, 150cm or 500mm");
    with_unit(text, &[("mm", 0.001), ("cm", 0.01), ("m", 1.0), ("", 1.0)]).ok_or_else(said)
}

/// A number above 0 times that of the first unit it ends in.
fn with_unit(text: &str, units: &[(&str, f64)]) -> Option<f64> {
    let text = text.trim().to_ascii_lowercase();
    let (number, factor) = units
        .iter()
        .find_map(|(unit, factor)| Some((text.strip_suffix(unit)?.trim(), factor)))?;
    Some(positive(number)? * factor)
}

fn positive(text: &str) -> Option<f64> {
    text.parse::<f64>().ok().filter(|v| v.is_finite() && *v > 0.0)
}

/// The material of that name.
pub fn material(name: &str) -> Result<Material, String> {
    let found = Material::PRESETS
        .into_iter()
        .find(|(preset, _)| preset.eq_ignore_ascii_case(name))
        .map(|(_, material)| material);
    let names = || Material::PRESETS.map(|(preset, _)| preset).join(", ");
    found.ok_or_else(|| format!("there is no material \"{name}\"; choose one of {}", names()))
}

/// `shellock test`.
pub fn test(session: &Session, kit: &Path, blows: &Blows) -> Result<u8, Failure> {
    let path = kit.join("plan.json");
    if !path.exists() {
        return Err(Failure::Wrong(format!(
            "{}: there is no kit here, for it has no plan.json; `shellock build` makes one",
            kit.display()
        )));
    }
    let broken = |what: &str| Failure::Wrong(format!("{}: {what}", path.display()));
    let plan: Value =
        serde_json::from_slice(&read(&path)?).map_err(|e| broken(&format!("not a plan: {e}")))?;
    let order = order_of(&plan).map_err(|f| match f {
        Failure::Wrong(what) => broken(&what),
        other => other,
    })?;
    check_kit(kit, &plan).map_err(|what| broken(&what))?;
    let surface = surface_of(&kit.join("segmentation.ply"), order.steps.len())?;
    let params = params_of(&plan, blows).map_err(|what| broken(&what))?;

    let display = Display::new(session.shown);
    let report = |p: shellock::context::Progress<'_>| display.show(p);
    let ctx = Ctx::new(&report, &session.stop);
    let tested = stress_test(&ctx, &params, &surface, &order).inspect_err(|_| display.finish())?;
    display.finish();

    let code = u8::from(!tested.passed());
    let value = json!({
        "format": "shellock-stress", "version": 1, "punch_n": params.punch_n,
        "punch_at": params.punch_at, "drop_mm": params.drop_mm,
        "material": params.metric.material, "connector_size": params.sizes.largest_mm(), "up": params.plan.up,
        "passed": tested.passed(), "report": tested,
    });
    let mut text = serde_json::to_string_pretty(&value).map_err(|e| broken(&e.to_string()))?;
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

/// What makes a plan no plan of this program's, or its kit incomplete.
fn check_kit(kit: &Path, plan: &Value) -> Result<(), String> {
    if plan.get("format").is_some_and(|f| f != "shellock-plan") || plan.get("version").is_some_and(|v| v != 1)
    {
        return Err("\"format\" and \"version\" are not \"shellock-plan\" and 1; build the kit again".into());
    }
    for piece in plan["pieces"].as_array().into_iter().flatten() {
        let direction: Vec<f64> = piece["installation_direction"]
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(Value::as_f64)
            .collect();
        if direction.len() != 3 || (direction.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() > 0.01 {
            return Err(format!(
                "the installation_direction of piece {} is no unit vector",
                piece["id"]
            ));
        }
        if let Some(file) = piece["file"].as_str().filter(|file| !kit.join(file).is_file()) {
            return Err(format!(
                "names {file}, which is not there; the kit is not complete"
            ));
        }
    }
    Ok(())
}

/// The surface with its patches that `build` wrote.
fn surface_of(path: &Path, n_pieces: usize) -> Result<SegmentedSurface, Failure> {
    let wrong = |what: &str| Failure::Wrong(format!("{}: {what}", path.display()));
    let (loaded, _) = load(path)?;
    let labels = loaded
        .face_labels()
        .ok_or_else(|| wrong("its faces have no labels"))?;
    let (solid, kept) = into_solid(&loaded.mesh).map_err(|source| Failure::NotOneBody {
        path: path.to_owned(),
        source,
    })?;
    let patch = |&face: &u32| {
        let label = u32::try_from(labels[face as usize])
            .ok()
            .filter(|&label| (label as usize) < n_pieces);
        label
            .map(PatchId)
            .ok_or_else(|| wrong("a face has a label that is no piece of plan.json"))
    };
    let patch_of_face: Vec<PatchId> = kept.iter().map(patch).collect::<Result<_, _>>()?;
    if (0..n_pieces as u32).any(|piece| !patch_of_face.contains(&PatchId(piece))) {
        return Err(wrong("a piece of plan.json has no face"));
    }
    Ok(SegmentedSurface {
        mesh: solid.into_mesh(),
        patch_of_face,
        source_face: kept,
        n_patches: n_pieces,
    })
}

/// The kit's sizes, or what is wrong with them.
fn params_of(plan_value: &Value, blows: &Blows) -> Result<StressParams, String> {
    let plan = plan_value;
    let mut params = Params::default();
    params.thickness = Thickness::Mm(
        plan["shell_thickness"]
            .as_f64()
            .ok_or("\"shell_thickness\" is no number of mm")?,
    );
    let sizes = sizes_of(plan)?;
    params.connector.size = SizeChoice::Fixed(sizes.largest_mm());
    params.seed = plan["seed"].as_u64().unwrap_or_default();
    let told: Vec<f64> = plan["up"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(Value::as_f64)
        .collect();
    params.up = match (blows.up, &told[..]) {
        (Some(axis), _) => axis.unit(),
        (None, [x, y, z]) => [*x, *y, *z],
        _ => Axis::Z.unit(),
    };
    let problems = params.problems();
    if !problems.is_empty() {
        return Err(problems.join("; "));
    }
    let mut plan_params = Settings::resolve(&params).plan;
    if let [x, y, z] = plan["key"]["slide"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(Value::as_f64)
        .collect::<Vec<_>>()[..]
    {
        plan_params.key = plan["key_piece"]
            .as_u64()
            .and_then(|key| u32::try_from(key).ok())
            .map(PatchId);
        plan_params.key_slide = Some(LatticeDirection::nearest(shellock_geom::Vec3::new(x, y, z)));
    }
    let built = || serde_json::from_value::<Material>(plan_value["strength"]["material"].clone()).ok();
    let (material, edge_share) = (blows.material.or_else(built).unwrap_or_default(), blows.edges);
    let metric = MetricParams {
        material,
        edge_share,
        ..MetricParams::of_plan(&plan_params, &sizes)
    };
    let punch_at = match blows.at {
        Place::Top => PunchAt::Top,
        Place::Middle => PunchAt::Middle,
    };
    Ok(StressParams {
        punch_n: blows.punch,
        punch_at,
        drop_mm: 1000.0 * blows.drop,
        metric,
        sizes,
        plan: plan_params,
    })
}

/// The connectors' sizes: one for all, or those of each pair.
fn sizes_of(plan: &Value) -> Result<ConnectorSizes, String> {
    let default_mm = plan["connector_size"]
        .as_f64()
        .ok_or("\"connector_size\" is no number of mm")?;
    let pair = |entry: &Value| -> Option<([PatchId; 2], f64)> {
        let piece = |i: usize| u32::try_from(entry["pieces"][i].as_u64()?).ok().map(PatchId);
        Some((
            [piece(0)?, piece(1)?],
            entry["size_mm"].as_f64().filter(|mm| (0.1..=20.0).contains(mm))?,
        ))
    };
    let pairs = plan["connector_sizes"]
        .as_array()
        .into_iter()
        .flatten()
        .map(pair)
        .collect::<Option<Vec<_>>>();
    let pairs =
        pairs.ok_or("\"connector_sizes\" must list \"pieces\", two numbers, and \"size_mm\", 0.1 to 20")?;
    let n_pieces = plan["pieces"].as_array().map_or(0, Vec::len);
    if let Some(([a, b], _)) = pairs
        .iter()
        .find(|(pair, _)| pair.iter().any(|p| usize::from(*p) >= n_pieces))
    {
        return Err(format!(
            "\"connector_sizes\" names pieces {a} and {b}, which are not both there"
        ));
    }
    if plan["connector_sizes"].as_array().is_some_and(Vec::is_empty) {
        return Err("\"connector_sizes\" is empty; a kit whose seams all have the same size has none".into());
    }
    Ok(ConnectorSizes::with_pairs(default_mm, pairs))
}

fn print_table(params: &StressParams, tested: &StressReport) {
    println!(
        "walls weigh {:.0} g; punch {:.0} N, fall from {:.2} m; material bears {} MPa",
        tested.mass_g,
        params.punch_n,
        params.drop_mm / 1000.0,
        tested.strength_mpa
    );
    println!(
        "design           test   force N  opening mm  between   walls MPa  connectors MPa  of strength  verdict"
    );
    for (
        name,
        Pair {
            punch,
            drop,
            score_mm,
            ..
        },
    ) in tested.designs()
    {
        for (test, o) in [("punch", punch), ("fall", drop)] {
            let Outcome {
                force_n,
                opening_mm,
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
                "{name:16} {test:6} {force_n:7.0}  {opening_mm:10.3}  {between:9} {wall_mpa:9.1}  {connector_mpa:14.1}  \
                 {percent:9.0} %  {verdict}"
            );
        }
        if let Some(score_mm) = score_mm {
            println!("{name:16} score by the surface metric {score_mm:.4} mm");
        }
    }
    if tested.kit.score_mm.is_none() {
        println!("by the surface metric this plan comes apart, so there is none of half its score");
    } else if tested.half_score.is_none() {
        println!("no other plan that holds was found, so none of half the score was tested");
    }
}

fn words(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Holds => "holds",
        Verdict::Opens => "OPENS",
        Verdict::Yields => "YIELDS",
        Verdict::ComesApart => "COMES APART",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_have_units() {
        assert_eq!(
            (newtons("70N"), newtons("7.5 n"), newtons("0.07kN"), newtons("70")),
            (Ok(70.0), Ok(7.5), Ok(0.07 * 1000.0), Ok(70.0))
        );
        assert_eq!(
            (metres("2m"), metres("150 cm"), metres("2")),
            (Ok(2.0), Ok(1.5), Ok(2.0))
        );
        for wrong in ["", "N", "-3N", "infN", "3kg"] {
            assert!(newtons(wrong).is_err(), "{wrong}");
        }
        for wrong in ["", "m", "-2m", "nanm", "2 km", "0"] {
            assert!(metres(wrong).is_err(), "{wrong}");
        }
        assert!(material("pla").is_ok() && material("wood").is_err());
    }
}

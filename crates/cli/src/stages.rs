//! Each stage alone, from what an earlier one wrote.

use std::fs;
use std::path::{Component, Path, PathBuf};

use serde_json::{Value, json};
use shellock::certificate::{OtherFile, PieceFile};
use shellock::design::{self, DesignError, Planned, Settings};
use shellock::piece::PressFit;
use shellock::plan::{InstallationPlan, InstallationStep};
use shellock::verify::{Assembly, VerifyParams};
use shellock::{Ctx, IdVec, LatticeDirection, PatchId, segmentation};
use shellock_formats::{write_labels, write_ply, write_stl_binary};
use shellock_geom::weld::weld;
use shellock_geom::{Solid, TriMesh, Vec3};

use crate::Session;
use crate::args::Options;
use crate::build::{checked, print_verdict, print_warnings, quality, weakest};
use crate::failure::Failure;
use crate::input::{self, load, read, sha256};
use crate::output::{CERTIFICATE, certificate_bytes};
use crate::paint::painted;
use crate::progress::{Display, PlanClock};

/// Writes one file: whole or not at all.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let parent = path
        .parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(".shellock-");
    // Temporary files are for their owner alone; this one stays, for whom the user lets read files.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let temporary = builder.tempfile_in(parent).map_err(Failure::unwritable(path))?;
    fs::write(temporary.path(), bytes).map_err(Failure::unwritable(path))?;
    temporary
        .persist(path)
        .map(|_| ())
        .map_err(|e| Failure::Unwritable {
            path: path.to_owned(),
            source: e.error,
        })
}

fn extension(path: &Path) -> String {
    path.extension()
        .map_or_else(String::new, |e| e.to_string_lossy().to_ascii_lowercase())
}

/// `shellock segment`.
pub fn segment(session: &Session, file: &Path, options: &Options, out: &Path) -> Result<u8, Failure> {
    let settings = Settings::resolve(&checked(options)?);
    let kind = extension(out);
    if !["ply", "3mf", "seg"].contains(&kind.as_str()) {
        return Err(Failure::Wrong(format!(
            "{}: choose a name that ends in .ply, .3mf or .seg",
            out.display()
        )));
    }
    let model = input::model(session, file, options)?;
    let display = Display::new(session.shown);
    let report = |p: shellock::context::Progress<'_>| display.show(p);
    let ctx = Ctx::new(&report, &session.stop);
    let surface = segmentation::segment(
        &ctx,
        &settings.segmentation,
        &model.solid,
        model.labels.as_deref(),
    )
    .map_err(DesignError::from)?;
    display.finish();
    let mut notes = model.notes.clone();
    let bytes = match kind.as_str() {
        "ply" => {
            let labels: Vec<i32> = surface.patch_of_face.iter().map(|p| p.0 as i32).collect();
            write_ply(&surface.mesh, Some(&labels))
        }
        "3mf" => {
            let (bytes, is_distinct) = painted(&model.name, &surface);
            if !is_distinct {
                notes
                    .push("slicers have 16 colours of paint: pieces that do not touch share some".to_owned());
            }
            bytes
        }
        _ => write_labels(&labels_of_file(&model, &surface)),
    };
    write(out, &bytes)?;
    let warnings = ctx.into_warnings();
    if session.is_json {
        let value = json!({ "status": "done", "out": out, "pieces": surface.n_patches, "notes": notes, "warnings": warnings });
        println!("{value}");
    } else {
        notes.iter().for_each(|n| println!("note: {n}"));
        warnings.iter().for_each(|w| println!("warning: {}", w.message));
        println!("{} pieces, written to {}", surface.n_patches, out.display());
    }
    Ok(0)
}

/// For each face of the file, the patch that has most of its area; faces that were dropped get patch 0.
fn labels_of_file(model: &input::Model, surface: &shellock::SegmentedSurface) -> Vec<u32> {
    let mut best = vec![(0.0f64, 0u32); model.n_file_faces];
    let mut area = vec![0.0; surface.n_patches];
    let mut from = 0;
    let mut order: Vec<usize> = (0..surface.mesh.triangles.len()).collect();
    order.sort_by_key(|&f| surface.source_face[f]);
    while from < order.len() {
        let source = surface.source_face[order[from]];
        let to = from
            + order[from..]
                .iter()
                .take_while(|&&f| surface.source_face[f] == source)
                .count();
        area.iter_mut().for_each(|a| *a = 0.0);
        for &f in &order[from..to] {
            area[surface.patch_of_face[f].0 as usize] += surface.mesh.face_area(f);
        }
        let (patch, &share) = area
            .iter()
            .enumerate()
            .max_by(|a, b| a.1.total_cmp(b.1))
            .expect("there is at least one patch");
        let entry = &mut best[model.file_face[source as usize] as usize];
        if share > entry.0 {
            *entry = (share, patch as u32);
        }
        from = to;
    }
    best.into_iter().map(|b| b.1).collect()
}

/// `shellock plan`.
pub fn plan(session: &Session, file: &Path, options: &Options) -> Result<u8, Failure> {
    let params = checked(options)?;
    let model = input::model(session, file, options)?;
    let display = Display::new(session.shown);
    let clock = PlanClock::new(options.plan_time);
    let report = |p: shellock::context::Progress<'_>| {
        clock.see(&p);
        display.show(p);
    };
    let is_time_up = || clock.is_up();
    let ctx = Ctx::new(&report, &session.stop).with_time_limit(&is_time_up);
    let planned = design::plan(&ctx, &params, &model.solid, model.labels.as_deref())
        .inspect_err(|_| display.finish())?;
    display.finish();
    let Planned {
        found,
        holding,
        warnings,
        ..
    } = planned.map_err(|reason| Failure::NoPlan(format!("no plan was found: {reason}")))?;
    let (proof, steps) = (found.proof(), &found.plan.steps);
    if session.is_json {
        let order: Vec<PatchId> = steps.iter().map(|s| s.piece).collect();
        let steps: Vec<Value> = steps
            .iter()
            .map(|s| json!({ "piece": s.piece, "separation": s.separation.step() }))
            .collect();
        println!(
            "{}",
            json!({ "status": "found", "installation_order": order, "steps": steps, "plan": proof, "holding": holding,
                    "mean_cost": found.score.mean, "n_plans": found.pool.len(), "warnings": warnings })
        );
        return Ok(0);
    }
    for (i, s) in steps.iter().enumerate() {
        let (cost, d) = (found.score.pieces[s.piece], -s.separation.unit() + 0.0);
        let [x, y, z] = d.to_array();
        println!(
            "{:3}. piece {:3} moves in along ({x:+.2}, {y:+.2}, {z:+.2}), cost {cost:.2}",
            i + 1,
            s.piece
        );
    }
    println!("{}", quality(&proof));
    weakest(&holding).iter().for_each(|line| println!("{line}"));
    print_warnings(&warnings);
    Ok(0)
}

/// `shellock verify`.
pub fn verify(session: &Session, kit: &Path, model: Option<&Path>) -> Result<u8, Failure> {
    let path = kit.join("plan.json");
    let broken = |what: &str| Failure::Wrong(format!("{}: {what}", path.display()));
    let text = read(&path)?;
    let plan: Value = serde_json::from_slice(&text).map_err(|e| broken(&format!("not a plan: {e}")))?;
    let Kit { files, pieces, order } = pieces_of(kit, &plan).map_err(|f| match f {
        Failure::Wrong(what) => broken(&what),
        other => other,
    })?;
    let solid = model_of(&plan, model).map_err(|f| match f {
        Failure::Wrong(what) => broken(&what),
        other => other,
    })?;
    let params = VerifyParams {
        clearance_mm: plan["clearance"].as_f64().unwrap_or_default(),
        seed: plan["seed"].as_u64().unwrap_or_default(),
    };
    let display = Display::new(session.shown);
    let report = |p: shellock::context::Progress<'_>| display.show(p);
    let ctx = Ctx::new(&report, &session.stop);
    let press_fits = press_fits_of(&plan).map_err(|what| broken(&what))?;
    let assembly = Assembly {
        model: Some(&solid),
        pieces: &pieces,
        plan: &order,
        press_fits: &press_fits,
    };
    let verdict = shellock::verify(&ctx, &params, &assembly).inspect_err(|_| display.finish())?;
    let claimed = verdict.certificate(files, &params, &assembly);
    let verdict = verdict.verification;
    display.finish();
    if let Some(claimed) = claimed {
        let claimed = claimed
            .with_press_fits(press_fits)
            .with_files(certified_files(kit));
        write(&kit.join(CERTIFICATE), &certificate_bytes(&claimed))?;
    }
    let code = u8::from(!verdict.passed());
    if session.is_json {
        println!(
            "{}",
            json!({ "passed": verdict.passed(), "checks": verdict.checks, "findings": verdict.findings, "exit_code": code })
        );
    } else {
        print_verdict(&verdict);
    }
    Ok(code)
}

/// The places where the key presses on purpose. A plan without any names none.
fn press_fits_of(plan: &Value) -> Result<Vec<PressFit>, String> {
    let fits = if plan["press_fits"].is_null() {
        Value::Array(Vec::new())
    } else {
        plan["press_fits"].clone()
    };
    let fits: Vec<PressFit> = serde_json::from_value(fits).map_err(|e| format!("press_fits: {e}"))?;
    let range_mm = 0.0..=PressFit::MOST_INTERFERENCE_MM;
    match fits.iter().find(|fit| !range_mm.contains(&fit.interference_mm)) {
        Some(fit) => Err(format!(
            "a press fit of {} mm is none; up to {} mm are",
            fit.interference_mm,
            PressFit::MOST_INTERFERENCE_MM
        )),
        None => Ok(fits),
    }
}

/// Files besides the pieces, as the earlier certificate names and hashes them, if there is one: what they
/// hold is not verified again.
fn certified_files(kit: &Path) -> Vec<OtherFile> {
    let earlier = read(&kit.join(CERTIFICATE))
        .ok()
        .and_then(|bytes| serde_json::from_slice::<Value>(&bytes).ok());
    earlier
        .and_then(|c| serde_json::from_value(c["files"].clone()).ok())
        .unwrap_or_default()
}

/// The solid that a kit was made from, in assembly space: that in the file `model`, or in the one that the
/// plan names.
pub fn model_of(plan: &Value, model: Option<&Path>) -> Result<Solid, Failure> {
    let named = plan["input"]["file"].as_str().unwrap_or_default();
    let model_path = model.map_or_else(|| PathBuf::from(named), Path::to_owned);
    if model.is_none() && !model_path.exists() {
        return Err(Failure::Wrong(format!(
            "there is no file {named} here, from which it was made; name the model after the kit"
        )));
    }
    let (loaded, _) = load(&model_path)?;
    let largest = plan["input"]["largest_only"].as_bool().unwrap_or_default();
    let solid = input::mended(&model_path, &loaded, input::mending(false, largest))?.solid;
    let t: Vec<f64> = plan["input"]["transform"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(Value::as_f64)
        .collect();
    if t.len() != 16 {
        return Err(Failure::Wrong("input.transform is not 16 numbers".into()));
    }
    let mut mesh = solid.into_mesh();
    for p in &mut mesh.points {
        *p = Vec3::from_array(std::array::from_fn(|r| {
            t[4 * r] * p.x + t[4 * r + 1] * p.y + t[4 * r + 2] * p.z + t[4 * r + 3]
        }));
    }
    Solid::new(mesh).map_err(|e| Failure::Wrong(format!("with its transform the model is no solid: {e}")))
}

/// What a plan file names.
pub struct Kit {
    pub files: Vec<PieceFile>,
    pub pieces: IdVec<PatchId, TriMesh>,
    pub order: InstallationPlan,
}

/// The files, their meshes and the order that a plan file names.
pub fn pieces_of(kit: &Path, plan: &Value) -> Result<Kit, Failure> {
    let order = order_of(plan)?;
    let (mut files, mut meshes) = (Vec::new(), Vec::new());
    for (i, piece) in plan["pieces"].as_array().into_iter().flatten().enumerate() {
        let file = piece["file"]
            .as_str()
            .ok_or_else(|| Failure::Wrong(format!("piece {i} names no file")))?;
        if !Path::new(file)
            .components()
            .all(|c| matches!(c, Component::Normal(_)))
        {
            return Err(Failure::Wrong(format!(
                "piece {i} names \"{file}\", which is no file within the kit"
            )));
        }
        let (loaded, bytes) = load(&kit.join(file))?;
        files.push(PieceFile {
            id: i.into(),
            file: file.to_owned(),
            sha256: sha256(&bytes),
            play: None,
        });
        meshes.push(weld(&loaded.mesh).mesh);
    }
    Ok(Kit {
        files,
        pieces: meshes.into_iter().collect(),
        order,
    })
}

/// The order and the directions that a plan file names.
pub fn order_of(plan: &Value) -> Result<InstallationPlan, Failure> {
    let wrong = |what: String| Failure::Wrong(what);
    let list = plan["pieces"]
        .as_array()
        .ok_or_else(|| wrong("there is no list of pieces".into()))?;
    let mut directions = Vec::new();
    for (i, piece) in list.iter().enumerate() {
        if piece["id"].as_u64() != Some(i as u64) {
            return Err(wrong(format!("piece number {i} does not have the id {i}")));
        }
        let d: Vec<f64> = piece["installation_direction"]
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(Value::as_f64)
            .collect();
        let [x, y, z] = d[..] else {
            return Err(wrong(format!("piece {i} has no installation direction")));
        };
        directions.push(LatticeDirection::nearest(-Vec3::new(x, y, z)));
    }
    let order = plan["installation_order"]
        .as_array()
        .ok_or_else(|| wrong("there is no installation order".into()))?;
    let mut is_named = vec![false; directions.len()];
    let steps = order
        .iter()
        .map(|id| {
            let piece = id.as_u64().filter(|&i| i < directions.len() as u64);
            let piece = piece
                .ok_or_else(|| wrong(format!("the installation order names {id}, which is no piece")))?;
            if std::mem::replace(&mut is_named[piece as usize], true) {
                return Err(wrong(format!("the installation order names piece {id} twice")));
            }
            Ok(InstallationStep {
                piece: PatchId(piece as u32),
                separation: directions[piece as usize],
            })
        })
        .collect::<Result<Vec<_>, Failure>>()?;
    match is_named.iter().position(|is_named| !is_named) {
        Some(piece) => Err(wrong(format!("the installation order leaves out piece {piece}"))),
        None => Ok(InstallationPlan { steps }),
    }
}

/// Whether both are the same name in the same folder.
fn same_file(a: &Path, b: &Path) -> bool {
    let folder = |p: &Path| match p.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => fs::canonicalize(folder).ok(),
        _ => fs::canonicalize(".").ok(),
    };
    a.file_name() == b.file_name() && folder(a) == folder(b)
}

/// `shellock figure`.
pub fn figure(name: &str, out: &Path, size_mm: f64, labels: Option<&Path>) -> Result<u8, Failure> {
    let (solid, limbs) = input::shellock_figure(name, size_mm)?;
    if labels.is_some() && limbs.iter().all(|limb| *limb == 0) {
        return Err(Failure::Wrong(format!(
            "{name} is not made of limbs, so it has no labels; fish and arms have"
        )));
    }
    if labels.is_some_and(|labels| same_file(labels, out)) {
        return Err(Failure::Wrong(
            "the figure and its labels need two different files".into(),
        ));
    }
    let bytes = match extension(out).as_str() {
        "stl" => write_stl_binary(solid.mesh()),
        "ply" => write_ply(solid.mesh(), None),
        _ => {
            return Err(Failure::Wrong(format!(
                "{}: choose a name that ends in .stl or .ply",
                out.display()
            )));
        }
    };
    write(out, &bytes)?;
    if let Some(labels) = labels {
        let lines: String = limbs.iter().map(|limb| format!("{limb}\n")).collect();
        write(labels, lines.as_bytes())?;
    }
    println!(
        "{name}, {size_mm} mm, {} triangles, written to {}",
        solid.mesh().triangles.len(),
        out.display()
    );
    Ok(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn press_fits_are_read_strictly_and_none_is_deeper_than_any_is_made() {
        let fit = |interference_mm: f64| json!({ "kind": "rib", "piece": 3, "at": [0.0, 0.0, 0.0], "interference_mm": interference_mm, "travel_mm": 2.0 });
        let n_read = |fits: Value| press_fits_of(&json!({ "press_fits": fits })).map(|fits| fits.len());
        assert_eq!(n_read(Value::Null), Ok(0));
        assert_eq!(n_read(json!([fit(0.08)])), Ok(1));
        assert!(
            n_read(json!([fit(0.08), fit(0.5)]))
                .unwrap_err()
                .contains("0.5 mm")
        );
        assert!(n_read(json!([fit(-0.1)])).is_err() && n_read(json!([3])).is_err());
    }
}

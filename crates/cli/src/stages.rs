//! Single stages, each starting from the files of an earlier one.

use std::fmt;
use std::fs;
use std::path::{Component, Path, PathBuf};

use serde_json::{Value, json};
use shellock::certificate::{OtherFile, PieceFile};
use shellock::design::{self, DesignError, Planned, Settings};
use shellock::verify::words::Coordinates;
use shellock::verify::{Assembly, VerifyParams};
use shellock::{Ctx, IdVec, InstallationPlan, PatchId, SegmentedSurface, segmentation};
use shellock_formats::{Selection, write_labels, write_ply, write_stl_binary};
use shellock_geom::repair::{InsideOut, RepairKind};
use shellock_geom::weld::weld;
use shellock_geom::{Solid, TriMesh, Vec3};
use shellock_kit::PlanFile;

use crate::Session;
use crate::args::{Axis, Options};
use crate::bears;
use crate::bed::fitted;
use crate::build::checked;
use crate::failure::Failure;
use crate::input::{self, load, load_selected, read, sha256};
use crate::interrupt::Writing;
use crate::output::{CERTIFICATE, PLAN, certificate_bytes};
use crate::paint::painted;
use crate::place::Standing;
use crate::progress::{Deadline, Display, PlanClock};
use crate::shape::filled_again;
use crate::shares::largest_shares;
use crate::told::{print_input_warnings, print_verdict, print_warnings, quality, weakest};

/// Writes one file, whole or not at all.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let _writing = Writing::begin();
    let parent = path
        .parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(".shellock-");
    // Temporary files are readable by their owner only. This one stays, so it gets the user's usual
    // permissions.
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

/// Runs `shellock segment` and returns the exit code.
pub fn segment(session: &Session, file: &Path, options: &Options, out: &Path) -> Result<u8, Failure> {
    checked(options)?;
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
    let surface = divided(session, &ctx, &model, options)?;
    display.finish();
    let mut notes = model.notes.clone();
    let bytes = match kind.as_str() {
        "ply" => {
            let labels: Vec<i32> = surface.patch_of_face.iter().map(|p| p.number() as i32).collect();
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
    print_input_warnings(session, &model);
    let mut warnings = ctx.into_warnings();
    if session.is_json {
        warnings.splice(0..0, model.warnings.iter().cloned());
    }
    if session.is_json {
        let value = json!({ "status": "done", "out": out, "pieces": surface.n_patches, "notes": notes,
                            "warnings": warnings });
        println!("{value}");
    } else {
        notes.iter().for_each(|n| println!("note: {n}"));
        let standing = Standing::of(options.up, model.solid.mesh());
        print_warnings(session, &warnings, &standing);
        println!("{} pieces, written to {}", surface.n_patches, out.display());
    }
    Ok(0)
}

/// Divides the surface of `model` as the options ask.
pub fn divided(
    session: &Session,
    ctx: &Ctx,
    model: &input::Model,
    options: &Options,
) -> Result<SegmentedSurface, Failure> {
    let settings = Settings::resolve(&fitted(session, &checked(options)?, options, model)?);
    let labels = model.labels.as_deref();
    let surface = segmentation::segment(ctx, &settings.segmentation, &model.solid, labels);
    Ok(surface.map_err(DesignError::from)?)
}

/// Patch with the largest share of each face of the file, from 1; dropped faces get the first patch.
pub fn labels_of_file(model: &input::Model, surface: &SegmentedSurface) -> Vec<u32> {
    labels_of_faces(model.n_file_faces, &model.file_face, surface)
}

fn labels_of_faces(n_file_faces: usize, file_face: &[u32], surface: &SegmentedSurface) -> Vec<u32> {
    let patches = surface.source_face.iter().zip(&surface.patch_of_face).enumerate();
    let parts = patches.map(|(face, (&source, patch))| {
        let area = surface.mesh.face_area(face);
        (file_face[source as usize], patch.number(), area)
    });
    let dropped = PatchId(0).number();
    let most = largest_shares(n_file_faces, parts);
    most.into_iter().map(|label| label.unwrap_or(dropped)).collect()
}

/// Runs `shellock plan` and returns the exit code.
pub fn plan(session: &Session, file: &Path, options: &Options) -> Result<u8, Failure> {
    let model = input::simple_model(session, file, options)?;
    let params = fitted(session, &checked(options)?, options, &model)?;
    let display = Display::new(session.shown);
    let clock = PlanClock::new(options.plan_time);
    let report = |p: shellock::context::Progress<'_>| {
        clock.see(&p);
        display.show(p);
    };
    let is_time_up = || clock.is_up();
    let deadline = Deadline::new(options.time, session.since);
    let seconds_left = || deadline.seconds_left();
    let ctx = Ctx::new(&report, &session.stop)
        .with_time_limit(&is_time_up)
        .with_deadline(&seconds_left);
    print_input_warnings(session, &model);
    let planned = design::plan(&ctx, &params, &model.solid, model.labels.as_deref())
        .inspect_err(|_| display.finish())?;
    display.finish();
    let Planned {
        plan,
        proof,
        mean_cost,
        n_plans,
        holding,
        warnings,
        ..
    } = planned.map_err(|none| Failure::NoPlan {
        told: format!("no plan was found: {}", none.reason),
        is_cut_short: none.is_cut_short,
    })?;
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
    bears::lines(&holding, &standing)
        .iter()
        .for_each(|line| println!("{line}"));
    weakest(&holding, &standing)
        .iter()
        .for_each(|line| println!("{line}"));
    print_warnings(session, &warnings, &standing);
    Ok(0)
}

/// Runs `shellock verify` and returns the exit code: 0 if every check passes, else 1.
pub fn verify(session: &Session, kit: &Path, model: Option<&Path>) -> Result<u8, Failure> {
    let plan = plan_of(kit)?;
    let Kit { files, pieces, order } = pieces_of(kit, &plan)?;
    let solid = model_of(kit, &plan, model)?;
    let press_fits = plan.checked_press_fits().map_err(broken(kit))?;
    plan.check_directions().map_err(broken(kit))?;
    plan.check_clearance().map_err(broken(kit))?;
    let params = VerifyParams {
        clearance_mm: plan.clearance,
        seed: plan.seed,
    };
    let display = Display::new(session.shown);
    let report = |p: shellock::context::Progress<'_>| display.show(p);
    let ctx = Ctx::new(&report, &session.stop);
    let assembly = Assembly {
        model: Some(&solid),
        pieces: &pieces,
        plan: &order,
        press_fits,
    };
    let verdict = shellock::verify(&ctx, &params, &assembly).inspect_err(|_| display.finish())?;
    let claimed = verdict.certificate(files, &params, &assembly);
    let verdict = verdict.verification;
    display.finish();
    if let Some(claimed) = claimed {
        let claimed = claimed
            .with_press_fits(press_fits.to_vec())
            .with_files(certified_files(kit));
        write(&kit.join(CERTIFICATE), &certificate_bytes(&claimed))?;
    }
    let code = u8::from(!verdict.passed());
    if session.is_json {
        println!(
            "{}",
            json!({ "passed": verdict.passed(), "checks": verdict.checks, "findings": verdict.findings,
                    "exit_code": code })
        );
    } else {
        let up = plan.up.and_then(Axis::of);
        match up.map(|up| Standing::of(up, solid.mesh())) {
            Some(standing) => print_verdict(&verdict, &standing),
            None => print_verdict(&verdict, &Coordinates),
        }
    }
    Ok(code)
}

/// Files besides the pieces, with their hashes, as the earlier certificate lists them; empty if there is
/// none. Their contents are not verified again.
fn certified_files(kit: &Path) -> Vec<OtherFile> {
    let earlier = read(&kit.join(CERTIFICATE))
        .ok()
        .and_then(|bytes| serde_json::from_slice::<Value>(&bytes).ok());
    earlier
        .and_then(|c| serde_json::from_value(c["files"].clone()).ok())
        .unwrap_or_default()
}

/// Reads the kit's plan.json.
pub fn plan_of(kit: &Path) -> Result<PlanFile, Failure> {
    PlanFile::read(&read(&kit.join(PLAN))?).map_err(broken(kit))
}

/// Returns a function that turns a problem into an error that names the kit's plan.json.
pub fn broken<E: fmt::Display>(kit: &Path) -> impl Fn(E) -> Failure {
    let path = kit.join(PLAN);
    move |what| Failure::Wrong(format!("{}: {what}", path.display()))
}

/// Reads the solid that a kit was made from, in assembly space, from the file `model` or else from the one
/// that the plan names.
pub fn model_of(kit: &Path, plan: &PlanFile, model: Option<&Path>) -> Result<Solid, Failure> {
    let Some(input) = &plan.input else {
        return Err(broken(kit)(
            "it does not say from which model it was made (\"input\")",
        ));
    };
    let model_path = model.map_or_else(|| PathBuf::from(&input.file), Path::to_owned);
    if model.is_none() && !model_path.exists() {
        return Err(broken(kit)(format!(
            "there is no file {} here, from which it was made; name the model after the kit",
            input.file
        )));
    }
    let selection = Selection {
        object: input.object.clone(),
        plate: input.plate.clone(),
    };
    let (loaded, _) = load_selected(&model_path, &selection)?;
    let repairs: Vec<&str> = input.repairs.iter().map(|r| r.kind.as_str()).collect();
    // The finished kit already answers the question that other files raise: its repairs say what the body
    // means.
    let inside_out = if repairs.contains(&RepairKind::CutOut { volume: 0.0 }.code()) {
        InsideOut::Cut
    } else {
        InsideOut::Unite
    };
    let mode = input::repair_mode(false, input.largest_only);
    let solid = input::repaired(&model_path, &loaded, mode, inside_out)?.solid;
    let t = input.transform;
    let mut mesh = solid.into_mesh();
    for p in &mut mesh.points {
        *p = Vec3::from_array(std::array::from_fn(|r| {
            t[4 * r] * p.x + t[4 * r + 1] * p.y + t[4 * r + 2] * p.z + t[4 * r + 3]
        }));
    }
    let solid = Solid::new(mesh)
        .map_err(|e| broken(kit)(format!("with its transform the model is no solid: {e}")))?;
    filled_again(solid, &repairs).map_err(broken(kit))
}

/// Pieces and order that a plan file names.
pub struct Kit {
    pub files: Vec<PieceFile>,
    pub pieces: IdVec<PatchId, TriMesh>,
    pub order: InstallationPlan,
}

/// Reads the piece files that a plan names, their meshes, and the order.
pub fn pieces_of(kit: &Path, plan: &PlanFile) -> Result<Kit, Failure> {
    let order = plan.order().map_err(broken(kit))?;
    let (mut files, mut meshes) = (Vec::new(), Vec::new());
    for piece in &plan.pieces {
        let (id, broken) = (piece.id, broken(kit));
        let Some(file) = &piece.file else {
            return Err(broken(format!("piece {id} names no file")));
        };
        let is_normal = |c: Component<'_>| matches!(c, Component::Normal(_));
        if !Path::new(file).components().all(is_normal) {
            return Err(broken(format!(
                "piece {id} names \"{file}\", which is no file within the kit"
            )));
        }
        let (loaded, bytes) = load(&kit.join(file))?;
        files.push(PieceFile {
            id,
            file: file.clone(),
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

/// Returns true if both paths have the same name in the same folder.
fn same_file(a: &Path, b: &Path) -> bool {
    let folder = |p: &Path| match p.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => fs::canonicalize(folder).ok(),
        _ => fs::canonicalize(".").ok(),
    };
    a.file_name() == b.file_name() && folder(a) == folder(b)
}

/// Runs `shellock figure` and returns the exit code.
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

    /// Separate triangles, each given as its patch, its triangle of the model, and its area.
    fn surface(parts: &[(u32, u32, f64)]) -> SegmentedSurface {
        let mut mesh = TriMesh::default();
        for (i, (_, _, area)) in parts.iter().enumerate() {
            let (at, z) = (3 * i as u32, i as f64);
            mesh.points.extend([
                Vec3::new(0.0, 0.0, z),
                Vec3::new(2.0 * area, 0.0, z),
                Vec3::new(0.0, 1.0, z),
            ]);
            mesh.triangles.push([at, at + 1, at + 2]);
        }
        SegmentedSurface {
            mesh,
            patch_of_face: parts.iter().map(|part| PatchId(part.0)).collect(),
            source_face: parts.iter().map(|part| part.1).collect(),
            n_patches: 1 + parts.iter().map(|part| part.0 as usize).max().unwrap_or(0),
        }
    }

    #[test]
    fn a_face_of_the_file_has_the_patch_with_most_of_its_area_over_all_its_triangles() {
        // A polygon of triangles 0 to 2: area 5 belongs to patch 0, 3 + 3 to patch 1.
        let polygon = [(0, 0, 5.0), (1, 1, 3.0), (1, 2, 3.0)];
        // A triangle that a seam cuts: the larger part decides, or two parts together.
        let cut = [(2, 3, 1.0), (0, 3, 2.0), (2, 3, 1.5)];
        let surface = surface(&[&polygon[..], &cut].concat());
        let labels = labels_of_faces(3, &[0, 0, 0, 1], &surface);
        assert_eq!(labels, [2, 3, 1], "the last face was dropped");
    }
}

//! Reading and verification of finished kits, from their files.

use std::fmt;
use std::path::{Component, Path, PathBuf};

use serde_json::Value;
use shellock::certificate::{OtherFile, PieceFile};
use shellock::verify::{Assembly, Verification, VerifyParams};
use shellock::{Ctx, IdVec, InstallationPlan, PatchId};
use shellock_formats::Selection;
use shellock_geom::repair::{InsideOut, RepairKind};
use shellock_geom::weld::weld;
use shellock_geom::{Solid, TriMesh, Vec3};
use shellock_kit::PlanFile;

use crate::failure::Failure;
use crate::files::write;
use crate::input::{self, load, load_selection, read, sha256};
use crate::options::Axis;
use crate::output::{CERTIFICATE, PLAN, certificate_bytes};
use crate::place::Standing;
use crate::shape::filled_again;

/// A finished kit, with the model that it was made from.
pub struct Finished {
    folder: PathBuf,
    plan: PlanFile,
    kit: KitOnDisk,
    solid: Solid,
}

impl Finished {
    /// Reads the kit in `folder` and its model: the file `model`, or else the one that the plan names.
    pub fn read(folder: &Path, model: Option<&Path>) -> Result<Self, Failure> {
        let plan = plan_of(folder)?;
        let kit = pieces_of(folder, &plan)?;
        let solid = model_of(folder, &plan, model)?;
        plan.checked_press_fits().map_err(broken(folder))?;
        plan.check_directions().map_err(broken(folder))?;
        plan.check_clearance().map_err(broken(folder))?;
        Ok(Self {
            folder: folder.to_owned(),
            plan,
            kit,
            solid,
        })
    }

    /// Verifies the kit again from its files, and writes its certificate where one can be given.
    pub fn verify(&self, ctx: &Ctx<'_>) -> Result<Verification, Failure> {
        let press_fits = self.plan.checked_press_fits().map_err(broken(&self.folder))?;
        let params = VerifyParams {
            clearance_mm: self.plan.clearance,
            seed: self.plan.seed,
        };
        let assembly = Assembly {
            model: Some(&self.solid),
            pieces: &self.kit.pieces,
            plan: &self.kit.order,
            press_fits,
        };
        let verdict = shellock::verify(ctx, &params, &assembly)?;
        if let Some(claimed) = verdict.certificate(self.kit.files.clone(), &params, &assembly) {
            let claimed = claimed
                .with_press_fits(press_fits.to_vec())
                .with_files(certified_files(&self.folder));
            write(&self.folder.join(CERTIFICATE), &certificate_bytes(&claimed))?;
        }
        Ok(verdict.verification)
    }

    /// Model in upright position, if the plan says which axis pointed up.
    pub fn upright(&self) -> Option<Standing> {
        let up = self.plan.up.and_then(Axis::of)?;
        Some(Standing::of(up, self.solid.mesh()))
    }
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
            "it does not name the model that it was made from (\"input\")",
        ));
    };
    let model_path = model.map_or_else(|| PathBuf::from(&input.file), Path::to_owned);
    if model.is_none() && !model_path.exists() {
        return Err(broken(kit)(format!(
            "the file {} that it was made from is not here; name the model after the kit",
            input.file
        )));
    }
    let selection = Selection {
        object: input.object.clone(),
        plate: input.plate.clone(),
    };
    let (loaded, _) = load_selection(&model_path, &selection)?;
    let repairs: Vec<&str> = input.repairs.iter().map(|r| r.kind.as_str()).collect();
    // The finished kit already answers the question that other files raise: its repairs say what the body
    // means.
    let inside_out = if repairs.contains(&RepairKind::CutOut { volume: 0.0 }.code()) {
        InsideOut::Cut
    } else {
        InsideOut::Unite
    };
    let mode = input::repair_mode(false, input.largest_only);
    let solid = input::repair_mesh(&model_path, &loaded, mode, inside_out)?.solid;
    let t = input.transform;
    let mut mesh = solid.into_mesh();
    for p in &mut mesh.points {
        *p = Vec3::from_array(std::array::from_fn(|r| {
            t[4 * r] * p.x + t[4 * r + 1] * p.y + t[4 * r + 2] * p.z + t[4 * r + 3]
        }));
    }
    let solid = Solid::new(mesh)
        .map_err(|e| broken(kit)(format!("after its transform the model is not a solid: {e}")))?;
    filled_again(solid, &repairs).map_err(broken(kit))
}

/// Pieces and order that a plan file names.
pub struct KitOnDisk {
    /// Files of the pieces.
    pub files: Vec<PieceFile>,
    /// Meshes of the pieces, mm.
    pub pieces: IdVec<PatchId, TriMesh>,
    /// Order and directions of installation.
    pub order: InstallationPlan,
}

/// Reads the piece files that a plan names, their meshes, and the order.
pub fn pieces_of(kit: &Path, plan: &PlanFile) -> Result<KitOnDisk, Failure> {
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
                "piece {id} names \"{file}\", which is not a file in the kit"
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
    Ok(KitOnDisk {
        files,
        pieces: meshes.into_iter().collect(),
        order,
    })
}

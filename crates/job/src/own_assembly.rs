//! Verification of a user's own assembly: a folder of meshes with an `assembly.json` that says how they go
//! together.

use std::path::{Component, Path, PathBuf};

use serde::{Deserialize, Serialize};
use shellock::certificate::PieceFile;
use shellock::verify::{Assembly, Check, Finding, Verification, VerifyParams};
use shellock::{Ctx, Direction, IdVec, InstallationPlan, PatchId};
use shellock_geom::weld::weld;
use shellock_geom::{TriMesh, Vec3};

use crate::failure::Failure;
use crate::files::write;
use crate::input::{load, read, sha256};
use crate::output::{CERTIFICATE, certificate_bytes};

/// Name of the file that says how the pieces go together.
pub const ASSEMBLY: &str = "assembly.json";

/// Example of the file, for error messages.
const HOW: &str = "it looks like { \"clearance\": 0.1, \"pieces\": [{ \"file\": \"first.stl\" }, { \
                   \"file\": \"key.stl\", \"pulled_out_along\": [0, 0, 1] }] }";

/// Contents of the file `assembly.json`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AssemblyFile {
    /// Gap between mating faces, mm.
    clearance: f64,
    /// Pieces in order of installation, first to last; the last is the key.
    pieces: Vec<PieceEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PieceEntry {
    /// Mesh file in the folder, in assembled position, mm.
    file: String,
    /// Direction in which the piece is pulled out again; the first piece needs none.
    #[serde(default)]
    pulled_out_along: Option<[f64; 3]>,
}

/// An assembly of a user, read from its folder.
pub struct OwnAssembly {
    folder: PathBuf,
    files: Vec<PieceFile>,
    pieces: IdVec<PatchId, TriMesh>,
    plan: InstallationPlan,
    clearance_mm: f64,
}

impl OwnAssembly {
    /// Reads the `assembly.json` in a folder, and the meshes that it names.
    pub fn read(folder: &Path) -> Result<Self, Failure> {
        let path = folder.join(ASSEMBLY);
        let wrong = |what: String| Failure::Wrong(format!("{}: {what}", path.display()));
        let told: AssemblyFile =
            serde_json::from_slice(&read(&path)?).map_err(|e| wrong(format!("{e}; {HOW}")))?;
        let ways: Vec<(&str, Option<[f64; 3]>)> = told
            .pieces
            .iter()
            .map(|p| (&p.file[..], p.pulled_out_along))
            .collect();
        let plan = plan(&ways, told.clearance).map_err(wrong)?;
        let (mut files, mut meshes) = (Vec::new(), Vec::new());
        for (i, PieceEntry { file, .. }) in told.pieces.iter().enumerate() {
            if !Path::new(file)
                .components()
                .all(|c| matches!(c, Component::Normal(_)))
            {
                return Err(wrong(format!("\"{file}\" is not a file in the folder")));
            }
            // As paths: "a//b.stl" and, on Windows, "a\\b.stl" are "a/b.stl".
            let is_file = |other: &str| Path::new(other) == Path::new(file);
            let is_taken = told.pieces[..i].iter().any(|other| is_file(&other.file));
            if file.eq_ignore_ascii_case(CERTIFICATE) || is_taken {
                return Err(wrong(format!(
                    "\"{file}\" cannot be a piece: each piece has a file of its own"
                )));
            }
            let (loaded, bytes) = load(&folder.join(file))?;
            if loaded.unit_mm.is_some_and(|mm| mm != 1.0) {
                return Err(wrong(format!("{file} is not in mm: save all pieces in mm")));
            }
            let (file, sha256) = (file.clone(), sha256(&bytes));
            files.push(PieceFile {
                id: i.into(),
                file,
                sha256,
                play: None,
            });
            meshes.push(weld(&loaded.mesh).mesh);
        }
        Ok(Self {
            folder: folder.to_owned(),
            files,
            pieces: meshes.into_iter().collect(),
            plan,
            clearance_mm: told.clearance,
        })
    }

    /// Verifies the assembly, and writes its certificate into the folder where one can be given.
    pub fn verify(&self, ctx: &Ctx<'_>) -> Result<Verification, Failure> {
        let assembly = assembly(&self.pieces, &self.plan);
        let params = params(self.clearance_mm);
        let verdict = shellock::verify(ctx, &params, &assembly)?;
        if let Some(claimed) = verdict.certificate(self.files.clone(), &params, &assembly) {
            write(&self.folder.join(CERTIFICATE), &certificate_bytes(&claimed))?;
        }
        Ok(verdict.verification)
    }
}

/// Plan of the named pieces: their order and directions. Fails if a direction or the clearance, mm, is wrong.
pub fn plan(pieces: &[(&str, Option<[f64; 3]>)], clearance_mm: f64) -> Result<InstallationPlan, String> {
    if !(0.0..=1.0).contains(&clearance_mm) {
        return Err(format!(
            "a clearance of {clearance_mm} mm is not possible; it must be 0 to 1 mm"
        ));
    }
    if pieces.len() < 2 {
        return Err("an assembly needs at least two pieces".to_owned());
    }
    let step = |(i, &(name, along)): (usize, &(&str, Option<[f64; 3]>))| {
        let along = match along {
            Some(along) => Vec3::from_array(along),
            None if i == 0 => Vec3::Z,
            None => {
                return Err(format!(
                    "{name} needs \"pulled_out_along\": the direction in which it is taken out"
                ));
            }
        };
        let way = Direction::of(along)
            .ok_or_else(|| format!("\"pulled_out_along\" of {name} is not a direction"))?;
        Ok((PatchId::from(i), way))
    };
    let steps = pieces.iter().enumerate().map(step).collect::<Result<Vec<_>, _>>();
    steps.map(InstallationPlan::new)
}

/// Assembly of pieces without a model and without press fits.
pub fn assembly<'a>(pieces: &'a IdVec<PatchId, TriMesh>, plan: &'a InstallationPlan) -> Assembly<'a> {
    Assembly {
        model: None,
        pieces,
        plan,
        press_fits: &[],
    }
}

/// Parameters of the verification for a clearance, mm.
pub fn params(clearance_mm: f64) -> VerifyParams {
    VerifyParams {
        clearance_mm,
        seed: 0,
    }
}

/// Verdict in full, for programs.
#[derive(Clone, Debug, Serialize)]
pub struct Judgement {
    /// Checks, each with its figure.
    pub checks: Vec<Check>,
    /// Findings that speak against the assembly.
    pub findings: Vec<Finding>,
    /// True if every check passes.
    pub passed: bool,
}

impl Judgement {
    /// Judgement that a verification comes to.
    pub fn of(found: Verification) -> Self {
        Self {
            passed: found.has_passed(),
            checks: found.checks,
            findings: found.findings,
        }
    }
}

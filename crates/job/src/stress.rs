//! Test of a finished kit by simulation: a punch and a fall.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use shellock::design::{Params, Settings, Thickness};
use shellock::key::Turn;
use shellock::metric::MetricParams;
use shellock::sizes::SizeChoice;
use shellock::stress_test::{Comparison, PunchAt, StressParams, StressReport, chart, stress_test};
use shellock::{Ctx, InstallationPlan, PatchId, SegmentedSurface};
use shellock_geom::check::into_solid;
use shellock_geom::{Solid, Vec3};
use shellock_kit::{PlanFile, PlanFileError};
use shellock_mechanics::Material;

use crate::failure::Failure;
use crate::files::write;
use crate::input::load;
use crate::kits::{broken, plan_of};
use crate::options::{Axis, Word};
use crate::output::PLAN;

/// Place that the punch presses on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The highest place that is wide enough.
    Top,
    /// The highest place above the middle.
    Middle,
}

impl Word for Place {
    fn all() -> Vec<(Self, &'static str, &'static str)> {
        vec![(Self::Top, "top", ""), (Self::Middle, "middle", "")]
    }
}

/// Loads that a finished kit is tested with, and settings of the simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Blows {
    /// Force of the punch, N.
    pub punch_n: f64,
    /// Place that the punch presses on.
    pub at: Place,
    /// Height of the fall, m.
    pub drop_m: f64,
    /// Material of the pieces; that of the kit if `None`.
    pub material: Option<Material>,
    /// Edge of the cells that finished pieces are cut into, mm.
    pub cell_mm: f64,
    /// Length of the edges of the mesh that forces act on, as a share of the usual one.
    pub edge_share: f64,
    /// Axis that points up; that of the kit if `None`.
    pub up: Option<Axis>,
}

/// A finished kit that is ready to be tested.
pub struct StressTest {
    folder: PathBuf,
    /// Order and directions of installation.
    pub order: InstallationPlan,
    /// Surface divided into the pieces.
    pub surface: SegmentedSurface,
    pieces: Vec<Solid>,
    /// Parameters of the test.
    pub params: StressParams,
}

impl StressTest {
    /// Reads the kit in the folder `kit`.
    pub fn read(kit: &Path, blows: &Blows) -> Result<Self, Failure> {
        if !kit.join(PLAN).exists() {
            return Err(Failure::Wrong(format!(
                "{}: there is no kit here, because plan.json is missing; `shellock build` makes one",
                kit.display()
            )));
        }
        let plan = plan_of(kit)?;
        let order = plan.order().map_err(broken(kit))?;
        check_kit(kit, &plan)?;
        let surface = surface_of(&kit.join("segmentation.ply"), order.steps.len())?;
        let params = params_of(&plan, blows).map_err(broken(kit))?;
        let pieces = pieces_of(kit, &plan)?;
        Ok(Self {
            folder: kit.to_owned(),
            order,
            surface,
            pieces,
            params,
        })
    }

    /// Punches the kit and lets it fall. The report contains the comparison with worse plans, if there is
    /// one.
    pub fn run(&self, ctx: &Ctx<'_>, compared: Option<Comparison>) -> Result<StressReport, Failure> {
        let tested = stress_test(
            ctx,
            &self.params,
            &self.surface,
            &self.order,
            &self.pieces,
            compared,
        )?;
        Ok(tested)
    }

    /// Writes the result into the kit's folder, and returns it as JSON.
    pub fn write(&self, tested: &StressReport) -> Result<Value, Failure> {
        let params = &self.params;
        let value = json!({
            "format": "shellock-stress", "version": 2, "punch_n": params.punch_n,
            "punch_at": params.punch_at, "drop_mm": params.drop_mm,
            "material": params.metric.material, "connector_size": params.sizes.largest_mm(),
            "up": params.plan.up, "passed": tested.has_passed(), "report": tested,
        });
        let mut text = serde_json::to_string_pretty(&value).expect("numbers and strings can be written");
        text.push('\n');
        write(&self.folder.join("stress.json"), text.as_bytes())?;
        write(&self.folder.join("stress.svg"), chart(tested).as_bytes())?;
        Ok(value)
    }
}

/// Checks that the plan's directions are valid and that all of the kit's piece files exist.
fn check_kit(kit: &Path, plan: &PlanFile) -> Result<(), Failure> {
    plan.check_directions().map_err(broken(kit))?;
    let mut files = plan.pieces.iter().filter_map(|piece| piece.file.as_ref());
    match files.find(|file| !kit.join(file).is_file()) {
        Some(file) => Err(broken(kit)(format!(
            "names {file}, which is missing; the kit is incomplete"
        ))),
        None => Ok(()),
    }
}

/// Loads the finished pieces, in order of their ids.
fn pieces_of(kit: &Path, plan: &PlanFile) -> Result<Vec<Solid>, Failure> {
    let piece = |(number, file): (usize, Option<&String>)| {
        let missing = || {
            broken(kit)(format!(
                "names no file for piece {number}; the test needs the finished pieces"
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
            .ok_or_else(|| wrong("a face has a label that is not a piece of plan.json"))
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
        let (laid, along) = Turn::align(Vec3::from(key.plane_normal), Vec3::from(key.slide));
        plan_params.key = plan.key_piece;
        (turn, plan_params.key_slide) = (laid, Some(along));
    }
    let built = || plan.strength.as_ref().and_then(|s| s.material);
    let (material, edge_share) = (
        blows.material.or_else(built).unwrap_or_default(),
        blows.edge_share,
    );
    let metric = MetricParams {
        edge_share,
        ..MetricParams::of_plan(&plan_params, &sizes, material)
    };
    let punch_at = match blows.at {
        Place::Top => PunchAt::Top,
        Place::Middle => PunchAt::Middle,
    };
    Ok(StressParams {
        punch_n: blows.punch_n,
        punch_at,
        drop_mm: 1000.0 * blows.drop_m,
        cell_mm: blows.cell_mm,
        metric,
        sizes,
        plan: plan_params,
        turn,
    })
}

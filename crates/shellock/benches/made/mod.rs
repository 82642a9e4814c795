//! Makes a kit stage by stage, as the whole job does if a piece is the key. Used by benchmarks of single
//! stages and tests of the result.

use shellock::body::{PatchDistances, ShellBodies, ShellGrid};
use shellock::connector::{self, Run, is_unobstructed};
use shellock::key::Turn;
use shellock::piece::{self, Connectors, FinishParams, Finished, LabelParams, Relief};
use shellock::plan::{LatticePlan, PlanConstraints, PlanOutcome, search, survey};
use shellock::verify::Assembly;
use shellock::{
    ConnectorSizes, Ctx, IdVec, InstallationPlan, Params, PatchId, SegmentedSurface, Settings, body,
};
use shellock_geom::{Aabb, Solid};

/// A kit with all the data from which it was made.
pub struct Made {
    pub settings: Settings,
    pub sizes: ConnectorSizes,
    pub surface: SegmentedSurface,
    /// Plan as the search found it.
    pub lattice_plan: LatticePlan,
    /// Plan in the form that the verification takes.
    pub plan: InstallationPlan,
    pub grid: ShellGrid,
    pub distances: PatchDistances,
    pub shell: ShellBodies,
    pub runs: Vec<Run>,
    pub pieces: Finished,
}

impl Made {
    /// Makes pieces by the first plan of `surface`.
    pub fn new(model: &Solid, surface: SegmentedSurface) -> Self {
        let ctx = &Ctx::quiet();
        let settings = Settings::resolve(&Params::default());
        let sizes = ConnectorSizes::default();
        let seams = surface.seams();
        let tables = survey(ctx, &settings.plan, &surface, &seams, &sizes).expect("not stopped");
        let none = PlanConstraints::default();
        let PlanOutcome::Found(found) = search(ctx, &settings.plan, &tables, &none).expect("not stopped")
        else {
            panic!("there is no plan");
        };
        let plan = found.plan;
        let room_mm = settings.connector.room_mm(sizes.largest_mm());
        let grid = ShellGrid::new(&settings.body, model, room_mm).expect("there is a cavity");
        let distances = PatchDistances::measure(&grid, &surface);
        let shell = split(&settings, &surface, &sizes, &grid, &distances, &plan);
        let runs = runs(&settings, &sizes, &grid, &shell, &plan);
        let pieces = finish(&settings, &surface, &sizes, &grid, &shell, &plan, &runs);
        let judged = InstallationPlan::new(plan.steps.iter().map(|s| (s.piece, s.separation.into())));
        Self {
            settings,
            sizes,
            surface,
            lattice_plan: plan,
            plan: judged,
            grid,
            distances,
            shell,
            runs,
            pieces,
        }
    }

    /// Assembly of the pieces, for the verification.
    pub fn assembly<'a>(&'a self, model: &'a Solid) -> Assembly<'a> {
        Assembly {
            model: Some(model),
            pieces: &self.pieces.meshes,
            plan: &self.plan,
            press_fits: &self.pieces.press_fits,
        }
    }
}

/// Bounding box of each piece's body, around its patch.
fn rooms(settings: &Settings, surface: &SegmentedSurface, sizes: &ConnectorSizes) -> IdVec<PatchId, Aabb> {
    let mut rooms: IdVec<PatchId, Aabb> = IdVec::from_fn(surface.n_patches, |_| Aabb::EMPTY);
    for (face, &p) in surface.patch_of_face.iter().enumerate() {
        rooms[p] = rooms[p].union(Aabb::around(surface.mesh.corners(face)));
    }
    let reach_mm = settings.body.thickness_mm + settings.connector.room_mm(sizes.largest_mm()) + 2.0;
    rooms.as_slice().iter().map(|r| r.grown(reach_mm)).collect()
}

/// Splits the wall along the plan.
pub fn split(
    settings: &Settings,
    surface: &SegmentedSurface,
    sizes: &ConnectorSizes,
    grid: &ShellGrid,
    distances: &PatchDistances,
    plan: &LatticePlan,
) -> ShellBodies {
    let rooms = rooms(settings, surface, sizes);
    body::build(&Ctx::quiet(), &settings.body, grid, distances, plan, &rooms).expect("pieces leave freely")
}

/// Connectors under the plan's seams.
pub fn runs(
    settings: &Settings,
    sizes: &ConnectorSizes,
    grid: &ShellGrid,
    shell: &ShellBodies,
    plan: &LatticePlan,
) -> Vec<Run> {
    let inner = shell.inner.as_ref().expect("there is a cavity");
    let curves = connector::curves(grid, inner, plan);
    let is_free = is_unobstructed(&settings.connector, grid, shell);
    connector::runs(&settings.connector, sizes, plan, &curves, None, &is_free).0
}

/// Carves and joins the pieces, and engraves their numbers.
pub fn finish(
    settings: &Settings,
    surface: &SegmentedSurface,
    sizes: &ConnectorSizes,
    grid: &ShellGrid,
    shell: &ShellBodies,
    plan: &LatticePlan,
    runs: &[Run],
) -> Finished {
    let gap_mm = settings
        .connector
        .clearance_mm
        .min(2.0 * settings.body.seam_gap_mm);
    let params = FinishParams {
        connector: &settings.connector,
        relief: Relief {
            gap_mm,
            key_gap_mm: gap_mm,
        },
        rim_mm: settings.body.rim_mm,
        grip: None,
        label: Some(LabelParams::default()),
        turn: Turn::default(),
    };
    let rooms = rooms(settings, surface, sizes);
    let ctx = Ctx::quiet();
    let connectors = Connectors::carve(&ctx, &settings.connector, grid, shell, plan, runs, &rooms);
    let connectors = connectors.expect("nobody stops it");
    piece::make(&ctx, &params, grid, shell, plan, &connectors).expect("pieces can be written")
}

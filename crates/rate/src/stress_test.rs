//! Stress test of the assembled pieces by a punch on top and a fall (Sect. 7, Fig. 15), compared with worse
//! designs.
//!
//! The test is of the pieces as printed (`printed`): the finished meshes with their gaps, without friction
//! and with some. Punch: the force presses on the surface that faces upwards within [`PUNCH_RADIUS_MM`] of
//! the top, or of the highest place in the middle; the points on the table are held. Fall: the model lands on
//! its feet and is stopped within 1/300 s (Sect. 4.3); the floor pushes with `M v / Δt` on the points that
//! touch it, and inertia balances the force.
//!
//! Worse designs have no finished pieces. The crate `shellock-volume` compares the kit's plan with them.
//!
//! Limits: static and linear; the fall is upright.

mod chart;
mod printed;
#[cfg(test)]
mod tests;

pub use chart::chart;
pub use printed::FRICTION;

use serde::{Deserialize, Serialize};
use shellock_assembly::{InstallationPlan, InstallationStep, LatticeDirection};
use shellock_geom::sparse::SparseError;
use shellock_geom::{Solid, Vec3};
use shellock_mechanics::solid::{SolidError, SolidParams};
use shellock_mechanics::{Meeting, ShellAssembly};
use shellock_plan::sizes::ConnectorSizes;
use shellock_plan::{LatticePlan, PlanParams};
use shellock_report::{Cancelled, Ctx, PatchId};
use shellock_surface::{SegmentedSurface, Turn};

use crate::handling::region::{highest, highest_in_the_middle};
use crate::handling::{self, Handling, OPEN_SIZES};
use crate::metric::{MetricParams, PlanModel};

/// Radius of the fist, mm.
pub const PUNCH_RADIUS_MM: f64 = 10.0;

/// Opening up to which a seam with connectors of that size holds, mm.
pub fn limit_mm(connector_mm: f64) -> f64 {
    OPEN_SIZES * connector_mm
}

/// Size of the largest connectors, mm; 0 where there are none.
pub fn largest_mm(meetings: &[Meeting]) -> f64 {
    meetings
        .iter()
        .filter_map(|m| m.joint)
        .map(|joint| joint.size_mm)
        .fold(0.0, f64::max)
}

/// The point that the punch hits; `None` on an empty surface.
pub fn hit(params: &StressParams, assembly: &ShellAssembly) -> Option<usize> {
    let up = Vec3::from_array(params.plan.up).normalize_or(Vec3::Z);
    match params.punch_at {
        PunchAt::Top => {
            let handling = Handling::new(params.plan.up, params.metric.wall_mm, params.metric.material);
            handling::top(&handling, assembly).or_else(|| highest(assembly, up))
        }
        PunchAt::Middle => highest_in_the_middle(assembly, up, PUNCH_RADIUS_MM),
    }
}

/// Returns true if any connector has opened too far.
pub fn is_open(opening_mm: &[f64], meetings: &[Meeting]) -> bool {
    meetings
        .iter()
        .zip(opening_mm)
        .any(|(m, d)| m.joint.is_some_and(|joint| *d >= limit_mm(joint.size_mm)))
}

/// Place where the punch lands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PunchAt {
    /// The highest place that is wide enough and above the feet, as kits are made for; the highest point
    /// where there is none.
    #[default]
    Top,
    /// The highest place above the middle of the surface.
    Middle,
}

/// Loads of the test, and properties of the pieces.
#[derive(Clone, Debug, PartialEq)]
pub struct StressParams {
    /// Force on the top, N. (0, 10⁵]; 70, as in the paper.
    pub punch_n: f64,
    /// Place that the punch presses on; the top by default.
    pub punch_at: PunchAt,
    /// Height of the fall, mm. (0, 10⁵]; 2000, as in the paper.
    pub drop_mm: f64,
    /// Edge of the cells that finished pieces are cut into, mm. [0.5, 20]; 2.5.
    pub cell_mm: f64,
    /// Walls, connectors and material.
    pub metric: MetricParams,
    /// Connector sizes of each pair of pieces.
    pub sizes: ConnectorSizes,
    /// Parameters of drawing plans; `up` is the direction of the top.
    pub plan: PlanParams,
    /// Rotation of the model by which the pieces' ways out become lattice directions, as those of drawn plans
    /// are.
    pub turn: Turn,
}

impl Default for StressParams {
    fn default() -> Self {
        Self {
            punch_n: 70.0,
            punch_at: PunchAt::default(),
            drop_mm: 2000.0,
            cell_mm: SolidParams::default().cell_mm,
            metric: MetricParams::default(),
            sizes: ConnectorSizes::default(),
            plan: PlanParams::default(),
            turn: Turn::default(),
        }
    }
}

impl StressParams {
    /// Lists every problem of the parameters.
    pub fn problems(&self) -> Vec<String> {
        let mut problems = self.plan.problems();
        problems.extend(self.metric.problems().iter().map(ToString::to_string));
        if !(0.5..=20.0).contains(&self.cell_mm) {
            problems.push(format!(
                "cells are {} mm; they must be from 0.5 to 20 mm",
                self.cell_mm
            ));
        }
        for (name, value) in [
            ("the punch", self.punch_n),
            ("the height of the fall", self.drop_mm),
        ] {
            if !(value > 0.0 && value <= 1e5) {
                problems.push(format!(
                    "{name} is {value}; it must be more than 0 and at most 100 000 N or mm"
                ));
            }
        }
        problems
    }
}

/// Verdict of a test, from best to worst.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StressVerdict {
    /// Seams stay closed, and the stress is within the strength.
    Holds,
    /// A seam opens by [0.3, 0.6) connector sizes.
    Opens,
    /// The stress in walls or connectors exceeds the strength of the material.
    Yields,
    /// A pin leaves its channel, or nothing stops some piece.
    ComesApart,
}

/// Result of one test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Verdict of the test.
    pub verdict: StressVerdict,
    /// Force on the model, N.
    pub force_n: f64,
    /// The widest opening, mm; infinite (`null`) where nothing stops some piece.
    pub opening_mm: f64,
    /// Part of the opening that is play, mm: the opening under a hundredth of the force; 0 where there are no
    /// gaps.
    pub play_mm: f64,
    /// Distance by which the key slides out on its way, where only friction or a detent holds it, mm; no part
    /// of the opening. 0 by the model without gaps, which holds the key fast.
    pub key_slides_mm: f64,
    /// Opening up to which the connectors at the widest place hold, mm.
    pub limit_mm: f64,
    /// The two pieces at the widest opening.
    pub between: Option<[PatchId; 2]>,
    /// Place of the widest opening, mm in assembly space.
    pub at: Option<[f64; 3]>,
    /// Number of joints whose pins have left their channels.
    pub n_lost: usize,
    /// Stress that all but 0.5 % of the walls' volume stays under, MPa (von Mises).
    pub wall_mpa: f64,
    /// Stress that all but 0.5 % of the volume of pins and channels stays under, MPa (von Mises).
    pub connector_mpa: f64,
    /// Largest stress anywhere, MPa, which grows with the fineness of the mesh.
    pub peak_mpa: f64,
    /// Ratio of the larger of wall and connector stress to the strength.
    pub strength_share: f64,
}

/// Both tests of one design without gaps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pair {
    /// Result of the punch on the top.
    pub punch: Outcome,
    /// Result of the fall onto the feet.
    pub drop: Outcome,
    /// Score of the plan: its least load factor in use; higher is better. `None` for half connectors, whose
    /// plan is the kit's.
    pub score: Option<f64>,
    /// Size of the largest connectors, mm.
    pub connector_mm: f64,
}

/// Both tests of the finished pieces, at one friction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Printed {
    /// Coefficient of friction between pieces.
    pub friction: f64,
    /// Result of the punch on the top.
    pub punch: Outcome,
    /// Result of the fall onto the feet.
    pub drop: Outcome,
}

/// Tests of the kit's plan and of two designs that ought to be worse, by the model of walls and connectors
/// without gaps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Tests of the kit's plan.
    pub kit: Pair,
    /// Tests with connectors of half the size.
    pub half_connectors: Pair,
    /// Tests of the drawn plan whose score is nearest to half the kit's, by ratio; `None` if none of them
    /// holds at all.
    pub half_score: Option<Pair>,
}

impl Comparison {
    /// Designs with their names, the kit's first.
    pub fn designs(&self) -> Vec<(&'static str, &Pair)> {
        let mut all = vec![
            ("kit's plan", &self.kit),
            ("half connectors", &self.half_connectors),
        ];
        all.extend(self.half_score.iter().map(|pair| ("half score", pair)));
        all
    }
}

/// All tests of a kit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StressReport {
    /// Tests of the finished pieces, with each friction of [`FRICTION`].
    pub printed: Vec<Printed>,
    /// Tests of worse designs, if requested.
    pub compared: Option<Comparison>,
    /// Mass of the pieces, g.
    pub mass_g: f64,
    /// Strength of the material, MPa.
    pub strength_mpa: f64,
}

impl StressReport {
    /// Returns true if the finished pieces hold in both tests, at every friction.
    pub fn has_passed(&self) -> bool {
        self.printed
            .iter()
            .flat_map(|printed| [&printed.punch, &printed.drop])
            .all(|o| o.verdict == StressVerdict::Holds)
    }

    /// Name, punch and fall of everything tested, the finished pieces first.
    pub fn rows(&self) -> Vec<(String, &Outcome, &Outcome)> {
        let printed = self.printed.iter();
        let mut rows: Vec<_> = printed
            .map(|p| (format!("printed, μ {}", p.friction), &p.punch, &p.drop))
            .collect();
        let designs = self.compared.iter().flat_map(Comparison::designs);
        rows.extend(designs.map(|(name, pair)| (name.to_owned(), &pair.punch, &pair.drop)));
        rows
    }
}

/// Reason why the tests could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StressError {
    /// Some parameters are out of range.
    #[error("{}", .0.join("; "))]
    Params(Vec<String>),
    /// The plan belongs to another surface.
    #[error("the plan has {steps} pieces, the surface {patches}: they do not belong together")]
    Plan {
        /// Steps of the plan.
        steps: usize,
        /// Patches of the surface.
        patches: usize,
    },
    /// The number of finished pieces differs from that of patches.
    #[error("{pieces} finished pieces of a surface of {patches}: they do not belong together")]
    Pieces {
        /// Number of pieces given.
        pieces: usize,
        /// Patches of the surface.
        patches: usize,
    },
    /// The model's surface has no volume.
    #[error("the surface of the segmentation is not one closed body")]
    NotClosed,
    /// The simulation of finished pieces failed.
    #[error("the simulation of the finished pieces failed: {0}")]
    Finished(#[from] SolidError),
    /// A way out is none of the 26 directions, once the model is rotated.
    #[error("piece {0} leaves along a direction that no plan of this program has")]
    Direction(PatchId),
    /// The surface metric failed.
    #[error("the surface metric failed: {0}")]
    Surface(#[from] SparseError),
    /// The user asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Subject of a stress test, rotated so that all ways out are lattice directions.
pub struct TestSubject {
    /// Parameters with the up direction of the rotated model.
    pub params: StressParams,
    /// Surface of the rotated model.
    pub surface: SegmentedSurface,
    /// Plan with the directions of the rotated model.
    pub plan: LatticePlan,
}

impl TestSubject {
    /// Rotates `surface` and `plan` by the turn of `params`.
    ///
    /// # Errors
    /// Some parameters are out of range, the plan belongs to another surface, or a way out is no lattice
    /// direction.
    pub fn new(
        params: &StressParams,
        surface: &SegmentedSurface,
        plan: &InstallationPlan,
    ) -> Result<Self, StressError> {
        check(params, surface, plan)?;
        let plan = lattice_plan(params, plan)?;
        let mut params = params.clone();
        params.plan.up = params.turn.apply(Vec3::from(params.plan.up)).to_array();
        let mesh = params.turn.mesh(&surface.mesh);
        Ok(Self {
            surface: SegmentedSurface {
                mesh,
                ..surface.clone()
            },
            params,
            plan,
        })
    }
}

/// The plan with the directions of the rotated model.
fn lattice_plan(params: &StressParams, plan: &InstallationPlan) -> Result<LatticePlan, StressError> {
    /// Greatest angle to a lattice direction, degrees, within which a direction counts as it.
    const MOST_OFF_DEG: f64 = 1.0;
    let step = |step: &InstallationStep| {
        let out = params.turn.apply(step.separation.unit());
        let nearest = LatticeDirection::nearest(out);
        let is_it = nearest.unit().dot(out) >= MOST_OFF_DEG.to_radians().cos();
        is_it
            .then_some((step.piece, nearest))
            .ok_or(StressError::Direction(step.piece))
    };
    // The first piece does not move, so its direction does not matter.
    let first = plan
        .steps
        .first()
        .map(|first| Ok((first.piece, LatticeDirection::nearest(Vec3::Z))));
    let others = plan.steps.iter().skip(1).map(step);
    let steps: Result<Vec<_>, _> = first.into_iter().chain(others).collect();
    steps.map(LatticePlan::new)
}

/// Tests the finished `pieces`, one for each patch of `surface`, in their assembled places; `plan` joins
/// them. Takes 10 to 60 s for kits of 10 pieces.
///
/// `compared` is the comparison with worse designs, for the report; see the crate `shellock-volume`.
pub fn stress_test(
    ctx: &Ctx<'_>,
    params: &StressParams,
    surface: &SegmentedSurface,
    plan: &InstallationPlan,
    pieces: &[Solid],
    compared: Option<Comparison>,
) -> Result<StressReport, StressError> {
    let TestSubject {
        params,
        surface,
        plan,
    } = &TestSubject::new(params, surface, plan)?;
    if pieces.len() != surface.n_patches {
        return Err(StressError::Pieces {
            pieces: pieces.len(),
            patches: surface.n_patches,
        });
    }
    let turn = params.turn;
    let pieces: Vec<Solid> = pieces
        .iter()
        .map(|piece| turn.solid(piece).map_err(|_| StressError::NotClosed))
        .collect::<Result<_, _>>()?;
    ctx.stage("finished pieces", 0)?;
    let model = PlanModel::new(&params.metric, surface, &params.sizes);
    let meetings = model.meetings(plan);
    let mut bench = printed::TestRig::new(ctx, params, surface, &model, plan, &meetings, &pieces)?;
    let mut tested = Vec::new();
    for friction in FRICTION {
        ctx.stage(&format!("stress test with friction {friction}"), 0)?;
        tested.push(Printed {
            friction,
            punch: bench.punch(ctx, friction)?,
            drop: bench.drop(ctx, friction)?,
        });
    }
    Ok(StressReport {
        printed: tested,
        compared,
        mass_g: bench.mass_t() * 1e6,
        strength_mpa: params.metric.material.strength_mpa,
    })
}

fn check(
    params: &StressParams,
    surface: &SegmentedSurface,
    plan: &InstallationPlan,
) -> Result<(), StressError> {
    let problems = params.problems();
    if !problems.is_empty() {
        return Err(StressError::Params(problems));
    }
    if plan.steps.len() != surface.n_patches {
        return Err(StressError::Plan {
            steps: plan.steps.len(),
            patches: surface.n_patches,
        });
    }
    Ok(())
}

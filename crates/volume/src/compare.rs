//! Stress tests of worse designs, which have no finished pieces: walls and connectors of tetrahedra with
//! contact, made from surface and plan.
//!
//! For a fair comparison the kit's own plan is tested so, too: without gaps, without friction except at the
//! key, with connectors wherever the plan has room.

#[cfg(test)]
mod tests;

use shellock_assembly::InstallationPlan;
use shellock_geom::Vec3;
use shellock_geom::sparse::SparseError;
use shellock_mechanics::{Joint, Meeting, StressLevel};
use shellock_plan::{LatticePlan, random_plans, survey};
use shellock_rate::handling::region::{around, lowest, spread};
use shellock_rate::handling::{Borne, Failure, Handling};
use shellock_rate::impact::impact_n;
use shellock_rate::metric::{self, MetricParams, PlanModel};
use shellock_rate::stress_test::{
    Comparison, Outcome, PUNCH_RADIUS_MM, Pair, StressError, StressParams, StressVerdict, TestSubject, hit,
    is_open, largest_mm, limit_mm,
};
use shellock_report::{Cancelled, Ctx};
use shellock_surface::SegmentedSurface;

use crate::{Loaded, VolumeError, VolumeModel, VolumeParams};

/// Reasons why worse designs could not be tested.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CompareError {
    /// Parameters or plan are wrong, or the surface metric failed.
    #[error(transparent)]
    Test(#[from] StressError),
    /// The simulation of walls and connectors failed.
    #[error("the simulation failed: {0}")]
    Volume(#[from] VolumeError),
}

impl From<SparseError> for CompareError {
    fn from(error: SparseError) -> Self {
        Self::Test(error.into())
    }
}

impl From<Cancelled> for CompareError {
    fn from(cancelled: Cancelled) -> Self {
        Self::Test(cancelled.into())
    }
}

/// Creates the solver of the volume metric for the surface of `model`.
///
/// # Errors
/// No wall can be built on the surface.
pub fn volume_model(model: &PlanModel) -> Result<VolumeModel, VolumeError> {
    let MetricParams {
        wall_mm, material, ..
    } = model.params;
    let params = VolumeParams {
        wall_mm,
        material,
        ..VolumeParams::default()
    };
    VolumeModel::new(&params, &model.assembly)
}

/// Load factor by the solid model, where walls can yield, too. The station at which walls or pins yield is
/// not known, so the station that opens most is reported. Factor 0 where `loaded` is `None`: parts come
/// apart.
pub fn borne_by_solids(plan: &[Meeting], loaded: Option<&Loaded>, strength_mpa: f64) -> Borne {
    let Some(loaded) = loaded else {
        return Borne {
            factor: 0.0,
            first: None,
        };
    };
    let opened = Borne::ANY.opening(plan, &loaded.opening_mm);
    let station = opened.first.map_or(0, |f| f.1);
    opened
        .and(
            strength_mpa / loaded.connectors.robust_mpa,
            Failure::PinYields,
            station,
        )
        .and(
            strength_mpa / loaded.walls.robust_mpa,
            Failure::WallYields,
            station,
        )
}

/// Number of random plans among which one of half the score is looked for.
const N_DRAWN: usize = 100;

/// The meeting with a connector of half the size.
fn with_half_the_size(meeting: &Meeting) -> Meeting {
    let half = |joint: Joint| Joint {
        size_mm: joint.size_mm / 2.0,
        ..joint
    };
    Meeting {
        joint: meeting.joint.map(half),
        ..*meeting
    }
}

/// Tests walls and connectors of `surface` under `plan`, with connectors of half the size, and under a plan
/// of half the score. All are made anew, without gaps.
pub fn compare(
    ctx: &Ctx<'_>,
    params: &StressParams,
    surface: &SegmentedSurface,
    plan: &InstallationPlan,
) -> Result<Comparison, CompareError> {
    let TestSubject {
        params,
        surface,
        plan,
    } = &TestSubject::new(params, surface, plan)?;
    ctx.stage("a plan of half the score", 0)?;
    let model = sound_model(ctx, params, surface)?;
    let handling = Handling::new(params.plan.up, params.metric.wall_mm, params.metric.material);
    let loads = metric::Bench::new(&handling, &model)?;
    let score = loads.least_use(plan)?;
    let worse = half_as_good(ctx, params, surface, &loads, score)?;

    let meetings = model.meetings(plan);
    ctx.stage("comparison: the kit's plan", 0)?;
    let bench = Bench::new(params, &model)?;
    let kit = bench.test(&meetings, Some(score))?;
    ctx.stage("comparison: half the score", 0)?;
    let half_score = worse
        .map(|(plan, score)| bench.test(&model.meetings(&plan), Some(score)))
        .transpose()?;
    ctx.stage("comparison: half connectors", 0)?;
    let half_connectors = bench.test(&meetings.iter().map(with_half_the_size).collect::<Vec<_>>(), None)?;
    Ok(Comparison {
        kit,
        half_connectors,
        half_score,
    })
}

/// Edge lengths to try, as shares of the requested one. Where a coarse mesh folds so that no wall can be
/// built on it, a somewhat finer or coarser mesh usually does not.
const EDGE_SHARES: [f64; 6] = [1.0, 0.9, 0.8, 1.1, 0.7, 1.25];

/// The model on that of these meshes on which walls leave out the fewest triangles; the first of several.
fn sound_model(
    ctx: &Ctx<'_>,
    params: &StressParams,
    surface: &SegmentedSurface,
) -> Result<PlanModel, CompareError> {
    let mut failure = None;
    let mut best: Option<(usize, f64, PlanModel)> = None;
    for share in EDGE_SHARES {
        let model = PlanModel::new(
            &MetricParams {
                edge_share: share * params.metric.edge_share,
                ..params.metric
            },
            surface,
            &params.sizes,
        );
        match volume_model(&model) {
            Err(e @ VolumeError::FlatTriangle(_)) => failure = failure.or(Some(e)),
            Err(e) => return Err(e.into()),
            Ok(walls) => {
                let n_left_out = walls.wall().n_left_out;
                if best.as_ref().is_none_or(|(least, ..)| n_left_out < *least) {
                    best = Some((n_left_out, share, model));
                }
                if n_left_out == 0 {
                    break;
                }
            }
        }
    }
    let Some((n_left_out, share, model)) = best else {
        return Err(failure.map_or(VolumeError::Contact, |e| e).into());
    };
    if share != 1.0 {
        ctx.note(&format!(
            "the mesh folds; its edges are made {share} times as long as asked for"
        ));
    }
    if n_left_out > 0 {
        let n_all = model.assembly.triangles.len();
        ctx.note(&format!(
            "no wall fits below {n_left_out} of {n_all} triangles, which lie in creases; they are left out"
        ));
    }
    Ok(model)
}

/// The drawn plan whose least load factor is nearest, by ratio, to half of `score`, with that factor.
fn half_as_good(
    ctx: &Ctx<'_>,
    params: &StressParams,
    surface: &SegmentedSurface,
    loads: &metric::Bench<'_>,
    score: f64,
) -> Result<Option<(LatticePlan, f64)>, CompareError> {
    let survey = survey(ctx, &params.plan, surface, &surface.seams(), &params.sizes)?;
    let mut best: Option<(f64, LatticePlan, f64)> = None;
    for plan in random_plans(&params.plan, &survey, N_DRAWN) {
        ctx.check()?;
        let own = loads.least_use(&plan)?;
        let distance = (own / (0.5 * score)).ln().abs();
        if distance.is_finite() && best.as_ref().is_none_or(|b| distance < b.0) {
            best = Some((distance, plan, own));
        }
    }
    Ok(best.map(|(_, plan, own)| (plan, own)))
}

/// The pieces of one design, standing and falling.
struct Bench<'a> {
    params: &'a StressParams,
    model: &'a PlanModel,
    /// Solver with the model held where it stands.
    at_rest: VolumeModel,
    /// Solver with the model held nowhere.
    free: VolumeModel,
}

impl<'a> Bench<'a> {
    pub fn new(params: &'a StressParams, model: &'a PlanModel) -> Result<Self, VolumeError> {
        let (wall_mm, material) = (params.metric.wall_mm, params.metric.material);
        let volume = VolumeParams {
            wall_mm,
            material,
            ..VolumeParams::default()
        };
        let held = lowest(&model.assembly, Vec3::from_array(params.plan.up));
        let at_rest = VolumeModel::with_clamp(&volume, &model.assembly, &held)?;
        let free = VolumeModel::new(&volume, &model.assembly)?;
        Ok(Self {
            params,
            model,
            at_rest,
            free,
        })
    }

    pub fn test(&self, meetings: &[Meeting], score: Option<f64>) -> Result<Pair, VolumeError> {
        let up = Vec3::from_array(self.params.plan.up).normalize_or(Vec3::Z);
        let assembly = &self.model.assembly;
        let fist = hit(self.params, assembly)
            .map_or_else(Vec::new, |hit| around(assembly, up, hit, PUNCH_RADIUS_MM));
        let punch = spread(assembly, &fist, -up * self.params.punch_n);
        let impact_n = impact_n(self.free.mass_t(), self.params.drop_mm);
        let impact = spread(assembly, &lowest(assembly, up), up * impact_n);
        let punched = self.at_rest.under_load(meetings, &punch)?;
        let fallen = self.free.under_load(meetings, &impact)?;
        Ok(Pair {
            punch: self.outcome(punched, meetings, self.params.punch_n),
            drop: self.outcome(fallen, meetings, impact_n),
            score,
            connector_mm: largest_mm(meetings),
        })
    }

    fn outcome(&self, loaded: Result<Loaded, Vec<u32>>, meetings: &[Meeting], force_n: f64) -> Outcome {
        let strength_mpa = self.params.metric.material.strength_mpa;
        let loaded = loaded.unwrap_or_else(|parts| Loaded {
            opening_mm: self.openings_of(&parts),
            lost: Vec::new(),
            walls: StressLevel::default(),
            connectors: StressLevel::default(),
            triangle_mpa: Vec::new(),
            imbalance: 0.0,
        });
        let widest = (0..loaded.opening_mm.len())
            .max_by(|a, b| loaded.opening_mm[*a].total_cmp(&loaded.opening_mm[*b]));
        let opening_mm = widest.map_or(0.0, |i| loaded.opening_mm[i]);
        let strength_share = loaded.walls.robust_mpa.max(loaded.connectors.robust_mpa) / strength_mpa;
        let verdict = if !loaded.lost.is_empty() || opening_mm.is_infinite() {
            StressVerdict::ComesApart
        } else if strength_share > 1.0 {
            StressVerdict::Yields
        } else if is_open(&loaded.opening_mm, meetings) {
            StressVerdict::Opens
        } else {
            StressVerdict::Holds
        };
        Outcome {
            verdict,
            force_n,
            opening_mm,
            play_mm: 0.0,
            key_slides_mm: 0.0,
            limit_mm: limit_mm(
                widest
                    .and_then(|i| meetings[i].joint)
                    .map_or(largest_mm(meetings), |j| j.size_mm),
            ),
            between: widest.map(|i| self.model.pieces_at(i)),
            at: widest.map(|i| {
                self.params
                    .turn
                    .inverse()
                    .apply(self.model.place_of(i))
                    .to_array()
            }),
            n_lost: loaded.lost.len(),
            wall_mpa: loaded.walls.robust_mpa,
            connector_mpa: loaded.connectors.robust_mpa,
            peak_mpa: loaded.walls.largest_mpa.max(loaded.connectors.largest_mpa),
            strength_share,
        }
    }

    /// Openings at all stations: infinite at those of `parts`, which come apart, and 0 elsewhere.
    fn openings_of(&self, parts: &[u32]) -> Vec<f64> {
        let is_loose = |i: usize| {
            self.model
                .pieces_at(i)
                .iter()
                .any(|piece| parts.contains(&piece.0))
        };
        (0..self.model.assembly.stations.len())
            .map(|i| if is_loose(i) { f64::INFINITY } else { 0.0 })
            .collect()
    }
}

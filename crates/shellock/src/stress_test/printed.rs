//! The tests of the pieces as they are printed: their finished meshes, with the gaps that these have.

use std::ops::Range;

use shellock_geom::signed_distance::SignedDistance;
use shellock_geom::{Solid, Vec3};
use shellock_mechanics::connector::PIN_DEPTH;
use shellock_mechanics::solid::{Answer, Hold, Moved, Push, SolidError, SolidModel, SolidParams, Spot};
use shellock_mechanics::{Meeting, StressLevel};

use super::{
    Outcome, PUNCH_RADIUS_MM, StressError, StressParams, StressVerdict, hit, is_open, largest_mm, limit_mm,
};
use crate::handling::region::{around, lowest, spread};
use crate::impact::impact_n;
use crate::metric::PlanModel;
use crate::{Ctx, SegmentedSurface};

/// Coefficients of friction: none, and little for printed plastic on itself. What is between holds between.
pub const FRICTION: [f64; 2] = [0.0, 0.2];
/// What is deeper than the wall by this is connector, mm.
const BELOW_WALL_MM: f64 = 0.15;

/// The pieces, standing and falling.
pub(super) struct Bench<'a> {
    params: &'a StressParams,
    model: &'a PlanModel,
    meetings: &'a [Meeting],
    solid: SolidModel,
    /// Root and tip of each station's pin, on either piece.
    places: Vec<Vec<[Spot; 2]>>,
}

impl<'a> Bench<'a> {
    pub fn new(
        ctx: &Ctx<'_>,
        params: &'a StressParams,
        surface: &SegmentedSurface,
        model: &'a PlanModel,
        meetings: &'a [Meeting],
        pieces: &[Solid],
    ) -> Result<Self, StressError> {
        let up = Vec3::from_array(params.plan.up).normalize_or(Vec3::Z);
        let assembly = &model.assembly;
        let areas_mm2 = assembly.point_areas_mm2();
        let held: Vec<Hold> = lowest(assembly, up)
            .into_iter()
            .map(|point| Hold {
                part: assembly.part_of_point[point as usize],
                at: assembly.points[point as usize],
                area_mm2: areas_mm2[point as usize],
            })
            .collect();
        let outside = Solid::new(surface.mesh.clone()).map_err(|_| StressError::NotClosed)?;
        let depth = SignedDistance::new(&outside);
        let wall_mm = params.metric.wall_mm + BELOW_WALL_MM;
        let solid = SolidModel::new(
            &SolidParams {
                cell_mm: params.cell_mm,
                material: params.metric.material,
                ..SolidParams::default()
            },
            pieces,
            &held,
            &|p| depth.at(p, wall_mm).is_none(),
            &|| ctx.check().is_err(),
        )
        .map_err(|e| stopped(ctx, e))?;
        let places = (0..meetings.len())
            .map(|i| places(model, &meetings[i], &solid, i))
            .collect();
        Ok(Self {
            params,
            model,
            meetings,
            solid,
            places,
        })
    }

    /// Mass of the pieces, t.
    pub fn mass_t(&self) -> f64 {
        self.solid.mass_t()
    }

    /// The punch with that friction.
    pub fn punch(&mut self, ctx: &Ctx<'_>, friction: f64) -> Result<Outcome, StressError> {
        let up = Vec3::from_array(self.params.plan.up).normalize_or(Vec3::Z);
        let assembly = &self.model.assembly;
        let fist = hit(self.params, assembly)
            .map_or_else(Vec::new, |hit| around(assembly, up, hit, PUNCH_RADIUS_MM));
        let forces_n = spread(assembly, &fist, -up * self.params.punch_n);
        self.outcome(ctx, &forces_n, Answer::Held, self.params.punch_n, friction)
    }

    /// The fall with that friction.
    pub fn drop(&mut self, ctx: &Ctx<'_>, friction: f64) -> Result<Outcome, StressError> {
        let up = Vec3::from_array(self.params.plan.up).normalize_or(Vec3::Z);
        let force_n = impact_n(self.mass_t(), self.params.drop_mm);
        let assembly = &self.model.assembly;
        let forces_n = spread(assembly, &lowest(assembly, up), up * force_n);
        self.outcome(ctx, &forces_n, Answer::Inertia, force_n, friction)
    }

    fn outcome(
        &mut self,
        ctx: &Ctx<'_>,
        forces_n: &[Vec3],
        answer: Answer,
        force_n: f64,
        friction: f64,
    ) -> Result<Outcome, StressError> {
        let assembly = &self.model.assembly;
        let push = |(point, force_n): (usize, &Vec3)| Push {
            part: assembly.part_of_point[point],
            at: assembly.points[point],
            force_n: *force_n,
        };
        let loaded = forces_n.iter().enumerate().filter(|f| *f.1 != Vec3::ZERO);
        let all: Vec<Push> = loaded.map(push).collect();
        // Where relief or a fragment took the surface away, the places about it bear its share.
        let has_material = |push: &&Push| self.solid.spot(push.part, push.at).is_some();
        let mut pushes: Vec<Push> = all.iter().filter(has_material).copied().collect();
        let total = |pushes: &[Push]| pushes.iter().map(|p| p.force_n.length()).sum::<f64>();
        let share = total(&all) / total(&pushes).max(f64::MIN_POSITIVE);
        if pushes.is_empty() {
            pushes = all;
        } else {
            pushes.iter_mut().for_each(|push| push.force_n *= share);
        }
        let moved = self
            .solid
            .under_load(&pushes, answer, friction, &|| ctx.check().is_err())
            .map_err(|e| stopped(ctx, e))?;
        if moved.friction_off > FRICTION_OFF {
            let percent = 100.0 * moved.friction_off;
            ctx.note(&format!("friction is off by {percent:.1} % of the load"));
        }
        Ok(Self::judged(
            self.params,
            self.model,
            self.meetings,
            &self.places,
            &moved,
            force_n,
        ))
    }

    fn judged(
        params: &StressParams,
        model: &PlanModel,
        meetings: &[Meeting],
        places: &[Vec<[Spot; 2]>],
        moved: &Moved<'_>,
        force_n: f64,
    ) -> Outcome {
        let lost_parts = moved.lost();
        let is_loose = |i: usize| {
            model
                .pieces_at(i)
                .iter()
                .any(|piece| lost_parts.contains(&piece.0))
        };
        let widest_at = |i: usize, motion: &dyn Fn(&Spot) -> Vec3| {
            let apart = places[i].iter().map(|[a, b]| motion(a).distance(motion(b)));
            apart.fold(0.0, f64::max)
        };
        let opening = |i: usize| {
            if is_loose(i) {
                f64::INFINITY
            } else {
                widest_at(i, &|spot| moved.moved_mm(spot))
            }
        };
        let stations: Range<usize> = 0..meetings.len();
        let openings: Vec<f64> = stations.clone().map(opening).collect();
        let widest = stations
            .clone()
            .max_by(|a, b| openings[*a].total_cmp(&openings[*b]));
        let opening_mm = widest.map_or(0.0, |i| openings[i]);
        let is_lost = |i: &usize| {
            meetings[*i]
                .joint
                .is_some_and(|j| openings[*i] >= PIN_DEPTH * j.size_mm)
        };
        let n_lost = stations.filter(is_lost).count();
        let [walls, connectors]: [StressLevel; 2] = moved.stress();
        let strength_share =
            walls.robust_mpa.max(connectors.robust_mpa) / params.metric.material.strength_mpa;
        let verdict = if n_lost > 0 || !lost_parts.is_empty() {
            StressVerdict::ComesApart
        } else if strength_share > 1.0 {
            StressVerdict::Yields
        } else if is_open(&openings, meetings) {
            StressVerdict::Opens
        } else {
            StressVerdict::Holds
        };
        Outcome {
            verdict,
            force_n,
            opening_mm,
            play_mm: widest.map_or(0.0, |i| widest_at(i, &|spot| moved.settled_mm(spot))),
            limit_mm: limit_mm(
                widest
                    .and_then(|i| meetings[i].joint)
                    .map_or(largest_mm(meetings), |j| j.size_mm),
            ),
            between: widest.map(|i| model.pieces_at(i)),
            at: widest.map(|i| params.turn.inverse().apply(model.place_of(i)).to_array()),
            n_lost,
            wall_mpa: walls.robust_mpa,
            connector_mpa: connectors.robust_mpa,
            peak_mpa: walls.largest_mpa.max(connectors.largest_mpa),
            strength_share,
        }
    }
}

/// Friction that is farther from its law, as a share of the load, is told.
const FRICTION_OFF: f64 = 0.02;

fn stopped(ctx: &Ctx<'_>, error: SolidError) -> StressError {
    match (error, ctx.check()) {
        (SolidError::Stopped, Err(cancelled)) => cancelled.into(),
        (error, _) => error.into(),
    }
}

/// Root and tip of a station's pin where both pieces have material there; none where there is no pin.
fn places(model: &PlanModel, meeting: &Meeting, solid: &SolidModel, i: usize) -> Vec<[Spot; 2]> {
    let Some(joint) = meeting.joint else {
        return Vec::new();
    };
    let root = model.place_of(i) - model.assembly.stations[i].normal * model.params.wall_mm;
    let tip = root - joint.leaves * (PIN_DEPTH * joint.size_mm);
    let [a, b] = model.pieces_at(i);
    let both = |p: Vec3| Some([solid.spot(a.0, p)?, solid.spot(b.0, p)?]);
    [root, tip].into_iter().filter_map(both).collect()
}

//! Stress tests of the pieces as they are printed: their finished meshes with their gaps.

use shellock_geom::signed_distance::SignedDistance;
use shellock_geom::{Solid, Vec3};
use shellock_mechanics::connector::PIN_DEPTH;
use shellock_mechanics::solid::{Answer, Hold, Moved, Push, SolidError, SolidModel, SolidParams, Spot};
use shellock_mechanics::{Meeting, StressLevel};
use shellock_plan::LatticePlan;
use shellock_report::{Ctx, PatchId};
use shellock_surface::SegmentedSurface;

use super::{
    Outcome, PUNCH_RADIUS_MM, StressError, StressParams, StressVerdict, hit, is_open, largest_mm, limit_mm,
};
use crate::handling::region::{around, lowest, spread};
use crate::impact::impact_n;
use crate::metric::PlanModel;

/// Coefficients of friction tested: none, and a low one for printed plastic on itself. Results for friction
/// in between lie between the two.
pub const FRICTION: [f64; 2] = [0.0, 0.2];
/// Depth below the wall from which material counts as connector, mm.
const BELOW_WALL_MM: f64 = 0.15;

/// The finished pieces, standing and falling.
pub(super) struct TestRig<'a> {
    params: &'a StressParams,
    model: &'a PlanModel,
    meetings: &'a [Meeting],
    /// The key and its way out.
    key: (PatchId, Vec3),
    solid: SolidModel,
    /// Root and tip of each station's pin, on either piece.
    places: Vec<Vec<[Spot; 2]>>,
}

impl<'a> TestRig<'a> {
    pub fn new(
        ctx: &Ctx<'_>,
        params: &'a StressParams,
        surface: &SegmentedSurface,
        model: &'a PlanModel,
        plan: &LatticePlan,
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
        .map_err(|e| stress_error(ctx, e))?;
        let places = (0..meetings.len())
            .map(|i| places(model, &meetings[i], &solid, i))
            .collect();
        Ok(Self {
            params,
            model,
            meetings,
            key: (plan.key(), plan.separation(plan.key()).unit()),
            solid,
            places,
        })
    }

    /// Mass of the pieces, t.
    pub fn mass_t(&self) -> f64 {
        self.solid.mass_t()
    }

    /// Runs the punch with the given friction.
    pub fn punch(&mut self, ctx: &Ctx<'_>, friction: f64) -> Result<Outcome, StressError> {
        let up = Vec3::from_array(self.params.plan.up).normalize_or(Vec3::Z);
        let assembly = &self.model.assembly;
        let fist = hit(self.params, assembly)
            .map_or_else(Vec::new, |hit| around(assembly, up, hit, PUNCH_RADIUS_MM));
        let forces_n = spread(assembly, &fist, -up * self.params.punch_n);
        self.outcome(ctx, &forces_n, Answer::Held, self.params.punch_n, friction)
    }

    /// Runs the fall with the given friction.
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
        // Where relief or a fragment removed the surface, the places around take over its share of the load.
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
            .map_err(|e| stress_error(ctx, e))?;
        if moved.friction_off > FRICTION_OFF {
            let percent = 100.0 * moved.friction_off;
            ctx.note(&format!("friction is off by {percent:.1} % of the load"));
        }
        let seen = Seen {
            model: self.model,
            meetings: self.meetings,
            key: self.key,
            places: &self.places,
            motion: &moved,
        };
        Ok(seen.judge(self.params, force_n))
    }
}

/// Motion of the pieces at the seams, under one load.
struct Seen<'a> {
    model: &'a PlanModel,
    meetings: &'a [Meeting],
    key: (PatchId, Vec3),
    places: &'a [Vec<[Spot; 2]>],
    motion: &'a Moved<'a>,
}

impl Seen<'_> {
    /// Displacement of the second piece relative to the first at each place of a station, mm.
    fn apart<'s>(
        &'s self,
        station: usize,
        motion: &'s dyn Fn(&Spot) -> Vec3,
    ) -> impl Iterator<Item = Vec3> + 's {
        self.places[station].iter().map(|[a, b]| motion(b) - motion(a))
    }

    /// Part of the displacement `apart` by which the key goes out of its way, mm; 0 between other pieces.
    fn slid_mm(&self, station: usize, apart: Vec3) -> f64 {
        let [a, b] = self.model.pieces_at(station);
        let (key, out) = self.key;
        let outward = match key {
            _ if key == b => apart.dot(out),
            _ if key == a => -apart.dot(out),
            _ => 0.0,
        };
        outward.max(0.0)
    }

    /// Widest opening of a station, mm. Sliding of the key on its way out does not count: there only friction
    /// or a detent holds it.
    fn widest_mm(&self, station: usize, motion: &dyn Fn(&Spot) -> Vec3) -> f64 {
        let openings = self.apart(station, motion).map(|apart| {
            let slid_mm = self.slid_mm(station, apart);
            (apart.length_squared() - slid_mm * slid_mm).max(0.0).sqrt()
        });
        openings.fold(0.0, f64::max)
    }

    fn opening_mm(&self, station: usize, lost: &[u32]) -> f64 {
        if self
            .model
            .pieces_at(station)
            .iter()
            .any(|piece| lost.contains(&piece.0))
        {
            f64::INFINITY
        } else {
            self.widest_mm(station, &|spot| self.motion.moved_mm(spot))
        }
    }

    /// Greatest distance by which the key slides out, mm.
    fn key_slides_mm(&self) -> f64 {
        let moved = |spot: &Spot| self.motion.moved_mm(spot);
        let slides = (0..self.meetings.len()).flat_map(|i| {
            let slid: Vec<f64> = self
                .apart(i, &moved)
                .map(|apart| self.slid_mm(i, apart))
                .collect();
            slid
        });
        slides.fold(0.0, f64::max)
    }

    fn judge(&self, params: &StressParams, force_n: f64) -> Outcome {
        let (meetings, moved) = (self.meetings, self.motion);
        let lost_parts = moved.lost();
        let openings: Vec<f64> = (0..meetings.len())
            .map(|i| self.opening_mm(i, &lost_parts))
            .collect();
        let widest = (0..meetings.len()).max_by(|a, b| openings[*a].total_cmp(&openings[*b]));
        let is_lost = |(m, opening_mm): &(&Meeting, &f64)| {
            m.joint.is_some_and(|j| **opening_mm >= PIN_DEPTH * j.size_mm)
        };
        let n_lost = meetings.iter().zip(&openings).filter(is_lost).count();
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
        let size_mm = widest
            .and_then(|i| meetings[i].joint)
            .map_or(largest_mm(meetings), |j| j.size_mm);
        let settled = |spot: &Spot| moved.settled_mm(spot);
        Outcome {
            verdict,
            force_n,
            opening_mm: widest.map_or(0.0, |i| openings[i]),
            play_mm: widest.map_or(0.0, |i| self.widest_mm(i, &settled)),
            key_slides_mm: self.key_slides_mm(),
            limit_mm: limit_mm(size_mm),
            between: widest.map(|i| self.model.pieces_at(i)),
            at: widest.map(|i| params.turn.inverse().apply(self.model.place_of(i)).to_array()),
            n_lost,
            wall_mpa: walls.robust_mpa,
            connector_mpa: connectors.robust_mpa,
            peak_mpa: walls.largest_mpa.max(connectors.largest_mpa),
            strength_share,
        }
    }
}

/// Deviation of friction from its law, as a share of the load, above which it is reported.
const FRICTION_OFF: f64 = 0.02;

fn stress_error(ctx: &Ctx<'_>, error: SolidError) -> StressError {
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

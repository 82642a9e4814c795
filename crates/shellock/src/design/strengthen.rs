//! What is changed before a kit is made where the plan that bears most does not bear what people do to it:
//! larger connectors where it gives way, then a thicker wall, then other pieces.
//!
//! The same plan is rated with each change first; what follows is planned anew with it.

use super::DesignError;
use super::attempt::Planning;
use super::budget::Levers;
use super::division::Division;
use crate::handling::Handling;
use crate::metric::{ChoiceError, Holding, LoadBorne, bears_with};
use crate::plan::{PlanParams, RankedPlan};
use crate::sizes::ChosenSizes;
use crate::{Cause, Ctx, PatchId, SegmentedSurface, Warning, segmentation, strength};

/// Changes aim at so much more than the load factor that is asked: the plan that is found with them is another.
const AIM: f64 = 0.1;
/// Below this a kit does not bear its load: only then pieces become one.
const ONCE: f64 = 1.0;
/// A change that lets a kit bear less than this many times as much is not worth it.
const GAIN: f64 = 1.05;
/// Rounds in which connectors grow: where one seam no longer gives way another does.
const MOST_ROUNDS: usize = 6;
/// Walls that are rated.
const MOST_WALLS: usize = 4;
/// Walls that are looked at in a mm.
const WALLS_A_MM: f64 = 10.0;

/// What lets a kit bear more.
pub(super) enum Remedy {
    /// Connectors of these sizes.
    Connectors(ChosenSizes),
    /// Another wall.
    Wall(Thicker),
    /// Pieces of which two became one, with what is told of it.
    Joined(SegmentedSurface, Warning),
}

/// A wall that is thicker for the sake of a use.
#[derive(Clone, Debug)]
pub(super) struct Thicker {
    pub thickness_mm: f64,
    /// What gave way.
    pub weakest: LoadBorne,
}

/// What lets the plan that was chosen bear more; `None` where it bears enough, or nothing that is `left` helps.
pub(super) fn remedy(
    ctx: &Ctx,
    planning: &Planning<'_>,
    handling: &Handling,
    (chosen, holding): (&RankedPlan, &Holding),
    left: &Levers,
) -> Result<Option<Remedy>, DesignError> {
    let division = planning.division;
    let Some(weakest) = weak(&holding.bears, left.asked) else {
        return Ok(None);
    };
    ctx.stage("what would let it bear more", 0)?;
    let trial = Trial {
        division,
        handling,
        plan: chosen,
        asked: left.asked,
    };
    let before = factor(weakest);
    let larger = (left.connectors > 0)
        .then(|| trial.larger_connectors(&holding.bears))
        .transpose()?;
    if larger
        .as_ref()
        .is_some_and(|(_, borne)| *borne >= left.asked + AIM)
    {
        return Ok(larger.map(|(sizes, _)| Remedy::Connectors(sizes)));
    }
    let (sizes, borne) = match &larger {
        Some((sizes, borne)) => (sizes, *borne),
        None => (&division.chosen, before),
    };
    if left.wall
        && let Some(thickness_mm) = trial.thicker_wall(planning, sizes, borne)?
    {
        if planning.may_begin_anew(ctx) {
            let weakest = weakest.clone();
            return Ok(Some(Remedy::Wall(Thicker {
                thickness_mm,
                weakest,
            })));
        }
        let walls = format!("walls of {thickness_mm:.1} mm, which would bear more");
        planning.pace.skip(ctx, &walls);
    }
    if let Some((sizes, borne)) = larger
        && is_worth(before, borne)
    {
        return Ok(Some(Remedy::Connectors(sizes)));
    }
    if left.weak_joinings > 0 && before < ONCE {
        return joined(ctx, division, chosen.plan.key(), weakest);
    }
    Ok(None)
}

/// True where a change is worth it that raises the least load factor from `before` to `after`. A plan that holds under no
/// load has the factor 0, of which any multiple is 0.
fn is_worth(before: f64, after: f64) -> bool {
    after > before && after >= GAIN * before
}

/// The use of which least is borne, where that is less than asked.
fn weak(uses: &[LoadBorne], asked: f64) -> Option<&LoadBorne> {
    let worst = uses
        .iter()
        .filter(|b| b.deed.is_use() && b.first.is_some())
        .min_by(|a, b| factor(a).total_cmp(&factor(b)))?;
    (factor(worst) < asked).then_some(worst)
}

fn factor(load: &LoadBorne) -> f64 {
    load.factor.unwrap_or(f64::INFINITY)
}

fn least(uses: &[LoadBorne]) -> f64 {
    let uses = uses.iter().filter(|b| b.deed.is_use());
    uses.map(factor).fold(f64::INFINITY, f64::min)
}

/// The plan with changes.
struct Trial<'a> {
    division: &'a Division,
    handling: &'a Handling,
    plan: &'a RankedPlan,
    asked: f64,
}

impl Trial<'_> {
    fn uses(&self, wall_mm: f64, sizes: &ChosenSizes) -> Result<Vec<LoadBorne>, DesignError> {
        let params = PlanParams {
            wall_mm,
            ..self.division.settings.plan.clone()
        };
        let handling = Handling {
            wall_mm,
            ..*self.handling
        };
        let surface = &self.division.surface;
        bears_with(&params, surface, &sizes.sizes, &handling, self.plan)
            .map_err(|e| ChoiceError::from(e).into())
    }

    /// Connectors as large as fit between all pieces that part under a use that is not borne, until no other
    /// use fails for another; the sizes of the best round, and what is borne with them.
    fn larger_connectors(&self, bears: &[LoadBorne]) -> Result<(ChosenSizes, f64), DesignError> {
        let aim = self.asked + AIM;
        let mut best = (self.division.chosen.clone(), least(bears));
        let (mut sizes, mut uses) = (best.0.clone(), bears.to_vec());
        for _ in 0..MOST_ROUNDS {
            let failing = uses.iter().filter(|b| b.deed.is_use() && factor(b) < aim);
            let parting: Vec<(&LoadBorne, [PatchId; 2])> =
                failing.filter_map(|b| Some((b, b.first?.between))).collect();
            let mut has_grown = false;
            for (load, pair) in parting {
                has_grown |= sizes.raise(pair, load.deed.done());
            }
            if !has_grown {
                break;
            }
            uses = self.uses(self.handling.wall_mm, &sizes)?;
            if least(&uses) > best.1 {
                best = (sizes.clone(), least(&uses));
            }
            if best.1 >= aim {
                break;
            }
        }
        Ok(best)
    }

    /// The least wall up to the thickest one that bears enough, or that one where it gains something; `None`
    /// where it would leave too little hollow.
    fn thicker_wall(
        &self,
        planning: &Planning<'_>,
        sizes: &ChosenSizes,
        before: f64,
    ) -> Result<Option<f64>, DesignError> {
        let most_mm = self.division.settings.strength.most_mm;
        let is_hollow =
            |mm: f64| planning.params.allows_thin || strength::is_hollow(planning.model, mm).is_ok();
        let (mut wall_mm, mut borne) = (self.handling.wall_mm, before);
        for _ in 0..MOST_WALLS {
            // Plates bend with the cube of their thickness, but openings grow with less than that.
            // What is planned anew with it bears more than this plan does.
            let wanted_mm = wall_mm * (self.asked / borne.max(0.1)).sqrt();
            let stepped_mm = (wanted_mm * WALLS_A_MM).ceil() / WALLS_A_MM;
            let next_mm = stepped_mm.max(wall_mm + 1.0 / WALLS_A_MM).min(most_mm);
            if next_mm <= wall_mm + 0.5 / WALLS_A_MM || !is_hollow(next_mm) {
                break;
            }
            wall_mm = next_mm;
            borne = least(&self.uses(wall_mm, sizes)?);
            if borne >= self.asked {
                break;
            }
        }
        Ok((wall_mm > self.handling.wall_mm && is_worth(before, borne)).then_some(wall_mm))
    }
}

/// The two pieces that part as one; not with the key.
fn joined(
    ctx: &Ctx,
    division: &Division,
    key: PatchId,
    weakest: &LoadBorne,
) -> Result<Option<Remedy>, DesignError> {
    let Some(first) = weakest.first.filter(|f| !f.between.contains(&key)) else {
        return Ok(None);
    };
    let params = &division.settings.segmentation;
    let united = segmentation::unite_two(&ctx.fork(), params, &division.surface, first.between)?;
    let told = Warning {
        cause: Cause::JoinedForUse {
            done: weakest.deed.done().to_owned(),
        },
        pieces: Vec::new(),
        at: Some(first.at),
    };
    Ok(united.map(|surface| Remedy::Joined(surface, told)))
}

impl Thicker {
    /// In words, for people.
    pub fn words(&self) -> String {
        let (done, wall_mm) = (self.weakest.deed.done(), self.thickness_mm);
        format!("it would give way where it is {done}: walls of {wall_mm:.1} mm")
    }

    /// What is told of it.
    pub fn warning(&self, from_mm: f64) -> Warning {
        Warning {
            cause: Cause::WallForUse {
                from_mm,
                to_mm: self.thickness_mm,
                done: self.weakest.deed.done().to_owned(),
            },
            pieces: Vec::new(),
            at: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use shellock_geom::{Solid, Vec3};

    use super::*;
    use crate::design::wall::Wall;
    use crate::design::ways::{Ask, Input};
    use crate::design::{Candidate, Job, Params, Settings};
    use crate::handling::{Deed, Failure};
    use crate::metric::GivesWay;
    use crate::plan::{LatticePlan, PlanConstraints, PlanScore, survey};
    use crate::{IdVec, LatticeDirection, testing};

    const N: usize = 4;

    /// A press on the top with this load factor.
    fn pressed(factor: f64) -> LoadBorne {
        LoadBorne {
            deed: Deed::PressTop,
            force_n: 70.0,
            at: [0.0; 3],
            factor: Some(factor),
            first: Some(GivesWay {
                how: Failure::Opens,
                between: [PatchId(0), PatchId(1)],
                at: [0.0; 3],
            }),
        }
    }

    /// Pieces that leave upwards, as they are numbered.
    fn plan() -> RankedPlan {
        let up = LatticeDirection::nearest(Vec3::Z);
        RankedPlan {
            plan: LatticePlan::new((0..N).map(|p| (PatchId::from(p), up))),
            score: PlanScore {
                worst: 1.0,
                mean: 1.0,
                pieces: IdVec::from_fn(N, |_: PatchId| 1.0),
            },
            loose: Vec::new(),
        }
    }

    /// Seeks a remedy for a ball in four pieces with this load factor under a press on its top; the remedy, and whether
    /// something is left out for want of time.
    fn changed(ctx: &Ctx, borne: f64, left: &Levers) -> (Option<Remedy>, bool) {
        let params = Params::default();
        let model = Solid::new(testing::sphere(3, Vec3::splat(40.0))).expect("closed");
        let pieces = testing::voronoi(model.mesh().clone(), N, 1);
        let wall = Wall {
            settings: Settings::resolve(&params),
            strength: None,
            warnings: Vec::new(),
        };
        let input = Input {
            params: &params,
            model: &model,
            labels: None,
        };
        let ask = Ask {
            factor: left.asked,
            rounds: params.rounds,
            n_thicker: 0,
        };
        let job = Job::of(&input, &wall, ask, false, pieces).expect("no key is named");
        let candidate = Candidate::new(&job, 0, None).expect("as it lies");
        let division = candidate.division(ctx, &job, candidate.surface.clone());
        let division = division.expect("sizes").expect("no key is cut");
        let (settings, surface) = (&division.settings.plan, &division.surface);
        let sizes = &division.chosen.sizes;
        let survey = survey(ctx, settings, surface, &surface.seams(), sizes).expect("not stopped");
        let planning = Planning {
            params: &params,
            model: &model,
            turn: &candidate.turn,
            division: &division,
            survey: &survey,
            constraints: &PlanConstraints::default(),
            begun_s: 100.0,
            pace: &job.pace,
        };
        let holding = Holding {
            quality_mm: None,
            loose: Vec::new(),
            seams: Vec::new(),
            n_compared: 1,
            bears: vec![pressed(borne)],
            foreseen_play: Vec::new(),
            foreseen_excess: Vec::new(),
        };
        let plan = (&plan(), &holding);
        let remedy = remedy(ctx, &planning, &planning.handling(), plan, left);
        (remedy.expect("not stopped"), job.pace.is_cut_short())
    }

    #[test]
    fn nothing_is_changed_where_no_lever_is_left() {
        let none = Levers {
            asked: 1.4,
            ..Levers::default()
        };
        for borne in [0.0, 0.5, 1.3] {
            let (remedy, is_cut_short) = changed(&Ctx::quiet(), borne, &none);
            assert!(remedy.is_none() && !is_cut_short, "{borne}");
        }
        let joins = Levers {
            weak_joinings: 1,
            ..none
        };
        let (remedy, _) = changed(&Ctx::quiet(), 0.0, &joins);
        assert!(matches!(remedy, Some(Remedy::Joined(..))));
    }

    #[test]
    fn a_wall_that_no_time_is_left_for_is_reported() {
        let wall = Levers {
            asked: 1.4,
            wall: true,
            ..Levers::default()
        };
        let remedy = |seconds_left: f64| {
            let left = || seconds_left;
            changed(&Ctx::quiet().with_deadline(&left), 0.2, &wall)
        };
        // The job began with 100 s.
        let (in_time, is_cut_short) = remedy(60.0);
        assert!(matches!(in_time, Some(Remedy::Wall(_))) && !is_cut_short);
        let (late, is_cut_short) = remedy(40.0);
        assert!(late.is_none() && is_cut_short);
    }
    #[test]
    fn a_change_that_gains_nothing_is_not_worth_it() {
        assert!(!is_worth(0.0, 0.0), "a twentieth more than nothing is nothing");
        assert!(is_worth(0.0, 0.1) && is_worth(1.0, GAIN));
        assert!(!is_worth(1.0, 1.04) && !is_worth(1.0, 0.5));
    }
}

//! Changes before a kit is made, if the strongest plan is weaker than asked: larger connectors where the plan
//! fails, then a thicker wall, then other pieces.
//!
//! The same plan is first rated with each change. Then planning begins anew with it.

use super::DesignError;
use super::agenda::{Allowance, Permit, Step};
use super::attempt::Planning;
use super::causes::Cause;
use super::division::Division;
use super::trial::Change;
use super::wall::Thicker;
use crate::handling::Handling;
use crate::metric::{ChoiceError, Holding, LoadBorne, bears_with};
use crate::plan::{PlanParams, RankedPlan};
use crate::sizes::ChosenSizes;
use crate::{Ctx, PatchId, Warning, segmentation, strength};

/// Changes aim at the load factor that is asked plus this, since they lead to another plan.
const AIM: f64 = 0.1;
/// Load factor below which a kit fails under its load. Only then are pieces joined.
const ONCE: f64 = 1.0;
/// Least factor by which a change must raise the load factor to be worth it.
const GAIN: f64 = 1.05;
/// Most rounds in which connectors grow: once one seam holds, another may open first.
const MOST_ROUNDS: usize = 6;
/// Most walls that are rated.
const MOST_WALLS: usize = 4;
/// Steps of wall thickness per mm.
const WALLS_A_MM: f64 = 10.0;

/// Finds changes that make the chosen plan stronger, most promising first: none if it is strong enough, or if
/// nothing that is allowed helps. Also returns the step that a lack of time rules out.
pub(super) fn strengthen(
    ctx: &Ctx,
    planning: &Planning<'_>,
    handling: &Handling,
    (chosen, holding): (&RankedPlan, &Holding),
    allowance: &Allowance,
) -> Result<(Vec<Change>, Option<Step>), DesignError> {
    let (division, asked) = (planning.division, allowance.least_factor);
    let Some(weakest) = weak(&holding.bears, asked) else {
        return Ok((Vec::new(), None));
    };
    ctx.stage("what would let it bear more", 0)?;
    let rating = Rating {
        division,
        handling,
        plan: chosen,
        least_factor: asked,
    };
    let before = factor(weakest);
    let larger = match allowance.is_allowed(Step::Enlarge) {
        true => Some(rating.enlarge(&holding.bears)?),
        false => None,
    };
    if let Some((sizes, borne)) = &larger
        && *borne >= asked + AIM
    {
        return Ok((vec![Change::Enlarge(sizes.clone())], None));
    }
    let mut changes = Vec::new();
    let mut late = allowance.late(Step::Enlarge).or(allowance.late(Step::JoinWeak));
    let (sizes, borne) = match &larger {
        Some((sizes, borne)) => (sizes, *borne),
        None => (&division.sizes, before),
    };
    let wall = allowance.permit(Step::Thicken);
    if wall != Permit::No
        && let Some(thickness_mm) = rating.thicken(planning, sizes, borne)?
    {
        match wall {
            Permit::Late => late = Some(Step::Thicken),
            _ => {
                let load = weakest.deed.words().to_owned();
                changes.push(Change::Thicken(Thicker { thickness_mm, load }));
            }
        }
    }
    if let Some((sizes, borne)) = larger
        && is_worth(before, borne)
    {
        changes.push(Change::Enlarge(sizes));
    } else if allowance.is_allowed(Step::JoinWeak) && before < ONCE && changes.is_empty() {
        changes.extend(join(ctx, division, chosen.plan.key(), weakest)?);
    }
    Ok((changes, late))
}

/// Returns true if a change is worth it that raises the least load factor from `before` to `after`. A plan
/// that holds under no load has the factor 0, of which any multiple is 0.
fn is_worth(before: f64, after: f64) -> bool {
    after > before && after >= GAIN * before
}

/// Returns the use with the least load factor, if that is less than asked.
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

/// A plan that is rated with changes.
struct Rating<'a> {
    division: &'a Division,
    handling: &'a Handling,
    plan: &'a RankedPlan,
    least_factor: f64,
}

impl Rating<'_> {
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

    /// Enlarges, to the largest that fits, the connectors of every pair that opens under a load which the kit
    /// does not withstand. Repeats, since another pair may then open first. Returns the best round's sizes
    /// and its least load factor.
    fn enlarge(&self, bears: &[LoadBorne]) -> Result<(ChosenSizes, f64), DesignError> {
        let aim = self.least_factor + AIM;
        let mut best = (self.division.sizes.clone(), least(bears));
        let (mut sizes, mut uses) = (best.0.clone(), bears.to_vec());
        for _ in 0..MOST_ROUNDS {
            let failing = uses.iter().filter(|b| b.deed.is_use() && factor(b) < aim);
            let parting: Vec<(&LoadBorne, [PatchId; 2])> =
                failing.filter_map(|b| Some((b, b.first?.between))).collect();
            let mut has_grown = false;
            for (load, pair) in parting {
                has_grown |= sizes.raise(pair, load.deed.words());
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

    /// Finds the thinnest wall that is strong enough, or the thickest one if that gains something; `None` if
    /// the cavity would become too small.
    fn thicken(
        &self,
        planning: &Planning<'_>,
        sizes: &ChosenSizes,
        before: f64,
    ) -> Result<Option<f64>, DesignError> {
        let most_mm = self.division.settings.strength.most_mm;
        let is_hollow = |mm: f64| {
            planning.input.params.allows_thin || strength::is_hollow(planning.input.model, mm).is_ok()
        };
        let (mut wall_mm, mut borne) = (self.handling.wall_mm, before);
        for _ in 0..MOST_WALLS {
            // Plates stiffen with the cube of their thickness, but openings shrink by less than that. The
            // plan that is found with this wall is stronger than the present one.
            let wanted_mm = wall_mm * (self.least_factor / borne.max(0.1)).sqrt();
            let stepped_mm = (wanted_mm * WALLS_A_MM).ceil() / WALLS_A_MM;
            let next_mm = stepped_mm.max(wall_mm + 1.0 / WALLS_A_MM).min(most_mm);
            if next_mm <= wall_mm + 0.5 / WALLS_A_MM || !is_hollow(next_mm) {
                break;
            }
            wall_mm = next_mm;
            borne = least(&self.uses(wall_mm, sizes)?);
            if borne >= self.least_factor {
                break;
            }
        }
        Ok((wall_mm > self.handling.wall_mm && is_worth(before, borne)).then_some(wall_mm))
    }
}

/// Joins the two pieces that part, unless one of them is the key.
fn join(
    ctx: &Ctx,
    division: &Division,
    key: PatchId,
    weakest: &LoadBorne,
) -> Result<Option<Change>, DesignError> {
    let Some(first) = weakest.first.filter(|f| !f.between.contains(&key)) else {
        return Ok(None);
    };
    let params = &division.settings.segmentation;
    let united = segmentation::unite_two(&ctx.fork(), params, &division.surface, first.between)?;
    let warning = Warning::new(
        Cause::JoinedForUse {
            load: weakest.deed.words().to_owned(),
        },
        Vec::new(),
        Some(first.at),
    );
    Ok(united.map(|surface| Change::Divide(Step::JoinWeak, surface, Some(warning))))
}

#[cfg(test)]
mod tests {
    use shellock_geom::Vec3;

    use super::super::agenda::Agenda;
    use super::super::tests::Ball;
    use super::*;
    use crate::IdVec;
    use crate::LatticeDirection;
    use crate::design::candidate::Candidate;
    use crate::handling::{Deed, Failure};
    use crate::metric::GivesWay;
    use crate::plan::{LatticePlan, PlanConstraints, PlanScore, survey};

    const N: usize = 4;

    /// A press on the top with this load factor.
    fn press(factor: f64) -> LoadBorne {
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

    /// Seeks changes of a ball in four pieces with this load factor under a press on its top, if only these
    /// steps are allowed.
    fn changes(borne: f64, steps: &[(Step, Permit)]) -> (Vec<Step>, Option<Step>) {
        let (ctx, ball) = (Ctx::quiet(), Ball::new());
        let job = ball.job(N);
        let candidate = Candidate::new(&job, None).expect("as it lies");
        let division = candidate.divide(&ctx, &job, candidate.surface.clone());
        let division = division.expect("sizes").expect("no key is cut");
        let (settings, surface) = (&division.settings.plan, &division.surface);
        let sizes = &division.sizes.sizes;
        let survey = survey(&ctx, settings, surface, &surface.seams(), sizes).expect("not stopped");
        let planning = Planning {
            input: ball.input(),
            turn: &candidate.turn,
            division: &division,
            survey: &survey,
            constraints: &PlanConstraints::default(),
        };
        let holding = Holding {
            quality_mm: None,
            loose: Vec::new(),
            seams: Vec::new(),
            n_compared: 1,
            bears: vec![press(borne)],
            foreseen_play: Vec::new(),
            foreseen_excess: Vec::new(),
        };
        let allowance = Agenda::new(&ctx, &ball.input()).allowance(&ctx).only(steps);
        let plan = (&plan(), &holding);
        let found = strengthen(&ctx, &planning, &planning.handling(), plan, &allowance);
        let (changes, late) = found.expect("not stopped");
        (changes.iter().map(Change::step).collect(), late)
    }

    #[test]
    fn only_what_is_allowed_is_changed() {
        for borne in [0.0, 0.5, 1.3] {
            assert_eq!(changes(borne, &[]), (vec![], None), "{borne}");
        }
        let join = [(Step::JoinWeak, Permit::Yes)];
        assert_eq!(changes(0.0, &join), (vec![Step::JoinWeak], None));
        assert_eq!(changes(2.0, &join), (vec![], None), "it is strong enough");
    }

    #[test]
    fn a_wall_that_no_time_is_left_for_is_reported() {
        assert_eq!(
            changes(0.2, &[(Step::Thicken, Permit::Yes)]),
            (vec![Step::Thicken], None)
        );
        assert_eq!(
            changes(0.2, &[(Step::Thicken, Permit::Late)]),
            (vec![], Some(Step::Thicken))
        );
    }

    #[test]
    fn a_change_that_gains_nothing_is_not_worth_it() {
        assert!(!is_worth(0.0, 0.0), "a twentieth more than nothing is nothing");
        assert!(is_worth(0.0, 0.1) && is_worth(1.0, GAIN));
        assert!(!is_worth(1.0, 1.04) && !is_worth(1.0, 0.5));
    }
}

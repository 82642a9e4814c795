//! Changes before a kit is made, if the strongest plan is weaker than asked: larger connectors where the plan
//! fails, then a thicker wall, then other pieces.
//!
//! The same plan is first rated with each change. Then planning begins anew with it. A plan that is far too
//! weak early in its climb is changed at once, since the rest of the climb would be lost.

use super::agenda::{Allowance, Permit, Step};
use super::causes::Cause;
use super::division::Division;
use super::longer;
use super::planning::Planning;
use super::trial::Change;
use super::wall::Thicker;
use super::{DesignError, WallChoice};
use crate::handling::Handling;
use crate::metric::{ChoiceError, LoadBorne, Stand, WhatIf, is_worth, weakest_use};
use crate::{Ctx, PatchId, Warning, segmentation};

/// Share of the load factor that is asked for, below which changes are sought: what is missing is less than
/// what the model knows.
const TOLERANCE: f64 = 0.99;
/// Load factor below which a kit fails under its load. Only then are pieces joined.
const ONCE: f64 = 1.0;

/// Factors by which the climb strengthens a plan after its first heat: more than in any of twelve climbs that
/// were measured (1.42), and their mean.
const MOST_GAIN: f64 = 1.5;
const MEAN_GAIN: f64 = 1.2;

/// Finds changes that make the plan stronger, most promising first: none if it is or may become strong
/// enough, or if nothing that is allowed helps. Also returns the step that a lack of time rules out.
pub(super) fn strengthen(
    ctx: &Ctx,
    planning: &Planning<'_>,
    handling: &Handling,
    stand: &Stand<'_>,
    allowance: &Allowance,
) -> Result<(Vec<Change>, Option<Step>), DesignError> {
    let (division, asked, bears) = (planning.division, allowance.least_factor, &stand.bears);
    if stand.is_early && !allowance.may_end_climb {
        return Ok((Vec::new(), None));
    }
    let [most_gain, gain] = match stand.is_early {
        true => [MOST_GAIN, MEAN_GAIN],
        false => [1.0; 2],
    };
    let Some((weakest, factor)) = weakest_use(bears, TOLERANCE * asked / most_gain) else {
        return Ok((Vec::new(), None));
    };
    let before = gain * factor;
    // An early look is a part of the climb, which may go on.
    if !stand.is_early {
        ctx.stage("reinforcements", 0)?;
    }
    let rating = WhatIf {
        params: &division.settings.plan,
        even: planning.even,
        sizes: &division.sizes,
        handling,
        plan: stand.plan,
        least_factor: asked,
        gain,
    };
    let larger = match allowance.is_allowed(Step::Enlarge) {
        true => Some(rating.enlarge(bears).map_err(ChoiceError::from)?),
        false => None,
    };
    if let Some((sizes, borne)) = &larger
        && rating.is_enough(*borne)
    {
        return Ok((vec![Change::Enlarge(sizes.clone())], None));
    }
    let mut changes = Vec::new();
    let mut late = allowance.late(Step::Enlarge).or(allowance.late(Step::JoinWeak));
    let (sizes, borne) = match &larger {
        Some((sizes, borne)) => (sizes, *borne),
        None => (&division.sizes, before),
    };
    // A thicker wall weighs most of all remedies, so a standard one is not made thicker for the sake of a
    // reserve.
    let rating = WhatIf {
        least_factor: match planning.input.params.wall {
            WallChoice::Sturdy => asked,
            WallChoice::Light | WallChoice::Standard => asked.min(ONCE),
        },
        ..rating
    };
    let wall = allowance.permit(Step::Thicken);
    if wall != Permit::No && borne < TOLERANCE * rating.least_factor {
        let input = planning.input;
        let is_hollow = |mm| input.params.allows_thin || planning.cavity.is_hollow(input.model, mm).is_ok();
        let most_mm = division.settings.strength.most_mm;
        let thicker = rating.thicken(&sizes.sizes, borne, most_mm, is_hollow);
        match (thicker.map_err(ChoiceError::from)?, wall) {
            (None, _) => {}
            (Some(_), Permit::Late) => late = Some(Step::Thicken),
            (Some(thickness_mm), _) => {
                let load = weakest.deed.words().to_owned();
                changes.push(Change::Thicken(Thicker { thickness_mm, load }));
            }
        }
    }
    if let Some((sizes, borne)) = larger
        && is_worth(before, borne)
    {
        changes.push(Change::Enlarge(sizes));
    } else if allowance.is_allowed(Step::JoinWeak) && before < ONCE && changes.is_empty() && !stand.is_early {
        // Fewer pieces are the last resort, so the climb and longer seams come before.
        let between = weakest.first.map(|first| first.between);
        if let Some(between) = between.filter(|pair| !pair.contains(&stand.plan.plan.key())) {
            changes.extend(longer::for_load(
                ctx,
                division,
                between,
                (before, ONCE),
                allowance,
            )?);
        }
        changes.extend(join(ctx, division, stand.plan.plan.key(), weakest)?);
    }
    Ok((changes, late))
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
    let united = segmentation::unite_two(
        &ctx.fork(),
        params,
        &division.surface,
        first.between,
        &division.twins(),
    )?;
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
    use super::super::agenda::Agenda;
    use super::super::tests::Ball;
    use super::*;
    use crate::IdVec;
    use crate::LatticeDirection;
    use crate::design::candidate::Candidate;
    use crate::handling::{Deed, Failure};
    use crate::metric::{EvenSurface, GivesWay, RESERVE};
    use crate::plan::{LatticePlan, PlanConstraints, PlanScore, PlanSurvey, RankedPlan, survey};
    use crate::strength::Cavity;

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

    /// Pieces of a ball that leave outwards, as they are numbered.
    fn plan(survey: &PlanSurvey) -> RankedPlan {
        let out = |piece: PatchId| (piece, LatticeDirection::nearest(survey.mean_normal[piece]));
        RankedPlan {
            plan: LatticePlan::new((0..N).map(|p| out(PatchId::from(p)))),
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
    fn changes(borne: f64, is_early: bool, steps: &[(Step, Permit)]) -> (Vec<Step>, Option<Step>) {
        let (ctx, ball) = (Ctx::quiet(), Ball::new());
        let job = ball.job(N);
        let candidate = Candidate::new(&job, None).expect("as it lies");
        let division = candidate.divide(&ctx, &job, candidate.surface.clone());
        let division = division.expect("sizes").expect("no key is cut");
        let (settings, surface) = (&division.settings.plan, &division.surface);
        let sizes = &division.sizes.sizes;
        let survey = survey(&ctx, settings, surface, &surface.seams(), sizes).expect("not stopped");
        let even = EvenSurface::new(surface, 1.0);
        let planning = Planning {
            even: &even,
            input: ball.input(),
            cavity: &Cavity::default(),
            turn: &candidate.turn,
            division: &division,
            survey: &survey,
            constraints: &PlanConstraints::default(),
        };
        let allowance = Agenda::new(&ctx, &ball.input()).allowance(&ctx).only(steps);
        let stand = Stand {
            plan: &plan(&survey),
            bears: vec![press(borne)],
            is_early,
        };
        let found = strengthen(&ctx, &planning, &planning.handling(), &stand, &allowance);
        let (changes, late) = found.expect("not stopped");
        (changes.iter().map(Change::step).collect(), late)
    }

    #[test]
    fn only_what_is_allowed_is_changed() {
        for borne in [0.0, 0.5, 1.3] {
            assert_eq!(changes(borne, false, &[]), (vec![], None), "{borne}");
        }
        let join = [(Step::JoinWeak, Permit::Yes)];
        assert_eq!(changes(0.0, false, &join), (vec![Step::JoinWeak], None));
        assert_eq!(changes(2.0, false, &join), (vec![], None), "it is strong enough");
    }

    #[test]
    fn a_climb_ends_early_for_a_thicker_wall_but_not_to_join_pieces_or_if_it_may_get_there() {
        let [thicken, join] = [Step::Thicken, Step::JoinWeak].map(|step| [(step, Permit::Yes)]);
        assert_eq!(changes(0.2, true, &thicken), (vec![Step::Thicken], None));
        assert_eq!(changes(RESERVE / MOST_GAIN, true, &thicken), (vec![], None));
        assert_eq!(changes(0.0, true, &join), (vec![], None));
    }

    #[test]
    fn a_wall_that_no_time_is_left_for_is_reported() {
        assert_eq!(
            changes(0.2, false, &[(Step::Thicken, Permit::Yes)]),
            (vec![Step::Thicken], None)
        );
        assert_eq!(
            changes(0.2, false, &[(Step::Thicken, Permit::Late)]),
            (vec![], Some(Step::Thicken))
        );
    }
}

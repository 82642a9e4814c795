//! Choice of the strongest plan that the search allows, and its weak places (Sect. 6.2).

use std::convert::Infallible;

use crate::causes::Cause;
use serde::{Deserialize, Serialize};
use shellock_geom::Vec3;
use shellock_geom::sparse::SparseError;
use shellock_mechanics::{Meeting, Opening, Resistance};
use shellock_plan::{FoundPlan, LatticePlan, Neighbourhood, RankedPlan};
use shellock_report::{Cancelled, Ctx, PatchId, Warning};

use super::climb::{Ascent, ClimbError, ClimbRules, Climbed};
use super::foresight::{COST_SLACK, Foresight};
use super::question::Choice;
use super::rating::{Bench, Rated};
use super::{Deformed, Foreseen, PlanModel};
use crate::handling::{Borne, DROP_MM, Deed, Failure, LoadCase};

/// Relative difference below which costs count as equal, against rounding.
const COST_TIE: f64 = 1e-9;

/// Greatest load factor in summaries; higher ones are of no interest.
pub const MOST_TIMES: f64 = 10.0;

/// Least components of `s` along the seam, and towards the earlier piece, that are named as the reason why a
/// seam is weak.
const ALONG_SHARE: f64 = 0.7;
const BACKWARD_SHARE: f64 = 0.5;

/// Resistance of a plan to the separation force of 10 N/m, by the surface metric.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Holding {
    /// `Q = −max w d`, mm; higher is better. `None` where pieces come apart in the simulation.
    pub quality_mm: Option<f64>,
    /// Pieces that come apart in the simulation, which has no friction but the key's; empty where all hold.
    pub loose: Vec<LoosePiece>,
    /// Seams with a connector, weakest first. Empty where pieces come apart.
    pub seams: Vec<SeamHolding>,
    /// Number of plans that were compared.
    pub n_compared: usize,
    /// Load factors of the kit, by simulation without a print to compare.
    #[serde(default)]
    pub bears: Vec<LoadBorne>,
    /// Predicted play of each piece from the plan: displacement, mm, and turn, degrees.
    pub foreseen_play: Vec<[f64; 2]>,
    /// Ratio of the predicted play to the allowed play of each piece.
    pub foreseen_excess: Vec<f64>,
}

/// Load factor of a kit under one load.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoadBorne {
    /// Kind of the load.
    pub deed: Deed,
    /// Force of the load, N; of a grip, that of each finger.
    pub force_n: f64,
    /// Place of the load, mm in assembly space.
    pub at: [f64; 3],
    /// Factor by which the load may grow; `None` where nothing fails.
    pub factor: Option<f64>,
    /// First failure under the growing load; `None` where nothing fails.
    pub first: Option<GivesWay>,
}

/// Summary of the loads that a kit withstands, each at most [`MOST_TIMES`] times the load asked for. `None`
/// where a load has no place on the kit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bears {
    /// Greatest press on the top, N.
    pub top_n: Option<f64>,
    /// Greatest press on the highest place above the middle, N.
    pub middle_n: Option<f64>,
    /// Greatest press on the weakest of the sides as the kit lies, N.
    pub sides_n: Option<f64>,
    /// Greatest force of the weaker of two grips, N a finger.
    pub grip_n: Option<f64>,
    /// Greatest fall onto the feet, m.
    pub fall_upright_m: Option<f64>,
    /// Greatest fall in the worst of all orientations, m.
    pub fall_m: Option<f64>,
    /// First failure in use; `None` where nothing fails, and in kits of earlier versions.
    #[serde(default)]
    pub weakest: Option<WeakestUse>,
    /// Validity of the figures, in words; empty in kits of earlier versions.
    #[serde(default)]
    pub basis: String,
}

/// Remark that goes with all figures of the simulation.
pub const BY_SIMULATION: &str = "by simulation, without a print to compare";

/// The use with the least load factor, and its failure.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WeakestUse {
    /// Kind of the use.
    pub deed: Deed,
    /// Kind and place of the failure.
    pub first: GivesWay,
}

impl Holding {
    /// Summary of the loads that the kit withstands; `None` where no loads were simulated.
    pub fn summary(&self) -> Option<Bears> {
        let least = |is: fn(&Deed) -> bool| {
            let factors = self
                .bears
                .iter()
                .filter(|b| is(&b.deed))
                .map(|b| (b.factor.unwrap_or(MOST_TIMES).min(MOST_TIMES), b));
            factors.min_by(|a, b| a.0.total_cmp(&b.0))
        };
        let newtons = |is| least(is).map(|(factor, load)| factor * load.force_n);
        // Forces go with the root of the height, so heights go with the square of the factor.
        let metres = |is| least(is).map(|(factor, _)| 1e-3 * DROP_MM * factor * factor);
        (!self.bears.is_empty()).then(|| Bears {
            top_n: newtons(|d| *d == Deed::PressTop),
            middle_n: newtons(|d| *d == Deed::PressMiddle),
            sides_n: newtons(|d| matches!(d, Deed::PressSide { .. })),
            grip_n: newtons(|d| matches!(d, Deed::GripNarrow | Deed::GripWide)),
            fall_upright_m: metres(|d| *d == Deed::FallUpright),
            fall_m: metres(|d| matches!(d, Deed::Fall { .. } | Deed::FallUpright)),
            weakest: self.weakest_use().and_then(|worst| {
                let deed = worst.deed;
                worst.first.map(|first| WeakestUse { deed, first })
            }),
            basis: BY_SIMULATION.to_owned(),
        })
    }

    /// The use with the least load factor; `None` where nothing fails in any use.
    pub fn weakest_use(&self) -> Option<&LoadBorne> {
        let uses = self
            .bears
            .iter()
            .filter(|b| b.deed.is_use() && b.factor.is_some());
        uses.min_by(|a, b| {
            a.factor
                .partial_cmp(&b.factor)
                .unwrap_or(std::cmp::Ordering::Equal)
        })
    }
}

/// Place and kind of a failure of the kit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GivesWay {
    /// Kind of the failure.
    pub how: Failure,
    /// The two pieces at the place of the failure.
    pub between: [PatchId; 2],
    /// Place of the failure, mm in assembly space.
    pub at: [f64; 3],
}

/// A piece that comes apart in the simulation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoosePiece {
    /// The piece that comes apart.
    pub piece: PatchId,
    /// Point near the middle of the piece, mm in assembly space.
    pub at: [f64; 3],
}

/// Resistance of one pair of pieces, at its weakest place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SeamHolding {
    /// The piece installed later.
    pub later: PatchId,
    /// The piece installed earlier.
    pub earlier: PatchId,
    /// Greatest weighted opening `max w d` along the seam, mm.
    pub score_mm: f64,
    /// Opening at the weakest place, mm.
    pub opening_mm: f64,
    /// Weight `w` of Eq. 4 at the weakest place.
    pub weight: f64,
    /// Weakest place, mm in assembly space.
    pub at: [f64; 3],
    /// Reason of the weakness, for people; it says "the later one" and "the earlier".
    pub reason: String,
}

/// The strongest plan, and its properties.
pub struct Chosen {
    /// Result of the search, with that plan in place of its own.
    pub search_result: FoundPlan,
    /// Resistance of the plan.
    pub holding: Holding,
    /// Motion of the pieces under the loads that are reported.
    pub deformation: Deformed,
    /// True if a stronger plan would have been sought if more time were left.
    pub is_cut_short: bool,
}

/// Climbs from the plans of the pool to a stronger one that costs at most a quarter more than the least.
/// Plans predicted to rattle are excluded, as long as some are not. The result replaces the plan of `found`.
///
/// Warns with `comes-apart` where the plan does not hold without friction, and with `piece-loose` of each
/// piece that hardly anything holds by the estimate of the costs.
pub fn choose(
    ctx: &Ctx<'_>,
    choice: &Choice<'_>,
    foresight: &Foresight,
    found: FoundPlan,
) -> Result<Chosen, ChoiceError> {
    let chosen = choose_or_change(ctx, choice, foresight, found, |_| None::<Infallible>)?;
    chosen.map_err(|never| match never {})
}

/// A plan on the climb, and what it withstands.
pub struct Stand<'a> {
    /// The strongest plan so far.
    pub plan: &'a RankedPlan,
    /// Load factors of that plan in use.
    pub bears: Vec<LoadBorne>,
    /// True after the first heat of the climb; false once the uses are climbed.
    pub is_early: bool,
}

/// Chooses a plan as [`choose`] does, or a change to make first. `change` sees the strongest plan early in
/// the climb, and once the uses are climbed. What it returns is returned in place of a plan, and nothing else
/// is climbed.
pub fn choose_or_change<T>(
    ctx: &Ctx<'_>,
    choice: &Choice<'_>,
    foresight: &Foresight,
    mut found: FoundPlan,
    change: impl FnMut(Stand<'_>) -> Option<T>,
) -> Result<Result<Chosen, T>, ChoiceError> {
    ctx.stage("strongest plan", 0)?;
    let model = &foresight.model;
    let bench = Bench::new(choice.handling, model)?;
    let climbed = match strongest(ctx, choice, foresight, &bench, &found, change)? {
        Ok(climbed) => climbed,
        Err(changed) => return Ok(Err(changed)),
    };
    let chosen = climbed.best.candidate.clone();
    let holding = hold(foresight, &bench, &climbed)?;
    warn(ctx, model, &holding, &chosen);
    let deformation = Deformed::of(model, &bench, &climbed.best, &holding.bears)?;
    found.is_optimal &= chosen.score.worst <= found.score.worst * (1.0 + COST_TIE);
    (found.plan, found.score) = (chosen.plan.clone(), chosen.score.clone());
    found.pool.retain(|p| p.plan != chosen.plan);
    found.pool.insert(0, chosen);
    Ok(Ok(Chosen {
        search_result: found,
        holding,
        deformation,
        is_cut_short: climbed.is_cut_short,
    }))
}

/// Resistance of the plan that was climbed to.
fn hold(foresight: &Foresight, bench: &Bench<'_>, climbed: &Climbed<'_>) -> Result<Holding, ChoiceError> {
    let (best, plan, model) = (&climbed.best, &climbed.best.candidate.plan, &foresight.model);
    let solved = bench.surface.resist(&best.meetings, plan.key().0)?;
    let Foreseen {
        play: foreseen_play,
        excess: foreseen_excess,
        ..
    } = foresight.play(plan);
    Ok(Holding {
        n_compared: climbed.n_plans,
        foreseen_play,
        foreseen_excess,
        bears: bears(model, bench, best),
        ..collect_holding(model, plan, &best.meetings, &solved.resistance)
    })
}

/// Warns of pieces that come apart, of pieces that are loose, and of a use that the plan does not withstand.
fn warn(ctx: &Ctx<'_>, model: &PlanModel, holding: &Holding, chosen: &RankedPlan) {
    if !holding.loose.is_empty() {
        warn_of_loose_pieces(ctx, &holding.loose);
    }
    chosen
        .loose
        .iter()
        .for_each(|&piece| warn_of_loose(ctx, model, piece));
    if let Some(weakest) = holding
        .weakest_use()
        .filter(|w| w.factor.is_some_and(|f| f < 1.0))
    {
        warn_of_use(ctx, weakest);
    }
}

/// The strongest plan, and how it was found; or the change to make first.
fn strongest<'b, T>(
    ctx: &Ctx<'_>,
    choice: &Choice<'_>,
    foresight: &Foresight,
    bench: &'b Bench<'b>,
    found: &FoundPlan,
    mut change: impl FnMut(Stand<'_>) -> Option<T>,
) -> Result<Result<Climbed<'b>, T>, ChoiceError> {
    let Some(first) = found.pool.first() else {
        return Err(ChoiceError::NoPlan);
    };
    let most_cost = found.score.worst * (1.0 + COST_SLACK);
    let counted = found.apply_counts(choice.survey);
    let around = &Neighbourhood::new(choice.params, &counted, choice.constraints, found, most_cost);
    let may_be = &|p: &RankedPlan| foresight.is_steady(&p.plan);
    let is_like =
        |plan: &&LatticePlan| plan.steps.len() == found.plan.steps.len() && plan.key() == found.plan.key();
    let of_this_key = choice.former.filter(is_like);
    let former = of_this_key.and_then(|plan| around.rank(plan.clone()));
    let mut starts: Vec<RankedPlan> = former.into_iter().filter(may_be).collect();
    starts.extend(foresight.steady());
    let params = choice.climb;
    let rules = ClimbRules {
        params,
        around,
        may_be,
    };
    let mut change_at = |rated: &Rated<'_>, is_early: bool| {
        let (plan, bears) = (&rated.candidate, bears(&foresight.model, bench, rated));
        change(Stand {
            plan,
            bears,
            is_early,
        })
    };
    let mut ascent = match Ascent::begin(ctx, rules, bench, &starts) {
        Ok(ascent) => ascent,
        Err(ClimbError::NoPlan) => {
            let best = bench.rate(first.clone())?;
            return Ok(match change_at(&best, false) {
                Some(changed) => Err(changed),
                None => Ok(Climbed {
                    best,
                    n_plans: 1,
                    n_solves: 0,
                    is_cut_short: false,
                }),
            });
        }
        Err(e) => return Err(e.into()),
    };
    if let Some(changed) = change_at(ascent.best()?, true) {
        return Ok(Err(changed));
    }
    ascent.race()?;
    if let Some(changed) = change_at(ascent.best()?, false) {
        return Ok(Err(changed));
    }
    Ok(Ok(ascent.finish()?))
}

/// Load factors of a plan, in assembly space.
pub(super) fn bears(model: &PlanModel, bench: &Bench<'_>, rated: &Rated<'_>) -> Vec<LoadBorne> {
    let one = |(case, borne): (&LoadCase, &Borne)| LoadBorne {
        deed: case.deed,
        force_n: case.force_n,
        at: case.at.to_array(),
        factor: borne.factor.is_finite().then_some(borne.factor),
        first: borne.first.map(|(how, station)| GivesWay {
            how,
            between: model.pieces_at(station as usize),
            at: model.place_of(station as usize).to_array(),
        }),
    };
    bench.cases.iter().zip(&rated.load_factors()).map(one).collect()
}

fn warn_of_loose_pieces(ctx: &Ctx<'_>, loose: &[LoosePiece]) {
    ctx.warn(Warning::new(
        Cause::ComesApart,
        loose.iter().map(|part| part.piece).collect(),
        loose.first().map(|part| part.at),
    ));
}

fn warn_of_use(ctx: &Ctx<'_>, weakest: &LoadBorne) {
    let (Some(factor), Some(first)) = (weakest.factor, weakest.first) else {
        return;
    };
    // Forces go with the root of the height, so heights go with the square of the factor.
    let much = |factor: f64, digits: usize| {
        if weakest.deed.is_fall() {
            let height_m = 1e-3 * DROP_MM * factor * factor;
            format!("a fall of {height_m:.*} m", digits + 1)
        } else {
            format!("{:.digits$} N", factor * weakest.force_n)
        }
    };
    // As many digits as tell the two apart.
    let digits = (0..3).find(|&n| much(factor, n) != much(1.0, n)).unwrap_or(3);
    let gives_way = match first.how {
        Failure::Opens => "the seam opens",
        Failure::PinYields => "pins bend",
        Failure::WallYields => "walls yield",
    };
    ctx.warn(Warning::new(
        Cause::BearsLittle {
            load: weakest.deed.words().to_owned(),
            bears: much(factor, digits),
            requirement: much(1.0, digits),
            gives_way: gives_way.to_owned(),
        },
        first.between.to_vec(),
        Some(first.at),
    ));
}

fn warn_of_loose(ctx: &Ctx<'_>, model: &PlanModel, piece: PatchId) {
    ctx.warn(Warning::new(
        Cause::PieceLoose,
        vec![piece],
        Some(middle_of(model, piece).to_array()),
    ));
}

/// The point of `piece` that is nearest to the mean of its points, mm.
fn middle_of(model: &PlanModel, piece: PatchId) -> Vec3 {
    let assembly = &model.assembly;
    let own = || {
        assembly
            .points
            .iter()
            .zip(&assembly.part_of_point)
            .filter(|(_, part)| **part == piece.0)
            .map(|x| *x.0)
    };
    let mean = own().sum::<Vec3>() / own().count().max(1) as f64;
    own()
        .min_by(|x, y| x.distance_squared(mean).total_cmp(&y.distance_squared(mean)))
        .unwrap_or(mean)
}

/// Collects the stations' openings by pairs of pieces.
fn collect_holding(
    model: &PlanModel,
    plan: &LatticePlan,
    meetings: &[Meeting],
    resistance: &Resistance,
) -> Holding {
    let (opening, loose) = match resistance {
        Resistance::Holds(opening) => (opening, Vec::new()),
        Resistance::Separable(parts) => {
            let part = |&p: &u32| LoosePiece {
                piece: PatchId(p),
                at: middle_of(model, PatchId(p)).to_array(),
            };
            let loose = parts.iter().map(part).collect();
            return Holding {
                quality_mm: None,
                loose,
                seams: Vec::new(),
                n_compared: 0,
                bears: Vec::new(),
                foreseen_play: Vec::new(),
                foreseen_excess: Vec::new(),
            };
        }
    };
    let mut seams = weakest_places(model, plan, meetings, opening);
    seams.sort_by(|x, y| {
        y.score_mm
            .total_cmp(&x.score_mm)
            .then((x.later, x.earlier).cmp(&(y.later, y.earlier)))
    });
    Holding {
        quality_mm: Some(opening.quality_mm),
        loose,
        seams,
        n_compared: 0,
        bears: Vec::new(),
        foreseen_play: Vec::new(),
        foreseen_excess: Vec::new(),
    }
}

/// The weakest place of every pair of pieces that has a connector.
fn weakest_places(
    model: &PlanModel,
    plan: &LatticePlan,
    meetings: &[Meeting],
    opening: &Opening,
) -> Vec<SeamHolding> {
    let mut worst: std::collections::BTreeMap<[PatchId; 2], (usize, f64)> = std::collections::BTreeMap::new();
    for (i, (meeting, d)) in meetings.iter().zip(&opening.opening_mm).enumerate() {
        if let Some(joint) = meeting.joint {
            let entry = worst.entry(model.pieces_at(i)).or_insert((i, joint.weight * d));
            if joint.weight * d > entry.1 {
                *entry = (i, joint.weight * d);
            }
        }
    }
    let seam = |([a, b], (station, score_mm)): ([PatchId; 2], (usize, f64))| {
        let (later, earlier) = if plan.position(a) > plan.position(b) {
            (a, b)
        } else {
            (b, a)
        };
        let weight = meetings[station].joint.map_or(0.0, |j| j.weight);
        let at = model.place_of(station).to_array();
        let reason = reason(model, plan, station, later).to_owned();
        SeamHolding {
            later,
            earlier,
            score_mm,
            opening_mm: opening.opening_mm[station],
            weight,
            at,
            reason,
        }
    };
    worst.into_iter().map(seam).collect()
}

/// Reason why the seam is weak at a station, without names: those of the kit's pieces are not known yet.
fn reason(model: &PlanModel, plan: &LatticePlan, station: usize, later: PatchId) -> &'static str {
    let s = plan.separation(later).unit();
    let frame = &model.assembly.stations[station];
    let across = if later == model.pieces_at(station)[0] {
        frame.across
    } else {
        -frame.across
    };
    if s.dot(frame.tangent).abs() >= ALONG_SHARE {
        "the later one goes in along the seam, so the connector is shallow"
    } else if s.dot(across) >= BACKWARD_SHARE {
        "the later one leaves towards the earlier, so the connector leans backward"
    } else {
        "the later one bends away from the earlier here, far from what holds it back"
    }
}

/// Reason why no plan was chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ChoiceError {
    /// The search's pool is empty.
    #[error("there is no plan to choose from")]
    NoPlan,
    /// The simulation's system could not be solved.
    #[error("the simulation of the seams cannot be solved: {0}")]
    Solve(#[from] SparseError),
    /// The user asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<ClimbError> for ChoiceError {
    fn from(e: ClimbError) -> Self {
        match e {
            ClimbError::NoPlan => Self::NoPlan,
            ClimbError::Solve(e) => e.into(),
            ClimbError::Cancelled(stop) => stop.into(),
        }
    }
}

//! The plan that holds best among those that the search cannot tell apart, and what is weak about it (Sect.
//! 6.2).

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use shellock_geom::Vec3;
use shellock_geom::sparse::SparseError;
use shellock_mechanics::{Meeting, Opening, Resistance};

use super::{Foreseen, MetricParams, PlanModel, foreseen};
use crate::plan::{FoundPlan, LatticePlan, PlanParams};
use crate::{Cancelled, Cause, ConnectorSizes, Ctx, PatchId, SegmentedSurface, Warning};

/// Plans whose cost is within this share of the best one's are compared by simulation.
///
/// Costs know what the verification asks for and the simulation does not (what carving takes, how firmly pins
/// hold), so it decides among plans of about the same cost only.
const COST_SLACK: f64 = 0.05;

/// Where pieces of all these would rattle too far, plans up to this share above the best one's cost are
/// looked at, too.
const COST_SLACK_FOR_PLAY: f64 = 0.25;

/// Plans whose widest play is within this share of the least are alike.
const PLAY_TIE: f64 = 0.05;

/// Costs that differ by less than this share are the same but for rounding.
const COST_TIE: f64 = 1e-9;

/// Share of `s` along the seam, or towards the earlier piece, from which that is named as the reason why a
/// seam is weak.
const ALONG_SHARE: f64 = 0.7;
const BACKWARD_SHARE: f64 = 0.5;

/// How a plan resists the separation force of 10 N/m, by the surface metric.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Holding {
    /// `Q = −max w d`, mm; higher is better. `None` where pieces come apart in the simulation.
    pub quality_mm: Option<f64>,
    /// Pieces that come apart in the simulation, which knows no friction but the key's; empty where all hold.
    pub loose: Vec<LoosePiece>,
    /// The seams, weakest first; those without a connector are left out. Empty where pieces come apart.
    pub seams: Vec<SeamHolding>,
    /// Plans that were compared.
    pub n_compared: usize,
    /// The play of each piece that was foreseen from the plan: displacement, mm, and turn, degrees; zeros for
    /// the key.
    pub foreseen_play: Vec<[f64; 2]>,
    /// By how many times that is more than the piece may.
    pub foreseen_excess: Vec<f64>,
}

/// A piece that comes apart.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoosePiece {
    /// The piece.
    pub piece: PatchId,
    /// A place in its middle, mm in assembly space.
    pub at: [f64; 3],
}

/// How one pair of pieces resists.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SeamHolding {
    /// The piece installed later.
    pub later: PatchId,
    /// The other one.
    pub earlier: PatchId,
    /// `max w d` along the seam, mm.
    pub score_mm: f64,
    /// How far it opens there, mm.
    pub opening_mm: f64,
    /// Weight `w` of Eq. 4 there.
    pub weight: f64,
    /// The place, mm in assembly space.
    pub at: [f64; 3],
    /// Why it is weak there, for people; it says "the later one" and "the earlier".
    pub reason: String,
}

/// Simulates the plans of the pool that cost about as little as the best one and are not foreseen to rattle;
/// the chosen plan takes the place of `found`'s. Where all of these would, more costly ones are looked at,
/// and those that rattle least are simulated.
///
/// Warns with `comes-apart` where none of them holds without friction, and with `piece-loose` of each piece
/// that hardly anything holds by the estimate of the costs.
pub fn choose(
    ctx: &Ctx<'_>,
    params: &PlanParams,
    surface: &SegmentedSurface,
    sizes: &ConnectorSizes,
    mut found: FoundPlan,
) -> Result<(FoundPlan, Holding), ChoiceError> {
    ctx.stage("which plan holds best", 0)?;
    let model = PlanModel::new(&MetricParams::of_plan(params, sizes), surface, sizes);
    let plans = shortlist(&model, surface, params.clearance_mm, &found);
    let meetings: Vec<Vec<Meeting>> = plans
        .iter()
        .map(|&i| model.meetings(&found.pool[i].plan))
        .collect();
    let key = found.plan.key();
    ctx.check()?;
    let solved = model.surface_model()?.resist_all(&meetings, key.0)?;
    let quality = |i: usize| match &solved[i].resistance {
        Resistance::Holds(opening) => opening.quality_mm,
        Resistance::Separable(parts) => -1e3 * parts.len() as f64,
    };
    // The earlier of equals, which costs less.
    let best = (0..plans.len()).reduce(|best, i| if quality(i) > quality(best) { i } else { best });
    let Some(best) = best else {
        return Err(ChoiceError::NoPlan);
    };
    let chosen = found.pool.remove(plans[best]);
    let Foreseen {
        play: foreseen_play,
        excess: foreseen_excess,
    } = foreseen(
        &model,
        &chosen.plan,
        &meetings[best],
        size_mm(surface),
        params.clearance_mm,
    );
    let holding = holding(&model, &chosen.plan, &meetings[best], &solved[best].resistance);
    let holding = Holding {
        n_compared: plans.len(),
        foreseen_play,
        foreseen_excess,
        ..holding
    };
    if !holding.loose.is_empty() {
        warn_of_parting(ctx, &holding.loose);
    }
    chosen
        .loose
        .iter()
        .for_each(|&piece| warn_of_loose(ctx, &model, piece));
    found.is_optimal &= chosen.score.worst <= found.score.worst * (1.0 + COST_TIE);
    (found.plan, found.score) = (chosen.plan.clone(), chosen.score.clone());
    found.pool.insert(0, chosen);
    Ok((found, holding))
}

/// The plans that are worth a simulation, by their places in the pool.
fn shortlist(
    model: &PlanModel,
    surface: &SegmentedSurface,
    clearance_mm: f64,
    found: &FoundPlan,
) -> Vec<usize> {
    // How far the loosest piece goes beyond what is allowed; 1 for plans in which none does.
    let excess = |&i: &usize| {
        let plan = &found.pool[i].plan;
        let foreseen = foreseen(model, plan, &model.meetings(plan), size_mm(surface), clearance_mm);
        foreseen.excess.into_iter().fold(1.0, f64::max)
    };
    let within = |slack: f64| -> Vec<(usize, f64)> {
        let limit = found.score.worst * (1.0 + slack);
        let plans: Vec<usize> = (0..found.pool.len())
            .filter(|&i| found.pool[i].score.worst <= limit)
            .collect();
        plans.par_iter().map(|i| (*i, excess(i))).collect()
    };
    let least = |plans: &[(usize, f64)]| plans.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
    let mut plans = within(COST_SLACK);
    if least(&plans) > 1.0 {
        plans = within(COST_SLACK_FOR_PLAY);
    }
    let most = least(&plans) * (1.0 + PLAY_TIE);
    plans.into_iter().filter(|p| p.1 <= most).map(|p| p.0).collect()
}

/// The longest side of the model.
fn size_mm(surface: &SegmentedSurface) -> f64 {
    surface.mesh.bounds().size().max_element()
}

fn warn_of_parting(ctx: &Ctx<'_>, loose: &[LoosePiece]) {
    ctx.warn(Warning {
        cause: Cause::ComesApart,
        pieces: loose.iter().map(|part| part.piece).collect(),
        at: loose.first().map(|part| part.at),
    });
}

fn warn_of_loose(ctx: &Ctx<'_>, model: &PlanModel, piece: PatchId) {
    ctx.warn(Warning {
        cause: Cause::PieceLoose,
        pieces: vec![piece],
        at: Some(middle_of(model, piece).to_array()),
    });
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

/// Puts the stations' openings together by pairs of pieces.
fn holding(model: &PlanModel, plan: &LatticePlan, meetings: &[Meeting], resistance: &Resistance) -> Holding {
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

/// Why it is weak there, without names: those of the kit's pieces are not known yet.
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

/// Why no plan was chosen.
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

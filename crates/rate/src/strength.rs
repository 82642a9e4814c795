//! Wall thickness that a fall does not break (Sect. 4.3, Eq. 2).
//!
//! The model falls in a few random orientations. In each, the region that meets the ground stops the model
//! within Δt, while the region on top is held:
//!
//! ```text
//!     ▒▒▒▒▒▒▒    top: held in the mean (see `mechanics::shell`)
//!    ╱       ╲
//!   │  shell  │  │ v = √(2 g h)
//!    ╲       ╱   ▼
//!     ░░░░░░░    bottom: f = m v / Δt upwards, spread by mass
//! ```
//!
//! m is the mass of the whole shell, so the load grows with the thickness H, and σ falls like 1/H where the
//! wall bends. The least H whose stress stays below the material's strength is found on a bracket that
//! shrinks by interpolating log σ over log H.
//!
//! Two rules apply. Where the model is too thin to be hollow with that H it is solid, not a shell: these
//! places do not count (`SolidRegion`). And the decisive stress of a case is the one that all but a small
//! share of the other area stays below. The few worst triangles, in creases and at tips, say more about the
//! mesh than about the model, and their stress grows with every refinement. docs/notes/strength.md shows the
//! effect of that share and of the mesh.

pub mod chart;
mod falls;
mod hollow;
mod thin;
mod wall;

use std::f64::consts::{PI, TAU};

use crate::causes::Cause;
use falls::{Fallen, Falls};
pub use hollow::{Cavity, NoRoom, TooThin};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::remesh::{RemeshParams, remesh};
use shellock_geom::{Solid, TriMesh, Vec3};
pub use shellock_mechanics::Material;
use shellock_mechanics::{LoadCase, ShellError, ShellModel};
use shellock_report::ParamProblem;
use shellock_report::{Cancelled, Ctx, Warning};
pub use thin::SolidRegion;
pub use wall::decide;

use crate::impact::impact_n;

/// Least area of a solid place that is reported, mm².
const TOLD_SOLID_MM2: f64 = 50.0;
/// Width of the bracket at which the search ends, mm.
const RESOLUTION_MM: f64 = 0.05;
/// Greatest number of thicknesses tried in search of one whose stress is low enough.
const MOST_WITHOUT_BRACKET: usize = 4;
/// Number of thicknesses tried after which the search bisects.
const MOST_INTERPOLATED: usize = 6;
/// Points of the coarse mesh, which shows how the stress depends on the thickness.
const COARSE_POINTS: f64 = 2000.0;
/// Points of the fine mesh, whose stress counts; docs/notes/strength.md shows the effect of more.
const FINE_POINTS: f64 = 6000.0;
/// Initial guess of the stress on the fine mesh over that on the coarse one: it is 1.0 to 1.05 on most
/// models.
const USUAL_RATIO: f64 = 1.025;
/// Change of the logarithm of the two meshes' ratio at which the search ends.
const RATIO_TOLERANCE: f64 = 0.01;
/// Greatest numbers of thicknesses tried on the coarse mesh, and on the fine one.
const MOST_TRIED: usize = 30;
const MOST_FINE: usize = 5;
/// Least share of the surface with a cavity below. A model with less is as good as solid, and no wall is
/// computed for it.
const LEAST_HOLLOW: f64 = 0.1;
/// Least share of the thinnest wall's cavity, and of its room for connectors, that any wall must leave. With
/// thicker walls thin legs would be solid and hold nothing, for the sake of a fall that they barely survive.
const LEAST_LEFT: f64 = 0.75;
/// Depth of the cavity below a wall that counts as room for a connector, mm.
const ROOM_MM: f64 = 1.5;
/// Least share of the surface with such room below the wall; a model with less is thin.
const ROOMY: f64 = 0.8;
/// Least difference from the usual least wall at which a thinner one is reported, mm.
const TOLD_THINNER_MM: f64 = 0.1;

/// Loads and limits of the wall. Lengths in mm.
#[derive(Clone, Debug, PartialEq)]
pub struct StrengthParams {
    /// Material that pieces are printed of.
    pub material: Material,
    /// Height of the fall, m. [0.01, 20]; 1.275, which gives the paper's 5 m/s.
    pub drop_m: f64,
    /// Number of orientations. [1, 200]; 12, the paper's.
    pub n_cases: usize,
    /// Seed of the orientations.
    pub seed: u64,
    /// Thinnest wall of a model with room for connectors. [0.4, 5]; 1.6, four lines of an ordinary nozzle:
    /// the two sides of a seam need two lines each.
    pub least_mm: f64,
    /// Thinnest wall of a model with bars or sheets so thin that `least_mm` leaves connectors little room.
    /// [0.4, `least_mm`]; 1.2, three lines.
    pub thin_mm: f64,
    /// Thickest wall to try. [`least_mm`, 20]; 3. The paper tries up to 10 mm and finds 1.9 to 2.8. Thicker
    /// walls leave a figure of 150 mm little cavity, and where 3 mm are too weak, 10 mm rarely suffice
    /// (docs/notes/strength.md).
    pub most_mm: f64,
    /// Wall of a model whose stress is too high with every wall, unless the limits forbid it. [0.4, 20]; 2,
    /// to which people hollow models. A thicker one would break, too, and weigh more.
    pub usual_mm: f64,
    /// Share of the hollow area whose stress may exceed the decisive one. [0, 0.2]; 0.005.
    pub peak_share: f64,
    /// Factor on the number of points of the analysis mesh. [0.1, 20]; 1.
    pub refinement: f64,
}

impl Default for StrengthParams {
    fn default() -> Self {
        let (material, seed) = (Material::default(), 1);
        Self {
            material,
            drop_m: 1.275,
            n_cases: 12,
            seed,
            least_mm: 1.6,
            thin_mm: 1.2,
            most_mm: 3.0,
            usual_mm: 2.0,
            peak_share: 0.005,
            refinement: 1.0,
        }
    }
}

impl StrengthParams {
    /// Adapts the limits to the model: no wall so thick that it leaves too little cavity or room for
    /// connectors, and the least wall as thin as connectors need. `None` where even the thinnest wall leaves
    /// too little cavity.
    fn leaving_cavity(&self, falls: &Falls) -> Option<Self> {
        let hollow_mm2 = |mm: f64| falls.hollow_areas(mm).iter().sum::<f64>();
        let room_mm2 = |mm: f64| hollow_mm2(mm + ROOM_MM);
        let total_mm2 = falls.mesh.area();
        let least_mm = thickest(self.thin_mm, self.least_mm, |mm| {
            room_mm2(mm) >= ROOMY * total_mm2
        });
        let (most_mm2, least_mm2) = (hollow_mm2(least_mm), LEAST_HOLLOW * total_mm2);
        if most_mm2 < least_mm2 {
            return None;
        }
        let cavity_left_mm2 = least_mm2.max(LEAST_LEFT * most_mm2);
        let room_left_mm2 = LEAST_LEFT * room_mm2(least_mm);
        let most_mm = thickest(least_mm, self.most_mm, |mm| {
            hollow_mm2(mm) >= cavity_left_mm2 && room_mm2(mm) >= room_left_mm2
        });
        Some(Self {
            least_mm,
            most_mm,
            ..self.clone()
        })
    }

    /// Lists every value out of range.
    pub fn problems(&self) -> Vec<ParamProblem> {
        [
            ParamProblem::unless_within("drop height", "m", self.drop_m, 0.01, 20.0),
            ParamProblem::unless_within("number of falls", "", self.n_cases as f64, 1.0, 200.0),
            ParamProblem::unless_within("thinnest wall", "mm", self.least_mm, 0.4, 5.0),
            ParamProblem::unless_within(
                "thinnest wall of a thin model",
                "mm",
                self.thin_mm,
                0.4,
                self.least_mm,
            ),
            ParamProblem::unless_within("thickest wall", "mm", self.most_mm, self.least_mm, 20.0),
            ParamProblem::unless_within("usual wall", "mm", self.usual_mm, 0.4, 20.0),
            ParamProblem::unless_within("share of peaks", "", self.peak_share, 0.0, 0.2),
            ParamProblem::unless_within("refinement", "", self.refinement, 0.1, 20.0),
        ]
        .into_iter()
        .flatten()
        .collect()
    }
}

/// The thickest wall between `low_mm` and `high_mm` for which `does` holds, mm. `does` must hold for every
/// thinner wall, too. `low_mm` where it holds for none.
fn thickest(low_mm: f64, high_mm: f64, does: impl Fn(f64) -> bool) -> f64 {
    /// Rounds of bisection: to a hundredth of a millimetre.
    const ROUNDS: usize = 8;
    if does(high_mm) {
        return high_mm;
    }
    let (mut low_mm, mut high_mm) = (low_mm, high_mm);
    for _ in 0..ROUNDS {
        let middle_mm = 0.5 * (low_mm + high_mm);
        if does(middle_mm) {
            low_mm = middle_mm;
        } else {
            high_mm = middle_mm;
        }
    }
    low_mm
}

/// Reason why there is no stress to report.
#[derive(Debug, thiserror::Error)]
pub enum StrengthError {
    /// The shell's equations could not be solved.
    #[error("the wall's stress could not be computed ({0}); choose the thickness yourself")]
    Shell(#[from] ShellError),
    /// There is almost no cavity between two walls.
    #[error(
        "the model is hardly anywhere thicker than two walls of {wall_mm} mm, the thinnest that is made, so \
         there is nothing to hollow out; print it solid, make it larger, or choose a thinner \
         wall"
    )]
    NothingHollow {
        /// Thickness of the thinnest wall, mm.
        wall_mm: f64,
    },
    /// Too little of the model can be hollow.
    #[error(transparent)]
    TooThin(#[from] TooThin),
    /// Connectors have no room behind the thinnest walls.
    #[error(transparent)]
    NoRoom(#[from] NoRoom),
    /// The user asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Stress of one wall thickness.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Tried {
    /// Thickness H of the wall, mm.
    pub thickness_mm: f64,
    /// Decisive stress in the worst case, MPa.
    pub stress_mpa: f64,
}

/// Wall thickness found, and its stress.
#[derive(Clone, Debug, PartialEq)]
pub struct Strength {
    /// Least thickness in the limits whose stress stays below the strength, mm.
    pub thickness_mm: f64,
    /// Thickest wall allowed, mm: none that leaves connectors too little room.
    pub most_mm: f64,
    /// Decisive stress with that thickness, MPa.
    pub stress_mpa: f64,
    /// True where the stress exceeds the strength.
    pub is_too_weak: bool,
    /// True if a search found that the stress of every wall in the limits exceeds the strength. The thickness
    /// found is then the usual one of 2 mm, or the nearest in the limits.
    pub no_wall_bears: bool,
    /// All thicknesses tried, ascending, with the stress on the fine mesh as predicted from the coarse one.
    pub trials: Vec<Tried>,
    /// Decisive orientation: number of the fall, and the direction that is down in it.
    pub decisive_fall: (usize, Vec3),
    /// Place of the decisive stress, mm.
    pub at: Vec3,
    /// Mesh on which stresses were computed.
    pub mesh: TriMesh,
    /// Von Mises stress of each triangle in the decisive fall, MPa.
    pub deciding_mpa: Vec<f64>,
    /// Largest stress of each triangle over all falls, MPa.
    pub largest_mpa: Vec<f64>,
    /// True for triangles with no cavity below.
    pub is_solid: Vec<bool>,
    /// Regions where the model is too thin to be hollow, the largest first.
    pub solid: Vec<SolidRegion>,
}

impl Strength {
    /// Rotates the model, and all directions with it, by `turn`.
    pub fn rotate(mut self, turn: impl Fn(Vec3) -> Vec3) -> Self {
        self.decisive_fall.1 = turn(self.decisive_fall.1);
        self.at = turn(self.at);
        self.mesh.points.iter_mut().for_each(|p| *p = turn(*p));
        self.solid
            .iter_mut()
            .for_each(|r| r.at = turn(r.at.into()).to_array());
        self
    }

    /// Share of the surface with no cavity below, in [0, 1].
    pub fn solid_share(&self) -> f64 {
        let solid = |t: &usize| self.is_solid[*t];
        (0..self.is_solid.len())
            .filter(solid)
            .map(|t| self.mesh.face_area(t))
            .sum::<f64>()
            / self.mesh.area()
    }

    /// Area of the surface with a cavity below, mm².
    pub fn hollow_mm2(&self) -> f64 {
        (1.0 - self.solid_share()) * self.mesh.area()
    }

    /// Warnings for the user: a wall that is too weak, and regions where the model is solid.
    pub fn warnings(&self, params: &StrengthParams) -> Vec<Warning> {
        let weak = self.is_too_weak.then(|| {
            Warning::new(
                Cause::WallTooWeak {
                    thickness_mm: self.thickness_mm,
                    drop_m: params.drop_m,
                    stress_mpa: self.stress_mpa,
                    strength_mpa: params.material.strength_mpa,
                    as_weak_up_to_mm: self.no_wall_bears.then_some(self.most_mm),
                },
                Vec::new(),
                Some(self.at.to_array()),
            )
        });
        let total_mm2: f64 = self.solid.iter().map(|r| r.area_mm2).sum();
        let large = self.solid.first().filter(|r| r.area_mm2 >= TOLD_SOLID_MM2);
        let solid = large.map(|largest| {
            Warning::new(
                Cause::TooThinToHollow {
                    n_places: self.solid.len(),
                    share: total_mm2 / self.mesh.area(),
                    thickness_mm: self.thickness_mm,
                    largest_mm2: largest.area_mm2,
                },
                Vec::new(),
                Some(largest.at),
            )
        });
        weak.into_iter().chain(solid).collect()
    }

    /// Warning that the wall found is thinner than the usual least one, for the sake of connectors; `None` if
    /// not.
    pub fn told_thinner(&self, params: &StrengthParams) -> Option<Warning> {
        let (thickness_mm, usual_mm) = (self.thickness_mm, params.least_mm);
        (thickness_mm < usual_mm - TOLD_THINNER_MM).then_some(Warning::new(
            Cause::WallThinForRoom {
                thickness_mm,
                usual_mm,
            },
            Vec::new(),
            None,
        ))
    }
}

/// Largest stress of all falls, by place.
pub struct StressMap {
    bvh: TriangleBvh,
    largest_mpa: Vec<f64>,
}

impl StressMap {
    /// Indexes the analysis mesh's triangles.
    pub fn new(strength: &Strength) -> Self {
        Self {
            bvh: TriangleBvh::new(&strength.mesh),
            largest_mpa: strength.largest_mpa.clone(),
        }
    }

    /// Largest stress of the triangle nearest to `place`, MPa.
    pub fn at(&self, place: Vec3) -> f64 {
        self.bvh
            .nearest(place, f64::INFINITY)
            .map_or(0.0, |nearest| self.largest_mpa[nearest.face as usize])
    }
}

/// Finds the thickness of the wall of `model` (mm).
///
/// A coarse mesh shows how the stress depends on the thickness. A fine mesh corrects it by a ratio that
/// hardly depends on the thickness.
pub fn thickness(ctx: &Ctx<'_>, params: &StrengthParams, model: &Solid) -> Result<Strength, StrengthError> {
    ctx.stage("thickness", 0)?;
    let falls = |points: f64| Falls::new(params, model, points);
    let (coarse, fine) = rayon::join(|| falls(COARSE_POINTS), || falls(FINE_POINTS));
    let (coarse, fine) = (coarse?, fine?);
    let params = &params
        .leaving_cavity(&coarse)
        .ok_or(StrengthError::NothingHollow {
            wall_mm: params.thin_mm,
        })?;
    let strength_mpa = params.material.strength_mpa;
    let middle_mm = (params.least_mm * params.most_mm).sqrt();
    let mut tried = vec![coarse.worst(middle_mm)?.trial];
    let mut exacts: Vec<Fallen> = Vec::new();
    let (at, ratio) = agree(
        strength_mpa,
        &mut |limit_mpa| estimate(ctx, params, &coarse, &mut tried, limit_mpa),
        &mut |mm| {
            exacts.push(fine.worst(mm)?);
            Ok(exacts[exacts.len() - 1].trial)
        },
    )?;
    let found = exacts.swap_remove(at);
    let is_too_weak = !bears(&found.trial, strength_mpa);
    let corrected = |t: &Tried| Tried {
        stress_mpa: ratio * t.stress_mpa,
        ..*t
    };
    let found = fine.strength(found, is_too_weak, tried.iter().map(corrected).collect());
    Ok(Strength {
        most_mm: params.most_mm,
        no_wall_bears: is_too_weak,
        ..found
    })
}

/// Returns true if a wall withstands the stress, within the error of the analysis.
fn bears(tried: &Tried, strength_mpa: f64) -> bool {
    tried.stress_mpa <= (1.0 + RATIO_TOLERANCE) * strength_mpa
}

/// Lets two meshes agree on a thickness: `estimate` finds one for a limit in MPa on the coarse mesh, `exact`
/// tells its stress on the fine one, and the ratio of both stresses changes the next limit.
///
/// Returns the index of the call of `exact` that counts, and the last ratio. Where the ratio varies with the
/// thickness, the thinnest wall of sufficient strength counts, else the one that was named last.
fn agree(
    strength_mpa: f64,
    estimate: &mut dyn FnMut(f64) -> Result<Tried, StrengthError>,
    exact: &mut dyn FnMut(f64) -> Result<Tried, StrengthError>,
) -> Result<(usize, f64), StrengthError> {
    let mut ratio = USUAL_RATIO;
    let mut exacts: Vec<Tried> = Vec::new();
    let mut last = 0;
    for _ in 0..MOST_FINE {
        let named = estimate(strength_mpa / ratio)?;
        let is_known = |e: &Tried| e.thickness_mm == named.thickness_mm;
        if let Some(known) = exacts.iter().position(is_known) {
            last = known;
            break;
        }
        let told = exact(named.thickness_mm)?;
        let before = ratio;
        // A wall without any load teaches nothing.
        if told.stress_mpa > 0.0 && named.stress_mpa > 0.0 {
            ratio = told.stress_mpa / named.stress_mpa;
        }
        last = exacts.len();
        exacts.push(told);
        if (ratio / before).ln().abs() <= RATIO_TOLERANCE {
            break;
        }
    }
    let thinnest = |i: &usize, j: &usize| exacts[*i].thickness_mm.total_cmp(&exacts[*j].thickness_mm);
    let at = if bears(&exacts[last], strength_mpa) {
        last
    } else {
        (0..exacts.len())
            .filter(|&i| bears(&exacts[i], strength_mpa))
            .min_by(thinnest)
            .unwrap_or(last)
    };
    Ok((at, ratio))
}

/// Thickness that the coarse mesh suggests for a limit of `limit_mpa`, with its stress there. Thicknesses
/// tried on the way are added to `tried`.
fn estimate(
    ctx: &Ctx<'_>,
    params: &StrengthParams,
    coarse: &Falls,
    tried: &mut Vec<Tried>,
    limit_mpa: f64,
) -> Result<Tried, StrengthError> {
    while let Some(next_mm) = next(tried, params, limit_mpa).filter(|_| tried.len() < MOST_TRIED) {
        ctx.check()?;
        insert(tried, coarse.worst(next_mm)?.trial);
    }
    ctx.check()?;
    if let Some(thinnest) = tried.iter().find(|t| t.stress_mpa <= limit_mpa) {
        return Ok(*thinnest);
    }
    let usual_mm = params.usual_mm.clamp(params.least_mm, params.most_mm);
    if let Some(known) = tried.iter().find(|t| t.thickness_mm == usual_mm) {
        return Ok(*known);
    }
    let usual = coarse.worst(usual_mm)?.trial;
    insert(tried, usual);
    Ok(usual)
}

/// Inserts a result, keeping thicknesses ascending.
fn insert(tried: &mut Vec<Tried>, new: Tried) {
    let at = tried.partition_point(|t| t.thickness_mm < new.thickness_mm);
    tried.insert(at, new);
}

/// Computes the stress of a wall of a given thickness, mm.
pub fn stress(
    ctx: &Ctx<'_>,
    params: &StrengthParams,
    model: &Solid,
    thickness_mm: f64,
) -> Result<Strength, StrengthError> {
    ctx.stage("stress", 0)?;
    let shell = Falls::new(params, model, FINE_POINTS)?;
    let found = shell.worst(thickness_mm)?;
    let tried = found.trial;
    Ok(shell.strength(
        found,
        tried.stress_mpa > params.material.strength_mpa,
        vec![tried],
    ))
}

/// The thickness to try next, mm; `None` at the end. First both ends of the range. If even the thickest wall
/// is too weak, a few between, since solid regions do not count. Then inside the bracket about the first
/// thickness within the limit, until that is narrow enough.
fn next(tried: &[Tried], params: &StrengthParams, limit_mpa: f64) -> Option<f64> {
    let (thinnest, thickest) = (tried.first()?, tried.last()?);
    let is_bearable = tried.iter().any(|t| t.stress_mpa <= limit_mpa);
    if !is_bearable && thickest.thickness_mm < params.most_mm {
        return Some(params.most_mm);
    }
    if !is_bearable && tried.len() < MOST_WITHOUT_BRACKET {
        let gaps = tried
            .windows(2)
            .map(|pair| [pair[0].thickness_mm, pair[1].thickness_mm]);
        return gaps
            .max_by(|a, b| (a[1] / a[0]).total_cmp(&(b[1] / b[0])))
            .map(|[a, b]| (a * b).sqrt());
    }
    let first = tried.iter().position(|t| t.stress_mpa <= limit_mpa)?;
    let Some(below) = first.checked_sub(1) else {
        return (thinnest.thickness_mm > params.least_mm).then_some(params.least_mm);
    };
    let (low, high) = (tried[below], tried[first]);
    let width_mm = high.thickness_mm - low.thickness_mm;
    if width_mm <= RESOLUTION_MM {
        return None;
    }
    // The guess is interpolated, and moved a little into the wider side, so that the bracket closes from
    // both.
    let share = (low.stress_mpa / limit_mpa).ln() / (low.stress_mpa / high.stress_mpa).ln();
    let guess_mm = low.thickness_mm * (high.thickness_mm / low.thickness_mm).powf(share.clamp(0.0, 1.0));
    let is_nearer_low = guess_mm - low.thickness_mm < 0.5 * width_mm;
    let moved_mm = guess_mm + RESOLUTION_MM / 3.0 * if is_nearer_low { 1.0 } else { -1.0 };
    // Where stresses do not follow a power of the thickness, interpolation alone would creep.
    let margin_mm = if tried.len() < MOST_INTERPOLATED {
        RESOLUTION_MM / 3.0
    } else {
        0.3 * width_mm
    };
    let margin_mm = margin_mm.min(0.5 * width_mm);
    Some(moved_mm.clamp(low.thickness_mm + margin_mm, high.thickness_mm - margin_mm))
}

#[cfg(test)]
mod tests;

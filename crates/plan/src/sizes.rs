//! Connector sizes for each pair of pieces (Sect. 4.3), chosen by the stress at their boundary and by the
//! room.
//!
//! ```text
//!   D = D_min + min(α max σ, 1) (D_max − D_min)                                      (Eq. 3)
//! ```
//!
//! with σ the largest von Mises stress of any load case at a point of the boundary. The paper leaves α open.
//! Here it is 1 over the material's strength: a boundary that is stressed to the limit gets D_max. A larger α
//! saturates boundaries that are far from failing; a smaller one never reaches D_max, since walls are made so
//! thick that no stress exceeds the strength.
//!
//! Room comes first. A short seam gets no larger connectors than leave it a contact. And there must be room
//! for a channel between the wall of a narrow limb and the opposite wall:
//!
//! ```text
//!   ═══════╤═══════  wall H       t: thickness of the model, along the normal
//!      F│M│ │F                    a channel that leaves straight out is 1.05 D + c deep, and
//!      F│ ┘ │F       cavity      stays c away from the wall opposite: 1.05 D + 2 c ≤ t − 2 H
//!      F└───┘F
//!   ═══════════════  wall H
//! ```
//!
//! Limits: the plan is not known yet, so neither is the angle of a connector, and a channel that leans may be
//! twice as deep. Connectors on the opposite wall are not considered. Connectors that still do not fit are
//! left out or carved, as with any size.

use std::collections::BTreeMap;
use std::str::FromStr;

use crate::causes::Cause;
use crate::causes::SizeLimit;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use shellock_geom::Vec3;
use shellock_geom::bvh::TriangleBvh;
use shellock_mechanics::connector::CHANNEL_DEPTH;
use shellock_report::ParamProblem;
use shellock_report::{Cancelled, Ctx, PatchId, Warning};
use shellock_surface::{Seam, SegmentedSurface};

/// Length of a seam, in connector sizes, with room for a run of 2.5 between the gaps of 1.5 at its ends.
pub const CONTACT_SIZES: f64 = 5.6;
/// Least length of a seam that counts as a contact, in connector sizes, for thin limbs, which have no longer
/// seams. Half round an arm 13 mm thick, runs end where the pin changes sides; below this length none was
/// left.
pub const LEAST_CONTACT_SIZES: f64 = 4.2;
/// Length of a closed seam, in connector sizes: only the run, as it has no ends that need gaps.
const LOOP_SIZES: f64 = 2.5;

/// Share of a pair's seams on which the cavity must have room for the size; elsewhere connectors are left out
/// or carved.
const ROOM_SHARE: f64 = 0.8;
/// Spacing of the places where the cavity is measured, mm: below the smallest connector.
const STEP_MM: f64 = 1.5;
/// Depth below the surface at which rays begin, mm, so that they do not hit their own start.
const BELOW_MM: f64 = 0.01;
/// Least reduction of a size that is reported, mm; users would not care about a smaller one.
const TOLD_FROM_MM: f64 = 0.25;

/// Greatest von Mises stress of all load cases at a point of the outer surface, MPa.
pub type StressField<'a> = &'a (dyn Fn(Vec3) -> f64 + Sync);

/// Depth of a channel below the wall where the piece leaves straight out, mm, with `clearance_mm` between the
/// pin and the floor.
pub fn depth_mm(size_mm: f64, clearance_mm: f64) -> f64 {
    CHANNEL_DEPTH * size_mm + clearance_mm
}

/// Connector size D of every pair of pieces, mm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConnectorSizes {
    default_mm: f64,
    /// Size of each pair, mm, with the lower id first.
    by_pair: BTreeMap<[PatchId; 2], f64>,
}

impl Default for ConnectorSizes {
    fn default() -> Self {
        Self::uniform(SizeChoice::DEFAULT_MM)
    }
}

impl ConnectorSizes {
    /// Gives all pairs one size.
    pub fn uniform(size_mm: f64) -> Self {
        Self {
            default_mm: size_mm,
            by_pair: BTreeMap::new(),
        }
    }

    /// Gives some pairs sizes of their own, named in either order; where a pair is named twice the last one
    /// counts.
    pub fn with_pairs(default_mm: f64, sizes_mm: impl IntoIterator<Item = ([PatchId; 2], f64)>) -> Self {
        let sorted = |([a, b], size_mm): ([PatchId; 2], f64)| ([a.min(b), a.max(b)], size_mm);
        Self {
            default_mm,
            by_pair: sizes_mm.into_iter().map(sorted).collect(),
        }
    }

    /// Sets the size between two pieces, in either order.
    fn set(&mut self, [a, b]: [PatchId; 2], size_mm: f64) {
        self.by_pair.insert([a.min(b), a.max(b)], size_mm);
    }

    /// Limits the sizes of all pairs with `piece` to `most_mm`.
    fn cap(&mut self, piece: PatchId, most_mm: f64) {
        self.by_pair
            .iter_mut()
            .filter(|(pair, _)| pair.contains(&piece))
            .for_each(|(_, mm)| *mm = mm.min(most_mm));
    }

    /// The size between two pieces, in either order, mm.
    pub fn of(&self, a: PatchId, b: PatchId) -> f64 {
        self.by_pair
            .get(&[a.min(b), a.max(b)])
            .copied()
            .unwrap_or(self.default_mm)
    }

    /// The size of pairs without one of their own, mm, such as those that meet only on the inner surface.
    pub fn default_mm(&self) -> f64 {
        self.default_mm
    }

    /// Pairs with a size of their own, the lower id first; sorted.
    pub fn pairs(&self) -> impl Iterator<Item = ([PatchId; 2], f64)> {
        self.by_pair.iter().map(|(pair, size_mm)| (*pair, *size_mm))
    }

    /// The largest size that any pair may have, mm, for which the cavity must have room.
    pub fn largest_mm(&self) -> f64 {
        self.by_pair.values().copied().fold(self.default_mm, f64::max)
    }
}

/// Source of the connector sizes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SizeChoice {
    /// One size for all pairs, mm. [1.5, 6].
    Fixed(f64),
    /// Sizes by stress and by room.
    Auto(SizeRange),
}

/// Range and slope of the sizes of Eq. 3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeRange {
    /// Smallest size D_min, mm, for boundaries without stress. [1.5, 6]; 2, as published.
    pub min_mm: f64,
    /// Largest size D_max, mm. [D_min, 6]; 4, as published.
    pub max_mm: f64,
    /// Slope α, 1/MPa. [0, 10]; 1 over the material's strength where `None`.
    pub alpha_per_mpa: Option<f64>,
}

impl Default for SizeRange {
    fn default() -> Self {
        Self {
            min_mm: 2.0,
            max_mm: 4.0,
            alpha_per_mpa: None,
        }
    }
}

impl Default for SizeChoice {
    fn default() -> Self {
        Self::Fixed(Self::DEFAULT_MM)
    }
}

impl SizeChoice {
    /// Size for all pairs unless another is chosen, mm: its walls come out at 1.1 mm.
    pub const DEFAULT_MM: f64 = 2.5;

    /// The least size that a pair may get, mm.
    ///
    /// Segmentation, which comes before any size, counts a seam as a contact if it has room for this size.
    /// Longer seams get larger connectors, but a seam is a contact if it has room for any size.
    pub fn smallest_mm(&self) -> f64 {
        match self {
            Self::Fixed(size_mm) => *size_mm,
            Self::Auto(range) => range.min_mm,
        }
    }

    /// The size that a pair gets without stress and with enough room, mm.
    pub fn usual_mm(&self) -> f64 {
        match self {
            Self::Fixed(size_mm) => *size_mm,
            Self::Auto(range) => Self::DEFAULT_MM.max(range.min_mm).min(range.max_mm),
        }
    }

    /// Lists every value out of range.
    pub fn problems(&self) -> Vec<ParamProblem> {
        const MM: [f64; 2] = [1.5, 6.0];
        let size = |name, value, least| ParamProblem::unless_within(name, "mm", value, least, MM[1]);
        let problems = match *self {
            Self::Fixed(size_mm) => vec![size("connector size", size_mm, MM[0])],
            Self::Auto(SizeRange {
                min_mm,
                max_mm,
                alpha_per_mpa,
            }) => vec![
                size("smallest connector size", min_mm, MM[0]),
                size("largest connector size", max_mm, MM[0].max(min_mm)),
                alpha_per_mpa
                    .and_then(|a| ParamProblem::unless_within("α of connector sizes", "1/MPa", a, 0.0, 10.0)),
            ],
        };
        problems.into_iter().flatten().collect()
    }
}

impl std::fmt::Display for SizeChoice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Fixed(size_mm) => size_mm.fmt(f),
            Self::Auto(_) => f.write_str("auto"),
        }
    }
}

impl FromStr for SizeChoice {
    type Err = NoSize;

    /// Parses `auto`, or a size in mm.
    fn from_str(text: &str) -> Result<Self, NoSize> {
        if text == "auto" {
            return Ok(Self::Auto(SizeRange::default()));
        }
        text.parse().map(Self::Fixed).map_err(|_| NoSize)
    }
}

/// Error: the text names no size.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("neither \"auto\" nor a number of mm")]
pub struct NoSize;

/// Parameters of choosing sizes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeParams {
    /// Source of the sizes.
    pub choice: SizeChoice,
    /// Wall thickness H, mm. (0, 10].
    pub wall_mm: f64,
    /// Gap between mating faces, mm. [0.03, 0.6].
    pub clearance_mm: f64,
    /// Strength of the material, MPa. > 0; 42 for the paper's resin.
    pub strength_mpa: f64,
}

/// Chosen sizes, and the pairs whose size is smaller than the stress asks for.
#[derive(Clone, Debug, PartialEq)]
pub struct ChosenSizes {
    /// The size of each pair.
    pub sizes: ConnectorSizes,
    /// Pairs whose size was reduced by more than a user would overlook, sorted.
    pub reductions: Vec<LimitedSize>,
    /// Largest size that fits between each pair, mm, the lower id first, and a place of its seam; empty where
    /// the user gives the size.
    most: BTreeMap<[PatchId; 2], (f64, Vec3)>,
    /// Pairs whose connectors are larger than the stress asks for.
    increases: Vec<RaisedSize>,
}

/// A pair whose connectors are larger than by Eq. 3, for the sake of use.
#[derive(Clone, Debug, PartialEq)]
struct RaisedSize {
    pair: [PatchId; 2],
    at: Vec3,
    from_mm: f64,
    to_mm: f64,
    /// Description of the use, as in "where it is …".
    load: &'static str,
}

/// A pair whose connectors are smaller than by Eq. 3.
#[derive(Clone, Debug, PartialEq)]
pub struct LimitedSize {
    /// The pair, the lower id first.
    pub pair: [PatchId; 2],
    /// Middle of the pair's longest seam, mm.
    pub at: Vec3,
    /// Size by Eq. 3, mm.
    pub wanted_mm: f64,
    /// Size that the pair got, mm.
    pub given_mm: f64,
    /// Reason for the reduction: the seam or the cavity.
    pub limit: SizeLimit,
}

/// Size for a greatest stress of `stress_mpa` by Eq. 3, mm in [D_min, D_max]. NaN counts as no stress.
pub fn size_for_stress_mm(range: &SizeRange, strength_mpa: f64, stress_mpa: f64) -> f64 {
    let alpha = range.alpha_per_mpa.unwrap_or(1.0 / strength_mpa);
    // `max` of a number and NaN is the number.
    let share = (alpha * stress_mpa).max(0.0);
    let share = share.min(1.0);
    range.min_mm + share * (range.max_mm - range.min_mm)
}

/// Chooses a size for each pair that shares a seam of `surface`. Without a stress field, stress counts as
/// zero.
///
/// Limited sizes are reported by [`ChosenSizes::tell`], so that a kit reports only those of its own
/// segmentation.
pub fn choose(
    ctx: &Ctx<'_>,
    params: &SizeParams,
    surface: &SegmentedSurface,
    stress_mpa: Option<StressField<'_>>,
) -> Result<ChosenSizes, Cancelled> {
    let range = match &params.choice {
        SizeChoice::Fixed(size_mm) => {
            return Ok(ChosenSizes {
                sizes: ConnectorSizes::uniform(*size_mm),
                reductions: Vec::new(),
                most: BTreeMap::new(),
                increases: Vec::new(),
            });
        }
        SizeChoice::Auto(range) => range,
    };
    ctx.stage("connector sizes", 0)?;
    let mut seams_of: BTreeMap<[PatchId; 2], Vec<Seam>> = BTreeMap::new();
    for seam in surface.seams() {
        seams_of.entry([seam.a, seam.b]).or_default().push(seam);
    }
    let cavity = Cavity {
        bvh: TriangleBvh::new(&surface.mesh),
        far_mm: surface.mesh.bounds().diagonal(),
    };
    let chosen: Vec<(LimitedSize, f64)> = seams_of
        .into_par_iter()
        .map(|(pair, seams)| size_of_pair(params, range, &cavity, (pair, &seams), stress_mpa))
        .collect();
    ctx.check()?;
    let sizes = ConnectorSizes::with_pairs(range.min_mm, chosen.iter().map(|c| (c.0.pair, c.0.given_mm)));
    let most = chosen
        .iter()
        .map(|(c, most_mm)| (c.pair, (*most_mm, c.at)))
        .collect();
    let limited = chosen
        .into_iter()
        .map(|c| c.0)
        .filter(|c| c.wanted_mm - c.given_mm > TOLD_FROM_MM)
        .collect();
    Ok(ChosenSizes {
        sizes,
        reductions: limited,
        most,
        increases: Vec::new(),
    })
}

/// Size of the connectors of a pair with these seams, by the stress there and by what fits, and the largest
/// size that would fit, mm.
fn size_of_pair(
    params: &SizeParams,
    range: &SizeRange,
    cavity: &Cavity,
    (pair, seams): ([PatchId; 2], &[Seam]),
    stress_mpa: Option<StressField<'_>>,
) -> (LimitedSize, f64) {
    let stress = |field: StressField<'_>| {
        seams
            .iter()
            .flat_map(|s| &s.points)
            .map(|p| field(*p))
            .fold(0.0, f64::max)
    };
    let wanted_mm = size_for_stress_mm(range, params.strength_mpa, stress_mpa.map_or(0.0, stress));
    let (seam_mm, at) = longest(seams, params.wall_mm);
    let cavity_mm = cavity.size_that_fits_mm(params, seams);
    let limit = if seam_mm <= cavity_mm {
        SizeLimit::Seam
    } else {
        SizeLimit::Cavity
    };
    let given_mm = wanted_mm.min(seam_mm).min(cavity_mm).max(range.min_mm);
    let limited = LimitedSize {
        pair,
        at,
        wanted_mm,
        given_mm,
        limit,
    };
    (limited, range.max_mm.min(seam_mm).min(cavity_mm).max(given_mm))
}

/// The largest size with which the longest of `seams` is a contact, mm, and the middle of that seam.
fn longest(seams: &[Seam], wall_mm: f64) -> (f64, Vec3) {
    let size_mm = |s: &Seam| s.length_below(wall_mm) / if s.is_loop() { LOOP_SIZES } else { CONTACT_SIZES };
    let sized = seams.iter().map(|s| (size_mm(s), s));
    let longest = sized.reduce(|x, y| if y.0 > x.0 { y } else { x });
    longest.map_or((0.0, Vec3::ZERO), |(size_mm, s)| {
        (size_mm, s.points[s.points.len() / 2])
    })
}

/// Inside of the model, measured by rays.
struct Cavity {
    bvh: TriangleBvh,
    far_mm: f64,
}

impl Cavity {
    /// The largest size for which there is room below [`ROOM_SHARE`] of `seams`, mm; ≤ 0 where there is no
    /// cavity, ∞ where nothing can be measured.
    fn size_that_fits_mm(&self, params: &SizeParams, seams: &[Seam]) -> f64 {
        let mut fits: Vec<f64> = seams
            .iter()
            .flat_map(|seam| seam.resample((seam.length() / STEP_MM).ceil().max(1.0) as usize))
            .filter_map(|(point, normal)| {
                let inwards = -normal.try_normalize()?;
                let (_, on_mm) = self
                    .bvh
                    .first_hit(point + BELOW_MM * inwards, inwards, self.far_mm)?;
                Some(size_within_mm(params, BELOW_MM + on_mm))
            })
            .collect();
        fits.sort_unstable_by(|x, y| y.total_cmp(x));
        let n = (ROOM_SHARE * fits.len() as f64).ceil() as usize;
        fits.get(n.saturating_sub(1)).copied().unwrap_or(f64::INFINITY)
    }
}

/// The largest size whose channel fits in a model `thickness_mm` thick, the clearance away from the opposite
/// wall, mm; may be < 0.
fn size_within_mm(params: &SizeParams, thickness_mm: f64) -> f64 {
    (thickness_mm - 2.0 * (params.wall_mm + params.clearance_mm)) / CHANNEL_DEPTH
}

impl ChosenSizes {
    /// Limits the sizes of all pairs with `piece` to `most_mm`, now and when sizes are raised.
    pub fn cap(&mut self, piece: PatchId, most_mm: f64) {
        self.sizes.cap(piece, most_mm);
        let own = self.most.iter_mut().filter(|(pair, _)| pair.contains(&piece));
        own.for_each(|(_, most)| most.0 = most.0.min(most_mm));
    }

    /// Enlarges the connectors of a pair to the largest size that fits, for the use `load` to the kit.
    /// Returns true if they grew.
    pub fn raise(&mut self, [a, b]: [PatchId; 2], load: &'static str) -> bool {
        /// Least growth that counts as a change, mm.
        const LEAST_MM: f64 = 0.05;
        let pair = [a.min(b), a.max(b)];
        let from_mm = self.sizes.of(a, b);
        let Some(&(to_mm, at)) = self.most.get(&pair).filter(|m| m.0 >= from_mm + LEAST_MM) else {
            return false;
        };
        self.sizes.set(pair, to_mm);
        self.increases.push(RaisedSize {
            pair,
            at,
            from_mm,
            to_mm,
            load,
        });
        true
    }

    /// Warns with `connectors-for-use` of each pair whose connectors are larger than the stress asks for.
    /// Warns with `connector-limited` once for all seams that are too short, and once for all cavities that
    /// are too narrow.
    pub fn tell(&self, ctx: &Ctx<'_>) {
        for raised in &self.increases {
            ctx.warn(Warning::new(
                Cause::ConnectorsForUse {
                    from_mm: raised.from_mm,
                    to_mm: raised.to_mm,
                    load: raised.load.to_owned(),
                },
                raised.pair.to_vec(),
                Some(raised.at.to_array()),
            ));
        }
        for limit in [SizeLimit::Seam, SizeLimit::Cavity] {
            let limited: Vec<&LimitedSize> = self.reductions.iter().filter(|l| l.limit == limit).collect();
            let lost_mm = |l: &LimitedSize| l.wanted_mm - l.given_mm;
            // Ties go to the pair with the lower ids.
            let worst = limited
                .iter()
                .copied()
                .reduce(|x, y| if lost_mm(y) > lost_mm(x) { y } else { x });
            let Some(worst) = worst else { continue };
            let mut pieces: Vec<PatchId> = limited.iter().flat_map(|l| l.pair).collect();
            pieces.sort_unstable();
            pieces.dedup();
            ctx.warn(Warning::new(
                Cause::ConnectorLimited {
                    pair: worst.pair,
                    by: worst.limit,
                    wanted_mm: worst.wanted_mm,
                    given_mm: worst.given_mm,
                    n_others: limited.len() - 1,
                },
                pieces,
                Some(worst.at.to_array()),
            ));
        }
    }
}

#[cfg(test)]
mod tests;

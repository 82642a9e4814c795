//! How pieces move under the loads that people are told of: for pictures, in no file.
//!
//! A kit bears a load up to the first seam that opens too far; what is seen of it is how walls bend and seams
//! open, in proportion to the load, since contacts have no clearance.

use rayon::prelude::*;
use shellock_geom::sparse::SparseError;
use shellock_geom::{TriMesh, Vec3};

use super::rating::{Bench, Rated};
use super::{LoadBorne, PlanModel};
use crate::PatchId;
use crate::handling::{Deed, LoadCase};

/// What people are told that a kit bears, each by the load of its kind that it bears least of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Told {
    /// A press on its top.
    Top,
    /// A press on the highest place above its middle.
    Middle,
    /// A press on one of its sides as it lies.
    Side,
    /// Two fingers where it is narrow.
    GripNarrow,
    /// Two fingers where it is wide.
    GripWide,
    /// A fall onto its feet.
    Feet,
    /// A fall onto any side, its feet included.
    AnySide,
    /// Its weight, held by one piece.
    Lifted,
}

impl Told {
    /// All, in the order in which they are told.
    pub const ALL: [Self; 8] = [
        Self::Top,
        Self::Middle,
        Self::Side,
        Self::GripNarrow,
        Self::GripWide,
        Self::Feet,
        Self::AnySide,
        Self::Lifted,
    ];

    fn is(self, deed: &Deed) -> bool {
        match self {
            Self::Top => *deed == Deed::PressTop,
            Self::Middle => *deed == Deed::PressMiddle,
            Self::Side => matches!(deed, Deed::PressSide { .. }),
            Self::GripNarrow => *deed == Deed::GripNarrow,
            Self::GripWide => *deed == Deed::GripWide,
            Self::Feet => *deed == Deed::FallUpright,
            Self::AnySide => matches!(deed, Deed::Fall { .. } | Deed::FallUpright),
            Self::Lifted => matches!(deed, Deed::Hang { .. }),
        }
    }

    /// The place of its load among `bears`; `None` where no load of the kind has a place on the model.
    pub fn among(self, bears: &[LoadBorne]) -> Option<usize> {
        let factor = |i: &usize| bears[*i].factor.unwrap_or(f64::INFINITY);
        let own = (0..bears.len()).filter(|i| self.is(&bears[*i].deed));
        own.min_by(|a, b| factor(a).total_cmp(&factor(b)))
    }
}

/// The outer surface as mechanics sees it, and how it moves under loads. Lengths in mm, in assembly space.
#[derive(Clone, Debug, Default)]
pub struct Deformed {
    /// Even triangles, fewer than pictures need; points of seams are there once for each piece.
    pub surface: TriMesh,
    /// The piece of each point.
    pub piece_of_point: Vec<PatchId>,
    /// In the order of [`Told::ALL`]; those that have no place on the model are left out, and lifting where
    /// something else gives way before.
    pub loads: Vec<DeformedLoad>,
}

/// One load and what moves.
#[derive(Clone, Debug)]
pub struct DeformedLoad {
    /// As what it is told.
    pub told: Told,
    /// How much of it the kit bears.
    pub borne: LoadBorne,
    /// Where it acts, that nearest to [`LoadBorne::at`] first: what presses, then the floor's answer; both
    /// fingers of a grip.
    pub touches: Vec<Touch>,
    /// How far each point of the surface goes where the load is [`LoadBorne::force_n`]; how the whole moves as
    /// a rigid body is left out.
    pub moved_mm: Vec<Vec3>,
}

/// What acts on the model at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// The middle of the place.
    pub at: Vec3,
    /// The force, N.
    pub force_n: Vec3,
}

impl Deformed {
    /// Of the loads of `bench` that people are told of; `bears` says how much the plan bears of each.
    pub(super) fn of(
        model: &PlanModel,
        bench: &Bench<'_>,
        rated: &Rated<'_>,
        bears: &[LoadBorne],
    ) -> Result<Self, SparseError> {
        let told = Told::ALL.into_iter();
        let least = |bears: &[LoadBorne]| {
            let uses = bears.iter().filter(|b| b.deed.is_use());
            uses.filter_map(|b| b.factor).fold(f64::INFINITY, f64::min)
        };
        let is_told = |&(told, i): &(Told, usize)| {
            told != Told::Lifted || bears[i].factor.is_some_and(|f| f <= least(bears))
        };
        let told: Vec<(Told, usize)> = told
            .filter_map(|t| t.among(bears).map(|i| (t, i)))
            .filter(is_told)
            .collect();
        let load = |&(told, i): &(Told, usize)| {
            Ok(DeformedLoad {
                told,
                borne: bears[i].clone(),
                touches: touches(&model.assembly.points, &bench.cases[i]),
                moved_mm: rated.moved_mm(i)?,
            })
        };
        let loads: Result<Vec<DeformedLoad>, SparseError> = told.par_iter().map(load).collect();
        let loads = loads?;
        let is_known = |l: &DeformedLoad| l.moved_mm.iter().all(|m| m.is_finite());
        Ok(Self {
            surface: TriMesh {
                points: model.assembly.points.clone(),
                triangles: model.assembly.triangles.clone(),
            },
            piece_of_point: model.assembly.part_of_point.iter().map(|&p| PatchId(p)).collect(),
            loads: loads.into_iter().filter(is_known).collect(),
        })
    }
}

/// Where a load acts: all of its forces are along one line, this way or that.
fn touches(points: &[Vec3], case: &LoadCase) -> Vec<Touch> {
    let hardest = case.forces_n.iter().copied();
    let hardest = hardest.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    let along = hardest.unwrap_or_default();
    let touch = |is: fn(f64) -> bool| {
        let own = || {
            points
                .iter()
                .zip(&case.forces_n)
                .filter(|(_, f)| is(f.dot(along)))
        };
        let total: f64 = own().map(|(_, f)| f.length()).sum();
        (total > 0.0).then(|| Touch {
            at: own().map(|(p, f)| f.length() * *p).sum::<Vec3>() / total,
            force_n: own().map(|(_, f)| *f).sum(),
        })
    };
    let both = [touch(|along| along > 0.0), touch(|along| along < 0.0)];
    let mut touches: Vec<Touch> = both.into_iter().flatten().collect();
    touches.sort_by(|a, b| a.at.distance(case.at).total_cmp(&b.at.distance(case.at)));
    touches
}

#[cfg(test)]
mod tests {
    use super::*;

    fn borne(deed: Deed, factor: Option<f64>) -> LoadBorne {
        LoadBorne {
            deed,
            force_n: 70.0,
            at: [0.0; 3],
            factor,
            first: None,
        }
    }

    #[test]
    fn each_kind_is_told_by_the_load_that_is_borne_least_and_what_is_not_there_is_left_out() {
        let side = |factor| {
            let toward = [1.0, 0.0, 0.0];
            borne(Deed::PressSide { toward }, factor)
        };
        let bears = [
            side(None),
            side(Some(2.0)),
            side(Some(1.5)),
            borne(Deed::FallUpright, Some(0.5)),
            borne(
                Deed::Fall {
                    down: [0.0, 0.0, 1.0],
                },
                Some(0.7),
            ),
        ];
        let told: Vec<Option<usize>> = Told::ALL.iter().map(|t| t.among(&bears)).collect();
        assert_eq!(told, [None, None, Some(2), None, None, Some(3), Some(3), None]);
    }

    #[test]
    fn a_press_and_the_floor_act_at_their_middles_and_the_other_way() {
        let points: Vec<Vec3> = (0..4).map(|x| Vec3::new(f64::from(x), 0.0, 0.0)).collect();
        let forces_n = vec![Vec3::Z, Vec3::ZERO, -3.0 * Vec3::Z, Vec3::Z];
        let case = LoadCase {
            deed: Deed::PressTop,
            force_n: 3.0,
            at: points[2],
            forces_n,
        };
        let [press, floor] = touches(&points, &case)[..] else {
            panic!("two places")
        };
        assert_eq!((press.at, press.force_n), (points[2], -3.0 * Vec3::Z));
        assert_eq!(
            (floor.at, floor.force_n),
            (Vec3::new(1.5, 0.0, 0.0), 2.0 * Vec3::Z)
        );
    }
}

//! Motion of the pieces under the reported loads, for pictures; not written to any file.
//!
//! A kit withstands a load up to the first seam that opens too far. Pictures show the bending of walls and
//! the opening of seams, which are proportional to the load, since contacts have no clearance.

use rayon::prelude::*;
use shellock_geom::sparse::SparseError;
use shellock_geom::{TriMesh, Vec3};
use shellock_report::PatchId;

use super::rating::{Bench, Rated};
use super::{LoadBorne, PlanModel};
use crate::handling::{Deed, LoadCase};

/// Kinds of loads that are reported, each by the load of the kind with the least load factor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Told {
    /// A press on the top.
    Top,
    /// A press on the highest place above the middle.
    Middle,
    /// A press on one of the sides, as the kit lies.
    Side,
    /// Two fingers where the kit is narrow.
    GripNarrow,
    /// Two fingers where the kit is wide.
    GripWide,
    /// A fall onto the feet.
    Feet,
    /// A fall onto any side, the feet included.
    AnySide,
    /// The weight of the kit, held by one piece.
    Lifted,
}

impl Told {
    /// All kinds, in the order of reports.
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

    /// Index of the load of this kind in `bears`; `None` where no load of the kind has a place on the model.
    pub fn among(self, bears: &[LoadBorne]) -> Option<usize> {
        let factor = |i: &usize| bears[*i].factor.unwrap_or(f64::INFINITY);
        let own = (0..bears.len()).filter(|i| self.is(&bears[*i].deed));
        own.min_by(|a, b| factor(a).total_cmp(&factor(b)))
    }
}

/// Outer surface of the mechanical model, and its motion under loads. Lengths in mm, in assembly space.
#[derive(Clone, Debug, Default)]
pub struct Deformed {
    /// Even triangles, fewer than pictures need; points of seams occur once for each piece.
    pub surface: TriMesh,
    /// The piece of each point.
    pub piece_of_point: Vec<PatchId>,
    /// Loads in the order of [`Told::ALL`]. Those that have no place on the model are left out, and lifting
    /// where something else fails before.
    pub loads: Vec<DeformedLoad>,
}

/// One load and the motion under it.
#[derive(Clone, Debug)]
pub struct DeformedLoad {
    /// Kind of the load in reports.
    pub kind: Told,
    /// Load factor of the kit under the load.
    pub capacity: LoadBorne,
    /// Places where the load acts, the nearest to [`LoadBorne::at`] first: the press, then the reaction of
    /// the floor; both fingers of a grip.
    pub touches: Vec<Touch>,
    /// Displacement of each point of the surface under the force [`LoadBorne::force_n`], without rigid motion
    /// of the whole.
    pub moved_mm: Vec<Vec3>,
}

/// A force that acts on the model at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Middle of the place.
    pub at: Vec3,
    /// Force at the place, N.
    pub force_n: Vec3,
}

impl Deformed {
    /// Computes the motion under the reported loads of `bench`; `bears` gives the load factors of the plan.
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
                kind: told,
                capacity: bears[i].clone(),
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

/// Places where a load acts. All of its forces are parallel to one line, in either direction.
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

    fn capacity(deed: Deed, factor: Option<f64>) -> LoadBorne {
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
            capacity(Deed::PressSide { toward }, factor)
        };
        let bears = [
            side(None),
            side(Some(2.0)),
            side(Some(1.5)),
            capacity(Deed::FallUpright, Some(0.5)),
            capacity(
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

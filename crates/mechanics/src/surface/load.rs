//! Forces from outside: how far seams open, and how much pins are bent, under many loads on one plan.
//!
//! A load is a force on every point of the outer surface. What of them does not balance accelerates the whole
//! as a rigid body, and the inertia of the walls bears it, spread by area (inertia relief). A part's answer to
//! its own forces, if nothing joined it to others, is one solve with the factor that it has anyway; contacts
//! then see a load as gaps that are there before they bear anything. Without a clearance contacts open in
//! proportion to the load: a load twice as large opens twice as far.

use nalgebra::{SMatrix, SVector};
use shellock_geom::Vec3;
use shellock_geom::sparse::SparseError;

use super::SurfaceModel;
use super::contact::{Contact, N_CONTACTS, TIP};
use super::parts::{N_MOTIONS, mid_wall};
use super::solve::{Balance, Jointed, Load, openings};
use crate::assembly::{Meeting, Opening};
use crate::connector::{PIN_DEPTH, PIN_WIDTH};

/// One load as the stations feel it before anything joins the parts.
#[derive(Clone, Debug)]
pub struct Drift(pub(super) Load);

/// What one load does to a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Bearing {
    /// Distance between the male and the female at each station, mm; 0 where there is no joint.
    pub opening_mm: Vec<f64>,
    /// The largest bending stress in the pin of each station, MPa; 0 where there is no joint.
    pub pin_mpa: Vec<f64>,
    /// Length of each station, mm.
    pub length_mm: Vec<f64>,
    /// Newton steps that it took.
    pub n_iterations: usize,
    /// What is left of the force, as a share of it.
    pub error: f64,
}

/// Which contacts are closed under a load: where to begin with a plan that is nearly the same.
#[derive(Clone, Debug, Default)]
pub struct Closed(Vec<bool>);

impl Closed {
    fn of(balance: &Balance) -> Self {
        Self(balance.borne.iter().map(|b| *b < 0.0).collect())
    }
}

/// The parts joined by a plan. Plans that differ little are made of each other, and loads begin where those of
/// another plan ended.
#[derive(Clone)]
pub struct JoinedParts<'a>(Jointed<'a>);

impl JoinedParts<'_> {
    /// The same parts joined by another plan; those whose seams it leaves alone are not computed again.
    pub fn changed(&self, plan: &[Meeting]) -> Result<Self, SparseError> {
        self.0.changed(plan).map(Self)
    }

    /// What `load` does; `plan` is what they are joined by. The answer does not depend on `closed`, but for
    /// rounding.
    pub fn bear(
        &self,
        plan: &[Meeting],
        load: &Drift,
        closed: Option<&Closed>,
    ) -> Result<(Bearing, Closed), SparseError> {
        let balance = self.0.balance(&load.0, closed.map(|c| &c.0[..]))?;
        let bearing = self.0.model.bearing(plan, &self.0.contacts, &balance);
        Ok((bearing, Closed::of(&balance)))
    }

    /// How far the separation force opens the seams; no part is held, since the pulls of all seams balance.
    pub fn pulled(
        &self,
        plan: &[Meeting],
        closed: Option<&Closed>,
    ) -> Result<(Opening, Closed), SparseError> {
        let model = self.0.model;
        let load = Load::of_pulls(model, plan, &model.pulls(plan));
        let balance = self.0.balance(&load, closed.map(|c| &c.0[..]))?;
        let opening = Opening::rated(plan, openings(model, plan, &balance.moved));
        Ok((opening, Closed::of(&balance)))
    }

    /// How far each point of the outer surface goes under `forces_n` on all of them, mm: with the middle of the
    /// wall below it. How the whole moves as a rigid body, in the mean over the area, is left out where no
    /// points are held: nothing says how far that is.
    ///
    /// One solve a part with the factor that it has. The answer does not depend on `closed`, but for rounding.
    ///
    /// # Panics
    /// Where there is not one force for each point.
    pub fn moved_mm(&self, forces_n: &[Vec3], closed: Option<&Closed>) -> Result<Vec<Vec3>, SparseError> {
        let model = self.0.model;
        let load = model.drift(forces_n).0;
        let balance = self.0.balance(&load, closed.map(|c| &c.0[..]))?;
        let points = mid_wall(&model.params, &model.assembly);
        let balanced_n = model.balanced(&points, forces_n);
        let mut moved_mm = vec![Vec3::ZERO; points.len()];
        for part in &model.parts {
            let own = part.moved(&points, &balanced_n, &balance.sent);
            own.into_iter()
                .for_each(|(v, moved)| moved_mm[v as usize] = moved);
        }
        if !model.is_held {
            model.without_whole(&points, &mut moved_mm);
        }
        Ok(moved_mm)
    }
}

impl SurfaceModel {
    /// What `forces_n` on the points of the outer surface do; where nothing holds the parts, inertia bears
    /// what of them does not balance.
    ///
    /// # Panics
    /// Where there is not one force for each point.
    pub fn drift(&self, forces_n: &[Vec3]) -> Drift {
        let points = mid_wall(&self.params, &self.assembly);
        assert_eq!(forces_n.len(), points.len(), "one force for each point");
        let balanced_n = self.balanced(&points, forces_n);
        let mut drift = vec![[0.0; N_MOTIONS]; self.assembly.stations.len()];
        for part in &self.parts {
            let own = part.drift(&points, &balanced_n);
            for (s, own) in part.stations.iter().zip(own.chunks_exact(N_MOTIONS)) {
                drift[*s as usize].iter_mut().zip(own).for_each(|(d, o)| *d += o);
            }
        }
        Drift(Load {
            sent: vec![[0.0; N_MOTIONS]; drift.len()],
            drift,
            scale_n: forces_n.iter().map(|f| f.length()).sum(),
        })
    }

    /// What each of `loads` does to the parts joined by `plan`; nothing but the model's held points is held.
    pub fn bear(&self, plan: &[Meeting], loads: &[Drift]) -> Result<Vec<Bearing>, SparseError> {
        let joined = self.joined(plan)?;
        loads
            .iter()
            .map(|load| joined.bear(plan, load, None).map(|found| found.0))
            .collect()
    }

    /// The parts joined by `plan`, ready for loads.
    pub fn joined(&self, plan: &[Meeting]) -> Result<JoinedParts<'_>, SparseError> {
        Jointed::new(self, &self.free, plan).map(JoinedParts)
    }

    fn bearing(&self, plan: &[Meeting], contacts: &[Contact], balance: &Balance) -> Bearing {
        let mut pin_mpa = vec![0.0_f64; plan.len()];
        let own = contacts
            .chunks_exact(N_CONTACTS)
            .zip(balance.borne.chunks_exact(N_CONTACTS));
        for (contacts, borne) in own {
            let i = contacts[TIP].station;
            let Some(joint) = plan[i].joint else { continue };
            let length_mm = self.assembly.stations[i].length_mm;
            let root = self.params.contact_n_mm(joint.size_mm, length_mm).sqrt();
            let (depth, thickness) = (PIN_DEPTH * joint.size_mm, PIN_WIDTH * joint.size_mm);
            pin_mpa[i] = 6.0 * (root * borne[TIP]).abs() / length_mm * depth / thickness.powi(2);
        }
        Bearing {
            opening_mm: openings(self, plan, &balance.moved),
            pin_mpa,
            length_mm: self.assembly.stations.iter().map(|s| s.length_mm).collect(),
            n_iterations: balance.n_iterations,
            error: balance.error,
        }
    }

    /// The forces, with the walls' inertia where nothing holds the parts.
    fn balanced(&self, points: &[Vec3], forces_n: &[Vec3]) -> Vec<Vec3> {
        let mut balanced_n = forces_n.to_vec();
        if self.is_held {
            return balanced_n;
        }
        let areas_mm2 = self.assembly.point_areas_mm2();
        let whole = Whole::new(points, &areas_mm2);
        let acceleration = whole.motion(points.iter().zip(forces_n).map(|(p, f)| (*p, *f)));
        for ((p, area), f) in points.iter().zip(&areas_mm2).zip(&mut balanced_n) {
            let modes = whole.modes(*p);
            (0..6).for_each(|a| *f -= acceleration[a] * *area * modes[a]);
        }
        balanced_n
    }

    /// Takes from motions what of them is the whole's, in the mean over the area.
    fn without_whole(&self, points: &[Vec3], moved_mm: &mut [Vec3]) {
        let areas_mm2 = self.assembly.point_areas_mm2();
        let whole = Whole::new(points, &areas_mm2);
        let weighted = points.iter().zip(&areas_mm2).zip(moved_mm.iter());
        let motion = whole.motion(weighted.map(|((p, area), m)| (*p, *area * *m)));
        for (p, m) in points.iter().zip(moved_mm) {
            let modes = whole.modes(*p);
            (0..6).for_each(|a| *m -= motion[a] * modes[a]);
        }
    }
}

/// All walls as one rigid body, their mass that of their area.
struct Whole {
    center: Vec3,
    /// Against [`Self::modes`], mm² and mm² times arms.
    inertia: SMatrix<f64, 6, 6>,
}

impl Whole {
    fn new(points: &[Vec3], areas_mm2: &[f64]) -> Self {
        let total: f64 = areas_mm2.iter().sum();
        let center = points.iter().zip(areas_mm2).map(|(p, a)| *a * *p).sum::<Vec3>() / total;
        let mut whole = Self {
            center,
            inertia: SMatrix::zeros(),
        };
        for (p, area) in points.iter().zip(areas_mm2) {
            let modes = whole.modes(*p);
            for a in 0..6 {
                (0..6).for_each(|b| whole.inertia[(a, b)] += area * modes[a].dot(modes[b]));
            }
        }
        whole
    }

    /// How a point moves with each of three shifts and three turns about the center.
    fn modes(&self, p: Vec3) -> [Vec3; 6] {
        let arm = p - self.center;
        std::array::from_fn(|j| {
            if j < 3 {
                Vec3::AXES[j]
            } else {
                Vec3::AXES[j - 3].cross(arm)
            }
        })
    }

    /// The motion with the same work, in its modes, as `pushes` at points: its acceleration under forces. None
    /// where it is no body.
    fn motion(&self, pushes: impl Iterator<Item = (Vec3, Vec3)>) -> SVector<f64, 6> {
        let mut work = SVector::<f64, 6>::zeros();
        for (p, push) in pushes {
            let modes = self.modes(p);
            (0..6).for_each(|a| work[a] += modes[a].dot(push));
        }
        self.inertia
            .cholesky()
            .map_or(SVector::zeros(), |c| c.solve(&work))
    }
}

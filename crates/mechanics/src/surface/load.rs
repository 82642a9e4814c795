//! External loads: openings of seams and bending of pins, under many loads on one plan.
//!
//! A load is a force on every point of the outer surface. Its unbalanced resultant accelerates the whole
//! assembly as a rigid body and is balanced by the inertia of the walls, spread by area (inertia relief). The
//! response of a free part to its own forces is one solve with its existing factor. Contacts then see a load
//! as initial gaps. Without a clearance, openings are proportional to the load: twice the load opens them
//! twice as far.

use nalgebra::{SMatrix, SVector};
use shellock_geom::Vec3;
use shellock_geom::sparse::SparseError;

use super::SurfaceModel;
use super::contact::{ContactSpring, N_CONTACTS, TIP};
use super::parts::{N_MOTIONS, mid_wall};
use super::solve::{Balance, Jointed, Load, openings};
use crate::assembly::{Meeting, Opening};
use crate::connector::{PIN_DEPTH, PIN_WIDTH};

/// One load, given by the motions that it causes at the stations before the parts are joined.
#[derive(Clone, Debug)]
pub struct Drift(pub(super) Load);

/// Response of a plan to one load.
#[derive(Clone, Debug, PartialEq)]
pub struct Bearing {
    /// Distance between the male and the female at each station, mm; 0 where there is no joint.
    pub opening_mm: Vec<f64>,
    /// Largest bending stress in the pin of each station, MPa; 0 where there is no joint.
    pub pin_mpa: Vec<f64>,
    /// Length of each station, mm.
    pub length_mm: Vec<f64>,
    /// Number of Newton steps taken.
    pub n_iterations: usize,
    /// Residual force, as a share of the force.
    pub error: f64,
}

/// Set of contacts closed under a load, as the starting point for a similar plan.
#[derive(Clone, Debug, Default)]
pub struct Closed(Vec<bool>);

impl Closed {
    fn of(balance: &Balance) -> Self {
        Self(balance.forces.iter().map(|b| *b < 0.0).collect())
    }
}

/// Parts joined by a plan. A similar plan can reuse them, and its loads can start from the contacts closed
/// before.
#[derive(Clone)]
pub struct JoinedParts<'a>(Jointed<'a>);

impl JoinedParts<'_> {
    /// Joins the same parts by another plan. Parts whose seams are unchanged are not computed again.
    pub fn rejoin(&self, plan: &[Meeting]) -> Result<Self, SparseError> {
        self.0.rejoin(plan).map(Self)
    }

    /// Computes the response to `load`, where `plan` is the plan that joins the parts. The result does not
    /// depend on `closed`, except for rounding.
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

    /// Computes the openings under the separation force. No part is held, since the pulls of all seams
    /// balance.
    pub fn pull(&self, plan: &[Meeting], closed: Option<&Closed>) -> Result<(Opening, Closed), SparseError> {
        let model = self.0.model;
        let load = Load::of_pulls(model, plan, &model.pulls(plan));
        let balance = self.0.balance(&load, closed.map(|c| &c.0[..]))?;
        let opening = Opening::rate(plan, openings(model, plan, &balance.motions));
        Ok((opening, Closed::of(&balance)))
    }

    /// Displacement of each point of the outer surface under `forces_n`, mm: that of the mid-wall point below
    /// it. If no points are held, the mean rigid motion over the area is subtracted, because it is
    /// undetermined.
    ///
    /// Takes one solve a part with its existing factor. The result does not depend on `closed`, except for
    /// rounding.
    ///
    /// # Panics
    /// If the number of forces is not the number of points.
    pub fn moved_mm(&self, forces_n: &[Vec3], closed: Option<&Closed>) -> Result<Vec<Vec3>, SparseError> {
        let model = self.0.model;
        let load = model.drift(forces_n).0;
        let balance = self.0.balance(&load, closed.map(|c| &c.0[..]))?;
        let points = mid_wall(&model.params, &model.assembly);
        let balanced_n = model.balance_forces(&points, forces_n);
        let mut moved_mm = vec![Vec3::ZERO; points.len()];
        for part in &model.parts {
            let own = part.displacements(&points, &balanced_n, &balance.sent);
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
    /// Computes the motions caused by `forces_n` on the points of the outer surface. If no points are held,
    /// inertia balances the resultant.
    ///
    /// # Panics
    /// If the number of forces is not the number of points.
    pub fn drift(&self, forces_n: &[Vec3]) -> Drift {
        let points = mid_wall(&self.params, &self.assembly);
        assert_eq!(forces_n.len(), points.len(), "one force for each point");
        let balanced_n = self.balance_forces(&points, forces_n);
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

    /// Computes the response of the parts joined by `plan` to each of `loads`. Only the model's held points
    /// are held.
    pub fn bear(&self, plan: &[Meeting], loads: &[Drift]) -> Result<Vec<Bearing>, SparseError> {
        let joined = self.join(plan)?;
        loads
            .iter()
            .map(|load| joined.bear(plan, load, None).map(|found| found.0))
            .collect()
    }

    /// Joins the parts by `plan`, ready for loads.
    pub fn join(&self, plan: &[Meeting]) -> Result<JoinedParts<'_>, SparseError> {
        Jointed::new(self, &self.free, plan).map(JoinedParts)
    }

    fn bearing(&self, plan: &[Meeting], contacts: &[ContactSpring], balance: &Balance) -> Bearing {
        let mut pin_mpa = vec![0.0_f64; plan.len()];
        let own = contacts
            .chunks_exact(N_CONTACTS)
            .zip(balance.forces.chunks_exact(N_CONTACTS));
        for (contacts, borne) in own {
            let i = contacts[TIP].station;
            let Some(joint) = plan[i].joint else { continue };
            let length_mm = self.assembly.stations[i].length_mm;
            let root = self.params.contact_n_mm(joint.size_mm, length_mm).sqrt();
            let (depth, thickness) = (PIN_DEPTH * joint.size_mm, PIN_WIDTH * joint.size_mm);
            pin_mpa[i] = 6.0 * (root * borne[TIP]).abs() / length_mm * depth / thickness.powi(2);
        }
        Bearing {
            opening_mm: openings(self, plan, &balance.motions),
            pin_mpa,
            length_mm: self.assembly.stations.iter().map(|s| s.length_mm).collect(),
            n_iterations: balance.n_iterations,
            error: balance.error,
        }
    }

    /// Forces plus the inertia forces of the walls, which are added only if no point is held.
    fn balance_forces(&self, points: &[Vec3], forces_n: &[Vec3]) -> Vec<Vec3> {
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

    /// Subtracts the mean rigid motion over the area from the displacements.
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

/// All walls as one rigid body with mass proportional to area.
struct Whole {
    center: Vec3,
    /// Inertia matrix in terms of [`Self::modes`], mm² and mm² times arms.
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

    /// Displacements of a point under each of three translations and three rotations about the centre.
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

    /// Rigid motion with the same work, in its modes, as `pushes` at points: the acceleration under forces.
    /// Zero if the inertia is singular.
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

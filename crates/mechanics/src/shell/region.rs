//! Nodes held in the mean: the reaction that balances a load, and the rigid motion contained in a
//! displacement.

use nalgebra::{Cholesky, Matrix6, Vector6};
use shellock_geom::{Aabb, Vec3};

use super::DOFS;

/// Least ratio of a region's smallest to greatest eigenvalue of inertia, with lengths in units of its size.
/// Below it the region is a line.
const MIN_INERTIA: f64 = 1e-10;

/// Weighted nodes with the inertia of their rigid motions.
pub(super) struct Region {
    nodes: Vec<u32>,
    weights: Vec<f64>,
    center: Vec3,
    /// Unit of length in `inertia`, mm.
    size: f64,
    inertia: Cholesky<f64, nalgebra::U6>,
}

impl Region {
    /// Builds the region; `None` if the nodes lie on a line.
    pub(super) fn new(nodes: Vec<u32>, points: &[Vec3], areas: &[f64]) -> Option<Self> {
        let at = |&v: &u32| points[v as usize];
        let weights: Vec<f64> = nodes.iter().map(|&v| areas[v as usize]).collect();
        let total: f64 = weights.iter().sum();
        let center = nodes
            .iter()
            .zip(&weights)
            .map(|(v, w)| at(v) * (w / total))
            .sum::<Vec3>();
        let mean_sq = nodes
            .iter()
            .zip(&weights)
            .map(|(v, w)| (at(v) - center).length_squared() * (w / total))
            .sum::<f64>();
        let size = mean_sq.sqrt();
        if size == 0.0 {
            return None;
        }
        let mut inertia = Matrix6::zeros();
        for (v, w) in nodes.iter().zip(&weights) {
            for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                // The component along `axis` of the node's displacement is linear in the rigid motion.
                let form = wrench(axis, (at(v) - center) / size);
                inertia += form * form.transpose() * (w / total);
            }
        }
        let eigenvalues = inertia.symmetric_eigenvalues();
        let is_solid = eigenvalues.min() > MIN_INERTIA * eigenvalues.max();
        let weights = weights.into_iter().map(|w| w / total).collect();
        let inertia = inertia.cholesky().filter(|_| is_solid)?;
        Some(Self {
            nodes,
            weights,
            center,
            size,
            inertia,
        })
    }

    fn arm(&self, point: Vec3) -> Vec3 {
        (point - self.center) / self.size
    }

    /// Adds to `loads` the traction on the region that balances the loads on `nodes`. The traction is linear
    /// in position.
    pub(super) fn balance(&self, nodes: &[u32], points: &[Vec3], loads: &mut [f64]) {
        let motion = -self.inertia.solve(&self.resultant(nodes, points, loads));
        for (&v, w) in self.nodes.iter().zip(&self.weights) {
            let force = self.displacement(&motion, points[v as usize]) * *w;
            add(loads, v, 0, force);
        }
    }

    /// Resultant of the loads on `nodes`: force, and moment about the region's centre over the region's size.
    pub(super) fn resultant(&self, nodes: &[u32], points: &[Vec3], loads: &[f64]) -> Vector6<f64> {
        nodes.iter().fold(Vector6::zeros(), |sum, &v| {
            let mut load = wrench(part(loads, v, 0), self.arm(points[v as usize]));
            let moment = part(loads, v, 3) / self.size;
            for axis in 0..3 {
                load[3 + axis] += moment[axis];
            }
            sum + load
        })
    }

    /// Moves `nodes` as a rigid body so that the region's mean displacement and rotation vanish.
    pub(super) fn settle(&self, nodes: &[u32], points: &[Vec3], displacements: &mut [f64]) {
        let moved = self
            .nodes
            .iter()
            .zip(&self.weights)
            .fold(Vector6::zeros(), |sum, (&v, w)| {
                sum + wrench(part(displacements, v, 0) * *w, self.arm(points[v as usize]))
            });
        let motion = -self.inertia.solve(&moved);
        let turn = Vec3::new(motion[3], motion[4], motion[5]) / self.size;
        for &v in nodes {
            add(
                displacements,
                v,
                0,
                self.displacement(&motion, points[v as usize]),
            );
            add(displacements, v, 3, turn);
        }
    }

    fn displacement(&self, motion: &Vector6<f64>, point: Vec3) -> Vec3 {
        let (shift, turn) = (
            Vec3::new(motion[0], motion[1], motion[2]),
            Vec3::new(motion[3], motion[4], motion[5]),
        );
        shift + turn.cross(self.arm(point))
    }
}

/// Returns true if the held degrees of freedom stop all rigid motions of `nodes`. Any other motion causes
/// strain.
pub(super) fn holds(nodes: &[u32], points: &[Vec3], is_held: &[bool]) -> bool {
    let bounds = Aabb::around(nodes.iter().map(|&v| points[v as usize]));
    let mut stopped = Matrix6::zeros();
    for &v in nodes {
        let arm = (points[v as usize] - bounds.center()) / bounds.diagonal();
        let axes = [Vec3::X, Vec3::Y, Vec3::Z];
        let of_moves = axes.map(|axis| wrench(axis, arm));
        let of_turns = axes.map(|axis| Vector6::new(0.0, 0.0, 0.0, axis.x, axis.y, axis.z));
        for (form, is_held) in of_moves
            .into_iter()
            .chain(of_turns)
            .zip(&is_held[v as usize * DOFS..])
        {
            if *is_held {
                stopped += form * form.transpose();
            }
        }
    }
    let eigenvalues = stopped.symmetric_eigenvalues();
    eigenvalues.min() > MIN_INERTIA * eigenvalues.max()
}

fn wrench(force: Vec3, arm: Vec3) -> Vector6<f64> {
    let moment = arm.cross(force);
    Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
}

fn part(values: &[f64], node: u32, first: usize) -> Vec3 {
    Vec3::from_slice(&values[node as usize * DOFS + first..][..3])
}

fn add(values: &mut [f64], node: u32, first: usize, by: Vec3) {
    for (value, by) in values[node as usize * DOFS + first..]
        .iter_mut()
        .zip(by.to_array())
    {
        *value += by;
    }
}

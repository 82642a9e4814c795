//! Solver for one thickness: factorised once, solved for all load cases.

use rayon::prelude::*;
use shellock_geom::Vec3;
use shellock_geom::sparse::Cholesky;

use super::region::{self, Region};
use super::{DOFS, ShellError, ShellModel, THICKNESS_MM};

/// Number of load cases solved together: enough to share each read of the factor, few enough for two threads
/// to share twelve.
const CASES_AT_ONCE: usize = 6;

/// Greatest resultant of the loads on a part without held nodes, over the sum of their sizes, that counts as
/// balanced.
const MAX_UNBALANCE: f64 = 1e-6;

/// Degrees of freedom of a node that are held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Support {
    /// Held point of the mesh.
    pub point: u32,
    /// Held displacements along x, y, z, and rotations about them.
    pub is_held: [bool; DOFS],
}

/// Loads on the shell, and the nodes that hold it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadCase {
    /// Force on each point, N.
    pub forces_n: Vec<Vec3>,
    /// Moment on each point, N·mm; empty if there are none.
    pub moments_n_mm: Vec<Vec3>,
    /// Points held in the mean, weighted by area. Empty if the solver has supports or the loads balance.
    pub anchors: Vec<u32>,
}

/// Displacement and rotation of each point.
#[derive(Clone, Debug, PartialEq)]
pub struct Displacements {
    /// Displacement of each point, mm.
    pub moves_mm: Vec<Vec3>,
    /// Rotation vector of each point, rad; small.
    pub turns_rad: Vec<Vec3>,
}

/// Shell of a given thickness, factorised and ready for load cases.
#[derive(Debug)]
pub struct ShellSolver<'a> {
    pub(super) model: &'a ShellModel,
    pub(super) thickness_mm: f64,
    factor: Cholesky,
    is_held: Vec<bool>,
    /// Points of each connected part. Empty if the solver has supports.
    free_parts: Vec<Vec<u32>>,
}

impl<'a> ShellSolver<'a> {
    pub(super) fn free(model: &'a ShellModel, thickness_mm: f64) -> Result<Self, ShellError> {
        let free_parts = model.parts();
        // Holding all six degrees of freedom of one node in each part is a statically determinate support.
        let supports: Vec<Support> = free_parts
            .iter()
            .map(|p| Support {
                point: p[0],
                is_held: [true; DOFS],
            })
            .collect();
        Ok(Self {
            free_parts,
            ..Self::with_supports(model, thickness_mm, &supports)?
        })
    }

    pub(super) fn with_supports(
        model: &'a ShellModel,
        thickness_mm: f64,
        supports: &[Support],
    ) -> Result<Self, ShellError> {
        if !THICKNESS_MM.contains(&thickness_mm) {
            return Err(ShellError::Thickness(thickness_mm));
        }
        let mut is_held = vec![false; model.points.len() * DOFS];
        for support in supports {
            let dofs = is_held
                .get_mut(support.point as usize * DOFS..)
                .and_then(|d| d.get_mut(..DOFS));
            let dofs = dofs.ok_or(ShellError::MissingSupport(support.point))?;
            dofs.iter_mut()
                .zip(support.is_held)
                .for_each(|(d, held)| *d |= held);
        }
        for part in model.parts() {
            if !region::holds(&part, &model.points, &is_held) {
                return Err(ShellError::Loose(part[0]));
            }
        }
        let mut stiffness = model.pattern.clone();
        let (of_membrane, of_bending) = (thickness_mm, thickness_mm.powi(3));
        let values: Vec<f64> = model
            .pattern
            .places()
            .zip(model.membrane.iter().zip(&model.bending))
            .map(|((row, column), (membrane, bending))| {
                match is_held[row as usize] || is_held[column as usize] {
                    true => f64::from(row == column),
                    false => of_membrane * membrane + of_bending * bending,
                }
            })
            .collect();
        stiffness.values_mut().copy_from_slice(&values);
        let factor = Cholesky::in_order(&model.order, &stiffness)?;
        Ok(Self {
            model,
            thickness_mm,
            factor,
            is_held,
            free_parts: Vec::new(),
        })
    }

    /// Computes the displacements in each load case, in the order of `cases`.
    pub fn solve(&self, cases: &[LoadCase]) -> Result<Vec<Displacements>, ShellError> {
        let groups: Vec<Vec<Displacements>> = cases
            .par_chunks(CASES_AT_ONCE)
            .enumerate()
            .map(|(group, cases)| self.solve_group(group * CASES_AT_ONCE, cases))
            .collect::<Result<_, _>>()?;
        Ok(groups.into_iter().flatten().collect())
    }

    fn solve_group(&self, first: usize, cases: &[LoadCase]) -> Result<Vec<Displacements>, ShellError> {
        let points = &self.model.points;
        let n = points.len() * DOFS;
        let mut values = Vec::with_capacity(n * cases.len());
        let mut regions = Vec::new();
        for (at, case) in (first..).zip(cases) {
            let mut loads = self.loads(at, case)?;
            regions.push(self.balance(at, case, &mut loads)?);
            values.extend(loads);
        }
        self.factor.solve_in_place(&mut values);
        for (displacements, regions) in values.chunks_mut(n).zip(&regions) {
            for (nodes, region) in self.free_parts.iter().zip(regions) {
                region.settle(nodes, points, displacements);
            }
        }
        let vector = |dofs: &[f64]| Vec3::from_slice(dofs);
        Ok(values
            .chunks(n)
            .map(|u| Displacements {
                moves_mm: u.chunks(DOFS).map(|dofs| vector(&dofs[..3])).collect(),
                turns_rad: u.chunks(DOFS).map(|dofs| vector(&dofs[3..])).collect(),
            })
            .collect())
    }

    /// Forces and moments of a load case, six values a node.
    fn loads(&self, at: usize, case: &LoadCase) -> Result<Vec<f64>, ShellError> {
        let want = self.model.points.len();
        let n_moments = if case.moments_n_mm.is_empty() {
            want
        } else {
            case.moments_n_mm.len()
        };
        if let Some(have) = [case.forces_n.len(), n_moments]
            .into_iter()
            .find(|have| *have != want)
        {
            return Err(ShellError::LoadLength { case: at, have, want });
        }
        let mut loads = Vec::with_capacity(want * DOFS);
        for (v, force) in case.forces_n.iter().enumerate() {
            let moment = case.moments_n_mm.get(v).copied().unwrap_or(Vec3::ZERO);
            if !(force.is_finite() && moment.is_finite()) {
                return Err(ShellError::LoadNotFinite {
                    case: at,
                    point: v as u32,
                });
            }
            loads.extend(force.to_array().into_iter().chain(moment.to_array()));
        }
        Ok(loads)
    }

    /// Adds the reactions of the held nodes to `loads`. Returns the region that holds each free part.
    fn balance(&self, at: usize, case: &LoadCase, loads: &mut [f64]) -> Result<Vec<Region>, ShellError> {
        let model = self.model;
        let mut holds = vec![false; model.points.len()];
        for &v in &case.anchors {
            *holds.get_mut(v as usize).ok_or(ShellError::MissingSupport(v))? = true;
        }
        if self.free_parts.is_empty() && !case.anchors.is_empty() {
            return Err(ShellError::HeldTwice { case: at });
        }
        let mut regions = Vec::new();
        for nodes in &self.free_parts {
            let held: Vec<u32> = nodes.iter().copied().filter(|&v| holds[v as usize]).collect();
            let has_own = !held.is_empty();
            let region = Region::new(
                if has_own { held } else { nodes.clone() },
                &model.points,
                &model.areas_mm2,
            )
            .ok_or(ShellError::HeldOnLine { case: at })?;
            if !has_own {
                let total: f64 = nodes
                    .iter()
                    .map(|&v| region.resultant(&[v], &model.points, loads).norm())
                    .sum();
                if region.resultant(nodes, &model.points, loads).norm() > MAX_UNBALANCE * total {
                    return Err(ShellError::Unbalanced {
                        case: at,
                        point: nodes[0],
                    });
                }
            }
            region.balance(nodes, &model.points, loads);
            regions.push(region);
        }
        // A load on a held degree of freedom goes straight into the support.
        loads
            .iter_mut()
            .zip(&self.is_held)
            .filter(|(_, held)| **held)
            .for_each(|(load, _)| *load = 0.0);
        Ok(regions)
    }
}

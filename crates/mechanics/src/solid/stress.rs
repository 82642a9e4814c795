//! Stress samples of a piece: one in each voxel that is mostly material.

use shellock_geom::Vec3;

use super::body::Body;
use super::element::{Elements, N_NODES, von_mises_mpa};
use super::voxels::{N_VOXELS, SIDE};
use crate::stress::StressSample;

/// Least share of material for a voxel to be sampled.
const MOSTLY: f64 = 0.5;

/// Point of a piece where stress is sampled.
pub(super) struct Probe {
    copy: u32,
    xi: Vec3,
    at: Vec3,
    volume_mm3: f64,
    /// True if the point belongs to a connector.
    is_connector: bool,
}

/// Sample points of a body: at the centre of full voxels, and on the surface in voxels that it cuts, where
/// bending stress is largest.
pub(super) fn probes(
    body: &Body,
    elements: &Elements,
    is_connector: &(dyn Fn(Vec3) -> bool + Sync),
) -> Vec<Probe> {
    let voxel_mm = elements.cell_mm / SIDE as f64;
    let mut found = Vec::new();
    for (id, copy) in (0..).zip(&body.cells.copies) {
        for voxel in 0..N_VOXELS {
            let share = f64::from(copy.fills[voxel].share);
            if share < MOSTLY {
                continue;
            }
            let local = [voxel % SIDE, voxel / SIDE % SIDE, voxel / SIDE / SIDE];
            let number: [i64; 3] =
                std::array::from_fn(|k| i64::from(copy.cell[k]) * SIDE as i64 + local[k] as i64);
            let out = outwards(body, number);
            let at = (Vec3::from(number.map(|k| k as f64 + 0.5)) + (share - 0.5) * out) * voxel_mm;
            found.push(Probe {
                copy: id,
                xi: body.xi(id, at),
                at,
                volume_mm3: share * voxel_mm.powi(3),
                is_connector: is_connector(at),
            });
        }
    }
    found
}

/// Unit vector out of the material; zero if the voxel's neighbours are all full.
fn outwards(body: &Body, voxel: [i64; 3]) -> Vec3 {
    let share = |axis: usize, step: i64| {
        let mut at = voxel;
        at[axis] += step;
        body.cells.share_at(at)
    };
    let slope = Vec3::from(std::array::from_fn::<f64, 3, _>(|k| share(k, -1) - share(k, 1)));
    slope.normalize_or_zero()
}

/// Von Mises stress at the sample points of walls and of connectors.
pub(super) fn samples(
    body: &Body,
    elements: &Elements,
    probes: &[Probe],
    displaced: &[f64],
) -> [Vec<StressSample>; 2] {
    let mut found = [Vec::new(), Vec::new()];
    for probe in probes {
        let nodes = &body.cells.copies[probe.copy as usize].nodes;
        let moved: [Vec3; N_NODES] =
            std::array::from_fn(|i| Vec3::from_slice(&displaced[3 * nodes[i] as usize..][..3]));
        found[usize::from(probe.is_connector)].push(StressSample {
            stress_mpa: von_mises_mpa(elements, &moved, probe.xi),
            volume_mm3: probe.volume_mm3,
            at: probe.at,
        });
    }
    found
}

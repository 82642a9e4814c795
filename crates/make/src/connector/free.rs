//! Test of points below the wall: may a piece have material there?

use rayon::prelude::*;
use shellock_geom::Vec3;
use shellock_report::PatchId;

use super::ConnectorParams;
use crate::body::{ShellBodies, ShellGrid};

/// Returns a test of a piece and a point: `None` in or above the wall, else true if connectors of the piece
/// may be there. The point must be clear of its way out and of later pieces' ways, by the clearance.
pub fn is_unobstructed<'a>(
    params: &ConnectorParams,
    grid: &'a ShellGrid,
    shell: &ShellBodies,
) -> impl Fn(PatchId, Vec3) -> Option<bool> + use<'a> {
    let blocked: Vec<Vec<f32>> = shell
        .keep_out
        .as_slice()
        .par_iter()
        .map(|b| b.spread(&grid.band, grid.cutoff_mm()))
        .collect();
    let clearance_mm = params.clearance_mm;
    move |piece, point| {
        let depth = grid.band.sample(&grid.depth, point)?;
        let is_below = depth >= grid.thickness_mm;
        is_below.then(|| {
            grid.band
                .sample(&blocked[usize::from(piece)], point)
                .is_some_and(|b| b + clearance_mm < 0.0)
        })
    }
}

//! Test of points below the wall: may a piece have material there?

use rayon::prelude::*;
use shellock_geom::Vec3;
use shellock_report::PatchId;

use super::ConnectorParams;
use super::profile::{ProfileRect, Section};
use super::station::RunStation;
use crate::body::{ShellBodies, ShellGrid};

/// Least share of a section's sample points that must be free for a connector to be worth making there.
const LEAST_FREE: f64 = 0.6;

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

/// Returns true if both halves have room for most of their section.
pub(super) fn has_room(
    params: &ConnectorParams,
    station: &RunStation,
    male: PatchId,
    female: PatchId,
    is_free: &dyn Fn(PatchId, Vec3) -> Option<bool>,
) -> bool {
    let section = Section::at(params, station);
    let halves: [(PatchId, &[Option<ProfileRect>]); 2] = [(male, &section.male), (female, &section.female)];
    halves.iter().all(|(piece, parts)| {
        let (mut free, mut all) = (0.0, 0.0);
        for part in parts.iter().flatten() {
            for (a, b) in (0..9).map(|i| (f64::from(i % 3), f64::from(i / 3))) {
                let n = part.n0 + (part.n1 - part.n0) * (0.5 + a) / 3.0;
                let s = part.s0 + (part.s1 - part.s0) * (0.5 + b) / 3.0;
                if let Some(ok) = is_free(*piece, station.point + n * station.n + s * station.s) {
                    all += 1.0;
                    free += f64::from(u8::from(ok));
                }
            }
        }
        all > 0.0 && free >= LEAST_FREE * all
    })
}

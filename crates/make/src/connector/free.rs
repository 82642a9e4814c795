//! Test of points below the wall: may a piece have material there?

use rayon::prelude::*;
use shellock_geom::Vec3;
use shellock_report::PatchId;

use super::ConnectorParams;
use super::profile::{ProfileRect, Section};
use super::station::RunStation;
use crate::body::{ShellBodies, ShellGrid};

/// Distance of the points that must be free from a part's sides, as a share of its width: sampled fields
/// round off the edges of walls.
const FROM_SIDE: f64 = 0.16;

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

/// Share of a section that must be free where connectors are carved to the room that they have.
pub(super) const MOST_OF_IT: f64 = 0.6;
/// Share of a section that must be free where it stays whole.
pub(super) const ALL_OF_IT: f64 = 1.0;

/// Returns true if both halves have room for at least `share` of their section, as far as it lies below the
/// wall.
pub(super) fn has_room(
    params: &ConnectorParams,
    station: &RunStation,
    male: PatchId,
    female: PatchId,
    share: f64,
    is_free: &dyn Fn(PatchId, Vec3) -> Option<bool>,
) -> bool {
    let section = Section::at(params, station);
    let halves: [(PatchId, &[Option<ProfileRect>]); 2] = [(male, &section.male), (female, &section.female)];
    halves.iter().all(|(piece, parts)| {
        let places = parts.iter().flatten().flat_map(|part| part.points(FROM_SIDE));
        let (n_free, n) = places
            .filter_map(|[n, s]| is_free(*piece, station.place(n, s)))
            .fold((0, 0), |(n_free, n), is_free| {
                (n_free + u32::from(is_free), n + 1)
            });
        n > 0 && f64::from(n_free) >= share * f64::from(n)
    })
}

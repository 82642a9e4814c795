//! Test of points below the wall: may a piece have material there?

use rayon::prelude::*;
use shellock_geom::Vec3;
use shellock_report::PatchId;

use super::ConnectorParams;
use super::profile::{ProfileRect, Section, WHOLE};
use super::station::RunStation;
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

/// Amount of a section that must be free, as far as it lies below the wall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Needed {
    /// Each part, as far as it counts as [`WHOLE`].
    Whole,
    /// Most of each half; carving removes the rest.
    Most,
}

/// Share of a half that must be free where connectors are carved to the room that they have.
const MOST: f64 = 0.6;

/// Returns true if both halves have as much room as is `needed`.
pub(super) fn has_room(
    params: &ConnectorParams,
    station: &RunStation,
    male: PatchId,
    female: PatchId,
    needed: Needed,
    is_free: &dyn Fn(PatchId, Vec3) -> Option<bool>,
) -> bool {
    let section = Section::at(params, station);
    let halves: [(PatchId, &[Option<ProfileRect>]); 2] = [(male, &section.male), (female, &section.female)];
    halves.iter().all(|(piece, parts)| {
        let is_free = |part: &ProfileRect| -> Vec<bool> {
            let places = part.points().map(|[n, s]| station.place(n, s));
            places.filter_map(|at| is_free(*piece, at)).collect()
        };
        let of_parts: Vec<Vec<bool>> = parts.iter().flatten().map(is_free).collect();
        let has = |share: f64, points: &[bool]| {
            let n_free = points.iter().filter(|is_free| **is_free).count();
            n_free as f64 >= share * points.len() as f64
        };
        let half = of_parts.concat();
        !half.is_empty()
            && match needed {
                Needed::Whole => of_parts.iter().all(|part| has(WHOLE, part)),
                Needed::Most => has(MOST, &half),
            }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::connector::RunShape;

    #[test]
    fn a_section_that_loses_a_corner_is_whole_and_one_that_loses_a_side_is_not() {
        let params = ConnectorParams::default();
        let station = RunStation {
            point: Vec3::ZERO,
            tangent: Vec3::X,
            n: Vec3::Y,
            s: Vec3::Z,
            theta: 0.0,
            depth: 1.0,
            arc_mm: 0.0,
            size_mm: 3.0,
            clearance_mm: 0.12,
            shape: RunShape::Seam,
        };
        let far = Section::at(&params, &station).female[1].expect("a channel has two walls");
        let points: Vec<[f64; 2]> = far.points().collect();
        // Points of the channel's far wall that are not free, by their place in the list, and all else is.
        let has_room = |n_lost: usize, needed| {
            let is_lost = |p: Vec3| {
                points[..n_lost]
                    .iter()
                    .any(|[n, s]| station.place(*n, *s).distance(p) < 1e-9)
            };
            let is_free = |piece: PatchId, p: Vec3| Some(piece == PatchId(1) || !is_lost(p));
            has_room(&params, &station, PatchId(1), PatchId(0), needed, &is_free)
        };
        // Two of 25 points are a corner, five a side, 25 a third of the half.
        assert!(has_room(2, Needed::Whole) && !has_room(5, Needed::Whole));
        assert!(has_room(25, Needed::Most));
        let nothing_free = |piece: PatchId, _| Some(piece == PatchId(1));
        assert!(!super::has_room(
            &params,
            &station,
            PatchId(1),
            PatchId(0),
            Needed::Most,
            &nothing_free
        ));
    }
}

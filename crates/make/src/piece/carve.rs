//! Swept volumes of half connectors, which are carved from other pieces.

use rayon::prelude::*;
use shellock_assembly::LatticeDirection;
use shellock_geom::{Aabb, Vec3, Volume};
use shellock_report::PatchId;

use crate::connector::{ConnectorParams, Half, ProfileRect, Run, RunShape, RunStation, Section};

/// Difference between the clearance and the growth of the socket, mm. The channel's section already keeps the
/// clearance; the difference keeps faces from coinciding.
const SOCKET_SLACK_MM: f64 = 0.01;

/// The corners of one convex cell of a run.
type Cell = [Vec3; 8];

/// Convex cells of one half, grown by `grown_mm`: one for each part of the section between two stations.
/// Every part grows on all sides, lengthwise at the half's ends.
fn cells(params: &ConnectorParams, run: &Run, half: Half, grown_mm: f64) -> Vec<Cell> {
    let has_part = |at: &RunStation| half == Half::Female || at.shape != RunShape::Stop;
    let first = run.stations.iter().position(has_part).unwrap_or(0);
    let last = run.stations.iter().rposition(has_part).unwrap_or(0);
    let ring = |(i, station): (usize, &RunStation)| {
        let section = Section::at(params, station);
        let lengthwise = match i {
            i if i == first => -grown_mm,
            i if i == last => grown_mm,
            _ => 0.0,
        };
        let moved = RunStation {
            point: station.point + lengthwise * station.tangent,
            ..*station
        };
        let corners = |part: &Option<ProfileRect>| part.map(|p| p.grown(grown_mm).corners(&moved));
        match half {
            Half::Male => section.male.iter().map(corners).collect(),
            Half::Female => section.female.iter().map(corners).collect(),
            Half::Corner => vec![corners(&section.corner)],
        }
    };
    let rings: Vec<Vec<Option<[Vec3; 4]>>> = run.stations.iter().enumerate().map(ring).collect();
    let mut cells = Vec::new();
    for pair in rings.windows(2) {
        for (a, b) in pair[0].iter().zip(&pair[1]) {
            if let (Some(a), Some(b)) = (a, b) {
                cells.push([a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]]);
            }
        }
    }
    cells
}

/// Swept volume of a piece's half connectors on its way out.
pub(super) struct SweptVolume {
    pub piece: PatchId,
    cells: Vec<(Cell, Aabb)>,
    along: Vec3,
}

impl SweptVolume {
    /// Collects the swept volume of all half connectors of `piece`.
    pub(super) fn of(
        params: &ConnectorParams,
        runs: &[Run],
        piece: PatchId,
        separation: LatticeDirection,
    ) -> Self {
        let cells = runs
            .iter()
            .flat_map(|run| {
                let grown = run.clearance_mm() - SOCKET_SLACK_MM.min(0.5 * run.clearance_mm());
                let male = (run.male == piece).then(|| cells(params, run, Half::Male, grown));
                let female = (run.female == piece).then(|| cells(params, run, Half::Female, grown));
                male.into_iter().chain(female).flatten()
            })
            .map(|cell| (cell, Aabb::around(cell)))
            .collect();
        Self {
            piece,
            cells,
            along: separation.unit(),
        }
    }

    /// Parts of the swept volume that can meet `room`, each limited to the distances at which it does.
    fn meeting(&self, room: Aabb, far_mm: f64) -> Vec<Volume> {
        self.cells
            .iter()
            .filter_map(|(cell, bounds)| {
                let (from, to) = distances_that_meet(*bounds, self.along, room, far_mm)?;
                let ends: Vec<Vec3> = [from, to]
                    .iter()
                    .flat_map(|t| cell.iter().map(move |c| *c + *t * self.along))
                    .collect();
                Some(Volume::hull(&ends))
            })
            .collect()
    }
}

/// Least and greatest t in [0, `far_mm`] for which `moving + t·along` meets `room`; `None` where it never
/// does.
pub(super) fn distances_that_meet(moving: Aabb, along: Vec3, room: Aabb, far_mm: f64) -> Option<(f64, f64)> {
    let (mut from, mut to) = (0.0f64, far_mm);
    for axis in 0..3 {
        let (low, high) = (
            room.min[axis] - moving.max[axis],
            room.max[axis] - moving.min[axis],
        );
        let speed = along[axis];
        if speed == 0.0 {
            if low > 0.0 || high < 0.0 {
                return None;
            }
        } else {
            let (a, b) = (low / speed, high / speed);
            from = from.max(a.min(b));
            to = to.min(a.max(b));
        }
    }
    (from <= to).then_some((from, to))
}

/// Subtracts from `volume` all that the `swept_volumes` sweep through it.
pub(super) fn subtract_sweeps<'a>(
    volume: &Volume,
    swept_volumes: impl IntoIterator<Item = &'a SweptVolume>,
    far_mm: f64,
) -> Volume {
    let room = volume.bounds();
    let swept_volumes: Vec<&SweptVolume> = swept_volumes.into_iter().collect();
    let swept: Vec<Volume> = swept_volumes
        .par_iter()
        .flat_map_iter(|w| w.meeting(room, far_mm))
        .collect();
    if swept.is_empty() {
        volume.clone()
    } else {
        volume.subtract(&Volume::union_all(swept))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_meets_a_room_exactly_between_two_distances() {
        let cube = |x: f64| Aabb {
            min: Vec3::new(x, 0.0, 0.0),
            max: Vec3::new(x + 1.0, 1.0, 1.0),
        };
        let (from, to) = distances_that_meet(cube(0.0), Vec3::X, cube(5.0), 100.0).unwrap();
        assert_eq!((from, to), (4.0, 6.0));
        assert_eq!(distances_that_meet(cube(0.0), -Vec3::X, cube(5.0), 100.0), None);
        assert_eq!(distances_that_meet(cube(0.0), Vec3::X, cube(5.0), 3.0), None);
        assert_eq!(distances_that_meet(cube(0.0), Vec3::Y, cube(5.0), 100.0), None);
    }
}

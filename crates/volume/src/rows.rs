//! Contact rows of a station: the relative motions that each of them restricts.
//!
//! | row  | where            | along | law                                     |
//! | :--- | :--------------- | :---- | :-------------------------------------- |
//! | 0, 3 | root, tip of pin | n     | closed                                  |
//! | 1, 4 | root, tip of pin | ŝ     | pushes only; closed where friction holds |
//! | 2, 5 | root, tip of pin | u     | free; closed where friction holds       |
//! | 6    | mid-wall         | wall  | pushes only                             |

use shellock_geom::Vec3;
use shellock_mechanics::{Meeting, Side};

use super::VolumeModel;
use super::front::Front;
use super::unknowns::Labels;

/// Index of the row for the walls' faces; those before belong to the connector.
pub(super) const WALL: usize = 6;

/// Constraint that a row imposes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Law {
    /// Gap closed in both directions: δ = 0.
    Both,
    /// Gap may open but not close: δ ≥ 0.
    Push,
    /// Row without any force.
    Free,
}

/// Law of each contact row; it is used only if the row has a side.
pub(super) fn laws(plan: &[Meeting]) -> Vec<Law> {
    let of_station = |meeting: &Meeting| {
        let [along_n, along_s, along_u] = match meeting.joint {
            None => [Law::Free; 3],
            Some(joint) if joint.is_fast => [Law::Both; 3],
            Some(_) => [Law::Both, Law::Push, Law::Free],
        };
        [along_n, along_s, along_u, along_n, along_s, along_u, Law::Push]
    };
    plan.iter().flat_map(of_station).collect()
}

/// Direction in which contact of the walls' faces acts on `side`. They part when b moves along `wall`, or a
/// against it.
pub(super) fn off_the_wall(meeting: &Meeting, side: Side) -> Vec3 {
    if side == Side::A {
        -meeting.wall
    } else {
        meeting.wall
    }
}

impl VolumeModel {
    /// Position of `side` of a station at mid-wall.
    pub(super) fn mid_wall(&self, station: usize, side: Side) -> Vec3 {
        let [outer, inner] = self.faces(station, side).map(|node| self.wall.nodes[node]);
        outer.midpoint(inner)
    }

    /// Wall nodes of a station's point on the outer and on the inner surface.
    fn faces(&self, station: usize, side: Side) -> [usize; 2] {
        let point = self.stations[station].points[side.index()] as usize;
        [point, point + self.params.n_layers * self.wall.depth_mm.len()]
    }

    /// One small front for each station of `part`, which couples the wall's motion at mid-wall to the row.
    /// That motion is the mean of outer and inner surface.
    pub(super) fn wall_fronts(&self, part: u32, plan: &[Meeting], labels: Labels) -> Vec<Front> {
        let sides = self.sides_of_part(part);
        let front = |(station, side): (usize, Side)| {
            let kept = self.faces(station, side).map(|node| self.kept_index[node]);
            let row = labels.row(station, WALL);
            let half = off_the_wall(&plan[station], side).to_array().map(|x| 0.5 * x);
            let mut couplings: Vec<(u32, f64)> = (kept.into_iter().flatten())
                .flat_map(|place| (3 * place..).zip(half))
                .collect();
            couplings.sort_unstable_by_key(|c| c.0);
            (!couplings.is_empty()).then(|| Front::coupling(row, &couplings))
        };
        sides.filter_map(front).collect()
    }

    /// Stations that `part` belongs to, each with its side.
    pub(super) fn sides_of_part(&self, part: u32) -> impl Iterator<Item = (usize, Side)> {
        let of_station = move |(station, parts): (usize, &[u32; 2])| {
            let parts = *parts;
            shellock_mechanics::SIDES
                .into_iter()
                .filter(move |side| parts[side.index()] == part)
                .map(move |side| (station, side))
        };
        self.station_parts.iter().enumerate().flat_map(of_station)
    }
}

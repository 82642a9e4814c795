//! Features of keys alone: detents that click, and a notch to pull at.

use shellock_assembly::{PressFit, PressFitKind};
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{TriMesh, Vec3, Volume};
use shellock_report::PatchId;

use crate::connector::{ConnectorParams, Run, RunStation, Section};

/// Position of the detent on a rail, mm from its back end, so that it presses only on the last millimetres of
/// the way; half its length at the foot and at the top.
const AT_MM: f64 = 1.3;
const FOOT_MM: f64 = 0.9;
const TOP_MM: f64 = 0.3;
/// Depth of the bump's foot in the tongue, and excess size of the dimple, mm.
const ROOT_MM: f64 = 0.2;
const PLAY_MM: f64 = 0.08;
/// Depth of a notch, mm: as deep as possible without the verification taking it for a hole.
const NOTCH_MM: f64 = shellock_assembly::verify::limits::WIDEST_HALF_GAP_MM;
/// Half the notch's length along the slide, and its width, mm.
const NOTCH_HALF_MM: f64 = 1.6;
const NOTCH_WIDTH_MM: f64 = 12.0;
/// Distance above and below the notch's middle in which the surface is looked for, mm.
const NOTCH_LOOK_MM: f64 = 2.0;
/// Greatest unevenness of the surface below a notch, mm.
const NOTCH_UNEVEN_MM: f64 = 0.4;

/// A notch for a fingernail across the key's outer surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grip {
    /// The key that gets the notch.
    pub key: PatchId,
    /// Middle of the notch, near the surface.
    pub at: Vec3,
    /// Unit vector along which the key is pulled.
    pub slide: Vec3,
    /// Outward unit normal of the key's plane.
    pub normal: Vec3,
}

/// A volume added to a piece or cut from it.
pub(super) struct Change {
    pub piece: PatchId,
    pub volume: Volume,
    pub is_added: bool,
}

/// Bumps and dimples of the rails among `runs`; none where `detent_mm` is 0.
pub(super) fn detents(params: &ConnectorParams, runs: &[Run]) -> (Vec<PressFit>, Vec<Change>) {
    let (mut made, mut changes) = (Vec::new(), Vec::new());
    for run in runs.iter().filter(|r| params.detent_mm > 0.0 && r.is_rail()) {
        let station = &run.stations[0];
        let Some(tongue) = Section::at(params, station).male[0] else {
            continue;
        };
        let top = tongue.n1 + station.clearance_mm + params.detent_mm;
        let inset = 0.15 * (tongue.s1 - tongue.s0);
        let (s0, s1) = (tongue.s0 + inset, tongue.s1 - inset);
        let bump = wedge(station, [tongue.n1 - ROOT_MM, top], [s0, s1], 0.0);
        let dimple = wedge(station, [tongue.n1 - ROOT_MM, top], [s0, s1], PLAY_MM);
        changes.push(Change {
            piece: run.male,
            volume: bump,
            is_added: true,
        });
        changes.push(Change {
            piece: run.female,
            volume: dimple,
            is_added: false,
        });
        made.push(PressFit {
            kind: PressFitKind::Detent,
            piece: run.male,
            at: (station.point + AT_MM * station.tangent + tongue.n1 * station.n).to_array(),
            interference_mm: params.detent_mm,
            travel_mm: AT_MM + FOOT_MM,
        });
    }
    (made, changes)
}

/// A roof across the rail, long at its foot and short at its top, grown by `play_mm`.
fn wedge(station: &RunStation, [foot, top]: [f64; 2], [s0, s1]: [f64; 2], play_mm: f64) -> Volume {
    let mut points = Vec::new();
    for (n, half_mm) in [(foot, FOOT_MM), (top + play_mm, TOP_MM)] {
        for s in [s0 - play_mm, s1 + play_mm] {
            for along in [AT_MM - half_mm - play_mm, AT_MM + half_mm + play_mm] {
                points.push(station.point + along * station.tangent + n * station.n + s * station.s);
            }
        }
    }
    Volume::hull(&points)
}

/// The notch, as a cut from the key with the body `body`; `None` where the surface is too uneven.
pub(super) fn notch(grip: &Grip, body: &TriMesh) -> Option<Change> {
    let across = grip.normal.cross(grip.slide);
    // Heights of the surface, seen from outside, all over the place of the notch.
    let surface = TriangleBvh::new(body);
    let height = |along: f64, aside: f64| {
        let from = grip.at + along * grip.slide + aside * across + NOTCH_LOOK_MM * grip.normal;
        surface
            .first_hit(from, -grip.normal, 2.0 * NOTCH_LOOK_MM)
            .map(|(_, far_mm)| NOTCH_LOOK_MM - far_mm)
    };
    let places = (-2..=2).flat_map(|i| (-6..=6).map(move |j| [f64::from(i) / 2.0, f64::from(j) / 6.0]));
    let heights: Option<Vec<f64>> = places
        .map(|[along, aside]| height(along * NOTCH_HALF_MM, aside * 0.5 * NOTCH_WIDTH_MM))
        .collect();
    let heights = heights?;
    let highest = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
    if highest - lowest > NOTCH_UNEVEN_MM {
        return None;
    }
    // The notch is deepest in front, where the nail pushes, and runs out towards the back.
    let mut points = Vec::new();
    for (along, height) in [
        (NOTCH_HALF_MM, lowest - NOTCH_MM),
        (NOTCH_HALF_MM, highest + 1.0),
        (-NOTCH_HALF_MM, highest + 0.1),
    ] {
        for aside in [-0.5, 0.5] {
            points
                .push(grip.at + along * grip.slide + aside * NOTCH_WIDTH_MM * across + height * grip.normal);
        }
    }
    Some(Change {
        piece: grip.key,
        volume: Volume::hull(&points),
        is_added: false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::connector::{RailPart, RunShape};

    #[test]
    fn a_bump_interferes_by_what_was_asked_for_and_not_in_its_dimple() {
        let params = ConnectorParams {
            detent_mm: 0.25,
            ..ConnectorParams::default()
        };
        let station = |arc_mm: f64| RunStation {
            point: arc_mm * Vec3::X,
            tangent: Vec3::X,
            n: Vec3::Y,
            s: Vec3::Z,
            theta: 0.0,
            depth: 1.0,
            arc_mm,
            size_mm: 2.5,
            clearance_mm: params.key_clearance_mm,
            shape: RunShape::Rail(RailPart::Full),
        };
        let run = Run {
            male: PatchId(1),
            female: PatchId(0),
            stations: vec![station(0.0), station(20.0)],
        };
        let (made, changes) = detents(&params, &[run]);
        assert_eq!((made.len(), changes.len()), (1, 2));
        let hanger = Section::at(&params, &station(0.0)).female[1].unwrap();
        let (bump, dimple) = (&changes[0].volume, &changes[1].volume);
        assert!((bump.bounds().max.y - hanger.n0 - 0.25).abs() < 1e-9);
        assert!(
            bump.subtract(dimple).volume() < 1e-6 && dimple.bounds().max.y < hanger.n1 - params.min_wall_mm
        );
    }

    #[test]
    fn a_notch_is_cut_into_a_flat_key_and_left_out_of_a_bent_one() {
        let plate = |bend: f64| {
            let at = |x: i32, y: i32| {
                let (x, y) = (0.5 * f64::from(x), 0.5 * f64::from(y));
                Vec3::new(x, y, bend * x * x)
            };
            let mut mesh = TriMesh::default();
            for (x, y) in (-20..20).flat_map(|x| (-20..20).map(move |y| (x, y))) {
                let first = mesh.points.len() as u32;
                mesh.points
                    .extend([at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)]);
                mesh.triangles
                    .extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
            }
            mesh
        };
        let grip = Grip {
            key: PatchId(3),
            at: Vec3::new(0.1, 0.1, 0.3),
            slide: Vec3::X,
            normal: Vec3::Z,
        };
        let cut = notch(&grip, &plate(0.0)).unwrap();
        assert!((cut.volume.bounds().min.z + NOTCH_MM).abs() < 1e-9 && !cut.is_added);
        assert!(notch(&grip, &plate(0.3)).is_none());
        // A plane with as few triangles as possible.
        let corners = [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]].map(|[x, y]| Vec3::new(x, y, 0.0));
        let coarse = TriMesh {
            points: corners.into(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        };
        assert!(notch(&grip, &coarse).is_some());
        // This notch reaches over the plate's edge.
        assert!(
            notch(
                &Grip {
                    at: Vec3::new(8.5, 0.0, 0.0),
                    ..grip
                },
                &coarse
            )
            .is_none()
        );
    }
}

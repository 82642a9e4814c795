//! Friction ribs, which hold a key that pulls out and has no rails to click on.
//!
//! A rib stands on the key's side of a seam or of a connector, below the rim, along the way out, and reaches
//! a little beyond the other piece's side. Pressed in, ribs are flattened or bend the walls, and their
//! friction keeps the key in its seat.

use shellock_assembly::{PressFit, PressFitKind};
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::clearance::{Scope, Shape, Translation, swept_gap};
use shellock_geom::{Solid, TriMesh, Vec3, Volume};
use shellock_report::PatchId;

use super::key_parts::Change;

/// Length of a rib along the way out, half its width at the foot and at the top, and the depth of its foot in
/// the key, mm.
const LENGTH_MM: f64 = 1.8;
const FOOT_MM: f64 = 0.5;
const TOP_MM: f64 = 0.15;
const ROOT_MM: f64 = 0.2;
/// Length over which both ends taper, mm.
const LEAD_MM: f64 = 0.5;
/// Sizes of ribs, relative to these lengths: smaller ones stand where the larger leave room, as on the short
/// sides of connectors.
const SCALES: [f64; 2] = [1.0, 0.6];
/// Greatest number of ribs, and least distance between two, mm.
const MOST: usize = 6;
const APART_MM: f64 = 6.0;
/// Greatest lean of the key's side from the way out, as |n·s|.
const MOST_ACROSS: f64 = 0.2;
/// Greatest gap to the other side, mm, and the amounts by which the gap at a rib's corners may be smaller or
/// larger than at its middle.
const WIDEST_GAP_MM: f64 = 0.4;
const NEARER_MM: f64 = 0.02;
const FARTHER_MM: f64 = 0.1;
/// Amount beyond its interference by which a rib may cross a piece on its way, mm; beyond that its place is
/// unsuitable.
const DEEPER_MM: f64 = 0.02;
/// Greatest number of places that are measured exactly.
const MOST_MEASURED: usize = 60;
/// Step and greatest length of the way over which rubbing is measured, mm.
const TRAVEL_STEP_MM: f64 = 0.5;
const MOST_TRAVEL_MM: f64 = 100.0;
/// Spacing of the places tried on a side, mm.
const STEP_MM: f64 = 0.8;

/// Surroundings of the ribs: the key and all other pieces.
pub(super) struct Seat<'a> {
    /// The key and its finished mesh.
    pub key: PatchId,
    pub mesh: &'a TriMesh,
    /// All other pieces, for rays.
    pub others: &'a TriangleBvh,
    /// Shapes of all other pieces, one each, for exact gaps.
    pub shapes: &'a [Shape],
    /// Unit vector of the key's way out.
    pub along: Vec3,
    /// Least depth below the model's surface, mm; above it is the rim.
    pub least_depth_mm: f64,
}

/// A place where a rib can stand.
#[derive(Clone, Copy)]
struct Place {
    at: Vec3,
    normal: Vec3,
    gap_mm: f64,
    /// Size of the rib, one of [`SCALES`].
    scale: f64,
}

/// Ribs that press by `interference_mm` on the pieces around the key, spread over its seams; none where no
/// side lies along the way out. `depth` gives the depth below the model's surface, mm.
pub(super) fn ribs(
    interference_mm: f64,
    seat: &Seat<'_>,
    depth: impl Fn(Vec3) -> f64,
) -> (Vec<PressFit>, Vec<Change>) {
    let fits = |p: &Place| has_intended_press(seat, p, interference_mm);
    let mut places = Vec::new();
    for scale in SCALES {
        spread(&mut places, candidates(seat, &depth, scale), fits);
    }
    let fit = |p: &Place| PressFit {
        kind: PressFitKind::Rib,
        piece: seat.key,
        at: p.at.to_array(),
        interference_mm,
        travel_mm: travel_mm(seat, p, interference_mm),
    };
    let change = |p: &Place| Change {
        piece: seat.key,
        volume: rib(p, seat.along, p.gap_mm + interference_mm),
        is_added: true,
    };
    (
        places.iter().map(fit).collect(),
        places.iter().map(change).collect(),
    )
}

/// Returns true if the rib, measured over its whole way and against all pieces, crosses none of them deeper
/// than intended.
fn has_intended_press(seat: &Seat<'_>, place: &Place, interference_mm: f64) -> bool {
    let Ok(rib) = Solid::new(rib(place, seat.along, place.gap_mm + interference_mm).to_mesh()) else {
        return false;
    };
    let rib = Shape::new(&rib);
    let way_out = Translation {
        along: seat.along,
        from_mm: 0.0,
        far_mm: f64::INFINITY,
    };
    let gap = |other: &Shape| swept_gap(&rib, other, &way_out, Scope::Everything, DEEPER_MM);
    seat.shapes
        .iter()
        .filter_map(gap)
        .all(|gap| gap.gap_mm >= -(interference_mm + DEEPER_MM))
}

/// Length of the way in over which a rib rubs, mm.
fn travel_mm(seat: &Seat<'_>, place: &Place, interference_mm: f64) -> f64 {
    let rubs = |t: &f64| {
        let top = place.at + (t + place.scale * (0.5 * LENGTH_MM - LEAD_MM)) * seat.along;
        seat.others
            .first_hit(top, place.normal, place.gap_mm + interference_mm)
            .is_some()
    };
    let steps = (0..=(MOST_TRAVEL_MM / TRAVEL_STEP_MM) as usize).map(|i| i as f64 * TRAVEL_STEP_MM);
    steps.rev().find(rubs).unwrap_or(0.0) + place.scale * LENGTH_MM
}

/// Places with room for a rib of size `scale`.
fn candidates(seat: &Seat<'_>, depth: &impl Fn(Vec3) -> f64, scale: f64) -> Vec<Place> {
    let gap = |p: Vec3, normal: Vec3| Some(seat.others.first_hit(p, normal, WIDEST_GAP_MM + ROOT_MM)?.1);
    let mut found = Vec::new();
    for face in 0..seat.mesh.triangles.len() {
        let [a, b, c] = seat.mesh.corners(face);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        if normal == Vec3::ZERO || normal.dot(seat.along).abs() > MOST_ACROSS {
            continue;
        }
        for at in grid_on([a, b, c]) {
            if depth(at) < seat.least_depth_mm {
                continue;
            }
            let Some(gap_mm) = gap(at, normal).filter(|mm| *mm < WIDEST_GAP_MM) else {
                continue;
            };
            let across = seat.along.cross(normal).normalize_or_zero();
            let corners = [(-0.5, -1.0), (-0.5, 1.0), (0.5, -1.0), (0.5, 1.0)];
            let goes_on = corners.into_iter().all(|(l, w)| {
                let corner = at + scale * (l * LENGTH_MM * seat.along + w * FOOT_MM * across);
                // The ray starts inside the key, so that a side that leans over is seen too.
                let apart = gap(corner - ROOT_MM * normal, normal).map(|mm| mm - ROOT_MM - gap_mm);
                depth(corner) >= seat.least_depth_mm
                    && apart.is_some_and(|mm| (-NEARER_MM..FARTHER_MM).contains(&mm))
            });
            if goes_on {
                found.push(Place {
                    at,
                    normal,
                    gap_mm,
                    scale,
                });
            }
        }
    }
    found
}

/// Points about [`STEP_MM`] apart inside a triangle; its centroid where it is small.
fn grid_on([a, b, c]: [Vec3; 3]) -> impl Iterator<Item = Vec3> {
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let n = (longest / STEP_MM).ceil().clamp(1.0, 200.0) as usize;
    let middle = move |i: usize, j: usize| {
        [
            (i as f64 + 1.0 / 3.0) / n as f64,
            (j as f64 + 1.0 / 3.0) / n as f64,
        ]
    };
    let inside = move |[u, v]: &[f64; 2]| u + v < 1.0;
    let pairs = (0..n).flat_map(move |i| (0..n - i).map(move |j| middle(i, j)));
    pairs
        .filter(inside)
        .map(move |[u, v]| a + u * (b - a) + v * (c - a))
}

/// Adds places that fit to those `chosen`, up to [`MOST`] in all, each as far as possible from those before,
/// the first as far as possible from the middle.
fn spread(chosen: &mut Vec<Place>, places: Vec<Place>, fits: impl Fn(&Place) -> bool) {
    let middle = places.iter().map(|p| p.at).sum::<Vec3>() / places.len().max(1) as f64;
    let to_chosen = |chosen: &[Place], p: &Place| {
        let apart = chosen.iter().map(|other| p.at.distance(other.at));
        apart.reduce(f64::min)
    };
    let apart = |p: &Place| to_chosen(&*chosen, p).unwrap_or_else(|| p.at.distance(middle));
    let mut apart_mm: Vec<f64> = places.iter().map(apart).collect();
    for _ in 0..MOST_MEASURED {
        let farthest = (0..places.len()).max_by(|&i, &j| apart_mm[i].total_cmp(&apart_mm[j]).then(j.cmp(&i)));
        let is_far = |i: &usize| chosen.is_empty() || apart_mm[*i] >= APART_MM * places[*i].scale;
        let Some(best) = farthest.filter(is_far) else {
            break;
        };
        if apart_mm[best] == f64::NEG_INFINITY || chosen.len() == MOST {
            break;
        }
        if !fits(&places[best]) {
            apart_mm[best] = f64::NEG_INFINITY;
            continue;
        }
        chosen.push(places[best]);
        for (mm, place) in apart_mm.iter_mut().zip(&places) {
            if *mm != f64::NEG_INFINITY {
                *mm = to_chosen(&*chosen, place).unwrap_or(0.0);
            }
        }
    }
}

/// A roof along the way out whose ridge is `height_mm` above the key's side.
fn rib(place: &Place, along: Vec3, height_mm: f64) -> Volume {
    let across = along.cross(place.normal).normalize_or_zero();
    let along = place.normal.cross(across);
    let mut points = Vec::new();
    let (foot_mm, top_mm) = (place.scale * FOOT_MM, place.scale * TOP_MM);
    let (length_mm, lead_mm) = (place.scale * LENGTH_MM, place.scale * LEAD_MM);
    for (height, half_width, half_length) in [
        (-ROOT_MM, foot_mm, 0.5 * length_mm),
        (height_mm, top_mm, 0.5 * length_mm - lead_mm),
    ] {
        for (s, t) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
            points.push(place.at + s * half_width * across + t * half_length * along + height * place.normal);
        }
    }
    Volume::hull(&points)
}

#[cfg(test)]
mod tests {
    use shellock_testkit::shapes::cuboid;

    use super::*;

    /// Ribs of a block of 20 mm in a tray that is 0.1 mm wider on each side; the block leaves upwards.
    fn ribs_of_a_block(least_depth_mm: f64) -> (Vec<PressFit>, Vec<Change>) {
        let tray =
            cuboid([-5.0, -5.0, -5.0], [25.0, 25.0, 10.0]).subtract(&cuboid([-0.1; 3], [20.1, 20.1, 11.0]));
        let others = TriangleBvh::new(&tray.to_mesh());
        let mesh = cuboid([0.0; 3], [20.0, 20.0, 10.0]).to_mesh();
        let shapes = [Shape::new(&Solid::new(tray.to_mesh()).unwrap())];
        let seat = Seat {
            key: PatchId(4),
            mesh: &mesh,
            others: &others,
            shapes: &shapes,
            along: Vec3::Z,
            least_depth_mm,
        };
        ribs(0.08, &seat, |p| 10.0 - p.z)
    }

    #[test]
    fn ribs_press_by_what_was_asked_for_on_all_sides_along_the_way_and_not_on_the_floor() {
        let (fits, changes) = ribs_of_a_block(1.5);
        assert_eq!((fits.len(), changes.len()), (MOST, MOST));
        for change in &changes {
            let b = change.volume.bounds();
            let beyond = [-b.min.x, -b.min.y, b.max.x - 20.0, b.max.y - 20.0]
                .into_iter()
                .fold(0.0, f64::max);
            assert!((beyond - 0.18).abs() < 1e-9, "{b:?}");
            assert!(b.min.z > -1.0 && b.max.z < 8.5 + 1e-9);
        }
        // Each rib rubs from where its upper end passes the tray's rim.
        for (fit, change) in fits.iter().zip(&changes) {
            let way_mm = 10.0 - change.volume.bounds().min.z;
            assert!(
                (fit.travel_mm - way_mm).abs() < 2.0 * TRAVEL_STEP_MM + LEAD_MM,
                "{} {way_mm}",
                fit.travel_mm
            );
        }
        let sides: Vec<bool> = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y]
            .map(|side| {
                changes
                    .iter()
                    .any(|c| (c.volume.bounds().center() - Vec3::splat(10.0)).dot(side) > 9.0)
            })
            .to_vec();
        assert!(sides.iter().filter(|s| **s).count() >= 3, "{sides:?}");
    }

    /// The tray's walls lean in above the block's top: a rib that fits at its place would be torn off on the
    /// way in.
    #[test]
    fn there_are_none_that_cross_something_on_their_way() {
        let collar = cuboid([-5.0, -5.0, 10.5], [25.0, 25.0, 12.0])
            .subtract(&cuboid([-0.1, -0.1, 10.0], [20.1, 20.1, 13.0]));
        let narrow = cuboid([-5.0, -5.0, 14.0], [-0.02, 25.0, 15.0]);
        let tray =
            cuboid([-5.0, -5.0, -5.0], [25.0, 25.0, 10.0]).subtract(&cuboid([-0.1; 3], [20.1, 20.1, 11.0]));
        let all = [tray, collar, narrow];
        let mesh = cuboid([0.0; 3], [20.0, 20.0, 10.0]).to_mesh();
        let others = TriangleBvh::new(&all[0].to_mesh());
        let shapes = all
            .each_ref()
            .map(|volume| Shape::new(&Solid::new(volume.to_mesh()).unwrap()));
        let seat = Seat {
            key: PatchId(4),
            mesh: &mesh,
            others: &others,
            shapes: &shapes,
            along: Vec3::Z,
            least_depth_mm: 1.5,
        };
        let (fits, changes) = ribs(0.08, &seat, |p| 10.0 - p.z);
        assert!(
            !fits.is_empty() && changes.iter().all(|c| c.volume.bounds().min.x > -0.1),
            "none on the narrow side"
        );
    }

    #[test]
    fn smaller_ribs_stand_where_sides_are_too_short_for_larger_ones() {
        // Of the sides, 1.4 mm below the rim are left.
        let (fits, changes) = ribs_of_a_block(8.6);
        assert_eq!(fits.len(), MOST);
        let height_mm = |c: &Change| c.volume.bounds().size().z;
        assert!(
            changes
                .iter()
                .all(|c| (height_mm(c) - SCALES[1] * LENGTH_MM).abs() < 1e-9)
        );
    }

    #[test]
    fn there_are_none_where_the_sides_are_all_rim() {
        assert!(ribs_of_a_block(20.0).0.is_empty());
    }
}

//! Parts of a piece that are too thin to print well: sheets of material, and slots within one piece.

use std::collections::HashMap;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{Aabb, TriMesh, Vec3};

use super::sample::{self, Sample};

/// Number of rays shot into a piece. The share is known to 1 % (two sigma at one half).
const N_SAMPLES: usize = 10_000;
/// Cosine of the greatest angle between two sides of a wall; beyond 30° they form an edge, which is always
/// thin.
const COS_WALL: f64 = 0.866_025_403_784_438_6;
/// Start of the ray below the surface, mm: more than rounding to single precision, less than any wall.
const START_MM: f64 = 1e-4;
/// Seed of the random numbers, the same for every piece.
const SEED: u64 = 0x7468_696e;

/// Result of [`thin_share`] for one piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinShare {
    /// Volume in walls thinner than the limit, over the piece's volume, in [0, 1].
    pub share: f64,
    /// Thinnest wall found: its place on the surface and its thickness, mm. `None` if no wall is too thin.
    pub worst: Option<([f64; 3], f64)>,
}

/// Share of a closed mesh's volume in walls thinner than `min_wall_mm`, and the thinnest place found.
///
/// Rays go inwards from 10 000 surface points. A ray counts if it meets, within `min_wall_mm`, a surface that
/// faces away within 30°. Each side of a wall owns half its volume. An empty mesh has no thin walls.
pub fn thin_share(mesh: &TriMesh, min_wall_mm: f64) -> ThinShare {
    let samples = sample::on_surface(mesh, N_SAMPLES, SEED);
    let volume = mesh.signed_volume();
    if samples.is_empty() || volume <= 0.0 {
        return ThinShare {
            share: 0.0,
            worst: None,
        };
    }
    let bvh = TriangleBvh::new(mesh);
    let walls_mm: Vec<Option<f64>> = samples
        .par_iter()
        .map(|s| {
            let inwards = -s.normal;
            let (face, distance) =
                bvh.first_hit(s.point + inwards * START_MM, inwards, min_wall_mm - START_MM)?;
            (mesh.face_normal(face as usize).dot(inwards) >= COS_WALL).then_some(distance + START_MM)
        })
        .collect();
    let mut worst: Option<([f64; 3], f64)> = None;
    let mut sum_mm = 0.0;
    for (sample, wall_mm) in samples.iter().zip(&walls_mm) {
        let Some(wall_mm) = *wall_mm else { continue };
        sum_mm += wall_mm;
        if worst.is_none_or(|w| wall_mm < w.1) {
            worst = Some((sample.point.to_array(), wall_mm));
        }
    }
    let share = 0.5 * sum_mm * mesh.area() / samples.len() as f64 / volume;
    ThinShare {
        share: share.min(1.0),
        worst,
    }
}

/// Number of rays per mm² for places: a place as long as [`LEAST_LENGTH_MM`] and a quarter as wide is met by
/// six.
const RAYS_PER_MM2: f64 = 6.0;
/// Greatest number of rays of one piece, in each direction.
const MOST_RAYS: usize = 300_000;
/// Cosine of the greatest angle between the two sides of a sheet or a slot; beyond 15° they form an edge or a
/// notch.
const COS_SHEET: f64 = 0.965_925_826_289_068_3;
/// Distance below which points belong to the same place, mm: three mean distances between rays.
const JOINED_MM: f64 = 1.2;
/// Least length of a reported place, mm, and least number of rays that meet it.
const LEAST_LENGTH_MM: f64 = 2.0;
const LEAST_RAYS: usize = 4;

/// Kind of a feature that is too thin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ThinKind {
    /// Sheet of material between two faces: it may break off.
    Sheet,
    /// Slot between two faces of one piece: it may fuse.
    Slot,
}

/// Place where a piece is too thin to print well.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ThinFeature {
    /// Kind of the feature: sheet or slot.
    pub kind: ThinKind,
    /// Length of the place, mm: the diagonal of its bounds.
    pub length_mm: f64,
    /// Median thickness of the place, mm.
    pub thickness_mm: f64,
    /// Point of the place that is nearest to its centre, mm.
    pub at: [f64; 3],
}

/// Finds sheets of material thinner than `least_wall_mm` and slots narrower than `least_slot_mm` within one
/// piece, 2 mm or longer; the longest first.
///
/// From points on the surface, one ray goes inwards and one outwards. If a ray meets, within the limit, a
/// face that is parallel within 15°, the point is thin. Thin points of one kind less than 1.2 mm apart form
/// one place.
pub fn thin_places(mesh: &TriMesh, least_wall_mm: f64, least_slot_mm: f64) -> Vec<ThinFeature> {
    let all = thin_points(mesh, [least_wall_mm, least_slot_mm]);
    let mut places: Vec<ThinFeature> = all.iter().map(|members| feature(members)).collect();
    places.sort_by(|a, b| b.length_mm.total_cmp(&a.length_mm));
    places
}

/// Point of the surface across which a piece is thin.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ThinPoint {
    kind: ThinKind,
    at: Vec3,
    /// Distance to the other side, mm.
    thickness_mm: f64,
}

/// Finds the points of the sheets and slots that [`thin_places`] reports, for given limits (mm, 0 for none).
/// The order is arbitrary, but equal for equal meshes.
fn thin_points(mesh: &TriMesh, limits_mm: [f64; 2]) -> Vec<Vec<ThinPoint>> {
    let n = ((mesh.area() * RAYS_PER_MM2) as usize).min(MOST_RAYS);
    if n == 0 {
        return Vec::new();
    }
    let samples = sample::on_surface(mesh, n, SEED);
    let bvh = TriangleBvh::new(mesh);
    let found = |kind: ThinKind, sense: f64, limit_mm: f64| {
        let point = |s: &Sample| {
            let across = sense * s.normal;
            let (face, on_mm) = bvh.first_hit(s.point + across * START_MM, across, limit_mm)?;
            let opposed = -s.normal.dot(mesh.face_normal(face as usize));
            // Faces that touch there form an edge, not a sheet.
            (opposed >= COS_SHEET && on_mm > 10.0 * START_MM).then_some(ThinPoint {
                kind,
                at: s.point,
                thickness_mm: on_mm + START_MM,
            })
        };
        if limit_mm <= 0.0 {
            return Vec::new();
        }
        group(&samples.par_iter().filter_map(point).collect::<Vec<_>>())
    };
    let [least_wall_mm, least_slot_mm] = limits_mm;
    let mut places = [
        found(ThinKind::Sheet, -1.0, least_wall_mm),
        found(ThinKind::Slot, 1.0, least_slot_mm),
    ]
    .concat();
    places.retain(|members| members.len() >= LEAST_RAYS && bounds(members).diagonal() >= LEAST_LENGTH_MM);
    places
}

fn bounds(members: &[ThinPoint]) -> Aabb {
    Aabb::around(members.iter().map(|m| m.at))
}

/// Summarises the points of one place.
fn feature(members: &[ThinPoint]) -> ThinFeature {
    let bounds = bounds(members);
    let middle = bounds.center();
    let far = |m: &&ThinPoint| m.at.distance_squared(middle);
    let nearest = members
        .iter()
        .min_by(|a, b| far(a).total_cmp(&far(b)))
        .expect("a place has points");
    let mut thicknesses: Vec<f64> = members.iter().map(|m| m.thickness_mm).collect();
    thicknesses.sort_unstable_by(f64::total_cmp);
    ThinFeature {
        kind: nearest.kind,
        length_mm: bounds.diagonal(),
        thickness_mm: thicknesses[thicknesses.len() / 2],
        at: nearest.at.to_array(),
    }
}

/// Groups of points linked by steps of [`JOINED_MM`], in the order of their first points.
fn group(points: &[ThinPoint]) -> Vec<Vec<ThinPoint>> {
    let cube = |p: Vec3| (p / JOINED_MM).floor().to_array().map(|x| x as i32);
    let mut members: HashMap<[i32; 3], Vec<usize>> = HashMap::new();
    for (i, p) in points.iter().enumerate() {
        members.entry(cube(p.at)).or_default().push(i);
    }
    let mut is_seen = vec![false; points.len()];
    let mut groups = Vec::new();
    for seed in 0..points.len() {
        if std::mem::replace(&mut is_seen[seed], true) {
            continue;
        }
        let (mut group, mut next) = (vec![seed], 0);
        while next < group.len() {
            let p = points[group[next]].at;
            let [i, j, k] = cube(p);
            let around = (0..27).map(|at| [i + at / 9 - 1, j + at / 3 % 3 - 1, k + at % 3 - 1]);
            for &other in around.filter_map(|c| members.get(&c)).flatten() {
                if !is_seen[other] && points[other].at.distance(p) < JOINED_MM {
                    is_seen[other] = true;
                    group.push(other);
                }
            }
            next += 1;
        }
        groups.push(group.into_iter().map(|i| points[i]).collect());
    }
    groups
}

#[cfg(test)]
mod tests {
    use shellock_geom::{Vec3, Volume};
    use shellock_testkit::shapes::cuboid;

    use super::*;

    #[test]
    fn the_thin_part_of_a_block_with_a_fin_is_the_fin() {
        // 1000 mm³ of block, 10 × 10 × 0.5 = 50 mm³ of fin.
        let mesh = cuboid([0.0; 3], [10.0; 3])
            .union(&cuboid([0.0, 4.0, 10.0], [10.0, 4.5, 20.0]))
            .to_mesh();
        let thin = thin_share(&mesh, 0.8);
        assert!((thin.share - 50.0 / 1050.0).abs() < 0.003, "{thin:?}");
        let (at, wall_mm) = thin.worst.unwrap();
        assert!((wall_mm - 0.5).abs() < 1e-3 && at[2] > 9.9, "{thin:?}");
        assert_eq!(
            thin_share(&mesh, 0.4),
            ThinShare {
                share: 0.0,
                worst: None
            }
        );
    }

    #[test]
    fn a_sharp_wedge_is_no_thin_wall() {
        let wedge = Volume::hull(&[
            Vec3::ZERO,
            Vec3::new(10.0, 0.0, 0.0),
            Vec3::new(10.0, 7.0, 0.0),
            Vec3::new(0.0, 0.0, 9.0),
            Vec3::new(10.0, 0.0, 9.0),
            Vec3::new(10.0, 7.0, 9.0),
        ]);
        assert_eq!(thin_share(&wedge.to_mesh(), 0.8).share, 0.0);
        assert_eq!(thin_share(&TriMesh::default(), 0.8).share, 0.0);
    }

    #[test]
    fn a_fin_and_a_slot_are_found_with_their_lengths_and_a_wall_and_a_wedge_are_not() {
        let block = cuboid([0.0; 3], [12.0, 10.0, 6.0]);
        let fin = cuboid([2.0, 1.0, 6.0], [10.0, 1.3, 8.0]);
        let slot = cuboid([-1.0, 6.0, 4.0], [13.0, 6.15, 7.0]);
        let mesh = block.union(&fin).subtract(&slot).to_mesh();
        let places = thin_places(&mesh, 0.4, 0.2);
        let kinds: Vec<ThinKind> = places.iter().map(|p| p.kind).collect();
        assert_eq!(kinds, [ThinKind::Slot, ThinKind::Sheet], "{places:?}");
        let near = |a: f64, b: f64, by: f64| (a - b).abs() < by;
        let [slot, fin] = places[..] else { unreachable!() };
        assert!(near(slot.length_mm, 12.0f64.hypot(2.0), 0.7) && near(slot.thickness_mm, 0.15, 1e-6));
        assert!(near(fin.length_mm, 8.0f64.hypot(2.0), 0.7) && near(fin.thickness_mm, 0.3, 1e-6));
        assert!(near(slot.at[1], 6.07, 0.1) && near(fin.at[1], 1.15, 0.2));
        assert_eq!(thin_places(&mesh, 0.25, 0.1), []);
        assert_eq!(thin_places(&TriMesh::default(), 1.0, 1.0), []);
    }
}

//! Places where finished pieces face each other, and the gaps between them.

use std::collections::BTreeMap;

use rayon::prelude::*;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{Solid, TriMesh, Vec3};

/// Longest edge of the triangles whose centroids are sampled, mm: half of the distance between contacts.
const SAMPLE_MM: f64 = 1.0;
/// Greatest cosine of the angle between the normals of faces that press on each other.
const OPPOSED: f64 = -0.5;
/// Least cosine between a face's normal and the direction to the nearest point. A point nearest round a
/// corner is not ahead.
const AHEAD: f64 = 0.7;
/// Distance below which the direction to the nearest point is only rounding error, mm.
const AT_ONE_PLACE_MM: f64 = 0.02;
/// Overlap above which pieces overlap on purpose, mm: half of the least interference of a press fit.
/// Coordinates of files are rounded to less than 10⁻⁴ mm.
const PRESSED_MM: f64 = 0.005;

/// Place where part 1 keeps part 0 from moving along the normal once the gap is closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Part whose face was sampled, and the part that it faces.
    pub parts: [u32; 2],
    /// Point on each of the two parts, mm.
    pub at: [Vec3; 2],
    /// Unit normal out of part 0 into part 1.
    pub normal: Vec3,
    /// Gap between the two parts, mm, ≥ 0.
    pub gap_mm: f64,
    /// Area of the face that the place represents, mm².
    pub area_mm2: f64,
    /// True if the parts are pressed into each other on purpose, and so hold in all directions.
    pub is_fast: bool,
}

/// Sample of a face: position, outward normal and area.
struct FaceSample {
    at: Vec3,
    normal: Vec3,
    area_mm2: f64,
}

/// Calls `each` with the centroids of a face's triangles, subdivided until they are small.
fn spots(mesh: &TriMesh, face: usize, each: &mut impl FnMut(FaceSample)) {
    let [a, b, c] = mesh.corners(face);
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let n = (longest / SAMPLE_MM).ceil().max(1.0) as usize;
    let area = mesh.double_area_vector(face);
    let Some(normal) = area.try_normalize() else {
        return;
    };
    let area_mm2 = area.length() / 2.0 / (n * n) as f64;
    let at = |i: f64, j: f64| a + (b - a) * (i / n as f64) + (c - a) * (j / n as f64);
    let third = 1.0 / 3.0;
    for i in 0..n {
        for j in 0..n - i {
            let (x, y) = (i as f64, j as f64);
            each(FaceSample {
                at: at(x + third, y + third),
                normal,
                area_mm2,
            });
            if i + j + 1 < n {
                each(FaceSample {
                    at: at(x + 2.0 * third, y + 2.0 * third),
                    normal,
                    area_mm2,
                });
            }
        }
    }
}

/// Finds places where parts face each other within `reach_mm`: one for each box of `spacing_mm` and facing
/// direction. Each is the nearest place in its box, with the area of all.
pub(super) fn touches(parts: &[Solid], reach_mm: f64, spacing_mm: f64) -> Vec<Touch> {
    let trees: Vec<TriangleBvh> = parts.par_iter().map(|p| TriangleBvh::new(p.mesh())).collect();
    let pairs: Vec<[usize; 2]> = (0..parts.len())
        .flat_map(|a| (a + 1..parts.len()).map(move |b| [a, b]))
        .filter(|[a, b]| {
            let reach = parts[*a].mesh().bounds().grown(reach_mm);
            reach.intersects(parts[*b].mesh().bounds())
        })
        .collect();
    pairs
        .par_iter()
        .flat_map(|&[a, b]| [[a, b], [b, a]])
        .map(|[a, b]| between(parts, &trees[b], [a, b], reach_mm, spacing_mm))
        .collect::<Vec<_>>()
        .concat()
}

fn between(
    parts: &[Solid],
    tree: &TriangleBvh,
    [a, b]: [usize; 2],
    reach_mm: f64,
    spacing_mm: f64,
) -> Vec<Touch> {
    let (mesh, other) = (parts[a].mesh(), parts[b].mesh());
    let near = other.bounds().grown(reach_mm);
    let mut boxes: BTreeMap<[i64; 4], Touch> = BTreeMap::new();
    for face in 0..mesh.triangles.len() {
        let corners = mesh.corners(face);
        if !shellock_geom::Aabb::around(corners).intersects(near) {
            continue;
        }
        spots(mesh, face, &mut |spot| {
            let its = |face: u32| other.double_area_vector(face as usize).try_normalize();
            let nearest = tree.nearest(spot.at, reach_mm * reach_mm);
            let beside = nearest.and_then(|hit| common_normal(&spot, hit.point, its(hit.face)?));
            // The nearest point may lie beside the sample, while another face lies in front of it.
            let ahead = || {
                let (face, far_mm) = tree.first_hit(spot.at, spot.normal, reach_mm)?;
                common_normal(&spot, spot.at + far_mm * spot.normal, its(face)?)
            };
            let Some((normal, gap_mm)) = beside.or_else(ahead) else {
                return;
            };
            let touch = Touch {
                parts: [a as u32, b as u32],
                at: [spot.at, spot.at + gap_mm * normal],
                normal,
                gap_mm: gap_mm.max(0.0),
                // Half of the area, since both parts are sampled.
                area_mm2: spot.area_mm2 / 2.0,
                is_fast: gap_mm < -PRESSED_MM,
            };
            let [x, y, z] = (spot.at / spacing_mm).to_array().map(|x| x.floor() as i64);
            boxes
                .entry([x, y, z, way(normal)])
                .and_modify(|old| {
                    let area_mm2 = old.area_mm2 + touch.area_mm2;
                    if (touch.is_fast, -touch.gap_mm) > (old.is_fast, -old.gap_mm) {
                        *old = touch;
                    }
                    old.area_mm2 = area_mm2;
                })
                .or_insert(touch);
        });
    }
    boxes.into_values().collect()
}

/// Common normal of two faces, and the gap along it, negative if they overlap. `None` if they do not face
/// each other.
fn common_normal(spot: &FaceSample, hit: Vec3, its: Vec3) -> Option<(Vec3, f64)> {
    if spot.normal.dot(its) > OPPOSED {
        return None;
    }
    let (to, normal) = (hit - spot.at, (spot.normal - its).normalize());
    let gap_mm = to.dot(normal);
    let is_ahead = to.length() < AT_ONE_PLACE_MM || gap_mm.abs() >= AHEAD * to.length();
    is_ahead.then_some((normal, gap_mm))
}

/// Index of the nearest of six axis directions of a normal.
fn way(normal: Vec3) -> i64 {
    let axis = (0..3).fold(0, |best, k| {
        if normal[k].abs() > normal[best].abs() {
            k
        } else {
            best
        }
    });
    2 * axis as i64 + i64::from(normal[axis] > 0.0)
}

//! Slits: narrow gaps between parts of a solid's surface that face each other.

use rayon::prelude::*;

use crate::bvh::TriangleBvh;
use crate::check::Groups;
use crate::topology::Topology;
use crate::{Aabb, Solid, TriMesh, Vec3};

/// Cosine of the greatest angle between both sides of a slit.
const COS_SLIT: f64 = 0.866_025_403_784_438_6;
/// Height above the surface at which a ray starts, as a share of the width requested: more than rounding.
const START_SHARE: f64 = 1e-6;
/// Approximate number of test points, beside one per triangle. Large triangles have several, so that a slit
/// of a hundredth of the size is found.
const N_POINTS: f64 = 20_000.0;
/// Least ratio of a slit's depth to the width requested; creases of 15° and more are shallower.
const LEAST_DEPTHS: f64 = 4.0;
/// Least area of a slit, mm²: smaller ones are scratches, less than a connector takes.
const LEAST_MM2: f64 = 4.0;

/// A slit in the surface of a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slit {
    /// Area of one side of the slit, mm².
    pub area_mm2: f64,
    /// Median width by area, mm.
    pub width_mm: f64,
    /// Midpoint between both sides at a place of that width, mm.
    pub at: Vec3,
}

/// A point of the surface that faces another part of it.
struct Facing {
    face: u32,
    other: u32,
    width_mm: f64,
    area_mm2: f64,
    at: Vec3,
}

/// Finds the slits narrower than `below_mm`, largest first.
///
/// Width is measured straight outwards to a surface that faces back within 30°. O(n log n); the same on any
/// number of threads.
pub fn slits(solid: &Solid, below_mm: f64) -> Vec<Slit> {
    let mesh = solid.mesh();
    let facing = find_facings(mesh, below_mm);
    let mut groups = Groups::of(mesh.triangles.len());
    let mut is_facing = vec![false; mesh.triangles.len()];
    for f in &facing {
        is_facing[f.face as usize] = true;
        groups.unite(f.face, f.other);
    }
    let topology = Topology::new(solid);
    for f in &facing {
        for next in topology
            .neighbours(f.face)
            .into_iter()
            .filter(|&n| is_facing[n as usize])
        {
            groups.unite(f.face, next);
        }
    }
    let mut named: Vec<(u32, &Facing)> = facing.iter().map(|f| (groups.find(f.face), f)).collect();
    named.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.width_mm.total_cmp(&b.1.width_mm)));
    let mut found: Vec<Slit> = named
        .chunk_by(|a, b| a.0 == b.0)
        .filter_map(|slit| join(slit, below_mm))
        .collect();
    found.sort_by(|a, b| b.area_mm2.total_cmp(&a.area_mm2));
    found
}

/// Combines facing points, sorted by width, into a slit; `None` if they are a crease or a scratch.
fn join(points: &[(u32, &Facing)], below_mm: f64) -> Option<Slit> {
    let both_mm2: f64 = points.iter().map(|(_, f)| f.area_mm2).sum();
    let area_mm2 = 0.5 * both_mm2;
    let length_mm = Aabb::around(points.iter().map(|(_, f)| f.at)).diagonal();
    if area_mm2 < LEAST_MM2 || area_mm2 < LEAST_DEPTHS * below_mm * length_mm {
        return None;
    }
    let mut narrower_mm2 = 0.0;
    let median = points.iter().find(|(_, f)| {
        narrower_mm2 += f.area_mm2;
        2.0 * narrower_mm2 >= both_mm2
    });
    median.map(|(_, f)| Slit {
        area_mm2,
        width_mm: f.width_mm,
        at: f.at,
    })
}

/// Finds the points that face another part of the surface within `below_mm`.
fn find_facings(mesh: &TriMesh, below_mm: f64) -> Vec<Facing> {
    let tree = TriangleBvh::new(mesh);
    let a_point_mm2 = mesh.area() / N_POINTS;
    let start_mm = START_SHARE * below_mm;
    let of_face = |face: usize| {
        let (outwards, area_mm2) = (mesh.face_normal(face), mesh.face_area(face));
        let n = (area_mm2 / a_point_mm2).ceil().max(1.0) as usize;
        let tree = &tree;
        (0..n).filter_map(move |k| {
            let from = point(mesh.corners(face), k);
            let (other, mm) = tree.first_hit(from + start_mm * outwards, outwards, below_mm - start_mm)?;
            let width_mm = mm + start_mm;
            let faces_back = mesh.face_normal(other as usize).dot(outwards) <= -COS_SLIT;
            faces_back.then(|| Facing {
                face: face as u32,
                other,
                width_mm,
                area_mm2: area_mm2 / n as f64,
                at: from + 0.5 * width_mm * outwards,
            })
        })
    };
    (0..mesh.triangles.len())
        .into_par_iter()
        .flat_map_iter(of_face)
        .collect()
}

/// Point `k` of a sequence that fills a triangle evenly, starting at its centre.
fn point([a, b, c]: [Vec3; 3], k: usize) -> Vec3 {
    /// Increments of the sequence: powers of the reciprocal of the plastic number.
    const STEPS: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053_3];
    let [u, v] = STEPS.map(|step| (1.0 / 3.0 + k as f64 * step).fract());
    let [u, v] = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
    a + u * (b - a) + v * (c - a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Volume;
    use crate::samples::{ball, cuboid};

    fn solid(volume: &Volume) -> Solid {
        Solid::new(volume.to_mesh()).unwrap()
    }

    fn block() -> Volume {
        cuboid([0.0; 3], [60.0, 40.0, 30.0])
    }

    #[test]
    fn a_saw_cut_is_found_with_its_width_place_and_area() {
        for (width, x) in [(0.05, 35.0), (0.02, 12.0)] {
            let cut = cuboid([x, -1.0, 10.0], [x + width, 41.0, 31.0]);
            let sawn = solid(&block().subtract(&cut));
            let [slit] = slits(&sawn, 0.1)[..] else {
                panic!("one slit")
            };
            assert!((slit.width_mm - width).abs() < 1e-9, "{slit:?}");
            assert!((slit.area_mm2 - 40.0 * 20.0).abs() < 40.0, "{slit:?}");
            assert!(
                (slit.at.x - x - 0.5 * width).abs() < 1e-9 && slit.at.z > 10.0,
                "{slit:?}"
            );
            assert_eq!(slits(&sawn, 0.9 * width), []);
        }
    }

    #[test]
    fn two_plates_that_nearly_touch_are_found() {
        let plates = cuboid([0.0; 3], [50.0, 50.0, 4.0]).union(&cuboid([0.0, 0.0, 4.07], [50.0, 50.0, 8.0]));
        let joined = solid(&plates.union(&cuboid([0.0; 3], [5.0, 50.0, 8.0])));
        let [slit] = slits(&joined, 0.1)[..] else {
            panic!("one slit")
        };
        assert!((slit.width_mm - 0.07).abs() < 1e-9, "{slit:?}");
        assert!((slit.area_mm2 - 45.0 * 50.0).abs() < 100.0, "{slit:?}");
    }

    #[test]
    fn creases_wide_gaps_and_scratches_are_no_slits() {
        let wide = block().subtract(&cuboid([30.0, -1.0, 10.0], [30.2, 41.0, 31.0]));
        assert_eq!(slits(&solid(&wide), 0.1), []);
        let scratch = block().subtract(&cuboid([30.0, 10.0, 29.0], [30.05, 12.0, 31.0]));
        assert_eq!(slits(&solid(&scratch), 0.1), []);
        // A notch of 28° opens to 0.1 mm within 0.2 mm.
        let side = |y: f64| {
            [
                Vec3::new(30.0, y, 10.0),
                Vec3::new(25.0, y, 31.0),
                Vec3::new(35.0, y, 31.0),
            ]
        };
        let notch = Volume::hull(&[side(-1.0), side(41.0)].concat());
        assert_eq!(slits(&solid(&block().subtract(&notch)), 0.1), []);
        let balls =
            [0.0, 9.9].map(|x| Volume::from_closed_mesh(&ball(Vec3::new(x, 0.0, 0.0), 5.0, 4)).unwrap());
        assert_eq!(slits(&solid(&balls[0].union(&balls[1])), 0.1), []);
    }
}

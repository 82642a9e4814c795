//! Relief: cuts off the parts of a piece that come too near to another one on its way out.
//!
//! Carving keeps the clearances wherever sampled fields are smooth. Where seams of three pieces meet, or a
//! wall is crooked within a grid cell, clearances are too small in spots, and in the worst spots surfaces
//! cross. Relief therefore measures the exact gaps of the finished pieces. Each triangle that a piece passes
//! too near is grown by the clearance, swept against the piece's way, and cut from the piece.

use rayon::prelude::*;
use shellock_geom::clearance::{Passed, Translation, find_passed_faces};
use shellock_geom::{Aabb, TriMesh, Vec3, Volume};
use shellock_plan::LatticePlan;
use shellock_report::{Cancelled, Ctx, IdVec, PatchId};

use super::carve::distances_that_meet;

/// Amount by which a gap may fall short without being cut, mm. Sockets are half as much tighter by design,
/// and smaller cuts are not worth making.
const TOLERANCE_MM: f64 = 0.0195;
/// Amount by which cuts fall short of the wanted gap, mm, so that their faces do not coincide with a
/// socket's.
const SHY_MM: f64 = 0.005;
/// Limits within which triangles are cut out as one: distance from a plane, mm, cosine to it, and size, mm.
const FLAT_MM: f64 = 0.02;
const FLAT_COS: f64 = 0.97;
const FLAT_SIZE_MM: f64 = 4.0;

/// Least gaps between finished pieces, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relief {
    /// Least gap between any two pieces, mm.
    pub gap_mm: f64,
    /// Least gap between the key and any other piece, mm.
    pub key_gap_mm: f64,
}

/// Surface mesh of a piece, with its bounding box.
struct Skin {
    mesh: TriMesh,
    bounds: Aabb,
}

/// Cuts off the parts of each of `pieces` that come too near to an earlier-installed one on its way out.
pub(super) fn relieve(
    ctx: &Ctx,
    params: &Relief,
    plan: &LatticePlan,
    pieces: &mut IdVec<PatchId, Volume>,
) -> Result<(), Cancelled> {
    let skins: Vec<Skin> = pieces.as_slice().par_iter().map(Skin::of).collect();
    let skins: IdVec<PatchId, Skin> = skins.into_iter().collect();
    let order: Vec<_> = plan.removal().collect();
    let relieved: Vec<Option<Volume>> = (0..order.len())
        .into_par_iter()
        .map(|at| {
            ctx.check()?;
            let (piece, along) = (order[at].piece, order[at].separation.unit());
            let gap_mm = if at == 0 { params.key_gap_mm } else { params.gap_mm };
            let cuts: Vec<Vec<Volume>> = order[at + 1..]
                .par_iter()
                .map(|earlier| cuts(&skins[piece], &skins[earlier.piece], along, gap_mm))
                .collect();
            let cuts = cuts.concat();
            Ok((!cuts.is_empty()).then(|| pieces[piece].subtract(&Volume::union_all(cuts))))
        })
        .collect::<Result<_, Cancelled>>()?;
    for (step, volume) in order.iter().zip(relieved) {
        if let Some(volume) = volume {
            pieces[step.piece] = volume;
        }
    }
    Ok(())
}

/// Volumes to cut from a piece so that it keeps `gap_mm` from an `earlier` one on its way `along`.
fn cuts(piece: &Skin, earlier: &Skin, along: Vec3, gap_mm: f64) -> Vec<Volume> {
    if distances_that_meet(piece.bounds.grown(gap_mm), along, earlier.bounds, f64::INFINITY).is_none() {
        return Vec::new();
    }
    let way_out = Translation {
        along,
        from_mm: 0.0,
        far_mm: f64::INFINITY,
    };
    let passed = find_passed_faces(&piece.mesh, &earlier.mesh, &way_out, gap_mm - TOLERANCE_MM);
    let flats = flats(&earlier.mesh, &passed);
    let drawn_out = flats
        .iter()
        .filter_map(|flat| flat.drawn_out(along, gap_mm - SHY_MM));
    drawn_out.collect()
}

/// Triangles in about one plane, and the bounding box of what passes them.
struct Flat {
    normal: Vec3,
    corners: Vec<Vec3>,
    around: Aabb,
    passed_by: Aabb,
}

/// Groups the passed triangles of `mesh` by plane: carving leaves many slivers, and each would otherwise be
/// cut out alone.
fn flats(mesh: &TriMesh, passed: &[Passed]) -> Vec<Flat> {
    let mut flats: Vec<Flat> = Vec::new();
    for p in passed {
        let corners = mesh.corners(p.face as usize);
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let around = Aabb::around(corners);
        let takes = |flat: &&mut Flat| {
            let is_in_plane = corners
                .iter()
                .all(|q| (*q - flat.corners[0]).dot(flat.normal).abs() < FLAT_MM);
            let is_parallel = normal == Vec3::ZERO || normal.dot(flat.normal) > FLAT_COS;
            is_in_plane && is_parallel && flat.around.union(around).diagonal() < FLAT_SIZE_MM
        };
        match flats.iter_mut().find(takes) {
            Some(flat) => {
                flat.corners.extend(corners);
                flat.around = flat.around.union(around);
                flat.passed_by = flat.passed_by.union(p.by);
            }
            None => flats.push(Flat {
                normal: if normal == Vec3::ZERO { Vec3::Z } else { normal },
                corners: corners.to_vec(),
                around,
                passed_by: p.by,
            }),
        }
    }
    flats
}

impl Flat {
    /// Volume swept by the triangles, grown by `by_mm` and moved against `along`, within the box that passes
    /// them.
    fn drawn_out(&self, along: Vec3, by_mm: f64) -> Option<Volume> {
        let swollen = self.swollen(by_mm);
        let bounds = Aabb::around(swollen.iter().copied());
        let (from, to) = distances_that_meet(bounds, -along, self.passed_by, f64::INFINITY)?;
        let ends = [from, to]
            .into_iter()
            .flat_map(|t| swollen.iter().map(move |p| *p - t * along));
        Some(Volume::hull(&ends.collect::<Vec<_>>()))
    }

    /// Corners whose hull contains all points within `by_mm`: a prism along the normal over an octagon, two
    /// of whose sides run along an edge. Corners are few, since the unions of such sweeps cost most of the
    /// relief.
    fn swollen(&self, by_mm: f64) -> Vec<Vec3> {
        let origin = self.corners[0];
        let (u, v) = self.axes();
        let range = |d: Vec3, by_mm: f64| {
            let [lo, hi] = self.range(d);
            [lo - by_mm, hi + by_mm]
        };
        let aslant_mm = by_mm * std::f64::consts::SQRT_2;
        let ([x0, x1], [y0, y1]) = (range(u, by_mm), range(v, by_mm));
        let ([s0, s1], [d0, d1]) = (range(u + v, aslant_mm), range(u - v, aslant_mm));
        let octagon = [
            [x1, s1 - x1],
            [s1 - y1, y1],
            [y1 + d0, y1],
            [x0, x0 - d0],
            [x0, s0 - x0],
            [s0 - y0, y0],
            [y0 + d1, y0],
            [x1, x1 - d1],
        ];
        let height = range(self.normal, by_mm);
        let corner = |[x, y]: [f64; 2]| height.map(|z| origin + x * u + y * v + z * self.normal);
        octagon.into_iter().flat_map(corner).collect()
    }

    /// Unit vectors in the plane, along and across an edge of the first triangle: the edge that gives all
    /// corners the smallest bounding rectangle.
    fn axes(&self) -> (Vec3, Vec3) {
        let (other, _) = self.normal.any_orthonormal_pair();
        let edges = [[0, 1], [1, 2], [2, 0]].map(|[a, b]| self.corners[b] - self.corners[a]);
        let along = edges
            .into_iter()
            .filter_map(|edge| edge.reject_from(self.normal).try_normalize());
        let width = |d: Vec3| {
            let [lo, hi] = self.range(d);
            hi - lo
        };
        let area = |(u, v): &(Vec3, Vec3)| width(*u) * width(*v);
        along
            .chain([other])
            .map(|u| (u, self.normal.cross(u)))
            .min_by(|a, b| area(a).total_cmp(&area(b)))
            .expect("there is one at least")
    }

    /// Range of the corners along `d`, from the first corner, mm.
    fn range(&self, d: Vec3) -> [f64; 2] {
        let along = self.corners.iter().map(|p| (*p - self.corners[0]).dot(d));
        along.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], x| {
            [lo.min(x), hi.max(x)]
        })
    }
}

impl Skin {
    fn of(piece: &Volume) -> Self {
        let mesh = piece.to_mesh();
        Self {
            bounds: mesh.bounds(),
            mesh,
        }
    }
}

#[cfg(test)]
mod tests {
    use shellock_testkit::shapes::cuboid;

    use super::*;

    #[test]
    fn a_swollen_flat_holds_what_is_near_it_and_is_no_thicker_along_its_normal() {
        let corners =
            [[0.0, 0.0, 1.0], [2.0, 0.3, 1.0], [0.4, 1.0, 1.0], [2.2, 1.4, 1.0]].map(Vec3::from_array);
        let mesh = TriMesh {
            points: corners.to_vec(),
            triangles: vec![[0, 1, 2], [2, 1, 3]],
        };
        let passed = [0, 1].map(|face| Passed {
            face,
            by: mesh.bounds(),
        });
        let [flat] = &flats(&mesh, &passed)[..] else {
            panic!("both triangles lie in one plane")
        };
        let solid = Volume::hull(&flat.swollen(0.1));
        let bounds = solid.bounds();
        assert!((bounds.min.z - 0.9).abs() < 1e-9 && (bounds.max.z - 1.1).abs() < 1e-9);
        let hull = solid.to_mesh();
        for t in 0..hull.triangles.len() {
            let [a, b, c] = hull.corners(t);
            let normal = (b - a).cross(c - a).normalize();
            assert!(corners.iter().all(|p| normal.dot(a - *p) > 0.1 - 1e-9));
        }
    }

    /// A block below an overhang that its way out touches by 0.03 mm: after the cut it passes the overhang
    /// with the wanted gap.
    #[test]
    fn what_was_too_near_on_the_way_keeps_the_gap_afterwards_and_the_rest_stays() {
        let skin = |volume: &Volume| Skin {
            mesh: volume.to_mesh(),
            bounds: volume.bounds(),
        };
        let block = cuboid([0.0; 3], [4.0, 4.0, 4.0]);
        let wall = cuboid([-2.0, 0.0, 0.0], [-1.0, 4.0, 9.0]);
        let overhang = cuboid([3.97, 1.0, 6.0], [6.0, 3.0, 7.0]);
        assert!(cuts(&skin(&block), &skin(&wall), Vec3::Z, 0.1).is_empty());
        let cut = cuts(&skin(&block), &skin(&overhang), Vec3::Z, 0.1);
        let free = block.subtract(&Volume::union_all(cut));
        assert!(cuts(&skin(&free), &skin(&overhang), Vec3::Z, 0.1).is_empty());
        let way_out = Translation {
            along: Vec3::Z,
            from_mm: 0.0,
            far_mm: f64::INFINITY,
        };
        assert_eq!(
            find_passed_faces(
                &free.to_mesh(),
                &overhang.to_mesh(),
                &way_out,
                0.1 - SHY_MM - 1e-6
            ),
            []
        );
        let lost = block.volume() - free.volume();
        assert!((0.9..1.1).contains(&(lost / (4.0 * 2.19 * 0.125))), "{lost}");
    }
}

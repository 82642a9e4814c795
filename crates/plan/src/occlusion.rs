//! Occlusion of outer patches by each other (Sect. 6.2).
//!
//! An orthographic camera looks along each of the 13 lines of the lattice. Every pixel keeps the list of
//! *all* surface points on its ray, sorted by depth. So one picture serves both directions of the line and
//! all pairs:
//!
//! ```text
//!   ray ──•p───────•q──•q────────•p──▶ s    p has q ahead of it at its first point, q has p ahead at both
//! ```
//!
//! The area of p with q ahead is positive along s exactly if the area of q with p ahead is positive along −s.
//! The two areas differ if one patch crosses a ray more often than the other.
//!
//! Faces parallel to a line do not show in its picture. But a piece cannot slide along a plane if the wall of
//! another lies ahead in that plane. A walk over the surface from each such face finds what is ahead
//! (`along_surface`).
//!
//! Limits: features thinner than a pixel may be missed; only outer patches are seen, walls are carved later.

mod along_surface;

use rayon::prelude::*;
use shellock_assembly::LatticeDirection;
use shellock_geom::Vec3;
use shellock_geom::topology::Topology;
use shellock_report::PatchId;
use shellock_surface::SegmentedSurface;

/// Pixels along the longest edge of the surface's bounding box: 0.6 mm at 150 mm.
///
/// The number of rays, and so the cost per layer of surface, is the same for any size of model.
const PIXELS_ACROSS: f64 = 250.0;

/// Least depth of a point of q beyond a point of p to count as ahead, in pixels: 0.02 mm at 150 mm.
///
/// A ray through a seam meets both patches at one depth, up to rounding.
const DEPTH_TIE_PIXELS: f64 = 1.0 / 30.0;

/// Distance from the middle of pixel (0, 0) to the least corner of the picture, in pixels.
///
/// Odd values, so that rays miss the edges of models whose faces follow the axes.
const PIXEL_SHIFT: [f64; 2] = [0.37, 0.41];

/// Area of each patch that every other patch occludes, for all 26 directions.
#[derive(Clone, Debug, Default)]
pub struct Occlusion {
    n: usize,
    /// One table for each direction.
    tables: Vec<Table>,
}

/// Projected and occluded areas of all patches along one direction.
#[derive(Clone, Debug)]
struct Table {
    total_mm2: Vec<f64>,
    /// Occluded area of p by q, at index `[p · n + q]`.
    occluded_mm2: Vec<f64>,
    /// The occluded point of p that would hit q first, with its distance to q, mm.
    first_hit: Vec<Option<(f64, Vec3)>>,
}

/// One crossing of a ray with the surface.
#[derive(Clone, Copy)]
struct Fragment {
    pixel: u32,
    patch: u32,
    depth_mm: f64,
}

/// Coordinates of an orthographic picture: right and up in pixels, depth along the line in mm.
struct Camera {
    right: Vec3,
    up: Vec3,
    depth: Vec3,
    /// Least coordinates along right and up, mm.
    origin_mm: [f64; 2],
    pixel_mm: f64,
    width: usize,
    height: usize,
}

impl Occlusion {
    /// Measures `surface` along all lines. Cost: 13 rasterisations of the mesh, whatever the number of
    /// patches.
    pub fn measure(surface: &SegmentedSurface) -> Self {
        let n = surface.n_patches;
        let half = LatticeDirection::COUNT / 2;
        // Direction i and its opposite 25 − i share a picture.
        let lines: Vec<LatticeDirection> = LatticeDirection::all().take(half).collect();
        let topology = Topology::of_mesh(&surface.mesh);
        let look = |&s: &LatticeDirection| {
            let mut tables = look_along(surface, s);
            if let Some(topology) = &topology {
                along_surface::add(surface, topology, s.unit(), &mut tables);
            }
            tables
        };
        let pictures: Vec<[Table; 2]> = lines.par_iter().map(look).collect();
        let (forwards, backwards): (Vec<Table>, Vec<Table>) =
            pictures.into_iter().map(|[f, b]| (f, b)).unzip();
        let tables = forwards.into_iter().chain(backwards.into_iter().rev()).collect();
        Self { n, tables }
    }

    /// A made-up table without occlusion for tests, in which every patch shows 1 mm².
    #[cfg(test)]
    pub fn none(n: usize) -> Self {
        let table = Table {
            total_mm2: vec![1.0; n],
            occluded_mm2: vec![0.0; n * n],
            first_hit: vec![None; n * n],
        };
        Self {
            n,
            tables: vec![table; LatticeDirection::COUNT],
        }
    }

    /// Makes q occlude this share of p along s.
    #[cfg(test)]
    pub fn occlude(&mut self, p: PatchId, q: PatchId, s: LatticeDirection, share: f64) {
        let at = self.at(p, q);
        self.tables[s.index()].occluded_mm2[at] = share * self.total_mm2(p, s);
    }

    /// Makes q occlude all of p along s.
    #[cfg(test)]
    pub fn block(&mut self, p: PatchId, q: PatchId, s: LatticeDirection) {
        let at = self.at(p, q);
        self.tables[s.index()].occluded_mm2[at] = self.total_mm2(p, s);
        self.tables[s.index()].first_hit[at] = Some((0.0, Vec3::ZERO));
    }

    /// Projected area of all layers of `p` along `s`, plus the true area of its faces parallel to `s`, mm².
    pub fn total_mm2(&self, p: PatchId, s: LatticeDirection) -> f64 {
        self.tables[s.index()].total_mm2[usize::from(p)]
    }

    /// Part of [`total_mm2`](Self::total_mm2) that has `q` ahead of it along `s`, mm². Faces parallel to `s`
    /// count fourfold, so the value can exceed the total.
    pub fn occluded_mm2(&self, p: PatchId, q: PatchId, s: LatticeDirection) -> f64 {
        self.tables[s.index()].occluded_mm2[self.at(p, q)]
    }

    /// Share of `p` that has `q` ahead of it along `s`, in [0, 1]; 0 if `p` is not visible at all.
    pub fn share(&self, p: PatchId, q: PatchId, s: LatticeDirection) -> f64 {
        let total = self.total_mm2(p, s);
        if total > 0.0 {
            (self.occluded_mm2(p, q, s) / total).min(1.0)
        } else {
            0.0
        }
    }

    /// Point of `p` that hits `q` first on its way along `s`, mm; `None` if `q` is not in the way.
    pub fn first_hit(&self, p: PatchId, q: PatchId, s: LatticeDirection) -> Option<Vec3> {
        self.tables[s.index()].first_hit[self.at(p, q)].map(|(_, at)| at)
    }

    fn at(&self, p: PatchId, q: PatchId) -> usize {
        usize::from(p) * self.n + usize::from(q)
    }
}

impl Camera {
    fn new(surface: &SegmentedSurface, s: LatticeDirection) -> Self {
        let depth = s.unit();
        let (right, up) = depth.any_orthonormal_pair();
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for p in &surface.mesh.points {
            for (k, x) in [p.dot(right), p.dot(up)].into_iter().enumerate() {
                low[k] = low[k].min(x);
                high[k] = high[k].max(x);
            }
        }
        let longest = surface.mesh.bounds().size().max_element();
        // A point-like or empty surface still gets a picture: one pixel.
        let pixel_mm = if longest > 0.0 && longest.is_finite() {
            longest / PIXELS_ACROSS
        } else {
            1.0
        };
        let count = |k: usize| ((high[k] - low[k]).max(0.0) / pixel_mm).ceil() as usize + 2;
        Self {
            right,
            up,
            depth,
            origin_mm: low,
            pixel_mm,
            width: count(0),
            height: count(1),
        }
    }

    fn project(&self, p: Vec3) -> Vec3 {
        Vec3::new(
            (p.dot(self.right) - self.origin_mm[0]) / self.pixel_mm + PIXEL_SHIFT[0],
            (p.dot(self.up) - self.origin_mm[1]) / self.pixel_mm + PIXEL_SHIFT[1],
            p.dot(self.depth),
        )
    }

    fn point(&self, f: Fragment) -> Vec3 {
        let (x, y) = (f.pixel as usize % self.width, f.pixel as usize / self.width);
        self.right * ((x as f64 - PIXEL_SHIFT[0]) * self.pixel_mm + self.origin_mm[0])
            + self.up * ((y as f64 - PIXEL_SHIFT[1]) * self.pixel_mm + self.origin_mm[1])
            + self.depth * f.depth_mm
    }
}

/// Tables of `s` and of its opposite.
fn look_along(surface: &SegmentedSurface, s: LatticeDirection) -> [Table; 2] {
    let camera = Camera::new(surface, s);
    let fragments = by_pixel(&camera, &rasterise(surface, &camera));
    let mut tally = Tally::new(surface.n_patches);
    for ray in fragments.chunk_by(|a, b| a.pixel == b.pixel) {
        tally.add(ray, &camera);
    }
    tally.tables
}

fn rasterise(surface: &SegmentedSurface, camera: &Camera) -> Vec<Fragment> {
    let projected: Vec<Vec3> = surface.mesh.points.iter().map(|&p| camera.project(p)).collect();
    let mut fragments = Vec::new();
    for (t, patch) in surface.mesh.triangles.iter().zip(&surface.patch_of_face) {
        let [a, b, c] = t.map(|v| projected[v as usize]);
        let low = a.min(b).min(c).ceil().max(Vec3::ZERO);
        let high = a.max(b).max(c).floor();
        // Most triangles of a fine mesh lie between the rays.
        if low.x > high.x || low.y > high.y {
            continue;
        }
        let area = (b.y - c.y) * (a.x - c.x) + (c.x - b.x) * (a.y - c.y);
        if area.abs() < 1e-14 {
            continue;
        }
        for y in low.y as usize..=(high.y as usize).min(camera.height - 1) {
            for x in low.x as usize..=(high.x as usize).min(camera.width - 1) {
                let (dx, dy) = (x as f64 - c.x, y as f64 - c.y);
                let wa = ((b.y - c.y) * dx + (c.x - b.x) * dy) / area;
                let wb = ((c.y - a.y) * dx + (a.x - c.x) * dy) / area;
                let wc = 1.0 - wa - wb;
                if wa >= 0.0 && wb >= 0.0 && wc >= 0.0 {
                    let depth_mm = wa * a.z + wb * b.z + wc * c.z;
                    fragments.push(Fragment {
                        pixel: (y * camera.width + x) as u32,
                        patch: patch.0,
                        depth_mm,
                    });
                }
            }
        }
    }
    fragments
}

/// Fragments sorted by pixel, then depth, then patch.
fn by_pixel(camera: &Camera, fragments: &[Fragment]) -> Vec<Fragment> {
    let mut starts = vec![0_u32; camera.width * camera.height + 1];
    for f in fragments {
        starts[f.pixel as usize + 1] += 1;
    }
    for i in 1..starts.len() {
        starts[i] += starts[i - 1];
    }
    let mut sorted = fragments.to_vec();
    for &f in fragments {
        let slot = &mut starts[f.pixel as usize];
        sorted[*slot as usize] = f;
        *slot += 1;
    }
    for ray in sorted.chunk_by_mut(|a, b| a.pixel == b.pixel) {
        ray.sort_unstable_by(|a, b| a.depth_mm.total_cmp(&b.depth_mm).then(a.patch.cmp(&b.patch)));
    }
    sorted
}

/// Accumulates the rays of one picture into the tables of both directions.
struct Tally {
    n: usize,
    tables: [Table; 2],
    /// Number of the last fragment that counted q, so that a fragment counts each q once.
    counted_by: Vec<u32>,
    n_fragments: u32,
}

impl Tally {
    fn new(n: usize) -> Self {
        let table = Table {
            total_mm2: vec![0.0; n],
            occluded_mm2: vec![0.0; n * n],
            first_hit: vec![None; n * n],
        };
        Self {
            n,
            tables: [table.clone(), table],
            counted_by: vec![0; n],
            n_fragments: 0,
        }
    }

    /// Adds one ray's fragments, nearest first along the line.
    fn add(&mut self, ray: &[Fragment], camera: &Camera) {
        for (i, &f) in ray.iter().enumerate() {
            self.count(0, f, ray[i + 1..].iter(), camera);
            self.count(1, f, ray[..i].iter().rev(), camera);
        }
    }

    /// Counts the patches of `ahead`, nearest first, as occluding `f`.
    fn count<'a>(
        &mut self,
        side: usize,
        f: Fragment,
        ahead: impl Iterator<Item = &'a Fragment>,
        camera: &Camera,
    ) {
        let pixel_mm2 = camera.pixel_mm * camera.pixel_mm;
        let table = &mut self.tables[side];
        table.total_mm2[f.patch as usize] += pixel_mm2;
        self.n_fragments += 1;
        for g in ahead {
            let gap = (g.depth_mm - f.depth_mm).abs();
            if g.patch == f.patch || gap <= DEPTH_TIE_PIXELS * camera.pixel_mm {
                continue;
            }
            let counted = &mut self.counted_by[g.patch as usize];
            if *counted == self.n_fragments {
                continue;
            }
            *counted = self.n_fragments;
            let pair = f.patch as usize * self.n + g.patch as usize;
            table.occlude(pair, pixel_mm2, gap, camera.point(f));
        }
    }
}

impl Table {
    /// Counts `area_mm2` as occluded for a `pair`, at a point that reaches the other patch after `gap_mm`.
    fn occlude(&mut self, pair: usize, area_mm2: f64, gap_mm: f64, at: Vec3) {
        self.occluded_mm2[pair] += area_mm2;
        if self.first_hit[pair].is_none_or(|(least, _)| gap_mm < least) {
            self.first_hit[pair] = Some((gap_mm, at));
        }
    }
}

#[cfg(test)]
mod tests {
    use shellock_test_surfaces::{sphere, voronoi};

    use super::*;

    fn direction(x: f64, y: f64, z: f64) -> LatticeDirection {
        LatticeDirection::nearest(Vec3::new(x, y, z))
    }

    #[test]
    fn what_is_ahead_one_way_is_behind_the_other() {
        let surface = voronoi(sphere(3, Vec3::new(40.0, 50.0, 70.0)), 7, 3);
        let occlusion = Occlusion::measure(&surface);
        for s in LatticeDirection::all() {
            for p in (0..7).map(PatchId) {
                assert!((occlusion.total_mm2(p, s) - occlusion.total_mm2(p, s.opposite())).abs() < 1e-6);
                for q in (0..7).map(PatchId) {
                    let there = occlusion.occluded_mm2(p, q, s) > 0.0;
                    assert_eq!(there, occlusion.occluded_mm2(q, p, s.opposite()) > 0.0);
                    assert_eq!(there, occlusion.first_hit(p, q, s).is_some());
                    assert!(occlusion.occluded_mm2(p, q, s) <= occlusion.total_mm2(p, s) + 1e-9);
                }
            }
        }
    }

    #[test]
    fn hemispheres_leave_along_their_axis_and_shade_each_other_fully_the_other_way() {
        let mesh = sphere(5, Vec3::splat(50.0));
        let surface = shellock_test_surfaces::label(mesh, 2, |p| u32::from(p.z > 0.0));
        let occlusion = Occlusion::measure(&surface);
        let (low, high) = (PatchId(0), PatchId(1));
        assert_eq!(occlusion.share(high, low, direction(0.0, 0.0, 1.0)), 0.0);
        assert!(occlusion.share(high, low, direction(0.0, 0.0, -1.0)) > 0.97);
        // Sideways, each hemisphere occludes only itself: the seam is level, up to a row of triangles.
        assert!(occlusion.share(high, low, direction(1.0, 0.0, 0.0)) < 0.01);
        let disk_mm2 = std::f64::consts::PI * 2500.0;
        assert!((occlusion.total_mm2(high, direction(0.0, 0.0, 1.0)) / disk_mm2 - 1.0).abs() < 0.02);
    }

    #[test]
    fn a_cap_leaves_along_its_axis_and_hits_the_rest_on_its_rim_first() {
        let surface =
            shellock_test_surfaces::label(sphere(5, Vec3::splat(50.0)), 2, |p| u32::from(p.z > 30.0));
        let occlusion = Occlusion::measure(&surface);
        let (rest, cap) = (PatchId(0), PatchId(1));
        assert_eq!(occlusion.share(cap, rest, direction(0.0, 0.0, 1.0)), 0.0);
        let down = direction(0.0, 0.0, -1.0);
        assert!(occlusion.share(cap, rest, down) > 0.99);
        // Of the cap, the rim is nearest to what is below it, though that is still the chord 2 · 30 mm away.
        let hit = occlusion.first_hit(cap, rest, down).unwrap();
        assert!(hit.z < 34.0, "{hit}");
    }
}

//! Narrow places of patches, between two seams or between a seam and the key.
//!
//! Every point of a patch has a distance to the patch's border. Where it is largest, the patch has a core; on
//! the way from one core to another it is least at a saddle, where the patch is twice that distance wide:
//!
//! ```text
//!     ____________            ________
//!    |            \__________/        |
//!    |    core   ·   saddle  ·  core  |
//!    |             __________         |
//!    |____________/          \________|
//! ```
//!
//! Points are visited from the largest distance to the smallest, and joined to their neighbours that were
//! visited before. Where two components meet that both have a core, there is a saddle.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use shellock_geom::subdivide::halve_edges;
use shellock_geom::topology::ends;
use shellock_geom::{HalfEdge, Solid, Topology, TriMesh, Vec3};
use shellock_report::PatchId;

use crate::SegmentedSurface;

/// Longest edge on which distances are measured, as a share of the width sought. Along edges, distances are
/// at most a few per cent too long.
const EDGE_SHARE: f64 = 0.25;
/// Greatest number of halvings of edges.
const MOST_HALVINGS: usize = 8;

/// A narrow place of a patch, with a part of the patch beyond it.
#[derive(Clone, Debug, PartialEq)]
pub struct Neck {
    /// Patch with the narrow place.
    pub patch: PatchId,
    /// Width of the patch there, mm.
    pub width_mm: f64,
    /// Middle of the neck.
    pub at: Vec3,
    /// Area of the smaller part, mm².
    pub part_mm2: f64,
    /// Triangles of the surface that are mostly in the smaller part.
    pub part: Vec<u32>,
}

/// Finds the places narrower than `width_mm` between two parts of a patch that are wider, narrowest first.
///
/// O(n log n) in the surface's points after subdivision. Empty if the surface is not closed.
pub fn necks(surface: &SegmentedSurface, width_mm: f64) -> Vec<Neck> {
    let Some((fine, source)) = refine(surface, EDGE_SHARE * width_mm) else {
        return Vec::new();
    };
    let patch_of: Vec<PatchId> = source
        .iter()
        .map(|&f| surface.patch_of_face[f as usize])
        .collect();
    let web = Web::new(fine.mesh(), &Topology::new(&fine), &patch_of);
    let depth = web.distances(|v| web.patch[v].is_none());
    let saddles = web.saddles(&depth, 0.5 * width_mm);
    let mut found: Vec<Neck> = saddles
        .into_iter()
        .map(|s| web.neck(&s, &depth, fine.mesh(), &patch_of, &source))
        .collect();
    found.sort_by(|a, b| a.width_mm.total_cmp(&b.width_mm));
    found
}

/// Halves edges until none is longer than `edge_mm`; with the triangle of the surface that contains each new
/// one.
fn refine(surface: &SegmentedSurface, edge_mm: f64) -> Option<(Solid, Vec<u32>)> {
    let mut fine = Solid::new(surface.mesh.clone()).ok()?;
    let mut source: Vec<u32> = (0..surface.mesh.triangles.len() as u32).collect();
    for _ in 0..MOST_HALVINGS {
        let mesh = fine.mesh();
        let is_long = |a: u32, b: u32| mesh.points[a as usize].distance(mesh.points[b as usize]) > edge_mm;
        let (next, parent) = halve_edges(&fine, &Topology::new(&fine), is_long);
        if next.mesh().triangles.len() == mesh.triangles.len() {
            break;
        }
        source = parent.iter().map(|&f| source[f as usize]).collect();
        fine = next;
    }
    Some((fine, source))
}

/// Points of a divided surface, linked along edges and across pairs of triangles within a patch.
struct Web {
    /// Patch of each point inside a patch; `None` on a border.
    patch: Vec<Option<PatchId>>,
    /// Neighbours of each point, with their distances, mm.
    links: Vec<Vec<(u32, f64)>>,
    /// Area around each point, mm².
    area_mm2: Vec<f64>,
}

/// The place where two parts of a patch meet.
struct Saddle {
    point: u32,
    /// Deepest points of the two parts.
    cores: [u32; 2],
}

impl Web {
    fn new(mesh: &TriMesh, topology: &Topology, patch_of: &[PatchId]) -> Self {
        let n = mesh.points.len();
        let mut patch: Vec<Option<PatchId>> = vec![None; n];
        let mut is_border = vec![false; n];
        let mut links: Vec<Vec<(u32, f64)>> = vec![Vec::new(); n];
        let mut area_mm2 = vec![0.0; n];
        let distance = |a: u32, b: u32| mesh.points[a as usize].distance(mesh.points[b as usize]);
        for (face, t) in mesh.triangles.iter().enumerate() {
            for &v in t {
                patch[v as usize] = Some(patch_of[face]);
                area_mm2[v as usize] += mesh.face_area(face) / 3.0;
            }
        }
        for h in 0..topology.n_half_edges() as HalfEdge {
            let o = topology.opposite(h);
            let (a, b) = ends(mesh, h);
            if patch_of[h as usize / 3] != patch_of[o as usize / 3] {
                is_border[a as usize] = true;
                is_border[b as usize] = true;
            } else if h < o {
                let [p, q] = [h, o].map(|x| ends(mesh, Topology::next(x)).1);
                for (x, y) in [(a, b), (p, q)] {
                    links[x as usize].push((y, distance(x, y)));
                    links[y as usize].push((x, distance(x, y)));
                }
            }
        }
        (0..n).filter(|&v| is_border[v]).for_each(|v| patch[v] = None);
        Self {
            patch,
            links,
            area_mm2,
        }
    }

    /// Distance of every point from the nearest source, mm, without crossing a border.
    fn distances(&self, is_source: impl Fn(usize) -> bool) -> Vec<f64> {
        let mut distance = vec![f64::INFINITY; self.links.len()];
        let mut front = BinaryHeap::new();
        for v in (0..distance.len()).filter(|&v| is_source(v)) {
            distance[v] = 0.0;
            front.push(Reverse((0u64, v as u32)));
        }
        while let Some(Reverse((bits, v))) = front.pop() {
            let d = f64::from_bits(bits);
            if d > distance[v as usize] {
                continue;
            }
            for &(w, length) in &self.links[v as usize] {
                if self.patch[w as usize].is_some() && d + length < distance[w as usize] {
                    distance[w as usize] = d + length;
                    front.push(Reverse(((d + length).to_bits(), w)));
                }
            }
        }
        distance
    }

    /// Places nearer to the border than `core_mm` where two parts meet that reach deeper than that.
    fn saddles(&self, depth: &[f64], core_mm: f64) -> Vec<Saddle> {
        let mut order: Vec<u32> = (0..depth.len() as u32)
            .filter(|&v| self.patch[v as usize].is_some() && depth[v as usize].is_finite())
            .collect();
        order.sort_by(|&a, &b| depth[b as usize].total_cmp(&depth[a as usize]).then(a.cmp(&b)));
        // The root of each component is its deepest point.
        let mut parent = vec![u32::MAX; depth.len()];
        let mut found = Vec::new();
        for v in order {
            parent[v as usize] = v;
            for &(w, _) in &self.links[v as usize] {
                if parent[w as usize] == u32::MAX {
                    continue;
                }
                let (a, b) = (root(&mut parent, v), root(&mut parent, w));
                if a == b {
                    continue;
                }
                let (deep, shallow) = if depth[a as usize] >= depth[b as usize] {
                    (a, b)
                } else {
                    (b, a)
                };
                if depth[v as usize] < core_mm && depth[shallow as usize] >= core_mm {
                    found.push(Saddle {
                        point: v,
                        cores: [deep, shallow],
                    });
                }
                parent[shallow as usize] = deep;
            }
        }
        found
    }

    fn neck(
        &self,
        saddle: &Saddle,
        depth: &[f64],
        mesh: &TriMesh,
        patch_of: &[PatchId],
        source: &[u32],
    ) -> Neck {
        let limit_mm = depth[saddle.point as usize];
        let reach = |core: u32| self.reach(core, depth, limit_mm);
        let [one, other] = saddle.cores.map(reach);
        let (from_one, from_other) = (self.distances(|v| one[v]), self.distances(|v| other[v]));
        let patch = self.patch[saddle.point as usize].expect("a saddle is inside a patch");
        let is_nearer = |v: usize, a: &[f64], b: &[f64]| a[v] < b[v];
        let area = |a: &[f64], b: &[f64]| -> f64 {
            (0..a.len())
                .filter(|&v| is_nearer(v, a, b))
                .map(|v| self.area_mm2[v])
                .sum()
        };
        let areas = [area(&from_one, &from_other), area(&from_other, &from_one)];
        let (small, large) = if areas[0] < areas[1] {
            (&from_one, &from_other)
        } else {
            (&from_other, &from_one)
        };
        let mut share = std::collections::BTreeMap::<u32, [f64; 2]>::new();
        for (face, t) in mesh
            .triangles
            .iter()
            .enumerate()
            .filter(|(f, _)| patch_of[*f] == patch)
        {
            let lead: f64 = t
                .iter()
                .map(|&v| (large[v as usize].min(1e9) - small[v as usize].min(1e9)).clamp(-1e3, 1e3))
                .sum();
            share.entry(source[face]).or_default()[usize::from(lead > 0.0)] += mesh.face_area(face);
        }
        let part: Vec<u32> = share
            .into_iter()
            .filter(|(_, s)| s[1] > s[0])
            .map(|(f, _)| f)
            .collect();
        Neck {
            patch,
            width_mm: 2.0 * limit_mm,
            at: mesh.points[saddle.point as usize],
            part_mm2: areas[0].min(areas[1]),
            part,
        }
    }

    /// Points deeper than `limit_mm` that are linked to `core` by such points.
    fn reach(&self, core: u32, depth: &[f64], limit_mm: f64) -> Vec<bool> {
        let mut is_reached = vec![false; depth.len()];
        let mut front = vec![core];
        is_reached[core as usize] = true;
        while let Some(v) = front.pop() {
            for &(w, _) in &self.links[v as usize] {
                if !is_reached[w as usize] && self.patch[w as usize].is_some() && depth[w as usize] > limit_mm
                {
                    is_reached[w as usize] = true;
                    front.push(w);
                }
            }
        }
        is_reached
    }
}

fn root(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        parent[v as usize] = parent[parent[v as usize] as usize];
        v = parent[v as usize];
    }
    v
}

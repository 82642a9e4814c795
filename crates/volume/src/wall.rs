//! The wall of all parts as tetrahedra: triangles of the outer surface, extruded inwards.
//!
//! A prism is cut into three tetrahedra along the diagonals that start at the lower-numbered point of each
//! side, so that neighbours match. Where a prism would fold over or become a sliver (tight concave places),
//! the wall is made thinner. A triangle in a crease, below which no prism fits, is left out.

use shellock_geom::Vec3;
use shellock_mechanics::ShellAssembly;

use super::element::volume_6;

/// Least volume of a tetrahedron, as a share of that in a straight prism on the same triangle.
///
/// With it, an inner triangle has at least about a tenth of the outer one's area. Worse elements make the
/// stiffness matrix ill-conditioned, and too stiff for the little material that they represent.
pub const MIN_VOLUME_SHARE: f64 = 0.1;

/// Factor on the depth of a point in a bad prism.
const THINNER: f64 = 0.8;

/// Least depth, as a share of the wall's. A prism that is bad at this depth at all three corners has a bad
/// outer triangle.
const LEAST_DEPTH_SHARE: f64 = 0.03;

/// Rounds of thinning: enough for the depths to fall from the wall's to the least, and then for the
/// neighbours', which must not be many times deeper.
const MAX_ROUNDS: usize = 64;

/// Greatest share of the triangles that may be left out: fewer carry no noticeable part of a load.
const MOST_LEFT_OUT: f64 = 0.005;

/// Tetrahedra of the walls of all parts.
#[derive(Clone, Debug)]
pub struct Wall {
    /// Nodes layer by layer from the outside; node `layer · n_points + point`.
    pub nodes: Vec<Vec3>,
    /// Four nodes of each tetrahedron, with positive volume; three times `n_layers` for each triangle that is
    /// not left out, in the order of triangles.
    pub tets: Vec<[u32; 4]>,
    /// First tetrahedron of each triangle, and the number of all tetrahedra.
    first_tet: Vec<u32>,
    /// Depth of the wall at each point, mm.
    pub depth_mm: Vec<f64>,
    /// Number of points with a thinner wall than requested.
    pub n_thinned: usize,
    /// Number of triangles without a wall.
    pub n_left_out: usize,
}

/// Triangle on which no prism fits, however thin, and which cannot be left out: too many others are, or one
/// of its points has no other wall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FlatTriangle(pub u32);

impl Wall {
    pub(super) fn new(assembly: &ShellAssembly, wall_mm: f64, n_layers: usize) -> Result<Self, FlatTriangle> {
        let mut depth_mm = vec![wall_mm; assembly.points.len()];
        let mut is_left_out = vec![false; assembly.triangles.len()];
        let least_mm = LEAST_DEPTH_SHARE * wall_mm;
        for round in 0..=MAX_ROUNDS {
            let mut bad = bad_triangles(assembly, &depth_mm, n_layers);
            bad.retain(|t| !is_left_out[*t as usize]);
            if bad.is_empty() {
                break;
            }
            let is_hopeless = |t: &u32| {
                let corners = assembly.triangles[*t as usize];
                round == MAX_ROUNDS || corners.iter().all(|&p| depth_mm[p as usize] <= least_mm)
            };
            for hopeless in bad.iter().filter(|t| is_hopeless(t)) {
                is_left_out[*hopeless as usize] = true;
            }
            thin(assembly, &bad, &mut depth_mm, least_mm);
        }
        if let Some(flat) = indispensable(assembly, &is_left_out) {
            return Err(flat);
        }
        let nodes = (0..=n_layers).flat_map(|layer| {
            let share = layer as f64 / n_layers as f64;
            (0..assembly.points.len()).map({
                let depth_mm = &depth_mm;
                move |i| assembly.points[i] - assembly.normals[i] * (depth_mm[i] * share)
            })
        });
        Ok(Self {
            nodes: nodes.collect(),
            tets: (assembly.triangles.iter().zip(&is_left_out))
                .filter(|(_, is_left_out)| !**is_left_out)
                .flat_map(|(&t, _)| {
                    (0..n_layers).flat_map(move |layer| prism(t, layer, assembly.points.len() as u32))
                })
                .collect(),
            first_tet: first_tets(&is_left_out, n_layers),
            n_thinned: depth_mm.iter().filter(|d| **d < wall_mm).count(),
            n_left_out: is_left_out.iter().filter(|is| **is).count(),
            depth_mm,
        })
    }

    /// Tetrahedra below a triangle; none if it is left out.
    pub(super) fn tets_below(&self, triangle: u32) -> std::ops::Range<u32> {
        let at = triangle as usize;
        self.first_tet[at]..self.first_tet[at + 1]
    }

    /// Corners of tetrahedron `tet`, mm.
    pub fn corners(&self, tet: usize) -> [Vec3; 4] {
        self.tets[tet].map(|node| self.nodes[node as usize])
    }
}

/// The first triangle that is left out but must not be; `None` if there is none.
fn indispensable(assembly: &ShellAssembly, is_left_out: &[bool]) -> Option<FlatTriangle> {
    let n = is_left_out.iter().filter(|is| **is).count();
    let is_many = n as f64 > MOST_LEFT_OUT * is_left_out.len() as f64;
    let mut has_wall = vec![false; assembly.points.len()];
    for (t, _) in assembly.triangles.iter().zip(is_left_out).filter(|(_, is)| !**is) {
        t.iter().for_each(|&p| has_wall[p as usize] = true);
    }
    let is_needed = |t: &[u32; 3]| is_many || !t.iter().all(|&p| has_wall[p as usize]);
    let mut all = (0..).zip(&assembly.triangles).zip(is_left_out);
    all.find(|((_, t), is_left_out)| **is_left_out && is_needed(t))
        .map(|((i, _), _)| FlatTriangle(i))
}

fn first_tets(is_left_out: &[bool], n_layers: usize) -> Vec<u32> {
    let n_of = |is_left_out: &bool| if *is_left_out { 0 } else { 3 * n_layers as u32 };
    let mut first = vec![0];
    for is_left_out in is_left_out {
        first.push(first[first.len() - 1] + n_of(is_left_out));
    }
    first
}

/// Three tetrahedra below triangle `t` in `layer`, of positive volume if the prism is sound.
fn prism(t: [u32; 3], layer: usize, n_points: u32) -> [[u32; 4]; 3] {
    let lowest = (0..3).min_by_key(|i| t[*i]).unwrap_or(0);
    let [a, b, c] =
        [t[lowest], t[(lowest + 1) % 3], t[(lowest + 2) % 3]].map(|p| p + layer as u32 * n_points);
    let [d, e, f] = [a, b, c].map(|p| p + n_points);
    // Diagonals start at a, the lowest; that of side bc starts at the lower of b and c.
    if b < c {
        [[a, e, d, f], [a, b, e, f], [a, b, f, c]]
    } else {
        [[a, e, d, f], [a, b, e, c], [a, c, e, f]]
    }
}

fn bad_triangles(assembly: &ShellAssembly, depth_mm: &[f64], n_layers: usize) -> Vec<u32> {
    let n_points = assembly.points.len() as u32;
    let node = |id: u32| {
        let (layer, point) = (id / n_points, (id % n_points) as usize);
        assembly.points[point]
            - assembly.normals[point] * (depth_mm[point] * f64::from(layer) / n_layers as f64)
    };
    let is_bad = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| assembly.points[i as usize]);
        let depth = t.map(|i| depth_mm[i as usize]).iter().sum::<f64>() / 3.0;
        let straight_6 = (b - a).cross(c - a).length() * depth / n_layers as f64;
        let mut tets = (0..n_layers).flat_map(|layer| prism(*t, layer, n_points));
        // A triangle without area, or with points that are not finite, is bad as well.
        let is_sound =
            |tet: [u32; 4]| straight_6 > 0.0 && volume_6(tet.map(node)) > MIN_VOLUME_SHARE * straight_6;
        tets.any(|tet| !is_sound(tet))
    };
    (0..)
        .zip(&assembly.triangles)
        .filter(|(_, t)| is_bad(t))
        .map(|(i, _)| i)
        .collect()
}

/// Makes the wall thinner below bad triangles, equally on both sides of a seam.
fn thin(assembly: &ShellAssembly, bad: &[u32], depth_mm: &mut [f64], least_mm: f64) {
    let mut is_hit = vec![false; depth_mm.len()];
    for &triangle in bad {
        for point in assembly.triangles[triangle as usize] {
            is_hit[point as usize] = true;
        }
    }
    for (depth, is_hit) in depth_mm.iter_mut().zip(is_hit) {
        if is_hit {
            *depth = (*depth * THINNER).max(least_mm);
        }
    }
    for station in &assembly.stations {
        let [a, b] = station.points.map(|p| p as usize);
        let least = depth_mm[a].min(depth_mm[b]);
        (depth_mm[a], depth_mm[b]) = (least, least);
    }
}

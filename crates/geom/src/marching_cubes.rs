//! Contouring of band fields into closed meshes.
//!
//! Each crossed grid edge has one vertex. On ambiguous faces the triangulation separates the positive
//! corners, and it draws no diagonal inside a face of a cell. Neighbouring cells therefore agree edge by
//! edge, so every contour is a closed manifold.

use std::sync::OnceLock;

use crate::band::Band;
use crate::{TriMesh, Vec3};

/// Treatment of nodes outside the band.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OffBand {
    /// Outside the contoured region: the contour closes along the band's border.
    Outside,
    /// On the same side as their neighbours in the band: cells that miss a corner are skipped. Only correct
    /// for a level set that stays inside the band.
    LikeNeighbours,
}

/// Least distance of a vertex from the ends of its edge, as a share of the edge, so that no triangle
/// collapses. Moves the surface by at most this share of a cell. With a fifth of it, needles around a node
/// were so thin that the check for folds found them.
const LEAST_SHARE: f64 = 1e-2;

/// Marks a missing vertex or value.
const NONE: u32 = u32::MAX;

/// Contours the region where `field` is positive, oriented outwards (towards lower values).
///
/// The mesh is closed if `off_band` is [`OffBand::Outside`], or if the level set stays inside the band. Work
/// and memory are proportional to the band and two layers of its box.
pub fn contour(band: &Band, field: &[f32], off_band: OffBand) -> TriMesh {
    contour_with_corners(band, field, off_band, Corners::Positive)
}

/// Corners to separate on an ambiguous face of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Corners {
    /// Corners inside the region.
    Positive,
    /// Corners outside the region. The contour of `f` then has the triangles of the contour of `−f`, flipped,
    /// so that two fields for opposite sides of one surface agree on it.
    Negative,
}

/// Contours like [`contour`], separating the corners that `apart` names.
pub fn contour_with_corners(band: &Band, field: &[f32], off_band: OffBand, apart: Corners) -> TriMesh {
    let mut out = Contour {
        band,
        off_band,
        apart,
        mesh: TriMesh::default(),
    };
    let mut low = Layer::read(band, field, -1);
    for k in -1..band.dims[2] as i64 {
        let mut high = Layer::read(band, field, k + 1);
        out.slab(k, &mut low, &mut high);
        low = high;
    }
    out.mesh
}

/// One z-layer of nodes, surrounded by missing nodes, and the vertices on its grid edges.
struct Layer {
    width: usize,
    /// Values of all nodes; −∞ for missing nodes.
    values: Vec<f32>,
    /// Vertex on the edge from each node along x, y and (to the next layer) z.
    edges: [Vec<u32>; 3],
    /// Range of x of the positive nodes in each row; no cell outside it is crossed. Empty if first > last.
    spans: Vec<(usize, usize)>,
}

impl Layer {
    fn read(band: &Band, field: &[f32], k: i64) -> Self {
        let [nx, ny, nz] = band.dims;
        let (width, height) = (nx + 2, ny + 2);
        let mut layer = Self {
            width,
            values: Vec::new(),
            edges: [Vec::new(), Vec::new(), Vec::new()],
            spans: vec![(usize::MAX, 0); height],
        };
        if k < 0 || k >= nz as i64 {
            return layer;
        }
        for j in 0..ny {
            let row = j + ny * k as usize;
            for run in &band.runs[band.row_start[row] as usize..band.row_start[row + 1] as usize] {
                if layer.values.is_empty() {
                    layer.values = vec![f32::NEG_INFINITY; width * height];
                }
                let (x0, n, first) = (run.i0 as usize + 1, run.len as usize, run.first as usize);
                let at = (j + 1) * width + x0;
                layer.values[at..at + n].copy_from_slice(&field[first..first + n]);
                let is_positive = |v: &f32| *v > 0.0;
                let values = &field[first..first + n];
                if let (Some(a), Some(b)) = (
                    values.iter().position(is_positive),
                    values.iter().rposition(is_positive),
                ) {
                    let span = &mut layer.spans[j + 1];
                    *span = (span.0.min(x0 + a), span.1.max(x0 + b));
                }
            }
        }
        layer
    }

    fn value(&self, at: usize) -> f32 {
        self.values.get(at).copied().unwrap_or(f32::NEG_INFINITY)
    }

    fn edge(&mut self, axis: usize, at: usize) -> &mut u32 {
        let n = self.width * self.spans.len();
        let edges = &mut self.edges[axis];
        if edges.is_empty() {
            edges.resize(n, NONE);
        }
        &mut edges[at]
    }
}

struct Contour<'a> {
    band: &'a Band,
    off_band: OffBand,
    apart: Corners,
    mesh: TriMesh,
}

impl Contour<'_> {
    /// Contours all cells between layers `k` and `k + 1`.
    fn slab(&mut self, k: i64, low: &mut Layer, high: &mut Layer) {
        let width = low.width;
        for j in 0..low.spans.len() - 1 {
            let spans = [low.spans[j], low.spans[j + 1], high.spans[j], high.spans[j + 1]];
            let (from, to) = spans
                .iter()
                .fold((usize::MAX, 0), |s, t| (s.0.min(t.0), s.1.max(t.1)));
            if from > to {
                continue;
            }
            for i in from - 1..=to {
                let at = j * width + i;
                let mut corner = [0.0f32; 8];
                for (c, value) in corner.iter_mut().enumerate() {
                    let there = at + (c & 1) + width * (c >> 1 & 1);
                    *value = if c < 4 {
                        low.value(there)
                    } else {
                        high.value(there)
                    };
                }
                let missing = corner.contains(&f32::NEG_INFINITY);
                if missing && self.off_band == OffBand::LikeNeighbours {
                    continue;
                }
                let case = (0..8).fold(0, |bits, c| bits | usize::from(corner[c] > 0.0) << c);
                if case != 0 && case != 255 {
                    self.cell([i, j], k, &corner, case, low, high);
                }
            }
        }
    }

    fn cell(
        &mut self,
        [i, j]: [usize; 2],
        k: i64,
        corner: &[f32; 8],
        case: usize,
        low: &mut Layer,
        high: &mut Layer,
    ) {
        let is_turned = self.apart == Corners::Negative;
        let case = if is_turned { 255 - case } else { case };
        let first = self.mesh.triangles.len();
        for polygon in &table()[case] {
            let ids: Vec<u32> = polygon
                .edges
                .iter()
                .map(|&e| self.vertex([i, j], k, corner, e, low, high))
                .collect();
            if polygon.fan {
                self.mesh
                    .triangles
                    .extend((2..ids.len()).map(|n| [ids[0], ids[n - 1], ids[n]]));
            } else {
                let center =
                    ids.iter().map(|&v| self.mesh.points[v as usize]).sum::<Vec3>() / ids.len() as f64;
                let hub = self.add(center);
                self.mesh
                    .triangles
                    .extend((0..ids.len()).map(|n| [hub, ids[n], ids[(n + 1) % ids.len()]]));
            }
        }
        if is_turned {
            self.mesh.triangles[first..].iter_mut().for_each(|t| t.swap(1, 2));
        }
    }

    fn add(&mut self, p: Vec3) -> u32 {
        self.mesh.points.push(p);
        u32::try_from(self.mesh.points.len() - 1).expect("contours have fewer than 2³² points")
    }

    /// Vertex on edge `e` of the cell, created on first use.
    fn vertex(
        &mut self,
        [i, j]: [usize; 2],
        k: i64,
        corner: &[f32; 8],
        e: u8,
        low: &mut Layer,
        high: &mut Layer,
    ) -> u32 {
        let (a, b) = edge_ends(e);
        let axis = usize::from(e) / 4;
        let at = (j + (a >> 1 & 1)) * low.width + i + (a & 1);
        let slot = if a < 4 {
            low.edge(axis, at)
        } else {
            high.edge(axis, at)
        };
        if *slot != NONE {
            return *slot;
        }
        // A node off the band counts as one cell below the level.
        let value = |c: usize| {
            if corner[c].is_finite() {
                f64::from(corner[c])
            } else {
                -self.band.cell_mm
            }
        };
        let (va, vb) = (value(a), value(b));
        let t = (va / (va - vb)).clamp(LEAST_SHARE, 1.0 - LEAST_SHARE);
        let mut node = [
            i as f64 - 1.0 + (a & 1) as f64,
            j as f64 - 1.0 + (a >> 1 & 1) as f64,
            k as f64 + (a >> 2) as f64,
        ];
        node[axis] += t;
        *slot = u32::try_from(self.mesh.points.len()).expect("contours have fewer than 2³² points");
        let id = *slot;
        self.mesh
            .points
            .push(self.band.origin + self.band.cell_mm * Vec3::from_array(node));
        id
    }
}

/// One polygon of a case, as cell edges in order.
struct Polygon {
    edges: Vec<u8>,
    /// True if a fan from the first vertex draws no diagonal inside a face of the cell; otherwise a middle
    /// vertex is used.
    fan: bool,
}

/// Corners of edge `e`, lower first. Edges 4a … 4a + 3 run along axis a; corner bits are x, y, z.
fn edge_ends(e: u8) -> (usize, usize) {
    let (axis, rest) = (usize::from(e) / 4, usize::from(e) % 4);
    let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
    let low = (rest & 1) << b | (rest >> 1) << c;
    (low, low | 1 << axis)
}

fn edge_between(p: usize, q: usize) -> u8 {
    (0..12u8)
        .find(|&e| edge_ends(e) == (p.min(q), p.max(q)))
        .expect("corners next to each other on a face")
}

/// Corners of the six faces, counter-clockwise seen from outside the cell.
fn faces() -> [[usize; 4]; 6] {
    std::array::from_fn(|f| {
        let (axis, side) = (f / 2, f % 2);
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        let around = [0, 1 << b, 1 << b | 1 << c, 1 << c].map(|x| x | side << axis);
        if side == 1 {
            around
        } else {
            [around[0], around[3], around[2], around[1]]
        }
    })
}

/// Polygons of all 256 sign patterns.
fn table() -> &'static [Vec<Polygon>] {
    static TABLE: OnceLock<Vec<Vec<Polygon>>> = OnceLock::new();
    TABLE.get_or_init(|| (0..256).map(polygons_of).collect())
}

fn polygons_of(case: usize) -> Vec<Polygon> {
    let positive = |corner: usize| case >> corner & 1 == 1;
    // On each face, one segment cuts off each run of positive corners, from where the run begins to where it
    // ends.
    let mut next = [u8::MAX; 12];
    for face in faces() {
        for start in 0..4 {
            if positive(face[start]) || !positive(face[(start + 1) % 4]) {
                continue;
            }
            let end = (1..=4)
                .find(|n| !positive(face[(start + 1 + n) % 4]))
                .expect("the corner before the run is not positive");
            let enter = edge_between(face[start], face[(start + 1) % 4]);
            let exit = edge_between(face[(start + end) % 4], face[(start + end + 1) % 4]);
            next[usize::from(enter)] = exit;
        }
    }
    let mut polygons = Vec::new();
    for first in 0..12u8 {
        let mut edges = Vec::new();
        let mut at = first;
        while next[usize::from(at)] != u8::MAX {
            edges.push(at);
            at = std::mem::replace(&mut next[usize::from(at)], u8::MAX);
        }
        if !edges.is_empty() {
            polygons.push(triangulable(edges));
        }
    }
    polygons
}

/// Rotates the polygon so that a fan from its first vertex draws no diagonal inside a face, if possible.
fn triangulable(edges: Vec<u8>) -> Polygon {
    let n = edges.len();
    let on_one_face = |a: u8, b: u8| {
        let corners = [edge_ends(a).0, edge_ends(a).1, edge_ends(b).0, edge_ends(b).1];
        faces().iter().any(|f| corners.iter().all(|c| f.contains(c)))
    };
    for turn in 0..n {
        let turned: Vec<u8> = (0..n).map(|i| edges[(i + turn) % n]).collect();
        if (2..n - 1).all(|i| !on_one_face(turned[0], turned[i])) {
            return Polygon {
                edges: turned,
                fan: true,
            };
        }
    }
    Polygon { edges, fan: false }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Solid;
    use crate::band::tests::cube_band;

    #[test]
    fn every_contour_of_noise_is_a_closed_manifold() {
        let (band, phi) = cube_band();
        let mut x = 12345u64;
        let noise: Vec<f32> = phi
            .iter()
            .map(|_| {
                x = x
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                (x >> 40) as f32 / (1u64 << 23) as f32 - 1.0
            })
            .collect();
        for apart in [Corners::Positive, Corners::Negative] {
            let mesh = contour_with_corners(&band, &noise, OffBand::Outside, apart);
            assert!(mesh.triangles.len() > 10_000);
            Solid::new(mesh).unwrap();
        }
    }

    #[test]
    fn opposite_fields_agree_on_their_surface() {
        let (band, phi) = cube_band();
        let noisy = |n: usize| (phi[n] - 1.1) + 0.4 * ((n * 7919 % 101) as f32 / 50.0 - 1.0);
        let field: Vec<f32> = (0..phi.len()).map(noisy).collect();
        let negated: Vec<f32> = field.iter().map(|f| -f).collect();
        let a = contour(&band, &field, OffBand::LikeNeighbours);
        let b = contour_with_corners(&band, &negated, OffBand::LikeNeighbours, Corners::Negative);
        assert_eq!(a.points.len(), b.points.len());
        assert!(a.points.iter().zip(&b.points).all(|(a, b)| a.distance(*b) < 1e-9));
        assert_eq!(a.triangles.len(), b.triangles.len());
        assert!(
            a.triangles
                .iter()
                .zip(&b.triangles)
                .all(|(a, b)| *a == [b[0], b[2], b[1]])
        );
    }

    #[test]
    fn the_level_set_of_a_distance_field_is_where_it_should_be() {
        let (band, phi) = cube_band();
        let inner: Vec<f32> = phi.iter().map(|d| d - 1.1).collect();
        let solid = Solid::new(contour(&band, &inner, OffBand::LikeNeighbours)).unwrap();
        // The offset of a cube inwards is a cube; the grid cuts its 12 edges by up to half a cell each way:
        // 12 · 5.8 · h² / 8.
        assert!((5.8f64.powi(3) - solid.volume()).abs() < 12.0 * 5.8 * 0.25 / 8.0 * 2.0);
        assert!(solid.mesh().points.iter().all(|p| {
            let depth = p.min(Vec3::splat(8.0) - *p).min_element();
            (depth - 1.1).abs() < 0.26
        }));
    }

    #[test]
    fn all_256_cases_use_each_crossed_edge_once() {
        for case in 0..256usize {
            let mut used: Vec<u8> = polygons_of(case).iter().flat_map(|p| p.edges.clone()).collect();
            used.sort_unstable();
            let crossed: Vec<u8> = (0..12u8)
                .filter(|&e| {
                    let (a, b) = edge_ends(e);
                    case >> a & 1 != case >> b & 1
                })
                .collect();
            assert_eq!(used, crossed, "case {case}");
        }
    }
}

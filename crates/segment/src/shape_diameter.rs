//! Shape diameter: the thickness of a body below each face.
//!
//! [Shapira, Shamir, Cohen-Or, *Consistent mesh partitioning and skeletonisation using the shape diameter
//! function*, The Visual Computer 2008, Sect. 3]. Rays go inwards in a cone. Lengths far from their median
//! are left out, the others are averaged by angle. The values are then smoothed along the surface between
//! faces of similar values.

use std::f64::consts::PI;

use rayon::prelude::*;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{TriMesh, Vec3};

use crate::face_graph::FaceGraph;

/// Opening angle of the cone, rad.
const CONE_RAD: f64 = 2.0 / 3.0 * PI;
/// Angle from the cone's axis at which a ray's weight is e^(−1/2), rad: a third of the opening angle.
const WEIGHT_RAD: f64 = CONE_RAD / 3.0;
/// Distance from the median, in median deviations, beyond which rays are left out.
const MOST_DEVIATIONS: f64 = 1.5;
/// Depth below the surface at which rays begin, as a share of the bounding box's diagonal, so that they miss
/// their own face.
const START: f64 = 1e-6;
/// Number of faces per squared ring count: the smoothing window has ⌊√(faces / 2000)⌋ + 1 rings.
const FACES_OF_A_RING: f64 = 2000.0;
/// Strength of the logarithm that spreads small diameters; the paper's 4.
const SPREAD: f64 = 4.0;
/// Golden angle, rad, by which each ray turns from the previous one, as sunflower seeds do.
const GOLDEN_RAD: f64 = 2.399_963_229_728_653;

/// Smoothed shape diameter of each face, mm, from `n_rays` rays. Faces without a ray that leaves the body
/// take the mean of their neighbours, or 0 if these have no values, either.
pub fn diameters_mm(mesh: &TriMesh, graph: &FaceGraph, n_rays: usize) -> Vec<f64> {
    let bvh = TriangleBvh::new(mesh);
    let reach = mesh.bounds().diagonal();
    let cone = cone(n_rays);
    let raw: Vec<Option<f64>> = (0..graph.n_faces())
        .into_par_iter()
        .map(|f| diameter(&bvh, graph, f, &cone, reach))
        .collect();
    let filled = fill(graph, raw);
    smooth(graph, &filled)
}

/// Scales diameters to [0, 1], spreading small ones: log(4 x + 1) / log 5, where x is the position between
/// the least and the largest.
pub fn normalise(diameters_mm: &[f64]) -> Vec<f64> {
    let least = diameters_mm.iter().copied().fold(f64::INFINITY, f64::min);
    let range = diameters_mm.iter().copied().fold(0.0, f64::max) - least;
    diameters_mm
        .iter()
        .map(|d| {
            let x = if range > 0.0 { (d - least) / range } else { 0.0 };
            (SPREAD * x + 1.0).ln() / (SPREAD + 1.0).ln()
        })
        .collect()
}

/// Directions around +z with their weights, spread evenly over the disk that closes the cone.
fn cone(n_rays: usize) -> Vec<(Vec3, f64)> {
    let (sin, cos) = (0.5 * CONE_RAD).sin_cos();
    (0..n_rays)
        .map(|i| {
            let radius = sin * ((i as f64 + 0.5) / n_rays as f64).sqrt();
            let (y, x) = (i as f64 * GOLDEN_RAD).sin_cos();
            let direction = Vec3::new(radius * x, radius * y, cos).normalize();
            let angle = direction.z.acos();
            (direction, (-0.5 * (angle / WEIGHT_RAD).powi(2)).exp())
        })
        .collect()
}

fn diameter(
    bvh: &TriangleBvh,
    graph: &FaceGraph,
    face: usize,
    cone: &[(Vec3, f64)],
    reach: f64,
) -> Option<f64> {
    let inwards = -graph.normal[face];
    if inwards == Vec3::ZERO {
        return None;
    }
    let (u, v) = inwards.any_orthonormal_pair();
    let origin = graph.center[face] + inwards * (START * reach);
    let mut hits: Vec<(f64, f64)> = Vec::with_capacity(cone.len());
    for &(d, weight) in cone {
        let direction = u * d.x + v * d.y + inwards * d.z;
        if let Some((hit, t)) = bvh.first_hit(origin, direction, 2.0 * reach)
            && graph.normal[hit as usize].dot(direction) > 0.0
        {
            hits.push((t, weight));
        }
    }
    if hits.is_empty() {
        return None;
    }
    let median = median(hits.iter().map(|h| h.0).collect());
    let deviation = self::median(hits.iter().map(|h| (h.0 - median).abs()).collect());
    let (sum, weights) = hits
        .iter()
        .filter(|h| (h.0 - median).abs() <= MOST_DEVIATIONS * deviation)
        .fold((0.0, 0.0), |(sum, weights), &(t, w)| (sum + t * w, weights + w));
    Some(if weights > 0.0 { sum / weights } else { median })
}

/// Median of `values`, which must not be empty.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let half = values.len() / 2;
    if values.len() % 2 == 1 {
        values[half]
    } else {
        0.5 * (values[half - 1] + values[half])
    }
}

/// Fills faces without a value with the mean of their neighbours, ring by ring.
fn fill(graph: &FaceGraph, mut values: Vec<Option<f64>>) -> Vec<f64> {
    let mut empty: Vec<u32> = (0..values.len() as u32)
        .filter(|&f| values[f as usize].is_none())
        .collect();
    loop {
        let found: Vec<(u32, f64)> = empty
            .iter()
            .filter_map(|&f| {
                let known: Vec<f64> = graph
                    .arcs(f)
                    .iter()
                    .filter_map(|&(g, _)| values[g as usize])
                    .collect();
                (!known.is_empty()).then(|| (f, known.iter().sum::<f64>() / known.len() as f64))
            })
            .collect();
        if found.is_empty() {
            break;
        }
        for &(face, value) in &found {
            values[face as usize] = Some(value);
        }
        empty.retain(|&f| values[f as usize].is_none());
    }
    values.into_iter().map(Option::unwrap_or_default).collect()
}

/// Means over a window of rings, weighted by distance in rings and by similarity of values.
fn smooth(graph: &FaceGraph, values: &[f64]) -> Vec<f64> {
    let n_rings = (values.len() as f64 / FACES_OF_A_RING).sqrt() as u32 + 1;
    (0..values.len() as u32)
        .into_par_iter()
        .with_min_len(1024)
        .map_init(Window::default, |window, face| {
            window.fill(graph, face, n_rings);
            let here = values[face as usize];
            let squares = window
                .faces
                .iter()
                .map(|&(f, _)| (values[f as usize] - here).powi(2));
            let deviation = (squares.sum::<f64>() / window.faces.len() as f64).sqrt();
            if deviation == 0.0 {
                return here;
            }
            let bell = |x: f64| (-0.5 * x * x).exp();
            let (mut sum, mut weights) = (0.0, 0.0);
            for &(f, ring) in &window.faces {
                let value = values[f as usize];
                let w = bell(2.0 * f64::from(ring) / f64::from(n_rings))
                    * bell((value - here) / (1.5 * deviation));
                sum += w * value;
                weights += w;
            }
            sum / weights
        })
        .collect()
}

/// The faces within some rings of a face.
#[derive(Default)]
struct Window {
    faces: Vec<(u32, u32)>,
    /// Last window that each face was in, counted from 1.
    last_window: Vec<u32>,
    n_windows: u32,
}

impl Window {
    fn fill(&mut self, graph: &FaceGraph, face: u32, n_rings: u32) {
        self.faces.clear();
        self.last_window.resize(graph.n_faces(), 0);
        self.n_windows += 1;
        self.faces.push((face, 0));
        self.last_window[face as usize] = self.n_windows;
        let mut at = 0;
        while let Some(&(face, ring)) = self.faces.get(at) {
            at += 1;
            if ring == n_rings {
                break;
            }
            for &(other, _) in graph.arcs(face) {
                if std::mem::replace(&mut self.last_window[other as usize], self.n_windows) != self.n_windows
                {
                    self.faces.push((other, ring + 1));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plate_is_as_thick_as_it_is() {
        let (points, triangles) = shellock_testkit::plain::cuboid(Vec3::ZERO, Vec3::new(100.0, 100.0, 2.0));
        let mesh = TriMesh { points, triangles };
        let graph = FaceGraph::new(&mesh);
        let found = diameters_mm(&mesh, &graph, 25);
        let flat = (0..12).find(|&f| graph.normal[f].z.abs() > 0.5).unwrap();
        // Rays lean by up to 60° and are averaged by angle, so a plate seems a little thicker.
        assert!(found[flat] > 2.0 && found[flat] < 4.0, "{}", found[flat]);
        let spread = normalise(&[1.0, 3.0, 5.0]);
        assert!(spread[0] == 0.0 && spread[1] > 0.5 && spread[2] == 1.0);
    }
}

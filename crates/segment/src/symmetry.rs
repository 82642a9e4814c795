//! Plane of approximate mirror symmetry of a surface.
//!
//! Many planes through the centroid are tried. The best few are then turned and moved as long as that helps.
//! The quality of a plane is the distance of mirrored surface points from the surface.
//!
//! Figures that are symmetric except for their pose, such as one with a raised arm, have no such plane.

use std::f64::consts::PI;

use nalgebra::{Matrix3, SymmetricEigen};
use rayon::prelude::*;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{TriMesh, Vec3};

/// A plane of mirror symmetry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// A point on the plane, mm.
    pub at: Vec3,
    /// Unit normal of the plane.
    pub normal: Vec3,
}

impl Plane {
    /// Mirror image of a point in the plane.
    pub fn image(&self, point: Vec3) -> Vec3 {
        point - 2.0 * self.height(point) * self.normal
    }

    /// Signed distance of a point from the plane, mm; negative behind it.
    pub fn height(&self, point: Vec3) -> f64 {
        (point - self.at).dot(self.normal)
    }
}

/// Largest root mean square distance of mirrored points from the surface, as a share of the bounding box's
/// diagonal, for a model to count as symmetric.
///
/// Koala, bust, armadillo and squirrel have 0.0006 to 0.009, a horse in mid-step 0.014, a statue 0.021. An
/// open hand has 0.029 and a waving teddy 0.033, so no value accepts the teddy without the hand.
const TOLERANCE: f64 = 0.025;
/// Number of surface points that are mirrored.
const N_SAMPLES: usize = 1000;
/// Step between the samples used while planes are only ranked.
const THINNED: usize = 4;
/// Number of normals tried beside the principal axes, about 10° apart.
const N_NORMALS: usize = 200;
/// Number of planes that are refined.
const N_REFINED: usize = 4;
/// Cosine of the smallest angle between the normals of two planes that are refined: 20°.
const APART: f64 = 0.94;

/// Finds the plane of approximate mirror symmetry. `None` if mirrored points are farther from the surface
/// than 2.5 % of the bounding box's diagonal. The result is the same on any number of threads.
///
/// Meant for meshes of some thousand triangles, which take 0.2 s each. If there are several planes, as for a
/// vase, one is returned.
pub fn plane(mesh: &TriMesh) -> Option<Plane> {
    nearest_plane(mesh)
        .filter(|&(deviation, _)| deviation <= TOLERANCE)
        .map(|(_, plane)| plane)
}

/// Finds the best plane, however bad, and the deviation of mirrored points from the surface, as a share of
/// the bounding box's diagonal. `None` if the mesh has no area.
pub fn nearest_plane(mesh: &TriMesh) -> Option<(f64, Plane)> {
    let figure = Figure::new(mesh)?;
    let few: Vec<Vec3> = figure.samples.iter().copied().step_by(THINNED).collect();
    let mut tried: Vec<(f64, Plane)> = figure
        .normals()
        .into_iter()
        .map(|normal| {
            let plane = Plane {
                at: figure.center,
                normal,
            };
            (figure.deviation(&plane, &few), plane)
        })
        .collect();
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut best: Vec<(f64, Plane)> = Vec::new();
    for (deviation, plane) in tried {
        let is_apart = |b: &(f64, Plane)| b.1.normal.dot(plane.normal).abs() < APART;
        if best.len() < N_REFINED && best.iter().all(is_apart) {
            best.push((deviation, plane));
        }
    }
    let (_, rough) = best
        .into_iter()
        .map(|(_, plane)| figure.refine(plane, &few, 0.1))
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(figure.refine(rough, &figure.samples, 0.02))
}

/// Surface and sample points against which planes are judged.
struct Figure {
    bvh: TriangleBvh,
    samples: Vec<Vec3>,
    center: Vec3,
    /// Root mean square distance from the centre, mm.
    radius_mm: f64,
    axes: [Vec3; 3],
    diagonal_mm: f64,
}

impl Figure {
    fn new(mesh: &TriMesh) -> Option<Self> {
        let samples = samples(mesh);
        let n = samples.len() as f64;
        let center = samples.iter().copied().sum::<Vec3>() / n;
        let mut spread = Matrix3::zeros();
        for from_center in samples.iter().map(|&p| p - center) {
            let v = nalgebra::Vector3::from(from_center.to_array());
            spread += v * v.transpose() / n;
        }
        let axes = SymmetricEigen::new(spread).eigenvectors;
        (!samples.is_empty()).then(|| Self {
            bvh: TriangleBvh::new(mesh),
            center,
            radius_mm: spread.trace().sqrt(),
            axes: [0, 1, 2].map(|i| Vec3::new(axes[(0, i)], axes[(1, i)], axes[(2, i)]).normalize()),
            diagonal_mm: mesh.bounds().diagonal(),
            samples,
        })
    }

    /// Candidate normals: the principal axes, and a spiral spread over half a ball.
    fn normals(&self) -> Vec<Vec3> {
        let golden = PI * (3.0 - 5.0_f64.sqrt());
        let spiral = (0..N_NORMALS).map(|i| {
            let z = (i as f64 + 0.5) / N_NORMALS as f64;
            let (sin, cos) = (golden * i as f64).sin_cos();
            let r = (1.0 - z * z).sqrt();
            Vec3::new(r * cos, r * sin, z)
        });
        self.axes.into_iter().chain(spiral).collect()
    }

    /// Root mean square distance of the images of `points` from the surface, as a share of the bounding box's
    /// diagonal.
    fn deviation(&self, plane: &Plane, points: &[Vec3]) -> f64 {
        let distance_sq = |&p: &Vec3| {
            let nearest = self.bvh.nearest(plane.image(p), f64::INFINITY);
            nearest.map_or(0.0, |n| n.distance_sq)
        };
        // Summed in order, so that the number of threads makes no difference.
        let all: Vec<f64> = points.par_iter().map(distance_sq).collect();
        (all.iter().sum::<f64>() / all.len() as f64).sqrt() / self.diagonal_mm
    }

    /// Turns and moves `plane` while that lowers the deviation of `points`. The first step is `first_rad`.
    fn refine(&self, plane: Plane, points: &[Vec3], first_rad: f64) -> (f64, Plane) {
        /// Step at which refinement ends, rad: 0.06°.
        const LAST_RAD: f64 = 1e-3;
        /// Largest number of steps of one length.
        const MOST_STEPS: usize = 6;
        let mut best = (self.deviation(&plane, points), plane);
        let mut step_rad = first_rad;
        while step_rad > LAST_RAD {
            for _ in 0..MOST_STEPS {
                let before = best.0;
                for tried in self.beside(best.1, step_rad) {
                    let deviation = self.deviation(&tried, points);
                    if deviation < best.0 {
                        best = (deviation, tried);
                    }
                }
                if best.0 >= before {
                    break;
                }
            }
            step_rad *= 0.5;
        }
        best
    }

    /// Planes one step away from `plane`: turned about its point nearest to the centre, or moved.
    fn beside(&self, plane: Plane, step_rad: f64) -> [Plane; 6] {
        let Plane { normal, .. } = plane;
        let at = self.center - plane.height(self.center) * normal;
        let (u, v) = normal.any_orthonormal_pair();
        let turned = |way: Vec3| Plane {
            at,
            normal: (normal + step_rad * way).normalize(),
        };
        let moved = |by: f64| Plane {
            at: at + by * step_rad * self.radius_mm * normal,
            normal,
        };
        [
            turned(u),
            turned(-u),
            turned(v),
            turned(-v),
            moved(1.0),
            moved(-1.0),
        ]
    }
}

/// Points spread evenly by area over the surface; empty if the surface has no area.
fn samples(mesh: &TriMesh) -> Vec<Vec3> {
    /// Increments of Roberts' sequence in the plane: powers of 1 over the plastic number.
    const STEPS: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];
    let total: f64 = (0..mesh.triangles.len()).map(|f| mesh.face_area(f)).sum();
    let mut found = Vec::with_capacity(N_SAMPLES);
    let mut so_far = 0.0;
    for face in 0..mesh.triangles.len() {
        so_far += mesh.face_area(face);
        while found.len() < N_SAMPLES && (found.len() as f64 + 0.5) / (N_SAMPLES as f64) * total < so_far {
            let [mut s, mut t] = STEPS.map(|step| (step * found.len() as f64).fract());
            if s + t > 1.0 {
                [s, t] = [1.0 - s, 1.0 - t];
            }
            let [a, b, c] = mesh.corners(face);
            found.push(a + s * (b - a) + t * (c - a));
        }
    }
    found
}

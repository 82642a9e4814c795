//! The local test set of the data-driven metric (Sect. 5.3): opening of a straight seam, for 8 connector
//! orientations and 26 directions of the testing force.
//!
//! Two half-planes meet in a seam and are held at their outer ring. The surface metric's solver simulates
//! them, and the middle of the seam is measured. Between the simulated cases, `d` is piecewise linear: in the
//! connector's angle, and in the force over the triangles that the 26 directions make of the sphere.

use shellock_assembly::LatticeDirection;
use shellock_geom::Vec3;
use shellock_geom::sparse::SparseError;
use shellock_mechanics::neighbourhood::{outer_ring, two_plates};
use shellock_mechanics::{Resistance, Station, SurfaceModel, SurfaceParams};

use super::interface::{SeamFrame, meeting};

/// Number of orientations of connectors about the seam.
pub const N_ORIENTATIONS: usize = 8;

/// Number of squares along the seam and beside it, and their size, mm. The neighbourhood is about as large as
/// half a piece.
const ALONG: usize = 8;
const BESIDE: usize = 4;
const EDGE_MM: f64 = 5.0;

/// Openings of a seam, mm, at the separation force of the simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct LocalTests {
    /// Openings by orientation, then by the lattice direction of the force in the frame (u, N, v).
    opening_mm: [[f64; LatticeDirection::COUNT]; N_ORIENTATIONS],
}

impl LocalTests {
    /// Simulates all 208 cases; takes some milliseconds.
    pub fn simulate(params: &SurfaceParams) -> Result<Self, SparseError> {
        let assembly = two_plates(ALONG, BESIDE, EDGE_MM);
        let model = SurfaceModel::with_held_points(params, &assembly, &outer_ring(ALONG, BESIDE))?;
        let middle = assembly.stations.len() / 2;
        let mut opening_mm = [[0.0; LatticeDirection::COUNT]; N_ORIENTATIONS];
        for (k, openings) in opening_mm.iter_mut().enumerate() {
            let (sin, cos) = angle_of(k).sin_cos();
            // Side a is the later piece. A connector is made at any angle, good or bad, since the weight w
            // accounts for that.
            let at = |s: &Station| {
                meeting(
                    s,
                    params.connector_mm,
                    true,
                    cos * s.normal + sin * s.across,
                    0.0,
                    true,
                    false,
                )
            };
            let plan: Vec<_> = assembly.stations.iter().map(at).collect();
            for (f, opening) in LatticeDirection::all().zip(openings) {
                let force = |s: &Station| params.force_n_per_mm * s.length_mm * in_world(s, f.unit());
                let pulls: Vec<Vec3> = assembly.stations.iter().map(force).collect();
                let solution = model.respond(&plan, &pulls)?;
                if let Resistance::Holds(found) = solution.resistance {
                    *opening = found.opening_mm[middle];
                }
            }
        }
        Ok(Self { opening_mm })
    }

    /// Opening `d(u, v, s, f)`, mm, if the later piece leaves along `s` and is pulled by `f`, both unit
    /// vectors.
    pub fn opening_mm(&self, frame: &SeamFrame, s: Vec3, f: Vec3) -> f64 {
        let angle = s
            .dot(frame.across)
            .atan2(s.dot(frame.normal))
            .rem_euclid(std::f64::consts::TAU);
        let at = angle / std::f64::consts::TAU * N_ORIENTATIONS as f64;
        let (low, share) = (at.floor() as usize % N_ORIENTATIONS, at.fract());
        let high = (low + 1) % N_ORIENTATIONS;
        let f = Vec3::new(f.dot(frame.tangent), f.dot(frame.normal), f.dot(frame.across));
        let corners = corners_of(f);
        let in_case = |k: usize| {
            corners
                .iter()
                .map(|&(d, w)| w * self.opening_mm[k][d.index()])
                .sum::<f64>()
        };
        (1.0 - share) * in_case(low) + share * in_case(high)
    }
}

/// Angle of an orientation from the normal towards the earlier piece, rad.
fn angle_of(orientation: usize) -> f64 {
    std::f64::consts::TAU * orientation as f64 / N_ORIENTATIONS as f64
}

fn in_world(station: &Station, f: Vec3) -> Vec3 {
    f.x * station.tangent + f.y * station.normal + f.z * station.across
}

/// The three lattice directions around `f`, an axis, a face diagonal and a space diagonal, with weights that
/// sum to 1.
fn corners_of(f: Vec3) -> [(LatticeDirection, f64); 3] {
    let mut axes = [0, 1, 2];
    axes.sort_by(|&x, &y| f[y].abs().total_cmp(&f[x].abs()));
    let largest = f[axes[0]].abs().max(f64::MIN_POSITIVE);
    let [second, third] = [axes[1], axes[2]].map(|i| f[i].abs() / largest);
    let mut corner = Vec3::ZERO;
    let weights = [1.0 - second, second - third, third];
    std::array::from_fn(|i| {
        corner[axes[i]] = if f[axes[i]] < 0.0 { -1.0 } else { 1.0 };
        (LatticeDirection::nearest(corner), weights[i])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: SeamFrame = SeamFrame {
        tangent: Vec3::X,
        normal: Vec3::Y,
        across: Vec3::Z,
    };

    #[test]
    fn simulated_cases_come_back_and_between_them_openings_are_between() {
        let tests = LocalTests::simulate(&SurfaceParams::default()).unwrap();
        for k in 0..N_ORIENTATIONS {
            let (sin, cos) = angle_of(k).sin_cos();
            for f in LatticeDirection::all() {
                let found = tests.opening_mm(&FRAME, Vec3::new(0.0, cos, sin), f.unit());
                assert!((found - tests.opening_mm[k][f.index()]).abs() < 1e-9);
            }
        }
        let between = tests.opening_mm(&FRAME, Vec3::new(0.0, 0.9, 0.4), Vec3::new(0.2, 0.9, -0.3));
        let all = tests.opening_mm.as_flattened();
        assert!(all.iter().any(|&d| d > between) && all.iter().any(|&d| d < between));
    }

    #[test]
    fn a_seam_opens_most_along_its_connectors_direction() {
        let tests = LocalTests::simulate(&SurfaceParams::default()).unwrap();
        let pulled = |f| tests.opening_mm(&FRAME, Vec3::Y, f);
        assert!(pulled(Vec3::Y) > 5.0 * pulled(-Vec3::Y) && pulled(Vec3::Y) > 5.0 * pulled(Vec3::Z));
    }

    #[test]
    fn weights_of_any_force_are_positive_sum_to_one_and_point_along_it() {
        for i in 0..200 {
            let (x, y) = (f64::from(i).sin(), (2.3 * f64::from(i)).cos());
            let f = Vec3::new(x, y, 0.7 - x * y).normalize();
            let corners = corners_of(f);
            assert!(
                corners.iter().all(|c| c.1 >= 0.0)
                    && (corners.iter().map(|c| c.1).sum::<f64>() - 1.0).abs() < 1e-12
            );
            let steps = corners
                .iter()
                .map(|(d, w)| *w * Vec3::from_array(d.step().map(f64::from)))
                .sum::<Vec3>();
            assert!((steps.normalize() - f).length() < 1e-9);
        }
    }
}

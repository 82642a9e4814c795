//! Bearings: points of a piece below another piece. Checks that they lie on the piece, on a surface wide
//! enough to count.

use serde::Deserialize;

use crate::barrier::{Frame, Prism, SIDES, stays_below};
use crate::mesh::Mesh;
use crate::number;
use crate::vector::{Vec3, dot, norm, scale, sub};

/// Tolerance for unit vectors and for perpendicularity.
const SAME: f64 = 1e-9;
/// Width over which the surface must continue beside its point, to one side, mm.
const BED_MM: f64 = 0.3;
/// Start of that width behind the point, mm, since the point may be at an edge.
const BEHIND_MM: f64 = 0.01;
/// Greatest drop of the surface over that width, mm, and rounding.
const BED_DROP_MM: f64 = 0.08 + 1e-6;

/// Point of piece `a` that rises along the normal, towards piece `b`.
#[derive(Clone, Deserialize)]
pub struct Bearing {
    #[serde(deserialize_with = "crate::number::place")]
    pub a: usize,
    #[serde(deserialize_with = "crate::number::place")]
    pub b: usize,
    /// Point on piece `a`, mm.
    pub point: Vec3,
    /// Unit vector from `a` to `b`.
    pub normal: Vec3,
    /// Unit vector perpendicular to the normal, towards the first side of regions.
    pub across: Vec3,
}

impl Bearing {
    /// Frame at the bearing's point, with the direction in which the point rises.
    pub fn frame(&self) -> Frame {
        Frame {
            origin: self.point,
            normal: self.normal,
            across: self.across,
        }
    }

    /// Moves the point onto the surface of `a`. An error if the point is not there, or the surface is too
    /// small.
    fn locate(&self, meshes: &[Mesh]) -> Result<Self, String> {
        let is_unit = |v: Vec3| (norm(v) - 1.0).abs() <= SAME;
        if !is_unit(self.normal) || !is_unit(self.across) || dot(self.normal, self.across).abs() > SAME {
            return Err("has directions that are no perpendicular unit vectors".into());
        }
        let (Some(own), Some(_), true) = (meshes.get(self.a), meshes.get(self.b), self.a != self.b) else {
            return Err("is not one of two pieces".into());
        };
        let (triangle, point) = own
            .on_surface(self.point)
            .ok_or_else(|| format!("is not on piece {}", number::of(self.a)))?;
        let (normal, across) = exact(self.normal, self.across);
        let bearing = Self {
            point,
            normal,
            across,
            ..self.clone()
        };
        match bearing.has_bed(own, triangle) {
            true => Ok(bearing),
            false => Err(format!("is on a speck of piece {}", number::of(self.a))),
        }
    }

    /// Returns true if the surface around `triangle` is wide enough to one side of the point.
    fn has_bed(&self, own: &Mesh, triangle: usize) -> bool {
        let down = Frame {
            normal: scale(self.normal, -1.0),
            ..self.frame()
        };
        (0..SIDES).any(|side| {
            let mut far_mm = [BED_MM; SIDES];
            [side, side + 1, side + 2]
                .iter()
                .for_each(|k| far_mm[k % SIDES] = BEHIND_MM);
            stays_below(own, triangle, &Prism::new(down, far_mm), BED_DROP_MM)
        })
    }
}

/// Nearest unit vectors that are perpendicular except for rounding. Hits and heights must be computed in the
/// same frame.
fn exact(normal: Vec3, across: Vec3) -> (Vec3, Vec3) {
    let unit = |v: Vec3| scale(v, 1.0 / norm(v));
    let normal = unit(unit(normal));
    // Two passes are enough.
    let square = |v: Vec3| unit(sub(v, scale(normal, dot(normal, v))));
    (normal, square(square(across)))
}

/// Moves the points of all bearings onto the pieces' surfaces.
pub fn locate_all(meshes: &[Mesh], bearings: &[Bearing]) -> Result<Vec<Bearing>, String> {
    let locate =
        |(i, bearing): (usize, &Bearing)| bearing.locate(meshes).map_err(|why| format!("bearing {i} {why}"));
    bearings.iter().enumerate().map(locate).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::tests::cuboid;

    /// Bearing at the top of a box of `width_mm`, offset from the middle.
    fn at_top(width_mm: f64, x: f64, y: f64, z: f64) -> Result<Vec<Bearing>, String> {
        let half = 0.5 * width_mm;
        let meshes = [
            cuboid([-half, -half, -5.0], [half, half, 0.0]),
            cuboid([-9.0, -9.0, 0.1], [9.0, 9.0, 5.0]),
        ];
        let up = Bearing {
            a: 0,
            b: 1,
            point: [x, y, z],
            normal: [0.0, 0.0, 1.0],
            across: [1.0, 0.0, 0.0],
        };
        locate_all(&meshes, &[up])
    }

    #[test]
    fn a_bearing_lies_on_its_piece_also_at_an_edge_but_not_on_a_speck() {
        assert!(at_top(4.0, 0.3, 0.2, 0.0).is_ok());
        let moved = at_top(4.0, 0.3, 0.2, 0.00009).unwrap();
        assert_eq!(moved[0].point[2], 0.0, "taken to the surface");
        assert!(at_top(4.0, 0.3, 0.2, 0.0002).is_err(), "above it");
        assert!(at_top(4.0, 0.3, 0.2, f64::NAN).is_err());
        assert!(at_top(4.0, 1.985, 0.2, 0.0).is_ok(), "at an edge");
        assert!(at_top(0.2, 0.0, 0.0, 0.0).is_err(), "a needle");
    }

    #[test]
    fn directions_are_perpendicular_unit_vectors_of_two_pieces() {
        let meshes = [
            cuboid([-2.0; 3], [2.0, 2.0, 0.0]),
            cuboid([-2.0, -2.0, 0.1], [2.0; 3]),
        ];
        let good = Bearing {
            a: 0,
            b: 1,
            point: [0.3, 0.2, 0.0],
            normal: [0.0, 0.0, 1.0],
            across: [1.0, 0.0, 0.0],
        };
        let is_good = |bearing: Bearing| locate_all(&meshes, &[bearing]).is_ok();
        assert!(is_good(good.clone()));
        assert!(!is_good(Bearing {
            normal: [0.0, 0.0, 1.00001],
            ..good.clone()
        }));
        assert!(!is_good(Bearing {
            across: [0.8, 0.0, 0.6],
            ..good.clone()
        }));
        assert!(!is_good(Bearing { b: 0, ..good.clone() }));
        assert!(!is_good(Bearing { b: 2, ..good }));
    }
}

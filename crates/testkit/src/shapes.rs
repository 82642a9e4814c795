//! Simple bodies as meshes and volumes, and an interlocking assembly of three parts.

use shellock_geom::contour::contour;
use shellock_geom::{Aabb, TriMesh, Vec3, Volume};

use crate::plain::{self, Plain};

fn mesh((points, triangles): Plain) -> TriMesh {
    TriMesh { points, triangles }
}

/// An octahedron, refined `n_splits` times, on the ellipsoid with half axes `radii_mm`: 8 · 4ⁿ triangles.
pub fn sphere(n_splits: usize, radii_mm: Vec3) -> TriMesh {
    mesh(plain::sphere(n_splits, radii_mm))
}

/// A ball around `center`: [`sphere`], moved there.
pub fn ball(n_splits: usize, center: Vec3, radius_mm: f64) -> TriMesh {
    let mut ball = sphere(n_splits, Vec3::splat(radius_mm));
    ball.points.iter_mut().for_each(|p| *p += center);
    ball
}

/// A ball around the origin, contoured on a grid: triangles of about the same size everywhere.
pub fn contoured_ball(radius_mm: f64, cell_mm: f64) -> TriMesh {
    let bounds = Aabb {
        min: Vec3::splat(-radius_mm),
        max: Vec3::splat(radius_mm),
    };
    contour(bounds, cell_mm, |p| radius_mm - p.length())
}

/// A tetrahedron at a corner of the unit cube, oriented outwards.
pub fn tetrahedron() -> TriMesh {
    mesh(plain::tetrahedron())
}

/// A torus around z as a grid of `cells` around and across it, each divided into two triangles.
pub fn torus(radius_mm: f64, tube_mm: f64, cells: [u32; 2]) -> TriMesh {
    mesh(plain::torus(radius_mm, tube_mm, cells))
}

/// A box between two opposite corners.
pub fn cuboid(min: impl Into<Vec3>, max: impl Into<Vec3>) -> Volume {
    Volume::cuboid(Aabb {
        min: min.into(),
        max: max.into(),
    })
}

/// A box given by the range of each coordinate, which reads better for boxes beside each other.
pub fn brick(x: [f64; 2], y: [f64; 2], z: [f64; 2]) -> Volume {
    cuboid([x[0], y[0], z[0]], [x[1], y[1], z[1]])
}

/// The box given by `ranges`, grown by `gap_mm` on all sides.
pub fn room(ranges: [[f64; 2]; 3], gap_mm: f64) -> Volume {
    let [x, y, z] = ranges.map(|[low, high]| [low - gap_mm, high + gap_mm]);
    brick(x, y, z)
}

/// Range of each coordinate of the cube of [`PinnedLid`], mm.
pub const ALL: [f64; 2] = [0.0, 30.0];

/// A cube in three parts: a base with a T-shaped groove that ends blind at x = 10, a lid with a T-shaped
/// tongue that slides in along −x, and a pin through both, pushed in along −z. They interlock while the pin
/// is in.
#[derive(Clone, Debug)]
pub struct PinnedLid {
    /// Gap between all faces that face each other, mm.
    pub gap_mm: f64,
    /// Overhang of the base's lips over the tongue's foot, mm.
    pub lip_mm: f64,
    /// Ranges of the pin's coordinates; 1 to 30 mm along z. A pin that ends above the lid's lower side holds
    /// nothing.
    pub pin: [[f64; 2]; 3],
}

impl Default for PinnedLid {
    fn default() -> Self {
        Self {
            gap_mm: 0.1,
            lip_mm: 4.0,
            pin: [[17.0, 24.0], [13.0, 17.0], [1.0, 30.0]],
        }
    }
}

impl PinnedLid {
    /// Returns base, lid and pin. They leave along x, x and z.
    pub fn parts(&self) -> [Volume; 3] {
        let stem = [[10.0, 30.0], [11.0, 19.0], [9.0, 16.0]];
        let foot = [[10.0, 30.0], [11.0 - self.lip_mm, 19.0 + self.lip_mm], [5.0, 9.0]];
        let [x, y, z] = self.pin;
        let hole = room([x, y, [z[0], 40.0]], self.gap_mm);
        let open = |[x, y, z]: [[f64; 2]; 3]| room([[x[0], 40.0], y, z], self.gap_mm);
        let base = brick(ALL, ALL, [0.0, 15.0 - 0.5 * self.gap_mm])
            .subtract(&open(stem))
            .subtract(&open(foot))
            .subtract(&hole);
        let plate = brick(ALL, ALL, [15.0 + 0.5 * self.gap_mm, 30.0]);
        let tongue = [stem, foot].map(|[x, y, z]| brick(x, y, z));
        let lid = Volume::union_all([vec![plate], tongue.into()].concat()).subtract(&hole);
        [base, lid, brick(x, y, z)]
    }
}

/// A volume's mesh with coordinates rounded to 32 bits, as a file stores it.
pub fn rounded_mesh(volume: &Volume) -> TriMesh {
    let mut mesh = volume.to_mesh();
    mesh.points.iter_mut().for_each(|p| *p = p.as_vec3().as_dvec3());
    mesh
}

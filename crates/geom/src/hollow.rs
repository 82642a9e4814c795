//! Detection and filling of bodies that are already hollow: their cavity has a few narrow openings, such as
//! slicers for resin make.
//!
//! Space outside the solid is divided by the largest balls that fit. A cavity is a region that has more room
//! inside than in any opening, so that a suitable ball cannot leave. Triangles that bound the cavity are
//! separated from the others. The shortest lines between the two sets are the rims of the openings. A mug,
//! whose mouth is as wide as the mug, is thus not hollow, and neither is a cage, which is mostly openings.

mod cut;
mod grid;
mod rooms;
mod sides;

use crate::bvh::TriangleBvh;
use crate::repair::{cap_all, crossings};
use crate::topology::Topology;
use crate::{NotSolid, Solid, TriMesh, Vec3};
use grid::Grid;
use rooms::rooms;
use sides::{CavityRim, Sides};

/// Least share of the cavity in the volume of cavity and solid together, for a body to be hollow. Walls of 5
/// mm leave 42 % of a cube of 40 mm. The largest fold of the solid figures that were examined has 3 %.
pub const LEAST_SHARE: f64 = 0.1;
/// Largest share of the openings in the cavity's surface; beyond it, openings are mouths. A bottle has 1 to 2
/// %, a vase whose mouth is half as wide as its belly 5 %, a mug 20 %.
const MOST_OPEN_SHARE: f64 = 0.04;
/// Least share of a cavity's nodes that are enclosed along all axes. The others see out through an opening.
const LEAST_ENCLOSED: f64 = 0.4;
/// Number of triangles at which the wall is measured.
const N_MEASURED: usize = 2000;
/// Cosine of the greatest angle between the two sides of a wall.
const COS_WALL: f64 = 0.5;

/// Description of a body that is already hollow.
#[derive(Clone, Debug, PartialEq)]
pub struct HollowBody {
    /// Median wall thickness over the cavity's surface, mm.
    pub wall_mm: f64,
    /// Volume of the cavity, mm³.
    pub cavity_mm3: f64,
    /// Openings that lead into the cavity, widest first.
    pub openings: Vec<Opening>,
    /// True for each triangle that bounds the cavity.
    is_cavity: Vec<bool>,
}

/// An opening of a cavity, at its narrowest place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Opening {
    /// Centre of the opening, mm.
    pub at: Vec3,
    /// Diameter of the circle of the same area, mm.
    pub width_mm: f64,
    /// Unit vector out of the cavity.
    pub outwards: Vec3,
}

/// A hollow body that was made solid.
#[derive(Clone, Debug, PartialEq)]
pub struct Filled {
    /// Solid body: the unchanged outer triangles, and new ones over the openings.
    pub solid: Solid,
    /// Triangle of the hollow body that each triangle is, or is next to.
    pub source_face: Vec<u32>,
}

/// Error: an opening cannot be closed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "the opening near ({:.1}, {:.1}, {:.1}) mm is not a plain hole that can be closed here; close it in a \
     modelling program",
    at.x, at.y, at.z
)]
pub struct CannotFill {
    /// Position of the widest opening, mm.
    pub at: Vec3,
}

/// Finds the cavity of `solid` and its openings. `None` unless the cavity takes at least `least_share` of the
/// volume of cavity and solid together.
///
/// O(n) for solid figures; otherwise a second for a hundred thousand triangles. The same on any number of
/// threads.
pub fn find_hollow(solid: &Solid, least_share: f64) -> Option<HollowBody> {
    let grid = Grid::new(solid);
    let node_mm3 = grid.cell_mm.powi(3);
    let is_large = |cavity_mm3: f64, share: f64| cavity_mm3 >= share * (solid.volume() + cavity_mm3);
    let enclosed_mm3 = grid.n_enclosed() as f64 * node_mm3;
    if !is_large(enclosed_mm3, LEAST_ENCLOSED * least_share) {
        return None;
    }
    let mesh = solid.mesh();
    let tree = TriangleBvh::new(mesh);
    let least_nodes = LEAST_ENCLOSED * least_share * solid.volume() / node_mm3;
    let rooms = rooms(&grid, &tree, least_nodes)?;
    let topology = Topology::new(solid);
    let mut sides = Sides::new(mesh, &topology, &tree, &grid, &rooms);
    let wall_mm = wall(&sides, &tree)?;
    sides.tighten(wall_mm, grid.cell_mm);
    let rims = sides.rims();
    let caps: Vec<Vec3> = rims.iter().map(|rim| cap_area(&sides, rim)).collect();
    let open_mm2: f64 = caps.iter().map(|area| area.length()).sum();
    let cavity_mm3 = cavity(&sides, &rims);
    if rims.is_empty()
        || open_mm2 > MOST_OPEN_SHARE * sides.cavity_mm2()
        || !is_large(cavity_mm3, least_share)
    {
        return None;
    }
    let mut openings: Vec<Opening> = rims
        .iter()
        .zip(&caps)
        .map(|(rim, area)| Opening {
            at: rim.center,
            width_mm: 2.0 * (area.length() / std::f64::consts::PI).sqrt(),
            outwards: area.normalize_or_zero(),
        })
        .collect();
    openings.sort_by(|a, b| b.width_mm.total_cmp(&a.width_mm));
    Some(HollowBody {
        wall_mm: wall(&sides, &tree)?,
        cavity_mm3,
        openings,
        is_cavity: sides.is_cavity,
    })
}

/// Removes the cavity that [`find_hollow`] found in `solid`. The openings are closed by triangles of least
/// area between their rims; the rest stays as it is.
pub fn fill(solid: &Solid, hollow: &HollowBody) -> Result<Filled, CannotFill> {
    let mesh = solid.mesh();
    let refused = CannotFill {
        at: hollow.openings.first().map_or(Vec3::ZERO, |opening| opening.at),
    };
    let outer: Vec<u32> = (0..mesh.triangles.len() as u32)
        .filter(|&face| !hollow.is_cavity[face as usize])
        .collect();
    let mut source_face = outer.clone();
    let mut closed = TriMesh {
        points: mesh.points.clone(),
        triangles: outer.iter().map(|&face| mesh.triangles[face as usize]).collect(),
    };
    for (cap, beside) in cap_all(&closed).ok_or(refused)? {
        source_face.resize(source_face.len() + cap.len(), outer[beside as usize]);
        closed.triangles.extend(cap);
    }
    let filled = Solid::new(closed.without_unused_points()).map_err(|_: NotSolid| refused)?;
    let is_one = crate::check::components(filled.mesh()).1 == 1;
    if is_one && crossings(filled.mesh()).count == 0 {
        Ok(Filled {
            solid: filled,
            source_face,
        })
    } else {
        Err(refused)
    }
}

/// Area vector of a surface over an opening: area, mm², times the normal out of the cavity.
fn cap_area(sides: &Sides, rim: &CavityRim) -> Vec3 {
    let part = |[from, to]: [Vec3; 2]| 0.5 * (to - rim.center).cross(from - rim.center);
    rim.edges.iter().map(|&h| part(sides.ends(h))).sum()
}

/// Volume enclosed by the cavity's triangles and flat caps over its openings, mm³.
fn cavity(sides: &Sides, rims: &[CavityRim]) -> f64 {
    let origin = rims.first().map_or(Vec3::ZERO, |rim| rim.center);
    let volume = |corners: [Vec3; 3]| {
        let [a, b, c] = corners.map(|p| p - origin);
        a.dot(b.cross(c)) / 6.0
    };
    let inner = (0..sides.is_cavity.len()).filter(|&face| sides.is_cavity[face]);
    let walls: f64 = inner.map(|face| volume(sides.mesh.corners(face))).sum();
    let caps = rims.iter().flat_map(|rim| {
        rim.edges.iter().map(|&h| {
            let [from, to] = sides.ends(h);
            volume([from, to, rim.center])
        })
    });
    -(walls + caps.sum::<f64>())
}

/// Median thickness between the cavity and the outside, weighted by area, mm; `None` if there is no cavity.
fn wall(sides: &Sides, tree: &TriangleBvh) -> Option<f64> {
    let mesh = sides.mesh;
    let inner: Vec<usize> = (0..mesh.triangles.len())
        .filter(|&face| sides.is_cavity[face])
        .collect();
    let step = inner.len().div_ceil(N_MEASURED).max(1);
    let longest_mm = mesh.bounds().diagonal();
    let measured = inner.iter().step_by(step).filter_map(|&face| {
        let inwards = -mesh.face_normal(face);
        let start = mesh.face_center(face) + 1e-9 * longest_mm * inwards;
        let (other, mm) = tree.first_hit(start, inwards, longest_mm)?;
        let is_wall =
            !sides.is_cavity[other as usize] && mesh.face_normal(other as usize).dot(inwards) >= COS_WALL;
        is_wall.then(|| (mm, mesh.face_area(face)))
    });
    let mut walls: Vec<(f64, f64)> = measured.collect();
    walls.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all_mm2: f64 = walls.iter().map(|w| w.1).sum();
    let mut below_mm2 = 0.0;
    let median = walls.iter().find(|w| {
        below_mm2 += w.1;
        2.0 * below_mm2 >= all_mm2
    });
    median.map(|w| w.0)
}

#[cfg(test)]
mod tests;

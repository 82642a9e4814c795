//! Rounding of exact meshes to the 32-bit coordinates of files, without losing the properties that make them
//! printable.

use std::collections::HashMap;

use crate::{Solid, TriMesh, Vec3, Volume};

/// Edge length below which edges collapse before rounding, mm. A 32-bit coordinate of 150 mm has steps of
/// 1.5e-5 mm.
const SHORT_MM: f64 = 1e-4;
/// Distance by which points move inwards if they would coincide without being joined by an edge, mm. Far
/// above the steps of the format, far below what any printer resolves.
const APART_MM: f64 = 2e-3;
/// Largest number of rounds of collapsing and moving apart. On all test models three were enough.
const MAX_ROUNDS: usize = 10;

/// Reason why a region has no printable 32-bit mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NotPrintable {
    /// Nothing is left of the body.
    #[error("nothing is left of the body")]
    Empty,
    /// Distinct points still coincide after all rounds.
    #[error(
        "the surface still touches itself at {count} points after rounding, first at ({:.3}, {:.3}, {:.3})",
        at.x, at.y, at.z
    )]
    Touches {
        /// Number of such places.
        count: usize,
        /// Position of the first place, mm.
        at: Vec3,
    },
    /// The rounded mesh bounds no volume.
    #[error("the rounded surface is not closed: {0}")]
    NotSolid(String),
}

/// Boundary of `volume` with coordinates that 32-bit floats hold exactly, and no two points at the same
/// place. A program that merges equal points, as slicers do, therefore sees the same manifold.
///
/// Points move by at most a few µm, and only where the surface touches itself or has edges under 0.1 µm.
pub fn printable(volume: &Volume) -> Result<TriMesh, NotPrintable> {
    if volume.is_empty() {
        return Err(NotPrintable::Empty);
    }
    let mut mesh = in_canonical_order(&round_points(&volume.to_mesh()));
    let mut touching = coincident(&mesh);
    for round in 0..MAX_ROUNDS {
        if touching.is_empty() {
            break;
        }
        move_apart(&mut mesh, &touching, APART_MM * (1.0 + 0.37 * round as f64));
        let again = Volume::from_closed_mesh(&mesh).map_err(|e| NotPrintable::NotSolid(e.to_string()))?;
        mesh = in_canonical_order(&round_points(&again.simplify(SHORT_MM).to_mesh()));
        touching = coincident(&mesh);
    }
    if let Some(first) = touching.first() {
        return Err(NotPrintable::Touches {
            count: touching.len(),
            at: mesh.points[first[0] as usize],
        });
    }
    Solid::new(mesh)
        .map(Solid::into_mesh)
        .map_err(|e| NotPrintable::NotSolid(e.to_string()))
}

/// Makes the largest part of `volume` [`printable`] as one closed surface. Separate chips are dropped. Small
/// cavities, which also arise where a surface that touched itself is moved apart, are filled.
pub fn printable_body(volume: &Volume) -> Result<TriMesh, NotPrintable> {
    let largest = |volume: &Volume| {
        volume
            .components()
            .into_iter()
            .next()
            .unwrap_or_else(Volume::empty)
    };
    let mut mesh = printable(&largest(volume))?;
    for _ in 0..MAX_ROUNDS {
        let again = Volume::from_closed_mesh(&mesh).map_err(|e| NotPrintable::NotSolid(e.to_string()))?;
        if again.components().len() == 1 {
            break;
        }
        mesh = printable(&largest(&again))?;
    }
    Ok(mesh)
}

fn round_points(mesh: &TriMesh) -> TriMesh {
    // Adding 0 turns −0 into 0, so equal points have equal bits.
    let round = |x: f64| f64::from(x as f32) + 0.0;
    TriMesh {
        points: mesh
            .points
            .iter()
            .map(|p| Vec3::new(round(p.x), round(p.y), round(p.z)))
            .collect(),
        triangles: mesh.triangles.clone(),
    }
}

/// Sorts points by coordinates and triangles by their corners, lowest first. The contents of a file then
/// depend only on the surface, not on how it was made.
fn in_canonical_order(mesh: &TriMesh) -> TriMesh {
    let mut order: Vec<u32> = (0..mesh.points.len() as u32).collect();
    let key = |v: &u32| mesh.points[*v as usize].to_array();
    order.sort_by(|a, b| {
        let (a, b) = (key(a), key(b));
        a[0].total_cmp(&b[0])
            .then(a[1].total_cmp(&b[1]))
            .then(a[2].total_cmp(&b[2]))
    });
    let mut rank = vec![0u32; order.len()];
    for (new, &old) in order.iter().enumerate() {
        rank[old as usize] = new as u32;
    }
    let mut triangles: Vec<[u32; 3]> = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| rank[v as usize]);
            if a < b && a < c {
                [a, b, c]
            } else if b < c {
                [b, c, a]
            } else {
                [c, a, b]
            }
        })
        .collect();
    triangles.sort_unstable();
    TriMesh {
        points: order.iter().map(|&v| mesh.points[v as usize]).collect(),
        triangles,
    }
}

/// Groups of different points at the same place, ordered by their first member.
fn coincident(mesh: &TriMesh) -> Vec<Vec<u32>> {
    let mut at: HashMap<[u64; 3], Vec<u32>> = HashMap::with_capacity(mesh.points.len());
    for (v, p) in mesh.points.iter().enumerate() {
        at.entry(p.to_array().map(f64::to_bits))
            .or_default()
            .push(v as u32);
    }
    let mut groups: Vec<Vec<u32>> = at.into_values().filter(|g| g.len() > 1).collect();
    groups.sort_unstable();
    groups
}

/// Moves the points of all groups apart: tips of material inwards, and outwards where all of a group are
/// bottoms of pits, which would otherwise pass through each other. A point joined to its twin by an edge
/// stays, since the edge will collapse.
fn move_apart(mesh: &mut TriMesh, groups: &[Vec<u32>], by_mm: f64) {
    let group_of: HashMap<u32, usize> = groups
        .iter()
        .enumerate()
        .flat_map(|(g, members)| members.iter().map(move |&v| (v, g)))
        .collect();
    let mut fans: HashMap<u32, Fan> = HashMap::new();
    for (f, t) in mesh.triangles.iter().enumerate() {
        for (k, &v) in t.iter().enumerate().filter(|(_, v)| group_of.contains_key(v)) {
            let fan = fans.entry(v).or_default();
            let [a, b] = [t[(k + 1) % 3], t[(k + 2) % 3]];
            let tip = mesh.points[v as usize];
            let edges = [a, b].map(|w| (mesh.points[w as usize] - tip).normalize_or_zero());
            fan.normal += mesh.double_area_vector(f);
            fan.edges += edges[0].angle_between(edges[1]) * (edges[0] + edges[1]);
            fan.has_twin |= [a, b].iter().any(|w| group_of.get(w) == group_of.get(&v));
        }
    }
    for members in groups {
        let are_pits = members.iter().all(|v| fans.get(v).is_some_and(Fan::is_pit));
        let sign = if are_pits { 1.0 } else { -1.0 };
        for (rank, v) in members.iter().enumerate() {
            if let Some(fan) = fans.get(v).filter(|fan| !fan.has_twin) {
                // Distances differ by rank, so that members with the same normal separate, too.
                let away_mm = sign * by_mm * (1.0 + 0.5 * rank as f64);
                mesh.points[*v as usize] += fan.normal.normalize_or_zero() * away_mm;
            }
        }
    }
}

/// Surface around a point.
#[derive(Default)]
struct Fan {
    /// Sum of the triangles' normals, each twice the triangle's area.
    normal: Vec3,
    /// Sum of the directions in which the triangles lead away, weighted by their angles.
    edges: Vec3,
    /// True if an edge joins the point to another at the same place.
    has_twin: bool,
}

impl Fan {
    /// Returns true if the point is the bottom of a pit: the surface rises from it on the whole.
    fn is_pit(&self) -> bool {
        self.edges.dot(self.normal) > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::repair::crossing_faces;
    use crate::samples::cuboid;

    #[test]
    fn a_body_loses_its_chips_and_its_slivers_of_hollow() {
        let body = cuboid([0.0; 3], [9.0; 3]);
        let hollow = body
            .subtract(&cuboid([4.0; 3], [4.01, 4.1, 5.0]))
            .union(&cuboid([11.0; 3], [12.0; 3]));
        assert_eq!(hollow.components().len(), 3);
        let made = printable_body(&hollow).unwrap();
        assert_eq!((made.triangles.len(), made.signed_volume()), (12, body.volume()));
    }

    #[test]
    fn boxes_that_touch_along_an_edge_come_apart() {
        let a = cuboid(Vec3::ZERO, Vec3::ONE);
        let b = cuboid([1.0, 1.0, 0.0], [2.0, 2.0, 1.0]);
        let both = a.union(&b);
        let mesh = printable(&both).unwrap();
        assert!(coincident(&mesh).is_empty());
        assert!((mesh.signed_volume() - 2.0).abs() < 0.02);
    }

    #[test]
    fn hollows_that_touch_along_an_edge_come_apart_without_crossing() {
        let mut mesh = cuboid([-1.0; 3], [3.0; 3]).to_mesh();
        for (low, high) in [([0.0; 3], [1.0; 3]), ([1.0, 1.0, 0.0], [2.0, 2.0, 1.0])] {
            let hollow = cuboid(low, high).to_mesh();
            let first = mesh.points.len() as u32;
            mesh.points.extend(&hollow.points);
            let inwards = hollow
                .triangles
                .iter()
                .map(|&[a, b, c]| [a, c, b].map(|v| v + first));
            mesh.triangles.extend(inwards);
        }
        let apart = printable(&Volume::from_closed_mesh(&mesh).unwrap()).unwrap();
        assert!(coincident(&apart).is_empty());
        assert!(crossing_faces(&apart).is_empty());
        assert!((apart.signed_volume() - 62.0).abs() < 0.03);
    }

    #[test]
    fn coordinates_are_exactly_what_32_bits_hold() {
        let v = cuboid([0.1; 3], [140.3; 3]);
        for p in &printable(&v).unwrap().points {
            assert!(p.to_array().iter().all(|&x| f64::from(x as f32) == x));
        }
    }
}

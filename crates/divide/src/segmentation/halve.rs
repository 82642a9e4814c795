//! Subdivision of long edges, so that patches and seams have enough points.

use shellock_geom::subdivide::halve_edges;
use shellock_geom::topology::ends;
use shellock_geom::{Solid, Topology};

use super::{FaceLabels, SegmentationParams};

/// Halves edges until none is longer than the limit. For models much larger than 300 mm, the limit grows to
/// bound the number of triangles.
pub(super) fn halve_long_edges(params: &SegmentationParams, solid: &Solid) -> (Solid, Vec<u32>) {
    let limit_mm = params.max_edge_mm.max((solid.mesh().area() / 20_000.0).sqrt());
    let mut fine = solid.clone();
    let mut source_face: Vec<u32> = (0..solid.mesh().triangles.len() as u32).collect();
    loop {
        let mesh = fine.mesh();
        let is_long = |a: u32, b: u32| mesh.points[a as usize].distance(mesh.points[b as usize]) > limit_mm;
        if !mesh
            .triangles
            .iter()
            .any(|&[a, b, c]| is_long(a, b) || is_long(b, c) || is_long(c, a))
        {
            return (fine, source_face);
        }
        let (next, parent) = halve_edges(&fine, &Topology::new(&fine), is_long);
        source_face = parent.iter().map(|&f| source_face[f as usize]).collect();
        fine = next;
    }
}

/// Halves edges near seams so that curves have enough points to be smooth.
pub(super) fn halve_edges_near_seams(
    solid: &Solid,
    labels: &FaceLabels,
    limit_mm: f64,
) -> (Solid, FaceLabels, Vec<u32>) {
    /// Rings of triangles beside the seam that are refined; the smoothed seam stays within them.
    const N_RINGS: usize = 2;
    let (mut fine, mut fine_labels) = (solid.clone(), labels.clone());
    let mut source_face: Vec<u32> = (0..solid.mesh().triangles.len() as u32).collect();
    loop {
        let (mesh, topology) = (fine.mesh(), Topology::new(&fine));
        let mut is_near = vec![false; mesh.points.len()];
        for h in 0..topology.n_half_edges() as u32 {
            let (f, g) = (h as usize / 3, topology.opposite(h) as usize / 3);
            is_near[ends(mesh, h).0 as usize] |= fine_labels.patch_of_face[f] != fine_labels.patch_of_face[g];
        }
        for _ in 0..N_RINGS {
            let before = is_near.clone();
            for t in mesh
                .triangles
                .iter()
                .filter(|t| t.iter().any(|&v| before[v as usize]))
            {
                t.iter().for_each(|&v| is_near[v as usize] = true);
            }
        }
        let wants = |a: u32, b: u32| {
            is_near[a as usize]
                && is_near[b as usize]
                && mesh.points[a as usize].distance(mesh.points[b as usize]) > limit_mm
        };
        if !mesh
            .triangles
            .iter()
            .any(|&[a, b, c]| wants(a, b) || wants(b, c) || wants(c, a))
        {
            return (fine, fine_labels, source_face);
        }
        let (next, parent) = halve_edges(&fine, &topology, wants);
        source_face = parent.iter().map(|&f| source_face[f as usize]).collect();
        fine_labels = fine_labels.inherit(&parent);
        fine = next;
    }
}

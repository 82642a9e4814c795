//! Writes a segmentation as paint for slicers.

use shellock::SegmentedSurface;
use shellock_formats::write_painted_3mf;

/// Number of colours that all slicers with paint can distinguish.
const N_COLORS: u32 = 16;

/// Writes a 3MF of the surface with its patches painted; also returns true if each patch has its own colour.
///
/// Patch k has colour k + 1, up to 16 patches. With more, patches share colours, but patches that touch get
/// different ones where possible.
pub fn paint_patches(name: &str, surface: &SegmentedSurface) -> (Vec<u8>, bool) {
    let is_distinct = surface.n_patches <= N_COLORS as usize;
    let color_of_patch = if is_distinct {
        (1..=surface.n_patches as u32).collect()
    } else {
        shared_colors(surface)
    };
    let colors: Vec<u32> = surface
        .patch_of_face
        .iter()
        .map(|p| color_of_patch[p.0 as usize])
        .collect();
    (write_painted_3mf(name, &surface.mesh, &colors), is_distinct)
}

/// Colours the patches in order: each gets the least-used colour, preferably one that no neighbour has.
fn shared_colors(surface: &SegmentedSurface) -> Vec<u32> {
    let n = surface.n_patches;
    let mut touches = vec![vec![false; n]; n];
    // Neighbours share a point: areas of one colour that meet in a point are hard to distinguish, too.
    let mut patches_of_point = vec![Vec::new(); surface.mesh.points.len()];
    for (triangle, patch) in surface.mesh.triangles.iter().zip(&surface.patch_of_face) {
        for &point in triangle {
            let patches: &mut Vec<usize> = &mut patches_of_point[point as usize];
            if !patches.contains(&(patch.0 as usize)) {
                patches.iter().for_each(|&p| {
                    touches[p][patch.0 as usize] = true;
                    touches[patch.0 as usize][p] = true;
                });
                patches.push(patch.0 as usize);
            }
        }
    }
    let mut colors: Vec<u32> = Vec::with_capacity(n);
    for near in &touches {
        let n_uses = |color: u32| colors.iter().filter(|&&c| c == color).count();
        let is_near = |color: u32| {
            near.iter()
                .zip(&colors)
                .any(|(touches, &c)| *touches && c == color)
        };
        let best = (1..=N_COLORS).min_by_key(|&color| (is_near(color), n_uses(color), color));
        colors.push(best.unwrap_or(1));
    }
    colors
}

#[cfg(test)]
mod tests {
    use shellock::PatchId;
    use shellock_formats::read_mesh;
    use shellock_geom::{TriMesh, Vec3};

    use super::*;

    /// A strip of quads, each its own patch.
    fn strip(n_patches: usize) -> SegmentedSurface {
        let points = (0..2 * n_patches + 2)
            .map(|i| Vec3::new((i / 2) as f64, (i % 2) as f64, 0.0))
            .collect();
        let quads = (0..n_patches as u32).map(|q| 2 * q);
        let triangles: Vec<[u32; 3]> = quads
            .flat_map(|i| [[i, i + 2, i + 3], [i, i + 3, i + 1]])
            .collect();
        SegmentedSurface {
            patch_of_face: (0..triangles.len() as u32)
                .map(|face| PatchId(face / 2))
                .collect(),
            source_face: (0..triangles.len() as u32).collect(),
            mesh: TriMesh { points, triangles },
            n_patches,
        }
    }

    #[test]
    fn up_to_sixteen_patches_have_their_own_colours_and_more_differ_from_their_neighbours() {
        for n in [2, 16, 17, 100] {
            let (bytes, is_distinct) = paint_patches("strip", &strip(n));
            let loaded = read_mesh(&bytes, None).unwrap();
            let colors: Vec<i64> = loaded.face_labels().unwrap().iter().step_by(2).copied().collect();
            assert_eq!((is_distinct, colors.len()), (n <= 16, n));
            assert!(colors.iter().all(|c| (1..=16).contains(c)));
            assert!(colors.windows(2).all(|pair| pair[0] != pair[1]));
            assert!(!is_distinct || colors == (1..=n as i64).collect::<Vec<_>>());
        }
    }
}

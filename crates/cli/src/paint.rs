//! A segmentation as paint for slicers.

use shellock::SegmentedSurface;
use shellock_geom::io::write_painted_3mf;

/// Colours that all slicers with paint can tell apart.
const N_COLORS: u32 = 16;

/// A 3MF of the surface with its patches painted, and whether each patch has a colour of its own.
///
/// Patch k has colour k + 1 up to 16 patches. With more, patches share colours; those that touch do not, unless they must.
pub fn painted(name: &str, surface: &SegmentedSurface) -> (Vec<u8>, bool) {
    let is_distinct = surface.n_patches <= N_COLORS as usize;
    let color_of_patch = if is_distinct { (1..=surface.n_patches as u32).collect() } else { shared_colors(surface) };
    let colors: Vec<u32> = surface.patch_of_face.iter().map(|p| color_of_patch[p.0 as usize]).collect();
    (write_painted_3mf(name, &surface.mesh, &colors), is_distinct)
}

/// For each patch, in order, the colour that fewest patches have of those that no neighbour has yet.
fn shared_colors(surface: &SegmentedSurface) -> Vec<u32> {
    let n = surface.n_patches;
    let mut touches = vec![vec![false; n]; n];
    // Patches that share a point, since paint of one colour that meets in a point is hard to tell apart, too.
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
    for patch in 0..n {
        let n_uses = |color: u32| colors.iter().filter(|&&c| c == color).count();
        let is_near = |color: u32| (0..patch).any(|p| touches[patch][p] && colors[p] == color);
        let best = (1..=N_COLORS).min_by_key(|&color| (is_near(color), n_uses(color), color));
        colors.push(best.unwrap_or(1));
    }
    colors
}

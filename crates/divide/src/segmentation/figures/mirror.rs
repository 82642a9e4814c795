//! Symmetry of a division compared with that of its model.

use rayon::prelude::*;
use shellock_geom::bvh::TriangleBvh;
use shellock_segment::symmetry::Plane;
use shellock_surface::SegmentedSurface;

/// Share of the area whose mirror image lies in the image of its piece. A point's mirror image is the surface
/// point nearest to it. A piece's image is the piece that holds most of its mirror image, if this holds the
/// other way round, too.
pub(super) fn mirrored_share(plane: &Plane, surface: &SegmentedSurface, bvh: &TriangleBvh) -> f64 {
    let (mesh, n) = (&surface.mesh, surface.n_patches);
    let beyond = |face: usize| {
        let nearest = bvh.nearest(plane.image(mesh.face_center(face)), f64::INFINITY);
        nearest.map_or(face, |found| found.face as usize)
    };
    let images: Vec<usize> = (0..mesh.triangles.len()).into_par_iter().map(beyond).collect();
    let mut common = vec![vec![0.0; n]; n];
    for (face, &image) in images.iter().enumerate() {
        let [of, into] = [face, image].map(|f| usize::from(surface.patch_of_face[f]));
        common[of][into] += mesh.face_area(face);
    }
    let image = |piece: usize| {
        let largest = (0..n).max_by(|&p, &q| common[piece][p].total_cmp(&common[piece][q]));
        largest.unwrap_or(piece)
    };
    let mirrored = (0..n).filter(|&piece| image(image(piece)) == piece);
    let area_mm2: f64 = mirrored.map(|piece| common[piece][image(piece)]).sum();
    area_mm2 / mesh.area().max(f64::MIN_POSITIVE)
}

//! Symmetry of a division: pieces that are each other's images, and the area that is divided alike.

use rayon::prelude::*;
use shellock_geom::bvh::TriangleBvh;
use shellock_report::PatchId;
use shellock_segment::symmetry::Plane;
use shellock_surface::SegmentedSurface;

/// Least share of two pieces that must be each other's image for them to be twins.
const ALIKE: f64 = 0.5;

/// Share of the area whose mirror image lies in the image of its piece. A point's mirror image is the surface
/// point nearest to it. A piece's image is the piece that holds most of its mirror image, if this holds the
/// other way round, too.
pub(super) fn mirrored_share(plane: &Plane, surface: &SegmentedSurface, bvh: &TriangleBvh) -> f64 {
    let images = Images::new(plane, surface, bvh);
    let mirrored = (0..surface.n_patches).filter(|&piece| images.is_mutual(piece));
    let area_mm2: f64 = mirrored
        .map(|piece| images.common_mm2[piece][images.of[piece]])
        .sum();
    area_mm2 / surface.mesh.area().max(f64::MIN_POSITIVE)
}

/// Pairs of pieces that are mirror images of each other, such as a left and a right arm.
#[derive(Clone, Debug, Default)]
pub struct Twins(Vec<Option<PatchId>>);

impl Twins {
    /// Finds the twins among the pieces of a model with this plane of symmetry.
    pub fn new(plane: &Plane, surface: &SegmentedSurface) -> Self {
        let images = Images::new(plane, surface, &TriangleBvh::new(&surface.mesh));
        let area_mm2: Vec<f64> = images.common_mm2.iter().map(|row| row.iter().sum()).collect();
        let twin = |piece: usize| {
            let image = images.of[piece];
            let least_mm2 = ALIKE * area_mm2[piece].max(area_mm2[image]);
            let is_alike = images.common_mm2[piece][image] >= least_mm2;
            (image != piece && images.is_mutual(piece) && is_alike).then(|| PatchId::from(image))
        };
        Self((0..surface.n_patches).map(twin).collect())
    }

    /// The piece on the other side that is the image of `piece`; `None` for a piece without a twin, such as
    /// one that the plane divides.
    pub fn of(&self, piece: PatchId) -> Option<PatchId> {
        self.0.get(usize::from(piece)).copied().flatten()
    }
}

/// Mirror images of pieces.
struct Images {
    /// Area of each piece whose image lies in each other piece, mm².
    common_mm2: Vec<Vec<f64>>,
    /// The piece that holds most of each piece's image.
    of: Vec<usize>,
}

impl Images {
    fn new(plane: &Plane, surface: &SegmentedSurface, bvh: &TriangleBvh) -> Self {
        let (mesh, n) = (&surface.mesh, surface.n_patches);
        let beyond = |face: usize| {
            let nearest = bvh.nearest(plane.image(mesh.face_center(face)), f64::INFINITY);
            nearest.map_or(face, |found| found.face as usize)
        };
        let images: Vec<usize> = (0..mesh.triangles.len()).into_par_iter().map(beyond).collect();
        let mut common_mm2 = vec![vec![0.0; n]; n];
        for (face, &image) in images.iter().enumerate() {
            let [of, into] = [face, image].map(|f| usize::from(surface.patch_of_face[f]));
            common_mm2[of][into] += mesh.face_area(face);
        }
        let image = |piece: usize| {
            let largest = (0..n).max_by(|&p, &q| common_mm2[piece][p].total_cmp(&common_mm2[piece][q]));
            largest.unwrap_or(piece)
        };
        Self {
            of: (0..n).map(image).collect(),
            common_mm2,
        }
    }

    /// Returns true if the piece is the image of its image.
    fn is_mutual(&self, piece: usize) -> bool {
        self.of[self.of[piece]] == piece
    }
}

#[cfg(test)]
mod tests {
    use shellock_geom::Vec3;
    use shellock_test_surfaces::{label, sphere};

    use super::*;

    #[test]
    fn pieces_on_both_sides_are_twins_and_those_on_the_plane_or_unlike_are_not() {
        // Four quarters of a ball, each side of z its own pair; the last is cut in two unequal parts.
        let part = |p: Vec3| match (p.x > 0.0, p.z > 0.0) {
            (left, false) => u32::from(left),
            (false, true) => 2,
            (true, true) => 3 + u32::from(p.y.abs() < 4.0),
        };
        let ball = label(sphere(5, Vec3::splat(40.0)), 5, part);
        let plane = |normal: Vec3| Plane {
            at: Vec3::ZERO,
            normal,
        };
        let twins = Twins::new(&plane(Vec3::X), &ball);
        let of = |piece: u32| twins.of(PatchId(piece)).map(|p| p.0);
        assert_eq!(
            [of(0), of(1), of(2), of(3), of(4)],
            [Some(1), Some(0), Some(3), Some(2), None]
        );
        // Across y, every piece is its own image.
        let twins = Twins::new(&plane(Vec3::Y), &ball);
        assert!((0..5).all(|piece| twins.of(PatchId(piece)).is_none()));
        assert!(Twins::default().of(PatchId(0)).is_none());
    }
}

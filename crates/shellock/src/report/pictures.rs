//! The picture that goes with the pieces: assembled, exploded, and each piece from inside.

use rayon::prelude::*;
use shellock_geom::{Aabb, Vec3};

use super::stills::{Camera, Image, Painted, render};
use super::{ReportPiece, exploded_shifts};

/// Pixels of the four large views along each side.
const LARGE: usize = 600;

/// Pixels of the view of one piece along each side; three to a large view's two.
const SMALL: usize = 400;

/// Front and back of the assembly and of the exploded view, then every piece from inside in the order of installation,
/// 1200 pixels wide on white.
pub fn pieces_picture(pieces: &[ReportPiece<'_>]) -> Image {
    let shifts = exploded_shifts(pieces);
    let painted = |share: f64| -> Vec<Painted<'_>> {
        let scene = pieces.iter().zip(&shifts);
        scene
            .map(|(p, &shift)| Painted { mesh: p.mesh, color: p.color, shift: share * shift, face_colors: None })
            .collect()
    };
    let (together, apart) = (painted(0.0), painted(1.0));
    let views = [
        (&together, Camera::front()),
        (&apart, Camera::front()),
        (&together, Camera::back()),
        (&apart, Camera::back()),
    ];
    let large: Vec<Image> = views.iter().map(|(scene, camera)| render(scene, camera, LARGE, LARGE)).collect();
    let all = pieces.iter().fold(Aabb::EMPTY, |b, p| b.union(p.mesh.bounds()));
    let mut in_order: Vec<&ReportPiece<'_>> = pieces.iter().collect();
    in_order.sort_by_key(|p| p.order);
    let small: Vec<Image> = in_order.into_par_iter().map(|p| from_inside(p, all.center())).collect();
    stacked(Image::sheet(&large, 2), Image::sheet(&small, 3)).on([255; 3])
}

/// A piece seen from the middle of the assembly, that is, its inner side with the connectors.
fn from_inside(piece: &ReportPiece<'_>, middle: Vec3) -> Image {
    let outwards = (piece.mesh.bounds().center() - middle).normalize_or(Vec3::Y);
    // Straight up or down, "up" has no meaning in the picture.
    let up = if outwards.z.abs() > 0.9 { Vec3::Y } else { Vec3::Z };
    let scene = [Painted { mesh: piece.mesh, color: piece.color, shift: Vec3::ZERO, face_colors: None }];
    render(&scene, &Camera::along(outwards, up), SMALL, SMALL)
}

/// One picture above the other, both from the left edge.
fn stacked(top: Image, bottom: Image) -> Image {
    let (width, height) = (top.width.max(bottom.width), top.height + bottom.height);
    let mut rgba = Vec::with_capacity(4 * width * height);
    for picture in [&top, &bottom] {
        for row in picture.rgba.chunks_exact(4 * picture.width.max(1)) {
            rgba.extend_from_slice(row);
            rgba.resize(rgba.len() + 4 * (width - picture.width), 0);
        }
    }
    Image { width, height, rgba }
}

//! Overview picture of the kit: assembled, exploded, and each piece from inside.

use rayon::prelude::*;
use shellock_geom::{Aabb, Vec3};

use super::stills::{Camera, Image, Painted, crease_normals, render};
use super::{ReportPiece, exploded_shifts};

/// Side length of the four large views, pixels.
const LARGE: usize = 600;

/// Side length of the view of one piece, pixels; three are as wide as two large views.
const SMALL: usize = 400;

/// Renders front and back of the assembly and of the exploded view, then every piece from inside in order of
/// installation. 1200 pixels wide, on white.
pub fn pieces_picture(pieces: &[ReportPiece<'_>]) -> Image {
    let shifts = exploded_shifts(pieces);
    let normals: Vec<Vec<[Vec3; 3]>> = pieces.par_iter().map(|p| crease_normals(p.mesh)).collect();
    let scene = |share: f64| -> Vec<Painted<'_>> {
        let all = pieces.iter().zip(&shifts).zip(&normals);
        all.map(|((p, &shift), normals)| paint(p, share * shift, normals))
            .collect()
    };
    let (together, apart) = (scene(0.0), scene(1.0));
    let views = [
        (&together, Camera::front()),
        (&apart, Camera::front()),
        (&together, Camera::back()),
        (&apart, Camera::back()),
    ];
    let large: Vec<Image> = views
        .iter()
        .map(|(scene, camera)| render(scene, camera, LARGE, LARGE))
        .collect();
    let all = pieces.iter().fold(Aabb::EMPTY, |b, p| b.union(p.mesh.bounds()));
    let mut in_order: Vec<usize> = (0..pieces.len()).collect();
    in_order.sort_by_key(|&i| pieces[i].order);
    let small = |i: usize| from_inside(&pieces[i], &normals[i], all.center(), SMALL);
    let small: Vec<Image> = in_order.into_par_iter().map(small).collect();
    stack(Image::sheet(&large, 2), Image::sheet(&small, 3)).on([255; 3])
}

fn paint<'a>(piece: &ReportPiece<'a>, shift: Vec3, normals: &'a [[Vec3; 3]]) -> Painted<'a> {
    Painted {
        mesh: piece.mesh,
        color: piece.color,
        shift,
        face_colors: None,
        normals: Some(normals),
    }
}

/// Renders a piece as seen from `middle`, the centre of the assembly: its inner side with the connectors. The
/// picture is `side` pixels wide and high. `normals` are the piece's [`crease_normals`].
pub fn from_inside(piece: &ReportPiece<'_>, normals: &[[Vec3; 3]], middle: Vec3, side: usize) -> Image {
    let outwards = (piece.mesh.bounds().center() - middle).normalize_or(Vec3::Y);
    // For a vertical line of sight, z is no usable up direction in the picture.
    let up = if outwards.z.abs() > 0.9 { Vec3::Y } else { Vec3::Z };
    render(
        &[paint(piece, Vec3::ZERO, normals)],
        &Camera::along(outwards, up),
        side,
        side,
    )
}

/// Stacks two pictures, aligned at the left edge.
fn stack(top: Image, bottom: Image) -> Image {
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

//! Small meshes as markers, and colours for quantities.

use std::f64::consts::TAU;
use std::fmt::Write;

use shellock_geom::{TriMesh, Vec3};
use shellock_render::stills::Painted;

use super::sheet::{Sheet, hex};

/// Colour of the background behind the subject.
pub const PALE: [u8; 3] = [218, 215, 208];
pub const DARK: [u8; 3] = [40, 40, 46];
pub const RED: [u8; 3] = [206, 44, 30];

/// Evenly spaced colours of a quantity from 0 to its largest value. They grow lighter, so that they differ in
/// grey, too.
const SCALE: [[u8; 3]; 5] = [
    [68, 1, 84],
    [59, 82, 139],
    [33, 145, 140],
    [94, 201, 98],
    [253, 231, 37],
];

/// Colour of a share from 0 to 1.
pub fn color_of(share: f64) -> [u8; 3] {
    let at = share.clamp(0.0, 1.0) * (SCALE.len() - 1) as f64;
    let i = (at as usize).min(SCALE.len() - 2);
    let (low, high, t) = (SCALE[i], SCALE[i + 1], at - i as f64);
    [0, 1, 2].map(|k| (f64::from(low[k]) * (1.0 - t) + f64::from(high[k]) * t).round() as u8)
}

/// Draws the scale from 0 to `most` below a picture.
pub fn color_bar(sheet: &mut Sheet, [x, y]: [f64; 2], width: f64, most: &str, what: &str) {
    const STEPS: usize = 50;
    for i in 0..STEPS {
        let left = x + width * i as f64 / STEPS as f64;
        let fill = hex(color_of((i as f64 + 0.5) / STEPS as f64));
        // Writing to a string cannot fail.
        let _ = writeln!(
            sheet.0,
            "<rect x=\"{left:.1}\" y=\"{y:.1}\" width=\"{:.1}\" height=\"12\" fill=\"{fill}\"/>",
            width / STEPS as f64 + 0.5
        );
    }
    sheet.words([x - 14.0, y + 11.0], "0");
    sheet.words([x + width + 8.0, y + 11.0], most);
    sheet.amid([x + 0.5 * width, y + 29.0], what);
}

/// Mesh of one colour in its place.
pub fn plain(mesh: &TriMesh, color: [u8; 3]) -> Painted<'_> {
    Painted {
        mesh,
        color,
        face_colors: None,
        normals: None,
        shift: Vec3::ZERO,
    }
}

/// Tubes around the segments of a line.
pub fn tube(points: &[Vec3], radius_mm: f64) -> TriMesh {
    const SIDES: u32 = 8;
    let mut mesh = TriMesh::default();
    for ends in points.windows(2) {
        let along = (ends[1] - ends[0]).normalize_or_zero();
        let aside = along.any_orthonormal_vector();
        let across = along.cross(aside);
        let first = mesh.points.len() as u32;
        for (end, overlap) in [(ends[0], -0.3), (ends[1], 0.3)] {
            for side in 0..SIDES {
                let (sin, cos) = (f64::from(side) * TAU / f64::from(SIDES)).sin_cos();
                let out = cos * aside + sin * across;
                mesh.points.push(end + radius_mm * (out + overlap * along));
            }
        }
        for side in 0..SIDES {
            let next = (side + 1) % SIDES;
            let [a, b, c, d] = [side, next, SIDES + next, SIDES + side].map(|v| first + v);
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
        for side in 1..SIDES - 1 {
            mesh.triangles.push([first, first + side + 1, first + side]);
            let second = first + SIDES;
            mesh.triangles.push([second, second + side, second + side + 1]);
        }
    }
    mesh
}

/// Small octahedra around places.
pub fn dots(places: impl IntoIterator<Item = Vec3>, radius_mm: f64) -> TriMesh {
    let mut mesh = TriMesh::default();
    for place in places {
        let first = mesh.points.len() as u32;
        let tips = [Vec3::X, Vec3::Y, Vec3::Z];
        mesh.points.extend(
            tips.iter()
                .flat_map(|&t| [place + radius_mm * t, place - radius_mm * t]),
        );
        for corner in 0..8_u32 {
            let [a, b, c] = [0, 1, 2].map(|axis| first + 2 * axis + (corner >> axis & 1));
            let turned = corner.count_ones() % 2 == 1;
            mesh.triangles.push(if turned { [a, c, b] } else { [a, b, c] });
        }
    }
    mesh
}

/// Mesh of the faces that `keep` selects.
pub fn part(mesh: &TriMesh, keep: impl Fn(usize) -> bool) -> TriMesh {
    let kept = (0..mesh.triangles.len()).filter(|&f| keep(f));
    TriMesh {
        points: mesh.points.clone(),
        triangles: kept.map(|f| mesh.triangles[f]).collect(),
    }
    .without_unused_points()
}

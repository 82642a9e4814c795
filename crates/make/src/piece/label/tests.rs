use shellock_test_surfaces::sphere;
use shellock_testkit::shapes::cuboid;

use super::*;

const WALL_MM: f64 = 2.0;

/// A quarter of a hollow ball of radius `r_mm`: three flat cuts, an outer and an inner side.
fn quarter(r_mm: f64) -> Volume {
    let ball = |r: f64| Volume::from_closed_mesh(&sphere(5, Vec3::splat(r))).unwrap();
    let shell = ball(r_mm).subtract(&ball(r_mm - WALL_MM));
    shell.intersect(&cuboid([0.0, 0.0, -2.0 * r_mm], [2.0 * r_mm; 3]))
}

fn engrave(r_mm: f64, number: u32) -> (Volume, Option<Volume>) {
    let piece = quarter(r_mm);
    let params = LabelParams::default();
    let depth = |p: Vec3| Some(r_mm - p.length());
    let cut = Wall::new(&params, piece.to_mesh(), WALL_MM, &depth).engrave(number);
    (piece, cut)
}

#[test]
fn a_number_is_cut_as_deep_as_asked_for_and_off_every_seam() {
    let r_mm = 25.0;
    let (piece, cut) = engrave(r_mm, 47);
    let cut = cut.unwrap();
    let chips = piece.intersect(&cut);
    assert!(!chips.is_empty());
    for p in chips.to_mesh().points {
        let depth = r_mm - p.length();
        assert!(
            depth > WALL_MM - 0.4 - 0.3,
            "a stroke leaves {depth} mm of the wall"
        );
        assert!(
            p.x > 1.0 && p.y > 1.0,
            "a stroke comes within 1 mm of a seam at {p}"
        );
    }
    // Strokes of 0.8 mm width and 0.4 mm depth.
    let length_mm = chips.volume() / (0.8 * 0.4);
    assert!((10.0..60.0).contains(&length_mm), "{length_mm} mm of strokes");
    let left = piece.subtract(&cut);
    assert_eq!((left.components().len(), left.genus()), (1, piece.genus()));
}

#[test]
fn what_is_too_small_or_too_thin_carries_no_number() {
    assert!(engrave(6.0, 3).1.is_none());
    let piece = quarter(25.0);
    let depth = |p: Vec3| Some(25.0 - p.length());
    let params = LabelParams {
        least_wall_mm: 1.5,
        ..LabelParams::default()
    };
    assert!(
        Wall::new(&params, piece.to_mesh(), WALL_MM, &depth)
            .engrave(3)
            .is_none()
    );
}

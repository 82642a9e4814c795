//! Pictures of the fit test: its plate, and the assembly of one number's parts.

use shellock::coupon::{Kind, Part, coupon, fits};
use shellock_geom::{TriMesh, Vec3};
use shellock_print::Printer;
use shellock_render::palette;
use shellock_render::stills::{Camera, Painted, render};

use super::draw::plain;
use super::sheet::{Sheet, WIDTH, pixels};
use crate::failure::Failure;

/// Distance of the parts in the picture of their assembly, mm.
const PULLED_MM: f64 = 5.0;

/// Shows the plate for a resin printer, and the joints of number 3 half assembled.
pub fn plate() -> Result<Vec<u8>, Failure> {
    const PLATE: [f64; 2] = [WIDTH, 330.0];
    const JOINT: [f64; 2] = [WIDTH / 2.0, 260.0];
    let printer = Printer::sla();
    let all = fits(
        printer.clearance_mm,
        printer.key_clearance_mm,
        printer.tolerance_mm,
    );
    let parts = coupon(&all, printer.min_wall_mm).map_err(|reason| Failure::Model {
        path: "coupon".into(),
        problem: reason.to_string(),
    })?;
    let color = |part: &Part| palette::color(part.fit.number as usize);
    let laid: Vec<(TriMesh, [u8; 3])> = parts.iter().map(|p| (p.on_plate(), color(p))).collect();
    let scene: Vec<Painted<'_>> = laid.iter().map(|(mesh, color)| plain(mesh, *color)).collect();
    let mut sheet = Sheet::new(PLATE[1] + JOINT[1] + 70.0);
    let from_above = Camera::along(Vec3::new(-0.3, 0.6, -1.0), Vec3::Y);
    sheet.still(
        [0.0, 0.0],
        render(&scene, &from_above, pixels(PLATE[0]), pixels(PLATE[1])),
    );
    sheet.amid(
        [0.5 * WIDTH, PLATE[1] + 16.0],
        "from the back: channels, pins, rails, keys",
    );
    let joints = [
        (
            [Kind::Channel, Kind::Pin],
            "the pin goes straight down into the channel",
        ),
        ([Kind::Rail, Kind::Key], "the key slides in from the front"),
    ];
    for (i, (kinds, words)) in joints.into_iter().enumerate() {
        let of = |kind| parts.iter().find(|p| p.fit.number == 3 && p.kind == kind);
        let joint: Vec<Painted<'_>> = kinds
            .into_iter()
            .filter_map(of)
            .map(|part| {
                let moves = matches!(part.kind, Kind::Pin | Kind::Key);
                Painted {
                    shift: if moves {
                        PULLED_MM * part.kind.separation()
                    } else {
                        Vec3::ZERO
                    },
                    ..plain(
                        &part.mesh,
                        if moves {
                            palette::color(3)
                        } else {
                            super::draw::PALE
                        },
                    )
                }
            })
            .collect();
        let camera = Camera::along(Vec3::new(-0.6, 0.9, -0.8), Vec3::Z);
        let at = [i as f64 * JOINT[0], PLATE[1] + 34.0];
        let size = JOINT.map(|length| pixels(length - 16.0));
        sheet.still([at[0] + 8.0, at[1]], render(&joint, &camera, size[0], size[1]));
        sheet.amid([at[0] + 0.5 * JOINT[0], at[1] + JOINT[1] + 8.0], words);
    }
    Ok(sheet.bytes())
}

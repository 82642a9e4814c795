//! Pictures of printing and assembling the kit.

use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{Aabb, TriMesh, Vec3};
use shellock_print::Printer;
use shellock_print::booklet::Booklet;
use shellock_print::plates::{Printable, Skin, lay};
use shellock_print::slicing::Slicing;
use shellock_render::stills::{Camera, Painted, render};

use super::draw::{PALE, plain};
use super::kit::Kit;
use super::sheet::{DENSITY, Sheet, WIDTH, hex, pixels};

/// Thickness of the drawn plate, mm.
const BED_MM: f64 = 2.0;

/// Shows the pieces on the plates of a filament printer and of a resin printer.
pub fn plates(kit: &Kit) -> Vec<u8> {
    const VIEW: [f64; 2] = [WIDTH / 2.0, 320.0];
    let skin = TriangleBvh::new(kit.model.mesh());
    let printables: Vec<Printable<'_>> = kit
        .meshes
        .iter()
        .map(|mesh| Printable {
            mesh,
            simple: mesh,
            skin: Skin::On(&skin),
        })
        .collect();
    let mut cells = Vec::new();
    for printer in [Printer::fdm(), Printer::sla()] {
        let plates = lay(
            &printer,
            Slicing::of_pieces(&printer, kit.settings.body.thickness_mm),
            &printables,
        );
        for plate in 0..plates.n_plates {
            let on_plate: Vec<_> = plates.poses.iter().filter(|l| l.plate == plate).collect();
            let laid: Vec<(TriMesh, [u8; 3])> = on_plate
                .iter()
                .map(|l| {
                    let mesh = &kit.meshes[l.piece];
                    let placed = TriMesh {
                        points: mesh.points.iter().map(|&p| l.place(p)).collect(),
                        triangles: mesh.triangles.clone(),
                    };
                    let piece = shellock::PatchId(l.piece as u32);
                    (placed, kit.color(piece))
                })
                .collect();
            let bed = bed(&printer);
            let mut scene: Vec<Painted<'_>> = laid.iter().map(|(m, color)| plain(m, *color)).collect();
            scene.push(plain(&bed, PALE));
            let camera = Camera::along(Vec3::new(-0.25, 0.75, -1.0), Vec3::Z);
            let size = VIEW.map(|length| pixels(length - 16.0));
            let words = format!(
                "{}: plate {} of {}, {} pieces",
                printer.name,
                plate + 1,
                plates.n_plates,
                on_plate.len()
            );
            cells.push((render(&scene, &camera, size[0], size[1]), words));
        }
    }
    let mut sheet = Sheet::new(cells.len().div_ceil(2) as f64 * (VIEW[1] + 30.0));
    for (i, (still, words)) in cells.into_iter().enumerate() {
        let at = [(i % 2) as f64 * VIEW[0], (i / 2) as f64 * (VIEW[1] + 30.0)];
        sheet.still([at[0] + 8.0, at[1] + 8.0], still);
        sheet.amid([at[0] + 0.5 * VIEW[0], at[1] + VIEW[1] + 10.0], &words);
    }
    sheet.bytes()
}

/// Slab under the area of the bed.
fn bed(printer: &Printer) -> TriMesh {
    let [width, depth, _] = printer.bed_mm;
    let slab = Aabb {
        min: Vec3::new(0.0, 0.0, -BED_MM),
        max: Vec3::new(width, depth, 0.0),
    };
    shellock_geom::boolean::Volume::cuboid(slab).to_mesh()
}

/// Shows four steps from the middle of the booklet, as on its page.
pub fn booklet(kit: &Kit) -> Vec<u8> {
    let booklet = Booklet {
        title: "squirrel".into(),
        pieces: kit.report_pieces(),
        ..Booklet::default()
    };
    let steps = booklet.steps();
    let first = (steps.len() / 2).saturating_sub(2);
    let shown: Vec<_> = steps.into_iter().enumerate().skip(first).take(4).collect();
    let tallest = shown
        .iter()
        .map(|(_, s)| s.picture.height as f64)
        .fold(0.0, f64::max);
    let widest = shown
        .iter()
        .map(|(_, s)| s.picture.width as f64)
        .fold(1.0, f64::max);
    let cell = [WIDTH / 2.0, tallest / widest * WIDTH / 2.0 + 56.0];
    let mut sheet = Sheet::new(2.0 * cell[1] + 10.0);
    for (k, (i, step)) in shown.into_iter().enumerate() {
        let at = [(k % 2) as f64 * cell[0], (k / 2) as f64 * cell[1]];
        let style = "fill=\"#222226\" font-size=\"34\" font-weight=\"bold\"";
        shellock_render::svg::text(
            &mut sheet.0,
            [at[0] + 12.0, at[1] + 40.0],
            style,
            &(i + 1).to_string(),
        );
        let left = at[0] + if i + 1 < 10 { 56.0 } else { 76.0 };
        sheet.disc([left, at[1] + 28.0], step.piece.0, step.piece.1);
        sheet.words([left + 24.0, at[1] + 24.0], &step.heading);
        let (words, is_new) = step.viewpoint;
        let style = if is_new {
            "fill=\"#ce2c1e\" font-weight=\"bold\" font-size=\"13\""
        } else {
            "fill=\"#6e6e76\" font-size=\"13\""
        };
        shellock_render::svg::text(&mut sheet.0, [left + 24.0, at[1] + 44.0], style, &words);
        // The picture has more pixels than the sheet has room for.
        let scale = (cell[0] - 8.0) * DENSITY / widest;
        let corner = [at[0] + 4.0, at[1] + 54.0];
        sheet.0.push_str(&format!(
            "<g transform=\"translate({:.1} {:.1}) scale({scale:.4})\">\n",
            corner[0], corner[1]
        ));
        sheet.still([0.0, 0.0], step.picture);
        let arrow: Vec<[f64; 2]> = step.arrow.iter().map(|p| p.map(|x| x / DENSITY)).collect();
        if !arrow.is_empty() {
            sheet.polygon(&arrow, &hex([206, 44, 30]), "stroke=\"white\" stroke-width=\"2\"");
        }
        sheet.0.push_str("</g>\n");
    }
    sheet.bytes()
}

//! Pictures of the whole kit: assembled, apart, in steps, its patches, and the contacts that hold its pieces.

use std::collections::BTreeMap;

use shellock::PatchId;
use shellock_geom::{Aabb, TriMesh, Vec3};
use shellock_render::exploded_shifts;
use shellock_render::stills::{Camera, Image, Painted, render};

use super::draw::{DARK, PALE, dots, part, plain, tube};
use super::kit::Kit;
use super::sheet::{Sheet, WIDTH, hex, paste, pixels, small_png};

/// Distance of a new piece from its place, mm.
const TRAVEL_MM: f64 = 30.0;

/// View direction for pieces underneath.
const FROM_BELOW: Vec3 = Vec3::new(-0.62, 0.95, 0.8);

/// Renders all pieces from the front, moved apart by a share of their exploded view.
fn all(kit: &Kit, share: f64, camera: &Camera, [width, height]: [usize; 2]) -> Image {
    let shifts = exploded_shifts(&kit.report_pieces());
    let scene: Vec<Painted<'_>> = kit
        .ids()
        .map(|p| kit.paint(p, share * shifts[usize::from(p)]))
        .collect();
    render(&scene, camera, width, height)
}

/// Shows the whole kit, with some of its assembly steps beside it.
pub fn kit(kit: &Kit) -> Vec<u8> {
    const WHOLE: [usize; 2] = [420, 740];
    const STEP: [usize; 2] = [255, 365];
    const COLUMNS: usize = 3;
    /// Number of steps shown: the first, the last, and evenly spaced ones between.
    const SHOWN: usize = 6;
    let order = kit.in_order();
    let last = order.len() - 1;
    let mut shown: Vec<usize> = (0..SHOWN).map(|i| (i * last + SHOWN / 2) / (SHOWN - 1)).collect();
    shown.dedup();
    let room = room_of_steps(kit);
    let mut pictures = vec![([0, 0], all(kit, 0.0, &Camera::front(), WHOLE))];
    for (i, &step) in shown.iter().enumerate() {
        let at = [WHOLE[0] + (i % COLUMNS) * 260, (i / COLUMNS) * 370];
        pictures.push((at, step_picture(kit, &order, step, &room, STEP)));
    }
    small_png(&paste([WHOLE[0] + COLUMNS * 260, WHOLE[1]], &pictures), 200)
}

/// Points without triangles that give all step pictures the same frame.
fn room_of_steps(kit: &Kit) -> TriMesh {
    let places = |p: PatchId| {
        let travel = TRAVEL_MM * kit.way_out(p);
        let points = &kit.meshes[usize::from(p)].points;
        points.iter().flat_map(move |&at| [at, at + travel])
    };
    TriMesh {
        points: kit.ids().flat_map(places).collect(),
        triangles: Vec::new(),
    }
}

/// Renders the pieces present after a step, with the new one on its way. The key, which is underneath, is
/// seen from below.
fn step_picture(kit: &Kit, order: &[PatchId], step: usize, room: &TriMesh, size: [usize; 2]) -> Image {
    let mut scene: Vec<Painted<'_>> = order[..=step]
        .iter()
        .enumerate()
        .map(|(i, &p)| {
            let is_new = i == step && step > 0;
            kit.paint(
                p,
                if is_new {
                    TRAVEL_MM * kit.way_out(p)
                } else {
                    Vec3::ZERO
                },
            )
        })
        .collect();
    scene.push(plain(room, PALE));
    let camera = if order[step] == kit.design.kit.plan.key() {
        Camera::along(FROM_BELOW, Vec3::Z)
    } else {
        Camera::front()
    };
    render(&scene, &camera, size[0], size[1])
}

/// Shows every step, in order, from one viewpoint.
pub fn steps(kit: &Kit) -> Vec<u8> {
    const COLUMNS: usize = 5;
    const CELL: [f64; 2] = [WIDTH / COLUMNS as f64, 190.0];
    let order = kit.in_order();
    let room = room_of_steps(kit);
    let mut sheet = Sheet::new(order.len().div_ceil(COLUMNS) as f64 * CELL[1] + 6.0);
    for (i, &piece) in order.iter().enumerate() {
        let at = [(i % COLUMNS) as f64 * CELL[0], (i / COLUMNS) as f64 * CELL[1]];
        let size = [CELL[0], CELL[1] - 12.0].map(pixels);
        sheet.still([at[0], at[1] + 12.0], step_picture(kit, &order, i, &room, size));
        sheet.words([at[0] + 6.0, at[1] + 20.0], &format!("{}.", i + 1));
        sheet.disc([at[0] + 40.0, at[1] + 15.0], kit.color(piece), piece.0);
        if piece == kit.design.kit.plan.key() {
            sheet.words([at[0] + 58.0, at[1] + 20.0], "the key, from below");
        }
    }
    sheet.bytes()
}

/// Shows the outer surface from the front and from behind, a colour a patch, and all its seams.
pub fn segmentation(kit: &Kit) -> Vec<u8> {
    const VIEW: [f64; 2] = [WIDTH / 3.0, 330.0];
    let surface = &kit.design.kit.surface;
    let mesh = &surface.mesh;
    let patches: Vec<(PatchId, TriMesh)> = kit
        .ids()
        .map(|p| (p, part(mesh, |f| surface.patch_of_face[f] == p)))
        .collect();
    let colored: Vec<Painted<'_>> = patches
        .iter()
        .map(|(p, mesh)| plain(mesh, kit.color(*p)))
        .collect();
    let seams = surface.seams();
    let lines: Vec<TriMesh> = seams.iter().map(|s| tube(&s.points, 1.5)).collect();
    let mut of_seam: Vec<Painted<'_>> = lines
        .iter()
        .enumerate()
        .map(|(i, line)| plain(line, shellock_render::palette::color(i)))
        .collect();
    of_seam.push(plain(mesh, PALE));
    let mut sheet = Sheet::new(VIEW[1] + 40.0);
    let size = VIEW.map(pixels);
    let stills = [
        render(&colored, &Camera::front(), size[0], size[1]),
        render(&colored, &Camera::back(), size[0], size[1]),
        render(&of_seam, &Camera::front(), size[0], size[1]),
    ];
    let words = [
        format!("{} patches, a colour each", patches.len()),
        "from behind".to_owned(),
        format!("{} seams, a colour each", seams.len()),
    ];
    for (i, (still, words)) in stills.into_iter().zip(words).enumerate() {
        let left = i as f64 * VIEW[0];
        sheet.still([left, 6.0], still);
        sheet.amid([left + 0.5 * VIEW[0], VIEW[1] + 28.0], &words);
    }
    sheet.bytes()
}

/// Distance, mm, below which contacts are drawn as one dot.
const APART_MM: f64 = 2.6;

/// Shows a piece from inside, with the contacts that hold it in the colours of the pieces that it touches.
pub fn contacts(kit: &Kit) -> Vec<u8> {
    const VIEW: [f64; 2] = [WIDTH / 2.0, 360.0];
    let made = &kit.design.kit;
    let middle = kit
        .meshes
        .iter()
        .fold(Aabb::EMPTY, |b, m| b.union(m.bounds()))
        .center();
    let outwards = |p: PatchId| (kit.meshes[usize::from(p)].bounds().center() - middle).normalize();
    // The two pieces with most contacts visible from inside are shown, but not the key, which may leave.
    let seen = |p: PatchId| {
        let faces_viewer = |n: Vec3| n.dot(-outwards(p)) > 0.5;
        made.touches
            .iter()
            .filter(|c| c.a == p && faces_viewer(c.normal))
            .count()
    };
    let mut held: Vec<(usize, PatchId)> = kit
        .ids()
        .filter(|&p| p != made.plan.key())
        .map(|p| (seen(p), p))
        .collect();
    held.sort_by_key(|&(n, p)| (std::cmp::Reverse(n), p));
    let mut sheet = Sheet::new(VIEW[1] + 74.0);
    for (i, &(_, piece)) in held.iter().take(2).enumerate() {
        let mut by_other: BTreeMap<PatchId, Vec<Vec3>> = BTreeMap::new();
        let mut n = 0;
        for c in made.touches.iter().filter(|c| c.a == piece) {
            let (place, dots) = (c.point, by_other.entry(c.b).or_default());
            n += 1;
            if dots.iter().all(|dot| dot.distance(place) > APART_MM) {
                dots.push(place);
            }
        }
        let spots: Vec<(PatchId, TriMesh)> = by_other
            .iter()
            .map(|(p, at)| (*p, dots(at.iter().copied(), 1.1)))
            .collect();
        let mut scene: Vec<Painted<'_>> = spots.iter().map(|(p, m)| plain(m, kit.color(*p))).collect();
        scene.push(Painted {
            color: PALE,
            ..kit.paint(piece, Vec3::ZERO)
        });
        let outwards = outwards(piece);
        let up = if outwards.z.abs() > 0.9 { Vec3::Y } else { Vec3::Z };
        let left = i as f64 * VIEW[0];
        let size = VIEW.map(pixels);
        sheet.still(
            [left, 4.0],
            render(&scene, &Camera::along(outwards, up), size[0], size[1]),
        );
        let words = format!("piece {piece} from inside: {n} contacts with pieces");
        sheet.amid([left + 0.5 * VIEW[0], VIEW[1] + 26.0], &words);
        let first = left + 0.5 * VIEW[0] - 15.0 * (spots.len() as f64 - 1.0);
        for (k, (other, _)) in spots.iter().enumerate() {
            let at = [first + 30.0 * k as f64, VIEW[1] + 50.0];
            sheet.disc(at, kit.color(*other), other.0);
        }
    }
    sheet.bytes()
}

/// Shows the kit assembled and apart, with a description, for the first page of the library's documentation.
pub fn first_page(kit: &Kit) -> Vec<u8> {
    const HEIGHT: f64 = 300.0;
    let mut sheet = Sheet::new(HEIGHT + 10.0);
    for (i, share) in [0.0, 1.0].into_iter().enumerate() {
        let size = [pixels(250.0) * 2 / 3, pixels(HEIGHT) * 2 / 3];
        let still = all(kit, share, &Camera::front(), size);
        // The image is small and has few colours, because it is part of the page's text.
        let data = shrunk(still);
        sheet.0.push_str(&format!(
            "<image x=\"{}\" y=\"5\" width=\"250\" height=\"{HEIGHT}\" \
             href=\"data:image/png;base64,{data}\"/>\n",
            250 * i
        ));
    }
    let key = kit.design.kit.plan.key();
    let words = [
        (hex(DARK), "from a closed mesh".to_owned()),
        (
            hex(DARK),
            format!("to {} printable shell pieces", kit.meshes.len()),
        ),
        (hex(DARK), "that lock each other:".to_owned()),
        (hex(DARK), "no glue, no screws;".to_owned()),
        (
            hex(kit.color(key)),
            format!("only piece {key}, the key, comes out"),
        ),
    ];
    for (i, (color, words)) in words.iter().enumerate() {
        let style = format!("fill=\"{color}\" font-size=\"16\"");
        shellock_render::svg::text(&mut sheet.0, [530.0, 110.0 + 26.0 * i as f64], &style, words);
    }
    sheet.bytes()
}

fn shrunk(still: Image) -> String {
    use base64::Engine;
    base64::engine::general_purpose::STANDARD.encode(small_png(&still.on([255; 3]), 40))
}

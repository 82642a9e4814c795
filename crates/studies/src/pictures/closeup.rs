//! Close-ups: sections across seams of finished pieces, and the key with its prism and rails.

use std::path::PathBuf;

use shellock::PatchId;
use shellock_geom::boolean::Volume;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{Aabb, TriMesh, Vec3};
use shellock_render::stills::{Camera, Painted, render};

use super::draw::{PALE, RED, plain, tube};
use super::kit::Kit;
use super::sheet::{Sheet, WIDTH, pixels};
use crate::failure::Failure;

/// Half of the visible extent of a seam's section, mm.
const HALF_MM: f64 = 7.0;
/// Least share of both halves that a shown joint keeps, and its least length, mm.
const LEAST_KEPT: f64 = 0.6;
const LEAST_MM: f64 = 6.0;

/// A joint at the place of its section.
struct Place {
    male: PatchId,
    female: PatchId,
    at: Vec3,
    tangent: Vec3,
    normal: Vec3,
    to_female: Vec3,
    theta_deg: f64,
    is_rail: bool,
    length_mm: f64,
}

fn fault(problem: &str) -> Failure {
    Failure::Model {
        path: PathBuf::from("squirrel"),
        problem: problem.to_owned(),
    }
}

/// Places of the kit's joints, each with the angle T in its middle.
fn places(kit: &Kit) -> Vec<Place> {
    let made = &kit.design.kit;
    let bvh = TriangleBvh::new(&made.surface.mesh);
    let seams = made.surface.seams();
    made.joints
        .iter()
        .filter(|j| j.length_mm > LEAST_MM && j.intact_share.iter().all(|&k| k > LEAST_KEPT))
        .filter_map(|joint| {
            let pair = [joint.male.min(joint.female), joint.male.max(joint.female)];
            let (seam, i) = seams
                .iter()
                .filter(|s| [s.a, s.b] == pair)
                .flat_map(|s| (1..s.points.len() - 1).map(move |i| (s, i)))
                .min_by(|(s, i), (t, k)| {
                    let far = |p: Vec3| p.distance(joint.at);
                    far(s.points[*i]).total_cmp(&far(t.points[*k]))
                })?;
            let (from, to) = (i.saturating_sub(4), (i + 4).min(seam.points.len() - 1));
            let tangent = (seam.points[to] - seam.points[from]).try_normalize()?;
            let normal = seam.normals[i].reject_from_normalized(tangent).try_normalize()?;
            let across = normal.cross(tangent);
            let beside = bvh.nearest(seam.points[i] + 1.5 * across, f64::INFINITY)?;
            let is_female = made.surface.patch_of_face[beside.face as usize] == joint.female;
            let to_female = if is_female { across } else { -across };
            let is_later = made.plan.position(joint.male) > made.plan.position(joint.female);
            let s = if is_later {
                made.plan.separation(joint.male).unit()
            } else {
                -made.plan.separation(joint.female).unit()
            };
            let theta_deg = s.dot(to_female).atan2(s.dot(normal)).to_degrees();
            // Seams that are left along themselves show nothing in a section.
            (joint.is_rail || s.dot(tangent).abs() < 0.5).then_some(Place {
                male: joint.male,
                female: joint.female,
                at: seam.points[i],
                tangent,
                normal,
                to_female,
                theta_deg,
                is_rail: joint.is_rail,
                length_mm: joint.length_mm,
            })
        })
        .collect()
}

/// Shows sections across three seams of finished pieces: the pins that point most nearly forward and straight
/// out, and a rail of the key.
pub fn seams(kit: &Kit) -> Result<Vec<u8>, Failure> {
    const VIEW: [f64; 2] = [WIDTH / 3.0, 210.0];
    let places = places(kit);
    let none = || fault("it has no such joint that is whole");
    let nearest = |asked: f64| {
        let pins = places.iter().filter(|p| !p.is_rail);
        let off = |p: &Place| (p.theta_deg - asked).abs();
        pins.min_by(|a, b| off(a).total_cmp(&off(b))).ok_or_else(none)
    };
    let rails = places.iter().filter(|p| p.is_rail);
    let longest_rail = rails.max_by(|a, b| a.length_mm.total_cmp(&b.length_mm));
    let shown = [nearest(-75.0)?, nearest(0.0)?, longest_rail.ok_or_else(none)?];
    let mut sheet = Sheet::new(VIEW[1] + 52.0);
    for (i, place) in shown.into_iter().enumerate() {
        let left = i as f64 * VIEW[0];
        let size = VIEW.map(|length| pixels(length - 8.0));
        sheet.still([left + 4.0, 4.0], cut_across(kit, place, size)?);
        let words = if place.is_rail {
            format!("rail: tongue of {}, key {}", place.male, place.female)
        } else {
            format!(
                "T = {:.0}°: pin of {}, channel of {}",
                place.theta_deg, place.male, place.female
            )
        };
        let words = words.replace('-', "\u{2212}");
        sheet.amid([left + 0.5 * VIEW[0], VIEW[1] + 20.0], &words);
    }
    let made = &kit.design.kit;
    let words = format!(
        "Cut faces are bright; the wall ({:.1} mm) is above. Gaps are as printed: {} mm in connectors, {} \
         mm in the wall.",
        made.thickness_mm,
        kit.settings.connector.clearance_mm,
        2.0 * kit.settings.body.seam_gap_mm
    );
    sheet.note([0.5 * WIDTH, VIEW[1] + 44.0], &words);
    Ok(sheet.bytes())
}

/// Renders the finished pieces inside a box about the place, seen along the seam.
fn cut_across(kit: &Kit, place: &Place, size: [usize; 2]) -> Result<shellock_render::stills::Image, Failure> {
    let Place {
        at,
        tangent,
        normal,
        to_female,
        ..
    } = *place;
    let corner = |i: usize| {
        let end = |bit: usize, low: f64, high: f64| if i >> bit & 1 == 0 { low } else { high };
        at + end(0, 0.0, 1.6 * HALF_MM) * tangent
            + end(1, -HALF_MM, HALF_MM) * to_female
            + end(2, -1.35 * HALF_MM, 0.7 * HALF_MM) * normal
    };
    let corners: Vec<Vec3> = (0..8).map(corner).collect();
    let (room, bounds) = (Volume::hull(&corners), Aabb::around(corners));
    let mut cuts = Vec::new();
    for (piece, mesh) in kit.design.kit.pieces.iter() {
        if !mesh.bounds().intersects(bounds) {
            continue;
        }
        let volume = Volume::from_closed_mesh(mesh).map_err(|e| fault(&e.to_string()))?;
        let cut = volume.intersect(&room).to_mesh();
        let colors: Vec<[u8; 3]> = (0..cut.triangles.len())
            .map(|f| {
                let is_cut = cut.face_normal(f).dot(tangent) < -0.999
                    && (cut.face_center(f) - at).dot(tangent).abs() < 1e-3;
                let toned = |c: u8| if is_cut { c } else { (f64::from(c) * 0.62) as u8 };
                kit.color(piece).map(toned)
            })
            .collect();
        cuts.push((cut, colors));
    }
    let scene: Vec<Painted<'_>> = cuts
        .iter()
        .map(|(mesh, colors)| Painted {
            face_colors: Some(colors),
            ..plain(mesh, PALE)
        })
        .collect();
    let camera = Camera::along(tangent + 0.3 * to_female - 0.22 * normal, normal);
    Ok(render(&scene, &camera, size[0], size[1]))
}

/// Shows the key on its way out with its prism, the place that it leaves, and the key from inside.
pub fn key(kit: &Kit) -> Result<Vec<u8>, Failure> {
    const VIEW: [f64; 2] = [WIDTH / 3.0, 280.0];
    let site = kit.design.key.as_ref().ok_or_else(|| fault("no key was cut"))?;
    let prism = site.prism;
    let key = kit.design.kit.plan.key();
    let [slide, normal] = [prism.slide, prism.normal].map(|v| v);
    let camera = Camera::along(-normal - 0.55 * slide + 0.35 * slide.cross(normal), normal);
    let out = 0.75 * prism.length_mm() * slide;
    let edges = edges(kit);
    let rest: Vec<Painted<'_>> = kit
        .ids()
        .filter(|&p| p != key)
        .map(|p| Painted {
            color: PALE,
            ..kit.paint(p, Vec3::ZERO)
        })
        .collect();
    let mut on_its_way = rest.clone();
    on_its_way.push(kit.paint(key, out));
    on_its_way.extend(edges.iter().map(|edge| plain(edge, RED)));
    let bounds = kit.meshes[usize::from(key)].bounds();
    let moved = Aabb {
        min: bounds.min + out,
        max: bounds.max + out,
    };
    let near = |frame: Aabb| Camera {
        frame: Some(frame),
        ..camera
    };
    let size = VIEW.map(|length| pixels(length - 8.0));
    let place: Vec<Painted<'_>> = kit
        .ids()
        .filter(|&p| p != key)
        .map(|p| kit.paint(p, Vec3::ZERO))
        .collect();
    let inside = Camera::along(normal - 0.25 * slide, -slide);
    let stills = [
        (
            render(
                &on_its_way,
                &near(bounds.union(moved).grown(8.0)),
                size[0],
                size[1],
            ),
            "the key slides out of its prism (red)",
        ),
        (
            render(&place, &near(bounds.grown(2.0)), size[0], size[1]),
            "its place: straight tongues at the sides",
        ),
        (
            render(&[kit.paint(key, Vec3::ZERO)], &inside, size[0], size[1]),
            "the key from inside: a groove for each",
        ),
    ];
    let mut sheet = Sheet::new(VIEW[1] + 34.0);
    for (i, (still, words)) in stills.into_iter().enumerate() {
        let left = i as f64 * VIEW[0];
        sheet.still([left + 4.0, 4.0], still);
        sheet.amid([left + 0.5 * VIEW[0], VIEW[1] + 22.0], words);
    }
    Ok(sheet.bytes())
}

/// Edges of the key's prism in place, slightly above the plane so that they are visible.
fn edges(kit: &Kit) -> Vec<TriMesh> {
    let Some(prism) = kit.design.key.as_ref().map(|site| site.prism) else {
        return Vec::new();
    };
    let far = 1.9 * prism.length_mm();
    let place = |along: f64, side: f64, below: f64| {
        prism.origin + along * prism.slide + side * prism.half_width_at(along) * prism.across()
            - below * prism.normal
    };
    let mut lines = Vec::new();
    for below in [-0.6, prism.depth_mm] {
        lines.push(vec![
            place(far, -1.0, below),
            place(0.0, -1.0, below),
            place(0.0, 1.0, below),
            place(far, 1.0, below),
        ]);
    }
    for side in [-1.0, 1.0] {
        for along in [0.0, far] {
            lines.push(vec![place(along, side, -0.6), place(along, side, prism.depth_mm)]);
        }
    }
    lines.iter().map(|line| tube(line, 0.6)).collect()
}

//! Sheet of a model's division seen from four sides: as drawn, after refinement, and as its kit is made.

use shellock::design::Settings;
use shellock::segmentation::figures::front_of;
use shellock::segmentation::{automatic_labels, segment};
use shellock::{Ctx, DesignOutcome, design};
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{TriMesh, Vec3};
use shellock_render::palette;
use shellock_render::stills::{Camera, Painted, crease_normals, render};

use crate::failure::Failure;
use crate::model::{Model, ModelOptions};
use crate::pictures::sheet::{Sheet, WIDTH, pixels};

/// Height of a still, and of the line of words above each row.
const STILL: f64 = 190.0;
const LINE: f64 = 26.0;
/// Views of a row, from the model's front on.
const VIEWS: [&str; 4] = ["front", "left", "back", "right"];

/// One stage of a division.
struct Stage {
    name: &'static str,
    /// Number of pieces and share of the smallest.
    words: String,
    mesh: TriMesh,
    /// Piece of each triangle of `mesh`.
    piece_of_face: Vec<usize>,
}

/// Draws the sheet of a model as an SVG text.
pub fn sheet(ctx: &Ctx<'_>, options: &ModelOptions, model: &Model) -> Result<String, Failure> {
    let stages = stages(ctx, options, model)?;
    let up = Vec3::from(options.params().up);
    let front = Vec3::from(front_of(up.to_array()));
    let left = up.cross(front);
    let width = WIDTH / VIEWS.len() as f64;
    let mut sheet = Sheet::new(stages.len() as f64 * (STILL + LINE) + LINE);
    for (i, name) in VIEWS.iter().enumerate() {
        sheet.note([(i as f64 + 0.5) * width, LINE - 8.0], name);
    }
    let mut colors = Colors::default();
    for (row, stage) in stages.iter().enumerate() {
        let top = LINE + row as f64 * (STILL + LINE);
        sheet.words([8.0, top + 16.0], &format!("{}: {}", stage.name, stage.words));
        if stage.piece_of_face.is_empty() {
            continue;
        }
        let of_piece = colors.of(stage);
        let face_colors: Vec<[u8; 3]> = stage.piece_of_face.iter().map(|&piece| of_piece[piece]).collect();
        let normals = crease_normals(&stage.mesh);
        let scene = [Painted {
            mesh: &stage.mesh,
            color: [0; 3],
            face_colors: Some(&face_colors),
            normals: Some(&normals),
            shift: Vec3::ZERO,
        }];
        for (i, from) in [front, left, -front, -left].into_iter().enumerate() {
            let still = render(&scene, &Camera::along(-from, up), pixels(width), pixels(STILL));
            sheet.still([i as f64 * width, top + LINE - 4.0], still);
        }
    }
    String::from_utf8(sheet.bytes()).map_err(|e| Failure::Model {
        path: options.model.clone(),
        problem: e.to_string(),
    })
}

/// The division as drawn, after refinement, and as the kit is made, as far as each exists.
fn stages(ctx: &Ctx<'_>, options: &ModelOptions, model: &Model) -> Result<Vec<Stage>, Failure> {
    let params = options.kit_params();
    let settings = Settings::resolve(&params).segmentation;
    let fault = |problem: String| Failure::Model {
        path: options.model.clone(),
        problem,
    };
    let solid = &model.solid;
    let drawn: Option<Vec<usize>> = match &model.labels {
        Some(labels) => Some(numbered(labels)),
        None => automatic_labels(ctx, &settings, solid)
            .map_err(|e| fault(e.to_string()))?
            .map(|labels| labels.as_slice().iter().map(|&l| l as usize).collect()),
    };
    let mut stages = Vec::new();
    if let Some(piece_of_face) = drawn {
        stages.push(Stage::of("as drawn", String::new(), solid.mesh(), piece_of_face));
    }
    let labels = model.labels.as_deref();
    let refined = segment(ctx, &settings, solid, labels).map_err(|e| fault(e.to_string()))?;
    let patches = |of: &[shellock::PatchId]| of.iter().map(|&p| usize::from(p)).collect();
    stages.push(Stage::of(
        "refined, so that pieces can lock",
        String::new(),
        &refined.mesh,
        patches(&refined.patch_of_face),
    ));
    match design(ctx, &params, solid, labels).map_err(|e| fault(e.to_string()))? {
        DesignOutcome::NoPlan(none) => stages.push(Stage {
            name: "no kit can be made",
            words: none.reason,
            mesh: TriMesh::default(),
            piece_of_face: Vec::new(),
        }),
        DesignOutcome::Made(made) => {
            let words = match made.kit.verification.has_passed() {
                true => String::new(),
                false => ", which fails a check".to_owned(),
            };
            let surface = &made.kit.surface;
            stages.push(Stage::of(
                "as made",
                words,
                &surface.mesh,
                patches(&surface.patch_of_face),
            ));
        }
    }
    Ok(stages)
}

impl Stage {
    fn of(name: &'static str, more: String, mesh: &TriMesh, piece_of_face: Vec<usize>) -> Self {
        let mut area_mm2 = vec![0.0; piece_of_face.iter().max().map_or(0, |most| most + 1)];
        for (face, &piece) in piece_of_face.iter().enumerate() {
            area_mm2[piece] += mesh.face_area(face);
        }
        let least = area_mm2.iter().copied().fold(f64::INFINITY, f64::min) / mesh.area();
        let words = format!(
            "{} pieces, the smallest with {:.1} % of the surface{more}",
            area_mm2.len(),
            100.0 * least
        );
        Self {
            name,
            words,
            mesh: mesh.clone(),
            piece_of_face,
        }
    }
}

/// Labels as numbers from 0 on, in the order of their first faces.
fn numbered(labels: &[i64]) -> Vec<usize> {
    let mut seen: Vec<i64> = Vec::new();
    let number = |label: &i64| {
        seen.iter().position(|l| l == label).unwrap_or_else(|| {
            seen.push(*label);
            seen.len() - 1
        })
    };
    labels.iter().map(number).collect()
}

/// Colours of the first stage's pieces. A later piece takes the colour of the first-stage piece that covers
/// most of it, unless a larger piece has it.
#[derive(Default)]
struct Colors(Option<(TriangleBvh, Vec<usize>)>);

impl Colors {
    fn of(&mut self, stage: &Stage) -> Vec<[u8; 3]> {
        let n_pieces = stage.piece_of_face.iter().max().map_or(0, |most| most + 1);
        let Some((bvh, first)) = &self.0 else {
            self.0 = Some((TriangleBvh::new(&stage.mesh), stage.piece_of_face.clone()));
            return (0..n_pieces).map(palette::color).collect();
        };
        let n_first = first.iter().max().map_or(0, |most| most + 1);
        let mut shared_mm2 = vec![vec![0.0; n_first]; n_pieces];
        for (face, &piece) in stage.piece_of_face.iter().enumerate() {
            if let Some(nearest) = bvh.nearest(stage.mesh.face_center(face), f64::INFINITY) {
                shared_mm2[piece][first[nearest.face as usize]] += stage.mesh.face_area(face);
            }
        }
        let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
        for (piece, shares) in shared_mm2.iter().enumerate() {
            pairs.extend(shares.iter().enumerate().map(|(of, &mm2)| (mm2, piece, of)));
        }
        pairs.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let (mut color, mut is_taken) = (vec![None; n_pieces], vec![false; n_first]);
        for (mm2, piece, of) in pairs {
            if mm2 > 0.0 && color[piece].is_none() && !is_taken[of] {
                color[piece] = Some(of);
                is_taken[of] = true;
            }
        }
        let mut next = n_first;
        let fresh = |color: Option<usize>| {
            color.unwrap_or_else(|| {
                next += 1;
                next - 1
            })
        };
        color.into_iter().map(fresh).map(palette::color).collect()
    }
}

//! Regions of the surface that no seam may divide, such as a figure's face.
//!
//! Each connected part of a region is kept whole by itself. Methods give it to one patch, repair never
//! divides it, and keys are cut elsewhere. Seams are smoothed as everywhere, so [`tell_cut`] measures the
//! final result.

use crate::causes::Cause;
use serde::{Deserialize, Serialize};
use shellock_geom::bvh::nearest_on_triangle;
use shellock_geom::topology::components;
use shellock_geom::{Solid, Topology, TriMesh, Vec3};
use shellock_report::{Ctx, PatchId, Warning};
use shellock_segment::whole::Whole;
use shellock_surface::{SegmentedSurface, Turn};

use super::user::user_labels;
use super::{FaceLabels, SegmentationError, SegmentationParams};

/// Least share of a region's area that must lie in one piece. Smoothing may take a rim.
const LEAST_SHARE: f64 = 0.98;
/// Greatest share of the surface in a region; more leaves too little to divide.
const MOST_SHARE: f64 = 0.5;

/// A region that no seam may divide.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum KeepWhole {
    /// Surface within a ball, in the space of the model, mm.
    Sphere {
        /// Centre of the ball.
        center_mm: [f64; 3],
        /// Radius of the ball; > 0.
        radius_mm: f64,
    },
    /// Triangles with this label, if there are labels.
    Label(i64),
    /// Triangles of the model. [`resolve_regions`] turns a label into these.
    Faces(Vec<u32>),
}

impl KeepWhole {
    /// Returns the region, rotated by `turn`; one given by faces or a label stays.
    pub fn rotate(&self, turn: &Turn) -> Self {
        match self {
            Self::Sphere { center_mm, radius_mm } => Self::Sphere {
                center_mm: turn.apply(Vec3::from(*center_mm)).to_array(),
                radius_mm: *radius_mm,
            },
            by_face => by_face.clone(),
        }
    }

    /// Problem of the region by itself, as a message for people, if any.
    pub(super) fn problem(&self) -> Option<String> {
        let Self::Sphere { center_mm, radius_mm } = self else {
            return None;
        };
        let is_number = center_mm.iter().all(|x| x.is_finite()) && radius_mm.is_finite();
        (!is_number || *radius_mm <= 0.0).then(|| {
            let [x, y, z] = center_mm;
            format!("keep-whole is {x},{y},{z},{radius_mm}, but must be a place in mm and a radius above 0")
        })
    }

    /// Faces of `mesh` in the region. For a ball, these are the faces that touch one larger by `margin_mm`.
    fn faces(&self, mesh: &TriMesh, source_face: &[u32], margin_mm: f64) -> Vec<u32> {
        let all = 0..mesh.triangles.len() as u32;
        match self {
            Self::Sphere { center_mm, radius_mm } => {
                let (center, radius) = (Vec3::from(*center_mm), radius_mm + margin_mm);
                let corners = |f: u32| mesh.triangles[f as usize].map(|v| mesh.points[v as usize]);
                let distance_sq = |f: u32| nearest_on_triangle(corners(f), center).0.distance_squared(center);
                all.filter(|&f| distance_sq(f) <= radius * radius).collect()
            }
            Self::Faces(faces) => {
                let mut is_in = vec![false; faces.iter().map(|&f| f as usize + 1).max().unwrap_or(0)];
                faces.iter().for_each(|&f| is_in[f as usize] = true);
                let has = |f: &u32| is_in.get(source_face[*f as usize] as usize) == Some(&true);
                all.filter(has).collect()
            }
            Self::Label(_) => Vec::new(),
        }
    }

    /// Description of the region for messages.
    fn words(&self) -> String {
        match self {
            Self::Sphere {
                center_mm: [x, y, z],
                radius_mm,
            } => {
                format!("the region within {radius_mm} mm of ({x:.1}, {y:.1}, {z:.1}) mm")
            }
            Self::Label(label) => format!("the region of label {label}"),
            Self::Faces(_) => "the region of the label".to_owned(),
        }
    }
}

/// Replaces labels by the triangles that have them, and checks each region against the model.
///
/// Fails if a region is empty, has more than half of the surface, or names a label of a model without labels.
pub fn resolve_regions(
    keep: &[KeepWhole],
    solid: &Solid,
    labels: Option<&[i64]>,
) -> Result<Vec<KeepWhole>, SegmentationError> {
    let mesh = solid.mesh();
    let own: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
    keep.iter()
        .map(|region| {
            let found = match (region, labels) {
                (KeepWhole::Label(label), Some(labels)) => {
                    let faces = own
                        .iter()
                        .copied()
                        .filter(|&f| labels.get(f as usize) == Some(label));
                    KeepWhole::Faces(faces.collect())
                }
                (KeepWhole::Label(label), None) => return Err(SegmentationError::KeepWholeNoLabels(*label)),
                _ => region.clone(),
            };
            let faces = found.faces(mesh, &own, 0.0);
            let words = region.words();
            if faces.is_empty() {
                let (min, max) = (mesh.bounds().min, mesh.bounds().max);
                return Err(SegmentationError::KeepWholeEmpty {
                    region: words,
                    min_mm: min.to_array(),
                    max_mm: max.to_array(),
                });
            }
            let share = inner_area_mm2(region, mesh, &faces) / mesh.area();
            if share > MOST_SHARE {
                return Err(SegmentationError::KeepWholeTooLarge { region: words, share });
            }
            Ok(found)
        })
        .collect()
}

/// Area of those of `faces` whose centres lie inside the region, mm².
fn inner_area_mm2(region: &KeepWhole, mesh: &TriMesh, faces: &[u32]) -> f64 {
    let is_inner = |f: &&u32| match region {
        KeepWhole::Sphere { center_mm, radius_mm } => {
            mesh.face_center(**f as usize).distance(Vec3::from(*center_mm)) <= *radius_mm
        }
        _ => true,
    };
    faces
        .iter()
        .filter(is_inner)
        .map(|&f| mesh.face_area(f as usize))
        .sum()
}

/// Sets of faces of `mesh` that must each belong to one patch. Balls are enlarged by `margin_mm`, and
/// `source_face` refers to the model's triangles.
pub fn whole(
    keep: &[KeepWhole],
    mesh: &TriMesh,
    topology: &Topology,
    source_face: &[u32],
    margin_mm: f64,
) -> Whole {
    let mut sets = Vec::new();
    for region in keep {
        sets.extend(parts(topology, mesh, &region.faces(mesh, source_face, margin_mm)));
    }
    Whole::new(mesh.triangles.len(), sets)
}

/// Connected parts of `faces`.
fn parts(topology: &Topology, mesh: &TriMesh, faces: &[u32]) -> Vec<Vec<u32>> {
    if faces.is_empty() {
        return Vec::new();
    }
    let mut is_in = vec![false; mesh.triangles.len()];
    faces.iter().for_each(|&f| is_in[f as usize] = true);
    let (component, n) = components(topology, |f, g| is_in[f as usize] == is_in[g as usize]);
    let mut parts = vec![Vec::new(); n];
    faces
        .iter()
        .for_each(|&f| parts[component[f as usize] as usize].push(f));
    parts.retain(|part| !part.is_empty());
    parts
}

/// Margin by which balls are enlarged while patches are made, mm: the width that smoothing may take from a
/// patch.
pub(super) fn margin_mm(params: &SegmentationParams) -> f64 {
    params.smoothing_mm2.max(0.0).sqrt()
}

/// Gives each set of `whole` to the patch that has most of it. Patches that are then too small join a
/// neighbour.
pub(super) fn gather_regions(
    ctx: &Ctx,
    params: &SegmentationParams,
    solid: &Solid,
    whole: &Whole,
    patches: FaceLabels,
) -> Result<FaceLabels, SegmentationError> {
    let mesh = solid.mesh();
    let area_mm2: Vec<f64> = (0..mesh.triangles.len()).map(|f| mesh.face_area(f)).collect();
    let mut label = patches.as_slice().to_vec();
    if whole.gather(&mut label, &area_mm2) == 0 {
        return Ok(patches);
    }
    let labels: Vec<i64> = label.into_iter().map(i64::from).collect();
    user_labels(&ctx.fork(), params, solid, &labels)
}

/// Warns of each resolved region with less than 98 % of its area in one piece. Names the largest place
/// outside that piece.
pub(super) fn tell_cut(ctx: &Ctx, keep: &[KeepWhole], surface: &SegmentedSurface) {
    let mesh = &surface.mesh;
    let Some(topology) = Topology::of_mesh(mesh).filter(|_| !keep.is_empty()) else {
        return;
    };
    for region in keep {
        let faces: Vec<u32> = region
            .faces(mesh, &surface.source_face, 0.0)
            .into_iter()
            .filter(|&f| inner_area_mm2(region, mesh, &[f]) > 0.0)
            .collect();
        let shares: Vec<(f64, f64, Vec<PatchId>, Vec3)> = parts(&topology, mesh, &faces)
            .iter()
            .map(|part| in_one_piece(surface, part))
            .collect();
        let area_mm2: f64 = shares.iter().map(|s| s.1).sum();
        let share = shares.iter().map(|s| s.0).sum::<f64>() / area_mm2.max(f64::MIN_POSITIVE);
        let worst = shares.iter().max_by(|a, b| (a.1 - a.0).total_cmp(&(b.1 - b.0)));
        if let Some((.., pieces, at)) = worst
            && share < LEAST_SHARE
        {
            ctx.warn(Warning::new(
                Cause::KeepWholeCut { share },
                pieces.clone(),
                Some(at.to_array()),
            ));
        }
    }
}

/// Some place of a resolved region that lies in one of `pieces`.
pub(super) fn place_in(
    keep: &[KeepWhole],
    surface: &SegmentedSurface,
    pieces: &[PatchId],
) -> Option<[f64; 3]> {
    let mesh = &surface.mesh;
    let faces = keep
        .iter()
        .flat_map(|region| region.faces(mesh, &surface.source_face, 0.0));
    let mut inside = faces.filter(|&f| pieces.contains(&surface.patch_of_face[f as usize]));
    inside.next().map(|f| mesh.face_center(f as usize).to_array())
}

/// Division of connected faces among pieces: the area in the piece that has most of them; the total area,
/// mm²; the pieces, largest first; and a place outside the first piece.
fn in_one_piece(surface: &SegmentedSurface, part: &[u32]) -> (f64, f64, Vec<PatchId>, Vec3) {
    let mesh = &surface.mesh;
    let mut area = std::collections::BTreeMap::<PatchId, f64>::new();
    for &f in part {
        *area.entry(surface.patch_of_face[f as usize]).or_default() += mesh.face_area(f as usize);
    }
    let mut pieces: Vec<(PatchId, f64)> = area.into_iter().collect();
    pieces.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let other = pieces.get(1).unwrap_or(&pieces[0]).0;
    let place = part
        .iter()
        .filter(|&&f| surface.patch_of_face[f as usize] == other);
    let largest = place.max_by(|&&f, &&g| mesh.face_area(f as usize).total_cmp(&mesh.face_area(g as usize)));
    let at = mesh.face_center(*largest.expect("the piece has a face of it") as usize);
    let all = pieces.iter().map(|p| p.1).sum();
    (pieces[0].1, all, pieces.into_iter().map(|p| p.0).collect(), at)
}

//! Division of a model into pieces: labels for its file, and figures for people.

use shellock::design::{DesignError, Settings};
use shellock::segmentation::figures::{
    ContactFigures, DivisionFigures, FigureParams, PieceFigures, SeamFigures, figures,
};
use shellock::segmentation::{self, SegmentationParams};
use shellock::verify::words::PlaceWords;
use shellock::{Ctx, PatchId, SegmentedSurface, Warning};

use crate::Session;
use crate::bed::fit_params;
use crate::build::check_options;
use crate::failure::Failure;
use crate::input::Model;
use crate::options::Options;
use crate::place::Standing;
use crate::shares::largest_shares;

/// A division with its figures and warnings.
pub struct Division {
    /// Figures of the division.
    pub figures: DivisionFigures,
    /// Changes that were made, and risks.
    pub warnings: Vec<Warning>,
    /// Parameters that the surface was divided with.
    params: SegmentationParams,
}

/// Parameters that `model` is divided with.
pub fn params(session: &Session, model: &Model, options: &Options) -> Result<SegmentationParams, Failure> {
    let params = fit_params(session, &check_options(options)?, options, model)?;
    Ok(Settings::resolve(&params).segmentation)
}

/// Divides `model` as `segment` does, by its labels if it has any.
pub fn divide(
    ctx: Ctx<'_>,
    params: SegmentationParams,
    model: &Model,
    options: &Options,
) -> Result<Division, Failure> {
    let surface = segmentation::segment(&ctx, &params, &model.solid, model.labels.as_deref())
        .map_err(DesignError::from)?;
    let mirror = segmentation::symmetry_plane(&params, &model.solid);
    let of_figures = FigureParams {
        up: options.up.unit(),
        wall_mm: params.wall_mm,
        min_contact_mm: params.min_contact_mm,
        mirror,
    };
    Ok(Division {
        figures: figures(&of_figures, &surface),
        warnings: ctx.into_warnings(),
        params,
    })
}

/// Divides the surface of `model` as the options ask.
pub fn divide_model(
    session: &Session,
    ctx: &Ctx,
    model: &Model,
    options: &Options,
) -> Result<SegmentedSurface, Failure> {
    let params = params(session, model, options)?;
    let surface = segmentation::segment(ctx, &params, &model.solid, model.labels.as_deref());
    Ok(surface.map_err(DesignError::from)?)
}

/// Patch with the largest share of each face of the file, from 1; dropped faces get the first patch.
pub fn labels_of_file(model: &Model, surface: &SegmentedSurface) -> Vec<u32> {
    labels_of_faces(model.n_file_faces, &model.file_face, surface)
}

fn labels_of_faces(n_file_faces: usize, file_face: &[u32], surface: &SegmentedSurface) -> Vec<u32> {
    let patches = surface.source_face.iter().zip(&surface.patch_of_face).enumerate();
    let parts = patches.map(|(face, (&source, patch))| {
        let area = surface.mesh.face_area(face);
        (file_face[source as usize], patch.number(), area)
    });
    let dropped = PatchId(0).number();
    let most = largest_shares(n_file_faces, parts);
    most.into_iter().map(|label| label.unwrap_or(dropped)).collect()
}

impl Division {
    /// Lines for people: figures of the whole, then one line for each piece.
    pub fn lines(&self, standing: &Standing) -> Vec<String> {
        let of_whole = self.of_whole();
        let width = of_whole.iter().map(|(what, _)| what.chars().count()).max();
        let width = width.unwrap_or_default();
        let mut lines: Vec<String> = of_whole
            .iter()
            .map(|(what, said)| format!("{what:width$}  {said}"))
            .collect();
        lines.push(format!(
            "{:>5}  {:>9}  {:5}  {:>6}  faces",
            "piece", "area, mm²", "disk", "cone"
        ));
        lines.extend(self.figures.pieces.iter().map(|p| of_piece(p, standing)));
        lines
    }

    /// Figures of the whole division, each with its name.
    fn of_whole(&self) -> Vec<Line> {
        let DivisionFigures {
            area_mm2,
            pieces,
            mirrored_share,
            ..
        } = &self.figures;
        let n_one_way = pieces.iter().filter(|p| p.faces.is_one_way()).count();
        let odd: Vec<PatchId> = pieces.iter().filter(|p| !p.is_disk).map(|p| p.piece).collect();
        let disks = if odd.is_empty() {
            "all pieces".to_owned()
        } else {
            format!("all but {}", list_pieces(&odd))
        };
        let n = pieces.len();
        let areas = format!(
            "{n}, from {:.0} to {:.0} mm², median {:.0} mm²",
            area_mm2.least, area_mm2.largest, area_mm2.median
        );
        let one_way =
            format!("{n_one_way} of {n} pieces: 95 % of their skin faces within 90° of one direction");
        let mirrored = mirrored_share.map(|share| {
            let told = format!("{:.0} % of the surface is divided symmetrically", 100.0 * share);
            ("mirrored", told)
        });
        let of_all = [
            vec![("pieces", areas)],
            of_seams(&self.figures.seams),
            of_contacts(&self.figures.contacts, &self.params),
            vec![("disks", disks), ("one way out", one_way)],
            mirrored.into_iter().collect(),
        ];
        of_all.concat()
    }
}

/// A name and the text of its figure.
type Line = (&'static str, String);

fn of_seams(seams: &SeamFigures) -> Vec<Line> {
    let percent = |share: f64| format!("{:3.0} %", 100.0 * share);
    let SeamFigures {
        length_mm,
        concave_share,
        flat_share,
        convex_share,
        visible_share,
        front_share,
        n_triple_points,
    } = *seams;
    vec![
        (
            "seams",
            format!("{length_mm:.0} mm, {n_triple_points} points where three or more pieces meet"),
        ),
        ("  in creases", percent(concave_share) + " of their length"),
        ("  where smooth", percent(flat_share)),
        ("  over edges", percent(convex_share)),
        (
            "  in sight",
            percent(visible_share) + ", mean of eight views around the model",
        ),
        (
            "  on the front",
            percent(front_share) + ": in sight from the front, and not in a crease",
        ),
    ]
}

fn of_contacts(contacts: &ContactFigures, params: &SegmentationParams) -> Vec<Line> {
    let SegmentationParams {
        min_contact_mm,
        wall_mm,
        ..
    } = params;
    let mut told = format!("{} at a depth of {wall_mm:.1} mm", contacts.n_contacts);
    if let Some(mm) = contacts.shortest_mm {
        told += &format!(", the shortest {mm:.1} mm");
    }
    if contacts.n_short > 0 {
        let n = contacts.n_short;
        told += &format!("; {n} more are shorter than {min_contact_mm:.1} mm and hold nothing");
    }
    vec![
        ("contacts", told),
        ("held", hold_words(contacts.n_faults, &contacts.hold_alone)),
    ]
}

fn hold_words(n_faults: usize, hold_alone: &[PatchId]) -> String {
    match (n_faults, hold_alone) {
        (0, _) => "no piece alone holds others".to_owned(),
        (n, []) => format!("not connected: {n} faults"),
        (n, [one]) => format!("piece {one} alone holds others: {n} faults"),
        (n, several) => format!("pieces {} alone hold others: {n} faults", list_pieces(several)),
    }
}

fn list_pieces(pieces: &[PatchId]) -> String {
    pieces
        .iter()
        .map(PatchId::to_string)
        .collect::<Vec<_>>()
        .join(", ")
}

fn of_piece(piece: &PieceFigures, standing: &Standing) -> String {
    let is_disk = if piece.is_disk { "yes" } else { "no" };
    format!(
        "{:>5}  {:>9.0}  {is_disk:5}  {:>5.0}°  {}",
        piece.piece.number(),
        piece.area_mm2,
        piece.faces.half_angle_deg,
        standing.way(piece.faces.axis)
    )
}

#[cfg(test)]
mod tests {
    use shellock_geom::{TriMesh, Vec3};

    use super::*;

    /// Separate triangles, each given as its patch, its triangle of the model, and its area.
    fn surface(parts: &[(u32, u32, f64)]) -> SegmentedSurface {
        let mut mesh = TriMesh::default();
        for (i, (_, _, area)) in parts.iter().enumerate() {
            let (at, z) = (3 * i as u32, i as f64);
            mesh.points.extend([
                Vec3::new(0.0, 0.0, z),
                Vec3::new(2.0 * area, 0.0, z),
                Vec3::new(0.0, 1.0, z),
            ]);
            mesh.triangles.push([at, at + 1, at + 2]);
        }
        SegmentedSurface {
            mesh,
            patch_of_face: parts.iter().map(|part| PatchId(part.0)).collect(),
            source_face: parts.iter().map(|part| part.1).collect(),
            n_patches: 1 + parts.iter().map(|part| part.0 as usize).max().unwrap_or(0),
        }
    }

    #[test]
    fn a_face_of_the_file_has_the_patch_with_most_of_its_area_over_all_its_triangles() {
        // A polygon of triangles 0 to 2: area 5 belongs to patch 0, 3 + 3 to patch 1.
        let polygon = [(0, 0, 5.0), (1, 1, 3.0), (1, 2, 3.0)];
        // A triangle that a seam cuts: the larger part decides, or two parts together.
        let cut = [(2, 3, 1.0), (0, 3, 2.0), (2, 3, 1.5)];
        let surface = surface(&[&polygon[..], &cut].concat());
        let labels = labels_of_faces(3, &[0, 0, 0, 1], &surface);
        assert_eq!(labels, [2, 3, 1], "the last face was dropped");
    }
}

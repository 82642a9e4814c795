//! Figures of a division into pieces, as `inspect --segment` prints them.

use shellock::design::{DesignError, Settings};
use shellock::segmentation::figures::{
    ContactFigures, DivisionFigures, FigureParams, PieceFigures, SeamFigures, figures,
};
use shellock::segmentation::{self, SegmentationParams};
use shellock::verify::words::PlaceWords;
use shellock::{Ctx, PatchId, Warning};

use crate::Session;
use crate::args::Options;
use crate::bed::fitted;
use crate::build::checked;
use crate::failure::Failure;
use crate::input::Model;
use crate::place::Standing;
use crate::progress::Display;

/// A division with its figures and warnings.
pub struct Division {
    /// Figures of the division.
    pub figures: DivisionFigures,
    /// Changes that were made, and risks.
    pub warnings: Vec<Warning>,
    /// Parameters that the surface was divided with.
    params: SegmentationParams,
}

/// Divides `model` as `segment` does, by its labels if it has any.
pub fn divide(session: &Session, model: &Model, options: &Options) -> Result<Division, Failure> {
    let params = fitted(session, &checked(options)?, options, model)?;
    let params = Settings::resolve(&params).segmentation;
    let display = Display::new(session.shown);
    let report = |p: shellock::context::Progress<'_>| display.show(p);
    let ctx = Ctx::new(&report, &session.stop);
    let surface = segmentation::segment(&ctx, &params, &model.solid, model.labels.as_deref())
        .inspect_err(|_| display.finish())
        .map_err(DesignError::from)?;
    display.finish();
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
            format!("all but {}", listed(&odd))
        };
        let n = pieces.len();
        let areas = format!(
            "{n}, of {:.0} to {:.0} mm², the middle one {:.0} mm²",
            area_mm2.least, area_mm2.largest, area_mm2.median
        );
        let one_way = format!("{n_one_way} of {n} pieces: 95 % of their skin within 90° of one direction");
        let mirrored = mirrored_share.map(|share| {
            let told = format!(
                "{:.0} % of the surface has its mirror image in its piece's image",
                100.0 * share
            );
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
            percent(visible_share) + ", the mean of eight views around the model",
        ),
        (
            "  on the front",
            percent(front_share) + ": in sight from the front, and in no crease",
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
        told += &format!("; {n} more shorter than {min_contact_mm:.1} mm, which hold nothing");
    }
    vec![
        ("contacts", told),
        ("held", held(contacts.n_faults, &contacts.hold_alone)),
    ]
}

fn held(n_faults: usize, hold_alone: &[PatchId]) -> String {
    match (n_faults, hold_alone) {
        (0, _) => "no piece alone holds others".to_owned(),
        (n, []) => format!("not together: {n} faults"),
        (n, [one]) => format!("piece {one} alone holds others: {n} faults"),
        (n, several) => format!("pieces {} alone hold others: {n} faults", listed(several)),
    }
}

fn listed(pieces: &[PatchId]) -> String {
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

//! A division into pieces in figures: what `inspect --segment` says of it.

use shellock::design::{DesignError, Settings};
use shellock::segmentation::figures::{DivisionFigures, FigureParams, PieceFigures, figures};
use shellock::segmentation::{self, SegmentationParams};
use shellock::{Ctx, PatchId, Warning};

use crate::Session;
use crate::args::Options;
use crate::build::checked;
use crate::failure::Failure;
use crate::input::Model;
use crate::place::Standing;
use crate::progress::Display;

/// A division, and what is told of it.
pub struct Division {
    /// What there is to say.
    pub figures: DivisionFigures,
    /// What was changed, and what may fail.
    pub warnings: Vec<Warning>,
    /// What it was divided for.
    params: SegmentationParams,
}

/// Divides `model` as `segment` does, by its labels where it has any.
pub fn divide(session: &Session, model: &Model, options: &Options) -> Result<Division, Failure> {
    let params = Settings::resolve(&checked(options)?).segmentation;
    let display = Display::new(session.shown);
    let report = |p: shellock::context::Progress<'_>| display.show(p);
    let ctx = Ctx::new(&report, &session.stop);
    let surface = segmentation::segment(&ctx, &params, &model.solid, model.labels.as_deref())
        .inspect_err(|_| display.finish())
        .map_err(DesignError::from)?;
    display.finish();
    let of_figures = FigureParams {
        up: options.up.unit(),
        wall_mm: params.wall_mm,
        min_contact_mm: params.min_contact_mm,
        mirror: None,
    };
    Ok(Division {
        figures: figures(&of_figures, &surface),
        warnings: ctx.into_warnings(),
        params,
    })
}

impl Division {
    /// All of it for people, a line each: of the whole, then of each piece.
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

    fn of_whole(&self) -> Vec<(&'static str, String)> {
        let DivisionFigures {
            area_mm2,
            seams,
            contacts,
            pieces,
            ..
        } = &self.figures;
        let percent = |share: f64| format!("{:3.0} %", 100.0 * share);
        let SegmentationParams {
            min_contact_mm,
            wall_mm,
            ..
        } = self.params;
        let shortest = contacts
            .shortest_mm
            .map_or_else(String::new, |mm| format!(", the shortest {mm:.1} mm"));
        let short = match contacts.n_short {
            0 => String::new(),
            n => format!("; {n} more shorter than {min_contact_mm:.1} mm, which hold nothing"),
        };
        let n_one_way = pieces.iter().filter(|p| p.faces.is_one_way()).count();
        let odd: Vec<PatchId> = pieces.iter().filter(|p| !p.is_disk).map(|p| p.piece).collect();
        let disks = if odd.is_empty() {
            "all pieces".to_owned()
        } else {
            format!("all but {}", listed(&odd))
        };
        vec![
            (
                "pieces",
                format!(
                    "{}, of {:.0} to {:.0} mm², the middle one {:.0} mm²",
                    self.figures.n_pieces, area_mm2.least, area_mm2.largest, area_mm2.median
                ),
            ),
            (
                "seams",
                format!(
                    "{:.0} mm, {} points where three or more pieces meet",
                    seams.length_mm, seams.n_triple_points
                ),
            ),
            (
                "  in creases",
                format!("{} of their length", percent(seams.concave_share)),
            ),
            ("  where smooth", format!("{}", percent(seams.flat_share))),
            ("  over edges", format!("{}", percent(seams.convex_share))),
            (
                "  in sight",
                format!(
                    "{}, the mean of eight views around the model",
                    percent(seams.visible_share)
                ),
            ),
            (
                "  on the front",
                format!(
                    "{}: in sight from the front, and in no crease",
                    percent(seams.front_share)
                ),
            ),
            (
                "contacts",
                format!(
                    "{} at a depth of {wall_mm:.1} mm{shortest}{short}",
                    contacts.n_contacts
                ),
            ),
            ("held", held(contacts.n_faults, &contacts.hold_alone)),
            ("disks", disks),
            (
                "one way out",
                format!(
                    "{n_one_way} of {} pieces: 95 % of their skin within 90° of one direction",
                    pieces.len()
                ),
            ),
        ]
    }
}

fn held(n_faults: usize, hold_alone: &[PatchId]) -> String {
    match (n_faults, hold_alone) {
        (0, _) => "every piece by two others at least".to_owned(),
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
    use shellock::verify::words::PlaceWords;
    let is_disk = if piece.is_disk { "yes" } else { "no" };
    format!(
        "{:>5}  {:>9.0}  {is_disk:5}  {:>5.0}°  {}",
        piece.piece.number(),
        piece.area_mm2,
        piece.faces.half_angle_deg,
        standing.way(piece.faces.axis)
    )
}

//! A kit on the plates of a printer: files, figures, and what does not fit.

use rayon::prelude::*;
use shellock::design::{DesignError, Settings};
use shellock::{Cause, Ctx, PatchId, SegmentedSurface, Warning, segmentation};
use shellock_formats::{NamedObject, write_3mf};
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{Solid, TriMesh};
use shellock_kit::plan_file::PrintingEntry;
use shellock_print::load::Load;
use shellock_print::plates::{Laid, Plates, Printable, fits, fits_whole, lay, lay_alone};
use shellock_print::time::{Cost, whole, whole_words};
use shellock_print::{Printer, Process};
use shellock_render::palette;

use crate::Session;
use crate::failure::Failure;
use crate::input::Model;

/// A face is part of the outer skin where its middle is so near to the model's surface, mm.
const SKIN_MM: f64 = 0.05;
/// Numbers of pieces that are tried where some are too large: each so many times the last.
const MORE_PIECES: f64 = 1.5;
const MOST_TRIES: u32 = 5;

/// A kit, laid on plates.
pub struct Printing {
    printer: Printer,
    plates: Plates,
    /// By the closed forms: all plates, and the whole model as people print it; `None` where it cannot be laid.
    cost: Cost,
    whole: Option<Cost>,
    /// What the pieces weigh without supports, g.
    grams: f64,
}

impl Printing {
    /// Lays `pieces` on plates of `printer`. Of their faces, those on `surface` are the skin that is seen;
    /// `solid` is the model.
    pub fn of(printer: &Printer, pieces: &[TriMesh], surface: &TriMesh, solid: &Solid) -> Self {
        let skin = TriangleBvh::new(surface);
        let printables: Vec<Printable<'_>> = pieces.par_iter().map(|mesh| printable(mesh, &skin)).collect();
        let plates = lay(printer, &printables);
        let mut loads = vec![Load::default(); plates.n_plates];
        for laid in &plates.laid {
            loads[laid.plate] = loads[laid.plate].and(laid.load);
        }
        let whole = lay_alone(printer, solid.mesh()).map(|laid| {
            let load = whole(printer.process, laid.load, solid.mesh().area());
            Cost::of(printer, &load)
        });
        Self {
            printer: printer.clone(),
            plates,
            cost: loads
                .iter()
                .fold(Cost::default(), |sum, load| sum.and(Cost::of(printer, load))),
            whole,
            grams: pieces.iter().map(TriMesh::signed_volume).sum::<f64>() * printer.material.density_g_cm3
                / 1000.0,
        }
    }

    /// What all plates take by closed forms, and the whole model as people print it.
    pub fn costs(&self) -> (Cost, Option<Cost>) {
        (self.cost, self.whole)
    }

    /// What the pieces weigh without supports, g.
    pub fn grams(&self) -> f64 {
        self.grams
    }

    /// Says which pieces the printer cannot make.
    pub fn warnings(&self) -> Option<Warning> {
        let pieces: Vec<PatchId> = self.plates.too_large.iter().map(|&i| i.into()).collect();
        (!pieces.is_empty()).then(|| Warning {
            cause: Cause::PieceTooLarge {
                printer: described(&self.printer),
            },
            pieces,
            at: None,
        })
    }

    /// In one line for people.
    pub fn words(&self) -> String {
        let n = self.plates.n_plates;
        let outer_mm2: f64 = self.plates.laid.iter().map(|l| l.outer_support_mm2).sum();
        let supports = match self.printer.process {
            Process::Sls => String::new(),
            _ => format!("; {:.1} cm² of the outer skin need support", outer_mm2 / 100.0),
        };
        let rest = match self.plates.too_large.len() {
            0 => format!("; {}", self.cost_words()),
            n => format!("; {n} pieces are not on them"),
        };
        let plates = if n == 1 { "plate" } else { "plates" };
        format!(
            "plates.3mf: {n} {plates} of {}{supports}{rest}",
            described(&self.printer)
        )
    }

    /// "about 13 h 50 min and 104 g on this printer with supports; the whole model …".
    fn cost_words(&self) -> String {
        let process = self.printer.process;
        let supports = if process == Process::Sls {
            ""
        } else {
            " with supports"
        };
        let ours = format!("about {} on this printer{supports}", self.cost.words());
        match self.whole {
            Some(whole) => format!(
                "{ours}; the whole model {} takes {}",
                whole_words(process),
                whole.words()
            ),
            None => ours,
        }
    }

    /// For plan.json.
    pub fn entry(&self) -> PrintingEntry {
        PrintingEntry::of(&self.printer, &self.plates, self.cost, self.whole)
    }

    /// All plates side by side, and each alone where there are several.
    pub fn files(&self, pieces: &[TriMesh]) -> Vec<(String, Vec<u8>)> {
        let names: Vec<String> = (1..=pieces.len())
            .map(|number| format!("piece {number}"))
            .collect();
        let object = |laid: &Laid, moved_mm: [f64; 3]| {
            let (name, mesh) = (names[laid.piece].as_str(), &pieces[laid.piece]);
            NamedObject {
                name,
                color: palette::color(laid.piece),
                mesh,
                turned: Some(laid.turned),
                moved_mm,
            }
        };
        let of_plate = |plate: usize| -> Vec<NamedObject<'_>> {
            self.plates
                .laid
                .iter()
                .filter(|l| l.plate == plate)
                .map(|l| object(l, l.moved_mm))
                .collect()
        };
        let all = || {
            self.plates
                .laid
                .iter()
                .map(|l| object(l, l.moved_among_plates_mm(&self.printer)))
                .collect()
        };
        let n = self.plates.n_plates;
        let single =
            (0..if n > 1 { n } else { 0 }).map(|i| (format!("plates/plate-{}.3mf", i + 1), of_plate(i)));
        let archives: Vec<(String, Vec<NamedObject<'_>>)> = std::iter::once(("plates.3mf".to_owned(), all()))
            .chain(single)
            .collect();
        archives
            .into_par_iter()
            .map(|(name, objects)| (name, write_3mf(&objects)))
            .collect()
    }
}

/// A piece, with the faces that lie on the model's surface told apart.
fn printable<'a>(mesh: &'a TriMesh, skin: &TriangleBvh) -> Printable<'a> {
    let is_outer = |f: usize| skin.nearest(mesh.face_center(f), SKIN_MM * SKIN_MM).is_some();
    Printable {
        mesh,
        is_outer: (0..mesh.triangles.len()).into_par_iter().map(is_outer).collect(),
    }
}

fn described(printer: &Printer) -> String {
    let [width, depth, height] = printer.bed_mm;
    format!("\"{}\" ({width} × {depth} × {height} mm)", printer.name)
}

/// What to say before the work starts where pieces will not fit the printer: which, and how many pieces would
/// do.
///
/// What fits the printer in one piece also does in several; only larger models are divided to see.
pub fn too_large(
    session: &Session,
    settings: &Settings,
    printer: &Printer,
    model: &Model,
) -> Result<Option<String>, Failure> {
    if fits_whole(printer, model.solid.mesh().bounds()) {
        return Ok(None);
    }
    let silent = |_: shellock::context::Progress<'_>| ();
    let ctx = Ctx::new(&silent, &session.stop);
    let wall_mm = settings.strength.least_mm.max(settings.body.thickness_mm);
    let misfits = |n_pieces: Option<usize>, labels: Option<&[i64]>| {
        let params = segmentation::SegmentationParams {
            n_pieces,
            ..settings.segmentation.clone()
        };
        let surface =
            segmentation::segment(&ctx, &params, &model.solid, labels).map_err(DesignError::from)?;
        let ids: Vec<u32> = (0..surface.n_patches as u32).collect();
        let misfits: Vec<u32> = ids
            .into_par_iter()
            .filter(|&p| !fits(printer, &shell_of(&surface, PatchId(p), wall_mm)))
            .collect();
        Ok::<_, Failure>((surface.n_patches, misfits))
    };
    let (n, misfitting) = misfits(settings.segmentation.n_pieces, model.labels.as_deref())?;
    if misfitting.is_empty() {
        return Ok(None);
    }
    let mut enough = None;
    let mut tried = n;
    for _ in 0..MOST_TRIES {
        tried = ((tried as f64 * MORE_PIECES).ceil() as usize).min(shellock::segmentation::MOST_PIECES);
        if misfits(Some(tried), None)?.1.is_empty() {
            enough = Some(tried);
            break;
        }
    }
    let remedy = match (enough, &model.labels) {
        (Some(n), None) => format!("about {n} pieces would do (--pieces {n})"),
        (Some(n), Some(_)) => format!("divide them further: about {n} pieces of even size would do"),
        (None, _) => "make it smaller (--size), or choose another printer (--printer)".to_owned(),
    };
    let count = misfitting.len();
    Ok(Some(format!(
        "{count} of {n} pieces will not fit the printer {}; {remedy}",
        described(printer)
    )))
}

/// A patch with a wall behind it, as points: about the piece it becomes.
fn shell_of(surface: &SegmentedSurface, patch: PatchId, wall_mm: f64) -> TriMesh {
    let mut mesh = TriMesh::default();
    for face in (0..surface.mesh.triangles.len()).filter(|&f| surface.patch_of_face[f] == patch) {
        let first = mesh.points.len() as u32;
        mesh.points.extend(surface.mesh.corners(face));
        mesh.points
            .push(surface.mesh.face_center(face) - wall_mm * surface.mesh.face_normal(face));
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    mesh
}

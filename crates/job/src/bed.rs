//! Checks before a kit is made: which pieces will fit the printer, and how many pieces it takes.

use rayon::prelude::*;
use shellock::design::{DesignError, Params, Settings};
use shellock::segmentation::{self, MOST_PIECES, SegmentationParams};
use shellock::{Ctx, PatchId, SegmentedSurface};
use shellock_geom::TriMesh;
use shellock_print::Printer;
use shellock_print::plates::{fits, fits_whole};

use crate::Session;
use crate::failure::Failure;
use crate::input::Model;
use crate::options::{Options, Pieces};
use crate::printing::describe;

/// Factor from one number of pieces to the next that is tried where some pieces are too large.
const MORE_PIECES: f64 = 1.5;
const MOST_TRIES: u32 = 5;
/// Smallest number of pieces that is tried for `--pieces fits-bed`.
const FEWEST: usize = 4;
/// Factor from one number of pieces to the next for `--pieces fits-bed`.
const SOME_MORE: f64 = 1.25;

/// Test division of a model that shows whether its pieces fit a printer.
struct Fitting<'a> {
    session: &'a Session,
    segmentation: &'a SegmentationParams,
    wall_mm: f64,
    printer: &'a Printer,
    model: &'a Model,
}

impl<'a> Fitting<'a> {
    fn new(session: &'a Session, settings: &'a Settings, printer: &'a Printer, model: &'a Model) -> Self {
        Self {
            session,
            segmentation: &settings.segmentation,
            wall_mm: settings.strength.least_mm.max(settings.body.thickness_mm),
            printer,
            model,
        }
    }

    /// Counts the pieces, and those of them that do not fit.
    fn misfits(&self, n_pieces: Option<usize>, labels: Option<&[i64]>) -> Result<(usize, usize), Failure> {
        let silent = |_: shellock::Progress<'_>| ();
        let ctx = Ctx::new(&silent, &self.session.stop);
        let params = SegmentationParams {
            n_pieces,
            ..self.segmentation.clone()
        };
        let surface =
            segmentation::segment(&ctx, &params, &self.model.solid, labels).map_err(DesignError::from)?;
        let n_misfits = (0..surface.n_patches as u32)
            .into_par_iter()
            .filter(|&p| !fits(self.printer, &shell_of(&surface, PatchId(p), self.wall_mm)))
            .count();
        Ok((surface.n_patches, n_misfits))
    }

    /// Returns the smallest number of pieces, of those tried, at which all fit; fails if there is none.
    fn fewest(&self) -> Result<usize, Failure> {
        let mut n_pieces = FEWEST;
        while self.misfits(Some(n_pieces), None)?.1 > 0 {
            if n_pieces == MOST_PIECES {
                return Err(Failure::Wrong(format!(
                    "even {MOST_PIECES} pieces do not fit the printer {}; make the model smaller (--size), \
                     or choose another printer (--printer)",
                    describe(self.printer)
                )));
            }
            n_pieces = ((n_pieces as f64 * SOME_MORE).ceil() as usize).min(MOST_PIECES);
        }
        Ok(n_pieces)
    }
}

/// Returns a warning if some pieces will not fit the printer: how many do not, and how many pieces would do.
///
/// A model that fits the printer in one piece also fits in several; only larger models are divided for the
/// test.
pub fn too_large(
    session: &Session,
    settings: &Settings,
    printer: &Printer,
    model: &Model,
) -> Result<Option<String>, Failure> {
    if fits_whole(printer, model.solid.mesh().bounds()) {
        return Ok(None);
    }
    let fitting = Fitting::new(session, settings, printer, model);
    let (n, n_misfits) = fitting.misfits(settings.segmentation.n_pieces, model.labels.as_deref())?;
    if n_misfits == 0 {
        return Ok(None);
    }
    let mut enough = None;
    let mut tried = n;
    for _ in 0..MOST_TRIES {
        tried = ((tried as f64 * MORE_PIECES).ceil() as usize).min(MOST_PIECES);
        if fitting.misfits(Some(tried), None)?.1 == 0 {
            enough = Some(tried);
            break;
        }
    }
    let remedy = match (enough, &model.labels) {
        (Some(n), None) => format!("about {n} pieces would fit (--pieces {n})"),
        (Some(n), Some(_)) => format!("divide them further: about {n} pieces of equal size would fit"),
        (None, _) => "make the model smaller (--size), or choose another printer (--printer)".to_owned(),
    };
    Ok(Some(format!(
        "{n_misfits} of {n} pieces will not fit the printer {}; {remedy}",
        describe(printer)
    )))
}

/// Returns `params` with the smallest number of pieces that fits the printer if the options ask for that.
///
/// Fails if the model has labels, since these already define the pieces, or if no number of pieces fits.
pub fn fit_params(
    session: &Session,
    params: &Params,
    options: &Options,
    model: &Model,
) -> Result<Params, Failure> {
    if options.pieces != Pieces::FitsBed {
        return Ok(params.clone());
    }
    if model.labels.is_some() {
        let problem = "--pieces fits-bed chooses the pieces, but labels already define them: leave out one \
                       of the two (--labels-from none ignores labels in the model's file)";
        return Err(Failure::Wrong(problem.to_owned()));
    }
    let printer = options.chosen_printer().map_err(Failure::Wrong)?;
    let settings = Settings::resolve(params);
    let fitting = Fitting::new(session, &settings, &printer, model);
    let n_pieces = session.during("number of pieces that fit", || fitting.fewest())?;
    let mut params = params.clone();
    params.n_pieces = Some(n_pieces);
    Ok(params)
}

/// Points of a patch and of a wall behind it: an estimate of the piece that it becomes.
pub fn shell_of(surface: &SegmentedSurface, patch: PatchId, wall_mm: f64) -> TriMesh {
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

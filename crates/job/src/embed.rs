//! Jobs of the command line for programs that embed them: meshes and options in, kits out. They use no
//! standard output, and no files but those that the caller names.
//!
//! Options mean what they mean on the command line. A kit has the
//! bytes that `shellock build` would write for a PLY file with the same points, triangles and labels.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};
use std::time::Instant;

use shellock::Progress;
use shellock::{Ctx, Warning};
use shellock_formats::{read_selection, write_ply};
use shellock_geom::TriMesh;
use shellock_geom::weld::weld;

use crate::Session;
use crate::batch;
use crate::build::{Begun, check_options};
use crate::course::Course;
use crate::division;
use crate::failure::Failure;
use crate::files;
use crate::input::{self, Model};
use crate::options::{Offer, Options, offers};
use crate::output::{Destination, is_of_kits};
use crate::own_assembly::{self, Judgement};

/// Reason why there is no result.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{message}")]
pub struct Problem {
    /// Exit code of the command line: 2 wrong input, 3 no plan, 4 a file could not be written, 130 stopped.
    pub code: u8,
    /// Error message for people.
    pub message: String,
    /// Place of the problem, in the model's units.
    pub at: Option<[f64; 3]>,
}

impl Problem {
    /// Problem with something that was given (code 2).
    pub fn wrong(message: String) -> Self {
        Self {
            code: 2,
            message,
            at: None,
        }
    }
}

impl std::convert::From<Failure> for Problem {
    fn from(failure: Failure) -> Self {
        let at = match &failure {
            Failure::NotOneBody { source, .. } => source.at().map(|at| at.to_array()),
            _ => None,
        };
        Self {
            code: failure.exit_code(),
            message: failure.to_string(),
            at,
        }
    }
}

/// Progress of a job.
pub enum News<'a> {
    /// A stage begins: the `number`-th of `n`, if stages are counted.
    Stage {
        /// Name of the stage.
        name: &'a str,
        /// Number of the stage, from 1; 0 if stages are not counted.
        number: usize,
        /// Number of stages in all.
        n: usize,
    },
    /// A decision was made, in words.
    Note(&'a str),
}

/// Source of a model.
pub enum Source<'a> {
    /// Points and triangles in file units, as of a PLY file, and one label a triangle where pieces are given.
    Mesh(&'a TriMesh, Option<&'a [i32]>),
    /// Bytes of a file in any format that can be read.
    File(&'a [u8]),
}

/// A model and the options for its kit.
pub struct Request<'a> {
    /// Source of the closed surface.
    pub model: Source<'a>,
    /// Name of the model's file.
    pub name: &'a str,
    /// Options of the kit; [`Options::from_names`] reads them by name.
    pub options: &'a Options,
}

/// A kit that is made but not yet written.
pub struct Kit {
    /// All files of the kit, each with its name in the kit's folder.
    pub files: Vec<(String, Vec<u8>)>,
    /// Pieces in order of installation, in assembled position, mm.
    pub pieces: Vec<TriMesh>,
    /// True if every check passes.
    pub has_passed: bool,
    /// Warnings, most important first.
    pub warnings: Vec<Warning>,
    /// Notes on changes to the model and to the choices.
    pub notes: Vec<String>,
}

impl Kit {
    /// Writes the kit's files with [`save`].
    pub fn save(&self, folder: &Path, may_replace: bool) -> Result<(), Problem> {
        save(&self.files, folder, may_replace)
    }
}

/// Makes the same kit as `shellock build`. Setting `stop` ends the job early.
pub fn design(
    request: &Request<'_>,
    news: &(dyn Fn(News<'_>) + Sync),
    stop: &Arc<AtomicBool>,
) -> Result<Kit, Problem> {
    let session = Session::silent(stop);
    let options = request.options;
    let params = check_options(options)?;
    let model = input::simple(&session, model(request)?, options)?;
    let course = Mutex::new(Course::default());
    let made =
        Begun::new(&session, &model, options, &params)?.make(&session, &|p| tell(&course, news, &p))?;
    Ok(Kit {
        has_passed: made.has_passed(),
        pieces: made
            .design
            .kit
            .pieces
            .iter()
            .map(|(_, mesh)| mesh.clone())
            .collect(),
        warnings: Warning::rank(&made.warnings),
        notes: made.notes,
        files: made.files,
    })
}

/// Divides the surface as `shellock segment` does. Returns the number of its piece, from 1, for each
/// triangle.
pub fn segment(
    request: &Request<'_>,
    news: &(dyn Fn(News<'_>) + Sync),
    stop: &Arc<AtomicBool>,
) -> Result<Vec<u32>, Problem> {
    let session = Session::silent(stop);
    check_options(request.options)?;
    let model = model(request)?;
    let course = Mutex::new(Course::default());
    let report = |p: Progress<'_>| tell(&course, news, &p);
    let surface = division::divide_model(&session, &Ctx::new(&report, stop), &model, request.options)?;
    Ok(division::labels_of_file(&model, &surface))
}

/// Verifies any assembly of closed meshes in assembled position, mm, as `shellock verify` does: the pieces
/// must go together in this order, and only the last may come out. `pulled_out_along` is each piece's way
/// out; the first piece needs none.
pub fn verify(
    pieces: &[TriMesh],
    pulled_out_along: &[Option<[f64; 3]>],
    clearance_mm: f64,
    stop: &Arc<AtomicBool>,
) -> Result<Judgement, Problem> {
    if pieces.len() != pulled_out_along.len() {
        let (n, n_ways) = (pieces.len(), pulled_out_along.len());
        return Err(Problem::wrong(format!(
            "{n} pieces and {n_ways} ways out: one for each is needed"
        )));
    }
    let names: Vec<String> = (1..=pieces.len()).map(|i| format!("piece {i}")).collect();
    let ways: Vec<(&str, Option<[f64; 3]>)> = names
        .iter()
        .map(|n| &n[..])
        .zip(pulled_out_along.iter().copied())
        .collect();
    let plan = own_assembly::plan(&ways, clearance_mm).map_err(Problem::wrong)?;
    let pieces = pieces.iter().map(|mesh| weld(mesh).mesh).collect();
    let (assembly, params) = (
        own_assembly::assembly(&pieces, &plan),
        own_assembly::params(clearance_mm),
    );
    let silent = |_: Progress<'_>| ();
    let verdict = shellock::verify(&Ctx::new(&silent, stop), &params, &assembly).map_err(Failure::from)?;
    Ok(Judgement::of(verdict.verification))
}

/// Writes a kit's files to `folder`, all or none. Replaces an earlier kit if `may_replace`, and nothing else.
pub fn save(files: &[(String, Vec<u8>)], folder: &Path, may_replace: bool) -> Result<(), Problem> {
    let to = Destination::new(folder.to_owned(), may_replace)?;
    Ok(to.write(files)?)
}

/// Writes one file, whole or not at all.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Problem> {
    Ok(files::write(path, bytes)?)
}

/// Lists all models below `folder`, except those in `out`, as `shellock batch` takes them: each model's path
/// within `folder`, with the path of its kit.
pub fn models(folder: &Path, out: Option<&Path>) -> Result<Vec<(PathBuf, PathBuf)>, Problem> {
    Ok(batch::models(folder, out)?.into())
}

/// Builds the tables of a batch, each with its file name, from a JSON list of records as `shellock batch`
/// keeps them.
pub fn tables(records: &str) -> Result<Vec<(String, Vec<u8>)>, Problem> {
    let records: Vec<batch::Record> =
        serde_json::from_str(records).map_err(|e| Problem::wrong(format!("records: {e}")))?;
    Ok(batch::tables(&records))
}

/// Path, within the folder for kits, at which a program other than `shellock batch` keeps its record of a
/// kit. `kind` names that program.
pub fn record_path(kit: &str, kind: &str) -> String {
    format!("{}/{}.{kind}.json", batch::RECORDS, batch::record_name(kit))
}

/// Returns true if a file of this name, within a kit's folder, is one that commands write there.
pub fn is_of_kit(name: &str) -> bool {
    is_of_kits(name)
}

/// Lists all options that [`Options::from_names`] reads.
pub fn options() -> Vec<Offer> {
    offers(&[], &[])
}

/// Reads the model by way of its file's bytes, because the kit states facts about these bytes, such as their
/// hash.
fn model(request: &Request<'_>) -> Result<Model, Problem> {
    let options = request.options;
    let path = Path::new(request.name);
    let bytes = match request.model {
        Source::Mesh(mesh, labels) => Cow::Owned(write_ply(mesh, labels)),
        Source::File(bytes) => Cow::Borrowed(bytes),
    };
    let extension = path.extension().and_then(|e| e.to_str());
    let loaded = read_selection(&bytes, extension, &input::selection(options)).map_err(|source| {
        Failure::NotAMesh {
            path: path.to_owned(),
            source,
        }
    })?;
    Ok(input::model_of(path, &loaded, &bytes, options)?)
}

fn tell(course: &Mutex<Course>, news: &(dyn Fn(News<'_>) + Sync), progress: &Progress<'_>) {
    match *progress {
        Progress::Stage { name, .. } => {
            let mut course = course.lock().expect("no holder of this lock panics");
            let stand = course.begin(name, Instant::now());
            drop(course);
            let (number, n) = stand.map_or((0, 0), |stand| (stand.number, stand.of));
            news(News::Stage { name, number, n });
        }
        Progress::Note(text) => news(News::Note(text)),
        Progress::Step => {}
    }
}

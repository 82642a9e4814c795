//! State behind the studio's page: one project, its model and its pieces.

#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};

use serde_json::{Map, Value, json};
use shellock::design::{Settings, first_division};
use shellock::segmentation::{self, MOST_PIECES};
use shellock::{Ctx, figure::Figure as Sample};
use shellock_formats::{Loaded, write_stl_binary};
use shellock_geom::Vec3;
use shellock_job::bed::fit_params;
use shellock_job::build::check_options;
use shellock_job::input::{read, shellock_figure};
use shellock_job::options::{Choice, Choices, Offer, apply_changes, offers, relabel};
use shellock_job::output::turn_back;
use shellock_job::project::ModelOf;
use shellock_job::{Failure, Options, Session, child, config};
use shellock_print::Printer;

use crate::figure::Figure;
use crate::finer::{self, finer};
use crate::jobs::Maker;
use crate::judgement::{Judged, judge};
use crate::kit;
use crate::messages::{Divided, Division, Judgement, MadeKit, Project};
use crate::pieces::{Pieces, successor};
use crate::refusal::Refusal;
use crate::store::{Found, N_LABELS, Store};

/// Options that change the solid made from the model's file.
const OF_MODEL: [&str; 13] = [
    "size",
    "height",
    "scale",
    "unit",
    "up",
    "no-repair",
    "largest",
    "object",
    "plate",
    "fill",
    "inside-out",
    "resolution",
    "labels-from",
];
/// Longest side of the figures that come with the program, mm.
const SAMPLE_MM: f64 = 120.0;

/// A project that is open in the studio.
pub struct Bench {
    store: Store,
    printers: Vec<Printer>,
    state: Mutex<State>,
}

struct State {
    /// Counter that grows with every change.
    revision: u64,
    model: Option<ModelOf>,
    choices: Choices,
    options: Arc<Options>,
    figure: Option<Arc<Figure>>,
    /// True while a model is being opened; `problem` says why the last one could not be.
    is_opening: bool,
    problem: Option<String>,
    pieces: Option<Pieces>,
    /// Labels, one a face of the file, kept until the model is open.
    file_labels: Option<Vec<u32>>,
    judgement: Option<Arc<Judged>>,
    /// Flag that stops the running judgement.
    stop_flag: Arc<AtomicBool>,
    /// Hash of the project that the kit in the making is built from.
    build_hash: Option<String>,
}

impl State {
    /// Choices adapted to `pieces`, so that their labels name the same faces as before; `None` if nothing has
    /// to change.
    ///
    /// Options name the labels of the model's file, or the numbers of painted pieces once a person has
    /// painted.
    fn relabel(&self, pieces: &Pieces) -> Option<Choices> {
        let model = &self.figure.as_ref()?.model;
        let own = model.labels.as_deref()?;
        let painted = self.pieces.as_ref().filter(|pieces| pieces.is_painted);
        let (before, after) = match (painted, pieces.is_painted) {
            (None, true) => (own.to_vec(), pieces.numbers()),
            (Some(painted), false) => (painted.numbers(), own.to_vec()),
            _ => return None,
        };
        let mesh = model.solid.mesh();
        let new_label = |label| successor(label, &before, &after, |face| mesh.face_area(face));
        Some(relabel(&self.choices, new_label))
    }
}

impl Bench {
    /// Opens the project in `folder`, which may be new. The model is not opened yet.
    pub fn open(folder: PathBuf) -> Result<Self, Failure> {
        let (
            store,
            Found {
                model,
                choices,
                labels,
            },
        ) = Store::open(folder)?;
        let text = store.printers().map(|printers| {
            let mut file = toml_edit::DocumentMut::new();
            file["printers"] = printers.clone();
            file.to_string()
        });
        let printers = text.map(|text| config::printers_of(&text)).transpose();
        let printers = printers.map_err(Failure::Wrong)?.unwrap_or_default();
        let options = choose_options(&choices, &printers)?;
        let state = State {
            revision: 0,
            model,
            choices,
            options: Arc::new(options),
            figure: None,
            is_opening: false,
            problem: None,
            pieces: None,
            file_labels: labels,
            judgement: None,
            stop_flag: Arc::default(),
            build_hash: None,
        };
        Ok(Self {
            store,
            printers,
            state: Mutex::new(state),
        })
    }

    /// Opens the model that the project names, if any.
    pub fn load(&self) {
        let Some(model) = self.lock().model.clone() else {
            return;
        };
        if let Err(refusal) = self.show(model) {
            self.lock().problem = Some(refusal.to_string());
        }
    }

    /// Copies the user's file into the project if it differs from the project's. [`Self::load`] opens it.
    pub fn take(&self, path: &Path) -> Result<(), Failure> {
        let name = path
            .file_name()
            .map_or_else(|| "model".into(), |n| n.to_string_lossy());
        let bytes = read(path)?;
        let extension = path.extension().and_then(|e| e.to_str());
        // An unreadable file is reported when it is opened.
        let model = match shellock_formats::read_mesh(&bytes, extension) {
            Ok(loaded) => self.store_model(&name, &loaded, &bytes)?,
            Err(_) => self.store.keep(&name, &bytes)?,
        };
        let mut state = self.lock();
        if state.model.as_ref() != Some(&model) {
            (state.model, state.file_labels) = (Some(model), None);
            self.store.save(state.model.as_ref(), &state.choices, None)?;
        }
        Ok(())
    }

    /// Stores a model's file, or a version of the same shape with triangles fine enough for painting.
    fn store_model(&self, name: &str, loaded: &Loaded, bytes: &[u8]) -> Result<ModelOf, Failure> {
        match finer(name, loaded) {
            Some((name, bytes)) => self.store.keep(&name, &bytes),
            None => self.store.keep(name, bytes),
        }
    }

    /// Opens a model from the project's folder.
    fn show(&self, model: ModelOf) -> Result<(), Refusal> {
        self.lock().is_opening = true;
        let opened = self.read_figure(&model, &self.lock().options.clone());
        let mut state = self.lock();
        state.is_opening = false;
        let figure = opened?;
        let painted = state.file_labels.take();
        let labels = painted.and_then(|labels| figure.shown_labels(&labels));
        (state.problem, state.model) = (None, Some(model));
        state.figure = Some(Arc::new(figure));
        state.pieces = labels.map(Pieces::painted_by_hand);
        self.record_change(&mut state)
    }

    fn read_figure(&self, model: &ModelOf, options: &Options) -> Result<Figure, Refusal> {
        let path = self.store.model_path(model).map_err(|e| self.refuse(&e))?;
        Figure::open(&Session::silent(&Arc::default()), &path, options).map_err(|e| self.refuse(&e))
    }

    /// Records a change: discards the judgement of the former state and saves the project.
    fn record_change(&self, state: &mut State) -> Result<(), Refusal> {
        state.revision += 1;
        state.judgement = None;
        state.stop_flag.store(true, Ordering::Relaxed);
        let painted = state.pieces.as_ref().filter(|pieces| pieces.is_painted);
        let labels = state
            .figure
            .as_ref()
            .zip(painted)
            .map(|(figure, pieces)| figure.file_labels(&pieces.labels));
        let saved = self
            .store
            .save(state.model.as_ref(), &state.choices, labels.as_deref());
        saved.map_err(|e| self.refuse(&e))
    }

    /// Sets new pieces for the state of `revision`; refuses if the state has changed since.
    fn set_pieces(&self, revision: u64, pieces: Pieces) -> Result<Divided, Refusal> {
        let mut state = self.lock();
        if state.revision != revision {
            return Err(Refusal::overtaken());
        }
        let (n_pieces, notes, method) = (pieces.n(), pieces.notes.clone(), state.options.method.name());
        if let Some(choices) = state.relabel(&pieces) {
            state.options = Arc::new(choose_options(&choices, &self.printers)?);
            state.choices = choices;
        }
        state.pieces = Some(pieces);
        self.record_change(&mut state)?;
        Ok(Divided {
            revision: state.revision,
            n_pieces,
            method,
            notes,
            is_changed: None,
        })
    }

    /// Copies what is needed to work on the model while the page goes on.
    fn snapshot(&self) -> Result<Snapshot, Refusal> {
        let state = self.lock();
        let figure = state.figure.clone();
        Ok(Snapshot {
            revision: state.revision,
            options: Arc::clone(&state.options),
            figure: figure.ok_or_else(|| Refusal::not_found("no model is open"))?,
            pieces: state.pieces.clone(),
        })
    }

    /// Words a failure for the page, without the path of the project's folder.
    fn refuse(&self, failure: &Failure) -> Refusal {
        let words = without_folder(&failure.to_string(), self.store.folder());
        match failure {
            Failure::Unwritable { .. } => Refusal::unable(words),
            _ => Refusal::wrong(words),
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().expect("no holder of this lock panics")
    }
}

struct Snapshot {
    revision: u64,
    options: Arc<Options>,
    figure: Arc<Figure>,
    pieces: Option<Pieces>,
}

impl Snapshot {
    fn pieces(&self) -> Result<&Pieces, Refusal> {
        self.pieces
            .as_ref()
            .ok_or_else(|| Refusal::not_found("the model has not been divided yet"))
    }
}

/// Functions that the page uses. They may be called from any thread, several at once.
impl Bench {
    /// Folder of the project, which holds all files written.
    pub(crate) fn folder(&self) -> &Path {
        self.store.folder()
    }

    /// Folder of the kit that was made last.
    pub(crate) fn kit_folder(&self) -> PathBuf {
        self.store.kit_folder()
    }

    /// State of the project, from which the page begins.
    pub(crate) fn project(&self) -> Project {
        let state = self.lock();
        let model = state.figure.as_ref().map(|figure| {
            let finer = state.model.as_ref().and_then(|of| finer::note(&of.file));
            figure.describe(finer, state.options.up)
        });
        let division = state.pieces.as_ref().map(|pieces| Division {
            n_pieces: pieces.n(),
            origin: if pieces.is_painted { "painted" } else { "automatic" },
            method: state.options.method.name(),
            notes: pieces.notes.clone(),
        });
        let name = self.store.folder().file_name();
        Project {
            name: name.map(|n| n.to_string_lossy().into_owned()),
            folder: self.store.folder().to_owned(),
            revision: state.revision,
            is_opening: state.is_opening,
            problem: state.problem.clone(),
            model,
            division,
            kit: self.store.kit().map(|noted| MadeKit {
                passed: noted.has_passed,
                is_current: noted.is_current,
                summary: noted.summary,
                files: kit::list(&self.store.kit_folder()),
            }),
            figures: Sample::ALL.map(|figure| figure.name()).to_vec(),
            program: env!("CARGO_PKG_VERSION"),
        }
    }

    /// All options of a kit, with their purpose and current values.
    pub(crate) fn options(&self) -> Vec<Offer> {
        offers(&self.lock().choices, &self.printers)
    }

    /// Sets options by name; `null` unsets one. If one value is wrong, no option changes.
    pub(crate) fn choose(&self, changes: &Map<String, Value>) -> Result<(), Refusal> {
        let (choices, model, figure) = {
            let state = self.lock();
            (state.choices.clone(), state.model.clone(), state.figure.clone())
        };
        let choices = apply_changes(&choices, changes)?;
        let options = Arc::new(choose_options(&choices, &self.printers)?);
        let is_other = changes.keys().any(|name| OF_MODEL.contains(&&name[..]));
        let opened = match model.filter(|_| is_other && figure.is_some()) {
            Some(model) => Some(self.read_figure(&model, &options)?),
            None => None,
        };
        let mut state = self.lock();
        (state.choices, state.options) = (choices, options);
        // Any option may change the division, except the key, which is cut out of the divided surface.
        if let Some(pieces) = &mut state.pieces
            && changes.keys().any(|name| name != "key")
        {
            pieces.division = None;
        }
        if let Some(next) = opened {
            let painted = state.pieces.take().filter(|pieces| pieces.is_painted);
            let of_file = figure
                .zip(painted)
                .map(|(before, pieces)| before.file_labels(&pieces.labels));
            state.pieces = of_file
                .and_then(|labels| next.shown_labels(&labels))
                .map(Pieces::painted_by_hand);
            state.figure = Some(Arc::new(next));
        }
        self.record_change(&mut state)
    }

    /// Opens the model in `file`, named `name`, and keeps a copy.
    pub(crate) fn open_file(&self, name: &str, file: &Path) -> Result<(), Refusal> {
        let bytes = read(file).map_err(|e| self.refuse(&e))?;
        // A file that cannot be read is not kept.
        let extension = Path::new(name).extension().and_then(|e| e.to_str());
        let loaded = shellock_formats::read_mesh(&bytes, extension)
            .map_err(|e| Refusal::wrong(format!("{name}: {e}")))?;
        let model = self
            .store_model(name, &loaded, &bytes)
            .map_err(|e| self.refuse(&e))?;
        drop((bytes, loaded));
        let before = {
            let mut state = self.lock();
            state.file_labels.take()
        };
        self.show(model).inspect_err(|_| self.lock().file_labels = before)
    }

    /// Opens one of the program's own figures.
    pub(crate) fn open_figure(&self, name: &str) -> Result<(), Refusal> {
        let (solid, _) = shellock_figure(name, SAMPLE_MM).map_err(|e| self.refuse(&e))?;
        let bytes = write_stl_binary(solid.mesh());
        let model = self
            .store
            .keep(&format!("{name}.stl"), &bytes)
            .map_err(|e| self.refuse(&e))?;
        self.lock().file_labels = None;
        self.show(model)
    }

    /// Surface of the model in the page's mesh format.
    pub(crate) fn mesh(&self) -> Result<Vec<u8>, Refusal> {
        let of = self.snapshot()?;
        Ok(of.figure.bytes(of.options.up))
    }

    /// Divides the model by the current options.
    pub(crate) fn divide(&self) -> Result<Divided, Refusal> {
        let of = self.snapshot()?;
        let pieces = divide_snapshot(&of).map_err(|e| self.refuse(&e))?;
        self.set_pieces(of.revision, pieces)
    }

    /// Piece of each triangle of the mesh, from 0: 32-bit little-endian numbers.
    pub(crate) fn labels(&self) -> Result<Vec<u8>, Refusal> {
        let of = self.snapshot()?;
        Ok(of
            .pieces()?
            .labels
            .iter()
            .flat_map(|label| label.to_le_bytes())
            .collect())
    }

    /// Takes a division painted by the user, in the format of [`Self::labels`].
    pub(crate) fn paint(&self, labels: &[u8]) -> Result<Divided, Refusal> {
        let of = self.snapshot()?;
        let (numbers, rest) = labels.as_chunks::<4>();
        if numbers.len() != of.figure.n_faces() || !rest.is_empty() {
            let n = of.figure.n_faces();
            return Err(Refusal::wrong(format!(
                "{} bytes are not the labels of {n} triangles",
                labels.len()
            )));
        }
        let painted: Vec<u32> = numbers.iter().map(|b| u32::from_le_bytes(*b)).collect();
        if painted.iter().any(|&label| label >= N_LABELS) {
            return Err(Refusal::wrong(format!(
                "more than {MOST_PIECES} pieces cannot be made"
            )));
        }
        let of_file = of.figure.file_labels(&painted);
        let kept = of
            .figure
            .shown_labels(&of_file)
            .unwrap_or_else(|| painted.clone());
        // A face of the file belongs to one piece only.
        let is_changed = kept != painted;
        let told = self.set_pieces(of.revision, Pieces::painted_by_hand(kept))?;
        Ok(Divided {
            is_changed: Some(is_changed),
            ..told
        })
    }

    /// Judges if the pieces interlock, and proposes repairs. A later call ends an earlier one.
    pub(crate) fn judge(&self) -> Result<Judgement, Refusal> {
        let of = self.snapshot()?;
        let pieces = of.pieces()?;
        let stop = Arc::new(AtomicBool::new(false));
        {
            let mut state = self.lock();
            if let Some(judged) = state.judgement.as_ref().filter(|_| state.revision == of.revision) {
                return Ok(judged.judgement.clone());
            }
            state.stop_flag.store(true, Ordering::Relaxed);
            state.stop_flag = Arc::clone(&stop);
        }
        let judged = judge(&Session::silent(&stop), &of.figure, &of.options, pieces);
        let mut state = self.lock();
        if state.revision != of.revision || stop.load(Ordering::Relaxed) {
            return Err(Refusal::overtaken());
        }
        let mut judged = judged.map_err(|e| self.refuse(&e))?;
        judged.judgement.revision = of.revision;
        let told = judged.judgement.clone();
        state.judgement = Some(Arc::new(judged));
        Ok(told)
    }

    /// Judged surface, cut along smooth seams, followed by the piece of each of its triangles.
    pub(crate) fn cut(&self) -> Result<Vec<u8>, Refusal> {
        let judged = self.lock().judgement.clone();
        let cut = judged.map(|judged| judged.cut.clone());
        cut.ok_or_else(Refusal::overtaken)
    }

    /// Replaces the division by the repaired one that the program proposes.
    pub(crate) fn mend(&self) -> Result<Divided, Refusal> {
        let (revision, judged) = {
            let state = self.lock();
            (state.revision, state.judgement.clone())
        };
        let judged = match judged {
            Some(judged) => judged,
            None => {
                self.judge()?;
                self.lock().judgement.clone().ok_or_else(Refusal::overtaken)?
            }
        };
        self.set_pieces(revision, Pieces::painted_by_hand(judged.labels.clone()))
    }

    /// Divides both sides of a symmetric model alike.
    pub(crate) fn mirror(&self) -> Result<Divided, Refusal> {
        let of = self.snapshot()?;
        let params = check_options(&of.options).map_err(|e| self.refuse(&e))?;
        let params = Settings::resolve(&params).segmentation;
        let labels = segmentation::mirrored_labels(&params, &of.figure.model.solid, &of.pieces()?.labels);
        let labels = labels.ok_or_else(|| Refusal::wrong("the model has no plane of symmetry"))?;
        self.set_pieces(of.revision, Pieces::painted_by_hand(labels))
    }

    /// Requests a key near the place `at`, mm.
    pub(crate) fn place_key(&self, at: [f64; 3]) -> Result<(), Refusal> {
        let place = turn_back(self.snapshot()?.options.up, Vec3::from(at)) + 0.0;
        let [x, y, z] = place.to_array().map(|mm| format!("{mm:.2}"));
        let changes = Map::from_iter([("key".to_owned(), json!(format!("{x},{y},{z}")))]);
        self.choose(&changes)
    }

    /// Refuses if there is no model of which a kit could be made.
    pub(crate) fn can_make(&self) -> Result<(), Refusal> {
        match self.lock().figure {
            Some(_) => Ok(()),
            None => Err(Refusal::not_found("no model is open")),
        }
    }
}

impl Maker for Arc<Bench> {
    fn task(&self) -> Result<Command, Refusal> {
        self.can_make()?;
        self.lock().build_hash = Some(self.store.state());
        let program = std::env::current_exe().map_err(|e| Refusal::unable(e.to_string()))?;
        Ok(child::build(
            &program,
            &self.store.project_file(),
            &self.store.kit_folder(),
        ))
    }

    fn on_end(&self, code: Option<i32>, output: &str) {
        let made_of = self.lock().build_hash.take();
        let result: Value = serde_json::from_str(output).unwrap_or_default();
        if let (Some(made_of), Some(code @ (0 | 1))) = (made_of, code) {
            // The kit exists even if the note on its inputs cannot be written.
            let _ = self.store.note_kit(&made_of, code, result);
        }
    }
}

/// Options of the command that makes the kit, which a project file may hold and the page does not offer.
const OF_COMMAND: [&str; 3] = ["config", "out", "force"];

/// Options that were chosen; refuses what `build` would refuse.
fn choose_options(choices: &[(String, Choice)], own_printers: &[Printer]) -> Result<Options, Failure> {
    let mut of_kit = choices.to_vec();
    of_kit.retain(|(name, _)| !OF_COMMAND.contains(&&name[..]));
    Options::from_choices(&of_kit, own_printers)
}

/// `words` without the path of `folder` before the names of files in it, which ends in this system's
/// separator.
fn without_folder(words: &str, folder: &Path) -> String {
    words.replace(&folder.join("").display().to_string(), "")
}

/// Divides the model as `segment` would.
fn divide_snapshot(of: &Snapshot) -> Result<Pieces, Failure> {
    let stop = Arc::default();
    let session = Session::silent(&stop);
    let model = &of.figure.model;
    let params = fit_params(&session, &check_options(&of.options)?, &of.options, model)?;
    let notes: Mutex<Vec<String>> = Mutex::default();
    let report = |progress: shellock::Progress<'_>| {
        if let shellock::Progress::Note(text) = progress {
            notes
                .lock()
                .expect("no holder of this lock panics")
                .push(text.to_owned());
        }
    };
    let ctx = Ctx::new(&report, &stop);
    let surface = first_division(&ctx, &params, &model.solid, model.labels.as_deref())?;
    drop(ctx);
    Ok(Pieces {
        labels: Arc::new(of.figure.labels_of(&surface)),
        is_painted: false,
        division: Some(Arc::new(surface)),
        notes: notes.into_inner().expect("no holder of this lock panics"),
    })
}

//! Native half of `import shellock`: arrays in, kits out. The package in `shellock/` has the documentation
//! for users.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use numpy::ndarray::Array2;
use numpy::{PyArray2, PyReadonlyArray1, PyReadonlyArray2, ToPyArray};
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyRuntimeError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use shellock_check::{Finding, Verdict};
use shellock_geom::{TriMesh, Vec3};
use shellock_job::Options;
use shellock_job::embed::{self, News, Problem, Request, Source};

create_exception!(
    _native,
    Refused,
    PyException,
    "Code and message of what went wrong."
);

/// Interval between checks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

/// Arrays of a mesh: points (n, 3), triangles (m, 3).
type Arrays<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<u32>>);

/// A kit that has been made.
#[pyclass(frozen, module = "shellock._native")]
struct Kit(embed::Kit);

#[pymethods]
impl Kit {
    #[getter]
    fn passed(&self) -> bool {
        self.0.has_passed
    }

    #[getter]
    fn notes(&self) -> Vec<String> {
        self.0.notes.clone()
    }

    fn warnings(&self) -> String {
        json(&self.0.warnings)
    }

    fn pieces<'py>(&self, py: Python<'py>) -> Vec<Arrays<'py>> {
        self.0.pieces.iter().map(|mesh| arrays(py, mesh)).collect()
    }

    fn files<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for (name, bytes) in &self.0.files {
            all.set_item(name, PyBytes::new(py, bytes))?;
        }
        Ok(all)
    }

    fn save(&self, py: Python<'_>, folder: PathBuf, force: bool) -> PyResult<()> {
        py.detach(|| self.0.save(&folder, force)).map_err(exception)
    }
}

/// Makes a kit. `options` is a JSON object. `progress` is called with a stage, its number, the number of
/// stages, and a note.
#[pyfunction]
#[pyo3(signature = (points, triangles, labels, name, options, progress))]
fn design(
    py: Python<'_>,
    points: PyReadonlyArray2<'_, f64>,
    triangles: PyReadonlyArray2<'_, u32>,
    labels: Option<PyReadonlyArray1<'_, i32>>,
    name: &str,
    options: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<Kit> {
    let input = Input::new(&points, &triangles, labels.as_ref(), options)?;
    wait_for(py, progress, |news, stop| {
        embed::design(&input.request(name), news, stop)
    })
    .map(Kit)
}

/// Makes a kit from the bytes of a model file.
#[pyfunction]
#[pyo3(signature = (file, name, options, progress))]
fn build(
    py: Python<'_>,
    file: &[u8],
    name: &str,
    options: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<Kit> {
    let options = &parse_options(options)?;
    let model = Source::File(file);
    let request = Request { model, name, options };
    wait_for(py, progress, |news, stop| embed::design(&request, news, stop)).map(Kit)
}

/// Divides a surface. Returns the number of the piece of each triangle, from 1.
#[pyfunction]
#[pyo3(signature = (points, triangles, labels, options, progress))]
fn segment(
    py: Python<'_>,
    points: PyReadonlyArray2<'_, f64>,
    triangles: PyReadonlyArray2<'_, u32>,
    labels: Option<PyReadonlyArray1<'_, i32>>,
    options: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<Vec<u32>> {
    let input = Input::new(&points, &triangles, labels.as_ref(), options)?;
    wait_for(py, progress, |news, stop| {
        embed::segment(&input.request("model.ply"), news, stop)
    })
}

/// Verifies an assembly. Returns a JSON object with `passed`, `checks` and `findings`.
#[pyfunction]
fn verify(
    py: Python<'_>,
    pieces: Vec<(PyReadonlyArray2<'_, f64>, PyReadonlyArray2<'_, u32>)>,
    pulled_out_along: Vec<Option<[f64; 3]>>,
    clearance: f64,
) -> PyResult<String> {
    let meshes: PyResult<Vec<TriMesh>> = pieces.iter().map(|(p, t)| mesh(p, t)).collect();
    let meshes = meshes?;
    let told = wait_for(py, None, |_, stop| {
        embed::verify(&meshes, &pulled_out_along, clearance, stop)
    })?;
    Ok(json(&told))
}

/// Checks the certificate in a kit's folder. Returns claim, verdict and figure of each finding.
#[pyfunction]
fn check(py: Python<'_>, folder: PathBuf) -> PyResult<Vec<(String, String, String)>> {
    let found = py.detach(|| shellock_check::check(&folder));
    let found = found.map_err(|message| exception(wrong(message)))?;
    let word = |verdict| match verdict {
        Verdict::Confirmed => "confirmed",
        Verdict::Refuted => "refuted",
        Verdict::Unproven => "unproven",
    };
    let told = |f: Finding| (f.claim, word(f.verdict).to_owned(), f.figure);
    Ok(found.into_iter().map(told).collect())
}

/// Writes the files of a kit to a folder.
#[pyfunction]
fn save(py: Python<'_>, files: Vec<(String, Vec<u8>)>, folder: PathBuf, force: bool) -> PyResult<()> {
    py.detach(|| embed::save(&files, &folder, force))
        .map_err(exception)
}

/// Writes one file atomically: either all of it or nothing.
#[pyfunction]
fn write_file(path: PathBuf, content: &[u8]) -> PyResult<()> {
    embed::write_file(&path, content).map_err(exception)
}

/// Lists all models below a folder, except in `out`, with the paths of their kits.
#[pyfunction]
fn models(folder: PathBuf, out: Option<PathBuf>) -> PyResult<Vec<(PathBuf, PathBuf)>> {
    embed::models(&folder, out.as_deref()).map_err(exception)
}

/// Returns the tables of a batch with their file names, from a JSON list of records.
#[pyfunction]
fn tables<'py>(py: Python<'py>, records: &str) -> PyResult<Vec<(String, Bound<'py, PyBytes>)>> {
    let files = embed::tables(records).map_err(exception)?;
    let bytes = |(name, content): (String, Vec<u8>)| (name, PyBytes::new(py, &content));
    Ok(files.into_iter().map(bytes).collect())
}

/// Returns the path of the record of a kit made on Ray, within the folder for kits.
#[pyfunction]
fn record_path(kit: &str) -> String {
    embed::record_path(kit, "ray")
}

/// Returns true if a file of this name, within a kit's folder, belongs to the kit.
#[pyfunction]
fn is_of_kit(name: &str) -> bool {
    embed::is_of_kit(name)
}

/// Returns all options, as a JSON list.
#[pyfunction]
fn options() -> String {
    json(&embed::options())
}

/// Input of a job, copied so that no Python object is needed while it runs.
struct Input {
    mesh: TriMesh,
    labels: Option<Vec<i32>>,
    options: Options,
}

impl Input {
    fn new(
        points: &PyReadonlyArray2<'_, f64>,
        triangles: &PyReadonlyArray2<'_, u32>,
        labels: Option<&PyReadonlyArray1<'_, i32>>,
        options: &str,
    ) -> PyResult<Self> {
        Ok(Self {
            mesh: mesh(points, triangles)?,
            labels: labels.map(|labels| labels.as_array().to_vec()),
            options: parse_options(options)?,
        })
    }

    fn request<'a>(&'a self, name: &'a str) -> Request<'a> {
        Request {
            model: Source::Mesh(&self.mesh, self.labels.as_deref()),
            name,
            options: &self.options,
        }
    }
}

/// Reads options from a JSON object with their names and values.
fn parse_options(options: &str) -> PyResult<Options> {
    let values = serde_json::from_str(options).map_err(|e| exception(wrong(format!("options: {e}"))))?;
    Options::from_names(&values).map_err(|failure| exception(failure.into()))
}

fn json(value: &impl serde::Serialize) -> String {
    serde_json::to_string(value).expect("numbers and strings can be written")
}

fn mesh(points: &PyReadonlyArray2<'_, f64>, triangles: &PyReadonlyArray2<'_, u32>) -> PyResult<TriMesh> {
    let (points, triangles) = (points.as_array(), triangles.as_array());
    if points.ncols() != 3 || triangles.ncols() != 3 {
        return Err(exception(wrong(
            "points and triangles have three columns each".into(),
        )));
    }
    let n_points = points.nrows();
    if triangles.iter().any(|&v| v as usize >= n_points) {
        return Err(exception(wrong(format!(
            "a triangle names a point that is none of the {n_points}"
        ))));
    }
    Ok(TriMesh {
        points: points
            .rows()
            .into_iter()
            .map(|p| Vec3::new(p[0], p[1], p[2]))
            .collect(),
        triangles: triangles.rows().into_iter().map(|t| [t[0], t[1], t[2]]).collect(),
    })
}

fn arrays<'py>(py: Python<'py>, mesh: &TriMesh) -> Arrays<'py> {
    let points = Array2::from_shape_fn((mesh.points.len(), 3), |(i, k)| mesh.points[i][k]);
    let triangles = Array2::from_shape_fn((mesh.triangles.len(), 3), |(i, k)| mesh.triangles[i][k]);
    (points.to_pyarray(py), triangles.to_pyarray(py))
}

fn wrong(message: String) -> Problem {
    Problem::wrong(message)
}

fn exception(problem: Problem) -> PyErr {
    Refused::new_err((problem.code, problem.message, problem.at))
}

/// Progress news on their way to another thread.
struct Event {
    stage: String,
    number: usize,
    n: usize,
    note: Option<String>,
}

/// Runs `job` in a thread of its own, while this thread checks for Ctrl-C and calls `progress`. The first
/// exception stops the job and is raised after the job has ended; `progress` is not called after it.
fn wait_for<T: Send>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    job: impl FnOnce(&(dyn Fn(News<'_>) + Sync), &Arc<AtomicBool>) -> Result<T, Problem> + Send,
) -> PyResult<T> {
    let stop = Arc::new(AtomicBool::new(false));
    let (send, receive) = channel();
    // Other Python threads may run meanwhile. The closure passed to `detach` may not borrow a bare receiver,
    // hence the mutex.
    let receive = Mutex::new(receive);
    let mut interrupt = None;
    let ended = std::thread::scope(|scope| {
        let stop_of_job = Arc::clone(&stop);
        let worker = scope.spawn(move || {
            let send = Mutex::new(send);
            let news = |news: News<'_>| {
                let event = event(news);
                // The receiver may be gone once the job is to stop.
                let _ = send.lock().map(|send| send.send(event));
            };
            job(&news, &stop_of_job)
        });
        loop {
            let event = py.detach(|| {
                receive
                    .lock()
                    .map_or(Err(RecvTimeoutError::Disconnected), |r| r.recv_timeout(LOOK))
            });
            let heard = match event {
                Ok(_) if interrupt.is_some() => Ok(()),
                Ok(event) => report_event(py, progress.as_ref(), &event),
                Err(RecvTimeoutError::Timeout) => py.check_signals(),
                Err(RecvTimeoutError::Disconnected) => break,
            };
            if let Err(e) = heard.and_then(|()| py.check_signals()) {
                stop.store(true, Ordering::Relaxed);
                interrupt.get_or_insert(e);
            }
        }
        py.detach(|| worker.join())
    });
    match (interrupt, ended) {
        (Some(e), _) => Err(e),
        (None, Ok(result)) => result.map_err(exception),
        (None, Err(_)) => Err(PyRuntimeError::new_err(
            "the program failed where it never should: please report the model",
        )),
    }
}

fn event(news: News<'_>) -> Event {
    match news {
        News::Stage { name, number, n } => Event {
            stage: name.to_owned(),
            number,
            n,
            note: None,
        },
        News::Note(text) => Event {
            stage: String::new(),
            number: 0,
            n: 0,
            note: Some(text.to_owned()),
        },
    }
}

fn report_event(py: Python<'_>, progress: Option<&Py<PyAny>>, event: &Event) -> PyResult<()> {
    let Some(progress) = progress else {
        return Ok(());
    };
    progress.call1(py, (&event.stage, event.number, event.n, event.note.as_deref()))?;
    Ok(())
}

#[pymodule]
mod _native {
    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
    #[pymodule_export]
    use super::{
        Kit, Refused, build, check, design, is_of_kit, models, options, record_path, save, segment, tables,
        verify, write_file,
    };
}

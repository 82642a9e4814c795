//! The studio's server: a page on the user's own machine, and the program behind it.
//!
//! ```text
//!  browser ──► guard ──► routes ──► Workshop (the program: models, divisions, project files)
//!     ▲       host, origin,  │
//!     │       token, rate    └────► jobs ──► the program again, as a process of its own, for each kit
//!     └──────────── events ◄──────────┘
//! ```
//!
//! This crate knows HTTP, jobs and the files of a finished kit, but nothing about models. The server binds
//! 127.0.0.1 alone. Every request beyond the page itself needs a token, which is new at each start.

mod guard;
mod jobs;
mod kit;
mod page;
mod refusal;
mod routes;

use std::ffi::OsString;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use serde_json::{Map, Value};
use tokio::net::TcpListener;

pub use kit::with_slashes;
pub use refusal::Refusal;

/// Largest accepted model file, bytes.
pub const MOST_BYTES: u64 = 500 << 20;
/// Interval between checks of the stop flag.
const LOOK: Duration = Duration::from_millis(50);

/// Functions of the program that the page uses. They may be called from any thread, several at once.
///
/// Answers are JSON in the form that the page reads. Lengths are in mm, and models stand with z up.
pub trait Workshop: Send + Sync + 'static {
    /// Returns the project's folder, which holds all files written.
    fn folder(&self) -> &Path;
    /// Returns the folder of the kit that was made last.
    fn kit_folder(&self) -> PathBuf;
    /// Returns all that the page shows at first, except the jobs.
    fn project(&self) -> Value;
    /// Returns all options of a kit, with their purpose and current values.
    fn options(&self) -> Value;
    /// Sets options by name; `null` unsets one. If one value is wrong, no option changes.
    fn choose(&self, changes: &Map<String, Value>) -> Result<(), Refusal>;
    /// Opens the model in `file`, named `name`, and keeps a copy.
    fn open(&self, name: &str, file: &Path) -> Result<(), Refusal>;
    /// Opens one of the program's own figures.
    fn open_figure(&self, name: &str) -> Result<(), Refusal>;
    /// Returns the model's surface in the page's mesh format.
    fn mesh(&self) -> Result<Vec<u8>, Refusal>;
    /// Divides the model by the current options.
    fn divide(&self) -> Result<Value, Refusal>;
    /// Returns the piece of each triangle of the mesh, from 0: 32-bit little-endian numbers.
    fn labels(&self) -> Result<Vec<u8>, Refusal>;
    /// Takes a division painted by the user, in the format of [`Self::labels`].
    fn paint(&self, labels: &[u8]) -> Result<Value, Refusal>;
    /// Judges if the pieces interlock, and proposes repairs. A later call ends an earlier one.
    fn judge(&self) -> Result<Value, Refusal>;
    /// Returns the judged surface, cut along smooth seams, followed by the piece of each of its triangles.
    fn cut(&self) -> Result<Vec<u8>, Refusal>;
    /// Replaces the division by the repaired one that the program proposes.
    fn mend(&self) -> Result<Value, Refusal>;
    /// Divides both sides of a symmetric model alike.
    fn mirror(&self) -> Result<Value, Refusal>;
    /// Requests a key near the place `at`, mm.
    fn place_key(&self, at: [f64; 3]) -> Result<(), Refusal>;
    /// Returns the process that makes the kit.
    fn task(&self) -> Result<Task, Refusal>;
    /// Reports the end of a task: its exit code, `None` after a signal, and its standard output.
    fn ended(&self, code: Option<i32>, output: &str);
}

/// A process that makes a kit. It must end when its standard input is closed.
#[derive(Clone, Debug)]
pub struct Task {
    /// Path of the program.
    pub program: PathBuf,
    /// Arguments of the program.
    pub arguments: Vec<OsString>,
}

/// Port and token of a running studio.
#[derive(Clone, Debug)]
pub struct Address {
    port: u16,
    token: String,
}

impl Address {
    /// Returns the page's address, including the token.
    pub fn url(&self) -> String {
        format!("http://127.0.0.1:{}/?token={}", self.port, self.token)
    }
}

/// Serves `workshop` at `port` (0: any free one) until `stop` becomes true. Calls `ready` with the address
/// once it listens.
///
/// Fails if the port is taken or there is no randomness for a token.
pub fn serve(
    workshop: Arc<dyn Workshop>,
    port: u16,
    stop: &AtomicBool,
    ready: impl FnOnce(&Address),
) -> std::io::Result<()> {
    const N_THREADS: usize = 2;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(N_THREADS)
        .enable_all()
        .build()?;
    let ended = runtime.block_on(async {
        let listener = TcpListener::bind(SocketAddr::from((Ipv4Addr::LOCALHOST, port))).await?;
        let address = Address {
            port: listener.local_addr()?.port(),
            token: guard::token()?,
        };
        let app = routes::app(&address, workshop);
        ready(&address);
        tokio::select! {
            ended = axum::serve(listener, app) => ended,
            () = stopped(stop) => Ok(()),
        }
    });
    // Computations still in progress are not waited for.
    runtime.shutdown_background();
    ended
}

async fn stopped(stop: &AtomicBool) {
    while !stop.load(Ordering::Relaxed) {
        tokio::time::sleep(LOOK).await;
    }
}

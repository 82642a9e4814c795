//! The studio's server: a page on the user's own machine, and the program behind it.
//!
//! ```text
//!  browser ──► guard ──► routes ──► Workshop (the program: models, divisions, project files)
//!     ▲       host, origin,  │
//!     │       token, rate    └────► jobs ──► the program again, as a process of its own, for each kit
//!     └──────────── events ◄──────────┘
//! ```
//!
//! It knows HTTP, jobs and the files of a finished kit; not what a model is. It binds 127.0.0.1 alone; what is not
//! the page itself asks for a token that is new at each start.

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

pub use kit::name_in_kit;
pub use refusal::Refusal;

/// Largest file that is taken, bytes.
pub const MOST_BYTES: u64 = 500 << 20;
/// How often it is looked whether to end.
const LOOK: Duration = Duration::from_millis(50);

/// What the program does for the page. All of it may be called from any thread, and several at once.
///
/// Answers are JSON as the page reads it; lengths are mm, places stand with z up.
pub trait Workshop: Send + Sync + 'static {
    /// Where everything is written.
    fn folder(&self) -> &Path;
    /// The folder of the kit that was made last.
    fn kit_folder(&self) -> PathBuf;
    /// All that the page shows at first, without the jobs.
    fn project(&self) -> Value;
    /// All options of a kit, what they are for and what is chosen.
    fn options(&self) -> Value;
    /// Sets options by name; `null` unsets one. All of them or, where one is wrong, none.
    fn choose(&self, changes: &Map<String, Value>) -> Result<(), Refusal>;
    /// Opens the model in `file`, which is called `name`, and keeps it.
    fn open(&self, name: &str, file: &Path) -> Result<(), Refusal>;
    /// Opens a figure of the program.
    fn open_figure(&self, name: &str) -> Result<(), Refusal>;
    /// The model's surface as the page draws it.
    fn mesh(&self) -> Result<Vec<u8>, Refusal>;
    /// Divides the model by the options.
    fn divide(&self) -> Result<Value, Refusal>;
    /// A piece for each triangle of the mesh, from 0: 32-bit numbers, the low byte first.
    fn labels(&self) -> Result<Vec<u8>, Refusal>;
    /// What a person painted, in the same way.
    fn paint(&self, labels: &[u8]) -> Result<Value, Refusal>;
    /// Whether the pieces lock, and what to mend; a later call ends an earlier one.
    fn judge(&self) -> Result<Value, Refusal>;
    /// The surface as it was judged, cut along smooth seams, and after it a piece for each of its triangles.
    fn cut(&self) -> Result<Vec<u8>, Refusal>;
    /// Takes the pieces as the program would mend them.
    fn mend(&self) -> Result<Value, Refusal>;
    /// Divides both sides of a symmetric model alike.
    fn mirror(&self) -> Result<Value, Refusal>;
    /// Wants the key near a place.
    fn place_key(&self, at: [f64; 3]) -> Result<(), Refusal>;
    /// What makes the kit.
    fn task(&self) -> Result<Task, Refusal>;
    /// A task has ended so, with this on its standard output.
    fn ended(&self, code: Option<i32>, output: &str);
}

/// A process that makes a kit. It ends where its standard input does.
#[derive(Clone, Debug)]
pub struct Task {
    /// The program.
    pub program: PathBuf,
    /// What it is given.
    pub arguments: Vec<OsString>,
}

/// Where the studio is, and its token.
#[derive(Clone, Debug)]
pub struct Address {
    port: u16,
    token: String,
}

impl Address {
    /// The page's address with the token.
    pub fn url(&self) -> String {
        format!("http://127.0.0.1:{}/?token={}", self.port, self.token)
    }
}

/// Serves `workshop` at `port` (0: any that is free) until `stop` becomes true; says where it is by `ready`.
///
/// Fails where the port is taken or there is no randomness for a token.
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
    // What still computes is not waited for.
    runtime.shutdown_background();
    ended
}

async fn stopped(stop: &AtomicBool) {
    while !stop.load(Ordering::Relaxed) {
        tokio::time::sleep(LOOK).await;
    }
}

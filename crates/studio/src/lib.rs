//! The studio: a page on the user's own machine, the server behind it, and the project that it edits.
//!
//! ```text
//!  browser ──► guard ──► routes ──► Bench (models, divisions, the project's files)
//!     ▲       host, origin,  │
//!     │       token, rate    └────► jobs ──► the program again, as a process of its own, for each kit
//!     └──────────── events ◄──────────┘
//! ```
//!
//! The server binds 127.0.0.1 alone. Every request beyond the page itself needs a token, which is new at each
//! start.

mod advice;
mod bench;
mod figure;
mod finer;
mod guard;
mod jobs;
mod judgement;
mod kit;
mod messages;
mod page;
mod pieces;
mod rate;
mod refusal;
mod routes;
mod state;
mod store;

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tokio::net::TcpListener;

pub use bench::Bench;
use jobs::Jobs;

/// Largest accepted model file, bytes.
pub const MOST_BYTES: u64 = 500 << 20;
/// Interval between checks of the stop flag.
const LOOK: Duration = Duration::from_millis(50);

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

/// Serves `bench` at `port` (0: any free one) until `stop` becomes true. Calls `ready` with the address
/// once it listens.
///
/// Fails if the port is taken or there is no randomness for a token.
pub fn serve(
    bench: Arc<Bench>,
    port: u16,
    stop: &AtomicBool,
    ready: impl FnOnce(&Address),
) -> std::io::Result<()> {
    const N_THREADS: usize = 2;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(N_THREADS)
        .enable_all()
        .build()?;
    let jobs = Jobs::new(Arc::clone(&bench));
    let ended = runtime.block_on(async {
        let listener = TcpListener::bind(SocketAddr::from((Ipv4Addr::LOCALHOST, port))).await?;
        let address = Address {
            port: listener.local_addr()?.port(),
            token: guard::token()?,
        };
        let app = routes::app(&address, Arc::clone(&jobs), bench);
        ready(&address);
        tokio::select! {
            ended = axum::serve(listener, app) => ended,
            () = wait_for_stop(stop) => Ok(()),
        }
    });
    jobs.close();
    // Computations still in progress are not waited for.
    runtime.shutdown_background();
    ended
}

async fn wait_for_stop(stop: &AtomicBool) {
    while !stop.load(Ordering::Relaxed) {
        tokio::time::sleep(LOOK).await;
    }
}

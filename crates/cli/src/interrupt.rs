//! Ctrl-C: stages end by themselves where they check for it. A moment later the process is ended, but never
//! while files are being written.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

/// Time for stages to end by themselves.
const PATIENCE: Duration = Duration::from_millis(300);

/// Interval at which the end of writing is checked.
const LOOK: Duration = Duration::from_millis(5);

/// Number of writers with files or folders that must not be left behind.
static N_WRITING: AtomicUsize = AtomicUsize::new(0);

/// Guard that keeps the program running while files are written.
pub struct Writing(());

impl Writing {
    pub fn begin() -> Self {
        N_WRITING.fetch_add(1, Ordering::SeqCst);
        Self(())
    }
}

impl Drop for Writing {
    fn drop(&mut self) {
        N_WRITING.fetch_sub(1, Ordering::SeqCst);
    }
}

/// On Ctrl-C, sets `stop`; a moment later calls `end`, and the program ends with code 130.
pub fn watch(stop: &Arc<AtomicBool>, end: impl Fn() + Send + Copy + 'static) {
    let stop = Arc::clone(stop);
    // Without a handler Ctrl-C would still end the program, only less tidily.
    let _ = ctrlc::set_handler(move || stop_soon(&stop, end));
}

/// Does the same when standard input ends: the program that started this one has stopped it, or is gone.
pub fn watch_stdin(stop: &Arc<AtomicBool>, end: impl Fn() + Send + Copy + 'static) {
    let stop = Arc::clone(stop);
    std::thread::spawn(move || {
        // A read error counts as the end of input.
        let _ = std::io::copy(&mut std::io::stdin(), &mut std::io::sink());
        stop_soon(&stop, end);
    });
}

fn stop_soon(stop: &Arc<AtomicBool>, end: impl Fn() + Send + 'static) {
    if stop.swap(true, Ordering::Relaxed) {
        return;
    }
    std::thread::spawn(move || {
        std::thread::sleep(PATIENCE);
        while N_WRITING.load(Ordering::SeqCst) > 0 {
            std::thread::sleep(LOOK);
        }
        end();
        std::process::exit(130);
    });
}

//! Ctrl-C: stages end by themselves where they check for it. A moment later the process is ended, but never
//! while files are being written.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use shellock_job::files::Writing;

/// Time for stages to end by themselves.
const PATIENCE: Duration = Duration::from_millis(300);

/// Interval at which the end of writing is checked.
const LOOK: Duration = Duration::from_millis(5);

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
        while Writing::is_going_on() {
            std::thread::sleep(LOOK);
        }
        end();
        std::process::exit(130);
    });
}

//! Ctrl-C: stages end by themselves where they look for it; what does not within a moment is ended from outside,
//! but never while files are written.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

/// How long stages have to end by themselves.
const PATIENCE: Duration = Duration::from_millis(300);

/// How often it is looked whether files are written.
const LOOK: Duration = Duration::from_millis(5);

/// How many have files or folders that must not be left behind.
static N_WRITING: AtomicUsize = AtomicUsize::new(0);

/// Nothing ends the program while there is one.
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

/// Sets `stop` with Ctrl-C; a moment later `end` tells it, and the program ends with code 130.
pub fn watch(stop: &Arc<AtomicBool>, end: impl Fn() + Send + Copy + 'static) {
    let stop = Arc::clone(stop);
    // Without a handler Ctrl-C would still end the program, only less tidily.
    let _ = ctrlc::set_handler(move || stop_soon(&stop, end));
}

/// The same where standard input ends: a program that started this one wants no more of it, or is gone.
pub fn watch_stdin(stop: &Arc<AtomicBool>, end: impl Fn() + Send + Copy + 'static) {
    let stop = Arc::clone(stop);
    std::thread::spawn(move || {
        // An error is an end, too.
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

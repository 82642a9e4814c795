//! Command line of Shellock: arguments → parameters → library → files. Programs can embed the same jobs
//! ([`embed`]).

mod args;
mod batch;
mod bears;
mod bed;
mod build;
mod choices;
mod config;
mod coupon;
mod course;
mod division;
pub mod embed;
mod failure;
mod fonts;
mod input;
mod inspect;
mod interrupt;
mod loads;
mod manual;
mod names;
mod output;
mod own_assembly;
mod page;
mod paint;
mod place;
mod printing;
mod progress;
mod project;
mod savings;
mod shape;
mod shares;
mod stages;
mod stopwatch;
mod stress;
mod studio;
mod tabs;
mod told;
mod units;

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::error::ErrorKind;
use serde_json::json;

use args::Command;
use failure::Failure;
pub use manual::options_guide;

/// Programs in the guide, compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/guide/library.md")]
struct Guide;

/// Settings and state that every command gets.
pub struct Session {
    /// True if one JSON object is printed instead of text.
    pub is_json: bool,
    /// True if every check, note and figure is printed.
    pub is_verbose: bool,
    /// Form in which progress is shown.
    pub shown: progress::Shown,
    /// Flag that becomes true with Ctrl-C.
    pub stop: Arc<AtomicBool>,
    /// Start time of the program.
    pub since: std::time::Instant,
}

impl Session {
    /// Creates a session that shows nothing and ends with `stop`.
    fn silent(stop: &Arc<AtomicBool>) -> Self {
        Self {
            is_json: false,
            is_verbose: false,
            shown: progress::Shown::Nothing,
            stop: Arc::clone(stop),
            since: std::time::Instant::now(),
        }
    }

    /// Runs `work` and shows progress under `name` meanwhile.
    pub fn during<T>(&self, name: &str, work: impl FnOnce() -> T) -> T {
        let display = progress::Display::new(self.shown);
        display.show(shellock::context::Progress::Stage { name, n_steps: 0 });
        let done = work();
        display.finish();
        done
    }
}

/// Limit on the number of threads: each has a stack, and no computer has as many cores.
const MOST_THREADS: usize = 256;

/// Runs the program with its arguments and returns its exit code.
pub fn command_line() -> ExitCode {
    let wants_json = std::env::args_os().any(|word| word == "--json");
    let cli = match config::command_line(std::env::args_os().collect()) {
        Ok(cli) => cli,
        Err(config::Refusal::Arguments(e)) => {
            let is_help = matches!(e.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion);
            if !is_help && wants_json {
                let text = e.render().to_string();
                return refuse(true, text.trim().trim_start_matches("error: "), 2);
            }
            let _ = e.print();
            return ExitCode::from(if is_help { 0 } else { 2 });
        }
        Err(config::Refusal::File(problem)) => return refuse(wants_json, &problem.to_string(), 2),
    };
    let tell = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        // A guarded panic becomes an error, which is reported as such.
        if shellock_geom::boolean::is_guarded() {
            return;
        }
        match panic
            .payload()
            .downcast_ref::<String>()
            .filter(|what| what.starts_with("failed printing to stdout"))
        {
            Some(what) => unprinted(what),
            None => tell(panic),
        }
    }));
    let session = Session {
        is_json: cli.json,
        is_verbose: cli.verbose,
        shown: shown(&cli),
        stop: Arc::new(AtomicBool::new(false)),
        since: std::time::Instant::now(),
    };
    let is_json = session.is_json;
    let is_batch = matches!(cli.command, Command::Batch(_));
    let told = move || {
        let stopped = if is_batch {
            Failure::BatchStopped
        } else {
            Failure::Stopped
        };
        refuse(is_json, &stopped.to_string(), stopped.exit_code());
    };
    interrupt::watch(&session.stop, told);
    if cli.stop_with_stdin {
        interrupt::watch_stdin(&session.stop, told);
    }
    if let Some(n) = cli.threads
        && let Err(e) = rayon::ThreadPoolBuilder::new()
            .num_threads(n.clamp(1, MOST_THREADS))
            .build_global()
    {
        eprintln!("warning: --threads {n} was not taken: {e}");
    }
    match run(&session, cli.command) {
        Ok(code) => ExitCode::from(code),
        Err(failure) => {
            let exit_code = failure.exit_code();
            match failure.code().filter(|_| session.is_json) {
                None => refuse(session.is_json, &failure.to_string(), exit_code),
                Some(code) => {
                    println!(
                        "{}",
                        json!({ "status": "error", "error": failure.to_string(), "code": code,
                                "exit_code": exit_code })
                    );
                    ExitCode::from(exit_code)
                }
            }
        }
    }
}

/// Reports an error: as one JSON object on standard output, or as a line on standard error.
fn refuse(is_json: bool, problem: &str, code: u8) -> ExitCode {
    if is_json {
        println!(
            "{}",
            json!({ "status": "error", "error": problem, "exit_code": code })
        );
    } else {
        eprintln!("error: {problem}");
    }
    ExitCode::from(code)
}

/// Ends the program when standard output fails. A full disk is reported; a reader that closed the pipe is
/// not.
fn unprinted(what: &str) -> ! {
    if !what.contains("Broken pipe") {
        eprintln!("error: {what}");
    }
    std::process::exit(4)
}

/// Form of progress for the options: events with JSON, nothing when quiet, else for people.
fn shown(cli: &args::Cli) -> progress::Shown {
    match (cli.quiet, cli.json) {
        (true, _) => progress::Shown::Nothing,
        (false, true) => progress::Shown::Events,
        (false, false) => progress::Shown::ForPeople,
    }
}

fn run(session: &Session, command: Command) -> Result<u8, Failure> {
    use inspect::Wanted;
    match command {
        Command::Build { model, options, out } => build::build(session, &model, &options, out),
        Command::Demo { figure, options, out } => build::demo(session, &figure, &options, out),
        Command::Segment { model, options, out } => stages::segment(session, &model, &options, &out),
        Command::Plan { model, options } => stages::plan(session, &model, &options),
        Command::Verify { kit, model } if kit.join(own_assembly::ASSEMBLY).is_file() => {
            own_assembly::verify(session, &kit, model.as_deref())
        }
        Command::Verify { kit, model } => stages::verify(session, &kit, model.as_deref()),
        Command::Test { kit, blows } => stress::test(session, &kit, &blows),
        Command::Report {
            kit,
            model,
            closed_form,
        } => savings::report(session, &kit, model.as_deref(), closed_form),
        Command::Inspect {
            model,
            options,
            segment,
        } => {
            let wanted = if segment { Wanted::Division } else { Wanted::File };
            inspect::inspect(session, &model, &options, wanted)
        }
        Command::Coupon(options) => coupon::coupon(session, &options),
        Command::Studio(options) => studio::studio(session, &options),
        Command::Batch(options) => batch::batch(session, &options),
        Command::Completions { shell } => Ok(manual::completions(shell)),
        Command::Manual { folder } => manual::write(&folder),
        Command::Figure {
            name,
            out,
            size,
            labels,
        } => stages::figure(&name, &out, size, labels.as_deref()),
    }
}

//! Command line of Shellock: arguments, progress and messages in a terminal. Jobs themselves are those of
//! [`shellock_job`], which programs can embed.

mod args;
mod commands;
mod config;
mod interrupt;
mod manual;
mod print;
mod progress;

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::error::ErrorKind;
use serde_json::json;

use args::Command;
use commands::{
    batch, build, coupon, figure, inspect, own_assembly, plan, printers, report, segment, studio, test,
    verify,
};
pub use manual::options_guide;
use shellock_job::Failure;
use shellock_job::own_assembly::ASSEMBLY;

/// Settings and state that every command gets.
pub struct Session {
    /// True if one JSON object is printed instead of text.
    pub is_json: bool,
    /// True if every check, note and figure is printed.
    pub is_verbose: bool,
    /// Form in which progress is shown.
    pub progress_form: progress::Shown,
    /// Stop flag, which becomes true with Ctrl-C, start time, and display of single stages.
    pub job: shellock_job::Session,
}

impl Session {
    /// Creates a session that begins now.
    fn new(cli: &args::Cli) -> Self {
        let shown = progress_form(cli);
        let stop = Arc::new(AtomicBool::new(false));
        Self {
            is_json: cli.json,
            is_verbose: cli.verbose,
            progress_form: shown,
            job: shellock_job::Session::new(&stop, move |name| {
                Box::new(progress::OneStage::begin(shown, name))
            }),
        }
    }
}

/// Limit on the number of threads: each has a stack, and no computer has as many cores.
const MOST_THREADS: usize = 256;

/// Runs the program with its arguments and returns its exit code.
pub fn command_line() -> ExitCode {
    let cli = match config::command_line(std::env::args_os().collect()) {
        Ok(cli) => cli,
        Err(refusal) => return refuse_arguments(refusal),
    };
    report_panics();
    let session = Session::new(&cli);
    watch_stops(&session, &cli);
    if let Some(n) = cli.threads
        && let Err(e) = rayon::ThreadPoolBuilder::new()
            .num_threads(n.clamp(1, MOST_THREADS))
            .build_global()
    {
        eprintln!("warning: --threads {n} was ignored: {e}");
    }
    match run(&session, cli.command) {
        Ok(code) => ExitCode::from(code),
        Err(failure) => report_failure(&session, &failure),
    }
}

/// Reports arguments or a file of them that cannot be used, or prints the help that they ask for.
fn refuse_arguments(refusal: config::Refusal) -> ExitCode {
    let wants_json = std::env::args_os().any(|word| word == "--json");
    match refusal {
        config::Refusal::Arguments(e) => {
            let is_help = matches!(e.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion);
            if !is_help && wants_json {
                let text = e.render().to_string();
                return refuse(true, text.trim().trim_start_matches("error: "), 2);
            }
            let _ = e.print();
            ExitCode::from(if is_help { 0 } else { 2 })
        }
        config::Refusal::File(problem) => refuse(wants_json, &problem.to_string(), 2),
    }
}

/// Reports panics as the system does, but for those that become errors and for failures of standard output.
fn report_panics() {
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
            Some(what) => abort_output(what),
            None => tell(panic),
        }
    }));
}

/// Watches for Ctrl-C, and for the end of standard input if that is asked for.
fn watch_stops(session: &Session, cli: &args::Cli) {
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
    interrupt::watch(&session.job.stop, told);
    if cli.stop_with_stdin {
        interrupt::watch_stdin(&session.job.stop, told);
    }
}

/// Reports why a command failed, with its code for programs where there is one.
fn report_failure(session: &Session, failure: &Failure) -> ExitCode {
    let exit_code = failure.exit_code();
    let Some(code) = failure.code().filter(|_| session.is_json) else {
        return refuse(session.is_json, &failure.to_string(), exit_code);
    };
    println!(
        "{}",
        json!({ "status": "error", "error": failure.to_string(), "code": code, "exit_code": exit_code })
    );
    ExitCode::from(exit_code)
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
fn abort_output(what: &str) -> ! {
    if !what.contains("Broken pipe") {
        eprintln!("error: {what}");
    }
    std::process::exit(4)
}

/// Form of progress for the options: events with JSON, nothing when quiet, else for people.
fn progress_form(cli: &args::Cli) -> progress::Shown {
    match (cli.quiet, cli.json) {
        (true, _) => progress::Shown::Nothing,
        (false, true) => progress::Shown::Events,
        (false, false) => progress::Shown::ForPeople,
    }
}

fn run(session: &Session, command: Command) -> Result<u8, Failure> {
    use inspect::Wanted;
    match command {
        Command::Build { model, options, out } => build::build(session, &model, &options.options, out),
        Command::Demo { figure, options, out } => build::demo(session, &figure, &options, out),
        Command::Segment { model, options, out } => segment::segment(session, &model, &options.options, &out),
        Command::Plan { model, options } => plan::plan(session, &model, &options.options),
        Command::Verify { kit, model } if kit.join(ASSEMBLY).is_file() => {
            own_assembly::verify(session, &kit, model.as_deref())
        }
        Command::Verify { kit, model } => verify::verify(session, &kit, model.as_deref()),
        Command::Test { kit, blows } => test::test(session, &kit, &blows),
        Command::Report {
            kit,
            model,
            closed_form,
        } => report::report(session, &kit, model.as_deref(), closed_form),
        Command::Inspect {
            model,
            options,
            segment,
        } => {
            let wanted = if segment { Wanted::Division } else { Wanted::File };
            inspect::inspect(session, &model, &options.options, wanted)
        }
        Command::Coupon(options) => coupon::coupon(session, &options),
        Command::Printers(options) => Ok(printers::printers(session, &options.own_printers)),
        Command::Studio(options) => studio::studio(session, &options),
        Command::Batch(options) => batch::batch(session, &options),
        Command::Completions { shell } => Ok(manual::completions(shell)),
        Command::Manual { folder } => manual::write(&folder),
        Command::Figure {
            name,
            out,
            size,
            labels,
        } => figure::figure(&name, &out, size, labels.as_deref()),
    }
}

//! Shell completions and manual pages, made from the declarations of the command line.

mod guide;

use std::fs;
use std::io::{ErrorKind, Write};
use std::path::Path;

use shellock_job::Failure;
use shellock_job::files::write as write_file;

use crate::args;

pub use guide::options_guide;

/// Runs `shellock completions` and returns the exit code.
pub fn completions(shell: clap_complete::Shell) -> u8 {
    let mut bytes = Vec::new();
    clap_complete::generate(shell, &mut args::command(), "shellock", &mut bytes);
    let mut out = std::io::stdout();
    // A reader that closes the pipe has seen enough.
    u8::from(
        out.write_all(&bytes)
            .and_then(|()| out.flush())
            .is_err_and(|e| e.kind() != ErrorKind::BrokenPipe),
    ) * 4
}

/// Runs `shellock manual`: writes `shellock.1` and a page for each command.
pub fn write(folder: &Path) -> Result<u8, Failure> {
    fs::create_dir_all(folder).map_err(Failure::unwritable(folder))?;
    let mut root = args::command();
    root.build();
    for command in std::iter::once(&root).chain(root.get_subcommands().filter(|c| c.get_name() != "help")) {
        let page = clap_mangen::Man::new(command.clone());
        let path = folder.join(page.get_filename());
        let mut bytes = Vec::new();
        page.render(&mut bytes).map_err(Failure::unwritable(&path))?;
        write_file(&path, &bytes)?;
    }
    Ok(0)
}

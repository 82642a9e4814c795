//! Guide of all options, written from the program's own declarations: `cargo xtask options`.

use std::fs;
use std::path::PathBuf;

use clap::Args;

use crate::failure::Failure;

/// Destination of the guide.
#[derive(Args)]
pub struct Options {
    /// Name of the file to write
    #[arg(long, value_name = "FILE", default_value = "docs/guide/options.md")]
    out: PathBuf,
}

/// Writes the guide; returns its file.
pub fn run(options: &Options) -> Result<Vec<PathBuf>, Failure> {
    let path = options.out.clone();
    match fs::write(&path, shellock_cli::options_guide()) {
        Ok(()) => Ok(vec![path]),
        Err(source) => Err(Failure::File { path, source }),
    }
}

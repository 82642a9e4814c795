//! Sheets that a study writes into its folder.

use std::fs;
use std::path::{Path, PathBuf};

use crate::failure::Failure;

/// A file to be written: its name in the study's folder, and its text.
pub type Sheet = (String, String);

/// Writes the sheets into the folder `study` of `out`; returns the files.
pub fn write_all(out: &Path, study: &str, sheets: &[Sheet]) -> Result<Vec<PathBuf>, Failure> {
    let folder = out.join(study);
    fs::create_dir_all(&folder).map_err(|source| Failure::File {
        path: folder.clone(),
        source,
    })?;
    let write = |(name, text): &Sheet| {
        let path = folder.join(name);
        fs::write(&path, text).map_err(|source| Failure::File {
            path: path.clone(),
            source,
        })?;
        Ok(path)
    };
    sheets.iter().map(write).collect()
}

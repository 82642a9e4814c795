//! Files written whole or not at all, and their names.

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::failure::Failure;

/// Number of writers with files or folders that must not be left behind.
static N_WRITING: AtomicUsize = AtomicUsize::new(0);

/// Guard that says that files are being written: the program must not end meanwhile.
pub struct Writing(());

impl Writing {
    /// Begins to write a file.
    pub fn begin() -> Self {
        N_WRITING.fetch_add(1, Ordering::SeqCst);
        Self(())
    }

    /// Returns true while any thread writes.
    pub fn is_going_on() -> bool {
        N_WRITING.load(Ordering::SeqCst) > 0
    }
}

impl Drop for Writing {
    fn drop(&mut self) {
        N_WRITING.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Writes one file, whole or not at all.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let _writing = Writing::begin();
    let parent = path
        .parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(".shellock-");
    // Temporary files are readable by their owner only. This one stays, so it gets the user's usual
    // permissions.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let temporary = builder.tempfile_in(parent).map_err(Failure::unwritable(path))?;
    fs::write(temporary.path(), bytes).map_err(Failure::unwritable(path))?;
    temporary
        .persist(path)
        .map(|_| ())
        .map_err(|e| Failure::Unwritable {
            path: path.to_owned(),
            source: e.error,
        })
}

/// Extension of a file's name, without the dot and in lower case; empty if there is none.
pub fn extension(path: &Path) -> String {
    path.extension()
        .map_or_else(String::new, |e| e.to_string_lossy().to_ascii_lowercase())
}

/// Parts of a relative `path` with `/` between them on every system, as files and addresses name it.
pub fn with_slashes(path: &Path) -> String {
    let parts: Vec<_> = path.iter().map(|part| part.to_string_lossy()).collect();
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    #[test]
    fn a_name_has_slashes_between_its_parts_on_every_system() {
        for parts in [
            &["plan.json"][..],
            &["pieces", "piece-1.stl"],
            &["a", "b c", "ü.3mf"],
        ] {
            let path: PathBuf = parts.iter().collect();
            assert_eq!(with_slashes(&path), parts.join("/"));
        }
    }
}

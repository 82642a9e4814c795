//! Access to the files of a finished kit.

use std::fs;
use std::io::{Cursor, Write};
use std::path::{Component, Path, PathBuf};

use shellock_job::files::with_slashes;
use zip::write::SimpleFileOptions;

use crate::messages::KitFile;
use crate::refusal::Refusal;

/// Lists all files below `folder` by their names within it, sorted, with `/` between folders.
pub fn names(folder: &Path) -> Vec<String> {
    let mut names = Vec::new();
    let mut left = vec![PathBuf::new()];
    while let Some(within) = left.pop() {
        for entry in fs::read_dir(folder.join(&within)).into_iter().flatten().flatten() {
            let name = within.join(entry.file_name());
            match entry.file_type() {
                Ok(kind) if kind.is_dir() => left.push(name),
                Ok(kind) if kind.is_file() => names.push(with_slashes(&name)),
                // Symbolic links may lead out of the kit.
                _ => {}
            }
        }
    }
    names.sort();
    names
}

/// Lists the files with their sizes.
pub fn list(folder: &Path) -> Vec<KitFile> {
    let size = |name: &String| fs::metadata(folder.join(name)).map_or(0, |m| m.len());
    let names = names(folder).into_iter();
    names
        .map(|name| KitFile {
            bytes: size(&name),
            name,
        })
        .collect()
}

/// Resolves `name` to a file within `folder`. Rejects names and links that lead out of it.
pub fn file(folder: &Path, name: &str) -> Result<PathBuf, Refusal> {
    let none = || Refusal::not_found("there is no such file in the kit");
    let is_plain = Path::new(name)
        .components()
        .all(|part| matches!(part, Component::Normal(_)));
    let path = folder.join(name);
    if !is_plain || name.contains('\\') || !path.is_file() {
        return Err(none());
    }
    let inside = folder.canonicalize().and_then(|f| Ok((f, path.canonicalize()?)));
    match inside {
        Ok((folder, path)) if path.starts_with(&folder) => Ok(path),
        _ => Err(none()),
    }
}

/// Content type that a browser is given for a file.
pub fn kind(name: &str) -> &'static str {
    match name.rsplit('.').next() {
        Some("html") => "text/html; charset=utf-8",
        Some("json") => "application/json",
        Some("svg") => "image/svg+xml",
        Some("png") => "image/png",
        Some("pdf") => "application/pdf",
        Some("3mf") => "model/3mf",
        Some("stl") => "model/stl",
        _ => "application/octet-stream",
    }
}

/// Packs the whole kit as a ZIP archive. Deterministic: equal files give equal bytes.
pub fn archive(folder: &Path) -> Result<Vec<u8>, Refusal> {
    let names = names(folder);
    if names.is_empty() {
        return Err(Refusal::not_found("there is no kit yet"));
    }
    pack(folder, &names).map_err(|e| Refusal::unable(format!("the kit could not be packed: {e}")))
}

fn pack(folder: &Path, names: &[String]) -> Result<Vec<u8>, std::io::Error> {
    /// Meshes in 3MF files and pictures are compressed already, so more effort gains little.
    const LEVEL: i64 = 3;
    let options = SimpleFileOptions::default()
        .last_modified_time(zip::DateTime::default())
        .compression_level(Some(LEVEL));
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for name in names {
        archive.start_file(name.as_str(), options)?;
        archive.write_all(&fs::read(folder.join(name))?)?;
    }
    Ok(archive.finish()?.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kit() -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        fs::create_dir_all(dir.path().join("kit/pieces")).unwrap();
        fs::write(dir.path().join("kit/plan.json"), "{}").unwrap();
        fs::write(dir.path().join("kit/pieces/piece-1.stl"), "solid").unwrap();
        fs::write(dir.path().join("secret"), "secret").unwrap();
        dir
    }

    #[test]
    fn files_within_the_kit_are_found_and_no_others() {
        let dir = kit();
        let folder = dir.path().join("kit");
        assert_eq!(names(&folder), ["pieces/piece-1.stl", "plan.json"]);
        assert!(file(&folder, "plan.json").is_ok() && file(&folder, "pieces/piece-1.stl").is_ok());
        for trick in [
            "../secret",
            "pieces/../../secret",
            "/etc/passwd",
            "..\\secret",
            "",
            ".",
            "pieces",
            "no",
            "pieces//../plan.json",
        ] {
            assert!(file(&folder, trick).is_err(), "{trick}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn links_out_of_the_kit_are_not_followed() {
        let dir = kit();
        let folder = dir.path().join("kit");
        std::os::unix::fs::symlink(dir.path().join("secret"), folder.join("link")).unwrap();
        assert!(file(&folder, "link").is_err());
        assert!(!names(&folder).contains(&"link".to_owned()));
    }

    #[test]
    fn an_archive_holds_every_file_and_is_the_same_each_time() {
        let dir = kit();
        let folder = dir.path().join("kit");
        let bytes = archive(&folder).unwrap();
        assert_eq!(bytes, archive(&folder).unwrap());
        let archive = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
        assert_eq!(archive.len(), 2);
        assert!(super::archive(&dir.path().join("none")).is_err());
    }
}

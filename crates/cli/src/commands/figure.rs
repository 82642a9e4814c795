//! `figure`: writes one of the figures that come with the program.

use std::fs;
use std::path::Path;

use shellock_formats::{write_ply, write_stl_binary};
use shellock_job::files::{extension, write};
use shellock_job::{Failure, input};

/// Returns true if both paths have the same name in the same folder.
fn same_file(a: &Path, b: &Path) -> bool {
    let folder = |p: &Path| match p.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => fs::canonicalize(folder).ok(),
        _ => fs::canonicalize(".").ok(),
    };
    a.file_name() == b.file_name() && folder(a) == folder(b)
}

/// Runs `shellock figure` and returns the exit code.
pub fn figure(name: &str, out: &Path, size_mm: f64, labels: Option<&Path>) -> Result<u8, Failure> {
    let (solid, limbs) = input::shellock_figure(name, size_mm)?;
    if labels.is_some() && limbs.iter().all(|limb| *limb == 0) {
        return Err(Failure::Wrong(format!(
            "{name} has no limbs and so no labels; fish and arms have labels"
        )));
    }
    if labels.is_some_and(|labels| same_file(labels, out)) {
        return Err(Failure::Wrong(
            "the figure and its labels need two different files".into(),
        ));
    }
    let bytes = match extension(out).as_str() {
        "stl" => write_stl_binary(solid.mesh()),
        "ply" => write_ply(solid.mesh(), None),
        _ => {
            return Err(Failure::Wrong(format!(
                "{}: choose a name that ends in .stl or .ply",
                out.display()
            )));
        }
    };
    write(out, &bytes)?;
    if let Some(labels) = labels {
        let lines: String = limbs.iter().map(|limb| format!("{limb}\n")).collect();
        write(labels, lines.as_bytes())?;
    }
    println!(
        "{name}, {size_mm} mm, {} triangles, written to {}",
        solid.mesh().triangles.len(),
        out.display()
    );
    Ok(0)
}

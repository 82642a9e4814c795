//! The paper's Table 1 for our own kits: their savings over solid models.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::Value;

use crate::failure::Failure;
use crate::table::markdown;

/// Which kits, and where the table goes.
#[derive(Args)]
pub struct Options {
    /// Folders of kits in which `shellock report` left its savings.json
    #[arg(required = true)]
    kits: Vec<PathBuf>,
    /// Markdown file to write the table to
    #[arg(short, long, value_name = "FILE", default_value = "docs/guide/savings.md")]
    out: PathBuf,
}

const HEAD: [&str; 9] = [
    "model",
    "pieces",
    "wall, mm",
    "material",
    "SLA time",
    "by",
    "FDM time",
    "by",
    "FDM, solid filled",
];

const INTRODUCTION: &str = "# What kits save\n\nOf finished kits, as `shellock report` tells it: material \
     and print time of all pieces over those of the solid model (the paper's Table 1 has 20 to 54 % and \
     23 to 69 %). Made by \
     `cargo xtask savings KIT...`.\n\nPieces lie on plates as in `plates.3mf`, the whole model in its own \
     best pose, both with supports and the same settings. Resin printers with a display take the same time \
     for every layer, so there the height of the plates counts alone; filament printers pay for walls, and \
     for supports. Times by PrusaSlicer are its own estimates: for resin with 0.05 mm layers, a pad and \
     supports, the whole model hollowed to 2 mm; for filament with its own defaults, but two perimeters, 15 \
     % infill, 0.2 mm layers and supports. The last column is over a whole model that is filled to 100 \
     %.\n\n";

/// Writes the table; returns its file.
pub fn run(options: &Options) -> Result<Vec<PathBuf>, Failure> {
    let rows = options
        .kits
        .iter()
        .map(|kit| row(kit))
        .collect::<Result<Vec<_>, _>>()?;
    let text = format!("{INTRODUCTION}{}", markdown(&HEAD, &rows));
    fs::write(&options.out, text).map_err(|source| Failure::File {
        path: options.out.clone(),
        source,
    })?;
    Ok(vec![options.out.clone()])
}

fn row(kit: &Path) -> Result<Vec<String>, Failure> {
    let path = kit.join("savings.json");
    let bytes = fs::read(&path).map_err(|source| Failure::File {
        path: path.clone(),
        source,
    })?;
    let told: Value = serde_json::from_slice(&bytes).map_err(|e| Failure::Table {
        path: path.clone(),
        problem: e.to_string(),
    })?;
    cells(&told).ok_or_else(|| Failure::Table {
        path,
        problem: "a figure is missing; run `shellock report` again".into(),
    })
}

fn cells(told: &Value) -> Option<Vec<String>> {
    let percent = |v: &Value| Some(format!("{:.0} %", 100.0 * v.as_f64()?));
    let mut cells = vec![
        told["model"].as_str()?.to_owned(),
        told["pieces"].as_u64()?.to_string(),
        format!("{:.2}", told["wall_mm"].as_f64()?),
        percent(&told["volume_ratio"])?,
    ];
    for process in ["sla", "fdm"] {
        let time = &told["print_time"][process];
        cells.extend([percent(&time["ratio"])?, time["by"].as_str()?.to_owned()]);
    }
    let filled = &told["print_time"]["fdm"]["filled_ratio"];
    cells.push(if filled.is_null() {
        "–".to_owned()
    } else {
        percent(filled)?
    });
    Some(cells)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_has_a_cell_for_each_word_of_the_head_and_none_where_a_figure_is_missing() {
        let text = r#"{ "model": "cat.obj", "pieces": 9, "wall_mm": 1.604, "volume_ratio": 0.1851,
            "print_time": { "sla": { "ratio": 0.8, "by": "PrusaSlicer" }, "fdm": { "ratio": 1.2, "by": "closed form" } } }"#;
        let told: Value = serde_json::from_str(text).unwrap();
        let row = cells(&told).unwrap();
        assert_eq!(
            row.join("|"),
            "cat.obj|9|1.60|19 %|80 %|PrusaSlicer|120 %|closed form|–"
        );
        assert_eq!(row.len(), HEAD.len());
        assert!(cells(&serde_json::json!({ "model": "cat.obj" })).is_none());
    }
}

//! `printers`: lists the printers that `--printer` knows.

use serde_json::{Value, json};
use shellock_job::printers::shipped;
use shellock_mechanics::Material;
use shellock_print::Printer;
use shellock_print::printer::Pace;

use crate::Session;

/// Runs `shellock printers` and returns the exit code. The user's `own` printers come first.
pub fn printers(session: &Session, own: &[Printer]) -> u8 {
    let is_own = |p: &&Printer| own.iter().any(|o| o.name.eq_ignore_ascii_case(&p.name));
    let known: Vec<&Printer> = own
        .iter()
        .chain(shipped().iter().filter(|p| !is_own(p)))
        .collect();
    if session.is_json {
        let list: Vec<Value> = known.into_iter().map(describe).collect();
        println!("{}", json!({ "status": "done", "printers": list }));
        return 0;
    }
    let rows: Vec<[String; 5]> = known.into_iter().map(row).collect();
    let head = ["--printer", "printer", "bed, mm", "layer, mm", "material"].map(String::from);
    for row in std::iter::once(&head).chain(&rows) {
        println!("{}", line(row, &widths(&head, &rows)));
    }
    0
}

fn row(printer: &Printer) -> [String; 5] {
    let [width, depth, height] = printer.bed_mm;
    [
        printer.name.clone(),
        printer.title.clone(),
        format!("{width} × {depth} × {height}"),
        printer.layer_mm.to_string(),
        material(printer).to_owned(),
    ]
}

/// Name of the printer's material; empty for one that is no preset.
fn material(printer: &Printer) -> &'static str {
    let mut presets = Material::PRESETS.into_iter();
    let found = presets.find(|(_, material)| *material == printer.material);
    found.map_or("", |(name, _)| name)
}

fn widths(head: &[String; 5], rows: &[[String; 5]]) -> [usize; 5] {
    let width = |k: usize| {
        let cells = std::iter::once(head)
            .chain(rows)
            .map(|row| row[k].chars().count());
        cells.max().unwrap_or(0)
    };
    [0, 1, 2, 3, 4].map(width)
}

fn line(row: &[String; 5], widths: &[usize; 5]) -> String {
    let cells = row
        .iter()
        .zip(widths)
        .map(|(cell, width)| format!("{cell:<width$}"));
    cells.collect::<Vec<_>>().join("  ").trim_end().to_owned()
}

fn describe(printer: &Printer) -> Value {
    json!({
        "name": printer.name,
        "title": printer.title,
        "bed": printer.bed_mm,
        "layer": printer.layer_mm,
        "clearance": printer.clearance_mm,
        "key_clearance": printer.key_clearance_mm,
        "tolerance": printer.tolerance_mm,
        "min_wall": printer.min_wall_mm,
        "material": material(printer),
        "fast": printer.pace.map(|pace| pace == Pace::Fast),
    })
}

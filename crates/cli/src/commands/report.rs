//! `report`: says what a finished kit saves over the solid model, in the terms of the paper's Table 1.

use std::path::Path;

use shellock_job::Failure;
use shellock_job::savings::{Savings, savings};

use crate::Session;

/// Runs `shellock report` and returns the exit code.
pub fn report(session: &Session, kit: &Path, model: Option<&Path>, closed_form: bool) -> Result<u8, Failure> {
    let savings = savings(kit, model, closed_form)?;
    if session.is_json {
        let text = serde_json::to_string(&savings).expect("numbers and strings can be written");
        println!("{text}");
    } else {
        print(&savings);
    }
    Ok(0)
}

fn print(savings: &Savings) {
    let wall_mm = savings.wall_mm.unwrap_or_default();
    println!("{} pieces, walls {wall_mm:.2} mm", savings.pieces);
    println!(
        "material    {:5.1} % of the solid model",
        100.0 * savings.volume_ratio
    );
    for (name, time) in &savings.print_time {
        println!(
            "{name}   {:5.1} % of the time and {:.1} % of the material of the whole model {}: {:.1} h and \
             {:.0} g instead of {:.1} h and {:.0} g, by {}",
            100.0 * time.ratio,
            100.0 * time.material_ratio,
            time.solid_as,
            hours(time.pieces_s),
            time.pieces_g,
            hours(time.solid_s),
            time.solid_g,
            time.by
        );
        if let (Some(ratio), Some(seconds)) = (time.filled_ratio, time.filled_solid_s) {
            println!(
                "      {:5.1} % of the {:.1} h that the whole model takes at 100 % infill",
                100.0 * ratio,
                hours(seconds)
            );
        }
        if let Some(note) = &time.note {
            println!("note: {name}: {note}");
        }
    }
}

fn hours(seconds: f64) -> f64 {
    seconds / 3600.0
}

//! `report`: what a kit saves over the solid model, as the paper's Table 1 tells it.
//!
//! Time and material are PrusaSlicer's own estimates where it is installed, else closed forms, with supports and
//! the same settings for both. Pieces are laid on plates anew for either process; the whole model is printed as
//! people print it (filament at 15 % infill, resin hollowed) in the pose that takes the least.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::{Value, json};
use shellock_formats::{NamedObject, write_3mf};
use shellock_geom::{Solid, TriMesh};
use shellock_print::plates::lay_alone;
use shellock_print::time::{Cost, whole_words};
use shellock_print::{Printer, Process};

use crate::Session;
use crate::failure::Failure;
use crate::interrupt::Writing;
use crate::printing::Printing;
use crate::stages::{Kit, model_of, pieces_of, plan_of, write};

/// The file's name within a kit.
const SAVINGS: &str = "savings.json";
/// The slicer's program.
const SLICER: &str = "prusa-slicer";

/// Settings of both technologies, where they are not the slicer's defaults, on a bed that holds everything. The
/// display of the resin printer is coarse: its pixels cost time here and change little.
const ROOMY: &str = "bed_shape = 0x0,1000x0,1000x1000,0x1000\nmax_print_height = 1000\n";
const SLA_SETTINGS: &str = "printer_technology = SLA\nexposure_time = 7.5\ninitial_exposure_time = 35\nfaded_layers = 10\n\
    supports_enable = 1\npad_enable = 1\ndisplay_width = 1000\ndisplay_height = 1000\ndisplay_pixels_x = 1000\n\
    display_pixels_y = 1000\n";
const FDM_SETTINGS: &str = "printer_technology = FFF\nnozzle_diameter = 0.4\nsupport_material = 1\nskirts = 0\nperimeters = 2\n\
    fill_density = 15%\n";
/// The whole model of resin.
const HOLLOWED: &str = "hollowing_enable = 1\nhollowing_min_thickness = 2\n";
/// Instead of 15 %.
const FILLED: &str = "fill_density = 100%\nfill_pattern = rectilinear\n";

/// `shellock report`.
pub fn report(session: &Session, kit: &Path, model: Option<&Path>, closed_form: bool) -> Result<u8, Failure> {
    let plan = plan_of(kit)?;
    let Kit { pieces, .. } = pieces_of(kit, &plan)?;
    let solid = model_of(kit, &plan, model)?;
    let slicer = if closed_form { None } else { Slicer::find()? };
    let mut times = serde_json::Map::new();
    for printer in [Printer::sla(), Printer::fdm()] {
        let bed_mm = plan.printing.as_ref().map_or(printer.bed_mm, |p| p.bed);
        let printer = Printer { bed_mm, ..printer };
        let printing = Printing::of(&printer, pieces.as_slice(), solid.mesh(), &solid);
        let sliced = match &slicer {
            Some(slicer) => slicer.costs(&printer, printing.files(pieces.as_slice()), &solid)?,
            None => None,
        };
        let by = if sliced.is_some() {
            "PrusaSlicer"
        } else {
            "closed form"
        };
        let (cost, whole) = printing.costs();
        let Costs {
            pieces,
            whole,
            filled,
        } = sliced.unwrap_or(Costs {
            pieces: cost,
            whole: whole.unwrap_or_default(),
            filled: None,
        });
        let over = |whole: f64, ours: f64| ours / whole.max(f64::MIN_POSITIVE);
        let filled_s = filled.map(|f| f.seconds);
        let told = json!({ "by": by, "pieces_s": pieces.seconds, "solid_s": whole.seconds,
            "ratio": over(whole.seconds, pieces.seconds), "pieces_g": pieces.grams, "solid_g": whole.grams,
            "material_ratio": over(whole.grams, pieces.grams), "solid_as": whole_words(printer.process),
            "filled_solid_s": filled_s, "filled_ratio": filled_s.map(|s| over(s, pieces.seconds)) });
        times.insert(printer.name, told);
    }
    let volume: f64 = pieces.as_slice().iter().map(TriMesh::signed_volume).sum();
    let told = json!({
        "model": plan.input.as_ref().map(|input| &input.file), "pieces": pieces.len(), "wall_mm": plan.shell_thickness,
        "volume_ratio": volume / solid.volume(), "print_time": times,
    });
    let mut text = serde_json::to_string_pretty(&told).expect("numbers and strings can be written");
    text.push('\n');
    write(&kit.join(SAVINGS), text.as_bytes())?;
    if session.is_json {
        println!("{told}")
    } else {
        print(&told)
    }
    Ok(0)
}

fn print(told: &Value) {
    let percent = |v: &Value| 100.0 * v.as_f64().unwrap_or_default();
    let hours = |v: &Value| v.as_f64().unwrap_or_default() / 3600.0;
    let wall_mm = told["wall_mm"].as_f64().unwrap_or_default();
    println!("{} pieces, walls {wall_mm:.2} mm", told["pieces"]);
    println!(
        "material    {:5.1} % of the solid model's",
        percent(&told["volume_ratio"])
    );
    for (name, time) in told["print_time"].as_object().into_iter().flatten() {
        println!(
            "{name}   {:5.1} % of the time and {:.1} % of the material of the whole model {}: {:.1} h and {:.0} g instead of \
             {:.1} h and {:.0} g, by {}",
            percent(&time["ratio"]),
            percent(&time["material_ratio"]),
            time["solid_as"].as_str().unwrap_or_default(),
            hours(&time["pieces_s"]),
            time["pieces_g"].as_f64().unwrap_or_default(),
            hours(&time["solid_s"]),
            time["solid_g"].as_f64().unwrap_or_default(),
            time["by"].as_str().unwrap_or_default()
        );
        if !time["filled_ratio"].is_null() {
            println!(
                "      {:5.1} % of {:.1} h where the whole model is filled to 100 %",
                percent(&time["filled_ratio"]),
                hours(&time["filled_solid_s"])
            );
        }
    }
}

/// By the slicer.
struct Costs {
    /// All plates.
    pieces: Cost,
    /// The whole model as people print it.
    whole: Cost,
    /// The whole model, filled, where that is another.
    filled: Option<Cost>,
}

/// PrusaSlicer, and a folder for its files.
struct Slicer {
    folder: tempfile::TempDir,
    /// Until the folder is gone.
    _writing: Writing,
}

impl Slicer {
    /// The slicer, where it is installed.
    fn find() -> Result<Option<Self>, Failure> {
        let runs = Command::new(SLICER)
            .arg("--help")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        if !runs.is_ok_and(|status| status.success()) {
            return Ok(None);
        }
        let _writing = Writing::begin();
        let folder = tempfile::tempdir().map_err(Failure::unwritable(&std::env::temp_dir()))?;
        Ok(Some(Self { folder, _writing }))
    }

    /// All plates among `files`, and the solid; `None` where the slicer refuses something.
    fn costs(
        &self,
        printer: &Printer,
        files: Vec<(String, Vec<u8>)>,
        solid: &Solid,
    ) -> Result<Option<Costs>, Failure> {
        let Some(laid) = lay_alone(printer, solid.mesh()) else {
            return Ok(None);
        };
        let object = NamedObject {
            name: "solid",
            color: [200; 3],
            mesh: solid.mesh(),
            turned: Some(laid.turned),
            moved_mm: laid.moved_mm,
        };
        let is_single = files.len() == 1;
        let plates = files
            .into_iter()
            .filter(|(name, _)| is_single || name.starts_with("plates/"))
            .map(|(_, bytes)| bytes);
        let mut pieces = Cost::default();
        for bytes in plates {
            let Some(plate) = self.cost_of(printer, &bytes, "")? else {
                return Ok(None);
            };
            pieces = pieces.and(plate);
        }
        let model = write_3mf(&[object]);
        let is_filament = printer.process == Process::Fdm;
        let Some(whole) = self.cost_of(printer, &model, if is_filament { "" } else { HOLLOWED })? else {
            return Ok(None);
        };
        let filled = if is_filament {
            self.cost_of(printer, &model, FILLED)?
        } else {
            None
        };
        Ok(Some(Costs {
            pieces,
            whole,
            filled,
        }))
    }

    /// What a 3MF file holds; `more` settings stand last.
    fn cost_of(&self, printer: &Printer, bytes: &[u8], more: &str) -> Result<Option<Cost>, Failure> {
        let [model, settings, out] =
            ["job.3mf", "job.ini", "job.out"].map(|name| self.folder.path().join(name));
        let (text, export) = match printer.process {
            Process::Fdm => (FDM_SETTINGS, "--export-gcode"),
            Process::Sla | Process::Sls => (SLA_SETTINGS, "--export-sla"),
        };
        let first = if printer.process == Process::Fdm {
            "first_layer_height"
        } else {
            "initial_layer_height"
        };
        let layer = printer.layer_mm;
        let text = format!("{text}{ROOMY}layer_height = {layer}\n{first} = {layer}\n{more}");
        for (path, bytes) in [(&model, bytes), (&settings, text.as_bytes())] {
            fs::write(path, bytes).map_err(Failure::unwritable(path))?;
        }
        let mut command = Command::new(SLICER);
        command
            .arg("--load")
            .arg(&settings)
            .arg(export)
            .arg("--dont-arrange")
            .arg("-o")
            .arg(&out)
            .arg(&model);
        let done = command.stdout(Stdio::null()).stderr(Stdio::null()).status();
        if !done.is_ok_and(|status| status.success()) {
            return Ok(None);
        }
        Ok(told_cost(&out, printer))
    }
}

/// The time and the material that the slicer wrote into its result.
fn told_cost(out: &PathBuf, printer: &Printer) -> Option<Cost> {
    let grams = |cm3: f64| cm3 * printer.material.density_g_cm3;
    match printer.process {
        Process::Fdm => {
            let code = fs::read_to_string(out).ok()?;
            let told = |name: &str| Some(code.lines().find(|l| l.contains(name))?.split_once('=')?.1);
            Some(Cost {
                seconds: seconds_in(told("estimated printing time (normal mode)")?),
                grams: grams(told("filament used [cm3]")?.trim().parse().ok()?),
            })
        }
        Process::Sla | Process::Sls => {
            let archive = Command::new("unzip")
                .arg("-p")
                .arg(out)
                .arg("config.ini")
                .output()
                .ok()?;
            let text = String::from_utf8_lossy(&archive.stdout).into_owned();
            let told = |name: &str| {
                let line = text.lines().find(|l| l.starts_with(name))?;
                line.split_once('=')?.1.trim().parse().ok()
            };
            Some(Cost {
                seconds: told("printTime")?,
                grams: grams(told("usedMaterial")?),
            })
        }
    }
}

/// "1d 2h 3m 4s" in seconds.
fn seconds_in(text: &str) -> f64 {
    let unit = |word: &str| {
        let (number, unit) = word.split_at_checked(word.len().checked_sub(1)?)?;
        let factor = match unit {
            "d" => 86_400.0,
            "h" => 3600.0,
            "m" => 60.0,
            "s" => 1.0,
            _ => return None,
        };
        Some(number.parse::<f64>().ok()? * factor)
    };
    text.split_whitespace().filter_map(unit).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slicers_way_to_tell_time_is_read() {
        assert_eq!(seconds_in(" 1d 2h 3m 4s"), 93_784.0);
        assert_eq!(seconds_in(" 15m 30s "), 930.0);
        assert_eq!(seconds_in(""), 0.0);
    }
}

//! Savings of a kit over the solid model, in the terms of the paper's Table 1.
//!
//! Time and material are PrusaSlicer's own estimates if it is installed, else closed forms; both include
//! supports and use the same settings for kit and model. If PrusaSlicer is installed but gives no estimate,
//! `note` says why. Pieces are laid on plates anew for each process. The whole model is printed as people
//! print it (filament at 15 % infill, resin hollowed), in the cheapest pose.

use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};

use serde::Serialize;
use shellock_formats::{NamedObject, write_3mf};
use shellock_geom::{Solid, TriMesh};
use shellock_print::plates::lay_alone;
use shellock_print::time::{Cost, whole_words};
use shellock_print::{Printer, Process};

use crate::failure::Failure;
use crate::files::{Writing, write};
use crate::kits::{KitOnDisk, broken, model_of, pieces_of, plan_of};
use crate::printing::Printing;

/// Name of the file within a kit.
const SAVINGS: &str = "savings.json";
/// Name of the slicer's program.
const SLICER: &str = "prusa-slicer";
/// Size limit of the `config.ini` read from a resin printer's archive, bytes. It is a list of short entries;
/// the limit guards against broken archives.
const MOST_CONFIG_BYTES: u64 = 1 << 20;

/// Settings for both technologies that differ from the slicer's defaults, on a bed that holds everything. The
/// resin printer's display is coarse: its pixels cost time here and change little.
const ROOMY: &str = "bed_shape = 0x0,1000x0,1000x1000,0x1000\nmax_print_height = 1000\n";
const SLA_SETTINGS: &str = "printer_technology = SLA\nexposure_time = 7.5\ninitial_exposure_time = \
                            35\nfaded_layers = 10\nsupports_enable = 1\npad_enable = 1\ndisplay_width = \
                            1000\ndisplay_height = 1000\ndisplay_pixels_x = 1000\ndisplay_pixels_y = 1000\n";
const FDM_SETTINGS: &str = "printer_technology = FFF\nnozzle_diameter = 0.4\nsupport_material = 1\nskirts = \
                            0\nperimeters = 2\nfill_density = 15%\n";
/// Further settings for the whole model in resin.
const HOLLOWED: &str = "hollowing_enable = 1\nhollowing_min_thickness = 2\n";
/// Further settings for a filled model: 100 % infill instead of 15 %.
const FILLED: &str = "fill_density = 100%\nfill_pattern = rectilinear\n";

/// Savings of a kit, as written to its `savings.json`.
#[derive(Clone, Debug, Serialize)]
pub struct Savings {
    /// Name of the model's file.
    pub model: Option<String>,
    /// Number of pieces of the kit.
    pub pieces: usize,
    /// Time and material by the name of the printer.
    pub print_time: BTreeMap<String, SavedTime>,
    /// Volume of the pieces over that of the solid model.
    pub volume_ratio: f64,
    /// Thickness of the walls, mm.
    pub wall_mm: Option<f64>,
}

/// Time and material of the pieces and of the whole model, for one process.
#[derive(Clone, Debug, Serialize)]
pub struct SavedTime {
    /// Source of the figures.
    pub by: &'static str,
    /// Time of the pieces over that of the filled model.
    pub filled_ratio: Option<f64>,
    /// Time of the whole model with 100 % infill, s.
    pub filled_solid_s: Option<f64>,
    /// Material of the pieces over that of the whole model.
    pub material_ratio: f64,
    /// Reason why figures of the slicer are missing although it is installed.
    pub note: Option<String>,
    /// Material of the pieces, g.
    pub pieces_g: f64,
    /// Time of the pieces, s.
    pub pieces_s: f64,
    /// Time of the pieces over that of the whole model.
    pub ratio: f64,
    /// Way in which the whole model is printed, in words.
    pub solid_as: &'static str,
    /// Material of the whole model, g.
    pub solid_g: f64,
    /// Time of the whole model, s.
    pub solid_s: f64,
}

/// Computes the savings of the kit in the folder `kit`, and writes them there. The time is by closed forms
/// if `closed_form`, even where a slicer is installed.
pub fn savings(kit: &Path, model: Option<&Path>, closed_form: bool) -> Result<Savings, Failure> {
    let plan = plan_of(kit)?;
    let wall_mm = plan.thickness_mm().map_err(broken(kit))?;
    let KitOnDisk { pieces, .. } = pieces_of(kit, &plan)?;
    let solid = model_of(kit, &plan, model)?;
    let slicer = if closed_form { None } else { Slicer::find()? };
    let mut print_time = BTreeMap::new();
    for printer in [Printer::sla(), Printer::fdm()] {
        let bed_mm = plan.printing.as_ref().map_or(printer.bed_mm, |p| p.bed);
        let printer = Printer { bed_mm, ..printer };
        let printing = Printing::of(&printer, wall_mm, pieces.as_slice(), solid.mesh(), &solid);
        let sliced = slicer
            .as_ref()
            .map(|slicer| slicer.costs(&printer, printing.files(pieces.as_slice()), &solid));
        let costs = match sliced {
            Some(Ok(costs)) => costs,
            Some(Err(NoEstimate::Failed(failure))) => return Err(failure),
            Some(Err(NoEstimate::Because(why))) => Costs::closed_form(&printing, Some(why)),
            None => Costs::closed_form(&printing, None),
        };
        print_time.insert(printer.name, costs.entry(printer.process));
    }
    let volume: f64 = pieces.as_slice().iter().map(TriMesh::signed_volume).sum();
    let savings = Savings {
        model: plan.input.as_ref().map(|input| input.file.clone()),
        pieces: pieces.len(),
        print_time,
        volume_ratio: volume / solid.volume(),
        wall_mm: plan.shell_thickness,
    };
    let mut text = serde_json::to_string_pretty(&savings).expect("numbers and strings can be written");
    text.push('\n');
    write(&kit.join(SAVINGS), text.as_bytes())?;
    Ok(savings)
}

/// Costs of a kit and of its model.
struct Costs {
    /// Name of the source of the figures.
    by: &'static str,
    /// Cost of all plates.
    pieces: Cost,
    /// Cost of the whole model as people print it.
    whole: Cost,
    /// Cost of the whole model with 100 % infill, for filament.
    full_infill: Option<Cost>,
    /// Reason why figures of the slicer are missing although it is installed.
    note: Option<String>,
}

impl Costs {
    fn closed_form(printing: &Printing, note: Option<String>) -> Self {
        let (pieces, whole) = printing.costs();
        Self {
            by: "closed form",
            pieces,
            whole: whole.unwrap_or_default(),
            full_infill: None,
            note,
        }
    }

    /// Entry of `savings.json` for one process.
    fn entry(self, process: Process) -> SavedTime {
        let Self {
            by,
            pieces,
            whole,
            full_infill,
            note,
        } = self;
        let over = |whole: f64, ours: f64| ours / whole.max(f64::MIN_POSITIVE);
        let filled_s = full_infill.map(|filled| filled.seconds);
        SavedTime {
            by,
            filled_ratio: filled_s.map(|s| over(s, pieces.seconds)),
            filled_solid_s: filled_s,
            material_ratio: over(whole.grams, pieces.grams),
            note,
            pieces_g: pieces.grams,
            pieces_s: pieces.seconds,
            ratio: over(whole.seconds, pieces.seconds),
            solid_as: whole_words(process),
            solid_g: whole.grams,
            solid_s: whole.seconds,
        }
    }
}

/// Reason why there is no estimate from the slicer.
#[derive(Debug)]
enum NoEstimate {
    /// The slicer refuses the model, or its answer cannot be read.
    Because(String),
    /// A file could not be written.
    Failed(Failure),
}

impl From<Failure> for NoEstimate {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}

/// PrusaSlicer, and a temporary folder for its files.
struct Slicer {
    folder: tempfile::TempDir,
    /// Keeps the program running until the folder is deleted.
    _guard: Writing,
}

impl Slicer {
    /// Returns the slicer, or `None` if it is not installed.
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
        Ok(Some(Self {
            folder,
            _guard: _writing,
        }))
    }

    /// Estimates the cost of all plates among `files`, and of the solid model.
    fn costs(
        &self,
        printer: &Printer,
        files: Vec<(String, Vec<u8>)>,
        solid: &Solid,
    ) -> Result<Costs, NoEstimate> {
        const WHOLE: &str = "the whole model";
        let laid = lay_alone(printer, solid.mesh());
        let laid =
            laid.ok_or_else(|| NoEstimate::Because(format!("no orientation to print {WHOLE} in was found")))?;
        let object = NamedObject {
            name: "solid",
            color: [200; 3],
            mesh: solid.mesh(),
            rotation: Some(laid.axes),
            moved_mm: laid.moved_mm,
            settings: &[],
        };
        let is_single = files.len() == 1;
        let is_plate = |name: &str| is_single || name.starts_with("plates/");
        let mut pieces = Cost::default();
        for (name, bytes) in files.iter().filter(|(name, _)| is_plate(name)) {
            pieces = pieces.and(self.cost_of(printer, name, bytes, "")?);
        }
        let model = write_3mf(&[object]);
        let is_filament = printer.process == Process::Fdm;
        let whole = self.cost_of(printer, WHOLE, &model, if is_filament { "" } else { HOLLOWED })?;
        let filled = is_filament.then(|| self.cost_of(printer, WHOLE, &model, FILLED));
        let (filled, note) = match filled {
            Some(Ok(cost)) => (Some(cost), None),
            Some(Err(NoEstimate::Because(why))) => (None, Some(format!("at 100 % infill: {why}"))),
            Some(Err(failed)) => return Err(failed),
            None => (None, None),
        };
        Ok(Costs {
            by: "PrusaSlicer",
            pieces,
            whole,
            full_infill: filled,
            note,
        })
    }

    /// Estimates the cost of the 3MF file `bytes`, called `name` in messages; `more` settings override the
    /// others.
    fn cost_of(&self, printer: &Printer, name: &str, bytes: &[u8], more: &str) -> Result<Cost, NoEstimate> {
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
        let done = done.map_err(|e| NoEstimate::Because(format!("PrusaSlicer could not be started: {e}")))?;
        if !done.success() {
            return Err(NoEstimate::Because(format!(
                "PrusaSlicer failed to slice {name} ({done})"
            )));
        }
        estimate(&out, printer).map_err(|why| {
            NoEstimate::Because(format!(
                "PrusaSlicer's estimate for {name} could not be read: {why}"
            ))
        })
    }
}

/// Reads time and material from the slicer's result, the file `out`; fails with the reason.
fn estimate(out: &Path, printer: &Printer) -> Result<Cost, String> {
    let (seconds, cm3) = match printer.process {
        Process::Fdm => {
            let code = fs::read(out).map_err(|e| e.to_string())?;
            filament_estimate(&String::from_utf8_lossy(&code))?
        }
        Process::Sla | Process::Sls => resin_estimate(&config_of(out)?)?,
    };
    Ok(Cost {
        seconds,
        grams: cm3 * printer.material.density_g_cm3,
    })
}

/// Reads seconds and cm³ from the comments of G-code.
fn filament_estimate(code: &str) -> Result<(f64, f64), String> {
    let value = |name: &str| {
        let line = code
            .lines()
            .find(|line| line.starts_with(';') && line.contains(name));
        let value = line
            .and_then(|line| line.split_once('='))
            .map(|(_, value)| value.trim());
        value.ok_or_else(|| format!("there is no \"{name}\""))
    };
    let time = value("estimated printing time (normal mode)")?;
    let seconds = seconds_in(time).ok_or_else(|| format!("\"{time}\" is not a time"))?;
    Ok((seconds, number(value("filament used [cm3]")?)?))
}

/// Reads seconds and cm³ from the `config.ini` of a resin printer's archive.
fn resin_estimate(config: &str) -> Result<(f64, f64), String> {
    let value = |name: &str| {
        let entries = config.lines().filter_map(|line| line.split_once('='));
        let mut values = entries
            .filter(|(key, _)| key.trim() == name)
            .map(|(_, value)| value);
        values.next().ok_or_else(|| format!("there is no \"{name}\""))
    };
    Ok((number(value("printTime")?)?, number(value("usedMaterial")?)?))
}

fn number(text: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|x: &f64| x.is_finite());
    number.ok_or_else(|| format!("\"{}\" is not a number", text.trim()))
}

/// Reads the `config.ini` of the archive `out`.
fn config_of(out: &Path) -> Result<String, String> {
    const CONFIG: &str = "config.ini";
    let file = fs::File::open(out).map_err(|e| e.to_string())?;
    let mut archive = zip::ZipArchive::new(file).map_err(|e| e.to_string())?;
    let config = archive.by_name(CONFIG).map_err(|e| format!("{CONFIG}: {e}"))?;
    let mut text = Vec::new();
    config
        .take(MOST_CONFIG_BYTES)
        .read_to_end(&mut text)
        .map_err(|e| format!("{CONFIG}: {e}"))?;
    Ok(String::from_utf8_lossy(&text).into_owned())
}

/// Parses a time such as "1d 2h 3m 4s" into seconds; `None` for any other text.
fn seconds_in(text: &str) -> Option<f64> {
    let seconds = |word: &str| {
        let (number, unit) = word.split_at_checked(word.len().checked_sub(1)?)?;
        let factor = match unit {
            "d" => 86_400.0,
            "h" => 3600.0,
            "m" => 60.0,
            "s" => 1.0,
            _ => return None,
        };
        Some(f64::from(number.parse::<u32>().ok()?) * factor)
    };
    let words: Option<Vec<f64>> = text.split_whitespace().map(seconds).collect();
    words
        .filter(|words| !words.is_empty())
        .map(|words| words.iter().sum())
}

#[cfg(test)]
mod tests {
    use std::io::{Cursor, Write as _};

    use super::*;

    #[test]
    fn the_slicers_way_to_tell_time_is_read() {
        assert_eq!(seconds_in(" 1d 2h 3m 4s"), Some(93_784.0));
        assert_eq!(seconds_in(" 15m 30s "), Some(930.0));
        for wrong in ["", "soon", "4", "3x", "1h soon", "-3s"] {
            assert_eq!(seconds_in(wrong), None, "{wrong}");
        }
    }

    /// Reads seconds and cm³ from a slicer's result with these bytes.
    fn read_estimate(printer: &Printer, bytes: &[u8]) -> Result<(f64, f64), String> {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("job.out");
        fs::write(&out, bytes).unwrap();
        let cost = estimate(&out, printer)?;
        Ok((cost.seconds, cost.grams / printer.material.density_g_cm3))
    }

    fn archive(file: &str, text: &str) -> Vec<u8> {
        let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
        archive
            .start_file(file, zip::write::SimpleFileOptions::default())
            .unwrap();
        archive.write_all(text.as_bytes()).unwrap();
        archive.finish().unwrap().into_inner()
    }

    #[test]
    fn the_slicers_archive_for_resin_is_read_or_it_is_said_why_not() {
        let read = |bytes: &[u8]| read_estimate(&Printer::sla(), bytes);
        let of = |config: &str| read(&archive("config.ini", config));
        let (seconds, cm3) = of("action = print\nprintTime = 4183.5\nusedMaterial = 12.5\n").unwrap();
        assert!(seconds == 4183.5 && (cm3 - 12.5).abs() < 1e-9);
        let says = |read: Result<_, String>, word: &str| {
            let why = read.unwrap_err();
            assert!(why.contains(word), "{why}");
        };
        says(of("printTime = 4183.5\n"), "no \"usedMaterial\"");
        says(of("printTimes = 1\nusedMaterial = 12.5\n"), "no \"printTime\"");
        says(
            of("printTime = nan\nusedMaterial = 12.5\n"),
            "\"nan\" is not a number",
        );
        says(read(&archive("other.ini", "printTime = 1")), "config.ini");
        says(read(b"no archive"), "rchive");
    }

    #[test]
    fn the_slicers_code_for_filament_is_read_or_it_is_said_why_not() {
        let read = |code: &str| read_estimate(&Printer::fdm(), code.as_bytes());
        let used = "; filament used [cm3] = 12.5\n";
        let time = "; estimated printing time (normal mode) = 1h 2m 3s\n";
        let (seconds, cm3) = read(&format!("G1 X0\n{used}{time}")).unwrap();
        assert!(seconds == 3723.0 && (cm3 - 12.5).abs() < 1e-9);
        assert!(read(used).unwrap_err().contains("no \"estimated printing time"));
        assert!(read(time).unwrap_err().contains("no \"filament used [cm3]\""));
        let soon = time.replace("1h 2m 3s", "soon");
        assert!(
            read(&format!("{used}{soon}"))
                .unwrap_err()
                .contains("\"soon\" is not a time")
        );
    }
}

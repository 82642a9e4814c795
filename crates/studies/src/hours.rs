//! Accuracy of the closed forms for filament prints against PrusaSlicer's estimates, and the coefficients
//! that fit best.
//!
//! Kits are compared plate by plate, and so are their whole models. With `--pieces` every piece is sliced
//! alone in two poses, with supports, and the coefficients of `print::time` are found by least squares.
//! `--profile` names files of settings, such as those of a vendor, in PrusaSlicer's own form.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use clap::Args;
use serde_json::Value;
use shellock_formats::{NamedObject, read_mesh, write_3mf};
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::weld::weld;
use shellock_geom::{TriMesh, Vec3};
use shellock_print::Printer;
use shellock_print::load::Load;
use shellock_print::plates::{Laid, Plates, Printable, Skin, lay, lay_alone};
use shellock_print::slicing::Slicing;
use shellock_print::time::{Cost, PLASTIC_FEATURES, TIME_FEATURES, plastic_features, time_features};

use crate::failure::Failure;
use crate::sheet::write_all;
use crate::table::markdown;

/// Settings of every print; the bed holds everything.
const SETTINGS: [(&str, &str); 8] = [
    ("printer_technology", "FFF"),
    ("nozzle_diameter", "0.4"),
    ("skirts", "0"),
    ("fill_density", "15%"),
    ("layer_height", "0.2"),
    ("first_layer_height", "0.2"),
    ("bed_shape", "0x0,1000x0,1000x1000,0x1000"),
    ("max_print_height", "1000"),
];
/// Setting of every print without a profile.
const WITHOUT_PROFILE: (&str, &str) = ("perimeters", "2");
/// Settings of pieces that are sliced alone: the slicer would wait for their small layers to cool, which it
/// need not on a full plate.
const ALONE: (&str, &str) = ("cooling", "0");

/// Which kits, and what of them.
#[derive(Args)]
pub struct HoursOptions {
    /// Folders of finished kits to slice
    #[arg(required = true)]
    kits: Vec<PathBuf>,
    /// Slice the pieces alone and find coefficients, instead of comparing kits
    #[arg(long)]
    pieces: bool,
    /// Settings of a printer, in PrusaSlicer's form; its defaults with two perimeters otherwise. Several may
    /// be given with --pieces
    #[arg(long, value_name = "FILE")]
    profile: Vec<PathBuf>,
    /// Compare with the estimate for fast printers
    #[arg(long)]
    fast: bool,
}

/// Writes the table; returns the file.
pub fn run(options: &HoursOptions, out: &Path) -> Result<Vec<PathBuf>, Failure> {
    let folder = out.join("hours");
    fs::create_dir_all(&folder).map_err(|source| Failure::File {
        path: folder.clone(),
        source,
    })?;
    let own: Vec<Option<&PathBuf>> = options.profile.iter().map(Some).collect();
    let profiles = if own.is_empty() { vec![None] } else { own };
    let slicer = |(i, profile)| {
        Ok(Slicer {
            folder: folder.clone(),
            number: i + 1,
            settings: settings(profile, options.pieces)?,
        })
    };
    let slicers: Vec<Slicer> = profiles
        .into_iter()
        .enumerate()
        .map(slicer)
        .collect::<Result<_, Failure>>()?;
    let text = if options.pieces {
        coefficients(&slicers, &options.kits)?
    } else {
        kits(&slicers[0], &options.kits, options.fast)?
    };
    print!("{text}");
    let name = if options.pieces { "pieces.md" } else { "kits.md" };
    write_all(out, "hours", &[(name.to_owned(), text)])
}

/// Settings of the slicer from a profile, without the one that says whether there are supports.
fn settings(profile: Option<&PathBuf>, is_alone: bool) -> Result<BTreeMap<String, String>, Failure> {
    let own = |(key, value): (&str, &str)| (key.trim().to_owned(), value.trim().to_owned());
    let mut all = BTreeMap::from([WITHOUT_PROFILE].map(own));
    if let Some(path) = profile {
        let text = fs::read_to_string(path).map_err(|source| Failure::File {
            path: path.clone(),
            source,
        })?;
        all = text
            .lines()
            .filter_map(|line| line.split_once('='))
            .map(own)
            .collect();
    }
    all.extend(SETTINGS.into_iter().chain(is_alone.then_some(ALONE)).map(own));
    all.remove("support_material");
    Ok(all)
}

/// Pieces of a kit, and its whole model.
struct Kit {
    pieces: Vec<TriMesh>,
    whole: TriMesh,
    /// Thickness of the walls, mm.
    wall_mm: f64,
}

impl Kit {
    fn lay(&self, printer: &Printer) -> Plates {
        let skin = TriangleBvh::new(&self.whole);
        let printable = |mesh| Printable {
            mesh,
            simple: mesh,
            skin: Skin::On(&skin),
        };
        let printables: Vec<Printable<'_>> = self.pieces.iter().map(printable).collect();
        lay(printer, Slicing::of_pieces(printer, self.wall_mm), &printables)
    }

    fn read(folder: &Path) -> Result<Self, Failure> {
        let file = |path: PathBuf| {
            let bytes = fs::read(&path).map_err(|source| Failure::File {
                path: path.clone(),
                source,
            })?;
            let extension = path.extension().and_then(|e| e.to_str());
            let loaded = read_mesh(&bytes, extension).map_err(|e| Failure::Model {
                path: path.clone(),
                problem: e.to_string(),
            })?;
            // Slicers need triangles that share their points.
            Ok(weld(&loaded.mesh).mesh)
        };
        let pieces = folder.join("pieces");
        let fault = |source| Failure::File {
            path: pieces.clone(),
            source,
        };
        let mut names: Vec<PathBuf> = fs::read_dir(&pieces)
            .map_err(fault)?
            .flatten()
            .map(|entry| entry.path())
            .collect();
        names.sort();
        Ok(Self {
            pieces: names.into_iter().map(file).collect::<Result<_, _>>()?,
            whole: file(folder.join("segmentation.ply"))?,
            wall_mm: wall_of(folder)?,
        })
    }
}

/// Thickness of the walls that a kit's plan names, mm.
fn wall_of(folder: &Path) -> Result<f64, Failure> {
    let path = folder.join("plan.json");
    let bytes = fs::read(&path).map_err(|source| Failure::File {
        path: path.clone(),
        source,
    })?;
    let plan: Value = serde_json::from_slice(&bytes).unwrap_or_default();
    plan["shell_thickness"].as_f64().ok_or_else(|| Failure::Model {
        path,
        problem: "it names no wall".into(),
    })
}

/// One row for each kit: estimate and slicer, and the slicer's ratio of the kit to its whole model.
fn kits(slicer: &Slicer, folders: &[PathBuf], is_fast: bool) -> Result<String, Failure> {
    let printer = Printer::fdm();
    let estimate = |load: &Load| match Cost::of_fast(&printer, load) {
        Some(cost) if is_fast => cost,
        _ => Cost::of(&printer, load),
    };
    let mut rows = Vec::new();
    for folder in folders {
        let kit = Kit::read(folder)?;
        let settings = Slicing::of_pieces(&printer, kit.wall_mm).settings();
        let plates = kit.lay(&printer);
        let (mut told, mut ours) = (Cost::default(), Cost::default());
        for plate in 0..plates.n_plates {
            let laid: Vec<&Laid> = plates.poses.iter().filter(|l| l.plate == plate).collect();
            let objects = laid
                .iter()
                .map(|l| object(&kit.pieces[l.piece], &settings, l.axes, l.moved_mm))
                .collect::<Vec<_>>();
            let load = laid.iter().fold(Load::default(), |sum, l| sum.and(l.load));
            ours = ours.and(estimate(&load));
            told = told.and(slicer.cost(&printer, &objects)?);
        }
        let alone = lay_alone(&printer, &kit.whole).ok_or_else(|| Failure::Model {
            path: folder.clone(),
            problem: "the whole model cannot be laid".into(),
        })?;
        let whole = slicer.cost(&printer, &[object(&kit.whole, &[], alone.axes, alone.moved_mm)])?;
        let marks_mm2: f64 = plates.poses.iter().map(|l| l.outer_support_mm2).sum();
        let row = row(folder, [told, ours, whole, estimate(&alone.load)], marks_mm2);
        eprintln!("{}", row.join(" | "));
        rows.push(row);
    }
    let head = [
        "kit",
        "time, h",
        "estimate",
        "plastic, g",
        "estimate",
        "whole model, h",
        "estimate",
        "whole model, g",
        "estimate",
        "time over whole",
        "plastic over whole",
        "skin with marks, cm²",
    ];
    Ok(markdown(&head, &rows))
}

fn row(folder: &Path, [told, ours, whole, whole_ours]: [Cost; 4], marks_mm2: f64) -> Vec<String> {
    let off = |ours: f64, told: f64| format!("{:+.0} %", 100.0 * (ours / told - 1.0));
    let mut row = vec![
        folder
            .file_name()
            .map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
    ];
    for (told, ours) in [(told, ours), (whole, whole_ours)] {
        row.extend([
            format!("{:.1}", told.seconds / 3600.0),
            off(ours.seconds, told.seconds),
            format!("{:.0}", told.grams),
            off(ours.grams, told.grams),
        ]);
    }
    row.extend([
        format!("{:.0} %", 100.0 * told.seconds / whole.seconds),
        format!("{:.0} %", 100.0 * told.grams / whole.grams),
        format!("{:.1}", marks_mm2 / 100.0),
    ]);
    row
}

fn object<'a>(
    mesh: &'a TriMesh,
    settings: &'a [(&'static str, &'static str)],
    turned: [[f64; 3]; 3],
    moved_mm: [f64; 3],
) -> NamedObject<'a> {
    NamedObject {
        name: "print",
        color: [200; 3],
        mesh,
        rotation: Some(turned),
        moved_mm,
        settings,
    }
}

/// Cost of one print by the slicer, and the amounts that the closed forms use.
struct Sample {
    load: Load,
    told: Cost,
}

/// Fits the coefficients of time and of plastic for each profile, and reports their errors.
fn coefficients(slicers: &[Slicer], folders: &[PathBuf]) -> Result<String, Failure> {
    let printer = Printer::fdm();
    let density = printer.material.density_g_cm3 / 1000.0;
    let mut rows = Vec::new();
    for slicer in slicers {
        let samples = samples(slicer, &printer, folders)?;
        let fitted: Vec<Fitted> = samples
            .iter()
            .map(|s| Fitted {
                amounts: time_features(&s.load, printer.layer_mm).to_vec(),
                total: s.told.seconds,
            })
            .collect();
        rows.push(fit_row(&TIME_FEATURES, &fitted));
        let fitted: Vec<Fitted> = samples
            .iter()
            .map(|s| Fitted {
                amounts: plastic_features(&s.load).to_vec(),
                total: s.told.grams / density,
            })
            .collect();
        rows.push(fit_row(&PLASTIC_FEATURES, &fitted));
    }
    Ok(markdown(
        &["coefficients", "prints", "median error", "90 % within"],
        &rows,
    ))
}

/// Slices all pieces and whole models alone, in two poses: the one on the plate, and a slanted one.
fn samples(slicer: &Slicer, printer: &Printer, folders: &[PathBuf]) -> Result<Vec<Sample>, Failure> {
    let slanted = Vec3::new(0.6, 0.0, 0.8);
    let mut samples = Vec::new();
    for folder in folders {
        let kit = Kit::read(folder)?;
        let slicing = Slicing::of_pieces(printer, kit.wall_mm);
        let laid = kit.lay(printer).poses.into_iter();
        let of_pieces = laid.map(|l| {
            (
                &kit.pieces[l.piece],
                slicing,
                Vec3::from_array(l.axes.map(|image| image[2])),
            )
        });
        let of_whole = lay_alone(printer, &kit.whole)
            .map(|l| (&kit.whole, Slicing::USUAL, l.axes.map(|image| image[2])));
        let poses =
            of_pieces.chain(of_whole.map(|(mesh, slicing, up)| (mesh, slicing, Vec3::from_array(up))));
        for (mesh, slicing, up) in
            poses.flat_map(|(mesh, slicing, up)| [up, slanted].map(|up| (mesh, slicing, up)))
        {
            let settings = slicing.settings();
            let (x, y) = up.any_orthonormal_pair();
            let axes = [x, y, up];
            let turned = [0, 1, 2].map(|axis| axes.map(|row| row[axis]));
            let least = |axis: Vec3| {
                let along = mesh.points.iter().map(|p| p.dot(axis));
                along.fold(f64::INFINITY, f64::min)
            };
            let moved_mm = [100.0 - least(x), 100.0 - least(y), -least(up)];
            // A print that touches the bed in one point only has no first layer, and the slicer refuses it.
            if let Ok(told) = slicer.cost(printer, &[object(mesh, &settings, turned, moved_mm)]) {
                let load = Load::of(mesh, axes, printer, slicing);
                samples.push(Sample { load, told });
            }
        }
    }
    if samples.is_empty() {
        return Err(Failure::Program {
            program: "prusa-slicer".into(),
            problem: "it refuses every piece".into(),
        });
    }
    write_samples(slicer, printer, &samples)?;
    Ok(samples)
}

/// Writes amounts and costs of all samples as a table for other programs.
fn write_samples(slicer: &Slicer, printer: &Printer, samples: &[Sample]) -> Result<(), Failure> {
    let columns = TIME_FEATURES.iter().chain(&PLASTIC_FEATURES);
    let mut text = columns.map(|name| format!("{name},")).collect::<String>() + "s,g\n";
    for s in samples {
        let time = time_features(&s.load, printer.layer_mm);
        let plastic = plastic_features(&s.load);
        for amount in time.iter().chain(&plastic) {
            text += &format!("{amount:.4},");
        }
        text += &format!("{:.1},{:.3}\n", s.told.seconds, s.told.grams);
    }
    let path = slicer.folder.join(format!("samples-{}.csv", slicer.number));
    fs::write(&path, text).map_err(|source| Failure::File { path, source })
}

/// One equation of the fit; errors count as shares of `total`.
struct Fitted {
    amounts: Vec<f64>,
    total: f64,
}

fn fit_row(names: &[&str], fitted: &[Fitted]) -> Vec<String> {
    let prices = least_squares(fitted);
    let mut errors: Vec<f64> = fitted
        .iter()
        .map(|f| (estimate(f, &prices) - f.total).abs() / f.total)
        .collect();
    errors.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let error = errors.get((share * errors.len() as f64) as usize);
        format!("{:.1} %", 100.0 * error.copied().unwrap_or(f64::NAN))
    };
    let told: Vec<String> = names
        .iter()
        .zip(&prices)
        .map(|(name, price)| format!("{name} {price:.4}"))
        .collect();
    vec![told.join(", "), errors.len().to_string(), at(0.5), at(0.9)]
}

fn estimate(fitted: &Fitted, prices: &[f64]) -> f64 {
    fitted
        .amounts
        .iter()
        .zip(prices)
        .map(|(amount, price)| amount * price)
        .sum()
}

/// Non-negative prices with the least sum of squared errors, by coordinate descent.
fn least_squares(fitted: &[Fitted]) -> Vec<f64> {
    /// Number of rounds: prices converge within some hundred.
    const ROUNDS: usize = 20_000;
    let n = fitted.first().map_or(0, |f| f.amounts.len());
    let sum =
        |term: &dyn Fn(&Fitted) -> f64| fitted.iter().map(|f| term(f) / (f.total * f.total)).sum::<f64>();
    let products: Vec<Vec<f64>> = (0..n)
        .map(|i| (0..n).map(|j| sum(&|f| f.amounts[i] * f.amounts[j])).collect())
        .collect();
    let told: Vec<f64> = (0..n).map(|i| sum(&|f| f.amounts[i] * f.total)).collect();
    let mut prices = vec![0.0; n];
    for _ in 0..ROUNDS {
        for i in 0..n {
            let all: f64 = products[i].iter().zip(&prices).map(|(p, price)| p * price).sum();
            if products[i][i] > 0.0 {
                prices[i] = f64::max(0.0, prices[i] + (told[i] - all) / products[i][i]);
            }
        }
    }
    prices
}

/// PrusaSlicer, and a folder for its files.
struct Slicer {
    folder: PathBuf,
    /// Number of the profile, from 1.
    number: usize,
    /// Settings of every print, by their names.
    settings: BTreeMap<String, String>,
}

impl Slicer {
    /// Slices a print with supports and reads the slicer's estimate of its cost.
    fn cost(&self, printer: &Printer, objects: &[NamedObject<'_>]) -> Result<Cost, Failure> {
        let [model, settings, out] = ["job.3mf", "job.ini", "job.gcode"].map(|name| self.folder.join(name));
        let lines = self
            .settings
            .iter()
            .map(|(key, value)| format!("{key} = {value}\n"));
        let text = lines.chain(["support_material = 1\n".into()]).collect::<String>();
        for (path, bytes) in [(&model, write_3mf(objects)), (&settings, text.into_bytes())] {
            fs::write(path, bytes).map_err(|source| Failure::File {
                path: path.clone(),
                source,
            })?;
        }
        let fault = |problem: String| Failure::Program {
            program: "prusa-slicer".into(),
            problem,
        };
        let done = Command::new("prusa-slicer")
            .arg("--load")
            .arg(&settings)
            .args(["--export-gcode", "--dont-arrange", "-o"])
            .arg(&out)
            .arg(&model)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status()
            .map_err(|e| fault(e.to_string()))?;
        if !done.success() {
            return Err(fault("it refuses the print".into()));
        }
        let code = fs::read_to_string(&out).map_err(|source| Failure::File {
            path: out.clone(),
            source,
        })?;
        let told = |name: &str| {
            code.lines()
                .find(|l| l.contains(name))
                .and_then(|l| Some(l.split_once('=')?.1))
        };
        let time = told("estimated printing time (normal mode)").map(seconds_in);
        let cm3 = told("filament used [cm3]").and_then(|text| text.trim().parse::<f64>().ok());
        fs::remove_file(&out).map_err(|source| Failure::File { path: out, source })?;
        match (time, cm3) {
            (Some(seconds), Some(cm3)) => Ok(Cost {
                seconds,
                grams: cm3 * printer.material.density_g_cm3,
            }),
            _ => Err(fault("it tells no time".into())),
        }
    }
}

/// Parses a time such as "1d 2h 3m 4s" into seconds; words that are no time count as 0.
fn seconds_in(text: &str) -> f64 {
    let seconds = |word: &str| {
        let (number, unit) = word.split_at(word.len() - 1);
        let factor = [("d", 86_400.0), ("h", 3600.0), ("m", 60.0), ("s", 1.0)]
            .into_iter()
            .find(|(u, _)| *u == unit)?
            .1;
        Some(number.parse::<f64>().ok()? * factor)
    };
    text.split_whitespace().filter_map(seconds).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn least_squares_find_what_made_the_figures_and_nothing_below_zero() {
        let made = |a: f64, b: f64| Fitted {
            amounts: vec![a, b, a * b],
            total: 2.0 * a + 0.5 * b,
        };
        let fitted = [made(1.0, 2.0), made(3.0, 1.0), made(2.0, 5.0), made(4.0, 4.0)];
        let prices = least_squares(&fitted);
        assert!(
            (prices[0] - 2.0).abs() < 1e-3 && (prices[1] - 0.5).abs() < 1e-3 && prices[2] < 1e-3,
            "{prices:?}"
        );
        let falling = [1.0, 2.0].map(|a| Fitted {
            amounts: vec![a],
            total: -a,
        });
        assert_eq!(least_squares(&falling), [0.0]);
        assert_eq!(seconds_in("1d 1h 1m 1s"), 90_061.0);
    }
}

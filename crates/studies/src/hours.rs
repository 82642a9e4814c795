//! Accuracy of the closed forms for filament prints against PrusaSlicer's estimates, and the coefficients
//! that fit best.
//!
//! Kits are compared plate by plate, and so are their whole models. With `--pieces` every piece is sliced
//! alone in three poses, with and without supports, and the coefficients of `print::time` are found by least
//! squares.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use clap::Args;
use shellock_formats::{NamedObject, read_mesh, write_3mf};
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::weld::weld;
use shellock_geom::{TriMesh, Vec3};
use shellock_print::Printer;
use shellock_print::load::Load;
use shellock_print::plates::{Laid, Printable, Skin, lay, lay_alone};
use shellock_print::time::{Cost, PLASTIC_FEATURES, TIME_FEATURES, plastic_features, time_features};

use crate::failure::Failure;
use crate::sheet::write_all;
use crate::table::markdown;

// Number of a form's features that belong to the piece itself; the rest belong to its supports.
const N_OWN_TIME: usize = 4;
const N_OWN_PLASTIC: usize = 3;
/// Settings that differ from PrusaSlicer's defaults; the bed holds everything.
const SETTINGS: &str = "printer_technology = FFF\nnozzle_diameter = 0.4\nskirts = 0\nperimeters = \
                        2\nfill_density = 15%\nlayer_height = 0.2\nfirst_layer_height = 0.2\nbed_shape = \
                        0x0,1000x0,1000x1000,0x1000\nmax_print_height = 1000\n";

/// Which kits, and what of them.
#[derive(Args)]
pub struct HoursOptions {
    /// Folders of finished kits to slice
    #[arg(required = true)]
    kits: Vec<PathBuf>,
    /// Slice the pieces alone and find coefficients, instead of comparing kits
    #[arg(long)]
    pieces: bool,
}

/// Writes the table; returns the file.
pub fn run(options: &HoursOptions, out: &Path) -> Result<Vec<PathBuf>, Failure> {
    let slicer = Slicer {
        folder: out.join("hours"),
    };
    fs::create_dir_all(&slicer.folder).map_err(|source| Failure::File {
        path: slicer.folder.clone(),
        source,
    })?;
    let text = if options.pieces {
        coefficients(&slicer, &options.kits)?
    } else {
        kits(&slicer, &options.kits)?
    };
    print!("{text}");
    let name = if options.pieces { "pieces.md" } else { "kits.md" };
    write_all(out, "hours", &[(name.to_owned(), text)])
}

/// Pieces of a kit, and its whole model.
struct Kit {
    pieces: Vec<TriMesh>,
    whole: TriMesh,
}

impl Kit {
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
        })
    }
}

/// One row for each kit: estimate and slicer, and the slicer's ratio of the kit to its whole model.
fn kits(slicer: &Slicer, folders: &[PathBuf]) -> Result<String, Failure> {
    let printer = Printer::fdm();
    let mut rows = Vec::new();
    for folder in folders {
        let kit = Kit::read(folder)?;
        let skin = TriangleBvh::new(&kit.whole);
        let printable = |mesh| Printable {
            mesh,
            simple: mesh,
            skin: Skin::On(&skin),
        };
        let printables: Vec<Printable<'_>> = kit.pieces.iter().map(printable).collect();
        let plates = lay(&printer, &printables);
        let (mut told, mut ours) = (Cost::default(), Cost::default());
        for plate in 0..plates.n_plates {
            let laid: Vec<&Laid> = plates.poses.iter().filter(|l| l.plate == plate).collect();
            let objects = laid
                .iter()
                .map(|l| object(&kit.pieces[l.piece], l.axes, l.moved_mm))
                .collect::<Vec<_>>();
            let load = laid.iter().fold(Load::default(), |sum, l| sum.and(l.load));
            ours = ours.and(Cost::of(&printer, &load));
            told = told.and(slicer.cost(&printer, &objects, true)?);
        }
        let alone = lay_alone(&printer, &kit.whole).ok_or_else(|| Failure::Model {
            path: folder.clone(),
            problem: "the whole model cannot be laid".into(),
        })?;
        let whole = slicer.cost(&printer, &[object(&kit.whole, alone.axes, alone.moved_mm)], true)?;
        let marks_mm2: f64 = plates.poses.iter().map(|l| l.outer_support_mm2).sum();
        let row = row(
            folder,
            [told, ours, whole, Cost::of(&printer, &alone.load)],
            marks_mm2,
        );
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

fn object(mesh: &TriMesh, turned: [[f64; 3]; 3], moved_mm: [f64; 3]) -> NamedObject<'_> {
    NamedObject {
        name: "print",
        color: [200; 3],
        mesh,
        rotation: Some(turned),
        moved_mm,
        settings: &[],
    }
}

/// Costs of one print by the slicer, without and with supports, and the amounts that the closed forms use.
struct Sample {
    load: Load,
    without: Cost,
    with: Cost,
}

/// Fits coefficients for the piece itself and for its supports, and reports their errors.
fn coefficients(slicer: &Slicer, folders: &[PathBuf]) -> Result<String, Failure> {
    let printer = Printer::fdm();
    let mut samples = Vec::new();
    for folder in folders {
        let kit = Kit::read(folder)?;
        for mesh in kit.pieces.iter().chain([&kit.whole]) {
            for up in [Vec3::Z, Vec3::new(0.6, 0.0, 0.8), Vec3::new(-0.48, 0.8, -0.36)] {
                let (x, y) = up.any_orthonormal_pair();
                let axes = [x, y, up];
                let turned = [0, 1, 2].map(|axis| axes.map(|row| row[axis]));
                let least = |axis: Vec3| {
                    mesh.points
                        .iter()
                        .map(|p| p.dot(axis))
                        .fold(f64::INFINITY, f64::min)
                };
                let print = [object(
                    mesh,
                    turned,
                    [100.0 - least(x), 100.0 - least(y), -least(up)],
                )];
                // A print that touches the bed in one point only has no first layer, and the slicer refuses
                // it.
                if let (Ok(with), Ok(without)) = (
                    slicer.cost(&printer, &print, true),
                    slicer.cost(&printer, &print, false),
                ) {
                    samples.push(Sample {
                        load: Load::of(mesh, axes, &printer),
                        without,
                        with,
                    });
                }
            }
        }
    }
    let density = printer.material.density_g_cm3 / 1000.0;
    let time = |s: &Sample| time_features(&s.load, printer.layer_mm).to_vec();
    let plastic = |s: &Sample| plastic_features(&s.load).to_vec();
    let (own_time, own_plastic) = (N_OWN_TIME, N_OWN_PLASTIC);
    let mut rows = Vec::new();
    for (names, own, amounts, told) in [
        (
            &TIME_FEATURES[..],
            own_time,
            &time as &dyn Fn(&Sample) -> Vec<f64>,
            &(|c: Cost| c.seconds) as &dyn Fn(Cost) -> f64,
        ),
        (
            &PLASTIC_FEATURES[..],
            own_plastic,
            &plastic,
            &(|c: Cost| c.grams / density),
        ),
    ] {
        for range in [0..own, own..names.len()] {
            let is_own = range.start == 0;
            let fitted: Vec<Fitted> = samples
                .iter()
                .map(|s| {
                    let (with, without) = (told(s.with), told(s.without));
                    let (total, of) = if is_own {
                        (without, without)
                    } else {
                        (with - without, with)
                    };
                    Fitted {
                        amounts: amounts(s)[range.clone()].to_vec(),
                        total,
                        of,
                    }
                })
                .collect();
            rows.push(fit_row(&names[range], &fitted));
        }
    }
    Ok(markdown(
        &["coefficients", "prints", "median error", "90 % within"],
        &rows,
    ))
}

/// One equation of the fit; errors count as shares of `of`.
struct Fitted {
    amounts: Vec<f64>,
    total: f64,
    of: f64,
}

fn fit_row(names: &[&str], fitted: &[Fitted]) -> Vec<String> {
    let prices = least_squares(fitted);
    let mut errors: Vec<f64> = fitted
        .iter()
        .map(|f| (estimate(f, &prices) - f.total).abs() / f.of)
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
    let sum = |term: &dyn Fn(&Fitted) -> f64| fitted.iter().map(|f| term(f) / (f.of * f.of)).sum::<f64>();
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
}

impl Slicer {
    /// Slices a print and reads the slicer's estimate of its cost.
    fn cost(&self, printer: &Printer, objects: &[NamedObject<'_>], supports: bool) -> Result<Cost, Failure> {
        let [model, settings, out] = ["job.3mf", "job.ini", "job.gcode"].map(|name| self.folder.join(name));
        let text = format!("{SETTINGS}support_material = {}\n", u8::from(supports));
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
            of: 1.0,
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
            of: 1.0,
        });
        assert_eq!(least_squares(&falling), [0.0]);
        assert_eq!(seconds_in("1d 1h 1m 1s"), 90_061.0);
    }
}

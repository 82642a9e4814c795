//! `coupon`: makes the fit test of a printer, and saves its result.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use shellock::coupon::{self, Fit, Kind, Part};
use shellock_formats::{NamedObject, write_3mf, write_stl_binary};
use shellock_geom::{TriMesh, Vec3};
use shellock_job::Failure;
use shellock_job::config::{USUAL, printers_of};
use shellock_job::files::write;
use shellock_job::printers::shipped;
use shellock_print::Printer;
use shellock_print::load::{Drawn, Load};
use shellock_print::slicing::Slicing;
use shellock_print::time::seconds_flat;
use shellock_render::palette;
use toml_edit::{DocumentMut, Item, Table, TableLike};

use crate::Session;
use crate::args::CouponOptions;
use crate::progress::Shown;

/// Default name of the plate's file, also within a folder; the mesh has the same name with another ending.
const PLATE: &str = "shellock-coupon.3mf";
/// Margin between the printed parts and the edge of the bed, mm, as on the plates of kits.
const EDGE_MM: f64 = 4.0;

/// Runs `shellock coupon` and returns the exit code.
pub fn coupon(session: &Session, options: &CouponOptions) -> Result<u8, Failure> {
    let printer = options.chosen_printer().map_err(Failure::Wrong)?;
    let fits = coupon::fits(
        printer.clearance_mm,
        printer.key_clearance_mm,
        printer.tolerance_mm,
    );
    if let (Some(number), Some(name)) = (options.fits, &options.save) {
        let path = options.config.clone().unwrap_or_else(|| USUAL.into());
        let fit = fits[number as usize - 1];
        save(&path, &printer, &fit, name)?;
        tell_profile(session, &path, &printer, &fit, name);
        return Ok(0);
    }
    let files = destination(options.out.as_deref(), options.force)?;
    let plate = session
        .job
        .during("making the parts", || Plate::of(&printer, &fits))?;
    if let Some(folder) = files[0].parent() {
        fs::create_dir_all(folder).map_err(Failure::unwritable(folder))?;
    }
    write(&files[0], &plate.archive())?;
    write(&files[1], &write_stl_binary(&plate.whole()))?;
    plate.tell(session, &files);
    Ok(0)
}

/// Returns the paths of the plate and of its mesh; refuses existing files unless `force` is set.
fn destination(out: Option<&Path>, force: bool) -> Result<[PathBuf; 2], Failure> {
    let out = out.unwrap_or(Path::new(PLATE));
    let refuse = |path: &Path, why: &str| Err(Failure::Wrong(format!("{} {why}", path.display())));
    let plate = match out.extension() {
        None => out.join(PLATE),
        Some(_) if out.is_dir() => out.join(PLATE),
        Some(ending) if ending.eq_ignore_ascii_case("3mf") => out.to_owned(),
        Some(_) => {
            return refuse(
                out,
                "is neither a folder nor a name that ends in .3mf; choose another with -o",
            );
        }
    };
    let files = [plate.clone(), plate.with_extension("stl")];
    for file in &files {
        if file.is_dir() {
            return refuse(file, "is a folder; choose another name with -o");
        }
        if file.exists() && !force {
            return refuse(
                file,
                "already exists; choose another name with -o, or --force to replace it",
            );
        }
    }
    Ok(files)
}

/// Parts of a fit test, centred on a printer's bed.
struct Plate<'a> {
    printer: &'a Printer,
    fits: &'a [Fit],
    parts: Vec<Part>,
    size_mm: [f64; 3],
}

impl<'a> Plate<'a> {
    fn of(printer: &'a Printer, fits: &'a [Fit]) -> Result<Self, Failure> {
        let mut parts = coupon::coupon(fits, printer.min_wall_mm)
            .map_err(|reason| Failure::Wrong(format!("the parts could not be made: {reason}")))?;
        let size_mm = coupon::size_mm(&parts);
        let [width, depth, height] = printer.bed_mm;
        let room = [width - 2.0 * EDGE_MM, depth - 2.0 * EDGE_MM, height];
        if size_mm.iter().zip(room).any(|(size, room)| *size > room) {
            return Err(Failure::Wrong(format!(
                "the fit test needs {:.0} × {:.0} × {:.0} mm and a margin of {EDGE_MM} mm, more than the \
                 printer \"{}\" has ({width} × {depth} × {height} mm)",
                size_mm[0].ceil(),
                size_mm[1].ceil(),
                size_mm[2].ceil(),
                printer.name
            )));
        }
        for part in &mut parts {
            part.moved_mm[0] += 0.5 * (width - size_mm[0]);
            part.moved_mm[1] += 0.5 * (depth - size_mm[1]);
        }
        Ok(Self {
            printer,
            fits,
            parts,
            size_mm,
        })
    }

    /// Writes all parts as 3MF objects, each with its name and the colour of its number.
    fn archive(&self) -> Vec<u8> {
        let names: Vec<String> = self.parts.iter().map(object_name).collect();
        let objects: Vec<NamedObject<'_>> = self
            .parts
            .iter()
            .zip(&names)
            .map(|(part, name)| NamedObject {
                name,
                color: palette::color(part.fit.number as usize),
                mesh: &part.mesh,
                rotation: Some(part.axes),
                moved_mm: part.moved_mm,
                settings: &[],
            })
            .collect();
        write_3mf(&objects)
    }

    /// Joins all parts in one mesh.
    fn whole(&self) -> TriMesh {
        let mut whole = TriMesh::default();
        for part in self.parts.iter().map(Part::on_plate) {
            let first = whole.points.len() as u32;
            whole.points.extend(part.points);
            whole
                .triangles
                .extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
        }
        whole
    }

    /// Estimate of the print time, s.
    fn seconds(&self) -> f64 {
        let axes = [Vec3::X, Vec3::Y, Vec3::Z];
        let load = |part: &Part| Load {
            // The parts are laid so that they need no support.
            support_mm3: 0.0,
            drawn: Drawn::default(),
            ..Load::of(&part.on_plate(), axes, self.printer, Slicing::USUAL)
        };
        let all = self.parts.iter().map(load).fold(Load::default(), Load::and);
        seconds_flat(self.printer, &all)
    }

    fn tell(&self, session: &Session, files: &[PathBuf; 2]) {
        let name = &self.printer.name;
        if session.is_json {
            let numbers: Vec<Value> = self.fits.iter().map(describe).collect();
            let value = json!({ "status": "done", "out": files, "printer": name, "parts": self.parts.len(),
                "numbers": numbers, "size": self.size_mm, "print_seconds": self.seconds() });
            println!("{value}");
            return;
        }
        if session.progress_form == Shown::Nothing {
            return;
        }
        let [width, depth, height] = self.size_mm;
        // docs/guide/fit-test.md quotes the figure of a slicer.
        let time = format!("about {:.0} min", self.seconds() / 60.0);
        println!(
            "{}: {} parts, {width:.0} × {depth:.0} × {height:.1} mm; {time} on the printer \"{name}\"",
            files[0].display(),
            self.parts.len()
        );
        println!("{}: the same plate as one mesh", files[1].display());
        println!("number  clearance  on rails  tolerance, mm");
        for fit in self.fits {
            println!(
                "{:6} {:10} {:9} {:10}",
                fit.number, fit.clearance_mm, fit.key_clearance_mm, fit.tolerance_mm
            );
        }
        println!(
            "print it as it lies, without supports. Use the smallest number whose pin and key go in by hand. \
             If that is 2, for example, save it with:\n  shellock coupon --printer {} --fits 2 --save \
             workshop",
            quote(name)
        );
    }
}

/// Name of a part in a slicer's list, such as "3 pin, 0.12 mm".
fn object_name(part: &Part) -> String {
    let clearance_mm = match part.kind {
        Kind::Channel | Kind::Pin => part.fit.clearance_mm,
        Kind::Rail | Kind::Key => part.fit.key_clearance_mm,
    };
    format!("{}, {clearance_mm} mm", part.name())
}

/// Quotes a name for a shell where it needs quotes.
fn quote(name: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_.".contains(c);
    if name.chars().all(is_plain) {
        name.to_owned()
    } else {
        format!("\"{name}\"")
    }
}

fn describe(fit: &Fit) -> Value {
    json!({ "number": fit.number, "clearance": fit.clearance_mm, "key_clearance": fit.key_clearance_mm,
            "tolerance": fit.tolerance_mm })
}

fn tell_profile(session: &Session, path: &Path, base: &Printer, fit: &Fit, name: &str) {
    if session.is_json {
        let value = json!({ "status": "done", "out": path, "printer": name, "based_on": base.name,
                            "fits": describe(fit) });
        println!("{value}");
    } else if session.progress_form != Shown::Nothing {
        println!(
            "{}: printer \"{name}\" has clearance {}, on rails {}, tolerance {} mm; `shellock build MODEL \
             --printer {}` uses them",
            path.display(),
            fit.clearance_mm,
            fit.key_clearance_mm,
            fit.tolerance_mm,
            quote(name)
        );
    }
}

/// Writes the clearances of `fit` into the configuration file as those of the printer `name`. `fit` is a
/// result for `base`. All else in the file stays.
fn save(path: &Path, base: &Printer, fit: &Fit, name: &str) -> Result<(), Failure> {
    let wrong = |problem: String| Failure::Wrong(format!("{}: {problem}", path.display()));
    let is_called = |p: &Printer| p.name.eq_ignore_ascii_case(name);
    if shipped().iter().any(is_called) {
        return Err(Failure::Wrong(format!(
            "the printer \"{name}\" comes with the program and stays as it is; choose another name with \
             --save"
        )));
    }
    if name.trim().is_empty() || name.chars().any(char::is_control) {
        return Err(Failure::Wrong(
            "give the printer a name with --save, such as workshop".into(),
        ));
    }
    // A symbolic link is kept; the file that it points to is changed.
    let file = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let unreadable = |source| Failure::Unreadable {
        path: path.to_owned(),
        source,
    };
    let text = if file.exists() {
        fs::read_to_string(&file).map_err(unreadable)?
    } else {
        String::new()
    };
    let saved = with_printer(&text, base, fit, name).map_err(wrong)?;
    let is_read_only = fs::metadata(&file).is_ok_and(|m| m.permissions().readonly());
    if is_read_only {
        let source = std::io::ErrorKind::PermissionDenied.into();
        return Err(Failure::Unwritable {
            path: path.to_owned(),
            source,
        });
    }
    write(&file, saved.as_bytes())
}

/// Returns the configuration `text` with the clearances of `fit`, a result for `base`, as those of the
/// printer `name`.
fn with_printer(text: &str, base: &Printer, fit: &Fit, name: &str) -> Result<String, String> {
    let mut configuration: DocumentMut = text.parse().map_err(|e: toml_edit::TomlError| e.to_string())?;
    let mut empty = Table::new();
    empty.set_implicit(true);
    let printers = configuration.entry("printers").or_insert(Item::Table(empty));
    let printers = printers
        .as_table_like_mut()
        .ok_or("\"printers\" must be a table; write for example [printers.mine]")?;
    let key = entry(printers, base, name)?;
    let table = printers.get_mut(&key).and_then(Item::as_table_like_mut);
    let table = table.ok_or_else(|| format!("the printer \"{key}\" must be a table"))?;
    let tolerance = if table.contains_key("wall-gap") {
        "wall-gap"
    } else {
        "tolerance"
    };
    set(table, "clearance", fit.clearance_mm);
    set(table, "key-clearance", fit.key_clearance_mm);
    set(table, tolerance, fit.tolerance_mm);
    let text = configuration.to_string();
    let is_there = printers_of(&text)?.iter().any(|p| {
        p.name == key
            && [p.clearance_mm, p.key_clearance_mm, p.tolerance_mm]
                == [fit.clearance_mm, fit.key_clearance_mm, fit.tolerance_mm]
    });
    if is_there {
        Ok(text)
    } else {
        Err(format!(
            "the printer \"{key}\" cannot be written there; write it by hand"
        ))
    }
}

/// Returns the key of the printer `name` among `printers`; adds a printer based on `base` if there is none.
fn entry(printers: &mut dyn TableLike, base: &Printer, name: &str) -> Result<String, String> {
    let named = |name: &str| {
        let mut entries = printers.iter();
        let found = entries.find(|(key, _)| key.eq_ignore_ascii_case(name));
        found.map(|(key, printer)| (key.to_owned(), printer.clone()))
    };
    if let Some((key, printer)) = named(name) {
        let like = likeness(&printer);
        if [&key, &like]
            .into_iter()
            .any(|of| of.eq_ignore_ascii_case(&base.name))
        {
            return Ok(key);
        }
        return Err(format!(
            "the printer \"{key}\" already exists and is like \"{like}\", not \"{}\"; name the printer that \
             the plate was made for with --printer, or choose another name with --save",
            base.name
        ));
    }
    let made = match named(&base.name) {
        // A copy goes to the end, without the comments beside the original.
        Some((_, Item::Table(mut own))) => {
            own.set_position(None);
            own.decor_mut().clear();
            Item::Table(own)
        }
        Some((_, own)) => own,
        None => {
            let mut table = Table::new();
            table.insert("like", toml_edit::value(&base.name));
            Item::Table(table)
        }
    };
    printers.insert(name, made);
    Ok(name.to_owned())
}

/// Name of the preset that a printer of the configuration is based on. A process has the same name as the
/// first of its printers.
fn likeness(printer: &Item) -> String {
    let word = |key: &str| printer.get(key).and_then(Item::as_str);
    word("like")
        .or_else(|| word("process"))
        .unwrap_or("sla")
        .to_owned()
}

/// Sets a number and keeps a comment beside it.
fn set(table: &mut dyn TableLike, key: &str, number: f64) {
    let new = toml_edit::Value::from(number);
    match table.get_mut(key).and_then(Item::as_value_mut) {
        Some(value) => {
            let decor = value.decor().clone();
            *value = new;
            *value.decor_mut() = decor;
        }
        None => {
            table.insert(key, Item::Value(new));
        }
    }
}

#[cfg(test)]
mod tests;

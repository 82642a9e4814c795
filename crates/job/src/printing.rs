//! Lays a kit on the plates of a printer: files, figures, and pieces that do not fit.

use rayon::prelude::*;
use shellock::{PatchId, Warning};
use shellock_formats::{NamedObject, write_3mf};
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::decimate::decimate_for_display;
use shellock_geom::{Aabb, Solid, TriMesh, Vec3};
use shellock_kit::plan_file::PrintingEntry;
use shellock_print::load::Load;
use shellock_print::plates::{Laid, Plates, Printable, Skin, lay, lay_alone};
use shellock_print::slicing::Slicing;
use shellock_print::time::{Cost, whole, whole_words};
use shellock_print::{Printer, Process};
use shellock_render::palette;
use shellock_render::stills::{Camera, Painted, render};
use shellock_report::words::pieces as named;

use crate::causes::Cause;

/// Tolerance of simple pieces, as a share of the kit's diagonal, in the mean: 0.07 mm on 240 mm.
const SEEN: f64 = 3e-4;

/// Colour of the plate in pictures.
const BED: [u8; 3] = [226, 228, 232];

/// Setting of PrusaSlicer for a piece on a raft. The supports stand on it, too.
const RAFT: (&str, &str) = ("raft_layers", "2");

/// A kit laid on plates.
pub struct Printing {
    printer: Printer,
    slicing: Slicing,
    plates: Plates,
    /// Pieces with few triangles, as they are shown.
    simple: Vec<TriMesh>,
    /// Cost of all plates, and of the whole model as people print it, by closed forms; `None` if it cannot be
    /// laid.
    cost: Cost,
    whole: Option<Cost>,
    /// Both costs on a fast printer, if the process has several paces.
    fast: Option<Cost>,
    fast_whole: Option<Cost>,
    /// Mass of the pieces without supports, g.
    grams: f64,
}

impl Printing {
    /// Lays `pieces` with walls of `wall_mm` on plates of `printer`. Faces of theirs on `surface` are the
    /// visible skin; `solid` is the model.
    pub fn of(printer: &Printer, wall_mm: f64, pieces: &[TriMesh], surface: &TriMesh, solid: &Solid) -> Self {
        let simple = simplify(pieces);
        let skin = TriangleBvh::new(surface);
        let printable = |(mesh, simple)| Printable {
            mesh,
            simple,
            skin: Skin::On(&skin),
        };
        let printables: Vec<Printable<'_>> = pieces.iter().zip(&simple).map(printable).collect();
        let slicing = Slicing::of_pieces(printer, wall_mm);
        let plates = lay(printer, slicing, &printables);
        let mut loads = vec![Load::default(); plates.n_plates];
        for laid in &plates.poses {
            loads[laid.plate] = loads[laid.plate].and(laid.load);
        }
        let whole = lay_alone(printer, solid.mesh())
            .map(|laid| whole(printer.process, laid.load, solid.mesh().area()));
        let costs = loads.iter().map(|load| Cost::of(printer, load));
        let fast = loads.iter().filter_map(|load| Cost::of_fast(printer, load));
        Self {
            printer: printer.clone(),
            slicing,
            plates,
            simple,
            cost: costs.fold(Cost::default(), Cost::and),
            fast: Cost::of_fast(printer, &Load::default()).map(|nothing| fast.fold(nothing, Cost::and)),
            whole: whole.map(|load| Cost::of(printer, &load)),
            fast_whole: whole.and_then(|load| Cost::of_fast(printer, &load)),
            grams: pieces.iter().map(TriMesh::signed_volume).sum::<f64>() * printer.material.density_g_cm3
                / 1000.0,
        }
    }

    /// Cost of all plates by closed forms, and of the whole model as people print it.
    pub fn costs(&self) -> (Cost, Option<Cost>) {
        (self.cost, self.whole)
    }

    /// Mass of the pieces without supports, g.
    pub fn grams(&self) -> f64 {
        self.grams
    }

    /// Warns of pieces that are too large for the printer, and of those that need a raft.
    pub fn warnings(&self) -> Vec<Warning> {
        let printer = describe(&self.printer);
        let too_large = self.plates.too_large.iter().map(|&i| i.into()).collect();
        let of =
            |cause, pieces: Vec<PatchId>| (!pieces.is_empty()).then(|| Warning::new(cause, pieces, None));
        let all = [
            of(Cause::PieceTooLarge { printer }, too_large),
            of(Cause::RaftNeeded, self.on_rafts()),
        ];
        all.into_iter().flatten().collect()
    }

    /// Pieces that need a raft, in order.
    fn on_rafts(&self) -> Vec<PatchId> {
        let laid = self.plates.poses.iter().filter(|l| l.needs_raft);
        laid.map(|l| l.piece.into()).collect()
    }

    /// Describes the plates in one line for people.
    pub fn words(&self) -> String {
        let n = self.plates.n_plates;
        let outer_mm2: f64 = self.plates.poses.iter().map(|l| l.outer_support_mm2).sum();
        let supports = match self.printer.process {
            Process::Sls => String::new(),
            _ => format!(
                "; {:.1} cm² of the outer surface need supports",
                outer_mm2 / 100.0
            ),
        };
        let rest = match self.plates.too_large.len() {
            0 => format!("; {}", self.cost_words()),
            n => format!("; {n} pieces do not fit on them"),
        };
        let plates = if n == 1 { "plate" } else { "plates" };
        format!(
            "plates.3mf: {n} {plates} of {}{supports}{rest}",
            describe(&self.printer)
        )
    }

    /// Describes the cost, as in "about 13 h 50 min and 104 g on this printer with supports; the whole model
    /// …".
    fn cost_words(&self) -> String {
        let process = self.printer.process;
        let supports = if process == Process::Sls {
            ""
        } else {
            " with supports"
        };
        let on = |fast: &Option<Cost>| match fast {
            Some(fast) => format!(", or {} on a fast printer", fast.words()),
            None => String::new(),
        };
        let printer = self.printer_words();
        let ours = format!(
            "about {} on {printer}{supports}{}",
            self.cost.words(),
            on(&self.fast)
        );
        match self.whole {
            Some(whole) => format!(
                "{ours}; the whole model {} takes {}{}",
                whole_words(process),
                whole.words(),
                on(&self.fast_whole)
            ),
            None => ours,
        }
    }

    /// Printer that the time is estimated for.
    fn printer_words(&self) -> &'static str {
        if self.fast.is_some() {
            "a printer like the Prusa MK3S"
        } else {
            "this printer"
        }
    }

    /// Printer that the kit is laid out for.
    pub fn printer(&self) -> &Printer {
        &self.printer
    }

    /// Choices that the plates ask of the slicer.
    pub fn slicing(&self) -> Slicing {
        self.slicing
    }

    /// Lists the figures of the plates for the page.
    pub fn figures(&self) -> Vec<(String, String)> {
        let n = self.plates.n_plates;
        let outer_mm2: f64 = self.plates.poses.iter().map(|l| l.outer_support_mm2).sum();
        let all = match self.fast {
            Some(_) => format!("all plates on {}, estimated", self.printer_words()),
            None => "all plates, estimated".to_owned(),
        };
        let mut figures = vec![
            ("printer".to_owned(), describe(&self.printer)),
            ("plates".to_owned(), n.to_string()),
            (all, self.cost.words()),
        ];
        if let Some(fast) = self.fast {
            figures.push(("all plates on a fast printer, estimated".to_owned(), fast.words()));
        }
        if let Some(whole) = self.whole {
            let name = format!(
                "for comparison, the whole model {}",
                whole_words(self.printer.process)
            );
            figures.push((name, whole.words()));
        }
        if self.printer.process != Process::Sls {
            let supports = format!("{:.1} cm² of the outer surface", outer_mm2 / 100.0);
            figures.push(("supports touch".to_owned(), supports));
        }
        let on_rafts = self.on_rafts();
        if !on_rafts.is_empty() {
            figures.push(("on a raft".to_owned(), named(&on_rafts)));
        }
        figures
    }

    /// Returns the pieces in assembled position with few triangles, as they are shown.
    pub fn simple_pieces(&self) -> &[TriMesh] {
        &self.simple
    }

    /// Renders each plate from above, as PNG.
    pub fn pictures(&self) -> Vec<Vec<u8>> {
        (0..self.plates.n_plates)
            .into_par_iter()
            .map(|plate| self.picture(plate))
            .collect()
    }

    fn picture(&self, plate: usize) -> Vec<u8> {
        const WIDTH: usize = 640;
        let [width, depth, _] = self.printer.bed_mm;
        let laid: Vec<(usize, TriMesh)> = self
            .plates
            .poses
            .iter()
            .filter(|l| l.plate == plate)
            .map(|l| (l.piece, pose(l, &self.simple[l.piece])))
            .collect();
        let bed = TriMesh {
            points: [[0.0, 0.0], [width, 0.0], [width, depth], [0.0, depth]]
                .map(|[x, y]| Vec3::new(x, y, -0.5))
                .into(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        };
        let painted = |mesh, color| Painted {
            mesh,
            color,
            face_colors: None,
            normals: None,
            shift: Vec3::ZERO,
        };
        let mut scene = vec![painted(&bed, BED)];
        scene.extend(
            laid.iter()
                .map(|(piece, mesh)| painted(mesh, palette::color(*piece))),
        );
        let height = (WIDTH as f64 * (depth / width).clamp(0.3, 3.0)).round() as usize;
        render(&scene, &Camera::along(-Vec3::Z, Vec3::Y), WIDTH, height).png()
    }

    /// Entry on printing in plan.json.
    pub fn entry(&self) -> PrintingEntry {
        PrintingEntry::of(&self.printer, &self.plates, self.cost, self.whole)
    }

    /// 3MF files: all plates side by side, and each plate alone if there are several.
    pub fn files(&self, pieces: &[TriMesh]) -> Vec<(String, Vec<u8>)> {
        let names: Vec<String> = (1..=pieces.len())
            .map(|number| format!("piece {number}"))
            .collect();
        let usual = self.slicing.settings();
        let on_raft = [&usual[..], &[RAFT]].concat();
        let object = |laid: &Laid, moved_mm: [f64; 3]| {
            let (name, mesh) = (names[laid.piece].as_str(), &pieces[laid.piece]);
            NamedObject {
                name,
                color: palette::color(laid.piece),
                mesh,
                rotation: Some(laid.axes),
                moved_mm,
                settings: if laid.needs_raft { &on_raft } else { &usual },
            }
        };
        let of_plate = |plate: usize| -> Vec<NamedObject<'_>> {
            self.plates
                .poses
                .iter()
                .filter(|l| l.plate == plate)
                .map(|l| object(l, l.moved_mm))
                .collect()
        };
        let all = || {
            self.plates
                .poses
                .iter()
                .map(|l| object(l, l.moved_among_plates_mm(&self.printer)))
                .collect()
        };
        let n = self.plates.n_plates;
        let single =
            (0..if n > 1 { n } else { 0 }).map(|i| (format!("plates/plate-{}.3mf", i + 1), of_plate(i)));
        let archives: Vec<(String, Vec<NamedObject<'_>>)> = std::iter::once(("plates.3mf".to_owned(), all()))
            .chain(single)
            .collect();
        archives
            .into_par_iter()
            .map(|(name, objects)| (name, write_3mf(&objects)))
            .collect()
    }
}

/// Returns the pieces with fewer triangles, as they are shown.
pub fn simplify(pieces: &[TriMesh]) -> Vec<TriMesh> {
    let all = pieces.iter().fold(Aabb::EMPTY, |b, mesh| b.union(mesh.bounds()));
    let tolerance_mm = SEEN * all.diagonal();
    pieces
        .par_iter()
        .map(|mesh| decimate_for_display(mesh, tolerance_mm))
        .collect()
}

/// Piece in its pose on the plate.
fn pose(laid: &Laid, piece: &TriMesh) -> TriMesh {
    TriMesh {
        points: piece.points.iter().map(|&p| laid.place(p)).collect(),
        triangles: piece.triangles.clone(),
    }
}

/// Name and size of a printer, in words.
pub fn describe(printer: &Printer) -> String {
    let [width, depth, height] = printer.bed_mm;
    format!("\"{}\" ({width} × {depth} × {height} mm)", printer.name)
}

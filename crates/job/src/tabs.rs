//! Text on printing and handling a kit: plates, time, settings, and advice for pieces that do not fit
//! together.

use shellock::PatchId;
use shellock_geom::TriMesh;
use shellock_kit::plan_file::piece_file;
use shellock_print::booklet::Section;
use shellock_print::{Printer, Process};
use shellock_render::{ReportPart, ReportTab};

use crate::printing::Printing;

/// Tab of the page on printing.
pub fn print(printing: &Printing, pieces: &[TriMesh], has_booklet: bool) -> ReportTab {
    let pictures = printing.pictures(pieces);
    let of = pictures.len();
    let mut parts = vec![
        ReportPart::Table("What it takes".into(), printing.figures()),
        ReportPart::Text("In the slicer".into(), settings(printing.printer())),
    ];
    parts.extend(
        pictures
            .into_iter()
            .enumerate()
            .map(|(i, png)| ReportPart::Picture(format!("Plate {} of {of}, from above", i + 1), png)),
    );
    parts.push(ReportPart::Files(
        "Files".into(),
        file_list(of, pieces.len(), has_booklet),
    ));
    ReportTab {
        name: "Print".into(),
        parts,
    }
}

fn settings(printer: &Printer) -> Vec<String> {
    let layer = printer.layer_mm;
    let own = match printer.process {
        Process::Sla => [
            format!(
                "Layers of {layer} mm, the exposure that your resin asks for. Turn hollowing and drain \
                 holes off: the pieces are hollow."
            ),
            "Supports on, from the plate: pieces lie so that most of them stand on inner sides. Keep tips \
             out of channels and off seams."
                .into(),
        ],
        Process::Fdm => [
            format!(
                "Layers of {layer} mm, 3 walls or more, so that thin walls and connectors are solid. Infill \
                 hardly matters."
            ),
            "Supports on, from the plate only, with a gap that comes off clean. No brim and no elephant \
             foot on seams."
                .into(),
        ],
        Process::Sls => [
            format!("Layers of {layer} mm. No supports."),
            "Turn compensation of holes off: gaps are made for your printer's tolerance already.".into(),
        ],
    };
    let mut all = vec![
        "Open plates.3mf (or a plate of its own). Do not scale it, and do not turn pieces: they lie as they \
         print best."
            .to_owned(),
    ];
    all.extend(own);
    all
}

fn file_list(n_plates: usize, n_pieces: usize, has_booklet: bool) -> Vec<(String, String)> {
    let file = |name: String, what: &str| (name, what.to_owned());
    let mut files = vec![file("plates.3mf".into(), "all plates")];
    if n_plates > 1 {
        files.extend((1..=n_plates).map(|i| file(format!("plates/plate-{i}.3mf"), "one plate")));
    }
    if has_booklet {
        files.push(file("instructions.pdf".into(), "the booklet, to print"));
    }
    files.push(file("assembly.3mf".into(), "all pieces in place"));
    files.extend((0..n_pieces).map(|i| file(piece_file(PatchId::from(i)), "one piece")));
    files
}

/// Page of the booklet before the first step.
pub fn before(printing: &Printing) -> Vec<Section> {
    let printer = printing.printer();
    let line = |(what, much): (String, String)| format!("{what}: {much}");
    let takes = Section {
        title: "Print".into(),
        lines: printing
            .figures()
            .into_iter()
            .map(line)
            .chain(settings(printer))
            .collect(),
    };
    let of_care = care(printer).parts.into_iter().filter_map(section);
    std::iter::once(takes).chain(of_care.take(4)).collect()
}

/// Section of the booklet that replaces it if the kit failed.
pub fn failure_section() -> Section {
    Section {
        title: "Do not print this kit".into(),
        lines: vec![
            "It failed its checks: pieces would come loose, rub or rattle. The page (report.html) says \
             which and where."
                .into(),
        ],
    }
}

/// Page of the booklet after the last step.
pub fn after(has_passed: bool) -> Vec<Section> {
    let apart = section(taking_apart());
    let worth = if has_passed {
        "What it bears and how far pieces can be wiggled is computed, not tried on a print; printers differ. \
         Handle it as what it is: a hollow thing held by small connectors. No warranty of any kind comes \
         with it."
    } else {
        "This kit failed its checks and is not meant to be printed."
    };
    apart
        .into_iter()
        .chain([Section {
            title: "What all this is worth".into(),
            lines: vec![worth.into()],
        }])
        .collect()
}

fn section(part: ReportPart) -> Option<Section> {
    match part {
        ReportPart::Text(title, lines) => Some(Section { title, lines }),
        _ => None,
    }
}

fn taking_apart() -> ReportPart {
    ReportPart::Text(
        "Taking it apart".into(),
        vec![
            "The key goes out first, the way it came in; then the pieces from the last to the first. No \
             other piece comes out before."
                .into(),
        ],
    )
}

/// Tab of the page on handling after printing.
pub fn care(printer: &Printer) -> ReportTab {
    let clean: Vec<&str> = match printer.process {
        Process::Sla => vec![
            "Take supports off before the resin is hard, then wash twice. Blow channels and grooves dry: \
             what stays in them is felt as too tight.",
            "Let it dry, then harden every side. Sand stubs of supports on seams flat.",
        ],
        Process::Fdm => vec![
            "Take supports off. Scrape a first layer that stands out at seams with a blade.",
            "Pull strings out of channels; a file of 2 mm goes into all of them.",
        ],
        Process::Sls => vec![
            "Brush and blow all powder out of channels and grooves.",
            "Dyeing adds no thickness; paint does: keep it off seams.",
        ],
    };
    let text = |title: &str, lines: &[&str]| {
        ReportPart::Text(title.into(), lines.iter().map(|&l| l.to_owned()).collect())
    };
    ReportTab {
        name: "Care".into(),
        parts: vec![
            text("Clean", &clean),
            text(
                "Before all: the fit test",
                &[
                    "`shellock coupon` makes a plate of half an hour that tells which clearance fits on \
                     your printer. Print it once before a large kit.",
                ],
            ),
            text(
                "Too tight",
                &[
                    "Do not force it: find where it rubs, mostly a stub of a support or a first layer, and \
                     sand that.",
                    "If all seams are tight, wet sand channels, or make the kit again with a larger \
                     --clearance and --seam-gap, 0.03 mm at a time.",
                ],
            ),
            text(
                "Too loose",
                &[
                    "Some play is meant: the Play page shows how much. A key that falls out is held by a \
                     strip of tape inside its groove.",
                    "If all pieces rattle, make the kit again with a smaller --clearance, 0.03 mm at a time.",
                ],
            ),
            taking_apart(),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_process_is_told_how_to_print_and_clean() {
        for printer in Printer::presets() {
            assert!(settings(&printer).len() >= 3);
            assert_eq!(care(&printer).parts.len(), 5);
        }
    }

    #[test]
    fn files_are_those_of_a_kit() {
        let names: Vec<String> = file_list(2, 3, true).into_iter().map(|f| f.0).collect();
        assert!(
            names.contains(&"plates/plate-2.3mf".to_owned())
                && names.contains(&"pieces/piece-03.stl".to_owned())
        );
        assert!(
            !file_list(1, 3, false)
                .iter()
                .any(|f| f.0.contains("plate-1") || f.0.ends_with(".pdf"))
        );
    }
}

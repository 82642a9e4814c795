//! Text on printing and handling a kit: plates, time, settings, and advice for pieces that do not fit
//! together.

use shellock::PatchId;
use shellock_kit::plan_file::piece_file;
use shellock_print::booklet::Section;
use shellock_print::slicing::Slicing;
use shellock_print::{Printer, Process};
use shellock_render::{ReportPart, ReportTab};

use crate::printing::Printing;

/// Tab of the page on printing.
pub fn print(printing: &Printing, has_booklet: bool) -> ReportTab {
    let pictures = printing.pictures();
    let of = pictures.len();
    let mut parts = vec![
        ReportPart::Table("Plates, time and material".into(), printing.figures()),
        ReportPart::Text(
            "Slicer settings".into(),
            settings(printing.printer(), printing.slicing()),
        ),
    ];
    parts.extend(
        pictures
            .into_iter()
            .enumerate()
            .map(|(i, png)| ReportPart::Picture(format!("Plate {} of {of}, from above", i + 1), png)),
    );
    parts.push(ReportPart::Files(
        "Files".into(),
        file_list(of, printing.simple_pieces().len(), has_booklet),
    ));
    ReportTab {
        name: "Print".into(),
        parts,
    }
}

fn settings(printer: &Printer, slicing: Slicing) -> Vec<String> {
    let layer = printer.layer_mm;
    let own = match printer.process {
        Process::Sla => [
            format!(
                "Layer height {layer} mm, with the exposure time recommended for your resin. Turn off \
                 hollowing and drain holes: the pieces are already hollow."
            ),
            "Turn on supports from the build plate. The pieces are oriented so that most supports touch \
             inner surfaces. Keep support tips out of channels and off seams."
                .into(),
        ],
        Process::Fdm => [
            format!(
                "Layer height {layer} mm, with {} perimeters (wall loops), so that walls and connectors \
                 print solid. Infill makes little difference.",
                slicing.n_perimeters
            ),
            "Supports everywhere, in the style \"snug\", for slopes of up to 40° from level. Pieces that \
             stand on a thin edge need a raft of two layers; do not use a brim for the others. PrusaSlicer \
             reads all this and the perimeters from the file; set it yourself in another slicer. Turn on \
             elephant foot compensation, so that the first layer does not bulge at seams."
                .into(),
        ],
        Process::Sls => [
            format!("Layer height {layer} mm. No supports."),
            "Turn off hole compensation: the gaps already allow for your printer's tolerance.".into(),
        ],
    };
    let mut all = vec![
        "Open plates.3mf, or a single plate if there are several. Do not scale or rotate the pieces: they \
         are already oriented for printing."
            .to_owned(),
    ];
    all.extend(own);
    all
}

fn file_list(n_plates: usize, n_pieces: usize, has_booklet: bool) -> Vec<(String, String)> {
    let file = |name: String, what: &str| (name, what.to_owned());
    let mut files = vec![file("plates.3mf".into(), "all plates in one file")];
    if n_plates > 1 {
        files.extend((1..=n_plates).map(|i| file(format!("plates/plate-{i}.3mf"), "a single plate")));
    }
    if has_booklet {
        files.push(file("instructions.pdf".into(), "the booklet for printing"));
    }
    files.push(file("assembly.3mf".into(), "all pieces, assembled"));
    files.extend((0..n_pieces).map(|i| file(piece_file(PatchId::from(i)), "a single piece")));
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
            .chain(settings(printer, printing.slicing()))
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
            "This kit failed its checks: some pieces would come loose, rub or rattle. The report \
             (report.html) shows which pieces and where."
                .into(),
        ],
    }
}

/// Page of the booklet after the last step.
pub fn after(has_passed: bool) -> Vec<Section> {
    let apart = section(taking_apart());
    let worth = if has_passed {
        "The loads that this kit can take and the play of its pieces were computed, not measured on a print. \
         Printers differ. Handle it with care: it is a hollow object held together by small connectors. It \
         comes without warranty of any kind."
    } else {
        "This kit failed its checks. Do not print it."
    };
    apart
        .into_iter()
        .chain([Section {
            title: "Limits of the computed figures".into(),
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
        "Disassembly".into(),
        vec![
            "Pull the key out first, back the way it went in. Then remove the other pieces, from the last to \
             the first. No other piece comes out before the key."
                .into(),
        ],
    )
}

/// Tab of the page on handling after printing.
pub fn care(printer: &Printer) -> ReportTab {
    let clean: Vec<&str> = match printer.process {
        Process::Sla => vec![
            "Remove the supports before the final cure, then wash twice. Blow channels and grooves dry: \
             resin left in them makes the fit too tight.",
            "Let the pieces dry, then cure them from all sides. Sand support marks on seams flat.",
        ],
        Process::Fdm => vec![
            "Remove the supports. If the first layer bulges at a seam, trim it with a blade.",
            "Pull strings out of the channels. A 2 mm file fits into all of them.",
        ],
        Process::Sls => vec![
            "Brush and blow all powder out of channels and grooves.",
            "Dye adds no thickness. Paint does: keep it off seams.",
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
                "First: the fit test",
                &[
                    "The fit test is a small plate that prints in about half an hour. It shows which \
                     clearance your printer needs. Make it with `shellock coupon`, and print it once before \
                     a large kit.",
                ],
            ),
            text(
                "Too tight",
                &[
                    "Do not force it. Find the spot that rubs, usually a support mark or a bulging first \
                     layer, and sand it.",
                    "If all seams are tight, wet-sand the channels, or make the kit again with a larger \
                     clearance and a larger seam gap. Increase both by 0.03 mm at a time.",
                ],
            ),
            text(
                "Too loose",
                &[
                    "Some play is intended: the report (report.html) shows how much. If the key falls out, \
                     stick a strip of tape inside its groove.",
                    "If all pieces rattle, make the kit again with a smaller clearance. Reduce it by 0.03 mm \
                     at a time.",
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
            assert!(settings(&printer, Slicing::of_pieces(&printer, 2.0)).len() >= 3);
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

//! Warnings of the library in words for the page, with the page's own piece numbers.

use shellock::causes::Divide as Cause;
use shellock::{PatchId, Warning};

/// Sentence for `warning` on the page; `number` gives the page's number of a patch, from 0.
///
/// Painted labels are the page's numbers, from 1. Patches are numbered in the order in which they will be
/// cut.
pub fn words(warning: &Warning, number: impl Fn(PatchId) -> u32) -> String {
    match warning.cause() {
        Some(Cause::LabelSplit { label, area_mm2 }) => {
            let cm2 = area_mm2 / 100.0;
            format!("piece {label} has parts that do not touch: {cm2:.1} cm² will become a separate piece")
        }
        Some(Cause::LabelIslands { n: 1, .. }) => "a small island will join the piece around it".to_owned(),
        Some(Cause::LabelIslands { n, .. }) => format!("{n} small islands will join the pieces around them"),
        Some(Cause::LabelMerged {
            label,
            area_mm2,
            least_mm2,
            ..
        }) => format!(
            "piece {label} is too small ({area_mm2:.0} mm², at least {least_mm2} mm² is needed) and will \
             join its neighbour"
        ),
        Some(Cause::LabelsDivided { into }) => {
            let line = |(label, pieces): &(i64, Vec<PatchId>)| format!("piece {label} into {}", pieces.len());
            let all: Vec<String> = into.iter().map(line).collect();
            format!(
                "pieces will be divided so that the kit locks and can be assembled: {}; no piece may hold \
                 others alone or run around a limb",
                all.join(", ")
            )
        }
        Some(Cause::LabelsJoined { labels }) => {
            let labels: Vec<String> = labels.iter().map(ToString::to_string).collect();
            let all = labels.join(", ");
            format!(
                "pieces {all} will be joined into one: the seams between or around them are too short to \
                 hold separate pieces"
            )
        }
        _ => {
            let mut pieces: Vec<PatchId> = warning.pieces.iter().map(|&p| PatchId(number(p))).collect();
            pieces.sort_unstable();
            pieces.dedup();
            let mut renumbered = warning.clone();
            renumbered.pieces = pieces;
            renumbered.to_string()
        }
    }
}

/// Returns true if "Fix" makes the change that `warning` announces.
pub fn is_mended(warning: &Warning) -> bool {
    matches!(
        warning.cause(),
        Some(
            Cause::LabelSplit { .. }
                | Cause::LabelIslands { .. }
                | Cause::LabelMerged { .. }
                | Cause::LabelsDivided { .. }
                | Cause::LabelsJoined { .. }
        )
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_are_called_as_the_page_calls_them_each_once() {
        let warning = Warning::new(
            Cause::ShortContacts {
                from_mm: 8.0,
                to_mm: 11.0,
            },
            vec![PatchId(4), PatchId(7), PatchId(2)],
            None,
        );
        let said = words(&warning, |p| if p == PatchId(2) { 0 } else { 5 });
        assert!(said.contains("hold pieces 1, 6;"), "{said}");
    }
}

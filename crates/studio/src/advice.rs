//! Warnings of the library in words for the page, with the page's own piece numbers.

use shellock::{Cause, PatchId, Warning};

/// Sentence for `warning` on the page; `number` gives the page's number of a patch, from 0.
///
/// Painted labels are the page's numbers, from 1. Patches are numbered in the order in which they will be
/// cut.
pub fn words(warning: &Warning, number: impl Fn(PatchId) -> u32) -> String {
    match &warning.cause {
        Cause::LabelSplit { label, area_mm2 } => {
            let cm2 = area_mm2 / 100.0;
            format!("piece {label} is in parts that do not touch: {cm2:.1} cm² will be a piece of their own")
        }
        Cause::LabelIslands { n: 1, .. } => "a small island will join the piece around it".to_owned(),
        Cause::LabelIslands { n, .. } => format!("{n} small islands will join the pieces around them"),
        Cause::LabelMerged {
            label,
            area_mm2,
            least_mm2,
            ..
        } => format!(
            "piece {label} is too small ({area_mm2:.0} mm², at least {least_mm2} are needed) and will join \
             its neighbour"
        ),
        Cause::LabelsDivided { into } => {
            let line = |(label, pieces): &(i64, Vec<PatchId>)| format!("piece {label} in {}", pieces.len());
            let all: Vec<String> = into.iter().map(line).collect();
            format!(
                "will be divided so that it locks and can be put on: {}; no piece may hold others alone, or \
                 run around a limb",
                all.join(", ")
            )
        }
        Cause::LabelsJoined { labels } => {
            let labels: Vec<String> = labels.iter().map(ToString::to_string).collect();
            let all = labels.join(", ");
            format!("pieces {all} will be one: the seams between or around them are too short to hold two")
        }
        _ => {
            let mut pieces: Vec<PatchId> = warning.pieces.iter().map(|&p| PatchId(number(p))).collect();
            pieces.sort_unstable();
            pieces.dedup();
            Warning {
                pieces,
                ..warning.clone()
            }
            .to_string()
        }
    }
}

/// Returns true if "Mend" makes the change that `warning` announces.
pub fn is_mended(warning: &Warning) -> bool {
    matches!(
        warning.cause,
        Cause::LabelSplit { .. }
            | Cause::LabelIslands { .. }
            | Cause::LabelMerged { .. }
            | Cause::LabelsDivided { .. }
            | Cause::LabelsJoined { .. }
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_are_called_as_the_page_calls_them_each_once() {
        let warning = Warning {
            cause: Cause::ShortContacts {
                from_mm: 8.0,
                to_mm: 11.0,
            },
            pieces: vec![PatchId(4), PatchId(7), PatchId(2)],
            at: None,
        };
        let said = words(&warning, |p| if p == PatchId(2) { 0 } else { 5 });
        assert!(said.starts_with("pieces 1, 6 hold by seams"), "{said}");
    }
}

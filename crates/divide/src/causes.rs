//! Causes of warnings about labels, patches and keys. Lengths in mm, areas in mm².

use std::sync::Arc;

use shellock_report::words::{number, numbers, pieces as named, plural};
use shellock_report::{Diagnostic, PatchId, Told};

/// Cause of a warning, with its figures.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the sentences below say what each figure is")]
pub enum Cause {
    LabelSplit {
        label: i64,
        area_mm2: f64,
    },
    LabelIslands {
        n: usize,
        area_mm2: f64,
        largest_mm2: f64,
        largest_label: i64,
    },
    LabelMerged {
        label: i64,
        area_mm2: f64,
        n_triangles: usize,
        least_mm2: f64,
    },
    LabelsDivided {
        into: Vec<(i64, Vec<PatchId>)>,
    },
    LabelsJoined {
        labels: Vec<i64>,
    },
    BordersMoved {
        share: f64,
    },
    ShortContacts {
        from_mm: f64,
        to_mm: f64,
    },
    WeakGraph,
    KeepWholeCut {
        share: f64,
    },
    KeyNotFlat {
        flat_share: f64,
        least_share: f64,
        off_mm: f64,
        may_be_cut: bool,
    },
    KeyNotStraight {
        straight_mm: f64,
        least_mm: f64,
        may_be_cut: bool,
    },
}

impl Diagnostic for Cause {
    #[expect(clippy::too_many_lines, reason = "a table, one row for each cause")]
    fn tell(&self, pieces: &[PatchId]) -> Told {
        let first = number(pieces, 0);
        match self {
            Self::LabelSplit { label, area_mm2 } => Told::note(
                "label-split",
                format!(
                    "label {label} has parts that do not touch: {area_mm2:.0} mm² become a piece of their \
                     own"
                ),
            ),
            Self::LabelIslands {
                n: 1,
                largest_mm2,
                largest_label,
                ..
            } => Told::note(
                "label-island",
                format!(
                    "{largest_mm2:.1} mm² of label {largest_label} lie apart and join the piece around them"
                ),
            ),
            Self::LabelIslands {
                n,
                area_mm2,
                largest_mm2,
                largest_label,
            } => Told::note(
                "label-island",
                format!(
                    "{n} islands of labels, {area_mm2:.1} mm² in all, join the pieces around them; the \
                     largest has {largest_mm2:.1} mm² of label {largest_label}"
                ),
            ),
            Self::LabelMerged {
                label,
                area_mm2,
                n_triangles,
                least_mm2,
            } => Told::warning(
                "label-merged",
                format!(
                    "label {label} has only {area_mm2:.1} mm² in {n_triangles} triangles and joins its \
                     neighbour; a piece needs {least_mm2} mm²"
                ),
            ),
            Self::LabelsDivided { into } => {
                let line =
                    |(label, pieces): &(i64, Vec<PatchId>)| format!("label {label} into {}", named(pieces));
                let all: Vec<String> = into.iter().map(line).collect();
                Told::warning(
                    "piece-split",
                    format!(
                        "labels are divided so that the kit locks and can be put together: {}; no piece may \
                         hold others alone, or go round a limb",
                        all.join(", ")
                    ),
                )
            }
            Self::LabelsJoined { labels } => {
                let labels: Vec<String> = labels.iter().map(ToString::to_string).collect();
                Told::warning(
                    "piece-joined",
                    format!(
                        "labels {} become one piece, {}: the seams between or around them are too short to \
                         hold two pieces",
                        labels.join(", "),
                        numbers(pieces)
                    ),
                )
            }
            Self::BordersMoved { share } => Told::note(
                "borders-moved",
                format!(
                    "{:.0} % of the surface is in another piece than your labels say: borders were moved to \
                     where seams are long enough",
                    100.0 * share
                ),
            ),
            Self::ShortContacts { from_mm, to_mm } => Told::warning(
                "short-contacts",
                format!(
                    "seams of only {from_mm:.0} to {to_mm:.0} mm hold {}; a larger model or smaller \
                     connectors make longer joints",
                    named(pieces)
                ),
            )
            .by(&["size", "connector"]),
            Self::WeakGraph => Told::warning(
                "weak-graph",
                format!(
                    "{} alone {} others, which may come loose: give other labels, smaller connectors or a \
                     larger model",
                    named(pieces),
                    plural(pieces.len(), "holds", "hold")
                ),
            )
            .by(&["labels", "connector", "size"]),
            Self::KeepWholeCut { share } => Told::warning(
                "keep-whole-cut",
                format!(
                    "a region to keep whole is divided: {:.0} % of it is in one piece ({}); give a smaller \
                     region, or one that ends in creases",
                    100.0 * share,
                    named(pieces)
                ),
            )
            .by(&["keep-whole"]),
            Self::KeyNotFlat {
                flat_share,
                least_share,
                may_be_cut,
                ..
            } => Told::warning(
                "key-not-flat",
                format!(
                    "the key, piece {first}, is curved and may sit loosely: {:.0} % of it lies in a plane, \
                     {:.0} % would do; give it a flatter place{}",
                    100.0 * flat_share,
                    100.0 * least_share,
                    or_cut(*may_be_cut)
                ),
            )
            .by(&["key"]),
            Self::KeyNotStraight {
                straight_mm,
                least_mm,
                may_be_cut,
            } => Told::warning(
                "key-not-straight",
                format!(
                    "friction alone holds the key, piece {first}: no side is straight along its way out for \
                     {least_mm:.0} mm (longest: {straight_mm:.1}); draw straight seams there{}",
                    or_cut(*may_be_cut)
                ),
            )
            .by(&["key"]),
        }
    }

    fn renumber(&self, new: &dyn Fn(PatchId) -> PatchId) -> Option<Arc<dyn Diagnostic>> {
        let Self::LabelsDivided { into } = self else {
            return None;
        };
        let into = into
            .iter()
            .map(|(label, pieces)| (*label, pieces.iter().map(|&piece| new(piece)).collect()))
            .collect();
        Some(Arc::new(Self::LabelsDivided { into }))
    }

    fn is_unordered(&self) -> bool {
        matches!(self, Self::ShortContacts { .. } | Self::WeakGraph)
    }
}

/// Advice for a chosen key that could be cut instead.
fn or_cut(may_be_cut: bool) -> &'static str {
    if may_be_cut { ", or let the key be cut" } else { "" }
}

#[cfg(test)]
mod tests {
    use shellock_report::LONGEST_SENTENCE;

    use super::*;

    #[test]
    fn sentences_can_be_read_at_once() {
        let pieces = [PatchId(11), PatchId(6)];
        for cause in [
            Cause::LabelIslands {
                n: 12,
                area_mm2: 1234.5,
                largest_mm2: 123.4,
                largest_label: 123,
            },
            Cause::LabelMerged {
                label: 123,
                area_mm2: 12.3,
                n_triangles: 12,
                least_mm2: 30.0,
            },
            Cause::ShortContacts {
                from_mm: 8.0,
                to_mm: 11.0,
            },
            Cause::WeakGraph,
            Cause::KeepWholeCut { share: 0.75 },
            Cause::KeyNotFlat {
                flat_share: 0.5,
                least_share: 0.7,
                off_mm: 2.0,
                may_be_cut: true,
            },
            Cause::KeyNotStraight {
                straight_mm: 3.5,
                least_mm: 12.0,
                may_be_cut: true,
            },
        ] {
            let sentence = cause.tell(&pieces).sentence;
            let n = sentence.chars().count();
            assert!(
                n <= LONGEST_SENTENCE && !sentence.contains('\n'),
                "{n}: {sentence}"
            );
        }
    }
}

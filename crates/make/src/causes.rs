//! Causes of warnings about bodies and finished pieces. Volumes in mm³.

use shellock_report::words::{number, pieces as named, plural};
use shellock_report::{Diagnostic, PatchId, Told};

/// Cause of a warning, with its figures.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the sentences below say what each figure is")]
pub enum Cause {
    BodyInParts {
        dropped_mm3: f64,
    },
    PartGiven {
        given_mm3: f64,
    },
    PieceWithoutNumber,
    KeyWithoutRibs,
    KeyWithoutGrip,
    KeyRibs {
        n: usize,
        interference_mm: f64,
        travel_mm: f64,
    },
    Detent {
        interference_mm: f64,
        travel_mm: f64,
    },
    SeamWithoutConnector {
        length_mm: f64,
    },
}

impl Diagnostic for Cause {
    fn tell(&self, pieces: &[PatchId]) -> Told {
        let [first, second] = [number(pieces, 0), number(pieces, 1)];
        match self {
            Self::BodyInParts { dropped_mm3 } => Told::warning(
                "body-in-parts",
                format!(
                    "piece {first} lacks {dropped_mm3:.1} mm³ that were attached to nothing and dropped: \
                     fill the gap, or divide the model otherwise there"
                ),
            ),
            Self::PartGiven { given_mm3 } => {
                let to = pieces
                    .get(1)
                    .map_or_else(String::new, |to| format!(" and went to piece {to}"));
                Told::warning(
                    "part-given",
                    format!(
                        "{given_mm3:.0} mm³ of piece {first} came off where seams meet{to}, but still have \
                         the colour of piece {first}; check the fit there"
                    ),
                )
            }
            Self::PieceWithoutNumber => Told::note(
                "piece-without-number",
                format!(
                    "{} {} no number inside, for want of an even place; tell {} by the pictures",
                    named(pieces),
                    plural(pieces.len(), "has", "have"),
                    plural(pieces.len(), "it", "them"),
                ),
            ),
            Self::KeyWithoutRibs => Told::warning(
                "key-without-ribs",
                format!(
                    "nothing but tight walls keeps the key, piece {first}, in: it has no rails, and no side \
                     has room for ribs; a drop of removable glue holds it"
                ),
            ),
            Self::KeyWithoutGrip => Told::note(
                "key-without-grip",
                format!(
                    "piece {first} has no notch to pull it out by, since no place of 12 × 3 mm in its \
                     middle is even"
                ),
            ),
            Self::KeyRibs {
                n,
                interference_mm,
                travel_mm,
            } => Told::note(
                "key-ribs",
                format!(
                    "{n} ribs press on the key by {interference_mm:.2} mm over the last {travel_mm:.1} mm of \
                     its way, on purpose, so that it stays in; file them down if it is too tight"
                ),
            ),
            Self::Detent {
                interference_mm,
                travel_mm,
            } => Told::note(
                "detent",
                format!(
                    "over its last {travel_mm:.1} mm the key clicks past a bump of piece {first}, which is \
                     {interference_mm:.2} mm too high for the groove on purpose"
                ),
            ),
            Self::SeamWithoutConnector { length_mm } => Told::note(
                "seam-without-connector",
                format!(
                    "the seam of {length_mm:.0} mm between pieces {first} and {second} has no connector; \
                     other seams hold these pieces"
                ),
            ),
        }
    }

    fn is_unordered(&self) -> bool {
        matches!(self, Self::PieceWithoutNumber)
    }
}

#[cfg(test)]
mod tests {
    use shellock_report::LONGEST_SENTENCE;

    use super::*;

    #[test]
    fn sentences_can_be_read_at_once() {
        let pieces = [PatchId(11), PatchId(6)];
        for cause in [
            Cause::BodyInParts { dropped_mm3: 12.4 },
            Cause::PartGiven { given_mm3: 1293.0 },
            Cause::PieceWithoutNumber,
            Cause::KeyWithoutRibs,
            Cause::KeyWithoutGrip,
            Cause::KeyRibs {
                n: 2,
                interference_mm: 0.1,
                travel_mm: 3.0,
            },
            Cause::Detent {
                interference_mm: 0.1,
                travel_mm: 3.0,
            },
            Cause::SeamWithoutConnector { length_mm: 12.4 },
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

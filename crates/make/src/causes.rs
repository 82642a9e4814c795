//! Causes of warnings about bodies and finished pieces. Volumes in mm³.

use shellock_report::words::{number, pieces as named, plural};
use shellock_report::{Diagnostic, PatchId, Told};

/// Cause of a warning, with its figures.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the sentences below say what each figure is")]
pub enum Cause {
    BodyInParts { dropped_mm3: f64 },
    PartGiven { given_mm3: f64 },
    PieceWithoutNumber,
    KeyWithoutRibs,
    KeyWithoutGrip,
}

impl Diagnostic for Cause {
    fn tell(&self, pieces: &[PatchId]) -> Told {
        let first = number(pieces, 0);
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

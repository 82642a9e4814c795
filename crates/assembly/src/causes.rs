//! Causes of warnings about a finished kit. Lengths in mm, volumes in mm³.

use shellock_report::words::{number, pieces as named, plural};
use shellock_report::{Diagnostic, PatchId, Told};

/// Cause of a warning, with its figures.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the sentences below say what each figure is")]
pub enum Cause {
    SmallOverlap {
        volume_mm3: f64,
    },
    Rattles {
        loosest: EstimatedPlay,
    },
    NotProven {
        figures: Vec<EstimatedPlay>,
        is_searched: bool,
    },
}

impl Diagnostic for Cause {
    fn tell(&self, pieces: &[PatchId]) -> Told {
        match self {
            Self::SmallOverlap { volume_mm3 } => Told::warning(
                "small-overlap",
                format!(
                    "pieces {} and {} overlap by {volume_mm3:.3} mm³; sand the joint if it is tight",
                    number(pieces, 0),
                    number(pieces, 1)
                ),
            ),
            Self::Rattles { loosest } => Told::warning(
                "rattles",
                format!(
                    "{} {}, by up to {:.1} mm and {:.1}°, but cannot come out; a smaller clearance, fewer \
                     pieces or a larger model make the kit firmer",
                    named(pieces),
                    plural(pieces.len(), "rattles", "rattle"),
                    loosest.translation_mm,
                    loosest.rotation_deg,
                ),
            )
            .by(&["clearance", "pieces", "size"]),
            Self::NotProven { figures, is_searched } => {
                Told::note("not-proven", not_proven(pieces, figures, *is_searched))
            }
        }
    }
}

/// Estimated play of a piece, as far as it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatedPlay {
    /// Greatest displacement of any point of the piece, mm.
    pub translation_mm: f64,
    /// Greatest rotation of the piece, degrees.
    pub rotation_deg: f64,
}

fn not_proven(pieces: &[PatchId], figures: &[EstimatedPlay], is_searched: bool) -> String {
    let line = |(id, play): (&PatchId, &EstimatedPlay)| {
        format!(
            "{id} (about {:.1} mm, {:.1}°)",
            play.translation_mm, play.rotation_deg
        )
    };
    let list: Vec<String> = pieces.iter().zip(figures).map(line).collect();
    let search = if is_searched {
        "; no way out was found for any piece but the key"
    } else {
        ""
    };
    format!(
        "the play of these pieces is estimated, not proven: {}{search}",
        list.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use shellock_report::LONGEST_SENTENCE;

    use super::*;

    #[test]
    fn sentences_can_be_read_at_once() {
        let pieces = [PatchId(11), PatchId(6)];
        for cause in [
            Cause::SmallOverlap { volume_mm3: 0.123 },
            Cause::Rattles {
                loosest: EstimatedPlay {
                    translation_mm: 1.9,
                    rotation_deg: 13.9,
                },
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

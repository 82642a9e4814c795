//! Causes of warnings about the choices of a design. Lengths in mm.

use shellock_report::words::{number, plural};
use shellock_report::{Diagnostic, PatchId, Told};

/// Cause of a warning, with its figures.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the sentences below say what each figure is")]
pub enum Cause {
    StrengthUnknown { error: String, thickness_mm: f64 },
    DividedOtherwise,
    WallForUse { from_mm: f64, to_mm: f64, load: String },
    JoinedForUse { load: String },
    KeyNotCut { reasons: Vec<String> },
    KeyWithoutRails,
    TimeUp { kits: usize },
}

impl Diagnostic for Cause {
    fn tell(&self, pieces: &[PatchId]) -> Told {
        let first = number(pieces, 0);
        match self {
            Self::StrengthUnknown { error, thickness_mm } => Told::warning(
                "strength-unknown",
                format!(
                    "the strength of the {thickness_mm:.2} mm wall is not known ({error}); handle the kit \
                     with care"
                ),
            ),
            Self::DividedOtherwise => Told::warning(
                "divided-otherwise",
                "pieces are of similar size and seams may cross a face, since no division at natural places \
                 holds together; try your own labels, or another number of pieces"
                    .to_owned(),
            )
            .by(&["labels", "pieces"]),
            Self::WallForUse { from_mm, to_mm, load } => Told::note(
                "wall-for-use",
                format!(
                    "walls are {to_mm:.1} mm thick instead of {from_mm:.1} mm, so that seams stay closed \
                     when the kit is {load}"
                ),
            )
            .by(&["thickness"]),
            Self::JoinedForUse { load } => Told::note(
                "joined-for-use",
                format!(
                    "two pieces are joined, since the seam between them would open when the kit is {load}"
                ),
            ),
            Self::KeyNotCut { reasons } => Told::warning(
                "key-not-cut",
                format!(
                    "piece {first} is the key as it is, without rails: {}",
                    shorten(reasons)
                ),
            ),
            Self::KeyWithoutRails => Told::note(
                "key-without-rails",
                format!(
                    "the key, piece {first}, has no rails, since no side has room for a straight one; its \
                     other connectors hold it"
                ),
            ),
            Self::TimeUp { kits: 0 } => Told::warning(
                "time-up",
                "the time was over; with more time the plan may be better".into(),
            )
            .by(&["time"]),
            Self::TimeUp { kits } => Told::warning(
                "time-up",
                format!(
                    "the time was over after {kits} {}, of which this is the best; with more time it may be \
                     better",
                    plural(*kits, "kit", "kits")
                ),
            )
            .by(&["time"]),
        }
    }
}

/// First of several reasons, and the number of the others.
fn shorten(reasons: &[String]) -> String {
    match reasons {
        [] => "nothing better was found".to_owned(),
        [only] => only.clone(),
        [first, rest @ ..] => format!("{first}; {} other keys failed too", rest.len()),
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
            Cause::DividedOtherwise,
            Cause::WallForUse {
                from_mm: 1.6,
                to_mm: 2.8,
                load: "dropped onto its feet".into(),
            },
            Cause::JoinedForUse {
                load: "dropped onto its feet".into(),
            },
            Cause::KeyWithoutRails,
            Cause::TimeUp { kits: 3 },
        ] {
            let sentence = cause.tell(&pieces).sentence;
            let n = sentence.chars().count();
            assert!(
                n <= LONGEST_SENTENCE && !sentence.contains('\n'),
                "{n}: {sentence}"
            );
        }
    }

    #[test]
    fn a_time_that_was_over_before_any_kit_speaks_of_the_plan_alone() {
        let sentence = |kits| Cause::TimeUp { kits }.tell(&[]).sentence;
        assert!(!sentence(0).contains("kit"), "{}", sentence(0));
        assert!(sentence(1).contains("after 1 kit,") && sentence(2).contains("after 2 kits,"));
    }
}

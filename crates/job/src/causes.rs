//! Causes of warnings about the input and the output of a job.

use shellock::{Diagnostic, PatchId, Told};
use shellock_report::words::{pieces as named, plural};

/// Cause of a warning, with its figures.
#[derive(Clone, Debug, PartialEq)]
pub enum Cause {
    /// A remark on the model's file, in the words of the program that read it.
    Input {
        /// Stable name of the remark for machines.
        code: &'static str,
        /// Sentence that people read.
        sentence: String,
        /// Settings by which the user can change it, most helpful first.
        settings: &'static [&'static str],
    },
    /// Some pieces are larger than the plate of the printer.
    PieceTooLarge {
        /// Name and size of the printer.
        printer: String,
    },
    /// Some pieces of filament stand on too little to stay on the plate by themselves.
    RaftNeeded,
    /// No font has some letters of the model's name.
    LettersNotPrinted {
        /// The letters that are missing.
        letters: String,
    },
    /// A check of the kit failed.
    Failed {
        /// Finding of the check, in words.
        finding: String,
    },
}

impl Diagnostic for Cause {
    fn tell(&self, pieces: &[PatchId]) -> Told {
        match self {
            Self::Input {
                code,
                sentence,
                settings,
            } => Told::warning(code, sentence.clone()).by(settings),
            Self::PieceTooLarge { printer } => Told::problem(
                "piece-too-large",
                format!(
                    "{} {} not fit the printer {printer} and {} left out of plates.3mf: make more pieces, or \
                     choose another printer",
                    named(pieces),
                    plural(pieces.len(), "does", "do"),
                    plural(pieces.len(), "is", "are"),
                ),
            )
            .by(&["pieces", "printer"]),
            Self::RaftNeeded => Told::warning(
                "raft-needed",
                format!(
                    "{} {} on too little of the plate and may fall over while printing: PrusaSlicer gives \
                     {} a raft of two layers; in another slicer, turn it on",
                    named(pieces),
                    plural(pieces.len(), "stands", "stand"),
                    plural(pieces.len(), "it", "them"),
                ),
            ),
            Self::LettersNotPrinted { letters } => {
                Told::warning("letters-not-printed", unprintable_letters(letters))
            }
            Self::Failed { finding } => Told::problem("failed", format!("do not print this kit: {finding}")),
        }
    }
}

fn unprintable_letters(letters: &str) -> String {
    /// Number of letters that the sentence shows.
    const SHOWN: usize = 20;
    let shown: String = letters.chars().take(SHOWN).collect();
    let more = if letters.chars().nth(SHOWN).is_some() {
        "..."
    } else {
        ""
    };
    format!(
        "the booklet prints boxes for \"{shown}{more}\" in the model's name: install a font that has these \
         letters, or rename the file"
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
            Cause::PieceTooLarge {
                printer: "\"fdm\" (256 × 256 × 256 mm)".into(),
            },
            Cause::RaftNeeded,
            Cause::LettersNotPrinted {
                letters: "兔".repeat(255),
            },
            Cause::Failed {
                finding: "piece 3 is not closed".into(),
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

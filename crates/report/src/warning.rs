//! Warnings: information for the user that did not stop the job.

use std::any::Any;
use std::fmt;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::PatchId;

/// Most characters of a sentence, so that it can be read at once.
pub const LONGEST_SENTENCE: usize = 200;

/// Severity of a warning; more severe ones compare greater.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// A fact that needs no action.
    Note,
    /// Something may go wrong, and can be prevented or checked.
    #[default]
    Warning,
    /// Something will go wrong unless action is taken.
    Problem,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Problem => "problem",
        })
    }
}

/// Code, severity and sentence of a warning.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Told {
    /// Stable name for machines, for example `"seam-without-connector"`.
    pub code: &'static str,
    /// Severity of the warning.
    pub severity: Severity,
    /// Sentence for people: what is wrong, where, and what to do.
    pub sentence: String,
    /// Settings by which the user can change it, most helpful first, such as `"pieces"`.
    pub settings: &'static [&'static str],
}

impl Told {
    /// A fact that needs no action.
    pub fn note(code: &'static str, sentence: String) -> Self {
        Self {
            code,
            severity: Severity::Note,
            sentence,
            settings: &[],
        }
    }

    /// Something that may go wrong.
    pub fn warning(code: &'static str, sentence: String) -> Self {
        Self {
            severity: Severity::Warning,
            ..Self::note(code, sentence)
        }
    }

    /// Something that will go wrong.
    pub fn problem(code: &'static str, sentence: String) -> Self {
        Self {
            severity: Severity::Problem,
            ..Self::note(code, sentence)
        }
    }

    /// Adds the settings by which the user can change it.
    pub fn by(self, settings: &'static [&'static str]) -> Self {
        Self { settings, ..self }
    }
}

/// Cause of a warning. Every crate has causes of its own, each with its figures.
pub trait Diagnostic: Any + fmt::Debug + Send + Sync {
    /// Tells code, severity and sentence. `pieces` are those of the warning, in its order.
    fn tell(&self, pieces: &[PatchId]) -> Told;

    /// Returns the cause with other numbers for the pieces that it names itself; `None` if it names none.
    fn renumber(&self, _new: &dyn Fn(PatchId) -> PatchId) -> Option<Arc<dyn Diagnostic>> {
        None
    }

    /// Returns true if the order of the warning's pieces means nothing.
    fn is_unordered(&self) -> bool {
        false
    }
}

/// Information for the user that did not stop the job, from any stage.
///
/// [`fmt::Display`] gives the sentence for people. A warning is written to files and JSON as a
/// [`WarningEntry`]. Two warnings are equal if they say the same of the same pieces and place.
#[derive(Clone, Debug, Serialize)]
#[serde(into = "WarningEntry")]
pub struct Warning {
    cause: Arc<dyn Diagnostic>,
    /// Pieces concerned, in the order in which the sentence names them.
    pub pieces: Vec<PatchId>,
    /// Place of the cause, mm in assembly space.
    pub at: Option<[f64; 3]>,
}

/// Warning in the form that files contain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WarningEntry {
    /// Stable name for machines, for example `"seam-without-connector"`.
    pub code: String,
    /// Severity of the warning; files of former versions do not state it.
    #[serde(default)]
    pub severity: Severity,
    /// Sentence of the warning, for people.
    pub message: String,
    /// Settings by which the user can change it, most helpful first, such as `"pieces"`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub settings: Vec<String>,
    /// Pieces that the warning concerns.
    pub pieces: Vec<PatchId>,
    /// Place of the cause, mm.
    pub at: Option<[f64; 3]>,
}

impl Warning {
    /// Creates a warning of `pieces`, in the order in which its sentence names them, and of a place.
    pub fn new(cause: impl Diagnostic, pieces: Vec<PatchId>, at: Option<[f64; 3]>) -> Self {
        Self {
            cause: Arc::new(cause),
            pieces,
            at,
        }
    }

    /// Returns the cause, if it is of this kind.
    pub fn cause<T: Diagnostic>(&self) -> Option<&T> {
        let cause: &dyn Any = &*self.cause;
        cause.downcast_ref()
    }

    /// Tells code, severity and sentence.
    pub fn describe(&self) -> Told {
        self.cause.tell(&self.pieces)
    }

    /// Stable name for machines, for example `"seam-without-connector"`.
    pub fn code(&self) -> &'static str {
        self.describe().code
    }

    /// Severity of the warning, by its cause.
    pub fn severity(&self) -> Severity {
        self.describe().severity
    }

    /// Returns the warning with other numbers for its pieces.
    pub fn renumber(&self, new: &dyn Fn(PatchId) -> PatchId) -> Self {
        let mut pieces: Vec<PatchId> = self.pieces.iter().map(|&piece| new(piece)).collect();
        if self.cause.is_unordered() {
            pieces.sort_unstable();
        }
        Self {
            cause: self.cause.renumber(new).unwrap_or_else(|| self.cause.clone()),
            pieces,
            at: self.at,
        }
    }

    /// Moves the warning's place to another frame.
    pub fn move_by(self, motion: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        Self {
            at: self.at.map(motion),
            ..self
        }
    }

    /// Sorts warnings by severity, the most severe first; equal ones keep their order.
    pub fn rank(warnings: &[Self]) -> Vec<Self> {
        let mut ranked = warnings.to_vec();
        ranked.sort_by_key(|w| std::cmp::Reverse(w.severity()));
        ranked
    }
}

impl PartialEq for Warning {
    fn eq(&self, other: &Self) -> bool {
        (&self.pieces, self.at, self.describe()) == (&other.pieces, other.at, other.describe())
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.describe().sentence)
    }
}

impl From<Warning> for WarningEntry {
    fn from(warning: Warning) -> Self {
        let told = warning.describe();
        Self {
            code: told.code.to_owned(),
            severity: told.severity,
            message: told.sentence,
            settings: told.settings.iter().map(ToString::to_string).collect(),
            pieces: warning.pieces,
            at: warning.at,
        }
    }
}

impl WarningEntry {
    /// Writes the sentence, followed by its settings as an interface spells them, such as "(--pieces)".
    pub fn sentence_with(&self, spell: impl Fn(&str) -> String) -> String {
        let settings: Vec<String> = self.settings.iter().map(|name| spell(name)).collect();
        match settings.is_empty() {
            true => self.message.clone(),
            false => format!("{} ({})", self.message, settings.join(", ")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cause that names the pieces of its warning and one of its own.
    #[derive(Debug)]
    struct Leaning(PatchId, Severity);

    impl Diagnostic for Leaning {
        fn tell(&self, pieces: &[PatchId]) -> Told {
            let sentence = format!("{} lean on {}", crate::words::pieces(pieces), self.0);
            Told {
                severity: self.1,
                ..Told::note("leaning", sentence).by(&["pieces", "size"])
            }
        }

        fn renumber(&self, new: &dyn Fn(PatchId) -> PatchId) -> Option<Arc<dyn Diagnostic>> {
            Some(Arc::new(Self(new(self.0), self.1)))
        }

        fn is_unordered(&self) -> bool {
            true
        }
    }

    fn lean(severity: Severity) -> Warning {
        Warning::new(Leaning(PatchId(4), severity), vec![PatchId(0), PatchId(2)], None)
    }

    #[test]
    fn new_numbers_reach_the_pieces_of_a_warning_and_of_its_cause() {
        let reversed = lean(Severity::Note).renumber(&|PatchId(i)| PatchId(9 - i));
        assert_eq!(reversed.to_string(), "pieces 8, 10 lean on 6");
        let cause: &Leaning = reversed.cause().expect("it keeps its kind");
        assert_eq!(cause.0, PatchId(5));
        assert_ne!(reversed, lean(Severity::Note));
        assert_eq!(
            reversed.renumber(&|PatchId(i)| PatchId(9 - i)),
            lean(Severity::Note)
        );
    }

    #[test]
    fn the_most_severe_come_first_and_equal_ones_keep_their_order() {
        let all = [
            Severity::Note,
            Severity::Problem,
            Severity::Warning,
            Severity::Problem,
        ]
        .map(lean);
        let ranked = Warning::rank(&all);
        assert!(ranked.is_sorted_by_key(|w| std::cmp::Reverse(w.severity())));
        assert_eq!(ranked.len(), all.len());
    }

    #[test]
    fn each_interface_spells_the_settings_in_its_own_way() {
        let entry = WarningEntry::from(lean(Severity::Note));
        assert_eq!(
            entry.sentence_with(|name| format!("--{name}")),
            "pieces 1, 3 lean on 5 (--pieces, --size)"
        );
        let bare = WarningEntry {
            settings: Vec::new(),
            ..entry
        };
        assert_eq!(
            bare.sentence_with(|_| panic!("there is none")),
            "pieces 1, 3 lean on 5"
        );
    }
}

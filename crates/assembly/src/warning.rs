//! Warnings: what the user should know of a job that went on.

mod words;

use std::fmt;

use serde::Serialize;

use crate::PatchId;

/// Information for the user that did not stop the job, from any stage from the segmentation to the plates.
///
/// [`fmt::Display`] gives the sentence for people: what is wrong, where, and what to do. A warning is written
/// to files and JSON as `code`, `message`, `pieces` and `at`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(into = "WarningEntry")]
pub struct Warning {
    /// Cause of the warning, with its figures.
    pub cause: Cause,
    /// Pieces concerned, in the order in which the sentence names them.
    pub pieces: Vec<PatchId>,
    /// Place of the cause, mm in assembly space.
    pub at: Option<[f64; 3]>,
}

/// Severity of a warning; more severe ones compare greater.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, serde::Deserialize)]
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

/// Warning in the form that files contain.
#[derive(Clone, Debug, PartialEq, Serialize, serde::Deserialize)]
pub struct WarningEntry {
    /// Stable name for machines, for example `"seam-without-connector"`.
    pub code: String,
    /// Severity of the warning; files of former versions do not state it.
    #[serde(default)]
    pub severity: Severity,
    /// Sentence of the warning, for people.
    pub message: String,
    /// Pieces that the warning concerns.
    pub pieces: Vec<PatchId>,
    /// Place of the cause, mm.
    pub at: Option<[f64; 3]>,
}

/// Cause of a warning. Lengths in mm, areas in mm², volumes in mm³, stresses in MPa.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the sentences in `words` say what each figure is")]
pub enum Cause {
    /// A remark on the model's file, in the words of the program that read it.
    Input {
        code: &'static str,
        sentence: String,
    },
    // The wall
    StrengthUnknown {
        error: String,
        thickness_mm: f64,
    },
    WallTooWeak {
        thickness_mm: f64,
        drop_m: f64,
        stress_mpa: f64,
        strength_mpa: f64,
        most_mm: f64,
    },
    TooThinToHollow {
        n_places: usize,
        share: f64,
        thickness_mm: f64,
        largest_mm2: f64,
    },
    // The user's labels and the segmentation
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
    ShortContacts {
        from_mm: f64,
        to_mm: f64,
    },
    WeakGraph,
    DividedOtherwise,
    KeepWholeCut {
        share: f64,
    },
    // The key
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
    KeyNotCut {
        reasons: Vec<String>,
    },
    KeyWithoutRails,
    TimeUp {
        kits: usize,
    },
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
    // The plan
    ShortJoints {
        from_mm: f64,
    },
    OcclusionToleranceRaised {
        share: f64,
    },
    ComesApart,
    PieceLoose,
    BearsLittle {
        done: String,
        bears: String,
        asked: String,
        gives_way: String,
    },
    /// The wall is thinner than usual, because a thicker one leaves too little room for connectors.
    WallThinForRoom {
        thickness_mm: f64,
        usual_mm: f64,
    },
    // Changes that make a kit carry more load
    WallForUse {
        from_mm: f64,
        to_mm: f64,
        done: String,
    },
    ConnectorsForUse {
        from_mm: f64,
        to_mm: f64,
        done: String,
    },
    JoinedForUse {
        done: String,
    },
    // The bodies, connectors and pieces
    ConnectorLimited {
        pair: [PatchId; 2],
        by: SizeLimit,
        wanted_mm: f64,
        given_mm: f64,
        n_others: usize,
    },
    BodyInParts {
        dropped_mm3: f64,
    },
    PartGiven {
        given_mm3: f64,
    },
    SeamWithoutConnector {
        length_mm: f64,
    },
    PieceWithoutNumber,
    // The finished kit
    SmallOverlap {
        volume_mm3: f64,
    },
    SurfacesCross {
        by_mm: f64,
        after_mm: f64,
    },
    ThinPlaces {
        n_sheets: usize,
        n_slots: usize,
        longest_mm: f64,
        thickness_mm: f64,
        is_slot: bool,
    },
    Rattles {
        loosest: EstimatedPlay,
    },
    NotProven {
        figures: Vec<EstimatedPlay>,
        is_searched: bool,
    },
    PieceTooLarge {
        printer: String,
    },
    LettersNotPrinted {
        letters: String,
    },
    Failed {
        finding: String,
    },
}

/// Limit that keeps connectors small.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SizeLimit {
    /// The seam is too short.
    Seam,
    /// The cavity is too narrow.
    Cavity,
}

/// Estimated play of a piece, as far as it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatedPlay {
    /// Greatest displacement of any point of the piece, mm.
    pub translation_mm: f64,
    /// Greatest rotation of the piece, degrees.
    pub rotation_deg: f64,
}

impl Warning {
    /// Stable name for machines, for example `"seam-without-connector"`.
    pub fn code(&self) -> &'static str {
        self.told().code
    }

    /// Severity of the warning, by its cause.
    pub fn severity(&self) -> Severity {
        self.told().severity
    }

    /// Moves the warning's place to another frame by `turn`.
    pub fn turned(self, turn: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        Self {
            at: self.at.map(turn),
            ..self
        }
    }

    /// Sorts warnings by severity, the most severe first; equal ones keep their order.
    pub fn ranked(warnings: &[Self]) -> Vec<Self> {
        let mut ranked = warnings.to_vec();
        ranked.sort_by_key(|w| std::cmp::Reverse(w.severity()));
        ranked
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.told().sentence)
    }
}

impl From<Warning> for WarningEntry {
    fn from(warning: Warning) -> Self {
        let told = warning.told();
        Self {
            code: told.code.to_owned(),
            severity: told.severity,
            message: told.sentence,
            pieces: warning.pieces,
            at: warning.at,
        }
    }
}

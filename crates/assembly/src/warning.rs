//! What the user should know of a job that went on: every warning's code and words stand here.

use std::fmt;

use serde::Serialize;

use crate::PatchId;

/// Something the user should know that did not stop the job, of all stages from the segmentation to the plates.
///
/// [`fmt::Display`] is the sentence for people: what, where, what to do. It is written to files and JSON as
/// `code`, `message`, `pieces` and `at`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(into = "WarningEntry")]
pub struct Warning {
    /// What it is about, with its figures.
    pub cause: Cause,
    /// The pieces it concerns, in the order in which the sentence names them.
    pub pieces: Vec<PatchId>,
    /// Where, mm in assembly space.
    pub at: Option<[f64; 3]>,
}

/// A warning as it stands in files.
#[derive(Clone, Debug, PartialEq, Serialize, serde::Deserialize)]
pub struct WarningEntry {
    /// Stable name for machines, for example `"seam-without-connector"`.
    pub code: String,
    /// The sentence.
    pub message: String,
    /// The pieces it concerns.
    pub pieces: Vec<PatchId>,
    /// Where, mm.
    pub at: Option<[f64; 3]>,
}

/// What a warning is about. Lengths in mm, areas in mm², volumes in mm³, stresses in MPa.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the sentences in `told` say what each figure is")]
pub enum Cause {
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
    // What was changed so that a kit bears more
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
    NotProven {
        figures: Vec<EstimatedPlay>,
        is_searched: bool,
    },
    PieceTooLarge {
        printer: String,
    },
    Failed {
        finding: String,
    },
}

/// What keeps connectors small.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SizeLimit {
    /// The seam is too short.
    Seam,
    /// The cavity is too narrow.
    Cavity,
}

/// How far a piece can be moved, as far as is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatedPlay {
    /// Of any of its points, mm.
    pub translation_mm: f64,
    /// By how much it turns, degrees.
    pub rotation_deg: f64,
}

impl Warning {
    /// Stable name for machines, for example `"seam-without-connector"`.
    pub fn code(&self) -> &'static str {
        self.told().0
    }

    /// Moved to another frame by `turn`.
    pub fn turned(self, turn: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        Self {
            at: self.at.map(turn),
            ..self
        }
    }

    /// "3, 5".
    fn ids(&self) -> String {
        let ids: Vec<String> = self.pieces.iter().map(ToString::to_string).collect();
        ids.join(", ")
    }

    /// Of the piece that the sentence names first, or of the one after it.
    fn id(&self, i: usize) -> String {
        self.pieces.get(i).map_or_else(|| "?".into(), ToString::to_string)
    }

    /// The code and the sentence of each cause, in one table.
    #[expect(clippy::too_many_lines, reason = "a table, one row for each cause")]
    fn told(&self) -> (&'static str, String) {
        let (first, second) = (self.id(0), self.id(1));
        match &self.cause {
            Cause::StrengthUnknown { error, thickness_mm } => (
                "strength-unknown",
                format!(
                    "what the wall bears could not be computed ({error}): it is {thickness_mm:.2} mm thick, and connectors are sized as if nothing pressed on them"
                ),
            ),
            Cause::WallTooWeak {
                thickness_mm,
                drop_m,
                stress_mpa,
                strength_mpa,
                most_mm,
            } => (
                "wall-too-weak",
                format!(
                    "a wall of {thickness_mm:.2} mm does not bear a fall from {drop_m} m: {stress_mpa:.0} MPa, and the material \
                     bears {strength_mpa:.0}; a wall up to {most_mm:.1} mm helps little"
                ),
            ),
            Cause::TooThinToHollow {
                n_places,
                share,
                thickness_mm,
                largest_mm2,
            } => (
                "too-thin-to-hollow",
                format!(
                    "{n_places} place(s) ({:.1} % of the surface) have no cavity between two walls of {thickness_mm:.2} mm, as \
                     they are thin or at a sharp edge: they are solid and have no connectors; the largest has {largest_mm2:.0} mm²",
                    100.0 * share
                ),
            ),
            Cause::LabelSplit { label, area_mm2 } => (
                "label-split",
                format!(
                    "label {label} has parts that do not touch: {area_mm2:.0} mm² become a piece of their own"
                ),
            ),
            Cause::LabelIslands {
                n: 1,
                largest_mm2,
                largest_label,
                ..
            } => (
                "label-island",
                format!(
                    "{largest_mm2:.1} mm² of label {largest_label} lie apart and join the patch around them"
                ),
            ),
            Cause::LabelIslands {
                n,
                area_mm2,
                largest_mm2,
                largest_label,
            } => (
                "label-island",
                format!(
                    "{n} islands of labels, {area_mm2:.1} mm² in all, lie apart and join the patches around them; the largest \
                     has {largest_mm2:.1} mm² of label {largest_label}"
                ),
            ),
            Cause::LabelMerged {
                label,
                area_mm2,
                n_triangles,
                least_mm2,
            } => (
                "label-merged",
                format!(
                    "label {label} has only {area_mm2:.1} mm² in {n_triangles} triangles and joins its neighbour; pieces need \
                     {least_mm2} mm²"
                ),
            ),
            Cause::LabelsDivided { into } => {
                let line = |(label, pieces): &(i64, Vec<PatchId>)| {
                    format!("label {label} into {}", in_words(pieces))
                };
                let all: Vec<String> = into.iter().map(line).collect();
                (
                    "piece-split",
                    format!(
                        "divided: {}. A piece that alone holds others lets them slide off together, and one that runs around a \
                         limb or has holes cannot be put on",
                        all.join(", ")
                    ),
                )
            }
            Cause::LabelsJoined { labels } => {
                let labels: Vec<String> = labels.iter().map(ToString::to_string).collect();
                (
                    "piece-joined",
                    format!(
                        "labels {} are one piece, {}: the seams between them or around them are too short to hold two pieces",
                        labels.join(", "),
                        self.ids()
                    ),
                )
            }
            Cause::ShortContacts { from_mm, to_mm } => (
                "short-contacts",
                format!(
                    "{} have seams of {from_mm:.0} to {to_mm:.0} mm that must hold, so their joints are short; a larger size or \
                     smaller connectors make them firmer",
                    in_words(&self.pieces)
                ),
            ),
            Cause::WeakGraph => (
                "weak-graph",
                format!(
                    "{} alone hold{} others, which may come loose: give other labels, smaller connectors or a larger size",
                    in_words(&self.pieces),
                    if self.pieces.len() == 1 { "s" } else { "" }
                ),
            ),
            Cause::KeepWholeCut { share } => (
                "keep-whole-cut",
                format!(
                    "a region to keep whole is divided: {:.0} % of it is in one piece ({}); give a smaller region, or one that \
                     ends in creases",
                    100.0 * share,
                    in_words(&self.pieces)
                ),
            ),
            Cause::KeyNotFlat {
                flat_share,
                least_share,
                off_mm,
                may_be_cut,
            } => (
                "key-not-flat",
                format!(
                    "the key, piece {first}, is curved, so it may sit loosely: {:.0} % of it lies in a plane ({:.0} % would do), and \
                     it is {off_mm:.1} mm off at the farthest; give it a flatter place{}",
                    100.0 * flat_share,
                    100.0 * least_share,
                    or_cut(*may_be_cut)
                ),
            ),
            Cause::KeyNotStraight {
                straight_mm,
                least_mm,
                may_be_cut,
            } => (
                "key-not-straight",
                format!(
                    "no side of the key, piece {first}, is straight along its way out for the {least_mm:.0} mm that rails need \
                     (longest: {straight_mm:.1} mm), so friction alone holds it; draw straight seams along its way out{}",
                    or_cut(*may_be_cut)
                ),
            ),
            Cause::KeyNotCut { reasons } => (
                "key-not-cut",
                format!(
                    "piece {first} is the key as it is, without rails: {}",
                    reasons.join("; ")
                ),
            ),
            Cause::TimeUp { kits } => (
                "time-up",
                format!(
                    "the time was over (--time) after {kits} {}: this is the best of them; on a faster computer, or with more time, it may be another",
                    if *kits == 1 { "kit" } else { "kits" }
                ),
            ),
            Cause::KeyWithoutRails => (
                "key-without-rails",
                format!(
                    "piece {first} is the key, but nothing straight runs under its sides: it slides along its plane without rails \
                     and is held by its other connectors"
                ),
            ),
            Cause::KeyWithoutRibs => (
                "key-without-ribs",
                format!(
                    "the key, piece {first}, has no rails, and no side on which ribs could stand: nothing but tight walls keeps it in"
                ),
            ),
            Cause::KeyWithoutGrip => (
                "key-without-grip",
                format!(
                    "piece {first} has no notch to pull it out by: its surface has no even place of 12 × 3 mm in the middle"
                ),
            ),
            Cause::KeyRibs {
                n,
                interference_mm,
                travel_mm,
            } => (
                "key-ribs",
                format!(
                    "the key has no rails: {n} ribs on its sides press by {interference_mm:.2} mm on the last {travel_mm:.1} mm of \
                     its way, on purpose, so that it stays in; file them down if it is too tight; the proofs of free paths are \
                     without them"
                ),
            ),
            Cause::Detent {
                interference_mm,
                travel_mm,
            } => (
                "detent",
                format!(
                    "on the last {travel_mm:.1} mm of its way the key is pressed past a bump of piece {first} that is \
                     {interference_mm:.2} mm too high for its groove, on purpose: it clicks; the proofs of free paths are without it"
                ),
            ),
            Cause::ShortJoints { from_mm } => (
                "short-joints",
                format!(
                    "no plan locks with long joints alone, so joints from {from_mm:.1} mm on count too; they hold less firmly"
                ),
            ),
            Cause::OcclusionToleranceRaised { share } => (
                "occlusion-tolerance-raised",
                format!(
                    "no plan leaves all paths free; pieces may now overlap by {} % on their way, which carving must absorb",
                    100.0 * share
                ),
            ),
            Cause::ComesApart => (
                "comes-apart",
                format!(
                    "in the simulation without friction these pieces can be pulled apart: {}",
                    self.ids()
                ),
            ),
            Cause::BearsLittle {
                done,
                bears,
                asked,
                gives_way,
            } => (
                "bears-little",
                format!(
                    "where the kit is {done} it bears {bears}, not {asked}: {gives_way} between pieces {first} and {second}; by \
                     simulation, without a print to compare; handle it with care there, print it larger, or choose fewer pieces \
                     (--pieces)"
                ),
            ),
            Cause::DividedOtherwise => (
                "divided-otherwise",
                "no kit of pieces that are cut where a person would cut holds together; these are of similar size, and their seams \
                 may run through a face: your own labels, or another number of pieces (--pieces), may do better"
                    .to_owned(),
            ),
            Cause::WallForUse { from_mm, to_mm, done } => (
                "wall-for-use",
                format!(
                    "walls are {to_mm:.1} mm thick where {from_mm:.1} mm bear a fall, so that seams stay closed where the kit is \
                     {done}; --thickness {from_mm:.1} leaves that out"
                ),
            ),
            Cause::ConnectorsForUse { from_mm, to_mm, done } => (
                "connectors-for-use",
                format!(
                    "connectors between pieces {first} and {second} are {to_mm:.1} mm instead of {from_mm:.1} mm, so that their seam \
                     stays closed where the kit is {done}"
                ),
            ),
            Cause::JoinedForUse { done } => (
                "joined-for-use",
                format!(
                    "two pieces are one here, since the seam between them would give way where the kit is {done}"
                ),
            ),
            Cause::PieceLoose => (
                "piece-loose",
                format!(
                    "some push moves piece {} and hardly any connector stops it; make more pieces, or divide the model otherwise",
                    self.id(0)
                ),
            ),
            Cause::ConnectorLimited {
                pair: [a, b],
                by,
                wanted_mm,
                given_mm,
                n_others,
            } => {
                let (why, remedy) = by.words();
                let others = match n_others {
                    0 => String::new(),
                    1 => ", and so for one other pair".to_owned(),
                    n => format!(", and so for {n} other pairs"),
                };
                (
                    "connector-limited",
                    format!(
                        "connectors between pieces {a} and {b} are {given_mm:.1} mm where the stress asks for \
                         {wanted_mm:.1} mm, because {why}{others}; {remedy}"
                    ),
                )
            }
            Cause::BodyInParts { dropped_mm3 } => (
                "body-in-parts",
                format!(
                    "piece {first}: fragments of {dropped_mm3:.1} mm³ were cut off from its body and dropped"
                ),
            ),
            Cause::SeamWithoutConnector { length_mm } => (
                "seam-without-connector",
                format!(
                    "the seam of {length_mm:.0} mm between pieces {first} and {second} has no connector; other seams hold these \
                     pieces"
                ),
            ),
            Cause::PieceWithoutNumber => (
                "piece-without-number",
                format!(
                    "no number is engraved on piece {}: the inner side has no even place of the wall's full thickness that is \
                     large enough; tell these pieces by their pictures",
                    self.ids()
                ),
            ),
            Cause::SmallOverlap { volume_mm3 } => (
                "small-overlap",
                format!(
                    "pieces {first} and {second} overlap by {volume_mm3:.3} mm³; sand the joint if it is tight"
                ),
            ),
            Cause::SurfacesCross { by_mm, after_mm } => (
                "surfaces-cross",
                format!(
                    "pieces {first} and {second} cross by {by_mm:.2} mm after {after_mm:.1} mm of the way of the first; it will rub \
                     there: sand it a little"
                ),
            ),
            Cause::ThinPlaces {
                n_sheets,
                n_slots,
                longest_mm,
                thickness_mm,
                is_slot,
            } => {
                let (kind, end) = if *is_slot {
                    ("slot", "wide")
                } else {
                    ("sheet", "thick")
                };
                let count = |n: usize, what: &str, risk: &str| match n {
                    0 => None,
                    1 => Some(format!("a {what}, which may {risk}")),
                    n => Some(format!("{n} {what}s, which may {risk}")),
                };
                let places = [
                    count(*n_sheets, "thin sheet", "break off"),
                    count(*n_slots, "hair slot", "fuse"),
                ];
                let places: Vec<String> = places.into_iter().flatten().collect();
                let have = if self.pieces.len() == 1 { "has" } else { "have" };
                (
                    "thin-places",
                    format!(
                        "{} {have} {}; the longest is a {kind} of {longest_mm:.0} mm, {thickness_mm:.2} mm {end}; look there \
                         before you assemble",
                        in_words(&self.pieces),
                        places.join(", and ")
                    ),
                )
            }
            Cause::NotProven { figures, is_searched } => {
                ("not-proven", self.not_proven(figures, *is_searched))
            }
            Cause::PieceTooLarge { printer } => {
                let ids = self.ids();
                let what = match self.pieces.len() {
                    1 => format!("piece {ids} does not fit the printer {printer}; it is"),
                    _ => format!("pieces {ids} do not fit the printer {printer}; they are"),
                };
                (
                    "piece-too-large",
                    format!(
                        "{what} left out of plates.3mf: choose more pieces (--pieces) or another printer"
                    ),
                )
            }
            Cause::Failed { finding } => ("failed", format!("do not print this kit: {finding}")),
        }
    }

    fn not_proven(&self, figures: &[EstimatedPlay], is_searched: bool) -> String {
        let line = |(id, play): (&PatchId, &EstimatedPlay)| {
            format!(
                "{id} (about {:.1} mm, {:.1}°)",
                play.translation_mm, play.rotation_deg
            )
        };
        let list: Vec<String> = self.pieces.iter().zip(figures).map(line).collect();
        let search = if is_searched {
            "; no way to take out one that is not the key was found"
        } else {
            ""
        };
        format!(
            "how far these pieces can be moved within the clearance is estimated, not proven: {}{search}",
            list.join(", ")
        )
    }
}

impl SizeLimit {
    /// Why, and what helps.
    fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::Seam => (
                "their seam is too short for larger ones",
                "fewer pieces have longer seams",
            ),
            Self::Cavity => (
                "the cavity is too narrow for larger ones",
                "thinner walls or a larger model make room",
            ),
        }
    }
}

/// What to do about a key that was chosen, where it could be cut instead.
fn or_cut(may_be_cut: bool) -> &'static str {
    if may_be_cut {
        ", or let the key be cut (--key auto)"
    } else {
        ""
    }
}

/// "piece 3", "pieces 3, 5".
fn in_words(pieces: &[PatchId]) -> String {
    let ids: Vec<String> = pieces.iter().map(ToString::to_string).collect();
    format!(
        "piece{} {}",
        if ids.len() == 1 { "" } else { "s" },
        ids.join(", ")
    )
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.told().1)
    }
}

impl From<Warning> for WarningEntry {
    fn from(warning: Warning) -> Self {
        let (code, message) = warning.told();
        Self {
            code: code.to_owned(),
            message,
            pieces: warning.pieces,
            at: warning.at,
        }
    }
}

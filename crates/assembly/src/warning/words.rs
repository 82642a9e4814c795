//! Code, severity and sentence of every warning: what is wrong, where, and what to do.

use super::{Cause, EstimatedPlay, Severity, SizeLimit, Warning};
use crate::PatchId;

/// Ratio of a wall's stress to the material's strength from which the wall breaks in the fall that it was
/// designed for.
const MUCH_TOO_WEAK: f64 = 2.0;

/// Code, severity and sentence of one warning.
pub(super) struct Told {
    pub code: &'static str,
    pub severity: Severity,
    pub sentence: String,
}

fn note(code: &'static str, sentence: String) -> Told {
    Told {
        code,
        severity: Severity::Note,
        sentence,
    }
}

fn warning(code: &'static str, sentence: String) -> Told {
    Told {
        severity: Severity::Warning,
        ..note(code, sentence)
    }
}

fn problem(code: &'static str, sentence: String) -> Told {
    Told {
        severity: Severity::Problem,
        ..note(code, sentence)
    }
}

fn letters_not_printed(letters: &str) -> String {
    /// Letters that the sentence shows.
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

impl Warning {
    /// Ids of the pieces, such as "3, 5".
    fn ids(&self) -> String {
        let ids: Vec<String> = self.pieces.iter().map(ToString::to_string).collect();
        ids.join(", ")
    }

    /// Id of the piece at index `i` in the sentence; "?" if there is none.
    fn id(&self, i: usize) -> String {
        self.pieces.get(i).map_or_else(|| "?".into(), ToString::to_string)
    }

    /// One table, with a row for each cause, in the order of the stages.
    #[expect(clippy::too_many_lines, reason = "a table, one row for each cause")]
    pub(super) fn told(&self) -> Told {
        let (first, second) = (self.id(0), self.id(1));
        match &self.cause {
            Cause::Input { code, sentence } => warning(code, sentence.clone()),
            // The wall
            Cause::StrengthUnknown { error, thickness_mm } => warning(
                "strength-unknown",
                format!(
                    "what the wall of {thickness_mm:.2} mm bears is not known ({error}); handle the kit \
                     with care"
                ),
            ),
            Cause::WallTooWeak {
                thickness_mm,
                drop_m,
                stress_mpa,
                strength_mpa,
                most_mm,
            } => {
                let thicker = if most_mm > thickness_mm {
                    format!(", and walls up to {most_mm:.1} mm help little")
                } else {
                    String::new()
                };
                let tell = if stress_mpa >= &(MUCH_TOO_WEAK * strength_mpa) {
                    problem
                } else {
                    warning
                };
                tell(
                    "wall-too-weak",
                    format!(
                        "the wall of {thickness_mm:.1} mm breaks in a fall from {drop_m} m: its stress is \
                         {:.1} times what the material bears{thicker}; print it larger, or do not drop it",
                        stress_mpa / strength_mpa
                    ),
                )
            }
            Cause::TooThinToHollow {
                n_places,
                share,
                thickness_mm,
                ..
            } => note(
                "too-thin-to-hollow",
                format!(
                    "{:.1} % of the surface, in {n_places} {}, is solid and without connectors: too thin \
                     there for a hollow between walls of {thickness_mm:.2} mm",
                    100.0 * share,
                    if *n_places == 1 { "place" } else { "places" }
                ),
            ),
            Cause::WallThinForRoom {
                thickness_mm,
                usual_mm,
            } => note(
                "wall-thin-for-room",
                format!(
                    "walls are {thickness_mm:.1} mm thick and not {usual_mm:.1}, as connectors have little \
                     room in a model so thin; a larger --size has room for both"
                ),
            ),
            Cause::WallForUse { from_mm, to_mm, done } => note(
                "wall-for-use",
                format!(
                    "walls are {to_mm:.1} mm thick where {from_mm:.1} mm bear a fall, so that seams stay \
                     closed where the kit is {done}; --thickness {from_mm:.1} leaves that out"
                ),
            ),
            // The user's labels and the division
            Cause::LabelSplit { label, area_mm2 } => note(
                "label-split",
                format!(
                    "label {label} has parts that do not touch: {area_mm2:.0} mm² become a piece of their \
                     own"
                ),
            ),
            Cause::LabelIslands {
                n: 1,
                largest_mm2,
                largest_label,
                ..
            } => note(
                "label-island",
                format!(
                    "{largest_mm2:.1} mm² of label {largest_label} lie apart and join the piece around them"
                ),
            ),
            Cause::LabelIslands {
                n,
                area_mm2,
                largest_mm2,
                largest_label,
            } => note(
                "label-island",
                format!(
                    "{n} islands of labels, {area_mm2:.1} mm² in all, lie apart and join the pieces around \
                     them; the largest has {largest_mm2:.1} mm² of label {largest_label}"
                ),
            ),
            Cause::LabelMerged {
                label,
                area_mm2,
                n_triangles,
                least_mm2,
            } => warning(
                "label-merged",
                format!(
                    "label {label} has only {area_mm2:.1} mm² in {n_triangles} triangles and joins its \
                     neighbour; pieces need {least_mm2} mm²"
                ),
            ),
            Cause::LabelsDivided { into } => {
                let line = |(label, pieces): &(i64, Vec<PatchId>)| {
                    format!("label {label} into {}", in_words(pieces))
                };
                let all: Vec<String> = into.iter().map(line).collect();
                warning(
                    "piece-split",
                    format!(
                        "divided so that it locks and can be put on: {}; no piece may hold others alone, or \
                         run around a limb",
                        all.join(", ")
                    ),
                )
            }
            Cause::LabelsJoined { labels } => {
                let labels: Vec<String> = labels.iter().map(ToString::to_string).collect();
                warning(
                    "piece-joined",
                    format!(
                        "labels {} are one piece, {}: the seams between or around them are too short to \
                         hold two pieces",
                        labels.join(", "),
                        self.ids()
                    ),
                )
            }
            Cause::ShortContacts { from_mm, to_mm } => warning(
                "short-contacts",
                format!(
                    "{} hold by seams of {from_mm:.0} to {to_mm:.0} mm, so their joints are short; a larger \
                     size or smaller connectors make them firmer",
                    in_words(&self.pieces)
                ),
            ),
            Cause::WeakGraph => warning(
                "weak-graph",
                format!(
                    "{} alone hold{} others, which may come loose: give other labels, smaller connectors or \
                     a larger size",
                    in_words(&self.pieces),
                    if self.pieces.len() == 1 { "s" } else { "" }
                ),
            ),
            Cause::DividedOtherwise => warning(
                "divided-otherwise",
                "pieces are of similar size and seams may run through a face, as none cut where a person \
                 would cut hold together; try your own labels, or another number of pieces (--pieces)"
                    .to_owned(),
            ),
            Cause::KeepWholeCut { share } => warning(
                "keep-whole-cut",
                format!(
                    "a region to keep whole is divided: {:.0} % of it is in one piece ({}); give a smaller \
                     region, or one that ends in creases",
                    100.0 * share,
                    in_words(&self.pieces)
                ),
            ),
            // The key
            Cause::KeyNotFlat {
                flat_share,
                least_share,
                may_be_cut,
                ..
            } => warning(
                "key-not-flat",
                format!(
                    "the key, piece {first}, is curved and may sit loosely: {:.0} % of it lies in a plane, \
                     {:.0} % would do; give it a flatter place{}",
                    100.0 * flat_share,
                    100.0 * least_share,
                    or_cut(*may_be_cut)
                ),
            ),
            Cause::KeyNotStraight {
                straight_mm,
                least_mm,
                may_be_cut,
            } => warning(
                "key-not-straight",
                format!(
                    "friction alone holds the key, piece {first}: no side is straight along its way out for \
                     {least_mm:.0} mm (longest: {straight_mm:.1}); draw straight seams there{}",
                    or_cut(*may_be_cut)
                ),
            ),
            Cause::KeyNotCut { reasons } => warning(
                "key-not-cut",
                format!(
                    "piece {first} is the key as it is, without rails: {}",
                    shortened(reasons)
                ),
            ),
            Cause::TimeUp { kits: 0 } => warning(
                "time-up",
                "the time was over (--time); with more time the plan may be another".into(),
            ),
            Cause::TimeUp { kits } => warning(
                "time-up",
                format!(
                    "the time was over (--time) after {kits} {}, of which this is the best; with more time \
                     it may be another",
                    if *kits == 1 { "kit" } else { "kits" }
                ),
            ),
            Cause::KeyWithoutRails => note(
                "key-without-rails",
                format!(
                    "the key, piece {first}, has no rails, as nothing straight runs under its sides; its \
                     other connectors hold it"
                ),
            ),
            Cause::KeyWithoutRibs => warning(
                "key-without-ribs",
                format!(
                    "nothing but tight walls keeps the key, piece {first}, in: it has no rails, and no side \
                     for ribs; a drop of removable glue holds it"
                ),
            ),
            Cause::KeyWithoutGrip => note(
                "key-without-grip",
                format!(
                    "piece {first} has no notch to pull it out by: it has no even place of 12 × 3 mm in its \
                     middle"
                ),
            ),
            Cause::KeyRibs {
                n,
                interference_mm,
                travel_mm,
            } => note(
                "key-ribs",
                format!(
                    "{n} ribs on the key press by {interference_mm:.2} mm on the last {travel_mm:.1} mm of \
                     its way, on purpose, so that it stays in; file them down if it is too tight"
                ),
            ),
            Cause::Detent {
                interference_mm,
                travel_mm,
            } => note(
                "detent",
                format!(
                    "the key clicks past a bump of piece {first} on its last {travel_mm:.1} mm, \
                     {interference_mm:.2} mm too high for its groove on purpose"
                ),
            ),
            // The plan
            Cause::ShortJoints { from_mm } => warning(
                "short-joints",
                format!(
                    "joints from {from_mm:.1} mm on hold pieces, as none lock by longer ones alone; a \
                     larger size makes them firmer"
                ),
            ),
            Cause::OcclusionToleranceRaised { share } => warning(
                "occlusion-tolerance-raised",
                format!(
                    "no plan leaves all ways free: up to {} % of a piece is carved away where it passes \
                     another",
                    100.0 * share
                ),
            ),
            Cause::ComesApart => warning(
                "comes-apart",
                format!(
                    "without friction {} can be pulled apart, by simulation; make other pieces (--pieces) \
                     or larger connectors",
                    in_words(&self.pieces)
                ),
            ),
            Cause::BearsLittle {
                done,
                bears,
                asked,
                gives_way,
            } => warning(
                "bears-little",
                format!(
                    "{done} it bears {bears}, not {asked}: then {gives_way} between pieces {first} and \
                     {second}; handle it with care there, print it larger, or choose fewer pieces (--pieces)"
                ),
            ),
            Cause::ConnectorsForUse { from_mm, to_mm, done } => note(
                "connectors-for-use",
                format!(
                    "connectors between pieces {first} and {second} are {to_mm:.1} mm instead of \
                     {from_mm:.1} mm, so that their seam stays closed where the kit is {done}"
                ),
            ),
            Cause::JoinedForUse { done } => note(
                "joined-for-use",
                format!(
                    "two pieces are one here, since the seam between them would give way where the kit is \
                     {done}"
                ),
            ),
            Cause::PieceLoose => warning(
                "piece-loose",
                format!(
                    "some push moves piece {first} and hardly any connector stops it; make more pieces, or \
                     divide the model otherwise"
                ),
            ),
            // The bodies and their connectors
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
                note(
                    "connector-limited",
                    format!(
                        "connectors between pieces {a} and {b} are {given_mm:.1} mm where {wanted_mm:.1} mm \
                         would bear more, because {why}{others}; {remedy}"
                    ),
                )
            }
            Cause::BodyInParts { dropped_mm3 } => warning(
                "body-in-parts",
                format!(
                    "piece {first} lacks {dropped_mm3:.1} mm³ that hung on nothing and were dropped: fill \
                     the gap, or divide the model otherwise there"
                ),
            ),
            Cause::PartGiven { given_mm3 } => {
                let to = self
                    .pieces
                    .get(1)
                    .map_or_else(String::new, |to| format!(" and went to piece {to}"));
                warning(
                    "part-given",
                    format!(
                        "{given_mm3:.0} mm³ of piece {first} came off it where seams meet{to}, though \
                         colours show it as piece {first}'s; see that they fit there"
                    ),
                )
            }
            Cause::SeamWithoutConnector { length_mm } => note(
                "seam-without-connector",
                format!(
                    "the seam of {length_mm:.0} mm between pieces {first} and {second} has no connector; \
                     other seams hold these pieces"
                ),
            ),
            Cause::PieceWithoutNumber => note(
                "piece-without-number",
                format!(
                    "no number is engraved on {}, which {} no even place for it inside; tell {} by the \
                     pictures",
                    in_words(&self.pieces),
                    if self.pieces.len() == 1 { "has" } else { "have" },
                    if self.pieces.len() == 1 { "it" } else { "them" },
                ),
            ),
            // The finished kit
            Cause::SmallOverlap { volume_mm3 } => warning(
                "small-overlap",
                format!(
                    "pieces {first} and {second} overlap by {volume_mm3:.3} mm³; sand the joint if it is \
                     tight"
                ),
            ),
            Cause::SurfacesCross { by_mm, after_mm } => warning(
                "surfaces-cross",
                format!(
                    "piece {first} rubs on piece {second} by {by_mm:.2} mm, {after_mm:.1} mm before it \
                     sits: sand it a little there"
                ),
            ),
            Cause::ThinPlaces {
                n_sheets,
                n_slots,
                longest_mm,
                thickness_mm,
                is_slot,
            } => warning(
                "thin-places",
                format!(
                    "{} {} {}; the longest is {longest_mm:.0} mm long and {thickness_mm:.2} mm {}; look \
                     there before you assemble",
                    in_words(&self.pieces),
                    if self.pieces.len() == 1 { "has" } else { "have" },
                    thin_places(*n_sheets, *n_slots),
                    if *is_slot { "wide" } else { "thick" },
                ),
            ),
            Cause::Rattles { loosest } => warning(
                "rattles",
                format!(
                    "{} {}, by up to {:.1} mm and {:.1}°, and {} in place; a smaller clearance, fewer \
                     pieces or a larger size make {} firmer",
                    in_words(&self.pieces),
                    if self.pieces.len() == 1 {
                        "rattles"
                    } else {
                        "rattle"
                    },
                    loosest.translation_mm,
                    loosest.rotation_deg,
                    if self.pieces.len() == 1 { "stays" } else { "stay" },
                    if self.pieces.len() == 1 { "it" } else { "them" },
                ),
            ),
            Cause::NotProven { figures, is_searched } => {
                note("not-proven", self.not_proven(figures, *is_searched))
            }
            Cause::PieceTooLarge { printer } => {
                let does = if self.pieces.len() == 1 { "does" } else { "do" };
                problem(
                    "piece-too-large",
                    format!(
                        "{} {does} not fit the printer {printer} and {} left out of plates.3mf: choose more \
                         pieces (--pieces) or another printer",
                        in_words(&self.pieces),
                        if self.pieces.len() == 1 { "is" } else { "are" },
                    ),
                )
            }
            Cause::LettersNotPrinted { letters } => {
                warning("letters-not-printed", letters_not_printed(letters))
            }
            Cause::Failed { finding } => problem("failed", format!("do not print this kit: {finding}")),
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
            "; no way out was found for any but the key"
        } else {
            ""
        };
        format!(
            "how far these pieces can be wiggled is estimated, not proven: {}{search}",
            list.join(", ")
        )
    }
}

/// First of several reasons, and the number of the others.
fn shortened(reasons: &[String]) -> String {
    match reasons {
        [] => "nothing better was found".to_owned(),
        [only] => only.clone(),
        [first, rest @ ..] => format!("{first}; and {} keys more that were tried", rest.len()),
    }
}

/// Phrase such as "2 thin sheets, which may break off, and a hair slot, which may fuse".
fn thin_places(n_sheets: usize, n_slots: usize) -> String {
    let count = |n: usize, what: &str, risk: &str| match n {
        0 => None,
        1 => Some(format!("a {what}, which may {risk}")),
        n => Some(format!("{n} {what}s, which may {risk}")),
    };
    let places = [
        count(n_sheets, "thin sheet", "break off"),
        count(n_slots, "hair slot", "fuse"),
    ];
    let places: Vec<String> = places.into_iter().flatten().collect();
    places.join(", and ")
}

impl SizeLimit {
    /// Reason for the limit, and its remedy.
    fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::Seam => (
                "their seam is too short",
                "fewer pieces (--pieces) have longer seams",
            ),
            Self::Cavity => (
                "the hollow is too narrow",
                "thinner walls or a larger model make room",
            ),
        }
    }
}

/// Advice for a chosen key that could be cut instead.
fn or_cut(may_be_cut: bool) -> &'static str {
    if may_be_cut {
        ", or let the key be cut (--key auto)"
    } else {
        ""
    }
}

/// Phrase such as "piece 3" or "pieces 3, 5".
fn in_words(pieces: &[PatchId]) -> String {
    let ids: Vec<String> = pieces.iter().map(ToString::to_string).collect();
    format!(
        "piece{} {}",
        if ids.len() == 1 { "" } else { "s" },
        ids.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn id(n: u32) -> PatchId {
        PatchId(n - 1)
    }

    fn of(cause: Cause) -> Warning {
        Warning {
            cause,
            pieces: vec![id(12), id(7)],
            at: None,
        }
    }

    /// Causes with the longest sentences, with typical figures.
    fn long() -> Vec<Cause> {
        let done = || "dropped onto its feet".to_owned();
        vec![
            Cause::WallTooWeak {
                thickness_mm: 2.85,
                drop_m: 1.275,
                stress_mpa: 131.0,
                strength_mpa: 42.0,
                most_mm: 3.0,
            },
            Cause::TooThinToHollow {
                n_places: 120,
                share: 0.052,
                thickness_mm: 2.41,
                largest_mm2: 149.0,
            },
            Cause::DividedOtherwise,
            Cause::KeyWithoutRibs,
            Cause::ShortContacts {
                from_mm: 8.0,
                to_mm: 11.0,
            },
            Cause::BearsLittle {
                done: done(),
                bears: "a fall from 45 cm".into(),
                asked: "2.0 m".into(),
                gives_way: "pins bend".into(),
            },
            Cause::ConnectorsForUse {
                from_mm: 2.0,
                to_mm: 4.0,
                done: done(),
            },
            Cause::ConnectorLimited {
                pair: [id(10), id(11)],
                by: SizeLimit::Seam,
                wanted_mm: 4.0,
                given_mm: 2.0,
                n_others: 14,
            },
            Cause::BodyInParts { dropped_mm3: 12.4 },
            Cause::PartGiven { given_mm3: 1293.0 },
            Cause::WallThinForRoom {
                thickness_mm: 1.23,
                usual_mm: 1.6,
            },
            Cause::Rattles {
                loosest: EstimatedPlay {
                    translation_mm: 1.9,
                    rotation_deg: 3.9,
                },
            },
            Cause::ThinPlaces {
                n_sheets: 6,
                n_slots: 4,
                longest_mm: 8.0,
                thickness_mm: 0.19,
                is_slot: true,
            },
            Cause::PieceTooLarge {
                printer: "\"fdm\" (256 × 256 × 256 mm)".into(),
            },
            Cause::LettersNotPrinted {
                letters: "兔".repeat(255),
            },
        ]
    }

    #[test]
    fn a_sentence_is_one_line_that_can_be_read_at_once() {
        for cause in long() {
            let sentence = of(cause).told().sentence;
            assert!(
                sentence.chars().count() <= 200,
                "{}: {sentence}",
                sentence.chars().count()
            );
            assert!(!sentence.contains('\n'));
        }
    }

    #[test]
    fn a_wall_twice_too_weak_is_a_problem_and_facts_are_notes() {
        let wall = |stress_mpa: f64| {
            of(Cause::WallTooWeak {
                thickness_mm: 2.0,
                drop_m: 1.275,
                stress_mpa,
                strength_mpa: 42.0,
                most_mm: 3.0,
            })
            .severity()
        };
        assert_eq!((wall(66.0), wall(126.0)), (Severity::Warning, Severity::Problem));
        let fact = Cause::TooThinToHollow {
            n_places: 120,
            share: 0.05,
            thickness_mm: 2.0,
            largest_mm2: 9.0,
        };
        assert_eq!(of(fact).severity(), Severity::Note);
    }

    #[test]
    fn a_time_that_was_over_before_any_kit_speaks_of_the_plan_alone() {
        let sentence = |kits| of(Cause::TimeUp { kits }).told().sentence;
        assert!(!sentence(0).contains("kit"), "{}", sentence(0));
        assert!(sentence(1).contains("after 1 kit,") && sentence(2).contains("after 2 kits,"));
    }

    #[test]
    fn what_matters_most_comes_first() {
        let all: Vec<Warning> = long().into_iter().map(of).collect();
        let ranked = Warning::ranked(&all);
        assert!(ranked.is_sorted_by_key(|w| std::cmp::Reverse(w.severity())));
        assert_eq!(ranked.len(), all.len());
        let codes: Vec<&str> = ranked.iter().map(Warning::code).collect();
        assert_eq!(codes[..2], ["wall-too-weak", "piece-too-large"]);
    }
}

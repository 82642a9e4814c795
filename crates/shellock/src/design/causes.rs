//! Causes of warnings about the choices of a design. Lengths in mm.

use shellock_report::words::{number, pieces as named, plural};
use shellock_report::{Diagnostic, PatchId, Told};

/// Cause of a warning, with its figures.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the sentences below say what each figure is")]
pub enum Cause {
    StrengthUnknown {
        error: String,
        thickness_mm: f64,
    },
    DividedOtherwise,
    WallForUse {
        from_mm: f64,
        to_mm: f64,
        load: String,
    },
    JoinedForUse {
        load: String,
    },
    KeyNotCut {
        reasons: Vec<String>,
    },
    KeyWithoutRails,
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
    TimeUp {
        kits: usize,
    },
    WaysOutNotSought,
}

impl Diagnostic for Cause {
    #[expect(clippy::too_many_lines, reason = "a table, one row for each cause")]
    fn tell(&self, pieces: &[PatchId]) -> Told {
        let [first, second] = [number(pieces, 0), number(pieces, 1)];
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
                    "walls are {to_mm:.1} mm thick, so that seams stay closed when the kit is {load}; \
                     {from_mm:.1} mm are enough for a fall"
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
            Self::SurfacesCross { by_mm, after_mm } => Told::warning(
                "surfaces-cross",
                format!(
                    "piece {first} rubs on piece {second} by {by_mm:.2} mm, {after_mm:.1} mm before it is \
                     in place: sand it a little there"
                ),
            ),
            Self::ThinPlaces {
                n_sheets,
                n_slots,
                longest_mm,
                thickness_mm,
                is_slot,
            } => Told::warning(
                "thin-places",
                format!(
                    "{} {} {}; the longest is {longest_mm:.0} mm long and {thickness_mm:.2} mm {}; check \
                     before you assemble",
                    named(pieces),
                    plural(pieces.len(), "has", "have"),
                    thin_places(*n_sheets, *n_slots),
                    if *is_slot { "wide" } else { "thick" },
                ),
            ),
            Self::WaysOutNotSought => Told::warning(
                "ways-out-not-sought",
                format!(
                    "the time was over before a way out was sought for {}, whose play is not proven; with \
                     more time it is",
                    named(pieces)
                ),
            )
            .by(&["time"]),
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
            Cause::SurfacesCross {
                by_mm: 0.05,
                after_mm: 12.3,
            },
            Cause::ThinPlaces {
                n_sheets: 6,
                n_slots: 4,
                longest_mm: 8.0,
                thickness_mm: 0.19,
                is_slot: true,
            },
            Cause::TimeUp { kits: 3 },
            Cause::WaysOutNotSought,
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

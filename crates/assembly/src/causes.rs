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
    WaysOutNotSought,
}

impl Diagnostic for Cause {
    fn tell(&self, pieces: &[PatchId]) -> Told {
        let [first, second] = [number(pieces, 0), number(pieces, 1)];
        match self {
            Self::SmallOverlap { volume_mm3 } => Told::warning(
                "small-overlap",
                format!(
                    "pieces {first} and {second} overlap by {volume_mm3:.3} mm³; sand the joint if it is \
                     tight"
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
            Cause::SmallOverlap { volume_mm3: 0.123 },
            Cause::Rattles {
                loosest: EstimatedPlay {
                    translation_mm: 1.9,
                    rotation_deg: 13.9,
                },
            },
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
}

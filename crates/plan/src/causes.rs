//! Causes of warnings about plans and connector sizes. Lengths in mm.

use std::sync::Arc;

use shellock_report::words::number;
use shellock_report::{Diagnostic, PatchId, Told};

/// Cause of a warning, with its figures.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the sentences below say what each figure is")]
pub enum Cause {
    ShortJoints {
        from_mm: f64,
    },
    OcclusionToleranceRaised {
        share: f64,
    },
    ConnectorLimited {
        pair: [PatchId; 2],
        by: SizeLimit,
        wanted_mm: f64,
        given_mm: f64,
        n_others: usize,
    },
    ConnectorsForUse {
        from_mm: f64,
        to_mm: f64,
        load: String,
    },
}

impl Diagnostic for Cause {
    fn tell(&self, pieces: &[PatchId]) -> Told {
        match self {
            Self::ShortJoints { from_mm } => Told::warning(
                "short-joints",
                format!(
                    "some pieces are held by joints of only {from_mm:.1} mm, since longer ones alone do not \
                     lock them; a larger model has longer joints"
                ),
            )
            .by(&["size"]),
            Self::OcclusionToleranceRaised { share } => Told::warning(
                "occlusion-tolerance-raised",
                format!(
                    "no plan leaves all ways out free: up to {} % of a piece is carved away where it passes \
                     another",
                    100.0 * share
                ),
            ),
            Self::ConnectorLimited {
                pair: [a, b],
                by,
                wanted_mm,
                given_mm,
                n_others,
            } => {
                let (why, remedy, settings) = by.words();
                let others = match n_others {
                    0 => String::new(),
                    1 => ", as for one other pair".to_owned(),
                    n => format!(", as for {n} other pairs"),
                };
                Told::note(
                    "connector-limited",
                    format!(
                        "connectors between pieces {a} and {b} are {given_mm:.1} mm where {wanted_mm:.1} mm \
                         would be stronger, because {why}{others}; {remedy}"
                    ),
                )
                .by(settings)
            }
            Self::ConnectorsForUse { from_mm, to_mm, load } => Told::note(
                "connectors-for-use",
                format!(
                    "connectors between pieces {} and {} are {to_mm:.1} mm instead of {from_mm:.1} mm, so \
                     that their seam stays closed when the kit is {load}",
                    number(pieces, 0),
                    number(pieces, 1)
                ),
            ),
        }
    }

    fn renumber(&self, new: &dyn Fn(PatchId) -> PatchId) -> Option<Arc<dyn Diagnostic>> {
        let mut renumbered = self.clone();
        let Self::ConnectorLimited { pair, .. } = &mut renumbered else {
            return None;
        };
        *pair = pair.map(new);
        Some(Arc::new(renumbered))
    }
}

/// Limit that keeps connectors small.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SizeLimit {
    /// The seam is too short.
    Seam,
    /// The cavity is too narrow.
    Cavity,
}

impl SizeLimit {
    /// Reason for the limit, its remedy, and the settings for that.
    fn words(self) -> (&'static str, &'static str, &'static [&'static str]) {
        match self {
            Self::Seam => (
                "their seam is too short",
                "fewer pieces have longer seams",
                &["pieces"],
            ),
            Self::Cavity => (
                "the hollow is too narrow",
                "thinner walls or a larger model make room",
                &["thickness", "size"],
            ),
        }
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
            Cause::ShortJoints { from_mm: 2.5 },
            Cause::OcclusionToleranceRaised { share: 0.05 },
            Cause::ConnectorLimited {
                pair: pieces,
                by: SizeLimit::Cavity,
                wanted_mm: 4.0,
                given_mm: 2.0,
                n_others: 14,
            },
            Cause::ConnectorsForUse {
                from_mm: 2.0,
                to_mm: 4.0,
                load: "dropped onto its feet".into(),
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

    #[test]
    fn a_pair_that_a_cause_names_gets_new_numbers() {
        let cause = Cause::ConnectorLimited {
            pair: [PatchId(0), PatchId(1)],
            by: SizeLimit::Seam,
            wanted_mm: 4.0,
            given_mm: 2.0,
            n_others: 0,
        };
        let new = cause
            .renumber(&|PatchId(i)| PatchId(i + 7))
            .expect("it names pieces");
        assert!(new.tell(&[]).sentence.contains("pieces 8 and 9"));
        assert!(
            Cause::ShortJoints { from_mm: 1.0 }
                .renumber(&|piece| piece)
                .is_none()
        );
    }
}

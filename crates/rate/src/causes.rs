//! Causes of warnings about walls, and about the loads that a plan carries. Lengths in mm, areas in mm²,
//! stresses in MPa.

use shellock_report::words::{number, pieces as named, plural};
use shellock_report::{Diagnostic, PatchId, Told};

/// Ratio of a wall's stress to the material's strength from which the wall breaks in the fall that it was
/// designed for.
const MUCH_TOO_WEAK: f64 = 2.0;

/// Cause of a warning, with its figures.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the sentences below say what each figure is")]
pub enum Cause {
    WallTooWeak {
        thickness_mm: f64,
        drop_m: f64,
        stress_mpa: f64,
        strength_mpa: f64,
        /// Thickness up to which a search found every wall too weak, mm.
        as_weak_up_to_mm: Option<f64>,
    },
    TooThinToHollow {
        n_places: usize,
        share: f64,
        thickness_mm: f64,
        largest_mm2: f64,
    },
    /// The wall is thinner than usual, because a thicker one leaves too little room for connectors.
    WallThinForRoom {
        thickness_mm: f64,
        usual_mm: f64,
    },
    ComesApart,
    PieceLoose,
    BearsLittle {
        load: String,
        bears: String,
        requirement: String,
        gives_way: String,
    },
}

impl Diagnostic for Cause {
    #[expect(clippy::too_many_lines, reason = "a table, one row for each cause")]
    fn tell(&self, pieces: &[PatchId]) -> Told {
        match self {
            Self::WallTooWeak {
                thickness_mm,
                drop_m,
                stress_mpa,
                strength_mpa,
                as_weak_up_to_mm,
            } => {
                let thicker = as_weak_up_to_mm
                    .filter(|most_mm| most_mm > thickness_mm)
                    .map_or_else(String::new, |most_mm| {
                        format!(", as do all walls up to {most_mm:.1} mm")
                    });
                let tell = if stress_mpa >= &(MUCH_TOO_WEAK * strength_mpa) {
                    Told::problem
                } else {
                    Told::warning
                };
                tell(
                    "wall-too-weak",
                    format!(
                        "the wall of {thickness_mm:.1} mm breaks in a fall from {drop_m} m{thicker}: its \
                         stress is {:.1} times the material's strength; print it larger, or do not drop it",
                        stress_mpa / strength_mpa
                    ),
                )
                .by(&["size"])
            }
            Self::TooThinToHollow {
                n_places,
                share,
                thickness_mm,
                ..
            } => Told::note(
                "too-thin-to-hollow",
                format!(
                    "{:.1} % of the surface, in {n_places} {}, is solid and without connectors: too thin \
                     there for a hollow between walls of {thickness_mm:.2} mm",
                    100.0 * share,
                    plural(*n_places, "place", "places")
                ),
            ),
            Self::WallThinForRoom {
                thickness_mm,
                usual_mm,
            } => Told::note(
                "wall-thin-for-room",
                format!(
                    "walls are {thickness_mm:.1} mm thick instead of {usual_mm:.1} mm, to leave room for \
                     connectors in so thin a model; a larger model has room for both"
                ),
            )
            .by(&["size"]),
            Self::ComesApart => Told::warning(
                "comes-apart",
                format!(
                    "in the simulation, {} can be pulled apart when there is no friction; change the number \
                     of pieces, or make connectors larger",
                    named(pieces)
                ),
            )
            .by(&["pieces", "connector"]),
            Self::PieceLoose => Told::warning(
                "piece-loose",
                format!(
                    "piece {} can be pushed out of place, since hardly any connector stops it; make more \
                     pieces, or divide the model otherwise",
                    number(pieces, 0)
                ),
            )
            .by(&["pieces"]),
            Self::BearsLittle {
                load,
                bears,
                requirement,
                gives_way,
            } => Told::warning(
                "bears-little",
                format!(
                    "{load} the kit withstands {bears}, not {requirement}: then {gives_way} between \
                     pieces {} and {}; handle it with care there, print it larger, or make fewer pieces",
                    number(pieces, 0),
                    number(pieces, 1)
                ),
            )
            .by(&["size", "pieces"]),
        }
    }

    fn is_unordered(&self) -> bool {
        matches!(self, Self::ComesApart)
    }
}

#[cfg(test)]
mod tests {
    use shellock_report::{LONGEST_SENTENCE, Severity};

    use super::*;

    #[test]
    fn sentences_can_be_read_at_once() {
        let pieces = [PatchId(11), PatchId(6)];
        for cause in [
            Cause::WallTooWeak {
                thickness_mm: 2.85,
                drop_m: 1.275,
                stress_mpa: 131.0,
                strength_mpa: 42.0,
                as_weak_up_to_mm: Some(3.0),
            },
            Cause::TooThinToHollow {
                n_places: 120,
                share: 0.052,
                thickness_mm: 2.41,
                largest_mm2: 149.0,
            },
            Cause::WallThinForRoom {
                thickness_mm: 1.23,
                usual_mm: 1.6,
            },
            Cause::ComesApart,
            Cause::PieceLoose,
            Cause::BearsLittle {
                load: "dropped onto its feet".into(),
                bears: "a fall from 45 cm".into(),
                requirement: "2.0 m".into(),
                gives_way: "pins bend".into(),
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
    fn a_wall_twice_too_weak_is_a_problem_and_a_fact_is_a_note() {
        let severity = |stress_mpa: f64| {
            let wall = Cause::WallTooWeak {
                thickness_mm: 2.0,
                drop_m: 1.275,
                stress_mpa,
                strength_mpa: 42.0,
                as_weak_up_to_mm: Some(3.0),
            };
            wall.tell(&[]).severity
        };
        assert_eq!(
            (severity(66.0), severity(126.0)),
            (Severity::Warning, Severity::Problem)
        );
        let fact = Cause::TooThinToHollow {
            n_places: 120,
            share: 0.05,
            thickness_mm: 2.0,
            largest_mm2: 9.0,
        };
        assert_eq!(fact.tell(&[]).severity, Severity::Note);
    }
}

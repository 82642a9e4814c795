//! Findings as sentences for people.

use std::fmt::{Display, Formatter, Result};

use super::{Finding, Motion, Play};

/// Wording of places and directions in messages.
pub trait PlaceWords {
    /// Phrase for a place, such as "at (1.0, 2.0, 3.0) mm" or "left front, 42 mm up".
    fn place(&self, at: [f64; 3]) -> String;
    /// Phrase for a direction, such as "along (1.00, 0.00, 0.00)" or "to the left".
    fn way(&self, along: [f64; 3]) -> String;
}

/// Wording of places and directions as figures, mm in assembly space.
pub struct Coordinates;

impl PlaceWords for Coordinates {
    fn place(&self, [x, y, z]: [f64; 3]) -> String {
        format!("at ({x:.1}, {y:.1}, {z:.1}) mm")
    }

    fn way(&self, [x, y, z]: [f64; 3]) -> String {
        format!("along ({x:.2}, {y:.2}, {z:.2})")
    }
}

impl Display for Finding {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        f.write_str(&self.describe(&Coordinates))
    }
}

impl Finding {
    /// Sentence about the finding, with places worded by `words`.
    pub fn describe(&self, words: &dyn PlaceWords) -> String {
        match self {
            Self::PlanBroken { piece } => format!("the plan does not name piece {piece} exactly once"),
            Self::NotClosed { piece } => {
                format!("piece {piece} is not closed: it has holes, or is inside out")
            }
            Self::SharedEdges { piece, count, at } => format!(
                "{count} edges of piece {piece} have more than two triangles, first {}",
                words.place(*at)
            ),
            Self::Folded { piece, area_mm2, at } => format!(
                "the surface of piece {piece} folds back on itself: {area_mm2:.1} mm² have material right in \
                 front of them, first {}; another number of pieces may avoid it",
                words.place(*at)
            ),
            Self::SeveralBodies { piece, count } => format!("piece {piece} falls into {count} bodies"),
            Self::Hanging {
                piece, width_mm, at, ..
            } => format!(
                "a part of piece {piece} hangs on a neck thinner than {width_mm:.1} mm and may break off, \
                 {}; another number of pieces may avoid it",
                words.place(*at)
            ),
            Self::Overlap { a, b, volume_mm3, at } => format!(
                "pieces {a} and {b} overlap by {volume_mm3:.2} mm³ {}",
                words.place(*at)
            ),
            Self::Outside { volume_mm3 } => {
                format!("{volume_mm3:.2} mm³ of the pieces lie outside the model")
            }
            Self::PathRubs {
                piece,
                against,
                travel_mm,
                thickness_mm,
                volume_mm3,
                at,
            } => format!(
                "on its way in, {travel_mm:.1} mm from its place, piece {piece} runs into piece {against} \
                 by {volume_mm3:.2} mm³, {thickness_mm:.3} mm thick, {}",
                words.place(*at)
            ),
            Self::Loose { piece, directions } => format!(
                "piece {piece} comes off by itself in {} of the directions that are tried, first {}; longer \
                 seams hold better: try fewer pieces, a larger model or other labels",
                directions.len(),
                words.way(directions.first().copied().unwrap_or_default())
            ),
            Self::ClusterMoves { motions } => {
                let way = |m: &Motion| format!("piece {} {}", m.piece, words.way(m.velocity));
                let ways: Vec<String> = motions.iter().map(way).collect();
                format!("these pieces come apart from the rest: {}", ways.join(", "))
            }
            Self::PlayTooWide {
                piece,
                play,
                most,
                at,
            } => format!(
                "piece {piece} {}, {}: its seams are too short for the clearance; try fewer pieces, a \
                 larger model, labels that cut where it is wider, or a smaller clearance if your printer \
                 holds it",
                too_wide(play, *most),
                words.place(*at)
            ),
            Self::ComesOut { piece, at } => format!(
                "piece {piece} can be worked out by hand, turned past its connectors, {}: join it to a \
                 neighbour, or cut where it is wider",
                words.place(*at)
            ),
            Self::SurfaceLost { fraction, at } => format!(
                "{:.2} % of the model's surface are on no piece, farthest from any {}",
                100.0 * fraction,
                words.place(*at)
            ),
        }
    }
}

/// Phrase about the figures of a play that exceed their limits.
fn too_wide(play: &Play, [most_mm, most_deg]: [f64; 2]) -> String {
    if !play.translation_mm.is_finite() || !play.rotation_deg.is_finite() {
        return "moves without end".to_owned();
    }
    let (mm, deg) = (play.translation_mm, play.rotation_deg);
    let mut parts = Vec::new();
    if mm > most_mm {
        parts.push(format!("by {mm:.2} mm, where {most_mm:.2} mm are allowed"));
    }
    if deg > most_deg {
        parts.push(format!("by {deg:.2}°, where {most_deg:.2}° are allowed"));
    }
    format!("rattles {}", parts.join(", and "))
}

/// Describes the faults of a kit that fails these checks, each once.
pub fn fault_words(checks: &[String]) -> String {
    let mut words: Vec<&str> = Vec::new();
    for check in checks {
        let word = match check.as_str() {
            "pieces sit within their play" => "a piece would rattle",
            "every piece but the key is blocked"
            | "no cluster but the key slides (translations)"
            | "nothing but the key moves (6 dof)"
            | "no piece can be worked out by hand" => "pieces would come loose",
            "outer surface kept" => "some of the outer surface would be lost",
            "every installation path is free" => "a piece would rub on its way in",
            "assembled pieces do not overlap" => "pieces would overlap",
            other => other,
        };
        if !words.contains(&word) {
            words.push(word);
        }
    }
    words.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PatchId;

    #[test]
    fn a_finding_names_its_pieces_and_its_place() {
        let at = [1.0, 2.25, -3.0];
        let text = Finding::Overlap {
            a: PatchId(2),
            b: PatchId(6),
            volume_mm3: 0.625,
            at,
        }
        .to_string();
        assert_eq!(text, "pieces 3 and 7 overlap by 0.62 mm³ at (1.0, 2.2, -3.0) mm");
        let text = Finding::Loose {
            piece: PatchId(3),
            directions: vec![[0.0, 0.0, 1.0]],
        }
        .to_string();
        assert!(
            text.starts_with("piece 4 ") && text.contains("(0.00, 0.00, 1.00)"),
            "{text}"
        );
    }

    #[test]
    fn only_what_is_too_much_is_told_of_play() {
        let told = |translation_mm, rotation_deg| {
            let play = Play {
                translation_mm,
                rotation_deg,
                is_proven: false,
            };
            too_wide(&play, [0.5, 2.0])
        };
        assert_eq!(told(0.51, 1.0), "rattles by 0.51 mm, where 0.50 mm are allowed");
        assert_eq!(told(0.4, 2.5), "rattles by 2.50°, where 2.00° are allowed");
        assert_eq!(told(f64::INFINITY, 1.0), "moves without end");
    }

    #[test]
    fn checks_that_mean_the_same_are_told_once() {
        let failed = [
            "every piece but the key is blocked",
            "nothing but the key moves (6 dof)",
            "a new one",
        ];
        let failed: Vec<String> = failed.map(String::from).into();
        assert_eq!(fault_words(&failed), "pieces would come loose, a new one");
    }
}

//! Findings as sentences for people.

use std::fmt::{Display, Formatter, Result};

use super::{Finding, Motion};

impl Display for Finding {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Self::PlanBroken { piece } => write!(f, "the plan does not name piece {piece} exactly once"),
            Self::NotClosed { piece } => {
                write!(f, "piece {piece} is not closed: it has holes, or is inside out")
            }
            Self::SharedEdges { piece, count, at } => {
                write!(
                    f,
                    "{count} edges of piece {piece} have more than two triangles, first {}",
                    At(at)
                )
            }
            Self::SeveralBodies { piece, count } => write!(f, "piece {piece} falls into {count} bodies"),
            Self::Overlap { a, b, volume_mm3, at } => {
                write!(f, "pieces {a} and {b} overlap by {volume_mm3:.2} mm³ {}", At(at))
            }
            Self::Outside { volume_mm3 } => {
                write!(f, "{volume_mm3:.2} mm³ of the pieces lie outside the model")
            }
            Self::PathRubs {
                piece,
                against,
                travel_mm,
                thickness_mm,
                volume_mm3,
                at,
            } => write!(
                f,
                "on its way in, {travel_mm:.1} mm from its place, piece {piece} runs into piece {against} by {volume_mm3:.2} mm³, \
                 {thickness_mm:.3} mm thick, {}",
                At(at)
            ),
            Self::Loose { piece, directions } => {
                let [x, y, z] = directions.first().copied().unwrap_or_default();
                write!(
                    f,
                    "piece {piece} comes off by itself in {} of the directions that are tried, first along ({x:.2}, {y:.2}, {z:.2}); \
                     longer seams hold better: try fewer pieces, a larger model or other labels",
                    directions.len()
                )
            }
            Self::ClusterMoves { motions } => {
                write!(f, "these pieces come apart from the rest: {}", named(motions))
            }
            Self::PlayTooWide {
                piece,
                play,
                most: [most_mm, most_deg],
                at,
            } => write!(
                f,
                "piece {piece} rattles by {:.1} mm and {:.1}°, where {most_mm:.1} mm and {most_deg:.1}° are allowed, {}: its seams are too short for \
                 the clearance; try fewer pieces, a larger model, labels that cut where it is wider, or a smaller --clearance if your printer \
                 holds it",
                play.translation_mm,
                play.rotation_deg,
                At(at)
            ),
            Self::ComesOut { piece, at } => write!(
                f,
                "piece {piece} can be worked out by hand, turned past its connectors, {}: join it to a neighbour, or cut where it is wider",
                At(at)
            ),
            Self::SurfaceLost { fraction, at } => write!(
                f,
                "{:.2} % of the model's surface are on no piece, farthest from any {}",
                100.0 * fraction,
                At(at)
            ),
        }
    }
}

/// A place.
struct At<'a>(&'a [f64; 3]);

impl Display for At<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let [x, y, z] = self.0;
        write!(f, "at ({x:.1}, {y:.1}, {z:.1}) mm")
    }
}

/// Which pieces move, each with the way it goes.
fn named(motions: &[Motion]) -> String {
    let way = |m: &Motion| {
        let [x, y, z] = m.velocity;
        format!("piece {} along ({x:.2}, {y:.2}, {z:.2})", m.piece)
    };
    motions.iter().map(way).collect::<Vec<_>>().join(", ")
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
}

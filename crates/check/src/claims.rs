//! Tests each claim, and states it as a sentence with its result.

use std::thread;

use crate::bearing::Bearing;
use crate::bounded::{self, Bounded};
use crate::mesh::Mesh;
use crate::number;
use crate::vector::{Vec3, scale};
use crate::{
    Certificate, Claim, Contact, Finding, LeastGaps, Tested, ToldPlay, gap, lock, rays, within_play,
};

/// Greatest amount by which a stated play may be below the proven one: rounding, mm and degrees.
const SAME_PLAY: f64 = 1e-6;

/// Kit against which claims are tested.
pub struct Kit<'a> {
    pub c: &'a Certificate,
    pub meshes: &'a [Mesh],
    /// Contacts with points and normals of the surfaces; `None` if some are not on the surfaces.
    pub contacts: Option<&'a [Contact]>,
    /// Bearings with points of the surfaces; `None` if some are not on the surfaces.
    pub bearings: Option<&'a [Bearing]>,
}

impl Kit<'_> {
    /// Tests all claims, in their order.
    pub fn test_claims(&self) -> Vec<Finding> {
        thread::scope(|scope| {
            let test = |claim| scope.spawn(move || self.test_claim(claim));
            let tests: Vec<_> = self.c.claims.iter().map(test).collect();
            let died = |_| Finding::new("a claim", Err("its test came to no end".to_owned()));
            tests
                .into_iter()
                .map(|test| test.join().unwrap_or_else(died))
                .collect()
        })
    }

    fn test_claim(&self, claim: &Claim) -> Finding {
        let fits = &self.c.press_fits;
        let (name, tested) = match claim {
            Claim::Locked {
                held,
                leaves,
                multipliers,
                hold,
            } => {
                let name = format!(
                    "nothing but the key, piece {}, moves while {} held",
                    number::of(*leaves),
                    are(held)
                );
                (
                    name,
                    self.test_lock(
                        held,
                        *leaves,
                        &lock::Held {
                            multipliers,
                            hold: *hold,
                        },
                    ),
                )
            }
            Claim::Bounded(claim) => self.test_play(claim),
            Claim::KeyLeaves {
                piece,
                direction,
                least,
            } => {
                let others: Vec<usize> = (0..self.meshes.len()).filter(|p| p != piece).collect();
                let tested = self.test_path(*piece, *direction, &others, least);
                (
                    format!("the key, piece {}, can leave", number::of(*piece)),
                    tested,
                )
            }
            Claim::Installs {
                piece,
                direction,
                least,
            } => {
                let order = self.c.installation_order.iter().copied();
                let earlier: Vec<usize> = order.take_while(|p| p != piece).collect();
                let tested = self.test_path(*piece, scale(*direction, -1.0), &earlier, least);
                (format!("piece {} can be installed", number::of(*piece)), tested)
            }
            Claim::Apart { least } => {
                let all: Vec<usize> = (0..self.meshes.len()).collect();
                let tested = rays::test_apart(self.meshes, |pair, at| {
                    gap::is_pressed(self.meshes, fits, pair, at)
                })
                .and_then(|figure| gap::test(self.meshes, fits, None, &all, least, figure));
                ("the assembled pieces do not overlap".into(), tested)
            }
        };
        Finding::new(&name, tested)
    }

    fn test_path(&self, piece: usize, way_out: Vec3, others: &[usize], least: &LeastGaps) -> Tested {
        let figure = rays::test_path(self.meshes, piece, way_out, others)?;
        gap::test(
            self.meshes,
            &self.c.press_fits,
            Some((piece, way_out)),
            others,
            least,
            figure,
        )
    }

    fn test_lock(&self, held: &[usize], leaves: usize, told: &lock::Held<'_>) -> Tested {
        let contacts = self.contacts.ok_or("its contacts are not there")?;
        let frame = lock::Frame {
            center: self.c.center,
            length_mm: self.c.length_mm,
            n_pieces: self.meshes.len(),
        };
        lock::test(&frame, contacts, held, leaves, told)
    }

    /// Tests the bound, and that the play stated to users for a piece is not less.
    fn test_play(&self, claim: &Bounded) -> (String, Tested) {
        let alone = if let [piece] = claim.free[..] {
            Some(piece)
        } else {
            None
        };
        let at_rest: Vec<usize> = (0..self.meshes.len())
            .filter(|id| !claim.free.contains(id))
            .collect();
        let together = || {
            format!(
                "all pieces together stay within their play ({} held)",
                names_of(&at_rest)
            )
        };
        let name = alone.map_or_else(together, within_play);
        let tested = self.play(claim).and_then(|play| {
            let told = alone.and_then(|piece| self.c.pieces.get(piece)?.play.as_ref());
            let slid = play
                .slid_mm
                .map_or(String::new(), |mm| format!(", the key slid by up to {mm:.2} mm"));
            let figure = format!(
                "{:.2} mm, {:.2}°, {} bearings{slid}",
                play.shift_mm,
                play.turn_deg,
                claim.rows.len()
            );
            match told.is_none_or(|told| is_enough(told, &play)) {
                true => Ok(figure),
                false => Err(format!("{figure}: the play told is less than the one proven")),
            }
        });
        (name, tested)
    }

    fn play(&self, claim: &Bounded) -> Result<bounded::Play, String> {
        let bearings = self.bearings.ok_or("its bearings are not there")?;
        let is_same = |other: &&Claim| matches!(other, Claim::Bounded(other) if other.free == claim.free);
        if self.c.claims.iter().filter(is_same).count() > 1 {
            return Err("it is claimed twice".into());
        }
        let way_out = self.c.claims.iter().find_map(|claim| match claim {
            Claim::KeyLeaves { piece, direction, .. } if *piece == self.c.key => Some(*direction),
            _ => None,
        });
        let slide = self.c.slide.as_ref();
        bounded::test(
            &bounded::Kit {
                meshes: self.meshes,
                bearings,
                slide,
                key: self.c.key,
                way_out,
            },
            claim,
        )
    }
}

fn is_enough(told: &ToldPlay, proven: &bounded::Play) -> bool {
    told.translation_mm >= proven.shift_mm - SAME_PLAY && told.rotation_deg >= proven.turn_deg - SAME_PLAY
}

/// Names of held pieces with a verb: "1 is", "2 and 3 are".
fn are(held: &[usize]) -> String {
    let names = held
        .iter()
        .map(|&id| number::of(id).to_string())
        .collect::<Vec<_>>()
        .join(" and ");
    if held.len() == 1 {
        format!("{names} is")
    } else {
        format!("{names} are")
    }
}

/// Names of pieces: "piece 8", "pieces 2 and 8".
fn names_of(pieces: &[usize]) -> String {
    let names = pieces
        .iter()
        .map(|&id| number::of(id).to_string())
        .collect::<Vec<_>>()
        .join(" and ");
    if pieces.len() == 1 {
        format!("piece {names}")
    } else {
        format!("pieces {names}")
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;
    use crate::mesh::tests::{cuboid, hollow};
    use crate::{Verdict, test_completeness, unproven};

    /// Certificate of a cube, piece 2, in a hollow, piece 1. The cube is the key here, though it has no way
    /// out.
    fn certificate(play: &Value) -> Value {
        let axes = json!([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        let (mut bearings, mut multipliers) = (Vec::new(), [Vec::new(), Vec::new()]);
        for i in 0..24 {
            let signs = [i / 4 % 2, i / 2 % 2, i % 2].map(|bit| 2.0 * f64::from(bit) - 1.0);
            let turned =
                |v: [f64; 3]| -> [f64; 3] { std::array::from_fn(|k| v[(k + 3 - i as usize / 8) % 3]) };
            let point = turned([5.0 * signs[0], 4.9 * signs[1], 4.9 * signs[2]]);
            let (normal, across) = (turned([signs[0], 0.0, 0.0]), turned([0.0, 1.0, 0.0]));
            bearings.push(json!({ "a": 2, "b": 1, "point": point, "normal": normal, "across": across }));
        }
        for axis in 0..3 {
            let face = (axis + 1) % 3;
            let pair = |rows: [usize; 4], factor: f64| json!(rows.map(|row| json!([row, factor])));
            let rises =
                [[0, 1, 6, 7], [2, 3, 4, 5]].map(|rows| pair(rows.map(|row| 8 * face + row), 0.25 / 4.9));
            multipliers[0].push(json!(rises));
            multipliers[1].push(json!(
                [0, 4].map(|side| pair([0, 1, 2, 3].map(|i| 8 * axis + side + i), 0.25))
            ));
        }
        let quantity = |at: Value, most: f64| {
            json!({ "plus": 2, "minus": null, "at": at,
            "axes": axes, "most": vec![[most; 2]; 3] })
        };
        let bounded = json!({ "claim": "bounded", "free": [2], "of_piece": [[0, 1]],
            "quantities": [quantity(Value::Null, 0.024), quantity(json!([0.0, 0.0, 0.0]), 0.12)],
            "rows": (0..24).map(|i| [i, 1, 0]).collect::<Vec<_>>(), "multipliers": multipliers });
        let piece = |id: usize, play: &Value| json!({ "id": id, "file": "", "sha256": "", "play": play });
        json!({ "clearance_mm": 0.1, "reach_mm": 0.2, "center": [0.0, 0.0, 0.0], "length_mm": 5.0, "key": 2,
            "installation_order": [1, 2], "pieces": [piece(1, &Value::Null), piece(2, play)], "contacts": [],
            "bearings": bearings, "slide": null, "failed": [], "claims": [bounded] })
    }

    fn findings(certificate: Value) -> Vec<Finding> {
        let c: Certificate = serde_json::from_value(certificate).unwrap();
        let meshes = [hollow(8.0, 5.1), cuboid([-5.0; 3], [5.0; 3])];
        let bearings = crate::bearing::locate_all(&meshes, &c.bearings);
        let kit = Kit {
            c: &c,
            meshes: &meshes,
            contacts: None,
            bearings: bearings.as_deref().ok(),
        };
        kit.test_claims().into_iter().chain(unproven(&c)).collect()
    }

    #[test]
    fn a_piece_is_told_to_stay_within_its_play_or_not_to_be_claimed_to() {
        let lines: Vec<String> = findings(certificate(&Value::Null))
            .iter()
            .map(Finding::to_string)
            .collect();
        let claim = |id: usize| format!("{:52}", format!("piece {id} stays within its play"));
        assert_eq!(
            lines[0],
            format!("confirmed  {}  0.21 mm, 2.38°, 24 bearings", claim(2))
        );
        assert_eq!(lines[1], format!("unproven   {}  not claimed", claim(1)));
        assert_eq!(lines.len(), 2);
    }

    #[test]
    fn a_play_told_is_no_less_than_the_one_proven() {
        let verdict = |mm: f64, deg: f64| {
            findings(certificate(&json!({ "translation_mm": mm, "rotation_deg": deg })))[0].verdict
        };
        assert_eq!(verdict(0.21, 2.39), Verdict::Confirmed);
        assert_eq!(verdict(0.20, 2.39), Verdict::Refuted);
        assert_eq!(verdict(0.21, 2.37), Verdict::Refuted);
    }

    #[test]
    fn a_claim_is_refused_where_it_is_made_twice_or_its_bearings_are_elsewhere() {
        let mut twice = certificate(&Value::Null);
        twice["claims"] = json!([twice["claims"][0], twice["claims"][0]]);
        assert!(findings(twice)[..2].iter().all(|f| f.verdict == Verdict::Refuted));
        let mut moved = certificate(&Value::Null);
        moved["bearings"][7]["point"][1] = 4.2.into();
        moved["bearings"][7]["point"][0] = 5.01.into();
        assert_eq!(findings(moved)[0].figure, "its bearings are not there");
    }

    #[test]
    fn one_lock_that_the_key_leaves_is_needed() {
        let least = json!({ "overall": null, "beneath_rim": null });
        let lock = json!({ "claim": "locked", "held": [1], "leaves": 2, "multipliers": [],
            "residual": 0.0, "hold": 0.1 });
        let up = [0.0, 0.0, 1.0];
        let others = [
            json!({ "claim": "key-leaves", "piece": 2, "direction": up, "least": least }),
            json!({ "claim": "installs", "piece": 2, "direction": up, "least": least }),
            json!({ "claim": "apart", "least": least }),
        ];
        let is_complete = |locks: &[Value]| {
            let mut all = certificate(&Value::Null);
            all["claims"] = json!([locks, &others[..]].concat());
            test_completeness(&serde_json::from_value(all).unwrap()).is_ok()
        };
        assert!(is_complete(std::slice::from_ref(&lock)));
        assert!(!is_complete(&[]) && !is_complete(&[lock.clone(), lock.clone()]));
        let changed = |field: &str, value: Value| {
            let mut other = lock.clone();
            other[field] = value;
            other
        };
        assert!(!is_complete(&[changed("leaves", 1.into())]));
        assert!(!is_complete(&[changed("held", json!([2]))]));
        assert!(!is_complete(&[changed("held", json!([1, 2]))]));
    }

    #[test]
    fn pieces_are_named_in_words() {
        assert_eq!([are(&[0]), are(&[1, 2])], ["1 is", "2 and 3 are"]);
        assert_eq!([names_of(&[7]), names_of(&[1, 7])], ["piece 8", "pieces 2 and 8"]);
    }
}

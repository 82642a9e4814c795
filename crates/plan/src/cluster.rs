//! The cluster test of whether a plan locks: exact for ideal joints and translations, in microseconds.
//!
//! A joint between a later piece p and an earlier q lets p leave along `s_p` and blocks all other motions. So
//! if a set of pieces moves along `d` and contains x, it must contain every y that x pushes or pulls. A joint
//! along neither of ±`d` acts both ways. If `d = s_p`, only q takes p along; if `d = −s_p`, only p takes q
//! along. Joints of the key act both ways, since the key is held. The assembly locks exactly if this digraph
//! is strongly connected for every `d`: then nothing can move without everything.
//!
//! Reversing `d` reverses every arc, so one of ±d is enough. Along a `d` that is no piece's direction, all
//! joints hold both ways, and the graph is connected if it is along any other.

use shellock_assembly::LatticeDirection;
use shellock_report::PatchId;

use super::PieceSet;

/// A connector that holds between two pieces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DirectedJoint {
    /// The piece installed later.
    pub later: PatchId,
    /// The piece installed earlier.
    pub earlier: PatchId,
    /// Direction along which `later` leaves.
    pub separation: LatticeDirection,
}

/// Pieces that can move together while the key and all others stay in place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoosePart {
    /// Set of pieces that move; never empty, and never contains the key.
    pub pieces: PieceSet,
    /// Direction in which they move.
    pub direction: LatticeDirection,
}

/// Finds a part that comes loose while the key is held; `None` if the plan locks. `n_pieces` ≤
/// [`PieceSet::MAX_PIECES`].
pub fn loose_part(n_pieces: usize, joints: &[DirectedJoint], key: PatchId) -> Option<LoosePart> {
    loose_part_as_one(n_pieces, joints, key, PieceSet::EMPTY)
}

/// Runs the test of [`loose_part`] with the pieces of `fused` moving as one.
///
/// A part that is loose here stays loose whatever joints the fused pieces get later, so a search may stop
/// there.
pub(super) fn loose_part_as_one(
    n_pieces: usize,
    joints: &[DirectedJoint],
    key: PatchId,
    fused: PieceSet,
) -> Option<LoosePart> {
    let mut both_ways = [PieceSet::EMPTY; PieceSet::MAX_PIECES];
    let mut lines = [false; LatticeDirection::COUNT / 2];
    for x in fused.iter() {
        both_ways[usize::from(x)] = fused;
    }
    for j in joints {
        let (p, q) = (usize::from(j.later), usize::from(j.earlier));
        both_ways[p] = both_ways[p].union(PieceSet::one(j.earlier));
        both_ways[q] = both_ways[q].union(PieceSet::one(j.later));
        if j.later != key {
            lines[line_of(j.separation).index()] = true;
        }
    }
    let all = PieceSet::first(n_pieces);
    let mut directions: Vec<LatticeDirection> = LatticeDirection::all().take(lines.len()).collect();
    directions.retain(|d| lines[d.index()]);
    if directions.is_empty() {
        // Only the key leaves, so any direction shows if the pieces are connected.
        directions.extend(LatticeDirection::all().next());
    }
    directions
        .into_iter()
        .find_map(|d| loose_along(d, joints, key, &both_ways[..n_pieces], all))
}

/// Representative of ±d: the direction with the lower index.
fn line_of(d: LatticeDirection) -> LatticeDirection {
    d.min(d.opposite())
}

fn loose_along(
    d: LatticeDirection,
    joints: &[DirectedJoint],
    key: PatchId,
    both_ways: &[PieceSet],
    all: PieceSet,
) -> Option<LoosePart> {
    // `pulls[x]` are the pieces that x takes along; `pulled_by[x]` are those that take x along.
    let mut pulls = [PieceSet::EMPTY; PieceSet::MAX_PIECES];
    let mut pulled_by = pulls;
    pulls[..both_ways.len()].copy_from_slice(both_ways);
    pulled_by[..both_ways.len()].copy_from_slice(both_ways);
    for j in joints.iter().filter(|j| j.later != key) {
        let (free, stays) = match j.separation {
            s if s == d => (j.later, j.earlier),
            s if s == d.opposite() => (j.earlier, j.later),
            _ => continue,
        };
        pulls[usize::from(free)] = pulls[usize::from(free)].minus(PieceSet::one(stays));
        pulled_by[usize::from(stays)] = pulled_by[usize::from(stays)].minus(PieceSet::one(free));
    }
    let without_key_along = all.minus(PieceSet::reached_from(key, &pulled_by));
    if !without_key_along.is_empty() {
        return Some(LoosePart {
            pieces: without_key_along,
            direction: d,
        });
    }
    // If the key's own cluster can leave along d, the others can leave it along −d.
    let left_behind = all.minus(PieceSet::reached_from(key, &pulls));
    (!left_behind.is_empty()).then_some(LoosePart {
        pieces: left_behind,
        direction: d.opposite(),
    })
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// Returns true if all of `pieces` may move along `d` while the others stay in place.
    fn moves(pieces: u32, d: LatticeDirection, joints: &[DirectedJoint], key: PatchId) -> bool {
        joints.iter().all(|j| {
            let (p, q) = (pieces >> j.later.0 & 1 == 1, pieces >> j.earlier.0 & 1 == 1);
            match (p, q) {
                (true, false) => j.later != key && d == j.separation,
                (false, true) => j.later != key && d == j.separation.opposite(),
                _ => true,
            }
        })
    }

    fn random_joints(n: u32, rng: &mut ChaCha8Rng) -> Vec<DirectedJoint> {
        // Few directions, so that some plans lock and some do not.
        let directions: Vec<LatticeDirection> = (0..n)
            .map(|_| {
                LatticeDirection::all()
                    .nth([0, 4, 12, 13, 25][rng.random_range(0..5)])
                    .unwrap()
            })
            .collect();
        let mut joints = Vec::new();
        for later in 0..n {
            for earlier in later + 1..n {
                if rng.random_range(0.0..1.0) < 0.75 {
                    let separation = directions[later as usize];
                    joints.push(DirectedJoint {
                        later: PatchId(later),
                        earlier: PatchId(earlier),
                        separation,
                    });
                }
            }
        }
        joints
    }

    #[test]
    fn a_plan_locks_exactly_when_no_subset_can_translate() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let key = PatchId(0);
        let mut n_locked = 0;
        for round in 0..2000 {
            let n = 2 + round % 5;
            let joints = random_joints(n, &mut rng);
            // Subsets without the key are enough: where the key moves, the others move the opposite way.
            let any_moves = (1..1_u32 << (n - 1))
                .any(|others| LatticeDirection::all().any(|d| moves(others << 1, d, &joints, key)));
            match loose_part(n as usize, &joints, key) {
                None => {
                    assert!(!any_moves);
                    n_locked += 1;
                }
                Some(part) => {
                    let mask = part.pieces.iter().fold(0, |m, p| m | 1 << p.0);
                    assert!(mask != 0 && mask & 1 == 0);
                    assert!(moves(mask, part.direction, &joints, key));
                }
            }
        }
        assert!(
            (200..1800).contains(&n_locked),
            "{n_locked} of 2000 lock: the cases must be of both kinds"
        );
    }

    #[test]
    fn what_is_loose_with_a_part_fused_is_loose_in_the_end() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for _ in 0..500 {
            let joints = random_joints(6, &mut rng);
            let fused: PieceSet = (3..6).map(PatchId).collect();
            let known: Vec<_> = joints.iter().copied().filter(|j| j.later.0 < 3).collect();
            if loose_part_as_one(6, &known, PatchId(0), fused).is_some() {
                assert!(loose_part(6, &joints, PatchId(0)).is_some());
            }
        }
    }
}

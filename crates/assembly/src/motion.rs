//! Infinitesimal mobility: decides if any pieces can move at all, alone or together.
//!
//! A motion gives each free piece a velocity (and a spin). A contact with normal `n` from `a` to `b` allows
//! the motion if `n · (v_a − v_b) ≤ 0`; over all contacts, `A x ≤ 0`. Nothing moves iff `x = 0` is the only
//! solution. Normals are rounded, so the contacts get a small gap `g`, and a linear program finds how far
//! `A x ≤ g` lets pieces go: a few gaps, or without end.

mod forces;
mod hold;
mod play;
pub(crate) mod proof;
mod system;

use forces::Balance;
pub use hold::least_holds;
use nalgebra::DVector;
pub(crate) use play::{Corner, Limits, farthest_of_piece};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use shellock_geom::Vec3;
pub(crate) use system::{Row, System};

use crate::PatchId;

/// Point of piece `a` that piece `b` lies against.
#[derive(Clone, Copy, Debug)]
pub struct Contact {
    /// Piece that the point lies on.
    pub a: PatchId,
    /// Piece that the point faces.
    pub b: PatchId,
    /// Position of the point, mm.
    pub point: Vec3,
    /// Unit normal of `a` at the point, towards `b`.
    pub normal: Vec3,
    /// Distance from the point to `b`, mm.
    pub gap_mm: f64,
    /// Area of `a` that the point represents, mm².
    pub area_mm2: f64,
}

/// Gap of all contacts while motions are sought, mm.
const SLACK_MM: f64 = 0.1;
/// Motion, as a multiple of the gap, above which pieces are loose. In 15 kits that hold, pieces move by at
/// most 228 gaps. A piece that slides out together with the key moves by more than 10 000, although normals
/// along its way deviate by up to 0.004.
const MOST_GAPS: f64 = 500.0;

/// Multiple of [`most_play`] from which a piece counts as loose.
pub const LOOSE: f64 = 2.0;

/// Multiple of [`most_play`] up to which a rattle is only reported. No other kit is made for it, since that
/// costs as much time as the first: three kits of a hand took 98 s of processor time, one takes 29.
pub const SLIGHT: f64 = 1.2;

/// Play of a piece, compared to the allowed play.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativePlay {
    /// Piece whose play it is.
    pub piece: PatchId,
    /// Ratio of its play to the allowed play.
    pub excess: f64,
}

/// Play above which a piece counts as rattling, mm and degrees.
///
/// The reference is 1 mm and 2° for a model of 150 mm and a clearance of 0.12 mm. Both values grow in
/// proportion to a larger clearance. The displacement also scales with the size of the model, but is no less
/// than for 75 mm. Rotations of pieces with a diagonal under 60 mm, whose rims move less, scale inversely
/// with the diagonal, up to twice. docs/notes/certificate.md has the evidence.
pub fn most_play(size_mm: f64, clearance_mm: f64, piece_mm: f64) -> [f64; 2] {
    const AT_MM: f64 = 150.0;
    const AT_CLEARANCE_MM: f64 = 0.12;
    const AT_PIECE_MM: f64 = 60.0;
    let wider = (clearance_mm / AT_CLEARANCE_MM).max(1.0);
    [
        wider * (size_mm / AT_MM).max(0.5),
        2.0 * wider * (AT_PIECE_MM / piece_mm).clamp(1.0, 2.0),
    ]
}

/// Motions of a piece that are considered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Freedom {
    /// Translations only: three components of velocity.
    Translations,
    /// Velocity and spin, six components.
    Rigid,
}

/// Motion of one piece, as velocity and spin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twist {
    /// Piece that performs the motion.
    pub piece: PatchId,
    /// Velocity of the piece at the origin, scaled so that the fastest component of the whole motion is 1.
    pub velocity: Vec3,
    /// Spin times the scale given to [`free_motion`].
    pub spin: Vec3,
}

/// The contacts as seen from `origin`.
fn centered(contacts: &[Contact], origin: Vec3) -> Vec<Contact> {
    let moved = |c: &Contact| Contact {
        point: c.point - origin,
        ..*c
    };
    contacts.iter().map(moved).collect()
}

/// Greatest small motion of a piece within its contacts while its neighbours rest: displacement of `middle`,
/// mm, and rotation, degrees.
///
/// Each belongs to a motion that the contacts allow, and does not depend on the coordinate axes but for the
/// search. Unlimited motions count as 100 mm and 1 rad.
pub fn farthest(piece: PatchId, contacts: &[Contact], middle: Vec3) -> [f64; 2] {
    /// Distance at which rotations count as displacements, mm.
    const LENGTH_MM: f64 = 50.0;
    const ENDLESS: [f64; 2] = [100.0, 1.0];
    if contacts.is_empty() {
        return ENDLESS;
    }
    let centered = centered(contacts, middle);
    let system = System::new(&centered, &[piece], LENGTH_MM, Freedom::Rigid);
    let gaps: Vec<f64> = system
        .rows
        .iter()
        .map(|row| centered[row.contact].gap_mm)
        .collect();
    let limits = Limits::new(&system, &gaps);
    let mut corner = Corner::new(&limits);
    let found = farthest_of_piece(&mut corner, LENGTH_MM);
    let [shift_mm, turn] = [0, 1].map(|k| found[k].map_or(ENDLESS[k], |far| far.min(ENDLESS[k])));
    [shift_mm, turn.to_degrees()]
}

/// Finds how the pieces not in `held` (of `n_pieces`) can move; empty if they cannot. With `leaves`, that
/// piece may move freely, and only motions in which others move count.
///
/// `scale_mm` makes spins comparable to velocities: half the model's diagonal.
///
/// Every contact gets a gap of 0.1 mm. Pieces that hold each other move by some gaps then. A group that
/// slides along parallel walls moves without end, but for the rounding of their normals: without gaps, that
/// rounding alone would hold it. A group is loose if it moves by more than 500 gaps. A cone that is more than
/// 0 in the others' unknowns is found along almost any direction or its opposite; three are tried.
pub fn free_motion(
    contacts: &[Contact],
    n_pieces: usize,
    held: &[PatchId],
    leaves: Option<PatchId>,
    scale_mm: f64,
    freedom: Freedom,
) -> Vec<Twist> {
    let free: Vec<PatchId> = (0..n_pieces)
        .map(PatchId::from)
        .filter(|id| !held.contains(id))
        .collect();
    let system = System::new(contacts, &free, scale_mm, freedom);
    let width = system.n / free.len().max(1);
    let is_other = |k: usize| Some(free[k / width]) != leaves;
    let limits = Limits::new(&system, &vec![SLACK_MM; system.rows.len()]);
    let mut corner = Corner::new(&limits);
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for _ in 0..3 {
        let towards = DVector::from_fn(system.n, |k, _| {
            if is_other(k) {
                rng.random_range(-1.0..1.0)
            } else {
                0.0
            }
        });
        for sign in [1.0, -1.0] {
            corner.farthest(&(&towards * sign));
            let motion = corner.motion();
            let of_others = DVector::from_fn(system.n, |k, _| if is_other(k) { motion[k] } else { 0.0 });
            if system.n > 0 && of_others.amax() > MOST_GAPS * SLACK_MM {
                let mut moving = system.twists(&of_others, &free);
                moving.retain(|t| Some(t.piece) != leaves);
                return moving;
            }
        }
    }
    Vec::new()
}

#[cfg(test)]
mod tests {
    use microlp::{ComparisonOp, OptimizationDirection, Problem, SolveOutcome};

    use super::*;

    fn random_contacts(rng: &mut ChaCha8Rng, n_pieces: u32, n: usize) -> Vec<Contact> {
        let mut unit = || Vec3::new(rng.random(), rng.random(), rng.random()) * 2.0 - 1.0;
        let mut contacts: Vec<Contact> = (0..n)
            .map(|_| Contact {
                a: PatchId(0),
                b: PatchId(0),
                point: unit(),
                normal: unit().normalize(),
                gap_mm: 0.0,
                area_mm2: 1.0,
            })
            .collect();
        for c in &mut contacts {
            c.a = PatchId(rng.random_range(0..n_pieces));
            c.b = PatchId((c.a.0 + rng.random_range(1..n_pieces)) % n_pieces);
        }
        contacts
    }

    #[test]
    fn pieces_move_exactly_where_the_linear_program_of_touching_contacts_finds_a_motion() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let (mut n_locked, mut n_open) = (0, 0);
        for n in [5, 8, 10, 12, 13, 14, 16, 20, 24, 26, 28, 30, 34, 40, 60] {
            for n_pieces in [2, 3] {
                let contacts = random_contacts(&mut rng, n_pieces, n);
                let free: Vec<PatchId> = (1..n_pieces).map(PatchId).collect();
                let system = System::new(&contacts, &free, 1.0, Freedom::Rigid);
                let touching = vec![0.0; system.rows.len()];
                let farthest = (0..4).map(|_| {
                    let towards = DVector::from_fn(system.n, |_, _| rng.random::<f64>() - 0.5);
                    farthest_by_simplex(&system, &touching, &towards)
                });
                let can_move = farthest.fold(0.0, f64::max) > 1.0;
                let held = [PatchId(0)];
                let moving = free_motion(&contacts, n_pieces as usize, &held, None, 1.0, Freedom::Rigid);
                assert_eq!(!moving.is_empty(), can_move, "{n} contacts: {moving:?}");
                n_open += usize::from(can_move);
                n_locked += usize::from(!can_move);
            }
        }
        assert!(n_locked > 5 && n_open > 5, "{n_locked} locked, {n_open} open");
    }

    /// Greatest `objective · x` in the box of ±1000 mm, with `gaps_mm` one a row.
    fn farthest_by_simplex(system: &System, gaps_mm: &[f64], objective: &DVector<f64>) -> f64 {
        let mut problem = Problem::new(OptimizationDirection::Maximize);
        let x: Vec<_> = objective
            .iter()
            .map(|&c| problem.add_var(c, (-1e3, 1e3)))
            .collect();
        for (row, &gap_mm) in system.rows.iter().zip(gaps_mm) {
            let mut dense = DVector::zeros(system.n);
            system.add(row, 1.0, &mut dense);
            let terms: Vec<_> = x
                .iter()
                .copied()
                .zip(dense.iter().copied())
                .filter(|t| t.1 != 0.0)
                .collect();
            problem.add_constraint(&terms, ComparisonOp::Le, gap_mm);
        }
        let SolveOutcome::Solution(best) = problem.solve().unwrap() else {
            panic!("no limit was set")
        };
        best.objective()
    }

    #[test]
    fn pieces_go_as_far_as_the_linear_program_says_whether_gaps_are_equal_or_none() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let (mut n_ended, mut n_endless) = (0, 0);
        for (n, n_pieces) in [(4, 2), (12, 2), (20, 2), (60, 3), (150, 4), (300, 5)] {
            let contacts = random_contacts(&mut rng, n_pieces, n);
            let free: Vec<PatchId> = (1..n_pieces).map(PatchId).collect();
            let system = System::new(&contacts, &free, 1.0, Freedom::Rigid);
            let equal = vec![0.1; system.rows.len()];
            let mut some = equal.clone();
            some.iter_mut().step_by(3).for_each(|gap| *gap = 0.0);
            for gaps_mm in [equal, some] {
                let limits = Limits::new(&system, &gaps_mm);
                let mut corner = Corner::new(&limits);
                for _ in 0..8 {
                    let mut objective = DVector::zeros(system.n);
                    let at = 6 * rng.random_range(0..free.len());
                    (at..at + 6).for_each(|k| objective[k] = rng.random::<f64>() - 0.5);
                    let expected = farthest_by_simplex(&system, &gaps_mm, &objective);
                    match corner.farthest(&objective) {
                        Some(most) => assert!(
                            (most - expected).abs() < 1e-3 * expected.max(1.0),
                            "{most} {expected}"
                        ),
                        None => assert!(expected > 10.0, "{expected}"),
                    }
                    *if expected < 10.0 {
                        &mut n_ended
                    } else {
                        &mut n_endless
                    } += 1;
                }
            }
        }
        assert!(
            n_ended > 20 && n_endless > 8,
            "{n_ended} ended, {n_endless} endless"
        );
    }

    /// The search for the farthest motion finds nine tenths of what a dense set of directions does, and
    /// about as much in the same contacts when they are turned.
    #[test]
    fn play_is_that_of_the_farthest_motion_however_the_contacts_lie() {
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let dense: Vec<Vec3> = (0..400)
            .map(|_| (Vec3::new(rng.random(), rng.random(), rng.random()) * 2.0 - 1.0).normalize())
            .collect();
        let mut n_held = 0;
        for n in [20, 40, 80, 80, 160, 160] {
            let mut contacts = random_contacts(&mut rng, 2, n);
            contacts.iter_mut().for_each(|c| {
                c.point *= 20.0;
                c.gap_mm = 0.05 + 0.1 * rng.random::<f64>();
            });
            let [shift_mm, turn_deg] = farthest(PatchId(1), &contacts, Vec3::ZERO);
            if shift_mm > 50.0 || turn_deg > 50.0 {
                continue;
            }
            n_held += 1;
            let system = System::new(&contacts, &[PatchId(1)], 50.0, Freedom::Rigid);
            let gaps: Vec<f64> = system.rows.iter().map(|r| contacts[r.contact].gap_mm).collect();
            let limits = Limits::new(&system, &gaps);
            let mut corner = Corner::new(&limits);
            let mut most = |from: usize, scale: f64| {
                let along = |d: &Vec3| {
                    let form = |k: usize, _| {
                        if (from..from + 3).contains(&k) {
                            scale * d[k - from]
                        } else {
                            0.0
                        }
                    };
                    corner.farthest(&DVector::from_fn(6, form)).unwrap()
                };
                dense.iter().map(along).fold(0.0, f64::max)
            };
            let [dense_mm, dense_deg] = [most(0, 1.0), most(3, 1.0 / 50.0).to_degrees()];
            assert!(shift_mm > 0.9 * dense_mm, "{shift_mm} {dense_mm}");
            assert!(turn_deg > 0.9 * dense_deg, "{turn_deg} {dense_deg}");
            // No direction is farther from the dense ones than some degrees.
            assert!(shift_mm < 1.1 * dense_mm, "{shift_mm} {dense_mm}");
            let turn = |v: Vec3| Vec3::new(0.6 * v.x - 0.8 * v.y, 0.8 * v.x + 0.6 * v.y, v.z);
            let turned: Vec<Contact> = contacts
                .iter()
                .map(|c| Contact {
                    point: turn(c.point),
                    normal: turn(c.normal),
                    ..*c
                })
                .collect();
            let [again_mm, again_deg] = farthest(PatchId(1), &turned, Vec3::ZERO);
            assert!((again_mm / shift_mm - 1.0).abs() < 0.12, "{again_mm} {shift_mm}");
            assert!(
                (again_deg / turn_deg - 1.0).abs() < 0.12,
                "{again_deg} {turn_deg}"
            );
        }
        assert!(n_held >= 4, "{n_held}");
    }

    /// Contacts on the six faces of a box around `center`, with normals outwards.
    fn box_contacts(a: u32, b: u32, center: Vec3) -> Vec<Contact> {
        let mut contacts = Vec::new();
        for (n, u, v) in [
            (Vec3::X, Vec3::Y, Vec3::Z),
            (Vec3::Y, Vec3::Z, Vec3::X),
            (Vec3::Z, Vec3::X, Vec3::Y),
        ] {
            for (p, q) in [(0.9, 0.8), (0.9, -0.8), (-0.7, 0.8), (-0.7, -0.8)] {
                for side in [1.0, -1.0] {
                    let point = center + n * side + u * p + v * q;
                    contacts.push(Contact {
                        a: PatchId(a),
                        b: PatchId(b),
                        point,
                        normal: n * side,
                        gap_mm: 0.0,
                        area_mm2: 1.0,
                    });
                }
            }
        }
        contacts
    }

    #[test]
    fn a_caged_box_is_locked_and_without_one_face_it_leaves_there() {
        let mut contacts = box_contacts(1, 0, Vec3::new(3.0, 1.0, 2.0));
        assert!(free_motion(&contacts, 2, &[PatchId(0)], None, 1.0, Freedom::Rigid).is_empty());
        contacts.retain(|c| c.normal != Vec3::X);
        let moving = free_motion(&contacts, 2, &[PatchId(0)], None, 1.0, Freedom::Translations);
        assert_eq!(moving.len(), 1);
        assert!((moving[0].velocity - Vec3::X).length() < 1e-3, "{moving:?}");
        contacts.retain(|c| c.normal != Vec3::NEG_X);
        let sliding = free_motion(&contacts, 2, &[PatchId(0)], None, 1.0, Freedom::Translations);
        assert!(sliding[0].velocity.x.abs() > 0.999, "{sliding:?}");
    }

    #[test]
    fn rounded_normals_do_not_hold_a_group_that_slides_out_with_the_key() {
        // Pieces 1 and 2 are caged in piece 0, open towards +x, and by each other along x.
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut contacts = box_contacts(1, 0, Vec3::ZERO);
        contacts.extend(box_contacts(2, 0, Vec3::X * 2.0));
        contacts.retain(|c| c.normal.x == 0.0);
        contacts.extend(box_contacts(1, 2, Vec3::ZERO));
        let mut bumpy = || Vec3::new(rng.random(), rng.random(), rng.random()) * 0.002 - 0.001;
        for c in &mut contacts {
            c.normal = (c.normal + bumpy()).normalize();
        }
        for leaves in [None, Some(PatchId(2))] {
            let moving = free_motion(&contacts, 3, &[PatchId(0)], leaves, 3.0, Freedom::Rigid);
            assert!(
                moving[0].piece == PatchId(1) && moving[0].velocity.x.abs() > 0.99,
                "{moving:?}"
            );
        }
        contacts.extend(box_contacts(1, 0, Vec3::ZERO));
        let leaves = Some(PatchId(2));
        assert!(free_motion(&contacts, 3, &[PatchId(0)], leaves, 3.0, Freedom::Rigid).is_empty());
    }

    #[test]
    fn forty_caged_pieces_with_twenty_thousand_contacts_are_decided_and_one_loose_pair_is_named() {
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        let mut contacts = Vec::new();
        for piece in 1..40u32 {
            let center = Vec3::new(rng.random(), rng.random(), rng.random()) * 2.0;
            for _ in 0..22 {
                let mut cage = box_contacts(piece, piece - 1, center);
                for c in &mut cage {
                    c.point += Vec3::new(rng.random(), rng.random(), rng.random()) * 0.05;
                }
                contacts.extend(cage);
            }
        }
        assert!(contacts.len() > 20_000);
        assert!(free_motion(&contacts, 40, &[PatchId(0)], None, 2.0, Freedom::Rigid).is_empty());
        contacts.retain(|c| c.a.0 != 38 || c.normal != Vec3::X);
        let moving = free_motion(&contacts, 40, &[PatchId(0)], None, 2.0, Freedom::Rigid);
        assert_eq!(moving.iter().map(|t| t.piece.0).collect::<Vec<_>>(), [38, 39]);
    }
}

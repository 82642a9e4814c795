//! Tests that locked assemblies are certified, that mobile ones are not, and that play is what the gaps
//! allow.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use shellock_geom::{Vec3, Volume};

use super::*;
use crate::LatticeDirection;
use crate::motion::proof::{Question, prove};
use crate::motion::{Freedom, free_motion};
use crate::verify::kits::{ALL, HALF_GAP_MM, Kit, PIN, brick, grown, pinned_kit, pinned_lid};

fn make_certificate(kit: &Kit) -> Certificate {
    let file = |id: PatchId| PieceFile {
        id,
        file: format!("{id}.stl"),
        sha256: String::new(),
        play: None,
    };
    let files = kit.pieces.ids().map(file).collect();
    let (verdict, contacts) = kit.examine();
    let evidence = Evidence {
        contacts: &contacts,
        verdict: &verdict,
        gaps: &KitGaps::default(),
        play: None,
    };
    certify(files, &kit.pieces, &kit.plan, &evidence, 2.0 * HALF_GAP_MM).expect("the plan is whole")
}

/// Pieces other than the key that can move while the first piece is held. Empty exactly if a lock is claimed.
fn movers(kit: &Kit) -> Vec<u32> {
    let moving = kit.verdict().findings.into_iter().find_map(|f| match f {
        Finding::ClusterMoves { motions } => Some(motions.iter().map(|m| m.piece.0).collect()),
        _ => None,
    });
    let is_claimed = matches!(&make_certificate(kit).claims[0], Claim::Locked { .. });
    assert_eq!(is_claimed, moving.is_none());
    moving.unwrap_or_default()
}

fn contact(a: u32, b: u32, point: Vec3, normal: Vec3) -> Contact {
    Contact {
        a: PatchId(a),
        b: PatchId(b),
        point,
        normal,
        gap_mm: 0.1,
        area_mm2: 1.0,
    }
}

fn question(n_pieces: usize, length_mm: f64, freedom: Freedom) -> Question<'static> {
    Question {
        n_pieces,
        at_rest: &[PatchId(0)],
        leaves: None,
        length_mm,
        freedom,
    }
}

fn is_locked(contacts: &[Contact], n_pieces: usize, freedom: Freedom) -> bool {
    prove(contacts, &question(n_pieces, 1.0, freedom)).is_some()
}

#[test]
fn a_pinned_lid_is_certified_with_few_contacts_whose_proof_adds_up() {
    let certificate = make_certificate(&pinned_kit(|_| {}));
    let Claim::Locked {
        held,
        leaves,
        multipliers,
        residual,
        hold,
    } = &certificate.claims[0]
    else {
        panic!()
    };
    assert_eq!((&held[..], *leaves), (&[PatchId(0)][..], PatchId(2)));
    // At most twice the number of unknowns of the two free pieces.
    assert!(
        multipliers.len() <= 24 && certificate.contacts.len() <= 24,
        "{multipliers:?}"
    );
    assert!(*residual < 1e-9 && *hold > 1e-3, "{residual} {hold}");
    // In equilibrium on the lid and on the key, too.
    for piece in [PatchId(1), PatchId(2)] {
        let wrench = |i: usize| {
            let c = &certificate.contacts[i];
            let arm = (Vec3::from(c.point) - Vec3::from(certificate.center)) / certificate.length_mm;
            let sign = f64::from(c.a == piece) - f64::from(c.b == piece);
            (sign * Vec3::from(c.normal), sign * arm.cross(c.normal.into()))
        };
        let sum = multipliers
            .iter()
            .fold((Vec3::ZERO, Vec3::ZERO), |sum, &(i, value)| {
                assert!(value > 0.0);
                (sum.0 + value * wrench(i).0, sum.1 + value * wrench(i).1)
            });
        assert!(sum.0.length() + sum.1.length() < 1e-9, "{sum:?}");
    }
}

#[test]
fn walls_without_connectors_are_not_certified() {
    let slice = |from: f64| brick(ALL, ALL, [from, from + 9.9]);
    let kit = Kit::new(
        brick(ALL, ALL, ALL),
        &[slice(0.0), slice(10.0), slice(20.0)],
        &[Vec3::Z; 3],
    );
    assert_eq!(movers(&kit), [1]);
}

#[test]
fn a_lid_without_its_tongue_is_not_certified() {
    let [_, lid, pin] = pinned_lid(PIN);
    let above = brick([-1.0, 31.0], [-1.0, 31.0], [15.0 + HALF_GAP_MM, 31.0]);
    let bare = lid.intersect(&above);
    assert_eq!(movers(&pinned_kit(|pieces| pieces[1] = bare)), [1]);
    drop(pin);
}

#[test]
fn a_cap_that_touches_nothing_but_a_locked_lid_is_not_certified() {
    // The cap's tongue slides into the lid from the side: without the lid, the cap would be apart from the
    // rest.
    let (stem, foot) = (
        ([0.0, 10.0], [11.0, 19.0], [26.0, 31.0]),
        ([0.0, 10.0], [7.0, 23.0], [22.0, 26.0]),
    );
    let open = |p: ([f64; 2], [f64; 2], [f64; 2])| grown([-5.0, p.0[1]], p.1, p.2);
    let [base, lid, pin] = pinned_lid(PIN);
    let lid = lid.subtract(&open(stem)).subtract(&open(foot));
    let top = brick([0.0, 10.0], ALL, [30.0 + 2.0 * HALF_GAP_MM, 36.0]);
    let cap = Volume::union_all(vec![
        top,
        brick(stem.0, stem.1, stem.2),
        brick(foot.0, foot.1, foot.2),
    ]);
    let out = [Vec3::X, Vec3::X, Vec3::NEG_X, Vec3::Z];
    assert_eq!(
        movers(&Kit::new(brick(ALL, ALL, ALL), &[base, lid, cap, pin], &out)),
        [2]
    );
}

#[test]
fn a_piece_that_alone_joins_another_to_the_rest_does_not_lock_it() {
    // A bar that ends in a turned wheel: the wheel, piece 1, touches only the bar, along a round axle and two
    // flanks.
    let mut contacts = Vec::new();
    for i in 0..24 {
        let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 24.0).sin_cos();
        for x in [-0.3, 0.4] {
            contacts.push(contact(1, 0, Vec3::new(x, cos, sin), Vec3::new(0.0, -cos, -sin)));
            contacts.push(contact(
                1,
                0,
                Vec3::new(x, cos, sin),
                Vec3::new(x.signum(), 0.0, 0.0),
            ));
        }
    }
    assert!(!is_locked(&contacts, 2, Freedom::Rigid));
    let spin = free_motion(&contacts, 2, &[PatchId(0)], None, 1.0, Freedom::Rigid)[0];
    assert!(
        spin.spin.x.abs() > 0.99 && spin.velocity.length() < 1e-3,
        "{spin:?}"
    );
}

#[test]
fn blocks_in_a_straight_groove_are_not_certified() {
    let hole = grown([-5.0, 35.0], [10.0, 20.0], [10.0, 20.0]);
    let tube = brick(ALL, ALL, ALL).subtract(&hole);
    let block = |from: f64, to: f64| brick([from, to], [10.0, 20.0], [10.0, 20.0]);
    let pieces = [tube, block(0.0, 9.9), block(20.0, 30.0), block(10.0, 19.9)];
    let kit = Kit::new(
        brick(ALL, ALL, ALL),
        &pieces,
        &[Vec3::X, Vec3::NEG_X, Vec3::X, Vec3::X],
    );
    assert!(!movers(&kit).is_empty());
}

#[test]
fn a_path_that_rubs_is_not_claimed() {
    let mut kit = pinned_kit(|_| {});
    let installs = |kit: &Kit| {
        let claims = make_certificate(kit).claims.into_iter();
        let piece = |claim| {
            if let Claim::Installs { piece, .. } = claim {
                Some(piece.0)
            } else {
                None
            }
        };
        claims.filter_map(piece).collect::<Vec<u32>>()
    };
    assert_eq!(installs(&kit), [1, 2]);
    kit.plan.steps[1].separation = LatticeDirection::nearest(Vec3::NEG_X).into();
    assert_eq!(installs(&kit), [2]);
}

#[test]
fn a_screw_is_not_certified_and_one_more_contact_locks_it() {
    const PITCH: f64 = 0.2;
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let mut contacts = Vec::new();
    for _ in 0..200 {
        let (sin, cos) = (rng.random::<f64>() * std::f64::consts::TAU).sin_cos();
        let point = Vec3::new(cos, sin, rng.random::<f64>() - 0.5);
        // Any normal perpendicular to the screw's velocity z PITCH + z × p.
        let velocity = (Vec3::Z * PITCH + Vec3::Z.cross(point)).normalize();
        let random = Vec3::new(rng.random(), rng.random(), rng.random()) * 2.0 - 1.0;
        contacts.push(contact(1, 0, point, velocity.cross(random).normalize()));
    }
    assert!(!is_locked(&contacts, 2, Freedom::Rigid));
    assert!(
        is_locked(&contacts, 2, Freedom::Translations),
        "a screw does not slide out"
    );
    for normal in [Vec3::Z, Vec3::NEG_Z] {
        contacts.push(contact(1, 0, Vec3::new(0.0, 0.0, 0.5 * normal.z), normal));
    }
    assert!(is_locked(&contacts, 2, Freedom::Rigid));
}

/// Returns true if some subset of the pieces 1.. moves along one of `directions` past all others: brute force
/// over the subsets of the directional blocking graphs.
fn a_subset_slides(contacts: &[Contact], n_pieces: u32, directions: &[Vec3]) -> bool {
    let subsets = 1u32..1 << (n_pieces - 1);
    let moves = |subset: u32, piece: PatchId| piece.0 > 0 && subset >> (piece.0 - 1) & 1 == 1;
    directions.iter().any(|d| {
        subsets.clone().any(|subset| {
            contacts.iter().all(|c| {
                let relative = f64::from(moves(subset, c.a)) - f64::from(moves(subset, c.b));
                relative * c.normal.dot(*d) <= 1e-12
            })
        })
    })
}

/// All directions in which a slide can begin along faces with these normals, which come in opposite pairs:
/// the extreme rays of all cones that they cut out, and the normals.
fn critical_directions(normals: &[Vec3]) -> Vec<Vec3> {
    let mut directions: Vec<Vec3> = normals.to_vec();
    for d in normals
        .iter()
        .flat_map(|a| normals.iter().map(|b| a.cross(*b)))
        .filter_map(Vec3::try_normalize)
    {
        if directions.iter().all(|known| known.distance_squared(d) > 1e-12) {
            directions.push(d);
        }
    }
    directions
}

#[test]
fn no_subset_slides_out_of_what_is_certified_and_one_piece_slides_where_it_is_not() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let normals: Vec<Vec3> = LatticeDirection::all().map(LatticeDirection::unit).collect();
    let directions = critical_directions(&normals);
    let (mut n_locked, mut n_sliding) = (0, 0);
    for round in 0..84u32 {
        let n_pieces = 2 + round % 7;
        let n_contacts = (3 + rng.random_range(0..9)) * n_pieces;
        let contacts: Vec<Contact> = (0..n_contacts)
            .map(|_| {
                let a = rng.random_range(0..n_pieces);
                let b = (a + rng.random_range(1..n_pieces)) % n_pieces;
                contact(a, b, Vec3::ZERO, normals[rng.random_range(0..normals.len())])
            })
            .collect();
        let slides = a_subset_slides(&contacts, n_pieces, &directions);
        let locked = is_locked(&contacts, n_pieces as usize, Freedom::Translations);
        assert!(!(slides && locked), "round {round}: {contacts:?}");
        // Some of three or more pieces can slide in different directions at once, which no blocking graph
        // shows.
        assert!(n_pieces > 2 || slides || locked, "round {round}: {contacts:?}");
        (n_locked, n_sliding) = (n_locked + u32::from(locked), n_sliding + u32::from(slides));
    }
    assert!(
        n_locked > 12 && n_sliding > 12,
        "{n_locked} locked, {n_sliding} sliding"
    );
}

#[test]
fn a_key_with_several_ways_out_locks_the_others() {
    // Piece 1 is caged in piece 0 but towards +x, where the key, piece 2, blocks it. The key leaves along z;
    // one flank is parallel to its way, the other sloping: it may move away from the former, too.
    let mut contacts = Vec::new();
    let corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
    let mut face = |a: u32, b: u32, middle: Vec3, normal: Vec3| {
        let (u, v) = normal.any_orthonormal_pair();
        contacts.extend(corners.map(|(p, q)| contact(a, b, middle + p * u + q * v, normal)));
    };
    for normal in [Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
        face(1, 0, normal, normal);
    }
    face(1, 2, Vec3::X, Vec3::X);
    let key = Vec3::X * 2.0;
    let sloping = Vec3::new(0.0, -1.0, -0.1).normalize();
    for normal in [Vec3::X, Vec3::Y, sloping] {
        face(2, 0, key + normal, normal);
    }
    let leaves = Some((PatchId(2), Vec3::Z));
    let question = question(3, 2.0, Freedom::Rigid);
    let proof = prove(&contacts, &Question { leaves, ..question }).expect("only the key moves");
    assert!(
        proof.residual < 1e-9 && proof.hold > 1e-2,
        "{} {}",
        proof.residual,
        proof.hold
    );
    // Without the key's back, the key lets piece 1 go.
    contacts.retain(|c| c.a != PatchId(2) || c.normal != Vec3::X);
    assert!(prove(&contacts, &Question { leaves, ..question }).is_none());
}

#[test]
fn forty_pieces_are_proven_and_no_proof_names_more_contacts_than_twice_the_unknowns() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let mut contacts = Vec::new();
    for piece in 1..40 {
        let center = Vec3::new(rng.random(), rng.random(), rng.random()) * 2.0;
        for _ in 0..500 {
            let axis = rng.random_range(0..3);
            let mut offset = Vec3::new(rng.random(), rng.random(), rng.random()) * 2.0 - 1.0;
            offset[axis] = offset[axis].signum();
            let normal = Vec3::AXES[axis] * offset[axis];
            contacts.push(contact(piece, piece - 1, center + offset, normal));
        }
    }
    let question = question(40, 2.0, Freedom::Rigid);
    let proof = prove(&contacts, &question).expect("every piece is caged by the one before");
    assert!(
        proof.multipliers.len() <= 2 * 39 * 6 && proof.residual < 1e-9 * proof.hold,
        "{}",
        proof.residual
    );
}

#[test]
fn gaps_of_a_row_add_up_when_all_may_move() {
    // Pieces 0, 1 and 2 are caged one in the other along every axis with gap g: 2 moves g alone, and 2 g with
    // 1.
    let mut contacts = Vec::new();
    for (a, b) in [(1, 0), (2, 1)] {
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                for (p, q) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
                    let mut point = Vec3::splat(sign);
                    (point[(axis + 1) % 3], point[(axis + 2) % 3]) = (p, q);
                    contacts.push(contact(a, b, point, Vec3::AXES[axis] * sign));
                }
            }
        }
    }
    let farthest = |free: &[PatchId], d: Vec3| {
        let system = crate::motion::System::new(&contacts, free, 1.0, Freedom::Rigid);
        let mut objective = nalgebra::DVector::zeros(system.n);
        let at = system.n - 6;
        (0..3).for_each(|k| objective[at + k] = d[k]);
        let gaps: Vec<f64> = system
            .rows
            .iter()
            .map(|row| contacts[row.contact].gap_mm)
            .collect();
        let limits = crate::motion::Limits::new(&system, &gaps);
        crate::motion::Corner::new(&limits)
            .farthest(&objective)
            .expect("it is caged")
    };
    for d in [Vec3::X, Vec3::NEG_Y, Vec3::Z] {
        assert!((farthest(&[PatchId(2)], d) - 0.1).abs() < 1e-5);
        assert!((farthest(&[PatchId(1), PatchId(2)], d) - 0.2).abs() < 1e-5);
    }
}

#[test]
fn a_plan_that_leaves_a_piece_out_is_not_certified() {
    let mut kit = pinned_kit(|_| {});
    kit.plan.steps.pop();
    let (verdict, gaps) = (Verification::default(), KitGaps::default());
    let evidence = Evidence {
        contacts: &[],
        verdict: &verdict,
        gaps: &gaps,
        play: None,
    };
    let claimed = |kit: &Kit| certify(Vec::new(), &kit.pieces, &kit.plan, &evidence, 0.1);
    assert_eq!(claimed(&kit), None);
}

#[test]
fn what_only_a_key_that_may_move_holds_is_not_certified() {
    // A block in a slot that is open along x, and a key across it that leaves along the same x.
    let slot = grown([-5.0, 40.0], [10.0, 20.0], [10.0, 20.0]);
    let base = brick(ALL, ALL, ALL).subtract(&slot);
    let block = brick([5.0, 15.0], [10.0, 20.0], [10.0, 20.0]);
    let key = brick([15.1, 30.0], [10.0, 20.0], [10.0, 20.0]);
    let kit = Kit::new(brick(ALL, ALL, ALL), &[base, block, key], &[Vec3::X; 3]);
    assert_eq!(movers(&kit), [1]);
}

//! Properties of directions and plans, and the invariance of a verdict under the assembly's placement and the
//! numbering of its pieces.

use std::collections::BTreeSet;

use proptest::prelude::*;
use shellock_assembly::verify::{Finding, Verification, examine};
use shellock_assembly::{
    Assembly, Ctx, Direction, IdVec, InstallationPlan, LatticeDirection, PatchId, PressFit, PressFitKind,
    VerifyParams, verify,
};
use shellock_geom::{Solid, TriMesh, Vec3};
use shellock_testkit::property::{LatticeTurn, cases, orders, turns, vectors};
use shellock_testkit::shapes::{ALL, PinnedLid, brick};

fn directions() -> impl Strategy<Value = LatticeDirection> {
    prop::sample::select(LatticeDirection::all().collect::<Vec<_>>())
}

fn turn_along(turn: &LatticeTurn, d: LatticeDirection) -> LatticeDirection {
    LatticeDirection::nearest(turn.apply(d.unit()))
}

type Judge = fn(&VerifyParams, &Assembly<'_>) -> Verification;
type Said = (Vec<(String, bool)>, BTreeSet<String>);

fn judge_fast(params: &VerifyParams, assembly: &Assembly<'_>) -> Verification {
    examine(&Ctx::quiet(), params, assembly).unwrap().0
}

fn judge_all(params: &VerifyParams, assembly: &Assembly<'_>) -> Verification {
    verify(&Ctx::quiet(), params, assembly).unwrap().verification
}

/// Assembly at an arbitrary place, with arbitrarily numbered pieces.
#[derive(Clone, Debug)]
struct Placed {
    turn: LatticeTurn,
    shift: Vec3,
    /// Numbers of base, lid and pin.
    number: Vec<usize>,
}

impl Placed {
    /// Verdict of `judge` on the pinned lid in this placement.
    fn judge(&self, lid: &PinnedLid, ways: [Vec3; 3], judge: Judge) -> Verification {
        let model = self.turn.mesh(&brick(ALL, ALL, ALL).to_mesh(), self.shift);
        let parts = lid
            .parts()
            .map(|part| self.turn.mesh(&part.to_mesh(), self.shift));
        let mut pieces: IdVec<PatchId, TriMesh> = IdVec::from_fn(3, |_| TriMesh::default());
        for (part, &number) in parts.into_iter().zip(&self.number) {
            pieces[PatchId::from(number)] = part;
        }
        let way = |way: Vec3| Direction::from(LatticeDirection::nearest(self.turn.apply(way)));
        let steps = self.number.iter().zip(ways);
        let plan = InstallationPlan::new(steps.map(|(&number, w)| (number.into(), way(w))));
        let params = VerifyParams {
            clearance_mm: lid.gap_mm,
            seed: 0,
        };
        let assembly = Assembly {
            model: Some(&Solid::new(model).unwrap()),
            pieces: &pieces,
            plan: &plan,
            press_fits: &[],
        };
        judge(&params, &assembly)
    }

    /// Checks, and findings worded independently of the placement.
    fn verdict(&self, lid: &PinnedLid, ways: [Vec3; 3], judge: Judge) -> Said {
        let verdict = self.judge(lid, ways, judge);
        let checks = verdict.checks.iter().map(|c| (c.name.clone(), c.ok));
        (
            checks.collect(),
            verdict.findings.iter().map(|f| self.in_words(f)).collect(),
        )
    }

    /// Part of the lid, 0, 1 or 2: base, lid or pin.
    fn part(&self, piece: PatchId) -> usize {
        self.number.iter().position(|&n| n == usize::from(piece)).unwrap()
    }

    /// Finding as it would be worded for the original assembly, without figures that come from sampled
    /// points.
    fn in_words(&self, finding: &Finding) -> String {
        let parts = |pieces: &[PatchId]| pieces.iter().map(|&p| self.part(p)).collect::<BTreeSet<_>>();
        match finding {
            Finding::Loose { piece, directions } => {
                let given = |d: &[f64; 3]| {
                    let is_it = |s: &LatticeDirection| self.turn.apply(s.unit()).distance((*d).into()) < 1e-6;
                    LatticeDirection::all().find(is_it).map(LatticeDirection::step)
                };
                let ways: BTreeSet<_> = directions.iter().map(given).collect();
                format!("{} is loose along {ways:?}", self.part(*piece))
            }
            Finding::PathRubs { piece, against, .. } => {
                format!("{} runs into {}", self.part(*piece), self.part(*against))
            }
            Finding::Overlap { a, b, .. } => format!("{:?} overlap", parts(&[*a, *b])),
            Finding::ClusterMoves { motions } => {
                format!(
                    "{:?} move",
                    parts(&motions.iter().map(|m| m.piece).collect::<Vec<_>>())
                )
            }
            other => panic!("boxes have no such fault: {other:?}"),
        }
    }
}

fn places() -> impl Strategy<Value = Placed> {
    (turns(), vectors(100.0), orders(3)).prop_map(|(turn, shift, number)| Placed { turn, shift, number })
}

/// Pinned lids with a fault or without: a pin that ends in the lid, lips that reach over nothing, a lid that
/// leaves through the base; each with the ways out.
fn lids() -> impl Strategy<Value = (PinnedLid, [Vec3; 3])> {
    prop::sample::select(vec![0usize, 1, 2, 3]).prop_map(|fault| {
        let mut lid = PinnedLid::default();
        let mut ways = [Vec3::X, Vec3::X, Vec3::Z];
        match fault {
            0 => {}
            1 => lid.pin[2][0] = 20.0,
            2 => lid.lip_mm = 0.0,
            _ => ways[1] = -Vec3::X,
        }
        (lid, ways)
    })
}

fn identity() -> Placed {
    Placed {
        turn: LatticeTurn::all()[0],
        shift: Vec3::ZERO,
        number: vec![0, 1, 2],
    }
}

proptest! {
    #![proptest_config(cases(8))]

    #[test]
    fn a_verdict_is_the_same_however_an_assembly_lies_and_its_pieces_are_numbered(
        (lid, ways) in lids(), placed in places(),
    ) {
        prop_assert_eq!(placed.verdict(&lid, ways, judge_fast), identity().verdict(&lid, ways, judge_fast));
    }
}

proptest! {
    #![proptest_config(cases(2))]

    #[test]
    fn what_locks_is_proven_to_lock_however_it_lies_and_its_pieces_are_numbered(placed in places()) {
        let verdict = placed.judge(&PinnedLid::default(), [Vec3::X, Vec3::X, Vec3::Z], judge_all);
        prop_assert!(verdict.has_passed(), "{:?}", verdict.findings);
    }
}

proptest! {
    #![proptest_config(cases(200))]

    #[test]
    fn turns_of_the_lattice_permute_the_directions_and_keep_opposites(turn in turns(), d in directions()) {
        let exact = turn.apply(Vec3::from_array(d.step().map(f64::from))).to_array();
        prop_assert_eq!(turn_along(&turn, d).step().map(f64::from), exact);
        prop_assert_eq!(turn_along(&turn, d.opposite()), turn_along(&turn, d).opposite());
        prop_assert_eq!(d.opposite().opposite(), d);
    }

    #[test]
    fn no_direction_is_nearer_than_the_nearest_and_it_turns_with_the_vector(
        turn in turns(), v in vectors(1.0)
    ) {
        let nearest = LatticeDirection::nearest(v);
        let mut dots: Vec<f64> = LatticeDirection::all().map(|d| d.unit().dot(v)).collect();
        dots.sort_by(f64::total_cmp);
        prop_assert!(nearest.unit().dot(v) >= dots[25] - 1e-12);
        // In a tie the order decides, which does not turn.
        prop_assume!(dots[25] - dots[24] > 1e-9);
        prop_assert_eq!(LatticeDirection::nearest(turn.apply(v)), turn_along(&turn, nearest));
        prop_assert_eq!(LatticeDirection::nearest(-v), nearest.opposite());
    }

    #[test]
    fn a_plan_finds_each_piece_where_it_was_put_and_takes_it_apart_the_other_way(
        order in orders(9), ways in prop::collection::vec(directions(), 9),
    ) {
        let steps = order.iter().zip(&ways).map(|(&piece, &way)| (piece.into(), way));
        let plan = InstallationPlan::new(steps);
        for (i, (&piece, &way)) in order.iter().zip(&ways).enumerate() {
            prop_assert_eq!(plan.position(piece.into()), i);
            prop_assert_eq!(plan.separation(piece.into()), way);
        }
        prop_assert_eq!(plan.key(), PatchId::from(order[8]));
        let apart: Vec<PatchId> = plan.removal().map(|step| step.piece).collect();
        prop_assert!(apart.iter().rev().map(|&p| usize::from(p)).eq(order));
    }

    #[test]
    fn what_a_press_fit_reaches_goes_along_with_it(
        turn in turns(), shift in vectors(50.0), at in vectors(20.0), off in vectors(4.0),
    ) {
        // Exclude cases that rounding decides.
        prop_assume!((off.length() - 4.0).abs() > 1e-9);
        let fit = |at: Vec3| PressFit {
            kind: PressFitKind::Rib,
            piece: PatchId(0),
            at: at.to_array(),
            interference_mm: 0.1,
            travel_mm: 1.0,
        };
        let moved = |p: Vec3| turn.apply(p) + shift;
        prop_assert_eq!(fit(at).reaches(at + off), fit(moved(at)).reaches(moved(at + off)));
        prop_assert_eq!(fit(at).reaches(at + off), off.length() < 4.0);
    }
}

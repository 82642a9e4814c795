//! Kits that are made up.

use shellock_geom::{TriMesh, Vec3};

use crate::causes::Make;
use crate::design::Kit;
use crate::key::Turn;
use crate::metric::Holding;
use crate::plan::key::KeyDirections;
use crate::plan::{Handover, LatticePlan, PlanProof, ProofScope};
use crate::play::{KitPlay, Rattle, Slide};
use crate::verify::{Check, Finding, Play, Verification};
use crate::{ConnectorSizes, IdVec, LatticeDirection, PatchId, Warning};

pub const N: usize = 3;

pub fn ids() -> impl Iterator<Item = PatchId> {
    (0..N).map(PatchId::from)
}

pub fn check(name: &str, ok: bool) -> Check {
    Check {
        name: name.into(),
        ok,
        figure: String::new(),
    }
}

/// A kit of three pieces, the last of them the key, that has these checks and findings.
pub fn kit(checks: &[(&str, bool)], findings: Vec<Finding>) -> Kit {
    handed_over(
        Handover::new(&Turn::default(), found_plan([0, 1, 2])),
        checks,
        findings,
    )
}

/// Patches in this order, all of which leave upwards.
pub fn found_plan(order: [u32; N]) -> LatticePlan {
    let up = LatticeDirection::nearest(Vec3::Z);
    LatticePlan::new(order.map(|patch| (PatchId(patch), up)))
}

pub fn handed_over(handover: Handover, checks: &[(&str, bool)], findings: Vec<Finding>) -> Kit {
    let plan = handover.plan();
    let slide = Slide {
        key: plan.key(),
        seat: PatchId(0),
        at: [0.0; 3],
        along: [0.0, 0.0, 1.0],
        most_mm: 0.3,
    };
    let nothing = || ids().map(|_| None).collect::<IdVec<PatchId, Option<Play>>>();
    Kit {
        surface: shellock_test_surfaces::voronoi(shellock_test_surfaces::sphere(2, Vec3::splat(20.0)), N, 1),
        sizes: ConnectorSizes::default(),
        plan,
        proof: PlanProof {
            cost: 1.0,
            lower_bound: 1.0,
            gap: 0.0,
            optimal: true,
            least_cost: 1.0,
            key_lower_bound: 1.0,
            proven_for: ProofScope {
                keys: Vec::new(),
                slides: KeyDirections::WithinPlane,
                n_lessons: 0,
            },
            piece_costs: ids().map(|_| 1.0).collect(),
        },
        holding: Holding {
            quality_mm: None,
            loose: Vec::new(),
            seams: Vec::new(),
            n_compared: 1,
            bears: Vec::new(),
            foreseen_play: Vec::new(),
            foreseen_excess: Vec::new(),
        },
        deformation: crate::metric::Deformed::default(),
        thickness_mm: 2.0,
        pieces: ids().map(|_| TriMesh::default()).collect(),
        joints: Vec::new(),
        press_fits: Vec::new(),
        contacts: Vec::new(),
        verification: Verification {
            checks: checks.iter().map(|&(name, ok)| check(name, ok)).collect(),
            findings,
        },
        touches: Vec::new(),
        rattles: Vec::new(),
        play: KitPlay {
            slide,
            bearings: Vec::new(),
            alone: nothing(),
            estimates: nothing(),
            swings: ids().map(|_| Vec::new()).collect(),
            ways_out: None,
            together: None,
            proofs: Vec::new(),
        },
        warnings: vec![Warning::new(Make::KeyWithoutGrip, Vec::new(), None)],
        handover,
    }
}

pub fn good() -> Kit {
    kit(&[("holds", true)], Vec::new())
}

pub fn kit_that_rattles(piece: u32, translation_mm: f64) -> Kit {
    let play = Play {
        translation_mm,
        rotation_deg: 0.0,
        is_proven: false,
    };
    let (piece, at) = (PatchId(piece), [0.0; 3]);
    let rattle = Rattle {
        piece,
        play,
        most: [1.0, 2.0],
        excess: translation_mm,
        at,
    };
    let finding = Finding::PlayTooWide {
        piece,
        play,
        most: [2.0, 4.0],
        at,
    };
    let is_loose = translation_mm > 2.0;
    let findings = if is_loose { vec![finding] } else { Vec::new() };
    Kit {
        rattles: vec![rattle],
        ..kit(&[("holds", true), ("sits", !is_loose)], findings)
    }
}

pub fn loose(piece: u32) -> Kit {
    kit(
        &[("holds", false), ("sits", true)],
        vec![Finding::Loose {
            piece: PatchId(piece),
            directions: Vec::new(),
        }],
    )
}

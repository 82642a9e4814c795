//! Conversion of results from the space in which a kit is made to the user's: the model as given, with pieces
//! numbered in the order of installation.
//!
//! Pieces are made in the model turned for its key, and identified by the patches of a division. Neither is
//! visible outside: places in a kit are in the space of the model as given, and the first piece is number 1.
//! Each type that leaves the making has a method `hand_over`.

use shellock_assembly::{Direction, InstallationPlan};
use shellock_geom::Vec3;
use shellock_report::{IdVec, PatchId, Warning};
use shellock_surface::{SegmentedSurface, Turn};

use crate::sizes::ConnectorSizes;
use crate::types::{LatticePlan, PlanProof, ProofScope};

/// Map from the turned model and its patches to the model as given and the pieces of the kit.
#[derive(Clone, Debug)]
pub struct Handover {
    back: Turn,
    /// Piece of the kit for each patch of the division.
    pieces: IdVec<PatchId, PatchId>,
    /// The plan as it was found.
    plan: LatticePlan,
}

impl Handover {
    /// Creates the map for pieces made by `plan` of a model that was turned by `turn`.
    pub fn new(turn: &Turn, plan: LatticePlan) -> Self {
        Self {
            back: turn.inverse(),
            pieces: IdVec::from_fn(plan.steps.len(), |patch| plan.position(patch).into()),
            plan,
        }
    }

    /// The plan as it was found: patches of the division, directions of the lattice.
    pub fn found_plan(&self) -> &LatticePlan {
        &self.plan
    }

    /// The patch of the division that a piece of the kit was made of.
    pub fn patch(&self, piece: PatchId) -> PatchId {
        self.plan.steps[usize::from(piece)].piece
    }

    /// Rotation back to the model as given, which finished pieces get.
    pub fn turn(&self) -> &Turn {
        &self.back
    }

    /// The piece of the kit that is made of a patch.
    pub fn piece(&self, patch: PatchId) -> PatchId {
        self.pieces[patch]
    }

    /// The pieces of the kit that are made of these patches, in the same order.
    pub fn all(&self, patches: &[PatchId]) -> Vec<PatchId> {
        patches.iter().map(|&p| self.piece(p)).collect()
    }

    /// Place in the model as given, mm. Directions turn likewise, since turns keep the origin.
    pub fn at(&self, place: [f64; 3]) -> [f64; 3] {
        self.back.apply(Vec3::from(place)).to_array()
    }

    /// Sorts one element per patch into the order of the pieces. An empty slice stays empty.
    pub fn in_order<T: Clone>(&self, of_patches: &[T]) -> Vec<T> {
        if of_patches.is_empty() {
            return Vec::new();
        }
        let patches = self.plan.steps.iter().map(|step| usize::from(step.piece));
        patches.map(|patch| of_patches[patch].clone()).collect()
    }

    /// Order and directions of installation, in the user's space.
    pub fn plan(&self) -> InstallationPlan {
        let way = |v: Vec3| Direction::of(self.back.apply(v)).expect("a turned direction has one");
        let steps = self.plan.steps.iter().enumerate();
        InstallationPlan::new(steps.map(|(i, step)| (i.into(), way(step.separation.unit()))))
    }

    /// The divided surface, in the user's space.
    pub fn surface(&self, surface: &SegmentedSurface) -> SegmentedSurface {
        SegmentedSurface {
            mesh: self.back.mesh(&surface.mesh),
            patch_of_face: self.all(&surface.patch_of_face),
            ..surface.clone()
        }
    }

    /// The connector sizes of pairs of pieces.
    pub fn sizes(&self, sizes: &ConnectorSizes) -> ConnectorSizes {
        let pairs = sizes
            .pairs()
            .map(|(pair, size_mm)| (pair.map(|p| self.piece(p)), size_mm));
        ConnectorSizes::with_pairs(sizes.default_mm(), pairs)
    }

    /// The proof of a plan, with its costs in the order of the pieces.
    pub fn proof(&self, proof: PlanProof) -> PlanProof {
        PlanProof {
            proven_for: ProofScope {
                keys: self.all(&proof.proven_for.keys),
                ..proof.proven_for
            },
            piece_costs: self.in_order(proof.piece_costs.as_slice()).into_iter().collect(),
            ..proof
        }
    }

    /// The warnings of the making, for the pieces and places of the kit.
    pub fn warnings(&self, warnings: Vec<Warning>) -> Vec<Warning> {
        let told = |w: Warning| w.renumber(&|piece| self.piece(piece)).move_by(|at| self.at(at));
        warnings.into_iter().map(told).collect()
    }
}

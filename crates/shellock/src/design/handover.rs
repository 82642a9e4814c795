//! Conversion of a kit from the space in which it is made to the user's: the model as given, with pieces
//! numbered in the order of installation.
//!
//! Pieces are made in the model turned for its key, and identified by the patches of a division. Neither is
//! visible outside: places in a kit are in the space of the model as given, and the first piece is number 1.

use shellock_geom::{TriMesh, Vec3};

use crate::connector::SeamRoom;
use crate::handling::Deed;
use crate::key::Turn;
use crate::metric::{Deformed, DeformedLoad, GivesWay, Holding, LoadBorne, LoosePiece, SeamHolding, Touch};
use crate::piece::{Finished, FinishedJoint};
use crate::plan::{LatticePlan, PlanProof, ProofScope};
use crate::{
    ConnectorSizes, Direction, IdVec, InstallationPlan, PatchId, PressFit, SegmentedSurface, Warning,
};

/// Map from the turned model and its patches to the model as given and the pieces of the kit.
#[derive(Clone, Debug)]
pub(super) struct Handover {
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

    fn piece(&self, patch: PatchId) -> PatchId {
        self.pieces[patch]
    }

    fn all(&self, patches: &[PatchId]) -> Vec<PatchId> {
        patches.iter().map(|&p| self.piece(p)).collect()
    }

    fn at(&self, place: [f64; 3]) -> [f64; 3] {
        self.back.apply(Vec3::from(place)).to_array()
    }

    /// Sorts one element per patch into the order of the pieces. An empty slice stays empty.
    fn in_order<T: Clone>(&self, of_patches: &[T]) -> Vec<T> {
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

    pub fn surface(&self, surface: &SegmentedSurface) -> SegmentedSurface {
        SegmentedSurface {
            mesh: self.back.mesh(&surface.mesh),
            patch_of_face: self.all(&surface.patch_of_face),
            ..surface.clone()
        }
    }

    pub fn sizes(&self, sizes: &ConnectorSizes) -> ConnectorSizes {
        let pairs = sizes
            .pairs()
            .map(|(pair, size_mm)| (pair.map(|p| self.piece(p)), size_mm));
        ConnectorSizes::with_pairs(sizes.default_mm(), pairs)
    }

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

    pub fn convert_holding(&self, holding: Holding) -> Holding {
        let loose = |l: LoosePiece| LoosePiece {
            piece: self.piece(l.piece),
            at: self.at(l.at),
        };
        let seam = |s: SeamHolding| SeamHolding {
            later: self.piece(s.later),
            earlier: self.piece(s.earlier),
            at: self.at(s.at),
            ..s
        };
        Holding {
            bears: holding
                .bears
                .into_iter()
                .map(|b| self.convert_capacity(b))
                .collect(),
            loose: holding.loose.into_iter().map(loose).collect(),
            seams: holding.seams.into_iter().map(seam).collect(),
            foreseen_play: self.in_order(&holding.foreseen_play),
            foreseen_excess: self.in_order(&holding.foreseen_excess),
            ..holding
        }
    }

    fn convert_capacity(&self, borne: LoadBorne) -> LoadBorne {
        // `at` also turns directions, since turns keep the origin.
        let deed = match borne.deed {
            Deed::PressSide { toward } => Deed::PressSide {
                toward: self.at(toward),
            },
            Deed::Fall { down } => Deed::Fall { down: self.at(down) },
            Deed::Hang { piece } => Deed::Hang {
                piece: self.piece(piece),
            },
            other => other,
        };
        let gives_way = |g: GivesWay| GivesWay {
            between: g.between.map(|p| self.piece(p)),
            at: self.at(g.at),
            ..g
        };
        LoadBorne {
            deed,
            at: self.at(borne.at),
            first: borne.first.map(gives_way),
            ..borne
        }
    }

    pub fn convert_deformation(&self, deformed: Deformed) -> Deformed {
        let touch = |t: Touch| Touch {
            at: self.back.apply(t.at),
            force_n: self.back.apply(t.force_n),
        };
        let load = |l: DeformedLoad| DeformedLoad {
            capacity: self.convert_capacity(l.capacity),
            touches: l.touches.into_iter().map(touch).collect(),
            moved_mm: l.moved_mm.into_iter().map(|m| self.back.apply(m)).collect(),
            kind: l.kind,
        };
        Deformed {
            surface: self.back.mesh(&deformed.surface),
            piece_of_point: self.all(&deformed.piece_of_point),
            loads: deformed.loads.into_iter().map(load).collect(),
        }
    }

    /// Converts finished pieces. Their meshes were already turned, before rounding.
    pub fn convert_pieces(&self, finished: Finished) -> Finished {
        let joint = |j: FinishedJoint| FinishedJoint {
            male: self.piece(j.male),
            female: self.piece(j.female),
            at: self.back.apply(j.at),
            ..j
        };
        let fit = |f: PressFit| PressFit {
            piece: self.piece(f.piece),
            at: self.at(f.at),
            ..f
        };
        let meshes: Vec<TriMesh> = self.in_order(finished.meshes.as_slice());
        Finished {
            meshes: meshes.into_iter().collect(),
            joints: finished.joints.into_iter().map(joint).collect(),
            press_fits: finished.press_fits.into_iter().map(fit).collect(),
        }
    }

    pub fn rooms(&self, rooms: Vec<SeamRoom>) -> Vec<SeamRoom> {
        let room = |r: SeamRoom| SeamRoom {
            later: self.piece(r.later),
            earlier: self.piece(r.earlier),
            at: self.back.apply(r.at),
            ..r
        };
        rooms.into_iter().map(room).collect()
    }

    pub fn warnings(&self, warnings: Vec<Warning>) -> Vec<Warning> {
        let told = |w: Warning| w.renumber(&|piece| self.piece(piece)).move_by(|at| self.at(at));
        warnings.into_iter().map(told).collect()
    }
}

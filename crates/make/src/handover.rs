//! Conversion of pieces from the space in which they are made to the user's.

use shellock_geom::TriMesh;
use shellock_plan::Handover;

use crate::connector::SeamRoom;
use crate::piece::{Finished, FinishedJoint, PressFit};

impl Finished {
    /// Converts pieces and places to those of the kit. The meshes were already turned, before rounding.
    pub fn hand_over(self, to: &Handover) -> Self {
        let fit = |f: PressFit| PressFit {
            piece: to.piece(f.piece),
            at: to.at(f.at),
            ..f
        };
        let meshes: Vec<TriMesh> = to.in_order(self.meshes.as_slice());
        Self {
            meshes: meshes.into_iter().collect(),
            joints: self.joints.into_iter().map(|joint| joint.hand_over(to)).collect(),
            press_fits: self.press_fits.into_iter().map(fit).collect(),
        }
    }
}

impl FinishedJoint {
    /// Converts pieces and place to those of the kit.
    pub fn hand_over(self, to: &Handover) -> Self {
        Self {
            male: to.piece(self.male),
            female: to.piece(self.female),
            at: to.turn().apply(self.at),
            ..self
        }
    }
}

impl SeamRoom {
    /// Converts pieces and place to those of the kit.
    pub fn hand_over(self, to: &Handover) -> Self {
        Self {
            later: to.piece(self.later),
            earlier: to.piece(self.earlier),
            at: to.turn().apply(self.at),
            ..self
        }
    }
}

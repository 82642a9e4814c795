//! Conversion of ratings from the space in which a kit is made to the user's.

use shellock_plan::Handover;

use super::{Deformed, DeformedLoad, GivesWay, Holding, LoadBorne, LoosePiece, SeamHolding, Touch};
use crate::handling::Deed;

impl Holding {
    /// Converts pieces and places to those of the kit.
    pub fn hand_over(self, to: &Handover) -> Self {
        let loose = |l: LoosePiece| LoosePiece {
            piece: to.piece(l.piece),
            at: to.at(l.at),
        };
        let seam = |s: SeamHolding| SeamHolding {
            later: to.piece(s.later),
            earlier: to.piece(s.earlier),
            at: to.at(s.at),
            ..s
        };
        Self {
            bears: self.bears.into_iter().map(|b| b.hand_over(to)).collect(),
            loose: self.loose.into_iter().map(loose).collect(),
            seams: self.seams.into_iter().map(seam).collect(),
            foreseen_play: to.in_order(&self.foreseen_play),
            foreseen_excess: to.in_order(&self.foreseen_excess),
            ..self
        }
    }
}

impl LoadBorne {
    fn hand_over(self, to: &Handover) -> Self {
        let deed = match self.deed {
            Deed::PressSide { toward } => Deed::PressSide {
                toward: to.at(toward),
            },
            Deed::Fall { down } => Deed::Fall { down: to.at(down) },
            Deed::Hang { piece } => Deed::Hang {
                piece: to.piece(piece),
            },
            other => other,
        };
        let gives_way = |g: GivesWay| GivesWay {
            between: g.between.map(|p| to.piece(p)),
            at: to.at(g.at),
            ..g
        };
        Self {
            deed,
            at: to.at(self.at),
            first: self.first.map(gives_way),
            ..self
        }
    }
}

impl Deformed {
    /// Converts pieces and places to those of the kit.
    pub fn hand_over(self, to: &Handover) -> Self {
        let back = to.turn();
        let touch = |t: Touch| Touch {
            at: back.apply(t.at),
            force_n: back.apply(t.force_n),
        };
        let load = |l: DeformedLoad| DeformedLoad {
            capacity: l.capacity.hand_over(to),
            touches: l.touches.into_iter().map(touch).collect(),
            moved_mm: l.moved_mm.into_iter().map(|m| back.apply(m)).collect(),
            kind: l.kind,
        };
        Self {
            surface: back.mesh(&self.surface),
            piece_of_point: to.all(&self.piece_of_point),
            loads: self.loads.into_iter().map(load).collect(),
        }
    }
}

//! Diagnosis of why there is no plan.

use shellock_assembly::LatticeDirection;
use shellock_report::PatchId;

use super::space::Space;
use super::{Blocker, PieceSet, PlanOutcome};

/// Returns the reason if no plan can exist at all, because the contact graph is not connected well enough.
pub(super) fn structural(space: &Space<'_>) -> Option<PlanOutcome> {
    if !space.all().is_connected(&space.neighbours) {
        let alone: Vec<String> = (0..space.n)
            .filter(|&p| space.neighbours[p].is_empty())
            .map(|p| p.to_string())
            .collect();
        let who = if alone.is_empty() {
            "groups of pieces".into()
        } else {
            format!("pieces {}", alone.join(", "))
        };
        let reason = format!(
            "{who} share no seam with the others that is long enough for a connector; merge them with a \
             neighbour or choose smaller connectors"
        );
        return Some(PlanOutcome::Infeasible {
            reason,
            blockers: Vec::new(),
            articulations: Vec::new(),
            apart: apart(space, PieceSet::first(0)).iter().collect(),
        });
    }
    let articulations = space.articulations();
    if articulations.is_empty() {
        return None;
    }
    let hanging = (articulations.iter())
        .map(|&p| apart(space, PieceSet::one(p)))
        .fold(PieceSet::first(0), PieceSet::union);
    let names: Vec<String> = articulations.iter().map(PatchId::to_string).collect();
    let reason = format!(
        "no plan locks, since all that joins some pieces to the others goes through piece {}; split it \
         lengthwise",
        names.join(" or ")
    );
    Some(PlanOutcome::Infeasible {
        reason,
        blockers: Vec::new(),
        apart: hanging.iter().collect(),
        articulations,
    })
}

/// Pieces outside the largest group of pieces that neighbours join, while the pieces of `without` are away.
/// Of equal groups, the first counts.
fn apart(space: &Space<'_>, without: PieceSet) -> PieceSet {
    let present = space.all().minus(without);
    let group = |first: PatchId| {
        let joined = |q: &PatchId| {
            let pair: PieceSet = [first, *q].into_iter().collect();
            pair.is_joined_within(present, &space.neighbours)
        };
        present.iter().filter(joined).collect::<PieceSet>()
    };
    let groups = present.iter().map(group);
    let largest = groups.reduce(|best, group| if group.len() > best.len() { group } else { best });
    largest.map_or(present, |largest| present.minus(largest))
}

/// Explains a search that got no further than the pieces `stuck`.
pub(super) fn stuck(space: &Space<'_>, stuck: PieceSet) -> PlanOutcome {
    let mut blockers = Vec::new();
    let mut n_free = 0;
    for piece in stuck.iter() {
        let found = blockers_of(space, piece, stuck.minus(PieceSet::one(piece)));
        n_free += usize::from(found.is_empty());
        blockers.extend(found);
    }
    let names: Vec<String> = stuck.iter().map(|p| p.to_string()).collect();
    let reason = if n_free == 0 {
        format!(
            "none of the pieces {} can leave the others of them; split one that is blocked",
            names.join(", ")
        )
    } else {
        // Some path is free, so paths are not the reason: what remains is disconnected or comes loose.
        blockers.clear();
        format!(
            "paths are free, but no order and directions tried for pieces {} lock the assembly",
            names.join(", ")
        )
    };
    PlanOutcome::Infeasible {
        reason,
        blockers,
        articulations: Vec::new(),
        apart: Vec::new(),
    }
}

/// Blockers of `piece` among `rest`, along the direction in which it is occluded least; empty if it can
/// leave.
fn blockers_of(space: &Space<'_>, piece: PatchId, rest: PieceSet) -> Vec<Blocker> {
    let occlusion = &space.survey.occlusion;
    let worst = |s: LatticeDirection| {
        rest.iter()
            .map(|q| occlusion.share(piece, q, s))
            .fold(0.0, f64::max)
    };
    if rest.is_empty() || LatticeDirection::all().any(|s| space.is_free(piece, s, rest)) {
        return Vec::new();
    }
    let Some(best) = LatticeDirection::all().min_by(|&s, &t| worst(s).total_cmp(&worst(t))) else {
        return Vec::new();
    };
    let blocker = |by: PatchId| {
        let at = occlusion.first_hit(piece, by, best)?.to_array();
        Some(Blocker {
            piece,
            by,
            at,
            occluded: occlusion.share(piece, by, best),
        })
    };
    let mut found: Vec<Blocker> = rest.iter().filter_map(blocker).collect();
    found.sort_by(|x, y| y.occluded.total_cmp(&x.occluded).then(x.by.cmp(&y.by)));
    found
}

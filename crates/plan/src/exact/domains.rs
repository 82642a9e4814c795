//! Plans that are still possible under a limit on the cost of each piece, and constraint propagation.
//!
//! The unknowns are the role of each piece (its direction, or being the first) and the later piece of each
//! seam. A plan is also an order, of which only the necessary part is kept: the pieces that must leave before
//! each other, closed under transitivity. So orders that differ in pieces that do not touch are never
//! distinguished. Revising a piece removes what is impossible:
//!
//! 1. order and seams agree: the neighbour that leaves first is the one installed later;
//! 2. no direction runs into a piece that leaves afterwards;
//! 3. each piece but the key joins a later one, each but the first an earlier one;
//! 4. the cost stays under the limit with the best of all other seams ([`PieceCosts::narrow`]).
//!
//! When nothing changes any more, two relaxed tests of the whole assembly follow. First, the pieces that must
//! remain when a piece leaves are connected through pieces that may remain. Second, the assembly locks (the
//! cluster test) if everything still open turns out well.
//!
//! [`PieceCosts::narrow`]: crate::PieceCosts::narrow

use shellock_assembly::LatticeDirection;
use shellock_report::PatchId;

use super::super::key::KeyChoice;
use super::super::local_cost::{
    ALL_DIRECTIONS, DirectionMask, Role, RoleSet, SeamStates, Surroundings, directions_in, mask_of,
};
use super::super::space::Space;
use crate::PieceSet;

/// The possibilities that are still left.
#[derive(Clone)]
pub(super) struct Domains {
    /// Possible roles of each piece.
    pub roles: Vec<RoleSet>,
    /// Possible directions of each contact: with its piece `a` later, and with `b` later.
    pub seams: Vec<[DirectionMask; 2]>,
    /// Pieces that leave before each piece.
    pub before: Vec<PieceSet>,
    /// Pieces that leave after each piece.
    pub after: Vec<PieceSet>,
}

/// Proof that nothing is possible, with the piece at which that showed.
pub(super) struct Conflict(pub PatchId);

/// Revises pieces until nothing changes.
pub(super) struct Propagator<'a> {
    pub space: &'a Space<'a>,
    key: &'a KeyChoice,
    /// Directions with a joint that holds, by contact: with `a` later, and with `b` later.
    hold_masks: Vec<[DirectionMask; 2]>,
    /// Number of pieces whose cost was evaluated: the measure of work.
    pub n_revisions: usize,
    /// Pieces still to revise.
    dirty: PieceSet,
    /// Pieces whose cost must be evaluated again. More remaining pieces alone are no reason, since they
    /// change little.
    is_cost_open: PieceSet,
}

impl<'a> Propagator<'a> {
    pub fn new(space: &'a Space<'a>, key: &'a KeyChoice) -> Self {
        let holding = space.survey.contacts.iter().map(|c| {
            [(c.a, c.b), (c.b, c.a)].map(|(p, q)| {
                let holds = |s: &LatticeDirection| space.joint_partners(p, *s, PieceSet::one(q)).contains(q);
                LatticeDirection::all()
                    .filter(holds)
                    .fold(0, |mask, s| mask | mask_of(s))
            })
        });
        let holding = holding.collect();
        Self {
            space,
            key,
            hold_masks: holding,
            n_revisions: 0,
            dirty: PieceSet::EMPTY,
            is_cost_open: PieceSet::EMPTY,
        }
    }

    /// All possibilities with this key.
    pub fn all(&self) -> Domains {
        let (n, key) = (self.space.n, self.key.piece);
        let of_key = self.key.directions.iter().fold(0, |mask, &s| mask | mask_of(s));
        let role = |p: PatchId| {
            let is_key = p == key;
            let separations = self.space.allowed_mask(p) & if is_key { of_key } else { ALL_DIRECTIONS };
            RoleSet {
                separations,
                may_be_first: !is_key,
                is_key,
            }
        };
        let alone = PieceSet::one(key);
        let (mut before, mut after) = (vec![alone; n], vec![PieceSet::EMPTY; n]);
        before[usize::from(key)] = PieceSet::EMPTY;
        after[usize::from(key)] = self.space.all().minus(alone);
        let seams = vec![[ALL_DIRECTIONS; 2]; self.space.survey.contacts.len()];
        Domains {
            roles: (0..n).map(|p| role(p.into())).collect(),
            seams,
            before,
            after,
        }
    }

    /// Removes what is impossible, starting with the pieces `changed`.
    pub fn propagate(&mut self, d: &mut Domains, changed: PieceSet, limit: f64) -> Result<(), Conflict> {
        self.dirty = changed;
        self.is_cost_open = changed;
        loop {
            while let Some(p) = self.dirty.iter().next() {
                self.dirty = self.dirty.minus(PieceSet::one(p));
                self.revise(d, p, limit)?;
            }
            self.one_first(d)?;
            if self.dirty.is_empty() {
                break;
            }
        }
        self.rests_hang_together(d)?;
        self.may_lock(d)
    }

    fn revise(&mut self, d: &mut Domains, p: PatchId, limit: f64) -> Result<(), Conflict> {
        self.orient(d, p)?;
        self.leave_freely(d, p)?;
        self.join(d, p)?;
        if !self.is_cost_open.contains(p) {
            return Ok(());
        }
        self.n_revisions += 1;
        self.cost(d, p, limit)?;
        self.is_cost_open = self.is_cost_open.minus(PieceSet::one(p));
        Ok(())
    }

    /// Indices into the sides of contact `i` in `Domains::seams`, with `p` later and with the other piece
    /// later, and the other piece.
    fn sides(&self, i: usize, p: PatchId) -> (usize, usize, PatchId) {
        let c = &self.space.survey.contacts[i];
        let own = usize::from(p != c.a);
        (own, 1 - own, c.other(p))
    }

    fn set_seam(
        &mut self,
        d: &mut Domains,
        i: usize,
        states: [DirectionMask; 2],
        by: PatchId,
    ) -> Result<(), Conflict> {
        if d.seams[i] != states {
            d.seams[i] = states;
            let c = &self.space.survey.contacts[i];
            let pair = PieceSet::one(c.a).union(PieceSet::one(c.b));
            self.dirty = self.dirty.union(pair);
            self.is_cost_open = self.is_cost_open.union(pair);
        }
        if states == [0; 2] {
            Err(Conflict(by))
        } else {
            Ok(())
        }
    }

    fn set_roles(&mut self, d: &mut Domains, p: PatchId, roles: RoleSet) -> Result<(), Conflict> {
        if d.roles[usize::from(p)] != roles {
            d.roles[usize::from(p)] = roles;
            self.dirty = self.dirty.union(PieceSet::one(p));
            self.is_cost_open = self.is_cost_open.union(PieceSet::one(p));
        }
        if roles.is_empty() {
            Err(Conflict(p))
        } else {
            Ok(())
        }
    }

    /// Requires that `x` leaves before `y`.
    pub fn order(&mut self, d: &mut Domains, x: PatchId, y: PatchId) -> Result<(), Conflict> {
        if d.before[usize::from(y)].contains(x) {
            return Ok(());
        }
        if x == y || d.before[usize::from(x)].contains(y) {
            return Err(Conflict(x));
        }
        let earlier = d.before[usize::from(x)].union(PieceSet::one(x));
        let later = d.after[usize::from(y)].union(PieceSet::one(y));
        for u in earlier.iter() {
            d.after[usize::from(u)] = d.after[usize::from(u)].union(later);
        }
        for v in later.iter() {
            d.before[usize::from(v)] = d.before[usize::from(v)].union(earlier);
        }
        self.dirty = self.dirty.union(earlier).union(later);
        Ok(())
    }

    /// Makes the order, the seams and the roles of `p` agree.
    fn orient(&mut self, d: &mut Domains, p: PatchId) -> Result<(), Conflict> {
        let at = usize::from(p);
        let space = self.space;
        let mut roles = d.roles[at];
        for &i in &space.contacts_of[at] {
            let (own, others, q) = self.sides(i, p);
            let mut states = d.seams[i];
            states[own] &= roles.separations;
            if d.before[at].contains(q) {
                states[own] = 0;
            }
            if d.after[at].contains(q) {
                states[others] = 0;
            }
            if states[others] == 0 {
                roles.separations &= states[own];
                roles.may_be_first = false;
            }
            self.set_seam(d, i, states, p)?;
            if states[others] == 0 {
                self.order(d, p, q)?;
            } else if states[own] == 0 {
                self.order(d, q, p)?;
            }
        }
        roles.may_be_first &= d.after[at].is_empty();
        self.set_roles(d, p, roles)?;
        if roles.separations == 0 {
            // The first-installed piece leaves after all others.
            for q in space.all().minus(PieceSet::one(p)).iter() {
                self.order(d, q, p)?;
            }
        }
        Ok(())
    }

    /// Keeps directions that are not blocked by a piece that leaves afterwards. A piece that blocks all
    /// remaining directions must leave before `p`.
    fn leave_freely(&mut self, d: &mut Domains, p: PatchId) -> Result<(), Conflict> {
        let at = usize::from(p);
        let mut roles = d.roles[at];
        let mut in_every_way = self.space.all();
        for s in directions_in(roles.separations) {
            let blockers = self.space.blockers(p, s);
            if blockers.and(d.after[at]).is_empty() {
                in_every_way = in_every_way.and(blockers);
            } else {
                roles = roles.without(Role::Between(s));
            }
        }
        self.set_roles(d, p, roles)?;
        if !roles.may_be_first {
            for q in in_every_way.iter() {
                self.order(d, q, p)?;
            }
        }
        Ok(())
    }

    /// Keeps directions with a joint to an earlier piece, and requires a joint to a later one.
    fn join(&mut self, d: &mut Domains, p: PatchId) -> Result<(), Conflict> {
        let space = self.space;
        let mut joining = 0;
        let mut hangs_on = Vec::new();
        for &i in &space.contacts_of[usize::from(p)] {
            let (own, others, _) = self.sides(i, p);
            joining |= d.seams[i][own] & self.hold_masks[i][own];
            if d.seams[i][others] & self.hold_masks[i][others] != 0 {
                hangs_on.push(i);
            }
        }
        let mut roles = d.roles[usize::from(p)];
        roles.separations &= joining;
        self.set_roles(d, p, roles)?;
        match hangs_on[..] {
            _ if p == self.key.piece => Ok(()),
            [] => Err(Conflict(p)),
            [i] => {
                let (own, others, _) = self.sides(i, p);
                let mut states = d.seams[i];
                states[own] = 0;
                states[others] &= self.hold_masks[i][others];
                self.set_seam(d, i, states, p)
            }
            _ => Ok(()),
        }
    }

    fn cost(&mut self, d: &mut Domains, p: PatchId, limit: f64) -> Result<(), Conflict> {
        let space = self.space;
        let mut roles = d.roles[usize::from(p)];
        let before = self.surroundings(d, p);
        let mut around = before.clone();
        space.costs.narrow(p, &mut roles, &mut around, limit);
        for ((&i, x), was) in space.contacts_of[usize::from(p)]
            .iter()
            .zip(&around.seams)
            .zip(&before.seams)
        {
            if x != was {
                let (own, others, _) = self.sides(i, p);
                let mut states = [0; 2];
                (states[own], states[others]) = (x.own, x.others);
                self.set_seam(d, i, states, p)?;
            }
        }
        self.set_roles(d, p, roles)
    }

    /// Knowledge about the surroundings of `p`.
    pub fn surroundings(&self, d: &Domains, p: PatchId) -> Surroundings {
        let seam = |&i: &usize| {
            let (own, others, _) = self.sides(i, p);
            SeamStates {
                own: d.seams[i][own],
                others: d.seams[i][others],
            }
        };
        let seams = self.space.contacts_of[usize::from(p)].iter().map(seam).collect();
        Surroundings {
            seams,
            remainder: d.after[usize::from(p)],
        }
    }

    /// Requires that exactly one piece is the first.
    fn one_first(&mut self, d: &mut Domains) -> Result<(), Conflict> {
        let may: Vec<usize> = (0..self.space.n).filter(|&p| d.roles[p].may_be_first).collect();
        let Some(&p) = may.first() else {
            return Err(Conflict(self.key.piece));
        };
        if may.len() == 1 && d.roles[p].separations != 0 {
            self.set_roles(d, p.into(), d.roles[p].only(Role::First))?;
        }
        Ok(())
    }

    /// Requires that the pieces that certainly remain when a piece leaves are connected, if only through
    /// pieces that may remain.
    fn rests_hang_together(&self, d: &Domains) -> Result<(), Conflict> {
        for p in (0..self.space.n).map(PatchId::from) {
            let surely = d.after[usize::from(p)];
            let may = self
                .space
                .all()
                .minus(d.before[usize::from(p)])
                .minus(PieceSet::one(p));
            if surely.len() > 1 && !surely.is_joined_within(may, &self.space.neighbours) {
                return Err(Conflict(p));
            }
        }
        Ok(())
    }

    /// Runs the cluster test with every open seam as firm as it can become.
    fn may_lock(&self, d: &Domains) -> Result<(), Conflict> {
        let n = self.space.n;
        let key = self.key.piece;
        for line in LatticeDirection::all().take(LatticeDirection::COUNT / 2) {
            let (along, against) = (mask_of(line), mask_of(line.opposite()));
            let mut pulls = vec![PieceSet::EMPTY; n];
            let mut pulled_by = pulls.clone();
            for (i, c) in self.space.survey.contacts.iter().enumerate() {
                for (side, (later, earlier)) in [(c.a, c.b), (c.b, c.a)].into_iter().enumerate() {
                    let joints = d.seams[i][side] & self.hold_masks[i][side];
                    let is_held = later == key && joints != 0;
                    let mut arc = |from: PatchId, to: PatchId| {
                        pulls[usize::from(from)] = pulls[usize::from(from)].union(PieceSet::one(to));
                        pulled_by[usize::from(to)] = pulled_by[usize::from(to)].union(PieceSet::one(from));
                    };
                    if is_held || joints & !along != 0 {
                        arc(later, earlier);
                    }
                    if is_held || joints & !against != 0 {
                        arc(earlier, later);
                    }
                }
            }
            for arcs in [&pulls, &pulled_by] {
                let left = self.space.all().minus(PieceSet::reached_from(key, arcs));
                if let Some(p) = left.iter().next() {
                    return Err(Conflict(p));
                }
            }
        }
        Ok(())
    }
}

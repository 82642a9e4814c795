//! Cost of a piece, as a function of what is known around it when it is removed (Sect. 5.3).
//!
//! Pieces are removed from the key on. When piece p leaves along `s_p`, the directions of the neighbours that
//! left before are known. The neighbours that remain were installed earlier, so their own directions do not
//! affect p:
//!
//! ```text
//!        later neighbours r (gone)        p leaves along s_p        earlier neighbours q (still there)
//!   seam p–r: piece r later, along s_r                          seam p–q: piece p later, along s_p
//! ```
//!
//! So the cost of p depends on one [`SeamStates`] for each seam, on its [`Role`], and on the pieces that
//! remain in its way. The search asks for bounds while several states are still possible. Once a single state
//! is left, the bound is the cost.

use shellock_assembly::LatticeDirection;
use shellock_assembly::push::N_PUSHES;
use shellock_report::PatchId;

use super::score::{ASKED_MM3, FIRM_MM3, HELD_MM3, LOOSE_COST, contact_cost, inward_cost, occluded_cost};
use super::{PieceSet, PlanConstraints, PlanSurvey};

/// Set of lattice directions; bit i stands for the direction with index i.
pub type DirectionMask = u32;

/// Mask of all 26 directions.
pub const ALL_DIRECTIONS: DirectionMask = (1 << LatticeDirection::COUNT) - 1;

/// Iterates over the directions of a mask, in order of their index.
pub fn directions_in(mask: DirectionMask) -> impl Iterator<Item = LatticeDirection> {
    let mut left = mask & ALL_DIRECTIONS;
    std::iter::from_fn(move || {
        let lowest = (left != 0).then(|| left.trailing_zeros())?;
        left &= left - 1;
        LatticeDirection::from_index(lowest as usize)
    })
}

/// Returns the mask of `s` alone.
pub fn mask_of(s: LatticeDirection) -> DirectionMask {
    1 << s.index()
}

/// Place of a piece in the order, with its direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Installed last; leaves along this direction.
    Key(LatticeDirection),
    /// Neither first nor last; leaves along this direction.
    Between(LatticeDirection),
    /// Installed first; leaves no other piece.
    First,
}

impl Role {
    /// Direction along which the piece leaves earlier ones.
    pub fn separation(self) -> Option<LatticeDirection> {
        match self {
            Self::Key(s) | Self::Between(s) => Some(s),
            Self::First => None,
        }
    }
}

/// The roles that are still possible for a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RoleSet {
    /// Directions along which the piece may leave.
    pub separations: DirectionMask,
    /// True if the piece may be the first.
    pub may_be_first: bool,
    /// True if the piece is the key.
    pub is_key: bool,
}

impl RoleSet {
    /// Number of roles that are left.
    pub fn len(self) -> usize {
        self.separations.count_ones() as usize + usize::from(self.may_be_first)
    }

    /// Returns true if no role is left.
    pub fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// Iterates over the roles, directions first.
    pub fn iter(self) -> impl Iterator<Item = Role> {
        let role = move |s| {
            if self.is_key {
                Role::Key(s)
            } else {
                Role::Between(s)
            }
        };
        directions_in(self.separations)
            .map(role)
            .chain(self.may_be_first.then_some(Role::First))
    }

    /// Returns the set with `role` alone.
    pub fn only(self, role: Role) -> Self {
        let separations = role.separation().map_or(0, mask_of);
        Self {
            separations,
            may_be_first: role == Role::First,
            ..self
        }
    }

    /// Returns the set without `role`.
    pub fn without(self, role: Role) -> Self {
        let separations = self.separations & !role.separation().map_or(0, mask_of);
        Self {
            separations,
            may_be_first: self.may_be_first && role != Role::First,
            ..self
        }
    }
}

/// Possible states of one seam, seen from one of its pieces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SeamStates {
    /// Directions along which the piece may leave the neighbour, if the piece is later.
    pub own: DirectionMask,
    /// Directions along which the neighbour may leave the piece, if the neighbour is later.
    pub others: DirectionMask,
}

/// Knowledge about the surroundings of a piece as it leaves.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Surroundings {
    /// Seams of the piece, in the order of the survey's contacts.
    pub seams: Vec<SeamStates>,
    /// Pieces that certainly remain. Once everything is known, these are all that remain.
    pub remainder: PieceSet,
}

/// Cost function of pieces, given their surroundings. The cost of a plan is the bottleneck over all pieces.
///
/// A metric of another kind (Eq. 6: a maximum over pairs of directions at the piece's seams) needs to
/// implement `bound` alone.
pub trait PieceCosts: Send + Sync {
    /// Lower bound on the cost of `piece` in `role`, whichever states of `around` are chosen.
    ///
    /// Equals the cost once each seam has one state left. Infinite if a seam has no state that is compatible
    /// with `role`.
    fn bound(&self, piece: PatchId, role: Role, around: &Surroundings) -> f64;

    /// Returns true if the piece is held by less than the verification requires, by estimate. Always false
    /// for costs without a measure of hold.
    fn is_loose(&self, _piece: PatchId, _role: Role, _around: &Surroundings) -> bool {
        false
    }

    /// Returns true if the piece is held by several times what the verification requires, by estimate. Always
    /// true for costs without a measure of hold.
    fn is_firm(&self, _piece: PatchId, _role: Role, _around: &Surroundings) -> bool {
        true
    }

    /// Removes roles and states that no choice with a cost up to `limit` can use. Some of these may stay in.
    fn narrow(&self, piece: PatchId, roles: &mut RoleSet, around: &mut Surroundings, limit: f64) {
        for role in roles.iter() {
            if self.bound(piece, role, around) > limit {
                *roles = roles.without(role);
            }
        }
        for i in 0..around.seams.len() {
            let whole = around.seams[i];
            let mut left = SeamStates::default();
            for s in directions_in(whole.own & roles.separations) {
                around.seams[i] = SeamStates {
                    own: mask_of(s),
                    others: 0,
                };
                let role = if roles.is_key {
                    Role::Key(s)
                } else {
                    Role::Between(s)
                };
                left.own |= if self.bound(piece, role, around) <= limit {
                    mask_of(s)
                } else {
                    0
                };
            }
            for s in directions_in(whole.others) {
                around.seams[i] = SeamStates {
                    own: 0,
                    others: mask_of(s),
                };
                let is_possible = roles.iter().any(|role| self.bound(piece, role, around) <= limit);
                left.others |= if is_possible { mask_of(s) } else { 0 };
            }
            around.seams[i] = left;
        }
    }
}

/// Hold of a piece for each push, mm³.
type Hold = [f32; N_PUSHES];

/// Contribution of one seam to its piece, for either order and each direction.
struct SeamTable {
    /// Cost times length by direction: first with the piece later, then with the neighbour later.
    cost_mm: [[f64; LatticeDirection::COUNT]; 2],
    /// Hold by direction, in the same order.
    hold: [Vec<Hold>; 2],
}

/// Cost tables of one piece.
struct PieceTable {
    seams: Vec<SeamTable>,
    /// Length of all its seams, mm; at least the smallest positive number.
    length_mm: f64,
    inward: [f64; LatticeDirection::COUNT],
    /// For each direction, cost of each other piece that is in the way.
    occluder_costs: Vec<Vec<(PatchId, f64)>>,
}

/// The default cost of a piece: the mean over its seams, by length, of Eq. 4's weight and of the unusable
/// share, plus its path and its missing hold.
pub struct SeamCosts {
    pieces: Vec<PieceTable>,
}

/// Slack of comparisons that subtract, in units of cost and in mm³. Above rounding, so that nothing possible
/// is removed.
const COST_SLACK: f64 = 1e-9;
const HOLD_SLACK_MM3: f32 = 1e-3;

impl SeamCosts {
    /// Builds the tables for `survey` and `constraints`. Cost: 52 entries of 66 numbers for each seam.
    pub fn new(survey: &PlanSurvey, constraints: &PlanConstraints) -> Self {
        let n = survey.n_pieces;
        let mut pieces: Vec<PieceTable> = (0..n)
            .map(PatchId::from)
            .map(|p| PieceTable::new(survey, p))
            .collect();
        for contact in &survey.contacts {
            for p in [contact.a, contact.b] {
                let q = contact.other(p);
                let mut cost_mm = [[0.0; LatticeDirection::COUNT]; 2];
                let mut hold = [(); 2].map(|()| vec![[0.0; N_PUSHES]; LatticeDirection::COUNT]);
                for (order, later) in [p, q].into_iter().enumerate() {
                    for s in LatticeDirection::all() {
                        let is_weak = constraints.is_weak(later, contact.other(later), s);
                        cost_mm[order][s.index()] =
                            contact_cost(survey, contact, later, s, is_weak) * contact.length_mm;
                        if let Some(pushes) = contact.hold(later, s).filter(|_| !is_weak) {
                            // Pushes of the later piece come first.
                            hold[order][s.index()] = pushes[order];
                        }
                    }
                }
                let table = &mut pieces[usize::from(p)];
                table.length_mm += contact.length_mm;
                table.seams.push(SeamTable { cost_mm, hold });
            }
        }
        pieces
            .iter_mut()
            .for_each(|t| t.length_mm = t.length_mm.max(f64::MIN_POSITIVE));
        Self { pieces }
    }

    /// Estimated overlap, mm³, with which `piece` resists its weakest push; infinite for the key. An upper
    /// bound while seams are open.
    pub fn hold_mm3(&self, piece: PatchId, role: Role, around: &Surroundings) -> f64 {
        if let Role::Key(_) = role {
            return f64::INFINITY;
        }
        let mut sum = [0.0; N_PUSHES];
        for (seam, states) in self.pieces[usize::from(piece)].seams.iter().zip(&around.seams) {
            match seam.only_hold(role, *states) {
                Some(held) => add(&mut sum, held),
                None => add(&mut sum, &seam.greatest_hold(role, *states)),
            }
        }
        f64::from(least(&sum))
    }
}

fn add(sum: &mut Hold, held: &Hold) {
    sum.iter_mut().zip(held).for_each(|(sum, mm3)| *sum += mm3);
}

fn raise(most: &mut Hold, held: &Hold) {
    most.iter_mut()
        .zip(held)
        .for_each(|(most, &mm3)| *most = if mm3 > *most { mm3 } else { *most });
}

fn least(held: &Hold) -> f32 {
    held.iter()
        .copied()
        .fold(f32::INFINITY, |x, y| if y < x { y } else { x })
}

/// Cost of a piece for its missing hold, given that it is held by `hold_mm3`.
fn loose_cost(hold_mm3: f64) -> f64 {
    LOOSE_COST * (1.0 - hold_mm3 / HELD_MM3).max(0.0)
}

impl SeamTable {
    /// Least cost times length over the directions `others`; infinite if there are none.
    fn least_of_others(&self, others: DirectionMask) -> f64 {
        directions_in(others)
            .map(|s| self.cost_mm[1][s.index()])
            .fold(f64::INFINITY, f64::min)
    }

    fn most_of_others(&self, others: DirectionMask) -> Hold {
        let mut most = [0.0; N_PUSHES];
        directions_in(others).for_each(|s| raise(&mut most, &self.hold[1][s.index()]));
        most
    }

    /// Least cost times length of the seam in `role`.
    fn least_cost_mm(&self, role: Role, states: SeamStates) -> f64 {
        self.with_own(role, states, self.least_of_others(states.others))
    }

    fn with_own(&self, role: Role, states: SeamStates, of_others: f64) -> f64 {
        match role.separation().filter(|&s| states.own & mask_of(s) != 0) {
            Some(s) => of_others.min(self.cost_mm[0][s.index()]),
            None => of_others,
        }
    }

    /// Hold of the only state left, without any comparison; `None` if several or none are left.
    fn only_hold(&self, role: Role, states: SeamStates) -> Option<&Hold> {
        let own = role.separation().filter(|&s| states.own & mask_of(s) != 0);
        match (own, states.others) {
            (Some(s), 0) => Some(&self.hold[0][s.index()]),
            (None, others) if others.is_power_of_two() => {
                Some(&self.hold[1][others.trailing_zeros() as usize])
            }
            _ => None,
        }
    }

    fn greatest_hold(&self, role: Role, states: SeamStates) -> Hold {
        let mut most = self.most_of_others(states.others);
        if let Some(s) = role.separation().filter(|&s| states.own & mask_of(s) != 0) {
            raise(&mut most, &self.hold[0][s.index()]);
        }
        most
    }
}

impl PieceTable {
    fn new(survey: &PlanSurvey, p: PatchId) -> Self {
        let inward = std::array::from_fn(|i| {
            let s = LatticeDirection::all().nth(i).expect("26 directions");
            inward_cost(survey, p, s)
        });
        let others = || (0..survey.n_pieces).map(PatchId::from).filter(|&q| q != p);
        let of = |s| {
            others()
                .map(|q| (q, occluded_cost(survey, p, s, q)))
                .filter(|x| x.1 > 0.0)
                .collect()
        };
        let occluded = LatticeDirection::all().map(of).collect();
        Self {
            seams: Vec::new(),
            length_mm: 0.0,
            inward,
            occluder_costs: occluded,
        }
    }

    /// Cost of the way out of `remaining`.
    fn path_cost(&self, role: Role, remaining: PieceSet) -> f64 {
        let occluded = |s: LatticeDirection| {
            let in_way = self.occluder_costs[s.index()]
                .iter()
                .filter(|x| remaining.contains(x.0));
            in_way.map(|x| x.1).sum::<f64>()
        };
        match role {
            // The key slides out along the surface, the first piece never leaves.
            Role::Key(s) => occluded(s),
            Role::Between(s) => self.inward[s.index()] + occluded(s),
            Role::First => 0.0,
        }
    }
}

impl PieceCosts for SeamCosts {
    fn bound(&self, piece: PatchId, role: Role, around: &Surroundings) -> f64 {
        let table = &self.pieces[usize::from(piece)];
        let seams = table.seams.iter().zip(&around.seams);
        let cost_mm: f64 = seams
            .map(|(seam, &states)| seam.least_cost_mm(role, states))
            .sum();
        let path = table.path_cost(role, around.remainder);
        cost_mm / table.length_mm + path + loose_cost(self.hold_mm3(piece, role, around))
    }

    fn is_loose(&self, piece: PatchId, role: Role, around: &Surroundings) -> bool {
        self.hold_mm3(piece, role, around) < ASKED_MM3
    }

    fn is_firm(&self, piece: PatchId, role: Role, around: &Surroundings) -> bool {
        self.hold_mm3(piece, role, around) >= FIRM_MM3
    }

    fn narrow(&self, piece: PatchId, roles: &mut RoleSet, around: &mut Surroundings, limit: f64) {
        let table = &self.pieces[usize::from(piece)];
        let seams = || table.seams.iter().zip(&around.seams);
        let of_others: Vec<(f64, Hold)> = seams()
            .map(|(t, x)| (t.least_of_others(x.others), t.most_of_others(x.others)))
            .collect();
        let mut left = vec![SeamStates::default(); around.seams.len()];
        for role in roles.iter() {
            let path = table.path_cost(role, around.remainder);
            let with_own =
                |((t, &x), others): ((&SeamTable, &SeamStates), &(f64, Hold))| t.with_own(role, x, others.0);
            let least_mm: Vec<f64> = seams().zip(&of_others).map(with_own).collect();
            let cost_mm: f64 = least_mm.iter().sum();
            let base = cost_mm / table.length_mm + path;
            if base > limit || !base.is_finite() {
                *roles = roles.without(role);
                continue;
            }
            let is_held = matches!(role, Role::Key(_));
            let mut choice = Choice {
                cost_mm,
                least_mm,
                hold: [0.0; N_PUSHES],
                most: Vec::with_capacity(left.len()),
            };
            if !is_held {
                seams()
                    .zip(&of_others)
                    .for_each(|((seam, &states), (_, most))| choice.hold(seam, role, states, most));
                if base + loose_cost(f64::from(least(&choice.hold))) > limit {
                    *roles = roles.without(role);
                    continue;
                }
            }
            let most_mm = (limit - path + COST_SLACK) * table.length_mm;
            let held_mm3 = HELD_MM3 * (1.0 - (limit - base) / LOOSE_COST);
            let needed = (!is_held).then_some(held_mm3 as f32 - HOLD_SLACK_MM3);
            for (i, (seam, states)) in seams().enumerate() {
                choice.support(i, seam, role, *states, &mut left[i], most_mm, needed);
            }
        }
        around.seams = left;
    }
}

/// The best contribution of each seam to a piece in one role.
struct Choice {
    cost_mm: f64,
    /// Least cost times length, by seam.
    least_mm: Vec<f64>,
    hold: Hold,
    /// Greatest hold, by seam; empty for the key, which needs no hold.
    most: Vec<Hold>,
}

impl Choice {
    /// Adds the greatest hold of the next seam.
    fn hold(&mut self, seam: &SeamTable, role: Role, states: SeamStates, most_of_others: &Hold) {
        let mut most = *most_of_others;
        if let Some(s) = role.separation().filter(|&s| states.own & mask_of(s) != 0) {
            raise(&mut most, &seam.hold[0][s.index()]);
        }
        add(&mut self.hold, &most);
        self.most.push(most);
    }

    /// Keeps the states of seam `i` that suffice together with the best of all other seams. `needed` is the
    /// required hold, mm³, if any.
    #[expect(
        clippy::too_many_arguments,
        reason = "one innermost step, with what its loops have at hand"
    )]
    fn support(
        &self,
        i: usize,
        seam: &SeamTable,
        role: Role,
        states: SeamStates,
        left: &mut SeamStates,
        most_mm: f64,
        needed: Option<f32>,
    ) {
        let own = role.separation().filter(|&s| states.own & mask_of(s) != 0);
        let others = states.others & !left.others;
        if own.is_none() && others == 0 {
            return;
        }
        let room_mm = most_mm - (self.cost_mm - self.least_mm[i]);
        let without: Option<Hold> = needed.map(|_| std::array::from_fn(|k| self.hold[k] - self.most[i][k]));
        let is_held = |held: &Hold| match (&without, needed) {
            (Some(without), Some(needed)) => {
                let sum: Hold = std::array::from_fn(|k| without[k] + held[k]);
                least(&sum) >= needed
            }
            _ => true,
        };
        let fits = |order: usize, s: LatticeDirection| {
            seam.cost_mm[order][s.index()] <= room_mm && is_held(&seam.hold[order][s.index()])
        };
        for s in directions_in(others) {
            left.others |= if fits(1, s) { mask_of(s) } else { 0 };
        }
        if let Some(s) = own {
            left.own |= if fits(0, s) { mask_of(s) } else { 0 };
        }
    }
}

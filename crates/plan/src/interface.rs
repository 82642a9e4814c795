//! Quality of the connectors that each seam could carry, for either order of its two pieces and all 26
//! directions (Eq. 4).
//!
//! At a sample of the seam, `u` is the tangent and `N` the outward normal, made perpendicular to `u`. `v` is
//! perpendicular to both and points from the later piece p to the earlier q. `s` is the direction along which
//! p leaves. The connector of the paper becomes shallow if `s` runs along the seam, and leans backward if `s`
//! points towards q:
//!
//! ```text
//!        N, T = 0: pulls straight out          the male piece is p where s · N ≥ 0,
//!   forward ↖ ↑ ↗ backward                     else q, which leaves p along ŝ = −s
//!      ───p───┼───q───▶ v
//! ```
//!
//! Limits: connectors lie on the inner side of the wall, whose edge is estimated from the outer surface
//! (`interface::sample`); carving may shift it. Pieces other than the two may obstruct a connector, which
//! shows only later.

mod blocking;
mod obstruction;
mod sample;
mod touches;

pub use blocking::{BlockingTable, Pushes};
pub use obstruction::{Leave, Obstructions, Sights};
pub use touches::{pin_contacts, wall_contacts};

use rayon::prelude::*;
use sample::{Line, Way, lines};
use shellock_assembly::LatticeDirection;
use shellock_geom::Vec3;
use shellock_mechanics::{Joint as MechanicalJoint, Meeting, Side, Station};
use shellock_report::PatchId;
use shellock_surface::seam::rules::{
    COUNTED_RUN_SIZES, MAX_ALONG_SEAM, MAX_BACKWARD_RAD, MAX_OUT_OF_RAIL, SHORTEST_RUN_SIZES,
};
use shellock_surface::{Seam, SegmentedSurface};

use super::PlanParams;
use crate::sizes::ConnectorSizes;

/// Connectors possible on the seams between two pieces, for one order and one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Joint {
    /// Weight `w` of Eq. 4, mean over the seams' length; in [β, 1 + β], lower is better.
    ///
    /// The mean and not a high quantile: a seam around a piece has some stretch along any `s`, so high
    /// quantiles are all near 1.
    pub weight: f64,
    /// Share of the seams' length on which a connector can be made, in [0, 1].
    pub usable: f64,
    /// Longest single run of connectors, mm.
    pub run_mm: f64,
    /// True if that run is long enough to hold, see [`Interface::count_runs_from`].
    pub holds: bool,
}

/// The contact of two pieces that share seams.
#[derive(Clone, Debug)]
pub struct Interface {
    /// The piece with the lower id.
    pub a: PatchId,
    /// The piece with the higher id.
    pub b: PatchId,
    /// Length of all seams between the two, mm.
    pub length_mm: f64,
    /// Size D of their connectors, mm.
    pub size_mm: f64,
    /// Joints by order (`a` later, then `b` later) and by direction.
    joints: [[Joint; LatticeDirection::COUNT]; 2],
    hold: BlockingTable,
    /// Inner edges of the walls below the seams.
    lines: Vec<Line>,
}

/// The frame of a seam as seen from its later piece: three perpendicular unit vectors.
#[derive(Clone, Copy, Debug)]
pub struct SeamFrame {
    /// Unit vector along the seam.
    pub tangent: Vec3,
    /// Unit vector out of the surface.
    pub normal: Vec3,
    /// Unit vector from the later piece to the earlier one.
    pub across: Vec3,
}

impl SeamFrame {
    /// Returns true if a connector can be made when the later piece leaves along the unit vector `s`.
    pub fn carries(&self, s: Vec3) -> bool {
        // s' is s without its part along the seam. If q is the male piece, both s and v change sign, so their
        // product stays the same.
        let (outwards, towards_female) = (s.dot(self.normal).abs(), s.dot(self.across));
        s.dot(self.tangent).abs() <= MAX_ALONG_SEAM && towards_female.atan2(outwards) <= MAX_BACKWARD_RAD
    }

    /// Returns true if the seam runs along `s`, so that the key can slide on a rail under it.
    pub fn carries_rail(&self, s: Vec3) -> bool {
        s.dot(self.tangent).abs() > MAX_ALONG_SEAM && s.dot(self.normal).abs() < MAX_OUT_OF_RAIL
    }

    /// Direction that the later piece's wall faces if the piece leaves along the unit vector `s`: towards the
    /// earlier piece. If `s` leads there, the face leans, so that it does not obstruct the way out.
    pub fn wall(&self, s: Vec3) -> Vec3 {
        let in_section = s.reject_from_normalized(self.tangent).normalize_or_zero();
        let lean = in_section.dot(self.across).max(0.0);
        (self.across - lean * in_section).normalize_or(self.across)
    }

    /// Weight `w` of Eq. 4, in [β, 1 + β]: large if `s` runs along the seam or towards the earlier piece.
    pub fn weight(&self, s: Vec3, beta: f64) -> f64 {
        s.dot(self.tangent).abs().max(s.dot(self.across).max(0.0)) + beta
    }
}

/// Contact of two pieces at a station, with connectors of `size_mm`, when the later one leaves along `s`. Has
/// no connector if none can be made, unless `is_any_angle`. `is_on_rails` is true if the later piece is the
/// key and slides on rails.
pub fn meeting(
    station: &Station,
    size_mm: f64,
    a_is_later: bool,
    s: Vec3,
    beta: f64,
    is_any_angle: bool,
    is_on_rails: bool,
) -> Meeting {
    let across = if a_is_later {
        station.across
    } else {
        -station.across
    };
    let frame = SeamFrame {
        tangent: station.tangent,
        normal: station.normal,
        across,
    };
    let in_section = s.reject_from_normalized(station.tangent).normalize_or_zero();
    let face = frame.wall(s);
    let wall = if a_is_later { face } else { -face };
    let (later, earlier) = if a_is_later {
        (Side::A, Side::B)
    } else {
        (Side::B, Side::A)
    };
    let later_is_male = s.dot(station.normal) >= 0.0;
    let (male, leaves) = if later_is_male {
        (later, in_section)
    } else {
        (earlier, -in_section)
    };
    let pull_on_a = if a_is_later { s } else { -s };
    let is_rail = is_on_rails && frame.carries_rail(s);
    // A rail holds across the seam. A piece that leaves along the rail passes beside it.
    let (male, leaves) = if is_rail {
        (earlier, station.normal)
    } else {
        (male, leaves)
    };
    let weight = if is_rail { beta } else { frame.weight(s, beta) };
    let joint = MechanicalJoint {
        male,
        leaves,
        is_fast: false,
        pull_on_a,
        weight,
        size_mm,
    };
    Meeting {
        wall,
        joint: (is_any_angle || is_rail || frame.carries(s)).then_some(joint),
    }
}

impl Interface {
    /// Joint between the two if `later` is installed after the other and leaves along `s`.
    pub fn joint(&self, later: PatchId, s: LatticeDirection) -> &Joint {
        &self.joints[usize::from(later != self.a)][s.index()]
    }

    /// Hold of that joint, by push. `None` if the joint does not hold, and for made-up contacts without a
    /// table.
    pub fn hold(&self, later: PatchId, s: LatticeDirection) -> Option<&Pushes> {
        if !self.joint(later, s).holds {
            return None;
        }
        self.hold.pushes(usize::from(later != self.a), s)
    }

    /// The piece of the contact that is not `piece`.
    pub fn other(&self, piece: PatchId) -> PatchId {
        if piece == self.a { self.b } else { self.a }
    }

    /// Counts exactly the joints as holding whose run is at least `shortest_sizes` connector sizes long. The
    /// value must not be below the shortest run that is made.
    pub fn count_runs_from(&mut self, shortest_sizes: f64) {
        let shortest_mm = shortest_sizes * self.size_mm;
        self.joints
            .iter_mut()
            .flatten()
            .for_each(|j| j.holds = j.run_mm >= shortest_mm);
    }

    /// Returns true if some order and direction makes a joint that holds.
    pub fn can_hold(&self) -> bool {
        self.joints.iter().flatten().any(|j| j.holds)
    }

    /// Makes up a contact for tests, with joints from a function of the later piece and the direction.
    #[cfg(test)]
    pub fn made_up(
        a: PatchId,
        b: PatchId,
        joint: impl Fn(PatchId, LatticeDirection) -> Joint,
        hold: BlockingTable,
    ) -> Self {
        let joints =
            [a, b].map(|p| std::array::from_fn(|i| joint(p, LatticeDirection::all().nth(i).unwrap())));
        Self {
            a,
            b,
            length_mm: 20.0,
            size_mm: 2.5,
            joints,
            hold,
            lines: Vec::new(),
        }
    }
}

/// Contacts of all pairs that share a seam, sorted by pair.
pub fn contacts(
    params: &PlanParams,
    surface: &SegmentedSurface,
    seams: &[Seam],
    sizes: &ConnectorSizes,
) -> Vec<Interface> {
    let obstructions = Obstructions::new(params.wall_mm, &surface.mesh, surface.patch_of_face.as_slice());
    let inner = |seam: &Seam| lines(params, sizes.of(seam.a, seam.b), seam, obstructions.as_ref());
    let mut measured: Vec<(&Seam, Vec<Line>)> = seams.par_iter().map(|seam| (seam, inner(seam))).collect();
    measured.sort_by_key(|(seam, _)| (seam.a, seam.b));
    measured
        .chunk_by(|(x, _), (y, _)| (x.a, x.b) == (y.a, y.b))
        .filter_map(|group| contact(params, sizes, group))
        .collect()
}

/// Evaluates the seams of one pair; `None` if they have no length.
fn contact(params: &PlanParams, sizes: &ConnectorSizes, seams: &[(&Seam, Vec<Line>)]) -> Option<Interface> {
    let (a, b) = seams.first().map(|(seam, _)| (seam.a, seam.b))?;
    let size_mm = sizes.of(a, b);
    let length_mm: f64 = seams
        .iter()
        .map(|(seam, _)| seam.length_below(params.wall_mm))
        .sum();
    if length_mm <= 0.0 {
        return None;
    }
    let lines: Vec<&Line> = seams.iter().flat_map(|(_, lines)| lines).collect();
    let joints: [[Joint; LatticeDirection::COUNT]; 2] = [1.0, -1.0].map(|side| {
        std::array::from_fn(|i| {
            // The frame with b later than a is the one with a later, with v reversed.
            let s = LatticeDirection::all().nth(i).expect("26 directions");
            joint(params, size_mm, &lines, Way::new(params, [a, b], side, s))
        })
    });
    let least_mm = SHORTEST_RUN_SIZES * size_mm;
    let holds = |order: usize, s: LatticeDirection| joints[order][s.index()].run_mm >= least_mm;
    let hold = BlockingTable::new(params, size_mm, [a, b], &lines, holds);
    Some(Interface {
        a,
        b,
        length_mm,
        size_mm,
        joints,
        hold,
        lines: seams.iter().flat_map(|(_, lines)| lines).cloned().collect(),
    })
}

/// Evaluates the connectors under `lines` for one order and direction. Without lines, no connector is
/// possible.
fn joint(params: &PlanParams, size_mm: f64, lines: &[&Line], way: Way) -> Joint {
    let (mut weight, mut usable, mut length_mm, mut run_mm) = (0.0, 0.0, 0.0, 0.0_f64);
    for line in lines {
        for x in &line.samples {
            weight += way.weight(x, params.beta) * x.length_mm;
            length_mm += x.length_mm;
        }
        for run in line.runs(way) {
            usable += run
                .samples
                .iter()
                .map(|&i| line.samples[i].length_mm)
                .sum::<f64>();
            run_mm = run_mm.max(run.length_mm);
        }
    }
    if length_mm <= 0.0 {
        return Joint {
            weight: 1.0 + params.beta,
            ..Joint::default()
        };
    }
    Joint {
        weight: weight / length_mm,
        usable: usable / length_mm,
        run_mm,
        holds: run_mm >= COUNTED_RUN_SIZES[0] * size_mm,
    }
}

#[cfg(test)]
mod tests {
    use shellock_surface::seam::rules::end_gap_mm;
    use shellock_test_surfaces::{label, level_seam, seams, sphere};

    use super::*;

    fn cap_contact(height: f64) -> Interface {
        let surface = label(sphere(5, Vec3::splat(50.0)), 2, |p| u32::from(p.z > height));
        let mut found = contacts(
            &PlanParams::default(),
            &surface,
            &seams(&surface),
            &ConnectorSizes::default(),
        );
        assert_eq!(found.len(), 1);
        found.remove(0)
    }

    #[test]
    fn a_seam_as_long_as_its_size_asks_for_has_room_for_a_run_that_holds() {
        for size_mm in [2.0, 2.5, 4.0] {
            let length_mm = crate::sizes::CONTACT_SIZES * size_mm;
            assert!(length_mm - 2.0 * end_gap_mm(size_mm, length_mm) >= 2.5 * size_mm);
        }
    }

    #[test]
    fn a_level_seam_is_best_left_upwards_and_worst_sideways() {
        let contact = cap_contact(0.0);
        let cap = contact.b;
        assert!((contact.length_mm - std::f64::consts::TAU * 50.0).abs() < 1.0);
        let up = contact.joint(cap, LatticeDirection::nearest(Vec3::Z));
        // On the equator +z is −v for the upper half: a pure forward connector, weight β.
        assert!((up.weight - 0.1).abs() < 0.02, "{up:?}");
        assert!(up.holds && up.usable > 0.99);
        assert!((up.run_mm / contact.length_mm - 1.0).abs() < 1e-3, "{up:?}");
        let down = contact.joint(cap, LatticeDirection::nearest(-Vec3::Z));
        assert!(
            (down.weight - 1.1).abs() < 0.02 && down.usable < 0.01 && !down.holds,
            "{down:?}"
        );
        let side = contact.joint(cap, LatticeDirection::nearest(Vec3::X));
        // |s·u| = |sin φ| ≤ 0.9 on 71 % of the circle.
        assert!((side.usable - 0.713).abs() < 0.03, "{side:?}");
        assert!((side.weight - (std::f64::consts::FRAC_2_PI + 0.1)).abs() < 0.03);
    }

    #[test]
    fn round_a_thin_limb_the_far_wall_leaves_only_ways_along_it() {
        let surface = label(sphere(5, Vec3::new(7.0, 7.0, 60.0)), 2, |p| u32::from(p.z > 0.0));
        let share = |wall_mm: f64, s: Vec3| {
            let params = PlanParams {
                wall_mm,
                ..PlanParams::default()
            };
            let contact = contacts(&params, &surface, &seams(&surface), &ConnectorSizes::default()).remove(0);
            contact.joint(contact.b, LatticeDirection::nearest(s)).usable
        };
        assert!(share(0.0, Vec3::X) > 0.6 && share(2.0, Vec3::X) < 0.2);
        assert!(share(2.0, Vec3::Z) > 0.99);
    }

    #[test]
    fn swapping_the_order_and_the_direction_leaves_the_joint_as_it_is() {
        let contact = cap_contact(20.0);
        for s in LatticeDirection::all() {
            let (x, y) = (
                contact.joint(contact.b, s),
                contact.joint(contact.a, s.opposite()),
            );
            assert!((x.weight - y.weight).abs() < 1e-12 && (x.usable - y.usable).abs() < 1e-12);
        }
    }

    #[test]
    fn an_open_seam_loses_both_ends_and_a_short_one_joins_nothing() {
        let up = |length_mm: f64, size_mm: f64| {
            let seam = level_seam(vec![Vec3::ZERO, length_mm * Vec3::X]);
            let params = PlanParams::default();
            let lines = lines(&params, size_mm, &seam, None);
            let contact = contact(&params, &ConnectorSizes::uniform(size_mm), &[(&seam, lines)]).unwrap();
            *contact.joint(PatchId(0), LatticeDirection::nearest(Vec3::Z))
        };
        assert!((up(40.0, 2.5).run_mm - 32.5).abs() <= 1.0);
        assert!(up(40.0, 2.5).holds && !up(12.0, 2.5).holds);
        // Only the ratio to the size decides: half the size needs half the length.
        assert!(up(12.0, 1.25).holds && !up(20.0, 5.0).holds);
    }
}

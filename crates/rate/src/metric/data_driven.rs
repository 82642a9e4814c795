//! The boundary-based, data-driven metric (Sect. 5.3, Eq. 6), and one that tests each piece as a whole.
//!
//! ```text
//!   d_k = max over places i on the boundary of piece k and tests f of  w_i d(u_i, v_i, s_i, f)
//!   Q = −max_k d_k
//! ```
//!
//! with f over the directions in which the piece separates from its neighbours (translation) and over ± (x_i
//! − x_a) × (x_b − x_a) for the ends x_a, x_b of the boundary (rotation). The study (docs/notes/metrics.md)
//! shows that the maximum hides interlocking: every boundary opens along its own direction, no matter how the
//! piece is held elsewhere. [`pieces_alone`] therefore simulates each piece with its neighbours held. That
//! metric, too, depends only on the directions on the piece's own boundaries.

use shellock_geom::Vec3;
use shellock_geom::sparse::SparseError;
use shellock_mechanics::{Meeting, Resistance, SurfaceModel};
use shellock_plan::interface::SeamFrame;
use shellock_plan::local_tests::LocalTests;
use shellock_report::PatchId;

use super::PlanModel;

/// Quality by Eq. 6 as published, mm; higher is better; 0 where nothing is joined.
pub fn data_driven(model: &PlanModel, tests: &LocalTests, plan: &[Meeting]) -> f64 {
    let pieces = (0..model.assembly.n_parts).map(PatchId::from);
    -pieces.map(|k| piece(model, tests, plan, k)).fold(0.0, f64::max)
}

/// Greatest weighted opening `d_k` of piece k (Eq. 6), mm.
fn piece(model: &PlanModel, tests: &LocalTests, plan: &[Meeting], k: PatchId) -> f64 {
    let own: Vec<Place> = places_of(model, plan, k);
    let mut pulls: Vec<Vec3> = Vec::new();
    for place in &own {
        if !pulls.contains(&place.pull) {
            pulls.push(place.pull);
        }
    }
    let mut worst = 0.0_f64;
    for place in &own {
        let turn = place.turn(model);
        for f in pulls
            .iter()
            .copied()
            .chain([turn, -turn])
            .filter(|f| *f != Vec3::ZERO)
        {
            worst = worst.max(place.weight * place.opening_mm(tests, f));
        }
    }
    worst
}

/// A joined station, from the side of one of its pieces.
struct Place {
    station: usize,
    is_a: bool,
    /// Frame with side a as the later piece; a later b pulled along s is an earlier a pulled along −s.
    frame: SeamFrame,
    /// Direction in which side a is pulled from side b.
    pull_on_a: Vec3,
    /// Direction in which the piece is pulled.
    pull: Vec3,
    weight: f64,
}

fn places_of(model: &PlanModel, plan: &[Meeting], k: PatchId) -> Vec<Place> {
    let mut places = Vec::new();
    for (station, (s, meeting)) in model.assembly.stations.iter().zip(plan).enumerate() {
        let pieces = model.pieces_at(station);
        let (Some(joint), true) = (meeting.joint, pieces.contains(&k)) else {
            continue;
        };
        let is_a = pieces[0] == k;
        let frame = SeamFrame {
            tangent: s.tangent,
            normal: s.normal,
            across: s.across,
        };
        let pull = if is_a { joint.pull_on_a } else { -joint.pull_on_a };
        places.push(Place {
            station,
            is_a,
            frame,
            pull_on_a: joint.pull_on_a,
            pull,
            weight: joint.weight,
        });
    }
    places
}

impl Place {
    /// Opening of the place where the piece is pulled by the unit vector `f`, mm.
    fn opening_mm(&self, tests: &LocalTests, f: Vec3) -> f64 {
        tests.opening_mm(&self.frame, self.pull_on_a, if self.is_a { f } else { -f })
    }

    /// Direction in which the place moves when the piece turns about the ends of its boundary; zero on a
    /// straight boundary.
    fn turn(&self, model: &PlanModel) -> Vec3 {
        let [from, to] = model.seam_ends(self.station);
        (model.place_of(self.station) - from)
            .cross(to - from)
            .normalize_or_zero()
    }
}

/// Quality `−max_k` of the openings of each piece k with all others held, mm; higher is better. The key,
/// which friction holds, is left out.
///
/// `None` where some piece comes apart even then.
pub fn pieces_alone(
    model: &PlanModel,
    solver: &SurfaceModel,
    plan: &[Meeting],
    key: PatchId,
) -> Result<Option<f64>, SparseError> {
    let mut worst = 0.0_f64;
    for k in (0..model.assembly.n_parts as u32).filter(|k| *k != key.0) {
        let Resistance::Holds(opening) = solver.resist_alone(plan, k)?.resistance else {
            return Ok(None);
        };
        let own = places_of(model, plan, PatchId(k));
        worst = own
            .iter()
            .map(|p| p.weight * opening.opening_mm[p.station])
            .fold(worst, f64::max);
    }
    Ok(Some(-worst))
}

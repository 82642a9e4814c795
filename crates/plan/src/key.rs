//! Choice of the key: the flattest piece, sliding out within its plane (Sect. 6.1).

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use shellock_assembly::LatticeDirection;
use shellock_geom::Vec3;
use shellock_report::{IdVec, PatchId};
use shellock_surface::SegmentedSurface;
use shellock_surface::plane::{Plane, Spot};

use super::{PlanParams, PlanSurvey};

/// Candidate planes tried for each piece.
const N_PLANES: usize = 64;

/// Greatest number of faces sampled for each piece, so that a fine mesh costs no more than a coarse one.
const MAX_FACES: usize = 3000;

/// Directions tried within the plane (Sect. 6.1).
const N_IN_PLANE: usize = 8;

/// Least share of a piece on its plane for a good key. Below it, the connectors cannot run straight.
const FLAT_SHARE: f64 = 0.5;

/// Penalty on the rank of a key on top compared with one underneath, as a share.
const VISIBLE_COST: f64 = 0.25;

/// The plane that fits a piece best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flatness {
    /// Outward unit normal of the plane; zero where the piece has no area.
    pub normal: Vec3,
    /// Share of the piece's area on the plane, in [0, 1].
    pub share: f64,
}

impl Flatness {
    /// Flatness of a piece without area.
    pub const NONE: Self = Self {
        normal: Vec3::ZERO,
        share: 0.0,
    };

    /// Returns true if the piece makes a good key.
    pub fn is_flat(self) -> bool {
        self.share >= FLAT_SHARE
    }

    /// Up to eight lattice directions nearest to directions in the plane, without repeats, in order round the
    /// normal.
    pub fn in_plane(self) -> Vec<LatticeDirection> {
        if self.normal == Vec3::ZERO {
            return Vec::new();
        }
        let (x, y) = self.normal.any_orthonormal_pair();
        let mut directions = Vec::new();
        for k in 0..N_IN_PLANE {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / N_IN_PLANE as f64).sin_cos();
            let s = LatticeDirection::nearest(cos * x + sin * y);
            if !directions.contains(&s) {
                directions.push(s);
            }
        }
        directions
    }
}

/// Fits the best plane to every piece by RANSAC over its faces, refined by least squares. Each piece has its
/// own random stream.
pub fn flatness(params: &PlanParams, surface: &SegmentedSurface) -> IdVec<PatchId, Flatness> {
    let mut faces = vec![Vec::new(); surface.n_patches];
    for (face, &patch) in surface.patch_of_face.iter().enumerate() {
        faces[usize::from(patch)].push(face);
    }
    let tolerance_mm = Plane::tolerance_mm(surface.mesh.bounds().size().max_element());
    let flats: Vec<Flatness> = faces
        .par_iter()
        .enumerate()
        .map(|(patch, faces)| {
            let mut rng = ChaCha8Rng::seed_from_u64(params.seed);
            rng.set_stream(patch as u64);
            let step = faces.len().div_ceil(MAX_FACES).max(1);
            let spots = Spot::sample(&surface.mesh, faces.iter().copied(), step);
            nearest_plane(&spots, tolerance_mm, &mut rng)
        })
        .collect();
    flats.into_iter().collect()
}

fn nearest_plane(spots: &[Spot], tolerance_mm: f64, rng: &mut ChaCha8Rng) -> Flatness {
    let total: f64 = spots.iter().map(|s| s.area).sum();
    if total <= 0.0 || !total.is_finite() {
        return Flatness::NONE;
    }
    let mut best = (0.0, None);
    for _ in 0..N_PLANES {
        let Spot {
            center: at, normal, ..
        } = spots[rng.random_range(0..spots.len())];
        let plane = Plane {
            at,
            normal,
            tolerance_mm,
        };
        let found = plane.area_mm2(spots);
        if found > best.0 {
            best = (found, Some(plane));
        }
    }
    best.1.map_or(Flatness::NONE, |plane| {
        let plane = plane.refine(spots);
        Flatness {
            normal: plane.normal,
            share: plane.area_mm2(spots) / total,
        }
    })
}

/// One choice of the key: a piece and the directions that it may take.
#[derive(Clone, Debug, PartialEq)]
pub struct KeyChoice {
    /// Piece that is the key.
    pub piece: PatchId,
    /// Directions to try, all of one kind.
    pub directions: Vec<LatticeDirection>,
    /// Kind of the directions.
    pub slides: KeyDirections,
    /// True if the piece is flat enough for straight connectors.
    pub is_flat: bool,
}

impl KeyChoice {
    /// Returns true if the two keys are equally flat and slide the same way, so that only the cost of their
    /// plans decides between them.
    pub fn is_as_good_as(&self, other: &Self) -> bool {
        self.is_flat == other.is_flat && self.slides == other.slides
    }
}

/// Kind of direction along which a key slides out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum KeyDirections {
    /// Along a lattice direction nearest to one in the key's plane.
    #[serde(rename = "within its plane")]
    WithinPlane,
    /// Along one of the other lattice directions.
    #[serde(rename = "out of its plane")]
    OutOfPlane,
}

/// All choices of the key, best first: flat pieces within their plane, flat pieces along other directions,
/// then pieces that are not flat, in the same order.
///
/// Pieces are ranked by the share on their plane times the root of their area, hidden ones first.
pub fn choices(params: &PlanParams, survey: &PlanSurvey) -> Vec<KeyChoice> {
    let up = Vec3::from(params.up).normalize_or_zero();
    let rank = |p: PatchId| {
        let hidden = 0.5 * (1.0 - survey.mean_normal[p].dot(up));
        survey.flatness[p].share * survey.area_mm2[p].sqrt() * (1.0 - VISIBLE_COST * (1.0 - hidden))
    };
    let mut pieces: Vec<PatchId> = survey
        .area_mm2
        .ids()
        .filter(|&p| params.key.is_none_or(|k| k == p))
        .collect();
    pieces.sort_by(|&x, &y| rank(y).total_cmp(&rank(x)).then(x.cmp(&y)));
    if let (Some(piece), Some(slide)) = (params.key, params.key_slide) {
        // The piece was cut as a key, so its rails are straight whatever its shape.
        let slides = KeyDirections::WithinPlane;
        return vec![KeyChoice {
            piece,
            directions: vec![slide],
            slides,
            is_flat: true,
        }];
    }
    let (flat, other): (Vec<PatchId>, Vec<PatchId>) =
        pieces.into_iter().partition(|&p| survey.flatness[p].is_flat());
    let mut choices = Vec::new();
    for pieces in [flat, other] {
        for slides in [KeyDirections::WithinPlane, KeyDirections::OutOfPlane] {
            for &piece in &pieces {
                let plane = survey.flatness[piece];
                let in_plane = plane.in_plane();
                let directions = match slides {
                    KeyDirections::WithinPlane => in_plane,
                    KeyDirections::OutOfPlane => LatticeDirection::all()
                        .filter(|s| !in_plane.contains(s))
                        .collect(),
                };
                choices.push(KeyChoice {
                    piece,
                    directions,
                    slides,
                    is_flat: plane.is_flat(),
                });
            }
        }
    }
    choices
}

#[cfg(test)]
mod tests {
    use shellock_test_surfaces::{label, sphere};

    use super::*;

    #[test]
    fn the_flat_face_of_a_clipped_ball_is_the_flattest_piece_and_slides_level() {
        let mut mesh = sphere(5, Vec3::splat(50.0));
        for p in &mut mesh.points {
            p.z = p.z.max(-30.0);
        }
        let surface = label(mesh, 3, |p| if p.z <= -30.0 { 2 } else { u32::from(p.x > 0.0) });
        let flat = flatness(&PlanParams::default(), &surface);
        assert!(flat[PatchId(2)].share > 0.99 && flat[PatchId(0)].share < 0.4);
        assert!(flat[PatchId(2)].normal.dot(-Vec3::Z) > 0.999);
        let level = flat[PatchId(2)].in_plane();
        assert_eq!(level.len(), 8);
        assert!(level.iter().all(|s| s.step()[2] == 0));
    }
}

//! Measurements of the surface for planning, made once. Later rounds change only the constraints.

use shellock_geom::Vec3;
use shellock_report::{Cancelled, Ctx, IdVec, PatchId};
use shellock_surface::{Seam, SegmentedSurface};

use super::interface::{Interface, contacts};
use super::key::{Flatness, flatness};
use super::occlusion::Occlusion;
use super::{PieceSet, PlanParams};
use crate::sizes::ConnectorSizes;

/// All data of the surface that [`search`](super::search) reads.
#[derive(Clone, Debug)]
pub struct PlanSurvey {
    /// Number of pieces, also if they are too many to measure.
    pub n_pieces: usize,
    /// Occlusion of each piece by every other.
    pub occlusion: Occlusion,
    /// Pairs that share a seam, sorted.
    pub contacts: Vec<Interface>,
    /// Mean outward normal of each piece, weighted by area. Its length is in [0, 1], near 1 for a flat piece.
    pub mean_normal: IdVec<PatchId, Vec3>,
    /// Area of each piece, mm².
    pub area_mm2: IdVec<PatchId, f64>,
    /// The plane nearest to each piece.
    pub flatness: IdVec<PatchId, Flatness>,
    /// Floor β used in the weights of the contacts.
    pub beta: f64,
}

/// Measures `surface`, to be joined by connectors of `sizes`. With more than [`PieceSet::MAX_PIECES`] pieces,
/// records only their number, which the search refuses.
pub fn survey(
    ctx: &Ctx<'_>,
    params: &PlanParams,
    surface: &SegmentedSurface,
    seams: &[Seam],
    sizes: &ConnectorSizes,
) -> Result<PlanSurvey, Cancelled> {
    ctx.stage("blocked directions", 3)?;
    let n_pieces = surface.n_patches;
    let mut survey = PlanSurvey::empty(n_pieces, params.beta);
    if n_pieces > PieceSet::MAX_PIECES {
        return Ok(survey);
    }
    survey.occlusion = Occlusion::measure(surface);
    ctx.step()?;
    survey.contacts = contacts(params, surface, seams, sizes);
    ctx.step()?;
    survey.area_mm2 = surface.areas();
    survey.mean_normal = mean_normals(surface, &survey.area_mm2);
    survey.flatness = flatness(params, surface);
    ctx.step()?;
    Ok(survey)
}

impl PlanSurvey {
    fn empty(n_pieces: usize, beta: f64) -> Self {
        Self {
            n_pieces,
            occlusion: Occlusion::default(),
            contacts: Vec::new(),
            mean_normal: IdVec::from_fn(0, |_| Vec3::ZERO),
            area_mm2: IdVec::from_fn(0, |_| 0.0),
            flatness: IdVec::from_fn(0, |_| Flatness::NONE),
            beta,
        }
    }
}

fn mean_normals(surface: &SegmentedSurface, area_mm2: &IdVec<PatchId, f64>) -> IdVec<PatchId, Vec3> {
    let mut sums = vec![Vec3::ZERO; surface.n_patches];
    for (face, &patch) in surface.patch_of_face.iter().enumerate() {
        sums[usize::from(patch)] += 0.5 * surface.mesh.double_area_vector(face);
    }
    sums.into_iter()
        .zip(area_mm2.as_slice())
        .map(|(v, &a)| if a > 0.0 { v / a } else { Vec3::ZERO })
        .collect()
}

//! Automatic division of a surface without labels, by one of several methods.

use serde::{Deserialize, Serialize};
use shellock_geom::{Solid, TriMesh};
use shellock_report::Ctx;
use shellock_segment::auto::AutoParams;
use shellock_segment::coarse::Coarse;
use shellock_segment::face_graph::FaceGraph;
use shellock_segment::kmeans::KMeansParams;
use shellock_segment::mirrored::Mirrored;
use shellock_segment::primitives::PrimitivesParams;
use shellock_segment::random_cuts::{Divided, RandomCutsParams};
use shellock_segment::sdf::SdfParams;
use shellock_segment::symmetry::{self, Plane};
use shellock_segment::whole::Whole;
use shellock_segment::{auto, kmeans, primitives, random_cuts, sdf};

use super::creases::crease_labels;
use super::ground::Ground;
use super::halve::halve_long_edges;
use super::keep_whole::gather_regions;
use super::user::user_labels;
use super::{FaceLabels, SegmentationError, SegmentationParams};

/// Least share of the surface for a part. Smaller parts join a neighbour: curls and claws are no pieces.
const LEAST_SHARE: f64 = 0.012;

/// Method that divides a surface without labels. The methods are compared in [`shellock_segment`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Best of the cuts that all methods propose.
    #[default]
    Auto,
    /// Cuts on which most of many random ones agree.
    RandomCuts,
    /// Parts that each have one thickness.
    Sdf,
    /// Parts that fit planes, spheres and cylinders.
    Primitives,
    /// Parts around representatives, by distance and turning.
    Kmeans,
    /// Patches of similar size with their seams in creases.
    Creases,
}

impl Method {
    /// All methods, the default first.
    pub const ALL: [Self; 6] = [
        Self::Auto,
        Self::RandomCuts,
        Self::Sdf,
        Self::Primitives,
        Self::Kmeans,
        Self::Creases,
    ];

    /// Name of the method in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::RandomCuts => "random-cuts",
            Self::Sdf => "sdf",
            Self::Primitives => "primitives",
            Self::Kmeans => "kmeans",
            Self::Creases => "creases",
        }
    }

    /// Finds the method with this name.
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|method| method.name() == name)
    }

    /// Returns true if the method can divide both sides of a model alike.
    pub fn knows_symmetry(self) -> bool {
        matches!(self, Self::Auto | Self::RandomCuts)
    }

    /// Part of each face; `None` for patches in creases, which need more than a mesh.
    fn parts(self, params: &SegmentationParams, mesh: &TriMesh, whole: &Whole) -> Option<Divided> {
        let SegmentationParams {
            n_pieces: n_parts,
            seed,
            symmetric,
            ..
        } = *params;
        let cuts = RandomCutsParams {
            n_parts,
            symmetric,
            seed,
            ..RandomCutsParams::default()
        };
        let part_of_face = match self {
            Self::Auto => return Some(auto::divide_with_whole(&AutoParams { cuts }, mesh, whole)),
            Self::RandomCuts => return Some(random_cuts::divide_with_whole(&cuts, mesh, whole)),
            Self::Sdf => {
                let params = SdfParams {
                    n_parts,
                    seed,
                    ..SdfParams::default()
                };
                sdf::divide(&params, mesh)
            }
            Self::Primitives => {
                let params = PrimitivesParams {
                    n_parts,
                    ..PrimitivesParams::default()
                };
                primitives::divide(&params, mesh)
            }
            Self::Kmeans => {
                let params = KMeansParams {
                    n_parts,
                    ..KMeansParams::default()
                };
                kmeans::divide(&params, mesh)
            }
            Self::Creases => return None,
        };
        Some(Divided {
            part_of_face,
            plane: None,
        })
    }
}

/// Plane about which `solid` is nearly symmetric, so that a division may be, too. `None` if there is none
/// ([`symmetry::plane`]).
pub fn symmetry_plane(params: &SegmentationParams, solid: &Solid) -> Option<Plane> {
    let (fine, _) = halve_long_edges(params, solid);
    symmetry::plane(&Coarse::new(fine.mesh(), RandomCutsParams::default().n_faces).mesh)
}

/// Makes `labels` of a symmetric solid symmetric, after the side that has more parts. `None` if there is no
/// plane of symmetry.
pub fn mirrored_labels(params: &SegmentationParams, solid: &Solid, labels: &[u32]) -> Option<Vec<u32>> {
    let plane = symmetry_plane(params, solid)?;
    let graph = FaceGraph::new(solid.mesh());
    Some(Mirrored::new(&plane, solid.mesh(), &graph).labels(&graph, labels))
}

/// Message about the plane of a division that was to be symmetric.
fn symmetry_message(plane: Option<Plane>) -> String {
    let Some(Plane { at, normal }) = plane else {
        return "no plane of symmetry is found: both sides are divided as they are".to_owned();
    };
    format!(
        "symmetric about the plane through ({:.1}, {:.1}, {:.1}) mm, normal ({:.3}, {:.3}, {:.3})",
        at.x, at.y, at.z, normal.x, normal.y, normal.z
    )
}

/// Divides by the method of `params` into connected patches, none too small. One seed gives one result.
///
/// Returns `None`, with a note, if the method finds nothing to divide, as on a ball.
pub fn automatic_labels(
    ctx: &Ctx,
    params: &SegmentationParams,
    solid: &Solid,
) -> Result<Option<FaceLabels>, SegmentationError> {
    let own: Vec<u32> = (0..solid.mesh().triangles.len() as u32).collect();
    automatic_on(
        ctx,
        params,
        solid,
        &Ground::with_regions(params, solid, &own).whole,
    )
}

/// Patches in creases, none of which divides a set of `whole`.
pub(super) fn creases_on(
    ctx: &Ctx,
    params: &SegmentationParams,
    solid: &Solid,
    whole: &Whole,
) -> Result<FaceLabels, SegmentationError> {
    gather_regions(ctx, params, solid, whole, crease_labels(ctx, params, solid)?)
}

/// Divides like [`automatic_labels`], without dividing any set of `whole`.
pub(super) fn automatic_on(
    ctx: &Ctx,
    params: &SegmentationParams,
    solid: &Solid,
    whole: &Whole,
) -> Result<Option<FaceLabels>, SegmentationError> {
    let Some(found) = params.method.parts(params, solid.mesh(), whole) else {
        return creases_on(ctx, params, solid, whole).map(Some);
    };
    ctx.check()?;
    if params.symmetric && params.method.knows_symmetry() {
        ctx.note(&symmetry_message(found.plane));
    }
    let mut parts = found.part_of_face;
    let mesh = solid.mesh();
    let area_mm2: Vec<f64> = (0..parts.len()).map(|f| mesh.face_area(f)).collect();
    whole.gather(&mut parts, &area_mm2);
    let labels: Vec<i64> = parts.into_iter().map(i64::from).collect();
    let large = SegmentationParams {
        min_piece_mm2: params.min_piece_mm2.max(LEAST_SHARE * solid.mesh().area()),
        ..params.clone()
    };
    // Merges of small parts are reported only for labels that people gave.
    match user_labels(&ctx.fork(), &large, solid, &labels) {
        Err(
            SegmentationError::OneLabel { .. }
            | SegmentationError::TooManyLabels { .. }
            | SegmentationError::AllTooSmall { .. },
        ) => {
            let method = params.method.name();
            ctx.note(&format!(
                "{method} finds no place to divide: pieces of similar size instead"
            ));
            Ok(None)
        }
        found => found.map(Some),
    }
}

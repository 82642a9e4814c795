//! Gaps between the finished pieces: each pair at rest, and each path over its whole travel. No sampling is
//! involved.
//!
//! The outer rims on both sides of a seam are meant to meet, and may rub by some µm, which is visible but
//! harmless. So each gap is computed twice: for whole surfaces and for the part beneath the rim. For that,
//! the pieces are cut at the rim's depth along lines that are straight on each triangle.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::clearance::{Gap, Shape, SweptGap, Translation, least_gaps, swept_gaps};
use shellock_geom::level_cut::{Side, cut_at_zero};
use shellock_geom::{Solid, TriMesh};

use super::body::{finite, merge_points};
use crate::InstallationPlan;
use crate::{Cancelled, Ctx, IdVec, PatchId};

/// Greatest gap that is computed, mm: the widest clearance is 1 mm.
const WITHIN_MM: f64 = 1.0;

/// Finished pieces, prepared for clearance queries; `None` for a mesh that bounds no volume.
pub struct PieceShapes(IdVec<PatchId, Option<Shape>>);

/// Least gap of two pieces, and its place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NearestPlace {
    /// Least distance, mm, to 0.1 µm; where surfaces cross, minus the depth as defined in
    /// [`shellock_geom::clearance`].
    pub gap_mm: f64,
    /// Travel of the moving piece at this gap, mm; 0 at rest.
    pub travel_mm: f64,
    /// Point midway between the surfaces, mm in assembly space.
    pub at: [f64; 3],
}

/// Least gaps between two pieces at rest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairGap {
    /// Piece with the lower id.
    pub a: PatchId,
    /// Piece with the higher id.
    pub b: PatchId,
    /// Least gap of their whole surfaces.
    pub overall: NearestPlace,
    /// Least gap beneath the rim, if it is within 1 mm.
    pub beneath_rim: Option<NearestPlace>,
}

/// Least gaps between a piece and one installed before it, over its whole way out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PathGap {
    /// Piece that moves along its way.
    pub piece: PatchId,
    /// Piece that was installed earlier.
    pub against: PatchId,
    /// Least gap of their whole surfaces.
    pub overall: NearestPlace,
    /// Least gap beneath the rim, if it is within 1 mm.
    pub beneath_rim: Option<NearestPlace>,
}

/// All gaps of a kit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct KitGaps {
    /// Gaps at rest, see [`pair_gaps`].
    pub pairs: Vec<PairGap>,
    /// Gaps along the ways, see [`path_gaps`].
    pub paths: Vec<PathGap>,
}

/// Computes all gaps of the finished `pieces` of `model`, installed by `plan`. Everything within `rim_mm` of
/// the model's surface is rim; without a model, nothing is.
pub fn kit_gaps(
    ctx: &Ctx,
    model: Option<&Solid>,
    pieces: &IdVec<PatchId, TriMesh>,
    plan: &InstallationPlan,
    rim_mm: f64,
) -> Result<KitGaps, Cancelled> {
    ctx.stage("gaps", 0)?;
    let shapes = prepare(ctx, model, pieces, rim_mm)?;
    let (pairs, paths) = rayon::join(|| pair_gaps(ctx, &shapes), || path_gaps(ctx, &shapes, plan));
    Ok(KitGaps {
        pairs: pairs?,
        paths: paths?,
    })
}

/// Prepares `pieces` of `model` for clearance queries. Everything within `rim_mm` of the model's surface is
/// rim.
pub fn prepare(
    ctx: &Ctx,
    model: Option<&Solid>,
    pieces: &IdVec<PatchId, TriMesh>,
    rim_mm: f64,
) -> Result<PieceShapes, Cancelled> {
    let outside = model.map(|model| TriangleBvh::new(model.mesh()));
    let shapes = pieces.as_slice().par_iter().map(|mesh| {
        ctx.check()?;
        Ok(shape(outside.as_ref(), mesh, rim_mm))
    });
    Ok(PieceShapes(
        shapes
            .collect::<Result<Vec<_>, Cancelled>>()?
            .into_iter()
            .collect(),
    ))
}

/// Gaps of every pair of pieces that comes within 1 mm, in order of their ids.
pub fn pair_gaps(ctx: &Ctx, shapes: &PieceShapes) -> Result<Vec<PairGap>, Cancelled> {
    let ids: Vec<PatchId> = shapes.0.ids().collect();
    let pairs = ids
        .iter()
        .enumerate()
        .flat_map(|(i, &a)| ids[i + 1..].iter().map(move |&b| (a, b)));
    among(ctx, pairs.collect(), |(a, b)| {
        let (shape_a, shape_b) = (shapes.0[a].as_ref()?, shapes.0[b].as_ref()?);
        let gaps = least_gaps(shape_a, shape_b, WITHIN_MM);
        let of = |gap: Gap| place(gap.gap_mm, 0.0, gap.at.to_array());
        Some(PairGap {
            a,
            b,
            overall: gaps.everything.map(of)?,
            beneath_rim: gaps.what_counts.map(of),
        })
    })
}

/// Gaps of every path of `plan` to each earlier piece that it comes within 1 mm of, in order of installation.
/// Pieces of the plan that do not exist are left out.
pub fn path_gaps(
    ctx: &Ctx,
    shapes: &PieceShapes,
    plan: &InstallationPlan,
) -> Result<Vec<PathGap>, Cancelled> {
    let steps = &plan.steps;
    let pairs = (0..steps.len()).flat_map(|i| (0..i).map(move |earlier| (i, earlier)));
    among(ctx, pairs.collect(), |(i, earlier)| {
        let (piece, against) = (steps[i].piece, steps[earlier].piece);
        let shape = |p: PatchId| shapes.0.as_slice().get(usize::from(p))?.as_ref();
        let (moving, fixed) = (shape(piece)?, shape(against)?);
        let way_out = Translation {
            along: steps[i].separation.unit(),
            from_mm: 0.0,
            far_mm: f64::INFINITY,
        };
        let gaps = swept_gaps(moving, fixed, &way_out, WITHIN_MM);
        let of = |gap: SweptGap| place(gap.gap_mm, gap.travel_mm, gap.at.to_array());
        Some(PathGap {
            piece,
            against,
            overall: gaps.everything.map(of)?,
            beneath_rim: gaps.what_counts.map(of),
        })
    })
}

/// Answers of `ask` for each of `pairs`, in their order.
fn among<P: Send, G: Send>(
    ctx: &Ctx,
    pairs: Vec<P>,
    ask: impl Fn(P) -> Option<G> + Sync + Send,
) -> Result<Vec<G>, Cancelled> {
    let gaps: Vec<Option<G>> = pairs
        .into_par_iter()
        .map(|pair| {
            ctx.check()?;
            Ok(ask(pair))
        })
        .collect::<Result<_, Cancelled>>()?;
    Ok(gaps.into_iter().flatten().collect())
}

fn shape(outside: Option<&TriangleBvh>, mesh: &TriMesh, rim_mm: f64) -> Option<Shape> {
    let mesh = finite(mesh).map(merge_points)?;
    let below_rim = |p| {
        outside
            .and_then(|outside| outside.nearest(p, rim_mm * rim_mm))
            .map_or(1.0, |near| near.distance_sq.sqrt() - rim_mm)
    };
    let values: Vec<f64> = mesh.points.iter().map(|&p| below_rim(p)).collect();
    let cut = cut_at_zero(&mesh, &values, |_| true);
    let solid = Solid::new(cut.mesh).ok()?;
    Some(Shape::new(&solid).count_only(|face| cut.side[face] == Side::Positive))
}

fn place(gap_mm: f64, travel_mm: f64, at: [f64; 3]) -> NearestPlace {
    NearestPlace {
        gap_mm,
        travel_mm,
        at,
    }
}

#[cfg(test)]
mod tests {
    use shellock_geom::{Vec3, Volume};
    use shellock_testkit::shapes::cuboid;

    use super::*;
    use crate::InstallationStep;
    use crate::LatticeDirection;

    /// A block that lies in a tray, flush with its rim, and touches only the walls there. It leaves upwards.
    fn kit() -> (Solid, IdVec<PatchId, TriMesh>, InstallationPlan) {
        let model = cuboid([0.0; 3], [20.0, 20.0, 10.0]);
        let seat = cuboid([5.0, 5.0, 4.0], [15.0, 15.0, 11.0]);
        let collar = cuboid([5.0, 5.0, 9.8], [15.0, 15.0, 10.0]);
        let block = cuboid([5.05, 5.04, 4.07], [14.9, 14.9, 10.0]).union(&collar);
        let ledge = cuboid([4.0, 7.0, 12.0], [5.08, 8.0, 13.0]);
        let steps = [Vec3::Z, Vec3::Z, Vec3::X].into_iter().zip(0..);
        let steps = steps.map(|(d, i)| InstallationStep {
            piece: PatchId(i),
            separation: LatticeDirection::nearest(d).into(),
        });
        let pieces = [model.subtract(&seat), block, ledge]
            .iter()
            .map(Volume::to_mesh)
            .collect();
        (
            Solid::new(model.to_mesh()).unwrap(),
            pieces,
            InstallationPlan {
                steps: steps.collect(),
            },
        )
    }

    #[test]
    fn gaps_beneath_the_rim_are_those_of_the_walls() {
        let (model, pieces, plan) = kit();
        let ctx = &Ctx::quiet();
        let shapes = prepare(ctx, Some(&model), &pieces, 1.0).unwrap();
        let pairs = pair_gaps(ctx, &shapes).unwrap();
        assert_eq!(pairs.len(), 1, "the ledge is 2 mm off");
        assert!(pairs[0].overall.gap_mm.abs() < 1e-4, "{pairs:?}");
        assert!(
            (pairs[0].beneath_rim.unwrap().gap_mm - 0.04).abs() < 1e-9,
            "{pairs:?}"
        );
        let paths = path_gaps(ctx, &shapes, &plan).unwrap();
        assert_eq!(
            paths[0].beneath_rim.map(|g| g.gap_mm),
            pairs[0].beneath_rim.map(|g| g.gap_mm)
        );
    }

    #[test]
    fn a_path_is_measured_past_what_is_only_met_on_the_way() {
        let (model, pieces, mut plan) = kit();
        plan.steps.swap(1, 2);
        let ctx = &Ctx::quiet();
        let shapes = prepare(ctx, Some(&model), &pieces, 1.0).unwrap();
        let paths = path_gaps(ctx, &shapes, &plan).unwrap();
        let met = paths
            .iter()
            .find(|p| (p.piece, p.against) == (PatchId(1), PatchId(2)))
            .unwrap();
        // The collar hits the ledge by 0.08 mm on its way, the block beneath it by 0.03.
        assert!((met.overall.gap_mm + 0.08).abs() < 2e-4, "{met:?}");
        assert!((2.0..3.2).contains(&met.overall.travel_mm), "{met:?}");
    }

    #[test]
    fn broken_pieces_and_plans_are_left_out() {
        let (model, mut pieces, mut plan) = kit();
        pieces[PatchId(1)].triangles.pop();
        pieces[PatchId(2)].points[0].x = f64::NAN;
        plan.steps[2].piece = PatchId(77);
        let ctx = &Ctx::quiet();
        let shapes = prepare(ctx, Some(&model), &pieces, 1.0).unwrap();
        assert_eq!(pair_gaps(ctx, &shapes).unwrap(), []);
        assert_eq!(path_gaps(ctx, &shapes, &plan).unwrap(), []);
    }
}

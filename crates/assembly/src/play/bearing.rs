//! Contacts with an area: places where a piece cannot rise past another while it moves sideways by no more
//! than so much.
//!
//! A point `p` of piece `a` faces piece `b`; `n`, from `a` to `b`, is the opposite of the normal of the
//! triangle of `b` that is nearest. How high the barrier of `b` above `p` is for sideways moves within a
//! region is [`super::barrier`]'s question. The surface of `a` beside `p` must be no speck: it falls away by
//! less than [`BED_DROP_MM`] over a half-disc of [`BED_MM`].

use rayon::prelude::*;
use shellock_geom::{TriMesh, Vec3};

use super::barrier::{Axis, Region, SIDES, Surface};
use crate::verify::sample;
use crate::{Cancelled, Ctx, IdVec, PatchId};

/// Distance of neighbouring points, mm: the best of them ends a turn about a connector of 1 mm.
pub(super) const SPACING_MM: f64 = 0.35;
/// The same for pieces whose proof does not close with the former.
pub(super) const FINE_SPACING_MM: f64 = 0.2;
/// Most points on one piece: what has more area beside others is no piece of a kit.
const MOST_POINTS: f64 = 1e6;
/// What may come on top of the clearance between faces that end motions, mm.
const REACH_MM: f64 = 0.2;
/// Faces whose normals have a greater scalar product do not face each other (37° from opposite).
const FACING: f64 = -0.8;
/// The surface of a piece beside a contact's point is at least this wide to one side, mm.
pub const BED_MM: f64 = 0.3;
/// Within that it falls away by less than this, mm.
pub const BED_DROP_MM: f64 = 0.08;
/// Barriers that are higher above the point hold nothing, mm.
pub const MOST_RISE_MM: f64 = 1.0;
/// The bed's half-disc begins so far behind the point, mm: the point may be at an edge.
pub const BEHIND_MM: f64 = 0.01;

/// A point of piece `a` that a surface of piece `b` is above.
#[derive(Clone, Copy, Debug)]
pub struct Bearing {
    /// The piece that the point is on.
    pub a: PatchId,
    /// The piece above it.
    pub b: PatchId,
    /// On `a`, mm.
    pub point: Vec3,
    /// Unit vector, from `a` to `b`.
    pub normal: Vec3,
    /// Distance to `b`, mm: the barrier is at least so high.
    pub gap_mm: f64,
    /// The triangle of `a` that the point is on.
    face: u32,
}

/// The pieces' surfaces, prepared for questions of what is above their points.
pub(super) struct Surfaces(IdVec<PatchId, Surface>);

impl Surfaces {
    pub fn new(pieces: &IdVec<PatchId, TriMesh>) -> Self {
        let surfaces: Vec<Surface> = pieces.as_slice().par_iter().map(Surface::new).collect();
        Self(surfaces.into_iter().collect())
    }

    /// All pieces.
    pub fn ids(&self) -> impl Iterator<Item = PatchId> + '_ {
        self.0.ids()
    }

    /// The surface of a piece.
    pub fn mesh(&self, piece: PatchId) -> &TriMesh {
        &self.0[piece].mesh
    }

    /// Of the pieces that count, the place nearest to `p` within `reach_mm`: which piece, where, and the
    /// outward normal of the triangle there.
    pub fn nearest(
        &self,
        p: Vec3,
        reach_mm: f64,
        counts: &dyn Fn(PatchId) -> bool,
    ) -> Option<(PatchId, Vec3, Vec3)> {
        let mut best: Option<(f64, PatchId, Vec3, Vec3)> = None;
        for (id, surface) in self.0.iter().filter(|(id, _)| counts(*id)) {
            let limit_sq = best.map_or(reach_mm * reach_mm, |b| b.0);
            if surface.bounds.distance_sq(p) <= limit_sq
                && let Some(near) = surface.tree.nearest(p, limit_sq)
            {
                best = Some((
                    near.distance_sq,
                    id,
                    near.point,
                    surface.mesh.face_normal(near.face as usize),
                ));
            }
        }
        best.map(|(_, id, point, normal)| (id, point, normal))
    }

    /// Points of all pieces that face others, in order of `a`, then along its surface, then of `b`.
    pub fn bearings(&self, ctx: &Ctx, clearance_mm: f64, seed: u64) -> Result<Vec<Bearing>, Cancelled> {
        let ids: Vec<PatchId> = self.0.ids().collect();
        let found: Vec<Vec<Bearing>> = ids
            .par_iter()
            .map(|&a| {
                ctx.check()?;
                let seed = seed.wrapping_add(u64::from(a.0));
                Ok(self.on_piece(a, &|_| true, clearance_mm + REACH_MM, SPACING_MM, seed))
            })
            .collect::<Result<_, Cancelled>>()?;
        Ok(found.into_iter().flatten().collect())
    }

    /// More points of `piece` that face others, and of others that face it.
    pub fn finer(&self, piece: PatchId, clearance_mm: f64, seed: u64) -> Vec<Bearing> {
        let reach_mm = clearance_mm + REACH_MM;
        let seed = seed.wrapping_add(1000 + u64::from(piece.0));
        let room = self.0[piece].bounds.grown(reach_mm);
        let is_beside = |a: &PatchId| *a != piece && self.0[*a].bounds.intersects(room);
        let own = self.on_piece(piece, &|_| true, reach_mm, FINE_SPACING_MM, seed);
        let of_others = self.0.ids().filter(is_beside);
        let of_others =
            of_others.flat_map(|a| self.on_piece(a, &|b| b == piece, reach_mm, FINE_SPACING_MM, seed));
        own.into_iter().chain(of_others).collect()
    }

    /// Points of `a` that face those pieces that count.
    fn on_piece(
        &self,
        a: PatchId,
        counts: &(dyn Fn(PatchId) -> bool + Sync),
        reach_mm: f64,
        spacing_mm: f64,
        seed: u64,
    ) -> Vec<Bearing> {
        let own = &self.0[a].mesh;
        let room = own.bounds().grown(reach_mm);
        let others: Vec<PatchId> = self
            .0
            .ids()
            .filter(|&b| b != a && counts(b) && self.0[b].bounds.intersects(room))
            .collect();
        let is_near = |f: u32| {
            let corners = own.corners(f as usize);
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            let far_mm = reach_mm + corners.iter().map(|c| c.distance(middle)).fold(0.0, f64::max);
            others
                .iter()
                .any(|&b| self.0[b].tree.nearest(middle, far_mm * far_mm).is_some())
        };
        let faces: Vec<u32> = (0..own.triangles.len() as u32)
            .into_par_iter()
            .filter(|&f| is_near(f))
            .collect();
        let near = TriMesh {
            points: own.points.clone(),
            triangles: faces.iter().map(|&f| own.triangles[f as usize]).collect(),
        };
        let n = (near.area() / (spacing_mm * spacing_mm))
            .ceil()
            .clamp(1.0, MOST_POINTS) as usize;
        let samples = sample::on_surface(&near, n, seed);
        let bearing = |s: &sample::Sample, b: PatchId| {
            let nearest = self.0[b].tree.nearest(s.point, reach_mm * reach_mm)?;
            let above = self.0[b].mesh.face_normal(nearest.face as usize);
            let face = faces[s.face];
            (s.normal.dot(above) < FACING).then_some(Bearing {
                a,
                b,
                point: s.point,
                normal: -above,
                gap_mm: nearest.distance_sq.sqrt(),
                face,
            })
        };
        let of_sample = |s: &sample::Sample| {
            others
                .iter()
                .filter_map(|&b| bearing(s, b))
                .collect::<Vec<Bearing>>()
        };
        samples.par_iter().flat_map_iter(of_sample).collect()
    }

    /// How far the bearing's point rises while it moves sideways within `region`, mm; `None` where nothing
    /// stops it.
    pub fn rise_mm(&self, bearing: &Bearing, region: &Region) -> Option<f64> {
        let axis = bearing.axis();
        let above = &self.0[bearing.b];
        let (from, _) = above
            .tree
            .first_hit(bearing.point, bearing.normal, MOST_RISE_MM)?;
        // From within the other piece its surface is seen from inside, and stops nothing.
        if above.mesh.face_normal(from as usize).dot(bearing.normal) >= 0.0 {
            return None;
        }
        above.barrier_mm(from, &axis, region, MOST_RISE_MM)
    }

    /// Whether the surface of `a` is wide enough beside the bearing's point.
    pub fn has_bed(&self, bearing: &Bearing) -> bool {
        let axis = Axis::new(bearing.point, -bearing.normal);
        let is_bed = |side: usize| {
            let mut half = Region::of_radius(BED_MM);
            for k in [SIDES - 1, 0, 1] {
                half.far_mm[(side + k) % SIDES] = BEHIND_MM;
            }
            self.0[bearing.a]
                .highest_mm(bearing.face, &axis, &half, BED_DROP_MM)
                .is_some()
        };
        (0..SIDES).any(is_bed)
    }
}

impl Bearing {
    /// Unit vector across the normal, towards the first side of its regions.
    pub fn across(&self) -> Vec3 {
        self.axis().sides()[0]
    }

    /// Where regions of sideways moves are.
    pub(super) fn axis(&self) -> Axis {
        Axis::new(self.point, self.normal)
    }
}

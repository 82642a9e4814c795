//! Bearings: contacts with an area. At such a place, a piece cannot rise past another while it moves sideways
//! within a limited region.
//!
//! A point `p` of piece `a` faces piece `b`. `n`, from `a` to `b`, is opposite to the normal of the nearest
//! triangle of `b`. [`super::barrier`] computes the height of the barrier of `b` above `p` for sideways
//! motions within a region. The surface of `a` beside `p` must be wide enough: it falls away by less than
//! [`BED_DROP_MM`] over a half-disc of [`BED_MM`].

use rayon::prelude::*;
use shellock_geom::{TriMesh, Vec3};

use super::barrier::{Axis, Region, SIDES, Surface};
use crate::verify::sample;
use crate::{Cancelled, Ctx, IdVec, PatchId};

/// Distance between neighbouring points, mm: the best of them ends a rotation about a connector of 1 mm.
pub(super) const SPACING_MM: f64 = 0.35;
/// Finer distance for pieces whose proof does not close with [`SPACING_MM`].
pub(super) const FINE_SPACING_MM: f64 = 0.2;
/// Greatest number of points on one piece; no piece of a kit has more area beside others.
const MOST_POINTS: f64 = 1e6;
/// Greatest distance beyond the clearance between faces that limit motions, mm.
const REACH_MM: f64 = 0.2;
/// Greatest scalar product of the normals of two faces that face each other (37° from opposite).
const FACING: f64 = -0.8;
/// Least width of a piece's surface beside a contact's point, to one side, mm.
pub const BED_MM: f64 = 0.3;
/// Greatest drop of the surface over that width, mm.
pub const BED_DROP_MM: f64 = 0.08;
/// Height above the point from which a barrier holds nothing, mm.
pub const MOST_RISE_MM: f64 = 1.0;
/// Start of the bed's half-disc behind the point, mm, since the point may be at an edge.
pub const BEHIND_MM: f64 = 0.01;

/// Point of piece `a` below a surface of piece `b`.
#[derive(Clone, Copy, Debug)]
pub struct Bearing {
    /// Piece that the point lies on.
    pub a: PatchId,
    /// Piece above the point.
    pub b: PatchId,
    /// Point on piece `a`, mm.
    pub point: Vec3,
    /// Unit vector from `a` to `b`.
    pub normal: Vec3,
    /// Distance to `b`, mm: the barrier is at least as high.
    pub gap_mm: f64,
    /// Triangle of `a` that the point lies on.
    face: u32,
}

/// Surfaces of the pieces, prepared for searches above their points.
pub(super) struct Surfaces(IdVec<PatchId, Surface>);

impl Surfaces {
    pub fn new(pieces: &IdVec<PatchId, TriMesh>) -> Self {
        let surfaces: Vec<Surface> = pieces.as_slice().par_iter().map(Surface::new).collect();
        Self(surfaces.into_iter().collect())
    }

    /// Ids of all pieces.
    pub fn ids(&self) -> impl Iterator<Item = PatchId> + '_ {
        self.0.ids()
    }

    /// Mesh of a piece's surface.
    pub fn mesh(&self, piece: PatchId) -> &TriMesh {
        &self.0[piece].mesh
    }

    /// Finds the place nearest to `p` within `reach_mm` on the pieces that `counts` accepts: the piece, the
    /// place, and the outward normal of the triangle there.
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

    /// Samples points of all pieces that face others, in order of `a`, then along its surface, then of `b`.
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

    /// Samples more points of `piece` that face others, and of others that face it.
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

    /// Samples points of `a` that face the pieces that `counts` accepts.
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

    /// Height that the bearing's point can reach while it moves sideways within `region`, mm; `None` if
    /// nothing stops it.
    pub fn rise_mm(&self, bearing: &Bearing, region: &Region) -> Option<f64> {
        let axis = bearing.axis();
        let above = &self.0[bearing.b];
        let (from, _) = above
            .tree
            .first_hit(bearing.point, bearing.normal, MOST_RISE_MM)?;
        // From inside the other piece, its surface is seen from inside and stops nothing.
        if above.mesh.face_normal(from as usize).dot(bearing.normal) >= 0.0 {
            return None;
        }
        above.barrier_mm(from, &axis, region, MOST_RISE_MM)
    }

    /// Returns true if the surface of `a` is wide enough beside the bearing's point.
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

    /// Axis of the regions of sideways motions.
    pub(super) fn axis(&self) -> Axis {
        Axis::new(self.point, self.normal)
    }
}

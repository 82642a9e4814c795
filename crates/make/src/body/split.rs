//! Cuts through the wall along fields that are known: a body for each piece.

use std::cell::Cell;

use rayon::prelude::*;
use shellock_geom::marching_cubes::{Corners, OffBand, contour_with_corners};
use shellock_geom::simplify::decimate_without_crossing;
use shellock_geom::{TriMesh, Vec3, Volume};
use shellock_report::{Cancelled, Ctx, PatchId};

use super::BodyParams;
use super::grid::{LocalField, ShellGrid};

/// Limits to the simplification of cutting tools. Where they cut, at most this share of the gap and this many
/// mm, so that paths stay free. Where they end outside the wall, farther from it than so many cells, the
/// larger tolerance applies.
const GAP_SHARE: f64 = 0.2;
const CUT_TOLERANCE_MM: f64 = 0.02;
const FREE_TOLERANCE_MM: f64 = 0.05;
const TIGHT_CELLS: f64 = 1.2;
/// Distance from the cut of a node that gets no gap, as a share of the gap.
const CLOSED_SHARE: f32 = 0.25;
/// Distance from the wall at which collars end, in cells, and the slope of that limit, field mm per mm.
const LIMIT_CELLS: f32 = 1.8;
const LIMIT_SLOPE: f32 = 5.0;
/// Width of a collar beyond the cut, in cells; one is enough for its contour to end where the cut is.
const COLLAR_CELLS: usize = 3;
/// Stray points of a part up to which a cut counts as separating it. A cut leaks if, on each side, more
/// points than this and than 0.5 % of all lie beyond a cell.
const MOST_STRAY: usize = 10;

/// A piece and the field of its cut, positive on its side; `None` for the first-installed piece.
pub(super) struct Cut {
    pub piece: PatchId,
    pub field: Option<LocalField>,
}

/// Cutter of the wall.
pub(super) struct Splitter<'a> {
    pub ctx: &'a Ctx<'a>,
    pub params: &'a BodyParams,
    pub grid: &'a ShellGrid,
    /// Distance by which each side of a cut stays back from it, mm.
    pub gap_mm: &'a [f32],
}

/// Cuts the pieces of `cuts` off `wall`, in the disassembly sequence.
///
/// The field of a cut ignores the pieces that left before. So its cut crosses the faces that former cuts left
/// and does not run along them, where rounding would fold the surface.
pub(super) fn split(
    with: &Splitter<'_>,
    wall: Volume,
    cuts: &[Cut],
) -> Result<Vec<(PatchId, Volume)>, Cancelled> {
    with.ctx.check()?;
    let (first, later) = cuts.split_first().expect("there is a cut for each piece");
    let Some(field) = &first.field else {
        with.ctx.step()?;
        return Ok(vec![(first.piece, wall)]);
    };
    let g = field.spread(&with.grid.band, -with.grid.cutoff_mm());
    let body = || {
        let body = with.side(&wall, &g, 1.0);
        with.ctx.step().map(|()| body)
    };
    let (body, parts) = rayon::join(body, || split(with, with.side(&wall, &g, -1.0), later));
    let mut parts = parts?;
    parts.push((first.piece, body?));
    Ok(parts)
}

impl Splitter<'_> {
    /// The part of `wall` where `sign · g` is positive, less the gap.
    ///
    /// A collar along the cut, on its other side, is subtracted from the wall. The wall then falls apart, and
    /// the parts on the wanted side are kept. The collar has far fewer triangles than a whole side. If the
    /// collar does not separate the sides, the whole side cuts instead.
    fn side(&self, wall: &Volume, g: &[f32], sign: f32) -> Volume {
        // Both collars resolve corners on the same side of the cut, so that they have the same triangles
        // there.
        let apart = if sign > 0.0 {
            Corners::Positive
        } else {
            Corners::Negative
        };
        let collar = contour_with_corners(
            &self.grid.band,
            &self.collar_field(g, sign),
            OffBand::Outside,
            apart,
        );
        let collar =
            Volume::from_closed_mesh(&self.simplify_collar(collar, g, sign)).expect("contours are manifold");
        self.half(&wall.subtract(&collar), g, sign)
            .unwrap_or_else(|| wall.intersect(&self.whole_side(g, sign)))
    }

    /// The parts of `apart` on the wanted side; `None` where a part lies on both sides.
    fn half(&self, apart: &Volume, g: &[f32], sign: f32) -> Option<Volume> {
        let cell = self.grid.band.cell_mm();
        let leaks = Cell::new(false);
        let half = apart.retain(|points| {
            // Samples beside jumps of g may have the wrong sign, so the sum decides.
            let (mut sum, mut n_points, mut n_beyond) = (0.0, 0, [0usize; 2]);
            for h in points
                .filter_map(|p| self.grid.band.sample(g, p))
                .map(|g| f64::from(sign) * g)
            {
                sum += h;
                n_points += 1;
                n_beyond[0] += usize::from(h > cell);
                n_beyond[1] += usize::from(h < -cell);
            }
            let n_stray = n_beyond[0].min(n_beyond[1]);
            leaks.set(leaks.get() || n_stray > MOST_STRAY.max(n_points / 200));
            sum > 0.0
        });
        (!leaks.get()).then_some(half)
    }

    /// The whole of the wanted side, less the gap.
    fn whole_side(&self, g: &[f32], sign: f32) -> Volume {
        let field: Vec<f32> = (0..g.len())
            .into_par_iter()
            .map(|n| self.inset(g, sign, n).min(self.limits(n)))
            .collect();
        // Corners are cut apart on the same side as in the other side's collar.
        let apart = if sign > 0.0 {
            Corners::Negative
        } else {
            Corners::Positive
        };
        let mesh = contour_with_corners(&self.grid.band, &field, OffBand::Outside, apart);
        Volume::from_closed_mesh(&mesh).expect("contours are manifold")
    }

    /// Field that is positive where tools reach. Nothing is cut below the wall or far outside: cuts are
    /// unknown there. Within a cell of the wall the limits exceed all values of the cut, because both sides'
    /// collars must agree there; hence the steep slope.
    fn limits(&self, n: usize) -> f32 {
        let (depth, reach) = (self.grid.depth[n], LIMIT_CELLS * self.grid.band.cell_mm() as f32);
        (self.grid.thickness_mm as f32 + reach - depth).min(depth + reach) * LIMIT_SLOPE
    }

    fn simplify_collar(&self, collar: TriMesh, g: &[f32], sign: f32) -> TriMesh {
        let h = |p: Vec3| self.grid.band.sample(g, p).map_or(0.0, |g| f64::from(sign) * g);
        let tolerance: Vec<f64> = collar
            .points
            .par_iter()
            .map(|&p| self.tolerance_mm(p, h(p)))
            .collect();
        decimate_without_crossing(collar, &tolerance)
    }

    /// Field that is positive in the collar: from the gap's border on the side of `sign` to some cells beyond
    /// the cut.
    fn collar_field(&self, g: &[f32], sign: f32) -> Vec<f32> {
        let (cell, cutoff) = (self.grid.band.cell_mm() as f32, self.grid.cutoff_mm());
        let is_own = |n: u32| sign * g[n as usize] > 0.0;
        let mut field: Vec<f32> = (0..g.len() as u32)
            .into_par_iter()
            .map(|n| if is_own(n) { cutoff } else { -cell })
            .collect();
        let mut front: Vec<u32> = (0..g.len() as u32)
            .into_par_iter()
            .filter(|&n| is_own(n) && self.limits(n as usize) > 0.0)
            .filter(|&n| {
                self.grid
                    .band
                    .face_neighbours(n)
                    .any(|m| !is_own(m) && self.limits(m as usize) > 0.0)
            })
            .collect();
        for _ in 0..COLLAR_CELLS {
            let beyond: Vec<u32> = front
                .iter()
                .flat_map(|&n| self.grid.band.face_neighbours(n))
                .collect();
            front.clear();
            for n in beyond {
                if field[n as usize] < 0.0 {
                    field[n as usize] = cutoff;
                    front.push(n);
                }
            }
        }
        field.par_iter_mut().enumerate().for_each(|(n, f)| {
            *f = f.min(-self.inset(g, sign, n)).min(self.limits(n));
        });
        field
    }

    /// Distance of node `n` from the gap, positive on the wanted side.
    ///
    /// The gap lies between two materials. Where the field comes near zero and turns round, with the other
    /// side's material nowhere around, a gap would be a slot that is thinner than a hair.
    fn inset(&self, g: &[f32], sign: f32, n: usize) -> f32 {
        let (own_mm, gap_mm) = (sign * g[n], self.gap_mm[n]);
        let inset_mm = own_mm - gap_mm;
        if inset_mm > 0.0 || own_mm <= 0.0 {
            return inset_mm;
        }
        let is_others = |m: u32| {
            let (m, thickness) = (m as usize, self.grid.thickness_mm as f32);
            -sign * g[m] > self.gap_mm[m] && (0.0..thickness).contains(&self.grid.depth[m])
        };
        if self.grid.band.all_neighbours(n as u32).any(is_others) {
            inset_mm
        } else {
            CLOSED_SHARE * gap_mm
        }
    }

    /// Tolerance by which a collar may be simplified at `p`, mm, where `sign · g` is `h`: a small share of
    /// the gap where it cuts, larger where it meets no remaining material.
    fn tolerance_mm(&self, p: Vec3, h: f64) -> f64 {
        let cell = self.grid.band.cell_mm();
        let (params, reach) = (self.params, TIGHT_CELLS * cell);
        let depth = self
            .grid
            .band
            .sample(&self.grid.depth, p)
            .unwrap_or(f64::NEG_INFINITY);
        if h < -0.4 * cell || depth < -reach || depth > params.thickness_mm + reach {
            return FREE_TOLERANCE_MM;
        }
        (GAP_SHARE * params.seam_gap_mm).min(CUT_TOLERANCE_MM)
    }
}

#[cfg(test)]
mod tests {
    use shellock_geom::Solid;
    use shellock_test_surfaces::sphere;

    use super::*;

    #[test]
    fn a_field_that_turns_round_just_before_zero_leaves_no_slot() {
        let model = Solid::new(sphere(5, Vec3::splat(16.0))).unwrap();
        let params = BodyParams::default();
        let grid = ShellGrid::new(&params, &model, 4.0).unwrap();
        let x: Vec<f32> = (0..grid.band.len())
            .map(|n| grid.band.position(n).x as f32)
            .collect();
        let at = x
            .iter()
            .copied()
            .min_by(|a, b| (a + 8.0).abs().total_cmp(&(b + 8.0).abs()))
            .unwrap();
        // The cut lies at x = 0. At x = -8 the field comes within a fifth of the gap of zero.
        let gap_mm = vec![params.seam_gap_mm as f32; x.len()];
        let ridge = |x: f32| -0.2 * gap_mm[0] - (x - at).abs();
        let splitter = Splitter {
            ctx: &Ctx::quiet(),
            params: &params,
            grid: &grid,
            gap_mm: &gap_mm,
        };
        let left_mm3 = |g: Vec<f32>| splitter.side(&grid.wall, &g, -1.0).volume();
        let straight_mm3 = left_mm3(x.clone());
        let ridged_mm3 = left_mm3(x.iter().map(|&x| x.max(ridge(x))).collect());
        assert!(
            (straight_mm3 - ridged_mm3).abs() < 1e-6 * straight_mm3,
            "{ridged_mm3} of {straight_mm3} mm³"
        );
        // A ridge that reaches across is a cut.
        let cut_mm3 = left_mm3(x.iter().map(|&x| x.max(ridge(x) + 0.5)).collect());
        assert!(cut_mm3 < 0.99 * straight_mm3);
    }
}

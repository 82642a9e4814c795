//! Division of the wall among the pieces: fields of their cuts, in the disassembly sequence.

use rayon::prelude::*;
use shellock_assembly::LatticeDirection;
use shellock_geom::band::Band;
use shellock_geom::level_cut::{Side, cut_at_zero};
use shellock_geom::marching_cubes::{OffBand, contour};
use shellock_geom::sweep::{Draft, Sweeper};
use shellock_geom::{Aabb, TriMesh, Vec3, Volume};
use shellock_plan::LatticePlan;
use shellock_report::{Ctx, IdVec, PatchId};
use shellock_surface::SegmentedSurface;

use super::chips::whole_bodies;
use super::fragments::Fragments;
use super::grid::{LocalField, PatchDistances, ShellGrid};
use super::split::{Cut, Splitter, split};
use super::{BodyError, BodyParams};

/// Depth of a piece's outer skin that other pieces' paths must not take from it, in cells. [geometry notes:
/// 1.5]
const SKIN_CELLS: f64 = 1.5;
/// Cells by which the remaining material is grown before it is swept, so that interpolation leaves no
/// rubbing.
const MARGIN_CELLS: f64 = 0.1;
/// Draft of all ways out. Contours of sampled fields are off by some hundredths of a mm, and a piece that
/// slides along a wall without draft would rub on every bump. Without it relief cuts three times as much from
/// a cat. With 0.2 mm at most, a way out that grazed a teddy's head cut 12 mm of its skin off.
const DRAFT: Draft = Draft {
    per_mm: 0.08,
    most_mm: 0.12,
};
/// Width of the transition between two fields of a cut, in cells. Contours step along an edge between fields,
/// since the grid does not resolve it, and rims would show that.
const BLEND_CELLS: f64 = 0.5;
/// Distance from the key's cut within which a node counts as part of its seam, mm.
const KEY_REACH_MM: f32 = 1.5;
/// Rounds of giving fragments to the other side of a cut. New fragments can appear where p must keep out of
/// the way of those it gave.
const MOST_GIVINGS: usize = 4;
/// Least share of its wall that a piece must be able to take along; below, the piece is blocked.
const LEAST_KEPT: f64 = 0.5;

/// The separated bodies, and the fields of the separation that later stages need.
pub struct ShellBodies {
    /// The body of each piece, one connected volume.
    pub bodies: IdVec<PatchId, Volume>,
    /// The inner surface of the wall, each triangle with the piece behind it; `None` where there is no
    /// cavity.
    pub inner: Option<SegmentedSurface>,
    /// Field that is positive where a piece may have no connectors: where bodies block its way out, or where
    /// it would block a later piece's way. On the nodes around its patch.
    pub keep_out: IdVec<PatchId, LocalField>,
    /// Field that is positive on each piece's own side of all cuts. Together with the wall's limits it bounds
    /// the body. On the nodes around its patch.
    pub side: IdVec<PatchId, LocalField>,
    /// Distance by which each side of a cut stays back from it, mm, on all nodes.
    pub gap_mm: Vec<f32>,
}

/// Splits the wall along the plan. The bodies partition the wall except for the gaps inside the seams.
pub fn build(
    ctx: &Ctx,
    params: &BodyParams,
    grid: &ShellGrid,
    distances: &PatchDistances,
    plan: &LatticePlan,
    rooms: &IdVec<PatchId, Aabb>,
) -> Result<ShellBodies, BodyError> {
    let separated = separate(ctx, grid, distances, plan, rooms)?;
    ctx.stage("bodies", plan.steps.len())?;
    let cuts = &separated.cuts;
    let key_cut = cuts[0].field.as_ref().filter(|_| params.key_gap_mm.is_some());
    let key_side = key_cut.map(|field| field.spread(&grid.band, -grid.cutoff_mm()));
    let gap = |n: usize| gap_mm(params, key_side.as_deref(), n);
    let gap_mm: Vec<f32> = (0..grid.band.len()).into_par_iter().map(gap).collect();
    let mut parts = split(
        &Splitter {
            ctx,
            params,
            grid,
            gap_mm: &gap_mm,
        },
        grid.wall.clone(),
        cuts,
    )?;
    parts.sort_by_key(|(p, _)| *p);
    let apart_mm = 2.0 * params.seam_gap_mm.max(params.key_gap_mm.unwrap_or(0.0));
    let parts = whole_bodies(ctx, grid, apart_mm, parts);
    Ok(ShellBodies {
        bodies: parts.into_iter().map(|(_, body)| body).collect(),
        inner: separated.inner,
        keep_out: of_every_piece(separated.keep_out),
        side: of_every_piece(separated.side),
        gap_mm,
    })
}

/// Cuts of all pieces, with what follows from them alone.
struct Separated {
    /// Cut of each piece, in order of removal.
    cuts: Vec<Cut>,
    /// Inner surface of the wall with its pieces, if there is a cavity.
    inner: Option<SegmentedSurface>,
    /// Region that each piece must keep free, and the region on its side of the cuts.
    keep_out: Vec<Option<LocalField>>,
    side: Vec<Option<LocalField>>,
}

/// Cuts the pieces off in the order of their removal.
fn separate(
    ctx: &Ctx,
    grid: &ShellGrid,
    distances: &PatchDistances,
    plan: &LatticePlan,
    rooms: &IdVec<PatchId, Aabb>,
) -> Result<Separated, BodyError> {
    ctx.stage("cuts", plan.steps.len())?;
    let mut fields = Separation::new(grid, distances, plan.steps.len());
    let mut inner = InnerSurface::new(grid);
    let mut cuts: Vec<Cut> = Vec::new();
    let mut blocked: Vec<Option<LocalField>> = vec![None; plan.steps.len()];
    let mut side = blocked.clone();
    for step in plan.removal() {
        let p = step.piece;
        let in_way = if fields.n_left() == 1 {
            inner.give_rest(p);
            side[usize::from(p)] = Some(LocalField::cut_out(&grid.band, &fields.rest, rooms[p]));
            cuts.push(Cut {
                piece: p,
                field: None,
            });
            fields.in_later_ways.clone()
        } else {
            let g = fields.cut(p, step.separation);
            let kept = fields.kept_share(p, &g);
            if kept < LEAST_KEPT {
                return Err(BodyError::Blocked {
                    piece: p,
                    separation: step.separation,
                    free_share: kept,
                });
            }
            let local = || LocalField::cut_out(&grid.band, &g, rooms[p]);
            let ((), local) = rayon::join(|| inner.give(p, &g, &grid.band), local);
            let own: Vec<f32> = g
                .par_iter()
                .zip(&fields.rest)
                .map(|(g, rest)| g.min(*rest))
                .collect();
            side[usize::from(p)] = Some(LocalField::cut_out(&grid.band, &own, rooms[p]));
            cuts.push(Cut {
                piece: p,
                field: Some(local),
            });
            fields.remove(p, step.separation, &g)
        };
        blocked[usize::from(p)] = Some(LocalField::cut_out(&grid.band, &in_way, rooms[p]));
        ctx.step()?;
    }
    Ok(Separated {
        cuts,
        inner: inner.finish(plan.steps.len()),
        keep_out: blocked,
        side,
    })
}

fn of_every_piece(fields: Vec<Option<LocalField>>) -> IdVec<PatchId, LocalField> {
    fields
        .into_iter()
        .map(|f| f.expect("every piece of a plan is removed once"))
        .collect()
}

/// The greater of two field values. Values that differ by less than `width` blend into each other, and the
/// result exceeds both by up to a quarter of it.
fn smooth_max(a: f32, b: f32, width: f32) -> f32 {
    let near = (width - (a - b).abs()).max(0.0);
    a.max(b) + 0.25 * near * near / width
}

/// Distance by which each side of a cut stays back at node `n`, mm. The key's seams can have a gap of their
/// own.
fn gap_mm(params: &BodyParams, key_side: Option<&[f32]>, n: usize) -> f32 {
    let is_at_key = key_side.is_some_and(|key| key[n].abs() < KEY_REACH_MM);
    let own = params.key_gap_mm.filter(|_| is_at_key);
    own.unwrap_or(params.seam_gap_mm) as f32
}

/// State between two removals of pieces.
struct Separation<'a> {
    grid: &'a ShellGrid,
    fragments: Fragments<'a>,
    distances: &'a PatchDistances,
    sweeper: Sweeper<'a>,
    remains: Vec<bool>,
    /// Field that is positive in the material that has not left, regardless of the wall's own limits.
    rest: Vec<f32>,
    /// Field that is positive where a later piece lies or passes on its way out.
    in_later_ways: Vec<f32>,
}

impl<'a> Separation<'a> {
    fn new(grid: &'a ShellGrid, distances: &'a PatchDistances, n_pieces: usize) -> Self {
        let cutoff = grid.cutoff_mm();
        Self {
            grid,
            fragments: Fragments::new(grid),
            distances,
            sweeper: Sweeper::new(&grid.band),
            remains: vec![true; n_pieces],
            rest: vec![cutoff; grid.band.len()],
            in_later_ways: vec![-cutoff; grid.band.len()],
        }
    }

    fn n_left(&self) -> usize {
        self.remains.iter().filter(|r| **r).count()
    }

    /// Wall thickness field at a node, positive inside, extended outwards by `beyond_mm`.
    fn wall(&self, node: usize, beyond_mm: f32) -> f32 {
        let depth = self.grid.depth[node];
        (depth + beyond_mm).min(self.grid.thickness_mm as f32 - depth)
    }

    /// Field `g_p` of the cut: positive on the side of p.
    fn cut(&self, p: PatchId, separation: LatticeDirection) -> Vec<f32> {
        let cutoff = self.grid.cutoff_mm();
        let cell = self.grid.band.cell_mm() as f32;
        let (skin_mm, margin) = (SKIN_CELLS as f32 * cell, MARGIN_CELLS as f32 * cell);
        let along = separation.step();
        let mut phi = self.distances.side_of(self.grid, p, &self.remains, separation);
        // The remaining material is swept with a margin.
        phi.par_iter_mut()
            .for_each(|phi| *phi = (*phi + margin).min(cutoff));
        let at = |node: usize, side: f32| self.wall(node, cell).min(side).min(self.rest[node]);
        let skin: Vec<f32> = (0..phi.len())
            .into_par_iter()
            .map(|n| at(n, phi[n]).min(skin_mm - self.grid.depth[n]).max(-cutoff))
            .collect();
        let ahead_of_skin = self.sweeper.max_ahead(&skin, along.map(|x| -x), DRAFT);
        let blend_mm = BLEND_CELLS as f32 * cell;
        let leaving = |n: usize| smooth_max(phi[n], ahead_of_skin[n], blend_mm);
        let staying: Vec<f32> = (0..phi.len())
            .into_par_iter()
            .map(|n| (at(n, -leaving(n)) + margin).max(-cutoff))
            .collect();
        let behind_staying = self.sweeper.max_ahead(&staying, along, DRAFT);
        let mut g: Vec<f32> = (0..phi.len())
            .into_par_iter()
            .map(|n| -smooth_max(-leaving(n), behind_staying[n], blend_mm))
            .collect();
        // Fragments that p gives stay, so p must keep out of their way as well. Fragments that p gets leave
        // together with all that is ahead of them.
        for _ in 0..MOST_GIVINGS {
            let Some(given) = self.fragments.give(&mut g, &self.rest) else {
                break;
            };
            if let Some(mut gained) = given.gain_field(self.grid) {
                gained
                    .par_iter_mut()
                    .enumerate()
                    .for_each(|(n, f)| *f = at(n, *f).max(-cutoff));
                let ahead = self.sweeper.max_ahead(&gained, along.map(|x| -x), DRAFT);
                g.par_iter_mut()
                    .zip(&ahead)
                    .for_each(|(g, ahead)| *g = g.max(*ahead));
            }
            let staying: Vec<f32> = (0..g.len())
                .into_par_iter()
                .map(|n| at(n, -g[n]).max(-cutoff))
                .collect();
            // The cut has its draft, and another one each round would move it by that much.
            let behind = self.sweeper.max_ahead(&staying, along, Draft::NONE);
            g.par_iter_mut()
                .zip(&behind)
                .for_each(|(g, behind)| *g = g.min(-behind));
        }
        g
    }

    /// Share of the wall under the patch of `p` that is on p's side of the cut `g`, in [0, 1].
    fn kept_share(&self, p: PatchId, g: &[f32]) -> f64 {
        let phi = self.distances.preference(p, &self.remains, self.grid.cutoff_mm());
        let is_own = |&n: &usize| phi[n] > 0.0 && self.wall(n, 0.0) > 0.0 && self.rest[n] > 0.0;
        let (own, kept) = (0..g.len())
            .into_par_iter()
            .filter(is_own)
            .map(|n| (1usize, usize::from(g[n] > 0.0)))
            .reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        kept as f64 / own.max(1) as f64
    }

    /// Removes p. Returns the field that is positive where p may have no connectors.
    fn remove(&mut self, p: PatchId, separation: LatticeDirection, g: &[f32]) -> Vec<f32> {
        let cutoff = self.grid.cutoff_mm();
        let along = separation.step();
        let body: Vec<f32> = (0..g.len())
            .into_par_iter()
            .map(|n| self.wall(n, 0.0).min(g[n]).min(self.rest[n]).max(-cutoff))
            .collect();
        self.remains[usize::from(p)] = false;
        self.rest.par_iter_mut().zip(g).for_each(|(r, g)| *r = r.min(-g));
        let staying: Vec<f32> = (0..g.len())
            .into_par_iter()
            .map(|n| self.wall(n, 0.0).min(self.rest[n]).max(-cutoff))
            .collect();
        let (behind_staying, ahead_of_p) = rayon::join(
            || self.sweeper.max_ahead(&staying, along, DRAFT),
            || self.sweeper.max_ahead(&body, along.map(|x| -x), DRAFT),
        );
        let in_way = behind_staying
            .iter()
            .zip(&self.in_later_ways)
            .map(|(a, b)| a.max(*b))
            .collect();
        self.in_later_ways
            .par_iter_mut()
            .zip(&ahead_of_p)
            .for_each(|(w, a)| *w = w.max(*a));
        in_way
    }
}

/// The inner surface of the wall while its owners are being found.
struct InnerSurface {
    mesh: TriMesh,
    owner: Vec<Option<PatchId>>,
}

impl InnerSurface {
    fn new(grid: &ShellGrid) -> Self {
        let field: Vec<f32> = grid.depth.iter().map(|d| d - grid.thickness_mm as f32).collect();
        let mesh = contour(&grid.band, &field, OffBand::LikeNeighbours);
        let owner = vec![None; mesh.triangles.len()];
        Self { mesh, owner }
    }

    /// Gives `p` the unowned part of the surface on its side of the cut `g`.
    fn give(&mut self, p: PatchId, g: &[f32], band: &Band) {
        let mut is_open = vec![false; self.mesh.points.len()];
        for (triangle, _) in self
            .mesh
            .triangles
            .iter()
            .zip(&self.owner)
            .filter(|(_, owner)| owner.is_none())
        {
            triangle.iter().for_each(|&v| is_open[v as usize] = true);
        }
        let value = |(&x, open): (&Vec3, &bool)| {
            if *open {
                band.sample(g, x).unwrap_or(-1.0)
            } else {
                -1.0
            }
        };
        let values: Vec<f64> = self.mesh.points.par_iter().zip(&is_open).map(value).collect();
        let cut = cut_at_zero(&self.mesh, &values, |face| self.owner[face].is_none());
        self.owner = cut
            .source_face
            .iter()
            .zip(&cut.side)
            .map(|(&source, side)| match side {
                Side::Positive => Some(p),
                Side::Negative => None,
                Side::Bystander => self.owner[source as usize],
            })
            .collect();
        self.mesh = cut.mesh;
    }

    fn give_rest(&mut self, p: PatchId) {
        self.owner.iter_mut().for_each(|o| *o = o.or(Some(p)));
    }

    fn finish(self, n_patches: usize) -> Option<SegmentedSurface> {
        let n = self.mesh.triangles.len();
        (n > 0).then(|| SegmentedSurface {
            mesh: self.mesh,
            patch_of_face: self
                .owner
                .into_iter()
                .map(|o| o.expect("the last piece took the rest"))
                .collect(),
            source_face: (0..n as u32).collect(),
            n_patches,
        })
    }
}

//! The grid that bodies are computed on: depth below the surface, and distances to the patches.

use rayon::prelude::*;
use shellock_assembly::LatticeDirection;
use shellock_geom::band::{Band, GridTooFine};
use shellock_geom::boolean::NotAVolume;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::marching_cubes::{OffBand, contour};
use shellock_geom::signed_distance::SignedDistance;
use shellock_geom::simplify::decimate_without_crossing;
use shellock_geom::{Aabb, Solid, Vec3, Volume};
use shellock_report::PatchId;
use shellock_surface::SegmentedSurface;

use super::BodyParams;
use super::sheets::Sheets;

/// Distance from the level at which values are cut off, in cells. Only the nearest few cells shape a contour,
/// and bounded fields interpolate without jumps.
const CUTOFF_CELLS: f64 = 3.5;
/// Width of the band outside the surface, in cells: the cuts must reach past the surface.
const OUTSIDE_CELLS: f64 = 2.5;
/// Root mean square distance by which the wall's inner surface may be simplified, mm. No printer resolves it,
/// and all later steps have a fifth of the triangles to deal with.
const INNER_TOLERANCE_MM: f64 = 0.05;

/// Grid nodes near the model's surface and their depth below it. Depends on the model alone.
pub struct ShellGrid {
    /// The nodes of the band.
    pub band: Band,
    /// Signed distance to the surface (φ0), mm, positive inside. Exact down to a few cells below the wall.
    pub depth: Vec<f32>,
    /// Wall thickness H, mm.
    pub thickness_mm: f64,
    /// Depth to which the band reaches, mm.
    pub reach_mm: f64,
    /// The model as a solid volume.
    pub(super) solid: Volume,
    /// The wall: the model less its cavity.
    pub wall: Volume,
    /// Pairs of neighbouring nodes inside the model with a crack between them that the depth at nodes does
    /// not show. The lower node comes first; pairs are sorted.
    cracks: Vec<(u32, u32)>,
}

/// Reason why the wall cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GridError {
    /// The grid has too many steps along one axis.
    #[error(transparent)]
    TooFine(#[from] GridTooFine),
    /// The boolean library rejects the mesh.
    #[error(
        "the model's surface touches itself in a way that cannot be cut: {0}; separate the touching parts \
         or repair the mesh"
    )]
    Surface(String),
    /// The inner side of the wall is not closed.
    #[error(
        "inside and outside of the model cannot be told apart everywhere, so it cannot be hollowed out: its \
         surface crosses itself; make its parts one solid (a boolean union) and try again"
    )]
    NoInside,
    /// No part of the model is deeper than the wall is thick.
    #[error(
        "the model has no cavity between two walls of {thickness_mm:.2} mm that the grid could resolve, so \
         there is nothing to hollow out; print it solid, make it larger or choose a thinner wall"
    )]
    NoCavity {
        /// Wall thickness asked for, mm.
        thickness_mm: f64,
    },
}

impl ShellGrid {
    /// Lays the band of `model`, from a little outside to `below_wall_mm` below the wall.
    pub fn new(params: &BodyParams, model: &Solid, below_wall_mm: f64) -> Result<Self, GridError> {
        let cell = params.cell_mm();
        let reach_mm = params.thickness_mm + below_wall_mm.max(3.0 * cell);
        let distance = SignedDistance::new(model);
        let exact_mm = params.thickness_mm + (OUTSIDE_CELLS + 1.0) * cell;
        let bounds = model.mesh().bounds();
        let (band, depth) = Band::along(&distance, bounds, cell, OUTSIDE_CELLS * cell, reach_mm, exact_mm)?;
        let thickness_mm = params.thickness_mm;
        let cracks = cracks(&distance, &band, &depth);
        let (outer, cavity) = rayon::join(
            || Volume::from_solid(model),
            || deeper_than(&band, &depth, thickness_mm),
        );
        let cavity = cavity.map_err(|_| GridError::NoInside)?;
        if cavity.is_empty() {
            return Err(GridError::NoCavity { thickness_mm });
        }
        let solid = outer.map_err(|e| GridError::Surface(e.to_string()))?;
        let wall = solid.subtract(&cavity);
        Ok(Self {
            band,
            depth,
            thickness_mm,
            reach_mm,
            solid,
            wall,
            cracks,
        })
    }

    /// Face neighbours of `node`, except across a crack, where both nodes are inside the model but the space
    /// between them is not.
    pub(super) fn joined_neighbours(&self, node: u32) -> impl Iterator<Item = u32> + '_ {
        let is_cut = move |other: u32| {
            let pair = (node.min(other), node.max(other));
            self.cracks.binary_search(&pair).is_ok()
        };
        self.band.face_neighbours(node).filter(move |&n| !is_cut(n))
    }

    /// Greatest absolute value kept in fields, mm.
    pub fn cutoff_mm(&self) -> f32 {
        (CUTOFF_CELLS * self.band.cell_mm()) as f32
    }

    /// Returns true if a node is so deep below the wall that no body reaches it.
    pub(super) fn is_below_wall(&self, node: usize) -> bool {
        f64::from(self.depth[node]) > self.thickness_mm + OUTSIDE_CELLS * self.band.cell_mm()
    }
}

/// Finds the pairs of nodes of [`ShellGrid::cracks`].
fn cracks(distance: &SignedDistance, band: &Band, depth: &[f32]) -> Vec<(u32, u32)> {
    let cell = band.cell_mm() as f32;
    let is_crack = |n: u32, m: u32| {
        // Where the surface passes between two nodes, the sum of their depths is at most a cell.
        let (a, b) = (depth[n as usize], depth[m as usize]);
        let position = |n: u32| band.position(n as usize);
        b > 0.0 && a + b <= 1.001 * cell && distance.is_between(position(n), position(m))
    };
    (0..band.len() as u32)
        .into_par_iter()
        .filter(|&n| (0.0..cell).contains(&depth[n as usize]))
        .flat_map_iter(|n| {
            let later = band.face_neighbours(n).filter(move |&m| m > n);
            later.filter(move |&m| is_crack(n, m)).map(move |m| (n, m))
        })
        .collect::<Vec<_>>()
}

/// The region deeper than `depth_mm`, with few triangles.
fn deeper_than(band: &Band, depth: &[f32], depth_mm: f64) -> Result<Volume, NotAVolume> {
    let field: Vec<f32> = depth.iter().map(|d| d - depth_mm as f32).collect();
    let mesh = contour(band, &field, OffBand::LikeNeighbours);
    let tolerance = vec![INNER_TOLERANCE_MM; mesh.points.len()];
    Volume::from_closed_mesh(&decimate_without_crossing(mesh, &tolerance))
}

/// A patch and the distance to it, mm.
type Entry = (u32, f32);

/// Distances from each node of the wall to the patches near it. Sparse, since most nodes see only one patch.
pub struct PatchDistances {
    /// Offsets into the entries: those of node n are `start[n] .. start[n + 1]`.
    start: Vec<u32>,
    entries: Vec<Entry>,
    sheets: Sheets,
}

impl PatchDistances {
    /// Measures from every node of the wall to every patch whose distance is within twice the cutoff of that
    /// to the nearest one.
    pub fn measure(grid: &ShellGrid, surface: &SegmentedSurface) -> Self {
        let groups: Vec<u32> = surface.patch_of_face.iter().map(|p| p.0).collect();
        let bvh = TriangleBvh::with_groups(&surface.mesh, &groups);
        let span = 2.0 * f64::from(grid.cutoff_mm());
        let lonely = LonelyBlocks::find(grid, &bvh, span);
        let chunk = 4096;
        let n = grid.band.len();
        let parts: Vec<(Vec<u32>, Vec<Entry>)> = (0..n.div_ceil(chunk))
            .into_par_iter()
            .map(|c| {
                let (mut counts, mut entries, mut found) =
                    (Vec::with_capacity(chunk), Vec::new(), Vec::new());
                for node in c * chunk..((c + 1) * chunk).min(n) {
                    if grid.is_below_wall(node) {
                        counts.push(0);
                        continue;
                    }
                    if let Some(patch) = lonely.patch_at(grid.band.block(node, BLOCK)) {
                        counts.push(1);
                        entries.push((patch, grid.depth[node].abs()));
                        continue;
                    }
                    let limit = f64::from(grid.depth[node].abs()) * 1.0001 + 1e-4 + span;
                    bvh.nearest_by_group(grid.band.position(node), limit * limit, &mut found);
                    counts.push(found.len() as u32);
                    entries.extend(found.iter().map(|&(g, d)| (g, d.sqrt() as f32)));
                }
                (counts, entries)
            })
            .collect();
        let (mut start, mut entries) = (vec![0u32], Vec::new());
        for (counts, part) in parts {
            for count in counts {
                start.push(start[start.len() - 1] + count);
            }
            entries.extend(part);
        }
        let near_seams: Vec<u32> = (0..n as u32)
            .filter(|&i| start[i as usize + 1] - start[i as usize] > 1)
            .collect();
        let foot = |x: Vec3| bvh.nearest(x, f64::INFINITY).map(|nearest| nearest.point);
        let sheets = Sheets::new(grid, surface, &near_seams, foot);
        Self {
            start,
            entries,
            sheets,
        }
    }

    /// Field that is positive on the side of `p`, which leaves along `separation` from the patches in
    /// `remains`. Near their seams it is the distance to the sheets through them, elsewhere
    /// [`Self::preference`].
    pub fn side_of(
        &self,
        grid: &ShellGrid,
        p: PatchId,
        remains: &[bool],
        separation: LatticeDirection,
    ) -> Vec<f32> {
        let mut side = self.preference(p, remains, grid.cutoff_mm());
        self.sheets.shape(grid, p, remains, separation, &mut side);
        side
    }

    /// `½ (min over remaining j ≠ p of d_j − d_p)` at every node, cut off at ±`cutoff`; positive nearer to
    /// `p`. `remains[j]` is true while patch j is still there.
    pub fn preference(&self, p: PatchId, remains: &[bool], cutoff: f32) -> Vec<f32> {
        (0..self.start.len() - 1)
            .into_par_iter()
            .map(|node| {
                let entries = &self.entries[self.start[node] as usize..self.start[node + 1] as usize];
                let (mut own, mut others) = (f32::INFINITY, f32::INFINITY);
                for &(patch, d) in entries {
                    if patch == p.0 {
                        own = d;
                    } else if remains[patch as usize] {
                        others = others.min(d);
                    }
                }
                // Far from p the value does not matter: the node belongs to a piece that has left.
                if own == f32::INFINITY {
                    -cutoff
                } else {
                    (0.5 * (others - own)).clamp(-cutoff, cutoff)
                }
            })
            .collect()
    }
}

/// Edge length, in nodes, of the blocks whose patches are looked up at once.
const BLOCK: u16 = 4;

/// Blocks of nodes that see only one patch, as most do: the distance of their nodes to it is the depth.
struct LonelyBlocks {
    /// Block and patch, sorted by block.
    patch_of: Vec<([u16; 3], u32)>,
}

impl LonelyBlocks {
    /// Finds the blocks. A node sees all patches whose distance exceeds that of its nearest one by at most
    /// `span` mm.
    fn find(grid: &ShellGrid, bvh: &TriangleBvh, span: f64) -> Self {
        let is_asked = |&n: &usize| !grid.is_below_wall(n);
        let mut members: Vec<([u16; 3], u32)> = (0..grid.band.len())
            .into_par_iter()
            .filter(is_asked)
            .map(|n| (grid.band.block(n, BLOCK), n as u32))
            .collect();
        members.par_sort_unstable();
        let blocks: Vec<&[([u16; 3], u32)]> = members.chunk_by(|a, b| a.0 == b.0).collect();
        let patch_of = blocks
            .par_iter()
            .filter_map(|block| {
                let node = block[block.len() / 2].1 as usize;
                let radius = f64::from(BLOCK - 1) * 3f64.sqrt() * grid.band.cell_mm();
                // A patch that any node of the block sees is farther from this node by at most twice the
                // radius.
                let limit = f64::from(grid.depth[node].abs()) * 1.0001 + 1e-4 + span + 2.0 * radius;
                let mut found = Vec::new();
                bvh.nearest_by_group(grid.band.position(node), limit * limit, &mut found);
                (found.len() == 1).then(|| (block[0].0, found[0].0))
            })
            .collect();
        Self { patch_of }
    }

    fn patch_at(&self, block: [u16; 3]) -> Option<u32> {
        self.patch_of
            .binary_search_by_key(&block, |e| e.0)
            .ok()
            .map(|at| self.patch_of[at].1)
    }
}

/// A field on the nodes inside a box.
#[derive(Clone, Debug)]
pub struct LocalField {
    nodes: Vec<u32>,
    values: Vec<f32>,
}

impl LocalField {
    /// Copies the part of `field` that lies in `room`.
    pub fn cut_out(band: &Band, field: &[f32], room: Aabb) -> Self {
        let nodes = band.nodes_in(room);
        let values = nodes.iter().map(|&n| field[n as usize]).collect();
        Self { nodes, values }
    }

    /// Spreads this field over all nodes of the band, with the value `elsewhere` at the others.
    pub fn spread(&self, band: &Band, elsewhere: f32) -> Vec<f32> {
        let mut field = vec![elsewhere; band.len()];
        for (&n, &v) in self.nodes.iter().zip(&self.values) {
            field[n as usize] = v;
        }
        field
    }
}

/// Outward unit normal of the offset surface through `p`; zero where the depth field has no slope.
pub(crate) fn outward(grid: &ShellGrid, p: Vec3) -> Vec3 {
    -grid.band.gradient(&grid.depth, p).normalize_or_zero()
}

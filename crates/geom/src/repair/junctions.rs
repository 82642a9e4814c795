//! T-junctions: edges that are divided on one side only.

use std::collections::BTreeMap;

use super::{Draft, NEAR_SHARE, Repair, RepairKind};
use crate::check::{OpenEdge, open_edges};
use crate::subdivide::fill_triangle;
use crate::{TriMesh, Vec3};

/// Largest number of edge–point pairs that are tested. Hostile files have more, and stay open.
const MAX_WORK: usize = 50_000_000;

/// Divides triangles at the corners of others that lie on their open edges. Keeps the draft if that closes
/// nothing.
pub(super) fn join(draft: &mut Draft) -> Option<Repair> {
    let open = open_edges(&draft.mesh);
    if open.is_empty() {
        return None;
    }
    let within = NEAR_SHARE * draft.mesh.bounds().diagonal();
    let points = Cells::of(&draft.mesh, &open)?;
    let mut on_side: BTreeMap<(u32, u8), Vec<u32>> = BTreeMap::new();
    let (mut count, mut work, mut at) = (0, 0, Vec3::ZERO);
    for edge in &open {
        let found = points.on_edge(&draft.mesh, edge, within, &mut work);
        if work > MAX_WORK {
            return None;
        }
        if let Some(&first) = found.first() {
            if count == 0 {
                at = draft.mesh.points[first as usize];
            }
            count += found.len();
            on_side.insert((edge.face, edge.side), found);
        }
    }
    if count == 0 {
        return None;
    }
    let mut joined = Draft {
        mesh: TriMesh::default(),
        source: Vec::new(),
    };
    joined.mesh.points.clone_from(&draft.mesh.points);
    for ((&triangle, &source), face) in draft.mesh.triangles.iter().zip(&draft.source).zip(0..) {
        let side = |k| on_side.get(&(face, k)).map_or(&[][..], Vec::as_slice);
        fill_triangle(triangle, [side(0), side(1), side(2)], &mut joined.mesh.triangles);
        joined.source.resize(joined.mesh.triangles.len(), source);
    }
    if joined.n_open() >= open.len() {
        return None;
    }
    *draft = joined;
    Some(Repair {
        kind: RepairKind::Joined,
        count,
        at,
    })
}

/// Ends of open edges, sorted into cells as large as a typical edge.
struct Cells {
    size: f64,
    content: BTreeMap<[i64; 3], Vec<u32>>,
    all: Vec<u32>,
}

impl Cells {
    fn of(mesh: &TriMesh, open: &[OpenEdge]) -> Option<Self> {
        let mut all: Vec<u32> = open.iter().flat_map(|e| [e.from, e.to]).collect();
        all.sort_unstable();
        all.dedup();
        let mut lengths: Vec<f64> = open.iter().map(|e| e.length(mesh)).collect();
        lengths.sort_unstable_by(f64::total_cmp);
        let size = lengths[lengths.len() / 2];
        if size <= 0.0 {
            return None;
        }
        let mut cells = Self {
            size,
            content: BTreeMap::new(),
            all: Vec::new(),
        };
        for &point in &all {
            cells
                .content
                .entry(cells.cell(mesh.points[point as usize]))
                .or_default()
                .push(point);
        }
        Some(Self { all, ..cells })
    }

    fn cell(&self, point: Vec3) -> [i64; 3] {
        point.to_array().map(|x| (x / self.size).floor() as i64)
    }

    /// Points inside an edge, in order along it, that are not corners of its triangle.
    fn on_edge(&self, mesh: &TriMesh, edge: &OpenEdge, within: f64, work: &mut usize) -> Vec<u32> {
        /// Largest number of cells searched for a long edge; beyond that, testing all points is faster.
        const MAX_CELLS: i64 = 1000;
        let [from, to] = [edge.from, edge.to].map(|v| mesh.points[v as usize]);
        let (along, length) = (to - from, from.distance(to));
        let (low, high) = (self.cell(from.min(to) - within), self.cell(from.max(to) + within));
        let extent: [i64; 3] =
            std::array::from_fn(|axis| high[axis].saturating_sub(low[axis]).saturating_add(1));
        let n_cells = extent.iter().fold(1_i64, |n, &e| n.saturating_mul(e));
        let mut near: Vec<u32> = Vec::new();
        if n_cells > MAX_CELLS {
            near.extend(&self.all);
        } else {
            for i in 0..n_cells {
                let step = [
                    i % extent[0],
                    i / extent[0] % extent[1],
                    i / extent[0] / extent[1],
                ];
                near.extend(
                    self.content
                        .get(&std::array::from_fn(|axis| low[axis] + step[axis]))
                        .into_iter()
                        .flatten(),
                );
            }
        }
        *work += near.len();
        let corners = mesh.triangles[edge.face as usize];
        let place = |p: u32| {
            let q = mesh.points[p as usize] - from;
            let t = q.dot(along) / (length * length);
            let is_within = t * length > within && (1.0 - t) * length > within;
            (is_within && q.distance(t * along) <= within && !corners.contains(&p)).then_some((t, p))
        };
        let mut found: Vec<(f64, u32)> = near.into_iter().filter_map(place).collect();
        found.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        // If two points lie at the same place along the edge, the surface is doubled rather than divided
        // there. The first one is enough.
        found.dedup_by(|later, earlier| (later.0 - earlier.0) * length <= within);
        found.into_iter().map(|(_, p)| p).collect()
    }
}

//! A posed piece as columns: stretches of vertical lines, one through each cell of a grid, that are inside
//! the piece.
//!
//! ```text
//!        ┌──────────┐  top
//!        │ a span   │
//!        └──────────┘  bottom: hangs where the face is flatter than an overhang may be
//!             :        support, down to the next span or to the plate
//!        ┌──────────┐
//! ───────┴──────────┴─────── plate, z = 0
//! ```
//!
//! Supports depend on these columns: a support above another part of the same piece ends there, not on the
//! plate. Limit: a feature narrower than a cell may fall between two columns.

use shellock_geom::{Aabb, TriMesh, Vec3};

/// Offset of each line from the middle of its cell, in cells. No round numbers, so that lines do not hit the
/// edges of boxes.
const OFF_MIDDLE: [f64; 2] = [0.0137, -0.0219];

/// A stretch of a column that is inside the piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Height of the lower end above the plate, mm.
    pub bottom_mm: f64,
    /// Height of the upper end above the plate, mm.
    pub top_mm: f64,
    /// Upward component of the unit normal at the lower end, in [−1, 0]; −1 for a horizontal overhang.
    pub bottom_normal: f64,
}

impl Span {
    /// Returns true if a height is in the span, upper end excluded.
    pub fn holds(&self, z_mm: f64) -> bool {
        self.bottom_mm <= z_mm && z_mm < self.top_mm
    }
}

/// All columns of a piece in its pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns {
    /// Width of a cell, mm.
    pub cell_mm: f64,
    /// Numbers of cells along x and y.
    pub size: [usize; 2],
    /// Least x and y of the piece in the plate's axes, mm.
    corner_mm: [f64; 2],
    /// Height of the piece, mm.
    pub height_mm: f64,
    /// Index of each column's first span, x fastest, and the number of spans at the end.
    starts: Vec<u32>,
    spans: Vec<Span>,
}

/// A crossing of a column with a face: column, height, upward component of the unit normal.
struct Crossing {
    column: u32,
    height_mm: f64,
    normal: f64,
}

impl Columns {
    /// Computes the columns of a closed `mesh` turned so that `axes` are those of the plate, with its lowest
    /// point at z = 0.
    ///
    /// Cells are `cell_mm` wide, or wider so that the longer side has at most 160. Linear in faces and cells.
    pub fn of(mesh: &TriMesh, axes: [Vec3; 3], cell_mm: f64) -> Self {
        /// Largest number of cells along the longer side.
        const MOST_CELLS: f64 = 160.0;
        let points: Vec<Vec3> = mesh
            .points
            .iter()
            .map(|p| Vec3::from_array(axes.map(|a| a.dot(*p))))
            .collect();
        let bounds = Aabb::around(points.iter().copied());
        let reach = bounds.max - bounds.min;
        let cell_mm = cell_mm.max(reach.x.max(reach.y) / MOST_CELLS);
        let size = [reach.x, reach.y].map(|mm| (mm / cell_mm).ceil().max(1.0) as usize);
        let to_grid = |p: &Vec3| {
            let q = *p - bounds.min;
            Vec3::new(
                q.x / cell_mm - 0.5 - OFF_MIDDLE[0],
                q.y / cell_mm - 0.5 - OFF_MIDDLE[1],
                q.z,
            )
        };
        let points: Vec<Vec3> = points.iter().map(to_grid).collect();
        let mut crossings = Vec::new();
        for corners in &mesh.triangles {
            cross(&points, *corners, size, cell_mm, &mut crossings);
        }
        let (starts, spans) = spans(size[0] * size[1], crossings);
        Self {
            cell_mm,
            size,
            corner_mm: [bounds.min.x, bounds.min.y],
            height_mm: reach.z,
            starts,
            spans,
        }
    }

    /// Returns the spans of a column, lowest first.
    pub fn spans(&self, column: usize) -> &[Span] {
        &self.spans[self.starts[column] as usize..self.starts[column + 1] as usize]
    }

    /// Columns that intersect the piece, in order.
    pub fn shadow(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.len()).filter(|&column| !self.spans(column).is_empty())
    }

    /// Position of the middle of a column's cell in the plate's axes, mm.
    pub fn middle(&self, column: usize) -> [f64; 2] {
        let at = [column % self.size[0], column / self.size[0]];
        [0, 1].map(|k| self.corner_mm[k] + (at[k] as f64 + 0.5) * self.cell_mm)
    }

    /// Number of columns, with or without spans.
    pub fn len(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// Returns true if there is no column.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Area of a cell, mm².
    pub fn cell_mm2(&self) -> f64 {
        self.cell_mm * self.cell_mm
    }
}

/// Twice the signed area of `abp`, seen from above. Exactly the negative for `bap`, so that a column crosses
/// exactly one of two faces at a common edge.
fn side(points: &[Vec3], a: u32, b: u32, x: f64, y: f64) -> f64 {
    let (lo, hi) = (points[a.min(b) as usize], points[a.max(b) as usize]);
    let doubled = (hi.x - lo.x) * (y - lo.y) - (hi.y - lo.y) * (x - lo.x);
    if a < b { doubled } else { -doubled }
}

/// Adds the crossings of columns with a face. Points have x and y in cells and z in mm.
fn cross(
    points: &[Vec3],
    [a, b, c]: [u32; 3],
    size: [usize; 2],
    cell_mm: f64,
    crossings: &mut Vec<Crossing>,
) {
    let corners = [a, b, c].map(|i| points[i as usize]);
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    if normal.z == 0.0 {
        return;
    }
    // The normal in mm: the cross product has x and y in cells.
    let upward =
        normal.z / (normal.z * normal.z + (normal.x.powi(2) + normal.y.powi(2)) / cell_mm.powi(2)).sqrt();
    let range = |k: usize| {
        let (lo, hi) = corners
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), p| {
                (lo.min(p[k]), hi.max(p[k]))
            });
        (lo.ceil().max(0.0) as usize)..((hi.floor() + 1.0).clamp(0.0, size[k] as f64) as usize)
    };
    for iy in range(1) {
        for ix in range(0) {
            let (x, y) = (ix as f64, iy as f64);
            let weights = [(b, c), (c, a), (a, b)].map(|(p, q)| side(points, p, q, x, y));
            if weights.iter().all(|w| *w > 0.0) || weights.iter().all(|w| *w < 0.0) {
                let sum: f64 = weights.iter().sum();
                let height_mm = (0..3).map(|k| weights[k] * corners[k].z).sum::<f64>() / sum;
                crossings.push(Crossing {
                    column: (iy * size[0] + ix) as u32,
                    height_mm,
                    normal: upward,
                });
            }
        }
    }
}

/// Start of each column's spans, and all spans. A span runs from a crossing into the piece to the crossing
/// out of it.
fn spans(n_columns: usize, mut crossings: Vec<Crossing>) -> (Vec<u32>, Vec<Span>) {
    crossings.sort_by(|a, b| {
        (a.column, a.height_mm)
            .partial_cmp(&(b.column, b.height_mm))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    let mut starts = Vec::with_capacity(n_columns + 1);
    let mut spans: Vec<Span> = Vec::with_capacity(crossings.len() / 2);
    let mut rest = crossings.as_slice();
    for column in 0..n_columns {
        starts.push(spans.len() as u32);
        let n = rest.iter().take_while(|c| c.column as usize == column).count();
        let (mine, others) = rest.split_at(n);
        rest = others;
        let mut entered: Vec<&Crossing> = Vec::new();
        for crossing in mine {
            if crossing.normal < 0.0 {
                entered.push(crossing);
            } else if let Some(below) = entered.pop()
                && entered.is_empty()
            {
                spans.push(Span {
                    bottom_mm: below.height_mm,
                    top_mm: crossing.height_mm,
                    bottom_normal: below.normal,
                });
            }
        }
    }
    starts.push(spans.len() as u32);
    (starts, spans)
}

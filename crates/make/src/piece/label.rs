//! Piece numbers, engraved on the inner side of the wall, where nobody sees them once the model is assembled.
//!
//! ```text
//!        ┌┐  ┌┐  ┌┐        strokes about as deep everywhere, whatever the wall's curvature
//!   ─────┘└──┘└──┘└─────   inner side
//!                          what is left of the wall
//!   ────────────────────   outer side
//! ```
//!
//! A place is suitable where rays from the cavity meet only the inner side, close to a plane, and pass
//! through the whole wall behind it. That keeps numbers off connectors, seams, notches and carved walls. The
//! largest size with a suitable place is taken, as near to the middle of the wall as possible.

mod digits;

use digits::Drawing;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{TriMesh, Vec3, Volume};
use shellock_report::ParamProblem;

use crate::body::ShellGrid;

/// Parameters of engraved numbers. Lengths in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LabelParams {
    /// Depth of the strokes. [0.1, 1]; 0.4, visible in every process, as two layers of filament are.
    pub depth_mm: f64,
    /// Width of the strokes. [0.4, 2]; 0.8: two lines of a 0.4 nozzle.
    pub stroke_mm: f64,
    /// Least wall thickness left behind a stroke. [0.1, 5]; 0.8.
    pub least_wall_mm: f64,
}

impl Default for LabelParams {
    fn default() -> Self {
        Self {
            depth_mm: 0.4,
            stroke_mm: 0.8,
            least_wall_mm: 0.8,
        }
    }
}

impl LabelParams {
    /// Lists every parameter out of range.
    pub fn problems(&self) -> Vec<ParamProblem> {
        let checks = [
            ParamProblem::unless_within("depth of numbers", "mm", self.depth_mm, 0.1, 1.0),
            ParamProblem::unless_within("stroke of numbers", "mm", self.stroke_mm, 0.4, 2.0),
            ParamProblem::unless_within("wall behind numbers", "mm", self.least_wall_mm, 0.1, 5.0),
        ];
        checks.into_iter().flatten().collect()
    }
}

/// Heights of digits that are tried, mm, largest first; below the last their loops would close.
const HEIGHTS_MM: [f64; 4] = [8.0, 6.5, 5.2, 4.2];
/// Free margin around a number, mm.
const RIM_MM: f64 = 1.2;
/// Spacing of the rays that test a place, mm.
const LOOK_MM: f64 = 0.9;
/// Approximate spacing of the places that are tried, mm.
const SPACING_MM: f64 = 2.0;
/// Uncertainty of the wall's inner side, mm: a quarter of a cell and its decimation.
const INNER_MM: f64 = 0.3;
/// Greatest deviation of the surface from the plane of a number, mm.
const UNEVEN_MM: f64 = 1.5;
/// Least cosine between a number's normal and the surface's: strokes get steeper beyond 40°.
const COS_STEEP: f64 = 0.766;
/// Share of the thickness that the wall must have behind a number; carved walls are thinner.
const WHOLE_WALL: f64 = 0.85;
/// Height above a number's plane at which rays start, mm; cutters end at half of it above the surface.
const ABOVE_MM: f64 = 2.0;
/// Tolerance within which strokes follow the surface, mm.
const FOLLOW_MM: f64 = 0.06;
/// Length below which strokes are not divided, mm.
const SHORTEST_MM: f64 = 0.6;
/// Directions in which a number may run, as rotations in rad.
const TURNS: [f64; 4] = [0.0, 0.5, -0.5, 1.57];

/// The volume to cut from `piece` to engrave its `number`; `None` where no place has room for it.
pub(super) fn cut(params: &LabelParams, grid: &ShellGrid, number: usize, piece: &Volume) -> Option<Volume> {
    let depth = |p: Vec3| grid.band.sample(&grid.depth, p);
    Wall::new(params, piece.to_mesh(), grid.thickness_mm, &depth).engrave(u32::try_from(number).ok()?)
}

/// A piece's wall, with the data that placing a number needs.
struct Wall<'a> {
    params: &'a LabelParams,
    mesh: TriMesh,
    bvh: TriangleBvh,
    thickness_mm: f64,
    /// Depth below the outer surface, mm, where it is known.
    depth: &'a dyn Fn(Vec3) -> Option<f64>,
}

/// Writing plane in the cavity, with `right` and `up` as a reader in the cavity sees them.
struct WritingPlane {
    corner: Vec3,
    right: Vec3,
    up: Vec3,
    /// Unit normal out of the wall, into the cavity.
    normal: Vec3,
}

impl WritingPlane {
    fn at(&self, [x, y]: [f64; 2]) -> Vec3 {
        self.corner + x * self.right + y * self.up
    }
}

impl<'a> Wall<'a> {
    fn new(
        params: &'a LabelParams,
        mesh: TriMesh,
        thickness_mm: f64,
        depth: &'a dyn Fn(Vec3) -> Option<f64>,
    ) -> Self {
        Self {
            params,
            bvh: TriangleBvh::new(&mesh),
            mesh,
            thickness_mm,
            depth,
        }
    }

    fn engrave(&self, number: u32) -> Option<Volume> {
        let Self {
            params, thickness_mm, ..
        } = self;
        if thickness_mm * WHOLE_WALL - params.depth_mm < params.least_wall_mm {
            return None;
        }
        let places = self.places();
        HEIGHTS_MM.iter().find_map(|&height_mm| {
            let drawing = Drawing::of(number, height_mm);
            let tries = places.iter().flat_map(|place| TURNS.map(|turn| (place, turn)));
            tries
                .into_iter()
                .find_map(|(&place, turn)| self.cutter(&drawing, &self.sheet(place, turn, &drawing)?))
        })
    }

    /// Faces of the inner side, about evenly spread, those nearest to its middle first.
    fn places(&self) -> Vec<usize> {
        let is_inner = |&f: &usize| self.is_inner(self.mesh.face_center(f)) && self.mesh.face_area(f) > 0.0;
        let faces: Vec<usize> = (0..self.mesh.triangles.len()).filter(is_inner).collect();
        let area: f64 = faces.iter().map(|&f| self.mesh.face_area(f)).sum();
        let weighted: Vec3 = faces
            .iter()
            .map(|&f| self.mesh.face_area(f) * self.mesh.face_center(f))
            .sum();
        let middle = weighted / area.max(f64::MIN_POSITIVE);
        let cell = |f: usize| {
            (self.mesh.face_center(f) / SPACING_MM)
                .floor()
                .to_array()
                .map(|x| x as i64)
        };
        let mut by_cell: Vec<([i64; 3], usize)> = faces.into_iter().map(|f| (cell(f), f)).collect();
        by_cell.sort_unstable();
        by_cell.dedup_by_key(|entry| entry.0);
        let mut places: Vec<usize> = by_cell.into_iter().map(|entry| entry.1).collect();
        let away = |f: &usize| self.mesh.face_center(*f).distance_squared(middle);
        places.sort_by(|a, b| away(a).total_cmp(&away(b)));
        places
    }

    fn is_inner(&self, p: Vec3) -> bool {
        (self.depth)(p).is_some_and(|d| (d - self.thickness_mm).abs() < INNER_MM)
    }

    /// A sheet in the plane of `face` with the drawing in its middle; `None` where the wall has no room for
    /// it.
    fn sheet(&self, face: usize, turn: f64, drawing: &Drawing) -> Option<WritingPlane> {
        let normal = self.mesh.face_normal(face);
        // Numbers stand upright where the wall does.
        let upwards = if normal.z.abs() > 0.9 { Vec3::Y } else { Vec3::Z };
        let up = upwards.reject_from(normal).try_normalize()?;
        let right = up.cross(normal);
        let (sin, cos) = turn.sin_cos();
        let (right, up) = (cos * right + sin * up, cos * up - sin * right);
        let size = drawing.size_mm();
        let corner = self.mesh.face_center(face) - 0.5 * size[0] * right - 0.5 * size[1] * up;
        let sheet = WritingPlane {
            corner,
            right,
            up,
            normal,
        };
        let rim = RIM_MM + 0.5 * self.params.stroke_mm;
        let n = size.map(|side| ((side + 2.0 * rim) / LOOK_MM).ceil() as usize);
        let place = |axis: usize, i: usize| i as f64 / n[axis] as f64 * (size[axis] + 2.0 * rim) - rim;
        // The corners come first: most unsuitable places fail there.
        let ends = [[0, 0], [n[0], 0], [0, n[1]], [n[0], n[1]]];
        let all = (0..=n[0]).flat_map(|i| (0..=n[1]).map(move |j| [i, j]));
        let mut looks = ends
            .into_iter()
            .chain(all)
            .map(|[i, j]| [place(0, i), place(1, j)]);
        looks.all(|at| self.has_whole_wall(&sheet, at)).then_some(sheet)
    }

    /// Returns true if the inner side lies below a place of the sheet, about parallel to it, with the whole
    /// wall behind it.
    fn has_whole_wall(&self, sheet: &WritingPlane, at: [f64; 2]) -> bool {
        let Some((face, height_mm)) = self.below(sheet, at) else {
            return false;
        };
        let point = sheet.at(at) + height_mm * sheet.normal;
        let is_flat =
            height_mm.abs() < UNEVEN_MM && self.mesh.face_normal(face).dot(sheet.normal) > COS_STEEP;
        if !(is_flat && self.is_inner(point)) {
            return false;
        }
        /// Distance behind the surface that was met, mm.
        const PAST_MM: f64 = 1e-3;
        let wall_mm = WHOLE_WALL * self.thickness_mm;
        self.bvh
            .first_hit(point - PAST_MM * sheet.normal, -sheet.normal, wall_mm - PAST_MM)
            .is_none()
    }

    /// First face below a place of the sheet, and its height over the sheet, mm.
    fn below(&self, sheet: &WritingPlane, at: [f64; 2]) -> Option<(usize, f64)> {
        let origin = sheet.at(at) + ABOVE_MM * sheet.normal;
        let (face, far_mm) = self.bvh.first_hit(origin, -sheet.normal, 2.0 * ABOVE_MM)?;
        Some((face as usize, ABOVE_MM - far_mm))
    }

    /// Volume that the strokes of `drawing` cut from the wall.
    fn cutter(&self, drawing: &Drawing, sheet: &WritingPlane) -> Option<Volume> {
        let mut parts = Vec::new();
        for stroke in &drawing.strokes {
            for pair in stroke.windows(2) {
                let ends = [pair[0], pair[1]].map(|at| Some((at, self.below(sheet, at)?.1)));
                self.cut_along(sheet, [ends[0]?, ends[1]?], &mut parts)?;
            }
        }
        Some(Volume::union_all(parts)).filter(|cut| !cut.is_empty())
    }

    /// Adds blocks along a straight stroke between two places with their heights. Halves the stroke where the
    /// surface bends.
    fn cut_along(
        &self,
        sheet: &WritingPlane,
        ends: [([f64; 2], f64); 2],
        parts: &mut Vec<Volume>,
    ) -> Option<()> {
        let [(a, height_a), (b, height_b)] = ends;
        let along = [b[0] - a[0], b[1] - a[1]];
        let length = along[0].hypot(along[1]);
        let middle = [0, 1].map(|k| 0.5 * (a[k] + b[k]));
        let height = self.below(sheet, middle)?.1;
        if length > SHORTEST_MM && (height - 0.5 * (height_a + height_b)).abs() > FOLLOW_MM {
            self.cut_along(sheet, [ends[0], (middle, height)], parts)?;
            return self.cut_along(sheet, [(middle, height), ends[1]], parts);
        }
        let half_mm = 0.5 * self.params.stroke_mm;
        let unit = along.map(|x| x / length.max(f64::MIN_POSITIVE));
        let mut corners = Vec::new();
        for (end, height, out) in [(a, height_a, -half_mm), (b, height_b, half_mm)] {
            for aside in [-half_mm, half_mm] {
                let at = [
                    end[0] + out * unit[0] - aside * unit[1],
                    end[1] + out * unit[1] + aside * unit[0],
                ];
                corners.extend(
                    [-self.params.depth_mm, 0.5 * ABOVE_MM]
                        .map(|z| sheet.at(at) + (height + z) * sheet.normal),
                );
            }
        }
        parts.push(Volume::hull(&corners));
        Some(())
    }
}

#[cfg(test)]
mod tests;

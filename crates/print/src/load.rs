//! Load of a posed piece on a printer: walls, infill and supports, from the piece's columns.
//!
//! Slices are examined about every millimetre, where a slicer examines every layer. Each filament slice
//! yields its sparse infill, its supports, and the length of short loops among its outlines. Sparse infill is
//! the area beyond the reach of the perimeters and of the solid layers above and below, if large enough.

use shellock_geom::{TriMesh, Vec3};

use crate::columns::Columns;
use crate::printer::{Printer, Process};
use crate::slicing::Slicing;
use crate::supports::Supports;

/// Width of a cell, mm.
pub(crate) const CELL_MM: f64 = 1.0;
/// Largest number of slices, which are otherwise a cell's width apart.
const MOST_SLICES: f64 = 120.0;
/// Solid layers below every top and above every bottom surface.
pub(crate) const SOLID_LAYERS: f64 = 3.0;
/// Smallest area of sparse infill, mm²; smaller areas are filled solid.
const SOLID_BELOW_MM2: f64 = 70.0;
/// Length below which a loop is printed slowly, mm: radius below 6.5, as in the slicer.
const SHORT_MM: f64 = 41.0;
/// Ratio of an outline's length to that of its cells' edges.
const OUTLINE: f64 = std::f64::consts::FRAC_PI_4;
/// Cosine of the slope of a level face: 10°.
const COS_LEVEL: f64 = 0.985;

/// Printing load of one piece, or of several on one plate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    /// Height of the highest part, mm.
    pub height_mm: f64,
    /// Volume of all parts, mm³.
    pub volume_mm3: f64,
    /// Area of all upward faces as seen from above, mm².
    pub top_mm2: f64,
    /// Area of those of them that are level, within 10°, mm².
    pub level_mm2: f64,
    /// Length of all outlines in all layers times the height of a layer, mm²: the area of all faces as seen
    /// from their sides.
    pub side_mm2: f64,
    /// Area of the shadow on the plate, mm².
    pub shadow_mm2: f64,
    /// Number of perimeters of a filament print.
    pub n_perimeters: usize,
    /// Volume filled with sparse infill, mm³.
    pub sparse_mm3: f64,
    /// Length of short loops in all slices times slice distance, mm². Short loops are printed slowly.
    pub small_side_mm2: f64,
    /// Volume filled by supports, mm³.
    pub support_mm3: f64,
    /// Supports of a filament print as the slicer draws them.
    pub drawn: Drawn,
    /// Area of the largest slice, mm²: the area over which a resin layer is peeled off.
    pub widest_mm2: f64,
    /// Volume of cups that open upwards only, mm³. Resin printers hang pieces upside down, so such cups trap
    /// resin and pull on the film. A bell, open below, drains through the supports that lift it off the
    /// plate.
    pub cup_mm3: f64,
}

/// Supports of a filament print in the shape in which the slicer draws them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drawn {
    /// Volume that they fill, mm³.
    pub volume_mm3: f64,
    /// Area of the sides, mm².
    pub side_mm2: f64,
    /// Area of the upper ends, mm².
    pub top_mm2: f64,
}

impl Drawn {
    fn and(self, other: Self) -> Self {
        Self {
            volume_mm3: self.volume_mm3 + other.volume_mm3,
            side_mm2: self.side_mm2 + other.side_mm2,
            top_mm2: self.top_mm2 + other.top_mm2,
        }
    }
}

impl Load {
    /// Combined load of both on one plate: heights by maximum, everything else by sum.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            height_mm: self.height_mm.max(other.height_mm),
            volume_mm3: self.volume_mm3 + other.volume_mm3,
            top_mm2: self.top_mm2 + other.top_mm2,
            level_mm2: self.level_mm2 + other.level_mm2,
            side_mm2: self.side_mm2 + other.side_mm2,
            shadow_mm2: self.shadow_mm2 + other.shadow_mm2,
            n_perimeters: self.n_perimeters.max(other.n_perimeters),
            sparse_mm3: self.sparse_mm3 + other.sparse_mm3,
            small_side_mm2: self.small_side_mm2 + other.small_side_mm2,
            support_mm3: self.support_mm3 + other.support_mm3,
            drawn: self.drawn.and(other.drawn),
            widest_mm2: self.widest_mm2 + other.widest_mm2,
            cup_mm3: self.cup_mm3 + other.cup_mm3,
        }
    }

    /// Computes the load of a closed `mesh` turned so that `axes` are those of the plate, sliced with these
    /// choices.
    ///
    /// Only figures that the time and material formulas of the printer's process use are computed; the others
    /// are 0. Takes some ms for a piece of 20 000 triangles and 60 mm.
    pub fn of(mesh: &TriMesh, axes: [Vec3; 3], printer: &Printer, slicing: Slicing) -> Self {
        let columns = Columns::of(mesh, axes, CELL_MM);
        let supports = Supports::of(&columns, printer, slicing.supports);
        let mut load = Self::without_slices(mesh, axes[2], printer, slicing, &columns, &supports);
        load.add_slices(printer, &columns, &supports);
        load
    }

    /// Computes the figures that need no slices, which take most of the time. A resin printer's time and
    /// material follow from these alone.
    pub(crate) fn without_slices(
        mesh: &TriMesh,
        up: Vec3,
        printer: &Printer,
        slicing: Slicing,
        columns: &Columns,
        supports: &Supports,
    ) -> Self {
        let mut load = Self {
            n_perimeters: slicing.n_perimeters,
            height_mm: columns.height_mm,
            volume_mm3: mesh.signed_volume(),
            ..Self::default()
        };
        if printer.process == Process::Sls {
            return load;
        }
        load.shadow_mm2 = columns.shadow().count() as f64 * columns.cell_mm2();
        load.support_mm3 = supports.volume_mm3(columns);
        if printer.process == Process::Fdm {
            for face in 0..mesh.triangles.len() {
                let double = mesh.double_area_vector(face);
                let upwards = double.dot(up);
                load.top_mm2 += upwards.max(0.0) / 2.0;
                if upwards > COS_LEVEL * double.length() {
                    load.level_mm2 += upwards / 2.0;
                }
                load.side_mm2 += (double - upwards * up).length() / 2.0;
            }
        }
        load
    }

    /// Adds the figures of slices.
    pub(crate) fn add_slices(&mut self, printer: &Printer, columns: &Columns, supports: &Supports) {
        match printer.process {
            Process::Sls => {}
            Process::Sla => Resin::of(columns).add_slices(columns, self),
            Process::Fdm => {
                let solid_mm = SOLID_LAYERS * printer.layer_mm;
                Filament::of(columns).add_slices(columns, supports, solid_mm, self);
            }
        }
    }
}

/// Heights of the examined slices and the distance between them, both in mm.
fn slices(columns: &Columns) -> (impl Iterator<Item = f64>, f64) {
    let n_slices = (columns.height_mm / columns.cell_mm)
        .ceil()
        .clamp(1.0, MOST_SLICES);
    let step_mm = columns.height_mm / n_slices;
    (
        (0..n_slices as usize).map(move |i| (i as f64 + 0.5) * step_mm),
        step_mm,
    )
}

/// A slice with a margin of one empty cell around it.
struct Slice {
    width: usize,
    /// Columns that are not empty, and their cells.
    cells: Vec<(usize, usize)>,
    /// True for each cell inside the piece.
    inside: Vec<bool>,
    islands: Islands,
}

impl Slice {
    fn of(columns: &Columns) -> Self {
        let [n_along, n_across] = columns.size;
        let width = n_along + 2;
        let cell = |column: usize| (column / n_along + 1) * width + column % n_along + 1;
        Self {
            width,
            cells: columns.shadow().map(|column| (column, cell(column))).collect(),
            inside: vec![false; width * (n_across + 2)],
            islands: Islands::default(),
        }
    }

    fn none(&self) -> Vec<bool> {
        vec![false; self.inside.len()]
    }

    fn neighbours(&self, cell: usize) -> [usize; 4] {
        [cell - 1, cell + 1, cell - self.width, cell + self.width]
    }

    /// Labels the connected regions outside the piece. Returns their number.
    fn find_lakes(&mut self) -> usize {
        let outside: Vec<bool> = self.inside.iter().map(|inside| !inside).collect();
        self.islands.find(&outside, self.width).len()
    }
}

/// State of the slice-by-slice analysis of a resin print.
struct Resin {
    slice: Slice,
    /// True for cells outside the piece that air reaches from below.
    is_vented: Vec<bool>,
}

impl Resin {
    fn of(columns: &Columns) -> Self {
        let slice = Slice::of(columns);
        let vented = vec![true; slice.inside.len()];
        Self {
            slice,
            is_vented: vented,
        }
    }

    fn add_slices(mut self, columns: &Columns, load: &mut Load) {
        let (heights, step_mm) = slices(columns);
        for z_mm in heights {
            let mut n_inside = 0;
            for &(column, cell) in &self.slice.cells {
                let is_inside = columns.spans(column).iter().any(|s| s.holds(z_mm));
                self.slice.inside[cell] = is_inside;
                n_inside += usize::from(is_inside);
            }
            load.widest_mm2 = load.widest_mm2.max(n_inside as f64 * columns.cell_mm2());
            load.cup_mm3 += self.vent() as f64 * columns.cell_mm2() * step_mm;
        }
    }

    /// Spreads air from the slice below and from the margin. Returns the number of outside cells that it does
    /// not reach.
    fn vent(&mut self) -> usize {
        let n_lakes = self.slice.find_lakes();
        let (inside, label) = (&self.slice.inside, &self.slice.islands.label);
        let mut is_open = vec![false; n_lakes];
        if let Some(rim) = label.first() {
            is_open[*rim as usize] = true;
        }
        for (cell, label) in label.iter().enumerate() {
            if !inside[cell] && self.is_vented[cell] {
                is_open[*label as usize] = true;
            }
        }
        let mut n_closed = 0;
        for (cell, label) in label.iter().enumerate() {
            self.is_vented[cell] = !inside[cell] && is_open[*label as usize];
            n_closed += usize::from(!inside[cell] && !self.is_vented[cell]);
        }
        n_closed
    }
}

/// State of the slice-by-slice analysis of a filament print.
struct Filament {
    slice: Slice,
    /// True for cells beyond the reach of solid layers at the surface above and below.
    deep: Vec<bool>,
    /// True for cells in a support as the slicer draws it, in this slice and in the one below.
    drawn: [Vec<bool>; 2],
}

impl Filament {
    fn of(columns: &Columns) -> Self {
        let slice = Slice::of(columns);
        let none = slice.none();
        Self {
            slice,
            deep: none.clone(),
            drawn: [none.clone(), none],
        }
    }

    fn add_slices(mut self, columns: &Columns, supports: &Supports, solid_mm: f64, load: &mut Load) {
        let (heights, step_mm) = slices(columns);
        for z_mm in heights {
            for &(column, cell) in &self.slice.cells {
                let span = columns.spans(column).iter().find(|s| s.holds(z_mm));
                self.slice.inside[cell] = span.is_some();
                self.deep[cell] =
                    span.is_some_and(|s| z_mm - s.bottom_mm > solid_mm && s.top_mm - z_mm > solid_mm);
            }
            self.draw(supports, z_mm);
            self.add(step_mm, columns.cell_mm, load);
        }
    }

    /// Draws the supports of a slice, but not into the piece.
    fn draw(&mut self, supports: &Supports, z_mm: f64) {
        self.drawn.swap(0, 1);
        let (width, inside) = (self.slice.width, &self.slice.inside);
        let margin = supports.margin_cells();
        let drawn = &mut self.drawn[0];
        drawn.fill(false);
        for &(column, cell) in &self.slice.cells {
            if supports
                .of_column(column)
                .iter()
                .any(|[lo, hi]| *lo <= z_mm && z_mm < *hi)
            {
                for row in (cell - margin * width..=cell + margin * width).step_by(width) {
                    (row - margin..=row + margin).for_each(|c| drawn[c] = !inside[c]);
                }
            }
        }
    }

    /// Adds the figures of this slice, which represents a layer of `step_mm`.
    fn add(&mut self, step_mm: f64, cell_mm: f64, load: &mut Load) {
        let (slice, cell_mm2) = (&mut self.slice, cell_mm * cell_mm);
        let width = slice.width;
        // Two perimeters are about a cell wide, so a cell with a neighbour outside has no infill. More of
        // them are up to two cells wide.
        let mut filled = slice.none();
        for &(_, cell) in &slice.cells {
            filled[cell] = slice.inside[cell] && slice.neighbours(cell).iter().all(|&n| slice.inside[n]);
        }
        let mut sparse = slice.none();
        for &(_, cell) in &slice.cells {
            let is_far = load.n_perimeters < 3 || slice.neighbours(cell).iter().all(|&n| filled[n]);
            sparse[cell] = filled[cell] && self.deep[cell] && is_far;
        }
        let enough = |n: &&usize| **n as f64 * cell_mm2 >= SOLID_BELOW_MM2;
        let n_sparse: usize = slice.islands.find(&sparse, width).iter().filter(enough).sum();
        load.sparse_mm3 += n_sparse as f64 * cell_mm2 * step_mm;
        let [drawn, below] = &self.drawn;
        let n_drawn = drawn.iter().filter(|s| **s).count();
        load.drawn.volume_mm3 += n_drawn as f64 * cell_mm2 * step_mm;
        let is_top = |(below, here): &(&bool, &bool)| **below && !**here;
        load.drawn.top_mm2 += below.iter().zip(drawn).filter(is_top).count() as f64 * cell_mm2;
        let along = drawn.windows(2).filter(|pair| pair[0] != pair[1]).count();
        let across = drawn.iter().zip(&drawn[width..]).filter(|(a, b)| a != b).count();
        load.drawn.side_mm2 += (along + across) as f64 * cell_mm * step_mm;
        load.small_side_mm2 += short_outlines(slice, cell_mm) as f64 * OUTLINE * cell_mm * step_mm;
    }
}

/// Number of cell edges along all short loops. Each loop separates an island of the piece from a region
/// outside.
fn short_outlines(slice: &mut Slice, cell_mm: f64) -> usize {
    let width = slice.width;
    slice.islands.find(&slice.inside, width);
    let of_island = std::mem::take(&mut slice.islands.label);
    slice.find_lakes();
    let mut edges: Vec<(u32, u32)> = Vec::new();
    for &(_, cell) in slice.cells.iter().filter(|(_, cell)| slice.inside[*cell]) {
        let outside = slice.neighbours(cell).into_iter().filter(|&n| !slice.inside[n]);
        edges.extend(outside.map(|n| (of_island[cell], slice.islands.label[n])));
    }
    edges.sort_unstable();
    let loops = edges.chunk_by(|a, b| a == b).map(<[_]>::len);
    let is_short = |n: &usize| *n as f64 * OUTLINE * cell_mm < SHORT_MM;
    loops.filter(is_short).sum()
}

/// Connected components of the set cells of a slice.
#[derive(Default)]
struct Islands {
    /// Index of the island of each set cell; `u32::MAX` for others.
    label: Vec<u32>,
    stack: Vec<usize>,
}

impl Islands {
    /// Finds all islands of `set`, whose rows have `width` cells. Returns the number of cells of each.
    fn find(&mut self, set: &[bool], width: usize) -> Vec<usize> {
        self.label.clear();
        self.label.resize(set.len(), u32::MAX);
        let mut sizes = Vec::new();
        for first in 0..set.len() {
            if !set[first] || self.label[first] != u32::MAX {
                continue;
            }
            let mut n = 0;
            self.label[first] = sizes.len() as u32;
            self.stack.push(first);
            while let Some(cell) = self.stack.pop() {
                n += 1;
                // Rows wrap around at their ends. The margin there is empty, so this connects the margin with
                // nothing but itself.
                for next in [
                    cell.wrapping_sub(1),
                    cell + 1,
                    cell.wrapping_sub(width),
                    cell + width,
                ] {
                    if next < set.len() && set[next] && self.label[next] == u32::MAX {
                        self.label[next] = sizes.len() as u32;
                        self.stack.push(next);
                    }
                }
            }
            sizes.push(n);
        }
        sizes
    }
}

#[cfg(test)]
mod tests {
    use shellock_geom::Volume;
    use shellock_testkit::shapes::cuboid;

    use super::*;
    use crate::supports::CONTACT_MM;
    use crate::time::Cost;

    const UPRIGHT: [Vec3; 3] = [Vec3::X, Vec3::Y, Vec3::Z];
    /// Axes of a piece that is turned upside down.
    const TURNED: [Vec3; 3] = [Vec3::X, Vec3::NEG_Y, Vec3::NEG_Z];

    fn load(volume: &Volume, axes: [Vec3; 3]) -> Load {
        Load::of(&volume.to_mesh(), axes, &Printer::fdm(), Slicing::USUAL)
    }

    fn of_resin(volume: &Volume, axes: [Vec3; 3]) -> Load {
        Load::of(&volume.to_mesh(), axes, &Printer::sla(), Slicing::USUAL)
    }

    /// A table top of 40 × 40 mm, 4 mm thick, 20 mm above the plate on a leg of 10 × 10 mm.
    fn table() -> Volume {
        cuboid([0.0, 0.0, 20.0], [40.0, 40.0, 24.0]).union(&cuboid([15.0, 15.0, 0.0], [25.0, 25.0, 21.0]))
    }

    /// A cup of 30 mm with walls and a floor of 3 mm.
    fn cup() -> Volume {
        cuboid([0.0; 3], [30.0; 3]).subtract(&cuboid([3.0; 3], [27.0, 27.0, 40.0]))
    }

    #[test]
    fn supports_of_a_table_are_its_clear_height_times_the_area_that_hangs() {
        let load = load(&table(), UPRIGHT);
        let expected = (40.0 * 40.0 - 10.0 * 10.0) * (20.0 - CONTACT_MM);
        assert!(
            (load.support_mm3 / expected - 1.0).abs() < 0.01,
            "{} {expected}",
            load.support_mm3
        );
        assert_eq!(of_resin(&table(), TURNED).support_mm3, 0.0);
    }

    #[test]
    fn supports_of_a_bridge_end_on_the_pieces_own_floor() {
        let under = cuboid([10.0, -1.0, 12.0], [50.0, 31.0, 22.0]);
        let bridge = cuboid([0.0; 3], [60.0, 30.0, 25.0]).subtract(&under);
        let expected = 40.0 * 30.0 * (10.0 - CONTACT_MM);
        let support_mm3 = load(&bridge, UPRIGHT).support_mm3;
        assert!(
            (support_mm3 / expected - 1.0).abs() < 0.02,
            "{support_mm3} {expected}"
        );
    }

    #[test]
    fn a_cup_catches_what_it_holds_and_a_bell_drains() {
        let inside = 24.0 * 24.0 * 27.0;
        let caught = of_resin(&cup(), UPRIGHT).cup_mm3;
        assert!((caught / inside - 1.0).abs() < 0.08, "{caught} {inside}");
        assert_eq!(of_resin(&cup(), TURNED).cup_mm3, 0.0);
        // A hole in its wall at the floor drains the cup, too.
        let drained = cup().subtract(&cuboid([-1.0, 12.0, 3.0], [4.0, 18.0, 9.0]));
        assert_eq!(of_resin(&drained, UPRIGHT).cup_mm3, 0.0);
    }

    #[test]
    fn a_block_is_filled_sparsely_but_for_its_perimeters_and_solid_layers_and_a_rod_is_not() {
        let block = load(&cuboid([0.0; 3], [40.0; 3]), UPRIGHT);
        let expected = 38.0 * 38.0 * (40.0 - 2.0 * SOLID_LAYERS * 0.2);
        assert!(
            (block.sparse_mm3 / expected - 1.0).abs() < 0.05,
            "{} {expected}",
            block.sparse_mm3
        );
        assert!((block.volume_mm3 - 64e3).abs() < 1e-6 && block.small_side_mm2 == 0.0);
        let rod = load(&cuboid([0.0; 3], [8.0, 8.0, 40.0]), UPRIGHT);
        assert_eq!(rod.sparse_mm3, 0.0, "too small an area");
        assert!(
            (rod.small_side_mm2 / (OUTLINE * 32.0 * 40.0) - 1.0).abs() < 0.02,
            "its loops are short"
        );
    }
    /// Name, shape, pose, and the slicer's seconds and cm³.
    type Sliced = (&'static str, fn() -> Volume, [Vec3; 3], f64, f64);

    /// Results of PrusaSlicer 2.5 with the profile of the usual pace.
    const SLICED: [Sliced; 2] = [
        (
            "cube of 40 mm",
            || cuboid([0.0; 3], [40.0; 3]),
            UPRIGHT,
            4283.0,
            17.06,
        ),
        ("cup", cup, UPRIGHT, 3210.0, 8.38),
    ];

    #[test]
    fn boxes_take_up_to_two_thirds_more_time_and_a_quarter_more_plastic_than_the_slicer_tells() {
        for (name, volume, axes, seconds, cm3) in SLICED {
            let ours = Cost::of(&Printer::fdm(), &load(&volume(), axes));
            let grams = cm3 * Printer::fdm().material.density_g_cm3;
            assert!(
                (-0.1..0.66).contains(&(ours.seconds / seconds - 1.0)),
                "{name}: {} s, {seconds} s",
                ours.seconds
            );
            assert!(
                (ours.grams / grams - 1.0).abs() < 0.25,
                "{name}: {} g, {grams} g",
                ours.grams
            );
        }
    }
}

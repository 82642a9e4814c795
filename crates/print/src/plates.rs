//! Pieces laid flat on the plates of a printer, as they are printed.
//!
//! Each piece is laid so that its outer skin needs the least support (`orient`), then plates are packed
//! (`pack`). Plates lie side by side, so that one file can hold all of them.

mod orient;
mod pack;

use rayon::prelude::*;
use shellock_geom::{Aabb, TriMesh, Vec3};

use crate::load::Load;
use crate::printer::Printer;
use orient::Pose;
use pack::{Spot, pack};

/// Free rim of a plate, mm: room for what slicers add at the foot of a print.
const EDGE_MM: f64 = 4.0;
/// Gap between pieces on a plate, mm.
const GAP_MM: f64 = 3.0;
/// From the left edge of a plate to that of the next, in widths.
const PITCH: f64 = 1.2;

/// A piece that is to be printed.
#[derive(Clone, Debug)]
pub struct Printable<'a> {
    /// Closed, mm.
    pub mesh: &'a TriMesh,
    /// One for each triangle: whether it is part of the skin that is seen later.
    pub is_outer: Vec<bool>,
}

/// How a piece lies on its plate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Laid {
    /// Position of the piece in the list.
    pub piece: usize,
    /// Plate, from 0.
    pub plate: usize,
    /// Where the x, y and z axes go.
    pub turned: [[f64; 3]; 3],
    /// Where it is moved after that, mm: with its lowest point on z = 0, in the frame of its plate, whose
    /// corner is the origin.
    pub moved_mm: [f64; 3],
    /// Width, depth and height as it lies, mm.
    pub size_mm: [f64; 3],
    /// Outer skin that needs support, mm².
    pub outer_support_mm2: f64,
    /// All surface that needs support, mm².
    pub support_mm2: f64,
    /// What it asks of the printer as it lies.
    pub load: Load,
}

impl Laid {
    /// Where a point of the piece in its assembled place is on the plate, mm.
    pub fn place(&self, p: Vec3) -> Vec3 {
        let [x, y, z] = self.turned.map(Vec3::from_array);
        p.x * x + p.y * y + p.z * z + Vec3::from_array(self.moved_mm)
    }

    /// [`Self::moved_mm`] where all plates of `printer` lie side by side along x.
    pub fn moved_among_plates_mm(&self, printer: &Printer) -> [f64; 3] {
        let [x, y, z] = self.moved_mm;
        [x + self.plate as f64 * PITCH * printer.bed_mm[0], y, z]
    }
}

/// All pieces on plates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plates {
    /// In order of pieces; what is too large is left out.
    pub laid: Vec<Laid>,
    /// How many plates there are.
    pub n_plates: usize,
    /// Positions of the pieces that the printer cannot make.
    pub too_large: Vec<usize>,
}

/// Lays all `pieces` flat and packs them on plates of `printer`; the same for the same input.
///
/// Some 0.3 to 1 s for a piece of 20 000 triangles: 150 poses are judged coarsely, 20 finely.
pub fn lay(printer: &Printer, pieces: &[Printable<'_>]) -> Plates {
    let poses: Vec<Option<Pose>> = pieces
        .par_iter()
        .map(|piece| orient::best(printer, piece, room_mm(printer)))
        .collect();
    let too_large = (0..pieces.len()).filter(|&i| poses[i].is_none()).collect();
    let fitting: Vec<(usize, Pose)> = poses
        .into_iter()
        .enumerate()
        .filter_map(|(i, p)| Some((i, p?)))
        .collect();
    // High ones first save height, large ones first save plates; the better of both is taken. Equal ones stay
    // in order.
    let by = |measure: fn(&Pose) -> f64| {
        let mut order: Vec<usize> = (0..fitting.len()).collect();
        order.sort_by(|&a, &b| measure(&fitting[b].1).total_cmp(&measure(&fitting[a].1)));
        improved(printer, &fitting, order)
    };
    let (high, large) = (by(|pose| pose.bounds.size().z), by(Pose::footprint_mm2));
    let fitting_spots = if high.cost(&fitting) < large.cost(&fitting) {
        high
    } else {
        large
    };
    let n_plates = fitting_spots.n_plates();
    let mut laid: Vec<Laid> = fitting_spots
        .0
        .iter()
        .map(|(at, spot)| placed(fitting[*at].0, &fitting[*at].1, spot))
        .collect();
    laid.sort_by_key(|l| l.piece);
    Plates {
        laid,
        n_plates,
        too_large,
    }
}

/// Positions in a list of poses, each with its spot.
struct Packing(Vec<(usize, Spot)>);

impl Packing {
    fn n_plates(&self) -> usize {
        self.0.iter().map(|(_, spot)| spot.plate + 1).max().unwrap_or(0)
    }

    /// Plates, and the heights of all of them in one, mm: what takes long on printers that care.
    fn cost(&self, poses: &[(usize, Pose)]) -> f64 {
        /// Changing a plate is worth this height.
        const PLATE_MM: f64 = 15.0;
        let mut heights = vec![PLATE_MM; self.n_plates()];
        for (at, spot) in &self.0 {
            heights[spot.plate] = heights[spot.plate].max(PLATE_MM + poses[*at].1.bounds.size().z);
        }
        heights.iter().fold(0.0, |sum, mm| sum + mm)
    }
}

/// The packing of the best order that swaps of two pieces lead to.
fn improved(printer: &Printer, poses: &[(usize, Pose)], mut order: Vec<usize>) -> Packing {
    /// Orders that are tried: all swaps of 15 pieces twenty times, 0.1 s.
    const MOST_TRIES: usize = 2000;
    let mut best = packed(printer, poses, &order);
    let mut cost = best.cost(poses);
    let (mut n_tries, mut is_better) = (0, true);
    while is_better {
        is_better = false;
        for (i, j) in (0..order.len()).flat_map(|i| (0..i).map(move |j| (i, j))) {
            order.swap(i, j);
            let other = packed(printer, poses, &order);
            let other_cost = other.cost(poses);
            if other_cost < cost {
                (best, cost, is_better) = (other, other_cost, true);
            } else {
                order.swap(i, j);
            }
            n_tries += 1;
            if n_tries == MOST_TRIES {
                return best;
            }
        }
    }
    best
}

fn packed(printer: &Printer, poses: &[(usize, Pose)], order: &[usize]) -> Packing {
    let sides: Vec<[f64; 2]> = order
        .iter()
        .map(|&at| [0, 1].map(|k| poses[at].1.bounds.size()[k] + GAP_MM))
        .collect();
    let [width, depth, _] = room_mm(printer);
    Packing(
        order
            .iter()
            .copied()
            .zip(pack([width + GAP_MM, depth + GAP_MM], &sides))
            .collect(),
    )
}

/// Whether a piece of this shape could be made by `printer` in some pose.
pub fn fits(printer: &Printer, mesh: &TriMesh) -> bool {
    let piece = Printable {
        mesh,
        is_outer: vec![false; mesh.triangles.len()],
    };
    orient::fits(&piece, room_mm(printer))
}

/// Whether everything that fits into a box fits the printer, however it is cut.
pub fn fits_whole(printer: &Printer, bounds: Aabb) -> bool {
    let sorted = |mut sides: [f64; 3]| {
        sides.sort_by(f64::total_cmp);
        sides
    };
    let (box_mm, room) = (sorted(bounds.size().to_array()), sorted(room_mm(printer)));
    box_mm.iter().zip(room).all(|(side, room)| *side <= room)
}

/// The pose of a solid that needs the least support, on a plate as large as it takes.
pub fn lay_alone(printer: &Printer, mesh: &TriMesh) -> Option<Laid> {
    let piece = Printable {
        mesh,
        is_outer: vec![true; mesh.triangles.len()],
    };
    let pose = orient::best(printer, &piece, [f64::INFINITY; 3])?;
    Some(placed(
        0,
        &pose,
        &Spot {
            plate: 0,
            corner_mm: [0.0; 2],
            is_turned: false,
        },
    ))
}

/// Width, depth and height that pieces may take, mm.
fn room_mm(printer: &Printer) -> [f64; 3] {
    let [width, depth, height] = printer.bed_mm;
    [width - 2.0 * EDGE_MM, depth - 2.0 * EDGE_MM, height]
}

fn placed(piece: usize, pose: &Pose, spot: &Spot) -> Laid {
    let pose = if spot.is_turned {
        pose.quarter_turned()
    } else {
        pose.clone()
    };
    let corner = Vec3::new(spot.corner_mm[0] + EDGE_MM, spot.corner_mm[1] + EDGE_MM, 0.0);
    // Where the axes go: the columns of the rotation.
    let turned = [0, 1, 2].map(|axis| pose.axes.map(|row| row[axis]));
    Laid {
        piece,
        plate: spot.plate,
        turned,
        moved_mm: (corner - pose.bounds.min).to_array(),
        size_mm: pose.bounds.size().to_array(),
        outer_support_mm2: pose.support.outer_mm2,
        support_mm2: pose.support.all_mm2,
        load: pose.load,
    }
}

#[cfg(test)]
mod tests;

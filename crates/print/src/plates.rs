//! Layout of pieces on the build plates of a printer.
//!
//! Each piece is oriented so that its outer skin needs the least support (`orient`), then the plates are
//! packed (`pack`). Plates lie side by side, so that one file can hold all of them.

mod foothold;
mod orient;
mod pack;

use rayon::prelude::*;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::decimate::decimate;
use shellock_geom::{Aabb, TriMesh, Vec3};

use crate::load::Load;
use crate::printer::{Printer, Process};
use crate::slicing::Slicing;
use orient::Pose;
use pack::{Spot, pack};

/// Free margin of a plate, mm: room for what slicers add at the foot of a print.
const EDGE_MM: f64 = 4.0;
/// Gap between pieces on a plate, mm: between prints of filament, whose rafts and supports reach 4 mm beyond
/// the pieces, and between others.
const GAPS_MM: [f64; 2] = [8.0, 3.0];
/// Tolerance of the mesh on which poses of a solid are compared, mm. It has a fifth of the triangles.
const SIMPLE_MM: f64 = 0.15;
/// Distance between the left edges of neighbouring plates, in plate widths.
const PITCH: f64 = 1.2;

/// A piece to be printed.
#[derive(Clone, Copy)]
pub struct Printable<'a> {
    /// Closed mesh of the piece, mm.
    pub mesh: &'a TriMesh,
    /// Closed mesh of the piece with fewer triangles, within 0.2 mm of `mesh`. Poses are compared on it; the
    /// figures of the best one are those of `mesh`.
    pub simple: &'a TriMesh,
    /// Skin that is visible on the assembled model.
    pub skin: Skin<'a>,
}

/// Part of a piece's surface that is visible on the assembled model.
#[derive(Clone, Copy)]
pub enum Skin<'a> {
    /// No part of the surface.
    None,
    /// All of the surface.
    All,
    /// Faces that lie on the surface of the model.
    On(&'a TriangleBvh),
}

impl Skin<'_> {
    /// Distance from the model's surface within which a face's centre belongs to the skin, mm.
    const NEAR_MM: f64 = 0.05;

    /// Returns true if the face with this centre belongs to the skin of a mesh that deviates from the piece
    /// by at most `deviation_mm`.
    fn holds(&self, center: Vec3, deviation_mm: f64) -> bool {
        let near_mm = Self::NEAR_MM + deviation_mm;
        match self {
            Self::None => false,
            Self::All => true,
            Self::On(surface) => surface.nearest(center, near_mm * near_mm).is_some(),
        }
    }
}

/// Pose of a piece on its plate, with its printing load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Laid {
    /// Index of the piece in the input list.
    pub piece: usize,
    /// Index of the plate, from 0.
    pub plate: usize,
    /// Images of the x, y and z axes: the columns of the rotation.
    pub axes: [[f64; 3]; 3],
    /// Translation after the rotation, mm. The lowest point comes to z = 0, and the origin is the corner of
    /// the plate.
    pub moved_mm: [f64; 3],
    /// Width, depth and height in this pose, mm.
    pub size_mm: [f64; 3],
    /// Area of outer skin that needs support, mm².
    pub outer_support_mm2: f64,
    /// Area of all surface that needs support, mm².
    pub support_mm2: f64,
    /// Area of the first layer of a filament print, mm²; `None` for other processes.
    pub foothold_mm2: Option<f64>,
    /// True if a filament print needs a raft: its first layer is too small, or not below its centre of mass.
    pub needs_raft: bool,
    /// Printing load in this pose.
    pub load: Load,
}

impl Laid {
    /// Maps a point of the assembled piece to its position on the plate, mm.
    pub fn place(&self, p: Vec3) -> Vec3 {
        let [x, y, z] = self.axes.map(Vec3::from_array);
        p.x * x + p.y * y + p.z * z + Vec3::from_array(self.moved_mm)
    }

    /// Returns [`Self::moved_mm`] for a layout with all plates of `printer` side by side along x.
    pub fn moved_among_plates_mm(&self, printer: &Printer) -> [f64; 3] {
        let [x, y, z] = self.moved_mm;
        [x + self.plate as f64 * PITCH * printer.bed_mm[0], y, z]
    }
}

/// Pieces laid out on plates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plates {
    /// Poses in order of pieces, without those that are too large.
    pub poses: Vec<Laid>,
    /// Number of plates in use.
    pub n_plates: usize,
    /// Indices of the pieces that are too large for the printer.
    pub too_large: Vec<usize>,
}

/// Orients all `pieces`, which are sliced alike, and packs them on plates of `printer`. Deterministic: equal
/// input gives equal plates.
///
/// Takes 0.1 to 0.3 s for a piece of 20 000 triangles: up to 150 poses are judged coarsely, 10 finely.
pub fn lay(printer: &Printer, slicing: Slicing, pieces: &[Printable<'_>]) -> Plates {
    let poses: Vec<Option<Pose>> = pieces
        .par_iter()
        .map(|piece| orient::best(printer, slicing, piece, room_mm(printer)))
        .collect();
    let too_large = (0..pieces.len()).filter(|&i| poses[i].is_none()).collect();
    let fitting: Vec<(usize, Pose)> = poses
        .into_iter()
        .enumerate()
        .filter_map(|(i, p)| Some((i, p?)))
        .collect();
    let fitting_spots = best_packing(printer, &fitting);
    let n_plates = fitting_spots.n_plates();
    let mut poses: Vec<Laid> = fitting_spots
        .0
        .iter()
        .map(|(at, spot)| place(fitting[*at].0, &fitting[*at].1, spot))
        .collect();
    poses.sort_by_key(|l| l.piece);
    Plates {
        poses,
        n_plates,
        too_large,
    }
}

/// Indices into a list of poses, each with its spot on a plate.
struct Packing(Vec<(usize, Spot)>);

impl Packing {
    fn n_plates(&self) -> usize {
        self.0.iter().map(|(_, spot)| spot.plate + 1).max().unwrap_or(0)
    }

    /// Cost of a packing, mm: the sum of the plates' heights, which takes long on some printers, plus a price
    /// per plate.
    fn cost(&self, poses: &[(usize, Pose)]) -> f64 {
        /// Price of changing a plate, as a height.
        const PLATE_MM: f64 = 15.0;
        let mut heights = vec![PLATE_MM; self.n_plates()];
        for (at, spot) in &self.0 {
            heights[spot.plate] = heights[spot.plate].max(PLATE_MM + poses[*at].1.bounds.size().z);
        }
        heights.iter().fold(0.0, |sum, mm| sum + mm)
    }
}

/// Finds a packing of low cost: packs by all `orders`, and improves the best few.
fn best_packing(printer: &Printer, poses: &[(usize, Pose)]) -> Packing {
    /// Number of orders improved.
    const N_IMPROVED: usize = 3;
    let mut tries: Vec<(f64, Vec<usize>)> = orders(poses)
        .into_iter()
        .map(|order| (pack_in_order(printer, poses, &order).cost(poses), order))
        .collect();
    // The sort is stable, so ties stay in order.
    tries.sort_by(|a, b| a.0.total_cmp(&b.0));
    tries
        .into_iter()
        .take(N_IMPROVED)
        .map(|(_, order)| improve(printer, poses, order))
        .min_by(|a, b| a.cost(poses).total_cmp(&b.cost(poses)))
        .unwrap_or(Packing(Vec::new()))
}

/// Lists orders that may pack well. A plate takes as long as its highest piece, so a number of the highest
/// pieces goes first, to share plates. Large pieces are the hardest to place, so within each part the
/// pieces go by footprint.
fn orders(poses: &[(usize, Pose)]) -> Vec<Vec<usize>> {
    let largest_first = |order: &mut [usize], measure: fn(&Pose) -> f64| {
        order.sort_by(|&a, &b| measure(&poses[b].1).total_cmp(&measure(&poses[a].1)));
    };
    let mut by_height: Vec<usize> = (0..poses.len()).collect();
    largest_first(&mut by_height, |pose| pose.bounds.size().z);
    let by_parts = (0..poses.len()).map(|n_high| {
        let mut order = by_height.clone();
        let (high, low) = order.split_at_mut(n_high);
        largest_first(high, Pose::footprint_mm2);
        largest_first(low, Pose::footprint_mm2);
        order
    });
    let mut orders: Vec<Vec<usize>> = by_parts.collect();
    orders.push(by_height);
    orders
}

/// Improves an order by swaps of two pieces. Returns the packing of the best order found.
fn improve(printer: &Printer, poses: &[(usize, Pose)], mut order: Vec<usize>) -> Packing {
    /// Largest number of orders tried: all swaps of 15 pieces twenty times, 0.1 s.
    const MOST_TRIES: usize = 2000;
    let mut best = pack_in_order(printer, poses, &order);
    let mut cost = best.cost(poses);
    let (mut n_tries, mut is_better) = (0, true);
    while is_better {
        is_better = false;
        for (i, j) in (0..order.len()).flat_map(|i| (0..i).map(move |j| (i, j))) {
            order.swap(i, j);
            let other = pack_in_order(printer, poses, &order);
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

fn pack_in_order(printer: &Printer, poses: &[(usize, Pose)], order: &[usize]) -> Packing {
    let gap_mm = gap_mm(printer);
    let sides: Vec<[f64; 2]> = order
        .iter()
        .map(|&at| [0, 1].map(|k| poses[at].1.bounds.size()[k] + gap_mm))
        .collect();
    let [width, depth, _] = room_mm(printer);
    Packing(
        order
            .iter()
            .copied()
            .zip(pack([width + gap_mm, depth + gap_mm], &sides))
            .collect(),
    )
}

/// Returns true if `printer` has room for a piece of this shape in some pose.
pub fn fits(printer: &Printer, mesh: &TriMesh) -> bool {
    let piece = Printable {
        mesh,
        simple: mesh,
        skin: Skin::None,
    };
    orient::fits(&piece, room_mm(printer))
}

/// Returns true if everything in a box fits `printer`, however the box is divided. The box may be turned by
/// quarters.
pub fn fits_whole(printer: &Printer, bounds: Aabb) -> bool {
    let sorted = |mut sides: [f64; 3]| {
        sides.sort_by(f64::total_cmp);
        sides
    };
    let (box_mm, room) = (sorted(bounds.size().to_array()), sorted(room_mm(printer)));
    box_mm.iter().zip(room).all(|(side, room)| *side <= room)
}

/// Returns the pose of a whole model that needs the least support, on a plate of unlimited size, with
/// supports as the slicer's profile draws them. `None` for a mesh without a convex hull, such as a flat one.
pub fn lay_alone(printer: &Printer, mesh: &TriMesh) -> Option<Laid> {
    let simple = decimate(mesh.clone(), &vec![SIMPLE_MM; mesh.points.len()]);
    let piece = Printable {
        mesh,
        simple: &simple,
        skin: Skin::All,
    };
    let pose = orient::best(printer, Slicing::USUAL, &piece, [f64::INFINITY; 3])?;
    Some(place(
        0,
        &pose,
        &Spot {
            plate: 0,
            corner_mm: [0.0; 2],
            is_turned: false,
        },
    ))
}

fn gap_mm(printer: &Printer) -> f64 {
    let [of_filament, of_others] = GAPS_MM;
    match printer.process {
        Process::Fdm => of_filament,
        Process::Sla | Process::Sls => of_others,
    }
}

/// Width, depth and height available for pieces, mm.
fn room_mm(printer: &Printer) -> [f64; 3] {
    let [width, depth, height] = printer.bed_mm;
    [width - 2.0 * EDGE_MM, depth - 2.0 * EDGE_MM, height]
}

fn place(piece: usize, pose: &Pose, spot: &Spot) -> Laid {
    let pose = if spot.is_turned {
        pose.quarter_turn()
    } else {
        pose.clone()
    };
    let corner = Vec3::new(spot.corner_mm[0] + EDGE_MM, spot.corner_mm[1] + EDGE_MM, 0.0);
    // Images of the axes: the columns of the rotation.
    let axes = [0, 1, 2].map(|axis| pose.axes.map(|row| row[axis]));
    Laid {
        piece,
        plate: spot.plate,
        axes,
        moved_mm: (corner - pose.bounds.min).to_array(),
        size_mm: pose.bounds.size().to_array(),
        outer_support_mm2: pose.support.outer_mm2,
        support_mm2: pose.support.all_mm2,
        foothold_mm2: pose.foothold.map(|foothold| foothold.area_mm2),
        needs_raft: pose.foothold.is_some_and(|foothold| !foothold.is_enough()),
        load: pose.load,
    }
}

#[cfg(test)]
mod tests;

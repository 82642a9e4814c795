//! Repair of surfaces without guessing: from a mesh as read to one solid body, with a report of every change.
//!
//! A defect is repaired if there is one right answer: duplicate points and triangles, triangles that face the
//! wrong way, cracks and corners on neighbours' edges within 10⁻⁵ of the size, holes of three edges or
//! smaller than a hundredth of the size, points where the surface pinches itself, specks, walls inside a
//! body, closed surfaces within others, parts that overlap, a surface that crosses itself, and triangles that
//! lie upside down on their neighbours. A defect that needs a decision about the shape is rejected with its
//! place: larger holes, one-sided surfaces, and several separate bodies. Bodies that are inside out and
//! overlap another are rejected, too, unless the owner says how to treat them.
//!
//! Each stage is a function from a draft to a draft, and a [`Repair`] if it changed something. A mesh that is
//! a solid as read and neither crosses itself nor folds gives exactly the result of
//! [`crate::check::into_solid`], bit by bit.

mod crossing;
mod cut;
mod cutters;
mod faces;
mod fans;
mod holes;
mod junctions;
mod near;
mod report;
mod shells;
mod unfold;
mod walls;

pub(crate) use crossing::crossing_faces;
pub use crossing::{Crossings, crossings};
pub use cut::{Carving, CutError, CutFace, cut_out};
pub use cutters::InsideOut;
pub(crate) use holes::cap_all;
pub use report::{Repair, RepairKind};

use rayon::prelude::*;

use crate::bvh::TriangleBvh;
use crate::check::{InputError, check_points, inspect, inspect_edges, into_solid, refuse};
use crate::weld::close;
use crate::{Solid, TriMesh};

/// Distance, as a share of the model's diagonal, below which points with an open surface between them are
/// merged. 2 µm on a model of 200 mm: a hundredth of what printers resolve, and ten times the steps of 32-bit
/// coordinates.
const NEAR_SHARE: f64 = 1e-5;
/// Size of holes that are closed, as a share of the model's diagonal: 2 mm on a model of 200 mm, less than a
/// wall.
const HOLE_SHARE: f64 = 0.01;
/// Size below which bodies are specks and no parts of the model, as a share of the diagonal.
const SPECK_SHARE: f64 = 0.01;

/// Changes that are allowed to a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RepairMode {
    /// None: a mesh that needs repair is rejected.
    Refuse,
    /// Repairs that have one right answer.
    Repair,
    /// Repairs as for `Repair`; of several separate bodies only the largest is kept.
    KeepLargest,
}

/// A valid body, and the changes that were made.
#[derive(Clone, Debug, PartialEq)]
pub struct Repaired {
    /// Solid body that the mesh became.
    pub solid: Solid,
    /// Triangle of the mesh as read that each triangle is, or is nearest to.
    pub source_face: Vec<u32>,
    /// Changes in the order in which they were made; empty if the mesh was sound.
    pub repairs: Vec<Repair>,
}

/// A mesh between stages.
#[derive(Clone, Debug, PartialEq)]
struct Draft {
    mesh: TriMesh,
    /// Source triangle, as read, of each triangle.
    source: Vec<u32>,
}

/// Makes one body of a mesh as read.
///
/// A mesh that cannot be repaired without guessing is rejected, with an error about its state after all
/// possible repairs. O(n log n), except for overlaps, whose cost grows with the number of crossing pairs of
/// triangles.
pub fn repair(mesh: &TriMesh, mode: RepairMode) -> Result<Repaired, InputError> {
    repair_as(mesh, mode, InsideOut::Ask)
}

/// Repairs like [`repair`], given the owner's decision about bodies that are inside out.
pub fn repair_as(mesh: &TriMesh, mode: RepairMode, inside_out: InsideOut) -> Result<Repaired, InputError> {
    check_points(mesh)?;
    let as_read = into_solid(mesh);
    let n_faces = mesh.triangles.len();
    if let Ok((solid, source_face)) = as_read {
        let crossings = crossings(solid.mesh());
        if crossings.count == 0 {
            return Ok(without_folds(solid, source_face, mode));
        }
        if mode == RepairMode::Refuse {
            return Err(InputError::Crossing {
                count: crossings.count,
                at: crossings.first,
            });
        }
        let draft = Draft {
            mesh: solid.into_mesh(),
            source: source_face,
        };
        return finish(draft, Vec::new(), mode, inside_out);
    }
    if mode == RepairMode::Refuse {
        as_read?;
    }
    let (draft, repairs, n_collapsed) = close_up(mesh)?;
    let repaired = check_edges(&draft).and_then(|()| finish(draft, repairs, mode, inside_out));
    // A few collapsed triangles are usual and harmless; one in a hundred on a broken surface is the cause.
    match repaired {
        Err(error) if !matches!(error, InputError::Cutter { .. }) && 100 * n_collapsed > n_faces => {
            Err(InputError::Collapsed {
                count: n_collapsed,
                n_faces,
            })
        }
        repaired => repaired,
    }
}

/// Removes the folds of a solid that does not cross itself. A fold is no reason to refuse one.
fn without_folds(solid: Solid, source: Vec<u32>, mode: RepairMode) -> Repaired {
    let mut draft = Draft {
        mesh: solid.into_mesh(),
        source,
    };
    let repairs = match mode {
        RepairMode::Refuse => None,
        RepairMode::Repair | RepairMode::KeepLargest => unfold::turn_folds(&mut draft),
    };
    Repaired {
        solid: Solid::new(draft.mesh).expect("flips and collapses leave the surface closed"),
        source_face: draft.source,
        repairs: repairs.into_iter().collect(),
    }
}

/// Closes a surface as far as that needs no decision. Returns the draft, the changes, and the number of
/// collapsed triangles.
fn close_up(mesh: &TriMesh) -> Result<(Draft, Vec<Repair>, usize), InputError> {
    let welded = close(mesh);
    let mut draft = Draft {
        mesh: welded.mesh,
        source: welded.kept_face,
    };
    if draft.mesh.triangles.is_empty() {
        return Err(InputError::Empty);
    }
    let mut repairs = Vec::new();
    // Cracks come first, since they hide everything else. Holes come after sheets and cracks, which must not
    // be closed like holes. Partitions come last, since they divide a closed surface.
    for stage in [
        near::merge,
        faces::drop_copies,
        junctions::join,
        faces::turn,
        walls::drop_sheets,
        holes::close,
        walls::drop_partitions,
    ] {
        repairs.extend(stage(&mut draft));
    }
    Ok((draft, repairs, welded.n_collapsed))
}

/// A closed surface of any number of bodies, made of a mesh as read and repaired as by [`repair`]; and
/// whether it had holes, which were closed.
pub(crate) fn close_surface(mesh: &TriMesh) -> Result<(TriMesh, bool), InputError> {
    check_points(mesh)?;
    let (mut draft, repairs, _) = close_up(mesh)?;
    let had_holes = repairs
        .iter()
        .any(|repair| matches!(repair.kind, RepairKind::Closed { .. }));
    check_edges(&draft)?;
    resolve(&mut draft, InsideOut::Ask)?;
    if draft.mesh.triangles.is_empty() {
        return Err(InputError::Empty);
    }
    Ok((draft.mesh, had_holes))
}

/// Rejects a draft that is still open or one-sided. Edges with more than two triangles may still bound a
/// volume.
fn check_edges(draft: &Draft) -> Result<(), InputError> {
    let found = inspect(&draft.mesh);
    let turned = found.edges.flips;
    if turned.count > 0 {
        return Err(InputError::OneSided {
            count: turned.count,
            at: turned.first,
        });
    }
    if found.edges.open.count > 0 {
        refuse(&found, draft.mesh.triangles.len(), 0)
    } else {
        Ok(())
    }
}

/// Makes one body of a closed surface.
fn finish(
    mut draft: Draft,
    mut repairs: Vec<Repair>,
    mode: RepairMode,
    inside_out: InsideOut,
) -> Result<Repaired, InputError> {
    repairs.extend(resolve(&mut draft, inside_out)?);
    repairs.extend(shells::drop_specks(&mut draft));
    repairs.extend(shells::fill_cavities(&mut draft));
    if mode == RepairMode::KeepLargest {
        repairs.extend(shells::keep_largest(&mut draft));
    }
    repairs.extend(unfold::turn_folds(&mut draft));
    let (solid, kept) = into_solid(&draft.mesh)?;
    let source_face = kept.iter().map(|&face| draft.source[face as usize]).collect();
    Ok(Repaired {
        solid,
        source_face,
        repairs,
    })
}

/// Makes a closed surface bound a volume: facing outwards, not crossing itself, and not pinched.
fn resolve(draft: &mut Draft, inside_out: InsideOut) -> Result<Vec<Repair>, InputError> {
    let mut repairs = Vec::new();
    repairs.extend(shells::drop_specks(draft));
    repairs.extend(cutters::settle(draft, inside_out)?);
    repairs.extend(shells::turn_outwards(draft));
    repairs.extend(crossing::resolve(draft)?);
    repairs.extend(fans::part(draft));
    Ok(repairs)
}

impl Draft {
    /// Keeps the marked triangles and the points that they use.
    fn retain(&mut self, is_kept: &[bool]) {
        let mut kept = is_kept.iter();
        self.source.retain(|_| kept.next() == Some(&true));
        let mut kept = is_kept.iter();
        self.mesh.triangles.retain(|_| kept.next() == Some(&true));
        self.mesh = std::mem::take(&mut self.mesh).without_unused_points();
    }

    /// Replaces the mesh by `mesh`, which is made of it. Each new triangle takes the source of the nearest
    /// old one.
    fn replace(&mut self, mesh: TriMesh) {
        let tree = TriangleBvh::new(&self.mesh);
        let nearest = |face: usize| {
            tree.nearest(mesh.face_center(face), f64::INFINITY)
                .map_or(0, |n| n.face)
        };
        self.source = (0..mesh.triangles.len())
            .into_par_iter()
            .map(|face| self.source[nearest(face) as usize])
            .collect();
        self.mesh = mesh;
    }

    fn n_open(&self) -> usize {
        inspect_edges(&self.mesh).open.count
    }
}

#[cfg(test)]
mod tests;

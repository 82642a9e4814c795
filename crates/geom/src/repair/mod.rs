//! Repair of surfaces without guessing: from a mesh as read to one solid body, with a word on every change.
//!
//! Repaired is what has one right answer: points and triangles that stand there twice, triangles turned the
//! wrong way, cracks and corners on neighbours' edges within 10⁻⁵ of the size, holes of three edges or
//! smaller than a hundredth of the size, points where the surface pinches itself, specks, walls inside a body,
//! closed surfaces within others, parts that overlap, a surface that crosses itself. What would need a decision
//! about the shape is refused with its place: larger holes, one-sided surfaces, several bodies apart from each
//! other, and bodies that are inside out and overlap another, unless the owner says which of the two is meant.
//!
//! Each stage is a function from a draft to a draft and a [`Repair`] if it changed something. A mesh that is
//! a solid as read, and does not cross itself, comes out as [`crate::check::into_solid`] makes it, bit by
//! bit.

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
mod walls;

pub(crate) use crossing::crossing_faces;
pub use crossing::{Crossings, crossings};
pub use cut::{Cut, CutError, CutFace, cut_out};
pub use cutters::InsideOut;
pub(crate) use holes::cap_all;
pub use report::{Repair, RepairKind};

use rayon::prelude::*;

use crate::bvh::TriangleBvh;
use crate::check::{InputError, check_points, inspect, inspect_edges, into_solid, refuse};
use crate::weld::close;
use crate::{Solid, TriMesh};

/// Points nearer than this share of the model's diagonal are the same, where the surface is open between
/// them: 2 µm on a model of 200 mm, a hundredth of what printers resolve, and ten times the steps of 32-bit
/// coordinates.
const NEAR_SHARE: f64 = 1e-5;
/// Holes smaller than this share of the model's diagonal are closed: 2 mm on a model of 200 mm, less than a
/// wall.
const HOLE_SHARE: f64 = 0.01;
/// Bodies smaller than this share of the diagonal are specks, no parts of the model.
const SPECK_SHARE: f64 = 0.01;

/// What may be done to a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RepairMode {
    /// Nothing: what needs repair is refused.
    Refuse,
    /// What has one right answer.
    Repair,
    /// The same, and of several bodies apart from each other all but the largest are left out.
    KeepLargest,
}

/// A body that can be made, and what was done to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Repaired {
    /// The body.
    pub solid: Solid,
    /// For each triangle the one of the mesh as read that it is or lies nearest to.
    pub source_face: Vec<u32>,
    /// What was changed, in the order in which it was done; nothing where the mesh was sound.
    pub repairs: Vec<Repair>,
}

/// A mesh between stages.
#[derive(Clone, Debug, PartialEq)]
struct Draft {
    mesh: TriMesh,
    /// For each triangle the one as read.
    source: Vec<u32>,
}

/// Makes one body of a mesh as read.
///
/// Refuses what cannot be repaired without guessing, by its state after what could be. O(n log n) but for
/// overlaps, whose cost follows the pairs of triangles that cross.
pub fn repair(mesh: &TriMesh, mode: RepairMode) -> Result<Repaired, InputError> {
    repair_as(mesh, mode, InsideOut::Ask)
}

/// [`repair`], where the owner of the mesh has said what bodies that are inside out are there for.
pub fn repair_as(mesh: &TriMesh, mode: RepairMode, inside_out: InsideOut) -> Result<Repaired, InputError> {
    check_points(mesh)?;
    let as_read = into_solid(mesh);
    let n_faces = mesh.triangles.len();
    if let Ok((solid, source_face)) = as_read {
        let crossings = crossings(solid.mesh());
        if crossings.count == 0 {
            return Ok(Repaired {
                solid,
                source_face,
                repairs: Vec::new(),
            });
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

/// Closes a surface as far as that needs no decision: the draft, what was changed, and how many triangles
/// collapsed.
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
    // Cracks first, since they hide all else; holes after sheets and cracks, which they should not close; cells last,
    // since they are those of a closed surface.
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

/// A closed surface of any number of bodies, made of a mesh as read and repaired as by [`repair`]; and whether it had
/// holes, which were closed.
pub(crate) fn closed(mesh: &TriMesh) -> Result<(TriMesh, bool), InputError> {
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

/// Refuses what is open or one-sided after all. Edges with more than two triangles may still bound a volume.
fn check_edges(draft: &Draft) -> Result<(), InputError> {
    let found = inspect(&draft.mesh);
    let turned = found.edges.turned;
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

/// From a closed surface to one body.
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
    let (solid, kept) = into_solid(&draft.mesh)?;
    let source_face = kept.iter().map(|&face| draft.source[face as usize]).collect();
    Ok(Repaired {
        solid,
        source_face,
        repairs,
    })
}

/// Makes a closed surface bound a volume: it faces outwards, crosses itself nowhere and is not pinched.
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
    /// The triangles for which `keep` holds, and the points they use.
    fn retain(&mut self, is_kept: &[bool]) {
        let mut kept = is_kept.iter();
        self.source.retain(|_| kept.next() == Some(&true));
        let mut kept = is_kept.iter();
        self.mesh.triangles.retain(|_| kept.next() == Some(&true));
        self.mesh = std::mem::take(&mut self.mesh).without_unused_points();
    }

    /// Takes `mesh` for this one, whose triangles it is made of: each is a part of the nearest.
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

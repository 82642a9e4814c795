//! Several closed surfaces: telling apart the model, specks, inner surfaces and bodies that are inside out.

use super::{Draft, Repair, RepairKind, SPECK_SHARE};
use crate::check::components;
use crate::{Aabb, TriMesh, Vec3};

/// Largest number of solid angles summed to decide what lies inside what: a second's work. Beyond that,
/// nothing is turned or left out.
const MAX_WORK: usize = 20_000_000;

/// Leaves out bodies that are much smaller than the largest.
pub(super) fn drop_specks(draft: &mut Draft) -> Option<Repair> {
    let shells = Shells::of(&draft.mesh);
    let size = |shell: &Shell| shell.bounds.diagonal();
    let largest = shells.all.iter().map(size).fold(0.0, f64::max);
    let is_speck: Vec<bool> = shells
        .all
        .iter()
        .map(|s| size(s) < SPECK_SHARE * largest)
        .collect();
    let longest = shells
        .all
        .iter()
        .map(size)
        .filter(|&d| d < SPECK_SHARE * largest)
        .fold(0.0, f64::max);
    shells.leave_out(draft, &is_speck, RepairKind::Specks { longest })
}

/// Turns bodies that are inside out, together with everything inside them.
pub(super) fn turn_outwards(draft: &mut Draft) -> Option<Repair> {
    let shells = Shells::of(&draft.mesh);
    let within = shells.containers(&draft.mesh)?;
    let is_everted = |s: usize| within[s].is_empty() && shells.all[s].volume < 0.0;
    let is_turned: Vec<bool> = (0..shells.all.len())
        .map(|s| is_everted(s) || within[s].iter().any(|&outer| is_everted(outer)))
        .collect();
    let first = is_turned.iter().position(|turned| *turned)?;
    for (triangle, &shell) in draft.mesh.triangles.iter_mut().zip(&shells.of_face) {
        if is_turned[shell as usize] {
            triangle.swap(1, 2);
        }
    }
    let count = is_turned.iter().filter(|turned| **turned).count();
    Some(Repair {
        kind: RepairKind::Everted,
        count,
        at: shells.all[first].bounds.center(),
    })
}

/// Leaves out closed surfaces that lie within others, whichever way they face. No surfaces may cross.
///
/// A cavity is invisible from outside, and pieces are hollow anyway. A body within a body adds nothing.
pub(super) fn fill_cavities(draft: &mut Draft) -> Option<Repair> {
    let shells = Shells::of(&draft.mesh);
    let is_inner: Vec<bool> = shells
        .containers(&draft.mesh)?
        .iter()
        .map(|within| !within.is_empty())
        .collect();
    let inner = shells.all.iter().zip(&is_inner).filter(|(_, inner)| **inner);
    let volume = inner.map(|(shell, _)| shell.volume.abs()).sum();
    shells.leave_out(draft, &is_inner, RepairKind::Filled { volume })
}

/// Leaves out all but the body of the largest volume.
pub(super) fn keep_largest(draft: &mut Draft) -> Option<Repair> {
    let shells = Shells::of(&draft.mesh);
    let largest = (0..shells.all.len())
        .rev()
        .max_by(|&s, &t| shells.all[s].volume.total_cmp(&shells.all[t].volume))?;
    let is_left_out: Vec<bool> = (0..shells.all.len()).map(|s| s != largest).collect();
    shells.leave_out(draft, &is_left_out, RepairKind::LeftOut)
}

/// Triangles connected over edges.
pub(super) struct Shell {
    pub(super) bounds: Aabb,
    pub(super) volume: f64,
    n_faces: usize,
    /// A corner of one of its triangles.
    point: Vec3,
}

/// The shells of a mesh, and the shell of each triangle.
pub(super) struct Shells {
    pub(super) all: Vec<Shell>,
    pub(super) of_face: Vec<u32>,
}

impl Shells {
    pub(super) fn of(mesh: &TriMesh) -> Self {
        let (of_face, n_shells) = components(mesh);
        let mut all: Vec<Option<Shell>> = (0..n_shells).map(|_| None).collect();
        for (face, &shell) in of_face.iter().enumerate() {
            let corners = mesh.corners(face);
            let shell = all[shell as usize].get_or_insert_with(|| Shell {
                bounds: Aabb::EMPTY,
                volume: 0.0,
                n_faces: 0,
                point: corners[0],
            });
            // A local origin keeps the volume exact far away from 0.
            let [a, b, c] = corners.map(|p| p - shell.point);
            shell.volume += a.dot(b.cross(c)) / 6.0;
            shell.bounds = shell.bounds.union(Aabb::around(corners));
            shell.n_faces += 1;
        }
        Self {
            all: all.into_iter().flatten().collect(),
            of_face,
        }
    }

    /// Triangles of the shells that `has` accepts, with the points that they use.
    pub(super) fn part(&self, mesh: &TriMesh, has: impl Fn(usize) -> bool) -> TriMesh {
        let of_part = mesh.triangles.iter().zip(&self.of_face);
        TriMesh {
            triangles: of_part
                .filter(|(_, shell)| has(**shell as usize))
                .map(|(t, _)| *t)
                .collect(),
            points: mesh.points.clone(),
        }
        .without_unused_points()
    }

    /// Shells around each shell, judged by one of its corners; `None` if that is too much work.
    fn containers(&self, mesh: &TriMesh) -> Option<Vec<Vec<usize>>> {
        let mut within = vec![Vec::new(); self.all.len()];
        if self.all.len() == 1 {
            return Some(within);
        }
        let may_hold = |s: usize, t: usize| {
            let [inner, outer] = [self.all[s].bounds, self.all[t].bounds];
            s != t && outer.contains(inner.min) && outer.contains(inner.max)
        };
        let n = self.all.len();
        if n.saturating_mul(n) > MAX_WORK {
            return None;
        }
        let pairs: Vec<(usize, usize)> = (0..n)
            .flat_map(|s| (0..n).map(move |t| (s, t)))
            .filter(|&(s, t)| may_hold(s, t))
            .collect();
        if pairs.iter().map(|&(_, t)| self.all[t].n_faces).sum::<usize>() > MAX_WORK {
            return None;
        }
        let mut faces = vec![Vec::new(); n];
        (0..)
            .zip(&self.of_face)
            .for_each(|(face, &shell): (usize, _)| faces[shell as usize].push(face));
        for (s, t) in pairs {
            let winding: f64 = faces[t]
                .iter()
                .map(|&face| solid_angle(mesh.corners(face), self.all[s].point))
                .sum::<f64>();
            if winding.abs() > std::f64::consts::TAU {
                within[s].push(t);
            }
        }
        Some(within)
    }

    fn leave_out(&self, draft: &mut Draft, is_left_out: &[bool], kind: RepairKind) -> Option<Repair> {
        let first = is_left_out.iter().position(|out| *out)?;
        let is_kept: Vec<bool> = self
            .of_face
            .iter()
            .map(|&shell| !is_left_out[shell as usize])
            .collect();
        draft.retain(&is_kept);
        let count = is_left_out.iter().filter(|out| **out).count();
        Some(Repair {
            kind,
            count,
            at: self.all[first].bounds.center(),
        })
    }
}

/// Signed solid angle of a triangle seen from `q`, in steradians, in [−2π, 2π]. Over a closed mesh the sum is
/// ±4π at a point inside and 0 outside. [VanOosterom1983]
pub(super) fn solid_angle(corners: [Vec3; 3], q: Vec3) -> f64 {
    let [a, b, c] = corners.map(|p| p - q);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * a.dot(b.cross(c)).atan2(denominator)
}

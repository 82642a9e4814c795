//! Bodies that are inside out and overlap another body: either meant as a hole, or flipped by mistake.

use super::crossing::{crossing_pairs, unite};
use super::shells::{self, Shells};
use super::{Draft, Repair, RepairKind};
use crate::check::InputError;
use crate::{TriMesh, Volume, boolean};

/// Treatment of bodies that are inside out and overlap another body; there are two right answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum InsideOut {
    /// Reject the mesh, so that its owner may decide.
    #[default]
    Ask,
    /// Cut them out of the bodies that they overlap.
    Cut,
    /// Flip them, and unite them with the bodies that they overlap.
    Unite,
}

/// Least common volume, as a share of the smaller body's, for two bodies to overlap: more than rounding at a
/// touch.
const LEAST_COMMON: f64 = 1e-9;

/// Treats bodies that are inside out and overlap an upright body as `wanted`.
///
/// Bodies entirely within another are cavities. Bodies that overlap nothing are left to
/// [`shells::turn_outwards`].
pub(super) fn settle(draft: &mut Draft, wanted: InsideOut) -> Result<Option<Repair>, InputError> {
    let shells = Shells::of(&draft.mesh);
    let is_cutter = cutters(&draft.mesh, &shells);
    let Some(first) = is_cutter.iter().position(|cutter| *cutter) else {
        return Ok(None);
    };
    let at = shells.all[first].bounds.center();
    let count = is_cutter.iter().filter(|cutter| **cutter).count();
    let asked = InputError::Cutter { count, at };
    let is_cut: Vec<bool> = shells
        .of_face
        .iter()
        .map(|&shell| is_cutter[shell as usize])
        .collect();
    match wanted {
        InsideOut::Ask => Err(asked),
        InsideOut::Unite => {
            let triangles = draft.mesh.triangles.iter_mut().zip(&is_cut);
            triangles.filter(|(_, cut)| **cut).for_each(|(t, _)| t.swap(1, 2));
            Ok(Some(Repair {
                kind: RepairKind::Everted,
                count,
                at,
            }))
        }
        InsideOut::Cut => {
            let volume = cut_out(draft, &is_cut).ok_or(asked)?;
            Ok(Some(Repair {
                kind: RepairKind::CutOut { volume },
                count,
                at,
            }))
        }
    }
}

/// Marks the shells that are inside out and overlap an upright shell.
fn cutters(mesh: &TriMesh, shells: &Shells) -> Vec<bool> {
    let n = shells.all.len();
    let mut is_cutter = vec![false; n];
    let pairs: Vec<(usize, usize)> = (0..n)
        .filter(|&s| shells.all[s].volume < 0.0)
        .flat_map(|s| (0..n).map(move |t| (s, t)))
        .filter(|&(s, t)| shells.all[t].volume > 0.0 && shells.all[s].bounds.intersects(shells.all[t].bounds))
        .collect();
    if pairs.is_empty() {
        return is_cutter;
    }
    let mut crossing: Vec<(u32, u32)> = crossing_pairs(mesh)
        .into_iter()
        .flat_map(|[a, b]| [(a, b), (b, a)])
        .map(|(a, b)| (shells.of_face[a as usize], shells.of_face[b as usize]))
        .collect();
    crossing.sort_unstable();
    crossing.dedup();
    for (s, t) in pairs {
        let crosses = crossing.binary_search(&(s as u32, t as u32)).is_ok();
        is_cutter[s] = is_cutter[s] || overlap(mesh, shells, (s, t), crosses);
    }
    is_cutter
}

/// Returns true if the surfaces of two shells meet and their enclosed volumes overlap.
fn overlap(mesh: &TriMesh, shells: &Shells, (inverted, upright): (usize, usize), crosses: bool) -> bool {
    let both = shells.part(mesh, |shell| shell == inverted || shell == upright);
    if !crosses && boolean::touches_itself(&both) != Ok(true) {
        return false;
    }
    let turned = invert(shells.part(mesh, |shell| shell == inverted));
    let upright_mesh = shells.part(mesh, |shell| shell == upright);
    let volumes = [turned, upright_mesh].map(|part| Volume::from_closed_mesh(&part));
    let [Ok(a), Ok(b)] = volumes else { return crosses };
    a.intersect(&b).volume() > LEAST_COMMON * a.volume().min(b.volume())
}

/// Cuts the bodies of the marked triangles out of the others, which are united first. Returns the loss of
/// enclosed volume.
fn cut_out(draft: &mut Draft, is_cut: &[bool]) -> Option<f64> {
    let [mut cut, mut rest] = [draft.clone(), draft.clone()];
    cut.retain(is_cut);
    rest.retain(&is_cut.iter().map(|cut| !cut).collect::<Vec<_>>());
    cut.mesh = invert(cut.mesh);
    let _ = shells::turn_outwards(&mut rest);
    let [whole, tool] = [rest, cut].map(|part| {
        let one = unite(&part.mesh)?;
        Volume::from_closed_mesh(&one).ok()
    });
    let (whole, tool) = (whole?, tool?);
    let left = whole.subtract(&tool);
    if left.is_empty() {
        return None;
    }
    draft.replace(left.to_mesh());
    Some(whole.volume() - left.volume())
}

fn invert(mut mesh: TriMesh) -> TriMesh {
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh
}

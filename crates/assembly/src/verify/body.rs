//! Checks that each piece is one printable solid.

use rayon::prelude::*;
use shellock_geom::{TriMesh, Vec3, Volume};

use super::folds::Fold;
use super::hanging::largest_part;
use super::{Check, Finding};
use crate::{Cancelled, Ctx, IdVec, PatchId};

/// Distance below which points are merged, mm, as readers of STL files do. At the size of prints it merges
/// bitwise equal single-precision points and, near the origin, a few more.
const MERGE_MM: f64 = 1e-8;
/// Volume below which a component is a crumb that no slicer prints, mm³. Cavities have a negative volume and
/// do not count as bodies.
const CRUMB_MM3: f64 = 0.01;

/// Piece as a reader of its file sees it.
pub struct Body {
    /// Mesh with equal points merged and collapsed triangles dropped.
    pub mesh: TriMesh,
    /// Region inside the mesh; `None` if it bounds none.
    pub volume: Option<Volume>,
    /// Defects found in the mesh.
    defects: Vec<Finding>,
    /// Faces of the mesh that have material right in front of them; `None` if there are none.
    fold: Option<Fold>,
}

/// Summary of the edges of a mesh.
struct EdgeUse {
    /// Number of edges used more often in one direction than in the other.
    n_unbalanced: usize,
    /// Number of edges of more than two triangles, and the midpoint of the first one.
    non_manifold: Option<(usize, Vec3)>,
}

/// Reads all pieces of a `model` and examines them one by one.
pub fn read(
    ctx: &Ctx,
    pieces: &IdVec<PatchId, TriMesh>,
    model: Option<&TriMesh>,
) -> Result<IdVec<PatchId, Body>, Cancelled> {
    let ids: Vec<PatchId> = pieces.ids().collect();
    let read = ids.into_par_iter().map(|piece| {
        ctx.check()?;
        Ok(read_piece(piece, &pieces[piece], model))
    });
    Ok(read
        .collect::<Result<Vec<Body>, Cancelled>>()?
        .into_iter()
        .collect())
}

/// Checks over all pieces, with their findings.
pub fn check(bodies: &IdVec<PatchId, Body>) -> (Vec<Check>, Vec<Finding>) {
    let findings: Vec<Finding> = bodies
        .iter()
        .flat_map(|(_, b)| b.defects.iter().cloned())
        .collect();
    let check = |name: &str, concerns: fn(&Finding) -> bool| {
        let n = findings.iter().filter(|f| concerns(f)).count();
        Check::new(name, n == 0, format!("{n} of {} pieces fail", bodies.len()))
    };
    let checks = vec![
        check("every piece closed, oriented", |f| {
            matches!(f, Finding::NotClosed { .. })
        }),
        check("no edge shared by four faces", |f| {
            matches!(f, Finding::SharedEdges { .. })
        }),
        Check {
            figure: figure_of_folds(bodies),
            ..check("no surface folds back on itself", |f| {
                matches!(f, Finding::Folded { .. })
            })
        },
        check("every piece one connected body", |f| {
            matches!(f, Finding::SeveralBodies { .. })
        }),
        check("no part hangs on a thin neck", |f| {
            matches!(f, Finding::Hanging { .. })
        }),
    ];
    (checks, findings)
}

fn read_piece(piece: PatchId, mesh: &TriMesh, model: Option<&TriMesh>) -> Body {
    let mut defects = Vec::new();
    let mesh = finite(mesh).map(merge_points).unwrap_or_default();
    let edges = edge_use(&mesh);
    if let Some((count, at)) = edges.non_manifold {
        defects.push(Finding::SharedEdges {
            piece,
            count,
            at: at.to_array(),
        });
    }
    let is_closed = edges.n_unbalanced == 0 && mesh.signed_volume() > 0.0;
    let volume = if is_closed {
        Volume::from_closed_mesh(&mesh).ok().filter(|v| !v.is_empty())
    } else {
        None
    };
    match &volume {
        None => defects.push(Finding::NotClosed { piece }),
        Some(volume) => {
            let count = volume
                .components()
                .iter()
                .filter(|c| c.to_mesh().signed_volume() > CRUMB_MM3)
                .count();
            if count != 1 {
                defects.push(Finding::SeveralBodies { piece, count });
            }
        }
    }
    let fold = volume.as_ref().and_then(|_| Fold::of(&mesh));
    if let Some(fold) = fold {
        defects.push(Finding::Folded {
            piece,
            area_mm2: fold.area_mm2,
            at: fold.at.to_array(),
        });
    }
    if volume.is_some() {
        defects.extend(largest_part(piece, &mesh, model));
    }
    Body {
        mesh,
        volume,
        defects,
        fold,
    }
}

/// Faces of all pieces that have material right in front of them, in words.
fn figure_of_folds(bodies: &IdVec<PatchId, Body>) -> String {
    let folds = bodies.iter().filter_map(|(_, body)| body.fold);
    let (n, area_mm2) = folds.fold((0, 0.0), |(n, mm2), fold| (n + fold.n_faces, mm2 + fold.area_mm2));
    format!("{n} faces, {area_mm2:.2} mm², have material in front")
}

/// Returns `mesh`, unless it refers to points that do not exist, or has coordinates that are not finite.
pub fn finite(mesh: &TriMesh) -> Option<&TriMesh> {
    let is_sound = mesh.points.iter().all(|p| p.is_finite())
        && mesh
            .triangles
            .iter()
            .flatten()
            .all(|&v| (v as usize) < mesh.points.len());
    is_sound.then_some(mesh)
}

/// Merges equal points of `mesh`, and drops triangles that collapse. Points keep their original order.
pub fn merge_points(mesh: &TriMesh) -> TriMesh {
    let cell = |p: Vec3| {
        p.to_array()
            .map(|x| (f64::from(x as f32) / MERGE_MM).round() as i64)
    };
    let mut by_place: Vec<([i64; 3], u32)> = mesh.points.iter().map(|&p| cell(p)).zip(0..).collect();
    by_place.sort_unstable();
    let mut name = vec![0u32; mesh.points.len()];
    for equal in by_place.chunk_by(|a, b| a.0 == b.0) {
        for e in equal {
            name[e.1 as usize] = equal[0].1;
        }
    }
    let triangles = mesh.triangles.iter().map(|t| t.map(|v| name[v as usize]));
    let triangles: Vec<[u32; 3]> = triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect();
    let mut is_used = vec![false; mesh.points.len()];
    triangles
        .iter()
        .flatten()
        .for_each(|&v| is_used[v as usize] = true);
    let mut rank = vec![0u32; mesh.points.len()];
    let mut points = Vec::new();
    for (v, &p) in mesh.points.iter().enumerate().filter(|(v, _)| is_used[*v]) {
        rank[v] = points.len() as u32;
        points.push(p);
    }
    TriMesh {
        points,
        triangles: triangles
            .into_iter()
            .map(|t| t.map(|v| rank[v as usize]))
            .collect(),
    }
}

fn edge_use(mesh: &TriMesh) -> EdgeUse {
    let mut edges: Vec<(u32, u32, bool)> = Vec::with_capacity(3 * mesh.triangles.len());
    for &[a, b, c] in &mesh.triangles {
        edges.extend([(a, b), (b, c), (c, a)].map(|(from, to)| (from.min(to), from.max(to), from < to)));
    }
    edges.sort_unstable();
    let mut found = EdgeUse {
        n_unbalanced: 0,
        non_manifold: None,
    };
    for uses in edges.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)) {
        let forwards = uses.iter().filter(|e| e.2).count();
        found.n_unbalanced += usize::from(2 * forwards != uses.len());
        if uses.len() > 2 {
            let middle = 0.5 * (mesh.points[uses[0].0 as usize] + mesh.points[uses[0].1 as usize]);
            found.non_manifold = Some(found.non_manifold.map_or((1, middle), |(n, at)| (n + 1, at)));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use shellock_testkit::shapes::cuboid;

    use super::*;

    fn join(parts: &[TriMesh]) -> TriMesh {
        let mut all = TriMesh::default();
        for part in parts {
            let first = all.points.len() as u32;
            all.points.extend(&part.points);
            all.triangles
                .extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
        }
        all
    }

    #[test]
    fn each_defect_of_a_piece_is_found() {
        let found = |mesh: &TriMesh| read_piece(PatchId(3), mesh, None).defects;
        let cube = cuboid([0.0; 3], [2.0; 3]).to_mesh();
        assert!(found(&cube).is_empty());

        let mut open = cube.clone();
        open.triangles.pop();
        assert_eq!(found(&open), [Finding::NotClosed { piece: PatchId(3) }]);

        let mut nan = cube.clone();
        nan.points[0].x = f64::NAN;
        assert_eq!(found(&nan), [Finding::NotClosed { piece: PatchId(3) }]);
        assert_eq!(
            found(&TriMesh::default()),
            [Finding::NotClosed { piece: PatchId(3) }]
        );

        let apart = join(&[cube.clone(), cuboid([5.0; 3], [6.0; 3]).to_mesh()]);
        assert_eq!(
            found(&apart),
            [Finding::SeveralBodies {
                piece: PatchId(3),
                count: 2
            }]
        );

        // Two cubes that touch along an edge: closed, but the edge has four faces.
        let touching = join(&[cube, cuboid([2.0, 2.0, 0.0], [4.0, 4.0, 2.0]).to_mesh()]);
        let shared = found(&touching);
        assert!(
            matches!(shared[0], Finding::SharedEdges { count: 1, at, .. } if at == [2.0, 2.0, 1.0]),
            "{shared:?}"
        );
    }

    #[test]
    fn a_cavity_is_no_second_body() {
        let hollow = cuboid([0.0; 3], [4.0; 3]).subtract(&cuboid([1.0; 3], [3.0; 3]));
        assert_eq!(read_piece(PatchId(0), &hollow.to_mesh(), None).defects, []);
    }
}

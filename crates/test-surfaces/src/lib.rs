//! Made-up surfaces for tests: icospheres, labels by face centre, seams along triangle edges.

use std::collections::{BTreeMap, BTreeSet};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use shellock_geom::{TriMesh, Vec3};
use shellock_report::PatchId;
use shellock_surface::{Seam, SegmentedSurface};
pub use shellock_testkit::shapes::sphere;

/// Labels each triangle by its centre.
pub fn label(mesh: TriMesh, n_patches: usize, patch_at: impl Fn(Vec3) -> u32) -> SegmentedSurface {
    let n = mesh.triangles.len();
    let patch_of_face = (0..n).map(|f| PatchId(patch_at(mesh.face_center(f)))).collect();
    SegmentedSurface {
        mesh,
        patch_of_face,
        source_face: (0..n as u32).collect(),
        n_patches,
    }
}

/// Labels each triangle by the nearest of `n_patches` spread directions (random, then four rounds of Lloyd).
pub fn voronoi(mesh: TriMesh, n_patches: usize, seed: u64) -> SegmentedSurface {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut sites: Vec<Vec3> = (0..n_patches)
        .map(|_| {
            mesh.face_center(rng.random_range(0..mesh.triangles.len()))
                .normalize()
        })
        .collect();
    let nearest = |sites: &[Vec3], p: Vec3| {
        let p = p.normalize();
        (0..sites.len())
            .max_by(|&i, &j| sites[i].dot(p).total_cmp(&sites[j].dot(p)))
            .unwrap()
    };
    for _ in 0..4 {
        let mut sums = vec![Vec3::ZERO; n_patches];
        for f in 0..mesh.triangles.len() {
            sums[nearest(&sites, mesh.face_center(f))] += mesh.face_center(f) * mesh.face_area(f);
        }
        sites = sums
            .into_iter()
            .zip(sites)
            .map(|(s, old)| s.try_normalize().unwrap_or(old))
            .collect();
    }
    label(mesh, n_patches, |p| nearest(&sites, p) as u32)
}

/// A ball of 40 mm radius about the origin, divided into its eight octants: bit k of a label is set where
/// coordinate k is positive.
pub fn octants() -> SegmentedSurface {
    let octant = |p: Vec3| u32::from(p.x > 0.0) + 2 * u32::from(p.y > 0.0) + 4 * u32::from(p.z > 0.0);
    label(sphere(4, Vec3::splat(40.0)), 8, octant)
}

/// A seam in a horizontal surface through `points`, between pieces 0 and 1.
pub fn level_seam(points: Vec<Vec3>) -> Seam {
    Seam {
        a: PatchId(0),
        b: PatchId(1),
        normals: vec![Vec3::Z; points.len()],
        points,
    }
}

/// The seams of `surface` along its triangle edges, chained from corner to corner.
pub fn seams(surface: &SegmentedSurface) -> Vec<Seam> {
    let mut owner = BTreeMap::new();
    for (f, &[a, b, c]) in surface.mesh.triangles.iter().enumerate() {
        for e in [(a, b), (b, c), (c, a)] {
            owner.insert(e, f);
        }
    }
    let mut pairs: BTreeMap<(PatchId, PatchId), BTreeSet<(u32, u32)>> = BTreeMap::new();
    let mut normal = vec![Vec3::ZERO; surface.mesh.points.len()];
    for (&(u, v), &f) in &owner {
        let (a, b) = (surface.patch_of_face[f], surface.patch_of_face[owner[&(v, u)]]);
        normal[u as usize] += surface.mesh.double_area_vector(f);
        if a < b {
            pairs.entry((a, b)).or_default().insert((u, v));
        }
    }
    let mut seams = Vec::new();
    for ((a, b), mut edges) in pairs {
        while let Some(line) = take_chain(&mut edges) {
            let points = line.iter().map(|&v| surface.mesh.points[v as usize]).collect();
            let normals = line.iter().map(|&v| normal[v as usize].normalize()).collect();
            seams.push(Seam {
                a,
                b,
                points,
                normals,
            });
        }
    }
    seams
}

/// Takes one chain of directed edges out of `edges`, started at an end where there is one.
fn take_chain(edges: &mut BTreeSet<(u32, u32)>) -> Option<Vec<u32>> {
    let heads: BTreeSet<u32> = edges.iter().map(|e| e.1).collect();
    let first = edges
        .iter()
        .find(|e| !heads.contains(&e.0))
        .or_else(|| edges.iter().next())
        .copied()?;
    edges.remove(&first);
    let mut line = vec![first.0, first.1];
    while let Some(&next) = edges
        .range((line[line.len() - 1], 0)..=(line[line.len() - 1], u32::MAX))
        .next()
    {
        edges.remove(&next);
        line.push(next.1);
    }
    Some(line)
}

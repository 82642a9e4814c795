//! Imprint of a key: makes the surface inside a prism a patch of its own.

use std::borrow::Cow;

use shellock_geom::level_cut::{Side, cut_at_zero};
use shellock_geom::subdivide::halve_edges;
use shellock_geom::topology::components;
use shellock_geom::{Solid, Topology, TriMesh};
use shellock_report::{Ctx, PatchId};
use shellock_surface::SegmentedSurface;

use super::KeyPrism;
use crate::segmentation::{SegmentationError, SegmentationParams, refined_again};
use crate::widen::widen;

/// Greatest edge length near the new seam, mm: corners are round to within a tenth of a millimetre.
const EDGE_MM: f64 = 1.2;
/// Greatest number of halvings of edges: enough from 40 mm down.
const MOST_HALVINGS: usize = 6;
/// Least distance of points from the cut, mm, so that no triangle is a sliver.
const LEAST_MM: f64 = 0.02;
/// Least share of an ordinary patch's area with which a fragment remains a patch; a smaller one joins the
/// neighbour with the longest common border.
const FRAGMENT_SHARE: f64 = 0.08;

/// The surface with the part in `prism` as a patch of its own, and the id of that patch. `None` where the
/// part is empty, or everything, or not nearly all of one patch.
///
/// Patches that the key cuts in two become two, or lose a small part to a neighbour. Ids change.
pub fn imprint(surface: &SegmentedSurface, prism: &KeyPrism) -> Option<(SegmentedSurface, PatchId)> {
    let (mesh, patch_of_face, source_face) = refine_near_prism(surface, prism)?;
    let value = |p| {
        let mm: f64 = prism.inside_mm(p);
        if mm.abs() < LEAST_MM { LEAST_MM } else { mm }
    };
    let values: Vec<f64> = mesh.points.iter().map(|&p| value(p)).collect();
    let cut = cut_at_zero(&mesh, &values, |_| true);
    let key = surface.n_patches as u32;
    let label: Vec<u32> = cut
        .source_face
        .iter()
        .zip(&cut.side)
        .map(|(&f, side)| {
            if *side == Side::Positive {
                key
            } else {
                patch_of_face[f as usize].0
            }
        })
        .collect();
    let topology = Topology::of_mesh(&cut.mesh)?;
    let (label, n_patches) = without_fragments(&cut.mesh, &topology, label, key);
    let surface = SegmentedSurface {
        patch_of_face: label.into_iter().map(PatchId).collect(),
        source_face: cut.source_face.iter().map(|&f| source_face[f as usize]).collect(),
        mesh: cut.mesh,
        n_patches,
    };
    let key = patch_in(&surface, prism)?;
    (n_patches > 2).then_some((surface, key))
}

/// Returns the surface with the part in `prism` as a patch, and the id of that patch, as [`imprint`] does. If
/// the key leaves a piece hanging on another, the pieces are refined first; if it leaves a piece narrow, a
/// part of that piece goes to a neighbour ([`widen`]).
pub fn imprint_and_refine(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    prism: &KeyPrism,
) -> Result<Option<(SegmentedSurface, PatchId)>, SegmentationError> {
    let faults = |s: &SegmentedSurface| {
        s.contact_graph_below(params.wall_mm, params.least_contact_mm)
            .n_faults()
    };
    let Some((cut, _)) = imprint(surface, prism) else {
        return Ok(None);
    };
    let mut best = Cow::Borrowed(surface);
    if faults(&cut) > 0
        && let Some(refined) = refined_again(&ctx.fork(), params, &cut)?
        && let Some((again, _)) = imprint(&refined, prism)
        && faults(&again) < faults(&cut)
    {
        best = Cow::Owned(refined);
    }
    let cut = |s: &SegmentedSurface| imprint(s, prism).map(|(cut, key)| (cut, Some(key)));
    let widened = widen(ctx, params, &best, &cut)?;
    Ok(widened.and_then(|(surface, key)| Some((surface, key?))))
}

/// The patch with most of the surface in `prism`, if it contains nearly all of that and little else.
pub fn patch_in(surface: &SegmentedSurface, prism: &KeyPrism) -> Option<PatchId> {
    /// Least share of the patch in the prism, and of the prism's surface in the patch.
    const LEAST: f64 = 0.8;
    let mut inside = vec![0.0; surface.n_patches];
    let mut whole = vec![0.0; surface.n_patches];
    for (face, &p) in surface.patch_of_face.iter().enumerate() {
        let area = surface.mesh.face_area(face);
        whole[usize::from(p)] += area;
        if prism.contains(surface.mesh.face_center(face)) {
            inside[usize::from(p)] += area;
        }
    }
    let total: f64 = inside.iter().sum();
    let best = (0..surface.n_patches).max_by(|&p, &q| inside[p].total_cmp(&inside[q]))?;
    (inside[best] > LEAST * total && inside[best] > LEAST * whole[best]).then(|| PatchId::from(best))
}

/// Refines the surface so that edges near the prism's sides are short.
fn refine_near_prism(
    surface: &SegmentedSurface,
    prism: &KeyPrism,
) -> Option<(TriMesh, Vec<PatchId>, Vec<u32>)> {
    let mut solid = Solid::new(surface.mesh.clone()).ok()?;
    let (mut patch, mut source) = (surface.patch_of_face.clone(), surface.source_face.clone());
    for _ in 0..MOST_HALVINGS {
        let mesh = solid.mesh();
        let inside: Vec<f64> = mesh.points.iter().map(|&p| prism.inside_mm(p)).collect();
        let is_long = |a: u32, b: u32| {
            let (a, b) = (a as usize, b as usize);
            let length = mesh.points[a].distance(mesh.points[b]);
            // Inside, distances are capped at the corner radius, so the seam may be nearer than they say by
            // no more than that.
            length > EDGE_MM
                && inside[a].min(inside[b]) < prism.corner_mm
                && inside[a].max(inside[b]) > -length
        };
        let any = mesh
            .triangles
            .iter()
            .any(|&[a, b, c]| is_long(a, b) || is_long(b, c) || is_long(c, a));
        if !any {
            break;
        }
        let (next, parent) = halve_edges(&solid, &Topology::new(&solid), is_long);
        patch = parent.iter().map(|&f| patch[f as usize]).collect();
        source = parent.iter().map(|&f| source[f as usize]).collect();
        solid = next;
    }
    Some((solid.into_mesh(), patch, source))
}

/// Relabels so that every patch is connected: small fragments join the neighbour with the longest common
/// border, others become patches. Numbers keep the order of the old ones. Also returns the number of patches.
fn without_fragments(
    mesh: &TriMesh,
    topology: &Topology,
    mut label: Vec<u32>,
    key: u32,
) -> (Vec<u32>, usize) {
    let typical = mesh.area() / f64::from(key.max(1));
    loop {
        let (component, n) = components(topology, |f, g| label[f as usize] == label[g as usize]);
        let mut area = vec![0.0; n];
        let mut of = vec![0; n];
        for (face, &c) in component.iter().enumerate() {
            area[c as usize] += mesh.face_area(face);
            of[c as usize] = label[face];
        }
        let largest = |c: usize| {
            (0..n)
                .filter(|&d| of[d] == of[c])
                .all(|d| area[d] < area[c] || d == c)
        };
        // Only one part of the key remains; a patch may fall into several large ones, or vanish.
        let is_fragment = |c: usize| {
            if of[c] == key {
                !largest(c)
            } else {
                area[c] < FRAGMENT_SHARE * typical
            }
        };
        let fragment = (0..n)
            .filter(|&c| is_fragment(c))
            .min_by(|&c, &d| area[c].total_cmp(&area[d]));
        let Some((fragment, into)) =
            fragment.and_then(|c| Some((c, neighbour(mesh, topology, &component, &of, c, key)?)))
        else {
            return number_components(&component, &of, n);
        };
        component
            .iter()
            .zip(&mut label)
            .filter(|(c, _)| **c as usize == fragment)
            .for_each(|(_, k)| *k = into);
    }
}

/// Label of the component with the longest border to `c`; the key only where there is no other.
fn neighbour(
    mesh: &TriMesh,
    topology: &Topology,
    component: &[u32],
    of: &[u32],
    c: usize,
    key: u32,
) -> Option<u32> {
    let mut border: std::collections::BTreeMap<u32, f64> = std::collections::BTreeMap::new();
    for (face, _) in component.iter().enumerate().filter(|(_, d)| **d as usize == c) {
        for (side, &g) in topology.neighbours(face as u32).iter().enumerate() {
            let other = of[component[g as usize] as usize];
            if component[g as usize] as usize != c && other != of[c] {
                let t = mesh.triangles[face];
                let (a, b) = (
                    mesh.points[t[side] as usize],
                    mesh.points[t[(side + 1) % 3] as usize],
                );
                *border.entry(other).or_default() += a.distance(b);
            }
        }
    }
    border
        .into_iter()
        .max_by(|a, b| (a.0 != key).cmp(&(b.0 != key)).then(a.1.total_cmp(&b.1)))
        .map(|(k, _)| k)
}

/// Numbers components by their old label, then by their lowest face.
fn number_components(component: &[u32], of: &[u32], n: usize) -> (Vec<u32>, usize) {
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by_key(|&c| (of[c], c));
    let mut number = vec![0; n];
    order
        .into_iter()
        .enumerate()
        .for_each(|(i, c)| number[c] = i as u32);
    (component.iter().map(|&c| number[c as usize]).collect(), n)
}

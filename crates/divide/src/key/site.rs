//! Search for places where a key can be.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use shellock_assembly::LatticeDirection;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::topology::components;
use shellock_geom::{Topology, TriMesh, Vec3};
use shellock_report::{Cancelled, Ctx};
use shellock_surface::plane::{Plane, Spot};
use shellock_surface::{SegmentedSurface, Turn};

use super::{KeyParams, KeyPrism};
use crate::segmentation;

/// Greatest number of faces sampled, so that a fine mesh costs no more than a coarse one.
const MOST_SPOTS: usize = 20_000;
/// Number of planes drawn, and greatest number of different ones kept.
const N_DRAWN: usize = 400;
const MOST_PLANES: usize = 16;
/// Number of slides tried in each plane.
const N_SLIDES: usize = 16;
/// Edges of square keys, as shares of the edge of an ordinary piece, largest first.
const SIZES: [f64; 4] = [0.6, 0.5, 0.4, 0.3];
/// Greatest area of a key, rim included, as a share of an ordinary piece's.
const MOST_AREA: f64 = 0.9;
/// Spacing of places across the slide, as a share of the width.
const STEP_SHARE: f64 = 0.25;
/// Radius of a key's corners, in connector sizes.
const CORNER_SIZES: f64 = 0.8;
/// Width of the band on either side of the seam in which flatness at the sides is measured, mm.
const SIDE_BAND_MM: f64 = 2.0;
/// Loss of score, as shares, of a key on top instead of underneath, and of one that needs the model turned.
const VISIBLE_COST: f64 = 0.4;
const TURN_COST: f64 = 0.1;
/// Greatest numbers of candidates whose rails are measured, of those examined closely, and of sites returned.
const MOST_PROBED: usize = 400;
const MOST_CANDIDATES: usize = 60;
const MOST_SITES: usize = 6;
/// Share of the largest component's area below which all other components together are ignored.
const CRUMBS: f64 = 0.02;
/// Distance from the wanted place at which the score of a key halves, in edges of an ordinary piece.
const NEAR_SHARE: f64 = 0.05;
/// Least share of the places along a key's sides that must have room for the grooves below.
const LEAST_ROOM: f64 = 0.7;

/// A place for a key, with its measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeySite {
    /// The prism that cuts the key.
    pub prism: KeyPrism,
    /// Share of the key's surface on the plane, in [0, 1].
    pub flat_share: f64,
    /// Share of flat surface along the worse of the two sides, where the rails are, in [0, 1].
    pub side_share: f64,
    /// Estimated length of straight rails that fit under the worse side, mm.
    pub rail_mm: f64,
    /// Area of the key's surface, mm².
    pub area_mm2: f64,
    /// Visibility of the key from above, in [0, 1]: 0 underneath, 1 on top.
    pub visibility: f64,
    /// Quality of the site; larger is better.
    pub score: f64,
}

impl KeySite {
    /// Describes the site for people.
    pub fn words(&self) -> String {
        let place = match self.visibility {
            below if below < 0.2 => "underneath",
            beside if beside < 0.8 => "at the side",
            _ => "on top",
        };
        format!("a key of {:.1} cm² {place}", self.area_mm2 / 100.0)
    }

    /// Returns the site, rotated by `turn`; its slide then is exactly `along`.
    pub fn rotate(&self, turn: &Turn, along: LatticeDirection) -> Self {
        let prism = KeyPrism {
            slide: along.unit(),
            ..self.prism.rotate(turn)
        };
        let normal = prism.normal.reject_from_normalized(prism.slide).normalize();
        Self {
            prism: KeyPrism { normal, ..prism },
            ..*self
        }
    }
}

/// The best places for a key on `surface`, best first; none where there is no room. The answer is the same on
/// any number of threads.
pub fn sites(ctx: &Ctx, params: &KeyParams, surface: &SegmentedSurface) -> Result<Vec<KeySite>, Cancelled> {
    ctx.stage("key", 0)?;
    let mesh = &surface.mesh;
    let Some(topology) = Topology::of_mesh(mesh) else {
        return Ok(Vec::new());
    };
    let n_faces = mesh.triangles.len();
    let spots = Spot::sample(mesh, 0..n_faces, n_faces.div_ceil(MOST_SPOTS).max(1));
    let mut planes = planes(params, mesh, &spots);
    if let Some(place) = params.near.map(Vec3::from) {
        let reach_mm = piece_edge_mm(params);
        let near: Vec<Spot> = spots
            .iter()
            .copied()
            .filter(|s| s.center.distance(place) < reach_mm)
            .collect();
        planes.extend(self::planes(params, mesh, &near));
    }
    let mut candidates: Vec<KeySite> = planes
        .par_iter()
        .flat_map_iter(|plane| on_plane(params, &spots, *plane))
        .collect();
    if let Some(place) = params.near.map(Vec3::from) {
        let edge_mm = piece_edge_mm(params);
        candidates.retain_mut(|site| {
            let off_mm = site.prism.middle().distance(place);
            site.score /= 1.0 + (off_mm / (NEAR_SHARE * edge_mm)).powi(2);
            off_mm < edge_mm
        });
    }
    let kept = no_key_centres(params, surface, &topology);
    candidates.retain(|site| !overlaps(&site.prism, params.size_mm, &kept));
    ctx.check()?;
    let by_score = |a: &KeySite, b: &KeySite| b.score.total_cmp(&a.score);
    candidates.sort_by(by_score);
    candidates.truncate(MOST_PROBED);
    let bvh = TriangleBvh::new(mesh);
    candidates.par_iter_mut().for_each(|site| {
        site.rail_mm = rail_mm(params, mesh, &bvh, &site.prism);
        site.score *= (site.rail_mm / site.prism.length_mm()).sqrt();
    });
    ctx.check()?;
    candidates.sort_by(by_score);
    candidates.truncate(MOST_CANDIDATES);
    let is_sound: Vec<bool> = candidates
        .par_iter()
        .map(|site| has_room(params, mesh, &bvh, site) && parts_in_two(mesh, &topology, &site.prism))
        .collect();
    let mut found: Vec<KeySite> = Vec::new();
    for (site, _) in candidates.iter().zip(is_sound).filter(|(_, ok)| *ok) {
        let is_same = |other: &KeySite| {
            let near = 0.5 * other.prism.half_width_mm;
            other.prism.origin.distance(site.prism.origin) < near
                && other.prism.slide.dot(site.prism.slide) > 0.9
        };
        if found.len() < MOST_SITES && !found.iter().any(is_same) {
            found.push(*site);
        }
    }
    Ok(found)
}

/// Centres of the faces from which no key is cut.
fn no_key_centres(params: &KeyParams, surface: &SegmentedSurface, topology: &Topology) -> Vec<Vec3> {
    let mesh = &surface.mesh;
    let whole = segmentation::whole(&params.keep_whole, mesh, topology, &surface.source_face, 0.0);
    let faces = whole.sets().iter().flatten();
    faces.map(|&f| mesh.face_center(f as usize)).collect()
}

/// Returns true if a point of `kept` is inside the prism, or nearer than `beside_mm` to it.
fn overlaps(prism: &KeyPrism, beside_mm: f64, kept: &[Vec3]) -> bool {
    kept.iter().any(|&p| prism.inside_mm(p) > -beside_mm)
}

/// Edge of an ordinary piece, mm.
fn piece_edge_mm(params: &KeyParams) -> f64 {
    params.piece_mm2.max(0.0).sqrt()
}

/// Different planes with much surface on them within the reach of a piece.
fn planes(params: &KeyParams, mesh: &TriMesh, spots: &[Spot]) -> Vec<Plane> {
    let tolerance_mm = Plane::tolerance_mm(mesh.bounds().size().max_element());
    let reach_mm = piece_edge_mm(params);
    let mut rng = ChaCha8Rng::seed_from_u64(params.seed);
    let total: f64 = spots.iter().map(|s| s.area).sum();
    // Drawing is by area: a small detail is no better a place for its fine mesh.
    let mut at: Vec<f64> = (0..N_DRAWN).map(|_| rng.random::<f64>() * total).collect();
    at.sort_by(f64::total_cmp);
    let mut drawn = Vec::new();
    let mut passed = 0.0;
    for s in spots {
        passed += s.area;
        while drawn.len() < at.len() && at[drawn.len()] < passed {
            drawn.push(Plane {
                at: s.center,
                normal: s.normal,
                tolerance_mm,
            });
        }
    }
    let mut refined: Vec<(f64, Plane)> = drawn
        .into_par_iter()
        .filter(|p| p.normal != Vec3::ZERO)
        .map(|p| {
            let near: Vec<Spot> = spots
                .iter()
                .copied()
                .filter(|s| s.center.distance(p.at) < reach_mm)
                .collect();
            let plane = p.refine(&near);
            (plane.area_mm2(&near), plane)
        })
        .collect();
    refined.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut kept: Vec<Plane> = Vec::new();
    for (_, p) in refined {
        let is_same = |q: &Plane| q.normal.dot(p.normal) > 0.98 && q.at.distance(p.at) < 0.5 * reach_mm;
        if kept.len() < MOST_PLANES && !kept.iter().any(is_same) {
            kept.push(snap(p));
        }
    }
    kept
}

/// Snaps a plane that is nearly level or upright to exactly so: nobody wants a model turned by a tenth of a
/// degree.
fn snap(p: Plane) -> Plane {
    /// Cosine of the snapping angle, 2°.
    const NEARLY: f64 = 0.9994;
    let axes = [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|a| [a, -a]);
    axes.into_iter()
        .find(|a| a.dot(p.normal) > NEARLY)
        .map_or(p, |normal| Plane { normal, ..p })
}

/// All prisms on one plane, scored.
fn on_plane(params: &KeyParams, spots: &[Spot], plane: Plane) -> Vec<KeySite> {
    let edge_mm = piece_edge_mm(params);
    let n = plane.normal;
    let reachable: Vec<Spot> = spots
        .iter()
        .copied()
        .filter(|s| (plane.at - s.center).dot(n) <= params.depth_mm())
        .collect();
    let near = |s: &&Spot| s.center.distance(plane.at) < 1.5 * edge_mm;
    let inliers: Vec<Spot> = reachable
        .iter()
        .filter(near)
        .copied()
        .filter(|s| plane.has(s))
        .collect();
    // The first slide is the axis nearest to the plane, so that level and upright planes try lattice
    // directions.
    let axes = [Vec3::X, Vec3::Y, Vec3::Z];
    let first = axes
        .into_iter()
        .min_by(|a, b| a.dot(n).abs().total_cmp(&b.dot(n).abs()))
        .expect("three axes");
    let first = first.reject_from_normalized(n).normalize();
    let mut found = Vec::new();
    for k in 0..N_SLIDES {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / N_SLIDES as f64).sin_cos();
        let slide = (cos * first + sin * n.cross(first)).normalize();
        for share in SIZES {
            let width_mm = share * edge_mm;
            if width_mm >= params.least_width_mm() {
                found.extend(along(params, &reachable, &inliers, plane, slide, width_mm));
            }
        }
        let least_mm = params.least_width_mm();
        if SIZES[0] * edge_mm >= least_mm && SIZES[SIZES.len() - 1] * edge_mm < least_mm {
            found.extend(along(params, &reachable, &inliers, plane, slide, least_mm));
        }
    }
    found
}

/// Prisms of one width, in all places across the slide.
fn along(
    params: &KeyParams,
    spots: &[Spot],
    inliers: &[Spot],
    plane: Plane,
    slide: Vec3,
    width_mm: f64,
) -> Vec<KeySite> {
    let across = plane.normal.cross(slide);
    let flat: Vec<[f64; 2]> = inliers
        .iter()
        .map(|s| s.center - plane.at)
        .map(|d| [d.dot(slide), d.dot(across)])
        .collect();
    let range = |axis: usize| {
        flat.iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), c| {
                (lo.min(c[axis]), hi.max(c[axis]))
            })
    };
    let (least, most) = range(1);
    if least > most {
        return Vec::new();
    }
    let half = 0.5 * width_mm;
    let (from, to) = if most - least > width_mm {
        (least + half, most - half)
    } else {
        (0.5 * (least + most), 0.0)
    };
    let n_steps = if to > from {
        ((to - from) / (STEP_SHARE * width_mm)).ceil() as usize
    } else {
        0
    };
    (0..=n_steps)
        .filter_map(|i| {
            let middle = from
                + if n_steps > 0 {
                    (to - from) * i as f64 / n_steps as f64
                } else {
                    0.0
                };
            let in_strip = flat.iter().filter(|c| (c[1] - middle).abs() < half);
            let front = in_strip.map(|c| c[0]).fold(f64::NEG_INFINITY, f64::max);
            if !front.is_finite() {
                return None;
            }
            let prism = KeyPrism {
                origin: plane.at + (front - width_mm) * slide + middle * across,
                slide,
                normal: plane.normal,
                half_width_mm: half,
                depth_mm: params.depth_mm(),
                corner_mm: CORNER_SIZES * params.size_mm,
            };
            score_plane(params, spots, plane, prism, width_mm)
        })
        .collect()
}

fn score_plane(
    params: &KeyParams,
    spots: &[Spot],
    plane: Plane,
    prism: KeyPrism,
    length_mm: f64,
) -> Option<KeySite> {
    let (mut area, mut flat, mut facing) = (0.0, 0.0, Vec3::ZERO);
    let mut sides = [0.0; 2];
    for s in spots {
        let [along, across, _] = prism.coordinates(s.center);
        if along < -SIDE_BAND_MM || across.abs() > prism.half_width_at(along) + SIDE_BAND_MM {
            continue;
        }
        let is_flat = plane.has(s);
        if prism.contains(s.center) {
            area += s.area;
            facing += s.area * s.normal;
            flat += if is_flat { s.area } else { 0.0 };
        }
        let off_seam = (across.abs() - prism.half_width_at(along)).abs();
        if is_flat && off_seam < SIDE_BAND_MM && (0.0..length_mm).contains(&along) {
            sides[usize::from(across > 0.0)] += s.area;
        }
    }
    if area <= 0.0 || area > MOST_AREA * params.piece_mm2 {
        return None;
    }
    let side_share = (sides[0].min(sides[1]) / (2.0 * SIDE_BAND_MM * length_mm)).min(1.0);
    let flat_share = flat / area;
    let up = Vec3::from(params.up).normalize_or_zero();
    let shown = 0.5 * (1.0 + (facing / area).dot(up));
    let turned = if Turn::align(prism.normal, prism.slide).0.is_none() {
        0.0
    } else {
        TURN_COST
    };
    let score = flat_share * side_share.sqrt() * flat.sqrt() * (1.0 - VISIBLE_COST * shown) * (1.0 - turned);
    Some(KeySite {
        prism,
        flat_share,
        side_share,
        rail_mm: 0.0,
        area_mm2: area,
        visibility: shown,
        score,
    })
}

/// Length of the longest straight rail under the worse side, mm. All of the key behind the rail's front
/// passes over the rail, so the rail must lie below it, and yet reach up to the wall at the side.
fn rail_mm(params: &KeyParams, mesh: &TriMesh, bvh: &TriangleBvh, prism: &KeyPrism) -> f64 {
    const N_ALONG: usize = 24;
    /// Number of places beside the seam, and their greatest distance inwards, in connector sizes.
    const N_BESIDE: usize = 3;
    const BESIDE_SIZES: f64 = 0.8;
    /// Greatest height to which a tongue reaches up to an uneven wall, in connector sizes.
    const UNEVEN_SIZES: f64 = 0.3;
    /// Distance outside the plane at which rays begin, mm.
    const ABOVE_MM: f64 = 8.0;
    let length_mm = prism.length_mm();
    let below = |along: f64, across: f64| {
        let at = prism.origin + along * prism.slide + across * prism.across();
        let hit = bvh.first_hit(at + ABOVE_MM * prism.normal, -prism.normal, 2.0 * ABOVE_MM);
        let outer = hit.filter(|(face, _)| mesh.face_normal(*face as usize).dot(prism.normal) > 0.0);
        outer.map_or(f64::INFINITY, |(_, mm)| mm - ABOVE_MM)
    };
    let step_mm = length_mm / N_ALONG as f64;
    // A row of heights from the seam inwards.
    let row = |i: usize, side: f64| -> [f64; N_BESIDE] {
        let along = (i as f64 + 0.5) * step_mm;
        let inwards = |j: usize| BESIDE_SIZES * params.size_mm * j as f64 / (N_BESIDE - 1) as f64;
        std::array::from_fn(|j| below(along, side * (prism.half_width_at(along) - inwards(j))))
    };
    let longest = |side: f64| {
        let rows: Vec<[f64; N_BESIDE]> = (0..N_ALONG).map(|i| row(i, side)).collect();
        let mut best = 0;
        for from in 0..N_ALONG {
            let mut least = f64::INFINITY;
            for to in from..N_ALONG {
                least = least.min(rows[to][0]);
                let passing = rows[..=to]
                    .iter()
                    .flatten()
                    .copied()
                    .fold(f64::NEG_INFINITY, f64::max);
                if !passing.is_finite() || passing - least > UNEVEN_SIZES * params.size_mm {
                    break;
                }
                best = best.max(to + 1 - from);
            }
        }
        best as f64 * step_mm
    };
    longest(-1.0).min(longest(1.0))
}

/// Returns true if the model below the key's sides is thick enough for the wall, the grooves and the wall
/// across.
fn has_room(params: &KeyParams, mesh: &TriMesh, bvh: &TriangleBvh, site: &KeySite) -> bool {
    /// Depth at which rays start, mm: below the bumps that the plane allows.
    const START_MM: f64 = 1.5;
    const N_ALONG: usize = 6;
    let prism = &site.prism;
    let needed_mm = 2.0 * params.wall_mm + 2.0 * params.size_mm - START_MM;
    let length_mm = prism.length_mm();
    let (mut n_free, mut n_all) = (0usize, 0u32);
    for i in 0..N_ALONG {
        let along = length_mm * (i as f64 + 0.5) / N_ALONG as f64;
        for side in [-1.0, 0.0, 1.0] {
            let across = side * prism.half_width_at(along);
            let from = prism.origin + along * prism.slide + across * prism.across() - START_MM * prism.normal;
            let hit = bvh.first_hit(from, -prism.normal, f64::INFINITY);
            n_all += 1;
            n_free += usize::from(hit.is_some_and(|(face, mm)| {
                mm > needed_mm && mesh.face_normal(face as usize).dot(prism.normal) < 0.0
            }));
        }
    }
    n_free as f64 >= LEAST_ROOM * f64::from(n_all)
}

/// Returns true if the inside of the prism and the rest are one component each.
fn parts_in_two(mesh: &TriMesh, topology: &Topology, prism: &KeyPrism) -> bool {
    let inside: Vec<bool> = (0..mesh.triangles.len())
        .map(|f| prism.contains(mesh.face_center(f)))
        .collect();
    let (component, n) = components(topology, |f, g| inside[f as usize] == inside[g as usize]);
    let mut area = vec![0.0; n];
    let mut is_inside = vec![false; n];
    for (face, &c) in component.iter().enumerate() {
        area[c as usize] += mesh.face_area(face);
        is_inside[c as usize] = inside[face];
    }
    let is_one = |side: bool| {
        let areas = || {
            area.iter()
                .zip(&is_inside)
                .filter(|(_, s)| **s == side)
                .map(|(a, _)| *a)
        };
        let (total, largest) = (areas().sum::<f64>(), areas().fold(0.0, f64::max));
        largest > 0.0 && total - largest < CRUMBS * largest
    };
    is_one(true) && is_one(false)
}

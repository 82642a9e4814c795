//! Removal of necks and sharp tips: a part of a piece beyond a narrow place goes to another piece.
//!
//! A piece breaks where it is narrow: between two seams, or between a seam and the slot of the key. It ends
//! in a needle where two seams meet at a sharp angle. Many such places show only after the key is cut. The
//! part beyond is then given away in the surface without the key, where its new border becomes a smooth seam,
//! and the key is cut again.

use std::collections::BTreeMap;

use shellock_geom::Topology;
use shellock_report::{Ctx, PatchId};
use shellock_surface::SegmentedSurface;
use shellock_surface::narrow::{Neck, TIP_DEG, Tip, narrow_places};

use crate::segmentation::{Reassignment, SegmentationError, SegmentationParams, reassign};

/// Least width of a piece, in walls.
const LEAST_WALLS: f64 = 3.0;
/// Greatest number of parts that are given away.
const MOST_PARTS: usize = 8;
/// Greatest number of neighbours tried for a part, and of changes tried until one helps.
const MOST_NEIGHBOURS: usize = 3;
const MOST_TRIED: usize = 4;
/// Least decrease of [`Faults::narrowness`] for which a part is given away. Widths are measured to a few per
/// cent.
const LEAST_GAIN: f64 = 0.1;

/// A division with the key as one of its pieces, if a key was cut.
pub type WithKey = (SegmentedSurface, Option<PatchId>);

/// Faults of a division.
#[derive(Clone, Copy, Debug)]
struct Faults {
    /// Faults of the contact graph.
    n_loose: usize,
    /// Sum of what all narrow places lack.
    narrowness: f64,
}

/// A neck or a tip.
struct NarrowPlace {
    patch: PatchId,
    /// Share of the least width, or of the least angle, that the place lacks.
    lack: f64,
    /// Triangles beyond the place.
    part: Vec<u32>,
}

impl NarrowPlace {
    /// The narrow places of all pieces but the key, worst first.
    fn all(params: &SegmentationParams, (surface, key): &WithKey) -> Vec<Self> {
        let least_mm = least_width_mm(params);
        let (necks, tips) = narrow_places(surface, least_mm);
        let necks = necks.into_iter().map(|n: Neck| Self {
            patch: n.patch,
            lack: 1.0 - n.width_mm / least_mm,
            part: n.part,
        });
        let tips = tips.into_iter().map(|t: Tip| Self {
            patch: t.patch,
            lack: 1.0 - t.angle_deg / TIP_DEG,
            part: t.part,
        });
        let mut all: Vec<Self> = necks.chain(tips).filter(|n| Some(n.patch) != *key).collect();
        all.sort_by(|a, b| b.lack.total_cmp(&a.lack));
        all
    }
}

impl Faults {
    fn of(params: &SegmentationParams, surface: &SegmentedSurface, narrow: &[NarrowPlace]) -> Self {
        Self {
            n_loose: surface
                .contact_graph_below(params.wall_mm, params.least_contact_mm)
                .n_faults(),
            narrowness: narrow.iter().map(|n| n.lack).sum(),
        }
    }

    fn is_better_than(self, other: Self) -> bool {
        self.n_loose <= other.n_loose && self.narrowness + LEAST_GAIN < other.narrowness
    }
}

/// Least width of a piece between its seams, mm.
pub fn least_width_mm(params: &SegmentationParams) -> f64 {
    LEAST_WALLS * params.wall_mm
}

/// Cuts the key out of `surface` by `cut`, and gives parts of pieces that hang on a narrow place to their
/// neighbours until no change helps. `None` if `cut` finds no key in `surface`.
///
/// Patches may be renumbered. Regions that are kept whole stay whole. Fails if the user stopped, or if seams
/// cannot be smoothed.
pub fn widen(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    cut: &dyn Fn(&SegmentedSurface) -> Option<WithKey>,
) -> Result<Option<WithKey>, SegmentationError> {
    let Some(mut state) = State::new(params, surface.clone(), cut) else {
        return Ok(None);
    };
    for _ in 0..MOST_PARTS {
        let Some(better) = state.improve(ctx, params, cut)? else {
            break;
        };
        state = better;
    }
    let (mut with_key, key) = state.with_key;
    let to_model = &state.surface.source_face;
    with_key
        .source_face
        .iter_mut()
        .for_each(|f| *f = to_model[*f as usize]);
    Ok(Some((with_key, key)))
}

/// A division before and after the key is cut.
struct State {
    surface: SegmentedSurface,
    /// The division with the key, whose sources are triangles of `surface`.
    with_key: WithKey,
    narrow: Vec<NarrowPlace>,
    faults: Faults,
}

impl State {
    fn new(
        params: &SegmentationParams,
        surface: SegmentedSurface,
        cut: &dyn Fn(&SegmentedSurface) -> Option<WithKey>,
    ) -> Option<Self> {
        let own_faces = SegmentedSurface {
            source_face: (0..surface.mesh.triangles.len() as u32).collect(),
            ..surface.clone()
        };
        let with_key = cut(&own_faces)?;
        let narrow = NarrowPlace::all(params, &with_key);
        Some(Self {
            faults: Faults::of(params, &with_key.0, &narrow),
            surface,
            with_key,
            narrow,
        })
    }

    /// Gives away the part beyond the worst narrow place for which that helps.
    fn improve(
        &self,
        ctx: &Ctx,
        params: &SegmentationParams,
        cut: &dyn Fn(&SegmentedSurface) -> Option<WithKey>,
    ) -> Result<Option<Self>, SegmentationError> {
        let tried = self.narrow.iter().flat_map(|place| {
            let into = self.neighbours(place).into_iter().take(MOST_NEIGHBOURS);
            into.map(move |patch| (place, patch))
        });
        for (place, into) in tried.take(MOST_TRIED) {
            ctx.check()?;
            let moved = self.reassignment(place, into);
            let changed = reassign(&ctx.fork(), params, &self.surface, &moved)?;
            let next = changed.and_then(|surface| Self::new(params, surface, cut));
            if let Some(next) = next.filter(|next| next.faults.is_better_than(self.faults)) {
                return Ok(Some(next));
            }
        }
        Ok(None)
    }

    /// Patches beside the part beyond a narrow place, except the key, by the length of the common border.
    fn neighbours(&self, narrow: &NarrowPlace) -> Vec<PatchId> {
        let (surface, key) = &self.with_key;
        let Some(topology) = Topology::of_mesh(&surface.mesh) else {
            return Vec::new();
        };
        let mut border_mm: BTreeMap<PatchId, f64> = BTreeMap::new();
        for &face in &narrow.part {
            let corners = surface.mesh.corners(face as usize);
            for (side, &other) in topology.neighbours(face).iter().enumerate() {
                let patch = surface.patch_of_face[other as usize];
                if patch != narrow.patch && Some(patch) != *key {
                    *border_mm.entry(patch).or_default() += corners[side].distance(corners[(side + 1) % 3]);
                }
            }
        }
        let mut found: Vec<(PatchId, f64)> = border_mm.into_iter().collect();
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        found.into_iter().map(|(patch, _)| patch).collect()
    }

    /// The part beyond `narrow` in terms of the surface without the key. What the key covers goes with the
    /// nearer side, so that the new seam runs below the key and not along its edge.
    fn reassignment(&self, narrow: &NarrowPlace, into: PatchId) -> Reassignment {
        let (with_key, key) = &self.with_key;
        let mut is_part = vec![false; with_key.mesh.triangles.len()];
        narrow.part.iter().for_each(|&f| is_part[f as usize] = true);
        let n = self.surface.mesh.triangles.len();
        let mut area = vec![[0.0; 2]; n];
        let mut into_mm2 = vec![0.0; self.surface.n_patches];
        for (face, &source) in with_key.source_face.iter().enumerate() {
            let (patch, mm2) = (with_key.patch_of_face[face], with_key.mesh.face_area(face));
            if patch == narrow.patch {
                area[source as usize][usize::from(is_part[face])] += mm2;
            } else if patch == into && Some(patch) != *key {
                into_mm2[usize::from(self.surface.patch_of_face[source as usize])] += mm2;
            }
        }
        let largest = (0..into_mm2.len()).max_by(|&a, &b| into_mm2[a].total_cmp(&into_mm2[b]));
        Reassignment {
            part: (0..n as u32)
                .filter(|&f| area[f as usize][1] > area[f as usize][0])
                .collect(),
            rest: (0..n as u32)
                .filter(|&f| area[f as usize][0] > 0.0 && area[f as usize][0] >= area[f as usize][1])
                .collect(),
            into: PatchId::from(largest.unwrap_or_default()),
        }
    }
}

#[cfg(test)]
mod tests {
    use shellock_geom::subdivide::halve_edges;
    use shellock_geom::{Solid, Vec3};
    use shellock_test_surfaces::label;
    use shellock_testkit::shapes::cuboid;

    use super::*;
    use crate::segmentation::refined_again;

    /// A slab of 80 × 40 × 8 mm whose lower side and edges are patch 0; `patch` tells the patches of its
    /// upper side.
    fn slab(n_patches: usize, patch: impl Fn(Vec3) -> u32) -> SegmentedSurface {
        let mut solid = Solid::new(cuboid([-40.0, -20.0, 0.0], [40.0, 20.0, 8.0]).to_mesh()).unwrap();
        for _ in 0..7 {
            let mesh = solid.mesh();
            let is_long = |a: u32, b: u32| mesh.points[a as usize].distance(mesh.points[b as usize]) > 2.0;
            solid = halve_edges(&solid, &Topology::new(&solid), is_long).0;
        }
        label(solid.mesh().clone(), n_patches, |p: Vec3| {
            if p.z < 7.9 { 0 } else { patch(p) }
        })
    }

    /// A slab on whose upper side a bar of `bar_mm` joins the two halves of patch 1, between patches 2 and 3.
    fn bar(bar_mm: f64) -> SegmentedSurface {
        slab(4, |p| {
            if p.x.abs() > 10.0 || 2.0 * p.y.abs() < bar_mm {
                1
            } else {
                2 + u32::from(p.y > 0.0)
            }
        })
    }

    /// A slab on whose upper side patch 1 ends in a corner of `angle_deg` at (−10, 0), between patches 2 and
    /// 3; smooth seams.
    fn wedge(angle_deg: f64) -> SegmentedSurface {
        let slope = (0.5 * angle_deg).to_radians().tan();
        let rough = slab(4, |p| {
            if p.y.abs() < slope * (p.x + 10.0) {
                1
            } else {
                2 + u32::from(p.y > 0.0)
            }
        });
        refined_again(&Ctx::quiet(), &params(), &rough).unwrap().unwrap()
    }

    fn params() -> SegmentationParams {
        SegmentationParams {
            wall_mm: 3.0,
            // The slab is no kit, and none of its pieces need be divided to make it one.
            max_splits: 0,
            ..SegmentationParams::default()
        }
    }

    #[test]
    fn a_bar_narrower_than_three_walls_is_a_neck_as_wide_as_it_and_a_wide_one_is_none() {
        let limit_mm = least_width_mm(&params());
        let found = narrow_places(&bar(5.0), limit_mm).0;
        assert_eq!(found.len(), 1, "{found:?}");
        let neck = &found[0];
        assert_eq!(neck.patch, PatchId(1));
        assert!((neck.width_mm - 5.0).abs() < 1.0, "{}", neck.width_mm);
        assert!(neck.at.x.abs() < 11.0 && neck.at.y.abs() < 1.0, "{}", neck.at);
        // Each of the two squares has 30 × 40 mm, and half of the bar may go with it.
        assert!((neck.part_mm2 - 1230.0).abs() < 80.0, "{}", neck.part_mm2);
        assert_eq!(narrow_places(&bar(14.0), limit_mm), (Vec::new(), Vec::new()));
    }

    #[test]
    fn the_part_beyond_a_neck_goes_to_a_neighbour_and_a_wide_piece_keeps_all() {
        let as_it_is = |s: &SegmentedSurface| Some((s.clone(), None));
        let widen = |bar_mm: f64| {
            widen(&Ctx::quiet(), &params(), &bar(bar_mm), &as_it_is)
                .unwrap()
                .unwrap()
                .0
        };
        let wide = widen(14.0);
        assert_eq!(wide.patch_of_face, bar(14.0).patch_of_face);
        let widened = widen(5.0);
        assert_eq!(
            narrow_places(&widened, least_width_mm(&params())),
            (Vec::new(), Vec::new())
        );
        let before = bar(5.0).mesh;
        assert!((widened.mesh.area() - before.area()).abs() < 1e-6 * before.area());
        let n = before.triangles.len();
        assert!(widened.source_face.iter().all(|&f| (f as usize) < n));
    }

    #[test]
    fn a_corner_sharper_than_the_limit_is_a_tip_and_goes_to_a_neighbour() {
        let limit_mm = least_width_mm(&params());
        // Patches are sharp elsewhere too, where seams meet the edges of the slab.
        let tips = |s: &SegmentedSurface| {
            let mut tips = narrow_places(s, limit_mm).1;
            tips.retain(|tip| tip.at.x < 10.0);
            tips
        };
        assert_eq!(tips(&wedge(80.0)), []);
        let sharp = wedge(30.0);
        let found = tips(&sharp);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!(found[0].patch, sharp.patch_of_face[found[0].part[0] as usize]);
        assert!(
            (25.0..40.0).contains(&found[0].angle_deg),
            "{}",
            found[0].angle_deg
        );
        assert!(
            // Smoothing takes the end of the corner.
            found[0].at.distance(Vec3::new(-6.0, 0.0, 8.0)) < 1.0,
            "{}",
            found[0].at
        );
        let as_it_is = |s: &SegmentedSurface| Some((s.clone(), None));
        let blunt = widen(&Ctx::quiet(), &params(), &sharp, &as_it_is)
            .unwrap()
            .unwrap()
            .0;
        assert_eq!(tips(&blunt), []);
    }
}

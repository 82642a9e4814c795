//! Longer seams for pieces that would rattle: a border moves to where the piece is wider.
//!
//! A piece rattles if its seams are short for the room between walls. A limb is thin at its root and wide
//! where it meets the body, so its seam is longer a few millimetres away. With `d` the distance from the
//! border, positive outside, the border moves to the level of `d` that is longest within reach. The length of
//! a level is the area of a band around it, divided by the band's width (the coarea formula).

use shellock_report::{Ctx, PatchId};
use shellock_surface::SegmentedSurface;

use super::ground::Ground;
use super::refine::n_faults;
use super::revise::try_change;
use super::{FaceLabels, SegmentationError, SegmentationParams};

/// Farthest that a border moves, as a share of the root of the piece's area.
const REACH: f64 = 0.4;
/// Number of levels that are examined on each side of the border.
const LEVELS: i32 = 16;
/// Half the width of a band, in distances between levels.
const HALF_BAND: f64 = 2.0;
/// Least growth of the seam, as a factor.
const LEAST_GROWTH: f64 = 1.15;
/// Least share of its area that a piece keeps.
const LEAST_KEPT: f64 = 0.7;

/// A piece whose seams shall be longer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wish {
    /// Piece that shall be held better.
    pub piece: PatchId,
    /// Length that is wanted, as a multiple of the present one; > 1.
    pub growth: f64,
}

/// Moves the borders of pieces to where their seams are as long as wanted, then refines and smooths again;
/// the first wishes come first. `None` if no border within reach is much longer, or if pieces would have to
/// be divided for it.
///
/// The `key` keeps its place. Patches may be renumbered.
pub fn lengthen(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    wishes: &[Wish],
    key: Option<PatchId>,
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    // All at once saves trials; what does not go together may go alone.
    let alone = if wishes.len() > 1 {
        wishes.chunks(1)
    } else {
        [].chunks(1)
    };
    for some in [wishes].into_iter().chain(alone) {
        let changed = try_change(ctx, params, surface, |solid, labels| {
            let ground = Ground::with_regions(params, solid, &surface.source_face);
            move_borders(params, &ground, labels, some, key)
        })?;
        if let Some(changed) = changed.filter(|next| next.n_patches == surface.n_patches) {
            return Ok(Some(changed));
        }
    }
    Ok(None)
}

/// Labels with the borders of these wishes moved; `None` if none is.
fn move_borders(
    params: &SegmentationParams,
    ground: &Ground<'_>,
    labels: &FaceLabels,
    wishes: &[Wish],
    key: Option<PatchId>,
) -> Option<FaceLabels> {
    let mut label = labels.as_slice().to_vec();
    let mut has_moved = false;
    for wish in wishes {
        let border = Border::new(ground, &label, wish.piece.0, key.map(|k| k.0));
        if let Some(moved) = border.lengthened(params, labels.n_patches(), wish.growth, wishes) {
            label = moved;
            has_moved = true;
        }
    }
    has_moved.then(|| FaceLabels::from_components(&ground.topology, &label))
}

/// Border of a piece, with the distance of each triangle from it.
struct Border<'a> {
    ground: &'a Ground<'a>,
    label: &'a [u32],
    piece: u32,
    /// Distance from the border, mm: negative inside, infinite where the border may not go.
    distance_mm: Vec<f64>,
    /// Neighbour that takes a triangle of the piece.
    taker: Vec<u32>,
}

impl<'a> Border<'a> {
    fn new(ground: &'a Ground<'a>, label: &'a [u32], piece: u32, key: Option<u32>) -> Self {
        let is_own = |f: u32| label[f as usize] == piece;
        let faces = 0..label.len() as u32;
        let beside = |own: bool| -> Vec<(u32, f64)> {
            let at_border = |f: &u32| {
                is_own(*f) == own
                    && Some(label[*f as usize]) != key
                    && (ground.topology.neighbours(*f).iter())
                        .any(|&g| is_own(g) != own && Some(label[g as usize]) != key)
            };
            faces.clone().filter(at_border).map(|f| (f, 1.0)).collect()
        };
        let (outside, inside) = (beside(false), beside(true));
        let (out_mm, _) = ground
            .faces
            .grow(&outside, |f| !is_own(f) && Some(label[f as usize]) != key);
        let (in_mm, nearest) = ground.faces.grow(&inside, is_own);
        let distance_mm = (0..label.len())
            .map(|f| if label[f] == piece { -in_mm[f] } else { out_mm[f] })
            .collect();
        let other = |f: u32| {
            let others = ground.topology.neighbours(f);
            let other = others
                .iter()
                .find(|&&g| !is_own(g) && Some(label[g as usize]) != key);
            other.map_or(piece, |&g| label[g as usize])
        };
        let taker = nearest
            .iter()
            .map(|&source| inside.get(source as usize).map_or(piece, |s| other(s.0)))
            .collect();
        Self {
            ground,
            label,
            piece,
            distance_mm,
            taker,
        }
    }

    /// Labels with the longest border within reach; `None` if the present one is about as long.
    fn lengthened(
        &self,
        params: &SegmentationParams,
        n_patches: usize,
        growth: f64,
        wishes: &[Wish],
    ) -> Option<Vec<u32>> {
        let areas = self.areas(self.label, n_patches);
        let step_mm = REACH * areas[self.piece as usize].sqrt() / f64::from(LEVELS);
        let length = |level: i32| self.length_mm(f64::from(level) * step_mm, HALF_BAND * step_mm);
        let now_mm = length(0);
        let mut levels: Vec<(f64, i32)> = (-LEVELS..=LEVELS)
            .filter(|level| *level != 0)
            .map(|level| (length(level), level))
            .filter(|l| l.0 > LEAST_GROWTH * now_mm)
            .collect();
        // The nearest border that is long enough, outside first; else the longest.
        let rank = |&(mm, level): &(f64, i32)| match (mm >= growth * now_mm, level > 0) {
            (true, true) => (0, f64::from(level)),
            (true, false) => (1, f64::from(-level)),
            (false, true) => (2, -mm),
            (false, false) => (3, -mm),
        };
        levels.sort_by(|a, b| {
            let (a, b) = (rank(a), rank(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        let before = FaceLabels::of_connected(self.label, n_patches);
        let n_before = n_faults(params, self.ground, &before);
        levels.into_iter().find_map(|(_, level)| {
            let moved = self.at_level(f64::from(level) * step_mm);
            let now = self.areas(&moved, n_patches);
            let is_worn = |k: usize| now[k] < LEAST_KEPT * areas[k];
            let takes_from_rattling = |k: usize| {
                now[k] < areas[k]
                    && k != self.piece as usize
                    && wishes.iter().any(|w| w.piece == PatchId::from(k))
            };
            if (0..n_patches).any(|k| is_worn(k) || takes_from_rattling(k)) {
                return None;
            }
            let whole = &self.ground.whole;
            if (0..n_patches as u32).any(|k| k != self.piece && whole.is_parted(&moved, [self.piece, k])) {
                return None;
            }
            let after = FaceLabels::from_components(&self.ground.topology, &moved);
            let is_good = after.n_patches() == n_patches && n_faults(params, self.ground, &after) <= n_before;
            is_good.then_some(moved)
        })
    }

    /// Length of the level at a distance from the border, mm.
    fn length_mm(&self, at_mm: f64, half_mm: f64) -> f64 {
        let is_near = |f: &usize| (self.distance_mm[*f] - at_mm).abs() <= half_mm;
        let near = (0..self.label.len()).filter(is_near);
        near.map(|f| self.ground.faces.area[f]).sum::<f64>() / (2.0 * half_mm)
    }

    /// Labels if the border runs at a distance from the present one.
    fn at_level(&self, at_mm: f64) -> Vec<u32> {
        let moved = |f: usize| {
            let k = self.label[f];
            match (k == self.piece, self.distance_mm[f] < at_mm) {
                (false, true) => self.piece,
                (true, false) => self.taker[f],
                _ => k,
            }
        };
        (0..self.label.len()).map(moved).collect()
    }

    fn areas(&self, label: &[u32], n_patches: usize) -> Vec<f64> {
        let mut areas = vec![0.0; n_patches];
        for (f, &k) in label.iter().enumerate() {
            areas[k as usize] += self.ground.faces.area[f];
        }
        areas
    }
}

#[cfg(test)]
mod tests {
    use shellock_geom::{Solid, Topology, Vec3};
    use shellock_testkit::shapes::torus;

    use super::*;
    use crate::segmentation::{smooth_and_cut, tell};

    /// Radius of the ring's tube, mm, and how much of it a pinch leaves.
    const TUBE_MM: f64 = 10.0;

    /// A ring in two halves, cut at both ends of the x axis, where the tube has `pinched` times its radius.
    fn ring(pinched: f64) -> SegmentedSurface {
        ring_with_labels(pinched).2
    }

    fn ring_with_labels(pinched: f64) -> (Solid, Vec<i64>, SegmentedSurface) {
        let mut ring = torus(30.0, TUBE_MM, [144, 48]);
        for p in &mut ring.points {
            let axis = Vec3::new(p.x, p.y, 0.0).normalize_or_zero() * 30.0;
            let pinch = 1.0 - (1.0 - pinched) * (-(axis.y / 6.0).powi(2)).exp();
            *p = axis + (*p - axis) * pinch;
        }
        let solid = Solid::new(ring).expect("closed");
        let half = |f| u32::from(solid.mesh().face_center(f).y > 0.0);
        let label: Vec<u32> = (0..solid.mesh().triangles.len()).map(half).collect();
        let labels = FaceLabels::from_components(&Topology::new(&solid), &label);
        let surface = smooth_and_cut(&Ctx::quiet(), &params(), &solid, &labels).unwrap();
        (solid, label.into_iter().map(i64::from).collect(), surface)
    }

    fn params() -> SegmentationParams {
        SegmentationParams {
            // The halves of a ring are no disks, and stay so here.
            max_splits: 0,
            ..SegmentationParams::default()
        }
    }

    fn longer(surface: &SegmentedSurface, growth: f64, key: Option<PatchId>) -> Option<SegmentedSurface> {
        let upper = surface
            .patch_of_face
            .iter()
            .zip(0..)
            .find(|(_, f)| surface.mesh.face_center(*f).y > 25.0)
            .map(|(patch, _)| *patch)
            .unwrap();
        let wish = Wish { piece: upper, growth };
        lengthen(&Ctx::quiet(), &params(), surface, &[wish], key).unwrap()
    }

    /// Length of all seams, mm, and their mean height y, mm.
    fn seams(surface: &SegmentedSurface) -> (f64, f64) {
        let graph = surface.contact_graph(0.0);
        let length_mm = graph.contacts().iter().map(|c| c.total_mm).sum();
        let mesh = &surface.mesh;
        let topology = Topology::of_mesh(mesh).unwrap();
        let at_seam = (0..mesh.triangles.len()).filter(|&f| {
            let own = surface.patch_of_face[f];
            let others = topology.neighbours(f as u32);
            others.iter().any(|&g| surface.patch_of_face[g as usize] != own)
        });
        let heights: Vec<f64> = at_seam.map(|f| mesh.face_center(f).y).collect();
        (length_mm, heights.iter().sum::<f64>() / heights.len() as f64)
    }

    #[test]
    fn a_border_moves_to_the_nearest_place_that_is_as_long_as_wanted() {
        let pinched = ring(0.5);
        let (before_mm, _) = seams(&pinched);
        let growth = 1.3;
        let (after_mm, y) = seams(&longer(&pinched, growth, None).unwrap());
        assert!(after_mm > growth * before_mm, "{before_mm} {after_mm}");
        // The upper half takes from the lower one: it grows. Bands blur a pinch as narrow as this one, so the
        // border goes some millimetres too far.
        let exact = -6.0 * (-((1.0 - 0.5 * growth) / 0.5).ln()).sqrt();
        assert!((y - exact).abs() < 3.0, "{y} {exact}");
        // What is wanted longer goes farther.
        let (farther_mm, farther_y) = seams(&longer(&pinched, 1.6, None).unwrap());
        assert!(
            farther_mm > 1.6 * before_mm && farther_y < y,
            "{farther_mm} {farther_y}"
        );
    }

    #[test]
    fn people_are_told_how_much_of_their_labels_moved() {
        let (solid, labels, before) = ring_with_labels(0.5);
        let told = |surface: &SegmentedSurface| {
            let ctx = Ctx::quiet();
            tell(&ctx, &params(), &solid, Some(&labels), surface).unwrap();
            let warnings = ctx.into_warnings();
            warnings.iter().map(|w| w.code().to_owned()).collect::<Vec<_>>()
        };
        assert!(!told(&before).contains(&"borders-moved".to_owned()));
        let after = longer(&before, 1.6, None).unwrap();
        assert!(told(&after).contains(&"borders-moved".to_owned()));
    }

    #[test]
    fn no_border_moves_on_an_even_tube_nor_into_the_key() {
        assert!(longer(&ring(1.0), 1.5, None).is_none());
        let pinched = ring(0.5);
        for key in [PatchId(0), PatchId(1)] {
            assert!(longer(&pinched, 1.5, Some(key)).is_none());
        }
    }
}

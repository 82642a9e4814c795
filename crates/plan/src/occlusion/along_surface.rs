//! Occlusion of faces parallel to a line, which slide edge on in their own plane.
//!
//! ```text
//!   ──────p──────┬────q────┐          ──────p──────┐ q        each p slides to the right: q is in its way
//!   wall of p    │ of q    │          wall of p    │
//!   ─────────────┴─────────┤          ─────────────┤
//! ```

use shellock_geom::Vec3;
use shellock_geom::topology::{HalfEdge, Topology};
use shellock_report::PatchId;
use shellock_surface::SegmentedSurface;

use super::Table;

/// Greatest cosine between a line and the normal of a face that counts as parallel to it. Over 60 mm such a
/// face rises by the 1.2 mm of skin that carving spares, so everything that slides towards another wall there
/// would be lost.
const ALONG_COS: f64 = 0.02;
/// Weight of area that would be lost to another wall. A strip 1 mm wide already makes a hole, while carving
/// often finds a way around faces that are merely occluded.
const LOST_WEIGHT: f64 = 4.0;
/// Greatest number of faces that a walk passes.
const MOST_STEPS: usize = 4096;

/// Approximate number of walks for one line. Each stands for the same area, so that fine meshes of flat
/// shapes cost no more.
const N_WALKS: f64 = 50_000.0;

/// Adds the faces parallel to `s` to the tables of `s` and of its opposite, with their true areas, since they
/// are lost whole.
pub(super) fn add(surface: &SegmentedSurface, topology: &Topology, s: Vec3, tables: &mut [Table; 2]) {
    let lying: Vec<(usize, f64)> = (0..surface.patch_of_face.len())
        .filter_map(|face| {
            let doubled = surface.mesh.double_area_vector(face);
            let area_mm2 = 0.5 * doubled.length();
            let lies_along = area_mm2 > 0.0 && doubled.dot(s).abs() <= ALONG_COS * 2.0 * area_mm2;
            lies_along.then_some((face, area_mm2))
        })
        .collect();
    let step_mm2 = lying.iter().map(|l| l.1).sum::<f64>() / N_WALKS;
    // A walk starts each time that the area passed so far reaches another step. The count starts at half a
    // step.
    let mut passed = 0.5;
    for (face, area_mm2) in lying {
        let patch = usize::from(surface.patch_of_face[face]);
        tables.iter_mut().for_each(|t| t.total_mm2[patch] += area_mm2);
        let before = f64::floor(passed);
        passed += area_mm2 / step_mm2;
        let stands_for_mm2 = (passed.floor() - before) * step_mm2;
        if stands_for_mm2 > 0.0 {
            for (table, way) in tables.iter_mut().zip([s, -s]) {
                count(surface, topology, (face, stands_for_mm2), way, table);
            }
        }
    }
}

/// Counts each patch ahead of a face on its `way` as occluding the area that the face stands for.
fn count(
    surface: &SegmentedSurface,
    topology: &Topology,
    (face, area_mm2): (usize, f64),
    way: Vec3,
    table: &mut Table,
) {
    let patch = surface.patch_of_face[face];
    let walk = Walk::from_middle(surface, topology, face, way);
    let at = walk.at;
    let mut met = vec![patch];
    for (ahead, gap_mm) in walk {
        if !met.contains(&ahead) {
            met.push(ahead);
            let pair = usize::from(patch) * surface.n_patches + usize::from(ahead);
            table.occlude(pair, LOST_WEIGHT * area_mm2, gap_mm, at);
        }
    }
}

/// A walk over faces along a direction, until the surface turns away from it. A face that turns towards it is
/// the last.
struct Walk<'a> {
    surface: &'a SegmentedSurface,
    topology: &'a Topology,
    along: Vec3,
    /// Edge through which the walk entered the present face, if any.
    entry: Option<HalfEdge>,
    face: usize,
    at: Vec3,
    gone_mm: f64,
    n_steps: usize,
}

impl<'a> Walk<'a> {
    fn from_middle(surface: &'a SegmentedSurface, topology: &'a Topology, face: usize, along: Vec3) -> Self {
        Self {
            surface,
            topology,
            along,
            entry: None,
            face,
            at: surface.mesh.corners(face).iter().sum::<Vec3>() / 3.0,
            gone_mm: 0.0,
            n_steps: 0,
        }
    }

    /// Half-edge through which the walk leaves the present face, with the distance to it, mm.
    fn way_out(&self) -> Option<(HalfEdge, f64)> {
        let corners = self.surface.mesh.corners(self.face);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let first = 3 * self.face as u32;
        let outs = (0..3).filter(|&k| self.entry != Some(first + k)).filter_map(|k| {
            let (from, to) = (corners[k as usize], corners[(k as usize + 1) % 3]);
            let outwards = (to - from).cross(normal);
            let speed = self.along.dot(outwards);
            (speed > 0.0).then(|| (first + k, ((from - self.at).dot(outwards) / speed).max(0.0)))
        });
        outs.min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

impl Iterator for Walk<'_> {
    type Item = (PatchId, f64);

    fn next(&mut self) -> Option<Self::Item> {
        if self.n_steps == MOST_STEPS {
            return None;
        }
        let (edge, mm) = self.way_out()?;
        let opposite = self.topology.opposite(edge);
        (self.at, self.gone_mm) = (self.at + mm * self.along, self.gone_mm + mm);
        (self.face, self.entry) = (opposite as usize / 3, Some(opposite));
        let [a, b, c] = self.surface.mesh.corners(self.face);
        let doubled = (b - a).cross(c - a);
        let towards = doubled.dot(self.along) / doubled.length().max(f64::MIN_POSITIVE);
        self.n_steps += 1;
        if towards > ALONG_COS {
            return None;
        }
        if towards < -ALONG_COS {
            self.n_steps = MOST_STEPS;
        }
        Some((self.surface.patch_of_face[self.face], self.gone_mm))
    }
}

#[cfg(test)]
mod tests {
    use shellock_assembly::LatticeDirection;
    use shellock_geom::Volume;
    use shellock_test_surfaces::label;
    use shellock_testkit::shapes::cuboid;

    use super::super::Occlusion;
    use super::*;

    fn shares(surface: &SegmentedSurface, p: u32, q: u32) -> [f64; 3] {
        let occlusion = Occlusion::measure(surface);
        let along = |s: Vec3| occlusion.share(PatchId(p), PatchId(q), LatticeDirection::nearest(s));
        [Vec3::Z, -Vec3::Z, Vec3::X].map(along)
    }

    #[test]
    fn a_side_wall_cannot_slide_to_where_its_plane_goes_on_in_another_piece() {
        let square =
            |z: f64| [[0.0, 0.0], [40.0, 0.0], [40.0, 40.0], [0.0, 40.0]].map(|[x, y]| Vec3::new(x, y, z));
        let box_of_two = Volume::loft(&[0.0, 20.0, 40.0].map(|z| square(z).to_vec())).to_mesh();
        // Both lids go to a third patch, so that only the sides are tested.
        let surface = label(box_of_two, 3, |p| match p.z {
            z if !(1.0..=39.0).contains(&z) => 2,
            z => u32::from(z > 20.0),
        });
        assert_eq!(shares(&surface, 0, 1), [1.0, 0.0, 0.0]);
        assert_eq!(shares(&surface, 1, 0), [0.0, 1.0, 0.0]);
    }

    #[test]
    fn a_post_cannot_slide_into_the_floor_that_it_stands_on() {
        let floor = cuboid([-20.0, -20.0, -10.0], [30.0, 30.0, 0.0]);
        let post = cuboid([0.0, 0.0, -5.0], [10.0, 10.0, 30.0]);
        let surface = label(floor.union(&post).to_mesh(), 2, |p| u32::from(p.z > 1e-6));
        let [up, down, _] = shares(&surface, 1, 0);
        assert_eq!((up, down), (0.0, 1.0));
    }
}

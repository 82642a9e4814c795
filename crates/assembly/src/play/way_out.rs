//! Guided search for a way to take a piece out by hand, if the absence of one is not proven.
//!
//! The piece moves from rest by small steps. At each pose, the points near its joints look up the nearest
//! surface of the other side, which limits the next step linearly. A linear program finds the step that goes
//! farthest in some direction. *Walks* begin with the motions of the widest play and continue in their
//! direction, which finds open shafts. Then a *tree* of poses grows towards random poses, each from the
//! nearest pose reached so far [LaValle1998]. It also finds ways that go back and forth: shifted under one
//! lip, tilted past the other. A walk starts from each pose that is farther than all before. Only a walk that
//! gets out is checked exactly: at every pose the piece must share no volume with the others.
//!
//! Limits: finding no way proves nothing. Other pieces rest.

use std::sync::OnceLock;

use nalgebra::DVector;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rayon::prelude::*;
use shellock_geom::{Quat, TriMesh, Vec3, Volume};

use super::bearing::Surfaces;
use crate::motion::{Contact, Corner, Freedom, Limits, System};
use crate::verify::sample;
use crate::{Cancelled, Ctx, IdVec, PatchId};

/// Distance to other pieces within which a point belongs to the piece's joint, mm.
const JOINT_MM: f64 = 2.5;
/// Distance between neighbouring points of joints, mm.
const SPACING_MM: f64 = 1.0;
/// Greatest number of samples of one piece; only those beside others are used.
const MOST_SAMPLES: f64 = 1e6;
/// Greatest number of points on either side.
const MOST_POINTS: usize = 700;
/// Distance beyond which faces do not limit a step, mm.
const REACH_MM: f64 = 0.6;
/// Mean displacement of a joint from which the piece is out, mm.
const OUT_MM: f64 = 12.0;
/// Distances by which faces may give way, mm: rims are some µm apart, and rough. With the first, wide faces
/// share no relevant volume.
const GIVE_MM: [f64; 2] = [0.001, 0.01];
/// Gap that is kept to surfaces where gaps are wider, mm, for features between points.
const KEPT_MM: f64 = 0.04;
/// Greatest motion of a point of the joint in a step, mm; larger steps could jump over features thinner than
/// pins.
const STEP_MM: f64 = 0.15;
/// Least step that counts as progress, mm.
const LEAST_STEP_MM: f64 = 0.01;
/// Greatest number of steps of a walk, and of steps without progress before it ends.
const MOST_STEPS: usize = 400;
const MOST_STUCK: usize = 12;
/// Random share of a step's direction, after progress and without: a walk along a wall must find the way
/// round its end.
const CHANCE: [f64; 2] = [0.1, 0.8];
/// Common volume of two pieces that counts as none, mm³, beyond that at rest.
const SHARED_MM3: f64 = 0.05;
/// Common volume that counts as none, as a share of the piece, if that is less.
const SHARED: f64 = 1e-4;
/// Number of translations and rotations.
const WAYS: usize = 6;
/// Greatest number of poses of a tree, for a piece with little play and for one with much.
const MOST_NODES: [usize; 2] = [150, 700];
/// Play of small motions above which a piece has much play, as multiples of the clearance, and in rad per mm
/// of it.
const LOOSE: [f64; 2] = [4.0, 0.25];
/// Number of steps towards one target.
const MOST_ON: usize = 8;
/// Share of targets that only rotate or shift the farthest pose further.
const ONWARDS: f64 = 0.5;
/// Distance of targets, as a multiple of that of the farthest pose, plus a constant, mm.
const BEYOND: f64 = 1.3;
const BEYOND_MM: f64 = 0.5;
/// Progress needed for a new walk beyond the pose where the last one started, as a multiple and in mm.
const FARTHER: f64 = 1.5;
const FARTHER_MM: f64 = 0.4;
/// Number of poses of a way that are checked exactly at once.
const N_AT_ONCE: usize = 4;
/// Number of poses of a way that are kept.
const KEPT_POSES: usize = 60;

/// Pose of a piece: rotated about a centre, then shifted.
#[derive(Clone, Copy)]
struct Pose {
    turn: Quat,
    shift: Vec3,
}

impl Pose {
    const REST: Self = Self {
        turn: Quat::IDENTITY,
        shift: Vec3::ZERO,
    };

    fn apply(&self, center: Vec3, p: Vec3) -> Vec3 {
        center + self.shift + self.turn * (p - center)
    }

    fn undo(&self, center: Vec3, p: Vec3) -> Vec3 {
        center + self.turn.inverse() * (p - center - self.shift)
    }

    /// Displacement of the centre, mm, and rotation vector, rad.
    fn coordinates(&self) -> [f64; 6] {
        let (s, w) = (self.shift.to_array(), self.turn.to_scaled_axis().to_array());
        [s[0], s[1], s[2], w[0], w[1], w[2]]
    }
}

/// Tree of poses that were reached.
struct Tree {
    /// Poses, each with the node from which it was reached.
    nodes: Vec<(Pose, usize)>,
    /// Node whose joint is farthest from its place, and below that distance, mm.
    farthest: usize,
    farthest_mm: f64,
}

impl Tree {
    fn add(&mut self, pose: Pose, from: usize, moved_mm: f64) -> usize {
        self.nodes.push((pose, from));
        let last = self.nodes.len() - 1;
        if moved_mm > self.farthest_mm {
            (self.farthest, self.farthest_mm) = (last, moved_mm);
        }
        last
    }

    /// Node nearest to a displacement and a rotation, which is weighted by the radius.
    fn nearest(&self, target: (Vec3, Vec3), radius_mm: f64) -> usize {
        let far = |(pose, _): &(Pose, usize)| {
            let turn = (pose.turn.to_scaled_axis() - target.1) * radius_mm;
            (pose.shift - target.0).length_squared() + turn.length_squared()
        };
        let nodes = &self.nodes;
        (0..nodes.len())
            .min_by(|&a, &b| far(&nodes[a]).total_cmp(&far(&nodes[b])))
            .unwrap_or(0)
    }

    /// Poses from rest to that of `last`.
    fn path(&self, last: usize) -> Vec<Pose> {
        let mut on_way = vec![last];
        while let Some(&node) = on_way.last().filter(|node| **node != 0) {
            on_way.push(self.nodes[node].1);
        }
        on_way.into_iter().rev().map(|node| self.nodes[node].0).collect()
    }
}

/// Search for a way to take one piece out past all others.
pub(super) struct Walk<'a> {
    surfaces: &'a Surfaces,
    piece: PatchId,
    center: Vec3,
    clearance_mm: f64,
    give_mm: f64,
    /// Other pieces, and the volume of this one, mm³, computed on demand; `None` if one bounds no volume.
    solids: OnceLock<Option<(Vec<Volume>, f64)>>,
    /// Points of the piece's joint, and below points of other pieces beside it.
    own: Vec<Vec3>,
    others: Vec<Vec3>,
}

impl<'a> Walk<'a> {
    pub fn new(surfaces: &'a Surfaces, piece: PatchId, center: Vec3, clearance_mm: f64) -> Self {
        let beside = |a: PatchId, b: &dyn Fn(PatchId) -> bool| -> Vec<Vec3> {
            let mesh = surfaces.mesh(a);
            let n = (mesh.area() / (SPACING_MM * SPACING_MM)).min(MOST_SAMPLES) as usize;
            let samples = sample::on_surface(mesh, n.max(1), u64::from(a.0))
                .into_iter()
                .map(|s| s.point);
            // Corners are the first to meet other pieces.
            let points = thin(as_met(mesh)).into_iter().chain(samples);
            let is_near = |p: &Vec3| surfaces.nearest(*p, JOINT_MM, b).is_some();
            points.filter(is_near).collect()
        };
        let own = thin(beside(piece, &|b| b != piece));
        let ids: Vec<PatchId> = surfaces.ids().filter(|&b| b != piece).collect();
        let others = thin(ids.iter().flat_map(|&b| beside(b, &|a| a == piece)).collect());
        Self {
            surfaces,
            piece,
            center,
            clearance_mm,
            give_mm: GIVE_MM[0],
            solids: OnceLock::new(),
            own,
            others,
        }
    }

    /// Searches for the poses of a way out, from rest; `None` if none was found. Walks begin with `swings`:
    /// displacement of the centre, mm, and rotation, rad.
    pub fn find(
        mut self,
        ctx: &Ctx,
        swings: &[[f64; 6]],
        pieces: &IdVec<PatchId, TriMesh>,
    ) -> Result<Option<Vec<[f64; 6]>>, Cancelled> {
        if self.own.is_empty() {
            return Ok(None);
        }
        // Without swings nothing limits small motions: start along and about the axes.
        let axes =
            (0..2 * WAYS).map(|i| std::array::from_fn(|k| if k == i / 2 { [1.0, -1.0][i % 2] } else { 0.0 }));
        let axes = axes.filter(|_| swings.is_empty());
        let starts: Vec<[f64; 6]> = swings.iter().copied().chain(axes).collect();
        for give_mm in GIVE_MM {
            self.give_mm = give_mm;
            for &[x, y, z, u, v, w] in starts.iter().step_by(if give_mm > GIVE_MM[0] { 1 } else { 2 }) {
                let heading = (Vec3::new(x, y, z), Vec3::new(u, v, w));
                if let Some(poses) = self.walk(ctx, vec![Pose::REST], heading)?
                    && self.is_free(ctx, &poses, pieces)?
                {
                    return Ok(Some(thin_poses(&poses)));
                }
            }
        }
        let is_loose = swings.iter().any(|s| {
            let [shift, turn] = [0, 3].map(|k| Vec3::new(s[k], s[k + 1], s[k + 2]).length());
            shift > LOOSE[0] * self.clearance_mm || turn > LOOSE[1] * self.clearance_mm
        });
        self.tree(
            ctx,
            pieces,
            MOST_NODES[usize::from(is_loose || swings.is_empty())],
        )
    }

    /// Searches for the poses of a way out with a tree of poses.
    fn tree(
        &self,
        ctx: &Ctx,
        pieces: &IdVec<PatchId, TriMesh>,
        most_nodes: usize,
    ) -> Result<Option<Vec<[f64; 6]>>, Cancelled> {
        let mut rng = ChaCha8Rng::seed_from_u64(1 + u64::from(self.piece.0));
        let radius_mm = self.radius_mm();
        let mut tree = Tree {
            nodes: vec![(Pose::REST, 0)],
            farthest: 0,
            farthest_mm: 0.0,
        };
        let mut walked_mm = 0.0;
        for _ in 0..most_nodes {
            ctx.check()?;
            let size_mm = BEYOND * tree.farthest_mm + BEYOND_MM;
            let mut random =
                || Vec3::from_array(std::array::from_fn(|_| rng.random_range(-size_mm..size_mm)));
            let target = (random(), random() / radius_mm);
            let (mut last, heading) = if rng.random_bool(ONWARDS) {
                (tree.farthest, target)
            } else {
                let near = tree.nearest(target, radius_mm);
                let pose = tree.nodes[near].0;
                (
                    near,
                    (target.0 - pose.shift, target.1 - pose.turn.to_scaled_axis()),
                )
            };
            for _ in 0..MOST_ON {
                let Some(next) = self.advance(&tree.nodes[last].0, heading) else {
                    break;
                };
                let moved_mm = self.moved_mm(&next);
                last = tree.add(next, last, moved_mm);
                if moved_mm > FARTHER * walked_mm + FARTHER_MM {
                    walked_mm = moved_mm;
                    let poses = self.walk(ctx, tree.path(last), self.heading(&next))?;
                    if let Some(poses) = poses
                        && self.is_free(ctx, &poses, pieces)?
                    {
                        return Ok(Some(thin_poses(&poses)));
                    }
                }
            }
            if tree.nodes.len() > most_nodes {
                break;
            }
        }
        Ok(None)
    }

    /// Pose after one step, or `None` without progress.
    fn advance(&self, pose: &Pose, heading: (Vec3, Vec3)) -> Option<Pose> {
        let (shift, spin) = self.step(pose, heading)?;
        let turn = Quat::from_scaled_axis(spin);
        Some(Pose {
            turn: (turn * pose.turn).normalize(),
            shift: pose.shift + shift,
        })
    }

    /// Poses of a walk that starts from the last of `poses` and gets out; `None` if it does not.
    fn walk(
        &self,
        ctx: &Ctx,
        mut poses: Vec<Pose>,
        mut heading: (Vec3, Vec3),
    ) -> Result<Option<Vec<Pose>>, Cancelled> {
        let mut pose = *poses.last().unwrap_or(&Pose::REST);
        let (mut farthest_mm, mut n_stuck) = (self.moved_mm(&pose), 0);
        let mut rng = ChaCha8Rng::seed_from_u64(u64::from(self.piece.0));
        for _ in 0..MOST_STEPS {
            ctx.check()?;
            let towards = self.with_chance(heading, CHANCE[usize::from(n_stuck > 0)], &mut rng);
            let Some(next) = self.advance(&pose, towards) else {
                n_stuck += 1;
                if n_stuck > MOST_STUCK {
                    return Ok(None);
                }
                continue;
            };
            pose = next;
            poses.push(pose);
            let moved_mm = self.moved_mm(&pose);
            if moved_mm > OUT_MM && self.is_apart(&pose) {
                return Ok(Some(poses));
            }
            n_stuck = if moved_mm > farthest_mm + LEAST_STEP_MM {
                0
            } else {
                n_stuck + 1
            };
            farthest_mm = f64::max(farthest_mm, moved_mm);
            if n_stuck > MOST_STUCK {
                return Ok(None);
            }
            heading = self.heading(&pose);
        }
        Ok(None)
    }

    /// Adds a random part to the direction, scaled equally for translations and rotations.
    fn with_chance(&self, heading: (Vec3, Vec3), chance: f64, rng: &mut ChaCha8Rng) -> (Vec3, Vec3) {
        let radius_mm = self.radius_mm();
        let length = (heading.0.length_squared() + (heading.1 * radius_mm).length_squared())
            .sqrt()
            .max(f64::MIN_POSITIVE);
        let mut random = || Vec3::from_array(std::array::from_fn(|_| rng.random_range(-chance..chance)));
        (
            heading.0 / length + random(),
            (heading.1 * radius_mm / length + random()) / radius_mm,
        )
    }

    /// Distance of the joint's farthest point from the centre, mm.
    fn radius_mm(&self) -> f64 {
        self.own
            .iter()
            .map(|&p| p.distance(self.center))
            .fold(1.0, f64::max)
    }

    /// Mean displacement of the joint's points, mm.
    fn moved_mm(&self, pose: &Pose) -> f64 {
        self.own
            .iter()
            .map(|&p| pose.apply(self.center, p).distance(p))
            .sum::<f64>()
            / self.own.len() as f64
    }

    /// Returns true if a quarter of the joint is away from the others: a piece that only spins in its place
    /// is not out.
    fn is_apart(&self, pose: &Pose) -> bool {
        let is_near = |p: &&Vec3| {
            self.surfaces
                .nearest(pose.apply(self.center, **p), JOINT_MM, &|b| b != self.piece)
                .is_some()
        };
        4 * self.own.iter().filter(is_near).count() < 3 * self.own.len()
    }

    /// Small motion that continues the displacement of the joint's points: the sum of their directions, and
    /// its moment.
    fn heading(&self, pose: &Pose) -> (Vec3, Vec3) {
        let at = self.center + pose.shift;
        let way = |p: &Vec3| {
            let to = pose.apply(self.center, *p);
            let on = (to - *p).normalize_or_zero();
            (on, (to - at).cross(on))
        };
        let sum = self
            .own
            .iter()
            .map(way)
            .fold((Vec3::ZERO, Vec3::ZERO), |s, w| (s.0 + w.0, s.1 + w.1));
        // Scaled as a unit force and its moment would act: moments are divided by the square of the joint's
        // size.
        let n = self.own.len() as f64;
        let size_sq = self
            .own
            .iter()
            .map(|p| p.distance_squared(self.center))
            .sum::<f64>()
            / n;
        (sum.0 / n, sum.1 / (n * size_sq.max(1.0)))
    }

    /// Step that goes farthest along `heading`: displacement of the centre and rotation about it.
    fn step(&self, pose: &Pose, heading: (Vec3, Vec3)) -> Option<(Vec3, Vec3)> {
        let at = self.center + pose.shift;
        let radius_mm = self.radius_mm();
        let contacts: Vec<Contact> = self
            .limits(pose, at)
            .into_iter()
            .chain(bounds(radius_mm))
            .collect();
        let (moving, fixed) = (PatchId(0), PatchId(1));
        let contacts: Vec<Contact> = contacts
            .into_iter()
            .map(|c| Contact {
                a: moving,
                b: fixed,
                ..c
            })
            .collect();
        let system = System::new(&contacts, &[moving], radius_mm, Freedom::Rigid);
        let gaps: Vec<f64> = system
            .rows
            .iter()
            .map(|row| contacts[row.contact].gap_mm)
            .collect();
        let towards = [heading.0, heading.1 * radius_mm];
        let objective = DVector::from_fn(6, |k, _| towards[k / 3][k % 3]);
        let limits = Limits::new(&system, &gaps);
        let mut corner = Corner::new(&limits);
        corner.farthest(&objective)?;
        let x = corner.motion();
        let (shift, spin) = (
            Vec3::new(x[0], x[1], x[2]),
            Vec3::new(x[3], x[4], x[5]) / radius_mm,
        );
        (shift.length() + spin.length() * radius_mm > LEAST_STEP_MM).then_some((shift, spin))
    }

    /// Limits of the next step by the surfaces around; points are relative to `at`.
    fn limits(&self, pose: &Pose, at: Vec3) -> Vec<Contact> {
        let is_other = |b: PatchId| b != self.piece;
        let of_own = |p: &Vec3| {
            let to = pose.apply(self.center, *p);
            let (_, near, normal) = self.surfaces.nearest(to, REACH_MM, &is_other)?;
            let (away, gap_mm) = apart(to, near, normal, self.give_mm);
            Some(limit(to - at, -away, gap_mm))
        };
        let of_other = |p: &Vec3| {
            let within = pose.undo(self.center, *p);
            let (_, near, normal) = self.surfaces.nearest(within, REACH_MM, &|b| b == self.piece)?;
            let (away, gap_mm) = apart(within, near, normal, self.give_mm);
            Some(limit(*p - at, pose.turn * away, gap_mm))
        };
        self.own
            .iter()
            .filter_map(of_own)
            .chain(self.others.iter().filter_map(of_other))
            .collect()
    }

    /// Returns true if at no pose the piece shares more volume with any other piece than at rest.
    fn is_free(
        &self,
        ctx: &Ctx,
        poses: &[Pose],
        pieces: &IdVec<PatchId, TriMesh>,
    ) -> Result<bool, Cancelled> {
        let solids = self.solids.get_or_init(|| {
            let others = pieces.iter().filter(|(id, _)| *id != self.piece);
            let others: Vec<Volume> = others
                .map(|(_, mesh)| Volume::from_closed_mesh(mesh).ok())
                .collect::<Option<_>>()?;
            Some((
                others,
                Volume::from_closed_mesh(&pieces[self.piece]).ok()?.volume(),
            ))
        });
        let Some((others, own_mm3)) = solids else {
            return Ok(false);
        };
        let most_mm3 = SHARED_MM3.min(SHARED * own_mm3);
        // Common volume with each other piece; `None` if the moved piece bounds no volume.
        let shared_mm3 = |pose: &Pose| -> Option<Vec<f64>> {
            let mut mesh = pieces[self.piece].clone();
            mesh.points
                .iter_mut()
                .for_each(|p| *p = pose.apply(self.center, *p));
            let room = mesh.bounds();
            let moved = Volume::from_closed_mesh(&mesh).ok()?;
            let with = |o: &Volume| {
                if o.bounds().intersects(room) {
                    moved.intersect(o).volume()
                } else {
                    0.0
                }
            };
            Some(others.iter().map(with).collect())
        };
        let Some(at_rest) = shared_mm3(&poses[0]) else {
            return Ok(false);
        };
        let is_free = |shared: &Vec<f64>| {
            shared
                .iter()
                .zip(&at_rest)
                .all(|(mm3, rest)| *mm3 <= rest + most_mm3)
        };
        for some in spread(poses.len()).chunks(N_AT_ONCE) {
            ctx.check()?;
            if !some
                .par_iter()
                .all(|&i| shared_mm3(&poses[i]).as_ref().is_some_and(is_free))
            {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// Indices below `n`, each far from those before it: the middle, the quarters, the eighths, and so on. A way
/// that is not free collides over some length, so this finds a pose there soon.
fn spread(n: usize) -> Vec<usize> {
    let n_all = n.next_power_of_two();
    let n_bits = n_all.trailing_zeros();
    // The bits of a count, read backwards, are such an order.
    (1..n_all)
        .chain([0])
        .map(|count| count.reverse_bits() >> (usize::BITS - n_bits).min(usize::BITS - 1))
        .filter(|&i| i < n)
        .collect()
}

/// Subset of the poses, including the last, each as displacement and rotation vector.
fn thin_poses(poses: &[Pose]) -> Vec<[f64; 6]> {
    let every = poses.len().div_ceil(KEPT_POSES).max(1);
    poses
        .iter()
        .step_by(every)
        .chain(poses.last())
        .map(Pose::coordinates)
        .collect()
}

/// Direction from the nearest place of a surface to a point, and the distance by which the point may
/// approach, mm. Beside an edge, the point may pass it. If the point touches the surface or is inside, the
/// direction is the triangle's normal.
fn apart(p: Vec3, near: Vec3, normal: Vec3, give_mm: f64) -> (Vec3, f64) {
    /// Distance below which the point touches the surface, mm.
    const TOUCHING_MM: f64 = 5e-4;
    /// Greatest depth that a step can reach, mm. A point farther from the surface is outside, whatever the
    /// normal beside an edge indicates.
    const DEEPEST_MM: f64 = 2.0 * GIVE_MM[1];
    let away = p - near;
    let gap_mm = away.length();
    if gap_mm > DEEPEST_MM || (gap_mm > TOUCHING_MM && away.dot(normal) > 0.0) {
        (away / gap_mm, (gap_mm - KEPT_MM).max(give_mm))
    } else {
        (normal, give_mm - gap_mm)
    }
}

fn limit(point: Vec3, normal: Vec3, gap_mm: f64) -> Contact {
    Contact {
        a: PatchId(0),
        b: PatchId(1),
        point,
        normal,
        gap_mm: gap_mm.max(0.0),
        area_mm2: 0.0,
    }
}

/// Limits the motion of points at this radius from the centre to one step.
fn bounds(radius_mm: f64) -> impl Iterator<Item = Contact> {
    const WAYS: [Vec3; 6] = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    let at = move |arm: Vec3| {
        WAYS.into_iter()
            .map(move |way| limit(arm * radius_mm, way, STEP_MM / 3f64.sqrt()))
    };
    WAYS.into_iter().chain([Vec3::ZERO]).flat_map(at)
}

/// Points of a mesh in the order in which its triangles use them. This order does not depend on the numbering
/// of points, which readers of files change.
pub(super) fn as_met(mesh: &TriMesh) -> Vec<Vec3> {
    let mut is_new = vec![true; mesh.points.len()];
    let corners = mesh.triangles.iter().flatten().map(|&v| v as usize);
    let first = corners.filter(|&v| std::mem::take(&mut is_new[v]));
    first.map(|v| mesh.points[v]).collect()
}

/// Keeps every k-th point if there are too many.
fn thin(points: Vec<Vec3>) -> Vec<Vec3> {
    let every = points.len().div_ceil(MOST_POINTS).max(1);
    points.into_iter().step_by(every).collect()
}

#[cfg(test)]
mod tests {
    use super::spread;

    #[test]
    fn a_spread_names_every_index_once_and_comes_near_all_of_them_soon() {
        for n in [0, 1, 2, 3, 7, 64, 119] {
            let order = spread(n);
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, (0..n).collect::<Vec<_>>());
            // Among the first eight, one is in each eighth that is whole.
            let far = |i: usize| order.iter().take(8).map(|&o| o.abs_diff(i)).min();
            assert!((0..n).all(|i| far(i) <= Some(n.next_power_of_two() / 8)));
        }
    }
}

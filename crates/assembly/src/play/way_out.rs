//! A guided search for a way to take a piece out by hand, where it is not proven that there is none.
//!
//! From rest the piece goes by small steps. At each pose the points near its joints ask for the nearest
//! surface of the other side, which gives a linear limit on the next step, and a linear program finds the
//! step that carries on best in some direction. *Walks* begin with the motions of the widest play and carry
//! on as they went, which finds open shafts. Then a *tree* of poses is grown towards random poses, each from
//! the nearest one that was reached [LaValle1998], which also finds ways that go forth and back: shifted
//! under one lip, tilted past the other. From each pose that is farther than all before a walk carries on.
//! Only a walk that gets out is looked at exactly: at every pose the piece must share no volume with the
//! others.
//!
//! Limits: that no way is found proves nothing. Other pieces rest.

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

/// What of a piece is so near to others is its joint, mm.
const JOINT_MM: f64 = 2.5;
/// Distance of neighbouring points of joints, mm.
const SPACING_MM: f64 = 1.0;
/// Most samples of one piece, of which those beside others count.
const MOST_SAMPLES: f64 = 1e6;
/// Most points of either side.
const MOST_POINTS: usize = 700;
/// Faces farther off limit no step, mm.
const REACH_MM: f64 = 0.6;
/// A joint that was moved so far in the mean is out, mm.
const OUT_MM: f64 = 12.0;
/// How far faces give way, mm: rims are some µm apart, and rough. With the first, wide faces share no volume
/// that counts.
const GIVE_MM: [f64; 2] = [0.001, 0.01];
/// What is kept of wider gaps, mm, for what lies between points.
const KEPT_MM: f64 = 0.04;
/// No point of the joint moves farther in a step, mm: thinner things than pins could be jumped.
const STEP_MM: f64 = 0.15;
/// A step by less gets nowhere, mm.
const LEAST_STEP_MM: f64 = 0.01;
/// Steps of one walk, and steps without coming farther before it ends.
const MOST_STEPS: usize = 400;
const MOST_STUCK: usize = 12;
/// Share of chance in the direction of a step that got on, and of one that did not: a walk along a wall must
/// find the way round its end.
const CHANCE: [f64; 2] = [0.1, 0.8];
/// Common volume of two pieces that they give way, mm³, on top of that at rest.
const SHARED_MM3: f64 = 0.05;
/// The same as a share of the piece, where that is less.
const SHARED: f64 = 1e-4;
/// Shifts and turns.
const WAYS: usize = 6;
/// Poses of a tree, for a piece that small motions hold well and for one that they do not.
const MOST_NODES: [usize; 2] = [150, 700];
/// Small motions that go farther, as multiples of the clearance and in rad for a mm of it, do not hold a
/// piece well.
const LOOSE: [f64; 2] = [4.0, 0.25];
/// Steps towards one target.
const MOST_ON: usize = 8;
/// Share of the targets that are only turned or shifted on from the farthest pose.
const ONWARDS: f64 = 0.5;
/// Targets are up to so many times as far as the farthest pose, and so much, mm.
const BEYOND: f64 = 1.3;
const BEYOND_MM: f64 = 0.5;
/// A pose must be so much farther than the one that the last walk carried on from, as a multiple and mm.
const FARTHER: f64 = 1.5;
const FARTHER_MM: f64 = 0.4;
/// Poses of a way that are kept.
const KEPT_POSES: usize = 60;

/// Where a piece is: turned about a centre, then shifted.
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
    fn written(&self) -> [f64; 6] {
        let (s, w) = (self.shift.to_array(), self.turn.to_scaled_axis().to_array());
        [s[0], s[1], s[2], w[0], w[1], w[2]]
    }
}

/// Poses that were reached.
struct Tree {
    /// Each with the one that it was reached from.
    nodes: Vec<(Pose, usize)>,
    /// The one whose joint is farthest from its place, and how far, mm.
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

    /// The node nearest to a displacement and turn, which counts by the radius.
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

    /// The poses from rest to that of `last`.
    fn path(&self, last: usize) -> Vec<Pose> {
        let mut on_way = vec![last];
        while let Some(&node) = on_way.last().filter(|node| **node != 0) {
            on_way.push(self.nodes[node].1);
        }
        on_way.into_iter().rev().map(|node| self.nodes[node].0).collect()
    }
}

/// A piece that is to be taken out past all others.
pub(super) struct Walk<'a> {
    surfaces: &'a Surfaces,
    piece: PatchId,
    center: Vec3,
    clearance_mm: f64,
    give_mm: f64,
    /// The others, and the volume of the piece, mm³, once they are needed; nothing where one is no volume.
    solids: OnceLock<Option<(Vec<Volume>, f64)>>,
    /// Points of the piece's joint, and points of others beside it with their pieces.
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
            // Corners are what meets others first.
            let points = thinned(as_met(mesh)).into_iter().chain(samples);
            let is_near = |p: &Vec3| surfaces.nearest(*p, JOINT_MM, b).is_some();
            points.filter(is_near).collect()
        };
        let own = thinned(beside(piece, &|b| b != piece));
        let ids: Vec<PatchId> = surfaces.ids().filter(|&b| b != piece).collect();
        let others = thinned(ids.iter().flat_map(|&b| beside(b, &|a| a == piece)).collect());
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

    /// The poses of a way out, from rest; `None` where none was found. Walks begin with `swings`:
    /// displacement of the centre, mm, and turn, rad.
    pub fn find(
        mut self,
        ctx: &Ctx,
        swings: &[[f64; 6]],
        pieces: &IdVec<PatchId, TriMesh>,
    ) -> Result<Option<Vec<[f64; 6]>>, Cancelled> {
        if self.own.is_empty() {
            return Ok(None);
        }
        // Along and about the axes where nothing ends a small motion.
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
                    return Ok(Some(kept(&poses)));
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

    /// The poses of a way out that a tree of poses leads to.
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
                let Some(next) = self.moved(&tree.nodes[last].0, heading) else {
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
                        return Ok(Some(kept(&poses)));
                    }
                }
            }
            if tree.nodes.len() > most_nodes {
                break;
            }
        }
        Ok(None)
    }

    /// The pose a step on.
    fn moved(&self, pose: &Pose, heading: (Vec3, Vec3)) -> Option<Pose> {
        let (shift, spin) = self.step(pose, heading)?;
        let turn = Quat::from_scaled_axis(spin);
        Some(Pose {
            turn: (turn * pose.turn).normalize(),
            shift: pose.shift + shift,
        })
    }

    /// All poses of a walk that carries on from the last of `poses` and gets out.
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
            let Some(next) = self.moved(&pose, towards) else {
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

    /// The direction, made as long for shifts as for turns, with chance.
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

    /// The joint's farthest point is so far from the centre, mm.
    fn radius_mm(&self) -> f64 {
        self.own
            .iter()
            .map(|&p| p.distance(self.center))
            .fold(1.0, f64::max)
    }

    /// How far the joint is from its place in the mean, mm.
    fn moved_mm(&self, pose: &Pose) -> f64 {
        self.own
            .iter()
            .map(|&p| pose.apply(self.center, p).distance(p))
            .sum::<f64>()
            / self.own.len() as f64
    }

    /// Whether a quarter of the joint is away from the others: what only spins in its place is not out.
    fn is_apart(&self, pose: &Pose) -> bool {
        let is_near = |p: &&Vec3| {
            self.surfaces
                .nearest(pose.apply(self.center, **p), JOINT_MM, &|b| b != self.piece)
                .is_some()
        };
        4 * self.own.iter().filter(is_near).count() < 3 * self.own.len()
    }

    /// The small motion that carries the joint's points on as they went so far: the sum of their ways, and
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
        // As far as a unit force and its moment would go: moments count by the square of the joint's size.
        let n = self.own.len() as f64;
        let size_sq = self
            .own
            .iter()
            .map(|p| p.distance_squared(self.center))
            .sum::<f64>()
            / n;
        (sum.0 / n, sum.1 / (n * size_sq.max(1.0)))
    }

    /// The step that goes farthest along `heading`: displacement of the centre and turn about it.
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

    /// What the surfaces around leave to the next step; points are from `at`.
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

    /// Whether the piece shares no more with any of the others at any pose than at rest.
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
        // With each of the others; nothing where the piece is no volume any more.
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
        for some in poses.chunks(8) {
            ctx.check()?;
            if !some
                .par_iter()
                .all(|pose| shared_mm3(pose).as_ref().is_some_and(is_free))
            {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// Some of the poses, the last among them, as they are written.
fn kept(poses: &[Pose]) -> Vec<[f64; 6]> {
    let every = poses.len().div_ceil(KEPT_POSES).max(1);
    poses
        .iter()
        .step_by(every)
        .chain(poses.last())
        .map(Pose::written)
        .collect()
}

/// The direction from the nearest place of a surface to a point, and how far it may come nearer, mm: beside
/// an edge the point may pass it. Where it touches or is inside, the triangle's normal.
fn apart(p: Vec3, near: Vec3, normal: Vec3, give_mm: f64) -> (Vec3, f64) {
    /// Less is touching, mm.
    const TOUCHING_MM: f64 = 5e-4;
    /// No step leads so far in, mm: what is farther from the surface is outside, whatever the normal beside
    /// an edge says.
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

/// No point so far from the centre moves by more than a step.
fn bounds(radius_mm: f64) -> impl Iterator<Item = Contact> {
    const WAYS: [Vec3; 6] = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    let at = move |arm: Vec3| {
        WAYS.into_iter()
            .map(move |way| limit(arm * radius_mm, way, STEP_MM / 3f64.sqrt()))
    };
    WAYS.into_iter().chain([Vec3::ZERO]).flat_map(at)
}

/// The points of a mesh as its triangles come to them: the same however they are numbered, as they are anew by readers of
/// files.
pub(super) fn as_met(mesh: &TriMesh) -> Vec<Vec3> {
    let mut is_new = vec![true; mesh.points.len()];
    let corners = mesh.triangles.iter().flatten().map(|&v| v as usize);
    let first = corners.filter(|&v| std::mem::take(&mut is_new[v]));
    first.map(|v| mesh.points[v]).collect()
}

/// Every k-th of too many points.
fn thinned(points: Vec<Vec3>) -> Vec<Vec3> {
    let every = points.len().div_ceil(MOST_POINTS).max(1);
    points.into_iter().step_by(every).collect()
}

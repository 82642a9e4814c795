//! Finishing: from bodies and runs to printable meshes.

use crate::causes::Cause;
use rayon::prelude::*;
use shellock_assembly::PressFit;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::clearance::Shape;
use shellock_geom::marching_cubes::{OffBand, contour};
use shellock_geom::rounding::{NotPrintable, printable_body};
use shellock_geom::{Aabb, Solid, TriMesh, Vec3, Volume};
use shellock_plan::LatticePlan;
use shellock_report::{Cancelled, Ctx, IdVec, PatchId, Warning};
use shellock_surface::Turn;

use super::carve::{SweptVolume, subtract_sweeps};
use super::key_parts::{Change, Grip, detents, notch};
use super::label::{self, LabelParams};
use super::relief::{Relief, relieve};
use super::ribs::{Seat, ribs};
use crate::body::{ShellBodies, ShellGrid};
use crate::connector::{ConnectorParams, Half, Run, RunStation, Section, whole_half};

/// Depth to which connectors reach into the wall they hang from, mm.
const ROOT_MM: f64 = 0.4;
/// Least share of either half that must survive the carving; below, both halves of the run are given up.
const LEAST_KEPT: f64 = 0.25;

/// Distance of ribs from the rim, mm.
const RIB_MARGIN_MM: f64 = 0.1;

/// Result of carving one run.
#[derive(Clone, Debug, PartialEq)]
pub struct FinishedJoint {
    /// The piece with the pin.
    pub male: PatchId,
    /// The piece with the channel.
    pub female: PatchId,
    /// Length along the seam, mm; 0 where the run was given up.
    pub length_mm: f64,
    /// Volume of the pin and of the channel below the wall, mm³, after carving.
    pub volume_mm3: [f64; 2],
    /// Share of each half that survived the carving, in [0, 1].
    pub intact_share: [f64; 2],
    /// Middle of the run.
    pub at: Vec3,
    /// True if the run is a rail of the key.
    pub is_rail: bool,
}

/// The finished pieces, ready to print.
pub struct Finished {
    /// One closed mesh a piece, turned, with coordinates that 32-bit floats hold.
    pub meshes: IdVec<PatchId, TriMesh>,
    /// One joint a run.
    pub joints: Vec<FinishedJoint>,
    /// Features that press on purpose on the key's way in.
    pub press_fits: Vec<PressFit>,
}

/// Reason why a piece could not be finished.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PieceError {
    /// The piece's surface cannot be written.
    #[error("piece {piece}: {reason}")]
    NotPrintable {
        /// The piece that cannot be written.
        piece: PatchId,
        /// The defect of its surface.
        reason: NotPrintable,
    },
    /// The user asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Parameters of finishing pieces.
pub struct FinishParams<'a> {
    /// Profiles and clearances of connectors.
    pub connector: &'a ConnectorParams,
    /// Least gaps of the finished pieces.
    pub relief: Relief,
    /// Least depth of ribs below the model's surface, mm.
    pub rim_mm: f64,
    /// The notch for the key, if one is wanted.
    pub grip: Option<Grip>,
    /// Parameters of engraved numbers, if wanted: the first-installed piece is 1.
    pub label: Option<LabelParams>,
    /// Final rotation of the meshes, before coordinates are rounded.
    pub turn: Turn,
}

/// Both halves of a run while they are being carved: volumes before carving, mm³, and carved shapes.
#[derive(Clone)]
struct Halves {
    raw: [f64; 2],
    shapes: [Volume; 2],
}

/// Carves every half connector in the disassembly sequence and joins it to its body. Cuts off what comes too
/// near to other pieces. Gives a key its detents and its notch, and every piece its number.
pub fn make(
    ctx: &Ctx,
    finish: &FinishParams<'_>,
    grid: &ShellGrid,
    shell: &ShellBodies,
    plan: &LatticePlan,
    runs: &[Run],
    rooms: &IdVec<PatchId, Aabb>,
) -> Result<Finished, PieceError> {
    let params = finish.connector;
    let far_mm = rooms
        .as_slice()
        .iter()
        .fold(Aabb::EMPTY, |b, r| b.union(*r))
        .diagonal();
    let halves = carved_halves(ctx, params, grid, shell, plan, runs, far_mm)?;
    let joints: Vec<FinishedJoint> = runs.iter().zip(&halves).map(|(run, h)| joint(run, h)).collect();
    let kept: Vec<Run> = runs
        .iter()
        .zip(&joints)
        .filter(|(_, j)| j.length_mm > 0.0)
        .map(|(r, _)| r.clone())
        .collect();
    ctx.stage("pieces", plan.steps.len())?;
    let mut pieces = unite(shell, &joints, &halves);
    relieve(ctx, &finish.relief, plan, &mut pieces)?;
    let (mut press_fits, mut changes) = detents(params, &kept);
    changes.extend(
        finish
            .grip
            .as_ref()
            .and_then(|grip| notch_or_warning(ctx, grip, shell)),
    );
    if params.key_rib_mm > 0.0 && !kept.iter().any(Run::is_rail) {
        let (fits, added) = ribs_of_key(ctx, params.key_rib_mm, finish.rim_mm, grid, plan, &pieces);
        press_fits.extend(fits);
        changes.extend(added);
    }
    Ok(Finished {
        meshes: make_printable(ctx, finish, grid, plan, &pieces, &changes)?,
        joints,
        press_fits,
    })
}

/// Carves both halves of each run in the disassembly sequence.
fn carved_halves(
    ctx: &Ctx,
    params: &ConnectorParams,
    grid: &ShellGrid,
    shell: &ShellBodies,
    plan: &LatticePlan,
    runs: &[Run],
    far_mm: f64,
) -> Result<Vec<Halves>, Cancelled> {
    ctx.stage("connectors", plan.steps.len())?;
    let mut halves = vec![
        Halves {
            raw: [0.0; 2],
            shapes: [Volume::empty(), Volume::empty()]
        };
        runs.len()
    ];
    let mut swept_volumes: Vec<SweptVolume> = Vec::new();
    for step in plan.removal() {
        let q = step.piece;
        let mine: Vec<(usize, usize)> = (0..runs.len())
            .flat_map(|r| {
                let male = (runs[r].male == q).then_some((r, 0));
                male.into_iter().chain((runs[r].female == q).then_some((r, 1)))
            })
            .collect();
        let whole: Vec<Volume> = mine
            .par_iter()
            .map(|&(r, h)| whole_half(params, &runs[r], [Half::Male, Half::Female][h]))
            .collect();
        let clearance_mm = mine
            .iter()
            .map(|&(r, _)| runs[r].clearance_mm())
            .fold(params.clearance_mm, f64::max);
        let room = Room::of(clearance_mm, grid, shell, q);
        let carve = |(&(r, h), whole): (&(usize, usize), &Volume)| {
            let free = room.cut(whole);
            if h == 1 {
                return (whole.volume(), subtract_sweeps(&free, &swept_volumes, far_mm));
            }
            // A corner ends where its wall does. The field of obstructions is too coarse there, and the other
            // wall's way, with the clearance of connectors around it, too wide.
            let is_partner = |w: &&SweptVolume| w.piece == runs[r].female;
            let pin = subtract_sweeps(&free, swept_volumes.iter().filter(is_partner), far_mm);
            let half = pin.union(&room.corner(params, &runs[r]));
            let strangers = swept_volumes.iter().filter(|w| !is_partner(w));
            (whole.volume(), subtract_sweeps(&half, strangers, far_mm))
        };
        let made: Vec<(f64, Volume)> = mine.par_iter().zip(&whole).map(carve).collect();
        for ((r, h), (raw, volume)) in mine.into_iter().zip(made) {
            halves[r].raw[h] = raw;
            halves[r].shapes[h] = volume;
        }
        swept_volumes.push(SweptVolume::of(params, runs, q, step.separation));
        ctx.step()?;
    }
    Ok(halves)
}

/// The notch; warns where there is none.
fn notch_or_warning(ctx: &Ctx, grip: &Grip, shell: &ShellBodies) -> Option<Change> {
    let cut = notch(grip, &shell.bodies[grip.key].to_mesh());
    if cut.is_none() {
        ctx.warn(Warning::new(
            Cause::KeyWithoutGrip,
            vec![grip.key],
            Some(grip.at.to_array()),
        ));
    }
    cut
}

/// Room for the half connectors of one piece.
struct Room<'a> {
    grid: &'a ShellGrid,
    clearance_mm: f32,
    /// Distance that the piece keeps from the cuts, mm, on all nodes.
    gap_mm: &'a [f32],
    /// Field that is positive where the piece may not be: in its way out or in a later piece's.
    keep_out: Vec<f32>,
    /// Field that is positive on the piece's own side of the cuts.
    side: Vec<f32>,
}

impl<'a> Room<'a> {
    fn of(clearance_mm: f64, grid: &'a ShellGrid, shell: &'a ShellBodies, q: PatchId) -> Self {
        let cutoff = grid.cutoff_mm();
        let (blocked, side) = rayon::join(
            || shell.keep_out[q].spread(&grid.band, cutoff),
            || shell.side[q].spread(&grid.band, -cutoff),
        );
        Self {
            grid,
            clearance_mm: clearance_mm as f32,
            gap_mm: &shell.gap_mm,
            keep_out: blocked,
            side,
        }
    }

    /// The region around `whole` where `field` is positive.
    fn region(&self, whole: &Volume, field: &dyn Fn(usize) -> f32) -> Volume {
        let (part, nodes) = self
            .grid
            .band
            .part_in(whole.bounds().grown(2.0 * self.grid.band.cell_mm()));
        let field: Vec<f32> = nodes.iter().map(|&n| field(n as usize)).collect();
        Volume::from_closed_mesh(&contour(&part, &field, OffBand::Outside)).expect("contours are manifold")
    }

    /// Least depth of connectors below the outer surface, mm.
    fn ceiling(&self) -> f32 {
        (self.grid.thickness_mm - ROOT_MM) as f32
    }

    /// Filling of the corners of a run's tongue where the tongue has room, as far off the cuts as the wall.
    fn corner(&self, params: &ConnectorParams, run: &Run) -> Volume {
        let has_tongue: Vec<bool> = run
            .stations
            .iter()
            .map(|at| self.has_tongue(params, at))
            .collect();
        let stretches = (0..has_tongue.len()).collect::<Vec<_>>();
        let stretches = stretches.chunk_by(|&i, &j| has_tongue[i] && has_tongue[j]);
        let corner = |stretch: &[usize]| {
            let stations = stretch.iter().map(|&i| run.stations[i]).collect();
            whole_half(
                params,
                &Run {
                    stations,
                    ..run.clone()
                },
                Half::Corner,
            )
        };
        let whole = Volume::union_all(stretches.filter(|s| s.len() > 1).map(corner).collect());
        if whole.is_empty() {
            return whole;
        }
        let (ceiling, depth) = (self.ceiling(), &self.grid.depth);
        whole.intersect(&self.region(&whole, &|n| {
            (self.side[n] - self.gap_mm[n]).min(depth[n] - ceiling)
        }))
    }

    /// Returns true if a tongue has room in its middle, on both sides of the seam.
    fn has_tongue(&self, params: &ConnectorParams, station: &RunStation) -> bool {
        let section = Section::at(params, station);
        let (Some(_), Some(tongue)) = (section.corner, section.male[0]) else {
            return false;
        };
        let n = 0.5 * (tongue.n0 + tongue.n1);
        let is_free = |s: f64| {
            let blocked = self.grid.band.sample(&self.keep_out, station.place(n, s));
            blocked.is_some_and(|by| by < -f64::from(self.clearance_mm))
        };
        [0.5, 0.25, -0.25]
            .into_iter()
            .all(|share| is_free(share * tongue.s0))
    }

    /// The part of `whole` that has room. It lies below the wall or a root's depth within it, and
    /// `clearance_mm` away from obstructions. From the wall of other pieces it keeps the same distance: below
    /// the wall by that much, or on the piece's own side of the cuts by the gap.
    ///
    /// A body's edge along the inner end of a seam is sharp. The single field of obstructions rounds it off
    /// by up to a third of a cell, more than the clearance. Two smooth fields, united after contouring, keep
    /// the edge. (Filling the angle in one field instead removes the connectors of narrow cavities.)
    fn cut(&self, whole: &Volume) -> Volume {
        let region = |field: &dyn Fn(usize) -> f32| self.region(whole, field);
        let (ceiling, floor) = (self.ceiling(), self.grid.thickness_mm as f32 + self.clearance_mm);
        let depth = &self.grid.depth;
        let cell = self.grid.band.cell_mm() as f32;
        // A piece's wall reaches to its gap, so its connectors must too: slots between the two would fuse.
        let away = |n: usize| {
            let below = ((depth[n] - floor) / cell).clamp(0.0, 1.0);
            self.gap_mm[n] + (self.clearance_mm - self.gap_mm[n]).max(0.0) * below
        };
        let space = region(&|n| (depth[n] - ceiling).min(-self.keep_out[n] - away(n)));
        let below = region(&|n| depth[n] - floor);
        let beside = region(&|n| self.side[n] - self.gap_mm[n]);
        let free = whole.intersect(&space);
        free.intersect(&below.union(&beside))
    }
}

fn joint(run: &Run, halves: &Halves) -> FinishedJoint {
    let volume_mm3 = [halves.shapes[0].volume(), halves.shapes[1].volume()];
    let kept = std::array::from_fn(|h| {
        if halves.raw[h] > 0.0 {
            volume_mm3[h] / halves.raw[h]
        } else {
            0.0
        }
    });
    let holds = kept.iter().all(|k| *k >= LEAST_KEPT);
    let length_mm = if holds { run.length() } else { 0.0 };
    FinishedJoint {
        male: run.male,
        female: run.female,
        length_mm,
        volume_mm3,
        intact_share: kept,
        at: run.middle(),
        is_rail: run.is_rail(),
    }
}

/// Unites the bodies with the half connectors that were kept.
fn unite(shell: &ShellBodies, joints: &[FinishedJoint], halves: &[Halves]) -> IdVec<PatchId, Volume> {
    let ids: Vec<PatchId> = shell.bodies.ids().collect();
    let pieces: Vec<Volume> = ids
        .par_iter()
        .map(|&q| {
            let mut parts = Vec::new();
            for (joint, half) in joints.iter().zip(halves).filter(|(j, _)| j.length_mm > 0.0) {
                if joint.male == q {
                    parts.push(half.shapes[0].clone());
                }
                if joint.female == q {
                    parts.push(half.shapes[1].clone());
                }
            }
            shell.bodies[q].union(&Volume::union_all(parts))
        })
        .collect();
    pieces.into_iter().collect()
}

/// Ribs around a key that slides on no rails; warns where there is no place for any.
fn ribs_of_key(
    ctx: &Ctx,
    interference_mm: f64,
    rim_mm: f64,
    grid: &ShellGrid,
    plan: &LatticePlan,
    pieces: &IdVec<PatchId, Volume>,
) -> (Vec<PressFit>, Vec<Change>) {
    let key = plan.key();
    let along = plan
        .removal()
        .next()
        .expect("a plan has a step for each piece")
        .separation
        .unit();
    let mut others = TriMesh::default();
    let mut shapes = Some(Vec::new());
    for other in pieces.ids().filter(|&p| p != key) {
        let mesh = pieces[other].to_mesh();
        let first = others.points.len() as u32;
        others.points.extend(&mesh.points);
        others
            .triangles
            .extend(mesh.triangles.iter().map(|t| t.map(|v| v + first)));
        // If one piece cannot be measured, no rib is known to fit.
        shapes = shapes.zip(Solid::new(mesh).ok()).map(|(mut shapes, solid)| {
            shapes.push(Shape::new(&solid));
            shapes
        });
    }
    let (mesh, others) = (pieces[key].to_mesh(), TriangleBvh::new(&others));
    let least_depth_mm = rim_mm + RIB_MARGIN_MM;
    let depth = |p: Vec3| grid.band.sample(&grid.depth, p).unwrap_or(f64::INFINITY);
    let made = shapes.map_or_else(Default::default, |shapes| {
        let seat = Seat {
            key,
            mesh: &mesh,
            others: &others,
            shapes: &shapes,
            along,
            least_depth_mm,
        };
        ribs(interference_mm, &seat, depth)
    });
    if made.0.is_empty() {
        ctx.warn(Warning::new(Cause::KeyWithoutRibs, vec![key], None));
    }
    made
}

/// Applies all changes and numbers to the pieces, and makes meshes that can be written.
fn make_printable(
    ctx: &Ctx,
    finish: &FinishParams<'_>,
    grid: &ShellGrid,
    plan: &LatticePlan,
    pieces: &IdVec<PatchId, Volume>,
    changes: &[Change],
) -> Result<IdVec<PatchId, TriMesh>, PieceError> {
    let ids: Vec<PatchId> = pieces.ids().collect();
    let meshes: Vec<Result<(TriMesh, bool), PieceError>> = ids
        .par_iter()
        .map(|&q| {
            let mut piece = pieces[q].clone();
            for change in changes.iter().filter(|c| c.piece == q) {
                piece = if change.is_added {
                    piece.union(&change.volume)
                } else {
                    piece.subtract(&change.volume)
                };
            }
            let number = finish
                .label
                .as_ref()
                .and_then(|params| label::cut(params, grid, plan.position(q) + 1, &piece));
            let printable = |piece: &Volume| printable_body(&finish.turn.volume(piece));
            // A number matters less than a piece that can be written.
            let numbered = number.and_then(|cut| printable(&piece.subtract(&cut)).ok());
            let has_number = numbered.is_some();
            let mesh = numbered.map_or_else(|| printable(&piece), Ok);
            ctx.step()?;
            Ok((
                mesh.map_err(|reason| PieceError::NotPrintable { piece: q, reason })?,
                has_number,
            ))
        })
        .collect();
    let meshes = meshes.into_iter().collect::<Result<Vec<_>, _>>()?;
    if finish.label.is_some() {
        warn_of_missing_numbers(
            ctx,
            ids.iter()
                .zip(&meshes)
                .filter(|(_, made)| !made.1)
                .map(|(q, _)| *q)
                .collect(),
        );
    }
    Ok(meshes.into_iter().map(|made| made.0).collect())
}

/// Warns of the pieces without a number.
fn warn_of_missing_numbers(ctx: &Ctx, pieces: Vec<PatchId>) {
    if pieces.is_empty() {
        return;
    }
    ctx.warn(Warning::new(Cause::PieceWithoutNumber, pieces, None));
}

//! Halves of connectors, carved so that every way out stays free.

use rayon::prelude::*;
use shellock_geom::Volume;
use shellock_geom::marching_cubes::{OffBand, contour};
use shellock_plan::LatticePlan;
use shellock_report::{Cancelled, Ctx, PatchId};

use super::carve::{SweptVolume, subtract_sweeps};
use super::trim::{self, Body, Left, Wall, sections_left};
use crate::body::{ShellBodies, ShellGrid};
use crate::connector::{ConnectorParams, Half, Run, RunStation, Section, whole_half, with_stops};

/// Depth to which connectors reach into the wall they hang from, mm.
const ROOT_MM: f64 = 0.4;
/// Distance that halves end inside their own wall, mm. Sides in one plane with the wall would meet it in
/// slivers, folds and slots that are thinner than a hair.
const INSET_MM: f32 = 0.03;
/// Rounds of shortening runs. What one round leaves is whole, so later ones only mend ends. The first closes
/// the new ends with stops; each further stop would take from the pin.
const MOST_TRIMS: usize = 3;

/// A run whose halves are carved: first the male one, then the female.
#[derive(Clone)]
pub(super) struct Carved {
    pub run: Run,
    pub halves: [Volume; 2],
    /// Sections of both halves, with the share that carving left.
    left: [Vec<Left>; 2],
}

impl Carved {
    /// Share of each half below the wall that carving left, in [0, 1].
    pub fn intact_share(&self) -> [f64; 2] {
        let mean = |left: &Vec<Left>| left.iter().map(|l| l.share).sum::<f64>() / left.len().max(1) as f64;
        [0, 1].map(|half| mean(&self.left[half]))
    }

    /// The stretches of the run that are left whole; `None` where all of it is. Rails end in parts of their
    /// own and stay as they are.
    fn trimmed(&self) -> Option<Vec<Run>> {
        if self.run.is_rail() {
            return None;
        }
        trim::trimmed(&self.run, [&self.left[0], &self.left[1]])
    }
}

/// Inputs that the halves of all runs share.
pub(super) struct Carver<'a> {
    pub ctx: &'a Ctx<'a>,
    pub params: &'a ConnectorParams,
    pub grid: &'a ShellGrid,
    pub shell: &'a ShellBodies,
    pub plan: &'a LatticePlan,
    /// Distance beyond which no piece meets another, mm.
    pub far_mm: f64,
}

/// Half of a run: the run's index, and 0 for the male half or 1 for the female.
type HalfId = (usize, usize);

impl Carver<'_> {
    /// Carves both halves of each run, with stops at its ends. Runs that lose a part of their section are
    /// shortened to the stretches that lose nothing, and given up where no stretch is long enough.
    pub fn carve(&self, runs: &[Run]) -> Result<Vec<Carved>, Cancelled> {
        self.ctx.stage("connectors", self.plan.steps.len())?;
        let closed: Vec<Run> = runs.iter().map(with_stops).collect();
        let mut made = self.carved(&closed, &vec![true; closed.len()], true)?;
        for round in 0..MOST_TRIMS {
            let anew = |run: Run| if round == 0 { with_stops(&run) } else { run };
            let mut next: Vec<(Run, Option<Carved>)> = Vec::new();
            for carved in made.drain(..) {
                match carved.trimmed() {
                    None => next.push((carved.run.clone(), Some(carved))),
                    Some(parts) => next.extend(parts.into_iter().map(|run| (anew(run), None))),
                }
            }
            // Shorter runs are in fewer ways, so what was whole stays so.
            let is_new: Vec<bool> = next.iter().map(|(_, carved)| carved.is_none()).collect();
            let runs: Vec<Run> = next.iter().map(|(run, _)| run.clone()).collect();
            let mut anew = self.carved(&runs, &is_new, false)?.into_iter();
            let carved = next.into_iter().map(|(_, old)| old.or_else(|| anew.next()));
            made = carved.map(|made| made.expect("each new run is carved")).collect();
        }
        Ok(made)
    }

    /// Carves both halves of the runs with `is_wanted`, in the disassembly sequence. Each piece is a step of
    /// the stage if this `counts`.
    fn carved(&self, runs: &[Run], is_wanted: &[bool], counts: bool) -> Result<Vec<Carved>, Cancelled> {
        let empty = |run: &Run| Carved {
            run: run.clone(),
            halves: [Volume::empty(), Volume::empty()],
            left: [Vec::new(), Vec::new()],
        };
        let mut made: Vec<Carved> = runs.iter().map(empty).collect();
        let mut swept_volumes: Vec<SweptVolume> = Vec::new();
        for step in self.plan.removal() {
            let q = step.piece;
            let mine: Vec<HalfId> = (0..runs.len())
                .filter(|r| is_wanted[*r])
                .flat_map(|r| [runs[r].male, runs[r].female].into_iter().zip([(r, 0), (r, 1)]))
                .filter(|(piece, _)| *piece == q)
                .map(|(_, half)| half)
                .collect();
            for ((r, h), (half, left)) in self.carved_of_piece(runs, q, &mine, &swept_volumes) {
                made[r].halves[h] = half;
                made[r].left[h] = left;
            }
            swept_volumes.push(SweptVolume::of(self.params, runs, q, step.separation));
            if counts {
                self.ctx.step()?;
            } else {
                self.ctx.check()?;
            }
        }
        let wanted = made
            .into_iter()
            .zip(is_wanted)
            .filter(|(_, is_wanted)| **is_wanted);
        Ok(wanted.map(|(made, _)| made).collect())
    }

    /// Carves the halves `mine` of piece `q` by its room and the ways of the pieces that leave before it.
    fn carved_of_piece(
        &self,
        runs: &[Run],
        q: PatchId,
        mine: &[HalfId],
        swept_volumes: &[SweptVolume],
    ) -> Vec<(HalfId, (Volume, Vec<Left>))> {
        if mine.is_empty() {
            return Vec::new();
        }
        let clearance_mm = mine
            .iter()
            .map(|&(r, _)| runs[r].clearance_mm())
            .fold(self.params.clearance_mm, f64::max);
        let room = Room::of(clearance_mm, self.grid, self.shell, q);
        let wall = Wall {
            body: Body::of(&self.shell.bodies[q]),
            thickness_mm: self.grid.thickness_mm,
            depth_mm: &|p| self.grid.band.sample(&self.grid.depth, p),
        };
        mine.par_iter()
            .map(|&(r, h)| {
                let run = &runs[r];
                let whole = whole_half(self.params, run, [Half::Male, Half::Female][h]);
                let half = self.carved_half(&room, run, h, &whole, swept_volumes);
                let parts = |section: &Section| match h {
                    0 => section.male.to_vec(),
                    _ => section.female.to_vec(),
                };
                let left = sections_left(self.params, run, &parts, [&whole, &half], &wall, clearance_mm);
                ((r, h), (half, left))
            })
            .collect()
    }

    fn carved_half(
        &self,
        room: &Room<'_>,
        run: &Run,
        h: usize,
        whole: &Volume,
        swept_volumes: &[SweptVolume],
    ) -> Volume {
        let free = room.cut(whole);
        if h == 1 {
            return subtract_sweeps(&free, swept_volumes, self.far_mm);
        }
        // A corner ends where its wall does. The field of obstructions is too coarse there, and the other
        // wall's way, with the clearance of connectors around it, too wide.
        let is_partner = |w: &&SweptVolume| w.piece == run.female;
        let pin = subtract_sweeps(&free, swept_volumes.iter().filter(is_partner), self.far_mm);
        let half = pin.union(&room.corner(self.params, run));
        let strangers = swept_volumes.iter().filter(|w| !is_partner(w));
        subtract_sweeps(&half, strangers, self.far_mm)
    }
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
        let roof = self.region(&whole, &|n| self.grid.depth[n] - self.ceiling());
        whole.intersect(&roof).intersect(&self.beside(&whole))
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
    /// A body's edge along the inner end of a seam is sharp, and so is the edge of a root. A single field
    /// rounds edges off by up to a third of a cell, more than the clearance: a root would end before its wall
    /// does, with a slot as thin as a hair beside it. Smooth fields, united and intersected after contouring,
    /// keep the edges. (Filling the angle in one field instead removes the connectors of narrow cavities.)
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
        let roof = region(&|n| depth[n] - ceiling);
        let space = region(&|n| -self.keep_out[n] - away(n));
        let below = region(&|n| depth[n] - floor);
        let free = whole.intersect(&roof).intersect(&space);
        free.intersect(&below.union(&self.beside(whole)))
    }

    /// The region around `whole` on the piece's own side of the cuts, a little within its wall.
    fn beside(&self, whole: &Volume) -> Volume {
        self.region(whole, &|n| self.side[n] - self.gap_mm[n] - INSET_MM)
    }
}

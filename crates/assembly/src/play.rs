//! Play of the pieces of a finished kit, proven for rigid motions of any size.
//!
//! The lock of [`crate::certificate`] is one of touching faces. Printed faces are a clearance apart, and a
//! piece with room can be turned past a short connector. Here the clearance counts. Contacts are taken with
//! an area, and a linear program over all of them bounds the pieces on any path from rest: first each piece
//! while all others are held, then all together with one held. docs/notes/certificate.md has the theorem; the
//! proofs go into the certificate.
//!
//! ```text
//!  surfaces ─► bearings ─► bounds ─► KitPlay
//!             (points with   (assume, find heights of barriers,
//!              barriers)      solve, widen, until it closes)
//! ```
//!
//! Limits: pieces are rigid. Bearings are sampled, so the proven play is more than the real one (by a third
//! to twice in kits). If no proof closes, the reported play is that of the first, linear program, which may
//! be less than the real one.

mod barrier;
mod bearing;
mod bound;
mod quantity;
#[cfg(test)]
mod tests;
mod way_out;

use std::collections::{BTreeMap, BTreeSet};

pub use bearing::Bearing;
use bearing::Surfaces;
use bound::{Answer, Candidates, Problem};
pub use bound::{Multipliers, Proof, Slide};
pub use quantity::Quantity;
use rayon::prelude::*;
use shellock_geom::{TriMesh, Vec3};
use shellock_report::Warning;
use way_out::Walk;

use crate::InstallationPlan;
use crate::causes::{Cause, EstimatedPlay};
use crate::motion::{LOOSE, most_play};
use crate::verify::{Check, Finding, Play};
use crate::{Cancelled, Ctx, IdVec, PatchId};

/// Distance that the key may slide on its way out within the proofs, mm: friction, ribs or a detent hold it
/// closer.
pub const SLIDE_MM: f64 = 0.3;

/// Parameters for measuring play.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlayParams {
    /// Gap left between mating faces, mm. [0, 1].
    pub clearance_mm: f64,
    /// Distance that the key may have slid on its way out, mm: friction, ribs or a detent hold it within. (0,
    /// 0.5]; 0.3.
    pub slide_mm: f64,
    /// True to also bound all pieces together if each alone is proven; takes some seconds.
    pub is_together: bool,
    /// Seed of the sample points; any number.
    pub seed: u64,
}

/// Play from a displacement, mm, and a rotation, rad.
fn play_of([shift_mm, turn]: [f64; 2], is_proven: bool) -> Play {
    Play {
        translation_mm: shift_mm,
        rotation_deg: turn.to_degrees(),
        is_proven,
    }
}

/// Piece, and poses that take it out, starting from rest: displacement of the centroid, mm, and rotation
/// vector, rad.
pub type WayOut = (PatchId, Vec<[f64; 6]>);

/// Play of a kit's pieces, with its proofs.
#[derive(Clone, Debug)]
pub struct KitPlay {
    /// Slide of the key up to which the results hold.
    pub slide: Slide,
    /// Bearings that the proofs refer to.
    pub bearings: Vec<Bearing>,
    /// Play of each piece while all others are held; `None` if nothing limits its motions.
    pub alone: IdVec<PatchId, Option<Play>>,
    /// Play of each piece for small motions, neglecting the effects of sideways motions and rotations. Closer
    /// to the real play than the proven one, but on its lower side.
    pub estimates: IdVec<PatchId, Option<Play>>,
    /// Small motions of each piece that go farthest along and about the coordinate axes: displacement of its
    /// centroid, mm, and rotation, rad.
    pub swings: IdVec<PatchId, Vec<[f64; 6]>>,
    /// Ways on which pieces other than the key can be taken out by hand. `None` if no search was made, see
    /// [`look_for_ways_out`].
    pub ways_out: Option<Vec<WayOut>>,
    /// Play of each piece while all but one move; `None` for the one that is held. Missing if it is not
    /// proven.
    pub together: Option<IdVec<PatchId, Option<Play>>>,
    /// Proofs: one for each piece whose play is proven, in order, then that of all together.
    pub proofs: Vec<Proof>,
}

impl Proof {
    /// Play that the proof gives for each free piece.
    pub fn plays(&self) -> impl Iterator<Item = (PatchId, Play)> + '_ {
        let norm = |q: usize| self.quantities[q].norm();
        let play = move |(&p, &[turn, shift]): (&PatchId, &[usize; 2])| {
            (p, play_of([norm(shift), norm(turn)], true))
        };
        self.free.iter().zip(&self.of_piece).map(play)
    }
}

/// Measures the play of finished `pieces` that are installed by `plan`, whose last step is the key. Ways out
/// are not searched.
///
/// A function of its arguments alone, on any number of threads. A kit of 13 pieces takes 3 s of processor
/// time.
pub fn measure(
    ctx: &Ctx,
    params: &PlayParams,
    pieces: &IdVec<PatchId, TriMesh>,
    plan: &InstallationPlan,
) -> Result<KitPlay, Cancelled> {
    ctx.stage("play", 0)?;
    let surfaces = Surfaces::new(pieces);
    let mut bearings = surfaces.bearings(ctx, params.clearance_mm, params.seed)?;
    let centers: IdVec<PatchId, Vec3> = pieces
        .as_slice()
        .par_iter()
        .map(TriMesh::centroid)
        .collect::<Vec<_>>()
        .into_iter()
        .collect();
    let slide = slide(params, plan, &bearings, &centers);
    let ids: Vec<PatchId> = pieces.ids().collect();
    let answers = solve_each(ctx, params, &surfaces, &mut bearings, &centers, &slide)?;
    let alone = answers.iter().map(alone).collect();
    let estimates = answers
        .iter()
        .map(|a| a.linear.first().map(|&linear| play_of(linear, false)))
        .collect();
    let swings = answers.iter().map(|a| a.swings.clone()).collect();
    let asked: BTreeSet<usize> = answers.iter().flat_map(|a| a.bearings.iter().copied()).collect();
    let mut proofs: Vec<Proof> = answers.into_iter().filter_map(|a| a.proof.ok()).collect();
    let mut together = None;
    if params.is_together && proofs.len() == ids.len() {
        let free = all_but_one(&ids, &bearings);
        let candidates = Candidates::Some(&asked);
        let question = Problem {
            surfaces: &surfaces,
            bearings: &bearings,
            candidates,
            centers: &centers,
            slide: &slide,
            free: &free,
            set_back_mm: 0.0,
        };
        if let Ok(proof) = question.solve(ctx)?.proof {
            let plays: BTreeMap<PatchId, Play> = proof.plays().collect();
            together = Some(ids.iter().map(|id| plays.get(id).copied()).collect());
            proofs.push(proof);
        }
    }
    Ok(KitPlay {
        slide,
        bearings,
        alone,
        estimates,
        swings,
        ways_out: None,
        together,
        proofs,
    })
}

/// Solves for each piece while all others are held. Bearings sampled for it are appended to `bearings`.
fn solve_each(
    ctx: &Ctx,
    params: &PlayParams,
    surfaces: &Surfaces,
    bearings: &mut Vec<Bearing>,
    centers: &IdVec<PatchId, Vec3>,
    slide: &Slide,
) -> Result<Vec<Answer>, Cancelled> {
    let solve = |bearings: &[Bearing], id: PatchId| {
        let question = Problem {
            surfaces,
            bearings,
            candidates: Candidates::All,
            centers,
            slide,
            free: &[id],
            set_back_mm: 0.0,
        };
        question.solve(ctx)
    };
    let ids: Vec<PatchId> = centers.ids().collect();
    let mut answers: Vec<Answer> = ids
        .par_iter()
        .map(|&id| solve(bearings, id))
        .collect::<Result<_, Cancelled>>()?;
    // If that is not enough, more points are sampled: the best of them are nearer to the ends of short
    // connectors.
    let again: Vec<PatchId> = ids
        .into_iter()
        .filter(|&id| is_close(&answers[usize::from(id)]))
        .collect();
    let finer: Vec<(Vec<Bearing>, Answer)> = again
        .par_iter()
        .map(|&id| {
            let finer = surfaces.finer(id, params.clearance_mm, params.seed);
            let answer = solve(&finer, id)?;
            Ok((finer, answer))
        })
        .collect::<Result<_, Cancelled>>()?;
    for (id, (finer, answer)) in again.into_iter().zip(finer) {
        answers[usize::from(id)] = answer.after(bearings.len());
        bearings.extend(finer);
    }
    Ok(answers)
}

/// Searches for ways out of the `pieces` for which `play` has no proof; the key's way out is known. A
/// function of its arguments alone, on any number of threads. A piece takes 2 to 4 s of processor time, so
/// this is for kits that pass all other checks.
pub fn look_for_ways_out(
    ctx: &Ctx,
    clearance_mm: f64,
    pieces: &IdVec<PatchId, TriMesh>,
    play: &mut KitPlay,
) -> Result<(), Cancelled> {
    let doubtful: Vec<PatchId> = play.unproven().filter(|id| *id != play.slide.key).collect();
    let found = if doubtful.is_empty() {
        Vec::new()
    } else {
        ctx.stage("ways out", 0)?;
        let surfaces = Surfaces::new(pieces);
        let walked = |id: PatchId| {
            let walk = Walk::new(&surfaces, id, pieces[id].centroid(), clearance_mm);
            Ok(walk.find(ctx, &play.swings[id], pieces)?.map(|poses| (id, poses)))
        };
        doubtful
            .into_par_iter()
            .map(walked)
            .collect::<Result<Vec<Option<WayOut>>, Cancelled>>()?
    };
    play.ways_out = Some(found.into_iter().flatten().collect());
    Ok(())
}

/// Play of each piece for small motions as in [`KitPlay::estimates`], if every printed face is set back by
/// `set_back_mm`; `None` if nothing limits its motions. Takes a second of processor time.
pub fn printed_thin(
    ctx: &Ctx,
    pieces: &IdVec<PatchId, TriMesh>,
    play: &KitPlay,
    set_back_mm: f64,
) -> Result<IdVec<PatchId, Option<Play>>, Cancelled> {
    let surfaces = Surfaces::new(pieces);
    let centers = pieces.as_slice().iter().map(TriMesh::centroid).collect();
    let small = |id: PatchId| {
        ctx.check()?;
        let question = Problem {
            surfaces: &surfaces,
            bearings: &play.bearings,
            candidates: Candidates::All,
            centers: &centers,
            slide: &play.slide,
            free: &[id],
            set_back_mm,
        };
        Ok(question
            .small_motions()
            .first()
            .map(|&linear| play_of(linear, false)))
    };
    let ids: Vec<PatchId> = pieces.ids().collect();
    let plays: Vec<Option<Play>> = ids.into_par_iter().map(small).collect::<Result<_, Cancelled>>()?;
    Ok(plays.into_iter().collect())
}

/// All pieces but the one that touches others at most points: held, it leaves the others least room.
fn all_but_one(ids: &[PatchId], bearings: &[Bearing]) -> Vec<PatchId> {
    let n_points = |id: PatchId| bearings.iter().filter(|b| b.a == id || b.b == id).count();
    // Ties go to the first piece.
    let held = ids.iter().rev().copied().max_by_key(|&id| n_points(id));
    ids.iter().copied().filter(|&id| Some(id) != held).collect()
}

/// Returns true if a proof that does not close may do so with more points.
fn is_close(answer: &Answer) -> bool {
    /// Small motions from which more points are hopeless: displacement, mm, and rotation, rad.
    const HOPELESS: [f64; 2] = [1.2, 0.05];
    let is_hopeless = answer
        .linear
        .first()
        .is_none_or(|l| l[0] > HOPELESS[0] || l[1] > HOPELESS[1]);
    answer.proof.is_err() && !is_hopeless
}

/// Play of a piece that is free while all others are at rest: proven if the proof closed, else estimated for
/// small motions; `None` without either.
fn alone(answer: &Answer) -> Option<Play> {
    match &answer.proof {
        Ok(proof) => proof.plays().next().map(|(_, play)| play),
        Err(_) => answer.linear.first().map(|&linear| play_of(linear, false)),
    }
}

/// Slide of the key along its way out, against the piece that shares most bearings with it.
fn slide(
    params: &PlayParams,
    plan: &InstallationPlan,
    bearings: &[Bearing],
    centers: &IdVec<PatchId, Vec3>,
) -> Slide {
    let key = plan.key();
    let mut n_points: BTreeMap<PatchId, usize> = BTreeMap::new();
    for b in bearings.iter().filter(|b| b.a == key || b.b == key) {
        *n_points.entry(if b.a == key { b.b } else { b.a }).or_default() += 1;
    }
    // Ties go to the first piece.
    let seat = n_points
        .iter()
        .rev()
        .max_by_key(|(_, n)| **n)
        .map_or(plan.steps[0].piece, |(seat, _)| *seat);
    let along = plan.separation(key).unit().to_array();
    Slide {
        key,
        seat,
        at: centers[key].to_array(),
        along,
        most_mm: params.slide_mm,
    }
}

/// Piece with more play than [`most_play`] allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rattle {
    /// Piece that has too much play.
    pub piece: PatchId,
    /// Play of the piece, estimated for small motions, since the proven play is more than the real one.
    pub play: Play,
    /// Play above which the piece counts as rattling, mm and degrees.
    pub most: [f64; 2],
    /// Ratio of the play to that limit, > 1.
    pub excess: f64,
    /// Centroid of the piece, mm.
    pub at: [f64; 3],
}

/// Pieces of a model of `size_mm` that rattle, the loosest first.
pub fn rattles(
    play: &KitPlay,
    pieces: &IdVec<PatchId, TriMesh>,
    size_mm: f64,
    clearance_mm: f64,
) -> Vec<Rattle> {
    let rattle = |(piece, play): (PatchId, &Option<Play>)| {
        let (play, mesh) = (play.unwrap_or(Play::ENDLESS), &pieces[piece]);
        let most = most_play(size_mm, clearance_mm, mesh.bounds().diagonal());
        Rattle {
            piece,
            play,
            most,
            excess: (play.translation_mm / most[0]).max(play.rotation_deg / most[1]),
            at: mesh.centroid().to_array(),
        }
    };
    let mut wide: Vec<Rattle> = play.estimates.iter().map(rattle).collect();
    wide.retain(|r| r.excess > 1.0);
    wide.sort_by(|a, b| b.excess.total_cmp(&a.excess));
    wide
}

/// Checks that no piece is loose: that no piece rattles by [`LOOSE`] times its limit.
pub fn check(play: &KitPlay, rattles: &[Rattle]) -> (Check, Vec<Finding>) {
    let loose = rattles.iter().filter(|r| r.excess > LOOSE);
    let findings: Vec<Finding> = loose
        .map(|r| Finding::PlayTooWide {
            piece: r.piece,
            play: r.play,
            most: r.most.map(|most| LOOSE * most),
            at: r.at,
        })
        .collect();
    let mut figure = words(play);
    if !rattles.is_empty() {
        let (n, s) = (rattles.len(), if rattles.len() == 1 { "s" } else { "" });
        figure += &format!("; {n} rattle{s}");
    }
    (
        Check::new("pieces sit within their play", findings.is_empty(), figure),
        findings,
    )
}

/// Warns of the pieces that rattle but are not loose.
pub fn warning_of_rattles(rattles: &[Rattle]) -> Option<Warning> {
    let told: Vec<&Rattle> = rattles.iter().filter(|r| r.excess <= LOOSE).collect();
    let loosest = told.first()?;
    Some(Warning::new(
        Cause::Rattles {
            loosest: EstimatedPlay {
                translation_mm: loosest.play.translation_mm,
                rotation_deg: loosest.play.rotation_deg,
            },
        },
        told.iter().map(|r| r.piece).collect(),
        Some(loosest.at),
    ))
}

/// Checks that no piece but the key was found to come out by hand; `None` if no search was made.
pub fn check_ways_out(play: &KitPlay, pieces: &IdVec<PatchId, TriMesh>) -> Option<(Check, Vec<Finding>)> {
    let found = |(piece, _): &WayOut| Finding::ComesOut {
        piece: *piece,
        at: pieces[*piece].centroid().to_array(),
    };
    let findings: Vec<Finding> = play.ways_out.as_ref()?.iter().map(found).collect();
    let open: Vec<PatchId> = play.unproven().collect();
    let figure = match open.as_slice() {
        [] => "proven for all pieces".to_owned(),
        [only] if *only == play.slide.key => "proven for all pieces but the key".to_owned(),
        open => {
            let n = open.iter().filter(|id| **id != play.slide.key).count();
            format!(
                "a way out was looked for for {n} pieces without a proof; {} found",
                findings.len()
            )
        }
    };
    Some((
        Check::new("no piece can be worked out by hand", findings.is_empty(), figure),
        findings,
    ))
}

/// Warns of the pieces whose play is not proven and that were not found to come out, with the figures of
/// small motions.
pub fn warning(play: &KitPlay) -> Option<Warning> {
    let comes_out = |id: PatchId| play.ways_out.iter().flatten().any(|way| way.0 == id);
    let open = play.alone.iter().filter_map(|(id, play)| Some((id, (*play)?)));
    let open: Vec<(PatchId, Play)> = open
        .filter(|(id, play)| !play.is_proven && !comes_out(*id))
        .collect();
    let is_searched = play.ways_out.is_some() && open.iter().any(|o| o.0 != play.slide.key);
    let figure = |o: &(PatchId, Play)| EstimatedPlay {
        translation_mm: o.1.translation_mm,
        rotation_deg: o.1.rotation_deg,
    };
    (!open.is_empty()).then(|| {
        Warning::new(
            Cause::NotProven {
                figures: open.iter().map(figure).collect(),
                is_searched,
            },
            open.iter().map(|o| o.0).collect(),
            None,
        )
    })
}

/// Widest play of the kit as a phrase, for people.
pub fn words(play: &KitPlay) -> String {
    let Some((loosest, widest)) = play.loosest() else {
        return "some piece has no end of its play".into();
    };
    let n_proven = play
        .alone
        .iter()
        .filter(|(_, play)| play.is_some_and(|p| p.is_proven))
        .count();
    let proven = if n_proven == play.alone.len() {
        "proven".to_owned()
    } else {
        format!("proven for {n_proven} of {}", play.alone.len())
    };
    let most_deg = play
        .alone
        .iter()
        .filter_map(|(_, p)| *p)
        .map(|p| p.rotation_deg)
        .fold(0.0, f64::max);
    format!(
        "within {:.1} mm and {most_deg:.1}°; loosest: piece {loosest}; {proven}",
        widest.translation_mm
    )
}

impl KitPlay {
    /// Pieces without a proof of their play.
    pub fn unproven(&self) -> impl Iterator<Item = PatchId> + '_ {
        self.alone
            .iter()
            .filter(|(_, play)| play.is_none_or(|p| !p.is_proven))
            .map(|(id, _)| id)
    }

    /// Piece with the widest play; `None` if some piece has no limit.
    pub fn loosest(&self) -> Option<(PatchId, Play)> {
        let all: Vec<(PatchId, Play)> = self
            .alone
            .iter()
            .map(|(piece, play)| Some((piece, (*play)?)))
            .collect::<Option<_>>()?;
        all.into_iter()
            .max_by(|a, b| a.1.translation_mm.total_cmp(&b.1.translation_mm))
    }
}

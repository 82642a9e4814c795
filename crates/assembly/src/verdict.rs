//! Complete verdict on an assembly's lock, in one call.

use shellock_report::Warning;

use crate::causes::Cause;
use crate::certificate::{Certificate, Evidence, PieceFile, certify};
use crate::play::{self, KitPlay, PlayParams, Rattle};
use crate::verify::clearance::{KitGaps, kit_gaps};
use crate::verify::contact::Contact;
use crate::verify::{Assembly, Finding, Verification, VerifyParams, examine, reaches_far_out};
use crate::{Cancelled, Ctx};

/// Verdict with the data that it is based on.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Verdict {
    /// Checks and their findings.
    pub verification: Verification,
    /// Contacts between the pieces.
    pub contacts: Vec<Contact>,
    /// Play of the pieces; `None` if a piece is open or the plan is broken.
    pub play: Option<KitPlay>,
    /// Least gaps between pieces, at rest and on their ways; without a model, nothing counts as rim.
    pub gaps: KitGaps,
}

/// Depth beneath the outer surface up to which gaps count as those of the rim, mm.
const RIM_MM: f64 = 1.0;

/// Verifies an assembly: pieces are closed and do not overlap, ways in are free, only the last piece moves,
/// play is within its limits, and pieces without a proof have no way out by hand.
///
/// A function of its arguments alone, on any number of threads; fails only if the user stopped. A kit of 13
/// pieces takes 5 s of processor time, and 2 to 4 s more for each piece whose play is not proven.
pub fn verify(ctx: &Ctx, params: &VerifyParams, assembly: &Assembly<'_>) -> Result<Verdict, Cancelled> {
    let (mut verification, contacts) = examine(ctx, params, assembly)?;
    let is_plan = verification.checks.first().is_some_and(|check| check.ok);
    // Barriers need closed surfaces.
    let is_open = |f: &Finding| matches!(f, Finding::NotClosed { .. } | Finding::SharedEdges { .. });
    let is_sound = is_plan && !verification.findings.iter().any(is_open) && !reaches_far_out(assembly);
    let play = if is_sound {
        let VerifyParams { clearance_mm, seed } = *params;
        let play_params = PlayParams {
            clearance_mm,
            slide_mm: play::SLIDE_MM,
            is_together: false,
            seed,
        };
        let (mut measured, _) = measure_play(ctx, &play_params, assembly, &mut verification)?;
        play::look_for_ways_out(ctx, clearance_mm, assembly.pieces, &mut measured)?;
        let ways_out = play::check_ways_out(&measured, assembly.pieces);
        ways_out.into_iter().for_each(|check| verification.add(check));
        Some(measured)
    } else {
        None
    };
    let gaps = kit_gaps(ctx, assembly.model, assembly.pieces, assembly.plan, RIM_MM)?;
    Ok(Verdict {
        verification,
        contacts,
        play,
        gaps,
    })
}

/// Measures the play of the pieces, and adds it to the verdict. Also returns the pieces that rattle.
fn measure_play(
    ctx: &Ctx,
    params: &PlayParams,
    assembly: &Assembly<'_>,
    verification: &mut Verification,
) -> Result<(KitPlay, Vec<Rattle>), Cancelled> {
    let measured = play::measure(ctx, params, assembly.pieces, assembly.plan)?;
    let size_mm = assembly.bounds().size().max_element();
    let rattles = play::rattles(&measured, assembly.pieces, size_mm, params.clearance_mm);
    verification.add(play::check(&measured, &rattles));
    Ok((measured, rattles))
}

/// Judgement of the pieces of a kit while it may still be given up for another: without exact gaps.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// Checks and their findings, those of play included.
    pub verification: Verification,
    /// Contacts between the pieces.
    pub contacts: Vec<Contact>,
    /// Play of the pieces.
    pub play: KitPlay,
    /// Pieces that rattle, the loosest first.
    pub rattles: Vec<Rattle>,
}

impl Judgement {
    /// Warnings of the pieces' play.
    pub fn warnings(&self) -> impl Iterator<Item = Warning> + use<> {
        let rattles = play::warning_of_rattles(&self.rattles);
        rattles.into_iter().chain(play::warning(&self.play))
    }
}

/// Judges closed pieces that are installed by a valid plan. Ways out are sought only for a kit that passes
/// all other checks, since that is slow. If the time is over by then, a warning says which pieces it leaves
/// open.
///
/// A function of its arguments alone, on any number of threads, as long as time is left.
pub fn judge(
    ctx: &Ctx,
    params: &VerifyParams,
    play: &PlayParams,
    assembly: &Assembly<'_>,
) -> Result<Judgement, Cancelled> {
    let (mut verification, contacts) = examine(ctx, params, assembly)?;
    let (mut measured, rattles) = measure_play(ctx, play, assembly, &mut verification)?;
    if verification.has_passed() {
        match play::look_for_ways_out(ctx, params.clearance_mm, assembly.pieces, &mut measured) {
            // A kit outlives the end of the time in it, since it only confirms what holds.
            Err(_) if ctx.is_time_over() => ctx.warn(way_out_warning(&measured)),
            searched => searched?,
        }
        let ways_out = play::check_ways_out(&measured, assembly.pieces);
        ways_out.into_iter().for_each(|check| verification.add(check));
    }
    Ok(Judgement {
        verification,
        contacts,
        play: measured,
        rattles,
    })
}

/// Warning of pieces for which no way out was sought.
fn way_out_warning(play: &KitPlay) -> Warning {
    let key = play.slide.key;
    let pieces = play.unproven().filter(|piece| *piece != key).collect();
    Warning::new(Cause::WaysOutNotSought, pieces, None)
}

impl Verdict {
    /// Certificate of everything that can be proven of the assembly, whose pieces are in `files`. `None` if
    /// the plan does not name every piece once.
    pub fn certificate(
        &self,
        files: Vec<PieceFile>,
        params: &VerifyParams,
        assembly: &Assembly<'_>,
    ) -> Option<Certificate> {
        let Self {
            verification,
            contacts,
            play,
            gaps,
        } = self;
        let evidence = Evidence {
            contacts,
            verdict: verification,
            gaps,
            play: play.as_ref(),
        };
        certify(
            files,
            assembly.pieces,
            assembly.plan,
            &evidence,
            params.clearance_mm,
        )
    }
}

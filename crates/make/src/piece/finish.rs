//! Finishing: from bodies and runs to printable meshes.

use crate::causes::Cause;
use rayon::prelude::*;
use shellock_assembly::PressFit;
use shellock_assembly::motion::Contact;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::clearance::Shape;
use shellock_geom::rounding::{NotPrintable, printable_body};
use shellock_geom::simplify::{Reach, simplify};
use shellock_geom::{Aabb, Solid, TriMesh, Vec3, Volume};
use shellock_plan::LatticePlan;
use shellock_report::{Cancelled, Ctx, IdVec, PatchId, Warning};
use shellock_surface::Turn;

use super::halves::{Carved, Carver};
use super::key_parts::{Change, Grip, detents, notch};
use super::label::{self, LabelParams};
use super::relief::{Relief, relieve};
use super::ribs::{Seat, ribs};
use crate::body::{ShellBodies, ShellGrid};
use crate::connector::{ConnectorParams, Run, contacts};

/// Greatest distance of a finished piece's surface from the one made, mm: far below what a printer resolves.
const NEAR_MM: f64 = 0.01;
/// Greatest such distance at folds, mm. Where two cuts meet at a small angle, a notch remains that is thinner
/// than a hair and up to a tenth of a millimetre deep.
const AT_FOLDS_MM: f64 = 0.12;
/// Depth below the model's surface up to which a piece's points stay in place, mm: it is seen.
const VISIBLE_MM: f64 = 0.3;
/// Distance of ribs from the rim, mm.
const RIB_MARGIN_MM: f64 = 0.1;

/// Result of carving one run.
#[derive(Clone, Debug, PartialEq)]
pub struct FinishedJoint {
    /// The piece with the pin.
    pub male: PatchId,
    /// The piece with the channel.
    pub female: PatchId,
    /// Length along the seam, mm.
    pub length_mm: f64,
    /// Volume of the pin and of the channel below the wall, mm³, after carving.
    pub volume_mm3: [f64; 2],
    /// Share of each half below the wall that carving left, in [0, 1].
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
    /// One joint a run that is left.
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

/// Connectors of a kit before they are joined to the bodies: runs with their carved halves.
pub struct Connectors(Vec<Carved>);

impl Connectors {
    /// Carves every half connector in the disassembly sequence.
    pub fn carve(
        ctx: &Ctx,
        params: &ConnectorParams,
        grid: &ShellGrid,
        shell: &ShellBodies,
        plan: &LatticePlan,
        runs: &[Run],
        rooms: &IdVec<PatchId, Aabb>,
    ) -> Result<Self, Cancelled> {
        let all = |b: Aabb, r: &Aabb| b.union(*r);
        let carver = Carver {
            ctx,
            params,
            grid,
            shell,
            plan,
            far_mm: rooms.as_slice().iter().fold(Aabb::EMPTY, all).diagonal(),
        };
        carver.carve(runs).map(Self)
    }

    /// Places where pins touch their channels, each a clearance apart.
    pub fn contacts(&self, params: &ConnectorParams) -> Vec<Contact> {
        self.0
            .iter()
            .flat_map(|made| contacts(params, &made.run))
            .collect()
    }

    /// One joint a run.
    pub fn joints(&self) -> impl Iterator<Item = FinishedJoint> {
        self.0.iter().map(joint)
    }
}

/// Joins connectors to their bodies and cuts off what comes too near to other pieces. Gives a key its detents
/// and its notch, and every piece its number.
pub fn make(
    ctx: &Ctx,
    finish: &FinishParams<'_>,
    grid: &ShellGrid,
    shell: &ShellBodies,
    plan: &LatticePlan,
    connectors: &Connectors,
) -> Result<Finished, PieceError> {
    let (params, carved) = (finish.connector, &connectors.0);
    let kept: Vec<Run> = carved.iter().map(|made| made.run.clone()).collect();
    ctx.stage("pieces", plan.steps.len())?;
    let mut pieces = unite(shell, carved);
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
        joints: connectors.joints().collect(),
        press_fits,
    })
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

fn joint(made: &Carved) -> FinishedJoint {
    let run = &made.run;
    FinishedJoint {
        male: run.male,
        female: run.female,
        length_mm: run.length(),
        volume_mm3: [made.halves[0].volume(), made.halves[1].volume()],
        intact_share: made.intact_share(),
        at: run.middle(),
        is_rail: run.is_rail(),
    }
}

/// Unites the bodies with their half connectors.
fn unite(shell: &ShellBodies, carved: &[Carved]) -> IdVec<PatchId, Volume> {
    let ids: Vec<PatchId> = shell.bodies.ids().collect();
    let pieces: Vec<Volume> = ids
        .par_iter()
        .map(|&q| {
            let halves = carved
                .iter()
                .flat_map(|made| [made.run.male, made.run.female].into_iter().zip(&made.halves));
            let own = halves
                .filter(|(piece, _)| *piece == q)
                .map(|(_, half)| half.clone());
            shell.bodies[q].union(&Volume::union_all(own.collect()))
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
    let made: Vec<Result<Printable, PieceError>> = ids
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
            // A number matters less than a piece that can be written.
            let numbered = number.and_then(|cut| printable(finish, grid, &piece.subtract(&cut)).ok());
            let has_number = numbered.is_some();
            let made = numbered.map_or_else(|| printable(finish, grid, &piece), Ok);
            let (mesh, has_few) = made.map_err(|reason| PieceError::NotPrintable { piece: q, reason })?;
            ctx.step()?;
            Ok(Printable {
                mesh,
                has_number,
                has_few,
            })
        })
        .collect();
    let made = made.into_iter().collect::<Result<Vec<_>, _>>()?;
    let pieces_that = |is_asked: fn(&Printable) -> bool| {
        let asked = ids.iter().zip(&made).filter(|(_, made)| is_asked(made));
        asked.map(|(q, _)| *q).collect::<Vec<PatchId>>()
    };
    if finish.label.is_some() {
        warn_of_missing_numbers(ctx, pieces_that(|made| !made.has_number));
    }
    for piece in pieces_that(|made| !made.has_few) {
        let number = plan.position(piece) + 1;
        ctx.note(&format!(
            "piece {number} keeps all its triangles: with fewer its surface would move or fold"
        ));
    }
    Ok(made.into_iter().map(|made| made.mesh).collect())
}

/// A piece that can be written.
struct Printable {
    mesh: TriMesh,
    has_number: bool,
    /// True if it has as few triangles as [`NEAR_MM`] allows.
    has_few: bool,
}

/// A mesh of the piece that can be written, and true if it has fewer triangles.
fn printable(
    finish: &FinishParams<'_>,
    grid: &ShellGrid,
    piece: &Volume,
) -> Result<(TriMesh, bool), NotPrintable> {
    let few = with_few_triangles(piece, |p| grid.band.sample(&grid.depth, p));
    let has_few = few.is_some();
    let mesh = printable_body(&finish.turn.volume(few.as_ref().unwrap_or(piece)))?;
    Ok((mesh, has_few))
}

/// The piece with fewer triangles, within [`NEAR_MM`], or [`AT_FOLDS_MM`] at folds, except on and just below
/// the model's surface. `None` if no other surface keeps that distance. `depth_mm` is the depth below that
/// surface, where it is known.
fn with_few_triangles(piece: &Volume, depth_mm: impl Fn(Vec3) -> Option<f64>) -> Option<Volume> {
    let solid = Solid::new(piece.to_mesh()).ok()?;
    let is_visible = |&p: &Vec3| depth_mm(p).is_some_and(|depth| depth < VISIBLE_MM);
    let points = &solid.mesh().points;
    let fixed: Vec<u32> = (0..points.len() as u32)
        .filter(|&v| is_visible(&points[v as usize]))
        .collect();
    let reach = Reach {
        within_mm: NEAR_MM,
        at_folds_mm: AT_FOLDS_MM,
    };
    let few = simplify(&solid, &fixed, reach)?;
    Volume::from_closed_mesh(few.solid.mesh()).ok()
}

/// Warns of the pieces without a number.
fn warn_of_missing_numbers(ctx: &Ctx, pieces: Vec<PatchId>) {
    if pieces.is_empty() {
        return;
    }
    ctx.warn(Warning::new(Cause::PieceWithoutNumber, pieces, None));
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use shellock_test_surfaces::sphere;

    use super::*;

    #[test]
    fn a_piece_keeps_its_visible_points_and_loses_others_that_its_shape_does_not_need() {
        const RADIUS_MM: f64 = 5.0;
        let ball = Volume::from_closed_mesh(&sphere(5, Vec3::splat(RADIUS_MM))).unwrap();
        // Only the upper half counts as visible.
        let few = with_few_triangles(&ball, |p| Some(if p.z > 0.0 { 0.0 } else { 1.0 })).unwrap();
        let points = |volume: &Volume, is_upper: bool| {
            let points = volume.to_mesh().points.into_iter();
            let half = points.filter(move |p| (p.z > 0.0) == is_upper);
            half.map(|p| p.to_array().map(f64::to_bits))
                .collect::<BTreeSet<_>>()
        };
        assert!(points(&few, true).is_superset(&points(&ball, true)));
        let [n_few, n_all] = [&few, &ball].map(|volume| points(volume, false).len());
        assert!(10 * n_few < 8 * n_all, "{n_few} of {n_all} points");
        let middles = few.to_mesh();
        for face in 0..middles.triangles.len() {
            let off_mm = RADIUS_MM - middles.face_center(face).length();
            assert!(off_mm.abs() < 0.005 + 2.0 * NEAR_MM, "{off_mm} mm");
        }
    }
}

//! Loads on the page: each with its figure, the place where it acts, the deformation, and the seam that
//! fails.

use shellock::design::Design;
use shellock::handling::{Deed, Failure};
use shellock::metric::{Deformed, DeformedLoad, GivesWay, Told, Touch};
use shellock::{PatchId, Seam, SegmentedSurface};
use shellock_geom::{TriMesh, Vec3};
use shellock_render::{ReportArrow, ReportLoad, ReportLoads, ReportPlace};

use crate::bears;
use crate::place::Standing;

/// Largest number of points in a line along a seam.
const LINE_POINTS: usize = 120;

/// All loads that the page shows, turned upright by `stand`; empty if none were simulated.
pub fn loads(design: &Design, standing: &Standing, stand: impl Fn(Vec3) -> Vec3) -> ReportLoads {
    let kit = &design.kit;
    let (carriers, places) = carriers(&kit.deformation, kit.pieces.len());
    let turned = |mesh: TriMesh| TriMesh {
        points: mesh.points.iter().map(|&p| stand(p)).collect(),
        ..mesh
    };
    let load = |load: &DeformedLoad| {
        let factor = shown_factor(load);
        let moved = |points: &Vec<usize>| points.iter().map(|&p| stand(factor * load.moved_mm[p])).collect();
        ReportLoad {
            name: bears::load_name(load.kind).to_owned(),
            figure: bears::figure(&load.capacity),
            title: bears::sentence(load.kind, &load.capacity),
            arrows: arrows(load, &stand),
            floor: floor(load).map(|[at, normal]| [stand(at).to_array(), stand(normal).to_array()]),
            place: load
                .capacity
                .first
                .map(|first| place(&kit.surface, &first, &stand)),
            moved_mm: places.iter().map(moved).collect(),
        }
    };
    let weakest = kit.holding.weakest_use().and_then(|worst| worst.first);
    let weakest = bears::weakest(&kit.holding, standing).zip(weakest);
    ReportLoads {
        title: "Loads it can take".into(),
        note: note(design),
        carriers: carriers.into_iter().map(turned).collect(),
        loads: kit.deformation.loads.iter().map(load).collect(),
        weakest: weakest.map(|(words, first)| (words, place(&kit.surface, &first, &stand))),
    }
}

/// Note that holds for all loads.
fn note(design: &Design) -> String {
    let is_there = |told| design.kit.deformation.loads.iter().any(|l| l.kind == told);
    let top = if is_there(Told::Top) {
        ""
    } else {
        " There is no press on the top: it is too narrow there, or it would tip over."
    };
    format!(
        "Figures are {}. Choose a load to see how the pieces bend and separate. The motion is exaggerated, \
         and that of the whole model is left out.{top}",
        bears::BY_SIMULATION
    )
}

/// Load factor at which a load is shown: the largest that the kit can take, where something begins to fail.
fn shown_factor(load: &DeformedLoad) -> f64 {
    let factor = bears::cap_factor(&load.capacity);
    if factor > 0.0 { factor } else { 1.0 }
}

/// Surface mesh of each piece, and the indices of its points among all.
fn carriers(deformed: &Deformed, n_pieces: usize) -> (Vec<TriMesh>, Vec<Vec<usize>>) {
    let mut places = vec![Vec::new(); n_pieces];
    let mut meshes = vec![TriMesh::default(); n_pieces];
    let mut own = vec![0; deformed.piece_of_point.len()];
    for (v, &piece) in deformed.piece_of_point.iter().enumerate() {
        own[v] = places[usize::from(piece)].len() as u32;
        places[usize::from(piece)].push(v);
        meshes[usize::from(piece)].points.push(deformed.surface.points[v]);
    }
    for t in &deformed.surface.triangles {
        let piece = deformed.piece_of_point[t[0] as usize];
        meshes[usize::from(piece)]
            .triangles
            .push(t.map(|v| own[v as usize]));
    }
    (meshes, places)
}

/// Arrows of the forces that act, labelled with their figure or role.
fn arrows(load: &DeformedLoad, stand: impl Fn(Vec3) -> Vec3) -> Vec<ReportArrow> {
    let words: [&str; 2] = match load.capacity.deed {
        Deed::GripNarrow | Deed::GripWide => ["one finger", "other finger"],
        Deed::FallUpright | Deed::Fall { .. } => ["floor", ""],
        Deed::Hang { .. } => ["held here", "weight"],
        Deed::PressTop | Deed::PressMiddle | Deed::PressSide { .. } => ["", ""],
    };
    let n = if floor(load).is_some() { 1 } else { 2 };
    let arrow = |(touch, words): (&Touch, &str)| ReportArrow {
        name: if words.is_empty() {
            bears::figure(&load.capacity)
        } else {
            words.to_owned()
        },
        tip: stand(touch.at).to_array(),
        along: stand(touch.force_n.normalize_or_zero()).to_array(),
    };
    load.touches.iter().take(n).zip(words).map(arrow).collect()
}

/// A point of the floor and its normal, for loads with a floor.
fn floor(load: &DeformedLoad) -> Option<[Vec3; 2]> {
    let touch = match load.capacity.deed {
        Deed::PressTop | Deed::PressMiddle | Deed::PressSide { .. } => load.touches.get(1),
        Deed::FallUpright | Deed::Fall { .. } => load.touches.first(),
        Deed::GripNarrow | Deed::GripWide | Deed::Hang { .. } => None,
    }?;
    Some([touch.at, touch.force_n.try_normalize()?])
}

/// Place where a kit fails, and the seam through it.
fn place(surface: &SegmentedSurface, first: &GivesWay, stand: impl Fn(Vec3) -> Vec3) -> ReportPlace {
    let [a, b] = first.between;
    let name = match first.how {
        Failure::Opens => format!("the seam between pieces {a} and {b} opens here"),
        Failure::PinYields => format!("the pins between pieces {a} and {b} bend here"),
        Failure::WallYields => format!("the walls of pieces {a} and {b} yield here"),
    };
    let line = seam_through(surface, first.between, Vec3::from(first.at));
    let rounded = |p: Vec3| stand(p).to_array().map(|x| (100.0 * x).round() / 100.0);
    ReportPlace {
        name,
        at: stand(Vec3::from(first.at)).to_array(),
        lines: line
            .map(|points| points.into_iter().map(rounded).collect())
            .into_iter()
            .collect(),
        piece: usize::from(a),
    }
}

/// Points, in order, of the seam between two pieces that comes nearest to a place; a loop ends where it
/// begins.
fn seam_through(surface: &SegmentedSurface, between: [PatchId; 2], at: Vec3) -> Option<Vec<Vec3>> {
    let distance = |seam: &Seam| {
        let distances = seam.points.iter().map(|p| p.distance(at));
        distances.fold(f64::INFINITY, f64::min)
    };
    let seams = surface.seams();
    let own = seams
        .into_iter()
        .filter(|s| between.contains(&s.a) && between.contains(&s.b));
    let nearest = own.min_by(|x, y| distance(x).total_cmp(&distance(y)))?;
    // A picture needs fewer points than a seam has.
    let n = nearest.points.len() - 1;
    let every = n.div_ceil(LINE_POINTS).max(1);
    let last = nearest.points.last().filter(|_| !n.is_multiple_of(every));
    Some(
        nearest
            .points
            .iter()
            .step_by(every)
            .chain(last)
            .copied()
            .collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two pyramids on a hexagon, halved: the two pieces meet along a loop in the plane y = 0.
    fn two_halves() -> SegmentedSurface {
        let rim = (0..6).map(|i| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::FRAC_PI_3).sin_cos();
            Vec3::new(cos, sin, 0.0)
        });
        let sides = (0..6).map(|i| [2 + i, 2 + (i + 1) % 6]);
        let triangles = sides.flat_map(|[u, v]| [[0, u, v], [1, v, u]]).collect();
        let mesh = TriMesh {
            points: [Vec3::Z, -Vec3::Z].into_iter().chain(rim).collect(),
            triangles,
        };
        SegmentedSurface {
            mesh,
            patch_of_face: (0..12).map(|i| PatchId(i / 6)).collect(),
            source_face: (0..12).collect(),
            n_patches: 2,
        }
    }

    #[test]
    fn a_seam_is_one_line_through_the_points_that_both_pieces_have() {
        let surface = two_halves();
        let pieces = [PatchId(1), PatchId(0)];
        let line = seam_through(&surface, pieces, Vec3::X).unwrap();
        assert!(
            line.len() >= 3 && line.iter().all(|p| p.y.abs() < 1e-12),
            "{line:?}"
        );
        assert!(seam_through(&surface, [PatchId(0); 2], Vec3::X).is_none());
    }

    #[test]
    fn carriers_have_all_points_and_triangles_once() {
        let surface = two_halves();
        let deformed = Deformed {
            surface: TriMesh {
                points: (0..6).map(|i| Vec3::splat(f64::from(i))).collect(),
                triangles: vec![[0, 2, 4], [5, 3, 1]],
            },
            piece_of_point: (0..6).map(|i| PatchId(i % 2)).collect(),
            loads: Vec::new(),
        };
        let (meshes, places) = carriers(&deformed, surface.n_patches);
        assert_eq!(places, [[0, 2, 4], [1, 3, 5]]);
        assert_eq!(meshes[0].triangles, [[0, 1, 2]]);
        assert_eq!(meshes[1].triangles, [[2, 1, 0]]);
        assert_eq!(meshes[1].points[0], Vec3::splat(1.0));
    }
}

use shellock_geom::Volume;
use shellock_testkit::shapes::{contoured_ball, cuboid};

use super::*;

/// A bowl: half a hollow ball, its rim on z = 0, its skin above.
fn bowl() -> TriMesh {
    let ball = |r: f64| Volume::from_closed_mesh(&contoured_ball(r, 1.0)).unwrap();
    ball(20.0)
        .subtract(&ball(18.0))
        .intersect(&cuboid([-30.0, -30.0, 0.0], [30.0; 3]))
        .to_mesh()
}

fn printable<'a>(mesh: &'a TriMesh, skin: Skin<'a>) -> Printable<'a> {
    Printable {
        mesh,
        simple: mesh,
        skin,
    }
}

fn on_plate(laid: &Laid, mesh: &TriMesh) -> Aabb {
    Aabb::around(mesh.points.iter().map(|&p| laid.place(p)))
}

#[test]
fn a_bowl_lies_with_no_support_on_its_skin() {
    let (mesh, ball) = (bowl(), contoured_ball(20.0, 1.0));
    let skin = TriangleBvh::new(&ball);
    for printer in [Printer::sla(), Printer::fdm()] {
        let plates = lay(&printer, Slicing::USUAL, &[printable(&mesh, Skin::On(&skin))]);
        let laid = plates.poses[0];
        assert_eq!(laid.outer_support_mm2, 0.0, "{}", printer.name);
        assert!(laid.support_mm2 > 0.0, "its inner side hangs over");
    }
}

#[test]
fn pieces_are_only_moved_stand_on_the_plate_and_keep_their_distance() {
    let blocks: Vec<TriMesh> = (1..9)
        .map(|i| {
            cuboid([0.0; 3], [10.0 * f64::from(i), 30.0, 5.0])
                .translate(Vec3::new(70.0, -40.0, 9.0))
                .to_mesh()
        })
        .collect();
    let pieces: Vec<Printable> = blocks.iter().map(|b| printable(b, Skin::None)).collect();
    let printer = Printer {
        bed_mm: [100.0, 80.0, 90.0],
        ..Printer::fdm()
    };
    let plates = lay(&printer, Slicing::USUAL, &pieces);
    assert_eq!((plates.poses.len(), plates.too_large.len()), (8, 0));
    let boxes: Vec<Aabb> = plates
        .poses
        .iter()
        .map(|l| on_plate(l, pieces[l.piece].mesh))
        .collect();
    for (i, (laid, mine)) in plates.poses.iter().zip(&boxes).enumerate() {
        assert!(
            mine.min.z.abs() < 1e-9 && mine.min.x > 3.9 && mine.max.x < 96.1 && mine.max.y < 76.1,
            "{mine:?}"
        );
        assert!((mine.size() - Vec3::from_array(laid.size_mm)).length() < 1e-9);
        let [x, y, z] = laid.axes.map(Vec3::from_array);
        assert!(
            (x.cross(y) - z).length() < 1e-12 && x.dot(y).abs() < 1e-12,
            "turned, not mirrored"
        );
        for (other, theirs) in plates.poses.iter().zip(&boxes).take(i) {
            assert!(
                laid.plate != other.plate || !mine.grown(7.9).intersects(*theirs),
                "pieces {i} and {}",
                other.piece
            );
        }
    }
}

#[test]
fn what_the_printer_cannot_make_is_told_and_what_fits_slantwise_is_made() {
    let rod = cuboid([0.0; 3], [280.0, 4.0, 4.0]).to_mesh();
    let long = cuboid([0.0; 3], [400.0, 4.0, 4.0]).to_mesh();
    // The diagonal of 212 × 212 mm is 300.
    let plates = lay(
        &Printer::fdm(),
        Slicing::USUAL,
        &[printable(&rod, Skin::None), printable(&long, Skin::None)],
    );
    assert_eq!(
        (plates.too_large, plates.poses.len(), plates.n_plates),
        (vec![1], 1, 1)
    );
    assert!(fits_whole(
        &Printer::fdm(),
        Aabb {
            min: Vec3::ZERO,
            max: Vec3::new(240.0, 200.0, 210.0)
        }
    ));
    assert!(!fits_whole(&Printer::fdm(), rod.bounds()));
}

#[test]
fn nothing_needs_no_plate_and_a_flat_mesh_is_no_piece() {
    assert_eq!(lay(&Printer::sla(), Slicing::USUAL, &[]), Plates::default());
    let flat = TriMesh {
        points: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2]],
    };
    assert_eq!(
        lay(&Printer::sla(), Slicing::USUAL, &[printable(&flat, Skin::All)]).too_large,
        [0]
    );
}

#[test]
fn swaps_make_plates_no_worse_and_lose_no_piece() {
    let printer = Printer {
        bed_mm: [100.0, 80.0, 100.0],
        ..Printer::sla()
    };
    let room = room_mm(&printer);
    let mut n_better = 0;
    for seed in 0..6 {
        let side = |i: u32, factor: u32, range: u32| f64::from(10 + (i + 7 * seed) * factor % range);
        let boxes: Vec<TriMesh> = (0..12)
            .map(|i| cuboid([0.0; 3], [side(i, 37, 50), side(i, 53, 40), side(i, 29, 20)]).to_mesh())
            .collect();
        let poses: Vec<(usize, Pose)> = boxes
            .iter()
            .map(|mesh| orient::best(&printer, Slicing::USUAL, &printable(mesh, Skin::None), room).unwrap())
            .enumerate()
            .collect();
        let order: Vec<usize> = (0..poses.len()).collect();
        let before = pack_in_order(&printer, &poses, &order).cost(&poses);
        let after = improve(&printer, &poses, order.clone());
        assert!(after.cost(&poses) <= before);
        n_better += usize::from(after.cost(&poses) < before);
        let mut packed: Vec<usize> = after.0.iter().map(|(at, _)| *at).collect();
        packed.sort_unstable();
        assert_eq!(packed, order);
    }
    assert!(n_better >= 3, "{n_better}");
}

#[test]
fn poses_that_are_found_on_a_simple_mesh_cost_about_as_much_as_those_of_the_piece_itself() {
    let mesh = bowl();
    let simple = decimate(mesh.clone(), &vec![SIMPLE_MM; mesh.points.len()]);
    assert!(2 * simple.triangles.len() < mesh.triangles.len());
    for printer in [Printer::sla(), Printer::fdm()] {
        let by = |simple| {
            let piece = Printable {
                simple,
                ..printable(&mesh, Skin::All)
            };
            lay(&printer, Slicing::USUAL, &[piece]).poses[0]
        };
        let (exact, quick) = (by(&mesh), by(&simple));
        let seconds = |laid: &Laid| crate::time::seconds(&printer, &laid.load);
        assert!(
            seconds(&quick) < 1.03 * seconds(&exact),
            "{}: {quick:?}, {exact:?}",
            printer.name
        );
        // Figures are those of the piece, whichever mesh the pose was found on.
        let axes = [0, 1, 2].map(|row| Vec3::from_array(quick.axes.map(|column| column[row])));
        let volume_mm3 = Load::of(&mesh, axes, &printer, Slicing::USUAL).volume_mm3;
        assert_eq!(quick.load.volume_mm3, volume_mm3);
    }
}

use shellock_mechanics::{Joint, sample};

use super::*;

/// Connector size D: the middle of the paper's 2 to 4.
const SIZE_MM: f64 = 3.0;

/// Joins every station; friction holds part `fast`.
fn join(assembly: &ShellAssembly, degrees: f64, fast: Option<u32>) -> Vec<Meeting> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let joint = |s: &Station| {
        let leaves = s.normal * cos + s.across * sin;
        let is_fast = s
            .points
            .iter()
            .any(|p| Some(assembly.part_of_point[*p as usize]) == fast);
        let joint = Joint {
            male: Side::A,
            leaves,
            is_fast,
            pull_on_a: leaves,
            weight: 1.0,
            size_mm: SIZE_MM,
        };
        Meeting {
            wall: s.across,
            joint: Some(joint),
        }
    };
    assembly.stations.iter().map(joint).collect()
}

#[test]
fn plates_on_a_straight_seam_come_apart() {
    let plates = sample::plates(30.0, 15.0, [10, 5]);
    let model = VolumeModel::new(&VolumeParams::default(), &plates).unwrap();
    for degrees in [-90.0, -45.0, 0.0, 45.0] {
        assert_eq!(
            model.resist(&join(&plates, degrees, None), 0).unwrap(),
            Resistance::Separable(vec![1])
        );
    }
}

/// Pins straight below a straight seam leave a plate two translations and a rotation. Walls across these hold
/// it, each in its one direction, so none of the walls may be missing or reversed.
#[test]
fn walls_block_what_pins_leave_free_each_in_one_direction() {
    let plates = sample::plates(30.0, 15.0, [6, 3]);
    let model = VolumeModel::new(&VolumeParams::default(), &plates).unwrap();
    let with_walls = |walls: [Vec3; 5]| {
        let mut plan = join(&plates, 0.0, None);
        plan.iter_mut()
            .zip(walls)
            .for_each(|(meeting, wall)| meeting.wall = wall);
        model.resist(&plan, 0).unwrap()
    };
    // Both ends keep b from going down; in between, one station each keeps b from sliding to either side.
    let walls = [Vec3::Z, Vec3::Y, -Vec3::Y, Vec3::X, Vec3::Z];
    assert!(matches!(with_walls(walls), Resistance::Holds(_)));
    for i in [0, 1, 2, 4] {
        let mut turned = walls;
        turned[i] = -turned[i];
        assert_eq!(with_walls(turned), Resistance::Separable(vec![1]));
        turned[i] = Vec3::X;
        assert_eq!(with_walls(turned), Resistance::Separable(vec![1]));
    }
}

#[test]
fn walls_alone_hold_no_octant() {
    let ball = sample::ball(20.0, 4);
    let model = VolumeModel::new(&VolumeParams::default(), &ball).unwrap();
    let plan: Vec<Meeting> = ball
        .stations
        .iter()
        .map(|s| Meeting {
            wall: s.across,
            joint: None,
        })
        .collect();
    assert_eq!(
        model.resist(&plan, 7).unwrap(),
        Resistance::Separable((0..7).collect())
    );
}

/// Two clamped plates with the pins pulled straight out: a wall across their way is the only obstacle.
#[test]
fn a_wall_bears_what_presses_on_it_and_does_not_stick() {
    let plates = sample::plates(20.0, 20.0, [8, 8]);
    let clamped: Vec<u32> = (0..)
        .zip(&plates.points)
        .filter(|(_, p)| p.x.abs() > 19.9)
        .map(|(i, _)| i)
        .collect();
    let model = VolumeModel::with_clamp(&VolumeParams::default(), &plates, &clamped).unwrap();
    let opening = |wall: Vec3| {
        let mut plan = join(&plates, 0.0, None);
        plan.iter_mut().for_each(|meeting| meeting.wall = wall);
        let moved = model.equilibrium(&plan, None).unwrap().unwrap().displacement_mm;
        moved
            .iter()
            .map(|[a, b]| (a[0] - b[0]).z)
            .fold(f64::NEG_INFINITY, f64::max)
    };
    let open = opening(-Vec3::Z);
    assert!(open > 1e-3, "{open} mm");
    assert!(
        opening(Vec3::Z).abs() < 0.02 * open,
        "{} mm of {open} mm",
        opening(Vec3::Z)
    );
}

/// Along a great circle, half of the ball may turn against the other half: each of the three circles frees
/// one rotation.
#[test]
fn octants_turn_about_great_circles_unless_friction_holds_one_of_them() {
    let ball = sample::ball(20.0, 4);
    let sliding = VolumeModel::new(&VolumeParams::default(), &ball).unwrap();
    assert_eq!(
        sliding.resist(&join(&ball, 0.0, None), 7).unwrap(),
        Resistance::Separable((0..7).collect())
    );
    let sticking = sliding.resist(&join(&ball, 0.0, Some(7)), 7).unwrap();
    let Resistance::Holds(opening) = sticking else {
        panic!("it comes apart")
    };
    assert!(
        opening.quality_mm < -1e-6 && opening.quality_mm > -0.1,
        "{opening:?}"
    );
}

/// Contact is exact: parts that touch may not enter each other by as little as a millionth of the opening.
#[test]
fn connectors_enter_each_other_nowhere_and_where_friction_holds_they_do_not_move_at_all() {
    let ball = sample::ball(20.0, 4);
    let model = VolumeModel::new(&VolumeParams::default(), &ball).unwrap();
    let plan = join(&ball, -30.0, Some(7));
    let moved = model
        .equilibrium(&plan, Some(7))
        .unwrap()
        .unwrap()
        .displacement_mm;
    let gaps_mm: Vec<[Vec3; 2]> = moved
        .iter()
        .map(|[a, b]| [0, 1].map(|pair| a[pair] - b[pair]))
        .collect();
    let widest_mm = gaps_mm
        .iter()
        .flatten()
        .map(|gap| gap.length())
        .fold(0.0, f64::max);
    for ((station, meeting), gaps) in ball.stations.iter().zip(&plan).zip(gaps_mm) {
        let joint = meeting.joint.unwrap();
        let n = station.tangent.cross(joint.leaves);
        for gap in gaps {
            assert!(
                gap.dot(n).abs() < 1e-6 * widest_mm,
                "{gap} across the channel of {widest_mm} mm"
            );
            assert!(
                gap.dot(joint.leaves) > -1e-6 * widest_mm,
                "{gap} into the channel of {widest_mm} mm"
            );
            assert!(
                !joint.is_fast || gap.length() < 1e-6 * widest_mm,
                "{gap} in spite of friction of {widest_mm} mm"
            );
        }
    }
}

/// Root and tip lie along ŝ, so a connector that turns about n moves its tip along the seam by the depth of
/// the pin more than its root. Reading the root alone would miss that.
#[test]
fn the_opening_is_that_of_the_tip_where_a_connector_turns() {
    let ball = sample::ball(20.0, 4);
    let model = VolumeModel::new(&VolumeParams::default(), &ball).unwrap();
    let plan = join(&ball, -30.0, Some(7));
    let moved = model
        .equilibrium(&plan, Some(7))
        .unwrap()
        .unwrap()
        .displacement_mm;
    let Resistance::Holds(opening) = model.resist(&plan, 7).unwrap() else {
        panic!("it comes apart")
    };
    let [mut n_by_root, mut n_by_tip] = [0; 2];
    for ([a, b], opening_mm) in moved.iter().zip(&opening.opening_mm) {
        let [root_mm, tip_mm] = [0, 1].map(|pair| a[pair].distance(b[pair]));
        assert!((opening_mm - root_mm.max(tip_mm)).abs() < 1e-12);
        n_by_root += usize::from(root_mm > 1.01 * tip_mm);
        n_by_tip += usize::from(tip_mm > 1.01 * root_mm);
    }
    assert!(n_by_root > 0 && n_by_tip > 0, "{n_by_root} {n_by_tip}");
}

/// The row of the walls' faces is read off the nodes, rigid motions off the place: both must refer to the
/// point at mid-wall.
#[test]
fn the_row_of_a_wall_sees_rigid_motions_as_its_point_at_mid_wall_does() {
    let ball = sample::ball(20.0, 4);
    let model = VolumeModel::new(&VolumeParams::default(), &ball).unwrap();
    let plan = join(&ball, 20.0, None);
    let (labels, part) = (model.labels(3), &model.parts[3]);
    let (fronts, sides) = (model.wall_fronts(3, &plan, labels), model.sides_of_part(3));
    let rigid = part.rigid.unwrap();
    let mut n_seen = 0;
    for (front, (station, side)) in fronts.iter().zip(sides) {
        let n = front.ids.len();
        assert_eq!(front.ids[n - 1], labels.row(station, super::WALL));
        let place = model.mid_wall(station, side);
        assert!((place.length() - 19.0).abs() < 1e-9, "{place}");
        let along = super::rows::off_the_wall(&plan[station], side);
        for motion in 0..6 {
            let at_node = |id: u32| {
                let node = part.seam_nodes[id as usize / 3] as usize;
                rigid.at(model.wall.nodes[node])[motion].to_array()[id as usize % 3]
            };
            let seen: f64 = (0..n - 1)
                .map(|i| front.values[n - 1 + n * i] * at_node(front.ids[i]))
                .sum();
            assert!(
                (seen - rigid.at(place)[motion].dot(along)).abs() < 1e-9,
                "motion {motion} at station {station}"
            );
        }
        n_seen += 1;
    }
    assert_eq!(n_seen, 9);
}

/// One plate alone, `[length, width]` mm, clamped at its far edge or not at all; its stiffness is condensed
/// onto all points near the seam.
fn strip(order: Order, clamp: bool) -> (VolumeModel, ShellAssembly) {
    let plates = sample::plates(5.0, 40.0, [4, 20]);
    let is_far = |p: &shellock_geom::Vec3| p.x.abs() > 40.0 - 1e-9;
    let clamped: Vec<u32> = (0..)
        .zip(&plates.points)
        .filter(|(_, p)| clamp && is_far(p))
        .map(|(i, _)| i)
        .collect();
    // Without lateral contraction the clamp does not stiffen the strip, and beam theory is right.
    let material = Material {
        poissons_ratio: 0.0,
        ..Material::SLA_RESIN
    };
    let params = VolumeParams {
        order,
        material,
        ..VolumeParams::default()
    };
    (
        VolumeModel::with_clamp(&params, &plates, &clamped).unwrap(),
        plates,
    )
}

/// Deflection of a strip's tip, mm, under 1 N spread over its end face; and the value by beam theory.
fn tip_deflection(order: Order) -> (f64, f64) {
    let (model, _) = strip(order, true);
    let part = &model.parts[0];
    let n = part.stiffness.ids.len();
    // The load is one more row; its remaining diagonal is minus the work of the load.
    let mut loaded = Front {
        ids: (0..=n as u32).collect(),
        values: vec![0.0; (n + 1) * (n + 1)],
    };
    let end: Vec<usize> = (0..part.seam_nodes.len())
        .filter(|i| model.wall.nodes[part.seam_nodes[*i] as usize].x > -1e-9)
        .collect();
    for &i in &end {
        loaded.values[n + (n + 1) * (3 * i + 2)] = 1.0 / end.len() as f64;
    }
    let left = Front::condense(&[&part.stiffness, &loaded], |id| id < n as u32).unwrap();
    let (force, length, width, depth, e) = (1.0, 40.0_f64, 5.0, 2.0_f64, 2000.0);
    (
        -left.values[0],
        force * length.powi(3) / (3.0 * e * width * depth.powi(3) / 12.0),
    )
}

#[test]
fn a_cantilever_bends_as_a_beam_with_quadratic_elements_and_locks_with_linear_ones() {
    let (quadratic, beam) = tip_deflection(Order::Quadratic);
    assert!(
        (quadratic / beam - 1.0).abs() < 0.02,
        "{quadratic} mm, beam {beam} mm"
    );
    let (linear, _) = tip_deflection(Order::Linear);
    assert!(linear < 0.8 * beam, "{linear} mm, beam {beam} mm");
}

/// Under uniform strain, internal forces vanish away from the surface and balance as a whole. Tested with the
/// work, which is the strain energy density times the volume.
#[test]
fn uniform_strain_has_its_exact_energy() {
    let corners =
        [[0.1, 0.0, 0.2], [2.0, 0.3, 0.0], [0.4, 1.7, 0.1], [0.3, 0.2, 1.1]].map(shellock_geom::Vec3::from);
    let material = Material::SLA_RESIN;
    let (lambda, mu) = element::lame(&material);
    let gradient = [[0.3, 0.1, -0.2], [0.0, -0.4, 0.5], [0.2, 0.6, 0.7]];
    let moved = |x: shellock_geom::Vec3| gradient.map(|row| shellock_geom::Vec3::from(row).dot(x));
    let strain = |i: usize, j: usize| 0.5 * (gradient[i][j] + gradient[j][i]);
    let trace: f64 = (0..3).map(|i| strain(i, i)).sum();
    let square: f64 = (0..9).map(|at| strain(at / 3, at % 3).powi(2)).sum();
    let expected = (lambda * trace * trace + 2.0 * mu * square) * element::volume_6(corners) / 6.0;
    for order in [Order::Linear, Order::Quadratic] {
        let mut places = corners.to_vec();
        places.extend(element::EDGES.map(|[i, j]| (corners[i] + corners[j]) / 2.0));
        let u: Vec<[f64; 3]> = places.into_iter().map(moved).collect();
        let mut energy = 0.0;
        element::stiffness(order, corners, (lambda, mu), |a, b, k| {
            let work: f64 = (0..9)
                .map(|at| u[a][at / 3] * k[at / 3][at % 3] * u[b][at % 3])
                .sum();
            energy += work * if a == b { 1.0 } else { 2.0 };
        });
        assert!(
            (energy / expected - 1.0).abs() < 1e-9,
            "{order:?}: {energy} for {expected}"
        );
    }
}

/// Stress of a bar that is pulled along one axis and free across it.
#[test]
fn uniaxial_strain_with_lateral_contraction_has_the_stress_of_a_bar() {
    for (_, material) in Material::PRESETS {
        let (e_mpa, nu) = (material.youngs_modulus_mpa, material.poissons_ratio);
        let (lambda, mu) = element::lame(&material);
        let strain = [1.0, -nu, -nu];
        let stress = strain.map(|x| lambda * strain.iter().sum::<f64>() + 2.0 * mu * x);
        assert!(
            (stress[0] / e_mpa - 1.0).abs() < 1e-12 && stress[1].abs() < 1e-9 * e_mpa,
            "{stress:?}"
        );
    }
}

/// Channels of any tilt: n, ŝ and u are perpendicular to each other, and both sides see them with opposite
/// signs.
#[test]
fn contact_acts_along_three_perpendicular_directions_and_each_side_bears_its_share_of_the_force() {
    let ball = sample::ball(20.0, 4);
    let params = VolumeParams::default();
    let model = VolumeModel::new(&params, &ball).unwrap();
    for degrees in [-90.0, -30.0, 0.0, 45.0] {
        for [a, b] in super::bars::sections(&model, &join(&ball, degrees, None))
            .iter()
            .zip(&ball.stations)
            .map(|(sides, station)| {
                let sides = sides
                    .each_ref()
                    .map(|s| s.as_ref().expect("every station is joined"));
                let force_n = params.force_n_per_mm * station.length_mm;
                assert!((sides[0].load().0.length() - force_n).abs() < 1e-12);
                assert!((sides[0].load().0 + sides[1].load().0).length() < 1e-12);
                sides
            })
        {
            for pair in [0, 3] {
                let along = |side: &super::connector::Section| -> Vec<Vec3> {
                    side.rows()
                        .filter(|r| (pair..pair + 3).contains(&r.0))
                        .map(|r| r.1)
                        .collect()
                };
                let (of_a, of_b) = (along(a), along(b));
                for i in 0..3 {
                    assert!((of_a[i].length() - 1.0).abs() < 1e-9 && (of_a[i] + of_b[i]).length() < 1e-9);
                    assert!(
                        of_a[i].dot(of_a[(i + 1) % 3]).abs() < 1e-9,
                        "{degrees}°: {of_a:?}"
                    );
                }
            }
        }
    }
}

/// Patch test: a free wall whose near nodes move uniformly exerts forces on them that balance, and rigid
/// motions cost nothing.
#[test]
fn rigid_motions_of_a_free_wall_are_held_by_its_springs_alone() {
    let (model, _) = strip(Order::Quadratic, false);
    let part = &model.parts[0];
    let (n, k) = (part.stiffness.ids.len(), &part.stiffness.values);
    let rigid = part.rigid.unwrap();
    let spring = {
        let one: f64 = 3.0_f64.recip() * n as f64;
        let moved: f64 = (0..n / 3)
            .flat_map(|i| (0..n / 3).map(move |j| (3 * i, 3 * j)))
            .map(|(i, j)| k[i.max(j) + n * i.min(j)])
            .sum();
        moved / one
    };
    let at = |node: usize| rigid.at(model.wall.nodes[part.seam_nodes[node] as usize]);
    for m in 0..6 {
        let u: Vec<f64> = (0..n / 3).flat_map(|i| at(i)[m].to_array()).collect();
        for row in 0..n {
            let force: f64 = (0..n).map(|j| k[row.max(j) + n * row.min(j)] * u[j]).sum();
            assert!(
                (force - spring * u[row]).abs() < 1e-7 * spring,
                "motion {m}, row {row}: {force}"
            );
        }
    }
}

#[test]
fn every_tetrahedron_of_a_ball_is_sound() {
    let model = VolumeModel::new(&VolumeParams::default(), &sample::ball(20.0, 6)).unwrap();
    assert_eq!((model.n_tets(), model.wall().n_thinned), (8 * 36 * 3, 0));
    for tet in 0..model.n_tets() {
        let corners = model.wall().corners(tet);
        assert!(element::volume_6(corners) > 0.0);
        let normals = element::gradients(corners);
        for [i, j] in element::EDGES {
            let dihedral = (-normals[i].normalize().dot(normals[j].normalize()))
                .acos()
                .to_degrees();
            assert!((15.0..165.0).contains(&dihedral), "{dihedral}° in {tet}");
        }
    }
}

/// A ball with a radius below its wall thickness: at the requested depth, prisms would turn over at the
/// centre.
#[test]
fn where_no_wall_fits_it_is_thinner_and_sound() {
    let params = VolumeParams {
        wall_mm: 6.0,
        ..VolumeParams::default()
    };
    let model = VolumeModel::new(&params, &sample::ball(5.0, 4)).unwrap();
    assert!(model.wall().n_thinned > 0);
    assert!((0..model.n_tets()).all(|t| element::volume_6(model.wall().corners(t)) > 0.0));
    assert!(model.wall().depth_mm.iter().all(|d| *d < 5.0));
}

/// A ball with one triangle pinched to a needle: its middle corner lies on the opposite edge.
#[test]
fn a_flat_triangle_is_left_out_and_the_others_carry_the_load() {
    let mut ball = sample::ball(20.0, 16);
    let is_inner = |t: &[u32; 3]| {
        let on_seam = |p: &u32| ball.stations.iter().any(|s| s.points.contains(p));
        !t.iter().any(on_seam)
    };
    let flat = ball.triangles.iter().position(is_inner).unwrap();
    let [a, b, c] = ball.triangles[flat].map(|p| p as usize);
    ball.points[a] = ball.points[b].midpoint(ball.points[c]);
    let model = VolumeModel::new(&VolumeParams::default(), &ball).unwrap();
    assert_eq!(model.wall().n_left_out, 1);
    assert_eq!(model.n_tets(), 3 * (ball.triangles.len() - 1));
    assert!((0..model.n_tets()).all(|t| element::volume_6(model.wall().corners(t)) > 0.0));
    assert!(matches!(
        model.resist(&join(&ball, 0.0, Some(7)), 7),
        Ok(Resistance::Holds(_))
    ));
}

fn quality(params: &VolumeParams, degrees: f64) -> f64 {
    let ball = sample::ball(15.0, 4);
    let model = VolumeModel::new(params, &ball).unwrap();
    match model.resist(&join(&ball, degrees, Some(7)), 7).unwrap() {
        Resistance::Holds(opening) => opening.quality_mm,
        Resistance::Separable(parts) => panic!("{parts:?} come off"),
    }
}

#[test]
fn the_coarsest_and_the_finest_tolerance_agree_on_the_quality() {
    let with = |tolerance| {
        quality(
            &VolumeParams {
                tolerance,
                ..VolumeParams::default()
            },
            -30.0,
        )
    };
    let (coarse, fine) = (with(1e-2), with(1e-12));
    assert!((coarse / fine - 1.0).abs() < 0.01, "{coarse} {fine}");
}

#[test]
fn openings_are_proportional_to_force_over_stiffness() {
    let params = VolumeParams::default();
    let q = quality(&params, 0.0);
    let twice = VolumeParams {
        force_n_per_mm: 2.0 * params.force_n_per_mm,
        ..params
    };
    assert!((quality(&twice, 0.0) / q - 2.0).abs() < 1e-6);
    let stiff = Material {
        youngs_modulus_mpa: 8000.0,
        ..params.material
    };
    assert!(
        (quality(
            &VolumeParams {
                material: stiff,
                ..params
            },
            0.0
        ) / q
            - 0.25)
            .abs()
            < 1e-6
    );
}

#[test]
fn odd_input_is_refused() {
    let plates = sample::plates(10.0, 5.0, [4, 2]);
    let model = VolumeModel::new(&VolumeParams::default(), &plates).unwrap();
    assert_eq!(
        model.resist(
            &[Meeting {
                wall: Vec3::X,
                joint: None
            }],
            0
        ),
        Err(VolumeError::Joints {
            joints: 1,
            stations: 3
        })
    );
    assert_eq!(
        model.resist(
            &[Meeting {
                wall: Vec3::X,
                joint: None
            }; 3],
            2
        ),
        Err(VolumeError::NoSuchPart(2))
    );
    assert_eq!(
        model.resist(
            &[Meeting {
                wall: Vec3::X,
                joint: None
            }; 3],
            0
        ),
        Ok(Resistance::Separable(vec![1]))
    );
    let thick = VolumeParams {
        wall_mm: f64::NAN,
        n_layers: 0,
        ..VolumeParams::default()
    };
    assert_eq!(thick.problems().len(), 2);
    assert!(VolumeModel::new(&thick, &plates).is_err());
    let mut flat = plates;
    flat.normals.fill(shellock_geom::Vec3::X);
    assert_eq!(
        VolumeModel::new(&VolumeParams::default(), &flat).unwrap_err(),
        VolumeError::FlatTriangle(0)
    );
}

#[test]
fn every_joint_has_connectors_of_its_seams_length_whatever_its_neighbours_are() {
    let ball = sample::ball(20.0, 6);
    let model = VolumeModel::new(&VolumeParams::default(), &ball).unwrap();
    let mut plan = join(&ball, 0.0, None);
    for (i, meeting) in plan.iter_mut().enumerate() {
        meeting.joint = meeting.joint.filter(|_| i % 5 != 0);
        if let Some(joint) = meeting.joint.as_mut().filter(|_| i % 3 == 0) {
            joint.male = joint.male.other();
        }
    }
    let sections = super::bars::sections(&model, &plan);
    let bars = super::bars::bars(&model, &plan, &sections);
    assert!(bars.iter().any(|bar| bar.to.is_ok()) && bars.iter().any(|bar| bar.to.is_err()));
    for (i, meeting) in plan.iter().enumerate() {
        for side in shellock_mechanics::SIDES {
            let n_bars = bars
                .iter()
                .filter(|bar| bar.side == side && bar.stations().any(|s| s == i))
                .count();
            assert_eq!(n_bars, if meeting.joint.is_some() { 2 } else { 0 }, "station {i}");
        }
    }
}

#[test]
fn a_joint_that_stands_alone_holds_no_octant() {
    let ball = sample::ball(20.0, 4);
    let model = VolumeModel::new(&VolumeParams::default(), &ball).unwrap();
    let mut plan = join(&ball, 0.0, None);
    let alone = ball.steps[0][0] as usize;
    plan.iter_mut()
        .enumerate()
        .filter(|(i, _)| *i != alone)
        .for_each(|(_, m)| m.joint = None);
    assert!(matches!(model.resist(&plan, 7), Ok(Resistance::Separable(_))));
}

#[test]
fn pins_that_slide_out_of_their_channels_do_not_hold() {
    let ball = sample::ball(20.0, 4);
    let plan = join(&ball, -0.7, Some(7));
    let at = |force_n_per_mm| {
        VolumeModel::new(
            &VolumeParams {
                force_n_per_mm,
                ..VolumeParams::default()
            },
            &ball,
        )
    };
    let Resistance::Holds(opening) = at(0.01).unwrap().resist(&plan, 7).unwrap() else {
        panic!("does not hold")
    };
    let widest_mm = opening.opening_mm.iter().copied().fold(0.0, f64::max);
    let lost_mm = 0.6 * SIZE_MM;
    let force = |share: f64| 0.01 * share * lost_mm / widest_mm;
    assert!(matches!(
        at(force(0.99)).unwrap().resist(&plan, 7).unwrap(),
        Resistance::Holds(_)
    ));
    assert!(matches!(
        at(force(1.01)).unwrap().resist(&plan, 7).unwrap(),
        Resistance::Separable(_)
    ));
}

/// Points of `assembly` with a height beyond `z`, upwards or downwards.
fn beyond(assembly: &ShellAssembly, z: f64) -> Vec<u32> {
    let is_beyond = |p: &Vec3| if z > 0.0 { p.z > z } else { p.z < z };
    (0..)
        .zip(&assembly.points)
        .filter(|(_, p)| is_beyond(p))
        .map(|(i, _)| i)
        .collect()
}

/// Ball pressed on its top with `force_n`, with its bottom held if `is_held`.
fn press(force_n: f64, connector_mm: f64, is_held: bool) -> Loaded {
    let ball = sample::ball(20.0, 4);
    let params = VolumeParams::default();
    let held = if is_held { beyond(&ball, -17.0) } else { Vec::new() };
    let model = VolumeModel::with_clamp(&params, &ball, &held).unwrap();
    let top = beyond(&ball, 17.0);
    let mut forces_n = vec![Vec3::ZERO; ball.points.len()];
    top.iter()
        .for_each(|&p| forces_n[p as usize] = -Vec3::Z * force_n / top.len() as f64);
    let mut plan = join(&ball, -30.0, Some(7));
    plan.iter_mut()
        .filter_map(|m| m.joint.as_mut())
        .for_each(|joint| joint.size_mm = connector_mm);
    model.under_load(&plan, &forces_n).unwrap().unwrap()
}

#[test]
fn forces_on_every_part_of_a_pressed_ball_balance_and_all_grows_with_the_force() {
    let (once, twice) = (press(10.0, 3.0, true), press(20.0, 3.0, true));
    assert!(once.imbalance < 1e-6 && once.lost.is_empty(), "{once:?}");
    let widest = |l: &Loaded| l.opening_mm.iter().copied().fold(0.0, f64::max);
    assert!((widest(&twice) / widest(&once) - 2.0).abs() < 1e-5);
    assert!((twice.walls.largest_mpa / once.walls.largest_mpa - 2.0).abs() < 1e-5);
    assert!((twice.connectors.robust_mpa / once.connectors.robust_mpa - 2.0).abs() < 1e-5);
    assert!(once.walls.robust_mpa > 0.0 && once.walls.robust_mpa <= once.walls.largest_mpa);
}

#[test]
fn smaller_connectors_open_wider_and_are_stressed_more() {
    let (whole, half) = (press(10.0, 3.0, true), press(10.0, 1.5, true));
    let widest = |l: &Loaded| l.opening_mm.iter().copied().fold(0.0, f64::max);
    assert!(
        widest(&half) > widest(&whole),
        "{} {}",
        widest(&half),
        widest(&whole)
    );
    assert!(half.connectors.robust_mpa > whole.connectors.robust_mpa);
}

#[test]
fn a_struck_ball_that_nothing_holds_is_balanced_by_its_inertia() {
    let struck = press(10.0, 3.0, false);
    assert!(
        struck.imbalance < 1e-6 && struck.lost.is_empty(),
        "{}",
        struck.imbalance
    );
    // The reference part's forces are in no equation: they balance because inertia balances the whole.
    let ball = sample::ball(20.0, 4);
    let model = VolumeModel::new(&VolumeParams::default(), &ball).unwrap();
    let mut forces_n = vec![Vec3::ZERO; ball.points.len()];
    forces_n[5] = Vec3::new(1.0, -2.0, 3.0);
    let loads_n = model.balance_forces(&forces_n).unwrap();
    let torque: Vec3 = loads_n
        .iter()
        .zip(&model.wall().nodes)
        .map(|(f, x)| x.cross(*f))
        .sum();
    assert!(
        loads_n.iter().sum::<Vec3>().length() < 1e-9 && torque.length() < 1e-8,
        "{torque}"
    );
}

#[test]
fn a_balls_mass_is_its_walls_volume_times_density() {
    let ball = sample::ball(20.0, 8);
    let mass_t = VolumeModel::new(&VolumeParams::default(), &ball)
        .unwrap()
        .mass_t();
    let wall_mm3 = 4.0 / 3.0 * std::f64::consts::PI * (20.0_f64.powi(3) - 18.0_f64.powi(3));
    assert!((mass_t / (wall_mm3 * 1.15e-9) - 1.0).abs() < 0.05, "{mass_t} t");
}

/// Stress is measured away from the held and the pulled end.
#[test]
fn a_plate_pulled_at_its_outer_face_has_the_stress_of_a_bar() {
    let (model, plates) = strip(Order::Quadratic, true);
    let end: Vec<u32> = (0..)
        .zip(&plates.points)
        .filter(|(i, p)| p.x == 0.0 && plates.part_of_point[*i as usize] == 0)
        .map(|(i, _)| i)
        .collect();
    let mut forces_n = vec![Vec3::ZERO; plates.points.len()];
    end.iter()
        .for_each(|&p| forces_n[p as usize] = Vec3::X * 10.0 / end.len() as f64);
    let plan: Vec<Meeting> = plates
        .stations
        .iter()
        .map(|s| Meeting {
            wall: -s.across,
            joint: None,
        })
        .collect();
    let loaded = model.under_load(&plan, &forces_n).unwrap().unwrap();
    // Pulled at the outer face of 2 mm: N/A + M/W = (1 + 3) F / (b h), all of which is von Mises stress.
    let expected_mpa = 4.0 * 10.0 / (5.0 * 2.0);
    let middle = plates
        .triangles
        .iter()
        .zip(&loaded.triangle_mpa)
        .filter(|(t, _)| {
            t.iter().all(|&p| {
                (p as usize) < plates.points.len() / 2
                    && (-30.0..-10.0).contains(&plates.points[p as usize].x)
            })
        });
    let largest_mpa = middle.map(|(_, mpa)| *mpa).fold(0.0, f64::max);
    assert!(
        (largest_mpa / expected_mpa - 1.0).abs() < 0.1,
        "{largest_mpa} MPa, a bar has {expected_mpa} MPa"
    );
}

/// Condensation onto the seams, and one sparse system: two ways to the same compliance.
#[test]
fn a_clamped_part_yields_to_its_contacts_alike_for_plans_and_for_loads() {
    let plates = sample::plates(20.0, 10.0, [5, 3]);
    let clamped: Vec<u32> = (0..)
        .zip(&plates.points)
        .filter(|(_, p)| p.x.abs() > 9.9)
        .map(|(i, _)| i)
        .collect();
    let model = VolumeModel::with_clamp(&VolumeParams::default(), &plates, &clamped).unwrap();
    let plan = join(&plates, 20.0, None);
    let sections = super::bars::sections(&model, &plan);
    let bars = super::bars::bars(&model, &plan, &sections);
    let loads_n = vec![Vec3::ZERO; model.wall.nodes.len()];
    for part in 0..2 {
        let condensed = model.response(part, false, &plan, &sections, &bars).unwrap();
        let mut body = super::load::Body::new(&model, part, &plan, &sections, &bars).unwrap();
        let sparse = body.load(&model, &plan, &sections, &loads_n);
        assert_eq!(condensed.rows, sparse.rows);
        let n = condensed.rows.len();
        let largest = condensed.compliance.iter().copied().fold(0.0, f64::max);
        for at in (0..n * n).filter(|at| at % n >= at / n) {
            let difference = condensed.compliance[at] - sparse.compliance[at];
            assert!(
                difference.abs() < 1e-7 * largest,
                "{difference} of {largest} at {at}"
            );
        }
    }
}

#[test]
fn forces_that_are_none_are_refused() {
    let plates = sample::plates(10.0, 5.0, [4, 2]);
    let model = VolumeModel::new(&VolumeParams::default(), &plates).unwrap();
    let plan = join(&plates, 0.0, None);
    let n = plates.points.len();
    assert_eq!(
        model.under_load(&plan, &[]),
        Err(VolumeError::Forces { forces: 0, points: n })
    );
    assert!(model.under_load(&plan, &vec![Vec3::splat(f64::NAN); n]).is_err());
    assert!(model.under_load(&[], &vec![Vec3::ZERO; n]).is_err());
}

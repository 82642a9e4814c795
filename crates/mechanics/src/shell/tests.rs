use shellock_geom::{TriMesh, Vec3};

use super::*;

/// Patch of irregular triangles in the plane z = 0 with its corners at ±10, and the points on its border.
fn patch() -> (TriMesh, Vec<bool>) {
    let n = 5;
    let points = (0..n * n).map(|at| {
        let (i, j) = (at % n, at / n);
        let is_inside = [i, j].iter().all(|k| (1..n - 1).contains(k));
        // Fixed offsets of up to a quarter of a cell.
        let wave = |k: i32| {
            if is_inside {
                1.2 * (f64::from(at * k)).sin()
            } else {
                0.0
            }
        };
        Vec3::new(
            f64::from(i) * 5.0 - 10.0 + wave(7),
            f64::from(j) * 5.0 - 10.0 + wave(11),
            0.0,
        )
    });
    let triangles = (0..(n - 1) * (n - 1)).flat_map(|cell| {
        let a = (cell / (n - 1) * n + cell % (n - 1)) as u32;
        let [b, c, d] = [a + 1, a + n as u32 + 1, a + n as u32];
        if cell % 2 == 0 {
            [[a, b, c], [a, c, d]]
        } else {
            [[a, b, d], [b, c, d]]
        }
    });
    let mesh = TriMesh {
        points: points.collect(),
        triangles: triangles.collect(),
    };
    let is_border = mesh
        .points
        .iter()
        .map(|p| p.x.abs().max(p.y.abs()) > 9.99)
        .collect();
    (mesh, is_border)
}

/// Closed surface of 2 n² points, 40 mm by 30 mm by 20 mm, not symmetric.
fn pebble(n: u32) -> TriMesh {
    let [around, up] = [2 * n, n];
    let mut points = vec![Vec3::Z * -10.0, Vec3::Z * 10.0];
    for j in 1..up {
        for i in 0..around {
            let (a, b) = (
                std::f64::consts::PI * f64::from(i) / f64::from(n),
                std::f64::consts::PI * f64::from(j) / f64::from(n),
            );
            points.push(Vec3::new(
                20.0 * a.cos() * b.sin() + 3.0 * b.cos(),
                15.0 * a.sin() * b.sin(),
                -10.0 * b.cos(),
            ));
        }
    }
    let at = |i: u32, j: u32| match j {
        0 => 0,
        j if j == up => 1,
        j => 2 + (j - 1) * around + i % around,
    };
    let triangles = (0..up)
        .flat_map(|j| (0..around).map(move |i| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        });
    TriMesh {
        points,
        triangles: triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect(),
    }
}

fn model(mesh: &TriMesh) -> ShellModel {
    ShellModel::new(mesh, &Material::SLA_RESIN).unwrap()
}

/// Forces (moves) and moments (turns) that displacements cause in a shell of thickness `h`.
fn forces(model: &ShellModel, h: f64, u: &Displacements) -> LoadCase {
    let mut stiffness = model.pattern.clone();
    for (value, (m, b)) in stiffness
        .values_mut()
        .iter_mut()
        .zip(model.membrane.iter().zip(&model.bending))
    {
        *value = h * m + h.powi(3) * b;
    }
    let dofs: Vec<f64> = (u.moves_mm.iter().zip(&u.turns_rad))
        .flat_map(|(u, r)| u.to_array().into_iter().chain(r.to_array()))
        .collect();
    let loads = stiffness.times(&dofs);
    LoadCase {
        forces_n: loads.chunks(6).map(|l| Vec3::from_slice(&l[..3])).collect(),
        moments_n_mm: loads.chunks(6).map(|l| Vec3::from_slice(&l[3..])).collect(),
        anchors: Vec::new(),
    }
}

fn field(mesh: &TriMesh, of: impl Fn(Vec3) -> (Vec3, Vec3)) -> Displacements {
    let (moves_mm, turns_rad) = mesh.points.iter().map(|p| of(*p)).unzip();
    Displacements { moves_mm, turns_rad }
}

fn largest(vectors: &[Vec3]) -> f64 {
    vectors.iter().map(|v| v.length()).fold(0.0, f64::max)
}

/// Load case that pushes the lower part of `mesh` up and sideways, and holds the upper part.
fn push(mesh: &TriMesh) -> LoadCase {
    let forces_n = mesh.points.iter().map(|p| {
        if p.z < -6.0 {
            Vec3::new(0.2, -0.1, 0.5)
        } else {
            Vec3::ZERO
        }
    });
    let held = (0..).zip(&mesh.points).filter(|(_, p)| p.z > 5.0).map(|(v, _)| v);
    LoadCase {
        forces_n: forces_n.collect(),
        anchors: held.collect(),
        ..LoadCase::default()
    }
}

#[test]
fn rigid_motions_call_up_no_force() {
    let mesh = pebble(6);
    let model = model(&mesh);
    let turn = Vec3::new(0.3, -0.7, 0.5);
    let moved = field(&mesh, |p| (turn.cross(p) + Vec3::new(2.0, 1.0, -3.0), turn));
    let bent = field(&mesh, |p| {
        (Vec3::new(p.x * p.y, p.z * p.z, p.x * p.x) * 0.05, turn)
    });
    let (none, some) = (forces(&model, 2.0, &moved), forces(&model, 2.0, &bent));
    assert!(largest(&none.forces_n) < 1e-11 * largest(&some.forces_n));
    assert!(largest(&none.moments_n_mm) < 1e-11 * largest(&some.moments_n_mm));
}

#[test]
fn a_patch_that_is_stretched_evenly_has_even_stress_and_no_force_inside() {
    let (mesh, is_border) = patch();
    let model = model(&mesh);
    // ε_x = 1e-3, ε_y = −2e-3, γ = 1e-3, with a rotation of 2e-3 in the plane.
    let u = field(&mesh, |p| {
        (
            Vec3::new(p.x - 1.5 * p.y, 2.5 * p.x - 2.0 * p.y, 0.0) * 1e-3,
            Vec3::Z * 2e-3,
        )
    });
    let case = forces(&model, 2.0, &u);
    for (v, is_border) in is_border.iter().enumerate() {
        assert!(*is_border || (case.forces_n[v].length() < 1e-10 && case.moments_n_mm[v].length() < 1e-10));
    }
    // The share of the tractions at each corner of the border follows from the stress alone.
    let stress = model.elasticity * nalgebra::Vector3::new(1e-3, -2e-3, 1e-3);
    let half_side = 2.5 * 2.0;
    let corner = mesh.points.iter().position(|p| p.x > 9.99 && p.y > 9.99).unwrap();
    let expected = Vec3::new(stress.x + stress.z, stress.z + stress.y, 0.0) * half_side;
    assert!(case.forces_n[corner].distance(expected) < 1e-10);

    let solver = model.at_thickness(2.0).unwrap();
    let solved = solver.solve(&[case]).unwrap();
    for stresses in [solver.stresses(&u), solver.stresses(&solved[0])] {
        let mean = 0.5 * (stress.x + stress.y);
        let radius = (0.5 * (stress.x - stress.y)).hypot(stress.z);
        for s in stresses.iter().flat_map(|s| [s.outer, s.inner]) {
            assert!((s.principal_mpa[0] - mean - radius).abs() < 1e-8);
            assert!((s.principal_mpa[1] - mean + radius).abs() < 1e-8);
        }
    }
}

#[test]
fn a_patch_that_is_bent_evenly_has_even_curvature_and_no_force_inside() {
    let (mesh, is_border) = patch();
    let model = model(&mesh);
    // w = (x² − 2 y² + 3 x y) / 1000; the rotations are its slopes.
    let u = field(&mesh, |Vec3 { x, y, .. }| {
        let slopes = [2.0 * x + 3.0 * y, 3.0 * x - 4.0 * y];
        (
            Vec3::Z * (x * x - 2.0 * y * y + 3.0 * x * y) * 1e-3,
            Vec3::new(slopes[1], -slopes[0], 0.0) * 1e-3,
        )
    });
    let case = forces(&model, 2.0, &u);
    for (v, is_border) in is_border.iter().enumerate() {
        assert!(*is_border || (case.forces_n[v].length() < 1e-10 && case.moments_n_mm[v].length() < 1e-10));
    }
    let solver = model.at_thickness(2.0).unwrap();
    let solved = solver.solve(&[case]).unwrap();
    // Strains at the outer face, 1 mm from the middle: −w″.
    let stress = model.elasticity * nalgebra::Vector3::new(-2e-3, 4e-3, -6e-3);
    let von_mises =
        (stress.x * stress.x - stress.x * stress.y + stress.y * stress.y + 3.0 * stress.z * stress.z).sqrt();
    for stresses in [solver.stresses(&u), solver.stresses(&solved[0])] {
        for s in stresses {
            assert!(
                (s.outer.von_mises_mpa - von_mises).abs() < 1e-8
                    && (s.inner.von_mises_mpa - von_mises).abs() < 1e-8
            );
            assert!((s.outer.principal_mpa[0] + s.inner.principal_mpa[1]).abs() < 1e-8);
            assert!((s.outer.principal_mpa[0] + s.outer.principal_mpa[1] - stress.x - stress.y).abs() < 1e-8);
        }
    }
}

#[test]
fn a_sphere_under_pressure_has_stress_p_r_over_2_h_at_every_thickness() {
    let mesh = sphere(50.0, 16);
    let shell = model(&mesh);
    let pressure_mpa = 0.1;
    let mut forces_n = vec![Vec3::ZERO; mesh.points.len()];
    for (t, corners) in mesh.triangles.iter().enumerate() {
        corners
            .iter()
            .for_each(|&v| forces_n[v as usize] += mesh.double_area_vector(t) * (pressure_mpa / 6.0));
    }
    for thickness_mm in [0.5, 1.0, 2.0] {
        let solver = shell.at_thickness(thickness_mm).unwrap();
        let case = LoadCase {
            forces_n: forces_n.clone(),
            ..LoadCase::default()
        };
        let expected = pressure_mpa * 50.0 / (2.0 * thickness_mm);
        let stresses = solver.stresses(&solver.solve(&[case]).unwrap()[0]);
        let mean = stresses
            .iter()
            .map(|s| 0.5 * (s.outer.von_mises_mpa + s.inner.von_mises_mpa))
            .sum::<f64>();
        let mean = mean / stresses.len() as f64;
        assert!((mean / expected - 1.0).abs() < 0.005, "{mean} for {expected}");
        let worst = stresses
            .iter()
            .map(|s| (s.von_mises_mpa() / expected - 1.0).abs())
            .fold(0.0, f64::max);
        assert!(worst < 0.06, "{worst} at {thickness_mm} mm");
    }
}

/// Octahedron with edges split into `n`, projected onto a sphere.
fn sphere(radius: f64, n: i32) -> TriMesh {
    let mut mesh = TriMesh::default();
    let mut index = std::collections::BTreeMap::new();
    for signs in 0..8 {
        let sign = [0, 1, 2].map(|bit| if signs >> bit & 1 == 0 { 1 } else { -1 });
        let mut at = |i: i32, j: i32| {
            let key = [i * sign[0], j * sign[1], (n - i - j) * sign[2]];
            *index.entry(key).or_insert_with(|| {
                mesh.points
                    .push(Vec3::from_array(key.map(f64::from)).normalize() * radius);
                mesh.points.len() as u32 - 1
            })
        };
        let mut triangles = Vec::new();
        for (i, j) in (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j))) {
            triangles.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
            if i + j < n - 1 {
                triangles.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
        let is_outward = sign.iter().product::<i32>() > 0;
        mesh.triangles.extend(
            triangles
                .into_iter()
                .map(|[a, b, c]| if is_outward { [a, b, c] } else { [a, c, b] }),
        );
    }
    mesh
}

#[test]
fn a_region_holds_in_the_mean_with_a_reaction_that_is_linear_in_place() {
    let mesh = pebble(10);
    let model = model(&mesh);
    let case = push(&mesh);
    let u = model
        .at_thickness(1.5)
        .unwrap()
        .solve(std::slice::from_ref(&case))
        .unwrap()
        .remove(0);
    let areas = model.areas_mm2();
    let (mut shift, mut turn) = (Vec3::ZERO, Vec3::ZERO);
    for &v in &case.anchors {
        shift += u.moves_mm[v as usize] * areas[v as usize];
        turn += mesh.points[v as usize].cross(u.moves_mm[v as usize]) * areas[v as usize];
    }
    let area: f64 = case.anchors.iter().map(|&v| areas[v as usize]).sum();
    assert!(
        shift.length() < 1e-9 * area * largest(&u.moves_mm)
            && turn.length() < 1e-8 * area * largest(&u.moves_mm)
    );

    // Forces caused by the displacements: the case's loads, and the reaction where it is held.
    let called_up = forces(&model, 1.5, &u);
    let reactions: Vec<Vec3> = called_up
        .forces_n
        .iter()
        .zip(&case.forces_n)
        .map(|(a, b)| *a - *b)
        .collect();
    let scale = largest(&case.forces_n);
    let is_held = |v: usize| case.anchors.contains(&(v as u32));
    for v in (0..mesh.points.len()).filter(|&v| !is_held(v)) {
        assert!(reactions[v].length() < 1e-6 * scale, "{v}: {}", reactions[v]);
    }
    assert!(largest(&called_up.moments_n_mm) < 1e-6 * scale);
    // For a traction a + b × x, the difference between two places is perpendicular to their distance.
    for pair in case.anchors.windows(2) {
        let [p, q] = [pair[0], pair[1]].map(|v| v as usize);
        let difference = reactions[p] / areas[p] - reactions[q] / areas[q];
        assert!(difference.dot(mesh.points[p] - mesh.points[q]).abs() < 1e-6 * scale);
    }
}

#[test]
fn which_nodes_hold_the_free_shell_does_not_matter() {
    let mesh = pebble(10);
    let n = mesh.points.len() as u32;
    let mut turned = mesh.clone();
    turned.points.reverse();
    turned
        .triangles
        .iter_mut()
        .flatten()
        .for_each(|v| *v = n - 1 - *v);
    let [here, there] = [&mesh, &turned].map(|mesh| {
        let model = model(mesh);
        let solver = model.at_thickness(1.0).unwrap();
        let u = solver.solve(&[push(mesh)]).unwrap().remove(0);
        solver.stresses(&u)
    });
    let most = here.iter().map(ShellStress::von_mises_mpa).fold(0.0, f64::max);
    for (a, b) in here.iter().zip(&there) {
        assert!((a.von_mises_mpa() - b.von_mises_mpa()).abs() < 1e-6 * most);
    }
}

#[test]
fn supports_carry_what_equilibrium_demands_and_do_not_move() {
    let mesh = pebble(8);
    let model = model(&mesh);
    let case = push(&mesh);
    let supports: Vec<Support> = case
        .anchors
        .iter()
        .map(|&point| Support {
            point,
            is_held: [true; 6],
        })
        .collect();
    let case = LoadCase {
        anchors: Vec::new(),
        ..case
    };
    let solver = model.at_thickness_with(1.5, &supports).unwrap();
    let u = solver.solve(std::slice::from_ref(&case)).unwrap().remove(0);
    assert!(
        supports
            .iter()
            .all(|s| u.moves_mm[s.point as usize] == Vec3::ZERO)
    );
    let called_up = forces(&model, 1.5, &u);
    let reaction: Vec3 = supports
        .iter()
        .map(|s| called_up.forces_n[s.point as usize])
        .sum();
    let load: Vec3 = case.forces_n.iter().sum();
    assert!((reaction + load).length() < 1e-7 * load.length());
    let again = solver.solve(&[LoadCase {
        anchors: vec![0],
        ..case
    }]);
    assert_eq!(again.unwrap_err(), ShellError::HeldTwice { case: 0 });
}

#[test]
fn parts_hold_on_their_own() {
    let mut mesh = pebble(6);
    let n = mesh.points.len() as u32;
    let other = mesh.clone();
    mesh.points
        .extend(other.points.iter().map(|p| *p + Vec3::X * 100.0));
    mesh.triangles
        .extend(other.triangles.iter().map(|t| t.map(|v| v + n)));
    let (alone, both) = (model(&other), model(&mesh));
    let (alone, both) = (alone.at_thickness(1.0).unwrap(), both.at_thickness(1.0).unwrap());
    let one = push(&other);
    let mut two = LoadCase {
        forces_n: one.forces_n.clone(),
        anchors: one.anchors.clone(),
        ..LoadCase::default()
    };
    two.forces_n.resize(2 * n as usize, Vec3::ZERO);
    let (u_one, u_two) = (
        alone.solve(&[one]).unwrap().remove(0),
        both.solve(&[two.clone()]).unwrap().remove(0),
    );
    let scale = largest(&u_one.moves_mm);
    for (v, u) in u_two.moves_mm.iter().enumerate() {
        let expected = u_one.moves_mm.get(v).copied().unwrap_or(Vec3::ZERO);
        assert!(u.distance(expected) < 1e-7 * scale);
    }
    two.forces_n[n as usize] = Vec3::Z;
    assert_eq!(
        both.solve(&[two]).unwrap_err(),
        ShellError::Unbalanced { case: 0, point: n }
    );
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let mesh = pebble(8);
    let run = |n_threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .build()
            .unwrap();
        pool.install(|| {
            let model = model(&mesh);
            let solver = model.at_thickness(1.0).unwrap();
            let u = solver.solve(&vec![push(&mesh); 8]).unwrap();
            (solver.stresses(&u[7]), u)
        })
    };
    assert!(run(1) == run(3));
}

#[test]
fn what_is_no_shell_is_refused_by_name() {
    let good = pebble(6);
    let refused = |change: &dyn Fn(&mut TriMesh)| {
        let mut mesh = good.clone();
        change(&mut mesh);
        ShellModel::new(&mesh, &Material::SLA_RESIN).unwrap_err()
    };
    assert_eq!(refused(&|m| m.triangles.clear()), ShellError::Empty);
    assert_eq!(
        refused(&|m| m.points[3].y = f64::NAN),
        ShellError::PointNotFinite(3)
    );
    assert_eq!(
        refused(&|m| m.triangles[7][1] = 10_000),
        ShellError::MissingPoint(7)
    );
    assert_eq!(
        refused(&|m| m.triangles[7][1] = m.triangles[7][0]),
        ShellError::FlatTriangle(7)
    );
    assert_eq!(
        refused(&|m| m.points.push(Vec3::ZERO)),
        ShellError::LoosePoint(good.points.len() as u32)
    );
    let stiff = Material {
        poissons_ratio: 0.5,
        ..Material::SLA_RESIN
    };
    assert!(matches!(
        ShellModel::new(&good, &stiff),
        Err(ShellError::Material { .. })
    ));
}

#[test]
fn what_cannot_be_solved_is_refused_by_name() {
    let mesh = pebble(6);
    let model = model(&mesh);
    for thickness in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            model.at_thickness(thickness),
            Err(ShellError::Thickness(_))
        ));
    }
    let hinge = [0, 1].map(|point| Support {
        point,
        is_held: [true, true, true, false, false, false],
    });
    assert_eq!(
        model.at_thickness_with(1.0, &hinge).unwrap_err(),
        ShellError::Loose(0)
    );
    assert_eq!(
        model.at_thickness_with(1.0, &[]).unwrap_err(),
        ShellError::Loose(0)
    );
    let missing = [Support {
        point: 9999,
        is_held: [true; 6],
    }];
    assert_eq!(
        model.at_thickness_with(1.0, &missing).unwrap_err(),
        ShellError::MissingSupport(9999)
    );

    let solver = model.at_thickness(1.0).unwrap();
    let refused = |change: &dyn Fn(&mut LoadCase)| {
        let mut case = push(&mesh);
        change(&mut case);
        solver.solve(&[push(&mesh), case]).unwrap_err()
    };
    let want = mesh.points.len();
    assert_eq!(
        refused(&|c| c.forces_n.truncate(4)),
        ShellError::LoadLength {
            case: 1,
            have: 4,
            want
        }
    );
    assert_eq!(
        refused(&|c| c.moments_n_mm = vec![Vec3::ZERO]),
        ShellError::LoadLength {
            case: 1,
            have: 1,
            want
        }
    );
    assert_eq!(
        refused(&|c| c.forces_n[5].x = f64::NAN),
        ShellError::LoadNotFinite { case: 1, point: 5 }
    );
    assert_eq!(
        refused(&|c| c.anchors = vec![9999]),
        ShellError::MissingSupport(9999)
    );
    assert_eq!(
        refused(&|c| c.anchors = vec![0, 1]),
        ShellError::HeldOnLine { case: 1 }
    );
    assert_eq!(
        refused(&|c| c.anchors.clear()),
        ShellError::Unbalanced { case: 1, point: 0 }
    );
}

#[test]
fn loads_are_carried_at_every_thickness() {
    let mesh = pebble(16);
    let model = model(&mesh);
    let case = push(&mesh);
    for thickness_mm in [0.001, 0.01, 0.1, 1.0, 10.0, 1000.0] {
        let u = model
            .at_thickness(thickness_mm)
            .unwrap()
            .solve(std::slice::from_ref(&case))
            .unwrap()
            .remove(0);
        let called_up = forces(&model, thickness_mm, &u);
        for v in (0..mesh.points.len()).filter(|&v| !case.anchors.contains(&(v as u32))) {
            let missing = called_up.forces_n[v].distance(case.forces_n[v]);
            assert!(missing < 1e-5, "{missing} N at {thickness_mm} mm");
        }
    }
}

use super::*;
use crate::samples::{both, cube, flip, unweld};

fn error(mesh: &TriMesh) -> InputError {
    into_solid(mesh).expect_err("the mesh is broken")
}

#[test]
fn a_cube_is_one_body_indexed_or_not() {
    let mesh = cube(Vec3::ONE, 2.0);
    for mesh in [unweld(&mesh), mesh] {
        let (solid, kept_face) = into_solid(&mesh).unwrap();
        assert_eq!((solid.volume(), solid.mesh().points.len()), (8.0, 8));
        assert_eq!(kept_face, (0..12).collect::<Vec<_>>());
    }
}

#[test]
fn touching_along_an_edge_is_sound_as_indexed_and_broken_as_a_soup() {
    // Two cubes that touch along an edge are two bodies as indexed. Once their points are merged, that edge
    // has four triangles.
    let mesh = both(cube(Vec3::ZERO, 1.0), cube(Vec3::new(1.0, 1.0, 0.0), 1.0));
    assert_eq!(crate::weld::close(&mesh).mesh, mesh);
    assert!(matches!(error(&mesh), InputError::Bodies(bodies) if bodies.len() == 2));
    let at = Vec3::new(1.0, 1.0, 0.5);
    assert_eq!(
        error(&unweld(&mesh)),
        InputError::Shared {
            count: 1,
            at,
            n_copies: 0
        }
    );
}

#[test]
fn bodies_are_counted_and_cavities_named() {
    let cavity = both(cube(Vec3::ZERO, 4.0), flip(cube(Vec3::ONE, 1.0)));
    let InputError::Bodies(bodies) = error(&cavity) else {
        panic!("two surfaces")
    };
    assert_eq!(
        bodies.iter().map(|b| b.signed_volume).collect::<Vec<_>>(),
        [64.0, -1.0]
    );
    let message = error(&cavity).to_string();
    assert_eq!(
        message,
        "the model consists of 2 separate bodies: 12 triangles of 4 × 4 × 4 around (2, 2, 2), 12 triangles \
         of 1 × 1 × 1 around (1.5, 1.5, 1.5) (a cavity); keep one of them, or unite those that overlap into \
         one"
    );
}

#[test]
fn a_hole_is_counted_with_its_edges() {
    let mut mesh = cube(Vec3::ZERO, 1.0);
    mesh.triangles.truncate(10);
    mesh.triangles.remove(0);
    let message = error(&mesh).to_string();
    assert!(
        matches!(
            error(&mesh),
            InputError::Open {
                count: 7,
                n_holes: 1,
                ..
            }
        ),
        "{message}"
    );
    assert!(
        message.starts_with("the surface is not closed: 1 hole (7 open edges), first near ("),
        "{message}"
    );
}

#[test]
fn turned_doubled_and_inverted_triangles_are_told_apart() {
    let mut turned = cube(Vec3::ZERO, 1.0);
    turned.triangles[3].swap(0, 1);
    assert!(matches!(error(&turned), InputError::Turned { count: 3, .. }));
    let mut doubled = cube(Vec3::ZERO, 1.0);
    doubled.triangles.push(doubled.triangles[5]);
    assert!(matches!(
        error(&doubled),
        InputError::Shared {
            count: 3,
            n_copies: 1,
            ..
        }
    ));
    assert_eq!(error(&flip(cube(Vec3::ZERO, 1.0))), InputError::InsideOut);
    assert_eq!(error(&TriMesh::default()), InputError::Empty);
}

#[test]
fn a_triangle_with_two_sides_is_flat() {
    let points = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
    assert_eq!(
        error(&TriMesh {
            points,
            triangles: vec![[0, 1, 2], [0, 2, 1]]
        }),
        InputError::Flat
    );
}

#[test]
fn a_pinched_point_is_found() {
    // A torus of 3 × 3 quads that narrows to one point: all points of one meridian become one, so that the
    // two fans of the horn meet there.
    let (n, m) = (4_u32, 3_u32);
    let turn = |i: u32, n: u32| std::f64::consts::TAU * f64::from(i) / f64::from(n);
    let mut points = vec![Vec3::new(3.0, 0.0, 0.0)];
    for i in 1..n {
        for j in 0..m {
            let r = 3.0 + turn(j, m).cos();
            points.push(Vec3::new(
                r * turn(i, n).cos(),
                r * turn(i, n).sin(),
                turn(j, m).sin(),
            ));
        }
    }
    let at = |i: u32, j: u32| {
        if i.is_multiple_of(n) {
            0
        } else {
            1 + (i % n - 1) * m + j % m
        }
    };
    let quads = (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
    let triangles = quads
        .flat_map(|(i, j)| {
            [
                [at(i, j), at(i + 1, j), at(i + 1, j + 1)],
                [at(i, j), at(i + 1, j + 1), at(i, j + 1)],
            ]
        })
        .filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0])
        .collect();
    let mesh = TriMesh { points, triangles };
    assert_eq!(
        error(&mesh),
        InputError::Pinched {
            count: 1,
            at: mesh.points[0]
        }
    );
}

#[test]
fn loose_and_rounded_meshes_get_their_own_words() {
    let mut cracked = unweld(&cube(Vec3::ZERO, 1.0));
    cracked
        .points
        .iter_mut()
        .enumerate()
        .for_each(|(i, p)| p.x += 1e-5 * i as f64);
    assert!(matches!(
        error(&cracked),
        InputError::Loose {
            count: 36,
            n_faces: 12,
            ..
        }
    ));
    let mut rounded = both(cube(Vec3::ZERO, 1.0), cube(Vec3::ONE, 3.0));
    rounded.points[0] = rounded.points[1];
    rounded.triangles.pop();
    assert_eq!(
        error(&rounded),
        InputError::Collapsed {
            count: 2,
            n_faces: 23
        }
    );
}

#[test]
fn wrong_numbers_are_refused() {
    let mut mesh = cube(Vec3::ZERO, 1.0);
    mesh.points[3].z = f64::INFINITY;
    assert_eq!(error(&mesh), InputError::NotFinite { vertex: 3, count: 1 });
    mesh.points[3].z = -1e31;
    assert_eq!(error(&mesh), InputError::TooFar { vertex: 3, count: 1 });
    let mut mesh = cube(Vec3::ZERO, 1.0);
    mesh.triangles[1][2] = 8;
    assert!(matches!(
        error(&mesh),
        InputError::NotSolid(NotSolid::MissingPoint {
            face: 1,
            vertex: 8,
            n_points: 8
        })
    ));
}

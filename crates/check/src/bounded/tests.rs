//! Cubes in hollows with 0.1 mm of room all round: the bounds on each of their motions, derived by hand.

use super::*;
use crate::bearing::locate_all;
use crate::mesh::tests::{cuboid, hollow};
use crate::quantity::tests::cube;

/// Distance of bearings from the edges, mm.
const FROM_EDGE_MM: f64 = 0.1;
/// Number of bearings of one cube in one hollow: four on each face.
const N: usize = 24;

fn sign(i: usize) -> f64 {
    if i == 1 { 1.0 } else { -1.0 }
}

/// Bearings of cube `a`, of half side `half_mm`, in hollow `b`: four on each face, ordered by axis, side, and
/// the next two axes.
fn of_cube(a: usize, b: usize, half_mm: f64) -> Vec<Bearing> {
    let of = |i: usize| {
        let (axis, signs) = (i / 8, [i / 4 % 2, i / 2 % 2, i % 2].map(sign));
        let (mut point, mut normal, mut across) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        point[axis] = signs[0] * half_mm;
        (1..3).for_each(|k| point[(axis + k) % 3] = signs[k] * (half_mm - FROM_EDGE_MM));
        normal[axis] = signs[0];
        across[(axis + 1) % 3] = 1.0;
        Bearing {
            a,
            b,
            point,
            normal,
            across,
        }
    };
    (0..N).map(of).collect()
}

/// Rows from `first` on that bound a displacement of the cube along an axis: all those of that face.
fn shift_rows(first: usize, axis: usize, side: usize) -> Vec<(usize, f64)> {
    (0..4).map(|i| (first + 8 * axis + 4 * side + i, 0.25)).collect()
}

/// Rows that bound a rotation about an axis: on two opposite faces, the two points that rise, by the second
/// axis after the face's or by the first.
fn turn_rows(first: usize, axis: usize, side: usize, half_mm: f64, by_second: bool) -> Vec<(usize, f64)> {
    let face = (axis + if by_second { 2 } else { 1 }) % 3;
    let rises = |i: &usize| {
        let signs = [i / 4 % 2, i / 2 % 2, i % 2].map(sign);
        let lever = if by_second { signs[2] } else { -signs[1] };
        i / 8 == face && signs[0] * lever == sign(side)
    };
    let multiplier = 0.25 / (half_mm - FROM_EDGE_MM);
    (0..N).filter(rises).map(|i| (first + i, multiplier)).collect()
}

/// Ends against each axis and along it.
fn both(ends: impl Fn(usize, usize) -> Vec<(usize, f64)>) -> Vec<Ends> {
    (0..3).map(|axis| [ends(axis, 0), ends(axis, 1)]).collect()
}

/// Cube of 10 mm, piece 1, in a hollow of piece 0.
struct Caged {
    meshes: Vec<Mesh>,
    bearings: Vec<Bearing>,
    claim: Bounded,
    slide: Option<Slide>,
}

impl Caged {
    fn new() -> Self {
        let claim = Bounded {
            free: vec![1],
            of_piece: vec![[0, 1]],
            quantities: vec![
                cube(Some(1), None, None, 0.024),
                cube(Some(1), None, Some([0.0; 3]), 0.12),
            ],
            rows: (0..N).map(|i| [i, 1, 0]).collect(),
            multipliers: vec![
                both(|k, s| turn_rows(0, k, s, 5.0, false)),
                both(|k, s| shift_rows(0, k, s)),
            ],
        };
        let meshes = vec![hollow(8.0, 5.1), cuboid([-5.0; 3], [5.0; 3])];
        Self {
            meshes,
            bearings: of_cube(1, 0, 5.0),
            claim,
            slide: None,
        }
    }

    /// The cube as the key in a shaft that is open upwards, along which it has slid by up to 0.4 mm.
    fn key() -> Self {
        let mut caged = Self::new();
        let shaft = cuboid([-5.1; 3], [5.1, 5.1, 50.0]).triangles;
        let mut around = cuboid([-8.0; 3], [8.0, 8.0, 60.0]).triangles;
        around.extend(shaft.into_iter().map(|[a, b, c]| [a, c, b]));
        caged.meshes[0] = Mesh::new(around);
        caged.slide = Some(Slide {
            key: 1,
            seat: 0,
            at: [0.0; 3],
            along: [0.0, 0.0, 1.0],
            most_mm: 0.4,
        });
        let claim = &mut caged.claim;
        claim.quantities[0] = cube(Some(1), None, None, 0.025);
        claim.quantities[1].most[2][1] = 0.42;
        claim.rows.truncate(20);
        claim.multipliers[0][1] = [0, 1].map(|side| turn_rows(0, 1, side, 5.0, true));
        claim.multipliers[1][2][1] = vec![(20, 1.0)];
        caged
    }

    fn test(&self) -> Result<Play, String> {
        let bearings = locate_all(&self.meshes, &self.bearings)?;
        let way_out = Some([0.0, 0.0, 1.0]);
        let kit = Kit {
            meshes: &self.meshes,
            bearings: &bearings,
            slide: self.slide.as_ref(),
            key: 1,
            way_out,
        };
        test(&kit, &self.claim)
    }

    /// Applies `change` and returns the message of the refusal.
    fn expect_refusal(mut self, change: impl FnOnce(&mut Self)) -> String {
        assert!(self.test().is_ok());
        change(&mut self);
        self.test().expect_err("refused")
    }
}

#[test]
fn a_cube_in_a_hollow_goes_little_farther_than_its_gap() {
    let play = Caged::new().test().unwrap();
    assert!((play.shift_mm - 0.12 * 3.0_f64.sqrt()).abs() < 1e-9);
    assert!((play.turn_deg - (0.024 * 3.0_f64.sqrt()).to_degrees()).abs() < 1e-9);
    assert_eq!(play.slid_mm, None);
}

#[test]
fn a_bound_that_is_too_small_is_refused_also_where_another_needs_it() {
    let small = Caged::new().expect_refusal(|c| c.claim.quantities[1].most[2][0] = 0.105);
    assert!(small.starts_with("quantity 1 goes to 0.1"), "{small}");
    let large = Caged::new().expect_refusal(|c| c.claim.quantities[0].most = vec![[0.2; 2]; 3]);
    assert!(
        large.starts_with("quantity"),
        "turned so far, errors are too great: {large}"
    );
}

#[test]
fn a_wider_hollow_is_refused() {
    let wide = Caged::new().expect_refusal(|c| c.meshes[0] = hollow(8.0, 5.15));
    assert!(wide.starts_with("quantity"), "{wide}");
    let wider = Caged::new().expect_refusal(|c| c.meshes[0] = hollow(8.0, 6.5));
    assert!(wider.ends_with("nothing is above"), "{wider}");
}

/// Hollow with a square pit of 2 mm in its wall along x, between the same two coordinates along y and z.
fn hollow_with_pit([from, to]: [f64; 2]) -> Mesh {
    let square = |x: f64, [from, to]: [f64; 2]| [[x, from, from], [x, to, from], [x, to, to], [x, from, to]];
    let rings = [
        square(5.1, [-5.1, 5.1]),
        square(5.1, [from, to]),
        square(7.1, [from, to]),
    ];
    let mut triangles = hollow(8.0, 5.1).triangles;
    triangles.retain(|t| t.iter().any(|p| p[0] != 5.1));
    for (ring, next) in rings.iter().zip(&rings[1..]) {
        for k in 0..4 {
            let (p, q, r, s) = (ring[k], ring[(k + 1) % 4], next[(k + 1) % 4], next[k]);
            triangles.extend([[p, r, q], [p, s, r]]);
        }
    }
    let [p, q, r, s] = rings[2];
    triangles.extend([[p, r, q], [p, s, r]]);
    let mesh = Mesh::new(triangles);
    assert_eq!(mesh.n_open_edges(), 0);
    mesh
}

#[test]
fn a_pit_in_the_hollow_is_refused_where_a_point_reaches_it() {
    let mut caged = Caged::new();
    caged.meshes[0] = hollow_with_pit([1.0, 2.0]);
    assert!(caged.test().is_ok(), "far from all points");
    let reached = Caged::new().expect_refusal(|c| c.meshes[0] = hollow_with_pit([3.8, 4.7]));
    assert!(reached.starts_with("row 7: a surface goes on to 2"), "{reached}");
}

#[test]
fn multipliers_that_are_negative_missing_or_no_numbers_are_refused() {
    let negative = Caged::new().expect_refusal(|c| c.claim.multipliers[1][0][1][2].1 = -0.25);
    assert!(negative.contains("is -0.25"), "{negative}");
    Caged::new().expect_refusal(|c| c.claim.multipliers[1][0][1][2].1 = f64::NAN);
    Caged::new().expect_refusal(|c| c.claim.multipliers[1][0][1][2].1 = 0.3);
    Caged::new().expect_refusal(|c| c.claim.multipliers[1][0][1].clear());
    Caged::new().expect_refusal(|c| c.claim.multipliers[1][0][1][2].0 = N);
    Caged::new().expect_refusal(|c| c.claim.multipliers[1][0][1][2].0 = N + 1);
    Caged::new().expect_refusal(|c| c.claim.multipliers[1].truncate(2));
    Caged::new().expect_refusal(|c| c.claim.multipliers.truncate(1));
}

#[test]
fn quantities_of_other_pieces_or_kinds_are_refused() {
    Caged::new().expect_refusal(|c| c.claim.rows[3] = [3, 0, 0]);
    Caged::new().expect_refusal(|c| c.claim.rows[3] = [3, 1, 1]);
    Caged::new().expect_refusal(|c| c.claim.rows[3] = [3, 1, 7]);
    Caged::new().expect_refusal(|c| c.claim.rows[3] = [77, 1, 0]);
    Caged::new().expect_refusal(|c| c.claim.quantities[1].plus = Some(0));
    Caged::new().expect_refusal(|c| c.claim.of_piece[0] = [1, 0]);
    Caged::new().expect_refusal(|c| c.claim.free = vec![0]);
    Caged::new().expect_refusal(|c| c.claim.free = vec![1, 1]);
}

#[test]
fn a_point_off_its_surface_or_a_normal_that_is_none_is_refused() {
    let off = Caged::new().expect_refusal(|c| c.bearings[3].point[0] += 0.001);
    assert_eq!(off, "bearing 3 is not on piece 2");
    Caged::new().expect_refusal(|c| c.bearings[3].normal[0] *= 1.001);
    Caged::new().expect_refusal(|c| c.bearings[3].normal = [0.6, 0.0, 0.8]);
    Caged::new().expect_refusal(|c| c.bearings[3].b = 1);
}

#[test]
fn a_key_is_bounded_while_its_slide_is() {
    let play = Caged::key().test().unwrap();
    assert_eq!(play.slid_mm, Some(0.4));
    assert!((play.shift_mm - (2.0 * 0.12_f64.powi(2) + 0.42_f64.powi(2)).sqrt()).abs() < 1e-9);
    Caged::key().expect_refusal(|c| c.slide = None);
    let slide = |change: fn(&mut Slide)| {
        Caged::key().expect_refusal(|c| c.slide.as_mut().into_iter().for_each(change))
    };
    slide(|s| s.most_mm = 0.415);
    slide(|s| s.most_mm = 0.6);
    slide(|s| s.most_mm = -0.1);
    slide(|s| s.along = [0.0, 1.0, 0.0]);
    slide(|s| s.at = [0.0, 0.0, 5.1]);
    slide(|s| (s.key, s.seat) = (0, 1));
    slide(|s| s.seat = 1);
}

/// Cube, piece 2, in a hollow cube of 16 mm, piece 1, in a hollow of piece 0: both are free.
fn cube_in_cube() -> Caged {
    let quantities = vec![
        cube(Some(1), None, None, 0.014),
        cube(Some(1), None, Some([0.0; 3]), 0.12),
        cube(Some(2), None, None, 0.045),
        cube(Some(2), None, Some([0.0; 3]), 0.27),
        cube(Some(1), Some(2), None, 0.029),
        cube(Some(1), Some(2), Some([0.0; 3]), 0.14),
    ];
    let [outer, inner] = [0, N];
    let sum = |a: Vec<(usize, f64)>, b: Vec<(usize, f64)>| [a, b].concat();
    let multipliers = vec![
        both(|k, s| turn_rows(outer, k, s, 8.0, false)),
        both(|k, s| shift_rows(outer, k, s)),
        both(|k, s| {
            sum(
                turn_rows(outer, k, s, 8.0, false),
                turn_rows(inner, k, s, 5.0, true),
            )
        }),
        both(|k, s| sum(shift_rows(outer, k, s), shift_rows(inner, k, s))),
        // The hollow against the cube in it: the opposite direction.
        both(|k, s| turn_rows(inner, k, 1 - s, 5.0, false)),
        both(|k, s| shift_rows(inner, k, 1 - s)),
    ];
    let rows = (0..2 * N)
        .map(|i| if i < N { [i, 1, 0] } else { [i, 5, 4] })
        .collect();
    Caged {
        meshes: vec![hollow(12.0, 8.1), hollow(8.0, 5.1), cuboid([-5.0; 3], [5.0; 3])],
        bearings: [of_cube(1, 0, 8.0), of_cube(2, 1, 5.0)].concat(),
        claim: Bounded {
            free: vec![1, 2],
            of_piece: vec![[0, 1], [2, 3]],
            quantities,
            rows,
            multipliers,
        },
        slide: None,
    }
}

#[test]
fn pieces_in_each_other_are_bounded_together() {
    let play = cube_in_cube().test().unwrap();
    assert!((play.shift_mm - 0.27 * 3.0_f64.sqrt()).abs() < 1e-9);
    assert!((play.turn_deg - (0.045 * 3.0_f64.sqrt()).to_degrees()).abs() < 1e-9);
}

#[test]
fn a_region_of_another_pair_is_refused_also_where_it_is_of_one_of_its_pieces() {
    let other = cube_in_cube().expect_refusal(|c| c.claim.rows[N + 3] = [N + 3, 3, 4]);
    assert!(other.ends_with("not of pieces 2 and 1"), "{other}");
    cube_in_cube().expect_refusal(|c| c.claim.rows[N + 3] = [N + 3, 5, 2]);
    cube_in_cube().expect_refusal(|c| c.claim.rows[3] = [3, 5, 4]);
    cube_in_cube().expect_refusal(|c| c.claim.quantities[5].minus = None);
    cube_in_cube()
        .expect_refusal(|c| (c.claim.quantities[5].plus, c.claim.quantities[5].minus) = (Some(2), Some(1)));
    cube_in_cube().expect_refusal(|c| c.claim.of_piece = vec![[0, 1]]);
}

/// At random poses within the bounds, the cube's points deviate from the linear prediction by no more than
/// the errors of the rows.
#[test]
fn errors_cover_what_is_left_of_poses_beside_their_logarithms() {
    let Caged { claim, bearings, .. } = cube_in_cube();
    let noise = |i: usize| (0.37 + 7.77 * i as f64).sin();
    for i in 0..2000 {
        let part = |k: usize, most: f64| -> Vec3 {
            std::array::from_fn(|axis| most * noise(1 + 13 * i + 3 * k + axis))
        };
        let [a, b] = [[part(0, 0.028), part(1, 0.13)], [part(2, 0.014), part(3, 0.12)]];
        let p = bearings[N + i % N].point;
        let seen = back(b, move_point(a, p));
        let field = |[w, v]: [Vec3; 2]| -> Vec3 { std::array::from_fn(|k| v[k] + cross(w, p)[k]) };
        let delta = sub(field(a), field(b));
        let of = |q: usize| claim.quantities[q].norm();
        let most_mm = of(5) + of(4) * norm(p);
        let error_mm = 0.5 * of(0) * most_mm + 0.5 * of(4) * (of(3) + of(2) * norm(p));
        assert!(distance(sub(seen, p), delta) <= error_mm);
    }
}

/// Moves `p` as a pose does, by small steps along its velocity field.
fn move_point([w, v]: [Vec3; 2], p: Vec3) -> Vec3 {
    const STEPS: usize = 64;
    let at = |p: Vec3| -> Vec3 { std::array::from_fn(|k| (v[k] + cross(w, p)[k]) / STEPS as f64) };
    (0..STEPS).fold(p, |p, _| {
        let midway: Vec3 = std::array::from_fn(|k| p[k] + 0.5 * at(p)[k]);
        std::array::from_fn(|k| p[k] + at(midway)[k])
    })
}

/// Place that a pose moves to `p`.
fn back([w, v]: [Vec3; 2], p: Vec3) -> Vec3 {
    move_point([w.map(|x| -x), v.map(|x| -x)], p)
}

/// Splits each triangle into `n²` parts of the same surface.
fn divide(mesh: &Mesh, n: usize) -> Mesh {
    let mut triangles = Vec::new();
    for &[a, b, c] in &mesh.triangles {
        // Computed from the corners' weights, so that neighbours have the same points except for rounding,
        // which f32 removes.
        let at = |i: usize, k: usize| -> Vec3 {
            let weights = [n - i - k, i, k].map(|w| w as f64 / n as f64);
            std::array::from_fn(|axis| {
                f64::from((weights[0] * a[axis] + weights[1] * b[axis] + weights[2] * c[axis]) as f32)
            })
        };
        for i in 0..n {
            for k in 0..n - i {
                triangles.push([at(i, k), at(i + 1, k), at(i, k + 1)]);
                if i + k + 2 <= n {
                    triangles.push([at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)]);
                }
            }
        }
    }
    let divided = Mesh::new(triangles);
    assert_eq!(divided.n_open_edges(), 0);
    divided
}

#[test]
fn many_small_triangles_bound_as_few_large_ones_do() {
    let mut caged = Caged::new();
    // Rounding moves walls by a millionth.
    caged.meshes = caged.meshes.iter().map(|mesh| divide(mesh, 18)).collect();
    assert!(caged.meshes.iter().all(|mesh| mesh.triangles.len() > 3000));
    caged.bearings = locate_all(&caged.meshes, &caged.bearings).unwrap();
    assert!(caged.test().is_ok());
}

//! Kernels on a ball of 100 000 triangles: distances, bands, sweeps, contours, booleans, remeshing,
//! simplifying. Clearances are those of two half shells of 26 000 triangles.

use divan::{Bencher, black_box};
use shellock_geom::band::Band;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::clearance::{Scope, Shape, Translation, least_gap, swept_gap};
use shellock_geom::contour::contour as dense;
use shellock_geom::marching_cubes::{OffBand, contour};
use shellock_geom::remesh::{RemeshParams, remesh};
use shellock_geom::signed_distance::SignedDistance;
use shellock_geom::simplify::{Reach, simplify};
use shellock_geom::sweep::{Draft, Sweeper};
use shellock_geom::{Aabb, Solid, Vec3, Volume};
use shellock_testkit::shapes::contoured_ball;

fn main() {
    divan::main();
}

fn ball() -> Solid {
    Solid::new(contoured_ball(50.0, 1.0)).expect("a ball is closed")
}

fn band(solid: &Solid) -> (Band, Vec<f32>) {
    Band::along(
        &SignedDistance::new(solid),
        solid.mesh().bounds(),
        0.8,
        2.0,
        7.0,
        5.0,
    )
    .expect("small grid")
}

#[divan::bench]
fn build_bvh(bencher: Bencher) {
    let ball = ball();
    bencher.bench(|| TriangleBvh::new(black_box(ball.mesh())));
}

#[divan::bench]
fn simplify_to_a_hundredth(bencher: Bencher) {
    let ball = ball();
    bencher.bench(|| simplify(black_box(&ball), &[], Reach::everywhere(0.01)));
}

#[divan::bench]
fn nearest_100k(bencher: Bencher) {
    let ball = ball();
    let bvh = TriangleBvh::new(ball.mesh());
    let queries: Vec<Vec3> = (0..100_000u32)
        .map(|i| {
            let t = f64::from(i);
            Vec3::new((t * 0.37).sin(), (t * 0.73).cos(), (t * 0.11).sin()).normalize()
                * (46.0 + 8.0 * (t * 0.19).fract())
        })
        .collect();
    bencher.bench(|| {
        queries
            .iter()
            .filter_map(|&q| bvh.nearest(q, 100.0))
            .map(|n| n.distance_sq)
            .sum::<f64>()
    });
}

#[divan::bench]
fn lay_band(bencher: Bencher) {
    let ball = ball();
    bencher.bench(|| band(black_box(&ball)));
}

#[divan::bench]
fn sweep_diagonal(bencher: Bencher) {
    let (band, depth) = band(&ball());
    let sweeper = Sweeper::new(&band);
    bencher.bench(|| sweeper.max_ahead(black_box(&depth), [1, 1, 1], Draft::NONE));
}

#[divan::bench]
fn contour_offset(bencher: Bencher) {
    let (band, depth) = band(&ball());
    let field: Vec<f32> = depth.iter().map(|d| d - 2.0).collect();
    bencher.bench(|| contour(&band, black_box(&field), OffBand::LikeNeighbours));
}

#[divan::bench]
fn subtract_ball(bencher: Bencher) {
    let a = Volume::from_solid(&ball()).expect("a solid");
    let b = a.translate(Vec3::new(13.1, 7.3, 3.7));
    bencher.bench(|| black_box(&a).subtract(&b));
}

#[divan::bench]
fn remesh_octants(bencher: Bencher) {
    let ball = ball();
    let octant = |p: Vec3| u32::from(p.x > 0.0) + 2 * u32::from(p.y > 0.0) + 4 * u32::from(p.z > 0.0);
    let labels: Vec<u32> = (0..ball.mesh().triangles.len())
        .map(|f| octant(ball.mesh().face_center(f)))
        .collect();
    let params = RemeshParams {
        target_edge_mm: 6.0,
        n_rounds: 6,
    };
    bencher.bench(|| remesh(&params, black_box(ball.mesh()), &labels));
}

/// Half of a shell 2 mm thick, 0.05 mm off a wavy seam.
fn half_shell(side: f64) -> Shape {
    let bounds = Aabb {
        min: Vec3::splat(-42.0),
        max: Vec3::splat(42.0),
    };
    let seam = |p: Vec3| side * (p.z - 0.5 * (0.3 * p.x).sin()) - 0.05;
    let field = |p: Vec3| (40.0 - p.length()).min(p.length() - 38.0).min(seam(p));
    Shape::new(&Solid::new(dense(bounds, 1.07, field)).expect("half a shell is closed"))
}

#[divan::bench]
fn gap_of_half_shells(bencher: Bencher) {
    let (upper, lower) = (half_shell(1.0), half_shell(-1.0));
    bencher.bench(|| least_gap(black_box(&upper), &lower, Scope::Everything, 1.0));
}

#[divan::bench]
fn gap_of_half_shells_drawn_apart(bencher: Bencher) {
    let (upper, lower) = (half_shell(1.0), half_shell(-1.0));
    let motion = Translation {
        along: Vec3::new(1.0, 0.0, 1.0),
        from_mm: 0.0,
        far_mm: f64::INFINITY,
    };
    bencher.bench(|| swept_gap(black_box(&upper), &lower, &motion, Scope::Everything, 1.0));
}

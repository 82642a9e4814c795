//! Benchmark of proofs of locks on round shells made by code: 13 and 40 pieces with 20 000 contacts.

use divan::Bencher;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use shellock_assembly::certificate::{Certificate, Claim, Evidence, certify};
use shellock_assembly::motion::Contact;
use shellock_assembly::verify::Verification;
use shellock_assembly::verify::clearance::KitGaps;
use shellock_assembly::{IdVec, InstallationPlan, InstallationStep, LatticeDirection, PatchId};
use shellock_geom::{TriMesh, Vec3};

const N_CONTACTS: usize = 20_000;
const RADIUS_MM: f64 = 75.0;
const CLEARANCE_MM: f64 = 0.12;

fn main() {
    divan::main();
}

/// Pieces of a round shell, installed in the order of their numbers, and the contacts of the connectors along
/// their seams.
struct Shell {
    pieces: IdVec<PatchId, TriMesh>,
    plan: InstallationPlan,
    contacts: Vec<Contact>,
}

impl Shell {
    /// Builds the shell. Seams lie where two of evenly spread centres are equally near. Across a seam the
    /// later piece may leave only along its direction `s`: contacts are perpendicular to `s`, all around, or
    /// face against it.
    fn new(n_pieces: usize) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(13);
        let centers = spread(n_pieces);
        let outwards = |c: &Vec3| {
            let ways: Vec<LatticeDirection> = LatticeDirection::all()
                .filter(|d| d.unit().dot(*c) > 0.5)
                .collect();
            ways[rng.random_range(0..ways.len())]
        };
        let separations: Vec<LatticeDirection> = centers.iter().map(outwards).collect();
        let mut contacts = Vec::new();
        while contacts.len() < N_CONTACTS {
            let Some((p, q, on_seam)) = seam_point(&centers, random_unit(&mut rng)) else {
                continue;
            };
            let (later, earlier) = (p.max(q), p.min(q));
            let s = separations[later].unit();
            let square = s.cross(random_unit(&mut rng)).normalize();
            let normal = if rng.random_range(0..5) == 0 { -s } else { square };
            let point = on_seam * (RADIUS_MM - 3.0 * rng.random::<f64>()) + normal * 1.5;
            let gap_mm = CLEARANCE_MM * (0.9 + 0.2 * rng.random::<f64>());
            contacts.push(Contact {
                a: later.into(),
                b: earlier.into(),
                point,
                normal,
                gap_mm,
                area_mm2: 0.5,
            });
        }
        let steps = separations.into_iter().enumerate();
        let steps = steps
            .map(|(piece, separation)| InstallationStep {
                piece: piece.into(),
                separation: separation.into(),
            })
            .collect();
        // Only their bounding boxes are used.
        let bodies = centers.iter().map(|&c| TriMesh {
            points: vec![c * RADIUS_MM],
            triangles: Vec::new(),
        });
        Self {
            pieces: bodies.collect(),
            plan: InstallationPlan { steps },
            contacts,
        }
    }

    fn make_certificate(&self) -> Certificate {
        let (verdict, gaps) = (Verification::default(), KitGaps::default());
        let evidence = Evidence {
            contacts: &self.contacts,
            verdict: &verdict,
            gaps: &gaps,
            play: None,
        };
        certify(Vec::new(), &self.pieces, &self.plan, &evidence, CLEARANCE_MM)
            .expect("the plan names every piece")
    }
}

/// Evenly spread unit vectors: a spiral by the golden angle.
fn spread(n: usize) -> Vec<Vec3> {
    let golden = std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    let at = |i: usize| {
        let z = 1.0 - (2.0 * i as f64 + 1.0) / n as f64;
        let (sin, cos) = (golden * i as f64).sin_cos();
        Vec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + Vec3::Z * z
    };
    (0..n).map(at).collect()
}

fn random_unit(rng: &mut ChaCha8Rng) -> Vec3 {
    loop {
        let v = Vec3::new(rng.random(), rng.random(), rng.random()) * 2.0 - 1.0;
        if (0.01..1.0).contains(&v.length_squared()) {
            return v.normalize();
        }
    }
}

/// Two nearest centres, and the place of their seam beside `at`; `None` if a third centre is nearer to that
/// place.
fn seam_point(centers: &[Vec3], at: Vec3) -> Option<(usize, usize, Vec3)> {
    let nearest = |at: Vec3| {
        let mut order: Vec<usize> = (0..centers.len()).collect();
        order.sort_by(|&i, &k| centers[k].dot(at).total_cmp(&centers[i].dot(at)));
        (order[0].min(order[1]), order[0].max(order[1]))
    };
    let (p, q) = nearest(at);
    let across = (centers[p] - centers[q]).normalize();
    let on_seam = (at - across * across.dot(at)).normalize();
    (nearest(on_seam) == (p, q)).then_some((p, q, on_seam))
}

#[divan::bench(args = [13, 40], sample_count = 5)]
fn certificate(bencher: Bencher, n_pieces: usize) {
    let shell = Shell::new(n_pieces);
    let claims = shell.make_certificate().claims;
    assert!(
        matches!(claims[0], Claim::Locked { .. }),
        "no proof was found: {:?}",
        claims[0]
    );
    bencher.bench(|| shell.make_certificate());
}

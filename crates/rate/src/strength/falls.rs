//! Falls of a shell in some orientations, and their decisive stress.

use super::*;

/// Height of the held region and of the one that meets the ground, as a share of the model's height in that
/// orientation.
const ZONE_SHARE: f64 = 0.1;
/// Least area of such a region, as a share of the surface; at a tip the region grows until it has as much.
const LEAST_ZONE_AREA: f64 = 0.01;

/// A shell and the falls that it is tested in.
pub(super) struct Falls {
    pub mesh: TriMesh,
    pub shell: ShellModel,
    /// Load of each fall, N, per mm³ of falling material.
    pub cases: Vec<LoadCase>,
    pub down: Vec<Vec3>,
    pub bvh: TriangleBvh,
    pub peak_share: f64,
    /// Volume of the model, mm³.
    pub volume_mm3: f64,
}

impl Falls {
    pub fn new(params: &StrengthParams, model: &Solid, n_points: f64) -> Result<Self, ShellError> {
        let mesh = analysis_mesh(model.mesh(), params.refinement * n_points);
        let shell = ShellModel::new(&mesh, &params.material)?;
        let mut rng = ChaCha8Rng::seed_from_u64(params.seed);
        let down = even_directions(&mut rng, params.n_cases);
        let density_t_mm3 = 1e-9 * params.material.density_g_cm3;
        let force_n_mm3 = impact_n(density_t_mm3, 1e3 * params.drop_m);
        let cases = down
            .iter()
            .map(|down| fall(&mesh, shell.areas_mm2(), *down, force_n_mm3))
            .collect();
        let (bvh, volume_mm3) = (TriangleBvh::new(&mesh), mesh.signed_volume());
        Ok(Self {
            bvh,
            volume_mm3,
            mesh,
            shell,
            cases,
            down,
            peak_share: params.peak_share,
        })
    }

    /// Stresses of all triangles in all falls, MPa.
    fn stresses(&self, thickness_mm: f64) -> Result<Vec<Vec<f64>>, ShellError> {
        let solver = self.shell.at_thickness(thickness_mm)?;
        let material_mm3 = (thickness_mm * self.mesh.area()).min(self.volume_mm3);
        let scaled = |case: &LoadCase| LoadCase {
            forces_n: case.forces_n.iter().map(|f| material_mm3 * *f).collect(),
            ..case.clone()
        };
        let moved = solver.solve(&self.cases.iter().map(scaled).collect::<Vec<_>>())?;
        Ok(moved
            .iter()
            .map(|u| solver.stresses(u).iter().map(|s| s.von_mises_mpa()).collect())
            .collect())
    }

    pub fn worst(&self, thickness_mm: f64) -> Result<Fallen, ShellError> {
        let hollow_mm2 = self.hollow_areas(thickness_mm);
        let stresses_mpa = self.stresses(thickness_mm)?;
        let counts: Vec<(usize, f64)> = stresses_mpa
            .par_iter()
            .map(|of_case| decisive_stress(of_case, &hollow_mm2, self.peak_share))
            .collect();
        let case = (0..counts.len())
            .max_by(|&i, &j| counts[i].1.total_cmp(&counts[j].1))
            .unwrap_or(0);
        let (triangle, stress_mpa) = counts[case];
        Ok(Fallen {
            trial: Tried {
                thickness_mm,
                stress_mpa,
            },
            case,
            triangle,
            hollow_mm2,
            stresses_mpa,
        })
    }

    /// Collects the results of the fall `worst`.
    pub fn strength(self, worst: Fallen, is_too_weak: bool, tried: Vec<Tried>) -> Strength {
        let Fallen {
            case,
            hollow_mm2,
            mut stresses_mpa,
            ..
        } = worst;
        let largest = |t: usize| stresses_mpa.iter().map(|of_case| of_case[t]).fold(0.0, f64::max);
        Strength {
            largest_mpa: (0..self.mesh.triangles.len()).map(largest).collect(),
            thickness_mm: worst.trial.thickness_mm,
            most_mm: worst.trial.thickness_mm,
            stress_mpa: worst.trial.stress_mpa,
            is_too_weak,
            no_wall_bears: false,
            trials: tried,
            decisive_fall: (case, self.down[case]),
            at: self.mesh.face_center(worst.triangle),
            deciding_mpa: stresses_mpa.swap_remove(case),
            is_solid: hollow_mm2.iter().map(|a| *a == 0.0).collect(),
            solid: thin::regions(&self.mesh, &hollow_mm2),
            mesh: self.mesh,
        }
    }

    /// Area of each triangle with a cavity below, mm²; 0 where the model is solid.
    pub fn hollow_areas(&self, thickness_mm: f64) -> Vec<f64> {
        let area = |t: usize| {
            let is_solid = thin::is_solid(&self.mesh, &self.bvh, t, thickness_mm);
            if is_solid { 0.0 } else { self.mesh.face_area(t) }
        };
        (0..self.mesh.triangles.len()).into_par_iter().map(area).collect()
    }
}

/// Results of all falls with one thickness.
pub(super) struct Fallen {
    pub trial: Tried,
    /// Index of the decisive fall.
    pub case: usize,
    /// Triangle with the decisive stress.
    pub triangle: usize,
    pub hollow_mm2: Vec<f64>,
    /// Stress of each triangle in each fall, MPa.
    pub stresses_mpa: Vec<Vec<f64>>,
}

/// Triangle and value of the decisive stress, which all but `peak_share` of the area does not exceed; 0 where
/// there is no area.
fn decisive_stress(stress_mpa: &[f64], areas: &[f64], peak_share: f64) -> (usize, f64) {
    let mut order: Vec<usize> = (0..areas.len()).filter(|&t| areas[t] > 0.0).collect();
    order.sort_by(|&i, &j| stress_mpa[j].total_cmp(&stress_mpa[i]));
    let mut left = peak_share * areas.iter().sum::<f64>();
    let found = order.iter().find(|&&t| {
        left -= areas[t];
        left < 0.0
    });
    found.map_or((0, 0.0), |&t| (t, stress_mpa[t]))
}

/// Remeshes to even triangles on about `n_points` points.
fn analysis_mesh(mesh: &TriMesh, n_points: f64) -> TriMesh {
    // A mesh of equilateral triangles of edge l has one point for each √3/2 l² of area.
    let target_edge_mm = (mesh.area() / (n_points * 0.75f64.sqrt())).sqrt();
    remesh(
        &RemeshParams {
            target_edge_mm,
            n_rounds: 5,
        },
        mesh,
        &vec![0; mesh.triangles.len()],
    )
    .mesh
}

/// Directions as evenly spread as a few can be, rotated at random: a spiral of equal areas.
///
/// Directions drawn one by one leave gaps and clusters, and the thickness depends on them:
/// docs/notes/strength.md.
fn even_directions(rng: &mut ChaCha8Rng, n: usize) -> Vec<Vec3> {
    let pole = on_sphere(rng);
    let (x, y) = pole.any_orthonormal_pair();
    let start: f64 = rng.random_range(0.0..TAU);
    let on_spiral = |i: usize| {
        let height = 1.0 - (2.0 * i as f64 + 1.0) / n as f64;
        let angle = start + i as f64 * PI * (3.0 - 5.0f64.sqrt());
        let radius = (1.0 - height * height).max(0.0).sqrt();
        pole * height + x * (radius * angle.cos()) + y * (radius * angle.sin())
    };
    (0..n).map(on_spiral).collect()
}

/// A random direction, uniform on the sphere.
fn on_sphere(rng: &mut ChaCha8Rng) -> Vec3 {
    loop {
        let p = Vec3::new(
            rng.random_range(-1.0..1.0),
            rng.random_range(-1.0..1.0),
            rng.random_range(-1.0..1.0),
        );
        let length = p.length();
        if (0.1..=1.0).contains(&length) {
            return p / length;
        }
    }
}

/// Load of a fall along `down`: `total_n` on the bottom, spread by area, which is by mass.
fn fall(mesh: &TriMesh, areas_mm2: &[f64], down: Vec3, total_n: f64) -> LoadCase {
    let bottom = zone(mesh, areas_mm2, down);
    let zone_mm2: f64 = bottom.iter().map(|&v| areas_mm2[v as usize]).sum();
    let mut forces_n = vec![Vec3::ZERO; mesh.points.len()];
    bottom
        .iter()
        .for_each(|&v| forces_n[v as usize] = -down * (total_n * areas_mm2[v as usize] / zone_mm2));
    LoadCase {
        forces_n,
        moments_n_mm: Vec::new(),
        anchors: zone(mesh, areas_mm2, -down),
    }
}

/// Points furthest along `way`: those in [`ZONE_SHARE`] of the height, and at least [`LEAST_ZONE_AREA`] of
/// the surface.
fn zone(mesh: &TriMesh, areas_mm2: &[f64], way: Vec3) -> Vec<u32> {
    let mut order: Vec<(f64, u32)> = mesh.points.iter().map(|p| p.dot(way)).zip(0..).collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let (Some(first), Some(last)) = (order.first(), order.last()) else {
        return Vec::new();
    };
    let least_height = first.0 - ZONE_SHARE * (first.0 - last.0);
    let mut missing_mm2 = LEAST_ZONE_AREA * areas_mm2.iter().sum::<f64>();
    let belongs = |(height, v): &&(f64, u32)| {
        let belongs = *height >= least_height || missing_mm2 > 0.0;
        missing_mm2 -= areas_mm2[*v as usize];
        belongs
    };
    order.iter().take_while(belongs).map(|(_, v)| *v).collect()
}

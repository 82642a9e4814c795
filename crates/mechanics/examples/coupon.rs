//! The volume metric against CalculiX: two plates clamped at their far edges, joined along a straight seam, pulled apart.
//!
//! `cargo run --release -p shellock-mechanics --example coupon`
//!
//! The reference has the same geometry as one solid a side (plate, bars and foot united by gmsh), quadratic tetrahedra of its own,
//! the pairs of all nodes of the common face tied along n, one-sided along ŝ at root and tip. Needs `gmsh` and `ccx`; a case that CalculiX
//! does not settle within 120 s is given up, and said so.

use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use shellock_geom::Vec3;
use shellock_mechanics::{Joint, Meeting, Side, VolumeModel, VolumeParams, sample};

const LENGTH: f64 = 40.0;
const WIDTH: f64 = 20.0;
const CELLS: [u32; 2] = [20, 10];
/// Sizes of the reference's elements, mm: at the seam, and at the clamps.
const SIZE: [f64; 2] = [0.9, 3.0];
/// Connector size D, mm.
const SIZE_MM: f64 = 3.0;
/// Separation force, N/mm: so small that the reference, which has one-sided springs only with large displacements, is linear.
const FORCE: f64 = 1e-3;
/// What is printed: µm at 0.1 N/mm.
const PRINTED: f64 = 1e3 * 0.1 / FORCE;

type Any<T> = Result<T, Box<dyn std::error::Error>>;

/// Displacements at the middle of the seam: side a and b, at the root and at the tip.
type Moved = [[Vec3; 2]; 2];

fn main() -> Any<()> {
    let params = VolumeParams { force_n_per_mm: FORCE, ..VolumeParams::default() };
    let folder = tempfile::tempdir()?;
    println!("| T | load on a | opening µm | CalculiX | tip of a µm | CalculiX | tip of b µm | CalculiX | worst |");
    println!("| --: | :-- | --: | --: | --: | --: | --: | --: | --: |");
    for degrees in [0.0_f64, -45.0, -90.0, 45.0] {
        let frame = Frame::new(degrees);
        let n_loads = if degrees == 0.0 { 4 } else { 2 };
        for (name, pull) in
            [("+ŝ", frame.s), ("−ŝ", -frame.s), ("+n", frame.n), ("along", Vec3::Y)].into_iter().take(n_loads)
        {
            let own = ours(&params, &frame, pull)?;
            let reference = calculix(&params, &frame, pull, folder.path());
            print_row(&format!("{degrees}°"), name, &own, reference);
        }
    }
    Ok(())
}

/// The cross-section's axes: x across from a to b, z outwards.
struct Frame {
    degrees: f64,
    s: Vec3,
    n: Vec3,
}

impl Frame {
    fn new(degrees: f64) -> Self {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Self { degrees, s: Vec3::new(sin, 0.0, cos), n: Vec3::new(cos, 0.0, -sin) }
    }
}

fn print_row(angle: &str, name: &str, own: &Moved, reference: Any<Moved>) {
    let widest = |m: &Moved| m[0][0].distance(m[1][0]).max(m[0][1].distance(m[1][1])) * PRINTED;
    let figures = |m: &Moved| [widest(m), m[0][1].length() * PRINTED, m[1][1].length() * PRINTED];
    let own = figures(own);
    match reference.map(|m| figures(&m)) {
        Ok(theirs) => {
            let largest = theirs.iter().fold(0.0_f64, |m, v| m.max(*v));
            // What stays closed is compared on the scale of what moves.
            let off = |i: usize| (own[i] - theirs[i]) / if theirs[i] < 0.05 * largest { largest } else { theirs[i] };
            let worst = (0..3).map(off).max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0) * 100.0;
            let columns: Vec<String> = own.iter().zip(theirs).map(|(o, t)| format!("{o:.3} | {t:.3}")).collect();
            println!("| {angle} | {name} | {} | {worst:+.1} % |", columns.join(" | "));
        }
        Err(error) => println!("| {angle} | {name} | {:.3} | | {:.3} | | {:.3} | | {error} |", own[0], own[1], own[2]),
    }
}

fn ours(params: &VolumeParams, frame: &Frame, pull: Vec3) -> Any<Moved> {
    let plates = sample::plates(LENGTH, WIDTH, CELLS);
    let clamped: Vec<u32> =
        (0..).zip(&plates.points).filter(|(_, p)| p.x.abs() > WIDTH - 1e-9).map(|(i, _)| i).collect();
    let model = VolumeModel::clamped(params, &plates, &clamped)?;
    let joint =
        Joint { male: Side::A, leaves: frame.s, is_fast: false, pull_on_a: pull, weight: 1.0, size_mm: SIZE_MM };
    let joints: Vec<Meeting> = plates.stations.iter().map(|s| Meeting { wall: s.across, joint: Some(joint) }).collect();
    let held = model.equilibrium(&joints, None)?.map_err(|_| "the coupon comes apart")?;
    Ok(held.displacement_mm[plates.stations.len() / 2])
}

fn run(command: &mut Command) -> Any<()> {
    let name = command.get_program().to_string_lossy().into_owned();
    let status =
        command.stdout(Stdio::null()).stderr(Stdio::null()).status().map_err(|_| format!("{name} not installed"))?;
    if status.success() { Ok(()) } else { Err(format!("{name} failed").into()) }
}

fn calculix(params: &VolumeParams, frame: &Frame, pull: Vec3, folder: &Path) -> Any<Moved> {
    std::fs::write(folder.join("coupon.geo"), geometry(params, frame))?;
    run(Command::new("gmsh")
        .args(["-3", "-order", "2", "-format", "inp", "-o", "mesh.inp", "coupon.geo"])
        .current_dir(folder))?;
    let mesh = Mesh::read(&std::fs::read_to_string(folder.join("mesh.inp"))?)?;
    let (deck, probes) = mesh.deck(params, frame, pull);
    std::fs::write(folder.join("coupon.inp"), deck)?;
    run(Command::new("timeout").args(["120", "ccx", "coupon"]).env("OMP_NUM_THREADS", "2").current_dir(folder))?;
    let results = std::fs::read_to_string(folder.join("coupon.dat"))?;
    let at = |node: usize| {
        let lines = results.lines().rev().map(|l| l.split_whitespace().collect::<Vec<_>>());
        let mut found = lines.filter(|w| w.len() == 4 && w[0].parse() == Ok(node));
        let words = found.next().ok_or("no displacement in the result")?;
        Ok::<_, Box<dyn std::error::Error>>(Vec3::new(words[1].parse()?, words[2].parse()?, words[3].parse()?))
    };
    Ok([[at(probes[0][0])?, at(probes[0][1])?], [at(probes[1][0])?, at(probes[1][1])?]])
}

/// First and last station along the seam.
fn ends() -> [f64; 2] {
    let cell = LENGTH / f64::from(CELLS[0]);
    [cell, LENGTH - cell]
}

/// Plates and bars for gmsh, with n along x, ŝ along z and the inner edge at the origin: what each side has, less the other side's wall; touching faces are shared.
fn geometry(params: &VolumeParams, frame: &Frame) -> String {
    let (d, t, [y0, y1]) = (SIZE_MM, params.wall_mm, ends());
    let (long, h, pin) = (y1 - y0, d / 2.0, 0.6 * d);
    let has_foot = |k: f64| {
        let centre = frame.n * (k * h / 2.0) + frame.s * (h / 2.0);
        centre.z < 0.05 * d && centre.x * k > 0.0
    };
    let foot = |id: u32, k: f64| {
        let x = if k < 0.0 { -h } else { 0.0 };
        if has_foot(k) { format!("Box({id}) = {{{x}, {y0}, 0, {h}, {long}, {h}}};\n") } else { String::new() }
    };
    let (foot_a, foot_b) = (foot(4, -1.0), foot(6, 1.0));
    let (list_a, list_b) = (if foot_a.is_empty() { "3" } else { "3, 4" }, if foot_b.is_empty() { "5" } else { "5, 6" });
    format!(
        "SetFactory(\"OpenCASCADE\");
Box(1) = {{{mw}, 0, 0, {w}, {l}, {t}}};\nBox(2) = {{0, 0, 0, {w}, {l}, {t}}};
Box(3) = {{{mh}, {y0}, {mp}, {h}, {long}, {pin}}};\n{foot_a}Box(5) = {{0, {y0}, {mp}, {h}, {long}, {pin}}};\n{foot_b}
Rotate{{{{0, 1, 0}}, {{0, 0, 0}}, {angle}}}{{ Volume{{1, 2}}; }}
a() = BooleanUnion{{ Volume{{1}}; Delete; }}{{ Volume{{{list_a}}}; Delete; }};
b() = BooleanUnion{{ Volume{{2}}; Delete; }}{{ Volume{{{list_b}}}; Delete; }};
parts() = BooleanFragments{{ Volume{{a()}}; Delete; }}{{ Volume{{b()}}; Delete; }};
Physical Volume(\"ALL\") = {{parts()}};
Field[1] = MathEval;\nField[1].F = \"{near} + {slope} * Max(Sqrt(x*x+z*z) - 4, 0)\";\nBackground Field = 1;
Mesh.MeshSizeExtendFromBoundary = 0;\nMesh.SaveGroupsOfNodes = 0;\n",
        mw = -WIDTH,
        w = WIDTH,
        l = LENGTH,
        mh = -h,
        mp = -pin,
        angle = -frame.degrees.to_radians(),
        near = SIZE[0],
        slope = (SIZE[1] - SIZE[0]) / (WIDTH - 4.0),
    )
}

/// Nodes by number, and elements by the volume they belong to.
struct Mesh {
    nodes: Vec<Option<Vec3>>,
    tets: Vec<(usize, [usize; 10])>,
}

impl Mesh {
    fn read(text: &str) -> Any<Self> {
        let mut mesh = Self { nodes: Vec::new(), tets: Vec::new() };
        let (mut section, mut volume, mut pending) = (String::new(), 0, Vec::new());
        for line in text.lines() {
            if line.starts_with('*') {
                section = line.to_uppercase();
                volume += usize::from(section.contains("C3D10"));
                continue;
            }
            let words: Vec<&str> = line.split(',').map(str::trim).filter(|w| !w.is_empty()).collect();
            if section.starts_with("*NODE") && words.len() == 4 {
                let id: usize = words[0].parse()?;
                mesh.nodes.resize(mesh.nodes.len().max(id + 1), None);
                mesh.nodes[id] = Some(Vec3::new(words[1].parse()?, words[2].parse()?, words[3].parse()?));
            } else if section.contains("C3D10") {
                for word in words {
                    pending.push(word.parse::<usize>()?);
                }
                if pending.len() >= 11 {
                    mesh.tets.push((volume, pending[1..11].try_into()?));
                    pending.clear();
                }
            }
        }
        if mesh.tets.is_empty() { Err("gmsh made no quadratic tetrahedra".into()) } else { Ok(mesh) }
    }

    fn at(&self, node: usize) -> Vec3 {
        self.nodes[node].unwrap_or(Vec3::NAN)
    }

    /// Gives side b its own nodes where it shares some with side a; returns pairs.
    fn split(&mut self) -> (Vec<[usize; 2]>, Vec<bool>) {
        // A volume is of side a if its plate is: the one that reaches x < −10 (volumes may be several).
        let mut least = vec![f64::INFINITY; 1 + self.tets.iter().map(|t| t.0).max().unwrap_or(0)];
        for (volume, tet) in &self.tets {
            least[*volume] = tet.iter().fold(least[*volume], |m, n| m.min(self.at(*n).x));
        }
        let is_b: Vec<bool> = self.tets.iter().map(|t| least[t.0] > -WIDTH / 2.0).collect();
        let mut used = vec![[false; 2]; self.nodes.len()];
        for ((_, tet), is_b) in self.tets.iter().zip(&is_b) {
            tet.iter().for_each(|n| used[*n][usize::from(*is_b)] = true);
        }
        let mut twin = vec![None; used.len()];
        let mut pairs = Vec::new();
        for node in (0..used.len()).filter(|n| used[*n] == [true; 2]) {
            twin[node] = Some(self.nodes.len());
            pairs.push([node, self.nodes.len()]);
            self.nodes.push(self.nodes[node]);
        }
        for ((_, tet), _) in self.tets.iter_mut().zip(&is_b).filter(|(_, b)| **b) {
            for node in tet {
                *node = twin[*node].unwrap_or(*node);
            }
        }
        (pairs, is_b)
    }

    /// The input of CalculiX, and the nodes to look at.
    fn deck(mut self, params: &VolumeParams, frame: &Frame, pull: Vec3) -> (String, [[usize; 2]; 2]) {
        let (pairs, is_b) = self.split();
        let d = SIZE_MM;
        let [y0, y1] = ends();
        let pairs: Vec<([usize; 2], Vec3)> = (pairs.into_iter())
            .map(|p| (p, self.at(p[0])))
            .filter(|(_, x)| {
                x.x.abs() < 1e-6 && (-0.6 * d - 1e-6..1e-6).contains(&x.z) && (y0 - 1e-6..y1 + 1e-6).contains(&x.y)
            })
            .collect();
        let mut deck = String::from("*NODE, NSET=NALL\n");
        for (id, p) in self.nodes.iter().enumerate().filter_map(|(id, p)| p.map(|p| (id, p))) {
            let _ = writeln!(deck, "{id}, {:.9}, {:.9}, {:.9}", p.x, p.y, p.z);
        }
        deck.push_str("*ELEMENT, TYPE=C3D10, ELSET=EALL\n");
        for (id, (_, t)) in (1..).zip(&self.tets) {
            let words: Vec<String> = t.iter().map(usize::to_string).collect();
            let _ = writeln!(deck, "{id}, {}", words.join(", "));
        }
        let (e, nu) = (params.material.youngs_modulus_mpa, params.material.poissons_ratio);
        let _ = write!(deck, "*MATERIAL, NAME=M\n*ELASTIC\n{e}, {nu}\n*SOLID SECTION, ELSET=EALL, MATERIAL=M\n");
        write_contact(&mut deck, &pairs, d, self.tets.len());
        deck.push_str("*BOUNDARY\n");
        for (id, p) in self.nodes.iter().enumerate() {
            if p.is_some_and(|p| (frame.n.x * p.x + frame.s.x * p.z).abs() > WIDTH - 1e-6) {
                let _ = writeln!(deck, "{id}, 1, 3");
            }
        }
        deck.push_str("*STEP, NLGEOM\n*STATIC\n1., 1.\n*CLOAD\n");
        let n_stations = f64::from(CELLS[0] - 1);
        let total = params.force_n_per_mm * LENGTH / f64::from(CELLS[0]) * n_stations;
        let mut force = vec![Vec3::ZERO; self.nodes.len()];
        for (node, share) in self.body_load(&is_b, |p, is_b| {
            let across = if is_b { p.x } else { -p.x };
            (0.0..d / 2.0).contains(&across) && (-0.6 * d..0.0).contains(&p.z) && (y0..y1).contains(&p.y)
        }) {
            force[node] = Vec3::new(pull.dot(frame.n), pull.y, pull.dot(frame.s)) * (share * total);
        }
        // Nothing may act on dependent unknowns: by the equation it acts on the other.
        for ([a, b], _) in &pairs {
            force[*b].x += std::mem::take(&mut force[*a].x);
        }
        for (node, force) in force.iter().enumerate() {
            for (axis, f) in (1..).zip(force.to_array()).filter(|(_, f)| *f != 0.0) {
                let _ = writeln!(deck, "{node}, {axis}, {f:.9e}");
            }
        }
        let nearest = |s: f64| {
            let off = |p: &&([usize; 2], Vec3)| (p.1.y - LENGTH / 2.0).powi(2) + (p.1.z - s).powi(2);
            pairs.iter().min_by(|p, q| off(p).total_cmp(&off(q))).map_or([0; 2], |p| p.0)
        };
        let (root, tip) = (nearest(0.0), nearest(-0.6 * d));
        deck.push_str("*NODE PRINT, NSET=NALL\nU\n*END STEP\n");
        (deck, [[root[0], tip[0]], [root[1], tip[1]]])
    }

    /// Shares of a uniform body force on the elements of each side that `is_loaded`; positive on a, negative on b.
    fn body_load(&self, is_b: &[bool], is_loaded: impl Fn(Vec3, bool) -> bool) -> Vec<(usize, f64)> {
        let mut share = vec![0.0; self.nodes.len()];
        for side in [false, true] {
            let loaded: Vec<([usize; 10], f64)> = (self.tets.iter().zip(is_b))
                .filter(|(_, b)| **b == side)
                .map(|((_, t), _)| (*t, [t[0], t[1], t[2], t[3]].map(|n| self.at(n))))
                .filter(|(_, c)| is_loaded(c.iter().sum::<Vec3>() / 4.0, side))
                .map(|(t, c)| (t, (c[1] - c[0]).cross(c[2] - c[0]).dot(c[3] - c[0]).abs()))
                .collect();
            let whole: f64 = loaded.iter().map(|l| l.1).sum();
            for (t, volume) in loaded {
                let part = volume / whole * if side { -1.0 } else { 1.0 };
                t[..4].iter().for_each(|n| share[*n] -= part / 20.0);
                t[4..].iter().for_each(|n| share[*n] += part / 5.0);
            }
        }
        share.into_iter().enumerate().filter(|(_, s)| *s != 0.0).collect()
    }
}

/// Equations along n (x) for all pairs; along ŝ (z), springs that only push for those at root and tip.
fn write_contact(deck: &mut String, pairs: &[([usize; 2], Vec3)], d: f64, n_tets: usize) {
    for ([a, b], _) in pairs {
        let _ = write!(deck, "*EQUATION\n2\n{a}, 1, 1., {b}, 1, -1.\n");
    }
    deck.push_str("*ELEMENT, TYPE=SPRING2, ELSET=FLOOR\n");
    let on_floor = pairs.iter().filter(|p| p.1.z.abs() < 1e-6 || (p.1.z + 0.6 * d).abs() < 1e-6);
    for (id, ([a, b], _)) in (n_tets + 1..).zip(on_floor) {
        let _ = writeln!(deck, "{id}, {a}, {b}");
    }
    deck.push_str("*SPRING, ELSET=FLOOR, NONLINEAR\n3, 3\n-1000000., -1.\n0., 0.\n1e-3, 1.\n");
}

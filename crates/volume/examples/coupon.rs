//! Compares the volume metric with CalculiX on two plates clamped at their far edges, joined along a straight
//! seam and pulled apart.
//!
//! `cargo run --release -p shellock-mechanics --example coupon [ANGLE]`: all rows, or those whose T is ANGLE
//! (`-45`).
//!
//! The reference has the same geometry as one solid a side. `gmsh` meshes the cross-section (walls, fronts
//! and feet cut at each other's outlines, six-node triangles), which is swept along the seam into
//! fifteen-node wedges. Where the sides touch, each has its own nodes at the same places. A closed contact is
//! an `*EQUATION` between two nodes. Its force is CalculiX's RF there, less the node's share of the load.
//! Analyses are linear: contacts that pull are opened and those that overlap closed, until CalculiX's own
//! results show none of either. Loads along n and ŝ are symmetric about the middle of the seam, and half of
//! the coupon is enough. Needs `gmsh` and `ccx`.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use shellock_geom::Vec3;
use shellock_mechanics::{Joint, Meeting, Side, sample};
use shellock_volume::{VolumeModel, VolumeParams};

const LENGTH: f64 = 40.0;
const WIDTH: f64 = 20.0;
/// Connector size D, mm.
const SIZE_MM: f64 = 3.0;
/// Squares of our plates along and across the seam; stations lie where the lines across meet the seam.
const CELLS: [u32; 2] = [20, 10];
/// Separation force on the seam, N/mm.
const FORCE: f64 = 0.1;
/// Greatest pull or overlap that counts as zero, as a share of the largest.
const NONE: f64 = 1e-3;
/// Runs of the reference after which its contacts count as not converged.
const MAX_RUNS: usize = 12;
/// Distance below which places are the same, mm.
const SAME: f64 = 1e-6;

type Any<T> = Result<T, Box<dyn std::error::Error>>;

/// Displacements at the middle of the seam: sides a and b, at the root and at the tip.
type Moved = [[Vec3; 2]; 2];

/// Region where the reference's sides touch.
#[derive(Clone, Copy, PartialEq)]
enum Touch {
    /// On the lines that our stations represent.
    Lines,
    /// Along n on the whole common face, across the walls on their whole faces; along ŝ still at root and
    /// tip.
    Faces,
}

/// Edge length of its triangles at the clamps, mm. Wedges are as long as the distance between stations.
const FAR_MM: f64 = 2.0;
/// Edge lengths of the reference's triangles at the seam, mm: one for the comparison, one to show the mesh's
/// influence.
const SIZES_MM: [f64; 2] = [0.7, 1.4];

/// Load case: T, the normal of the walls' common face, and the force on a.
struct Case {
    frame: Frame,
    wall: Vec3,
    pull: Vec3,
    name: String,
}

fn main() -> Any<()> {
    let params = VolumeParams {
        force_n_per_mm: FORCE,
        ..VolumeParams::default()
    };
    let folder = tempfile::tempdir()?;
    println!(
        "| T | load on a | opening | lines | faces | tip of a | lines | faces | tip of b | lines | faces | \
         off lines | off faces |"
    );
    println!("| --: | :-- |{}", " --: |".repeat(11));
    let mut meshes = String::new();
    let only: Option<f64> = std::env::args().nth(1).map(|word| word.parse()).transpose()?;
    for case in cases()
        .into_iter()
        .filter(|c| only.is_none_or(|degrees| degrees == c.frame.degrees))
    {
        let own = figures(&ours(&params, &case)?);
        let references = [Touch::Lines, Touch::Faces].map(|touch| {
            SIZES_MM.map(|near_mm| {
                let reference = Reference {
                    params: &params,
                    case: &case,
                    near_mm,
                    touch,
                };
                reference
                    .equilibrium(folder.path())
                    .map(|(moved, n_runs)| (figures(&moved), n_runs))
            })
        });
        let finest = [0, 1].map(|touch| &references[touch][0]);
        let text = |r: &Any<([f64; 3], usize)>, i: usize| {
            r.as_ref()
                .map_or_else(ToString::to_string, |r| format!("{:.3}", r.0[i]))
        };
        let columns: Vec<String> = (0..3)
            .map(|i| format!("{:.3} | {} | {}", own[i], text(finest[0], i), text(finest[1], i)))
            .collect();
        let off = finest.map(|r| {
            r.as_ref()
                .map_or(String::new(), |r| format!("{:+.1} %", worst(own, r.0)))
        });
        println!(
            "| {} | {} | {} |",
            case.name,
            columns.join(" | "),
            off.join(" | ")
        );
        let tips: Vec<String> = references.iter().flatten().map(|r| text(r, 1)).collect();
        let runs: Vec<String> = references
            .iter()
            .flatten()
            .map(|r| r.as_ref().map_or(String::new(), |r| r.1.to_string()))
            .collect();
        let _ = writeln!(
            meshes,
            "| {} | {} | {} |",
            case.name,
            tips.join(" | "),
            runs.join(", ")
        );
    }
    let sizes: Vec<String> = ["lines", "faces"]
        .iter()
        .flat_map(|t| SIZES_MM.map(|h| format!("{t}, {h} mm")))
        .collect();
    println!(
        "\n| T | load on a | tip of a: {} | runs |\n| --: | :-- |{}\n{meshes}",
        sizes.join(" | "),
        " --: |".repeat(5)
    );
    Ok(())
}

/// Load cases. Walls stand upright, except where they would block the pull; there a plan tilts them along ŝ.
fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for degrees in [0.0_f64, -45.0, -90.0, 45.0] {
        let frame = Frame::new(degrees);
        let wall = if degrees > 0.0 { frame.n } else { Vec3::X };
        let loads = [
            ("+ŝ", frame.s),
            ("−ŝ", -frame.s),
            ("+n", frame.n),
            ("along", Vec3::Y),
        ];
        for (load, pull) in loads.into_iter().take(if degrees == 0.0 { 4 } else { 2 }) {
            cases.push(Case {
                frame: Frame::new(degrees),
                wall,
                pull,
                name: format!("{degrees}° | {load}"),
            });
        }
    }
    cases
}

/// Opening, and displacements of the tips of a and b, µm.
fn figures(m: &Moved) -> [f64; 3] {
    let widest = m[0][0].distance(m[1][0]).max(m[0][1].distance(m[1][1]));
    [widest, m[0][1].length(), m[1][1].length()].map(|mm| mm * 1e3)
}

/// Largest deviation, %. Contacts that stay closed are compared on the scale of the moving ones.
fn worst(own: [f64; 3], theirs: [f64; 3]) -> f64 {
    let largest = theirs.iter().fold(0.0_f64, |m, v| m.max(*v));
    let off = |i: usize| {
        (own[i] - theirs[i])
            / if theirs[i] < 0.05 * largest {
                largest
            } else {
                theirs[i]
            }
    };
    100.0
        * (0..3)
            .map(off)
            .max_by(|a, b| a.abs().total_cmp(&b.abs()))
            .unwrap_or(0.0)
}

/// Axes of the cross-section: x across from a to b, z outwards.
struct Frame {
    degrees: f64,
    s: Vec3,
    n: Vec3,
}

impl Frame {
    fn new(degrees: f64) -> Self {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Self {
            degrees,
            s: Vec3::new(sin, 0.0, cos),
            n: Vec3::new(cos, 0.0, -sin),
        }
    }

    /// Components of `x` along n, u and ŝ, the axes of the reference.
    fn local(&self, x: Vec3) -> Vec3 {
        Vec3::new(x.dot(self.n), x.y, x.dot(self.s))
    }
}

fn ours(params: &VolumeParams, case: &Case) -> Any<Moved> {
    let plates = sample::plates(LENGTH, WIDTH, CELLS);
    let clamped: Vec<u32> = (0..)
        .zip(&plates.points)
        .filter(|(_, p)| p.x.abs() > WIDTH - 1e-9)
        .map(|(i, _)| i)
        .collect();
    let model = VolumeModel::with_clamp(params, &plates, &clamped)?;
    let joint = Joint {
        male: Side::A,
        leaves: case.frame.s,
        is_fast: false,
        pull_on_a: case.pull,
        weight: 1.0,
        size_mm: SIZE_MM,
    };
    let joints: Vec<Meeting> = plates
        .stations
        .iter()
        .map(|_| Meeting {
            wall: case.wall,
            joint: Some(joint),
        })
        .collect();
    let held = model
        .equilibrium(&joints, None)?
        .map_err(|_| "the coupon comes apart")?;
    Ok(held.displacement_mm[plates.stations.len() / 2].map(|side| side.map(|x| case.frame.local(x))))
}

fn run(command: &mut Command) -> Any<()> {
    let name = format!("{command:?}");
    let status = command
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .map_err(|_| format!("{name} not installed"))?;
    if status.success() {
        Ok(())
    } else {
        Err(format!("{name} failed").into())
    }
}

/// One load case of the reference.
struct Reference<'a> {
    params: &'a VolumeParams,
    case: &'a Case,
    near_mm: f64,
    touch: Touch,
}

impl Reference<'_> {
    /// Displacements in the reference's axes, and the number of runs until its contacts settled.
    fn equilibrium(&self, folder: &Path) -> Any<(Moved, usize)> {
        std::fs::write(folder.join("section.geo"), self.geometry())?;
        run(Command::new("timeout")
            .args([
                "60",
                "gmsh",
                "-2",
                "-order",
                "2",
                "-format",
                "inp",
                "-o",
                "section.inp",
                "section.geo",
            ])
            .current_dir(folder))?;
        let section = Section::read(
            &std::fs::read_to_string(folder.join("section.inp"))?,
            &self.case.frame,
        )?;
        let solid = Solid::swept(&section, self);
        let (contacts, probes) = (solid.contacts(&section, self), solid.probes(&section)?);
        let (model, load) = (solid.model(self), self.load_n_mm3());
        // Start from open contacts: those closed in excess open only one by one.
        let mut is_closed: Vec<bool> = contacts.iter().map(|c| c.is_tie).collect();
        let mut fewest_wrong = usize::MAX;
        for n_runs in 1..=MAX_RUNS {
            std::fs::write(
                folder.join("coupon.inp"),
                model.clone() + &self.step(&contacts, &is_closed),
            )?;
            run(Command::new("timeout")
                .args(["60", "ccx", "coupon"])
                .env("OMP_NUM_THREADS", "1")
                .current_dir(folder))?;
            let results = Results::read(&std::fs::read_to_string(folder.join("coupon.dat"))?)?;
            let wrong = results.wrong(&contacts, &is_closed, |node| {
                load[solid.side[node]] * solid.front_mm3[node]
            })?;
            if wrong.is_empty() {
                let at = |node: usize| results.displacement(node);
                return Ok((
                    [
                        [at(probes[0][0])?, at(probes[0][1])?],
                        [at(probes[1][0])?, at(probes[1][1])?],
                    ],
                    n_runs,
                ));
            }
            // Change all wrong contacts at once until that no longer helps; then the first half.
            let n_changed = if wrong.len() < fewest_wrong {
                wrong.len()
            } else {
                wrong.len().div_ceil(2)
            };
            fewest_wrong = fewest_wrong.min(wrong.len());
            wrong
                .into_iter()
                .take(n_changed)
                .for_each(|i| is_closed[i] = !is_closed[i]);
        }
        Err("not settled".into())
    }

    /// Positions of the first and last station along the seam.
    fn ends(&self) -> [f64; 2] {
        let cell = LENGTH / f64::from(CELLS[0]);
        [cell, LENGTH - cell]
    }

    /// Returns true if one half may represent the whole, by symmetry about the middle of the seam.
    fn is_half(&self) -> bool {
        self.case.pull.y == 0.0
    }

    /// Geometry of the cross-section for gmsh, with n along x, ŝ along y and the inner edge at the origin.
    /// Walls have two layers, so that there are nodes at mid-wall.
    fn geometry(&self) -> String {
        let (d, half_wall) = (SIZE_MM, self.params.wall_mm / 2.0);
        let (h, pin) = (d / 2.0, 0.6 * d);
        let foot = |id: u32, k: f64| {
            let centre = self.case.frame.n * (k * h / 2.0) + self.case.frame.s * (h / 2.0);
            let x = if k < 0.0 { -h } else { 0.0 };
            let has_foot = centre.z < 0.05 * d && centre.x * k > 0.0;
            if has_foot {
                format!("Rectangle({id}) = {{{x}, 0, 0, {h}, {h}}};\n")
            } else {
                String::new()
            }
        };
        format!(
            "SetFactory(\"OpenCASCADE\");
Rectangle(1) = {{{mw}, 0, 0, {w}, {t}}};\nRectangle(2) = {{{mw}, {t}, 0, {w}, {t}}};
Rectangle(3) = {{0, 0, 0, {w}, {t}}};\nRectangle(4) = {{0, {t}, 0, {w}, {t}}};
Rotate {{{{0, 0, 1}}, {{0, 0, 0}}, {angle}}} {{ Surface{{1:4}}; }}
Rectangle(5) = {{{mh}, {mp}, 0, {h}, {pin}}};\nRectangle(6) = {{0, {mp}, 0, {h}, {pin}}};\n{feet}
BooleanFragments{{ Surface{{:}}; Delete; }}{{}}
Physical Surface(\"ALL\") = {{Surface{{:}}}};
Field[1] = MathEval;\nField[1].F = \"Min({far}, {near} + 0.25 * Max(Sqrt(x*x+y*y) - 2, 0))\";\nBackground \
             Field = 1;
Mesh.MeshSizeExtendFromBoundary = 0;\nMesh.MeshSizeFromPoints = 0;\nMesh.SaveGroupsOfNodes = 0;\n",
            mw = -WIDTH,
            w = WIDTH,
            t = half_wall,
            mh = -h,
            mp = -pin,
            angle = self.case.frame.degrees.to_radians(),
            feet = foot(7, -1.0) + &foot(8, 1.0),
            near = self.near_mm,
            far = FAR_MM,
        )
    }

    /// Separation force on the fronts of a and b, spread over their volume, N/mm³, in the reference's axes.
    fn load_n_mm3(&self) -> [Vec3; 2] {
        let (d, [y0, y1]) = (SIZE_MM, self.ends());
        let joined_mm = LENGTH * f64::from(CELLS[0] - 1) / f64::from(CELLS[0]);
        let pull = self.case.frame.local(self.case.pull)
            * (self.params.force_n_per_mm * joined_mm / (0.3 * d * d * (y1 - y0)));
        [pull, -pull]
    }

    /// Input of a step: the contacts as they are, loads and output requests.
    fn step(&self, contacts: &[Contact], is_closed: &[bool]) -> String {
        let mut deck = String::new();
        for (contact, _) in contacts
            .iter()
            .zip(is_closed)
            .filter(|(_, is_closed)| **is_closed)
        {
            let ([a, b], opens) = (contact.nodes.map(|node| node + 1), contact.opens.to_array());
            // The dependent unknown is the node's motion along the axis nearest to the contact's.
            let mut axes = [0, 2];
            axes.sort_by(|i, j| opens[*j].abs().total_cmp(&opens[*i].abs()));
            let of_axis = |&axis: &usize| {
                let (dof, factor) = (axis + 1, opens[axis]);
                format!("{a}, {dof}, {factor:.12}, {b}, {dof}, {:.12}", -factor)
            };
            let terms: Vec<String> = axes
                .iter()
                .filter(|axis| opens[**axis].abs() > SAME)
                .map(of_axis)
                .collect();
            let _ = writeln!(deck, "*EQUATION\n{}\n{}", 2 * terms.len(), terms.join(", "));
        }
        deck.push_str("*NSET, NSET=TOUCHING\n");
        for [a, b] in contacts.iter().map(|c| c.nodes) {
            let _ = writeln!(deck, "{}, {}", a + 1, b + 1);
        }
        deck.push_str("*STEP\n*STATIC\n*DLOAD\n");
        for (side, load) in self.load_n_mm3().into_iter().enumerate() {
            let (size, Vec3 { x, y, z }) = (load.length(), load.normalize());
            let _ = writeln!(deck, "FRONT{side}, GRAV, {size:.12}, {x:.12}, {y:.12}, {z:.12}");
        }
        deck.push_str("*NODE PRINT, NSET=TOUCHING\nU\n*NODE PRINT, NSET=TOUCHING\nRF\n*END STEP\n");
        deck
    }
}

/// Cross-section: places (n, 0, ŝ), six-node triangles with their sides, and the places where the sides
/// touch.
struct Section {
    nodes: Vec<Vec3>,
    triangles: Vec<Triangle>,
    /// Nodes of a and b at the same place.
    pairs: Vec<[usize; 2]>,
    is_corner: Vec<bool>,
}

struct Triangle {
    nodes: [usize; 6],
    side: usize,
    is_wall: bool,
    centre: Vec3,
}

impl Section {
    fn read(text: &str, frame: &Frame) -> Any<Self> {
        let mut at: BTreeMap<usize, Vec3> = BTreeMap::new();
        let mut found: Vec<[usize; 6]> = Vec::new();
        let mut keyword = String::new();
        for line in text.lines() {
            if line.starts_with('*') {
                keyword = line.to_uppercase();
                continue;
            }
            let words: Vec<&str> = line.split(',').map(str::trim).filter(|w| !w.is_empty()).collect();
            if keyword.starts_with("*NODE") && words.len() == 4 {
                at.insert(
                    words[0].parse()?,
                    Vec3::new(words[1].parse()?, 0.0, words[2].parse()?),
                );
            } else if keyword.contains("CPS6") && words.len() == 7 {
                let ids = words[1..]
                    .iter()
                    .map(|w| w.parse())
                    .collect::<Result<Vec<usize>, _>>()?;
                found.push(ids.as_slice().try_into()?);
            }
        }
        if found.is_empty() {
            Err("gmsh made no quadratic triangles".into())
        } else {
            Ok(Self::split(&at, &found, frame))
        }
    }

    /// Gives each side its own nodes. Above the inner face the seam's plane separates the sides, below it the
    /// common face does.
    fn split(at: &BTreeMap<usize, Vec3>, found: &[[usize; 6]], frame: &Frame) -> Self {
        let mut own = BTreeMap::new();
        let mut section = Self {
            nodes: Vec::new(),
            triangles: Vec::new(),
            pairs: Vec::new(),
            is_corner: Vec::new(),
        };
        for ids in found {
            let centre = ids[..3].iter().map(|id| at[id]).sum::<Vec3>() / 3.0;
            let middle = frame.n * centre.x + frame.s * centre.z;
            let is_wall = middle.z > 0.0;
            let side = usize::from(if is_wall { middle.x > 0.0 } else { centre.x > 0.0 });
            let nodes = ids.map(|id| {
                *own.entry((id, side)).or_insert_with(|| {
                    section.nodes.push(at[&id]);
                    section.is_corner.push(false);
                    section.nodes.len() - 1
                })
            });
            nodes[..3].iter().for_each(|node| section.is_corner[*node] = true);
            section.triangles.push(Triangle {
                nodes,
                side,
                is_wall,
                centre,
            });
        }
        section.pairs = (own.iter().filter(|(key, _)| key.1 == 0))
            .filter_map(|(key, a)| Some([*a, *own.get(&(key.0, 1))?]))
            .collect();
        section
    }
}

/// Fifteen-node wedges: the cross-section swept along y.
struct Solid {
    nodes: Vec<Vec3>,
    /// Nodes of each wedge, with the side whose front it is in, if any.
    wedges: Vec<([usize; 15], Option<usize>)>,
    side: Vec<usize>,
    /// Share of each node in the volume of its side's front, mm³.
    front_mm3: Vec<f64>,
    /// Node at each place of the section, at each half layer.
    place: Vec<BTreeMap<usize, usize>>,
    y_of: Vec<f64>,
}

/// Two nodes at the same place. The first may move from the second along `opens`, but not against it; if
/// `is_tie`, neither way.
struct Contact {
    nodes: [usize; 2],
    opens: Vec3,
    is_tie: bool,
}

impl Solid {
    fn swept(section: &Section, reference: &Reference) -> Self {
        let n_layers = CELLS[0] as usize / if reference.is_half() { 2 } else { 1 };
        let layer_mm = LENGTH / f64::from(CELLS[0]);
        let mut solid = Self {
            nodes: Vec::new(),
            wedges: Vec::new(),
            side: Vec::new(),
            front_mm3: Vec::new(),
            place: vec![BTreeMap::new(); 2 * n_layers + 1],
            y_of: (0..=2 * n_layers)
                .map(|half| half as f64 * layer_mm / 2.0)
                .collect(),
        };
        let (pin, h) = (0.6 * SIZE_MM, 0.5 * SIZE_MM);
        let [y0, y1] = reference.ends();
        for below in (0..2 * n_layers).step_by(2) {
            let has_connector = (y0..y1).contains(&solid.y_of[below + 1]);
            for triangle in section.triangles.iter().filter(|t| t.is_wall || has_connector) {
                let Vec3 { x, z, .. } = triangle.centre;
                let is_front = has_connector
                    && (-pin..0.0).contains(&z)
                    && x.abs() < h
                    && (x > 0.0) == (triangle.side == 1);
                solid.sweep(section, triangle, below, is_front.then_some(layer_mm));
            }
        }
        solid
    }

    /// Sweeps `triangle` into a wedge in one layer; the layer's height is given if the wedge carries load.
    fn sweep(&mut self, section: &Section, triangle: &Triangle, below: usize, loaded_mm: Option<f64>) {
        // Reversed, so that the sweep goes up: n × ŝ points down the seam.
        let [a, c, b, ac, cb, ba] = triangle.nodes;
        let (corners, middles) = ([a, b, c], [ba, cb, ac]);
        let mut nodes = [0; 15];
        for (i, (corner, middle)) in corners.into_iter().zip(middles).enumerate() {
            nodes[i] = self.node(section, below, corner);
            nodes[3 + i] = self.node(section, below + 2, corner);
            nodes[6 + i] = self.node(section, below, middle);
            nodes[9 + i] = self.node(section, below + 2, middle);
            nodes[12 + i] = self.node(section, below + 1, corner);
        }
        let [p, q, r] = corners.map(|at| section.nodes[at]);
        let volume = loaded_mm.unwrap_or(0.0) * (q - p).cross(r - p).length() / 2.0;
        for (i, node) in nodes.into_iter().enumerate() {
            self.side[node] = triangle.side;
            // Integrals of the shape functions over the wedge: corners, midpoints of the triangles' sides,
            // midpoints in between.
            self.front_mm3[node] += volume * [-1.0 / 9.0, -1.0 / 9.0, 1.0 / 6.0, 1.0 / 6.0, 2.0 / 9.0][i / 3];
        }
        self.wedges.push((nodes, loaded_mm.map(|_| triangle.side)));
    }

    fn node(&mut self, section: &Section, half: usize, at: usize) -> usize {
        let (nodes, y, side, front) = (
            &mut self.nodes,
            self.y_of[half],
            &mut self.side,
            &mut self.front_mm3,
        );
        *self.place[half].entry(at).or_insert_with(|| {
            nodes.push(Vec3 {
                y,
                ..section.nodes[at]
            });
            side.push(0);
            front.push(0.0);
            nodes.len() - 1
        })
    }

    fn contacts(&self, section: &Section, reference: &Reference) -> Vec<Contact> {
        let (pin, frame) = (0.6 * SIZE_MM, &reference.case.frame);
        let [y0, y1] = reference.ends();
        let middle = frame.local(Vec3::Z * (reference.params.wall_mm / 2.0));
        let off_wall = -frame.local(reference.case.wall);
        let mut contacts = Vec::new();
        for (half, nodes) in self.place.iter().enumerate() {
            if !(y0 - SAME..=y1 + SAME).contains(&self.y_of[half]) {
                continue;
            }
            for pair in &section.pairs {
                let [Some(&a), Some(&b)] = pair.map(|p| nodes.get(&p)) else {
                    continue;
                };
                let mut add = |opens, is_tie| {
                    contacts.push(Contact {
                        nodes: [a, b],
                        opens,
                        is_tie,
                    })
                };
                let x = section.nodes[pair[0]];
                let is_common = x.x.abs() < SAME && (-pin - SAME..SAME).contains(&x.z);
                let is_end = is_common && (x.z.abs() < SAME || x.z < SAME - pin);
                // Under even pressure, the nodes of a face at the corners of elements carry no force.
                let is_between = section.is_corner[pair[0]] != (half % 2 == 0);
                let (is_tied, is_wall) = match reference.touch {
                    Touch::Lines => (is_end, x.distance(middle) < SAME),
                    Touch::Faces => (is_common, !is_common && is_between),
                };
                if is_tied {
                    add(Vec3::X, true);
                }
                if is_end {
                    add(Vec3::Z, false);
                }
                if is_wall {
                    add(off_wall, false);
                }
            }
        }
        contacts
    }

    fn probes(&self, section: &Section) -> Any<[[usize; 2]; 2]> {
        let half = self
            .y_of
            .iter()
            .position(|y| (y - LENGTH / 2.0).abs() < SAME)
            .ok_or("no middle")?;
        let at = |z: f64| {
            let is_there = |p: &&[usize; 2]| section.nodes[p[0]].distance(Vec3::Z * z) < SAME;
            let pair = section.pairs.iter().find(is_there).ok_or("no node to look at")?;
            Ok::<_, &'static str>(pair.map(|p| self.place[half][&p]))
        };
        let (root, tip) = (at(0.0)?, at(-0.6 * SIZE_MM)?);
        Ok([[root[0], tip[0]], [root[1], tip[1]]])
    }

    /// Input of CalculiX, without contacts and loads.
    fn model(&self, reference: &Reference) -> String {
        let mut deck = String::from("*NODE, NSET=NALL\n");
        for (id, p) in (1..).zip(&self.nodes) {
            let _ = writeln!(deck, "{id}, {:.9}, {:.9}, {:.9}", p.x, p.y, p.z);
        }
        for (name, wanted) in [("FRONT0", Some(0)), ("FRONT1", Some(1)), ("REST", None)] {
            let _ = writeln!(deck, "*ELEMENT, TYPE=C3D15, ELSET={name}");
            for (id, (nodes, _)) in (1..).zip(&self.wedges).filter(|(_, w)| w.1 == wanted) {
                let words: Vec<String> = nodes.iter().map(|n| (n + 1).to_string()).collect();
                let _ = writeln!(deck, "{id}, {}", words.join(", "));
            }
        }
        let (e, nu) = (
            reference.params.material.youngs_modulus_mpa,
            reference.params.material.poissons_ratio,
        );
        let _ = writeln!(
            deck,
            "*ELSET, ELSET=EALL\nFRONT0, FRONT1, REST\n*MATERIAL, NAME=M\n*ELASTIC\n{e}, {nu}\n*DENSITY\n1.
*SOLID SECTION, ELSET=EALL, MATERIAL=M\n*BOUNDARY"
        );
        for (id, p) in (1..).zip(&self.nodes) {
            if (reference.case.frame.n.x * p.x + reference.case.frame.s.x * p.z).abs() > WIDTH - SAME {
                let _ = writeln!(deck, "{id}, 1, 3");
            } else if reference.is_half() && p.y > LENGTH / 2.0 - SAME {
                let _ = writeln!(deck, "{id}, 2, 2");
            }
        }
        deck
    }
}

/// Results printed by CalculiX: displacements and forces by node.
struct Results {
    displacement: BTreeMap<usize, Vec3>,
    force: BTreeMap<usize, Vec3>,
}

impl Results {
    fn read(text: &str) -> Any<Self> {
        let mut results = Self {
            displacement: BTreeMap::new(),
            force: BTreeMap::new(),
        };
        let mut is_force = false;
        for line in text.lines() {
            if line.contains("for set") {
                is_force = line.contains("forces");
                continue;
            }
            let [node, x, y, z] = line.split_whitespace().collect::<Vec<_>>()[..] else {
                continue;
            };
            let value = Vec3::new(x.parse()?, y.parse()?, z.parse()?);
            if is_force {
                &mut results.force
            } else {
                &mut results.displacement
            }
            .insert(node.parse::<usize>()? - 1, value);
        }
        Ok(results)
    }

    fn displacement(&self, node: usize) -> Any<Vec3> {
        self.displacement
            .get(&node)
            .copied()
            .ok_or_else(|| format!("no displacement of node {node}").into())
    }

    /// One-sided contacts that pull or overlap.
    fn wrong(
        &self,
        contacts: &[Contact],
        is_closed: &[bool],
        body_load: impl Fn(usize) -> Vec3,
    ) -> Any<Vec<usize>> {
        let mut values = Vec::new();
        for (i, contact) in contacts.iter().enumerate() {
            let [a, b] = contact.nodes;
            values.push(if is_closed[i] {
                // The node's force, less its share of the load, is the contact force.
                (self.force.get(&a).copied().ok_or("no force at a contact")? - body_load(a))
                    .dot(contact.opens)
            } else {
                (self.displacement(a)? - self.displacement(b)?).dot(contact.opens)
            });
        }
        let largest = [false, true].map(|closed| {
            (values.iter().zip(is_closed))
                .filter(|v| *v.1 == closed)
                .fold(0.0_f64, |m, v| m.max(v.0.abs()))
        });
        let is_wrong =
            |i: &usize| !contacts[*i].is_tie && values[*i] < -NONE * largest[usize::from(is_closed[*i])];
        Ok((0..contacts.len()).filter(is_wrong).collect())
    }
}

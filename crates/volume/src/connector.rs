//! Pins and channels: short bars of quadratic tetrahedra along the seams, hung on the walls.
//!
//! ```text
//!      n ▲      male's wall         female's wall        in the plane of ŝ and n, at the inner edge o
//!        │    ······o──────▶ ŝ      o······
//!        │   front  │ foot        front: −0.6 D ≤ s ≤ 0, 0.5 D thick; the male's on the side n < 0,
//!            ┌──────o──────┐             the female's on n > 0; both touch along n = 0
//!            │ pin  │      │      foot:  0 ≤ s ≤ 0.5 D, where the front alone would hang on the edge
//!            └──────┴──────┘             only, because ŝ lies across the wall
//! ```
//! A corner that lies in the wall of its own side, or in the face s = 0 where there is no foot, moves with
//! the wall. Its motion is interpolated linearly in the nearest tetrahedron, and extrapolated beyond it,
//! which is exact for rigid motions. So no angle of ŝ needs another mesh, and bars may overlap their own
//! wall.

use shellock_geom::Vec3;
use shellock_geom::sparse::SparseError;
use shellock_mechanics::connector::{PIN_DEPTH, PIN_WIDTH};
use shellock_mechanics::{Joint, Side};

use super::VolumeModel;
use super::element::{EDGES, Order, gradients, lame, stiffness, volume_6};
use super::front::Front;
use super::unknowns::{Labels, N_ACROSS, N_ALONG_S, N_SECTION, Owner, ROWS};

/// Distance outside the wall at which corners still count as inside, as a share of D: points on the inner
/// surface are inside.
const SLACK: f64 = 0.05;
/// Least volume of a tetrahedron of a bar, as a share of a straight one's. Below it, the frames twist too far
/// for a connector.
const MIN_VOLUME_SHARE: f64 = 0.1;

/// Nodes of the bar between two stations: cross-sections at both ends and halfway.
const N_BAR: usize = 3 * N_SECTION;

/// Motion of a node as a weighted sum of the motions of kept wall nodes.
pub(super) type Hold = Vec<(u32, f64)>;

/// Cross-section of one side at a station.
#[derive(Debug)]
pub(super) struct Section {
    /// Corners along s (tip, root, foot), and across from the common face.
    at: [[Vec3; 2]; 3],
    hold: [[Option<Hold>; 2]; 3],
    has_foot: bool,
    /// Directions n, ŝ and u, which are equal on both sides.
    frame: [Vec3; 3],
    /// Sign of the side: 1 for the male, −1 for the female.
    sign: f64,
    /// Separation force on the side, N.
    force_n: Vec3,
}

impl Section {
    /// Indices along s of the contact pairs on the common face: root and tip.
    const PAIRS: [usize; 2] = [1, 0];

    /// Cross-section of `side` at a station joined by `joint`, or `along_mm` further along. A section further
    /// on carries no force.
    pub fn new(model: &VolumeModel, station: usize, side: Side, joint: &Joint, along_mm: f64) -> Self {
        let (place, size) = (&model.stations[station], joint.size_mm);
        let inland = if side == Side::A {
            -place.across
        } else {
            place.across
        };
        let male_to_female = if joint.male == Side::A {
            place.across
        } else {
            -place.across
        };
        // n = −u × ŝ with u = v × N, v from male to female.
        let s = joint.leaves;
        let n = male_to_female * s.dot(place.normal) - place.normal * s.dot(male_to_female);
        let thick = n * (if joint.male == side { -PIN_WIDTH } else { PIN_WIDTH } * size);
        let edge = model.inner_edge[station][side.index()] + along_mm * place.tangent;
        let at = [-PIN_DEPTH, 0.0, PIN_WIDTH]
            .map(|s_share| [0.0, 1.0].map(|k| edge + s * (s_share * size) + thick * k));

        let is_inside = |x: Vec3| {
            let least = -SLACK * size;
            (x - edge).dot(place.normal) >= least && (x - edge).dot(inland) >= least
        };
        let foot = (at[1][0] + at[1][1] + at[2][0] + at[2][1]) / 4.0 - edge;
        let has_foot = foot.dot(place.normal) < SLACK * size && foot.dot(inland) > 0.0;
        let hold = [0, 1, 2].map(|is| {
            [0, 1].map(|k| {
                let is_root = (is == 1) && (k == 0 || !has_foot);
                (is_root || is_inside(at[is][k])).then(|| model.hold(station, side, at[is][k]))
            })
        });
        let pull = joint.pull_on_a * (model.params.force_n_per_mm * place.length_mm);
        Self {
            at,
            hold,
            has_foot,
            frame: [n, s, place.tangent],
            sign: if joint.male == side { 1.0 } else { -1.0 },
            force_n: if side == Side::A { pull } else { -pull },
        }
    }

    /// Iterates over the contact rows on this side: row, direction, place.
    pub fn rows(&self) -> impl Iterator<Item = (usize, Vec3, Vec3)> {
        Self::PAIRS.into_iter().enumerate().flat_map(move |(pair, is)| {
            (0..3).map(move |c| (3 * pair + c, self.frame[c] * self.sign, self.at[is][0]))
        })
    }

    /// Separation force, and the four places on which a quarter of it acts.
    pub fn load(&self) -> (Vec3, [Vec3; 4]) {
        (
            self.force_n,
            [self.at[0][0], self.at[0][1], self.at[1][0], self.at[1][1]],
        )
    }
}

/// Bar of one side along the seam, from a station to the next, or halfway there with an end of its own.
#[derive(Debug)]
pub(super) struct Bar {
    /// Index among the bars of all parts.
    pub index: usize,
    pub side: Side,
    pub from: usize,
    pub to: Result<usize, Section>,
    /// Corners of the bar's tetrahedra, as nodes of its lattice.
    pub tets: Vec<[usize; 4]>,
}

/// Cross-sections of both sides at each station; `None` where it is not joined.
pub(super) type Sections = Vec<[Option<Section>; 2]>;

/// First and last of a part's bars at each section, by station and side. The first carries the contact rows
/// and load of the station.
pub(super) type Spans = Vec<[Option<[usize; 2]>; 2]>;

/// Lattice node at `is` along s, `k` across and `it` along the seam.
fn lattice(is: usize, k: usize, it: usize) -> usize {
    (it * N_ALONG_S + is) * N_ACROSS + k
}

/// Corners of the six tetrahedra of the cell from tip to root (0) or root to foot (1).
fn cell_tets(cell: usize) -> [[usize; 4]; 6] {
    [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]].map(|axes| {
        let mut at = [2 * cell, 0, 0];
        let mut corners = [lattice(at[0], at[1], at[2]); 4];
        for (corner, axis) in corners[1..].iter_mut().zip(axes) {
            at[axis] += 2;
            *corner = lattice(at[0], at[1], at[2]);
        }
        corners
    })
}

/// Position of the corner `node` of the lattice.
pub(super) fn corner(sections: [&Section; 2], node: usize) -> Vec3 {
    let (it, is, k) = (node / N_SECTION, node % N_SECTION / N_ACROSS, node % N_ACROSS);
    sections[it / 2].at[is / 2][k / 2]
}

/// Weights that move a node with the wall, if it does. A node halfway moves with the wall if both its ends
/// do.
fn hold(sections: [&Section; 2], node: usize) -> Option<Hold> {
    let (it, is, k) = (node / N_SECTION, node % N_SECTION / N_ACROSS, node % N_ACROSS);
    let end = |up: bool| {
        let shifted = |x: usize| {
            if x.is_multiple_of(2) {
                x
            } else if up {
                x + 1
            } else {
                x - 1
            }
        };
        sections[shifted(it) / 2].hold[shifted(is) / 2][shifted(k) / 2].as_ref()
    };
    if it % 2 + is % 2 + k % 2 == 0 {
        return end(true).cloned();
    }
    Some(
        [end(false)?, end(true)?]
            .into_iter()
            .flatten()
            .map(|(node, w)| (*node, 0.5 * w))
            .collect(),
    )
}

/// Tetrahedra of the bar between two cross-sections, as nodes of its lattice, without those that move rigidly
/// with the wall. `None` if the sections are twisted so far that the bar would turn inside out.
pub(super) fn tets_between(sections: [&Section; 2]) -> Option<Vec<[usize; 4]>> {
    let has_foot = sections[0].has_foot && sections[1].has_foot;
    let mut tets = Vec::new();
    for cell in 0..1 + usize::from(has_foot) {
        let mut cell_tets = cell_tets(cell);
        let along =
            corner(sections, lattice(2 * cell, 0, 0)).distance(corner(sections, lattice(2 * cell, 0, 2)));
        let section = sections[0].at[cell][0].distance(sections[0].at[cell + 1][0])
            * sections[0].at[cell][0].distance(sections[0].at[cell][1]);
        // Kuhn's tetrahedra: even permutations of the axes have one sign, odd ones the other.
        let volumes: Vec<f64> = (cell_tets.iter().enumerate())
            .map(|(i, t)| volume_6(t.map(|node| corner(sections, node))) * if i < 3 { 1.0 } else { -1.0 })
            .collect();
        let sign = volumes[0].signum();
        if volumes
            .iter()
            .any(|v| v * sign < MIN_VOLUME_SHARE * along * section)
        {
            return None;
        }
        for (i, tet) in cell_tets.iter_mut().enumerate() {
            if (i < 3) != (sign > 0.0) {
                tet.swap(2, 3);
            }
        }
        let nodes: Vec<usize> = cell_tets.concat();
        if nodes.into_iter().any(|node| hold(sections, node).is_none()) {
            tets.extend(cell_tets);
        }
    }
    Some(tets)
}

impl Bar {
    /// Stations of the bar: one or two.
    pub fn stations(&self) -> impl Iterator<Item = usize> {
        std::iter::once(self.from).chain(self.to.as_ref().ok().copied())
    }

    /// Cross-sections at the bar's ends.
    fn ends<'a>(&'a self, sections: &'a Sections) -> Option<[&'a Section; 2]> {
        let of = |station: usize| sections[station][self.side.index()].as_ref();
        let to = match &self.to {
            Ok(station) => of(*station)?,
            Err(end) => end,
        };
        Some([of(self.from)?, to])
    }

    /// Cross-sections at the bar's ends, and the unknowns that move each node, by the first of three: the
    /// node's own, or those of the wall.
    pub fn movers<'a>(
        &'a self,
        sections: &'a Sections,
        labels: Labels,
    ) -> Option<([&'a Section; 2], Vec<Hold>)> {
        let ends = self.ends(sections)?;
        let [halfway, end] = labels.within(self.index);
        let to = self
            .to
            .as_ref()
            .map_or(end, |station| labels.section(*station, self.side));
        let base = [labels.section(self.from, self.side), halfway, to];
        let mover = |node: usize| match hold(ends, node) {
            Some(hold) => hold.into_iter().map(|(kept, w)| (3 * kept, w)).collect(),
            None => vec![(base[node / N_SECTION] + 3 * (node % N_SECTION) as u32, 1.0)],
        };
        Some((ends, (0..N_BAR).map(mover).collect()))
    }

    /// Stiffness, contact rows and load of the bar. `carries` selects the stations whose rows and load belong
    /// to this bar, so that each counts once.
    pub fn front(
        &self,
        model: &VolumeModel,
        sections: &Sections,
        carries: impl Fn(usize) -> bool,
        labels: Labels,
    ) -> Front {
        let Some((ends, movers)) = self.movers(sections, labels) else {
            return Front::default();
        };
        let carried: Vec<(usize, usize)> = self
            .stations()
            .enumerate()
            .filter(|(_, station)| carries(*station))
            .collect();
        let mut sum = Accumulator::new(self.used_nodes(), &movers, labels, &carried);
        sum.add_stiffness(&self.lattice_stiffness(model, ends), &movers);
        for (i, station) in carried {
            sum.add_contact(ends[i], &movers, 2 * i, |row| labels.row(station, row));
            sum.add_load(ends[i], &movers, 2 * i, labels.load());
        }
        sum.front
    }

    fn used_nodes(&self) -> Vec<usize> {
        let mut nodes: Vec<usize> = self.tets.iter().flat_map(|t| with_middles(*t)).collect();
        // Pairs and loads act on front corners, even if no element uses them.
        nodes.extend(
            [0, 2]
                .into_iter()
                .flat_map(|it| [0, 2].map(|is| [0, 2].map(|k| lattice(is, k, it))))
                .flatten(),
        );
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    fn lattice_stiffness(&self, model: &VolumeModel, sections: [&Section; 2]) -> Vec<f64> {
        const N: usize = 3 * N_BAR;
        let mut k_bar = vec![0.0; N * N];
        let lame = lame(&model.params.material);
        for tet in &self.tets {
            let nodes = with_middles(*tet);
            stiffness(
                Order::Quadratic,
                tet.map(|c| corner(sections, c)),
                lame,
                |a, b, k| {
                    for (i, k) in k.iter().enumerate() {
                        for (j, k) in k.iter().enumerate() {
                            let (row, column) = (3 * nodes[a] + i, 3 * nodes[b] + j);
                            k_bar[row + N * column] += k;
                            if a != b {
                                k_bar[column + N * row] += k;
                            }
                        }
                    }
                },
            );
        }
        k_bar
    }
}

/// Ten nodes of a tetrahedron of the lattice.
pub(super) fn with_middles(corners: [usize; 4]) -> [usize; 10] {
    let mut nodes = [0; 10];
    nodes[..4].copy_from_slice(&corners);
    for (node, [i, j]) in nodes[4..].iter_mut().zip(EDGES) {
        *node = usize::midpoint(corners[i], corners[j]);
    }
    nodes
}

/// Interpolates at `x` in the nearest of `tets`, which has the largest least barycentric coordinate: its
/// corners with their weights.
pub(super) fn interpolation(tets: impl Iterator<Item = ([u32; 4], [Vec3; 4])>, x: Vec3) -> [(u32, f64); 4] {
    let mut best = ([(0, 0.0); 4], f64::NEG_INFINITY);
    for (nodes, corners) in tets {
        let g = gradients(corners);
        let l: [f64; 4] = std::array::from_fn(|i| f64::from(u8::from(i == 0)) + g[i].dot(x - corners[0]));
        let least = l.into_iter().fold(f64::INFINITY, f64::min);
        if least > best.1 {
            best = (std::array::from_fn(|i| (nodes[i], l[i])), least);
        }
    }
    best.0
}

/// Accumulates the front of a bar.
struct Accumulator {
    front: Front,
    used: Vec<usize>,
}

impl Accumulator {
    fn new(used: Vec<usize>, movers: &[Hold], labels: Labels, carried: &[(usize, usize)]) -> Self {
        let mut ids: Vec<u32> = used
            .iter()
            .flat_map(|&node| &movers[node])
            .flat_map(|(first, _)| *first..*first + 3)
            .collect();
        for (_, station) in carried {
            ids.extend((0..ROWS).map(|row| labels.row(*station, row)));
            ids.push(labels.load());
        }
        ids.sort_unstable();
        ids.dedup();
        let n = ids.len();
        Self {
            front: Front {
                ids,
                values: vec![0.0; n * n],
            },
            used,
        }
    }

    fn place(&self, id: u32) -> usize {
        self.front.ids.partition_point(|&other| other < id)
    }

    /// Adds Pᵀ K P, where P maps the unknowns to the nodes.
    fn add_stiffness(&mut self, k_bar: &[f64], movers: &[Hold]) {
        const N: usize = 3 * N_BAR;
        let n = self.front.ids.len();
        let placed: Vec<Vec<(usize, f64)>> = (self.used.iter())
            .map(|&node| {
                movers[node]
                    .iter()
                    .map(|(first, w)| (self.place(*first), *w))
                    .collect()
            })
            .collect();
        let mut half = vec![0.0; n * N];
        for (&node, movers) in self.used.iter().zip(&placed) {
            for &(at, weight) in movers {
                for i in 0..3 {
                    let source = &k_bar[N * (3 * node + i)..][..N];
                    for (sum, k) in half[N * (at + i)..][..N].iter_mut().zip(source) {
                        *sum += weight * k;
                    }
                }
            }
        }
        for column in 0..n {
            for (&node, movers) in self.used.iter().zip(&placed) {
                for &(at, weight) in movers {
                    for i in 0..3 {
                        self.front.values[at + i + n * column] += weight * half[N * column + 3 * node + i];
                    }
                }
            }
        }
    }

    /// Adds the vector `value` between unknown `id` and a node's motion. `id` comes after the wall's unknowns
    /// and before the nodes'.
    fn couple(&mut self, id: u32, movers: &Hold, value: Vec3) {
        let (n, at) = (self.front.ids.len(), self.place(id));
        for (first, weight) in movers {
            let first = self.place(*first);
            for (i, v) in value.to_array().into_iter().enumerate() {
                let (row, column) = (at.max(first + i), at.min(first + i));
                self.front.values[row + n * column] += weight * v;
            }
        }
    }

    fn add_contact(&mut self, section: &Section, movers: &[Hold], it: usize, label: impl Fn(usize) -> u32) {
        for (row, direction, _) in section.rows() {
            let node = lattice(2 * Section::PAIRS[row / 3], 0, it);
            self.couple(label(row), &movers[node], direction);
        }
    }

    fn add_load(&mut self, section: &Section, movers: &[Hold], it: usize, load: u32) {
        for is in [0, 2] {
            for k in [0, 2] {
                self.couple(load, &movers[lattice(is, k, it)], section.force_n / 4.0);
            }
        }
    }
}

/// Adds up the fronts of a part's `bars` and eliminates their own unknowns. One front is left for each chain
/// of consecutive bars.
///
/// Halves are condensed first, then joined: the remainder of each is short, however long the seam.
pub(super) fn condense(
    fronts: &[Front],
    bars: &[&Bar],
    labels: Labels,
    spans: &Spans,
) -> Result<Vec<Front>, SparseError> {
    fn reduce(
        fronts: &[Front],
        from: usize,
        is_inside: &dyn Fn(u32, usize, usize) -> bool,
    ) -> Result<Front, SparseError> {
        let to = from + fronts.len();
        if let [front] = fronts {
            return Front::condense(&[front], |id| is_inside(id, from, to));
        }
        let (left, right) = fronts.split_at(fronts.len() / 2);
        let halves = [
            reduce(left, from, is_inside)?,
            reduce(right, from + left.len(), is_inside)?,
        ];
        Front::condense(&[&halves[0], &halves[1]], |id| is_inside(id, from, to))
    }
    let is_inside = |id: u32, from: usize, to: usize| match labels.owner(id) {
        Owner::Part => false,
        Owner::Section(station, side) => {
            spans[station][side.index()].is_none_or(|[first, last]| from <= first && last < to)
        }
        Owner::Bar => true,
    };
    let follows = |i: usize| {
        bars[i - 1]
            .stations()
            .any(|s| bars[i].stations().any(|other| s == other))
    };
    let starts: Vec<usize> = (0..bars.len())
        .filter(|i| *i == 0 || !follows(*i))
        .chain([bars.len()])
        .collect();
    starts
        .windows(2)
        .map(|ends| reduce(&fronts[ends[0]..ends[1]], ends[0], &is_inside))
        .collect()
}

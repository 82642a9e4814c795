//! Fragments of a cut: parts of one side that are not connected to the rest of that side.

use rayon::prelude::*;

use super::grid::ShellGrid;

/// Field value of a fragment after it is given to the other side, in cells from the cut.
const GIVEN_CELLS: f64 = 0.45;

/// Finds fragments of both sides of a cut. Detached chips of the wall itself do not count: they are detached
/// on any side.
pub(super) struct Fragments<'a> {
    grid: &'a ShellGrid,
    /// True for the nodes of the largest connected part of the wall.
    wall: Vec<bool>,
}

impl<'a> Fragments<'a> {
    pub fn new(grid: &'a ShellGrid) -> Self {
        let is_wall = |n: usize| grid.depth[n] > 0.0 && grid.depth[n] < grid.thickness_mm as f32;
        let mut wall: Vec<bool> = (0..grid.band.len()).into_par_iter().map(is_wall).collect();
        for n in minor_components(grid, wall.clone()).into_iter().flatten() {
            wall[n as usize] = false;
        }
        Self { grid, wall }
    }

    /// Gives each fragment of either side of the cut `g` through the `rest` to the side that surrounds it.
    /// `None` where there are none.
    pub fn give(&self, g: &mut [f32], rest: &[f32]) -> Option<Given> {
        let away_mm = GIVEN_CELLS as f32 * self.grid.band.cell_mm() as f32;
        let fragments = |side: f32| {
            let is_member = |n: usize| self.wall[n] && rest[n] > 0.0 && side * g[n] > 0.0;
            let member = (0..g.len()).into_par_iter().map(is_member).collect();
            minor_components(self.grid, member).concat()
        };
        let (lost, gained) = rayon::join(|| fragments(1.0), || fragments(-1.0));
        self.turn_over(&lost, -away_mm, g, rest);
        self.turn_over(&gained, away_mm, g, rest);
        (!lost.is_empty() || !gained.is_empty()).then_some(Given {
            gains: gained,
            away_mm,
        })
    }

    /// Gives the nodes of `fragments` the value `to`, and also the nodes above and below the wall that have
    /// no other side of the cut near them: the contour would otherwise step from node to node within the
    /// wall.
    fn turn_over(&self, fragments: &[u32], to: f32, g: &mut [f32], rest: &[f32]) {
        fragments.iter().for_each(|&n| g[n as usize] = to);
        let band = &self.grid.band;
        let is_on_other_side = |n: u32, g: &[f32]| {
            let n = n as usize;
            self.wall[n] && rest[n] > 0.0 && (g[n] > 0.0) != (to > 0.0)
        };
        let beside: Vec<u32> = fragments
            .iter()
            .flat_map(|&n| band.all_neighbours(n))
            .filter(|&m| !self.wall[m as usize] && !band.all_neighbours(m).any(|k| is_on_other_side(k, g)))
            .collect();
        beside.into_iter().for_each(|m| g[m as usize] = to);
    }
}

/// Fragments that have changed sides.
pub(super) struct Given {
    /// Nodes of fragments that went to the piece that is cut off.
    gains: Vec<u32>,
    away_mm: f32,
}

impl Given {
    /// Field that is positive in the fragments the piece got, and up to a cell beyond them; `None` where it
    /// got none.
    pub fn gain_field(&self, grid: &ShellGrid) -> Option<Vec<f32>> {
        let mut field = vec![-grid.cutoff_mm(); grid.band.len()];
        for &n in &self.gains {
            field[n as usize] = self.away_mm;
            for m in grid.joined_neighbours(n) {
                field[m as usize] = self.away_mm;
            }
        }
        (!self.gains.is_empty()).then_some(field)
    }
}

/// Connected components of the member nodes, all but the largest. Nodes connect along cell edges.
fn minor_components(grid: &ShellGrid, mut member: Vec<bool>) -> Vec<Vec<u32>> {
    let mut components: Vec<Vec<u32>> = Vec::new();
    for seed in 0..member.len() {
        if !std::mem::take(&mut member[seed]) {
            continue;
        }
        let mut component = vec![seed as u32];
        let mut next = 0;
        while next < component.len() {
            for node in grid.joined_neighbours(component[next]) {
                if std::mem::take(&mut member[node as usize]) {
                    component.push(node);
                }
            }
            next += 1;
        }
        components.push(component);
    }
    components.sort_by_key(|c| std::cmp::Reverse(c.len()));
    components.split_off(components.len().min(1))
}

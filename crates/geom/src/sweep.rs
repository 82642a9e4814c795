//! Sweeps of a sampled field along lattice directions: the running maximum along every grid line.

use std::sync::OnceLock;

use rayon::prelude::*;

use crate::band::Band;

/// Number of samples between two nodes of a diagonal line. A diagonal step is up to √3 cells long, and a
/// ridge between two nodes would be missed. Along an axis the interpolant is linear, so nodes are enough.
const SUB_STEPS: usize = 3;

/// Amount by which values ahead count for more: `per_mm` for each mm to them, at most `most_mm`. The swept
/// volume of a body with field values in mm then widens along the way, as moulded parts do.
///
/// Where a line leaves the band and comes back, the way outside counts as one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Draft {
    /// Rise for each mm to the value, field units per mm.
    pub per_mm: f32,
    /// Greatest rise, field units.
    pub most_mm: f32,
}

impl Draft {
    /// No draft: a plain running maximum.
    pub const NONE: Self = Self {
        per_mm: 0.0,
        most_mm: 0.0,
    };
}

/// Lines of a band in each of the 13 lattice line directions, computed on first use and then kept.
pub struct Sweeper<'a> {
    band: &'a Band,
    lines: [OnceLock<Lines>; 13],
}

/// All nodes, sorted by line and, within a line, along it.
struct Lines {
    order: Vec<u32>,
    /// Start of each line in `order`; the last entry is the end.
    start: Vec<u32>,
}

impl<'a> Sweeper<'a> {
    /// Creates a sweeper that has not computed any lines yet.
    pub fn new(band: &'a Band) -> Self {
        Self {
            band,
            lines: std::array::from_fn(|_| OnceLock::new()),
        }
    }

    /// Computes `max over t ≥ 0 of field(x + t·step)` at every node x. `step` has components in {−1, 0, 1},
    /// not all 0. With a `draft` it is the smaller of two maxima: of `field + per_mm · way`, and of
    /// `field + most_mm`.
    ///
    /// Off the band the field counts as −∞, so a line may leave the band and come back. Between nodes the
    /// trilinear interpolant is sampled at three inner points of each diagonal step.
    pub fn max_ahead(&self, field: &[f32], step: [i32; 3], draft: Draft) -> Vec<f32> {
        let (line, forwards) = line_of(step);
        let lines = self.lines[line].get_or_init(|| Lines::new(self.band, positive(step)));
        let ahead = self.with_sub_steps(field, step);
        let length = step.map(|x| (x * x) as f32).iter().sum::<f32>().sqrt();
        let rise = draft.per_mm * length * self.band.cell_mm() as f32;
        // Each line writes to its own stretch of `swept`; the values are then copied back to their nodes.
        let mut swept: Vec<f32> = lines.order.par_iter().map(|&n| ahead[n as usize]).collect();
        let mut stretches: Vec<&mut [f32]> = Vec::with_capacity(lines.start.len());
        let mut rest = swept.as_mut_slice();
        for w in lines.start.windows(2) {
            let (stretch, tail) = rest.split_at_mut((w[1] - w[0]) as usize);
            stretches.push(stretch);
            rest = tail;
        }
        stretches.into_par_iter().with_min_len(256).for_each(|stretch| {
            let (mut best, mut raised) = (f32::NEG_INFINITY, f32::NEG_INFINITY);
            let mut visit = |x: &mut f32| {
                best = best.max(*x);
                raised = (raised + rise).max(*x);
                *x = raised.min(best + draft.most_mm);
            };
            if forwards {
                stretch.iter_mut().rev().for_each(&mut visit)
            } else {
                stretch.iter_mut().for_each(&mut visit)
            }
        });
        let mut out = ahead;
        for (&node, &value) in lines.order.iter().zip(&swept) {
            out[node as usize] = value;
        }
        out
    }

    /// Largest value on [x, x + step) at each node x.
    fn with_sub_steps(&self, field: &[f32], step: [i32; 3]) -> Vec<f32> {
        let axes: Vec<usize> = (0..3).filter(|&a| step[a] != 0).collect();
        if axes.len() == 1 {
            return field.to_vec();
        }
        // A sample between nodes cannot exceed its corners, so far below the level there is nothing to find.
        let floor = (-3.0 * self.band.cell_mm()) as f32;
        field
            .par_iter()
            .enumerate()
            .map(|(node, &here)| {
                if here < floor {
                    here
                } else {
                    self.best_towards(field, node as u32, step, &axes)
                }
            })
            .collect()
    }

    fn best_towards(&self, field: &[f32], node: u32, step: [i32; 3], axes: &[usize]) -> f32 {
        let here = field[node as usize];
        let n_corners = 1usize << axes.len();
        let mut corner = [here; 8];
        for (bits, value) in corner.iter_mut().enumerate().take(n_corners).skip(1) {
            let mut to = [0; 3];
            for (b, &a) in axes.iter().enumerate() {
                to[a] = if bits >> b & 1 == 1 { step[a] } else { 0 };
            }
            match self.band.neighbour(node, to) {
                Some(n) => *value = field[n as usize],
                None => return here,
            }
        }
        let mut best = here;
        for k in 1..=SUB_STEPS {
            let t = k as f32 / (SUB_STEPS + 1) as f32;
            let mut value = 0.0;
            for (bits, &f) in corner.iter().enumerate().take(n_corners) {
                let far = bits.count_ones() as i32;
                value += f * t.powi(far) * (1.0 - t).powi(axes.len() as i32 - far);
            }
            best = best.max(value);
        }
        best
    }
}

/// Representative of a line direction: its last non-zero component (z, else y, else x) is +1.
fn positive(step: [i32; 3]) -> [i32; 3] {
    let leading = step.iter().rev().find(|&&s| s != 0).copied().unwrap_or(1);
    step.map(|s| s * leading)
}

/// Index of the line direction of `step`, of 13, and true if `step` equals the direction's representative.
fn line_of(step: [i32; 3]) -> (usize, bool) {
    assert!(
        step.iter().any(|&s| s != 0) && step.iter().all(|s| s.abs() <= 1),
        "a lattice step, not {step:?}"
    );
    let p = positive(step);
    // Base-3 digits of the representative exceed the middle (13) exactly for the 13 representatives.
    let code = (p[0] + 1) + 3 * (p[1] + 1) + 9 * (p[2] + 1);
    (code as usize - 14, p == step)
}

impl Lines {
    /// Sorts nodes by line. Storage order already ascends along z, then y, then x, so a stable sort by line
    /// is enough.
    fn new(band: &Band, step: [i32; 3]) -> Self {
        let [nx, ny, nz] = band.dims.map(|n| n as i64);
        let [sx, sy, sz] = step.map(i64::from);
        // Coordinates of the line: its intersection with the plane t = 0, shifted to be ≥ 0.
        let key = |&[i, j, k]: &[u16; 3]| {
            let [i, j, k] = [i, j, k].map(i64::from);
            let (a, b) = if sz != 0 {
                ((i - sx * k) + nz, (j - sy * k) + nz)
            } else if sy != 0 {
                ((i - sx * j) + ny, k)
            } else {
                (j, k)
            };
            (b * (nx + ny + 2 * nz) + a) as u64
        };
        let mut keyed: Vec<(u64, u32)> = band
            .coords
            .par_iter()
            .enumerate()
            .map(|(n, c)| (key(c), n as u32))
            .collect();
        // With the node as second component of the key, an unstable sort gives the stable order.
        keyed.par_sort_unstable();
        let mut start: Vec<u32> = Vec::new();
        let mut last = None;
        for (at, &(key, _)) in keyed.iter().enumerate() {
            if last != Some(key) {
                start.push(at as u32);
                last = Some(key);
            }
        }
        start.push(keyed.len() as u32);
        Self {
            order: keyed.into_iter().map(|k| k.1).collect(),
            start,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::band::tests::cube_band;

    fn all_steps() -> impl Iterator<Item = [i32; 3]> {
        (0..27)
            .filter(|&c| c != 13)
            .map(|c| [c / 9 - 1, c / 3 % 3 - 1, c % 3 - 1])
    }

    #[test]
    fn sweeping_agrees_with_walking_every_line() {
        let (band, phi) = cube_band();
        // A field without any symmetry.
        let field: Vec<f32> = phi
            .iter()
            .enumerate()
            .map(|(n, x)| x + ((n * 7919) % 101) as f32 * 0.01)
            .collect();
        let sweeper = Sweeper::new(&band);
        let reach = *band.dims.iter().max().unwrap() as i64;
        for step in all_steps() {
            let inner = sweeper.with_sub_steps(&field, step);
            let swept = sweeper.max_ahead(&field, step, Draft::NONE);
            for node in (0..band.len()).step_by(41) {
                let from = band.coords[node].map(i64::from);
                let expected = (0..=reach)
                    .filter_map(|t| band.node_at(std::array::from_fn(|a| from[a] + t * i64::from(step[a]))))
                    .map(|n| inner[n as usize])
                    .fold(f32::NEG_INFINITY, f32::max);
                assert_eq!(swept[node], expected, "{step:?}");
            }
        }
    }

    #[test]
    fn a_draft_raises_values_by_the_way_to_them_and_no_more_than_its_limit() {
        let (band, phi) = cube_band();
        let sweeper = Sweeper::new(&band);
        let draft = Draft {
            per_mm: 0.08,
            most_mm: 0.2,
        };
        let reach = *band.dims.iter().max().unwrap() as i64;
        for step in all_steps() {
            let inner = sweeper.with_sub_steps(&phi, step);
            let swept = sweeper.max_ahead(&phi, step, draft);
            let length = f64::from(step.map(|x| x * x).iter().sum::<i32>()).sqrt() * band.cell_mm();
            for node in (0..band.len()).step_by(41) {
                let from = band.coords[node].map(i64::from);
                let values: Vec<f64> = (0..=reach)
                    .filter_map(|t| band.node_at(std::array::from_fn(|a| from[a] + t * i64::from(step[a]))))
                    .map(|n| f64::from(inner[n as usize]))
                    .collect();
                let most = |rise: &dyn Fn(f64) -> f64| {
                    let raised = values
                        .iter()
                        .enumerate()
                        .map(|(t, v)| v + rise(t as f64 * length));
                    raised.fold(f64::NEG_INFINITY, f64::max)
                };
                let expected = most(&|mm| 0.08 * mm).min(most(&|_| 0.0) + 0.2);
                assert!((f64::from(swept[node]) - expected).abs() < 1e-4, "{step:?}");
            }
        }
    }

    #[test]
    fn a_swept_field_never_grows_along_its_step() {
        let (band, phi) = cube_band();
        let sweeper = Sweeper::new(&band);
        for step in all_steps() {
            let swept = sweeper.max_ahead(&phi, step, Draft::NONE);
            for node in (0..band.len() as u32).step_by(13) {
                if let Some(next) = band.neighbour(node, step) {
                    assert!(swept[next as usize] <= swept[node as usize]);
                }
            }
        }
    }
}

//! One-dimensional Gaussian mixtures, called bells here.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Largest number of values used by a fit; more are thinned out evenly in their sorted order.
const MOST_VALUES: usize = 4096;
const N_STARTS: u64 = 10;
const MOST_ROUNDS: usize = 30;
/// Relative gain in likelihood below which refinement stops.
const WORTH_A_ROUND: f64 = 1e-3;
/// Smallest standard deviation of a bell, for values in [0, 1].
const LEAST_DEVIATION: f64 = 1e-4;

/// One Gaussian bell of a mixture.
#[derive(Clone, Copy, Debug)]
pub struct Bell {
    /// Mean of the bell.
    pub mean: f64,
    /// Standard deviation of the bell.
    pub deviation: f64,
    /// Share of all values that belong to the bell, [0, 1].
    pub share: f64,
}

impl Bell {
    fn density(&self, x: f64) -> f64 {
        self.share * (-0.5 * ((x - self.mean) / self.deviation).powi(2)).exp() / self.deviation
    }
}

/// Fits `n_bells` bells to `values` in [0, 1], sorted by ascending mean. Runs k-means from random starts and
/// refines the best result by expectation–maximisation.
pub fn fit(values: &[f64], n_bells: usize, seed: u64) -> Vec<Bell> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let step = sorted.len().div_ceil(MOST_VALUES).max(1);
    let few: Vec<f64> = sorted.into_iter().step_by(step).collect();
    let means = (0..N_STARTS)
        .map(|start| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(start);
            k_means(&few, n_bells, &mut rng)
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map_or_else(Vec::new, |(_, means)| means);
    refine(&few, bells_of(&few, &means))
}

/// Probability of each bell to have produced `x`; the sum is 1. Far from all bells, the nearest bell gets 1.
pub fn memberships(bells: &[Bell], x: f64) -> Vec<f64> {
    let densities: Vec<f64> = bells.iter().map(|b| b.density(x)).collect();
    let sum: f64 = densities.iter().sum();
    if sum > 0.0 {
        densities.into_iter().map(|d| d / sum).collect()
    } else {
        let nearest = nearest(&bells.iter().map(|b| b.mean).collect::<Vec<_>>(), x);
        (0..bells.len())
            .map(|i| f64::from(u8::from(i == nearest)))
            .collect()
    }
}

fn nearest(means: &[f64], x: f64) -> usize {
    (0..means.len())
        .min_by(|&i, &j| (means[i] - x).abs().total_cmp(&(means[j] - x).abs()))
        .unwrap_or(0)
}

/// Sum of squared errors and ascending means, by k-means. Starts are drawn with the squared distance to
/// earlier ones as weight.
fn k_means(values: &[f64], n: usize, rng: &mut ChaCha8Rng) -> (f64, Vec<f64>) {
    let mut means: Vec<f64> = Vec::with_capacity(n);
    while means.len() < n && !values.is_empty() {
        let weights: Vec<f64> = values
            .iter()
            .map(|x| means.iter().map(|m| (m - x).powi(2)).fold(1.0, f64::min))
            .collect();
        let mut left = rng.random::<f64>() * weights.iter().sum::<f64>();
        let chosen = weights.iter().position(|w| {
            left -= w;
            left < 0.0
        });
        means.push(values[chosen.unwrap_or(0)]);
    }
    for _ in 0..MOST_ROUNDS {
        let before = means.clone();
        let mut sums = vec![(0.0, 0.0); means.len()];
        for &x in values {
            let sum = &mut sums[nearest(&before, x)];
            *sum = (sum.0 + x, sum.1 + 1.0);
        }
        for (mean, (sum, count)) in means.iter_mut().zip(sums) {
            if count > 0.0 {
                *mean = sum / count;
            }
        }
        if means == before {
            break;
        }
    }
    means.sort_unstable_by(f64::total_cmp);
    let error = values
        .iter()
        .map(|&x| (means[nearest(&means, x)] - x).powi(2))
        .sum();
    (error, means)
}

fn bells_of(values: &[f64], means: &[f64]) -> Vec<Bell> {
    let mut sums = vec![(0.0, 0.0); means.len()];
    for &x in values {
        let sum = &mut sums[nearest(means, x)];
        *sum = (sum.0 + (x - means[nearest(means, x)]).powi(2), sum.1 + 1.0);
    }
    means
        .iter()
        .zip(sums)
        .map(|(&mean, (squares, count))| Bell {
            mean,
            deviation: (squares / f64::max(count, 1.0)).sqrt().max(LEAST_DEVIATION),
            share: count / values.len().max(1) as f64,
        })
        .collect()
}

fn refine(values: &[f64], mut bells: Vec<Bell>) -> Vec<Bell> {
    let mut before = f64::NEG_INFINITY;
    for _ in 0..MOST_ROUNDS {
        let mut likelihood = 0.0;
        let mut sums = vec![[0.0; 3]; bells.len()];
        for &x in values {
            let density: f64 = bells.iter().map(|b| b.density(x)).sum();
            likelihood += density.max(f64::MIN_POSITIVE).ln();
            for (sum, m) in sums.iter_mut().zip(memberships(&bells, x)) {
                *sum = [sum[0] + m, sum[1] + m * x, sum[2] + m * x * x];
            }
        }
        for (bell, [weight, sum, squares]) in bells.iter_mut().zip(sums) {
            if weight > 0.0 {
                bell.mean = sum / weight;
                let variance = squares / weight - bell.mean * bell.mean;
                bell.deviation = variance.max(0.0).sqrt().max(LEAST_DEVIATION);
                bell.share = weight / values.len() as f64;
            }
        }
        if likelihood - before < WORTH_A_ROUND * likelihood.abs() {
            break;
        }
        before = likelihood;
    }
    bells.sort_by(|a, b| a.mean.total_cmp(&b.mean));
    bells
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_heaps_of_values_are_two_bells() {
        let heap = |mean: f64, n: u32| (0..n).map(move |i| mean + 0.05 * (f64::from(i) / f64::from(n) - 0.5));
        let values: Vec<f64> = heap(0.2, 300).chain(heap(0.7, 100)).collect();
        let bells = fit(&values, 2, 0);
        assert!((bells[0].mean - 0.2).abs() < 1e-3 && (bells[1].mean - 0.7).abs() < 1e-3);
        assert!((bells[0].share - 0.75).abs() < 1e-3);
        assert!(memberships(&bells, 0.21)[0] > 0.999);
    }
}

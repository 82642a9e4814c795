//! Rank correlations, and bands over the curves of several runs.

/// Ranks of the values from 1 on, in increasing order; equal values share the mean of their ranks.
pub fn mean_ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&i, &j| values[i].total_cmp(&values[j]));
    let mut ranks = vec![0.0; values.len()];
    let mut n_lower = 0;
    for ties in order.chunk_by(|&i, &j| values[i] == values[j]) {
        let rank = n_lower as f64 + 0.5 * (ties.len() + 1) as f64;
        ties.iter().for_each(|&i| ranks[i] = rank);
        n_lower += ties.len();
    }
    ranks
}

/// Spearman's ρ in [−1, 1]: the correlation of the mean ranks. `None` if the lengths differ, or if one side
/// is constant, has fewer than two values, or has one that is not finite.
pub fn spearman(a: &[f64], b: &[f64]) -> Option<f64> {
    are_comparable(a, b).then(|| pearson(&mean_ranks(a), &mean_ranks(b)))?
}

fn pearson(a: &[f64], b: &[f64]) -> Option<f64> {
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let (mean_a, mean_b) = (mean(a), mean(b));
    let product = |x: &[f64], mean_x: f64, y: &[f64], mean_y: f64| -> f64 {
        x.iter().zip(y).map(|(x, y)| (x - mean_x) * (y - mean_y)).sum()
    };
    let (aa, bb) = (product(a, mean_a, a, mean_a), product(b, mean_b, b, mean_b));
    (aa > 0.0 && bb > 0.0).then(|| (product(a, mean_a, b, mean_b) / (aa * bb).sqrt()).clamp(-1.0, 1.0))
}

/// Kendall's τ-b in [−1, 1]: concordant minus discordant pairs, over the geometric mean of the numbers of
/// pairs untied in `a` and in `b`. `None` as for [`spearman`]. O(n²).
pub fn kendall(a: &[f64], b: &[f64]) -> Option<f64> {
    if !are_comparable(a, b) {
        return None;
    }
    let (mut balance, mut untied_a, mut untied_b) = (0i64, 0i64, 0i64);
    for i in 0..a.len() {
        for j in 0..i {
            let (x, y) = (sign(a[i], a[j]), sign(b[i], b[j]));
            balance += x * y;
            untied_a += x * x;
            untied_b += y * y;
        }
    }
    (untied_a > 0 && untied_b > 0).then(|| balance as f64 / (untied_a as f64 * untied_b as f64).sqrt())
}

fn sign(x: f64, y: f64) -> i64 {
    i64::from(x > y) - i64::from(x < y)
}

fn are_comparable(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.len() > 1 && a.iter().chain(b).all(|x| x.is_finite())
}

/// Values shifted and scaled to [0, 1], the least at 0; all 0.5 if they are equal.
pub fn normalise(values: &[f64]) -> Vec<f64> {
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| {
            (l.min(v), h.max(v))
        });
    values
        .iter()
        .map(|v| if high > low { (v - low) / (high - low) } else { 0.5 })
        .collect()
}

/// Range of the values that several runs had reached at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BandPoint {
    /// Time, or whatever the horizontal axis is.
    pub x: f64,
    /// Least value of the runs.
    pub low: f64,
    /// Median value of the runs.
    pub middle: f64,
    /// Greatest value of the runs.
    pub high: f64,
}

/// Range of `runs` from the point on where all have a value. Each run is a step function, given by its (x,
/// value) in order of x.
pub fn band(runs: &[Vec<(f64, f64)>]) -> Vec<BandPoint> {
    let starts = runs.iter().map(|r| r.first().map_or(f64::INFINITY, |p| p.0));
    let start = starts.fold(f64::NEG_INFINITY, f64::max);
    let mut moments: Vec<f64> = runs
        .iter()
        .flatten()
        .map(|p| p.0)
        .filter(|&x| x >= start)
        .collect();
    moments.sort_by(f64::total_cmp);
    moments.dedup();
    let at = |x: f64| {
        let mut values: Vec<f64> = runs
            .iter()
            .filter_map(|r| r[..r.partition_point(|p| p.0 <= x)].last())
            .map(|p| p.1)
            .collect();
        values.sort_by(f64::total_cmp);
        let n = values.len();
        let middle = 0.5 * (values[(n - 1) / 2] + values[n / 2]);
        BandPoint {
            x,
            low: values[0],
            middle,
            high: values[n - 1],
        }
    };
    moments.into_iter().map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(a: Option<f64>, b: f64) {
        assert!((a.unwrap() - b).abs() < 1e-12, "{a:?} is not {b}");
    }

    #[test]
    fn ties_share_their_mean_rank() {
        assert_eq!(mean_ranks(&[3.0, 1.0, 3.0, 2.0, 3.0]), [4.0, 1.0, 4.0, 2.0, 4.0]);
        assert_eq!(mean_ranks(&[-0.0, 0.0]), [1.5, 1.5]);
    }

    #[test]
    fn correlations_of_equal_and_opposite_orders_are_one_and_minus_one() {
        let a = [0.3, 7.0, 1.5, 2.0];
        let grown = a.map(f64::exp);
        let turned = a.map(|x| -x);
        assert_near(spearman(&a, &grown), 1.0);
        assert_near(kendall(&a, &grown), 1.0);
        assert_near(spearman(&a, &turned), -1.0);
        assert_near(kendall(&a, &turned), -1.0);
    }

    #[test]
    fn without_ties_spearman_is_the_sum_of_squared_rank_differences() {
        // IQ against hours of television, a common classroom example: Σ d² = 194, ρ = 1 − 6 · 194 / (10 ·
        // 99).
        let iq = [106.0, 100.0, 86.0, 101.0, 99.0, 103.0, 97.0, 113.0, 112.0, 110.0];
        let hours = [7.0, 27.0, 2.0, 50.0, 28.0, 29.0, 20.0, 12.0, 6.0, 17.0];
        assert_near(spearman(&iq, &hours), 1.0 - 6.0 * 194.0 / 990.0);
        // 20 concordant and 25 discordant pairs.
        assert_near(kendall(&iq, &hours), -5.0 / 45.0);
    }

    #[test]
    fn with_ties_both_follow_their_definitions() {
        let (a, b) = ([1.0, 2.0, 2.0, 3.0], [1.0, 3.0, 2.0, 3.0]);
        // Ranks 1, 2½, 2½, 4 and 1, 3½, 2, 3½: Σ products of deviations 3.75, squares 4.5 and 4.5.
        assert_near(spearman(&a, &b), 3.75 / 4.5);
        // Of six pairs four agree, one is tied in a only and one in b only.
        assert_near(kendall(&a, &b), 4.0 / 5.0);
    }

    #[test]
    fn what_has_no_order_has_no_correlation() {
        for (a, b) in [
            (vec![], vec![]),
            (vec![1.0], vec![2.0]),
            (vec![1.0, 1.0], vec![1.0, 2.0]),
        ] {
            assert_eq!((spearman(&a, &b), kendall(&a, &b)), (None, None));
        }
        assert_eq!(spearman(&[1.0, f64::NAN], &[1.0, 2.0]), None);
        assert_eq!(kendall(&[1.0, 2.0, 3.0], &[1.0, 2.0]), None);
    }

    #[test]
    fn a_band_is_the_range_of_step_functions() {
        let runs = [
            vec![(0.0, 1.0), (2.0, 5.0)],
            vec![(1.0, 2.0)],
            vec![(0.5, 0.0), (3.0, 4.0)],
        ];
        let point = |x, low, middle, high| BandPoint { x, low, middle, high };
        assert_eq!(
            band(&runs),
            [
                point(1.0, 0.0, 1.0, 2.0),
                point(2.0, 0.0, 2.0, 5.0),
                point(3.0, 2.0, 4.0, 5.0)
            ]
        );
        assert_eq!(band(&[]), []);
        assert_eq!(band(&[vec![(0.0, 1.0)], vec![]]), []);
    }
}

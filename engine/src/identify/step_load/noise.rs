//! What a load explains beyond coloured noise, and whether anything but such noise is left.
//!
//! Noise that wanders looks like steps here and there. Residuals r are therefore predicted from their own past,
//! a[k] = r[k] − Σ wᵢ r[k − i], by an autoregression of the order that Schwarz's criterion asks for: fits are compared by
//! their innovations a, and a fit is complete where these are white and follow no move of the MV.

use crate::identify::residual_tests::ResidualTests;

/// Highest order of the autoregression.
const ORDER: usize = 8;

/// Logarithm of the likelihood ratio, twice, of two series of residuals of the same rows, each coloured noise.
pub(super) fn likelihood_ratio(without: &[f64], with: &[f64]) -> f64 {
    let rows = with.len() as f64;
    let [without, with] = [without, with].map(Autoregressions::of);
    let order = with.order();
    rows * (without.power[order] / with.power[order]).ln()
}

/// Whether the past of residuals tells of the next one.
pub(super) fn is_coloured(residuals: &[f64]) -> bool {
    Autoregressions::of(residuals).order() > 0
}

/// Residuals of a fit moved to its best for coloured noise, along its sensitivities: min ‖A(r − J δ)‖ over δ, where A leaves
/// of each row what an autoregression of r cannot predict. Least squares leave noise that wanders more than they need to,
/// and a step would explain the difference.
///
/// Source: Cochrane & Orcutt, J. Am. Stat. Assoc. 44 (1949) 32.
pub(super) fn at_best(mut residuals: Vec<f64>, sensitivities: &[Vec<f64>]) -> Vec<f64> {
    /// Rounds of noise and fit in turn.
    const ROUNDS: usize = 2;
    /// Part of a column below which what is left is rounding.
    const ROUNDING: f64 = 1e-7;
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let take = |from: &mut [f64], share: f64, what: &[f64]| {
        from.iter_mut().zip(what).for_each(|(v, w)| *v -= share * w);
    };
    for _ in 0..ROUNDS {
        let noise = Autoregressions::of(&residuals);
        let mut left = noise.unpredicted(&residuals);
        // Columns as they are, beside themselves filtered and made orthonormal.
        let mut basis: Vec<(Vec<f64>, Vec<f64>)> = vec![];
        for column in sensitivities {
            let (mut filtered, mut column) = (noise.unpredicted(column), column.clone());
            let size = dot(&filtered, &filtered).sqrt();
            for (q, raw) in basis.iter().chain(&basis) {
                let share = dot(q, &filtered);
                take(&mut filtered, share, q);
                take(&mut column, share, raw);
            }
            let rest = dot(&filtered, &filtered).sqrt();
            if rest > ROUNDING * size && rest > 0.0 {
                filtered.iter_mut().chain(&mut column).for_each(|v| *v /= rest);
                let share = dot(&filtered, &left);
                take(&mut left, share, &filtered);
                take(&mut residuals, share, &column);
                basis.push((filtered, column));
            }
        }
    }
    residuals
}

/// Tests of the innovations of residuals, with the MV passed through the same filter: what a model has left out of its answer
/// to the MV stays in step with it, while a controller that answers wandering noise no longer passes for one.
///
/// Source: Box, Jenkins & Reinsel, Time Series Analysis, 4th ed., ch. 12 (prewhitening); Ljung, System Identification, 2nd
/// ed., 16.6.
pub(super) fn innovation_tests(residuals: &[f64], mv: &[f64]) -> ResidualTests {
    let noise = Autoregressions::of(residuals);
    ResidualTests::new(&noise.unpredicted(residuals), &noise.unpredicted(mv))
}

/// Autoregressions of residuals of each order.
struct Autoregressions {
    rows: f64,
    /// Mean square of what each cannot predict.
    power: [f64; ORDER + 1],
    /// Weights of the values one, two, … rows back.
    weights: [Vec<f64>; ORDER + 1],
}

impl Autoregressions {
    /// By Burg's recursion: the reflection k = 2 Σ f[t] b[t−1] / Σ (f[t]² + b[t−1]²) of the errors of predicting forward and
    /// backward. Products of lagged values instead take the residuals for 0 beyond both ends, and noise that wanders loses
    /// there as much as a step explains.
    ///
    /// Source: Kay & Marple, Proceedings of the IEEE 69 (1981) 1380.
    fn of(residuals: &[f64]) -> Self {
        let rows = residuals.len().max(1) as f64;
        let mean_square = residuals.iter().map(|r| r * r).sum::<f64>() / rows;
        let mut power = [mean_square.max(f64::MIN_POSITIVE); ORDER + 1];
        let mut weights: [Vec<f64>; ORDER + 1] = Default::default();
        let (mut forward, mut backward) = (residuals.to_vec(), residuals.to_vec());
        for order in 1..=ORDER {
            let pairs = || forward.iter().skip(1).zip(&backward);
            let products: f64 = pairs().map(|(f, b)| f * b).sum();
            let squares: f64 = pairs().map(|(f, b)| f * f + b * b).sum();
            let reflection = if squares > 0.0 { 2.0 * products / squares } else { 0.0 };
            (forward, backward) = pairs().map(|(f, b)| (f - reflection * b, b - reflection * f)).unzip();
            let shorter = &weights[order - 1];
            let mirrored = shorter.iter().rev();
            let mut longer: Vec<f64> =
                shorter.iter().zip(mirrored).map(|(w, m)| w - reflection * m).collect();
            longer.push(reflection);
            weights[order] = longer;
            power[order] = (power[order - 1] * (1.0 - reflection * reflection)).max(f64::MIN_POSITIVE);
        }
        Self { rows, power, weights }
    }

    /// The order that Schwarz's criterion asks for.
    fn order(&self) -> usize {
        let criterion = |p: usize| self.rows * self.power[p].ln() + p as f64 * self.rows.ln();
        (0..=ORDER).min_by(|&a, &b| criterion(a).total_cmp(&criterion(b))).unwrap_or(0)
    }

    /// What is left of values once the autoregression has predicted them. The first rows, of little past, are predicted by
    /// shorter ones and scaled to the same spread, lest a fit leaves anything it likes there.
    ///
    /// Source: Prais & Winsten, Cowles Commission Discussion Paper 383 (1954), for the first order.
    fn unpredicted(&self, values: &[f64]) -> Vec<f64> {
        let order = self.order();
        let one = |row: usize| {
            let known = order.min(row);
            let past = values[..row].iter().rev().zip(&self.weights[known]);
            let left = values[row] - past.map(|(v, w)| v * w).sum::<f64>();
            left * (self.power[order] / self.power[known]).sqrt()
        };
        (0..values.len()).map(one).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::Distribution;

    fn first_order(rows: usize, pole: f64) -> Vec<f64> {
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(3);
        let mut last = 0.0;
        (0..rows)
            .map(|_| {
                let e: f64 = rand_distr::StandardNormal.sample(&mut rng);
                last = pole * last + e;
                last
            })
            .collect()
    }

    #[test]
    fn a_first_order_process_is_predicted_by_its_last_value() {
        let found = Autoregressions::of(&first_order(20_000, 0.9)).power;
        // 1/(1 − 0.81) = 5.26 before, 1 from the first order on; 20,000 rows tell it to 1 %.
        assert!((found[0] - 5.26).abs() < 0.6, "{found:?}");
        assert!(found[1..].iter().all(|v| (v - 1.0).abs() < 0.05), "{found:?}");
    }

    /// Products of lagged values took the series for 0 beyond its ends: a walk that ends far out had innovations far too large.
    #[test]
    fn the_ends_of_a_walk_are_no_innovations() {
        let walk: Vec<f64> = first_order(600, 1.0).iter().map(|v| v + 40.0).collect();
        let found = Autoregressions::of(&walk).power;
        // Variance 1, of 600 rows known to 6 %.
        assert!((found[1] - 1.0).abs() < 0.18, "{found:?}");
    }

    /// A controller that answers wandering noise moves with it; that is no part of the process left out.
    #[test]
    fn innovations_are_white_and_do_not_follow_a_controller_that_answers_them() {
        let e = first_order(2000, 0.8);
        let mut answer = vec![0.0];
        answer.extend(e.iter().map(|e| -0.6 * e));
        let mv = &answer[..e.len()];
        let raw = ResidualTests::new(&e, mv);
        assert!(!raw.is_white() && raw.follows_input());
        let tests = innovation_tests(&e, mv);
        assert!(tests.is_white() && !tests.follows_input(), "{tests:?}");
        let left_out: Vec<f64> =
            (0..e.len()).map(|k| e[k] + if k > 3 { mv[k - 3] - mv[k - 4] } else { 0.0 }).collect();
        assert!(innovation_tests(&left_out, mv).follows_input());
    }

    #[test]
    fn a_level_under_coloured_noise_is_fitted_better_than_by_its_mean() {
        let (e, ones) = (first_order(200, 0.97), vec![1.0; 200]);
        let mean = e.iter().sum::<f64>() / 200.0;
        let least_squares: Vec<f64> = e.iter().map(|v| v - mean).collect();
        let noise = Autoregressions::of(&least_squares);
        let size = |r: &[f64]| noise.unpredicted(r).iter().map(|a| a * a).sum::<f64>();
        let best = at_best(least_squares.clone(), &[ones]);
        assert!(size(&best) <= size(&least_squares));
        // Moved by a level and by nothing else.
        let by = best[0] - least_squares[0];
        assert!(best.iter().zip(&least_squares).all(|(a, b)| (a - b - by).abs() < 1e-9));
    }
}

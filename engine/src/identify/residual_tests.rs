//! What is left over by a model: is it white, and does it still follow the input?

/// Largest lag looked at, in rows.
const LAGS: usize = 25;
/// Rows looked at: more of them only make a band narrower than any model is true.
const ROWS: usize = 20_000;
/// Normal quantile of 95 %.
const Z: f64 = 1.959_963_984_540_054;

/// Correlations of the residuals with their 95 % bands.
///
/// Source: Ljung, System Identification, 2nd ed., 16.6; Ljung & Box, Biometrika 65 (1978) 297.
#[derive(Debug, Clone, PartialEq)]
pub struct ResidualTests {
    /// Autocorrelation at lags 1, 2, … rows.
    pub autocorrelation: Vec<f64>,
    /// Half width of the band that white residuals stay in, 19 times out of 20.
    pub autocorrelation_band: f64,
    /// Ljung and Box's statistic over those lags.
    pub ljung_box: f64,
    /// Probability of one this large or larger, were the residuals white.
    pub white_probability: f64,
    /// Correlation of the residuals with the moves of the MV that many rows before; lags 0, 1, 2, ….
    pub cross_correlation: Vec<f64>,
    /// Half width of its band.
    pub cross_correlation_band: f64,
    /// Rows that say as much as one independent row: 1 + 2 Σ autocorrelation, 1 for white residuals.
    pub rows_per_independent: f64,
}

impl ResidualTests {
    /// From residuals y − ŷ and the MV, one of each a row; rows that don't count hold 0 in `residuals`.
    #[must_use]
    pub fn new(residuals: &[f64], mv: &[f64]) -> Self {
        let rows = residuals.len().min(ROWS);
        // The middle of a long record: its ends may lie before or after what matters.
        let first = (residuals.len() - rows) / 2;
        let mean = residuals.iter().sum::<f64>() / residuals.len().max(1) as f64;
        let e: Vec<f64> = residuals[first..first + rows].iter().map(|r| r - mean).collect();
        let moves: Vec<f64> =
            (first..first + rows).map(|k| if k == 0 { 0.0 } else { mv[k] - mv[k - 1] }).collect();
        let lags = LAGS.min(rows / 4);
        let power = lagged(&e, &e, 0);
        let share = |lag| if power > 0.0 { lagged(&e, &e, lag) / power } else { 0.0 };
        let autocorrelation: Vec<f64> = (1..=lags).map(share).collect();
        let n = rows as f64;
        let ljung_box = n
            * (n + 2.0)
            * autocorrelation.iter().enumerate().map(|(i, r)| r * r / (n - (i + 1) as f64)).sum::<f64>();
        let white_probability = chi_square_tail(ljung_box, lags);
        let move_power = lagged(&moves, &moves, 0);
        let scale = (power * move_power).sqrt();
        let cross = |lag| if scale > 0.0 { lagged(&e, &moves, lag) / scale } else { 0.0 };
        let cross_correlation: Vec<f64> = (0..=lags).map(cross).collect();
        let move_correlation =
            |lag| if move_power > 0.0 { lagged(&moves, &moves, lag) / move_power } else { 0.0 };
        let products: f64 =
            autocorrelation.iter().enumerate().map(|(i, r)| 2.0 * r * move_correlation(i + 1)).sum();
        Self {
            rows_per_independent: if white_probability < 0.01 { independent(&e, power) } else { 1.0 },
            autocorrelation,
            autocorrelation_band: Z / n.sqrt(),
            ljung_box,
            white_probability,
            cross_correlation,
            cross_correlation_band: Z * ((1.0 + products).max(0.1) / n).sqrt(),
        }
    }

    /// Whether nothing speaks against white residuals, at 1 %.
    #[must_use]
    pub fn is_white(&self) -> bool {
        self.white_probability >= 0.01
    }

    /// Whether the residuals still follow the MV: one lag three bands out, or one two bands out and twice as many outside
    /// the band as one in twenty would leave. Lag 0 does not count: a PV is measured ahead of its row's MV, and where a
    /// controller answers it, noise moves both.
    #[must_use]
    pub fn follows_input(&self) -> bool {
        let beyond = |bands: f64| {
            let later = self.cross_correlation.iter().skip(1);
            later.filter(|c| c.abs() > bands * self.cross_correlation_band).count()
        };
        beyond(3.0) > 0 || (beyond(2.0) > 0 && beyond(1.0) * 10 > self.cross_correlation.len())
    }
}

/// Σ a[k] b[k − lag].
fn lagged(a: &[f64], b: &[f64], lag: usize) -> f64 {
    a.iter().skip(lag).zip(b).map(|(x, y)| x * y).sum()
}

/// 1 + 2 Σ ρ up to where the correlation has died away, by the trapezoidal rule over lags that grow by a quarter.
fn independent(e: &[f64], power: f64) -> f64 {
    /// Correlation that counts as none.
    const NONE: f64 = 0.05;
    if power <= 0.0 {
        return 1.0;
    }
    let most = e.len() / 4;
    let (mut lag, mut last, mut total) = (0, 1.0, 0.0);
    loop {
        let next = (lag + 1).max(lag + lag / 4);
        if next > most {
            break;
        }
        let correlation = lagged(e, e, next) / power;
        if correlation <= NONE {
            break;
        }
        // The sum from lag + 1 to next of a straight line between the two.
        let (steps, slope) = ((next - lag) as f64, correlation - last);
        total += steps * last + slope * (steps + 1.0) / 2.0;
        (lag, last) = (next, correlation);
    }
    (1.0 + 2.0 * total).clamp(1.0, (e.len() as f64 / 10.0).max(1.0))
}

/// P(χ² ≥ x) with `freedom` degrees of freedom, by Wilson and Hilferty's cube root: good to 0.003.
fn chi_square_tail(x: f64, freedom: usize) -> f64 {
    if freedom == 0 {
        return 1.0;
    }
    let k = freedom as f64;
    let spread = (2.0 / (9.0 * k)).sqrt();
    let z = ((x / k).cbrt() - (1.0 - 2.0 / (9.0 * k))) / spread;
    0.5 * erfc(z / std::f64::consts::SQRT_2)
}

/// Complementary error function, to 1.2e-7 relative (Numerical Recipes' Chebyshev fit, as published by Press et al.).
fn erfc(x: f64) -> f64 {
    const C: [f64; 10] = [
        -1.265_512_23,
        1.000_023_68,
        0.374_091_96,
        0.096_784_18,
        -0.186_288_06,
        0.278_868_07,
        -1.135_203_98,
        1.488_515_87,
        -0.822_152_23,
        0.170_872_77,
    ];
    let t = 1.0 / (1.0 + 0.5 * x.abs());
    let sum = C.iter().rev().fold(0.0, |sum, c| sum * t + c);
    let tail = t * (-x * x + sum).exp();
    if x >= 0.0 { tail } else { 2.0 - tail }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::Distribution;

    fn noise(rows: usize, pole: f64) -> Vec<f64> {
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(3);
        let normal = rand_distr::StandardNormal;
        let mut last = 0.0;
        (0..rows)
            .map(|_| {
                let e: f64 = normal.sample(&mut rng);
                last = pole * last + e;
                last
            })
            .collect()
    }

    #[test]
    fn white_noise_is_white_and_coloured_noise_is_not() {
        let mv: Vec<f64> = (0..4000).map(|k| f64::from((k / 100) % 2)).collect();
        let white = ResidualTests::new(&noise(4000, 0.0), &mv);
        assert!(white.is_white() && !white.follows_input(), "{white:?}");
        assert_eq!(white.rows_per_independent, 1.0);
        // (1 + ρ)/(1 − ρ) = 9 of a first-order process with ρ = 0.8.
        let red = ResidualTests::new(&noise(4000, 0.8), &mv);
        assert!(!red.is_white());
        assert!((red.rows_per_independent - 9.0).abs() < 2.5, "{}", red.rows_per_independent);
    }

    #[test]
    fn what_follows_the_input_is_seen() {
        let mv: Vec<f64> = (0..4000).map(|k| f64::from((k / 100) % 2)).collect();
        let mut e = noise(4000, 0.0);
        for k in 3..4000 {
            e[k] += 5.0 * (mv[k - 3] - mv[k.saturating_sub(4)]);
        }
        assert!(ResidualTests::new(&e, &mv).follows_input());
    }

    #[test]
    fn chi_square_tail_agrees_with_tables() {
        // Abramowitz & Stegun, table 26.8.
        for (x, k, p) in [(37.6525, 25, 0.05), (44.3141, 25, 0.01), (11.0705, 5, 0.05)] {
            assert!((chi_square_tail(x, k) - p).abs() < 1e-3, "{x} {k}");
        }
    }
}

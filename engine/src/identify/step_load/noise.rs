//! What a load explains beyond coloured noise.
//!
//! Noise that wanders looks like steps here and there. Both fits' residuals are therefore predicted from their own past, by
//! an autoregression of the order that the residuals with the load ask for, and what cannot be predicted is compared.

/// Highest order of the autoregression.
const ORDER: usize = 8;

/// Logarithm of the likelihood ratio, twice, of two series of residuals of the same rows, each coloured noise.
pub(super) fn likelihood_ratio(without: &[f64], with: &[f64]) -> f64 {
    let rows = with.len() as f64;
    let [without, with] = [without, with].map(innovations);
    let order = (0..=ORDER)
        .min_by(|&a, &b| {
            let criterion = |p: usize| rows * with[p].ln() + p as f64 * rows.ln();
            criterion(a).total_cmp(&criterion(b))
        })
        .unwrap_or(0);
    rows * (without[order] / with[order]).ln()
}

/// Mean square of what an autoregression of each order cannot predict, by Levinson and Durbin's recursion.
fn innovations(residuals: &[f64]) -> [f64; ORDER + 1] {
    let rows = residuals.len().max(1) as f64;
    let covariance: Vec<f64> = (0..=ORDER)
        .map(|lag| residuals.iter().skip(lag).zip(residuals).map(|(a, b)| a * b).sum::<f64>() / rows)
        .collect();
    let mut out = [covariance[0].max(f64::MIN_POSITIVE); ORDER + 1];
    let mut weights: Vec<f64> = vec![];
    for order in 1..=ORDER {
        let last = out[order - 1];
        let predicted: f64 = weights.iter().enumerate().map(|(i, w)| w * covariance[order - 1 - i]).sum();
        let reflection = (covariance[order] - predicted) / last;
        let mirrored: Vec<f64> = weights.iter().rev().map(|w| reflection * w).collect();
        weights.iter_mut().zip(mirrored).for_each(|(w, m)| *w -= m);
        weights.push(reflection);
        out[order] = (last * (1.0 - reflection * reflection)).max(f64::MIN_POSITIVE);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::Distribution;

    #[test]
    fn a_first_order_process_is_predicted_by_its_last_value() {
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(3);
        let mut last = 0.0;
        let values: Vec<f64> = (0..20_000)
            .map(|_| {
                let e: f64 = rand_distr::StandardNormal.sample(&mut rng);
                last = 0.9 * last + e;
                last
            })
            .collect();
        let found = innovations(&values);
        // 1/(1 − 0.81) = 5.26 before, 1 from the first order on; 20,000 rows tell it to 1 %.
        assert!((found[0] - 5.26).abs() < 0.6, "{found:?}");
        assert!(found[1..].iter().all(|v| (v - 1.0).abs() < 0.05), "{found:?}");
    }
}

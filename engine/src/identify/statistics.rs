//! Standard errors, Student's t, resolution and correlation of the residuals.

/// Two-sided 95 % quantile of Student's t with `freedom` degrees of freedom.
///
/// Expansion about the normal quantile, good to 1e-3 from 5 degrees on. Source: Abramowitz & Stegun 26.7.5.
pub(super) fn student_95(freedom: usize) -> f64 {
    const Z: f64 = 1.959_963_984_540_054;
    let n = freedom.max(1) as f64;
    let z2 = Z * Z;
    let g1 = (z2 + 1.0) / 4.0;
    let g2 = ((5.0 * z2 + 16.0) * z2 + 3.0) / 96.0;
    let g3 = (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / 384.0;
    Z * (1.0 + g1 / n + g2 / (n * n) + g3 / (n * n * n))
}

/// Inverse of a symmetric positive definite matrix; `None` when it is singular to rounding.
pub(super) fn inverse(matrix: &[[f64; 4]; 4]) -> Option<[[f64; 4]; 4]> {
    let scale = std::array::from_fn::<f64, 4, _>(|i| matrix[i][i].sqrt());
    if scale.iter().any(|s| s.is_nan() || *s <= 0.0) {
        return None;
    }
    let mut a = [[0.0; 8]; 4];
    for i in 0..4 {
        for j in 0..4 {
            a[i][j] = matrix[i][j] / (scale[i] * scale[j]);
        }
        a[i][4 + i] = 1.0;
    }
    for p in 0..4 {
        let pivot = a[p][p];
        if pivot.is_nan() || pivot <= 1e-13 {
            return None;
        }
        a[p].iter_mut().for_each(|v| *v /= pivot);
        let row = a[p];
        for (i, other) in a.iter_mut().enumerate() {
            if i != p {
                let share = other[p];
                other.iter_mut().zip(row).for_each(|(v, r)| *v -= share * r);
            }
        }
    }
    Some(std::array::from_fn(|i| std::array::from_fn(|j| a[i][4 + j] / (scale[i] * scale[j]))))
}

/// Step of a quantised signal: the smallest move, when all moves are multiples of it and there are few levels.
pub(super) fn resolution(values: &[f64]) -> Option<f64> {
    /// Rows looked at.
    const ROWS: usize = 20_000;
    let moves = || values.windows(2).take(ROWS).map(|w| (w[1] - w[0]).abs());
    let largest = values.iter().take(ROWS).fold(0.0_f64, |m, v| m.max(v.abs()));
    let step = moves().filter(|&m| m > 1e-9 * largest).fold(f64::INFINITY, f64::min);
    if !step.is_finite() {
        return None;
    }
    let whole = |m: f64| {
        let levels = m / step;
        (levels - levels.round()).abs() < 0.02 * levels.max(1.0) && levels < 1000.0
    };
    let (mut still, mut total) = (0, 0);
    for m in moves() {
        if !whole(m) {
            return None;
        }
        total += 1;
        still += usize::from(m < 0.5 * step);
    }
    (still * 10 > total).then_some(step)
}

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

/// Σ f(v), in eight lanes: a plain sum waits for each addition before the next.
pub(super) fn summed(values: &[f64], f: impl Fn(f64) -> f64) -> f64 {
    let mut lanes = [0.0; 8];
    let chunks = values.chunks_exact(8);
    let rest: f64 = chunks.remainder().iter().map(|v| f(*v)).sum();
    for chunk in chunks {
        for (lane, value) in lanes.iter_mut().zip(chunk) {
            *lane += f(*value);
        }
    }
    lanes.iter().sum::<f64>() + rest
}

/// Mean of a column that is not empty.
pub(super) fn mean(values: &[f64]) -> f64 {
    summed(values, |v| v) / values.len() as f64
}

/// Whether stamps lie on an even grid of `step_s` to within `tolerance_s`.
pub(super) fn is_even(time_s: &[f64], step_s: f64, tolerance_s: f64) -> bool {
    /// Looked at together: a search that may end at every row looks at one a time.
    const ROWS: usize = 64;
    time_s.chunks(ROWS).enumerate().all(|(chunk, stamps)| {
        let first = time_s[0];
        let place = |i: usize| (chunk * ROWS + i) as f64 * step_s;
        let off = |i: usize, t: f64| (t - first - place(i)).abs() > tolerance_s;
        !stamps.iter().enumerate().fold(false, |any, (i, &t)| any | off(i, t))
    })
}

/// Step of a quantised signal: the mean of the smallest moves, when all moves are multiples of it and there are few
/// levels. A converter behind a coarse sensor shifts each level by up to half a code, so that multiples are rough.
/// `rough` is how far a move may lie from a multiple, in steps.
pub(super) fn resolution(values: &[f64], rough: f64) -> Option<f64> {
    /// Rows looked at.
    const ROWS: usize = 20_000;
    let moves = || values.windows(2).take(ROWS).map(|w| (w[1] - w[0]).abs());
    let largest = values.iter().take(ROWS).fold(0.0_f64, |m, v| m.max(v.abs()));
    let smallest = moves().filter(|&m| m > 1e-9 * largest).fold(f64::INFINITY, f64::min);
    if !smallest.is_finite() {
        return None;
    }
    let single = || moves().filter(|&m| m >= smallest && m < 1.5 * smallest);
    let step = single().sum::<f64>() / single().count() as f64;
    let whole = |m: f64| {
        let levels = m / step;
        (levels - levels.round()).abs() < rough && levels < 1000.0
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

#[cfg(test)]
mod tests {
    use super::resolution;

    /// A level in steps of 0.35 cm read by a converter of 0.01465 cm went unnoticed: 23 and 24 codes are no multiples.
    #[test]
    fn steps_are_seen_behind_a_converter() {
        let code = 0.014_65;
        let read = |y: f64| (((y / 0.35).round() * 0.35) / code).round() * code;
        let values: Vec<f64> =
            (0..2000).map(|k| read(3.0 + 4.0 * (0.37 * f64::from(k) / 20.0).sin())).collect();
        let step = resolution(&values, 0.1).expect("a step");
        assert!((step - 0.35).abs() < 0.005, "{step}");
        let smooth: Vec<f64> = (0..2000).map(|k| (0.1 * f64::from(k)).sin()).collect();
        assert_eq!(resolution(&smooth, 0.1), None);
    }
}

//! One-dimensional searches on smooth functions: a root in a bracket, a minimum in a triple.

/// Evaluations after which a search gives its best.
const MOST_EVALUATIONS: usize = 60;
/// Relative fall of a minimum still to be expected at which the search ends; a peak's relative error is half of it.
const EXPECTED_FALL: f64 = 1e-9;

/// Root of `f` between two points (x, f(x)) of opposite sign, to rounding.
///
/// Chandrupatla's hybrid of inverse quadratic interpolation and bisection, Advances in Engineering Software 28, 1997.
pub(super) fn root(mut f: impl FnMut(f64) -> f64, a: (f64, f64), b: (f64, f64)) -> f64 {
    let (mut a, mut b) = (a, b);
    let mut share = 0.5;
    for _ in 0..MOST_EVALUATIONS {
        let x = a.0 + share * (b.0 - a.0);
        let p = (x, f(x));
        let old;
        if (p.1 > 0.0) == (a.1 > 0.0) {
            old = a;
        } else {
            old = b;
            b = a;
        }
        a = p;
        let best = if a.1.abs() < b.1.abs() { a } else { b };
        let tolerance = 2.0 * f64::EPSILON * best.0.abs();
        let smallest_share = tolerance / (b.0 - a.0).abs();
        if best.1 == 0.0 || smallest_share > 0.5 {
            return best.0;
        }
        let xi = (a.0 - b.0) / (old.0 - b.0);
        let phi = (a.1 - b.1) / (old.1 - b.1);
        let interpolates = phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi;
        share = if interpolates {
            a.1 / (b.1 - a.1) * old.1 / (b.1 - old.1)
                + (old.0 - a.0) / (b.0 - a.0) * a.1 / (old.1 - a.1) * b.1 / (old.1 - b.1)
        } else {
            0.5
        };
        share = share.clamp(smallest_share, 1.0 - smallest_share);
    }
    if a.1.abs() < b.1.abs() { a.0 } else { b.0 }
}

/// Minimum of `f` in a bracketing triple of (x, f(x)) with the middle lowest: parabolas, golden section when they stall.
pub(super) fn minimum(
    mut f: impl FnMut(f64) -> f64,
    left: (f64, f64),
    middle: (f64, f64),
    right: (f64, f64),
) -> (f64, f64) {
    /// 2 − golden ratio, the share of the wider side a golden step takes.
    const GOLDEN: f64 = 0.381_966_011_250_105;
    let (mut a, mut m, mut b) = (left, middle, right);
    let mut last_width = b.0 - a.0;
    for evaluation in 0..MOST_EVALUATIONS {
        let (vertex, fall) = parabola(a, m, b);
        if evaluation > 1 && fall <= EXPECTED_FALL * m.1.abs() {
            break;
        }
        let width = b.0 - a.0;
        let stalled = evaluation % 3 == 2 && width > 0.5 * last_width;
        if evaluation % 3 == 2 {
            last_width = width;
        }
        let nudge = 1e-3 * width;
        let mut x = vertex;
        if stalled || !(x > a.0 && x < b.0) {
            x = if b.0 - m.0 > m.0 - a.0 { m.0 + GOLDEN * (b.0 - m.0) } else { m.0 - GOLDEN * (m.0 - a.0) };
        } else if (x - m.0).abs() < nudge {
            x = if b.0 - m.0 > m.0 - a.0 { m.0 + nudge } else { m.0 - nudge };
        }
        if width <= 4.0 * f64::EPSILON * m.0.abs() {
            break;
        }
        let p = (x, f(x));
        if p.1 < m.1 {
            if p.0 > m.0 {
                a = m
            } else {
                b = m
            }
            m = p;
        } else if p.0 > m.0 {
            b = p;
        } else {
            a = p;
        }
    }
    m
}

/// Vertex of the parabola through three points and how far it lies under the middle one.
pub(super) fn parabola(a: (f64, f64), m: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    let (left, right) = (m.0 - a.0, b.0 - m.0);
    let (fall_left, fall_right) = ((a.1 - m.1) / left, (b.1 - m.1) / right);
    let curvature = (fall_left + fall_right) / (left + right);
    if curvature <= 0.0 {
        return (m.0, 0.0);
    }
    let slope = (fall_right * left - fall_left * right) / (left + right);
    let step = -0.5 * slope / curvature;
    (m.0 + step, 0.25 * slope * slope / curvature)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_minimum_comes_out_whether_flat_or_sharp() {
        for width in [1.0, 1e-4, 1e-7] {
            let f = |x: f64| {
                2.0 + ((x - 0.3) / width).powi(2)
                    + 0.1 * ((x - 0.3) / width).powi(3) / (1.0 + (x / width).powi(2))
            };
            let point = |x: f64| (x, f(x));
            let (_, low) = minimum(f, point(0.0), point(0.25), point(0.5));
            assert!((low - 2.0).abs() < 4e-9, "{width}: {low}");
        }
    }

    #[test]
    fn a_root_comes_out() {
        let f = |x: f64| x.powi(9) - 0.5;
        let x = root(f, (0.0, f(0.0)), (3.0, f(3.0)));
        assert!((x - 0.5f64.powf(1.0 / 9.0)).abs() < 1e-14);
    }
}

//! Roots of real polynomials, coefficients in falling powers.
//!
//! Non-finite coefficients give no roots; callers hold validated models.

use num_complex::Complex64;

/// Steps of Laguerre's method per root; it converges in under ten from any start in practice.
const LAGUERRE_STEPS: usize = 80;
/// Passes over all roots at most; one suffices for distinct roots, equal ones take some tens.
const REFINEMENTS: usize = 60;
/// Imaginary part, relative to the modulus, under which a root counts as real.
const REAL_TOLERANCE: f64 = 1e-12;

/// Value of a real polynomial at jω as (real, imaginary).
#[inline]
pub(crate) fn at_j_omega(coefficients: &[f64], omega: f64) -> (f64, f64) {
    let (mut re, mut im) = (0.0, 0.0);
    for &c in coefficients {
        (re, im) = (c - im * omega, re * omega);
    }
    (re, im)
}

/// Product of two polynomials.
pub(crate) fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            out[i + j] += x * y;
        }
    }
    out
}

/// Appends all complex roots of a polynomial whose first coefficient is not zero.
///
/// Roots at the origin are exact; degrees one and two in closed form, above by Laguerre's method with deflation
/// from the smallest root up (Press et al., Numerical Recipes, section 9.5), then refined together on the whole
/// polynomial, because deflation by one of several equal roots spoils the others.
pub(crate) fn push_roots(coefficients: &[f64], out: &mut Vec<Complex64>) {
    let significant = coefficients.iter().rposition(|&c| c != 0.0).map_or(0, |last| last + 1);
    let zeros_at_origin = coefficients.len() - significant;
    out.extend(std::iter::repeat_n(Complex64::new(0.0, 0.0), zeros_at_origin));
    if significant < 2 {
        return;
    }
    if significant <= 3 {
        push_low_degree(&coefficients[..significant], out);
        return;
    }
    let first = out.len();
    let mut work = coefficients[..significant].to_vec();
    while work.len() > 3 {
        let root = laguerre(&work);
        if root.im.abs() <= REAL_TOLERANCE * root.norm() {
            out.push(Complex64::new(root.re, 0.0));
            deflate(&mut work, &[root.re]);
        } else {
            out.push(root);
            out.push(root.conj());
            deflate(&mut work, &[2.0 * root.re, -root.norm_sqr()]);
        }
    }
    push_low_degree(&work, out);
    refine_together(&coefficients[..significant], &mut out[first..]);
}

/// Ehrlich and Aberth's iteration: Newton's step with the other roots divided out (Aberth, Math. Comp. 27, 1973).
fn refine_together(c: &[f64], roots: &mut [Complex64]) {
    for _ in 0..REFINEMENTS {
        let mut settled = true;
        for i in 0..roots.len() {
            let x = roots[i];
            let zero = Complex64::new(0.0, 0.0);
            let (mut p, mut dp, mut bound) = (zero, zero, 0.0);
            let modulus = x.norm();
            for &k in c {
                dp = dp * x + p;
                p = p * x + k;
                bound = bound * modulus + k.abs();
            }
            if p.norm() <= 8.0 * f64::EPSILON * bound {
                continue;
            }
            settled = false;
            let newton = p / dp;
            let others = roots.iter().enumerate().filter(|(j, r)| *j != i && **r != x);
            let repulsion: Complex64 = others.map(|(_, r)| 1.0 / (x - r)).sum();
            let step = newton / (1.0 - newton * repulsion);
            if step.is_finite() {
                roots[i] = x - step;
            }
        }
        if settled {
            return;
        }
    }
}

fn push_low_degree(c: &[f64], out: &mut Vec<Complex64>) {
    match *c {
        [a, b] => out.push(Complex64::new(-b / a, 0.0)),
        [a, b, c] => out.extend(quadratic(a, b, c)),
        _ => {}
    }
}

/// Both roots of a x² + b x + c without cancellation, a ≠ 0.
fn quadratic(a: f64, b: f64, c: f64) -> [Complex64; 2] {
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 {
        let root = Complex64::new(-b / (2.0 * a), (-discriminant).sqrt() / (2.0 * a));
        return [root, root.conj()];
    }
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    if q == 0.0 {
        return [Complex64::new(0.0, 0.0); 2];
    }
    [Complex64::new(q / a, 0.0), Complex64::new(c / q, 0.0)]
}

fn laguerre(c: &[f64]) -> Complex64 {
    let degree = (c.len() - 1) as f64;
    let mut x = Complex64::new(0.0, 0.0);
    for _ in 0..LAGUERRE_STEPS {
        let zero = Complex64::new(0.0, 0.0);
        let (mut p, mut dp, mut half_ddp) = (zero, zero, zero);
        let mut bound = 0.0;
        for &k in c {
            half_ddp = half_ddp * x + dp;
            dp = dp * x + p;
            p = p * x + k;
            bound = bound * x.norm() + p.norm();
        }
        if p.norm() <= 4.0 * f64::EPSILON * bound {
            return x;
        }
        let g = dp / p;
        let h = g * g - 2.0 * half_ddp / p;
        let root = ((degree - 1.0) * (degree * h - g * g)).sqrt();
        let denominator = if (g + root).norm_sqr() >= (g - root).norm_sqr() { g + root } else { g - root };
        let step = if denominator.norm_sqr() > 0.0 {
            degree / denominator
        } else {
            Complex64::from_polar(1.0 + x.norm(), 1.0)
        };
        x -= step;
        if step.norm() <= f64::EPSILON * x.norm() {
            return x;
        }
    }
    x
}

/// Divides by xᵐ − f₀ xᵐ⁻¹ − … − fₘ₋₁ and drops the remainder.
fn deflate(work: &mut Vec<f64>, factor: &[f64]) {
    for i in 1..work.len() {
        let carried: f64 = factor.iter().zip(work[..i].iter().rev()).map(|(f, w)| f * w).sum();
        work[i] += carried;
    }
    work.truncate(work.len() - factor.len());
}

/// Appends the positive real roots of odd multiplicity in rising order, coefficients in falling powers.
///
/// Between neighbouring roots of the derivative a polynomial is monotone, so a change of sign there brackets one
/// root; Newton's step is kept inside the bracket by geometric bisection.
pub(crate) fn push_positive_roots(coefficients: &[f64], out: &mut Vec<f64>) {
    let Some(first) = coefficients.iter().position(|&c| c != 0.0) else { return };
    let last = coefficients.iter().rposition(|&c| c != 0.0).unwrap_or(first);
    let c = &coefficients[first..=last];
    let signs = c.iter().filter(|v| **v != 0.0).map(|v| *v > 0.0);
    let changes = signs.clone().zip(signs.skip(1)).filter(|(a, b)| a != b).count();
    if changes == 0 {
        return;
    }
    if c.len() <= 3 {
        let mut found = Vec::with_capacity(2);
        push_low_degree(c, &mut found);
        let mut real: [f64; 2] = [0.0; 2];
        let mut count = 0;
        for root in found.iter().filter(|r| r.im == 0.0 && r.re > 0.0) {
            real[count] = root.re;
            count += 1;
        }
        if count == 2 && real[0] != real[1] {
            out.extend([real[0].min(real[1]), real[0].max(real[1])]);
        } else if count == 1 {
            out.push(real[0]);
        }
        return;
    }
    let degree = c.len() - 1;
    let derivative: Vec<f64> = c[..degree].iter().enumerate().map(|(i, v)| v * (degree - i) as f64).collect();
    let mut stops = Vec::with_capacity(degree + 1);
    push_positive_roots(&derivative, &mut stops);
    let upper = stops.last().copied().unwrap_or(0.0).max(root_bound(c)) * 2.0;
    let lower = 0.5 / root_bound(&c.iter().rev().copied().collect::<Vec<_>>());
    let mut a = stops.first().map_or(lower, |s| lower.min(0.5 * s));
    stops.push(upper);
    for &b in &stops {
        if let Some(root) = monotone_root(c, a, b) {
            out.push(root);
        }
        a = b;
    }
}

/// Fujiwara's bound on the modulus of the roots.
fn root_bound(c: &[f64]) -> f64 {
    let worst = c.iter().enumerate().skip(1).map(|(i, v)| (v / c[0]).abs().powf(1.0 / i as f64));
    2.0 * worst.fold(f64::MIN_POSITIVE, f64::max)
}

fn monotone_root(c: &[f64], mut a: f64, mut b: f64) -> Option<f64> {
    let value = |x: f64| c.iter().fold((0.0, 0.0), |(p, dp), &k| (p * x + k, dp * x + p));
    let (at_a, at_b) = (value(a).0, value(b).0);
    if at_a == 0.0 || (at_a > 0.0) == (at_b > 0.0) {
        return None;
    }
    let mut x = (a * b).sqrt();
    for _ in 0..120 {
        let (p, dp) = value(x);
        if p == 0.0 {
            return Some(x);
        }
        if (p > 0.0) == (at_a > 0.0) {
            a = x
        } else {
            b = x
        }
        let newton = x - p / dp;
        let next = if newton > a && newton < b { newton } else { (a * b).sqrt() };
        if (next - x).abs() <= 2.0 * f64::EPSILON * x || b - a <= 2.0 * f64::EPSILON * b {
            return Some(next);
        }
        x = next;
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_of_a_product_of_known_factors_come_back() {
        // (s + 1)(s + 200)(s² + 0.2 s + 4)(s − 3) s²
        let c = product(
            &product(&[1.0, 1.0], &[1.0, 200.0]),
            &product(&product(&[1.0, 0.2, 4.0], &[1.0, -3.0]), &[1.0, 0.0, 0.0]),
        );
        let mut roots = Vec::new();
        push_roots(&c, &mut roots);
        assert_eq!(roots.len(), 7);
        for expected in [(-1.0, 0.0), (-200.0, 0.0), (3.0, 0.0), (-0.1, (4.0f64 - 0.01).sqrt()), (0.0, 0.0)] {
            let nearest = roots
                .iter()
                .map(|r| (r - Complex64::new(expected.0, expected.1)).norm())
                .fold(f64::INFINITY, f64::min);
            assert!(nearest < 1e-9, "{expected:?} missed by {nearest}");
        }
    }

    #[test]
    fn equal_roots_come_back_to_the_accuracy_they_have() {
        // (4 s + 1)⁸: eight equal roots are good to the eighth root of the rounding, about 2 %.
        let c = (0..8).fold(vec![1.0], |c, _| product(&c, &[4.0, 1.0]));
        let mut roots = Vec::new();
        push_roots(&c, &mut roots);
        assert_eq!(roots.len(), 8);
        assert!(roots.iter().all(|r| (r + 0.25).norm() < 0.02), "{roots:?}");
    }

    #[test]
    fn positive_roots_come_back_in_order() {
        // (x − 1e-4)(x − 2)(x − 3)(x + 5)(x² + x + 1)
        let c = product(
            &product(&product(&[1.0, -1e-4], &[1.0, -2.0]), &[1.0, -3.0]),
            &product(&[1.0, 5.0], &[1.0, 1.0, 1.0]),
        );
        let mut roots = Vec::new();
        push_positive_roots(&c, &mut roots);
        assert_eq!(roots.len(), 3, "{roots:?}");
        for (root, expected) in roots.iter().zip([1e-4, 2.0, 3.0]) {
            assert!((root / expected - 1.0).abs() < 1e-10, "{root} for {expected}");
        }
    }
}

//! The matrix exponential of the normalised second-order system, with its derivatives.

/// A 2 × 2 matrix by rows.
pub(super) type Matrix2 = [[f64; 2]; 2];

pub(super) fn apply(m: &Matrix2, v: [f64; 2]) -> [f64; 2] {
    [m[0][0] * v[0] + m[0][1] * v[1], m[1][0] * v[0] + m[1][1] * v[1]]
}

/// E = e^(A s) of A = [[0, 1], [−1, −2ζ]] over s = t/τ, with ∂E/∂ln τ and ∂E/∂ln ζ at fixed t.
///
/// With Δ = ζ² − 1: E = e^(−ζs) (C I + S (A + ζI)), C = cosh √Δ s, S = sinh(√Δ s)/√Δ; both are even in √Δ and go
/// over into cos and sin below ζ = 1. ∂E/∂ln τ = −s A E.
#[derive(Debug, Clone, Copy)]
pub(super) struct Exponential {
    pub e: Matrix2,
    pub by_tau: Matrix2,
    pub by_zeta: Matrix2,
}

impl Exponential {
    pub fn new(s: f64, zeta: f64) -> Self {
        let delta = (zeta - 1.0) * (zeta + 1.0);
        let Damped { c, s: sine, s_by_delta } = Damped::new(s, zeta, delta);
        let e = [[c + zeta * sine, sine], [-sine, c - zeta * sine]];
        let by_tau = [
            [-s * e[1][0], -s * e[1][1]],
            [s * (e[0][0] + 2.0 * zeta * e[1][0]), s * (e[0][1] + 2.0 * zeta * e[1][1])],
        ];
        // dC/dζ = ζ s S, dS/dζ = 2ζ ∂S/∂Δ, both with the common e^(−ζs), whose derivative is −s.
        let (dc, ds) = (zeta * s * sine - s * c, 2.0 * zeta * s_by_delta - s * sine);
        let by_zeta =
            [[zeta * (dc + sine + zeta * ds), zeta * ds], [-zeta * ds, zeta * (dc - sine - zeta * ds)]];
        Self { e, by_tau, by_zeta }
    }
}

/// C, S and ∂S/∂Δ, each times e^(−ζs).
struct Damped {
    c: f64,
    s: f64,
    s_by_delta: f64,
}

impl Damped {
    fn new(s: f64, zeta: f64, delta: f64) -> Self {
        let square = delta * s * s;
        if square.abs() < 1.0 {
            return Self::series(s, (-zeta * s).exp(), square);
        }
        let (c, sine) = if delta > 0.0 {
            let root = delta.sqrt();
            // ζ − √Δ = 1/(ζ + √Δ) keeps its digits.
            let slow = (-s / (zeta + root)).exp();
            let share = (-2.0 * root * s).exp_m1();
            (slow * (1.0 + 0.5 * share), -0.5 * slow * share / root)
        } else {
            let root = (-delta).sqrt();
            let decay = (-zeta * s).exp();
            (decay * (root * s).cos(), decay * (root * s).sin() / root)
        };
        Self { c, s: sine, s_by_delta: (s * c - sine) / (2.0 * delta) }
    }

    fn series(s: f64, decay: f64, square: f64) -> Self {
        /// The tenth term of either is below 1e-17.
        const TERMS: u32 = 10;
        let (mut c, mut sine, mut by_delta) = (0.0, 0.0, 0.0);
        let mut term = 1.0;
        for k in 0..TERMS {
            let n = f64::from(2 * k);
            if k > 0 {
                // ∂/∂Δ of Δᵏ s²ᵏ/(2k+1)! is k s² Δᵏ⁻¹ s²ᵏ⁻²/(2k+1)!; `term` still holds power k − 1.
                by_delta += f64::from(k) * term / ((n - 1.0) * n * (n + 1.0));
                term *= square / ((n - 1.0) * n);
            }
            c += term;
            sine += term / (n + 1.0);
        }
        Self { c: decay * c, s: decay * s * sine, s_by_delta: decay * s.powi(3) * by_delta }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// e^(As) by scaling and a Taylor series: another way to the same matrix.
    fn reference(s: f64, zeta: f64) -> Matrix2 {
        let squarings = 20;
        let h = s / f64::from(1 << squarings);
        let a = [[0.0, h], [-h, -2.0 * zeta * h]];
        let mut sum = [[1.0, 0.0], [0.0, 1.0]];
        let mut term = sum;
        for k in 1..8 {
            term = multiply(&term, &a);
            for i in 0..2 {
                for j in 0..2 {
                    term[i][j] /= f64::from(k);
                    sum[i][j] += term[i][j];
                }
            }
        }
        for _ in 0..squarings {
            sum = multiply(&sum, &sum);
        }
        sum
    }

    fn multiply(a: &Matrix2, b: &Matrix2) -> Matrix2 {
        std::array::from_fn(|i| std::array::from_fn(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j]))
    }

    #[test]
    fn exponential_and_derivatives_agree_with_an_independent_series() {
        for zeta in [0.05, 0.7, 0.999, 1.0, 1.000_001, 1.3, 8.0] {
            for s in [1e-3, 0.1, 0.9, 1.1, 4.0, 12.0] {
                let found = Exponential::new(s, zeta);
                let step = 1e-5;
                let (ahead, behind) = (reference(s, zeta * (1.0 + step)), reference(s, zeta * (1.0 - step)));
                let (longer, shorter) =
                    (reference(s * (1.0 + step), zeta), reference(s * (1.0 - step), zeta));
                let exact = reference(s, zeta);
                for i in 0..2 {
                    for j in 0..2 {
                        assert!((found.e[i][j] - exact[i][j]).abs() < 3e-9, "E at ζ {zeta}, s {s}");
                        let slope = (ahead[i][j] - behind[i][j]) / (2.0 * step);
                        assert!((found.by_zeta[i][j] - slope).abs() < 1e-4, "∂ζ at ζ {zeta}, s {s}: {slope}");
                        let slope = -(longer[i][j] - shorter[i][j]) / (2.0 * step);
                        assert!((found.by_tau[i][j] - slope).abs() < 1e-4, "∂τ at ζ {zeta}, s {s}: {slope}");
                    }
                }
            }
        }
    }
}

//! Rational transfer function with dead time.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// `G(s) = (n₀ sᵐ + … + nₘ)/(d₀ sⁿ + … + dₙ) · e^(−L s)`, coefficients in falling powers of s.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TransferFunction {
    /// Numerator, falling powers of s.
    pub num: Vec<f64>,
    /// Denominator, falling powers of s; the first coefficient is not zero.
    pub den: Vec<f64>,
    /// Dead time L in seconds, ≥ 0.
    pub dead_time_s: f64,
}

impl TransferFunction {
    /// Value at the complex frequency `s` in rad/s, dead time exact.
    #[must_use]
    pub fn eval(&self, s: Complex64) -> Complex64 {
        self.eval_rational(s) * (-s * self.dead_time_s).exp()
    }

    /// Value of the rational part alone at `s` in rad/s.
    #[must_use]
    pub fn eval_rational(&self, s: Complex64) -> Complex64 {
        horner(&self.num, s) / horner(&self.den, s)
    }

    /// `G(jω)`, ω in rad/s.
    #[must_use]
    pub fn at_omega(&self, omega_rad_s: f64) -> Complex64 {
        self.eval(Complex64::new(0.0, omega_rad_s))
    }
}

fn horner(coefficients: &[f64], s: Complex64) -> Complex64 {
    coefficients.iter().fold(Complex64::new(0.0, 0.0), |value, &c| value * s + c)
}

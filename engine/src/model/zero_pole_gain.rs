//! A transfer function as zeros, poles and gain.

use num_complex::Complex64;

use super::TransferFunction;
use super::roots::push_roots;
use super::state_space::slowest_first;

/// A zero and a pole nearer to each other than this share of their modulus cancel.
const CANCEL: f64 = 1e-8;
/// Imaginary parts below this share of the largest root are rounding.
const REAL: f64 = 1e-10;

/// `G(s) = k Π(s − zᵢ)/Π(s − pᵢ) · e^(−L s)`, roots in 1/s, complex ones in conjugate pairs.
#[derive(Debug, Clone, PartialEq)]
pub struct ZeroPoleGain {
    /// Zeros in 1/s, the slowest first.
    pub zeros: Vec<Complex64>,
    /// Poles in 1/s, the slowest first.
    pub poles: Vec<Complex64>,
    /// k: what `s^(n−m) G(s)` tends to for large s, without the dead time.
    pub gain: f64,
    /// Dead time L in seconds.
    pub dead_time_s: f64,
}

impl ZeroPoleGain {
    /// Zeros and poles of a transfer function, nothing cancelled.
    #[must_use]
    pub fn of(tf: &TransferFunction) -> Self {
        let roots = |coefficients: &[f64]| {
            let first = coefficients.iter().position(|c| *c != 0.0).unwrap_or(coefficients.len());
            let mut out = Vec::new();
            if first < coefficients.len() {
                push_roots(&coefficients[first..], &mut out);
            }
            slowest_first(&mut out);
            out
        };
        let leading = |c: &[f64]| c.iter().copied().find(|v| *v != 0.0).unwrap_or(0.0);
        Self {
            zeros: roots(&tf.num),
            poles: roots(&tf.den),
            gain: leading(&tf.num) / leading(&tf.den),
            dead_time_s: tf.dead_time_s,
        }
    }

    /// With every pair of a zero and a pole that are the same left out, and rounding taken off real roots.
    #[must_use]
    pub fn minimal(mut self) -> Self {
        let largest = self.zeros.iter().chain(&self.poles).map(|r| r.norm()).fold(0.0, f64::max);
        for root in self.zeros.iter_mut().chain(&mut self.poles) {
            if root.im.abs() <= REAL * root.norm() {
                root.im = 0.0;
            }
            if root.norm() <= 1e-14 * largest {
                *root = Complex64::new(0.0, 0.0);
            }
        }
        self.zeros.retain(|zero| {
            let scale = CANCEL * zero.norm().max(1e-6 * largest);
            match self.poles.iter().position(|pole| (pole - zero).norm() <= scale) {
                Some(twin) => {
                    self.poles.remove(twin);
                    false
                }
                None => true,
            }
        });
        slowest_first(&mut self.zeros);
        slowest_first(&mut self.poles);
        self
    }

    /// Gain at rest, G(0); ±∞ for a pole at 0, 0 for a zero there.
    #[must_use]
    pub fn static_gain(&self) -> f64 {
        let product = |roots: &[Complex64]| {
            roots.iter().filter(|r| r.norm_sqr() > 0.0).map(|r| -r).product::<Complex64>().re
        };
        let at_origin = |roots: &[Complex64]| roots.iter().filter(|r| r.norm_sqr() == 0.0).count();
        let finite = self.gain * product(&self.zeros) / product(&self.poles);
        match at_origin(&self.zeros).cmp(&at_origin(&self.poles)) {
            std::cmp::Ordering::Greater => 0.0,
            std::cmp::Ordering::Equal => finite,
            std::cmp::Ordering::Less if finite == 0.0 => 0.0,
            std::cmp::Ordering::Less => f64::INFINITY.copysign(finite),
        }
    }

    /// −1/p of the real poles in seconds, the largest first; ∞ for an integrator, negative for an unstable pole.
    #[must_use]
    pub fn time_constants_s(&self) -> Vec<f64> {
        self.poles
            .iter()
            .filter(|p| p.im == 0.0)
            .map(|p| if p.re == 0.0 { f64::INFINITY } else { -1.0 / p.re })
            .collect()
    }

    /// The same with coefficients in falling powers of s, the denominator's first one 1.
    #[must_use]
    pub fn transfer_function(&self) -> TransferFunction {
        let num = polynomial(&self.zeros).iter().map(|c| self.gain * c).collect();
        TransferFunction { num, den: polynomial(&self.poles), dead_time_s: self.dead_time_s }
    }

    /// Value at a complex s in rad/s, dead time exact.
    #[must_use]
    pub fn eval(&self, s: Complex64) -> Complex64 {
        let product = |roots: &[Complex64]| roots.iter().map(|r| s - r).product::<Complex64>();
        self.gain * product(&self.zeros) / product(&self.poles) * (-s * self.dead_time_s).exp()
    }
}

/// Π(s − rᵢ) in falling powers; conjugate pairs as real quadratics.
fn polynomial(roots: &[Complex64]) -> Vec<f64> {
    let mut c = vec![1.0];
    for root in roots.iter().filter(|r| r.im >= 0.0) {
        let factor: &[f64] =
            if root.im == 0.0 { &[1.0, -root.re] } else { &[1.0, -2.0 * root.re, root.norm_sqr()] };
        c = super::roots::product(&c, factor);
    }
    c
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_common_root_goes_and_the_rest_stays() {
        // 3 (s + 2)(s + 1)/((s + 2)(s² + 2 s + 5))
        let tf =
            TransferFunction { num: vec![3.0, 9.0, 6.0], den: vec![1.0, 4.0, 9.0, 10.0], dead_time_s: 0.5 };
        let minimal = ZeroPoleGain::of(&tf).minimal();
        assert_eq!((minimal.zeros.len(), minimal.poles.len()), (1, 2));
        assert!((minimal.static_gain() - 0.6).abs() < 1e-12);
        let s = Complex64::new(0.1, 0.7);
        assert!((minimal.eval(s) - tf.eval(s)).norm() < 1e-12);
        assert!((minimal.transfer_function().eval(s) - tf.eval(s)).norm() < 1e-12);
    }

    #[test]
    fn an_integrator_has_an_infinite_gain_of_the_right_sign() {
        let tf = TransferFunction { num: vec![-2.0], den: vec![1.0, 1.0, 0.0], dead_time_s: 0.0 };
        assert_eq!(ZeroPoleGain::of(&tf).static_gain(), f64::NEG_INFINITY);
        assert_eq!(ZeroPoleGain::of(&tf).time_constants_s(), vec![f64::INFINITY, 1.0]);
    }
}

//! The √ law of valves, regularised where its slope would be infinite.

use super::spec::ValveLaw;

/// `x/(x² + δ²)^¼`, an odd function that is √x for x ≫ δ and x/√δ for x ≪ δ.
///
/// `x` and `delta` in cm; the result in cm^½. δ = 0 gives sgn(x)·√|x|.
/// Source: Modelica.Fluid.Utilities.regRoot.
#[must_use]
#[inline]
pub fn regularised_root(x: f64, delta: f64) -> f64 {
    if delta == 0.0 {
        return x.signum() * x.abs().sqrt() * f64::from(u8::from(x != 0.0));
    }
    x / (x * x + delta * delta).sqrt().sqrt()
}

/// Derivative of [`regularised_root`] with respect to x, in cm^−½; ∞ at x = 0 when δ = 0.
#[must_use]
#[inline]
pub fn regularised_root_slope(x: f64, delta: f64) -> f64 {
    let square = x * x + delta * delta;
    (0.5 * x * x + delta * delta) / (square * square.sqrt().sqrt())
}

impl ValveLaw {
    /// Flow in cm³/s for the coefficient k and the head in cm.
    #[must_use]
    #[inline]
    pub fn flow_cm3_s(self, k: f64, head_cm: f64, delta_cm: f64) -> f64 {
        match self {
            Self::SquareRoot => k * regularised_root(head_cm, delta_cm),
            Self::Laminar => k * head_cm,
        }
    }

    /// Slope of the flow with the head, in cm²/s.
    #[must_use]
    #[inline]
    pub fn slope_cm2_s(self, k: f64, head_cm: f64, delta_cm: f64) -> f64 {
        match self {
            Self::SquareRoot => k * regularised_root_slope(head_cm, delta_cm),
            Self::Laminar => k,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_from_zero_it_is_the_square_root() {
        for x in [5.0_f64, 10.0, 25.0] {
            assert!((regularised_root(x, 0.05) / x.sqrt() - 1.0).abs() < 3e-5);
            assert_eq!(regularised_root(x, 0.0), x.sqrt());
            assert_eq!(regularised_root(-x, 0.0), -x.sqrt());
        }
        assert_eq!(regularised_root(0.0, 0.0), 0.0);
        assert_eq!(regularised_root(0.0, 0.05), 0.0);
    }

    #[test]
    fn the_slope_is_the_derivative() {
        for x in [-3.0, -0.02, 0.0, 0.01, 0.4, 12.0] {
            let numeric = (regularised_root(x + 1e-6, 0.05) - regularised_root(x - 1e-6, 0.05)) / 2e-6;
            assert!((regularised_root_slope(x, 0.05) / numeric - 1.0).abs() < 1e-7);
        }
    }
}

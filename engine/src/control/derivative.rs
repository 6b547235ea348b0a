//! The filtered derivative of the sampled PIDs.

use super::gains::PidGains;

/// a_d and b_d of `D_k = a_d D_{k−1} + b_d Δ(c·r − y)`, the filter K Td s/(1 + s Td/N) sampled every `sample_time_s`.
///
/// ```text
/// a_d = (2Td − N·h)/(2Td + N·h),  b_d = 2·K·N·Td/(2Td + N·h)       Tustin
/// a_d = Td/(Td + N·h),            b_d = K·N·Td/(Td + N·h)          backward difference, where 2Td < N·h
/// ```
///
/// Tustin's a_d is negative for 2Td < N·h and D would ring from sample to sample. Source: Åström & Hägglund,
/// PID Controllers, 2nd ed., 1995, section 3.6.
#[must_use]
pub fn derivative_coefficients(gains: &PidGains, sample_time_s: f64) -> (f64, f64) {
    let PidGains { kc, td_s, n, .. } = *gains;
    let nh = n * sample_time_s;
    if td_s == 0.0 {
        (0.0, 0.0)
    } else if 2.0 * td_s < nh {
        (td_s / (td_s + nh), kc * n * td_s / (td_s + nh))
    } else {
        ((2.0 * td_s - nh) / (2.0 * td_s + nh), 2.0 * kc * n * td_s / (2.0 * td_s + nh))
    }
}

/// The two signals of a sample that a law remembers, in PV units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Signals {
    pub setpoint: f64,
    pub pv: f64,
}

impl Signals {
    /// w·r − y.
    pub fn weighted(self, weight: f64) -> f64 {
        weight * self.setpoint - self.pv
    }

    /// r − y.
    pub fn error(self) -> f64 {
        self.setpoint - self.pv
    }
}

/// Coefficients of a sampled PID, worked out once for each tuning.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sampled {
    /// a_d of the derivative.
    pub a_d: f64,
    /// b_d of the derivative.
    pub b_d: f64,
    /// K·h/(2Ti), factor on e_k + e_{k−1} by the trapezoidal rule; 0 for Ti = ∞.
    pub integral: f64,
}

impl Sampled {
    pub fn of(gains: &PidGains, sample_time_s: f64) -> Self {
        let (a_d, b_d) = derivative_coefficients(gains, sample_time_s);
        Self { a_d, b_d, integral: gains.kc * sample_time_s / (2.0 * gains.ti_s) }
    }
}

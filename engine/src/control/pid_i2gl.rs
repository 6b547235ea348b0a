//! PID-I2GL: the incremental PID with two degrees of freedom of the STAD paper (Figure 6, eqs. 8–10).
//!
//! ```text
//! ΔP  = K[(b·r_k − y_k) − (b·r_{k−1} − y_{k−1})]          formed from the signals with the present K, b
//! D_k = a_d D_{k−1} + b_d[(c·r_k − y_k) − (c·r_{k−1} − y_{k−1})],   ΔD = D_k − D_{k−1}
//! ΔI  = K·h/(2Ti)·(e_k + e_{k−1})
//! u_k = sat(u_{k−1} + ΔP + ΔD + ΔI)                       the limiter is the anti-windup
//! a_d = (2Td − N·h)/(2Td + N·h),  b_d = 2·K·N·Td/(2Td + N·h);  backward difference where 2Td < N·h
//! ```
//!
//! P is never stored, so a change of K or b at any error brings no jump. Input that is not finite holds
//! the last output and is reported.

use serde::{Deserialize, Serialize};

use super::gains::{GainsError, PidGains};

/// Tuning of a PID with two degrees of freedom.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PidTuning {
    /// Gains of the ideal form.
    pub gains: PidGains,
    /// b, weight of the setpoint in the proportional part.
    pub b: f64,
    /// c, weight of the setpoint in the derivative part.
    pub c: f64,
}

impl PidTuning {
    /// Weights b = 1, c = 0: proportional on the error, derivative on the PV.
    #[must_use]
    pub fn new(gains: PidGains) -> Self {
        Self { gains, b: 1.0, c: 0.0 }
    }

    /// Checks the gains for this law, which needs integral action: P and D alone have no anchor in it.
    ///
    /// # Errors
    /// [`GainsError`] with the offending value.
    pub fn validated(self) -> Result<Self, GainsError> {
        let gains = self.gains.validated()?;
        if !gains.ti_s.is_finite() {
            return Err(GainsError::Ti { value: gains.ti_s });
        }
        for (name, value) in [("b", self.b), ("c", self.c)] {
            if !value.is_finite() || !(0.0..=2.0).contains(&value) {
                return Err(GainsError::Weight { name, value });
            }
        }
        Ok(self)
    }
}

/// Who writes the output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// The operator.
    Manual,
    /// The controller.
    Automatic,
}

/// What one sample of the controller came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControlOutput {
    /// Output within its limits, in MV units.
    pub mv: f64,
    /// The increment the law asked for before the limiter, in MV units.
    pub wanted_increment: f64,
    /// The input was not finite and the output is held.
    pub held: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Last {
    setpoint: f64,
    pv: f64,
}

/// The controller's state.
#[derive(Debug, Clone, PartialEq)]
pub struct PidI2gl {
    tuning: PidTuning,
    sample_time_s: f64,
    low: f64,
    high: f64,
    mv: f64,
    derivative: f64,
    last: Option<Last>,
}

impl PidI2gl {
    /// A controller at rest at the output `mv`, limited to `low…high`, sampled every `sample_time_s`.
    #[must_use]
    pub fn new(tuning: PidTuning, sample_time_s: f64, low: f64, high: f64, mv: f64) -> Self {
        Self { tuning, sample_time_s, low, high, mv: mv.clamp(low, high), derivative: 0.0, last: None }
    }

    /// The tuning in use.
    #[must_use]
    pub fn tuning(&self) -> PidTuning {
        self.tuning
    }

    /// The present output in MV units.
    #[must_use]
    pub fn mv(&self) -> f64 {
        self.mv
    }

    /// Takes a new tuning, without a jump of the output. A change of Td or N restarts the derivative from 0.
    pub fn set_tuning(&mut self, tuning: PidTuning) {
        let (old, new) = (self.tuning.gains, tuning.gains);
        if old.td_s != new.td_s || old.n != new.n {
            self.derivative = 0.0;
        }
        self.tuning = tuning;
    }

    /// Puts the output to a value, for manual operation.
    pub fn set_mv(&mut self, mv: f64) {
        if mv.is_finite() {
            self.mv = mv.clamp(self.low, self.high);
        }
    }

    /// a_d and b_d of the derivative filter for the present tuning.
    #[must_use]
    pub fn derivative_coefficients(&self) -> (f64, f64) {
        let PidGains { kc, td_s, n, .. } = self.tuning.gains;
        let nh = n * self.sample_time_s;
        if td_s == 0.0 {
            (0.0, 0.0)
        } else if 2.0 * td_s < nh {
            (td_s / (td_s + nh), kc * n * td_s / (td_s + nh))
        } else {
            ((2.0 * td_s - nh) / (2.0 * td_s + nh), 2.0 * kc * n * td_s / (2.0 * td_s + nh))
        }
    }

    /// One sample: setpoint and PV in PV units. In manual only r, y and D are kept up to date.
    pub fn update(&mut self, setpoint: f64, pv: f64, mode: Mode) -> ControlOutput {
        if !setpoint.is_finite() || !pv.is_finite() {
            return ControlOutput { mv: self.mv, wanted_increment: 0.0, held: true };
        }
        let last = self.last.unwrap_or(Last { setpoint, pv });
        self.last = Some(Last { setpoint, pv });
        let PidTuning { gains, b, c } = self.tuning;
        let (a_d, b_d) = self.derivative_coefficients();
        let weighted = |w: f64, s: &Last| w * s.setpoint - s.pv;
        let now = Last { setpoint, pv };
        let derivative = a_d * self.derivative + b_d * (weighted(c, &now) - weighted(c, &last));
        let delta_d = derivative - self.derivative;
        self.derivative = derivative;
        let delta_p = gains.kc * (weighted(b, &now) - weighted(b, &last));
        let delta_i = gains.kc * self.sample_time_s / (2.0 * gains.ti_s)
            * ((setpoint - pv) + (last.setpoint - last.pv));
        let wanted_increment = delta_p + delta_d + delta_i;
        if mode == Mode::Automatic {
            self.mv = (self.mv + wanted_increment).clamp(self.low, self.high);
        }
        ControlOutput { mv: self.mv, wanted_increment, held: false }
    }
}

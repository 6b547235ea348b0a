//! Gains and setpoint weights of a PID with two degrees of freedom.

use serde::{Deserialize, Serialize};

use super::gains::{GainsError, PidGains};
use super::law::Law;

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

    /// Checks gains and weights for a law. PID-I2GL needs integral action: P and D alone have no anchor in it.
    ///
    /// # Errors
    /// [`GainsError`] with the offending value.
    pub fn validated(self, law: &Law) -> Result<Self, GainsError> {
        let gains = self.gains.validated()?;
        if matches!(law, Law::PidI2gl { .. }) && !gains.ti_s.is_finite() {
            return Err(GainsError::Anchor);
        }
        for (name, value) in [("b", self.b), ("c", self.c)] {
            if !value.is_finite() || !(0.0..=2.0).contains(&value) {
                return Err(GainsError::Weight { name, value });
            }
        }
        Ok(self)
    }
}

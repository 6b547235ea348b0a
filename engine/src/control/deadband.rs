//! Gap action: little or no control near the setpoint, for tanks that are there to even out flows.

use serde::{Deserialize, Serialize};

/// A band about the setpoint in which the error counts less.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Deadband {
    /// Half its width in cm.
    pub half_width_cm: f64,
    /// Factor on the error inside; 0 for none at all.
    #[serde(default)]
    pub factor: f64,
}

impl Deadband {
    /// The error that counts, `f·e` inside and `e ∓ (1 − f)·w` outside, which meet at the edges.
    #[must_use]
    pub fn error(&self, error_cm: f64) -> f64 {
        let inside = error_cm.clamp(-self.half_width_cm, self.half_width_cm);
        error_cm - inside * (1.0 - self.factor)
    }

    /// The PV with which a law sees that error.
    #[must_use]
    pub fn pv(&self, setpoint_cm: f64, pv_cm: f64) -> f64 {
        setpoint_cm - self.error(setpoint_cm - pv_cm)
    }
}

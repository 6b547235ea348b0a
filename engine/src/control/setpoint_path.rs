//! The way of the setpoint from the operator to the law: ramp, then filter.

use serde::{Deserialize, Serialize};

/// How a setpoint is led to its new value.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SetpointPath {
    /// Largest speed in cm/s; absent: none.
    pub ramp_cm_s: Option<f64>,
    /// Time constant of the filter in seconds; 0 for none.
    pub filter_s: f64,
}

/// The setpoint on its way.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SetpointShaper {
    /// Ramped and filtered value in cm; none before the first sample.
    now: Option<(f64, f64)>,
}

impl SetpointShaper {
    /// One sample: the setpoint for the law, in cm.
    pub fn step(&mut self, path: &SetpointPath, setpoint_cm: f64, sample_time_s: f64) -> f64 {
        let (ramped, filtered) = self.now.unwrap_or((setpoint_cm, setpoint_cm));
        let ramped = match path.ramp_cm_s {
            Some(speed) => setpoint_cm.clamp(ramped - speed * sample_time_s, ramped + speed * sample_time_s),
            None => setpoint_cm,
        };
        let filtered = if path.filter_s > 0.0 {
            filtered - (-sample_time_s / path.filter_s).exp_m1() * (ramped - filtered)
        } else {
            ramped
        };
        self.now = Some((ramped, filtered));
        filtered
    }

    /// Stands at a value at once, as for a setpoint that another loop writes.
    pub fn jump(&mut self, setpoint_cm: f64) {
        self.now = Some((setpoint_cm, setpoint_cm));
    }
}

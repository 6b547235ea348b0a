//! A loop: one sensor, one controller, one pump.

use serde::{Deserialize, Serialize};

use super::gains::{GainsError, PidGains};
use super::pid_i2gl::{ControlOutput, Mode, PidI2gl, PidTuning};
use crate::plant::RigError;

/// A loop as a rig file describes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoopSpec {
    /// Tag of the controller, for example `LIC-02`.
    pub id: String,
    /// Tag of the sensor that gives the PV.
    pub sensor: String,
    /// Tag of the pump that takes the MV.
    pub pump: String,
    /// Setpoint at the start in cm.
    pub setpoint_cm: f64,
    /// Mode at the start.
    pub mode: Mode,
    /// Kc in MV units per cm.
    pub kc: f64,
    /// Ti in seconds.
    pub ti_s: f64,
    /// Td in seconds.
    #[serde(default)]
    pub td_s: f64,
    /// N, ratio of Td to the filter's time constant.
    #[serde(default = "default_n")]
    pub n: f64,
    /// b, weight of the setpoint in the proportional part.
    #[serde(default = "default_b")]
    pub b: f64,
    /// c, weight of the setpoint in the derivative part.
    #[serde(default)]
    pub c: f64,
    /// Time constant of the PV filter in seconds; 0 for none.
    #[serde(default)]
    pub pv_filter_s: f64,
}

fn default_n() -> f64 {
    PidGains::DEFAULT_N
}

fn default_b() -> f64 {
    1.0
}

impl LoopSpec {
    /// The tuning the file gives.
    #[must_use]
    pub fn tuning(&self) -> PidTuning {
        let gains = PidGains { kc: self.kc, ti_s: self.ti_s, td_s: self.td_s, n: self.n };
        PidTuning { gains, b: self.b, c: self.c }
    }

    /// Checks gains, weights and filter.
    ///
    /// # Errors
    /// [`RigError::Value`] with the offending field.
    pub fn check(&self) -> Result<(), RigError> {
        let refuse = |field: &'static str, value: f64, expected: &str| RigError::Value {
            item: self.id.clone(),
            field,
            value,
            expected: expected.to_owned(),
        };
        check_filter(self.pv_filter_s).map_err(|_| refuse("pv_filter_s", self.pv_filter_s, "0…3600"))?;
        self.tuning().validated().map(|_| ()).map_err(|error| match error {
            GainsError::Kc { value } => refuse("kc", value, "≠ 0"),
            GainsError::Ti { value } => refuse("ti_s", value, "> 0"),
            GainsError::Td { value } => refuse("td_s", value, "≥ 0"),
            GainsError::N { value } => refuse("n", value, "> 0"),
            GainsError::Weight { name: "b", value } => refuse("b", value, "0…2"),
            GainsError::Weight { value, .. } => refuse("c", value, "0…2"),
            GainsError::Filter { value } => refuse("pv_filter_s", value, "0…3600"),
        })
    }
}

/// Checks the time constant of a PV filter in seconds.
///
/// # Errors
/// [`GainsError::Filter`] outside 0…3600 s.
pub fn check_filter(pv_filter_s: f64) -> Result<f64, GainsError> {
    if (0.0..=3600.0).contains(&pv_filter_s) {
        Ok(pv_filter_s)
    } else {
        Err(GainsError::Filter { value: pv_filter_s })
    }
}

/// A loop in operation.
#[derive(Debug, Clone, PartialEq)]
pub struct ControlLoop {
    controller: PidI2gl,
    sample_time_s: f64,
    /// Setpoint in cm.
    pub setpoint_cm: f64,
    /// Who writes the output.
    pub mode: Mode,
    pv_filter_s: f64,
    filtered_pv: Option<f64>,
}

impl ControlLoop {
    /// A loop at rest at the output `mv`, limited to `low…high` in MV units.
    #[must_use]
    pub fn new(spec: &LoopSpec, sample_time_s: f64, low: f64, high: f64, mv: f64) -> Self {
        Self {
            controller: PidI2gl::new(spec.tuning(), sample_time_s, low, high, mv),
            sample_time_s,
            setpoint_cm: spec.setpoint_cm,
            mode: spec.mode,
            pv_filter_s: spec.pv_filter_s,
            filtered_pv: None,
        }
    }

    /// The tuning in use.
    #[must_use]
    pub fn tuning(&self) -> PidTuning {
        self.controller.tuning()
    }

    /// Takes a new tuning without a jump.
    pub fn set_tuning(&mut self, tuning: PidTuning) {
        self.controller.set_tuning(tuning);
    }

    /// Time constant of the PV filter in seconds.
    #[must_use]
    pub fn pv_filter_s(&self) -> f64 {
        self.pv_filter_s
    }

    /// Changes the PV filter; it goes on from its present value.
    pub fn set_pv_filter(&mut self, pv_filter_s: f64) {
        self.pv_filter_s = pv_filter_s;
    }

    /// The present output in MV units.
    #[must_use]
    pub fn mv(&self) -> f64 {
        self.controller.mv()
    }

    /// Puts the output to a value, for manual operation.
    pub fn set_mv(&mut self, mv: f64) {
        self.controller.set_mv(mv);
    }

    /// One sample with the measured PV in cm.
    pub fn update(&mut self, pv_cm: f64) -> ControlOutput {
        let pv = if pv_cm.is_finite() && self.pv_filter_s > 0.0 {
            let before = self.filtered_pv.unwrap_or(pv_cm);
            let share = -(-self.sample_time_s / self.pv_filter_s).exp_m1();
            before + share * (pv_cm - before)
        } else {
            pv_cm
        };
        if pv.is_finite() {
            self.filtered_pv = Some(pv);
        }
        self.controller.update(self.setpoint_cm, pv, self.mode)
    }
}

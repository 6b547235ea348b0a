//! A loop as a rig file describes it.

use serde::{Deserialize, Serialize};

use super::controller::Mode;
use super::forms::{FormError, FormGains};
use super::gains::{GainsError, PidGains};
use super::law::Law;
use super::options::LoopOptions;
use super::tuning::PidTuning;
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
    pub pump: Option<String>,
    /// Tag of the loop that takes the MV as its setpoint, instead of a pump.
    pub cascade_to: Option<String>,
    /// Setpoint at the start in cm.
    pub setpoint_cm: f64,
    /// Mode at the start.
    pub mode: Mode,
    /// Kc in MV units per cm; absent with `gains`, and with on/off.
    pub kc: Option<f64>,
    /// Ti in seconds; absent: no integral action.
    pub ti_s: Option<f64>,
    /// Td in seconds.
    #[serde(default)]
    pub td_s: f64,
    /// N, ratio of Td to the filter's time constant.
    #[serde(default = "default_n")]
    pub n: f64,
    /// Gains in a form, instead of Kc, Ti, Td and N.
    pub gains: Option<FormGains>,
    /// b, weight of the setpoint in the proportional part.
    #[serde(default = "default_b")]
    pub b: f64,
    /// c, weight of the setpoint in the derivative part.
    #[serde(default)]
    pub c: f64,
    /// Time constant of the PV filter in seconds; 0 for none.
    #[serde(default)]
    pub pv_filter_s: f64,
    /// The law.
    #[serde(default)]
    pub law: Law,
    /// What stands around the law.
    #[serde(default)]
    pub options: LoopOptions,
}

fn default_n() -> f64 {
    PidGains::DEFAULT_N
}

fn default_b() -> f64 {
    1.0
}

impl LoopSpec {
    /// The gains of the file in the ideal form, whatever form they are written in.
    ///
    /// # Errors
    /// [`FormError`] where the ideal form has no such gains.
    pub fn ideal_gains(&self) -> Result<PidGains, FormError> {
        match (&self.gains, self.kc) {
            (Some(gains), _) => gains.to_ideal(),
            (None, Some(kc)) => {
                let ti_s = self.ti_s.unwrap_or(f64::INFINITY);
                Ok(PidGains { kc, ti_s, td_s: self.td_s, n: self.n })
            }
            // An on/off loop needs no gains; a change of its law asks for them.
            (None, None) => Ok(PidGains::p(1.0)),
        }
    }

    /// The tuning the file gives.
    #[must_use]
    pub fn tuning(&self) -> PidTuning {
        let gains = self.ideal_gains().unwrap_or(PidGains::p(1.0));
        PidTuning { gains, b: self.b, c: self.c }
    }

    /// Takes another tuning.
    pub fn set_tuning(&mut self, tuning: PidTuning) {
        let PidTuning { gains, b, c } = tuning;
        (self.kc, self.ti_s, self.td_s, self.n) = (Some(gains.kc), Some(gains.ti_s), gains.td_s, gains.n);
        (self.gains, self.b, self.c) = (None, b, c);
    }

    /// Checks gains, weights and filter.
    ///
    /// # Errors
    /// [`RigError::Value`] with the offending field.
    pub fn check_tuning(&self) -> Result<(), RigError> {
        let refuse = |field: &'static str, value: f64, expected: &str| RigError::Value {
            item: self.id.clone(),
            field,
            value,
            expected: expected.to_owned(),
        };
        check_filter(self.pv_filter_s).map_err(|_| refuse("pv_filter_s", self.pv_filter_s, "0…3600"))?;
        let given = usize::from(self.kc.is_some()) + usize::from(self.gains.is_some());
        if given > 1 || given == 0 && self.law.is_pid() {
            let expected = "a number other than 0, or left out with gains of another form or on/off";
            return Err(refuse("kc", self.kc.unwrap_or(f64::NAN), expected));
        }
        let gains = self.ideal_gains().map_err(|error| refuse("gains", error.value(), &error.to_string()))?;
        let tuning = PidTuning { gains, b: self.b, c: self.c };
        tuning.validated(&self.law).map(|_| ()).map_err(|error| match error {
            GainsError::Kc { value } => refuse("kc", value, "≠ 0"),
            GainsError::Ti { value } => refuse("ti_s", value, "> 0"),
            GainsError::Anchor => refuse("ti_s", f64::INFINITY, "> 0 and finite with pid_i2gl"),
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

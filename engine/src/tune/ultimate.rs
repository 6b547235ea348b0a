//! Ultimate gain and period of a process under proportional control.

use serde::{Deserialize, Serialize};

use super::RuleError;
use crate::analyze::{OpenLoop, analyze_loop};
use crate::control::PidGains;
use crate::model::ProcessModel;

/// Ku and Pu: the proportional gain at which the loop oscillates for ever, and the period of that oscillation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Ultimate {
    /// Ku in MV units per PV unit, of the process gain's sign.
    #[serde(rename = "Ku")]
    pub ku: f64,
    /// Pu in seconds.
    #[serde(rename = "Pu_s")]
    pub pu_s: f64,
}

impl Ultimate {
    /// Checks Ku ≠ 0 and Pu > 0, both finite.
    ///
    /// # Errors
    /// [`RuleError::Ultimate`] with the offending values.
    pub fn validated(self) -> Result<Self, RuleError> {
        let usable = self.ku.is_finite() && self.ku != 0.0 && self.pu_s.is_finite() && self.pu_s > 0.0;
        if usable { Ok(self) } else { Err(RuleError::Ultimate { ku: self.ku, pu_s: self.pu_s }) }
    }
}

/// Proportional gain, relative to what the process could feel, from which its limit is sought.
const SMALL_GAIN: f64 = 1e-6;

/// Ku and Pu of a model, dead time exact: `arg G(jω) = −π` at ω = 2π/Pu, `Ku = 1/|G(jω)|`, by root finding.
///
/// Where several frequencies qualify, the one reached first from small gains. `None` where no proportional gain
/// brings the process to its limit (first and second order without dead time), or small ones do not stabilise it.
#[must_use]
pub fn ultimate(model: &ProcessModel) -> Option<Ultimate> {
    let process = OpenLoop::new(model, &PidGains::p(1.0));
    let low = process.process_low();
    // |L| falls under 1 long before any of the process's own frequencies.
    let gain = low.coefficient * process.lowest_frequency().powi(low.power);
    let kc = SMALL_GAIN / gain;
    let analysis = analyze_loop(&OpenLoop::new(model, &PidGains::p(kc)));
    let omega = analysis.w_180_rad_s.filter(|w| *w > 0.0)?;
    let pu_s = 2.0 * std::f64::consts::PI / omega;
    Ultimate { ku: kc * analysis.gain_margin?, pu_s }.validated().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Fopdt, Ipdt};

    #[test]
    fn an_integrator_has_its_closed_form() {
        // Ku = π/(2 Kv θ), Pu = 4 θ.
        let model = ProcessModel::Ipdt(Ipdt::new(-0.2, 3.0).expect("a model"));
        let found = ultimate(&model).expect("a limit");
        assert!((found.ku / (-std::f64::consts::PI / 1.2) - 1.0).abs() < 1e-12, "{found:?}");
        assert!((found.pu_s / 12.0 - 1.0).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn three_equal_lags_have_ku_8_and_pu_of_root_3() {
        let model = ProcessModel::rational(&[1.0], &[1.0, 3.0, 3.0, 1.0], 0.0).expect("a model");
        let found = ultimate(&model).expect("a limit");
        assert!((found.ku - 8.0).abs() < 1e-11, "{found:?}");
        assert!((found.pu_s - 2.0 * std::f64::consts::PI / 3f64.sqrt()).abs() < 1e-11, "{found:?}");
    }

    #[test]
    fn a_lag_without_dead_time_has_no_limit() {
        assert_eq!(ultimate(&ProcessModel::Fopdt(Fopdt::new(2.0, 5.0, 0.0).expect("a model"))), None);
    }
}

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

/// Gains per decade, and decades about 1/|G| at the process's lowest frequency, among which one that stabilises is sought.
const PER_DECADE: f64 = 24.0;
const DECADES: f64 = 3.0;

/// Ku and Pu of a model, dead time exact: `arg G(jω) = −π` at ω = 2π/Pu, `Ku = 1/|G(jω)|`, by root finding.
///
/// Where several frequencies qualify, the one reached first from small gains. `None` where no proportional gain
/// brings the process to its limit (first and second order without dead time). An unstable process has the limit at the
/// upper end of the gains that stabilise it.
#[must_use]
pub fn ultimate(model: &ProcessModel) -> Option<Ultimate> {
    let process = OpenLoop::new(model, &PidGains::p(1.0));
    let low = process.process_low();
    // |L| falls under 1 long before any of the process's own frequencies.
    let gain = low.coefficient * process.lowest_frequency().powi(low.power);
    let kc = SMALL_GAIN / gain;
    at_limit(model, kc).or_else(|| {
        // What is unstable by itself needs a gain of its own: the weakest that stabilises leads to the upper end.
        let unit = 1.0 / process.process_at_omega(process.lowest_frequency()).norm();
        let steps = (DECADES * PER_DECADE) as i32;
        let gains = (-steps..=steps).map(|k| unit * 10f64.powf(f64::from(k) / PER_DECADE));
        let both = gains.flat_map(|kc| [kc * gain.signum(), -kc * gain.signum()]);
        both.filter_map(|kc| at_limit(model, kc)).next()
    })
}

/// The limit that is reached from a stabilising gain upwards; `None` where the gain does not stabilise or there is none.
fn at_limit(model: &ProcessModel, kc: f64) -> Option<Ultimate> {
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

    /// Said to have no ultimate gain, because small gains do not stabilise e^(−0.2 s)/(s − 1): those from 1 to Ku do, where
    /// ω = tan 0.2 ω, so ω = 7.1 to 7.3 rad/s and Ku = √(1 + ω²).
    #[test]
    fn an_unstable_process_has_its_limit_at_the_upper_end_of_what_stabilises() {
        let model = ProcessModel::rational(&[1.0], &[1.0, -1.0], 0.2).expect("a model");
        let found = ultimate(&model).expect("a limit");
        let omega = 2.0 * std::f64::consts::PI / found.pu_s;
        assert!(((0.2 * omega).tan() / omega - 1.0).abs() < 1e-9, "{found:?}");
        assert!((found.ku / (1.0 + omega * omega).sqrt() - 1.0).abs() < 1e-9, "{found:?}");
        assert!(found.ku > 7.1 && found.ku < 7.3, "{found:?}");
    }
}

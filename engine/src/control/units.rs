//! Gains and times as plants write them: proportional band, reset rate, minutes, and mappings of the user's own.

use serde::{Deserialize, Serialize};

use super::forms::{Form, FormError, FormGains, ParallelGains, SeriesGains};
use super::gains::{GainsError, PidGains};

/// PB = 100·(MV span/PV span)/Kc in percent, spans in the units of MV and PV; its own inverse.
#[must_use]
pub fn proportional_band_percent(kc: f64, mv_span: f64, pv_span: f64) -> f64 {
    100.0 * (mv_span / pv_span) / kc
}

/// Kc of a proportional band in percent.
#[must_use]
pub fn kc_of_proportional_band(percent: f64, mv_span: f64, pv_span: f64) -> f64 {
    proportional_band_percent(percent, mv_span, pv_span)
}

/// Reset rate 1/Ti in repeats per second; 0 for Ti = ∞; its own inverse.
#[must_use]
pub fn repeats_per_s(ti_s: f64) -> f64 {
    1.0 / ti_s
}

/// Reset rate 60/Ti in repeats per minute; 0 for Ti = ∞; its own inverse.
#[must_use]
pub fn repeats_per_min(ti_s: f64) -> f64 {
    60.0 / ti_s
}

/// How a controller shows one number of its base form.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scale {
    /// It shows factor × value.
    Times(f64),
    /// It shows factor ÷ value; 0 stands for ∞ and the other way round.
    Over(f64),
}

impl Scale {
    /// The value itself.
    pub const PLAIN: Self = Self::Times(1.0);
    /// Seconds shown in minutes.
    pub const MINUTES: Self = Self::Times(1.0 / 60.0);
    /// A time shown as repeats per second.
    pub const REPEATS_PER_S: Self = Self::Over(1.0);
    /// A time shown as repeats per minute.
    pub const REPEATS_PER_MIN: Self = Self::Over(60.0);

    /// A gain shown as proportional band in percent.
    #[must_use]
    pub fn proportional_band(mv_span: f64, pv_span: f64) -> Self {
        Self::Over(100.0 * mv_span / pv_span)
    }

    fn factor(self) -> f64 {
        match self {
            Self::Times(factor) | Self::Over(factor) => factor,
        }
    }

    fn shown(self, value: f64) -> f64 {
        match self {
            Self::Times(factor) => factor * value,
            Self::Over(factor) => factor / value,
        }
    }

    fn value(self, shown: f64) -> f64 {
        match self {
            Self::Times(factor) => shown / factor,
            Self::Over(factor) => factor / shown,
        }
    }
}

/// A controller's own way to take its gains, as its user gives it: a base form and a scale for each number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mapping {
    /// Form its algorithm has.
    pub base: Form,
    /// Of Kc or Kp.
    pub gain: Scale,
    /// Of Ti or Ki.
    pub integral: Scale,
    /// Of Td or Kd.
    pub derivative: Scale,
    /// Of N or Tf.
    pub filter: Scale,
}

/// The four numbers as a controller shows them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShownGains {
    /// Gain.
    pub gain: f64,
    /// Integral.
    pub integral: f64,
    /// Derivative.
    pub derivative: f64,
    /// Filter.
    pub filter: f64,
}

impl Mapping {
    /// Checks that every factor is a finite number other than 0.
    ///
    /// # Errors
    /// [`GainsError::Kc`] with the offending factor.
    pub fn validated(self) -> Result<Self, GainsError> {
        let scales = [self.gain, self.integral, self.derivative, self.filter];
        match scales.map(Scale::factor).into_iter().find(|f| !f.is_finite() || *f == 0.0) {
            Some(value) => Err(GainsError::Kc { value }),
            None => Ok(self),
        }
    }

    /// What the controller shows for gains of any form.
    ///
    /// # Errors
    /// [`FormError`] where the base form has no such gains.
    pub fn shown(&self, gains: &FormGains) -> Result<ShownGains, FormError> {
        let values = match gains.to_form(self.base)? {
            FormGains::Ideal(g) => [g.kc, g.ti_s, g.td_s, g.n],
            FormGains::Series(g) => [g.kc, g.ti_s, g.td_s, g.n],
            FormGains::Parallel(g) => [g.kp, g.ki, g.kd, g.tf_s],
        };
        Ok(ShownGains {
            gain: self.gain.shown(values[0]),
            integral: self.integral.shown(values[1]),
            derivative: self.derivative.shown(values[2]),
            filter: self.filter.shown(values[3]),
        })
    }

    /// Gains of the base form from what the controller shows.
    #[must_use]
    pub fn gains(&self, shown: &ShownGains) -> FormGains {
        let gain = self.gain.value(shown.gain);
        let integral = self.integral.value(shown.integral);
        let derivative = self.derivative.value(shown.derivative);
        let filter = self.filter.value(shown.filter);
        match self.base {
            Form::Ideal => {
                FormGains::Ideal(PidGains { kc: gain, ti_s: integral, td_s: derivative, n: filter })
            }
            Form::Series => {
                FormGains::Series(SeriesGains { kc: gain, ti_s: integral, td_s: derivative, n: filter })
            }
            Form::Parallel => {
                FormGains::Parallel(ParallelGains { kp: gain, ki: integral, kd: derivative, tf_s: filter })
            }
        }
    }
}

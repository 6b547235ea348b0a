//! The forms in which controllers take their gains, each with its filter, and the exact ways between them.
//!
//! ```text
//! ideal     C = Kc(1 + 1/(Ti s) + Td s/(1 + s Td/N))
//! parallel  C = Kp + Ki/s + Kd s/(1 + s Tf)
//! series    C = Kc(1 + 1/(Ti s))·(1 + Td s)/(1 + s Td/N)
//! ```
//!
//! With Tf = Td/N, ideal → parallel is Kp = Kc, Ki = Kc/Ti, Kd = Kc·Td. Ideal → series needs the two zeros to be
//! real: they are the roots τ of τ² − (Ti + Tf)τ + Ti(Td + Tf) = 0, so it exists if and only if
//! (Ti + Td/N)² ≥ 4·Ti·Td(1 + 1/N). The larger root becomes the series form's Ti, the smaller its Td; N' = Td'/Tf.
//! Source: Åström & Hägglund, PID Controllers, 2nd ed., 1995, section 3.2, with the filter carried along.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::gains::{GainsError, PidGains};
use crate::explain::{Explain, number};

/// Gains of the parallel form.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParallelGains {
    /// Kp in MV units per PV unit.
    pub kp: f64,
    /// Ki in MV units per PV unit and second.
    #[serde(default)]
    pub ki: f64,
    /// Kd in MV units times seconds per PV unit.
    #[serde(default)]
    pub kd: f64,
    /// Tf, time constant of the derivative's filter in seconds.
    #[serde(default)]
    pub tf_s: f64,
}

impl From<PidGains> for ParallelGains {
    /// Kc, Kc/Ti, Kc·Td, Td/N.
    fn from(ideal: PidGains) -> Self {
        ideal_to_parallel(&ideal)
    }
}

impl ParallelGains {
    /// C(jω), ω > 0 in rad/s.
    #[must_use]
    pub fn at_omega(&self, omega_rad_s: f64) -> Complex64 {
        let s = Complex64::new(0.0, omega_rad_s);
        self.kp + self.ki / s + self.kd * s / (1.0 + s * self.tf_s)
    }
}

/// Gains of the series (interacting) form.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SeriesGains {
    /// Kc in MV units per PV unit.
    pub kc: f64,
    /// Ti in seconds; ∞ without integral action.
    #[serde(default = "never")]
    pub ti_s: f64,
    /// Td in seconds.
    #[serde(default)]
    pub td_s: f64,
    /// N, ratio of Td to the filter's time constant.
    #[serde(default = "usual_n")]
    pub n: f64,
}

fn never() -> f64 {
    f64::INFINITY
}

fn usual_n() -> f64 {
    PidGains::DEFAULT_N
}

/// A form without its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Form {
    /// The ideal (ISA) form, used everywhere inside.
    Ideal,
    /// Three gains side by side.
    Parallel,
    /// PI and lead one behind the other.
    Series,
}

impl Form {
    /// Every form.
    pub const ALL: [Self; 3] = [Self::Ideal, Self::Parallel, Self::Series];

    /// Name in files and arguments.
    #[must_use]
    pub fn id(self) -> &'static str {
        match self {
            Self::Ideal => "ideal",
            Self::Parallel => "parallel",
            Self::Series => "series",
        }
    }
}

/// Gains in one of the forms.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "form", rename_all = "snake_case")]
pub enum FormGains {
    /// Of the ideal form.
    Ideal(PidGains),
    /// Of the parallel form.
    Parallel(ParallelGains),
    /// Of the series form.
    Series(SeriesGains),
}

/// Why gains cannot be written in a form.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FormError {
    /// The numbers are no gains.
    #[error(transparent)]
    Gains(#[from] GainsError),
    /// Complex zeros.
    #[error("the series form has no such gains: (Ti + Td/N)² = {} s² must be at least 4·Ti·Td(1 + 1/N) = {} s²; lower Td, or use the ideal or parallel form", number(*.square_s2), number(*.least_s2))]
    Series {
        /// (Ti + Td/N)² in s².
        square_s2: f64,
        /// 4·Ti·Td(1 + 1/N) in s².
        least_s2: f64,
    },
    /// An integral or derivative without proportional action.
    #[error("Kp = 0 with Ki = {} and Kd = {}: only the parallel form has integral or derivative action without a proportional one", number(*.ki), number(*.kd))]
    NoProportional {
        /// Ki in MV units per PV unit and second.
        ki: f64,
        /// Kd in MV units times seconds per PV unit.
        kd: f64,
    },
    /// A time that would be negative.
    #[error("the ideal form would need {name} = {} s, which it does not have; use the form the gains are in", number(*.value_s))]
    Time {
        /// `Ti` or `Td`.
        name: &'static str,
        /// The time in seconds.
        value_s: f64,
    },
    /// A derivative without filter where the form's N would be infinite.
    #[error("Tf = {} s gives no finite N = Td/Tf: give the derivative a filter, Tf > 0", number(*.tf_s))]
    Filter {
        /// Tf in seconds.
        tf_s: f64,
    },
}

impl FormError {
    /// The number that decides.
    #[must_use]
    pub fn value(&self) -> f64 {
        match self {
            Self::Gains(
                GainsError::Kc { value }
                | GainsError::Ti { value }
                | GainsError::Td { value }
                | GainsError::N { value }
                | GainsError::Weight { value, .. }
                | GainsError::Filter { value },
            ) => *value,
            Self::Gains(GainsError::Anchor) => f64::INFINITY,
            Self::Series { square_s2, .. } => *square_s2,
            Self::NoProportional { .. } => 0.0,
            Self::Time { value_s, .. } => *value_s,
            Self::Filter { tf_s } => *tf_s,
        }
    }

    /// One of each kind of its own, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        vec![
            Self::Series { square_s2: 16.0, least_s2: 17.6 },
            Self::NoProportional { ki: 2.0, kd: 0.0 },
            Self::Time { name: "Td", value_s: -0.5 },
            Self::Filter { tf_s: 0.0 },
        ]
    }
}

impl Explain for FormError {
    fn key(&self) -> &'static str {
        match self {
            Self::Gains(error) => error.key(),
            Self::Series { .. } => "form.series",
            Self::NoProportional { .. } => "form.no_proportional",
            Self::Time { .. } => "form.time",
            Self::Filter { .. } => "form.filter",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Gains(error) => error.args(),
            Self::Series { square_s2, least_s2 } => {
                vec![("square_s2", number(*square_s2)), ("least_s2", number(*least_s2))]
            }
            Self::NoProportional { ki, kd } => vec![("ki", number(*ki)), ("kd", number(*kd))],
            Self::Time { name, value_s } => {
                vec![("name", (*name).to_owned()), ("value_s", number(*value_s))]
            }
            Self::Filter { tf_s } => vec![("tf_s", number(*tf_s))],
        }
    }
}

impl FormGains {
    /// The form.
    #[must_use]
    pub fn form(&self) -> Form {
        match self {
            Self::Ideal(_) => Form::Ideal,
            Self::Parallel(_) => Form::Parallel,
            Self::Series(_) => Form::Series,
        }
    }

    /// The same controller in the ideal form.
    ///
    /// # Errors
    /// [`FormError`] where the ideal form has no such controller.
    pub fn to_ideal(&self) -> Result<PidGains, FormError> {
        match self {
            Self::Ideal(gains) => Ok(gains.validated()?),
            Self::Parallel(gains) => parallel_to_ideal(gains),
            Self::Series(gains) => series_to_ideal(gains),
        }
    }

    /// The same controller in a form.
    ///
    /// # Errors
    /// [`FormError`] with the numbers where the form has no such controller.
    pub fn to_form(&self, form: Form) -> Result<Self, FormError> {
        if form == self.form() {
            return Ok(*self);
        }
        let ideal = self.to_ideal()?;
        Ok(match form {
            Form::Ideal => Self::Ideal(ideal),
            Form::Parallel => Self::Parallel(ideal_to_parallel(&ideal)),
            Form::Series => Self::Series(ideal_to_series(&ideal)?),
        })
    }

    /// `C(jω)` by the form's own formula, ω > 0 in rad/s.
    #[must_use]
    pub fn at_omega(&self, omega_rad_s: f64) -> Complex64 {
        let s = Complex64::new(0.0, omega_rad_s);
        match self {
            Self::Ideal(gains) => gains.at_omega(omega_rad_s),
            Self::Parallel(g) => g.at_omega(omega_rad_s),
            Self::Series(g) => {
                let integral = if g.ti_s.is_finite() { 1.0 / (s * g.ti_s) } else { Complex64::new(0.0, 0.0) };
                g.kc * (1.0 + integral) * (1.0 + s * g.td_s) / (1.0 + s * g.td_s / g.n)
            }
        }
    }
}

fn ideal_to_parallel(ideal: &PidGains) -> ParallelGains {
    ParallelGains { kp: ideal.kc, ki: ideal.ki(), kd: ideal.kd(), tf_s: ideal.td_s / ideal.n }
}

fn parallel_to_ideal(gains: &ParallelGains) -> Result<PidGains, FormError> {
    let ParallelGains { kp, ki, kd, tf_s } = *gains;
    for value in [kp, ki, kd] {
        if !value.is_finite() {
            return Err(GainsError::Kc { value }.into());
        }
    }
    if kp == 0.0 && (ki != 0.0 || kd != 0.0) {
        return Err(FormError::NoProportional { ki, kd });
    }
    let ti_s = if ki == 0.0 { f64::INFINITY } else { kp / ki };
    let td_s = if kd == 0.0 { 0.0 } else { kd / kp };
    for (name, value_s) in [("Ti", ti_s), ("Td", td_s)] {
        if value_s < 0.0 {
            return Err(FormError::Time { name, value_s });
        }
    }
    let n = if td_s == 0.0 { PidGains::DEFAULT_N } else { td_s / tf_s };
    if !n.is_finite() || n <= 0.0 {
        return Err(FormError::Filter { tf_s });
    }
    Ok(PidGains { kc: kp, ti_s, td_s, n }.validated()?)
}

fn ideal_to_series(ideal: &PidGains) -> Result<SeriesGains, FormError> {
    let PidGains { kc, ti_s, td_s, n } = *ideal;
    let tf_s = td_s / n;
    if td_s == 0.0 {
        return Ok(SeriesGains { kc, ti_s, td_s, n });
    }
    if ti_s == f64::INFINITY {
        return Ok(SeriesGains { kc, ti_s, td_s: td_s + tf_s, n: n + 1.0 });
    }
    let (sum_s, product_s2) = (ti_s + tf_s, ti_s * (td_s + tf_s));
    let (square_s2, least_s2) = (sum_s * sum_s, 4.0 * product_s2);
    if square_s2 < least_s2 {
        return Err(FormError::Series { square_s2, least_s2 });
    }
    let larger_s = 0.5 * (sum_s + (square_s2 - least_s2).sqrt());
    let smaller_s = product_s2 / larger_s;
    Ok(SeriesGains { kc: kc * larger_s / ti_s, ti_s: larger_s, td_s: smaller_s, n: smaller_s / tf_s })
}

fn series_to_ideal(gains: &SeriesGains) -> Result<PidGains, FormError> {
    let SeriesGains { kc, ti_s, td_s, n } = *gains;
    PidGains { kc, ti_s, td_s, n }.validated()?;
    let tf_s = td_s / n;
    // N = 1 has no derivative action: lead and filter cancel.
    if td_s == 0.0 || n == 1.0 {
        return Ok(PidGains { kc, ti_s, td_s: 0.0, n: PidGains::DEFAULT_N });
    }
    if ti_s == f64::INFINITY {
        let ideal_td_s = td_s - tf_s;
        if ideal_td_s < 0.0 {
            return Err(FormError::Time { name: "Td", value_s: ideal_td_s });
        }
        return Ok(PidGains { kc, ti_s, td_s: ideal_td_s, n: n - 1.0 });
    }
    let ideal_ti_s = ti_s + td_s - tf_s;
    if ideal_ti_s <= 0.0 {
        return Err(FormError::Time { name: "Ti", value_s: ideal_ti_s });
    }
    let ideal_td_s = ti_s * td_s / ideal_ti_s - tf_s;
    if ideal_td_s <= 0.0 {
        return Err(FormError::Time { name: "Td", value_s: ideal_td_s });
    }
    let ideal =
        PidGains { kc: kc * ideal_ti_s / ti_s, ti_s: ideal_ti_s, td_s: ideal_td_s, n: ideal_td_s / tf_s };
    Ok(ideal.validated()?)
}

//! Gains of a PID controller in the ideal (ISA) form.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use crate::explain::{Explain, number};

/// `C(s) = Kc (1 + 1/(Ti s) + Td s/(1 + s Td/N))`.
///
/// `ti_s = ∞` stands for a controller without integral action, `td_s = 0` for one without derivative.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PidGains {
    /// Kc in MV units per PV unit; negative for direct action.
    pub kc: f64,
    /// Ti in seconds; > 0, ∞ without integral action.
    pub ti_s: f64,
    /// Td in seconds; ≥ 0.
    pub td_s: f64,
    /// N, ratio of Td to the filter's time constant; > 0.
    pub n: f64,
}

/// Why a set of gains cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GainsError {
    /// Kc zero or not finite.
    #[error("Kc = {} is not usable: it must be a finite number other than 0", number(*.value))]
    Kc {
        /// Offending value in MV units per PV unit.
        value: f64,
    },
    /// Ti zero, negative or NaN.
    #[error("Ti = {} s is not usable: it must be greater than 0", number(*.value))]
    Ti {
        /// Offending value in seconds.
        value: f64,
    },
    /// Ti infinite for PID-I2GL.
    #[error(
        "PID-I2GL needs integral action, Ti = ∞ is not usable: P and D alone have no anchor in it; choose the positional PID"
    )]
    Anchor,
    /// Td negative or not finite.
    #[error("Td = {} s is not usable: it must be 0 or more", number(*.value))]
    Td {
        /// Offending value in seconds.
        value: f64,
    },
    /// N zero, negative or not finite.
    #[error("N = {} is not usable: it must be greater than 0", number(*.value))]
    N {
        /// Offending value.
        value: f64,
    },
    /// A setpoint weight outside 0…2.
    #[error("the setpoint weight {name} = {} is not usable: it must lie between 0 and 2", number(*.value))]
    Weight {
        /// `b` or `c`.
        name: &'static str,
        /// Offending value.
        value: f64,
    },
    /// A PV filter that is negative, longer than an hour or not finite.
    #[error("a PV filter of {} s is not usable: it must lie between 0 and 3600 s", number(*.value))]
    Filter {
        /// Offending value in seconds.
        value: f64,
    },
}

impl GainsError {
    /// One of each kind, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        vec![
            Self::Kc { value: 0.0 },
            Self::Ti { value: -1.0 },
            Self::Anchor,
            Self::Td { value: -1.0 },
            Self::N { value: 0.0 },
            Self::Weight { name: "b", value: 3.0 },
            Self::Filter { value: -1.0 },
        ]
    }
}

impl Explain for GainsError {
    fn key(&self) -> &'static str {
        match self {
            Self::Kc { .. } => "gains.kc",
            Self::Ti { .. } => "gains.ti",
            Self::Anchor => "gains.anchor",
            Self::Td { .. } => "gains.td",
            Self::N { .. } => "gains.n",
            Self::Weight { .. } => "gains.weight",
            Self::Filter { .. } => "gains.filter",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Anchor => vec![],
            Self::Kc { value }
            | Self::Ti { value }
            | Self::Td { value }
            | Self::N { value }
            | Self::Filter { value } => vec![("value", number(*value))],
            Self::Weight { name, value } => {
                vec![("name", (*name).to_owned()), ("value", number(*value))]
            }
        }
    }
}

impl PidGains {
    /// Filter ratio N unless another is given.
    pub const DEFAULT_N: f64 = 10.0;

    /// Proportional action alone.
    #[must_use]
    pub fn p(kc: f64) -> Self {
        Self { kc, ti_s: f64::INFINITY, td_s: 0.0, n: Self::DEFAULT_N }
    }

    /// Proportional and integral action.
    #[must_use]
    pub fn pi(kc: f64, ti_s: f64) -> Self {
        Self { kc, ti_s, td_s: 0.0, n: Self::DEFAULT_N }
    }

    /// All three actions with N = 10.
    #[must_use]
    pub fn pid(kc: f64, ti_s: f64, td_s: f64) -> Self {
        Self { kc, ti_s, td_s, n: Self::DEFAULT_N }
    }

    /// Checks Kc ≠ 0, Ti > 0 (∞ allowed), Td ≥ 0, N > 0.
    ///
    /// # Errors
    /// [`GainsError`] with the offending value.
    pub fn validated(self) -> Result<Self, GainsError> {
        if !self.kc.is_finite() || self.kc == 0.0 {
            return Err(GainsError::Kc { value: self.kc });
        }
        if self.ti_s.is_nan() || self.ti_s <= 0.0 {
            return Err(GainsError::Ti { value: self.ti_s });
        }
        if !self.td_s.is_finite() || self.td_s < 0.0 {
            return Err(GainsError::Td { value: self.td_s });
        }
        if !self.n.is_finite() || self.n <= 0.0 {
            return Err(GainsError::N { value: self.n });
        }
        Ok(self)
    }

    /// Ki = Kc/Ti of the parallel form, in MV units per PV unit and second; 0 without integral action.
    #[must_use]
    pub fn ki(&self) -> f64 {
        self.kc / self.ti_s
    }

    /// Kd = Kc·Td of the parallel form, in MV units times seconds per PV unit.
    #[must_use]
    pub fn kd(&self) -> f64 {
        self.kc * self.td_s
    }

    /// `C(jω)`, ω > 0 in rad/s.
    #[must_use]
    pub fn at_omega(&self, omega_rad_s: f64) -> Complex64 {
        let s = Complex64::new(0.0, omega_rad_s);
        let integral = if self.ti_s.is_finite() { 1.0 / (s * self.ti_s) } else { Complex64::new(0.0, 0.0) };
        let derivative = s * self.td_s / (1.0 + s * (self.td_s / self.n));
        self.kc * (1.0 + integral + derivative)
    }
}

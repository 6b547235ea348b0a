//! The named low-order structures of process control, validated at construction.

use serde::{Deserialize, Serialize};

use super::TransferFunction;
use crate::explain::{Explain, number};

/// First order plus dead time, `K e^(−Ls)/(T s + 1)`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Fopdt {
    /// K, static gain in PV units per MV unit; not zero.
    pub gain: f64,
    /// T, time constant in seconds; > 0.
    pub time_constant_s: f64,
    /// L, dead time in seconds; ≥ 0.
    pub dead_time_s: f64,
}

/// Integrator plus dead time, `Kv e^(−Ls)/s`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Ipdt {
    /// Kv, velocity gain in PV units per MV unit and second; not zero.
    pub velocity_gain: f64,
    /// L, dead time in seconds; ≥ 0.
    pub dead_time_s: f64,
}

/// Overdamped second order plus dead time, `K (Tz s + 1) e^(−Ls)/((T1 s + 1)(T2 s + 1))`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sopdt {
    /// K, static gain in PV units per MV unit; not zero.
    pub gain: f64,
    /// T1, the larger time constant in seconds; > 0.
    pub time_constant_1_s: f64,
    /// T2, the smaller time constant in seconds; ≥ 0.
    pub time_constant_2_s: f64,
    /// Tz, time constant of the zero in seconds; negative puts it in the right half-plane.
    pub zero_time_constant_s: f64,
    /// L, dead time in seconds; ≥ 0.
    pub dead_time_s: f64,
}

/// Any process model the workbench tunes and analyses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ProcessModel {
    /// First order plus dead time.
    Fopdt(Fopdt),
    /// Integrator plus dead time.
    Ipdt(Ipdt),
    /// Second order plus dead time.
    Sopdt(Sopdt),
    /// Numerator and denominator with dead time.
    Rational(TransferFunction),
}

/// As the command line writes models: `K=4.9,T=152,L=2`, times in seconds.
impl std::fmt::Display for ProcessModel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let n = number;
        match self {
            Self::Fopdt(m) => {
                write!(f, "K={},T={},L={}", n(m.gain), n(m.time_constant_s), n(m.dead_time_s))
            }
            Self::Ipdt(m) => write!(f, "Kv={},L={}", n(m.velocity_gain), n(m.dead_time_s)),
            Self::Sopdt(m) => {
                let [t1, t2] = [m.time_constant_1_s, m.time_constant_2_s].map(n);
                write!(f, "K={},T1={t1},T2={t2},L={}", n(m.gain), n(m.dead_time_s))?;
                if m.zero_time_constant_s != 0.0 {
                    write!(f, ",Tz={}", n(m.zero_time_constant_s))?;
                }
                Ok(())
            }
            Self::Rational(m) => {
                let falling = |c: &[f64]| c.iter().map(|c| n(*c)).collect::<Vec<_>>().join(" ");
                write!(f, "num={},den={},L={}", falling(&m.num), falling(&m.den), n(m.dead_time_s))
            }
        }
    }
}

/// Why a set of numbers is not a process model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// A gain of zero or a non-finite one.
    #[error("the gain {symbol} = {} is not usable: it must be a finite number other than 0", number(*.value))]
    Gain {
        /// Symbol as the user typed it.
        symbol: &'static str,
        /// Offending value.
        value: f64,
    },
    /// A time constant of zero or less.
    #[error("the time constant {symbol} = {} s is not usable: it must be greater than 0", number(*.value))]
    TimeConstant {
        /// Symbol as the user typed it.
        symbol: &'static str,
        /// Offending value in seconds.
        value: f64,
    },
    /// A negative or non-finite dead time.
    #[error("the dead time L = {} s is not usable: it must be 0 or more", number(*.value))]
    DeadTime {
        /// Offending value in seconds.
        value: f64,
    },
    /// A numerator or denominator that is empty, zero or not finite.
    #[error(
        "the {part} of the transfer function is empty, zero or not finite: give its coefficients in falling powers of s"
    )]
    Polynomial {
        /// `numerator` or `denominator`.
        part: &'static str,
    },
    /// More zeros than poles.
    #[error(
        "the transfer function has {zeros} zeros but only {poles} poles: no real process has more zeros than poles"
    )]
    Improper {
        /// Degree of the numerator.
        zeros: usize,
        /// Degree of the denominator.
        poles: usize,
    },
}

impl Explain for ModelError {
    fn key(&self) -> &'static str {
        match self {
            Self::Gain { .. } => "model.gain",
            Self::TimeConstant { .. } => "model.time_constant",
            Self::DeadTime { .. } => "model.dead_time",
            Self::Polynomial { .. } => "model.polynomial",
            Self::Improper { .. } => "model.improper",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Gain { symbol, value } | Self::TimeConstant { symbol, value } => {
                vec![("symbol", (*symbol).to_owned()), ("value", number(*value))]
            }
            Self::DeadTime { value } => vec![("value", number(*value))],
            Self::Polynomial { part } => vec![("part", (*part).to_owned())],
            Self::Improper { zeros, poles } => {
                vec![("zeros", zeros.to_string()), ("poles", poles.to_string())]
            }
        }
    }
}

impl ModelError {
    /// One of each kind, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        vec![
            Self::Gain { symbol: "K", value: 0.0 },
            Self::TimeConstant { symbol: "T", value: -3.0 },
            Self::DeadTime { value: -1.0 },
            Self::Polynomial { part: "numerator" },
            Self::Improper { zeros: 2, poles: 1 },
        ]
    }
}

fn check_gain(symbol: &'static str, value: f64) -> Result<(), ModelError> {
    if value.is_finite() && value != 0.0 { Ok(()) } else { Err(ModelError::Gain { symbol, value }) }
}

fn check_time_constant(symbol: &'static str, value: f64) -> Result<(), ModelError> {
    if value.is_finite() && value > 0.0 { Ok(()) } else { Err(ModelError::TimeConstant { symbol, value }) }
}

fn check_dead_time(value: f64) -> Result<(), ModelError> {
    if value.is_finite() && value >= 0.0 { Ok(()) } else { Err(ModelError::DeadTime { value }) }
}

impl Fopdt {
    /// Checks K ≠ 0, T > 0, L ≥ 0.
    ///
    /// # Errors
    /// [`ModelError`] with the offending value.
    pub fn new(gain: f64, time_constant_s: f64, dead_time_s: f64) -> Result<Self, ModelError> {
        check_gain("K", gain)?;
        check_time_constant("T", time_constant_s)?;
        check_dead_time(dead_time_s)?;
        Ok(Self { gain, time_constant_s, dead_time_s })
    }

    /// θ/τ, what the field calls the controllability ratio: dead time over time constant.
    #[must_use]
    pub fn dead_time_ratio(&self) -> f64 {
        self.dead_time_s / self.time_constant_s
    }
}

impl Ipdt {
    /// Checks Kv ≠ 0, L ≥ 0.
    ///
    /// # Errors
    /// [`ModelError`] with the offending value.
    pub fn new(velocity_gain: f64, dead_time_s: f64) -> Result<Self, ModelError> {
        check_gain("Kv", velocity_gain)?;
        check_dead_time(dead_time_s)?;
        Ok(Self { velocity_gain, dead_time_s })
    }
}

impl Sopdt {
    /// Checks K ≠ 0, T1 > 0, T2 > 0, L ≥ 0, Tz finite, and orders T1 ≥ T2.
    ///
    /// # Errors
    /// [`ModelError`] with the offending value.
    pub fn new(
        gain: f64,
        time_constant_1_s: f64,
        time_constant_2_s: f64,
        zero_time_constant_s: f64,
        dead_time_s: f64,
    ) -> Result<Self, ModelError> {
        check_gain("K", gain)?;
        check_time_constant("T1", time_constant_1_s)?;
        check_time_constant("T2", time_constant_2_s)?;
        check_dead_time(dead_time_s)?;
        if !zero_time_constant_s.is_finite() {
            return Err(ModelError::TimeConstant { symbol: "Tz", value: zero_time_constant_s });
        }
        Ok(Self {
            gain,
            time_constant_1_s: time_constant_1_s.max(time_constant_2_s),
            time_constant_2_s: time_constant_1_s.min(time_constant_2_s),
            zero_time_constant_s,
            dead_time_s,
        })
    }
}

impl ProcessModel {
    /// Checks a numerator and a denominator in falling powers of s, and drops leading zeros.
    ///
    /// # Errors
    /// [`ModelError`] when a polynomial is unusable, the function improper or the dead time negative.
    pub fn rational(num: &[f64], den: &[f64], dead_time_s: f64) -> Result<Self, ModelError> {
        let num = trimmed(num).ok_or(ModelError::Polynomial { part: "numerator" })?;
        let den = trimmed(den).ok_or(ModelError::Polynomial { part: "denominator" })?;
        check_dead_time(dead_time_s)?;
        if num.len() > den.len() {
            return Err(ModelError::Improper { zeros: num.len() - 1, poles: den.len() - 1 });
        }
        Ok(Self::Rational(TransferFunction { num, den, dead_time_s }))
    }

    /// The model as numerator, denominator and dead time.
    #[must_use]
    pub fn transfer_function(&self) -> TransferFunction {
        match self {
            Self::Fopdt(m) => TransferFunction {
                num: vec![m.gain],
                den: vec![m.time_constant_s, 1.0],
                dead_time_s: m.dead_time_s,
            },
            Self::Ipdt(m) => TransferFunction {
                num: vec![m.velocity_gain],
                den: vec![1.0, 0.0],
                dead_time_s: m.dead_time_s,
            },
            Self::Sopdt(m) => {
                let (t1, t2) = (m.time_constant_1_s, m.time_constant_2_s);
                let num = if m.zero_time_constant_s == 0.0 {
                    vec![m.gain]
                } else {
                    vec![m.gain * m.zero_time_constant_s, m.gain]
                };
                TransferFunction { num, den: vec![t1 * t2, t1 + t2, 1.0], dead_time_s: m.dead_time_s }
            }
            Self::Rational(tf) => tf.clone(),
        }
    }

    /// L in seconds.
    #[must_use]
    pub fn dead_time_s(&self) -> f64 {
        match self {
            Self::Fopdt(m) => m.dead_time_s,
            Self::Ipdt(m) => m.dead_time_s,
            Self::Sopdt(m) => m.dead_time_s,
            Self::Rational(m) => m.dead_time_s,
        }
    }
}

fn trimmed(coefficients: &[f64]) -> Option<Vec<f64>> {
    if coefficients.iter().any(|c| !c.is_finite()) {
        return None;
    }
    let first = coefficients.iter().position(|&c| c != 0.0)?;
    Some(coefficients[first..].to_vec())
}

//! Why points of a frequency response are none, or do not tell what is asked.

use super::measured::FEWEST;
use crate::explain::{Explain, number};

/// Why points are not a frequency response.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FrequencyResponseError {
    /// Too few of them.
    #[error("a frequency response of {count} points says too little: at least {FEWEST} are needed")]
    TooFew {
        /// Their number.
        count: usize,
    },
    /// A frequency that is not larger than the one before, or a value that is zero or not finite.
    #[error(
        "point {index} of the frequency response, at {} rad/s, is not usable: frequencies must rise from above 0, values be finite and not 0",
        number(*.omega_rad_s)
    )]
    Point {
        /// Its place, from 1.
        index: usize,
        /// Its frequency in rad/s.
        omega_rad_s: f64,
    },
    /// The gain of the loop has not fallen under 1 at the last frequency.
    #[error(
        "the loop's gain is still {} at the last measured frequency, {} rad/s: whether it is stable cannot be told; measure up to where it is well under 1",
        number(*.gain),
        number(*.omega_rad_s)
    )]
    TooShort {
        /// |L| there.
        gain: f64,
        /// The last frequency in rad/s.
        omega_rad_s: f64,
    },
    /// The phase leads the gain by more than a stable process can.
    #[error(
        "at {} rad/s the phase of the frequency response is {}° ahead of what its gain allows a stable process: is the process unstable? A measured response must be that of a stable or integrating process; take a model for an unstable one",
        number(*.omega_rad_s),
        number(*.lead_deg)
    )]
    Unstable {
        /// Frequency of the largest lead in rad/s.
        omega_rad_s: f64,
        /// The lead in degrees, rounded.
        lead_deg: f64,
    },
    /// The response ends before half a turn of lag, so that no gain can be told from one too large.
    #[error(
        "the frequency response ends at {} rad/s with a phase of {}°: which gains stabilise cannot be told before −180°; measure to a higher frequency",
        number(*.omega_rad_s),
        number(*.phase_deg)
    )]
    BeforeHalfTurn {
        /// The last frequency in rad/s.
        omega_rad_s: f64,
        /// Phase there in degrees, of the process with its gain taken positive.
        phase_deg: f64,
    },
}

impl FrequencyResponseError {
    /// One of each kind, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        vec![
            Self::TooFew { count: 2 },
            Self::Point { index: 3, omega_rad_s: 0.1 },
            Self::TooShort { gain: 1.2, omega_rad_s: 0.3 },
            Self::Unstable { omega_rad_s: 0.3, lead_deg: 80.0 },
            Self::BeforeHalfTurn { omega_rad_s: 0.3, phase_deg: -120.0 },
        ]
    }
}

impl Explain for FrequencyResponseError {
    fn key(&self) -> &'static str {
        match self {
            Self::TooFew { .. } => "frequency_response.too_few",
            Self::Point { .. } => "frequency_response.point",
            Self::TooShort { .. } => "frequency_response.too_short",
            Self::Unstable { .. } => "frequency_response.unstable",
            Self::BeforeHalfTurn { .. } => "frequency_response.before_half_turn",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::TooFew { count } => vec![("count", count.to_string()), ("least", FEWEST.to_string())],
            Self::Point { index, omega_rad_s } => {
                vec![("index", index.to_string()), ("omega", number(*omega_rad_s))]
            }
            Self::TooShort { gain, omega_rad_s } => {
                vec![("gain", number(*gain)), ("omega", number(*omega_rad_s))]
            }
            Self::Unstable { omega_rad_s, lead_deg } => {
                vec![("omega", number(*omega_rad_s)), ("lead", number(*lead_deg))]
            }
            Self::BeforeHalfTurn { omega_rad_s, phase_deg } => {
                vec![("omega", number(*omega_rad_s)), ("phase", number(*phase_deg))]
            }
        }
    }
}

//! Why a document stays as it is, in words that say what to do.

use crate::explain::{Explain, number};
use crate::session::CommandError;
use crate::tune::RuleError;
use crate::tune::optimum::OptimumError;

/// Why the document stays as it is.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DocumentError {
    /// The rig could not take it.
    #[error(transparent)]
    Command(#[from] CommandError),
    /// PV and MV on one column.
    #[error("PV and MV cannot be the same column; choose another one for either")]
    SameColumn,
    /// A stretch without length.
    #[error("a stretch from {} s to {} s is empty; drag over a part of the trend", number(*.from_s), number(*.to_s))]
    EmptyStretch {
        /// Start in seconds.
        from_s: f64,
        /// End in seconds.
        to_s: f64,
    },
    /// A free time constant that is not positive.
    #[error("τc = {} s is not usable: it must be greater than 0", number(*.value))]
    TauC {
        /// Offending value in seconds.
        value: f64,
    },
    /// Limits that cannot be used.
    #[error(transparent)]
    Optimum(OptimumError),
    /// An overshoot that is no share.
    #[error("an overshoot of {} % is not usable: give percent from 0 to 100", number(*.value))]
    Overshoot {
        /// Offending value in percent.
        value: f64,
    },
    /// Ku and Pu that cannot be used.
    #[error(transparent)]
    Ultimate(RuleError),
}

impl Explain for DocumentError {
    fn key(&self) -> &'static str {
        match self {
            Self::Command(error) => error.key(),
            Self::SameColumn => "document.same_column",
            Self::EmptyStretch { .. } => "document.empty_stretch",
            Self::TauC { .. } => "document.tau_c",
            Self::Overshoot { .. } => "document.overshoot",
            Self::Ultimate(error) => error.key(),
            Self::Optimum(error) => error.key(),
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Command(error) => error.args(),
            Self::SameColumn => vec![],
            Self::EmptyStretch { from_s, to_s } => vec![("from_s", number(*from_s)), ("to_s", number(*to_s))],
            Self::TauC { value } | Self::Overshoot { value } => vec![("value", number(*value))],
            Self::Ultimate(error) => error.args(),
            Self::Optimum(error) => error.args(),
        }
    }
}

impl DocumentError {
    /// One of each kind of its own, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        vec![
            Self::SameColumn,
            Self::EmptyStretch { from_s: 5.0, to_s: 5.0 },
            Self::TauC { value: -1.0 },
            Self::Overshoot { value: -1.0 },
        ]
    }
}

//! Why a test does not begin.

use crate::explain::{Explain, number};
use crate::plant::RigError;

/// A description that cannot be, or a loop that is not ready for it. Nothing has been moved then.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ExcitationError {
    /// A value of the description.
    #[error(transparent)]
    Value(#[from] RigError),
    /// Another test runs.
    #[error("a test runs on {tag}; end that one first")]
    Busy {
        /// Loop of the test that runs.
        tag: String,
    },
    /// None to end.
    #[error("no test runs on {tag}")]
    NotRunning {
        /// Loop.
        tag: String,
    },
    /// No valid PV to begin with.
    #[error("{tag} has no valid PV: a test needs its sensor")]
    NoPv {
        /// Loop.
        tag: String,
    },
    /// The PV is outside the limits it is to keep.
    #[error("{tag}: the PV is {}, outside the limits of the test, {} to {}", number(*.pv), number(*.low), number(*.high))]
    PvOutside {
        /// Loop.
        tag: String,
        /// PV in PV units.
        pv: f64,
        /// Lowest PV.
        low: f64,
        /// Highest PV.
        high: f64,
    },
    /// The output has not the room that the signal needs.
    #[error(
        "{tag}: the output would go from {} to {}, but must stay between {} and {}; choose a smaller move, or another operating point",
        number(*.from), number(*.to), number(*.low), number(*.high)
    )]
    Margin {
        /// Loop.
        tag: String,
        /// Lowest output of the signal in MV units.
        from: f64,
        /// Highest.
        to: f64,
        /// Lowest output possible.
        low: f64,
        /// Highest.
        high: f64,
    },
    /// The new setpoint lies beyond the limits of the PV.
    #[error(
        "{tag}: the setpoint would go to {}, but the PV must stay between {} and {}",
        number(*.setpoint), number(*.low), number(*.high)
    )]
    Setpoint {
        /// Loop.
        tag: String,
        /// Setpoint after the step in PV units.
        setpoint: f64,
        /// Lowest PV.
        low: f64,
        /// Highest PV.
        high: f64,
    },
}

impl Explain for ExcitationError {
    fn key(&self) -> &'static str {
        match self {
            Self::Value(error) => error.key(),
            Self::Busy { .. } => "excitation.busy",
            Self::NotRunning { .. } => "excitation.not_running",
            Self::NoPv { .. } => "excitation.no_pv",
            Self::PvOutside { .. } => "excitation.pv_outside",
            Self::Margin { .. } => "excitation.margin",
            Self::Setpoint { .. } => "excitation.setpoint",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        let between = |low: f64, high: f64| [("low", number(low)), ("high", number(high))];
        match self {
            Self::Value(error) => error.args(),
            Self::Busy { tag } | Self::NotRunning { tag } | Self::NoPv { tag } => vec![("tag", tag.clone())],
            Self::PvOutside { tag, pv, low, high } => {
                let mut args = vec![("tag", tag.clone()), ("pv", number(*pv))];
                args.extend(between(*low, *high));
                args
            }
            Self::Margin { tag, from, to, low, high } => {
                let mut args = vec![("tag", tag.clone()), ("from", number(*from)), ("to", number(*to))];
                args.extend(between(*low, *high));
                args
            }
            Self::Setpoint { tag, setpoint, low, high } => {
                let mut args = vec![("tag", tag.clone()), ("setpoint", number(*setpoint))];
                args.extend(between(*low, *high));
                args
            }
        }
    }
}

impl ExcitationError {
    /// One of each kind of its own, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        let tag = || "LIC-02".to_owned();
        vec![
            Self::Busy { tag: tag() },
            Self::NotRunning { tag: tag() },
            Self::NoPv { tag: tag() },
            Self::PvOutside { tag: tag(), pv: 26.0, low: 1.5, high: 25.5 },
            Self::Margin { tag: tag(), from: 0.8, to: 1.6, low: 1.0, high: 3.5 },
            Self::Setpoint { tag: tag(), setpoint: 26.0, low: 1.5, high: 25.5 },
        ]
    }
}

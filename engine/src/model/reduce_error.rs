//! Why a transfer function cannot be reduced to a low-order model.

use crate::explain::{Explain, number};
use crate::identify::FitError;

/// What stands in the way of a reduction.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ReduceError {
    /// Conjugate poles or zeros.
    #[error("the {what} at {} ± {}j has no time constant: low-order models with real lags do not fit it", number(*.re), number(*.im))]
    Complex {
        /// `pole` or `zero`.
        what: &'static str,
        /// Real part in 1/s.
        re: f64,
        /// Imaginary part in 1/s.
        im: f64,
    },
    /// A pole in the right half-plane.
    #[error("the pole at {} 1/s is unstable: there is no low-order model with lags for it", number(*.pole))]
    Unstable {
        /// Pole in 1/s.
        pole: f64,
    },
    /// Poles at 0 where they cannot be.
    #[error("{integrators} integrators are too many for this reduction")]
    Integrators {
        /// How many.
        integrators: usize,
    },
    /// A zero at 0, or no gain at all.
    #[error("the gain at rest is 0: the output returns whatever the input does")]
    NoGain,
    /// Nothing that takes time.
    #[error("the process has no lag left: it is a gain")]
    NoLag,
    /// The fit failed.
    #[error(transparent)]
    Fit(#[from] FitError),
}

impl Explain for ReduceError {
    fn key(&self) -> &'static str {
        match self {
            Self::Complex { .. } => "reduce.complex",
            Self::Unstable { .. } => "reduce.unstable",
            Self::Integrators { .. } => "reduce.integrators",
            Self::NoGain => "reduce.no_gain",
            Self::NoLag => "reduce.no_lag",
            Self::Fit(error) => error.key(),
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Complex { what, re, im } => {
                vec![("what", (*what).to_owned()), ("re", number(*re)), ("im", number(*im))]
            }
            Self::Unstable { pole } => vec![("pole", number(*pole))],
            Self::Integrators { integrators } => vec![("integrators", integrators.to_string())],
            Self::NoGain | Self::NoLag => vec![],
            Self::Fit(error) => error.args(),
        }
    }
}

impl ReduceError {
    /// One of each kind of its own, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        vec![
            Self::Complex { what: "pole", re: -0.1, im: 0.3 },
            Self::Unstable { pole: 0.2 },
            Self::Integrators { integrators: 2 },
            Self::NoGain,
            Self::NoLag,
        ]
    }
}

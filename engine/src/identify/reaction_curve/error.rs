//! Why no reaction curve can be read off a record.

use crate::explain::{Explain, number};
use crate::identify::FitError;

/// What a record lacks to be a reaction curve, and what to do about it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ReactionCurveError {
    /// The data are malformed.
    #[error("{0}")]
    Data(FitError),
    /// The MV holds still.
    #[error(
        "{column} makes no step in this stretch: choose one with a single step, or give the value of {column} before the first row"
    )]
    NoStep {
        /// Name of the MV column.
        column: String,
    },
    /// The MV moves more than once.
    #[error(
        "{column} moves in {moves} rows of this stretch: a reaction curve has one step; choose a stretch around a single one, or use least squares"
    )]
    SeveralSteps {
        /// Name of the MV column.
        column: String,
        /// Rows in which it moves.
        moves: usize,
    },
    /// Too little of the response.
    #[error(
        "only {rows} rows after the step: a reaction curve needs at least {needed}; choose a longer stretch"
    )]
    TooShort {
        /// Rows from the step on.
        rows: usize,
        /// Rows needed.
        needed: usize,
    },
    /// The PV doesn't respond beyond its noise.
    #[error(
        "{column} moves by {} after the step, no more than its noise of {}: make a larger step", number(*.moved), number(*.noise)
    )]
    NoResponse {
        /// Name of the PV column.
        column: String,
        /// From rest to rest, in PV units.
        moved: f64,
        /// Standard deviation at rest, in PV units.
        noise: f64,
    },
    /// The PV moves ahead of the step.
    #[error(
        "{column} is not at rest before the step: it moves by {} % of the response; begin the stretch later, or wait for rest before the step", number(*.percent)
    )]
    NotAtRestBefore {
        /// Name of the PV column.
        column: String,
        /// How far it moves ahead of the step, in percent of the response.
        percent: f64,
    },
    /// The PV still moves at the end.
    #[error(
        "{column} is not at rest after the step: over the last quarter it moves by {} % of the response; record longer, or fit an integrating or drifting model", number(*.percent)
    )]
    NotAtRestAfter {
        /// Name of the PV column.
        column: String,
        /// How far it moves over the last quarter of the time since the step, in percent of the response.
        percent: f64,
    },
}

impl Explain for ReactionCurveError {
    fn key(&self) -> &'static str {
        match self {
            Self::Data(error) => error.key(),
            Self::NoStep { .. } => "curve.no_step",
            Self::SeveralSteps { .. } => "curve.several_steps",
            Self::TooShort { .. } => "curve.too_short",
            Self::NoResponse { .. } => "curve.no_response",
            Self::NotAtRestBefore { .. } => "curve.not_at_rest_before",
            Self::NotAtRestAfter { .. } => "curve.not_at_rest_after",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Data(error) => error.args(),
            Self::NoStep { column } => vec![("column", column.clone())],
            Self::SeveralSteps { column, moves } => {
                vec![("column", column.clone()), ("moves", moves.to_string())]
            }
            Self::TooShort { rows, needed } => {
                vec![("rows", rows.to_string()), ("needed", needed.to_string())]
            }
            Self::NoResponse { column, moved, noise } => {
                vec![("column", column.clone()), ("moved", number(*moved)), ("noise", number(*noise))]
            }
            Self::NotAtRestBefore { column, percent } | Self::NotAtRestAfter { column, percent } => {
                vec![("column", column.clone()), ("percent", number(*percent))]
            }
        }
    }
}

impl ReactionCurveError {
    /// Whether the MV makes one step, so that a reaction curve was meant.
    #[must_use]
    pub fn is_one_step(&self) -> bool {
        !matches!(self, Self::Data(_) | Self::NoStep { .. } | Self::SeveralSteps { .. })
    }

    /// One value of every variant, for the test that compares sentences and translations.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        let column = || "LT-103".to_owned();
        vec![
            Self::Data(FitError::TooFewSamples { rows: 7, needed: 10 }),
            Self::NoStep { column: "pump".to_owned() },
            Self::SeveralSteps { column: "pump".to_owned(), moves: 4 },
            Self::TooShort { rows: 3, needed: 10 },
            Self::NoResponse { column: column(), moved: 0.02, noise: 0.05 },
            Self::NotAtRestBefore { column: column(), percent: 12.0 },
            Self::NotAtRestAfter { column: column(), percent: 7.0 },
        ]
    }
}

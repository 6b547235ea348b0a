//! Why a stretch of data cannot be fitted, naming the column and the row.

use crate::explain::{Explain, number};

/// What is wrong with the data of a [`super::FitProblem`] and what to do about it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Columns of different lengths.
    #[error(
        "the columns have different lengths: {time} time stamps, {pv} values of {pv_name}, {mv} of {mv_name}"
    )]
    LengthMismatch {
        /// Rows of the time column.
        time: usize,
        /// Rows of the PV.
        pv: usize,
        /// Rows of the MV.
        mv: usize,
        /// Name of the PV column.
        pv_name: String,
        /// Name of the MV column.
        mv_name: String,
    },
    /// Fewer rows than the model has unknowns to spare.
    #[error("only {rows} rows in this stretch: a fit needs at least {needed}; choose a longer one")]
    TooFewSamples {
        /// Rows given.
        rows: usize,
        /// Rows needed.
        needed: usize,
    },
    /// NaN or ∞ in a column.
    #[error(
        "column {column} holds {} in row {row}: remove the row or choose a stretch without it", number(*.value)
    )]
    NotFinite {
        /// Name of the column.
        column: String,
        /// Row number as the user counts.
        row: usize,
        /// Offending value.
        value: f64,
    },
    /// A time stamp before the one above it.
    #[error(
        "time goes backwards in row {row} of column {column}: from {} s to {} s; choose a stretch that ends before it or starts there",
        number(*.from_s), number(*.to_s)
    )]
    TimeBackwards {
        /// Name of the time column.
        column: String,
        /// Row number as the user counts.
        row: usize,
        /// Time of the row above, in seconds.
        from_s: f64,
        /// Time of the row, in seconds.
        to_s: f64,
    },
    /// All rows carry one time stamp.
    #[error("all rows of column {column} carry the same time: is it the right column?")]
    NoTimeSpan {
        /// Name of the time column.
        column: String,
    },
    /// Values so large or small that their squares are no numbers any more.
    #[error(
        "the values of {column} are as large as {}: choose a unit in which they lie between 1e-100 and 1e100",
        number(*.size)
    )]
    OutOfScale {
        /// Name of the column.
        column: String,
        /// Size of its largest value.
        size: f64,
    },
    /// The MV holds still.
    #[error("{column} does not move in this stretch (it stays at {}): choose one where it does", number(*.value))]
    ConstantMv {
        /// Name of the MV column.
        column: String,
        /// Its only value.
        value: f64,
    },
    /// The PV holds still.
    #[error(
        "{column} does not move in this stretch (it stays at {}): is the sensor frozen, or is it another column?",
        number(*.value)
    )]
    ConstantPv {
        /// Name of the PV column.
        column: String,
        /// Its only value.
        value: f64,
    },
    /// The log starts at the step: the MV holds still but the PV moves.
    #[error(
        "{pv_name} moves while {mv_name} stays at {}: does the log start at the step? Then give the value of {mv_name} before the first row",
        number(*.value)
    )]
    NeedsMvBefore {
        /// Name of the PV column.
        pv_name: String,
        /// Name of the MV column.
        mv_name: String,
        /// The only value of the MV.
        value: f64,
    },
    /// PV and MV are one column.
    #[error("{pv_name} and {mv_name} hold the same values: choose different columns for PV and MV")]
    SameColumn {
        /// Name of the PV column.
        pv_name: String,
        /// Name of the MV column.
        mv_name: String,
    },
    /// An MV before the first row that is no number.
    #[error("the value of {column} before the first row must be a number, not {}", number(*.value))]
    MvBefore {
        /// Name of the MV column.
        column: String,
        /// Offending value.
        value: f64,
    },
    /// No gain can be told from the data, whatever the dynamics.
    #[error(
        "no first-order model can be told from this stretch: {pv_name} does not follow {mv_name} in any way that differs from a start away from rest"
    )]
    NothingToFit {
        /// Name of the PV column.
        pv_name: String,
        /// Name of the MV column.
        mv_name: String,
    },
}

impl Explain for FitError {
    fn key(&self) -> &'static str {
        match self {
            Self::LengthMismatch { .. } => "fit.length_mismatch",
            Self::TooFewSamples { .. } => "fit.too_few_samples",
            Self::NotFinite { .. } => "fit.not_finite",
            Self::TimeBackwards { .. } => "fit.time_backwards",
            Self::NoTimeSpan { .. } => "fit.no_time_span",
            Self::OutOfScale { .. } => "fit.out_of_scale",
            Self::ConstantMv { .. } => "fit.constant_mv",
            Self::ConstantPv { .. } => "fit.constant_pv",
            Self::NeedsMvBefore { .. } => "fit.needs_mv_before",
            Self::SameColumn { .. } => "fit.same_column",
            Self::MvBefore { .. } => "fit.mv_before",
            Self::NothingToFit { .. } => "fit.nothing_to_fit",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::LengthMismatch { time, pv, mv, pv_name, mv_name } => vec![
                ("time", time.to_string()),
                ("pv", pv.to_string()),
                ("mv", mv.to_string()),
                ("pv_name", pv_name.clone()),
                ("mv_name", mv_name.clone()),
            ],
            Self::TooFewSamples { rows, needed } => {
                vec![("rows", rows.to_string()), ("needed", needed.to_string())]
            }
            Self::NotFinite { column, row, value } => {
                vec![("column", column.clone()), ("row", row.to_string()), ("value", number(*value))]
            }
            Self::TimeBackwards { column, row, from_s, to_s } => vec![
                ("column", column.clone()),
                ("row", row.to_string()),
                ("from_s", number(*from_s)),
                ("to_s", number(*to_s)),
            ],
            Self::OutOfScale { column, size } => {
                vec![("column", column.clone()), ("size", number(*size))]
            }
            Self::NoTimeSpan { column } => vec![("column", column.clone())],
            Self::ConstantMv { column, value }
            | Self::ConstantPv { column, value }
            | Self::MvBefore { column, value } => {
                vec![("column", column.clone()), ("value", number(*value))]
            }
            Self::NeedsMvBefore { pv_name, mv_name, value } => {
                vec![("pv_name", pv_name.clone()), ("mv_name", mv_name.clone()), ("value", number(*value))]
            }
            Self::SameColumn { pv_name, mv_name } | Self::NothingToFit { pv_name, mv_name } => {
                vec![("pv_name", pv_name.clone()), ("mv_name", mv_name.clone())]
            }
        }
    }
}

impl FitError {
    /// One value of every variant, for the test that compares sentences and translations.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        let (pv_name, mv_name) = ("LT-103".to_owned(), "pump".to_owned());
        vec![
            Self::LengthMismatch {
                time: 100,
                pv: 99,
                mv: 98,
                pv_name: pv_name.clone(),
                mv_name: mv_name.clone(),
            },
            Self::TooFewSamples { rows: 7, needed: 10 },
            Self::NotFinite { column: pv_name.clone(), row: 12, value: f64::NAN },
            Self::TimeBackwards { column: "time".to_owned(), row: 5, from_s: 4.0, to_s: 1.5 },
            Self::NoTimeSpan { column: "time".to_owned() },
            Self::OutOfScale { column: pv_name.clone(), size: 3e200 },
            Self::ConstantMv { column: mv_name.clone(), value: 2.5 },
            Self::ConstantPv { column: pv_name.clone(), value: 10.0 },
            Self::NeedsMvBefore { pv_name: pv_name.clone(), mv_name: mv_name.clone(), value: 50.0 },
            Self::SameColumn { pv_name: pv_name.clone(), mv_name: mv_name.clone() },
            Self::MvBefore { column: mv_name.clone(), value: f64::INFINITY },
            Self::NothingToFit { pv_name, mv_name },
        ]
    }
}

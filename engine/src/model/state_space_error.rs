//! Why matrices, or samples for a linear model, cannot be used.

use crate::explain::{Explain, number};

/// What is wrong with the parts of a [`super::StateSpace`] or with the samples sent through it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StateSpaceError {
    /// A matrix or a list of the wrong size.
    #[error("{what} has {rows} × {columns} entries and needs {expected_rows} × {expected_columns}")]
    Shape {
        /// A, B, C, D, or the name of the list.
        what: &'static str,
        /// Rows there are.
        rows: usize,
        /// Columns there are.
        columns: usize,
        /// Rows that are needed.
        expected_rows: usize,
        /// Columns that are needed.
        expected_columns: usize,
    },
    /// NaN or ∞ in a matrix or a list.
    #[error("{what} holds a value that is not a finite number")]
    NotFinite {
        /// A, B, C, D, or the name of the list.
        what: &'static str,
    },
    /// A negative or non-finite dead time.
    #[error("the dead time of the input {input} is {} s: it must be 0 or more", number(*.value))]
    Delay {
        /// Name of the input.
        input: String,
        /// Offending value in seconds.
        value: f64,
    },
    /// A time stamp that is not after the one above it.
    #[error("time does not rise at row {row}: from {} s to {} s", number(*.from_s), number(*.to_s))]
    Time {
        /// Row, from 1.
        row: usize,
        /// Time of the row above, in seconds.
        from_s: f64,
        /// Time of the row, in seconds.
        to_s: f64,
    },
    /// An input or output that the model does not have.
    #[error("the model has no {what} number {index}")]
    NoChannel {
        /// `input` or `output`.
        what: &'static str,
        /// Number, from 1.
        index: usize,
    },
}

impl Explain for StateSpaceError {
    fn key(&self) -> &'static str {
        match self {
            Self::Shape { .. } => "state_space.shape",
            Self::NotFinite { .. } => "state_space.not_finite",
            Self::Delay { .. } => "state_space.delay",
            Self::Time { .. } => "state_space.time",
            Self::NoChannel { .. } => "state_space.no_channel",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Shape { what, rows, columns, expected_rows, expected_columns } => vec![
                ("what", (*what).to_owned()),
                ("rows", rows.to_string()),
                ("columns", columns.to_string()),
                ("expected_rows", expected_rows.to_string()),
                ("expected_columns", expected_columns.to_string()),
            ],
            Self::NotFinite { what } => vec![("what", (*what).to_owned())],
            Self::Delay { input, value } => vec![("input", input.clone()), ("value", number(*value))],
            Self::Time { row, from_s, to_s } => {
                vec![("row", row.to_string()), ("from_s", number(*from_s)), ("to_s", number(*to_s))]
            }
            Self::NoChannel { what, index } => {
                vec![("what", (*what).to_owned()), ("index", index.to_string())]
            }
        }
    }
}

impl StateSpaceError {
    /// One of each kind, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        vec![
            Self::Shape { what: "B", rows: 2, columns: 1, expected_rows: 3, expected_columns: 1 },
            Self::NotFinite { what: "A" },
            Self::Delay { input: "BA01".to_owned(), value: -1.0 },
            Self::Time { row: 7, from_s: 3.0, to_s: 2.0 },
            Self::NoChannel { what: "output", index: 4 },
        ]
    }
}

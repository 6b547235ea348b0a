//! Why a rig cannot be fitted to a record.

use crate::explain::{Explain, number};

/// What is wrong with a [`super::GreyBoxProblem`] and what to do about it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GreyBoxError {
    /// A name that is no parameter.
    #[error("there is no parameter {name}; the rig has {known}, and point_2, point_3 … of every curve")]
    UnknownParameter {
        /// Name as given.
        name: String,
        /// Names there are.
        known: String,
    },
    /// Bounds the wrong way round, or no numbers.
    #[error("{name}: the lower bound {} must lie below the upper one, {}", number(*.low), number(*.high))]
    BoundsOrder {
        /// Parameter.
        name: String,
        /// Lower bound.
        low: f64,
        /// Upper bound.
        high: f64,
    },
    /// Bounds beyond what a rig can have.
    #[error(
        "{name}: bounds from {} to {} are not possible; they must lie within {}…{}",
        number(*.low), number(*.high), number(*.least), number(*.most)
    )]
    BoundsPossible {
        /// Parameter.
        name: String,
        /// Lower bound.
        low: f64,
        /// Upper bound.
        high: f64,
        /// Lowest possible value.
        least: f64,
        /// Highest possible value.
        most: f64,
    },
    /// The rig's own value, where the search starts, outside the bounds.
    #[error(
        "{name} is {} in the rig file, outside its bounds {}…{}: widen them or start from another value",
        number(*.value), number(*.low), number(*.high)
    )]
    OutsideBounds {
        /// Parameter.
        name: String,
        /// Value of the rig file.
        value: f64,
        /// Lower bound.
        low: f64,
        /// Upper bound.
        high: f64,
    },
    /// A parameter named twice.
    #[error("{name} is named twice among the parameters to fit")]
    Twice {
        /// Parameter.
        name: String,
    },
    /// No parameter is free.
    #[error(
        "no parameter of this rig is marked for fitting: name them with their bounds in the table [fit] of the rig file, or with --fit"
    )]
    NothingMarked,
    /// A name that is no pump.
    #[error("there is no input {name}; the rig has {known}")]
    UnknownInput {
        /// Name as given.
        name: String,
        /// Pumps there are.
        known: String,
    },
    /// A name that is no level.
    #[error("there is no output {name}; the rig has {known}")]
    UnknownOutput {
        /// Name as given.
        name: String,
        /// Levels there are.
        known: String,
    },
    /// No output at all.
    #[error("no output is named: a fit needs at least one recorded level")]
    NoOutput,
    /// A pump that the outputs depend on without a column.
    #[error("the outputs depend on the pump {pump}: name the column of its input, {signal}=COLUMN")]
    MissingInput {
        /// Tag of the pump.
        pump: String,
        /// Signal of its input.
        signal: String,
    },
    /// A column without a value.
    #[error("the column of the input {name} holds no number")]
    EmptyInput {
        /// Signal of the input.
        name: String,
    },
    /// A column of another length.
    #[error("{name} has {found} values for {rows} time stamps")]
    Length {
        /// Signal.
        name: String,
        /// Its values.
        found: usize,
        /// Time stamps.
        rows: usize,
    },
    /// Fewer rows than unknowns to spare.
    #[error("{name} has only {rows} rows with a value: this fit needs at least {needed}")]
    TooFewRows {
        /// Signal.
        name: String,
        /// Rows with a value.
        rows: usize,
        /// Rows needed.
        needed: usize,
    },
    /// An output that holds still.
    #[error(
        "{name} does not move in this record (it stays at {}): is the sensor frozen, or is it another column?",
        number(*.value)
    )]
    StillOutput {
        /// Signal.
        name: String,
        /// Its only value.
        value: f64,
    },
    /// A time stamp before the one above it.
    #[error("time goes backwards in row {row}: from {} s to {} s", number(*.from_s), number(*.to_s))]
    TimeBackwards {
        /// Row, from 1.
        row: usize,
        /// Time of the row above, in seconds.
        from_s: f64,
        /// Time of the row, in seconds.
        to_s: f64,
    },
    /// All rows carry one time stamp, or one that is no number.
    #[error("the time stamps of the record span no time: is it the right column?")]
    NoTimeSpan,
}

impl Explain for GreyBoxError {
    fn key(&self) -> &'static str {
        match self {
            Self::UnknownParameter { .. } => "grey_box.unknown_parameter",
            Self::BoundsOrder { .. } => "grey_box.bounds_order",
            Self::BoundsPossible { .. } => "grey_box.bounds_possible",
            Self::OutsideBounds { .. } => "grey_box.outside_bounds",
            Self::Twice { .. } => "grey_box.twice",
            Self::NothingMarked => "grey_box.nothing_marked",
            Self::UnknownInput { .. } => "grey_box.unknown_input",
            Self::UnknownOutput { .. } => "grey_box.unknown_output",
            Self::NoOutput => "grey_box.no_output",
            Self::MissingInput { .. } => "grey_box.missing_input",
            Self::EmptyInput { .. } => "grey_box.empty_input",
            Self::Length { .. } => "grey_box.length",
            Self::TooFewRows { .. } => "grey_box.too_few_rows",
            Self::StillOutput { .. } => "grey_box.still_output",
            Self::TimeBackwards { .. } => "grey_box.time_backwards",
            Self::NoTimeSpan => "grey_box.no_time_span",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        let n = |x: &f64| number(*x);
        match self {
            Self::NothingMarked | Self::NoOutput | Self::NoTimeSpan => vec![],
            Self::UnknownParameter { name, known }
            | Self::UnknownInput { name, known }
            | Self::UnknownOutput { name, known } => {
                vec![("name", name.clone()), ("known", known.clone())]
            }
            Self::BoundsOrder { name, low, high } => {
                vec![("name", name.clone()), ("low", n(low)), ("high", n(high))]
            }
            Self::BoundsPossible { name, low, high, least, most } => vec![
                ("name", name.clone()),
                ("low", n(low)),
                ("high", n(high)),
                ("least", n(least)),
                ("most", n(most)),
            ],
            Self::OutsideBounds { name, value, low, high } => {
                vec![("name", name.clone()), ("value", n(value)), ("low", n(low)), ("high", n(high))]
            }
            Self::Twice { name } | Self::EmptyInput { name } => vec![("name", name.clone())],
            Self::MissingInput { pump, signal } => vec![("pump", pump.clone()), ("signal", signal.clone())],
            Self::Length { name, found, rows } => {
                vec![("name", name.clone()), ("found", found.to_string()), ("rows", rows.to_string())]
            }
            Self::TooFewRows { name, rows, needed } => {
                vec![("name", name.clone()), ("rows", rows.to_string()), ("needed", needed.to_string())]
            }
            Self::StillOutput { name, value } => vec![("name", name.clone()), ("value", n(value))],
            Self::TimeBackwards { row, from_s, to_s } => {
                vec![("row", row.to_string()), ("from_s", n(from_s)), ("to_s", n(to_s))]
            }
        }
    }
}

impl GreyBoxError {
    /// One value of every variant, for the test that compares sentences and translations.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        let name = || "FV01.k90".to_owned();
        let signal = || "h3".to_owned();
        vec![
            Self::UnknownParameter { name: "FV01.q".to_owned(), known: name() },
            Self::BoundsOrder { name: name(), low: 3.0, high: 2.0 },
            Self::BoundsPossible { name: name(), low: -1.0, high: 2.0, least: 0.0, most: 1e9 },
            Self::OutsideBounds { name: name(), value: 137.6, low: 1.0, high: 2.0 },
            Self::Twice { name: name() },
            Self::NothingMarked,
            Self::UnknownInput { name: "x".to_owned(), known: "u (BA01)".to_owned() },
            Self::UnknownOutput { name: "x".to_owned(), known: "h3 (TQ3)".to_owned() },
            Self::NoOutput,
            Self::MissingInput { pump: "BA01".to_owned(), signal: "u".to_owned() },
            Self::EmptyInput { name: "u".to_owned() },
            Self::Length { name: signal(), found: 9, rows: 10 },
            Self::TooFewRows { name: signal(), rows: 7, needed: 12 },
            Self::StillOutput { name: signal(), value: 4.2 },
            Self::TimeBackwards { row: 5, from_s: 4.0, to_s: 1.5 },
            Self::NoTimeSpan,
        ]
    }
}

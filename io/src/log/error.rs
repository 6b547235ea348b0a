//! Files that hold no log, and what to do about them.

use vasos_engine::explain::Explain;

/// Why nothing could be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ImportError {
    /// Nothing in the file.
    #[error("the file is empty")]
    Empty,
    /// A format that is known but not text.
    #[error("this is {format}, not a text log: export it as CSV and open that")]
    Foreign {
        /// Name of the format.
        format: &'static str,
    },
    /// Bytes that are no text.
    #[error("this is a binary file, not a text log: export the data as CSV and open that")]
    Binary,
    /// Text without any numbers in columns.
    #[error("no rows of numbers in {lines} lines of text: a log has one row of numbers for each sample")]
    NoNumbers {
        /// Lines looked at.
        lines: usize,
    },
    /// One row of numbers.
    #[error("only one row of numbers (line {line}): a log needs at least two")]
    OneRow {
        /// Its line, counted from 1.
        line: usize,
    },
    /// Nothing but time stamps.
    #[error("{rows} time stamps but no measurement beside them: a log needs at least one more column")]
    OnlyTime {
        /// Rows read.
        rows: usize,
    },
    /// Every row carries the same time.
    #[error(
        "all {rows} rows carry the same time in column '{name}': name another column, or give the sample time"
    )]
    TimeStandsStill {
        /// Column.
        name: String,
        /// Rows read.
        rows: usize,
    },
    /// A time column the user named is not there.
    #[error("there is no column '{name}' to take the time from: the file has {columns}")]
    NoSuchTimeColumn {
        /// Name as typed.
        name: String,
        /// The names there are.
        columns: String,
    },
}

impl Explain for ImportError {
    fn key(&self) -> &'static str {
        match self {
            Self::Empty => "import.empty",
            Self::Foreign { .. } => "import.foreign",
            Self::Binary => "import.binary",
            Self::NoNumbers { .. } => "import.no_numbers",
            Self::OneRow { .. } => "import.one_row",
            Self::OnlyTime { .. } => "import.only_time",
            Self::TimeStandsStill { .. } => "import.time_stands_still",
            Self::NoSuchTimeColumn { .. } => "import.no_such_time_column",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Empty | Self::Binary => Vec::new(),
            Self::Foreign { format } => vec![("format", (*format).to_owned())],
            Self::NoNumbers { lines } => vec![("lines", lines.to_string())],
            Self::OneRow { line } => vec![("line", line.to_string())],
            Self::OnlyTime { rows } => vec![("rows", rows.to_string())],
            Self::TimeStandsStill { name, rows } => {
                vec![("name", name.clone()), ("rows", rows.to_string())]
            }
            Self::NoSuchTimeColumn { name, columns } => {
                vec![("name", name.clone()), ("columns", columns.clone())]
            }
        }
    }
}

impl ImportError {
    /// One value of every variant, for the test that compares sentences and translations.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        vec![
            Self::Empty,
            Self::Foreign { format: "MATLAB" },
            Self::Binary,
            Self::NoNumbers { lines: 12 },
            Self::OneRow { line: 2 },
            Self::OnlyTime { rows: 100 },
            Self::TimeStandsStill { name: "time".to_owned(), rows: 250 },
            Self::NoSuchTimeColumn { name: "tempo".to_owned(), columns: "time, T1".to_owned() },
        ]
    }
}

//! Files that hold no log, and what to do about them.

use vasos_engine::explain::Explain;

/// Why nothing could be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ImportError {
    /// Nothing in the file.
    #[error("the file is empty")]
    Empty,
    /// A format that is known but not text.
    #[error("this is {format}, not a log that can be read: export it as CSV and open that")]
    Foreign {
        /// Name of the format.
        format: &'static str,
    },
    /// Bytes that are no text.
    #[error("this is a binary file, not a text log: export the data as CSV and open that")]
    Binary,
    /// The disk, the network or a packed file gave an error.
    #[error("the file cannot be read: {reason}")]
    Read {
        /// What the system or the format's reader said.
        reason: String,
    },
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
    /// A handful of numbers in one column.
    #[error("{count} numbers in one column and no time beside them: too few for a log")]
    FewNumbers {
        /// How many.
        count: usize,
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
    /// Commas between the fields, and within some of their numbers.
    #[error(
        "the rows from line {line} on have up to {fields} fields under {names} names: their commas part fields and begin decimals, and nothing tells which; export with semicolons or decimal points"
    )]
    CommasInCommas {
        /// First line of data, counted from 1.
        line: usize,
        /// Names above it.
        names: usize,
        /// Most fields of a row.
        fields: usize,
    },
    /// A sheet the user named is not there.
    #[error("there is no sheet '{name}': the workbook has {sheets}")]
    NoSuchSheet {
        /// Name as typed.
        name: String,
        /// The names there are.
        sheets: String,
    },
    /// Files that have no clock in common to be put together by.
    #[error("{file} cannot be joined to {first}: one of them has dates, the other only seconds")]
    NotJoinable {
        /// The file.
        file: String,
        /// The file it was to be joined to.
        first: String,
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
            Self::Read { .. } => "import.read",
            Self::NoNumbers { .. } => "import.no_numbers",
            Self::OneRow { .. } => "import.one_row",
            Self::FewNumbers { .. } => "import.few_numbers",
            Self::OnlyTime { .. } => "import.only_time",
            Self::TimeStandsStill { .. } => "import.time_stands_still",
            Self::CommasInCommas { .. } => "import.commas_in_commas",
            Self::NoSuchSheet { .. } => "import.no_such_sheet",
            Self::NotJoinable { .. } => "import.not_joinable",
            Self::NoSuchTimeColumn { .. } => "import.no_such_time_column",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Empty | Self::Binary => Vec::new(),
            Self::Foreign { format } => vec![("format", (*format).to_owned())],
            Self::Read { reason } => vec![("reason", reason.clone())],
            Self::NoNumbers { lines } => vec![("lines", lines.to_string())],
            Self::OneRow { line } => vec![("line", line.to_string())],
            Self::FewNumbers { count } => vec![("count", count.to_string())],
            Self::OnlyTime { rows } => vec![("rows", rows.to_string())],
            Self::TimeStandsStill { name, rows } => {
                vec![("name", name.clone()), ("rows", rows.to_string())]
            }
            Self::CommasInCommas { line, names, fields } => {
                vec![("line", line.to_string()), ("names", names.to_string()), ("fields", fields.to_string())]
            }
            Self::NoSuchSheet { name, sheets } => vec![("name", name.clone()), ("sheets", sheets.clone())],
            Self::NotJoinable { file, first } => vec![("file", file.clone()), ("first", first.clone())],
            Self::NoSuchTimeColumn { name, columns } => {
                vec![("name", name.clone()), ("columns", columns.clone())]
            }
        }
    }
}

impl From<std::io::Error> for ImportError {
    fn from(error: std::io::Error) -> Self {
        Self::Read { reason: error.to_string() }
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
            Self::Read { reason: "end of file".to_owned() },
            Self::NoNumbers { lines: 12 },
            Self::OneRow { line: 2 },
            Self::FewNumbers { count: 6 },
            Self::OnlyTime { rows: 100 },
            Self::TimeStandsStill { name: "time".to_owned(), rows: 250 },
            Self::CommasInCommas { line: 2, names: 3, fields: 6 },
            Self::NoSuchSheet { name: "Data".to_owned(), sheets: "Notes, Run 1".to_owned() },
            Self::NotJoinable { file: "b.csv".to_owned(), first: "a.csv".to_owned() },
            Self::NoSuchTimeColumn { name: "tempo".to_owned(), columns: "time, T1".to_owned() },
        ]
    }
}

//! How a file was read: its format, what was repaired and where, and the columns proposed.

use serde::Serialize;
use vasos_engine::explain::{Explain, number};

/// Character set of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Encoding {
    /// UTF-8, with or without mark.
    Utf8,
    /// UTF-16 with a byte order mark.
    Utf16,
    /// Latin-1 in its Windows form.
    Windows1252,
    /// Chinese.
    Gb18030,
}

/// What stands between the fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Separator {
    /// `\t`
    Tab,
    /// `;`
    Semicolon,
    /// `,`
    Comma,
    /// `||`
    DoubleBar,
    /// `|`
    Bar,
    /// Any run of blanks.
    Blanks,
}

/// Decimal mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Decimal {
    /// `1.5`
    Point,
    /// `1,5`
    Comma,
}

/// What the time column holds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TimeKind {
    /// Numbers, of so many seconds each.
    Numbers {
        /// Seconds in one unit of the column.
        unit_s: f64,
    },
    /// Dates and times of day.
    Stamps,
    /// Days since 1899-12-30, as spreadsheets count.
    ExcelSerials,
    /// Seconds (or milliseconds) since 1970.
    Epoch,
    /// None: rows were taken to be this far apart.
    Missing {
        /// Sample time used, in seconds.
        sample_time_s: f64,
        /// Whether that was a guess: ask the user.
        assumed: bool,
    },
}

/// Names of the columns proposed for the parts of a loop.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Roles {
    /// Process variable.
    pub pv: Option<String>,
    /// Setpoint.
    pub sp: Option<String>,
    /// Manipulated variable.
    pub mv: Option<String>,
    /// Controller mode.
    pub mode: Option<String>,
}

/// How a file was read.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImportReport {
    /// Character set.
    pub encoding: Encoding,
    /// Separator of the data rows; the header may use another.
    pub separator: Separator,
    /// Decimal mark.
    pub decimal: Decimal,
    /// Line the names come from, counted from 1; absent: the file has none.
    pub header_line: Option<usize>,
    /// First line of data, counted from 1.
    pub first_data_line: usize,
    /// What the time column holds.
    pub time: TimeKind,
    /// Name of the time column.
    pub time_column: Option<String>,
    /// What was repaired.
    pub repairs: Vec<Repair>,
    /// Columns proposed.
    pub roles: Roles,
}

/// Something in the file that was not taken as it stands. Lines are counted from 1.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Repair {
    /// Words or nothing where a number belongs.
    MissingValues {
        /// Column.
        column: String,
        /// How many.
        count: usize,
        /// First line of them.
        line: usize,
        /// What stood there first.
        text: String,
    },
    /// Lines that are no rows of data.
    SkippedLines {
        /// How many.
        count: usize,
        /// First of them.
        line: usize,
    },
    /// Rows with fewer or more fields than the others.
    RaggedRows {
        /// How many.
        count: usize,
        /// First line of them.
        line: usize,
        /// Fields of the other rows.
        fields: usize,
    },
    /// Columns of words that are neither time nor states.
    TextColumn {
        /// Column left out.
        column: String,
    },
    /// Rows without a readable time.
    NoTime {
        /// How many were left out.
        count: usize,
        /// First line of them.
        line: usize,
    },
    /// Rows whose time stamp equals that of the row above.
    DuplicateStamps {
        /// How many were left out.
        count: usize,
        /// First line of them.
        line: usize,
    },
    /// Stamps too coarse for the rows: those of one stamp were spread evenly up to the next.
    SpreadStamps {
        /// Rows that shared a stamp.
        count: usize,
    },
    /// Single rows out of the order of time.
    StrayStamps {
        /// How many were left out.
        count: usize,
        /// First line of them.
        line: usize,
    },
    /// Time jumps back: the file holds several runs, the longest was kept.
    TimeRestart {
        /// Line at which time first jumps back.
        line: usize,
        /// By how many seconds.
        back_s: f64,
        /// First line kept.
        from_line: usize,
        /// Last line kept.
        to_line: usize,
    },
    /// Steps longer than three sample times.
    Gaps {
        /// How many.
        count: usize,
        /// Line after the first.
        line: usize,
        /// The longest, in seconds.
        longest_s: f64,
    },
    /// Dates that read as day/month and as month/day.
    AmbiguousDates,
    /// No time in the file.
    NoTimeColumn {
        /// Sample time taken, in seconds.
        sample_time_s: f64,
    },
}

impl std::fmt::Display for Repair {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::MissingValues { column, count, line, text } => {
                write!(f, "values missing in {column}: {count}, the first in line {line} ('{text}')")
            }
            Self::SkippedLines { count, line } => {
                write!(f, "lines skipped because they are no rows of data: {count}, the first is line {line}")
            }
            Self::RaggedRows { count, line, fields } => {
                write!(
                    f,
                    "rows that do not have {fields} fields like the others: {count}, the first is line {line}"
                )
            }
            Self::TextColumn { column } => write!(f, "column {column} holds words, not numbers: left out"),
            Self::NoTime { count, line } => {
                write!(
                    f,
                    "rows left out because their time cannot be read: {count}, the first is line {line}"
                )
            }
            Self::DuplicateStamps { count, line } => {
                write!(
                    f,
                    "rows left out because they repeat the time of the row above: {count}, the first is line {line}"
                )
            }
            Self::SpreadStamps { count } => {
                write!(
                    f,
                    "rows that share a time stamp with others: {count}; they were spread evenly up to the next stamp"
                )
            }
            Self::StrayStamps { count, line } => {
                write!(
                    f,
                    "rows left out because they are out of the order of time: {count}, the first is line {line}"
                )
            }
            Self::TimeRestart { line, back_s, from_line, to_line } => write!(
                f,
                "time jumps back by {} s in line {line}: the longest run was kept, lines {from_line} to {to_line}",
                number(*back_s)
            ),
            Self::Gaps { count, line, longest_s } => write!(
                f,
                "gaps of more than three sample times: {count}, the first before line {line}, the longest {} s",
                number(*longest_s)
            ),
            Self::AmbiguousDates => {
                write!(f, "the dates read as day/month and as month/day: day/month was taken")
            }
            Self::NoTimeColumn { sample_time_s } => write!(
                f,
                "the file has no time column: rows were taken to be {} s apart; give the sample time",
                number(*sample_time_s)
            ),
        }
    }
}

impl Explain for Repair {
    fn key(&self) -> &'static str {
        match self {
            Self::MissingValues { .. } => "repair.missing_values",
            Self::SkippedLines { .. } => "repair.skipped_lines",
            Self::RaggedRows { .. } => "repair.ragged_rows",
            Self::TextColumn { .. } => "repair.text_column",
            Self::NoTime { .. } => "repair.no_time",
            Self::DuplicateStamps { .. } => "repair.duplicate_stamps",
            Self::SpreadStamps { .. } => "repair.spread_stamps",
            Self::StrayStamps { .. } => "repair.stray_stamps",
            Self::TimeRestart { .. } => "repair.time_restart",
            Self::Gaps { .. } => "repair.gaps",
            Self::AmbiguousDates => "repair.ambiguous_dates",
            Self::NoTimeColumn { .. } => "repair.no_time_column",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::MissingValues { column, count, line, text } => vec![
                ("column", column.clone()),
                ("count", count.to_string()),
                ("line", line.to_string()),
                ("text", text.clone()),
            ],
            Self::RaggedRows { count, line, fields } => {
                vec![("count", count.to_string()), ("line", line.to_string()), ("fields", fields.to_string())]
            }
            Self::TextColumn { column } => vec![("column", column.clone())],
            Self::SkippedLines { count, line }
            | Self::NoTime { count, line }
            | Self::DuplicateStamps { count, line }
            | Self::StrayStamps { count, line } => {
                vec![("count", count.to_string()), ("line", line.to_string())]
            }
            Self::SpreadStamps { count } => vec![("count", count.to_string())],
            Self::TimeRestart { line, back_s, from_line, to_line } => vec![
                ("line", line.to_string()),
                ("back_s", number(*back_s)),
                ("from_line", from_line.to_string()),
                ("to_line", to_line.to_string()),
            ],
            Self::Gaps { count, line, longest_s } => vec![
                ("count", count.to_string()),
                ("line", line.to_string()),
                ("longest_s", number(*longest_s)),
            ],
            Self::AmbiguousDates => Vec::new(),
            Self::NoTimeColumn { sample_time_s } => vec![("sample_time_s", number(*sample_time_s))],
        }
    }
}

impl Repair {
    /// One value of every variant, for the test that compares sentences and translations.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        let column = "LT-103".to_owned();
        vec![
            Self::MissingValues { column: column.clone(), count: 4, line: 17, text: "Bad".to_owned() },
            Self::SkippedLines { count: 2, line: 9 },
            Self::RaggedRows { count: 3, line: 31, fields: 5 },
            Self::TextColumn { column },
            Self::NoTime { count: 6, line: 44 },
            Self::DuplicateStamps { count: 7, line: 52 },
            Self::SpreadStamps { count: 80 },
            Self::StrayStamps { count: 1, line: 68 },
            Self::TimeRestart { line: 74, back_s: 23.7, from_line: 75, to_line: 300 },
            Self::Gaps { count: 8, line: 91, longest_s: 120.0 },
            Self::AmbiguousDates,
            Self::NoTimeColumn { sample_time_s: 1.0 },
        ]
    }
}

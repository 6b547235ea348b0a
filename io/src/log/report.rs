//! How a file was read: its format, what was repaired and where, and the columns proposed.

use serde::Serialize;

use super::Repair;

/// Character set of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Encoding {
    /// UTF-8, with or without mark.
    Utf8,
    /// UTF-16 with a byte order mark.
    Utf16,
    /// UTF-32 with a byte order mark.
    Utf32,
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
    /// Days since the year 0, as MATLAB counts.
    MatlabDays,
    /// Days since noon of 1 January 4713 BC, as astronomers count, or the same less 2,400,000.5.
    JulianDays,
    /// Seconds since 1970 or 1904, or thousandths, millionths or billionths of them; 100 ns since 1601 or the year 1.
    Epoch,
    /// None: rows were taken to be this far apart.
    Missing {
        /// Sample time used, in seconds.
        sample_time_s: f64,
        /// Whether that was a guess: ask the user.
        assumed: bool,
    },
}

/// How a text file is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct TextFormat {
    /// Character set.
    pub encoding: Encoding,
    /// Separator of the data rows; the header may use another.
    pub separator: Separator,
    /// Decimal mark.
    pub decimal: Decimal,
}

/// What a file is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FileFormat {
    /// Text with separators.
    Text(TextFormat),
    /// A workbook of a spreadsheet program.
    Workbook {
        /// Sheet that was read.
        sheet: String,
    },
    /// Parquet.
    Parquet,
    /// A recording of a run.
    Recording,
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

/// One of several files that a log was made of.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JoinedFile {
    /// Its name.
    pub name: String,
    /// Rows it gave.
    pub rows: usize,
    /// What was repaired in it, by its own lines.
    pub repairs: Vec<Repair>,
}

/// How a file was read; of several files joined, how the first was.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImportReport {
    /// What the file is.
    pub format: FileFormat,
    /// Line the names come from, counted from 1; absent: the file has none.
    pub header_line: Option<usize>,
    /// First line of data, counted from 1.
    pub first_data_line: usize,
    /// What the time column holds.
    pub time: TimeKind,
    /// Name of the time column.
    pub time_column: Option<String>,
    /// Seconds the stamps' zone is ahead of UTC, where they have one.
    pub zone_s: Option<f64>,
    /// What was repaired; of several files joined, what joining them took.
    pub repairs: Vec<Repair>,
    /// The files, where several were joined.
    pub files: Vec<JoinedFile>,
    /// Columns proposed.
    pub roles: Roles,
}

impl ImportReport {
    /// How the text is written, where the file is one.
    #[must_use]
    pub fn text(&self) -> Option<TextFormat> {
        match self.format {
            FileFormat::Text(text) => Some(text),
            _ => None,
        }
    }
}

//! A log as plain data: named columns over one time axis, as an importer gives it and a fit takes it.
//!
//! NaN in a column is a missing value; a face picks the rows that are whole with [`LogTable::complete`].

use serde::{Deserialize, Serialize};

/// One column of a log, one value a row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LogColumn {
    /// Name, unique in its table.
    pub name: String,
    /// Unit as the file writes it, without brackets.
    pub unit: Option<String>,
    /// Values; NaN where the file has none.
    pub values: Vec<f64>,
    /// Words of a text column (AUTO, MAN, …): a value is the index of its word. Empty for numbers.
    pub states: Vec<String>,
}

/// Where the time axis of a log begins.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LogStart {
    /// A number of seconds in the file.
    Seconds(f64),
    /// Date and time, ISO 8601 as the file's clock showed them.
    Calendar(String),
    /// The file has no time.
    Unknown,
}

/// A log: columns of N rows over a time axis that starts at 0 and never decreases.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LogTable {
    /// Name of the log, for titles.
    pub name: String,
    /// Time in seconds since the first row.
    pub time_s: Vec<f64>,
    /// What the first row's time was in the file.
    pub start: LogStart,
    /// Columns in the file's order, the time column left out.
    pub columns: Vec<LogColumn>,
    /// Line of the file each row came from, counted from 1.
    pub lines: Vec<u32>,
}

/// Rows of a log in which every chosen column has a value.
#[derive(Debug, Clone, PartialEq)]
pub struct CompleteRows {
    /// Time in seconds since the log's first row.
    pub time_s: Vec<f64>,
    /// The chosen columns, in the order asked for.
    pub columns: Vec<Vec<f64>>,
    /// Rows taken, counted from 0.
    pub taken: Vec<usize>,
    /// Rows left out because a value was missing, counted from 0.
    pub left_out: Vec<usize>,
}

impl CompleteRows {
    /// Values of another column at the rows taken; a missing one holds the last, or the first there is. `None` where
    /// there is none at all.
    #[must_use]
    pub fn held(&self, values: &[f64]) -> Option<Vec<f64>> {
        let mut last = self.taken.iter().map(|&row| values[row]).find(|v| v.is_finite());
        let mut hold = |row: usize| {
            last = Some(values[row]).filter(|v| v.is_finite()).or(last);
            last
        };
        self.taken.iter().map(|&row| hold(row)).collect()
    }

    /// Line of the file that the first row came from, counted from 1.
    #[must_use]
    pub fn first_line(&self, table: &LogTable) -> usize {
        self.taken.first().and_then(|&row| table.lines.get(row)).map_or(1, |line| *line as usize)
    }
}

impl LogTable {
    /// Rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Whether there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// Index of a column by name; exact, else regardless of case.
    #[must_use]
    pub fn index_of(&self, name: &str) -> Option<usize> {
        let same = |c: &LogColumn| c.name.to_lowercase() == name.trim().to_lowercase();
        self.columns.iter().position(|c| c.name == name).or_else(|| self.columns.iter().position(same))
    }

    /// A column by name; exact, else regardless of case.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&LogColumn> {
        self.index_of(name).map(|i| &self.columns[i])
    }

    /// The rows from `from_s` to `to_s` in which every given column holds a finite value.
    #[must_use]
    pub fn complete(&self, columns: &[&[f64]], from_s: f64, to_s: f64) -> CompleteRows {
        let mut rows = CompleteRows {
            time_s: Vec::new(),
            columns: vec![Vec::new(); columns.len()],
            taken: Vec::new(),
            left_out: Vec::new(),
        };
        for (row, &time) in self.time_s.iter().enumerate().filter(|(_, t)| (from_s..=to_s).contains(*t)) {
            if columns.iter().all(|c| c[row].is_finite()) {
                rows.time_s.push(time);
                rows.taken.push(row);
                rows.columns.iter_mut().zip(columns).for_each(|(to, from)| to.push(from[row]));
            } else {
                rows.left_out.push(row);
            }
        }
        rows
    }

    /// The rows ahead of a time, where these columns hold a number.
    #[must_use]
    pub fn ahead(&self, columns: &[&[f64]], start_s: f64) -> CompleteRows {
        let end = self.time_s.partition_point(|t| *t < start_s);
        let last_s = end.checked_sub(1).map_or(f64::NEG_INFINITY, |row| self.time_s[row]);
        self.complete(columns, f64::NEG_INFINITY, last_s)
    }
}

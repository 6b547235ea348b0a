//! Import of plant logs: text as plants write it becomes a [`LogTable`] and a list of what was repaired.
//!
//! Bytes → text (`decode`) → separator, decimal mark, header (`layout`) → columns (`rows`) → time axis (`axis`) →
//! which column is PV, SP, MV (`roles`). An import reads what can be read and says what it left out; only
//! files with nothing to read are refused, with [`ImportError`]. The file itself is never written to.

mod axis;
mod behaviour;
mod decode;
mod error;
mod fingerprint;
mod layout;
mod names;
mod number;
mod report;
mod roles;
mod rows;
mod split;
mod stamp;

use vasos_engine::signal::{LogColumn, LogTable};

pub use error::ImportError;
pub use fingerprint::sha256;
pub use report::{Decimal, Encoding, ImportReport, Repair, Roles, Separator, TimeKind};

/// What the user may say about a file ahead of its import; all of it can be found out.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ImportOptions {
    /// Sample time in seconds, for a file without time; absent: 1 s, and the report says so.
    pub sample_time_s: Option<f64>,
    /// Time column by name, where the proposal is wrong.
    pub time_column: Option<String>,
}

/// A log and how it was read.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedLog {
    /// The data.
    pub table: LogTable,
    /// How it was read, what was repaired and which columns are proposed.
    pub report: ImportReport,
}

/// Reads a text log.
///
/// `name` is the title of the table, usually the file's name. Time comes out in seconds from the first row, never
/// decreasing; missing values as NaN.
///
/// # Errors
/// [`ImportError`] for a file that holds nothing to read, with what to do.
pub fn import_log(name: &str, bytes: &[u8], options: &ImportOptions) -> Result<ImportedLog, ImportError> {
    let (text, encoding) = decode::decode(bytes)?;
    let lines = layout::lines(&text);
    let layout = layout::find(&lines)?;
    let mut repairs = Vec::new();
    let read = rows::read(&lines, &layout, &mut repairs)?;
    let axis = axis::find(&read, options, &mut repairs)?;
    let names = layout.names.clone();
    let kept = axis.keep.as_deref();
    let pick = |values: Vec<f64>| match kept {
        Some(rows) => rows.iter().map(|&r| values[r]).collect(),
        None => values,
    };
    let mut columns = Vec::new();
    for (i, column) in read.columns.into_iter().enumerate() {
        if axis.columns.contains(&i) || column.is_text_only() {
            continue;
        }
        columns.push(LogColumn {
            name: names[i].name.clone(),
            unit: names[i].unit.clone(),
            values: pick(column.values),
            states: column.states,
        });
    }
    if columns.is_empty() {
        return Err(ImportError::OnlyTime { rows: axis.time_s.len() });
    }
    let file_lines = match kept {
        Some(rows) => rows.iter().map(|&r| read.lines[r]).collect(),
        None => read.lines,
    };
    let table = LogTable {
        name: name.to_owned(),
        time_s: axis.time_s,
        start: axis.start,
        columns,
        lines: file_lines,
    };
    let roles = roles::propose(&table);
    let report = ImportReport {
        encoding,
        separator: layout.separator,
        decimal: layout.decimal,
        header_line: layout.header_line,
        first_data_line: layout.first_data_line(&lines),
        time: axis.kind,
        time_column: axis.columns.first().map(|&i| names[i].name.clone()),
        repairs,
        roles,
    };
    Ok(ImportedLog { table, report })
}

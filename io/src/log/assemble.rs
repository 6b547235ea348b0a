//! Columns of any format into a log: layout turned, time axis found, roles proposed.

use vasos_engine::signal::{LogColumn, LogTable};

use super::arrange::arrange;
use super::read::{Kind, Read, ReadColumn};
use super::{
    DateOrder, FileFormat, ImportError, ImportOptions, ImportReport, ImportedLog, Repair, axis, notes, parts,
    quality, roles, stand_ins,
};

/// Of a column with blanks in it, this share and more of them means that only changes were written.
const SPARSE: f64 = 0.5;
/// Fewer numbers in a single nameless column are no log.
const FEWEST_ALONE: usize = 10;

/// What a file is and where in it the data stands.
#[derive(Debug)]
pub(super) struct Source {
    pub format: FileFormat,
    pub header_line: Option<usize>,
    pub first_data_line: usize,
    /// Order of day and month that its dates show for certain.
    pub date_order: Option<DateOrder>,
}

impl Source {
    /// Of a format that has rows and no lines, and no dates that read two ways.
    pub fn of_rows(format: FileFormat) -> Self {
        Self { format, header_line: None, first_data_line: 1, date_order: None }
    }
}

/// Makes the log.
///
/// # Errors
/// [`ImportError::OneRow`] when fewer than two rows have a time, [`ImportError::OnlyTime`] when nothing stands beside it,
/// [`ImportError::FewNumbers`], [`ImportError::NoSuchTimeColumn`].
pub(super) fn assemble(
    name: &str,
    mut read: Read,
    source: Source,
    options: &ImportOptions,
    mut repairs: Vec<Repair>,
) -> Result<ImportedLog, ImportError> {
    if options.time_column.is_none() {
        parts::compose(&mut read);
    }
    let mut read = arrange(read, options, &mut repairs);
    quality::take_out(&mut read, &mut repairs);
    let axis = axis::find(&mut read, options, &mut repairs)?;
    if axis.time_s.len() < 2 {
        return Err(ImportError::OneRow { line: source.first_data_line });
    }
    let time_column = axis.columns.first().map(|&i| read.columns[i].name.clone());
    let mut columns = Vec::new();
    for (i, mut column) in std::mem::take(&mut read.columns).into_iter().enumerate() {
        if axis.columns.contains(&i) {
            continue;
        }
        if column.is_text_only() {
            repairs.push(Repair::TextColumn { column: column.name });
        } else if column.kind.is_stamp() {
            repairs.push(Repair::SpareTime { column: column.name });
        } else {
            stand_ins::take_out(&mut column, &read.lines, &mut repairs);
            columns.push(log_column(column, axis.keep.as_deref(), &axis.time_s, &mut repairs));
        }
    }
    if columns.is_empty() {
        return Err(ImportError::OnlyTime { rows: axis.time_s.len() });
    }
    // With a name above them or a sample time from the user they are taken for what they are said to be.
    let said = source.header_line.is_some() || options.sample_time_s.is_some();
    if columns.len() == 1 && axis.columns.is_empty() && axis.time_s.len() < FEWEST_ALONE && !said {
        return Err(ImportError::FewNumbers { count: axis.time_s.len() });
    }
    let lines = match &axis.keep {
        Some(rows) => rows.iter().map(|&r| read.lines[r as usize]).collect(),
        None => read.lines,
    };
    let table = LogTable { name: name.to_owned(), time_s: axis.time_s, start: axis.start, columns, lines };
    notes::note(&table, &mut repairs);
    let roles = roles::propose(&table);
    let report = ImportReport {
        format: source.format,
        header_line: source.header_line,
        first_data_line: source.first_data_line,
        time: axis.kind,
        time_column,
        zone_s: axis.zone_s,
        repairs,
        files: Vec::new(),
        roles,
    };
    Ok(ImportedLog { table, report })
}

fn log_column(
    mut column: ReadColumn,
    keep: Option<&[u32]>,
    time_s: &[f64],
    repairs: &mut Vec<Repair>,
) -> LogColumn {
    if let Some(rows) = keep {
        column.values = rows.iter().map(|&r| column.values[r as usize]).collect();
    }
    if writes_changes_only(&column, repairs) {
        hold(&mut column, time_s, repairs);
    }
    // Words of a column of numbers are missing values.
    let states = if column.kind == Kind::Words { column.states } else { Vec::new() };
    LogColumn { name: column.name, unit: column.unit, values: column.values, states }
}

/// Whether a column has its blanks spread over it, more of them than values, and nothing unreadable.
fn writes_changes_only(column: &ReadColumn, repairs: &[Repair]) -> bool {
    let blank = column.values.iter().filter(|v| v.is_nan()).count();
    if (blank as f64) < SPARSE * column.values.len() as f64 || blank + 2 > column.values.len() {
        return false;
    }
    let unreadable = |r: &Repair| matches!(r, Repair::MissingValues { column: c, text, .. } if *c == column.name && !text.is_empty());
    if repairs.iter().any(unreadable) {
        return false;
    }
    let runs = column.values.chunk_by(|a, b| a.is_nan() == b.is_nan()).filter(|run| run[0].is_nan());
    let mut lengths: Vec<usize> = runs.map(<[f64]>::len).collect();
    lengths.sort_unstable();
    let (Some(&longest), typical) = (lengths.last(), lengths.get(lengths.len() / 2)) else { return false };
    lengths.len() > 2 && typical.is_some_and(|t| longest <= 10 * t)
}

fn hold(column: &mut ReadColumn, time_s: &[f64], repairs: &mut Vec<Repair>) {
    let (mut last, mut since_s) = (f64::NAN, 0.0);
    let (mut count, mut longest_s) = (0, 0.0_f64);
    for (value, &t) in column.values.iter_mut().zip(time_s) {
        if value.is_finite() {
            (last, since_s) = (*value, t);
        } else if last.is_finite() {
            *value = last;
            count += 1;
            longest_s = longest_s.max(t - since_s);
        }
    }
    repairs.retain(|r| !matches!(r, Repair::MissingValues { column: c, .. } if *c == column.name));
    repairs.push(Repair::HeldValues { column: column.name.clone(), count, longest_s });
}

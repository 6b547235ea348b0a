//! Several logs into one: one behind the other where their columns agree, else side by side by their time.

use vasos_engine::signal::{LogColumn, LogStart, LogTable};

use super::merge::{Point, Series, merge};
use super::order::typical_step;
use super::stamp::{DateOrder, parse as parse_stamp};
use super::{ImportError, ImportedLog, JoinedFile, Repair, roles};

/// Joins logs; one alone stays as it is.
///
/// # Errors
/// [`ImportError::NotJoinable`] for a log with dates beside one without, [`ImportError::Empty`] for none at all.
pub(super) fn join(mut logs: Vec<ImportedLog>) -> Result<ImportedLog, ImportError> {
    if logs.len() < 2 {
        return logs.pop().ok_or(ImportError::Empty);
    }
    let dated = |log: &ImportedLog| matches!(log.table.start, LogStart::Calendar(_));
    if let Some(other) = logs.iter().find(|log| dated(log) != dated(&logs[0])) {
        let (file, first) = (other.table.name.clone(), logs[0].table.name.clone());
        return Err(ImportError::NotJoinable { file, first });
    }
    let is_dated = dated(&logs[0]);
    if is_dated {
        logs.sort_by(|a, b| start_s(a).total_cmp(&start_s(b)));
    }
    let names = |log: &ImportedLog| {
        // Centimetres do not go on in millimetres.
        let named = |c: &LogColumn| (c.name.clone(), c.unit.clone());
        let mut names: Vec<(String, Option<String>)> = log.table.columns.iter().map(named).collect();
        names.sort_unstable();
        names
    };
    let first = names(&logs[0]);
    let same = logs.iter().all(|log| names(log) == first);
    let files = logs.iter().map(|log| JoinedFile {
        name: log.table.name.clone(),
        rows: log.table.len(),
        repairs: log.report.repairs.clone(),
    });
    let files = files.collect();
    let mut repairs = Vec::new();
    let mut report = logs[0].report.clone();
    let title = logs.iter().map(|log| log.table.name.as_str()).collect::<Vec<_>>().join(" + ");
    let mut table = if same { behind(logs, is_dated, &mut repairs) } else { beside(&logs, &mut repairs) };
    table.name = title;
    table.lines = (1..=u32::try_from(table.len()).unwrap_or(u32::MAX)).collect();
    report.roles = roles::propose(&table);
    (report.repairs, report.files) = (repairs, files);
    Ok(ImportedLog { table, report })
}

/// Time of the first row, in seconds of UTC for stamps with a zone.
fn start_s(log: &ImportedLog) -> f64 {
    match &log.table.start {
        LogStart::Calendar(iso) => {
            let local = parse_stamp(iso, DateOrder::DayFirst).map_or(0.0, super::stamp::Stamp::seconds);
            local - log.report.zone_s.unwrap_or(0.0)
        }
        LogStart::Seconds(s) => *s,
        LogStart::Unknown => 0.0,
    }
}

fn behind(logs: Vec<ImportedLog>, dated: bool, repairs: &mut Vec<Repair>) -> LogTable {
    let mut logs = logs.into_iter();
    let Some(first) = logs.next() else { return empty() };
    let origin_s = start_s(&first);
    let step_s = typical_step(&first.table.time_s).unwrap_or(1.0);
    let mut table = first.table;
    for log in logs {
        let end_s = table.time_s.last().copied().unwrap_or(0.0);
        let mut offset_s = start_s(&log) - origin_s;
        let file = log.table.name.clone();
        // Two runs that both count from nought tell nothing of the time between them.
        if !dated && offset_s <= end_s {
            offset_s = end_s + step_s;
            repairs.push(Repair::Appended { file: file.clone(), step_s });
        }
        let overlap = log.table.time_s.partition_point(|t| t + offset_s <= end_s);
        if overlap > 0 {
            let length_s = log.table.time_s[overlap - 1] - log.table.time_s[0];
            repairs.push(Repair::Overlap { file: file.clone(), count: overlap, length_s });
        }
        let rows = log.table.len() - overlap;
        repairs.push(Repair::FileJoined { file, line: table.len() + 1, rows });
        table.time_s.extend(log.table.time_s[overlap..].iter().map(|t| t + offset_s));
        for column in &mut table.columns {
            if let Some(from) = log.table.columns.iter().find(|c| c.name == column.name) {
                append(column, from, overlap);
            }
        }
    }
    table
}

/// Values behind a column's own; words keep their meaning.
fn append(column: &mut LogColumn, from: &LogColumn, skip: usize) {
    if column.states == from.states {
        column.values.extend_from_slice(&from.values[skip..]);
        return;
    }
    let place = from.states.iter().map(|state| {
        column.states.iter().position(|s| s == state).unwrap_or_else(|| {
            column.states.push(state.clone());
            column.states.len() - 1
        }) as f64
    });
    let place: Vec<f64> = place.collect();
    let meaning = |v: &f64| place.get(*v as usize).copied().filter(|_| v.is_finite()).unwrap_or(f64::NAN);
    column.values.extend(from.values[skip..].iter().map(meaning));
}

fn beside(logs: &[ImportedLog], repairs: &mut Vec<Repair>) -> LogTable {
    let mut series: Vec<Series> = Vec::new();
    for (k, log) in logs.iter().enumerate() {
        let offset_s = start_s(log);
        for column in &log.table.columns {
            let points = log.table.time_s.iter().zip(&column.values).zip(&log.table.lines);
            let points =
                points.map(|((t, &value), &line)| Point { time_s: t + offset_s, value, line }).collect();
            let taken = series.iter().any(|s| s.name == column.name);
            let name =
                if taken { format!("{} ({})", column.name, log.table.name) } else { column.name.clone() };
            series.push(Series { name, unit: column.unit.clone(), states: column.states.clone(), points });
        }
        if k > 0 {
            let (file, columns) = (log.table.name.clone(), log.table.columns.len());
            repairs.push(Repair::FileMerged { file, columns });
        }
    }
    let mut merged = merge(&mut series, repairs);
    let first_s = merged.time_s.first().copied().unwrap_or(0.0);
    merged.time_s.iter_mut().for_each(|t| *t -= first_s);
    let columns = series.into_iter().zip(merged.columns).map(|(s, values)| LogColumn {
        name: s.name,
        unit: s.unit,
        values,
        states: s.states,
    });
    let start = logs.iter().min_by(|a, b| start_s(a).total_cmp(&start_s(b)));
    let start = start.map_or(LogStart::Unknown, |log| log.table.start.clone());
    LogTable {
        name: String::new(),
        time_s: merged.time_s,
        start,
        columns: columns.collect(),
        lines: merged.lines,
    }
}

fn empty() -> LogTable {
    LogTable {
        name: String::new(),
        time_s: Vec::new(),
        start: LogStart::Unknown,
        columns: Vec::new(),
        lines: Vec::new(),
    }
}

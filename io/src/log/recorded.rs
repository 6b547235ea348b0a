//! A run out of a recording of one's own.

use std::path::Path;

use super::assemble::Source;
use super::merge::{Point, Series, merge};
use super::read::{Kind, Read, ReadColumn};
use super::{FileFormat, ImportError, Repair};
use crate::export::mode_columns;
use crate::recording::{Parts, Recorded, RecordedColumn, RecordingError, read_columns, read_recorded};
use vasos_engine::session::RecordedRun;

/// Names of the values of a loop's component, in their order.
const LOOP: [(&str, Option<&str>); 3] = [("sp", Some("cm")), ("pv", Some("cm")), ("mv", None)];

/// Whether a file begins like a recording.
pub(super) fn is_recording(start: &[u8]) -> bool {
    start.starts_with(b"RRF")
}

/// Reads the longest run of a recording: its columns under their own names where it is of a rig, else by the entities
/// that hold them.
///
/// # Errors
/// [`ImportError::Read`] for a recording that cannot be read or has no numbers in it.
pub(super) fn read_run(path: &Path, repairs: &mut Vec<Repair>) -> Result<(Read, Source), ImportError> {
    let recorded = read_recorded(&Parts::of(path));
    if let Err(error @ RecordingError::Nothing { .. }) = &recorded {
        return Err(ImportError::Read { reason: error.to_string() });
    }
    if let Ok(Recorded { runs, flaws, .. }) = recorded
        && let Some(run) = runs.iter().max_by_key(|run| run.len())
    {
        repairs.extend(flaws.into_iter().map(|flaw| Repair::Recording { flaw }));
        if runs.len() > 1 {
            repairs.push(Repair::OtherRuns { run: run.name.clone(), others: runs.len() - 1 });
        }
        return Ok(read_rows(run));
    }
    let (all, flaw) = read_columns(path).map_err(|error| ImportError::Read { reason: error.to_string() })?;
    repairs.extend(flaw.map(|flaw| Repair::Recording { flaw }));
    let numeric = |c: &&RecordedColumn| c.values.iter().any(|v| !v.is_empty());
    let mut runs: Vec<&str> = all.iter().filter(numeric).map(|c| c.recording.as_str()).collect();
    runs.sort_unstable();
    runs.dedup();
    let length = |run: &&str| all.iter().filter(|c| c.recording == **run).map(|c| c.time_s.len()).max();
    let none = || ImportError::Read { reason: "the recording holds no numbers".to_owned() };
    let run = runs.iter().copied().max_by_key(length).ok_or_else(none)?;
    if runs.len() > 1 {
        repairs.push(Repair::OtherRuns { run: run.to_owned(), others: runs.len() - 1 });
    }
    let mut series: Vec<Series> =
        all.iter().filter(|c| c.recording == run).filter(numeric).flat_map(signals).collect();
    let merged = merge(&mut series, repairs);
    let unit = Some("s".to_owned());
    let mut columns = vec![ReadColumn::new("time".to_owned(), unit, Kind::Number, merged.time_s)];
    columns.extend(
        series
            .into_iter()
            .zip(merged.columns)
            .map(|(s, values)| ReadColumn::new(s.name, s.unit, Kind::Number, values)),
    );
    let lines = (1..=columns[0].values.len() as u32).collect();
    let source = Source::of_rows(FileFormat::Recording);
    Ok((Read { columns, lines, stated_sample_time_s: None }, source))
}

fn read_rows(run: &RecordedRun) -> (Read, Source) {
    let column = |name: String, unit: &str, values: Vec<f64>| {
        let unit = Some(unit.to_owned()).filter(|unit| !unit.is_empty());
        ReadColumn::new(name, unit, Kind::Number, values)
    };
    let mut columns = vec![column("time".to_owned(), "s", run.rows.time_s.clone())];
    for (index, channel) in run.channels().channels.iter().enumerate() {
        columns.push(column(channel.name.clone(), channel.unit, run.rows.column(index).collect()));
    }
    for (name, words) in mode_columns(run) {
        let mut column = ReadColumn::new(name, None, Kind::Words, vec![]);
        // A word of a slot without a loop is a value that does not exist.
        let mut state = |word: &str| if word.is_empty() { None } else { column.state(word) };
        column.values = words.iter().map(|word| state(word).map_or(f64::NAN, f64::from)).collect();
        columns.push(column);
    }
    let lines = (1..=run.len() as u32).collect();
    let source = Source::of_rows(FileFormat::Recording);
    (Read { columns, lines, stated_sample_time_s: None }, source)
}

/// The values of a component, a signal each.
fn signals(column: &RecordedColumn) -> Vec<Series> {
    let count = column.values.iter().map(Vec::len).max().unwrap_or(0);
    let is_loop = column.component.starts_with("loop_");
    let name = |i: usize| {
        let entity = column.entity.trim_start_matches('/');
        match LOOP.get(i).filter(|_| is_loop) {
            Some((part, unit)) => (format!("{}.{part}", column.component), unit.map(str::to_owned)),
            None if column.component == "levels" => (format!("levels.{}", i + 1), Some("cm".to_owned())),
            None if column.component == "flows" => (format!("flows.{}", i + 1), None),
            None if count == 1 => (entity.to_owned(), None),
            None => (format!("{entity}.{}", i + 1), None),
        }
    };
    let one = |i: usize| {
        let (name, unit) = name(i);
        let points = column.time_s.iter().zip(&column.values).enumerate().map(|(row, (&time_s, values))| {
            Point { time_s, value: values.get(i).copied().unwrap_or(f64::NAN), line: row as u32 + 1 }
        });
        Series { name, unit, states: Vec::new(), points: points.collect() }
    };
    (0..count).map(one).collect()
}

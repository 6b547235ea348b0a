//! Runs as CSV or Parquet, by the ending of the file's name.
//!
//! [`write_run`] writes the columns of `vasos simulate`: `time_s`, `sp`, `pv`, `mv`, and signals with their unit
//! (`h1_cm`). [`write_columns`] adds the unit to the first three as well (`pv_cm`): there is no scenario beside them
//! that says it. In Parquet every column has its unit as metadata `unit` too. Full precision; a value that does not
//! exist is an empty cell, or null. [`write_recorded`] adds the mode of each loop as `mode`: MAN, AUTO or CAS.

use std::collections::HashMap;
use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::file::properties::WriterProperties;
use rerun::external::arrow::array::{ArrayRef, Float64Array, RecordBatch, StringArray};
use rerun::external::arrow::datatypes::{DataType, Field, Schema};
use vasos_engine::control::Mode;
use vasos_engine::session::RecordedRun;
use vasos_engine::signal::{Channel, ChannelSet};
use vasos_engine::sim::Run;

use crate::rig::FileError;

/// Rows of Parquet written at once.
const BATCH: usize = 65_536;
/// Metadata of a Parquet column that names its unit.
pub const UNIT: &str = "unit";

/// Columns to write.
struct Columns<'a> {
    /// Name and unit.
    heads: Vec<(String, &'a str)>,
    time_s: &'a [f64],
    value: &'a dyn Fn(usize, usize) -> f64,
    /// Name and word of each row, of columns behind the numbers.
    words: Vec<(String, Vec<&'static str>)>,
}

/// Writes a run under the names of `vasos simulate`; the name ends in `.csv` or `.parquet`.
///
/// # Errors
/// [`FileError::Write`], also for another ending.
pub fn write_run(run: &Run, path: &Path) -> Result<(), FileError> {
    let width = run.channels.len();
    let heads = run.channels.channels.iter().map(|c| (c.name.clone(), c.unit)).collect();
    let value = |row: usize, column: usize| run.values[row * width + column];
    write(&Columns { heads, time_s: &run.time_s, value: &value, words: vec![] }, path)
}

/// Writes the rows of a recording, every name with its unit, and the modes of its loops.
///
/// # Errors
/// As [`write_run`].
pub fn write_recorded(run: &RecordedRun, path: &Path) -> Result<(), FileError> {
    let rows = &run.rows;
    let width = rows.channels.len();
    let value = |row: usize, column: usize| rows.values[row * width + column];
    let words = mode_columns(run);
    write(&Columns { heads: heads(&rows.channels), time_s: &rows.time_s, value: &value, words }, path)
}

/// Name and words of the modes of each loop slot of a recording; an empty word while a slot has no loop.
#[must_use]
pub fn mode_columns(run: &RecordedRun) -> Vec<(String, Vec<&'static str>)> {
    let modes = run.modes();
    let several = modes.len() > 1;
    let name = |slot: usize| if several { format!("mode{}", slot + 1) } else { "mode".to_owned() };
    let words =
        |modes: Vec<Option<Mode>>| modes.into_iter().map(|mode| mode.map_or("", Mode::word)).collect();
    modes.into_iter().enumerate().map(|(slot, modes)| (name(slot), words(modes))).collect()
}

/// Writes columns with names that end in their units; each has a value for every time.
///
/// # Errors
/// As [`write_run`].
pub fn write_columns(
    channels: &ChannelSet,
    time_s: &[f64],
    columns: &[&[f64]],
    path: &Path,
) -> Result<(), FileError> {
    let value = |row: usize, column: usize| columns[column][row];
    write(&Columns { heads: heads(channels), time_s, value: &value, words: vec![] }, path)
}

/// Names with units, and the units.
fn heads(channels: &ChannelSet) -> Vec<(String, &str)> {
    channels.channels.iter().map(|channel| (with_unit(channel), channel.unit)).collect()
}

/// A channel's name with its unit at the end, where it has none there yet.
#[must_use]
pub fn with_unit(channel: &Channel) -> String {
    let suffix = match channel.unit {
        "V" => "v",
        "%" => "percent",
        "cm³/s" => "cm3_s",
        "°" => "deg",
        other => other,
    };
    if suffix.is_empty() || channel.name.ends_with(&format!("_{suffix}")) {
        channel.name.clone()
    } else {
        format!("{}_{suffix}", channel.name)
    }
}

fn write(columns: &Columns, path: &Path) -> Result<(), FileError> {
    let failed = |reason: String| FileError::Write { path: path.display().to_string(), reason };
    let mut beside = path.as_os_str().to_owned();
    beside.push(".writing");
    let beside = Path::new(&beside);
    let written = match path.extension().map(|e| e.to_string_lossy().to_lowercase()).as_deref() {
        Some("csv") => write_csv(columns, beside).map_err(|error| error.to_string()),
        Some("parquet") => write_parquet(columns, beside).map_err(|error| error.to_string()),
        _ => return Err(failed("the name must end in .csv or .parquet".to_owned())),
    };
    // A disk that is full must not cost the file that was there.
    let placed = written.and_then(|()| std::fs::rename(beside, path).map_err(|error| error.to_string()));
    placed.map_err(|reason| {
        drop(std::fs::remove_file(beside));
        failed(reason)
    })
}

/// Sample times are multiples of the sample time; nine decimals hide the rounding of the product.
fn shown_time(time_s: f64) -> f64 {
    (time_s * 1e9).round() / 1e9
}

fn write_csv(columns: &Columns, path: &Path) -> csv::Result<()> {
    let mut writer = csv::Writer::from_path(path)?;
    let names = columns.heads.iter().map(|h| &h.0).chain(columns.words.iter().map(|w| &w.0));
    writer.write_record(std::iter::once("time_s").chain(names.map(String::as_str)))?;
    let cell = |v: f64| if v.is_nan() { String::new() } else { format!("{v}") };
    for (row, &time_s) in columns.time_s.iter().enumerate() {
        let time = format!("{}", shown_time(time_s));
        let values = (0..columns.heads.len()).map(|column| cell((columns.value)(row, column)));
        let words = columns.words.iter().map(|(_, words)| words[row].to_owned());
        writer.write_record(std::iter::once(time).chain(values).chain(words))?;
    }
    Ok(writer.flush()?)
}

fn write_parquet(columns: &Columns, path: &Path) -> parquet::errors::Result<()> {
    let heads = std::iter::once(("time_s".to_owned(), "s")).chain(columns.heads.iter().cloned());
    let field = |(name, unit): (String, &str)| {
        let unit = HashMap::from([(UNIT.to_owned(), unit.to_owned())]);
        Field::new(name, DataType::Float64, true).with_metadata(unit)
    };
    let word_field = |(name, _): &(String, _)| Field::new(name, DataType::Utf8, true);
    let fields = heads.map(field).chain(columns.words.iter().map(word_field));
    let schema = Arc::new(Schema::new(fields.collect::<Vec<_>>()));
    let properties = WriterProperties::builder().set_compression(Compression::ZSTD(ZstdLevel::default()));
    let mut writer = ArrowWriter::try_new(File::create(path)?, schema.clone(), Some(properties.build()))?;
    let rows = columns.time_s.len();
    for from in (0..rows).step_by(BATCH) {
        let batch = from..(from + BATCH).min(rows);
        let times = batch.clone().map(|row| shown_time(columns.time_s[row]));
        let mut arrays: Vec<ArrayRef> = vec![Arc::new(Float64Array::from_iter_values(times))];
        for column in 0..columns.heads.len() {
            let values = batch.clone().map(|row| Some((columns.value)(row, column)).filter(|v| !v.is_nan()));
            arrays.push(Arc::new(values.collect::<Float64Array>()));
        }
        for (_, words) in &columns.words {
            let words = words[batch.clone()].iter().map(|word| Some(*word).filter(|word| !word.is_empty()));
            arrays.push(Arc::new(words.collect::<StringArray>()));
        }
        writer.write(&RecordBatch::try_new(schema.clone(), arrays)?)?;
    }
    writer.close().map(drop)
}

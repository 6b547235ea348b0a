//! Parquet files, batch by batch.

use std::fs::File;

use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use rerun::external::arrow::array::{Array, ArrayRef, AsArray};
use rerun::external::arrow::compute::cast;
use rerun::external::arrow::datatypes::{DataType, Field, Float64Type, Int64Type, TimeUnit};

use super::assemble::Source;
use super::read::{Kind, Read, ReadColumn};
use super::stamp::{DAY_S, DateOrder, Stamp, parse as parse_stamp};
use super::{Decimal, FileFormat, ImportError, Repair, number};

/// Rows decoded at once.
const BATCH: usize = 16_384;
/// Name under which pandas writes an index that has none.
const UNNAMED_INDEX: &str = "__index_level_0__";

/// Whether a file begins like Parquet.
pub(super) fn is_parquet(start: &[u8]) -> bool {
    start.starts_with(b"PAR1")
}

/// How the values of a column come to numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Route {
    Number,
    /// Whole numbers of so many seconds each, as time of the kind.
    Ticks(Kind, f64),
    Flag,
    Text,
}

/// Reads all columns that are numbers, times, flags or text.
///
/// # Errors
/// [`ImportError::Read`] for a damaged file, [`ImportError::OneRow`] for one without rows.
pub(super) fn read_parquet(file: File, repairs: &mut Vec<Repair>) -> Result<(Read, Source), ImportError> {
    let unreadable = |error: &dyn std::error::Error| ImportError::Read { reason: error.to_string() };
    let builder = ParquetRecordBatchReaderBuilder::try_new(file).map_err(|e| unreadable(&e))?;
    let rows = usize::try_from(builder.metadata().file_metadata().num_rows()).unwrap_or(0);
    let schema = builder.schema().clone();
    let mut columns = Vec::new();
    for (at, field) in schema.fields().iter().enumerate() {
        match route(field.data_type()) {
            Some(route) => columns.push((at, route, column(field, route, rows))),
            None => repairs.push(Repair::TextColumn { column: field.name().clone() }),
        }
    }
    let batches = builder.with_batch_size(BATCH).build().map_err(|e| unreadable(&e))?;
    let mut missing = vec![(0, 0); columns.len()];
    for batch in batches {
        let batch = batch.map_err(|e| unreadable(&e))?;
        for ((at, route, column), missing) in columns.iter_mut().zip(&mut missing) {
            let before = column.values.len();
            append(column, *route, batch.column(*at)).map_err(|e| unreadable(&e))?;
            for (row, value) in column.values.iter().enumerate().skip(before) {
                if value.is_nan() {
                    missing.1 = if missing.0 == 0 { row + 1 } else { missing.1 };
                    missing.0 += 1;
                }
            }
        }
    }
    let count = columns.first().map_or(0, |(_, _, c)| c.values.len());
    if count < 2 {
        return Err(ImportError::OneRow { line: count });
    }
    for ((_, _, column), (count, line)) in columns.iter().zip(missing).filter(|(_, m)| m.0 > 0) {
        let column = column.name.clone();
        repairs.push(Repair::MissingValues { column, count, line, text: String::new() });
    }
    let columns = columns.into_iter().map(|(_, _, column)| column).collect();
    let lines = (1..=u32::try_from(count).unwrap_or(u32::MAX)).collect();
    let source = Source::of_rows(FileFormat::Parquet);
    Ok((Read { columns, lines, stated_sample_time_s: None }, source))
}

fn unit_s(unit: TimeUnit) -> f64 {
    match unit {
        TimeUnit::Second => 1.0,
        TimeUnit::Millisecond => 1e-3,
        TimeUnit::Microsecond => 1e-6,
        TimeUnit::Nanosecond => 1e-9,
    }
}

fn route(kind: &DataType) -> Option<Route> {
    Some(match kind {
        DataType::Timestamp(unit, _) => Route::Ticks(Kind::Full, unit_s(*unit)),
        DataType::Date32 | DataType::Date64 => Route::Ticks(Kind::Date, DAY_S),
        DataType::Time32(unit) | DataType::Time64(unit) => Route::Ticks(Kind::Clock, unit_s(*unit)),
        DataType::Duration(unit) => Route::Ticks(Kind::Number, unit_s(*unit)),
        DataType::Boolean => Route::Flag,
        DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View => Route::Text,
        DataType::Dictionary(_, value) => {
            route(value).filter(|r| matches!(r, Route::Text | Route::Number))?
        }
        number if number.is_numeric() => Route::Number,
        _ => return None,
    })
}

fn column(field: &Field, route: Route, rows: usize) -> ReadColumn {
    let kind = match route {
        Route::Number => Kind::Number,
        Route::Ticks(kind, _) => kind,
        // Text is one of words until its first value says otherwise.
        Route::Flag | Route::Text => Kind::Words,
    };
    let name = if field.name() == UNNAMED_INDEX { "index" } else { field.name() };
    let unit = ["unit", "units"].iter().find_map(|key| field.metadata().get(*key)).cloned();
    let mut column = ReadColumn::new(name.to_owned(), unit, kind, Vec::with_capacity(rows));
    if let DataType::Timestamp(_, Some(zone)) = field.data_type() {
        // The values are in UTC, whatever zone they are to be shown in.
        let shown = format!("2000-01-01T00:00:00{zone}");
        column.zone_s = match parse_stamp(&shown, DateOrder::DayFirst) {
            Some(Stamp::Full { zone_s: Some(zone_s), .. }) => Some(zone_s),
            _ => Some(0.0),
        };
    }
    if route == Route::Ticks(Kind::Number, 1.0) || matches!(field.data_type(), DataType::Duration(_)) {
        column.unit = Some("s".to_owned());
    }
    column
}

fn append(
    column: &mut ReadColumn,
    route: Route,
    array: &ArrayRef,
) -> Result<(), rerun::external::arrow::error::ArrowError> {
    match route {
        Route::Number => {
            let numbers = cast(array, &DataType::Float64)?;
            let numbers = numbers.as_primitive::<Float64Type>();
            let finite = |v: Option<f64>| v.filter(|v| v.is_finite()).unwrap_or(f64::NAN);
            column.values.extend(numbers.iter().map(finite));
        }
        Route::Ticks(_, tick_s) => {
            let is_days = matches!(array.data_type(), DataType::Date32 | DataType::Date64);
            let array = if is_days { cast(array, &DataType::Date32)? } else { array.clone() };
            // Of 32 bits, days and times of day have no way to 64 but their own width.
            let ticks = match array.data_type() {
                DataType::Date32 | DataType::Time32(_) => {
                    cast(&cast(&array, &DataType::Int32)?, &DataType::Int64)?
                }
                _ => cast(&array, &DataType::Int64)?,
            };
            let ticks = ticks.as_primitive::<Int64Type>();
            column.values.extend(ticks.iter().map(|v| v.map_or(f64::NAN, |v| v as f64 * tick_s)));
        }
        Route::Flag => {
            let flags = array.as_boolean();
            for flag in flags.iter() {
                let state = flag.and_then(|f| column.state(if f { "true" } else { "false" }));
                column.values.push(state.map_or(f64::NAN, f64::from));
            }
        }
        Route::Text => {
            let words = cast(array, &DataType::Utf8)?;
            for word in words.as_string::<i32>().iter() {
                let value = word.map(str::trim).filter(|w| !w.is_empty()).and_then(|w| text_value(column, w));
                column.values.push(value.unwrap_or(f64::NAN));
            }
        }
    }
    Ok(())
}

/// Text as what its column holds by its first value: stamps, numbers or words.
fn text_value(column: &mut ReadColumn, word: &str) -> Option<f64> {
    let stamp = || parse_stamp(word, DateOrder::DayFirst);
    if column.kind == Kind::Words && column.states.is_empty() {
        if number::parse(word, Decimal::Point).is_some() {
            column.kind = Kind::Number;
        } else if let Some(first) = stamp() {
            column.kind = match first {
                Stamp::Full { zone_s, .. } => {
                    column.zone_s = zone_s;
                    Kind::Full
                }
                Stamp::Date(_) => Kind::Date,
                Stamp::Clock(_) => Kind::Clock,
            };
        }
    }
    match column.kind {
        Kind::Number => number::parse(word, Decimal::Point),
        Kind::Words => column.state(word).map(f64::from),
        _ => stamp().map(Stamp::seconds),
    }
}
